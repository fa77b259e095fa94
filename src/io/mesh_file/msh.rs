//! Gmsh meshes, versions 2.2 (text) and 4.1 (text and binary). Nothing is dropped without a word: what cannot be right
//! is refused with its place, and what is not computed on is noted.

mod binary;
mod groups;
mod section;
mod stream;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::DVec3;

use super::place::{ElementName, FilePlace};
use super::sets::check_count;
use super::soup::Soup;
use super::tetrahedra::{FileTetrahedra, bounded};
use super::words::{listed, number, whole};
use crate::mesh::volume::Tetrahedron;
use crate::plain::{lines_before, quote};
use binary::{BinarySection, Bytes, pieces};
use groups::PhysicalGroups;
use section::{MshSection, RecordWords, Sections};
use stream::{Stream, TextRecords};

/// What an element is, its corners coming first among its nodes.
#[derive(Clone, Copy, PartialEq)]
enum ElementShape {
    /// Points and lines: outlines of the part, which carry nothing.
    Outline,
    Triangle,
    Quadrangle,
    Tetrahedron,
    Other(&'static str),
}

/// A kind of element.
#[derive(Clone, Copy)]
struct MshElementKind {
    dimension: u64,
    nodes: usize,
    shape: ElementShape,
}

/// Elements by Gmsh's numbers of their kinds.
fn kind(number: u64) -> Option<MshElementKind> {
    let (dimension, nodes, shape) = match number {
        15 => (0, 1, ElementShape::Outline),
        1 => (1, 2, ElementShape::Outline),
        8 => (1, 3, ElementShape::Outline),
        26 => (1, 4, ElementShape::Outline),
        2 => (2, 3, ElementShape::Triangle),
        9 => (2, 6, ElementShape::Triangle),
        3 => (2, 4, ElementShape::Quadrangle),
        10 => (2, 9, ElementShape::Quadrangle),
        16 => (2, 8, ElementShape::Quadrangle),
        4 => (3, 4, ElementShape::Tetrahedron),
        11 => (3, 10, ElementShape::Tetrahedron),
        29 => (3, 20, ElementShape::Other("tetrahedron of 20 nodes")),
        5 => (3, 8, ElementShape::Other("hexahedron")),
        12 => (3, 27, ElementShape::Other("hexahedron")),
        17 => (3, 20, ElementShape::Other("hexahedron")),
        6 => (3, 6, ElementShape::Other("prism")),
        13 => (3, 18, ElementShape::Other("prism")),
        18 => (3, 15, ElementShape::Other("prism")),
        7 => (3, 5, ElementShape::Other("pyramid")),
        14 => (3, 14, ElementShape::Other("pyramid")),
        19 => (3, 13, ElementShape::Other("pyramid")),
        _ => return None,
    };
    Some(MshElementKind {
        dimension,
        nodes,
        shape,
    })
}

/// Sections that change nothing about the mesh.
const SILENT: [&str; 1] = ["Comments"];

/// Reads a mesh.
///
/// # Errors
/// A message naming the place.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let version = version(bytes)?;
    if version == Version::FourthBinary {
        return read_binary(bytes);
    }
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<&str> = text.lines().collect();
    let mut sections = Sections::of(&lines)?;
    let mut reader = MshReader::default();
    sections.take("MeshFormat")?;
    let (nodes, elements) = (sections.take("Nodes")?, sections.take("Elements")?);
    if let Some(mut names) = sections.take_any("PhysicalNames")? {
        let records = std::iter::from_fn(|| names.following());
        reader.groups.read_names(records)?;
    }
    let entities = sections.take_any("Entities")?;
    if version == Version::Fourth {
        if let Some(entities) = entities {
            reader.groups.read_entities(TextRecords::of(entities))?;
        }
        reader.nodes_of_fourth(TextRecords::of(nodes))?;
        reader.elements_of_fourth(TextRecords::of(elements))?;
    } else {
        reader.nodes_of_second(nodes)?;
        reader.elements_of_second(elements)?;
    }
    reader.note_sections(sections.rest());
    reader.finish()
}

/// Reads a binary mesh of version 4.1.
fn read_binary(bytes: &[u8]) -> Result<Soup, String> {
    let mut pieces = pieces(bytes)?;
    let mut take = |name: &str| -> Result<Option<BinarySection>, String> {
        let Some(at) = pieces.iter().position(|piece| piece.name == name) else {
            return Ok(None);
        };
        let piece = pieces.remove(at);
        match pieces.iter().find(|piece| piece.name == name) {
            None => Ok(Some(piece)),
            Some(second) => Err(format!(
                "byte {}: ${name} is there a second time: write one mesh into a file",
                second.begins
            )),
        }
    };
    let missing =
        |name: &str| format!("the section ${name} is missing: the file was cut or is damaged");
    let format = take("MeshFormat")?.ok_or_else(|| missing("MeshFormat"))?;
    let nodes = take("Nodes")?.ok_or_else(|| missing("Nodes"))?;
    let elements = take("Elements")?.ok_or_else(|| missing("Elements"))?;
    let (names, entities) = (take("PhysicalNames")?, take("Entities")?);
    let order = format.order()?;
    let mut reader = MshReader::default();
    if let Some(names) = names {
        let text = String::from_utf8_lossy(names.bytes);
        let first = 1 + lines_before(bytes, names.begins);
        let lines = (first..).zip(text.lines());
        let filled = lines.filter(|(_, text)| !text.trim().is_empty());
        let records = filled.map(|(line, text)| RecordWords::of(text, line));
        reader.groups.read_names(records)?;
    }
    if let Some(entities) = entities {
        reader.groups.read_entities(Bytes::of(entities, order))?;
    }
    reader.nodes_of_fourth(Bytes::of(nodes, order))?;
    reader.elements_of_fourth(Bytes::of(elements, order))?;
    reader.note_sections(pieces.iter().map(|piece| piece.name).collect());
    reader.finish()
}

/// Which of Gmsh's formats a file is of.
#[derive(Clone, Copy, PartialEq)]
enum Version {
    Second,
    Fourth,
    FourthBinary,
}

/// What `$MeshFormat` says.
fn version(bytes: &[u8]) -> Result<Version, String> {
    let mut lines = (1..).zip(bytes.split(|&b| b == b'\n').map(String::from_utf8_lossy));
    let (head, _) = lines
        .find(|(_, text)| text.trim() == "$MeshFormat")
        .ok_or("the section $MeshFormat is missing: this is no mesh of Gmsh 2.2 or 4.1")?;
    let line = head + 1;
    let text = lines.next().map(|(_, text)| text).unwrap_or_default();
    let mut words = text.split_whitespace();
    let mut word = || {
        let cut = || format!("line {line}: the version of the format is missing");
        words.next().ok_or_else(cut)
    };
    let (version, binary) = (word()?, word()?);
    let format = number(version, line)?;
    let is_binary = whole(binary, line)? != 0;
    match format {
        v if (2.0..3.0).contains(&v) && is_binary => Err(format!(
            "line {line}: the file is binary and of version 2: save it as version 4.1, or as text"
        )),
        v if (2.0..3.0).contains(&v) => Ok(Version::Second),
        v if (4.1..5.0).contains(&v) && is_binary => {
            if word()? == "8" {
                Ok(Version::FourthBinary)
            } else {
                Err(format!(
                    "line {line}: its counts are not of eight bytes: save it with Gmsh on a computer of today, or as text"
                ))
            }
        }
        v if (4.1..5.0).contains(&v) => Ok(Version::Fourth),
        _ => Err(format!(
            "line {line}: Gmsh format {} is not read: save it as version 2.2 or 4.1",
            quote(version)
        )),
    }
}

#[derive(Default)]
struct MshReader {
    soup: Soup,
    /// The file's numbers of the nodes.
    nodes: HashMap<u64, u32>,
    /// Places of the elements, by the file's numbers of them.
    elements: HashMap<u64, FilePlace>,
    tetrahedra: FileTetrahedra,
    groups: PhysicalGroups,
    /// Triangles and quadrangles with nodes between their corners, which are left out.
    curved: usize,
}

impl MshReader {
    fn nodes_of_second(&mut self, mut section: MshSection) -> Result<(), String> {
        let count = announced(&mut section, "nodes")?;
        bounded(count, FilePlace::Line(section.first_line()))?;
        for _ in 0..count {
            let mut record = section.record()?;
            let tag = record.whole()?;
            let (position, place) = (record.point()?, FilePlace::Line(record.line));
            record.ends()?;
            self.node(tag, position, place)?;
        }
        section.finish(count, "nodes")
    }

    fn elements_of_second(&mut self, mut section: MshSection) -> Result<(), String> {
        let count = announced(&mut section, "elements")?;
        for _ in 0..count {
            let mut record = section.record()?;
            let place = FilePlace::Line(record.line);
            let (tag, kind_number) = (record.whole()?, record.whole()?);
            let tags = record.whole()?;
            // The first is the physical group, none being zero.
            let mut group = None;
            if tags > 0 {
                group = Some(record.signed()?.unsigned_abs()).filter(|&group| group > 0);
                record.skip(tags - 1)?;
            }
            let kind = known_kind(kind_number, place)?;
            self.is_new(tag, place)?;
            let nodes: Vec<u32> = (0..kind.nodes)
                .map(|_| record.whole().and_then(|node| self.known(node, place)))
                .collect::<Result<_, _>>()?;
            record.ends()?;
            self.groups.add(kind.dimension, group.as_slice(), &nodes);
            self.take(kind.shape, &nodes, ElementName { number: tag, place })?;
        }
        section.finish(count, "elements")
    }

    fn nodes_of_fourth(&mut self, mut stream: impl Stream) -> Result<(), String> {
        let (blocks, count) = announced_blocks(&mut stream, "nodes")?;
        bounded(count, stream.head())?;
        let mut read = 0;
        for _ in 0..blocks {
            stream.begin()?;
            let dimension = stream.int()?;
            stream.int()?;
            let parametric = stream.int()? != 0;
            let in_block = stream.size()?;
            stream.announced(in_block, "nodes")?;
            stream.end()?;
            let parameters = if parametric { dimension.clamp(0, 3) } else { 0 };
            for tag in stream.tags(in_block)? {
                stream.begin()?;
                let place = stream.place();
                let position = DVec3::new(stream.number()?, stream.number()?, stream.number()?);
                for _ in 0..parameters {
                    stream.number()?;
                }
                stream.end()?;
                self.node(tag, position, place)?;
            }
            read += in_block;
        }
        all_there(&stream, read, count, "nodes")?;
        stream.finish(count, "nodes")
    }

    fn elements_of_fourth(&mut self, mut stream: impl Stream) -> Result<(), String> {
        let (blocks, count) = announced_blocks(&mut stream, "elements")?;
        let mut read = 0;
        for _ in 0..blocks {
            stream.begin()?;
            let (dimension, entity) = (stream.int()?, stream.int()?);
            let kind_number = stream.int()?;
            let in_block = stream.size()?;
            stream.announced(in_block, "elements")?;
            let kind = known_kind(kind_number.unsigned_abs(), stream.place())?;
            stream.end()?;
            let groups = self.groups.of_entity(dimension.unsigned_abs(), entity);
            for _ in 0..in_block {
                stream.begin()?;
                let (tag, place) = (stream.size()?, stream.place());
                self.is_new(tag, place)?;
                let nodes: Vec<u32> = (0..kind.nodes)
                    .map(|_| stream.size().and_then(|node| self.known(node, place)))
                    .collect::<Result<_, _>>()?;
                stream.end()?;
                self.groups.add(kind.dimension, &groups, &nodes);
                self.take(kind.shape, &nodes, ElementName { number: tag, place })?;
            }
            read += in_block;
        }
        all_there(&stream, read, count, "elements")?;
        stream.finish(count, "elements")
    }

    fn node(&mut self, tag: u64, position: DVec3, place: FilePlace) -> Result<(), String> {
        let number = self.soup.positions.len() as u32;
        if self.nodes.insert(tag, number).is_some() {
            return Err(format!("{place}: node {tag} is there a second time"));
        }
        self.soup.positions.push(position);
        Ok(())
    }

    /// Refuses an element whose number was there before.
    fn is_new(&mut self, tag: u64, place: FilePlace) -> Result<(), String> {
        match self.elements.entry(tag) {
            Entry::Vacant(free) => {
                free.insert(place);
                Ok(())
            }
            Entry::Occupied(first) => Err(format!(
                "{place}: element {tag} is there a second time (first in {})",
                first.get()
            )),
        }
    }

    fn known(&self, node: u64, place: FilePlace) -> Result<u32, String> {
        let known = self.nodes.get(&node).copied();
        known.ok_or_else(|| format!("{place}: the element names node {node}, which is not there"))
    }

    fn take(
        &mut self,
        shape: ElementShape,
        nodes: &[u32],
        origin: ElementName,
    ) -> Result<(), String> {
        let triangles = &mut self.soup.triangles;
        match shape {
            ElementShape::Outline => {}
            ElementShape::Triangle => {
                triangles.push([nodes[0], nodes[1], nodes[2]]);
                self.curved += usize::from(nodes.len() > 3);
            }
            ElementShape::Quadrangle => {
                triangles.push([nodes[0], nodes[1], nodes[2]]);
                triangles.push([nodes[0], nodes[2], nodes[3]]);
                self.curved += usize::from(nodes.len() > 4);
            }
            ElementShape::Tetrahedron => self.tetrahedra.push(tetrahedron(nodes), origin)?,
            ElementShape::Other(what) => {
                return Err(format!(
                    "{origin}: the element is a {what}: only tetrahedra of 4 or 10 nodes are computed on. Mesh the part with them"
                ));
            }
        }
        Ok(())
    }

    fn note_sections(&mut self, mut rest: Vec<&str>) {
        rest.retain(|name| !SILENT.contains(name));
        if !rest.is_empty() {
            self.soup.notes.push(format!(
                "sections of the file that are not read: {}",
                listed(&rest)
            ));
        }
    }

    fn finish(mut self) -> Result<Soup, String> {
        let sets = self.groups.sets();
        check_count(sets.len(), self.soup.positions.len())?;
        self.soup.node_sets = sets;
        if self.tetrahedra.is_empty() {
            if self.curved > 0 {
                self.soup.notes.push(format!(
                    "{} curved triangles or quadrangles are taken as flat: their nodes between the corners are left out",
                    self.curved
                ));
            }
            return Ok(self.soup);
        }
        let apart = self.tetrahedra.triangles_apart(&self.soup);
        if apart > 0 {
            self.soup.notes.push(format!(
                "{apart} triangles lie on nodes that no tetrahedron has and are left out: only the tetrahedra are computed on"
            ));
        }
        self.tetrahedra.hand_to(&mut self.soup)?;
        Ok(self.soup)
    }
}

fn known_kind(number: u64, place: FilePlace) -> Result<MshElementKind, String> {
    kind(number).ok_or_else(|| {
        format!(
            "{place}: elements of Gmsh's kind {number} are not read: mesh the part with elements of first or second order"
        )
    })
}

/// A tetrahedron of four or ten nodes in Gmsh's order.
fn tetrahedron(nodes: &[u32]) -> Tetrahedron {
    // Gmsh has the nodes on the edges 23 and 13 the other way round.
    const MIDDLES: [usize; 6] = [4, 5, 6, 7, 9, 8];
    Tetrahedron {
        corners: std::array::from_fn(|k| nodes[k]),
        middles: MIDDLES.map(|k| nodes.get(k).copied()),
    }
}

/// The count that a section of version 2 begins with.
fn announced(section: &mut MshSection, what: &str) -> Result<u64, String> {
    let mut head = section.record()?;
    let count = head.whole()?;
    section.announced(count, what, head.line)?;
    head.ends()?;
    Ok(count)
}

/// The counts of blocks, and of what they hold, that a section of version 4.1 begins with.
fn announced_blocks(stream: &mut impl Stream, what: &str) -> Result<(u64, u64), String> {
    stream.begin()?;
    let (blocks, count) = (stream.size()?, stream.size()?);
    stream.announced(blocks, "blocks")?;
    stream.announced(count, what)?;
    // The least and the largest of their numbers.
    stream.size()?;
    stream.size()?;
    stream.end()?;
    Ok((blocks, count))
}

/// Refuses blocks that together hold another number of things than their section announces.
fn all_there(stream: &impl Stream, read: u64, count: u64, what: &str) -> Result<(), String> {
    if read == count {
        return Ok(());
    }
    Err(format!(
        "{}: ${} announces {count} {what}, but its blocks hold {read}: a count is wrong, or a block is missing",
        stream.head(),
        stream.name()
    ))
}
