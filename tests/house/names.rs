//! One name, one meaning: no two types of the crate are called the same.

use std::collections::BTreeMap;

use syn::Item;

use crate::source::Source;

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
