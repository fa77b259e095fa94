//! What the pages say holds: links lead somewhere, commands are understood, the reference names every option with its
//! default, and RESULTS.md shows the tables that the benchmarks wrote.

use std::path::{Path, PathBuf};

use clap::{Arg, Command, CommandFactory, Parser};

use hapdef::cli::Cli;

#[path = "../../benches/page/mod.rs"]
#[allow(dead_code, reason = "benchmarks write the page, too")]
mod results;

/// The pages that people read, from the root of the repository.
const PAGES: [&str; 7] = [
    "README.md",
    "GUIDE.md",
    REFERENCE,
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "RESULTS.md",
    "assets/firmware/PROTOCOL.md",
];
const REFERENCE: &str = "REFERENCE.md";
/// Of options that several commands share, and that stand in the page once.
const COMMON: &str = "## Common options";
const OF_DATA: &str = "### Options of select and evaluate";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn page(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn the_readme_is_short() {
    assert!(page("README.md").lines().count() <= 130);
}

/// What somebody needs before anything else works, and whoever tries the readers hard.
#[test]
fn what_a_bare_machine_needs_and_the_long_run_are_named() {
    assert!(page("README.md").contains("gcc libc6-dev"));
    let contributing = page("CONTRIBUTING.md");
    assert!(contributing.contains("gcc libc6-dev"));
    assert!(contributing.contains("cargo bench --bench hard -- --inputs"));
}

#[test]
fn every_link_leads_somewhere() {
    let broken: Vec<String> = PAGES
        .iter()
        .flat_map(|from| {
            let text = page(from);
            let targets = links(&text).into_iter().map(str::to_owned);
            let wrong = targets.filter(|to| !leads_somewhere(from, to));
            wrong.map(|to| format!("{from}: {to}")).collect::<Vec<_>>()
        })
        .collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn results_shows_what_the_benchmarks_wrote() {
    let text = page("RESULTS.md");
    let read = |file: &str| std::fs::read_to_string(root().join(file)).ok();
    assert!(
        results::remade(&text, &read) == text,
        "put the tables into RESULTS.md: cargo bench --bench results -- assemble"
    );
}

#[test]
fn the_reference_lists_every_key() {
    const BEGIN: &str = "<!-- keys: from `hapdef keys --markdown` -->";
    const END: &str = "<!-- end of keys -->";
    let text = page(REFERENCE);
    let (before, rest) = text.split_once(BEGIN).expect("the keys begin somewhere");
    let (_, after) = rest.split_once(END).expect("they end somewhere");
    let keys = hapdef::cli::keys::markdown();
    let wanted = format!("{before}{BEGIN}\n\n{keys}\n\n{END}{after}");
    if std::env::var_os("HAPDEF_REFERENCE").is_some_and(|asked| asked == "keep") {
        std::fs::write(root().join(REFERENCE), &wanted).expect("the page can be written");
        return;
    }
    assert!(
        text == wanted,
        "put the keys into {REFERENCE}: HAPDEF_REFERENCE=keep cargo test --test engine docs::"
    );
}

/// Targets of links and pictures.
fn links(text: &str) -> Vec<&str> {
    text.split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target)
        .collect()
}

fn leads_somewhere(from: &str, target: &str) -> bool {
    if target.starts_with("https://") {
        return true;
    }
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let place: PathBuf = if path.is_empty() {
        root().join(from)
    } else {
        root().join(from).with_file_name("").join(path)
    };
    if anchor.is_empty() {
        return place.exists();
    }
    let text = std::fs::read_to_string(place).unwrap_or_default();
    text.lines()
        .filter_map(|l| l.strip_prefix('#'))
        .any(|heading| slug(heading.trim_start_matches('#').trim()) == anchor)
}

/// The anchor of a heading, as it is made where repositories are shown.
fn slug(heading: &str) -> String {
    let kept = |c: char| c.is_alphanumeric() || c == ' ' || c == '-' || c == '_';
    let lower = heading.to_lowercase();
    let kept: String = lower.chars().filter(|&c| kept(c)).collect();
    kept.replace(' ', "-")
}

#[test]
fn every_command_of_the_pages_is_understood() {
    for name in PAGES {
        for line in commands(&page(name)) {
            let words = line.split(" #").next().unwrap_or_default();
            // Where an example stands for any of its kind.
            let words = words.replace(['[', ']'], "");
            if let Err(why) = Cli::try_parse_from(words.split_whitespace()) {
                panic!("{name}: {line}\n{why}");
            }
        }
    }
}

/// Lines of code that run the program.
fn commands(text: &str) -> Vec<&str> {
    text.lines()
        .filter_map(|l| l.strip_prefix("    "))
        .map(str::trim)
        .filter(|l| l.starts_with("hapdef "))
        .collect()
}

#[test]
fn the_reference_names_every_option_with_its_default() {
    let text = page(REFERENCE);
    let mut program = Cli::command();
    program.build();
    let subcommands = program.get_subcommands().filter(|c| c.get_name() != "help");
    for command in subcommands.chain([&program]) {
        let own = section(&text, &title(command));
        let shared = [section(&text, OF_DATA), section(&text, COMMON)];
        for arg in options(command) {
            let row = rows(own)
                .chain(shared.iter().flat_map(|s| rows(s)))
                .find(|r| names(r, arg));
            let row = row.unwrap_or_else(|| panic!("{}: {arg} is missing", title(command)));
            assert!(
                defaults(arg).iter().all(|d| row.contains(d.as_str())),
                "{}: {row}: the default is {:?}",
                title(command),
                defaults(arg)
            );
        }
        for row in rows(own) {
            let known = options(command).any(|arg| names(row, arg));
            assert!(known, "{}: no such option: {row}", title(command));
        }
    }
}

/// The heading of a command in the page.
fn title(command: &Command) -> String {
    match command.get_name() {
        "hapdef" => "## hapdef".into(),
        name => format!("## hapdef {name}"),
    }
}

/// What stands under a heading, up to the next one of its level or above.
fn section<'a>(text: &'a str, heading: &str) -> &'a str {
    let begin = text
        .find(&format!("\n{heading}\n"))
        .unwrap_or_else(|| panic!("{REFERENCE} has no “{heading}”"));
    let body = &text[begin + heading.len() + 2..];
    let level = heading.split(' ').next().unwrap_or_default();
    let end = (2..=level.len())
        .filter_map(|n| body.find(&format!("\n{} ", "#".repeat(n))))
        .min();
    &body[..end.unwrap_or(body.len())]
}

/// Rows of tables of options.
fn rows(section: &str) -> impl Iterator<Item = &str> {
    section.lines().filter(|l| l.starts_with("| `--"))
}

fn names(row: &str, arg: &Arg) -> bool {
    let Some(long) = arg.get_long() else {
        return false;
    };
    let rest = row.strip_prefix(&format!("| `--{long}"));
    rest.is_some_and(|rest| rest.starts_with([' ', '`']))
}

fn options(command: &Command) -> impl Iterator<Item = &Arg> {
    // Those of its steps stand in its section too.
    let steps = command
        .get_subcommands()
        .filter(|_| command.get_name() == "study");
    let all = command
        .get_arguments()
        .chain(steps.flat_map(Command::get_arguments));
    all.filter(|a| a.get_long().is_some_and(|long| long != "help"))
}

/// What an option is without being given, as it is written.
fn defaults(arg: &Arg) -> Vec<String> {
    if !arg.get_action().takes_values() {
        return Vec::new();
    }
    let values = arg.get_default_values().iter();
    values.map(|v| v.to_string_lossy().into_owned()).collect()
}
