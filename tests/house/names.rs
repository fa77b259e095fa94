//! One name, one meaning: no two types of the crate are called the same.

use std::collections::BTreeMap;

use syn::{Attribute, Item, Meta};

use crate::source::{Source, attributes};

/// What stands in for a type in a build without a feature: of one build only one of them is.
fn stands_in(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) if list.path.is_ident("cfg") => {
            let when = list.tokens.to_string();
            when.starts_with("not (feature") || when.starts_with("not(feature")
        }
        _ => false,
    })
}

#[test]
fn no_two_types_share_a_name() {
    let source = Source::read();
    let mut homes: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for file in &source.files {
        for item in &file.syntax.items {
            let name = match item {
                Item::Struct(item) => &item.ident,
                Item::Enum(item) => &item.ident,
                Item::Trait(item) => &item.ident,
                Item::Type(item) => &item.ident,
                _ => continue,
            };
            if stands_in(attributes(item)) {
                continue;
            }
            homes.entry(name.to_string()).or_default().push(&file.name);
        }
    }
    assert!(homes.len() > 800, "only {} types were found", homes.len());
    let twice: Vec<String> = (homes.iter())
        .filter(|(_, files)| files.len() > 1)
        .map(|(word, files)| format!("{word}: {}", files.join(", ")))
        .collect();
    assert!(twice.is_empty(), "{}", twice.join("\n"));
}
