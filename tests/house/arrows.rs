//! Which file uses which.
//!
//! An arrow goes from the file that names something to the file that *defines* it: re-exports are followed to their
//! end. That a parent declares a module, or hands on what one defines (`pub use`), is no arrow; that it uses it is one,
//! and so is every use of the parent's items by the child. An `impl` in another file than its type's counts as a use of
//! that type; where the functions of such an `impl` are called, that is a use of its file: a type spread over files is
//! still tied together.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::source::{Source, Target, is_within};

/// From file to file, with the paths that lead there.
pub type Arrows = BTreeMap<(usize, usize), BTreeSet<String>>;

/// Functions that stand in another file than their type's: by name, the files of the type and of the function.
type Away = HashMap<String, BTreeSet<(usize, usize)>>;

/// Calls `tell` with each module that names something, what it names, and the path it does so by.
pub fn each_use(source: &Source, mut tell: impl FnMut(usize, &Target, &str)) {
    for (number, module) in source.modules.iter().enumerate() {
        for used in &module.uses {
            let Some(target) = source.resolve(number, &used.path) else {
                continue;
            };
            let there = &source.modules[target.module];
            let is_own = is_within(&there.path, &module.path)
                && source.in_library(number) == source.in_library(target.module);
            // A module by itself, or all that is in it, is used where a path goes through it.
            if target.item.is_some() && !(used.is_public && is_own) {
                tell(number, &target, &used.path.join("::"));
            }
        }
        for path in &module.paths {
            if let Some(target) = source.resolve(number, path)
                && target.item.is_some()
            {
                tell(number, &target, &path.join("::"));
            }
        }
    }
}

/// All arrows between files.
pub fn arrows(source: &Source) -> Arrows {
    let away = away(source);
    let mut arrows = Arrows::new();
    let mut draw = |from: usize, to: usize, by: String| {
        if from != to {
            arrows.entry((from, to)).or_default().insert(by);
        }
    };
    each_use(source, |from, target, path| {
        let (from, home) = (
            source.modules[from].file,
            source.modules[target.module].file,
        );
        draw(from, home, path.to_owned());
        let called = target.rest.first().and_then(|name| away.get(name));
        for &(_, file) in called.into_iter().flatten().filter(|(h, _)| *h == home) {
            draw(from, file, path.to_owned());
        }
    });
    for module in &source.modules {
        for (name, places) in away.iter().filter(|(name, _)| module.calls.contains(*name)) {
            // Another function of that name may be meant.
            if source.functions[name] > 1 {
                continue;
            }
            for &(home, file) in places {
                let knows = module.file == home || arrows.contains_key(&(module.file, home));
                if knows && module.file != file {
                    let by = arrows.entry((module.file, file)).or_default();
                    by.insert(format!(".{name}()"));
                }
            }
        }
    }
    arrows
}

fn away(source: &Source) -> Away {
    let mut away = Away::new();
    for block in source.impls.iter().filter(|b| b.is_inherent) {
        let Some(target) = source.resolve(block.module, &block.of) else {
            continue;
        };
        let (home, file) = (
            source.modules[target.module].file,
            source.modules[block.module].file,
        );
        if home != file {
            for name in &block.functions {
                away.entry(name.clone()).or_default().insert((home, file));
            }
        }
    }
    away
}

/// Circles: sets of files each of which leads to all the others (R. Tarjan, SIAM J. Comput. 1, 1972).
pub fn circles(files: usize, arrows: &Arrows) -> Vec<Vec<usize>> {
    let mut next = vec![Vec::new(); files];
    for &(from, to) in arrows.keys() {
        next[from].push(to);
    }
    let mut search = Search {
        next,
        order: vec![None; files],
        low: vec![0; files],
        open: Vec::new(),
        is_open: vec![false; files],
        count: 0,
        found: Vec::new(),
    };
    for file in 0..files {
        if search.order[file].is_none() {
            search.visit(file);
        }
    }
    search.found
}

struct Search {
    next: Vec<Vec<usize>>,
    order: Vec<Option<usize>>,
    low: Vec<usize>,
    open: Vec<usize>,
    is_open: Vec<bool>,
    count: usize,
    found: Vec<Vec<usize>>,
}

impl Search {
    fn visit(&mut self, at: usize) {
        let own = self.count;
        self.count += 1;
        (self.order[at], self.low[at]) = (Some(own), own);
        self.open.push(at);
        self.is_open[at] = true;
        for to in self.next[at].clone() {
            match self.order[to] {
                None => {
                    self.visit(to);
                    self.low[at] = self.low[at].min(self.low[to]);
                }
                Some(order) if self.is_open[to] => self.low[at] = self.low[at].min(order),
                Some(_) => {}
            }
        }
        if self.low[at] == own {
            let from = self.open.iter().rposition(|&f| f == at).unwrap_or(0);
            let mut circle = self.open.split_off(from);
            for &file in &circle {
                self.is_open[file] = false;
            }
            if circle.len() > 1 {
                circle.sort_unstable();
                self.found.push(circle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_found() {
        let pairs = [(0, 1), (1, 2), (2, 0), (2, 3), (3, 4), (4, 3), (5, 0)];
        let arrows = pairs.map(|pair| (pair, BTreeSet::new())).into();
        assert_eq!(circles(6, &arrows), [vec![3, 4], vec![0, 1, 2]]);
    }

    /// Arrows of a crate whose file `a/inner.rs` holds this, beside `b.rs` and `b/deep.rs`.
    fn drawn(inner: &str) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("main.rs", "fn main() { hapdef::b::work(); }"),
            ("a.rs", "mod inner; pub struct Kept;"),
            ("a/inner.rs", inner),
            ("b.rs", "mod deep; pub use deep::Deep; pub fn work() {}"),
            (
                "b/deep.rs",
                "pub struct Deep; impl Deep { pub fn new() -> Self { Deep } }",
            ),
        ];
        for (name, text) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        let source = Source::of(folder.path());
        let name = |file: usize| source.files[file].name.as_str();
        let ends = |&(from, to): &(usize, usize)| format!("{} -> {}", name(from), name(to));
        let found = arrows(&source).keys().map(ends).collect::<Vec<_>>();
        found.into_iter().filter(|f| f.starts_with("a/")).collect()
    }

    #[test]
    fn no_way_of_writing_a_path_hides_an_arrow() {
        for inner in [
            "use crate::b::Deep;",
            "use crate::{b::{self, Deep}};",
            "use super::super::b::Deep as Other;",
            "use crate::b::*; fn f(_: Deep) {}",
            "fn f() -> super::super::b::Deep { todo!() }",
            "fn f() { use crate::b; let _ = b::Deep::new(); }",
            "fn f() { println!(\"{:p}\", &crate::b::Deep::new()); }",
            "mod within { pub fn f(_: super::super::super::b::Deep) {} }",
            "macro_rules! make { () => { crate::b::Deep::new() } }",
            "impl From<crate::b::Deep> for u8 { fn from(_: crate::b::Deep) -> u8 { 0 } }",
        ] {
            assert_eq!(drawn(inner), ["a/inner.rs -> b/deep.rs"], "{inner}");
        }
        assert_eq!(drawn("use super::Kept;"), ["a/inner.rs -> a.rs"]);
        for inner in [
            "#[cfg(test)] mod tests { use crate::b::Deep; }",
            "#[test] fn f() { crate::b::work(); }",
            "// use crate::b::Deep;",
            "fn f(b: u8) -> u8 { b }",
        ] {
            assert!(drawn(inner).is_empty(), "{inner}");
        }
    }
}
