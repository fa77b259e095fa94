//! Tetrahedra from Abaqus and `CalculiX` input files. Nothing is dropped without a word: what cannot be right, or
//! would place nodes elsewhere, is refused with its line, and what is not computed on is noted.

mod keyword;
mod said;

use std::collections::HashMap;

use glam::DVec3;

use super::place::{ElementName, FilePlace};
use super::sets::{NumberRange, Numbered, Sets, check_count};
use super::soup::Soup;
use super::tetrahedra::{FileTetrahedra, bounded};
use super::unread::Unread;
use super::words::{fortran, whole};
use crate::mesh::volume::Tetrahedron;
use crate::plain::quote;
use keyword::{Keyword, statements, values};
use said::{Boundaries, Elastic};

/// What the lines after a keyword are.
#[derive(Default)]
enum Reading {
    /// No keyword has come yet.
    #[default]
    Start,
    Nothing,
    /// Nodes, which belong to a set where that is said.
    Nodes(Option<usize>),
    /// Tetrahedra of so many nodes, which belong to a set where that is said.
    Elements(usize, Option<usize>),
    /// Nodes of a set, or ranges of them.
    NodeSet(usize, bool),
    ElementSet(usize, bool),
    /// Constants of an elastic material.
    Elastic,
    /// What is held.
    Boundary,
    /// What would place nodes elsewhere than their coordinates say.
    Moved(&'static str),
}

/// An element of 4 or 10 nodes as its lines have it.
struct InpElement {
    line: usize,
    number: u64,
    /// The file's numbers of its nodes.
    nodes: Vec<u64>,
}

/// Keywords that change nothing about the mesh.
const SILENT: [&str; 9] = [
    "HEADING",
    "MATERIAL",
    "PREPRINT",
    "PART",
    "END PART",
    "ASSEMBLY",
    "END ASSEMBLY",
    "END INSTANCE",
    "END STEP",
];

/// Keywords whose lines are read, and which may have them in another file.
const WITH_DATA: [&str; 6] = ["NODE", "ELEMENT", "NSET", "ELSET", "ELASTIC", "BOUNDARY"];

/// Reads nodes, tetrahedra and sets of nodes.
///
/// # Errors
/// A message naming the line.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut reader = InpReader::default();
    for (line, words) in statements(&text) {
        if words.starts_with('*') {
            reader.begin(&Keyword::of(&words, line))?;
        } else {
            reader.data(&words, line)?;
        }
    }
    reader.finish()
}

#[derive(Default)]
struct InpReader {
    soup: Soup,
    reading: Reading,
    /// An element that goes on in the next line: where it began, and its number and nodes so far.
    waiting: Option<(usize, Vec<u64>)>,
    /// Places in our lists by the file's numbers.
    node_places: HashMap<u64, u32>,
    element_places: HashMap<u64, u32>,
    elements: Vec<InpElement>,
    node_sets: Sets,
    element_sets: Sets,
    elastic: Elastic,
    boundaries: Boundaries,
    /// Types of elements that are left out.
    left_out: Unread,
    /// Keywords that are not read.
    unread: Unread,
}

impl InpReader {
    fn begin(&mut self, keyword: &Keyword) -> Result<(), String> {
        self.element_is_whole()?;
        self.elastic.notice(keyword);
        let line = keyword.line;
        if WITH_DATA.contains(&keyword.name.as_str()) {
            no_input(keyword)?;
        }
        self.reading = match keyword.name.as_str() {
            "NODE" => self.begin_nodes(keyword)?,
            "ELEMENT" => self.begin_elements(keyword)?,
            "NSET" => self.begin_node_set(keyword)?,
            "ELSET" => {
                let set = self.element_sets.open(keyword.required("ELSET")?);
                Reading::ElementSet(set, keyword.option("GENERATE").is_some())
            }
            "ELASTIC" if Elastic::is_read(keyword) => Reading::Elastic,
            "BOUNDARY" if self.boundaries.begin(keyword) => Reading::Boundary,
            "STEP" => {
                self.boundaries.begin_step();
                Reading::Nothing
            }
            "SYSTEM" => Reading::Moved("*SYSTEM gives nodes in a system of its own"),
            "INSTANCE" => Reading::Moved("*INSTANCE moves the part"),
            "INCLUDE" => {
                return Err(format!(
                    "line {line}: it includes another file: put everything into one"
                ));
            }
            "NGEN" | "NFILL" | "NCOPY" | "NMAP" | "ELGEN" | "ELCOPY" | "PARAMETER" => {
                return Err(format!(
                    "line {line}: *{} makes nodes or elements that do not stand in the file, which is not read: write all of them",
                    keyword.name
                ));
            }
            name => {
                if !SILENT.contains(&name) {
                    self.unread.add(name, line);
                }
                Reading::Nothing
            }
        };
        Ok(())
    }

    fn begin_nodes(&mut self, keyword: &Keyword) -> Result<Reading, String> {
        let curved = |system: &str| !system.is_empty() && !system.eq_ignore_ascii_case("R");
        if keyword.option("SYSTEM").is_some_and(curved) {
            return Err(format!(
                "line {}: nodes in cylindrical or spherical coordinates are not read: write them in Cartesian ones (SYSTEM=R)",
                keyword.line
            ));
        }
        let set = keyword.option("NSET").filter(|name| !name.is_empty());
        Ok(Reading::Nodes(set.map(|name| self.node_sets.open(name))))
    }

    fn begin_elements(&mut self, keyword: &Keyword) -> Result<Reading, String> {
        let line = keyword.line;
        let kind = keyword.required("TYPE")?.to_uppercase();
        let set = keyword.option("ELSET").filter(|name| !name.is_empty());
        let set = set.map(|name| self.element_sets.open(name));
        if let Some(nodes) = nodes_of_tetrahedron(&kind) {
            return Ok(Reading::Elements(nodes, set));
        }
        if kind.starts_with("C3D") {
            return Err(format!(
                "line {line}: elements of type {} are not computed on: mesh the part with tetrahedra (C3D4 or C3D10)",
                quote(&kind)
            ));
        }
        self.left_out.add(&kind, line);
        Ok(Reading::Nothing)
    }

    fn begin_node_set(&mut self, keyword: &Keyword) -> Result<Reading, String> {
        let set = self.node_sets.open(keyword.required("NSET")?);
        if let Some(elements) = keyword.option("ELSET") {
            let elements = self.element_sets.known(elements, keyword.line)?;
            self.node_sets.at(set).of_elements.insert(elements);
        }
        let ranges = keyword.option("GENERATE").is_some();
        Ok(Reading::NodeSet(set, ranges))
    }

    fn data(&mut self, words: &str, line: usize) -> Result<(), String> {
        match self.reading {
            Reading::Nothing => Ok(()),
            Reading::Start => Err(format!(
                "line {line}: {} stands before the first keyword: this is no input file of Abaqus or CalculiX",
                quote(words)
            )),
            Reading::Moved(what) => Err(format!(
                "line {line}: {what}, which is not read: write the nodes where they are, in one Cartesian system"
            )),
            Reading::Nodes(set) => self.node(words, line, set),
            Reading::Elements(nodes, set) => self.element(words, line, nodes, set),
            Reading::Elastic => self.elastic.take(words, line),
            Reading::Boundary => self.boundaries.take(words, line),
            Reading::NodeSet(set, ranges) => add_to(&mut self.node_sets, set, ranges, words, line),
            Reading::ElementSet(set, ranges) => {
                add_to(&mut self.element_sets, set, ranges, words, line)
            }
        }
    }

    fn node(&mut self, words: &str, line: usize, set: Option<usize>) -> Result<(), String> {
        let words: Vec<&str> = values(words).collect();
        let [tag, x, y, z] = words[..] else {
            return Err(format!(
                "line {line}: a node has a number and three coordinates, and here are {} values",
                words.len()
            ));
        };
        let tag = whole(tag, line)?;
        let position = DVec3::new(fortran(x, line)?, fortran(y, line)?, fortran(z, line)?);
        bounded(self.soup.positions.len() as u64 + 1, FilePlace::Line(line))?;
        let place = self.soup.positions.len() as u32;
        if self.node_places.insert(tag, place).is_some() {
            return Err(format!(
                "line {line}: node {tag} is there a second time: a file of several parts is not read, write one part into a file"
            ));
        }
        self.soup.positions.push(position);
        if let Some(set) = set {
            self.node_sets.at(set).numbers.push(tag);
        }
        Ok(())
    }

    fn element(
        &mut self,
        words: &str,
        line: usize,
        nodes: usize,
        set: Option<usize>,
    ) -> Result<(), String> {
        let (begun, mut numbers) = self.waiting.take().unwrap_or((line, Vec::new()));
        for word in values(words) {
            numbers.push(whole(word, line)?);
        }
        if numbers.len() <= nodes {
            self.waiting = Some((begun, numbers));
            return Ok(());
        }
        if numbers.len() > nodes + 1 {
            return Err(format!(
                "line {line}: an element of this type has a number and {nodes} nodes, and here are {} values",
                numbers.len()
            ));
        }
        let tag = numbers.remove(0);
        if let Some(first) = self.element_places.insert(tag, self.elements.len() as u32) {
            return Err(format!(
                "line {begun}: element {tag} is there a second time (first in line {})",
                self.elements[first as usize].line
            ));
        }
        self.elements.push(InpElement {
            line: begun,
            number: tag,
            nodes: numbers,
        });
        if let Some(set) = set {
            self.element_sets.at(set).numbers.push(tag);
        }
        Ok(())
    }

    /// Refuses an element that ends before all its nodes are there.
    fn element_is_whole(&self) -> Result<(), String> {
        match (&self.waiting, &self.reading) {
            (Some((line, numbers)), Reading::Elements(nodes, _)) => Err(format!(
                "line {line}: the element is cut off: {} of its {nodes} nodes are there",
                numbers.len().saturating_sub(1)
            )),
            _ => Ok(()),
        }
    }

    fn finish(mut self) -> Result<Soup, String> {
        self.element_is_whole()?;
        if self.elements.is_empty() {
            let others = if self.left_out.is_empty() {
                String::new()
            } else {
                format!(", but elements of type {}", self.left_out.listed())
            };
            return Err(format!(
                "it has no tetrahedra (C3D4 or C3D10){others}: mesh the part with tetrahedra"
            ));
        }
        if !self.left_out.is_empty() {
            self.soup.notes.push(format!(
                "elements of other types are left out: {}; only the tetrahedra are computed on",
                self.left_out.listed()
            ));
        }
        if !self.unread.is_empty() {
            self.soup.notes.push(format!(
                "keywords of the file that are not read: {}",
                self.unread.listed()
            ));
        }
        self.tetrahedra()?.hand_to(&mut self.soup)?;
        self.take_sets()?;
        self.soup.said.material = self.elastic.material(&mut self.soup.notes);
        self.soup.said.supports = self.boundaries.supports(
            &self.node_places,
            &mut self.soup.node_sets,
            &mut self.soup.notes,
        );
        Ok(self.soup)
    }

    /// The elements on our nodes.
    fn tetrahedra(&self) -> Result<FileTetrahedra, String> {
        let mut tetrahedra = FileTetrahedra::default();
        for element in &self.elements {
            let place = |k: usize| self.place_of(element.nodes[k], element.line);
            let mut tetrahedron = Tetrahedron {
                corners: [place(0)?, place(1)?, place(2)?, place(3)?],
                middles: [None; 6],
            };
            if element.nodes.len() == 10 {
                for (k, middle) in (4..).zip(&mut tetrahedron.middles) {
                    *middle = Some(place(k)?);
                }
            }
            let origin = ElementName::in_line(element.number, element.line);
            tetrahedra.push(tetrahedron, origin)?;
        }
        Ok(tetrahedra)
    }

    fn place_of(&self, node: u64, line: usize) -> Result<u32, String> {
        let place = self.node_places.get(&node).copied();
        place.ok_or_else(|| {
            format!("line {line}: the element names node {node}, which is not there")
        })
    }

    /// Looks up what the sets of nodes name.
    fn take_sets(&mut self) -> Result<(), String> {
        let sets = self.node_sets.len();
        check_count(sets.max(self.element_sets.len()), self.node_places.len())?;
        let nodes = Numbered::of(&self.node_places);
        let elements = Numbered::of(&self.element_places);
        for set in 0..sets {
            let named = self.node_sets.members(set, &nodes);
            let (mut found, mut missing) = (named.found, named.missing);
            for of in named.of_elements {
                let these = self.element_sets.members(of, &elements);
                missing = missing.saturating_add(these.missing);
                for element in these.found {
                    let element = &self.elements[element as usize];
                    found.extend(element.nodes.iter().filter_map(|n| self.node_places.get(n)));
                }
                found.sort_unstable();
                found.dedup();
            }
            let name = self.node_sets.name(set);
            if missing > 0 {
                self.soup.notes.push(format!(
                    "the set {} names {missing} nodes or elements that are not there",
                    quote(name)
                ));
            }
            self.soup.node_sets.push((name.to_owned(), found));
        }
        Ok(())
    }
}

/// Refuses what stands in another file.
fn no_input(keyword: &Keyword) -> Result<(), String> {
    match keyword.option("INPUT") {
        None => Ok(()),
        Some(file) => Err(format!(
            "line {}: *{} is read from another file ({}): put everything into one",
            keyword.line,
            keyword.name,
            quote(file)
        )),
    }
}

/// Nodes of a tetrahedron of a type; nothing for other elements.
fn nodes_of_tetrahedron(kind: &str) -> Option<usize> {
    let of = |start: &str, nodes: usize| {
        let variant = kind.strip_prefix(start)?;
        let plain = variant.chars().all(|c| c.is_ascii_alphabetic());
        plain.then_some(nodes)
    };
    of("C3D10", 10).or_else(|| of("C3D4", 4))
}

/// Adds a line to a set: a range, or numbers and names of other sets.
fn add_to(
    sets: &mut Sets,
    set: usize,
    ranges: bool,
    words: &str,
    line: usize,
) -> Result<(), String> {
    if ranges {
        let range = range(words, line)?;
        sets.at(set).ranges.push(range);
        return Ok(());
    }
    for word in values(words) {
        // What is damaged is no name.
        if word.starts_with(|c: char| c.is_alphabetic() || "_\"".contains(c)) {
            let other = sets.known(word, line)?;
            sets.at(set).sets.insert(other);
        } else {
            let number = whole(word, line)?;
            sets.at(set).numbers.push(number);
        }
    }
    Ok(())
}

fn range(words: &str, line: usize) -> Result<NumberRange, String> {
    let numbers: Vec<u64> = values(words)
        .map(|word| whole(word, line))
        .collect::<Result<_, _>>()?;
    let (first, last, step) = match numbers[..] {
        [first, last] => (first, last, 1),
        [first, last, step] => (first, last, step),
        _ => {
            return Err(format!(
                "line {line}: a range has a first and a last number and maybe a step, and here are {} values",
                numbers.len()
            ));
        }
    };
    if first > last || step == 0 {
        return Err(format!(
            "line {line}: the range from {first} to {last} in steps of {step} is empty"
        ));
    }
    Ok(NumberRange { first, last, step })
}
