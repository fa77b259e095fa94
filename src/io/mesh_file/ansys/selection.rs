//! Which nodes are selected, and components: what D,ALL and CM speak of.

use std::collections::BTreeSet;
use std::rc::Rc;

use glam::DVec3;

use super::command::{DeckCommand, Parameters};
use crate::io::mesh_file::sets::Numbered;

/// What is selected.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum DeckSelection {
    #[default]
    All,
    Only(BTreeSet<u32>),
    /// By a command that is not followed, in this line.
    Unknown(usize),
}

impl DeckSelection {
    /// The places of what is selected among so many nodes; the line of what could not be followed.
    ///
    /// # Errors
    /// That line.
    pub fn places(&self, nodes: usize) -> Result<Vec<u32>, usize> {
        match self {
            Self::All => Ok((0..nodes as u32).collect()),
            Self::Only(places) => Ok(places.iter().copied().collect()),
            Self::Unknown(line) => Err(*line),
        }
    }

    /// Selects anew, in addition, without or among, as the label S, A, U or R of a command says; `found` is nothing
    /// for what is not followed.
    pub fn change(&mut self, label: &str, found: Option<BTreeSet<u32>>, nodes: usize, line: usize) {
        let Some(found) = found else {
            *self = Self::Unknown(line);
            return;
        };
        let before = self.places(nodes);
        *self = match (label, before) {
            ("S" | "", _) => Self::Only(found),
            (_, Err(line)) => Self::Unknown(line),
            ("A", Ok(before)) => Self::Only(before.into_iter().chain(found).collect()),
            ("U", Ok(before)) => {
                Self::Only(before.into_iter().filter(|n| !found.contains(n)).collect())
            }
            ("R", Ok(before)) => {
                Self::Only(before.into_iter().filter(|n| found.contains(n)).collect())
            }
            _ => Self::Unknown(line),
        };
    }
}

/// The nodes of a deck by number and place.
pub struct Nodes<'n> {
    pub numbered: Rc<Numbered>,
    pub positions: &'n [DVec3],
}

impl Nodes<'_> {
    /// What NSEL,Type,Item,Comp,VMIN,VMAX,VINC names; nothing where that is not followed.
    ///
    /// # Errors
    /// A message naming the line of a word that is no number.
    pub fn named(
        &self,
        command: &DeckCommand,
        known: &Parameters,
    ) -> Result<Option<BTreeSet<u32>>, String> {
        let item = command.label(1);
        if item.starts_with("NODE") || item.is_empty() {
            let first = known.whole(command, 3)?.unwrap_or(0);
            let last = known.whole(command, 4)?.unwrap_or(first);
            let step = known.whole(command, 5)?.unwrap_or(1).max(1);
            return Ok(Some(self.between(first, last, step)));
        }
        let axis = ["X", "Y", "Z"].iter().position(|a| *a == command.label(2));
        let (Some(axis), "LOC") = (axis, item.as_str()) else {
            return Ok(None);
        };
        let least = known.number(command, 3)?.unwrap_or(0.0);
        let most = known.number(command, 4)?.unwrap_or(least);
        let slack = slack(least, most);
        let within = least - slack..=most + slack;
        let places = (0..).zip(self.positions);
        let found = places.filter(|(_, p)| within.contains(&p[axis]));
        Ok(Some(found.map(|(place, _)| place).collect()))
    }

    /// Nodes from one number to another in steps.
    #[must_use]
    pub fn between(&self, first: u64, last: u64, step: u64) -> BTreeSet<u32> {
        let between = self.numbered.between(first, last).iter();
        let in_step = between.filter(|(number, _)| (number - first).is_multiple_of(step));
        in_step.map(|&(_, place)| place).collect()
    }
}

/// How far beyond what is asked for a node may lie, as Ansys has it.
fn slack(least: f64, most: f64) -> f64 {
    const SHARE: f64 = 0.005;
    if most != least {
        SHARE * (most - least).abs()
    } else if least != 0.0 {
        SHARE * least.abs()
    } else {
        1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::super::command::{Statement, statements};
    use super::*;

    fn set(places: &[u32]) -> BTreeSet<u32> {
        places.iter().copied().collect()
    }

    #[test]
    fn selections_are_changed_step_by_step() {
        let mut selection = DeckSelection::default();
        assert_eq!(selection.places(3), Ok(vec![0, 1, 2]));
        selection.change("S", Some(set(&[1, 2])), 9, 1);
        selection.change("A", Some(set(&[5])), 9, 2);
        selection.change("U", Some(set(&[1])), 9, 3);
        assert_eq!(selection.places(9), Ok(vec![2, 5]));
        selection.change("R", Some(set(&[5, 7])), 9, 4);
        assert_eq!(selection, DeckSelection::Only(set(&[5])));
        selection.change("A", None, 9, 5);
        selection.change("A", Some(set(&[5])), 9, 6);
        assert_eq!(selection.places(9), Err(5));
        selection.change("S", Some(set(&[5])), 9, 7);
        assert_eq!(selection.places(9), Ok(vec![5]));
    }

    #[test]
    fn nodes_are_named_by_number_and_place() {
        let positions: Vec<DVec3> = (0..5).map(|k| DVec3::X * f64::from(k)).collect();
        let nodes = Nodes {
            numbered: Rc::new(Numbered::of(&(101..106).zip(0..).collect())),
            positions: &positions,
        };
        let known = Parameters::default();
        for (line, places) in [
            ("nsel,s,node,,102,106,2", Some(&[1, 3][..])),
            ("nsel,s,,,104", Some(&[3][..])),
            ("nsel,s,loc,x,0", Some(&[0][..])),
            ("nsel,s,loc,x,1,3", Some(&[1, 2, 3][..])),
            ("nsel,s,ext", None),
        ] {
            let Some(Statement::Command(command)) = statements(line, 1).pop() else {
                panic!("{line}");
            };
            let named = nodes.named(&command, &known).unwrap();
            assert_eq!(named, places.map(set), "{line}");
        }
    }
}
