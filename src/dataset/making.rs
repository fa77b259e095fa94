//! How readings change with the way touches are made: by a tip of another size, and where a part of the force drags along
//! the surface.
//!
//! Under some of the touches of a dataset, and solved for only where either may be off: they are other loads.

use super::columns::Columns;
use super::site::{SlopesAsked, gauges_on};
use crate::budget::Cancelled;
use crate::elasticity::respond::{Quantity, Responses, respond};
use crate::elasticity::{Push, Touch};
use crate::uncertainty::Making;

/// Of a tip's radius: as far as it is made larger and smaller for the slope.
const STEP: f64 = 0.1;
/// Loads that stand for a touch, of either cause.
const WAYS: usize = 2;

/// What the reading of every site changes by under some of the touches of a dataset, at their force. In single precision:
/// they make up variances. Nothing is held for what is not off.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MakingSlopes {
    /// The touches of the dataset, rising.
    columns: Columns,
    /// Sites × touches: strain a metre of the tip's radius.
    tip: Vec<f32>,
    /// Sites × touches, for each of two directions along the surface: strain where as much force acts that way as presses.
    shear: [Vec<f32>; 2],
}

/// What a site's reading of a touch changes by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MakingSlope {
    /// Strain a metre of the tip's radius.
    pub tip: f64,
    /// Strain where as much force acts along the surface as presses, in each of two directions at right angles.
    pub shear: [f64; 2],
}

impl MakingSlopes {
    /// Solves for the touches that are meant made otherwise, as far as `making` says that they may be. Also how many
    /// right-hand sides that took.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub(super) fn of(asked: &SlopesAsked, making: &Making) -> Result<(Self, usize), Cancelled> {
        let (model, gauges, pressed) = (asked.model, asked.gauges, asked.pressed());
        let solve = |wanted: bool, ways: fn(&Touch) -> [Push; WAYS]| {
            if !wanted || gauges.is_empty() {
                return Ok(None);
            }
            let pushes: Vec<Push> = pressed.iter().flat_map(ways).collect();
            let (observer, angles) = gauges_on(model, gauges);
            let reading = Quantity::Gauge(&angles);
            respond(model, &pushes, &observer, reading, asked.watch).map(Some)
        };
        let mut found = Self {
            columns: Columns::new(asked.columns.to_vec()),
            ..Self::default()
        };
        let mut solves = 0;
        // One after the other: the answers to both together might not fit where those to one do.
        let shape = (gauges.len(), pressed.len());
        if let Some(sized) = solve(making.tip > 0.0, of_two_sizes)? {
            solves += sized.solves;
            let radius = |t: usize| pressed[t].tip_radius;
            let slope = |t: usize, [larger, smaller]: [f64; WAYS]| {
                (larger - smaller) / (2.0 * STEP * radius(t))
            };
            found.tip = each(&sized, shape, slope);
        }
        if let Some(dragged) = solve(making.friction > 0.0, along_the_surface)? {
            solves += dragged.solves;
            found.shear = [0, 1].map(|way| each(&dragged, shape, |_, ways| ways[way]));
        }
        Ok((found, solves))
    }

    /// Of all sites, sites × touches each or nothing: by the tip's radius, and along two directions.
    #[must_use]
    pub fn all(&self) -> [&[f32]; 3] {
        let [along, across] = &self.shear;
        [&self.tip, along, across]
    }

    /// Slopes that are known already, as [`Self::all`] has them.
    #[must_use]
    pub fn known(touches: Vec<usize>, [tip, along, across]: [Vec<f32>; 3]) -> Self {
        Self {
            columns: Columns::new(touches),
            tip,
            shear: [along, across],
        }
    }

    /// The touches of the dataset that they are known for.
    #[must_use]
    pub fn columns(&self) -> &Columns {
        &self.columns
    }

    /// What a site's reading of the touch of a column changes by.
    #[must_use]
    pub fn of_touch(&self, site: usize, column: usize) -> MakingSlope {
        let at = site * self.columns.len() + column;
        let of = |values: &Vec<f32>| values.get(at).map_or(0.0, |v| f64::from(*v));
        MakingSlope {
            tip: of(&self.tip),
            shear: self.shear.each_ref().map(of),
        }
    }

    /// Those of one site alone.
    #[must_use]
    pub(super) fn only(&self, site: usize) -> Self {
        let count = self.columns.len();
        let own = |values: &Vec<f32>| match &values[..] {
            [] => Vec::new(),
            all => all[site * count..][..count].to_vec(),
        };
        Self {
            columns: self.columns.clone(),
            tip: own(&self.tip),
            shear: self.shear.each_ref().map(own),
        }
    }

    /// Forgets all sites but the first.
    pub(super) fn truncate(&mut self, sites: usize) {
        let count = sites * self.columns.len();
        let [along, across] = &mut self.shear;
        for values in [&mut self.tip, along, across] {
            values.truncate(count);
        }
    }

    /// One site more, of which they are known under every touch.
    pub(super) fn push(&mut self, site: &Self) {
        let [along, across] = &mut self.shear;
        let rows = [&site.tip, &site.shear[0], &site.shear[1]];
        for (values, row) in [&mut self.tip, along, across].into_iter().zip(rows) {
            values.extend(
                self.columns
                    .touches()
                    .iter()
                    .filter_map(|&touch| row.get(touch)),
            );
        }
    }
}

/// Straight in, by a tip that is larger and by one that is smaller.
fn of_two_sizes(touch: &Touch) -> [Push; WAYS] {
    [1.0 + STEP, 1.0 - STEP].map(|by| {
        Push::from(&Touch {
            tip_radius: by * touch.tip_radius,
            ..*touch
        })
    })
}

/// As hard as the touch, in two directions along the surface.
fn along_the_surface(touch: &Touch) -> [Push; WAYS] {
    let along = touch.normal.any_orthonormal_vector();
    [along, touch.normal.cross(along)].map(|way| Push {
        touch: *touch,
        force: way * touch.force,
    })
}

/// What every gauge makes of what it reads of each touch made in two ways: sites × touches.
fn each(
    responses: &Responses,
    (gauges, touches): (usize, usize),
    of: impl Fn(usize, [f64; WAYS]) -> f64,
) -> Vec<f32> {
    let mut row = vec![0.0; WAYS * touches];
    let mut values = Vec::with_capacity(gauges * touches);
    for gauge in 0..gauges {
        responses.row_into(gauge, &mut row);
        let (pairs, _) = row.as_chunks::<WAYS>();
        values.extend(
            pairs
                .iter()
                .enumerate()
                .map(|(t, pair)| of(t, *pair) as f32),
        );
    }
    values
}
