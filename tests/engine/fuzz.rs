//! Every reader with everything wrong that chance can make wrong: what it reads is sound and finite, or
//! refused in words that fit on a screen; nothing panics, nothing hangs.
//!
//! A few thousand files a reader here, the same in every run. `cargo bench --bench hard` does a million, with
//! time and memory of each; `CONTRIBUTING.md` says how.

use crate::hard;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use hapdef::io::mesh_file::parse_mesh;
use hapdef::mesh::repair::Repair;
use hard::reader::{Outcome, Reader};
use hard::{property, seeds, spoil};
use rayon::prelude::*;
use tempfile::TempDir;

/// Files a reader; a tenth of them where each is replayed and its touches are found.
const COUNT: u64 = 2000;

fn count(reader: Reader) -> u64 {
    match reader {
        Reader::Recording => COUNT / 10,
        _ => COUNT,
    }
}

/// What is wrong with the outcomes of a reader, by the numbers of its files.
fn broken(reader: Reader) -> Vec<String> {
    let files = seeds::of(reader);
    let (taken, refused) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let folder = || TempDir::new().expect("a folder for files");
    let wrong: Vec<String> = (0..count(reader))
        .into_par_iter()
        .map_init(folder, |folder, number| {
            let bytes = spoil::input(&files, 0, number);
            let hold = || reader.hold(&bytes, folder.path());
            match catch_unwind(AssertUnwindSafe(hold)) {
                Ok(Ok(Outcome::Taken)) => taken.fetch_add(1, Ordering::Relaxed),
                Ok(Ok(Outcome::Refused(_))) => refused.fetch_add(1, Ordering::Relaxed),
                Ok(Err(wrong)) => return Some(format!("{} {number}: {wrong}", reader.name())),
                Err(_) => return Some(format!("{} {number}: panic", reader.name())),
            };
            None
        })
        .flatten()
        .collect();
    println!("{}: {taken:?} taken, {refused:?} refused", reader.name());
    wrong
}

#[test]
fn spoiled_files_of_every_kind_are_refused_in_words_or_sound() {
    // What parses may panic on hostile bytes; that is caught and is no noise worth having.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if rayon::current_thread_index().is_none() {
            hook(info);
        }
    }));
    let wrong = Reader::ALL.map(broken).concat();
    assert!(
        wrong.is_empty(),
        "{}:\n{}",
        wrong.len(),
        wrong[..wrong.len().min(20)].join("\n")
    );
}

#[test]
fn the_files_that_are_spoiled_are_sound() {
    let folder = TempDir::new().unwrap();
    for reader in Reader::ALL {
        for file in seeds::of(reader) {
            let name = reader.name();
            if reader.is_mesh() {
                let repair = Repair::default();
                let loaded = parse_mesh(&file, name, None, 1e-3, 0, &repair);
                let loaded = loaded.unwrap_or_else(|e| panic!("{name}: {e}"));
                property::surface(&loaded).unwrap();
            } else {
                assert_eq!(
                    reader.hold(&file, folder.path()),
                    Ok(Outcome::Taken),
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn the_same_number_is_the_same_file() {
    let files = seeds::of(Reader::Obj);
    let made = |seed, number| spoil::input(&files, seed, number);
    assert_eq!(made(0, 0), files[0]);
    assert_eq!(made(3, 1000), made(3, 1000));
    assert_ne!(made(3, 1000), made(4, 1000));
    assert_ne!(made(3, 1000), made(3, 1001));
}

#[test]
fn words_for_people_are_told_from_others() {
    let good = "part.ply: line 3: “\u{fffd}Some(” is no number. Export the mesh again";
    assert_eq!(property::message(good), Ok(()));
    assert_eq!(
        property::shape(good),
        "part.ply: line #:  is no number. Export the mesh again"
    );
    let long = "a\n".repeat(property::LINES + 1);
    for bad in [
        "",
        "a\u{1b}[31m",
        "got Some(3)",
        "at \u{fffd}\u{fffd}",
        long.as_str(),
    ] {
        assert!(property::message(bad).is_err(), "{bad}");
    }
}

/// The targets for libFuzzer are a workspace of their own, which no build of the program looks at: what is forgotten
/// there is found here.
mod guided {
    use std::collections::BTreeSet;

    use toml::Table;

    use super::Reader;

    const PROGRAM: &str = include_str!("../../Cargo.toml");
    const TARGETS: &str = include_str!("../../fuzz/Cargo.toml");
    const LOCK: &str = include_str!("../../fuzz/Cargo.lock");

    fn parsed(text: &str) -> Table {
        text.parse().unwrap()
    }

    /// What the program needs on every system and without the window.
    fn needed() -> BTreeSet<String> {
        let program = parsed(PROGRAM);
        let always = |(_, wanted): &(&String, &toml::Value)| {
            wanted.get("optional").and_then(toml::Value::as_bool) != Some(true)
        };
        let all = program["dependencies"].as_table().unwrap().iter();
        all.filter(always).map(|(name, _)| name.clone()).collect()
    }

    /// What the lock of the targets knows that the program needs: names, without versions.
    fn locked() -> BTreeSet<String> {
        let lock = parsed(LOCK);
        let packages = lock["package"].as_array().unwrap();
        let program = packages
            .iter()
            .find(|p| p["name"].as_str() == Some("hapdef"));
        let needs = program.unwrap()["dependencies"].as_array().unwrap();
        let name = |need: &toml::Value| need.as_str()?.split(' ').next().map(str::to_owned);
        needs.iter().filter_map(name).collect()
    }

    #[test]
    fn the_lock_of_the_targets_knows_all_that_the_program_needs() {
        let missing: Vec<String> = needed().difference(&locked()).cloned().collect();
        assert!(
            missing.is_empty(),
            "{missing:?}: run `cargo metadata --manifest-path fuzz/Cargo.toml`"
        );
    }

    #[test]
    fn every_reader_has_its_target() {
        let targets = parsed(TARGETS);
        let bins = targets["bin"].as_array().unwrap();
        let found: BTreeSet<&str> = bins.iter().filter_map(|b| b["name"].as_str()).collect();
        assert_eq!(found, Reader::ALL.map(Reader::name).into());
    }
}
