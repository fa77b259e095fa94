//! Named sets of nodes or of elements: numbers, ranges of them, and other sets. What they name is looked up among
//! what is there, so that a set costs no more than the file it stands in.

use std::collections::{BTreeSet, HashMap};

use crate::memory;

/// Numbers from one to another in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberRange {
    pub first: u64,
    pub last: u64,
    /// At least one.
    pub step: u64,
}

impl NumberRange {
    fn count(&self) -> u64 {
        ((self.last - self.first) / self.step).saturating_add(1)
    }

    /// Whether another range, that begins later, goes on where this one ends or before.
    fn meets(&self, later: &Self) -> bool {
        let in_step = self.step == later.step && self.first % self.step == later.first % self.step;
        in_step && later.first <= self.last.saturating_add(self.step)
    }

    fn find(&self, things: &Numbered) -> Vec<u32> {
        let between = things.between(self.first, self.last);
        if self.count() < between.len() as u64 {
            let numbers = (self.first..=self.last).step_by(self.step as usize);
            return numbers.filter_map(|number| things.get(number)).collect();
        }
        let in_step = |thing: &&(u64, u32)| (thing.0 - self.first).is_multiple_of(self.step);
        between
            .iter()
            .filter(in_step)
            .map(|thing| thing.1)
            .collect()
    }
}

/// The same numbers in fewer ranges: those that meet become one.
fn joined(ranges: &[NumberRange]) -> Vec<NumberRange> {
    let mut sorted = ranges.to_vec();
    sorted.sort_unstable_by_key(|r| (r.step, r.first % r.step, r.first));
    let mut joined: Vec<NumberRange> = Vec::new();
    for range in sorted {
        match joined.last_mut() {
            Some(last) if last.meets(&range) => last.last = last.last.max(range.last),
            _ => joined.push(range),
        }
    }
    joined
}

/// Nodes or elements by their numbers in the file.
pub struct Numbered {
    /// Number in the file and place in our list, rising.
    sorted: Vec<(u64, u32)>,
}

impl Numbered {
    #[must_use]
    pub fn of(places: &HashMap<u64, u32>) -> Self {
        let mut sorted: Vec<(u64, u32)> = places.iter().map(|(&n, &at)| (n, at)).collect();
        sorted.sort_unstable();
        Self { sorted }
    }

    #[must_use]
    pub fn get(&self, number: u64) -> Option<u32> {
        let found = self.sorted.binary_search_by_key(&number, |thing| thing.0);
        found.ok().map(|at| self.sorted[at].1)
    }

    /// Those from one number to another, by number and place; none where the other is smaller.
    #[must_use]
    pub fn between(&self, first: u64, last: u64) -> &[(u64, u32)] {
        let from = self.sorted.partition_point(|thing| thing.0 < first);
        let to = self.sorted.partition_point(|thing| thing.0 <= last);
        self.sorted.get(from..to).unwrap_or_default()
    }
}

/// What was said of one set.
#[derive(Default)]
pub struct NamedSet {
    pub name: String,
    pub numbers: Vec<u64>,
    pub ranges: Vec<NumberRange>,
    /// Other sets that belong to it.
    pub sets: BTreeSet<usize>,
    /// Of a set of nodes: sets of elements whose nodes belong to it.
    pub of_elements: BTreeSet<usize>,
}

/// What a set names.
#[derive(Default)]
pub struct SetMembers {
    /// Places in our list, each once, rising.
    pub found: Vec<u32>,
    /// Numbers of what is not there.
    pub missing: u64,
    /// Sets of elements whose nodes belong to it.
    pub of_elements: BTreeSet<usize>,
}

/// Most sets of nodes, and of elements, of a file.
const MOST: usize = 10_000;

/// Refuses more sets than there is memory for, each taken for all nodes.
///
/// # Errors
/// A message with what to do.
pub fn check_count(sets: usize, nodes: usize) -> Result<(), String> {
    /// Bytes for a node in a set: its number, and its place in the mask.
    const A_NODE: f64 = 5.0;
    let bytes = A_NODE * sets as f64 * nodes as f64;
    if sets <= MOST && bytes <= memory::allowed() {
        return Ok(());
    }
    Err(format!(
        "it has {sets} sets on {nodes} nodes: keep only the sets that the project names, no more than {MOST}"
    ))
}

/// Sets by name; capitals make no difference.
#[derive(Default)]
pub struct Sets {
    all: Vec<NamedSet>,
    places: HashMap<String, usize>,
}

impl Sets {
    #[must_use]
    pub fn len(&self) -> usize {
        self.all.len()
    }

    #[must_use]
    pub fn name(&self, set: usize) -> &str {
        &self.all[set].name
    }

    /// The set of a name, empty where it is new.
    pub fn open(&mut self, name: &str) -> usize {
        let place = self.places.entry(name.to_uppercase());
        *place.or_insert_with(|| {
            self.all.push(NamedSet {
                name: name.to_owned(),
                ..NamedSet::default()
            });
            self.all.len() - 1
        })
    }

    /// The set of a name that is known already.
    ///
    /// # Errors
    /// A message naming the line where it is named.
    pub fn known(&self, name: &str, line: usize) -> Result<usize, String> {
        let found = self.places.get(&name.trim_matches('"').to_uppercase());
        found.copied().ok_or_else(|| {
            format!(
                "line {line}: there is no set {} up to here",
                crate::plain::quote(name)
            )
        })
    }

    /// A set, to add to it.
    pub fn at(&mut self, set: usize) -> &mut NamedSet {
        &mut self.all[set]
    }

    /// What a set and those that belong to it name among the things that are there.
    #[must_use]
    pub fn members(&self, set: usize, things: &Numbered) -> SetMembers {
        let mut members = SetMembers::default();
        for set in self.with_its_sets(set) {
            let set = &self.all[set];
            let before = members.found.len();
            let found = set.numbers.iter().filter_map(|&number| things.get(number));
            members.found.extend(found);
            let mut named = set.numbers.len() as u64;
            for range in joined(&set.ranges) {
                members.found.extend(range.find(things));
                named = named.saturating_add(range.count());
            }
            let found = (members.found.len() - before) as u64;
            members.missing = members.missing.saturating_add(named - found);
            members.of_elements.extend(&set.of_elements);
        }
        members.found.sort_unstable();
        members.found.dedup();
        members
    }

    fn with_its_sets(&self, set: usize) -> BTreeSet<usize> {
        let mut reached = BTreeSet::new();
        let mut open = vec![set];
        while let Some(set) = open.pop() {
            if reached.insert(set) {
                open.extend(&self.all[set].sets);
            }
        }
        reached
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ten() -> Numbered {
        Numbered::of(&(1..=10).map(|n| (u64::from(n) * 10, n)).collect())
    }

    #[test]
    fn ranges_cost_what_is_there() {
        let range = |first, last, step| NumberRange { first, last, step };
        let mut sets = Sets::default();
        let all = sets.open("all");
        let bombs = (0..100_000).map(|k| range(1 + k % 3, u64::MAX - 1 - k % 5, 1));
        sets.at(all).ranges.extend(bombs);
        assert_eq!(sets.members(all, &ten()).found.len(), 10);
        let few = sets.open("few");
        sets.at(few)
            .ranges
            .extend([range(10, 90, 40), range(20, 20, 7)]);
        let members = sets.members(few, &ten());
        assert_eq!((members.found, members.missing), (vec![1, 2, 5, 9], 0));
        // 15 and 25 are not there.
        sets.at(few).ranges.push(range(15, 25, 10));
        assert_eq!(sets.members(few, &ten()).missing, 2);
    }

    #[test]
    fn a_set_may_hold_itself() {
        let mut sets = Sets::default();
        let (a, b) = (sets.open("a"), sets.open("B"));
        assert_eq!(sets.open("A"), a);
        sets.at(a).numbers.push(20);
        sets.at(a).sets.extend([a, b]);
        sets.at(b).sets.insert(a);
        assert_eq!(sets.members(b, &ten()).found, [2]);
        assert!(sets.known("c", 7).unwrap_err().contains("line 7"));
    }
}
