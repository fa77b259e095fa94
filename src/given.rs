//! The elastic model asked at given points: touches and gauges that somebody else chose.

mod sift;

use std::sync::Arc;

use glam::DVec3;

use crate::budget::{Budget, Watch};
use crate::design::{self, Built, Checks, DesignError, Inputs};
use crate::elasticity::estimate::{AccuracyTarget, BEYOND, Discretization};
use crate::elasticity::linearity::Linearity;
use crate::elasticity::observe::{Face, Observer, SiteFrame};
use crate::elasticity::respond::{Quantity, Responses, respond};
use crate::elasticity::{Model, Touch};
use crate::mesh::{SurfacePoint, TriMesh};
use crate::plain;

pub use sift::{GivenSite, GivenTable, LeftOutRow, Sifted, sift};

/// What the model answers.
pub struct GivenAnswer {
    /// The factored model.
    pub model: Box<dyn Model>,
    responses: Responses,
    /// The rows that were answered and those that were not, and how far each was off.
    pub rows: Sifted,
    /// How far it is from converged.
    pub discretization: Discretization,
    /// Of a shell.
    pub linearity: Option<Linearity>,
    /// What the solution was checked for.
    pub checks: Checks,
    /// What a reader must know.
    pub notes: Vec<String>,
}

/// One touch read at one site, on the inside face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPair {
    /// Rows of what was given.
    pub touch: usize,
    /// Row of the site in what was given.
    pub site: usize,
    /// m.
    pub displacement: DVec3,
    /// Along the gauge's direction, as a ratio.
    pub strain: f64,
}

/// A given normal further than this from the surface's is worth a word (cos 45°).
const ASKEW: f64 = 0.707;
/// A given normal nearer to the surface itself than this (cos 80°) is of neither side.
const SIDEWAYS: f64 = 0.174;

/// Answers for every touch at every site.
///
/// # Errors
/// [`DesignError`] for what cannot be computed, and for the first point that cannot be meant for this part.
pub fn answer(
    inputs: &Inputs,
    touches: &[Touch],
    sites: &[GivenSite],
    budget: &Budget,
    watch: Watch,
) -> Result<GivenAnswer, DesignError> {
    inputs.project.check()?;
    let mut rows = sift(&inputs.part, touches, sites);
    rows.refuse_any()?;
    let mut answer = answer_sifted(inputs, touches, sites, rows, budget, watch)?;
    answer.rows.refuse_any()?;
    Ok(answer)
}

/// Answers for the touches and sites that are left of those that were given; where the elements that are laid on the
/// part turn a gauge out of their surface, that one is left out too.
///
/// # Errors
/// [`DesignError`] for what cannot be computed, and where nothing is left.
pub fn answer_sifted(
    inputs: &Inputs,
    touches: &[Touch],
    sites: &[GivenSite],
    mut rows: Sifted,
    budget: &Budget,
    watch: Watch,
) -> Result<GivenAnswer, DesignError> {
    inputs.project.check()?;
    rows.check()?;
    // Solved, read out row by row, and written as text: several times the numbers themselves.
    design::check_room(sites.len(), touches.len(), 24)?;
    let touches: Vec<Touch> = rows.touches.iter().map(|&k| touches[k]).collect();
    let places: Vec<DVec3> = rows.sites.iter().map(|&k| sites[k].position).collect();
    let mut notes = Vec::new();
    let inputs = facing_touches(inputs, &touches, &mut notes);
    askew(&touches, &rows, &inputs.part, &mut notes);

    let ground = design::ground(&inputs, watch)?;
    ground.check(&inputs.project)?;
    let target = AccuracyTarget::new(&touches, &places, &budget.elements);
    let built = ground.build(&target, watch)?;
    let checks = Checks::of(&built);
    let Built {
        meshed,
        model,
        estimate,
        linearity,
        is_short,
        ..
    } = built;
    notes.extend(design::short_of_memory(is_short));
    notes.extend(design::open_solid(&inputs));
    notes.extend(design::overlapping_tetrahedra(&inputs));
    notes.extend(checks.distrust());
    notes.extend(design::cautions(
        &estimate,
        linearity.as_ref(),
        &inputs.project,
        budget,
    ));
    notes.extend(design::large_motion(
        &inputs.part,
        &estimate,
        linearity.as_ref(),
    ));
    let tips = || touches.iter().map(|t| t.tip_radius);
    let smallest = tips().fold(f64::INFINITY, f64::min);
    notes.extend(meshed.cautions(smallest));
    notes.extend(design::wide_tip(&inputs.part, tips().fold(0.0, f64::max)));
    let (observer, angles) = observed(&*model, sites, &mut rows);
    rows.check()?;
    notes.extend(under_tips(&touches, sites, &rows.sites));
    let held = design::on_what_is_held(&inputs, &touches)?;
    notes.extend(pressed_on_supports(&held, &rows));
    let reading = Quantity::GaugeAndDisplacement(&angles);
    let responses = respond(&*model, &touches, &observer, reading, watch)?;
    Ok(GivenAnswer {
        model,
        responses,
        rows,
        discretization: estimate,
        linearity,
        checks,
        notes,
    })
}

/// The sites that are left on a model, and the angle of each gauge there; one whose direction the model's surface
/// does not have is left out.
fn observed(model: &dyn Model, sites: &[GivenSite], rows: &mut Sifted) -> (Observer, Vec<f64>) {
    let on = |rows: &[usize]| {
        let nearest = |&k: &usize| model.index().nearest(sites[k].position).0;
        let points: Vec<SurfacePoint> = rows.iter().map(nearest).collect();
        model.observer(&points, Face::Inside)
    };
    let observer = on(&rows.sites);
    let projected: Vec<Result<f64, f64>> = (rows.sites.iter().zip(observer.frames()))
        .map(|(&k, frame)| angle_within(sites[k].direction, frame))
        .collect();
    let angles: Vec<f64> = projected.iter().flatten().copied().collect();
    if projected.iter().all(Result::is_ok) {
        return (observer, angles);
    }
    let tried = std::mem::take(&mut rows.sites);
    for (row, angle) in tried.into_iter().zip(projected) {
        match angle {
            Ok(_) => rows.sites.push(row),
            Err(angle_deg) => rows.left_out.push(LeftOutRow {
                table: GivenTable::Sites,
                row,
                why: DesignError::AcrossTheWall {
                    number: row,
                    angle_deg,
                },
            }),
        }
    }
    (on(&rows.sites), angles)
}

/// The angle of a direction in a tangent frame (radians), of its part in the surface; where next to nothing of it
/// is, how far it points out (degrees).
fn angle_within(direction: DVec3, frame: &SiteFrame) -> Result<f64, f64> {
    let (x, y) = (direction.dot(frame.x_axis), direction.dot(frame.y_axis));
    let within = x.hypot(y) / direction.length();
    // No number at all is no direction either.
    if within >= 0.1 {
        Ok(y.atan2(x))
    } else {
        Err(within.min(1.0).acos().to_degrees())
    }
}

impl GivenAnswer {
    /// All pairs, touch by touch.
    pub fn pairs(&self) -> impl Iterator<Item = GivenPair> + '_ {
        let Sifted { touches, sites, .. } = &self.rows;
        let rows: Vec<Vec<f64>> = (0..self.responses.rows())
            .map(|r| {
                let mut row = vec![0.0; touches.len()];
                self.responses.row_into(r, &mut row);
                row
            })
            .collect();
        let count = sites.len();
        (0..touches.len() * count).map(move |k| {
            let (touch, site) = (k / count, k % count);
            let u = |c: usize| rows[count + 3 * site + c][touch];
            GivenPair {
                touch: touches[touch],
                site: sites[site],
                displacement: DVec3::new(u(0), u(1), u(2)),
                strain: rows[site][touch],
            }
        })
    }
}

/// What has to be known of gauges beneath a tip: no estimate speaks of their strain, which changes there within a cell.
fn under_tips(touches: &[Touch], sites: &[GivenSite], rows: &[usize]) -> Option<String> {
    let beneath = |touch: &Touch| {
        let near = (BEYOND * touch.tip_radius).powi(2);
        let of = |&&row: &&usize| sites[row].position.distance_squared(touch.position) < near;
        rows.iter().filter(of).count()
    };
    let count: usize = touches.iter().map(beneath).sum();
    (count > 0).then(|| {
        format!(
            "{count} of {} pairs of touch and gauge lie within two tip radii of each other: the error in strain is not estimated there, and may be many times what is estimated farther out.",
            touches.len() * rows.len()
        )
    })
}

/// A word on touches that press on what is held.
fn pressed_on_supports(held: &[usize], rows: &Sifted) -> Option<String> {
    let first = rows.touches[*held.first()?];
    Some(format!(
        "{} (the first is touch {first}) on what a support holds: next to nothing moves there, whatever the force.",
        plain::either(held.len(), "touch presses", "touches press")
    ))
}

/// Touches come from outside: an open part that winds the other way is turned over.
fn facing_touches(inputs: &Inputs, touches: &[Touch], notes: &mut Vec<String>) -> Inputs {
    let part = &inputs.part;
    let facing = |touch: &Touch| {
        let at = part.index().nearest(touch.position).0;
        part.facet_normal(at.triangle).dot(touch.normal)
    };
    // Normals along the surface say nothing about its sides.
    let facing: Vec<f64> = touches.iter().map(facing).collect();
    let along = facing.iter().filter(|&&f| f > SIDEWAYS).count();
    let against = facing.iter().filter(|&&f| f < -SIDEWAYS).count();
    let mut inputs = inputs.clone();
    if against > along && part.boundary_edges().next().is_some() {
        notes.push(format!(
            "The mesh faces away from {against} of {} touches: it was turned over, so that its outside is where the touches are.",
            touches.len()
        ));
        inputs.part = Arc::new(part.turned_over());
    }
    inputs
}

/// Remarks on touches that press along what is not nearly the surface's normal.
fn askew(touches: &[Touch], rows: &Sifted, part: &TriMesh, notes: &mut Vec<String>) {
    let index = part.index();
    let turned: Vec<usize> = (touches.iter().zip(&rows.touches))
        .filter(|(t, _)| part.normal(index.nearest(t.position).0).dot(t.normal) < ASKEW)
        .map(|(_, &row)| row)
        .collect();
    let pressed = match turned[..] {
        [] => return,
        [only] => format!("The normal of touch {only} is more than 45° from the surface's: it was"),
        [first, ..] => format!(
            "The normals of {} touches (the first is touch {first}) are more than 45° from the surface's: they were",
            turned.len()
        ),
    };
    notes.push(format!("{pressed} pressed as given."));
}
