//! Places that say the same: runs of ten lines or more that stand twice.

use std::collections::HashMap;

use syn::Item;
use syn::spanned::Spanned;

use crate::source::{File, attributes, is_test};

/// So many equal lines are a repeat.
const LINES: usize = 10;

/// Two places, each a file and a line, and how many lines they have in common.
pub struct Repeat {
    pub places: [(String, usize); 2],
    pub lines: usize,
}

/// All pairs of places in some files with at least ten equal lines of code after each other; how they are indented,
/// blank lines, comments, imports and tests do not count.
pub fn repeats(files: &[File]) -> Vec<Repeat> {
    let code: Vec<Vec<(usize, &str)>> = files.iter().map(code_of).collect();
    let mut places: HashMap<Vec<&str>, Vec<(usize, usize)>> = HashMap::new();
    for (file, lines) in code.iter().enumerate() {
        for (at, window) in lines.windows(LINES).enumerate() {
            let words = window.iter().map(|l| l.1).collect();
            places.entry(words).or_default().push((file, at));
        }
    }
    let line = |(file, at): (usize, usize)| code[file].get(at).map(|l| l.1);
    let mut found = Vec::new();
    for same in places.values() {
        for (k, &a) in same.iter().enumerate() {
            for &b in &same[k + 1..] {
                // Each run is told once, from its beginning, and no run overlaps itself.
                let before = |(file, at): (usize, usize)| at.checked_sub(1).map(|at| (file, at));
                let goes_on = before(a)
                    .zip(before(b))
                    .is_some_and(|(a, b)| line(a) == line(b));
                if goes_on || (a.0 == b.0 && a.1.abs_diff(b.1) < LINES) {
                    continue;
                }
                let at = |(file, at): (usize, usize), k: usize| line((file, at + k));
                let equal = |k: &usize| at(a, *k).is_some() && at(a, *k) == at(b, *k);
                found.push(Repeat {
                    places: [a, b].map(|(file, at)| (files[file].name.clone(), code[file][at].0)),
                    lines: (0..code[a.0].len()).take_while(equal).count(),
                });
            }
        }
    }
    found.sort_by(|a, b| a.places.cmp(&b.places));
    found
}

/// Numbers and words of the lines that count.
fn code_of(file: &File) -> Vec<(usize, &str)> {
    let mut left_out = Vec::new();
    leave_out(&file.syntax.items, &mut left_out);
    (1..)
        .zip(file.text.lines().map(str::trim))
        .filter(|(n, line)| {
            let is_comment = line.is_empty() || line.starts_with("//");
            !is_comment
                && !left_out
                    .iter()
                    .any(|&[first, last]| (first..=last).contains(n))
        })
        .collect()
}

/// The lines of tests and imports.
fn leave_out(items: &[Item], into: &mut Vec<[usize; 2]>) {
    for item in items {
        if is_test(attributes(item)) || matches!(item, Item::Use(_)) {
            let span = item.span();
            into.push([span.start().line, span.end().line]);
        } else if let Item::Mod(module) = item
            && let Some((_, items)) = &module.content
        {
            leave_out(items, into);
        }
    }
}
