//! Remakes the trade-off of speed against accuracy on the bundled limb, `assets/trade` and what `RESULTS.md` shows of it:
//! `cargo bench --bench trade` (about a quarter of an hour on two cores; stopped, it goes on from where it was, and where the
//! record is of another limb, other defaults or another version, it begins anew). With `-- assemble` it measures nothing
//! and only puts the tables into the page again.

mod page;

use std::path::Path;
use std::process::Command;

use hapdef::cli;
use hapdef::io::together::Together;
use hapdef::io::trade_file::{self, TradeRecord};

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
    page::remake();
}

/// Puts an empty record where there is none that measuring can go on from.
fn begin_anew_unless_it_holds(folder: &Path) {
    let inputs = cli::bundled().expect("the limb is bundled").inputs;
    if matches!(trade_file::read(folder), Ok(Some(record)) if record.is_of(&inputs)) {
        return;
    }
    let place = Together::claim(folder).expect("nobody else measures here");
    let record = TradeRecord::new(&inputs, rayon::current_num_threads());
    trade_file::write(&place, &inputs.project, &record).expect("the folder can be written to");
}
