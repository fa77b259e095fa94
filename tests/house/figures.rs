//! The figures of the house. They are kept in a table of RESULTS.md and may only become better:
//! `HAPDEF_HOUSE=keep cargo test --test house` writes there what is better now.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Fields, ImplItem, Item, TraitItem, Visibility};

use crate::arrows::{arrows, circles};
use crate::layers::OUTER;
use crate::repeats::repeats;
use crate::source::{File, Source, attributes, attributes_within, is_test, items_in};
use crate::units::factors;

/// A file is long beyond so many lines.
const LONG: usize = 500;
const BEGIN: &str = "<!-- house: written by `HAPDEF_HOUSE=keep cargo test --test house` -->";
const END: &str = "<!-- /house -->";

/// One figure; less is better.
struct Figure {
    name: &'static str,
    value: usize,
    /// What issue 21 asks for.
    wanted: usize,
    /// Where it comes from, to be printed.
    seen: Vec<String>,
}

fn figures(source: &Source) -> Vec<Figure> {
    let circles = circles(source.files.len(), &arrows(source));
    let mut functions: Vec<(usize, String)> = source.files.iter().flat_map(functions_of).collect();
    functions.sort();
    let share = |percent: usize| functions[(functions.len() - 1) * percent / 100].0;
    let long = source
        .files
        .iter()
        .map(|f| (f.text.lines().count(), &f.name));
    let long = long.filter(|(lines, _)| *lines > LONG);
    let bare: Vec<String> = source.files.iter().flat_map(undocumented).collect();
    let repeats = repeats(&source.files);
    let factors: Vec<String> = source.files.iter().flat_map(factors).collect();
    let figure = |name, value, wanted, seen| Figure {
        name,
        value,
        wanted,
        seen,
    };
    vec![
        figure(
            "circles of files",
            circles.len(),
            0,
            (circles.iter())
                .map(|circle| {
                    let names = circle.iter().map(|&f| source.files[f].name.as_str());
                    names.collect::<Vec<_>>().join(" ")
                })
                .collect(),
        ),
        figure(
            "files in circles",
            circles.iter().map(Vec::len).sum(),
            0,
            Vec::new(),
        ),
        figure("lines of a function, median", share(50), 10, Vec::new()),
        figure(
            "lines of a function, 99 %",
            share(99),
            60,
            (functions.iter().rev().take(10))
                .map(|(lines, name)| format!("{name}: {lines}"))
                .collect(),
        ),
        figure(
            "files over 500 lines",
            long.clone().count(),
            3,
            long.map(|(lines, name)| format!("{name}: {lines}"))
                .collect(),
        ),
        figure("undocumented public items of the core", bare.len(), 0, bare),
        figure(
            "pairs of places of ten equal lines or more",
            repeats.len(),
            0,
            (repeats.iter())
                .map(|r| {
                    let [(a, m), (b, n)] = &r.places;
                    format!("{a}:{m} and {b}:{n}, {} lines", r.lines)
                })
                .collect(),
        ),
        figure("factors of units below the edge", factors.len(), 0, factors),
        figure("fields of `Studio`", studio_fields(source), 8, Vec::new()),
    ]
}

/// How many lines each function has, from its `fn` to its closing brace, tests left out.
fn functions_of(file: &File) -> Vec<(usize, String)> {
    let mut found = Functions {
        file: &file.name,
        found: Vec::new(),
    };
    found.visit_file(&file.syntax);
    found.found
}

struct Functions<'f> {
    file: &'f str,
    found: Vec<(usize, String)>,
}

impl Functions<'_> {
    fn add(&mut self, of: &syn::Signature, block: &syn::Block) {
        let first = of.fn_token.span.start().line;
        let last = block.brace_token.span.close().end().line;
        let name = format!("{}:{first} {}", self.file, of.ident);
        self.found.push((last + 1 - first, name));
    }
}

impl<'ast> Visit<'ast> for Functions<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_test(attributes(item)) {
            return;
        }
        if let Item::Macro(item) = item
            && let Some(items) = items_in(&item.mac.tokens)
        {
            for item in &items {
                self.visit_item(item);
            }
        }
        if let Item::Fn(item) = item {
            self.add(&item.sig, &item.block);
        }
        visit::visit_item(self, item);
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        if is_test(attributes_within(item)) {
            return;
        }
        if let ImplItem::Fn(item) = item {
            self.add(&item.sig, &item.block);
        }
        visit::visit_impl_item(self, item);
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        if let Some(block) = &item.default {
            self.add(&item.sig, block);
        }
        visit::visit_trait_item_fn(self, item);
    }
}

fn has_words(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("doc"))
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

/// What is public in a file of the core and says nothing of itself: what `missing_docs` asks for.
fn undocumented(file: &File) -> Vec<String> {
    let layer = file.name.split(['/', '.']).next().unwrap_or_default();
    if OUTER.iter().any(|o| o.0 == layer) || ["main", "allocation", "parting"].contains(&layer) {
        return Vec::new();
    }
    let mut found = Vec::new();
    if !has_words(&file.syntax.attrs) {
        found.push(format!("{}: the file itself", file.name));
    }
    let mut tell = |name: String| found.push(format!("{}: {name}", file.name));
    file.syntax
        .items
        .iter()
        .for_each(|item| bare(item, &mut tell));
    found
}

fn bare(item: &Item, tell: &mut dyn FnMut(String)) {
    if is_test(attributes(item)) {
        return;
    }
    let (visibility, name) = match item {
        Item::Const(i) => (&i.vis, &i.ident),
        Item::Enum(i) => (&i.vis, &i.ident),
        Item::Fn(i) => (&i.vis, &i.sig.ident),
        Item::Static(i) => (&i.vis, &i.ident),
        Item::Struct(i) => (&i.vis, &i.ident),
        Item::Trait(i) => (&i.vis, &i.ident),
        Item::Type(i) => (&i.vis, &i.ident),
        Item::Impl(i) if i.trait_.is_none() => {
            return i.items.iter().for_each(|item| bare_within(item, tell));
        }
        Item::Mod(i) => {
            let items = i.content.as_ref().map(|c| &c.1);
            return items
                .into_iter()
                .flatten()
                .for_each(|item| bare(item, tell));
        }
        _ => return,
    };
    if !is_public(visibility) {
        return;
    }
    if !has_words(attributes(item)) {
        tell(name.to_string());
    }
    match item {
        Item::Struct(i) => bare_fields(&i.fields, false, &name.to_string(), tell),
        Item::Enum(i) => {
            for variant in &i.variants {
                let name = format!("{name}::{}", variant.ident);
                if !has_words(&variant.attrs) {
                    tell(name.clone());
                }
                bare_fields(&variant.fields, true, &name, tell);
            }
        }
        Item::Trait(i) => {
            for item in &i.items {
                if let TraitItem::Fn(f) = item
                    && !has_words(&f.attrs)
                {
                    tell(format!("{name}::{}", f.sig.ident));
                }
            }
        }
        _ => {}
    }
}

fn bare_within(item: &ImplItem, tell: &mut dyn FnMut(String)) {
    let (visibility, name) = match item {
        ImplItem::Const(i) => (&i.vis, &i.ident),
        ImplItem::Fn(i) => (&i.vis, &i.sig.ident),
        _ => return,
    };
    let attributes = attributes_within(item);
    if is_public(visibility) && !is_test(attributes) && !has_words(attributes) {
        tell(name.to_string());
    }
}

/// Fields with names; those of a variant are as public as it is.
fn bare_fields(fields: &Fields, all: bool, of: &str, tell: &mut dyn FnMut(String)) {
    for field in fields {
        if let Some(name) = &field.ident
            && (all || is_public(&field.vis))
            && !has_words(&field.attrs)
        {
            tell(format!("{of}.{name}"));
        }
    }
}

/// None once there is no such thing.
fn studio_fields(source: &Source) -> usize {
    let file = source.files.iter().find(|f| f.name == "studio.rs");
    let items = file.into_iter().flat_map(|f| &f.syntax.items);
    let mut fields = items.filter_map(|item| match item {
        Item::Struct(i) if i.ident == "Studio" => Some(i.fields.len()),
        _ => None,
    });
    fields.next().unwrap_or(0)
}

fn results() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("RESULTS.md")
}

/// The rows of the table: a figure's name, what it was when the issue began, and what is kept.
fn kept(text: &str) -> Vec<(String, String, usize)> {
    let from = text
        .find(BEGIN)
        .expect("RESULTS.md has the table of the house");
    let table = &text[from..from + text[from..].find(END).expect(END)];
    let rows = table
        .lines()
        .map(|l| l.split('|').map(str::trim).collect::<Vec<_>>());
    rows.filter_map(|cells| match cells[..] {
        ["", name, before, kept, _, ""] => {
            Some((name.to_owned(), before.to_owned(), kept.parse().ok()?))
        }
        _ => None,
    })
    .collect()
}

fn table(figures: &[Figure], kept: &[(String, String, usize)]) -> String {
    let mut table =
        format!("{BEGIN}\n\n| Figure | Before | Now | To reach |\n|---|---:|---:|---:|\n");
    for figure in figures {
        let before = kept
            .iter()
            .find(|k| k.0 == figure.name)
            .map_or("", |k| &k.1);
        let Figure {
            name,
            value,
            wanted,
            ..
        } = figure;
        let _ = writeln!(table, "| {name} | {before} | {value} | {wanted} |");
    }
    table + "\n" + END
}

#[test]
fn the_house_is_kept() {
    let figures = figures(&Source::read());
    for figure in &figures {
        println!(
            "{}: {} (to reach: {})",
            figure.name, figure.value, figure.wanted
        );
        figure.seen.iter().for_each(|line| println!("    {line}"));
    }
    let text = std::fs::read_to_string(results()).unwrap();
    let rows = kept(&text);
    let (mut worse, mut better) = (Vec::new(), false);
    for figure in &figures {
        let row = rows.iter().find(|row| row.0 == figure.name);
        let value = row.map(|row| row.2);
        match value {
            Some(value) if figure.value > value => worse.push(format!(
                "{}: {}, and was {value}\n    {}",
                figure.name,
                figure.value,
                figure.seen.join("\n    ")
            )),
            Some(value) => better |= figure.value < value,
            None => better = true,
        }
    }
    assert!(
        worse.is_empty(),
        "the house became worse:\n{}",
        worse.join("\n")
    );
    if better && std::env::var("HAPDEF_HOUSE").is_ok_and(|v| v == "keep") {
        let (from, to) = (
            text.find(BEGIN).unwrap(),
            text.find(END).unwrap() + END.len(),
        );
        let new = format!("{}{}{}", &text[..from], table(&figures, &rows), &text[to..]);
        std::fs::write(results(), new).unwrap();
    } else if better {
        println!(
            "Better than RESULTS.md says: keep it by HAPDEF_HOUSE=keep cargo test --test house"
        );
    }
}
