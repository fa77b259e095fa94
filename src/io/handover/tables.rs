//! Tables for whoever wires and buys.

use crate::design::Design;
use crate::io::table::Writing;
use crate::workshop::Wiring;

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
    table.text().clone()
}

/// A row an item.
pub(super) fn bill(items: Vec<[String; 3]>) -> String {
    let mut table = Writing::new(["item", "quantity", "about"]);
    for item in items {
        table.row(item);
    }
    table.text().clone()
}

/// A row a vertex of the limb: mean error of the chosen gauges around it, and the share of light touches that they do not feel.
pub(super) fn zones(design: &Design) -> String {
    let mesh = &design.simulated.mesh;
    let errors = design.error_map(mesh);
    let blind = design.blind_map(mesh);
    let force = blind.as_ref().map_or(0.0, |(force, _)| *force);
    let mut table = Writing::new([
        "x_mm".to_owned(),
        "y_mm".to_owned(),
        "z_mm".to_owned(),
        "error_mm".to_owned(),
        format!("not_felt_at_{force}n"),
    ]);
    let cell = |values: Option<&Vec<f64>>, k: usize| {
        values.map_or(String::new(), |v| format!("{:.3}", v[k]))
    };
    for (k, p) in mesh.positions().iter().enumerate() {
        let [x, y, z] = (*p * 1e3).to_array().map(|v| format!("{v:.3}"));
        let felt = blind.as_ref().map(|(_, share)| share);
        table.row([x, y, z, cell(errors.as_ref(), k), cell(felt, k)]);
    }
    table.text().clone()
}
