//! Blocks of a deck: lines of numbers in fields of fixed width that follow a command.

use glam::DVec3;

use super::command::{DeckCommand, DeckLines};
use super::elements::{DeckElement, Routine};
use super::format::FieldWidths;
use super::reader::DeckReader;
use crate::io::mesh_file::place::{ElementName, FilePlace};
use crate::io::mesh_file::sets::NumberRange;
use crate::io::mesh_file::tetrahedra::bounded;
use crate::io::mesh_file::words::{at, fortran};

/// Most nodes of an element.
const MOST_NODES: i64 = 64;

/// How a block was read.
#[derive(Default)]
struct BlockTally {
    read: u64,
    /// Whether its end stands there.
    ended: bool,
}

impl BlockTally {
    /// Refuses a block that was cut; `announced` is how many things it says that it has.
    fn check(
        &self,
        command: &DeckCommand,
        what: &str,
        announced: Option<u64>,
    ) -> Result<(), String> {
        match announced {
            Some(count) if self.read < count => Err(at(
                command.line,
                &format!(
                    "{} announces {count} {what}, and {} are there: the file was cut, or the count is wrong",
                    command.title(),
                    self.read
                ),
            )),
            None if !self.ended => Err(at(
                command.line,
                &format!(
                    "{} does not end (with -1) after {} {what}: the file was cut",
                    command.title(),
                    self.read
                ),
            )),
            _ => Ok(()),
        }
    }
}

/// The format that follows a command.
fn format_of(command: &DeckCommand, lines: &mut DeckLines) -> Result<FieldWidths, String> {
    let (line, text) = lines.next().ok_or_else(|| {
        let what = format!("the file was cut after {}", command.title());
        at(command.line, &what)
    })?;
    FieldWidths::of(text, line)
}

/// The deck's number of a node or an element.
fn number(field: i64, line: usize) -> Result<u64, String> {
    u64::try_from(field)
        .map_err(|_| at(line, &format!("{field} is no number of a node or element")))
}

/// Likewise of several.
fn numbers(fields: &[i64], line: usize) -> Result<Vec<u64>, String> {
    fields.iter().map(|&field| number(field, line)).collect()
}

impl DeckReader {
    /// NBLOCK,NUMFIELD,Solkey,NDMAX,NDSEL: number, …, three coordinates, and angles.
    pub(super) fn node_block(
        &mut self,
        command: &DeckCommand,
        lines: &mut DeckLines,
    ) -> Result<(), String> {
        let format = format_of(command, lines)?;
        if format.real_fields() < 3 {
            let what = "the format of the nodes has no three coordinates";
            return Err(at(command.line + 1, what));
        }
        let announced = self.known.whole(command, 3)?;
        bounded(announced.unwrap_or(0), FilePlace::Line(command.line))?;
        let mut tally = BlockTally::default();
        while let Some((line, text)) = lines.next_of_block() {
            let (whole, mut real) = format.numbers(text, line)?;
            let Some(&first) = whole.first() else {
                continue;
            };
            if first == -1 {
                tally.ended = true;
                break;
            }
            if real.len() < 3 {
                real.resize(3, 0.0);
            }
            let position = DVec3::new(real[0], real[1], real[2]);
            self.take_node(number(first, line)?, position, &real[3..], line)?;
            tally.read += 1;
        }
        // CDWRITE ends them with N,R5.3,LOC,-1.
        let after = lines.peek().unwrap_or_default().1.trim_start();
        let is_end = after
            .get(..4)
            .is_some_and(|a| a.eq_ignore_ascii_case("N,R5"));
        tally.ended |= is_end;
        self.note_numbers(command)?;
        tally.check(command, "nodes", announced)
    }

    /// Says where far larger numbers are announced than there are: the file may have been cut.
    fn note_numbers(&mut self, command: &DeckCommand) -> Result<(), String> {
        let announced = self.known.whole(command, 2)?.unwrap_or(0);
        if announced / 2 > self.last_node {
            self.soup.notes.push(format!(
                "line {} announces nodes with numbers up to {announced}, and the last has {}: there may be others in another file",
                command.line, self.last_node
            ));
        }
        Ok(())
    }

    /// EBLOCK,NUMFIELD,Solkey,NDMAX,NDSEL: elements with all that belongs to them (SOLID), or those of the active type.
    pub(super) fn element_block(
        &mut self,
        command: &DeckCommand,
        lines: &mut DeckLines,
    ) -> Result<(), String> {
        let format = format_of(command, lines)?;
        let solid = command.label(1).starts_with("SOL");
        let announced = self.known.whole(command, 3)?;
        let mut tally = BlockTally::default();
        while let Some((line, text)) = lines.next_of_block() {
            let (fields, _) = format.numbers(text, line)?;
            if fields.is_empty() {
                continue;
            }
            if fields[0] == -1 {
                tally.ended = true;
                break;
            }
            let element = if solid {
                whole_element(&fields, line, &format, lines)?
            } else {
                self.short_element(&fields, line)?
            };
            self.take_element(element)?;
            tally.read += 1;
        }
        tally.check(command, "elements", announced)
    }

    /// An element of the active type: number, section, real constants, material, system, nodes.
    fn short_element(&self, fields: &[i64], line: usize) -> Result<DeckElement, String> {
        let [tag, section, _, material, _, nodes @ ..] = fields else {
            return Err(cut_off(line, 0));
        };
        let mut nodes = numbers(nodes, line)?;
        while nodes.last() == Some(&0) {
            nodes.pop();
        }
        Ok(DeckElement {
            origin: ElementName::in_line(number(*tag, line)?, line),
            line,
            kind: self.active.kind,
            material: number(*material, line)?,
            section: number(*section, line)?,
            nodes,
        })
    }

    /// ETBLOCK: number and routine of each type of elements.
    pub(super) fn element_types(&mut self, lines: &mut DeckLines) -> Result<(), String> {
        // Its format has words too.
        lines.next();
        while let Some((line, text)) = lines.next_of_block() {
            let mut words = text.split_whitespace();
            let (tag, routine) = (words.next(), words.next());
            if tag == Some("-1") {
                break;
            }
            let tag = tag.and_then(|tag| tag.parse().ok());
            let known = tag.zip(routine.and_then(Routine::of));
            let (tag, routine) = known.ok_or_else(|| at(line, "here is no type of elements"))?;
            self.routines.insert(tag, routine);
        }
        Ok(())
    }

    /// CMBLOCK,Cname,Entity,NUMITEMS: numbers of nodes or elements; a negative one ends a range.
    pub(super) fn component_block(
        &mut self,
        command: &DeckCommand,
        lines: &mut DeckLines,
    ) -> Result<(), String> {
        let count = self.known.whole(command, 2)?.unwrap_or(0);
        let format = format_of(command, lines)?;
        let mut items = Vec::new();
        while (items.len() as u64) < count {
            let Some((line, text)) = lines.next_of_block() else {
                let what = format!(
                    "{} announces {count} numbers, and {} are there: the file was cut",
                    command.title(),
                    items.len()
                );
                return Err(at(command.line, &what));
            };
            items.extend(format.numbers(text, line)?.0);
        }
        let sets = match command.label(1) {
            entity if entity.starts_with("NODE") => &mut self.node_sets,
            entity if entity.starts_with("ELEM") => &mut self.element_sets,
            _ => {
                self.unread.add(&command.title(), command.line);
                return Ok(());
            }
        };
        let set = sets.open(command.field(0));
        let set = sets.at(set);
        set.numbers.clear();
        set.ranges.clear();
        set.sets.clear();
        let mut before = 0;
        for item in items {
            let (first, last) = (before + 1, item.unsigned_abs());
            if item >= 0 {
                set.numbers.push(last);
            } else if first <= last {
                set.ranges.push(NumberRange {
                    first,
                    last,
                    step: 1,
                });
            }
            before = last;
        }
        Ok(())
    }

    /// SECBLOCK,N: thickness, and more, of each layer.
    pub(super) fn layers(
        &mut self,
        command: &DeckCommand,
        lines: &mut DeckLines,
    ) -> Result<(), String> {
        let count = self.known.whole(command, 0)?.unwrap_or(0);
        for _ in 0..count {
            let Some((line, text)) = lines.next_of_block() else {
                let what = format!(
                    "{} announces {count} layers: the file was cut",
                    command.title()
                );
                return Err(at(command.line, &what));
            };
            let first = text.split(',').next().unwrap_or_default().trim();
            let layers = self.thickness.entry(self.section).or_default();
            *layers += fortran(first, line)?;
        }
        Ok(())
    }
}

/// An element with all that belongs to it: material, type, real constants, section, system, three keys, how many nodes,
/// another key, number, and the nodes, which go on in the next line where there are many.
fn whole_element(
    fields: &[i64],
    line: usize,
    format: &FieldWidths,
    lines: &mut DeckLines,
) -> Result<DeckElement, String> {
    let [
        material,
        kind,
        _,
        section,
        _,
        _,
        _,
        _,
        count,
        _,
        tag,
        nodes @ ..,
    ] = fields
    else {
        return Err(cut_off(line, 0));
    };
    if !(1..=MOST_NODES).contains(count) {
        let what =
            format!("an element of {count} nodes is none: its fields are not as EBLOCK has them");
        return Err(at(line, &what));
    }
    let count = *count as usize;
    let mut nodes = numbers(nodes, line)?;
    while nodes.len() < count {
        let before = nodes.len();
        if let Some((line, text)) = lines.next_of_block() {
            let (more, _) = format.numbers(text, line)?;
            if more.first().is_some_and(|&field| field != -1) {
                nodes.extend(numbers(&more, line)?);
            }
        }
        if nodes.len() == before {
            return Err(at(
                line,
                &format!("the element is cut off: {before} of its {count} nodes are there"),
            ));
        }
    }
    nodes.truncate(count);
    Ok(DeckElement {
        origin: ElementName::in_line(number(*tag, line)?, line),
        line,
        kind: number(*kind, line)?,
        material: number(*material, line)?,
        section: number(*section, line)?,
        nodes,
    })
}

fn cut_off(line: usize, nodes: usize) -> String {
    at(
        line,
        &format!("the element is cut off: {nodes} of its nodes are there"),
    )
}
