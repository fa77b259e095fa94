//! Input of Ansys MAPDL: what Mechanical writes (`ds.dat`) and what CDWRITE writes (`.cdb`). Nodes, tetrahedra or
//! shells, their material, what is held, components and units are read. What cannot be right, or would place nodes
//! elsewhere, is refused with its line; what is not read is noted, each command once.

mod block;
mod command;
mod elements;
mod finish;
mod format;
mod material;
mod reader;
mod selection;

use std::rc::Rc;

use super::found::UnitSystem;
use super::place::ElementName;
use super::sets::Numbered;
use super::soup::Soup;
use super::words::at;
use crate::elasticity::DofSet;
use crate::plain::quote;
use command::{DeckCommand, DeckLines, Statement, statements};
use elements::{DeckElement, Routine};
use glam::DVec3;
use reader::DeckReader;
use selection::{DeckSelection, Nodes};

/// Commands that change nothing about the part: the program's own, how it solves, and what it writes.
const SILENT: &[&str] = &[
    "/BATC", "/CLEA", "/COLO", "/COM", "/CONF", "/FILN", "/GO", "/GOLI", "/GOPR", "/GRAP", "/GST",
    "/NERR", "/NOLI", "/NOPR", "/OUTP", "/POST", "/PREP", "/SOLU", "/TITL", "/VIEW", "/WB", "/XML",
    "*DIM", "*GET", "*MSG", "*STAT", "*VWRI", "ANTY", "AUTO", "C***", "CEWR", "CNTR", "DMPO",
    "EQSL", "ESEL", "ESLN", "ESYS", "ETCO", "EXTO", "FINI", "IRLF", "KBC", "LUMP", "NCNV", "NEQI",
    "NLDI", "NLGE", "NSUB", "OUTR", "REAL", "RESC", "SAVE", "SHPP", "STAB", "TIME", "TOFF", "TSHA",
    "XMLO",
];
/// Commands that make, move, number or remove nodes or elements without writing them down.
const CHANGING: &[&str] = &[
    "NGEN", "NSYM", "NSCA", "NMOD", "NDEL", "NUMM", "NUMC", "NREA", "FILL", "EGEN", "ESYM", "ENSY",
    "EDEL", "EMOD", "EREA", "AMES", "VMES", "VSWE", "CDRE", "/INPU", "*USE", "TRAN",
];
/// Commands that must be carried out wherever they stand.
const WEIGHTY: &[&str] = &[
    "N", "E", "EN", "EMOR", "NBLO", "EBLO", "ET", "ETBL", "CMBL", "CM", "D", "MP", "MPDA", "/UNIT",
];

/// Reads a deck.
///
/// # Errors
/// A message naming the line.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = DeckLines::of(&text);
    let mut reader = DeckReader::default();
    while let Some((number, line)) = lines.next() {
        for statement in statements(line, number) {
            match statement {
                Statement::Set(name, value) => reader.known.set(&name, value),
                Statement::Numbers => reader.stray(number),
                Statement::Command(command) => reader.carry_out(&command, &mut lines)?,
            }
        }
        if reader.ended {
            break;
        }
    }
    reader.finish()
}

impl DeckReader {
    /// Numbers without a block that is read.
    fn stray(&mut self, line: usize) {
        if !self.in_unread {
            self.strays.add("numbers", line);
        }
    }

    fn carry_out(&mut self, command: &DeckCommand, lines: &mut DeckLines) -> Result<(), String> {
        let key = command.key();
        self.in_unread = false;
        if self.is_skipped(command)? {
            return Ok(());
        }
        match key {
            "N" => self.node(command)?,
            "NBLO" => self.node_block(command, lines)?,
            "NROT" => self.turn_node(command)?,
            "ET" => self.element_type(command)?,
            "ETBL" => self.element_types(lines)?,
            "KEYO" => self.key_option(command)?,
            "TYPE" => self.active.kind = self.attribute(command)?,
            "MAT" => self.active.material = self.attribute(command)?,
            "SECN" => self.active.section = self.attribute(command)?,
            "E" => self.element(command, 0)?,
            "EN" => self.element(command, 1)?,
            "EMOR" => self.more_nodes(command)?,
            "EBLO" => self.element_block(command, lines)?,
            "SECT" => self.begin_section(command)?,
            "SECD" => self.layer(command)?,
            "SECB" => self.layers(command, lines)?,
            "MP" => (self.materials).constant(command, &self.known, &mut self.unread)?,
            "MPTE" => self.materials.temperatures(command, &self.known)?,
            "MPDA" => (self.materials).data(command, &self.known, &mut self.unread)?,
            "TREF" => self.materials.reference(command, &self.known)?,
            "/UNIT" => self.units(&command.label(0), command.line)?,
            "/COM" | "C***" => self.comment(command)?,
            "CMBL" => self.component_block(command, lines)?,
            "CM" => self.component(command),
            "CMGR" => self.component_group(command),
            "CMSE" => self.select_component(command),
            "NSEL" => self.select_nodes(command)?,
            "ALLS" => self.selection = DeckSelection::All,
            "NSLE" | "NSLK" | "NSLL" | "NSLA" | "NSLV" => {
                self.selection = DeckSelection::Unknown(command.line);
            }
            "D" if !self.solved => self.hold(command)?,
            "CSYS" => self.system(command)?,
            "LOCA" | "CLOC" | "CS" | "CSKP" | "CSWP" => self.elsewhere = Some(command.line),
            "*SET" => self.known.set(&command.label(0), command.field(1)),
            "SOLV" => self.solved = true,
            "/EOF" | "/EXI" | "/EXIT" => self.ended = true,
            key if CHANGING.contains(&key) => return Err(changing(command)),
            _ => self.not_read(command),
        }
        Ok(())
    }

    /// Whether a command stands between *IF and *ENDIF, or in a loop: these are not followed.
    fn is_skipped(&mut self, command: &DeckCommand) -> Result<bool, String> {
        let last = command.label(command.fields() - 1);
        match command.key() {
            "*IF" if last.starts_with("THEN") => self.depth += 1,
            "*DO" | "*DOWH" | "*CREA" => self.depth += 1,
            "*ENDI" | "*ENDD" | "*END" => {
                self.depth = self.depth.saturating_sub(1);
                return Ok(true);
            }
            "*ELSE" => return Ok(true),
            key if self.depth > 0 && (WEIGHTY.contains(&key) || CHANGING.contains(&key)) => {
                return Err(at(
                    command.line,
                    &format!(
                        "{} stands in a loop or under a condition, which is not followed: write the deck with CDWRITE, where all stands as it is",
                        command.title()
                    ),
                ));
            }
            _ => {
                if self.depth > 0 {
                    self.not_read(command);
                }
                return Ok(self.depth > 0);
            }
        }
        self.not_read(command);
        Ok(true)
    }

    fn not_read(&mut self, command: &DeckCommand) {
        self.in_unread = true;
        if !SILENT.contains(&command.key()) {
            self.unread.add(&command.title(), command.line);
        }
    }

    fn attribute(&self, command: &DeckCommand) -> Result<u64, String> {
        Ok(self.known.whole(command, 0)?.unwrap_or(1))
    }

    /// N,NODE,X,Y,Z,THXY,THYZ,THZX.
    fn node(&mut self, command: &DeckCommand) -> Result<(), String> {
        let line = command.line;
        if command.label(0).starts_with("R5") {
            // The end of a block of nodes.
            return Ok(());
        }
        if let Some(system) = self.elsewhere {
            return Err(at(
                line,
                &format!(
                    "the node is given in the system of coordinates of line {system}: write nodes in the global Cartesian one (CSYS,0)"
                ),
            ));
        }
        let next = self.last_node.saturating_add(1);
        let number = self.known.whole(command, 0)?.unwrap_or(next);
        let mut values = [0.0; 6];
        for (k, value) in values.iter_mut().enumerate() {
            *value = self.known.number(command, 1 + k)?.unwrap_or(0.0);
        }
        let [x, y, z, angles @ ..] = values;
        self.take_node(number, DVec3::new(x, y, z), &angles, line)
    }

    /// NROTAT: nodes get directions of their own.
    fn turn_node(&mut self, command: &DeckCommand) -> Result<(), String> {
        if let Some(first) = self.known.whole(command, 0).ok().flatten() {
            let last = self.known.whole(command, 1)?.unwrap_or(first);
            let turned = self.node_list().between(first, last, 1);
            self.turned.extend(turned);
        } else if let Ok(places) = self.selection.places(self.nodes.len()) {
            self.turned.extend(places);
        }
        Ok(())
    }

    /// ET,ITYPE,Ename,KOP1,…
    fn element_type(&mut self, command: &DeckCommand) -> Result<(), String> {
        let number = self.attribute(command)?;
        let word = command.field(1);
        let value = self.known.value(word).map(|x| format!("{x}"));
        let known = Routine::of(word).or_else(|| Routine::of(&value?));
        let routine = known.ok_or_else(|| {
            let what = format!("{} is no type of elements", quote(word));
            at(command.line, &what)
        })?;
        self.routines.insert(number, routine);
        self.note_membrane(number, self.known.number(command, 2)?, command.line);
        Ok(())
    }

    /// KEYOPT,ITYPE,KNUM,VALUE: one of all that are there changes what is computed here.
    fn key_option(&mut self, command: &DeckCommand) -> Result<(), String> {
        let number = self.attribute(command)?;
        if self.known.whole(command, 1)? == Some(1) {
            self.note_membrane(number, self.known.number(command, 2)?, command.line);
        }
        Ok(())
    }

    fn note_membrane(&mut self, kind: u64, option: Option<f64>, line: usize) {
        let is_shell = |routine: &Routine| routine.used == elements::Use::Shell;
        if self.routines.get(&kind).is_some_and(is_shell) && option.is_some_and(|o| o != 0.0) {
            self.soup.notes.push(format!(
                "line {line} makes membranes of shells (KEYOPT 1), which bend here all the same"
            ));
        }
    }

    /// E,I,J,… and EN,IEL,I,J,…: nodes from field `first` on.
    fn element(&mut self, command: &DeckCommand, first: usize) -> Result<(), String> {
        let next = self.last_element.saturating_add(1);
        let number = if first > 0 {
            self.known.whole(command, 0)?
        } else {
            None
        };
        let element = DeckElement {
            origin: ElementName::in_line(number.unwrap_or(next), command.line),
            line: command.line,
            kind: self.active.kind,
            material: self.active.material,
            section: self.active.section,
            nodes: self.node_fields(command, first)?,
        };
        self.take_element(element)
    }

    /// EMORE,Q,R,…: more nodes of the last element.
    fn more_nodes(&mut self, command: &DeckCommand) -> Result<(), String> {
        let more = self.node_fields(command, 0)?;
        let last = self.elements.last_mut().ok_or_else(|| {
            at(
                command.line,
                "EMORE adds nodes to an element, and none is there",
            )
        })?;
        last.nodes.extend(more);
        Ok(())
    }

    /// The nodes of a command, those after the last left out.
    fn node_fields(&self, command: &DeckCommand, first: usize) -> Result<Vec<u64>, String> {
        let fields = first..command.fields();
        let nodes = fields.map(|k| Ok(self.known.whole(command, k)?.unwrap_or(0)));
        let mut nodes: Vec<u64> = nodes.collect::<Result<_, String>>()?;
        while nodes.last() == Some(&0) {
            nodes.pop();
        }
        Ok(nodes)
    }

    /// SECTYPE,SECID,Type: what follows is of that section.
    fn begin_section(&mut self, command: &DeckCommand) -> Result<(), String> {
        self.section = self.attribute(command)?;
        self.thickness.remove(&self.section);
        Ok(())
    }

    /// SECDATA,TK,…: a layer.
    fn layer(&mut self, command: &DeckCommand) -> Result<(), String> {
        let thickness = self.known.number(command, 0)?.unwrap_or(0.0);
        *self.thickness.entry(self.section).or_default() += thickness;
        Ok(())
    }

    fn units(&mut self, label: &str, line: usize) -> Result<(), String> {
        if label.is_empty() || label == "USER" {
            return Ok(());
        }
        let Some(system) = UnitSystem::of_ansys(label, line) else {
            self.soup.notes.push(format!(
                "line {line} names units that are not known here ({}): mm, cm, m and inches are",
                quote(label)
            ));
            return Ok(());
        };
        match self.soup.said.system {
            Some(first) if (first.length, first.stress) != (system.length, system.stress) => {
                Err(at(
                    line,
                    &format!(
                        "it names {} as the unit of length, and line {} {}: keep the one that is right",
                        system.length.name(),
                        first.line,
                        first.length.name()
                    ),
                ))
            }
            _ => {
                self.soup.said.system.get_or_insert(system);
                Ok(())
            }
        }
    }

    /// What Mechanical says in a comment: “Data in consistent MKS units”.
    fn comment(&mut self, command: &DeckCommand) -> Result<(), String> {
        let words: Vec<&str> = command.text.split_whitespace().collect();
        let says = words.windows(3).find(|three| {
            three[0].eq_ignore_ascii_case("consistent") && three[2].starts_with("units")
        });
        says.map_or(Ok(()), |three| self.units(three[1], command.line))
    }

    fn system(&mut self, command: &DeckCommand) -> Result<(), String> {
        let global = self.known.whole(command, 0)?.unwrap_or(0) == 0;
        self.elsewhere = (!global).then_some(command.line);
        Ok(())
    }

    /// The nodes in the order of their numbers.
    fn node_list(&mut self) -> Nodes<'_> {
        let count = self.nodes.len();
        let kept = (self.numbered.take()).filter(|(of, _)| *of == count);
        let (_, numbered) = kept.unwrap_or_else(|| (count, Rc::new(Numbered::of(&self.nodes))));
        self.numbered = Some((count, Rc::clone(&numbered)));
        Nodes {
            numbered,
            positions: &self.soup.positions,
        }
    }

    fn select_nodes(&mut self, command: &DeckCommand) -> Result<(), String> {
        let count = self.nodes.len();
        let label = command.label(0);
        match label.as_str() {
            "ALL" => self.selection = DeckSelection::All,
            "NONE" => self.selection = DeckSelection::Only([].into()),
            "INVE" => self.selection = DeckSelection::Unknown(command.line),
            _ => {
                let known = std::mem::take(&mut self.known);
                let named = self.node_list().named(command, &known);
                self.known = known;
                // A place in another system is another place.
                let is_known = self.elsewhere.is_none() || command.label(1) != "LOC";
                let found = named?.filter(|_| is_known);
                self.selection.change(&label, found, count, command.line);
            }
        }
        Ok(())
    }

    /// CMSEL,Type,Name.
    fn select_component(&mut self, command: &DeckCommand) {
        let (label, name) = (command.label(0), command.field(1));
        if self.element_sets.known(name, command.line).is_ok() {
            // Which elements are selected says nothing of nodes.
            return;
        }
        let nodes = self.node_list().numbered;
        let set = self.node_sets.known(name, command.line).ok();
        let found = set.map(|set| self.node_sets.members(set, &nodes).found);
        let found = found.map(|places| places.into_iter().collect());
        let count = self.nodes.len();
        self.selection.change(&label, found, count, command.line);
    }

    /// CM,Cname,Entity: the nodes that are selected.
    fn component(&mut self, command: &DeckCommand) {
        let places = self.selection.places(self.nodes.len());
        let (Ok(places), "NODE") = (places, command.label(1).as_str()) else {
            return self.not_read(command);
        };
        let set = self.node_sets.open(command.field(0));
        let set = self.node_sets.at(set);
        set.numbers.clear();
        set.ranges.clear();
        set.sets.clear();
        let numbers = places
            .iter()
            .map(|&place| self.node_numbers[place as usize]);
        set.numbers.extend(numbers);
    }

    /// CMGRP,Aname,Cnam1,…: components as one.
    fn component_group(&mut self, command: &DeckCommand) {
        let fields = 1..command.fields();
        let names = fields
            .map(|k| command.field(k))
            .filter(|name| !name.is_empty());
        let members: Result<Vec<usize>, String> = names
            .map(|name| self.node_sets.known(name, command.line))
            .collect();
        let Ok(members) = members else {
            return self.not_read(command);
        };
        let group = self.node_sets.open(command.field(0));
        self.node_sets.at(group).sets.extend(members);
    }

    /// D,NODE,Lab,VALUE,VALUE2,NEND,NINC,Lab2,…,Lab6.
    fn hold(&mut self, command: &DeckCommand) -> Result<(), String> {
        let labels: Vec<String> = [1, 6, 7, 8, 9, 10].map(|k| command.label(k)).into();
        let dofs = labels.iter().fold(0, |all, label| all | dof(label).0);
        // A table, or what is no plain number, moves what it holds.
        let value = self.known.number(command, 2);
        let moved = value.map_or(1.0, |value| value.unwrap_or(0.0));
        if dofs == 0 || moved != 0.0 {
            self.not_read(command);
            return Ok(());
        }
        let Some(places) = self.held_places(command)? else {
            self.not_read(command);
            return Ok(());
        };
        let full = DofSet::DISPLACEMENTS.0;
        let turned = dofs & full != full && places.iter().any(|place| self.turned.contains(place));
        if turned {
            // Directions of its own: no mirror plane of ours.
            self.not_read(command);
            return Ok(());
        }
        for place in places {
            self.held.hold(place, DofSet(dofs));
        }
        Ok(())
    }

    /// The nodes that a D speaks of; nothing where that could not be followed.
    fn held_places(&mut self, command: &DeckCommand) -> Result<Option<Vec<u32>>, String> {
        let word = command.field(0);
        if word.eq_ignore_ascii_case("ALL") {
            return Ok(self.selection.places(self.nodes.len()).ok());
        }
        if let Ok(Some(first)) = self.known.whole(command, 0) {
            let last = self.known.whole(command, 4)?.unwrap_or(first);
            let step = self.known.whole(command, 5)?.unwrap_or(1).max(1);
            let found = self.node_list().between(first, last, step);
            return Ok(Some(found.into_iter().collect()).filter(|f: &Vec<u32>| !f.is_empty()));
        }
        let Ok(set) = self.node_sets.known(word, command.line) else {
            return Ok(None);
        };
        let nodes = self.node_list().numbered;
        Ok(Some(self.node_sets.members(set, &nodes).found))
    }
}

/// Why a command that changes the mesh is refused.
fn changing(command: &DeckCommand) -> String {
    at(
        command.line,
        &format!(
            "{} makes, moves or removes nodes or elements, or reads another file, which is not carried out: write the deck with CDWRITE, where all stands as it is",
            command.title()
        ),
    )
}

/// The degrees of freedom of a label of D.
fn dof(label: &str) -> DofSet {
    let one = ["UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"];
    match (label, one.iter().position(|known| *known == label)) {
        (_, Some(index)) => DofSet::of(&[index]),
        ("ALL", _) => DofSet::ALL,
        _ => DofSet::default(),
    }
}
