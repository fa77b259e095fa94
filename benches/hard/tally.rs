//! What came of many inputs.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::hard::property;

/// Of some inputs of one reader. It travels from the process that reads to the one that watches.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Tally {
    /// Number after the last input that is counted here.
    pub next: u64,
    pub inputs: u64,
    pub taken: u64,
    /// Spent reading.
    pub seconds: f64,
    /// Seconds and number of the slowest input.
    pub slowest: (f64, u64),
    /// Bytes that were held at most, and by which input.
    pub largest: (u64, u64),
    /// Messages and caught panics, by their shape.
    pub said: BTreeMap<String, Kind>,
    pub caught: BTreeMap<String, Kind>,
    /// Numbers of inputs for which something did not hold, and what.
    pub wrong: Vec<(u64, String)>,
}

/// Messages that differ in numbers and quotations only.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Kind {
    pub count: u64,
    /// Number of the first input.
    pub first: u64,
    pub example: String,
}

impl Tally {
    pub fn add(&mut self, later: Self) {
        self.next = self.next.max(later.next);
        self.inputs += later.inputs;
        self.taken += later.taken;
        self.seconds += later.seconds;
        if later.slowest.0 > self.slowest.0 {
            self.slowest = later.slowest;
        }
        if later.largest.0 > self.largest.0 {
            self.largest = later.largest;
        }
        merge(&mut self.said, later.said);
        merge(&mut self.caught, later.caught);
        self.wrong.extend(later.wrong);
    }

    /// What did not hold, by its shape.
    pub fn kinds_of_wrong(&self) -> BTreeMap<String, Vec<&(u64, String)>> {
        let mut kinds: BTreeMap<String, Vec<&(u64, String)>> = BTreeMap::new();
        for one in &self.wrong {
            kinds.entry(property::shape(&one.1)).or_default().push(one);
        }
        kinds
    }
}

/// Counts one more message.
pub fn count(kinds: &mut BTreeMap<String, Kind>, number: u64, example: &str) {
    let kind = kinds
        .entry(property::shape(example))
        .or_insert_with(|| Kind {
            count: 0,
            first: number,
            example: example.to_owned(),
        });
    kind.count += 1;
}

fn merge(kinds: &mut BTreeMap<String, Kind>, later: BTreeMap<String, Kind>) {
    for (shape, kind) in later {
        match kinds.get_mut(&shape) {
            Some(known) => known.count += kind.count,
            None => drop(kinds.insert(shape, kind)),
        }
    }
}
