//! Too few places for gauges: what each filter took, and which key to change to what.

use super::inputs::Inputs;
use crate::feasible::{Blame, Feasibility, Filter};
use crate::{plain, units};

/// Fewer sites are feasible than gauges were asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{words}")]
pub struct Shortage {
    /// Gauges asked for.
    pub wanted: usize,
    /// Sites that are feasible.
    pub available: usize,
    /// The filter whose relaxation helps most.
    pub blamed: Option<Filter>,
    words: String,
}

impl Shortage {
    pub(super) fn of(
        inputs: &Inputs,
        feasibility: &Feasibility,
        wanted: usize,
        blame: Option<Blame>,
    ) -> Self {
        let available = feasibility.sites().len();
        let head = if available == 0 {
            "no site is feasible".to_owned()
        } else {
            format!(
                "{} asked for, but only {} feasible",
                plain::either(wanted, "gauge was", "gauges were"),
                plain::either(available, "site is", "sites are")
            )
        };
        let mut words = format!("{head}: {}", taken_in_words(inputs, feasibility));
        if available > 0 {
            words.push_str(". Ask for fewer gauges (selection.sensors)");
        }
        // What no filter's limit mends: there are not so many sites at all.
        let beyond = wanted > feasibility.verdicts.len() && available > 0;
        let remedy = if beyond {
            Some(format!(
                "lower sites.spacing_mm ({})",
                inputs.project.sites.spacing_mm
            ))
        } else {
            blame.as_ref().map(|blame| remedy(inputs, blame))
        };
        if let Some(remedy) = remedy {
            let or = if available > 0 { ", or " } else { ". " };
            words.push_str(or);
            words.push_str(&if available > 0 {
                remedy
            } else {
                capitalized(&remedy)
            });
        }
        Self {
            wanted,
            available,
            blamed: blame.map(|b| b.filter),
            words,
        }
    }
}

/// "of 210 sites, 2.1 mm apart, the filters took 180 (too near a support), then 30 (at an edge)".
fn taken_in_words(inputs: &Inputs, feasibility: &Feasibility) -> String {
    let taken: Vec<String> = (feasibility.taken().into_iter())
        .filter(|(_, count)| *count > 0)
        .map(|(filter, count)| format!("{count} ({})", filter.label().to_lowercase()))
        .collect();
    let sites = feasibility.verdicts.len();
    let spacing = inputs.project.sites.spacing_mm;
    if taken.is_empty() {
        return format!("the part has {sites}, {spacing} mm apart (sites.spacing_mm)");
    }
    format!(
        "of {sites} sites, {spacing} mm apart, the filters took {}",
        taken.join(", then ")
    )
}

/// What to change, and to what.
fn remedy(inputs: &Inputs, blame: &Blame) -> String {
    let project = &inputs.project;
    let (gauge, room) = (&project.gauge, &project.feasible);
    let limit = blame.limit.unwrap_or(f64::NAN);
    let change = match blame.filter {
        Filter::NotBehind => {
            "paint the inside (part.inside) where walls that can be touched have their back, or lower touch.reach_mm: few places lie behind what a fingertip reaches".to_owned()
        }
        Filter::OutOfReach => format!(
            "take a narrower gauge (gauge.grid_width_mm is {}): a pad twice as wide as its grid, {} mm, cannot be brought to the wall; one for {} mm can",
            gauge.grid_width_mm,
            2.0 * gauge.grid_width_mm,
            down(units::mm(limit))
        ),
        Filter::SupportClearance => format!(
            "lower feasible.support_clearance_mm from {} to {}, or make the supports smaller",
            room.support_clearance_mm,
            down(units::mm(limit))
        ),
        Filter::Edge => format!(
            "raise feasible.edge_radius_mm from {} to {}, or lower feasible.edge_neighbours ({}) or sites.spacing_mm ({})",
            room.edge_radius_mm,
            up(units::mm(limit)),
            room.edge_neighbours,
            project.sites.spacing_mm
        ),
        Filter::Footprint => format!(
            "take a smaller gauge: {} × {} mm hang over the part's edge wherever else one could go (gauge.grid_length_mm, gauge.grid_width_mm)",
            gauge.grid_length_mm, gauge.grid_width_mm
        ),
        Filter::Flatness => format!(
            "raise gauge.flatness_mm from {} to {}, or take a smaller gauge (gauge.grid_length_mm is {}): the wall is curved under it",
            gauge.flatness_mm,
            up(units::mm(limit)),
            gauge.grid_length_mm
        ),
        Filter::Noise => format!(
            "lower gauge.least_signal_to_noise from {} to {}, lower gauge.noise_microstrain ({}) or press harder (touch.force_n is {}): the signals are {} microstrain",
            gauge.least_signal_to_noise,
            down(units::microstrain(limit) / gauge.noise_microstrain),
            gauge.noise_microstrain,
            project.touch.force_n,
            down(units::microstrain(limit))
        ),
        Filter::Range => format!(
            "raise gauge.range_microstrain from {} to {}, or press less hard (touch.force_n is {})",
            gauge.range_microstrain,
            up(units::microstrain(limit)),
            project.touch.force_n
        ),
        Filter::Jig => "switch feasible.jig off and press some gauges by hand, or choose a part with a straight way in".to_owned(),
        Filter::Painted => painted(inputs),
        Filter::KeptOut => {
            "make the region where no gauge may go (feasible.keep_out) smaller".to_owned()
        }
    };
    if blame.alone == 0 {
        return format!("{change}, and then see to the filters after it: they take the same sites");
    }
    change
}

fn painted(inputs: &Inputs) -> String {
    let any = (inputs.painted.as_ref()).is_some_and(|mask| mask.iter().any(|&set| set));
    if !any {
        return "paint where gauges can go, or clear the painted region (feasible.painted): nothing is painted in it".into();
    }
    format!(
        "paint a larger region (feasible.painted) where the other filters leave sites, or lower sites.spacing_mm ({}): too few of them lie in it",
        inputs.project.sites.spacing_mm
    )
}

/// Three digits of a number, so that what is measured passes a limit that is a least …
fn down(x: f64) -> f64 {
    digits(x, f64::floor)
}

/// … or a most.
fn up(x: f64) -> f64 {
    digits(x, f64::ceil)
}

fn digits(x: f64, round: fn(f64) -> f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let places = 2 - x.abs().log10().floor() as i32;
    let rounded = if places >= 0 {
        round(x * 10f64.powi(places)) / 10f64.powi(places)
    } else {
        round(x / 10f64.powi(-places)) * 10f64.powi(-places)
    };
    if rounded.is_finite() { rounded } else { x }
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_rounded_to_the_side_that_passes() {
        assert_eq!((down(5.2378), up(5.2378)), (5.23, 5.24));
        assert_eq!((down(123_456.0), up(123_456.0)), (123_000.0, 124_000.0));
        assert_eq!(down(0.0), 0.0);
        assert_eq!(up(0.30), 0.3);
    }
}
