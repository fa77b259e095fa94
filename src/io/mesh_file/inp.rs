//! Tetrahedra from Abaqus and `CalculiX` input files. Nothing is dropped without a word: what cannot be right, or
//! would place nodes elsewhere, is refused with its line, and what is not computed on is noted.

mod keyword;
mod sets;

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::Soup;
use super::tetrahedra::Tetrahedra;
use super::words::{fortran, listed, whole};
use crate::memory;
use crate::mesh::volume::Tetrahedron;
use crate::plain::quote;
use keyword::{Keyword, statements};
use sets::{Numbered, Range, Sets};

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
    /// What would place nodes elsewhere than their coordinates say.
    Moved(&'static str),
}

/// An element of 4 or 10 nodes as its lines have it.
struct Element {
    line: usize,
    /// The file's numbers of its nodes.
    nodes: Vec<u64>,
}

/// Keywords that change nothing about the mesh.
const SILENT: [&str; 8] = [
    "HEADING",
    "PREPRINT",
    "PART",
    "END PART",
    "ASSEMBLY",
    "END ASSEMBLY",
    "END INSTANCE",
    "END STEP",
];
/// Most sets of nodes, and of elements.
const MOST_SETS: usize = 10_000;

/// Reads nodes, tetrahedra and sets of nodes.
///
/// # Errors
/// A message naming the line.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut reader = Reader::default();
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
struct Reader {
    soup: Soup,
    reading: Reading,
    /// An element that goes on in the next line: where it began, and its number and nodes so far.
    waiting: Option<(usize, Vec<u64>)>,
    /// Places in our lists by the file's numbers.
    node_places: HashMap<u64, u32>,
    element_places: HashMap<u64, u32>,
    elements: Vec<Element>,
    node_sets: Sets,
    element_sets: Sets,
    /// Types of elements that are left out, with the line of the first.
    left_out: BTreeMap<String, usize>,
    /// Keywords that are not read.
    unread: BTreeMap<String, usize>,
}

impl Reader {
    fn begin(&mut self, keyword: &Keyword) -> Result<(), String> {
        self.element_is_whole()?;
        let line = keyword.line;
        self.reading = match keyword.name.as_str() {
            "NODE" => self.begin_nodes(keyword)?,
            "ELEMENT" => self.begin_elements(keyword)?,
            "NSET" => self.begin_node_set(keyword)?,
            "ELSET" => {
                let set = self.element_sets.open(keyword.required("ELSET")?);
                Reading::ElementSet(set, keyword.option("GENERATE").is_some())
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
                    self.unread.entry(name.to_owned()).or_insert(line);
                }
                Reading::Nothing
            }
        };
        Ok(())
    }

    fn begin_nodes(&mut self, keyword: &Keyword) -> Result<Reading, String> {
        no_input(keyword)?;
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
        no_input(keyword)?;
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
        self.left_out.entry(kind).or_insert(line);
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
        self.elements.push(Element {
            line: begun,
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
        let left_out: Vec<&str> = self.left_out.keys().map(String::as_str).collect();
        if self.elements.is_empty() {
            let others = if left_out.is_empty() {
                String::new()
            } else {
                format!(", but elements of type {}", listed(&left_out))
            };
            return Err(format!(
                "it has no tetrahedra (C3D4 or C3D10){others}: mesh the part with tetrahedra"
            ));
        }
        if !left_out.is_empty() {
            self.soup.notes.push(format!(
                "elements of type {} are left out (the first in line {}): only the tetrahedra are computed on",
                listed(&left_out),
                first(&self.left_out)
            ));
        }
        if !self.unread.is_empty() {
            let unread: Vec<&str> = self.unread.keys().map(String::as_str).collect();
            self.soup.notes.push(format!(
                "keywords of the file that are not read: {} (the first in line {}; material, supports and touches are the project's)",
                listed(&unread),
                first(&self.unread)
            ));
        }
        self.tetrahedra()?.hand_to(&mut self.soup)?;
        self.take_sets()?;
        Ok(self.soup)
    }

    /// The elements on our nodes.
    fn tetrahedra(&self) -> Result<Tetrahedra, String> {
        let mut tetrahedra = Tetrahedra::default();
        for element in &self.elements {
            let place = |k: usize| self.place_of(element.nodes[k], element.line);
            let corners = [place(0)?, place(1)?, place(2)?, place(3)?];
            let middles = match element.nodes.len() {
                10 => Some([
                    place(4)?,
                    place(5)?,
                    place(6)?,
                    place(7)?,
                    place(8)?,
                    place(9)?,
                ]),
                _ => None,
            };
            tetrahedra.push(Tetrahedron { corners, middles }, element.line)?;
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
        check_sets(sets.max(self.element_sets.len()), self.node_places.len())?;
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

/// The first line of all.
fn first(lines: &BTreeMap<String, usize>) -> usize {
    lines.values().copied().min().unwrap_or_default()
}

/// Refuses more sets than there is memory for, each taken for all nodes.
fn check_sets(sets: usize, nodes: usize) -> Result<(), String> {
    /// Bytes for a node in a set: its number, and its place in the mask.
    const A_NODE: f64 = 5.0;
    let bytes = A_NODE * sets as f64 * nodes as f64;
    if sets <= MOST_SETS && bytes <= memory::allowed() {
        return Ok(());
    }
    Err(format!(
        "it has {sets} sets on {nodes} nodes: keep only the sets that the project names, no more than {MOST_SETS}"
    ))
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

/// The values of a line; a comma may follow the last.
fn values(words: &str) -> impl Iterator<Item = &str> {
    let words = words.strip_suffix(',').unwrap_or(words);
    words.split(',').map(str::trim)
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

fn range(words: &str, line: usize) -> Result<Range, String> {
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
    Ok(Range { first, last, step })
}
