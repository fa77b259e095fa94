//! A project as the text of its file, with a comment at every key: what the table of keys says of it.

use std::fmt::Write as _;

use crate::project::{Heading, Key, KeyTable, Project, Value};

/// The commented text of a project.
#[must_use]
pub fn to_text(project: &Project) -> String {
    let mut text = String::from(
        "# A HapDef project. Lengths in millimetres, forces in newtons; paths are relative to this file.\n",
    );
    key_line(
        &mut text,
        "format",
        project.format,
        Some("version of this file's format"),
    );
    project.tables(&mut |heading, table| write_table(&mut text, heading, table));
    text
}

fn write_table(text: &mut String, heading: Heading, table: &dyn KeyTable) {
    let header = heading.text;
    let _ = match heading.of_list {
        None => writeln!(text, "\n[{header}]"),
        Some(_) => writeln!(text, "\n[[{header}]]"),
    };
    // What each key of a list means is said once.
    let is_explained = heading.of_list.is_none_or(|k| k == 0);
    table.each(&mut |key, value| write_key(text, key, value, is_explained));
}

/// A key with its value; where it has none, what it would mean.
fn write_key(text: &mut String, key: &Key, value: &dyn Value, is_explained: bool) {
    let comment = is_explained.then_some(key.help);
    if let Some(value) = value.written() {
        key_line(text, key.name(), value, comment);
    } else if let Some(comment) = comment {
        let _ = writeln!(text, "# {}: {comment}", key.name());
    }
}

fn key_line(text: &mut String, name: &str, value: impl std::fmt::Display, comment: Option<&str>) {
    let _ = match comment {
        Some(comment) => writeln!(text, "{name} = {value}  # {comment}"),
        None => writeln!(text, "{name} = {value}"),
    };
}
