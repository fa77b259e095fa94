//! Remakes the trade of speed against accuracy on the bundled limb, `assets/trade` and what the README shows of it:
//! `cargo bench --bench trade` (about 40 minutes on two cores; stopped, it goes on from where it was). With
//! `-- assemble` it measures nothing and only puts the tables into the README again.

use std::path::Path;
use std::process::Command;

/// Where the README shows the tables.
const BEGIN: &str = "<!-- trade: from assets/trade/trade.md, by `cargo bench --bench trade` -->\n";
const END: &str = "<!-- end of trade -->";
const POINTS: &str = "130";

fn main() {
    let folder = Path::new("assets/trade");
    let assemble = std::env::args().any(|a| a == "assemble");
    let points = if assemble { "0" } else { POINTS };
    let done = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["trade", "--out", "assets/trade", "--points", points])
        .status()
        .expect("hapdef runs");
    assert!(done.success(), "the trade could not be measured");
    let tables = std::fs::read_to_string(folder.join("trade.md")).expect("trade.md was written");
    let readme = std::fs::read_to_string("README.md").expect("README.md is here");
    std::fs::write("README.md", spliced(&readme, &tables)).expect("README.md can be written");
}

/// The README with the tables between its marks.
fn spliced(readme: &str, tables: &str) -> String {
    let begin = readme.find(BEGIN).expect("the README has the mark") + BEGIN.len();
    let end = readme.find(END).expect("the README has the end mark");
    format!(
        "{}\n{}\n{}",
        &readme[..begin],
        tables.trim_end(),
        &readme[end..]
    )
}
