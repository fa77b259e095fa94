//! One name, one meaning: a word that many rooms use stands for one type in all of them.

use std::collections::BTreeMap;

use syn::Item;

use crate::source::Source;

/// Words that each had two meanings and more.
const WORDS: [&str; 16] = [
    "Asked",
    "Command",
    "Doubt",
    "Elements",
    "Estimator",
    "Field",
    "Ground",
    "Known",
    "Matched",
    "Measured",
    "Pressed",
    "Reach",
    "Reading",
    "Region",
    "Settings",
    "Shape",
];

#[test]
fn a_word_that_many_use_is_one_type() {
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
    let twice = WORDS.iter().filter_map(|&word| {
        let files = homes.get(word).filter(|files| files.len() > 1)?;
        Some(format!("{word}: {}", files.join(", ")))
    });
    let twice: Vec<String> = twice.collect();
    assert!(twice.is_empty(), "{}", twice.join("\n"));
}
