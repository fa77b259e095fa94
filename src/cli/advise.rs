//! `hapdef advise`: shell or solid, measured on the part.

use clap::Args;

use super::common::Common;
use super::{out, progress::Bar};
use crate::design;

#[derive(Args, Debug, Clone)]
pub struct AdviseArgs {
    #[command(flatten)]
    pub common: Common,
}

/// Measures the walls and says what fits and what it would cost.
///
/// # Errors
/// What the user must change.
pub fn run(args: &AdviseArgs) -> anyhow::Result<()> {
    let loaded = args.common.load()?;
    let bar = Bar::default();
    let watch = |p| bar.show(p);
    let advice = args
        .common
        .in_pool(|| Ok(design::advise(&loaded.inputs, &watch)?))?;
    bar.finish();
    if args.common.json {
        return out::line(&serde_json::to_string(&advice)?);
    }
    for line in &advice.words {
        out::line(line)?;
    }
    Ok(())
}
