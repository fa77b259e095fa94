//! The open project as the window edits it: plain data, with undo and redo.

mod inputs;
mod paint;
mod state;

use std::path::PathBuf;
use std::sync::Arc;

use crate::design::{Inputs, check_shape};
use crate::io::project_file::LoadedProject;
use crate::mesh::geodesic::{March, MarchScratch};
use crate::mesh::repair::Repair;
use crate::mesh::{RepairReport, TriMesh};
use crate::project::{ChosenSite, PartModel};

pub use inputs::{
    DesignInputs, ElementInputs, ExpectedInputs, FilterInputs, JigInputs, ModelInputs, PaintInputs,
    ReductionInputs, SelectionInputs, SensingInputs, SimulationInputs, TradeInputs, WallInputs,
};
pub use paint::Brush;
pub use state::{DocumentState, Layer};

/// An open project.
pub struct Document {
    pub state: DocumentState,
    pub part: Arc<TriMesh>,
    pub repairs: RepairReport,
    /// Where it was opened from or saved to; nothing for the bundled limb until it is saved.
    pub path: Option<PathBuf>,
    pub mesh_path: PathBuf,
    /// The mesh is the one inside the program and lies in no file yet.
    pub bundled: bool,
    /// The ways over the part: a brush asks for them many times a second.
    march: March,
    scratch: MarchScratch,
    /// Body and repairs that the part was taken in with.
    taken_in: (usize, Repair),
    /// Why nothing can be computed on the part, whatever its project, where that is so.
    misshapen: Option<String>,
    saved: DocumentState,
    /// The state at the last finished gesture.
    settled: DocumentState,
    past: Vec<DocumentState>,
    future: Vec<DocumentState>,
}

/// Undo steps kept.
const DEPTH: usize = 200;

impl Document {
    #[must_use]
    pub fn new(loaded: LoadedProject, path: Option<PathBuf>) -> Self {
        let state = DocumentState {
            project: loaded.inputs.project,
            painted: loaded.inputs.painted,
            masks: loaded.inputs.masks,
        };
        let part = &state.project.part;
        Self {
            taken_in: (part.body, part.repair()),
            misshapen: (check_shape(&loaded.inputs.part).err()).map(|e| e.to_string()),
            march: March::over(&loaded.inputs.part),
            scratch: MarchScratch::default(),
            part: loaded.inputs.part,
            repairs: loaded.repairs,
            path,
            mesh_path: loaded.mesh_path,
            bundled: loaded.bundled,
            saved: state.clone(),
            settled: state.clone(),
            state,
            past: Vec::new(),
            future: Vec::new(),
        }
    }

    /// Whether the project asks for another body or other repairs than the part was taken in with.
    #[must_use]
    pub fn asks_for_another_part(&self) -> bool {
        let part = &self.state.project.part;
        self.taken_in != (part.body, part.repair())
    }

    /// Why nothing can be computed on the part, whatever its project says; nothing of most parts.
    #[must_use]
    pub fn misshapen(&self) -> Option<&str> {
        self.misshapen.as_deref()
    }

    /// A snapshot for a job.
    #[must_use]
    pub fn inputs(&self) -> Inputs {
        Inputs {
            project: self.state.project.clone(),
            part: Arc::clone(&self.part),
            painted: self.state.painted.clone(),
            masks: self.state.masks.clone(),
        }
    }

    /// Gauges that a computation found: they belong to no step of undo, and end no redo.
    pub fn adopt_sites(&mut self, sites: Vec<ChosenSite>) {
        self.settled.project.selection.sites.clone_from(&sites);
        self.state.project.selection.sites = sites;
    }

    /// Ends a gesture: what changed since the last one becomes one undo step.
    pub fn settle(&mut self) {
        self.state.drop_empty_layers();
        if self.state == self.settled {
            return;
        }
        self.past
            .push(std::mem::replace(&mut self.settled, self.state.clone()));
        if self.past.len() > DEPTH {
            self.past.remove(0);
        }
        self.future.clear();
    }

    pub fn undo(&mut self) {
        self.settle();
        if let Some(before) = self.past.pop() {
            self.future.push(std::mem::replace(&mut self.state, before));
            self.settled = self.state.clone();
        }
    }

    pub fn redo(&mut self) {
        self.settle();
        if let Some(after) = self.future.pop() {
            self.past.push(std::mem::replace(&mut self.state, after));
            self.settled = self.state.clone();
        }
    }

    #[must_use]
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty() || self.state != self.settled
    }

    #[must_use]
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty() && self.state == self.settled
    }

    #[must_use]
    pub fn is_dirty(&self) -> bool {
        self.state != self.saved
    }

    /// The state on disk, as far as is known.
    #[must_use]
    pub fn saved(&self) -> &DocumentState {
        &self.saved
    }

    /// What is on disk is not this state but that one.
    pub fn compare_with(&mut self, saved: DocumentState) {
        self.saved = saved;
    }

    /// What lies on disk now is this state, in a project and with a mesh at these paths. The name of the mesh
    /// belongs to no step of undo.
    pub fn saved_as(&mut self, path: PathBuf, mesh: PathBuf, saved: DocumentState) {
        let name = &saved.project.part.mesh;
        self.state.project.part.mesh.clone_from(name);
        self.settled.project.part.mesh.clone_from(name);
        self.path = Some(path);
        self.mesh_path = mesh;
        self.bundled = false;
        self.saved = saved;
    }

    /// Name for the title and the reports.
    #[must_use]
    pub fn name(&self) -> String {
        let path = self.path.as_ref().unwrap_or(&self.mesh_path);
        path.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    }

    /// Whether the part is taken as a solid.
    #[must_use]
    pub fn is_solid(&self) -> bool {
        self.state.project.part.model == PartModel::Solid
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::EstimatorKind;
    use crate::mesh::SurfacePoint;
    use crate::placement::SelectorKind;
    use crate::project::Project;

    fn document() -> Document {
        Document::new(crate::io::opening::bundled().unwrap(), None)
    }

    fn at(document: &Document) -> SurfacePoint {
        SurfacePoint {
            triangle: (document.part.triangles().len() / 2) as u32,
            barycentric: [1.0 / 3.0; 3],
        }
    }

    #[test]
    fn a_stroke_is_one_step_of_undo() {
        let mut d = document();
        let place = at(&d);
        d.dab(Layer::Feasible, Brush::Paint, place, 6e-3);
        d.dab(Layer::Feasible, Brush::Paint, place, 9e-3);
        d.settle();
        let painted = d
            .state
            .painted
            .as_ref()
            .unwrap()
            .iter()
            .filter(|&&m| m)
            .count();
        assert!(painted > 10 && painted < 300, "{painted}");
        d.dab(Layer::Feasible, Brush::Erase, place, 4e-3);
        d.settle();
        d.undo();
        assert_eq!(
            d.state
                .painted
                .as_ref()
                .unwrap()
                .iter()
                .filter(|&&m| m)
                .count(),
            painted
        );
        d.undo();
        assert!(d.state.painted.is_none() && !d.can_undo() && !d.is_dirty());
        d.redo();
        d.redo();
        assert!(!d.can_redo() && d.is_dirty());
    }

    #[test]
    fn a_new_change_ends_redo() {
        let mut d = document();
        d.state.project.touch.force_n = 12.0;
        d.settle();
        d.undo();
        d.state.project.touch.force_n = 14.0;
        d.settle();
        assert!(!d.can_redo());
        d.undo();
        assert_eq!(d.state.project.touch.force_n, 10.0);
    }

    #[test]
    fn only_what_depends_on_a_change_goes_stale() {
        let mut d = document();
        let before = document();
        let quality = before.state.project.budget.quality;
        let changed = |d: &Document| {
            [
                d.model_inputs() != before.model_inputs(),
                d.simulation_inputs(quality) != before.simulation_inputs(quality),
                d.filter_inputs(quality) != before.filter_inputs(quality),
                d.design_inputs(quality) != before.design_inputs(quality),
            ]
        };
        d.state.project.part.mesh = "elsewhere/limb.glb".into();
        assert_eq!(changed(&d), [false; 4]);
        d.state.project.selection.sensors = 5;
        assert_eq!(changed(&d), [false, false, false, true]);
        d.state.project.feasible.edge_radius_mm = 1.0;
        assert_eq!(changed(&d), [false, false, true, true]);
        d.state.project.part.thickness_mm = 2.0;
        assert_eq!(changed(&d), [true; 4]);
    }

    #[test]
    fn a_stroke_that_is_taken_back_leaves_what_depends_on_the_mask() {
        let mut d = document();
        let before = d.paint_inputs();
        d.fill(Layer::KeepOut);
        assert_ne!(d.paint_inputs(), before);
        let filled = d.paint_inputs();
        let place = at(&d);
        d.dab(Layer::KeepOut, Brush::Erase, place, 6e-3);
        assert_ne!(d.paint_inputs(), filled, "changed in place");
        d.fill(Layer::KeepOut);
        assert_eq!(d.paint_inputs(), filled, "the same values in another place");
        d.clear(Layer::KeepOut);
        assert_eq!(d.paint_inputs(), before);
    }

    /// Which of candidates, selections and design go stale when a project with one selector is changed.
    fn stale(selector: SelectorKind, change: impl Fn(&mut Project)) -> [bool; 3] {
        let mut d = document();
        d.state.project.selection.selector = selector;
        d.state.project.selection.compare = false;
        let quality = d.state.project.budget.quality;
        let before = d.design_inputs(quality);
        change(&mut d.state.project);
        let now = d.design_inputs(quality);
        [
            now.selection.reduction != before.selection.reduction,
            now.selection != before.selection,
            now != before,
        ]
    }

    #[test]
    fn another_workshop_is_another_judge_and_another_choice_for_who_knows_it() {
        let glued = |p: &mut Project| p.gauge.tolerance.place_mm = 0.5;
        let pressed = |p: &mut Project| p.touch.forces_n = [1.0, 10.0];
        let [knows, other] = [SelectorKind::ExpectedError, SelectorKind::PcaQr];
        assert_eq!(stale(other, glued), [false, false, true]);
        assert_eq!(stale(other, pressed), [false; 3]);
        assert_eq!(stale(knows, glued), [false, true, true]);
        assert_eq!(stale(knows, pressed), [false, true, true]);
        let drifting = |p: &mut Project| p.gauge.drift_microstrain = 2.0;
        let by_machine = |p: &mut Project| p.calibration.place_mm = 0.0;
        assert_eq!(stale(knows, drifting), [false, true, true]);
        let poor = |p: &mut Project| p.live.model_error = 0.1;
        assert_eq!(stale(knows, poor), [false, true, true]);
        assert_eq!(stale(other, poor), [false, false, true]);
        // What only the judge's estimator knows.
        assert_eq!(stale(knows, by_machine), [false, false, true]);
        // What readings change by is simulated as soon as touches are made otherwise, by however much.
        let sized = |p: &mut Project| p.touch.tip_tolerance_mm = 0.5;
        let dragged = |p: &mut Project| p.touch.friction_percent = 10.0;
        assert_eq!(stale(knows, sized), [true; 3]);
        // Of a force along the surface it is simulated in any case, because whoever finds touches allows for one.
        assert_eq!(stale(knows, dragged), [false, true, true]);
        let straight = |p: &mut Project| p.live.friction_percent = 0.0;
        assert_eq!(stale(knows, straight), [true; 3]);
        let counted = |p: &mut Project| p.gauge.resolution_microstrain = 2.0;
        // Sites that hardly move a count are filtered.
        assert_eq!(stale(knows, counted), [true; 3]);
        let mut document = document();
        let simulated = |d: &Document| d.simulation_inputs(d.state.project.budget.quality);
        let chosen = |d: &Document| d.selection_inputs(d.state.project.budget.quality);
        dragged(&mut document.state.project);
        let before = (simulated(&document), chosen(&document));
        document.state.project.touch.friction_percent = 20.0;
        assert!(simulated(&document) == before.0 && chosen(&document) != before.1);
    }

    #[test]
    fn another_estimator_is_another_judge() {
        let trained = |p: &mut Project| p.evaluation.estimator = EstimatorKind::Svr;
        assert_eq!(stale(SelectorKind::PcaQr, trained), [false, false, true]);
        let mut d = document();
        d.state.project.evaluation.estimator = EstimatorKind::Matching;
        let quality = d.state.project.budget.quality;
        let before = d.design_inputs(quality);
        d.state.project.live.largest_force_n = 200.0;
        assert_ne!(d.design_inputs(quality), before);
    }
}
