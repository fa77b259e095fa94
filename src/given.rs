//! The elastic model asked at given points: touches and gauges that somebody else chose.

use std::sync::Arc;

use glam::DVec3;

use crate::budget::{Budget, Watch};
use crate::design::{self, Built, Checks, DesignError, Inputs};
use crate::elasticity::estimate::Discretization;
use crate::elasticity::linearity::Linearity;
use crate::elasticity::observe::{Face, Observer};
use crate::elasticity::respond::{Reading, Responses, respond};
use crate::elasticity::{Model, Touch};
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, TriMesh};

/// A gauge at a given place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenSite {
    /// m.
    pub position: DVec3,
    /// The direction the gauge measures along; its part in the surface counts.
    pub direction: DVec3,
}

/// What the model answers.
pub struct Answer {
    pub model: Box<dyn Model>,
    responses: Responses,
    sites: usize,
    touches: usize,
    /// How far the given points lay from the part (m).
    pub touch_distances: Vec<f64>,
    pub site_distances: Vec<f64>,
    pub discretization: Discretization,
    /// Of a shell.
    pub linearity: Option<Linearity>,
    pub checks: Checks,
    /// What a reader must know.
    pub notes: Vec<String>,
}

/// One touch read at one site, on the inside face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    pub touch: usize,
    pub site: usize,
    /// m.
    pub displacement: DVec3,
    pub strain: f64,
}

/// A given normal further than this from the surface's is worth a word (cos 45°).
const ASKEW: f64 = 0.707;

/// Answers for every touch at every site.
///
/// # Errors
/// [`DesignError`] for what cannot be computed, and for points that cannot be meant for this part.
pub fn answer(
    inputs: &Inputs,
    touches: &[Touch],
    sites: &[GivenSite],
    budget: &Budget,
    watch: Watch,
) -> Result<Answer, DesignError> {
    inputs.project.check()?;
    let index = SurfaceIndex::new(&inputs.part);
    let reach = Reach::of(&inputs.part, &index);
    reach.check("touch", touches.iter().map(|t| t.position))?;
    reach.check("site", sites.iter().map(|s| s.position))?;
    // Solved, read out row by row, and written as text: several times the numbers themselves.
    design::check_room(sites.len(), touches.len(), 24)?;
    let mut notes = Vec::new();
    let inputs = facing_touches(inputs, touches, &index, &mut notes);
    let index = SurfaceIndex::new(&inputs.part);
    let distances = |points: &mut dyn Iterator<Item = DVec3>| -> Vec<f64> {
        points.map(|p| index.nearest(p).1).collect()
    };
    let touch_distances = distances(&mut touches.iter().map(|t| t.position));
    let site_distances = distances(&mut sites.iter().map(|s| s.position));
    askew(touches, &index, &inputs.part, &mut notes);

    let ground = design::ground(&inputs, watch)?;
    let places: Vec<DVec3> = sites.iter().map(|s| s.position).collect();
    ground.check(&inputs.project)?;
    let built = ground.build(touches, &places, &budget.elements, watch)?;
    let checks = Checks::of(&built);
    let Built {
        laid,
        model,
        estimate,
        linearity,
        ..
    } = built;
    notes.extend(design::open_solid(&inputs));
    notes.extend(checks.distrust());
    notes.extend(design::cautions(
        &estimate,
        linearity.as_ref(),
        &inputs.project,
        budget,
    ));
    let smallest = touches
        .iter()
        .map(|t| t.tip_radius)
        .fold(f64::INFINITY, f64::min);
    notes.extend(ground.cautions(&laid, smallest));
    let points: Vec<SurfacePoint> = places.iter().map(|&p| model.index().nearest(p).0).collect();
    let observer = model.observer(&points, Face::Inside);
    let angles = angles(sites, &observer)?;
    let reading = Reading::GaugeAndDisplacement(&angles);
    let responses = respond(&*model, touches, &observer, reading, watch)?;
    Ok(Answer {
        model,
        responses,
        sites: sites.len(),
        touches: touches.len(),
        touch_distances,
        site_distances,
        discretization: estimate,
        linearity,
        checks,
        notes,
    })
}

impl Answer {
    /// All pairs, touch by touch.
    pub fn pairs(&self) -> impl Iterator<Item = Pair> + '_ {
        let rows: Vec<Vec<f64>> = (0..self.responses.rows())
            .map(|r| {
                let mut row = vec![0.0; self.touches];
                self.responses.row_into(r, &mut row);
                row
            })
            .collect();
        let sites = self.sites;
        (0..self.touches * sites).map(move |k| {
            let (touch, site) = (k / sites, k % sites);
            let u = |c: usize| rows[sites + 3 * site + c][touch];
            Pair {
                touch,
                site,
                displacement: DVec3::new(u(0), u(1), u(2)),
                strain: rows[site][touch],
            }
        })
    }
}

/// Touches come from outside: an open part that winds the other way is turned over.
fn facing_touches(
    inputs: &Inputs,
    touches: &[Touch],
    index: &SurfaceIndex,
    notes: &mut Vec<String>,
) -> Inputs {
    let part = &inputs.part;
    let against = touches
        .iter()
        .filter(|t| {
            let at = index.nearest(t.position).0;
            part.facet_normal(at.triangle).dot(t.normal) < 0.0
        })
        .count();
    let mut inputs = inputs.clone();
    if 2 * against > touches.len() && part.boundary_edges().next().is_some() {
        notes.push(format!(
            "The mesh faces away from {against} of {} touches: it was turned over, so that its outside is where the touches are.",
            touches.len()
        ));
        inputs.part = Arc::new(part.turned_over());
    }
    inputs
}

/// Whether points can be meant for a part: none lies farther from it than it is large.
///
/// # Errors
/// [`DesignError::OffThePart`] for the first that does; `what` it is.
pub fn check_reach(
    part: &TriMesh,
    what: &'static str,
    points: impl Iterator<Item = DVec3>,
) -> Result<(), DesignError> {
    Reach::of(part, &SurfaceIndex::new(part)).check(what, points)
}

/// How far from a part points can be meant for it: no farther than it is large.
struct Reach<'a> {
    index: &'a SurfaceIndex,
    lower: DVec3,
    upper: DVec3,
    /// m.
    size: f64,
}

impl<'a> Reach<'a> {
    fn of(part: &TriMesh, index: &'a SurfaceIndex) -> Self {
        let (lower, upper) = part.bounds();
        Self {
            index,
            lower,
            upper,
            size: (upper - lower).length(),
        }
    }

    fn check(
        &self,
        what: &'static str,
        points: impl Iterator<Item = DVec3>,
    ) -> Result<(), DesignError> {
        for (number, point) in points.enumerate() {
            let distance = self.distance(point);
            if distance > self.size {
                return Err(DesignError::OffThePart {
                    what,
                    number,
                    distance_mm: distance * 1000.0,
                    size_mm: self.size * 1000.0,
                });
            }
        }
        Ok(())
    }

    /// From the part (m); of what is out of reach, from the box around it. The box is asked first: very far
    /// out squares are no numbers any more, and the nearest place is not found.
    fn distance(&self, point: DVec3) -> f64 {
        if !point.is_finite() {
            return f64::INFINITY;
        }
        let beyond = (point - point.clamp(self.lower, self.upper)).abs();
        let widest = beyond.max_element();
        if widest > self.size {
            widest * (beyond / widest).length()
        } else {
            self.index.nearest(point).1
        }
    }
}

fn askew(touches: &[Touch], index: &SurfaceIndex, part: &TriMesh, notes: &mut Vec<String>) {
    let turned: Vec<usize> = touches
        .iter()
        .enumerate()
        .filter(|(_, t)| part.normal(index.nearest(t.position).0).dot(t.normal) < ASKEW)
        .map(|(k, _)| k)
        .collect();
    if let Some(first) = turned.first() {
        notes.push(format!(
            "The normals of {} touches (the first is touch {first}) are more than 45° from the surface's: they were pressed as given.",
            turned.len()
        ));
    }
}

fn angles(sites: &[GivenSite], observer: &Observer) -> Result<Vec<f64>, DesignError> {
    sites
        .iter()
        .zip(observer.frames())
        .enumerate()
        .map(|(number, (site, frame))| {
            let d = site.direction;
            let (x, y) = (d.dot(frame.x_axis), d.dot(frame.y_axis));
            if x.hypot(y) < 0.1 * d.length() || !d.is_finite() || d.length() == 0.0 {
                return Err(DesignError::AcrossTheWall { number });
            }
            Ok(y.atan2(x))
        })
        .collect()
}
