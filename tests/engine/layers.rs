//! Dependencies point one way: each part of the crate names only what lies below it.

use std::path::Path;

/// From the bottom up; a module may use those above it in this list, itself included.
const ORDER: [&[&str]; 14] = [
    &[
        "budget",
        "colormap",
        "eigen",
        "lanes",
        "memory",
        "plain",
        "tally",
        "uncertainty",
        "draw",
        "wire",
    ],
    &["mesh"],
    &["limb", "elasticity"],
    &["dataset"],
    &["feasible", "regression"],
    &["pca"],
    &["gaussian_process"],
    &["placement", "evaluation"],
    &["inference"],
    &["live", "board"],
    &["project"],
    &["design", "study"],
    &["given", "trade"],
    &[
        "io", "job", "link", "document", "render", "session", "cli", "studio",
    ],
];

/// Among the outer modules, who may use whom.
const OUTER: [(&str, &[&str]); 8] = [
    ("io", &[]),
    ("job", &[]),
    ("link", &[]),
    ("render", &[]),
    ("document", &["io"]),
    ("session", &["io", "job", "link", "document"]),
    ("cli", &["io", "link", "session"]),
    (
        "studio",
        &["io", "job", "link", "document", "render", "session"],
    ),
];

fn level(module: &str) -> usize {
    ORDER
        .iter()
        .position(|l| l.contains(&module))
        .unwrap_or_else(|| panic!("{module} has no layer"))
}

fn files(folder: &Path, into: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

#[test]
fn dependencies_point_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&root, &mut all);
    let mut seen = 0;
    for path in all {
        let relative = path.strip_prefix(&root).unwrap();
        let module = relative
            .iter()
            .next()
            .unwrap()
            .to_string_lossy()
            .replace(".rs", "");
        if ["lib", "main"].contains(&module.as_str()) {
            continue;
        }
        // What stands in a test module may reach anywhere.
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
        for used in code.split("crate::").skip(1) {
            let used: String = used
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect();
            if used.is_empty() || used == module {
                continue;
            }
            seen += 1;
            let (from, to) = (level(&module), level(&used));
            let outer = OUTER.iter().find(|o| o.0 == module);
            let allowed = match outer {
                Some((_, also)) => to < from || also.contains(&used.as_str()),
                None => to < from,
            };
            assert!(allowed, "{} must not use {used}", relative.display());
        }
    }
    assert!(seen > 100, "the walk found only {seen} uses");
}
