//! What several touches read together, and how far that may be off.

use super::{RADII, SeveralTouches, Spot, TouchKind};
use crate::inference::matching::Matching;

impl Matching {
    /// What every channel reads of some touches (strain).
    #[must_use]
    pub fn reading_of_all(&self, touches: &SeveralTouches) -> Vec<f64> {
        let mut sum = vec![0.0; self.map.channels()];
        for reading in self.readings_of(touches) {
            for (sum, x) in sum.iter_mut().zip(reading) {
                *sum += x;
            }
        }
        sum
    }

    /// What every channel reads of each of some touches (strain).
    #[must_use]
    pub fn readings_of(&self, touches: &SeveralTouches) -> Vec<Vec<f64>> {
        let spots = self.spots_of(touches).into_iter();
        let reading = |spot: Spot| -> Vec<f64> {
            let felt = self.felt(&spot).reading.into_iter();
            felt.map(|g| spot.force * g).collect()
        };
        spots.map(reading).collect()
    }

    /// As [`Self::leeway`], of all of them together.
    #[must_use]
    pub fn leeway_of_all(&self, touches: &SeveralTouches) -> Vec<Vec<f64>> {
        if !matches!(touches.kind, TouchKind::Area(_)) {
            return touches
                .contacts
                .iter()
                .flat_map(|c| self.leeway(c))
                .collect();
        }
        let (lower, upper) = self.map.mesh.bounds();
        let across = (upper - lower).length();
        let scaled = |by: f64, of: &[f64]| of.iter().map(|v| by * v).collect::<Vec<f64>>();
        let mut ways = Vec::new();
        for spot in self.spots_of(touches) {
            let felt = self.felt(&spot);
            ways.push(scaled(self.most_force, &felt.reading));
            let sizes = [across, across, (RADII[1] / RADII[0]).ln()];
            let changes = felt.columns.iter().zip(sizes);
            ways.extend(changes.map(|(change, by)| scaled(by * spot.force, change)));
            let made = self.nuisances_of(&spot);
            ways.extend(made.iter().map(|n| scaled(2.0 * spot.force, &n.reading)));
        }
        ways
    }
}
