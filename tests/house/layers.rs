//! Dependencies point one way: each part of the crate names only what lies below it, and no files know each other in a
//! circle.

use std::collections::BTreeSet;

use crate::arrows::{arrows, circles, each_use};
use crate::source::Source;

/// From the bottom up; a module may use those above it in this list, itself included.
const ORDER: [&[&str]; 17] = [
    &["units"],
    &[
        "bounds",
        "budget",
        "colormap",
        "draw",
        "eigen",
        "lanes",
        "memory",
        "paper",
        "plain",
        "statistics",
        "tally",
        "uncertainty",
        "wire",
    ],
    &["mesh"],
    &["gauge"],
    &["limb", "elasticity", "jig"],
    &["dataset", "as_made"],
    &["feasible", "regression"],
    &["learning", "pca"],
    &["gaussian_process"],
    &["placement"],
    &["evaluation"],
    &["inference"],
    &["live", "board", "bench"],
    &["project"],
    &["design", "study"],
    &["given", "trade", "parameter_study", "workshop"],
    &[
        "io", "job", "link", "document", "render", "test_bed", "varied", "session", "cli", "studio",
    ],
];

/// Among the outer modules, who may use whom.
pub const OUTER: [(&str, &[&str]); 10] = [
    ("io", &[]),
    ("job", &[]),
    ("link", &[]),
    ("render", &[]),
    ("document", &["io"]),
    ("test_bed", &["io", "link"]),
    ("varied", &["io"]),
    (
        "session",
        &["io", "job", "link", "document", "test_bed", "varied"],
    ),
    (
        "cli",
        &["io", "link", "document", "test_bed", "varied", "session"],
    ),
    (
        "studio",
        &[
            "io", "job", "link", "document", "render", "test_bed", "session",
        ],
    ),
];

/// What shows and asks in the window. `studio/layout.rs` alone knows them all.
const PANELS: [&str; 18] = [
    "bench",
    "confusions",
    "dialogs",
    "inspector",
    "jig",
    "jobs",
    "kept",
    "legend",
    "live",
    "measure",
    "menu",
    "overlay",
    "palette",
    "results",
    "stages",
    "study",
    "toolbar",
    "trade",
];

fn level(module: &str) -> usize {
    ORDER
        .iter()
        .position(|l| l.contains(&module))
        .unwrap_or_else(|| panic!("{module} has no layer"))
}

fn may_use(from: &str, to: &str) -> bool {
    let also = OUTER.iter().find(|o| o.0 == from).map_or(&[][..], |o| o.1);
    from == to || level(to) < level(from) || also.contains(&to)
}

#[test]
fn dependencies_point_down() {
    let source = Source::read();
    let mut wrong = BTreeSet::new();
    let mut seen = 0;
    each_use(&source, |from, target, path| {
        let ends = [from, target.module].map(|m| source.modules[m].path.first());
        // What stands in lib.rs is everybody's; the program's own files may use all.
        let [Some(layer), Some(used)] = ends else {
            return;
        };
        if !source.in_library(from) {
            return;
        }
        seen += 1;
        if !may_use(layer, used) {
            let file = &source.files[source.modules[from].file].name;
            wrong.insert(format!(
                "src/{file} must not use {path}: {layer} does not lie above {used}"
            ));
        }
    });
    let said: Vec<String> = wrong.into_iter().collect();
    assert!(said.is_empty(), "{}", said.join("\n"));
    assert!(seen > 5000, "the walk found only {seen} uses");
}

#[test]
fn no_files_know_each_other_in_a_circle() {
    let source = Source::read();
    let arrows = arrows(&source);
    let name = |file: &usize| source.files[*file].name.as_str();
    let found: Vec<BTreeSet<&str>> = circles(source.files.len(), &arrows)
        .iter()
        .map(|circle| circle.iter().map(name).collect())
        .collect();
    let said: Vec<String> = found
        .iter()
        .map(|circle| {
            let inner = (arrows.iter())
                .filter(|((from, to), _)| circle.contains(name(from)) && circle.contains(name(to)));
            let ways: Vec<String> = inner
                .map(|((from, to), by)| format!("  {} -> {}: {by:?}", name(from), name(to)))
                .collect();
            format!("{circle:?}\n{}", ways.join("\n"))
        })
        .collect();
    assert!(
        said.is_empty(),
        "files know each other in a circle: {}",
        said.join("\n")
    );
}

#[test]
fn no_panel_of_the_window_knows_another() {
    let source = Source::read();
    let panel = |file: usize| {
        let name = source.files[file].name.strip_prefix("studio/")?;
        let first = name.split(['/', '.']).next()?;
        PANELS.into_iter().find(|panel| *panel == first)
    };
    let all: BTreeSet<&str> = (0..source.files.len()).filter_map(panel).collect();
    assert_eq!(
        all,
        BTreeSet::from(PANELS),
        "a panel is gone or has another name"
    );
    let wrong: Vec<String> = arrows(&source)
        .keys()
        .filter_map(|&(from, to)| {
            let (from, to) = (panel(from)?, panel(to)?);
            (from != to).then(|| format!("{from} knows {to}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn what_the_window_does_stands_in_one_file() {
    let source = Source::read();
    let of_window = source.impls.iter().filter(|block| {
        let target = source.resolve(block.module, &block.of);
        target.is_some_and(|t| t.item.as_deref() == Some("Studio"))
    });
    let files: BTreeSet<&str> = of_window
        .map(|block| {
            source.files[source.modules[block.module].file]
                .name
                .as_str()
        })
        .collect();
    assert_eq!(files, BTreeSet::from(["studio.rs"]));
}
