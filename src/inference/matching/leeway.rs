//! What a touch that was found reads, and the ways in which it may be another one: for whoever wants to know what of a
//! reading no touch explains.

use glam::DVec3;

use super::{Contact, Matching};

/// Touches that stand for all that may be meant where no narrow place is, and how far they are apart in templates.
const LIKELY: usize = 6;
const APART: f64 = 3.0;

impl Matching {
    /// What every channel reads of a touch (strain).
    #[must_use]
    pub fn reading_of(&self, touch: &Contact) -> Vec<f64> {
        let at = self.map.mesh.index().nearest(touch.position).0;
        let slope = self.slope(&touch.about(), at);
        slope.reading.iter().map(|g| touch.force * g).collect()
    }

    /// By what readings differ (strain) where the touch is somewhere else near by, harder, or made otherwise: each as far
    /// as it can be thought to be. Of a wide stretch of places, by what touches at the likeliest of them read: as the
    /// last search found these.
    #[must_use]
    pub fn leeway(&self, touch: &Contact) -> Vec<Vec<f64>> {
        let scaled = |by: f64, of: &[f64]| of.iter().map(|v| by * v).collect::<Vec<f64>>();
        if !touch.narrow {
            let mut places: Vec<DVec3> = Vec::with_capacity(LIKELY);
            let apart = APART * self.map.spacing();
            let mut ways = vec![scaled(self.most_force, &self.reading_of(touch))];
            while places.len() < LIKELY {
                let free = |p: DVec3| places.iter().all(|q| q.distance(p) >= apart);
                let Some(node) = self.best_template(&free) else {
                    break;
                };
                places.push(self.map.places[node]);
                ways.push(scaled(self.most_force, self.map.node(node)));
            }
            return ways;
        }
        let at = self.map.mesh.index().nearest(touch.position).0;
        let slope = self.slope(&touch.about(), at);
        let (lower, upper) = self.map.mesh.bounds();
        let across = touch.force * (upper - lower).length();
        let moved = [0, 1].map(|k| slope.change.iter().map(|d| across * d[k]).collect());
        let nuisances = self.nuisances().map_or_else(Vec::new, |n| n.at(at));
        let made = (nuisances.iter()).map(|n| scaled(2.0 * touch.force, &n.reading));
        let harder = scaled(self.most_force, &slope.reading);
        (moved.into_iter().chain([harder]).chain(made)).collect()
    }
}
