//! A click presses the limb: a worker keeps the factored model and solves the latest touch.

use glam::DVec3;

use super::latest::{Desk, Latest};
use crate::budget::unwatched;
use crate::design::{self, DesignError, Inputs};
use crate::document::Document;
use crate::elasticity::observe::{Face, Observer};
use crate::elasticity::{Model, Touch};
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, TriMesh};

/// What a touch did, at every vertex of the part.
pub struct Touched {
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
    key: String,
}

/// How large the largest displacement is drawn, as a share of the limb.
const SHOWN_DEFORMATION: f64 = 0.06;

/// A round factor by which a largest displacement (m) shows on a part.
fn exaggeration(part: &TriMesh, largest: f64) -> Option<f64> {
    if largest <= 0.0 {
        return None;
    }
    let (lower, upper) = part.bounds();
    let wanted = SHOWN_DEFORMATION * (upper - lower).length() / largest;
    let power = 10f64.powf(wanted.log10().floor());
    let round = [5.0, 2.0, 1.0].map(|m| m * power);
    round.into_iter().find(|s| *s <= wanted)
}

struct Request {
    key: String,
    inputs: Inputs,
    touch: Touch,
}

const BROKEN: &str = "An internal error stopped this touch. Please report it";

/// The touch that is shown, and the worker that computes it.
#[derive(Default)]
pub(super) struct Touching {
    worker: Option<Latest<Request, Touched>>,
    waiting: usize,
    result: Option<Touched>,
    /// Counts results, so that the view knows when to build its fields anew.
    pub version: u64,
}

impl Touching {
    /// Applies a touch of the project's force; the answer comes later.
    pub fn apply(&mut self, ctx: &egui::Context, document: &Document, at: SurfacePoint) {
        let project = &document.state.project;
        let (force, tip_radius) = project.tip();
        let request = Request {
            key: document.model_key(),
            inputs: document.inputs(),
            touch: Touch {
                position: document.part.point(at),
                normal: document.part.normal(at),
                force,
                tip_radius,
            },
        };
        let worker = (self.worker).get_or_insert_with(|| Latest::start(ctx, BROKEN, serve));
        if worker.ask(request) {
            self.waiting += 1;
        }
    }

    pub fn result(&self) -> Option<&Touched> {
        self.result.as_ref()
    }

    pub fn is_waiting(&self) -> bool {
        self.waiting > 0
    }

    pub fn clear(&mut self) {
        self.result = None;
        self.version += 1;
    }

    /// Takes in answers; an error in the user's terms comes back.
    pub fn collect(&mut self, document: &Document) -> Option<String> {
        let mut error = None;
        if let Some(worker) = &self.worker {
            for reply in worker.answers() {
                self.waiting = 0;
                match reply {
                    Ok(touched) => {
                        self.result = Some(touched);
                        self.version += 1;
                    }
                    Err(message) => error = Some(message),
                }
            }
        }
        // What was computed for another part or support no longer shows this one.
        if self
            .result
            .as_ref()
            .is_some_and(|r| r.key != document.model_key())
        {
            self.clear();
        }
        error
    }
}

/// Answers requests on one model; returns the first that needs another.
fn serve(first: Request, desk: &Desk<Request, Touched>) -> Option<Request> {
    let model = match build(&first.inputs) {
        Ok(model) => model,
        Err(error) => {
            desk.answer(Err(format!("The touch could not be computed: {error}")));
            return desk.wait();
        }
    };
    let vertices = design::carry(model.index(), &first.inputs.part);
    let observer = model.observer(&vertices, Face::Inside);
    let key = first.key.clone();
    let mut request = first;
    loop {
        // Only the latest touch matters.
        request = desk.latest(request);
        if request.key != key {
            return Some(request);
        }
        desk.answer(Ok(solve(&*model, &observer, &request)));
        request = desk.wait()?;
    }
}

/// An even mesh, quick to have: the click is answered at once, the simulation brings the graded one.
fn build(inputs: &Inputs) -> Result<Box<dyn Model>, DesignError> {
    inputs.project.check()?;
    let ground = design::ground(inputs, &unwatched)?;
    ground.quick(&unwatched)
}

fn solve(model: &dyn Model, observer: &Observer, request: &Request) -> Touched {
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
    Touched {
        touch: request.touch,
        largest,
        exaggeration,
        index: SurfaceIndex::of(shown, part.triangles()),
        displacement,
        strain,
        key: request.key.clone(),
    }
}
