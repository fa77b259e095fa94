//! Gmsh meshes, versions 2.2 and 4.1, as text. Nothing is dropped without a word: what cannot be right is
//! refused with its line, and what is not computed on is noted.

mod section;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::Soup;
use super::tetrahedra::Tetrahedra;
use super::words::{listed, number, whole};
use crate::mesh::volume::Tetrahedron;
use crate::plain::quote;
use section::{Record, Section, Sections};

/// What an element is, its corners coming first among its nodes.
#[derive(Clone, Copy, PartialEq)]
enum Shape {
    /// Points and lines: outlines of the part, which carry nothing.
    Outline,
    Triangle,
    Quadrangle,
    Tetrahedron,
    Other(&'static str),
}

/// Elements by Gmsh's numbers of their kinds: nodes, and what they are.
fn kind(number: u64) -> Option<(usize, Shape)> {
    Some(match number {
        15 => (1, Shape::Outline),
        1 => (2, Shape::Outline),
        8 => (3, Shape::Outline),
        26 => (4, Shape::Outline),
        2 => (3, Shape::Triangle),
        9 => (6, Shape::Triangle),
        3 => (4, Shape::Quadrangle),
        10 => (9, Shape::Quadrangle),
        16 => (8, Shape::Quadrangle),
        4 => (4, Shape::Tetrahedron),
        11 => (10, Shape::Tetrahedron),
        29 => (20, Shape::Other("tetrahedron of 20 nodes")),
        5 => (8, Shape::Other("hexahedron")),
        12 => (27, Shape::Other("hexahedron")),
        17 => (20, Shape::Other("hexahedron")),
        6 => (6, Shape::Other("prism")),
        13 => (18, Shape::Other("prism")),
        18 => (15, Shape::Other("prism")),
        7 => (5, Shape::Other("pyramid")),
        14 => (14, Shape::Other("pyramid")),
        19 => (13, Shape::Other("pyramid")),
        _ => return None,
    })
}

/// Sections that change nothing about the mesh.
const SILENT: [&str; 2] = ["Entities", "Comments"];

/// Reads a mesh.
///
/// # Errors
/// A message naming the line.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<&str> = text.lines().collect();
    let fourth = is_fourth(&lines)?;
    let mut sections = Sections::of(&lines)?;
    let mut reader = Reader::default();
    sections.take("MeshFormat")?;
    let (nodes, elements) = (sections.take("Nodes")?, sections.take("Elements")?);
    if fourth {
        reader.nodes_of_fourth(nodes)?;
        reader.elements_of_fourth(elements)?;
    } else {
        reader.nodes_of_second(nodes)?;
        reader.elements_of_second(elements)?;
    }
    reader.note_sections(&sections);
    reader.finish()
}

/// Whether the file is of version 4.1; otherwise it is of version 2.
fn is_fourth(lines: &[&str]) -> Result<bool, String> {
    let start = lines.iter().position(|l| l.trim() == "$MeshFormat");
    let start =
        start.ok_or("the section $MeshFormat is missing: this is no mesh of Gmsh 2.2 or 4.1")?;
    let line = start + 2;
    let mut words = lines.get(start + 1).unwrap_or(&"").split_whitespace();
    let mut word = || {
        let cut = || format!("line {line}: the version of the format is missing");
        words.next().ok_or_else(cut)
    };
    let (version, binary) = (word()?, word()?);
    let format = number(version, line)?;
    if whole(binary, line)? != 0 {
        return Err(format!(
            "line {line}: the file is binary: in Gmsh choose “Save as… ASCII”, or write it with -format msh41 without -bin"
        ));
    }
    match format {
        v if (2.0..3.0).contains(&v) => Ok(false),
        v if (4.1..5.0).contains(&v) => Ok(true),
        _ => Err(format!(
            "line {line}: Gmsh format {} is not read: save it as version 2.2 or 4.1",
            quote(version)
        )),
    }
}

/// So many numbers of nodes, of which a line may hold several.
fn tags(section: &mut Section, count: u64) -> Result<Vec<u64>, String> {
    let mut tags = Vec::new();
    while (tags.len() as u64) < count {
        let mut record = section.record()?;
        tags.push(record.whole()?);
        while (tags.len() as u64) < count && record.goes_on() {
            tags.push(record.whole()?);
        }
        record.ends()?;
    }
    Ok(tags)
}

#[derive(Default)]
struct Reader {
    soup: Soup,
    /// The file's numbers of the nodes.
    nodes: HashMap<u64, u32>,
    /// Lines of the elements, by the file's numbers of them.
    elements: HashMap<u64, usize>,
    tetrahedra: Tetrahedra,
    /// Triangles and quadrangles with nodes between their corners, which are left out.
    curved: usize,
}

impl Reader {
    fn nodes_of_second(&mut self, mut section: Section) -> Result<(), String> {
        let count = announced(&mut section, "nodes")?;
        for _ in 0..count {
            let mut record = section.record()?;
            let tag = record.whole()?;
            self.node(tag, record, 0)?;
        }
        section.finish(count, "nodes")
    }

    fn elements_of_second(&mut self, mut section: Section) -> Result<(), String> {
        let count = announced(&mut section, "elements")?;
        for _ in 0..count {
            let mut record = section.record()?;
            let (tag, kind_number) = (record.whole()?, record.whole()?);
            let tags = record.whole()?;
            record.skip(tags)?;
            self.element(tag, kind_number, record)?;
        }
        section.finish(count, "elements")
    }

    fn nodes_of_fourth(&mut self, mut section: Section) -> Result<(), String> {
        let (blocks, count) = announced_blocks(&mut section, "nodes")?;
        let mut read = 0;
        for _ in 0..blocks {
            let mut head = section.record()?;
            let dimension = head.whole()?;
            head.skip(1)?;
            let (parametric, in_block) = (head.whole()?, head.whole()?);
            section.announced(in_block, "nodes", head.line)?;
            head.ends()?;
            let parameters = if parametric == 0 { 0 } else { dimension.min(3) };
            for tag in tags(&mut section, in_block)? {
                self.node(tag, section.record()?, parameters)?;
            }
            read += in_block;
        }
        all_there(&section, read, count, "nodes")?;
        section.finish(count, "nodes")
    }

    fn elements_of_fourth(&mut self, mut section: Section) -> Result<(), String> {
        let (blocks, count) = announced_blocks(&mut section, "elements")?;
        let mut read = 0;
        for _ in 0..blocks {
            let mut head = section.record()?;
            head.skip(2)?;
            let (kind_number, in_block) = (head.whole()?, head.whole()?);
            section.announced(in_block, "elements", head.line)?;
            head.ends()?;
            for _ in 0..in_block {
                let mut record = section.record()?;
                let tag = record.whole()?;
                self.element(tag, kind_number, record)?;
            }
            read += in_block;
        }
        all_there(&section, read, count, "elements")?;
        section.finish(count, "elements")
    }

    /// A node, its coordinates and some parameters being what is left of a line.
    fn node(&mut self, tag: u64, mut record: Record, parameters: u64) -> Result<(), String> {
        let line = record.line;
        let position = record.point()?;
        record.skip(parameters)?;
        record.ends()?;
        let number = self.soup.positions.len() as u32;
        if self.nodes.insert(tag, number).is_some() {
            return Err(format!("line {line}: node {tag} is there a second time"));
        }
        self.soup.positions.push(position);
        Ok(())
    }

    /// An element, its nodes being what is left of a line.
    fn element(&mut self, tag: u64, kind_number: u64, mut record: Record) -> Result<(), String> {
        let line = record.line;
        let (count, shape) = kind(kind_number).ok_or_else(|| {
            format!(
                "line {line}: elements of Gmsh's kind {kind_number} are not read: mesh the part with elements of first or second order"
            )
        })?;
        match self.elements.entry(tag) {
            Entry::Vacant(free) => free.insert(line),
            Entry::Occupied(first) => {
                return Err(format!(
                    "line {line}: element {tag} is there a second time (first in line {})",
                    first.get()
                ));
            }
        };
        let nodes: Vec<u32> = (0..count)
            .map(|_| record.whole().and_then(|node| self.known(node, line)))
            .collect::<Result<_, _>>()?;
        record.ends()?;
        self.take(shape, &nodes, line)
    }

    fn known(&self, node: u64, line: usize) -> Result<u32, String> {
        let known = self.nodes.get(&node).copied();
        known.ok_or_else(|| {
            format!("line {line}: the element names node {node}, which is not there")
        })
    }

    fn take(&mut self, shape: Shape, nodes: &[u32], line: usize) -> Result<(), String> {
        let triangles = &mut self.soup.triangles;
        match shape {
            Shape::Outline => {}
            Shape::Triangle => {
                triangles.push([nodes[0], nodes[1], nodes[2]]);
                self.curved += usize::from(nodes.len() > 3);
            }
            Shape::Quadrangle => {
                triangles.push([nodes[0], nodes[1], nodes[2]]);
                triangles.push([nodes[0], nodes[2], nodes[3]]);
                self.curved += usize::from(nodes.len() > 4);
            }
            Shape::Tetrahedron => self.tetrahedra.push(tetrahedron(nodes), line)?,
            Shape::Other(what) => {
                return Err(format!(
                    "line {line}: the element is a {what}: only tetrahedra of 4 or 10 nodes are computed on. Mesh the part with them"
                ));
            }
        }
        Ok(())
    }

    fn note_sections(&mut self, sections: &Sections) {
        let mut rest = sections.rest();
        rest.retain(|name| !SILENT.contains(name));
        if !rest.is_empty() {
            self.soup.notes.push(format!(
                "sections of the file that are not read: {}",
                listed(&rest)
            ));
        }
    }

    fn finish(mut self) -> Result<Soup, String> {
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

/// A tetrahedron of four or ten nodes in Gmsh's order.
fn tetrahedron(nodes: &[u32]) -> Tetrahedron {
    Tetrahedron {
        corners: std::array::from_fn(|k| nodes[k]),
        middles: (nodes.len() == 10).then(|| {
            let mut middles: [u32; 6] = std::array::from_fn(|k| nodes[4 + k]);
            // Gmsh has the nodes on the edges 23 and 13 the other way round.
            middles.swap(4, 5);
            middles
        }),
    }
}

/// The count that a section of version 2 begins with.
fn announced(section: &mut Section, what: &str) -> Result<u64, String> {
    let mut head = section.record()?;
    let count = head.whole()?;
    section.announced(count, what, head.line)?;
    head.ends()?;
    Ok(count)
}

/// The counts of blocks, and of what they hold, that a section of version 4.1 begins with.
fn announced_blocks(section: &mut Section, what: &str) -> Result<(u64, u64), String> {
    let mut head = section.record()?;
    let (blocks, count) = (head.whole()?, head.whole()?);
    section.announced(blocks, "blocks", head.line)?;
    section.announced(count, what, head.line)?;
    head.skip(2)?;
    head.ends()?;
    Ok((blocks, count))
}

/// Refuses blocks that together hold another number of things than their section announces.
fn all_there(section: &Section, read: u64, count: u64, what: &str) -> Result<(), String> {
    if read == count {
        return Ok(());
    }
    Err(format!(
        "line {}: ${} announces {count} {what}, but its blocks hold {read}: a count is wrong, or a block is missing",
        section.first_line(),
        section.name
    ))
}
