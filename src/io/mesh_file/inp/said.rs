//! What an input file says of the material and of what is held.

use std::collections::{BTreeMap, HashMap};

use super::keyword::{Keyword, values};
use crate::elasticity::DofSet;
use crate::io::mesh_file::held::{HeldNodes, NodeSet};
use crate::io::mesh_file::words::{fortran, listed, whole};
use crate::plain;
use crate::project::SupportKeys;

/// The first isotropic elastic constants of the file.
#[derive(Default)]
pub struct Elastic {
    constants: Option<[f64; 2]>,
    /// Lines of constants: one for each material and temperature.
    lines: usize,
    /// Whether the file is more than a mesh: it speaks of a material.
    meant: bool,
}

impl Elastic {
    /// Notices that a keyword speaks of a material.
    pub fn notice(&mut self, keyword: &Keyword) {
        self.meant |= keyword.name == "MATERIAL" || keyword.name.ends_with(" SECTION");
    }

    /// Whether the lines after a keyword are constants of an isotropic material.
    #[must_use]
    pub fn is_read(keyword: &Keyword) -> bool {
        let kind = keyword.option("TYPE").unwrap_or_default().to_uppercase();
        kind.is_empty() || kind.starts_with("ISO")
    }

    /// Takes a line: Young's modulus, Poisson's ratio, and maybe more.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn take(&mut self, words: &str, line: usize) -> Result<(), String> {
        let mut words = values(words);
        let modulus = fortran(words.next().unwrap_or_default(), line)?;
        let ratio = match words.next() {
            None | Some("") => 0.0,
            Some(word) => fortran(word, line)?,
        };
        self.constants.get_or_insert([modulus, ratio]);
        self.lines += 1;
        Ok(())
    }

    /// Young's modulus, in the file's unit, and Poisson's ratio.
    pub fn material(&self, notes: &mut Vec<String>) -> Option<[f64; 2]> {
        if self.lines > 1 {
            notes.push(format!(
                "the file has {} elastic materials or temperatures: the first is taken",
                self.lines
            ));
        }
        if self.meant && self.constants.is_none() {
            notes.push(
                "the file has no elastic constants that are read (*ELASTIC of an isotropic material): the project's are taken".to_owned(),
            );
        }
        self.constants
    }
}

/// What is held, of nodes and sets by their names in the file, in capitals.
#[derive(Default)]
pub struct Boundaries {
    held: BTreeMap<String, DofSet>,
    /// Lines that move what they hold, or do not say degrees of freedom of displacement.
    others: usize,
    steps: usize,
    /// Whether the step has begun anew with what is held.
    anew: bool,
}

impl Boundaries {
    /// Whether the lines after a keyword say what is held from the start or in the first step. The first one of that
    /// step with OP=NEW lets go all that was held before.
    #[must_use]
    pub fn begin(&mut self, keyword: &Keyword) -> bool {
        if self.steps > 1 {
            return false;
        }
        let op = keyword.option("OP").unwrap_or_default();
        if self.steps == 1 && op.eq_ignore_ascii_case("NEW") && !self.anew {
            self.held.clear();
            (self.others, self.anew) = (0, true);
        }
        let kind = keyword.option("TYPE").unwrap_or_default().to_uppercase();
        kind.is_empty() || kind == "DISPLACEMENT"
    }

    pub fn begin_step(&mut self) {
        self.steps += 1;
    }

    /// Takes a line: a node or a set, and its first and last degree of freedom, or a name for several.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn take(&mut self, words: &str, line: usize) -> Result<(), String> {
        let words: Vec<&str> = values(words).collect();
        let word = |k: usize| words.get(k).copied().unwrap_or_default();
        let held = named(word(1)).map_or_else(|| numbered(word(1), word(2), line), Ok)?;
        let value = word(3);
        let moved = !value.is_empty() && fortran(value, line)? != 0.0;
        if moved || held == DofSet::default() {
            self.others += 1;
        } else {
            let name = word(0).trim_matches('"').to_uppercase();
            self.held.entry(name).or_default().0 |= held.0;
        }
        Ok(())
    }

    /// The supports that this is, on sets of nodes; `places` are the nodes by the file's numbers.
    pub fn supports(
        &self,
        places: &HashMap<u64, u32>,
        sets: &mut Vec<NodeSet>,
        notes: &mut Vec<String>,
    ) -> Vec<SupportKeys> {
        let mut all = HeldNodes::default();
        let mut unknown: Vec<&str> = Vec::new();
        for (name, dofs) in &self.held {
            let nodes = nodes_of(name, places, sets);
            if nodes.is_empty() {
                unknown.push(name);
            }
            for node in nodes {
                all.hold(node, *dofs);
            }
        }
        if !unknown.is_empty() {
            notes.push(format!(
                "*BOUNDARY holds what is no node or set of the file, and nothing here: {}",
                listed(&unknown)
            ));
        }
        if self.others > 0 {
            notes.push(format!(
                "left out: {} of *BOUNDARY that move what is held, or hold no displacement",
                plain::count(self.others, "line")
            ));
        }
        all.supports(true, sets, notes)
    }
}

/// Freedoms by their common name.
fn named(word: &str) -> Option<DofSet> {
    Some(match word.to_uppercase().as_str() {
        "ENCASTRE" => DofSet::ALL,
        "PINNED" => DofSet::DISPLACEMENTS,
        "XSYMM" => DofSet::symmetry(0),
        "YSYMM" => DofSet::symmetry(1),
        "ZSYMM" => DofSet::symmetry(2),
        _ => return None,
    })
}

/// Freedoms from one number to another, those beyond the six left out; a name that is not known is none.
fn numbered(first: &str, last: &str, line: usize) -> Result<DofSet, String> {
    if first.starts_with(char::is_alphabetic) {
        return Ok(DofSet::default());
    }
    let first = whole(first, line)?;
    let last = match last {
        "" => first,
        word => whole(word, line)?,
    };
    let among = (1..=6_u64)
        .zip(0..)
        .filter(|(k, _)| (first..=last).contains(k));
    let held: Vec<usize> = among.map(|(_, index)| index).collect();
    Ok(DofSet::of(&held))
}

/// The nodes of a set, whichever instance it is said to be of, or the one of a number.
fn nodes_of(name: &str, places: &HashMap<u64, u32>, sets: &[NodeSet]) -> Vec<u32> {
    if let Ok(number) = name.parse::<u64>() {
        return places.get(&number).copied().into_iter().collect();
    }
    let own = name.rsplit('.').next().unwrap_or(name);
    let found = sets
        .iter()
        .find(|(set, _)| set.eq_ignore_ascii_case(name) || set.eq_ignore_ascii_case(own));
    found.map(|(_, nodes)| nodes.clone()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_may_begin_anew_with_what_is_held() {
        let of = |op: &str| {
            let mut said = Boundaries::default();
            let boundary = |op: &str| Keyword::of(&format!("*BOUNDARY{op}"), 1);
            for (step, op, line) in [(0, "", "1, 1, 3"), (1, op, "2, 1"), (0, op, "3, 2")] {
                (0..step).for_each(|_| said.begin_step());
                assert!(said.begin(&boundary(op)));
                said.take(line, 1).unwrap();
            }
            said.begin_step();
            assert!(!said.begin(&boundary(op)));
            said.held.into_keys().collect::<Vec<_>>()
        };
        assert_eq!(of(""), ["1", "2", "3"]);
        assert_eq!(of(", OP=MOD"), ["1", "2", "3"]);
        assert_eq!(of(", op=new"), ["2", "3"]);
    }

    #[test]
    fn what_is_held_may_be_said_in_many_ways() {
        let mut said = Boundaries::default();
        for line in [
            "foot, 1, 3",
            "Part-1-1.FOOT, 2",
            "7, XSYMM",
            "7, 1, 3, 0.5",
            "7, 11",
            "nowhere, PINNED",
        ] {
            said.take(line, 1).unwrap();
        }
        assert!(said.take("foot, x1", 1).is_ok());
        assert!(said.take("foot, 1, z", 3).unwrap_err().contains("line 3"));
        let places = HashMap::from([(1, 0), (2, 1), (7, 2)]);
        let mut sets = vec![("Foot".to_owned(), vec![0, 1])];
        let mut notes = Vec::new();
        let supports = said.supports(&places, &mut sets, &mut notes);
        let names: Vec<_> = supports.iter().filter_map(|s| s.vertices.clone()).collect();
        assert_eq!(names, ["Foot", "held along x"]);
        assert_eq!(notes.len(), 2, "{notes:?}");
    }

    #[test]
    fn the_first_material_is_taken() {
        let mut elastic = Elastic::default();
        let mut notes = Vec::new();
        assert_eq!(elastic.material(&mut notes), None);
        elastic.take("1.7D+03, 0.394,", 1).unwrap();
        elastic.take("900., .4, 60.", 2).unwrap();
        assert_eq!(elastic.material(&mut notes), Some([1700.0, 0.394]));
        assert!(notes[0].contains("2 elastic"), "{notes:?}");
        assert!(elastic.take("stiff", 3).is_err());
    }
}
