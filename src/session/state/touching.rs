//! What a touch does to the part, and the worker that keeps the factored model and solves the latest touch.

use glam::DVec3;

use crate::budget::unwatched;
use crate::design::{self, DesignError, Inputs};
use crate::document::ModelInputs;
use crate::elasticity::observe::{Face, Observer};
use crate::elasticity::{Model, Touch};
use crate::mesh::TriMesh;
use crate::mesh::locate::SurfaceIndex;
use crate::session::latest::{Latest, LatestDesk};
use crate::session::slot::Slot;

/// What a touch did, at every vertex of the part.
pub struct TouchEffect {
    pub touch: Touch,
    /// m.
    pub displacement: Vec<DVec3>,
    /// Principal strain of the inside face that is larger in size, signed.
    pub strain: Vec<f64>,
    /// Largest displacement (m).
    pub largest: f64,
    /// How much the displacement is exaggerated where it is shown; nothing where there is none.
    pub exaggeration: Option<f64>,
    /// The part as it is shown, to be pointed at.
    pub index: SurfaceIndex,
}

/// How large the largest displacement is drawn, as a share of the limb.
pub(in crate::session) const SHOWN_DEFORMATION: f64 = 0.06;

/// A round factor by which a largest displacement (m) shows on a part.
pub(in crate::session) fn exaggeration(part: &TriMesh, largest: f64) -> Option<f64> {
    if largest <= 0.0 {
        return None;
    }
    let (lower, upper) = part.bounds();
    let wanted = SHOWN_DEFORMATION * (upper - lower).length() / largest;
    let power = 10f64.powf(wanted.log10().floor());
    let round = [5.0, 2.0, 1.0].map(|m| m * power);
    round.into_iter().find(|s| *s <= wanted)
}

pub(in crate::session) struct TouchRequest {
    pub(in crate::session) model: ModelInputs,
    pub(in crate::session) inputs: Inputs,
    pub(in crate::session) touch: Touch,
}

pub(in crate::session) const BROKEN: &str =
    "An internal error stopped this touch. Please report it";

/// The touch that is shown, and the worker that computes it.
#[derive(Default)]
pub struct Touching {
    pub(in crate::session) worker: Option<Latest<TouchRequest, Slot<ModelInputs, TouchEffect>>>,
    pub(in crate::session) waiting: bool,
    pub(in crate::session) result: Option<Slot<ModelInputs, TouchEffect>>,
    /// Counts results, so that whoever draws them knows when to do so anew.
    pub version: u64,
}

impl Touching {
    /// The touch that is shown.
    #[must_use]
    pub fn result(&self) -> Option<&TouchEffect> {
        self.result.as_ref().map(|slot| &slot.value)
    }

    /// Whether one is being computed.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.waiting
    }

    pub(in crate::session) fn show(&mut self, result: Option<Slot<ModelInputs, TouchEffect>>) {
        self.result = result;
        self.version += 1;
    }
}

/// Answers requests on one model; returns the first that needs another.
pub(in crate::session) fn serve(
    first: TouchRequest,
    desk: &LatestDesk<TouchRequest, Slot<ModelInputs, TouchEffect>>,
) -> Option<TouchRequest> {
    let model = match build(&first.inputs) {
        Ok(model) => model,
        Err(error) => {
            desk.answer(Err(format!("The touch could not be computed: {error}")));
            return desk.wait();
        }
    };
    let vertices = design::carry(model.mesh(), &first.inputs.part);
    let observer = model.observer(&vertices, Face::Inside);
    let model_inputs = first.model.clone();
    let mut request = first;
    loop {
        // Only the latest touch matters.
        request = desk.latest(request);
        if request.model != model_inputs {
            return Some(request);
        }
        desk.answer(Ok(Slot {
            inputs: model_inputs.clone(),
            value: solve(&*model, &observer, &request),
        }));
        request = desk.wait()?;
    }
}

/// An even mesh, quick to have: the click is answered at once, the simulation brings the graded one.
pub(in crate::session) fn build(inputs: &Inputs) -> Result<Box<dyn Model>, DesignError> {
    inputs.project.check()?;
    let ground = design::ground(inputs, &unwatched)?;
    ground.quick(&unwatched)
}

pub(in crate::session) fn solve(
    model: &dyn Model,
    observer: &Observer,
    request: &TouchRequest,
) -> TouchEffect {
    let u = model.press(&request.touch);
    let displacement: Vec<DVec3> = observer.displacement_of(model, &u);
    let strain = observer
        .strain_of(model, &u)
        .into_iter()
        .map(|[xx, yy, xy]| {
            let (mean, radius) = (f64::midpoint(xx, yy), ((xx - yy) / 2.0).hypot(xy / 2.0));
            mean + radius * if mean < 0.0 { -1.0 } else { 1.0 }
        })
        .collect();
    let largest = displacement.iter().map(|d| d.length()).fold(0.0, f64::max);
    let part = &request.inputs.part;
    let exaggeration = exaggeration(part, largest);
    let scale = exaggeration.unwrap_or(0.0);
    let moved = part.positions().iter().zip(&displacement);
    let shown = moved.map(|(p, u)| *p + *u * scale).collect();
    TouchEffect {
        touch: request.touch,
        largest,
        exaggeration,
        index: SurfaceIndex::of(shown, part.triangles()),
        displacement,
        strain,
    }
}
