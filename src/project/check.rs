//! What the values of a project must be: each within the range of its key, and together.

use super::axis::is_direction;
use super::key::number;
use super::value::BadValue;
use super::{Project, SupportKeys};
use crate::dataset::Signal;
use crate::elasticity::support::MOST;

/// How many forces sets may be judged at.
const JUDGED: std::ops::RangeInclusive<usize> = 1..=20;

impl Project {
    /// Holds every value against the range of its key, and values against each other.
    ///
    /// # Errors
    /// [`BadValue`] for the first that cannot be used.
    pub fn check(&self) -> Result<(), BadValue> {
        let mut found = Ok(());
        self.tables(&mut |standing, table| {
            if found.is_ok() {
                found = table.obeys().map_err(|bad| standing.names(table, bad));
            }
        });
        found?;
        self.check_forces()?;
        self.check_judged()?;
        self.check_counts()?;
        self.check_directions()?;
        self.check_channels()
    }

    fn check_forces(&self) -> Result<(), BadValue> {
        let [lightest, hardest] = self.touch.forces_n;
        if lightest <= hardest {
            return Ok(());
        }
        Err(BadValue {
            key: "touch.forces_n".to_owned(),
            rule: "the lightest force and then the hardest".into(),
            value: format!("[{}, {}]", number(lightest), number(hardest)),
        })
    }

    fn check_judged(&self) -> Result<(), BadValue> {
        let forces = &self.evaluation.forces_n;
        let rising = forces.windows(2).all(|pair| pair[0] < pair[1]);
        if rising && JUDGED.contains(&forces.len()) {
            return Ok(());
        }
        let listed: Vec<String> = forces.iter().take(4).map(|&f| number(f)).collect();
        let more = if forces.len() > listed.len() {
            ", …"
        } else {
            ""
        };
        Err(BadValue {
            key: "evaluation.forces_n".to_owned(),
            rule: format!(
                "{} to {} forces, each harder than the one before",
                JUDGED.start(),
                JUDGED.end()
            )
            .into(),
            value: format!("[{}{more}]", listed.join(", ")),
        })
    }

    fn check_counts(&self) -> Result<(), BadValue> {
        let supports = self.supports.len();
        if supports > MOST {
            return Err(BadValue {
                key: "support".to_owned(),
                rule: format!("between 0 and {MOST}").into(),
                value: supports.to_string(),
            });
        }
        let directions = self.gauge.directions;
        if directions == 1 || self.gauge.signal == Signal::Strain {
            return Ok(());
        }
        Err(BadValue {
            key: "gauge.directions".to_owned(),
            rule: "1 for displacements, which have no direction of a gauge".into(),
            value: directions.to_string(),
        })
    }

    fn check_directions(&self) -> Result<(), BadValue> {
        let supports = self.supports.iter().map(|s| s.box_axis.as_ref());
        let regions = (self.evaluation.regions.iter()).map(|r| r.box_axis.as_ref());
        let costs = self.selection.costs.iter().map(|c| c.box_axis.as_ref());
        let sites = self.selection.sites.iter().map(|s| Some(&s.direction));
        let kept = self.kept.iter().flat_map(|kept| &kept.sites);
        let kept = kept.map(|s| Some(&s.direction));
        let directions = (supports.map(|axis| ("support.box_axis", axis)))
            .chain(regions.map(|axis| ("evaluation.region.box_axis", axis)))
            .chain(costs.map(|axis| ("selection.cost.box_axis", axis)))
            .chain(sites.map(|axis| ("selection.site.direction", axis)))
            .chain(kept.map(|axis| ("kept.site.direction", axis)));
        for (key, direction) in directions {
            direction.map_or(Ok(()), |direction| is_direction(key, direction))?;
        }
        let is_alone = |s: &SupportKeys| s.box_axis.is_some() && s.box_mm.is_none();
        if self.supports.iter().any(is_alone) {
            return Err(BadValue {
                key: "support.box_axis".to_owned(),
                rule: "given beside box_mm, which it turns".into(),
                value: "given without it".into(),
            });
        }
        Ok(())
    }

    fn check_channels(&self) -> Result<(), BadValue> {
        let Some((first, second, channel)) = self.live.shared_channel() else {
            return Ok(());
        };
        Err(BadValue {
            key: "live.channels".to_owned(),
            rule: "another channel for each gauge".into(),
            value: format!("{channel} for gauges {} and {}", first + 1, second + 1),
        })
    }
}

#[cfg(test)]
mod tests;
