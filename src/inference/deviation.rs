//! How far off readings may be wherever a newton presses: each channel for itself by gluing, and all channels together by
//! the way a touch is made.

use std::sync::Arc;

use glam::DVec3;

use super::map::{ResponseMap, Slope};
use crate::mesh::SurfacePoint;
use crate::uncertainty::Making;

/// What readings of a newton may be off by, everywhere (standard deviations).
#[derive(Clone)]
pub struct Deviations {
    /// Of each channel for itself: by gluing (strain).
    pub own: Arc<ResponseMap>,
    /// Of all channels together; absent where touches are made just as they are said to be.
    pub nuisances: Option<Nuisances>,
    /// Both, as if each channel were off by all of it for itself (strain).
    pub all: Arc<ResponseMap>,
}

impl Deviations {
    /// By gluing alone (strain a newton).
    #[must_use]
    pub fn of_gluing(own: Arc<ResponseMap>) -> Self {
        Self {
            all: Arc::clone(&own),
            nuisances: None,
            own,
        }
    }

    /// By gluing and by the way touches are made.
    #[must_use]
    pub fn new(own: Arc<ResponseMap>, nuisances: Nuisances) -> Self {
        if nuisances.is_nothing() {
            return Self::of_gluing(own);
        }
        Self {
            all: Arc::new(nuisances.beside(&own)),
            nuisances: Some(nuisances),
            own,
        }
    }

    /// Of some of the channels, with factors, as [`ResponseMap::mixed`].
    #[must_use]
    pub fn mixed(&self, channels: &[Vec<(usize, f64)>]) -> Self {
        let own = Arc::new(self.own.mixed(channels));
        match &self.nuisances {
            Some(nuisances) => Self::new(own, nuisances.mixed(channels)),
            None => Self::of_gluing(own),
        }
    }
}

/// What a touch may have about it beside place and force: a tip of another size, and a force along the surface. All
/// channels feel the same of it, so that enough of them tell it apart from the place.
#[derive(Clone)]
pub struct Nuisances {
    /// How far off touches are made.
    pub making: Making,
    /// A metre more of the tip's radius; absent where the tip is taken to be as large as it is said to be.
    pub tip: Option<Arc<ResponseMap>>,
    /// A newton along x, y and z, whichever way the surface lies; absent where touches press straight in.
    pub axes: Option<Arc<[ResponseMap; 3]>>,
}

/// One of them at a place, for a touch of one newton, as far off as is usual.
#[derive(Clone, Debug)]
pub struct Nuisance {
    /// The force that it is, along the surface (N); zero for the tip's size.
    pub force: DVec3,
    /// How much larger the tip is (m); zero for a force.
    pub tip: f64,
    /// What every channel reads of it (strain).
    pub reading: Vec<f64>,
}

/// What is known of a touch beside its place and how hard it presses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TouchDoubts {
    /// Force along the surface over the one that presses.
    pub aside: DVec3,
    /// How much larger the tip is than it was said to be (m).
    pub tip: f64,
}

/// No place has more of them: the tip, and two directions along the surface.
pub const MOST: usize = 3;

impl Nuisances {
    /// As far as touches are off at all.
    #[must_use]
    pub fn new(
        making: Making,
        tip: Option<Arc<ResponseMap>>,
        axes: Option<Arc<[ResponseMap; 3]>>,
    ) -> Self {
        Self {
            making,
            tip: tip.filter(|_| making.tip > 0.0),
            axes: axes.filter(|_| making.friction > 0.0),
        }
    }

    fn is_nothing(&self) -> bool {
        self.tip.is_none() && self.axes.is_none()
    }

    /// Those of a place, at most [`MOST`].
    #[must_use]
    pub fn at(&self, at: SurfacePoint) -> Vec<Nuisance> {
        let scaled =
            |by: f64, of: Vec<f64>| -> Vec<f64> { of.into_iter().map(|v| by * v).collect() };
        let sized = self.tip.iter().map(|tip| Nuisance {
            force: DVec3::ZERO,
            tip: self.making.tip,
            reading: scaled(self.making.tip, tip.at(at)),
        });
        let dragged = self.axes.iter().flat_map(|axes| {
            let normal = axes[0].mesh.normal(at);
            let along = normal.any_orthonormal_vector();
            let [x, y, z] = axes.each_ref().map(|m| m.at(at));
            let by = self.making.along_either();
            [along, normal.cross(along)].map(|way| Nuisance {
                force: way * by,
                tip: 0.0,
                reading: (0..x.len())
                    .map(|c| by * way.dot(DVec3::new(x[c], y[c], z[c])))
                    .collect(),
            })
        });
        sized.chain(dragged).collect()
    }

    /// What one newton reads at a place, beside what it presses, of a touch about which so much is known (strain).
    pub(super) fn reading(&self, about: &TouchDoubts, at: SurfacePoint) -> Vec<f64> {
        let mut slope = Slope::zero(self.channels());
        self.add(about, at, &mut slope);
        slope.reading
    }

    fn channels(&self) -> usize {
        let tip = self.tip.iter().map(|tip| &**tip);
        let mut all = tip.chain(self.axes.iter().flat_map(|axes| axes.iter()));
        all.next().map_or(0, ResponseMap::channels)
    }

    /// Adds to what one newton reads at a place, and how that changes over the surface, what it reads of a touch about
    /// which so much is known.
    pub(super) fn add(&self, about: &TouchDoubts, at: SurfacePoint, slope: &mut Slope) {
        let tip = self.tip.iter().map(|tip| (about.tip, &**tip));
        let axes = self.axes.iter();
        let pushed = axes.flat_map(|axes| about.aside.to_array().into_iter().zip(&**axes));
        for (share, map) in tip.chain(pushed) {
            let more = map.slope(at);
            for (sum, value) in slope.reading.iter_mut().zip(&more.reading) {
                *sum += share * value;
            }
            for (sum, value) in slope.change.iter_mut().zip(&more.change) {
                *sum += *value * share;
            }
        }
    }

    /// Variance that they put on a channel's reading of one newton at a node of the map.
    fn variance_at_node(&self, node: usize, channel: usize, normal: DVec3) -> f64 {
        let of = |map: &ResponseMap| map.node(node)[channel];
        let shear = self.axes.as_ref().map_or(0.0, |axes| {
            let by_axis = DVec3::from_array(axes.each_ref().map(of));
            by_axis.reject_from_normalized(normal).length()
        });
        let tip = self.tip.as_ref().map_or(0.0, |tip| of(tip));
        self.making.variance(tip, shear)
    }

    /// What gluing leaves, and these beside it.
    fn beside(&self, own: &ResponseMap) -> ResponseMap {
        let channels = own.channels();
        let values = own
            .normals()
            .into_iter()
            .enumerate()
            .flat_map(|(node, normal)| {
                let together = move |(c, glued): (usize, &f64)| {
                    (glued * glued + self.variance_at_node(node, c, normal)).sqrt()
                };
                own.node(node).iter().enumerate().map(together)
            });
        ResponseMap::of(Arc::clone(&own.mesh), channels, values.collect())
    }

    fn mixed(&self, channels: &[Vec<(usize, f64)>]) -> Self {
        Self {
            making: self.making,
            tip: self.tip.as_ref().map(|m| Arc::new(m.mixed(channels))),
            axes: (self.axes.as_ref())
                .map(|axes| Arc::new(axes.each_ref().map(|m| m.mixed(channels)))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;

    /// Two channels that read the same per newton at all six nodes of a triangle, which faces along z.
    fn map(mesh: &Arc<TriMesh>, readings: [f64; 2]) -> ResponseMap {
        ResponseMap::of(Arc::clone(mesh), 2, readings.repeat(6))
    }

    #[test]
    fn all_channels_together_feel_of_a_touch_what_each_is_off_by() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
        let mesh = Arc::new(mesh);
        let making = Making {
            tip: 0.5e-3,
            friction: 0.2,
        };
        // What presses straight in counts for nothing.
        let axes = [[3e-6, 1e-6], [-4e-6, 2e-6], [-2e-6, 1e-6]].map(|c| map(&mesh, c));
        let tip = Arc::new(map(&mesh, [1e-3, -2e-3]));
        let nuisances = Nuisances::new(making, Some(tip), Some(Arc::new(axes)));
        let own = Arc::new(map(&mesh, [0.3e-6, 0.4e-6]));
        let deviations = Deviations::new(own, nuisances);
        let at = SurfacePoint {
            triangle: 0,
            barycentric: [0.2, 0.3, 0.5],
        };
        let expected = [0.25 + 0.02 * 25.0, 1.0 + 0.02 * 5.0];
        let alone = [0.09, 0.16];
        let found = deviations.nuisances.as_ref().unwrap().at(at);
        assert_eq!(found.len(), MOST);
        for (c, all) in deviations.all.at(at).into_iter().enumerate() {
            let together = found.iter().map(|n| n.reading[c] * n.reading[c]);
            let variance = together.sum::<f64>() * 1e12;
            assert!((variance - expected[c]).abs() < 1e-9, "{variance}");
            assert!((all * all * 1e12 - expected[c] - alone[c]).abs() < 1e-9);
        }
        let along: DVec3 = found.iter().map(|n| n.force).sum();
        assert!(along.z.abs() < 1e-12 && (along.length() - 0.2).abs() < 1e-12);
    }
}
