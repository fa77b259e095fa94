//! `hapdef keys`: what a project file may hold, read off the table that also checks it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use clap::Args;
use serde_json::json;

use super::out;
use crate::plain::quote;
use crate::project::{Key, Project, ValueRange, all_keys};

/// Every key with its unit, its range, its default and its meaning.
#[derive(Args, Debug, Clone)]
pub struct KeysArgs {
    /// Only keys whose path has this in it, such as gauge or `force_n`.
    pub part: Option<String>,
    /// As the tables of the reference page.
    #[arg(long)]
    pub markdown: bool,
    #[arg(long, conflicts_with = "markdown")]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// When no key is of that name, or the answer cannot be printed.
pub fn run(args: &KeysArgs) -> anyhow::Result<()> {
    let rows = rows(args.part.as_deref().unwrap_or_default());
    if rows.is_empty() {
        let part = quote(args.part.as_deref().unwrap_or_default());
        anyhow::bail!("no key has {part} in it. `hapdef keys` lists them all");
    }
    let text = if args.json {
        let keys: Vec<_> = rows.iter().map(KeyRow::json).collect();
        json!({ "keys": keys }).to_string()
    } else if args.markdown {
        in_tables(&rows)
    } else {
        in_lines(&rows)
    };
    out::line(text.trim_end())
}

/// The tables of the reference page.
#[must_use]
pub fn markdown() -> String {
    in_tables(&rows(""))
}

/// A key with what stands for it where it is left out.
struct KeyRow {
    key: &'static Key,
    default: Option<toml::Value>,
}

fn rows(part: &str) -> Vec<KeyRow> {
    let mut defaults = BTreeMap::new();
    // Lists are empty, and what they would hold has no defaults.
    Project::around("", None).tables(&mut |_, table| {
        table.each(&mut |key, value| {
            let given = value.written().filter(|_| key.path != "part.mesh");
            defaults.insert(key.path, given);
        });
    });
    let named = all_keys().into_iter().filter(|key| key.path.contains(part));
    named
        .map(|key| KeyRow {
            key,
            default: defaults.get(key.path).cloned().flatten(),
        })
        .collect()
}

impl KeyRow {
    fn json(&self) -> serde_json::Value {
        let key = self.key;
        let (least, most) = match key.range {
            ValueRange::Numbers(span) => (json!(span.least()), json!(span.most())),
            ValueRange::Whole(least, most) => (json!(least), json!(most)),
            ValueRange::Words(_) | ValueRange::Any(_) => (json!(null), json!(null)),
        };
        let words = match key.range {
            ValueRange::Words(words) => json!(words),
            _ => json!(null),
        };
        json!({
            "path": key.path,
            "table": key.table(),
            "unit": (!key.unit.is_empty()).then_some(key.unit),
            "range": key.range.to_string(),
            "least": least,
            "most": most,
            "words": words,
            "default": self.default,
            "help": key.help,
        })
    }

    /// The default as in the file.
    fn usual(&self) -> String {
        (self.default.as_ref()).map_or_else(|| "–".to_owned(), toml::Value::to_string)
    }
}

/// For a terminal.
fn in_lines(rows: &[KeyRow]) -> String {
    let mut text = String::new();
    for row in rows {
        let key = row.key;
        let default = row.default.as_ref().map(|value| format!(" = {value}"));
        let unit = match key.unit {
            "" => String::new(),
            unit => format!("{unit}, "),
        };
        let _ = writeln!(
            text,
            "{}{}\n    {unit}{}\n    {}",
            key.path,
            default.unwrap_or_default(),
            key.range,
            key.sentence(),
        );
    }
    text
}

/// For the reference page: a table for each table of the file.
fn in_tables(rows: &[KeyRow]) -> String {
    let mut text = String::new();
    let mut table = "";
    for row in rows {
        let key = row.key;
        if key.table() != table {
            table = key.table();
            let _ = writeln!(
                text,
                "\n`{table}`\n\n| key | unit | may be | default | meaning |\n|---|---|---|---|---|"
            );
        }
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} | {} |",
            key.name(),
            key.unit,
            key.range,
            row.usual(),
            key.help.replace('|', "\\|"),
        );
    }
    text.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_found_by_a_part_of_its_path_with_its_default() {
        let found = rows("touch.force_n");
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].usual(), "10.0");
        let said = found[0].json();
        assert_eq!(said["unit"], "N");
        assert_eq!(
            (&said["least"], &said["most"]),
            (&json!(1e-12), &json!(1e12))
        );
        assert!(rows("nothing of the kind").is_empty());
    }

    #[test]
    fn what_must_be_given_and_what_stands_in_lists_has_no_default() {
        for path in ["part.mesh", "part.unit", "support.kind", "kept.name"] {
            let found = rows(path);
            assert_eq!(found[0].usual(), "–", "{path}");
        }
    }

    #[test]
    fn each_table_of_the_file_is_a_table_of_the_page() {
        let page = markdown();
        for key in all_keys() {
            assert!(
                page.contains(&format!("\n| `{}` | ", key.name())),
                "{}",
                key.path
            );
            assert!(
                page.contains(&format!("`{}`\n\n", key.table())),
                "{}",
                key.path
            );
        }
    }
}
