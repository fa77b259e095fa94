use std::collections::BTreeSet;

use super::*;
use crate::project::ValueRange;

/// A project of one key more than it must have.
fn with(key: &Key, value: &str) -> String {
    let lines = format!("{} = {value}\n", key.name());
    match key.table() {
        "part" => format!("format = 1\n[part]\nmesh = \"a.stl\"\n{lines}"),
        table => format!("format = 1\n[part]\nmesh = \"a.stl\"\n[{table}]\n{lines}"),
    }
}

fn is_in_a_list(key: &Key) -> bool {
    let lists = [
        "support",
        "selection.cost",
        "selection.site",
        "evaluation.region",
        "live.glued",
        "live.press",
    ];
    lists.contains(&key.table()) || key.table().starts_with("kept")
}

#[test]
fn every_key_is_one_that_files_have_and_no_file_has_another() {
    let mut listed = BTreeSet::new();
    for key in all_keys() {
        assert!(listed.insert(key.path), "{} twice", key.path);
        assert!(
            !key.help.is_empty() && !key.help.ends_with('.'),
            "{}",
            key.path
        );
    }
    // What serde knows of the tables that there is one of, by a project that has everything.
    let mut project = Project::around("a.stl", None);
    project.budget.limits.vertices = Some(100);
    let known = toml::Value::try_from(&project).unwrap();
    let mut path = Vec::new();
    leaves(&known, &mut path, &mut |path| {
        assert!(
            path == "format" || listed.contains(path),
            "{path} is not listed"
        );
    });
}

fn leaves(value: &toml::Value, path: &mut Vec<String>, see: &mut dyn FnMut(&str)) {
    match value {
        toml::Value::Table(table) => {
            for (name, inner) in table {
                path.push(name.clone());
                leaves(inner, path, see);
                path.pop();
            }
        }
        // A list of tables that the project has none of.
        toml::Value::Array(none) if none.is_empty() => {}
        _ => see(&path.join(".")),
    }
}

#[test]
fn words_are_those_that_a_file_may_have() {
    for key in all_keys() {
        let ValueRange::Words(words) = key.range else {
            continue;
        };
        if is_in_a_list(key) {
            continue;
        }
        let quoted = |word: &str| match word {
            "true" | "false" => word.to_owned(),
            word => format!("\"{word}\""),
        };
        for word in words {
            let text = with(key, &quoted(word));
            let read: Result<Project, _> = toml::from_str(&text);
            assert!(read.is_ok(), "{}: {word}: {read:?}", key.path);
        }
        let read: Result<Project, _> = toml::from_str(&with(key, "\"no such word\""));
        let refused = read.unwrap_err().message().to_owned();
        // The reader says what it knows: no word more than is listed.
        assert!(
            words.iter().all(|word| refused.contains(word)) || words[0] == "true",
            "{}: {refused}",
            key.path
        );
        assert_eq!(
            refused.matches('`').count() / 2,
            if words[0] == "true" {
                0
            } else {
                words.len() + 1
            }
        );
    }
}

#[test]
fn what_a_control_offers_can_be_used() {
    for key in all_keys() {
        if let ValueRange::Numbers(span) = key.range {
            let offered = key.numbers();
            assert!(
                span.contains(*offered.start()) && span.contains(*offered.end()),
                "{}",
                key.path
            );
        }
    }
}

#[test]
fn what_is_usual_lies_in_its_range() {
    assert_eq!(Project::around("a.stl", None).check(), Ok(()));
}

#[test]
fn a_kept_site_is_named_where_it_stands() {
    let mut project = Project::around("a.stl", None);
    project.kept.push(KeptSelection {
        name: "kept".into(),
        selector: "by-hand".into(),
        quality: crate::budget::Quality::Draft,
        cost: 1.0,
        seconds: 0.0,
        sites: vec![ChosenSite {
            position_mm: [0.0, f64::NAN, 0.0],
            direction: [0.0, 0.0, 1.0],
        }],
        errors: Vec::new(),
        failures: Vec::new(),
    });
    let said = project.check().unwrap_err().to_string();
    assert!(said.starts_with("kept.site.position_mm must be"), "{said}");
}
