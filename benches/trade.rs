//! Remakes the trade of speed against accuracy on the bundled limb, `assets/trade` and what README and RESULTS show of it:
//! `cargo bench --bench trade` (about a quarter of an hour on two cores; stopped, it goes on from where it was, and where the
//! record is of another limb, other defaults or another version, it begins anew). With `-- assemble` it measures nothing
//! and only puts the tables into the pages again.

use std::path::Path;
use std::process::Command;

use hapdef::cli;
use hapdef::io::together::Together;
use hapdef::io::trade_file::{self, Record};

/// Where the pages show the tables.
const BEGIN: &str = "<!-- trade: from assets/trade/trade.md, by `cargo bench --bench trade` -->\n";
const END: &str = "<!-- end of trade -->";
const POINTS: &str = "40";

fn main() {
    let folder = Path::new("assets/trade");
    let assemble = std::env::args().any(|a| a == "assemble");
    if !assemble {
        begin_anew_unless_it_holds(folder);
    }
    let points = if assemble { "0" } else { POINTS };
    let done = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["trade", "--out", "assets/trade", "--points", points])
        .status()
        .expect("hapdef runs");
    assert!(done.success(), "the trade could not be measured");
    let tables = std::fs::read_to_string(folder.join("trade.md")).expect("trade.md was written");
    for page in ["README.md", "RESULTS.md"] {
        let text = std::fs::read_to_string(page).expect("the page is here");
        std::fs::write(page, spliced(&text, &tables)).expect("the page can be written");
    }
}

/// Puts an empty record where there is none that measuring can go on from.
fn begin_anew_unless_it_holds(folder: &Path) {
    let inputs = cli::bundled().expect("the limb is bundled").inputs;
    if matches!(trade_file::read(folder), Ok(Some(record)) if record.is_of(&inputs)) {
        return;
    }
    let place = Together::claim(folder).expect("nobody else measures here");
    let record = Record::new(&inputs, rayon::current_num_threads());
    trade_file::write(&place, &inputs.project, &record).expect("the folder can be written to");
}

/// A page with the tables between its marks.
fn spliced(page: &str, tables: &str) -> String {
    let begin = page.find(BEGIN).expect("the page has the mark") + BEGIN.len();
    let end = page.find(END).expect("the page has the end mark");
    format!(
        "{}\n{}\n{}",
        &page[..begin],
        tables.trim_end(),
        &page[end..]
    )
}
