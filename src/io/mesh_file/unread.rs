//! What a file holds that is not read: each name once, with how often it stands there and where first.

use std::collections::BTreeMap;

use crate::plain::quote;

/// Names that are shown; those beyond are only counted.
const SHOWN: usize = 30;

/// What stands under one name.
#[derive(Clone, Copy)]
struct Count {
    times: usize,
    /// Line of the first.
    first: usize,
}

#[derive(Default)]
pub struct Unread {
    names: BTreeMap<String, Count>,
}

impl Unread {
    /// One more of a name.
    pub fn add(&mut self, name: &str, line: usize) {
        if let Some(count) = self.names.get_mut(name) {
            count.times += 1;
        } else {
            let first = Count {
                times: 1,
                first: line,
            };
            self.names.insert(name.to_owned(), first);
        }
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// How many there are of all names.
    #[must_use]
    pub fn total(&self) -> usize {
        self.names.values().map(|count| count.times).sum()
    }

    /// The names in the order of their first lines, each with its count and that line.
    #[must_use]
    pub fn listed(&self) -> String {
        let mut all: Vec<(&String, &Count)> = self.names.iter().collect();
        all.sort_by_key(|(_, count)| count.first);
        let shown: Vec<String> = (all.iter().take(SHOWN))
            .map(|(name, count)| match count.times {
                1 => format!("{} (line {})", quote(name), count.first),
                times => format!("{} ({times}, first in line {})", quote(name), count.first),
            })
            .collect();
        match all.len().saturating_sub(SHOWN) {
            0 => shown.join(", "),
            more => format!("{} and {more} more", shown.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_name_is_said_once() {
        let mut unread = Unread::default();
        assert!(unread.is_empty());
        for line in [7, 9, 12] {
            unread.add("SFE", line);
        }
        unread.add("ACEL", 3);
        assert_eq!(unread.total(), 4);
        assert_eq!(
            unread.listed(),
            "“ACEL” (line 3), “SFE” (3, first in line 7)"
        );
        for k in 0..SHOWN {
            unread.add(&format!("C{k}"), 20 + k);
        }
        assert!(unread.listed().ends_with("and 2 more"));
    }
}
