//! Tables for whoever wires and buys.

use crate::io::table::Writing;
use crate::workshop::{Wiring, bill as items};

/// A row a gauge.
pub(super) fn wiring(wiring: &Wiring) -> String {
    let mut table = Writing::new([
        "gauge",
        "channel",
        "pin",
        "low_microstrain",
        "high_microstrain",
        "low_counts",
        "high_counts",
        "cable_mm",
    ]);
    for c in &wiring.channels {
        let [low, high] = c.microstrain.map(|v| format!("{v:.1}"));
        let [least, most] = c.counts.map(|v| format!("{v:.0}"));
        table.row([
            c.gauge.to_string(),
            c.channel.to_string(),
            c.pin.clone(),
            low,
            high,
            least,
            most,
            format!("{:.0}", c.cable * 1e3),
        ]);
    }
    table.text().to_owned()
}

/// A row an item.
pub(super) fn bill(wiring: &Wiring) -> String {
    let mut table = Writing::new(["item", "quantity", "about"]);
    for item in items(wiring) {
        table.row(item);
    }
    table.text().to_owned()
}
