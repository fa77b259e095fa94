//! `hapdef simulate`: the elastic model only.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{Common, progress::Bar};
use crate::design;
use crate::io::artifacts::save_dataset;

#[derive(Args, Debug, Clone)]
pub struct SimulateArgs {
    #[command(flatten)]
    pub common: Common,
    /// The dataset (.npz).
    #[arg(long)]
    pub out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &SimulateArgs) -> anyhow::Result<()> {
    let loaded = args.common.load()?;
    anyhow::ensure!(
        args.out.extension().is_some_and(|e| e == "npz"),
        "{}: datasets are written as .npz",
        args.out.display()
    );
    if let Some(folder) = args.out.parent().filter(|f| !f.as_os_str().is_empty()) {
        anyhow::ensure!(
            folder.is_dir(),
            "{}: there is no such folder. Create it first",
            folder.display()
        );
    }
    let budget = loaded.inputs.project.budget.quality.budget();
    let bar = Bar::default();
    let result = args
        .common
        .in_pool(|| Ok(design::simulate(&loaded.inputs, &budget, &|p| bar.show(p))?));
    bar.finish();
    let simulated = result?;
    save_dataset(&args.out, &simulated.dataset)?;
    if args.common.json {
        let summary = json!({
            "sites": simulated.dataset.sites.len(),
            "touches": simulated.dataset.touches.len(),
            "signal": simulated.dataset.signal,
            "vertices": simulated.mesh.positions().len(),
            "unknowns": simulated.unknowns,
            "achieved": simulated.achieved,
        });
        println!("{summary}");
    } else {
        eprintln!("wrote {}", args.out.display());
    }
    Ok(())
}
