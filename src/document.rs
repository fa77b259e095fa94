//! The open project as the window edits it: plain data, with undo and redo.

mod paint;

use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::{Arc, Weak};

use crate::budget::Quality;
use crate::design::{Inputs, check_shape};
use crate::io::project_file::LoadedProject;
use crate::mesh::geodesic::{March, Scratch};
use crate::mesh::repair::Repair;
use crate::mesh::{RepairReport, TriMesh};
use crate::placement::SelectorKind;
use crate::project::{
    ChosenSite, GaugeKeys, Masks, PartModel, Project, SelectionKeys, SupportKeys, ToleranceKeys,
    TouchKeys,
};

pub use paint::{Brush, Layer};

/// What undo brings back. The mesh is not part of it: opening a file begins a new history.
#[derive(Clone, PartialEq)]
pub struct State {
    pub project: Project,
    pub painted: Option<Arc<Vec<bool>>>,
    /// Masks of the part's vertices that supports may name.
    pub masks: Masks,
}

/// An open project.
pub struct Document {
    pub state: State,
    pub part: Arc<TriMesh>,
    pub repairs: RepairReport,
    /// Where it was opened from or saved to; nothing for the bundled limb until it is saved.
    pub path: Option<PathBuf>,
    pub mesh_path: PathBuf,
    /// The mesh is the one inside the program and lies in no file yet.
    pub bundled: bool,
    /// The ways over the part: a brush asks for them many times a second.
    march: March,
    scratch: Scratch,
    /// Body and repairs that the part was taken in with.
    taken_in: (usize, Repair),
    /// Why nothing can be computed on the part, whatever its project, where that is so.
    misshapen: Option<String>,
    fingerprints: Fingerprints,
    saved: State,
    /// The state at the last finished gesture.
    settled: State,
    past: Vec<State>,
    future: Vec<State>,
}

/// What is painted on all layers and what is held: equal when these are.
#[derive(Clone, Debug, PartialEq)]
pub struct PaintKey([Option<u64>; 6], Vec<(SupportKeys, Option<u64>)>);

/// Undo steps kept.
const DEPTH: usize = 200;

impl Document {
    #[must_use]
    pub fn new(loaded: LoadedProject, path: Option<PathBuf>) -> Self {
        let state = State {
            project: loaded.inputs.project,
            painted: loaded.inputs.painted,
            masks: loaded.inputs.masks,
        };
        let part = &state.project.part;
        Self {
            taken_in: (part.body, part.repair()),
            misshapen: (check_shape(&loaded.inputs.part).err()).map(|e| e.to_string()),
            march: March::over(&loaded.inputs.part),
            scratch: Scratch::default(),
            part: loaded.inputs.part,
            repairs: loaded.repairs,
            path,
            mesh_path: loaded.mesh_path,
            bundled: loaded.bundled,
            fingerprints: Fingerprints::default(),
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
        self.drop_empty_layers();
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
    pub fn saved(&self) -> &State {
        &self.saved
    }

    /// What is on disk is not this state but that one.
    pub fn compare_with(&mut self, saved: State) {
        self.saved = saved;
    }

    /// What lies on disk now is this state, in a project and with a mesh at these paths. The name of the mesh
    /// belongs to no step of undo.
    pub fn saved_as(&mut self, path: PathBuf, mesh: PathBuf, saved: State) {
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

    /// The part without the path of its mesh: the mesh itself is known by its place in memory, and saving
    /// under another name changes nothing that was computed.
    fn part_key(&self) -> crate::project::Part {
        crate::project::Part {
            mesh: String::new(),
            ..self.state.project.part.clone()
        }
    }

    /// The supports with what the masks they name hold.
    fn supports_key(&self) -> Vec<(SupportKeys, Option<u64>)> {
        let mask = |s: &SupportKeys| self.mask_key(s.vertices.as_ref()?);
        let supports = &self.state.project.supports;
        supports.iter().map(|s| (s.clone(), mask(s))).collect()
    }

    fn mask_key(&self, name: &str) -> Option<u64> {
        let mask = self.state.masks.get(name)?;
        Some(self.fingerprints.of(mask))
    }

    /// What the simulation depends on, as a key.
    #[must_use]
    pub fn simulation_key(&self) -> String {
        self.simulation_key_at(self.state.project.budget.quality)
    }

    /// As [`Self::simulation_key`], of a quality that need not be the project's.
    #[must_use]
    pub fn simulation_key_at(&self, quality: Quality) -> String {
        let gauge = &self.state.project.gauge;
        let report = (gauge.signal, gauge.directions);
        format!("{} {report:?}", self.elements_key_at(quality))
    }

    /// What the simulation depends on beside what gauges report: its elements, sites and touches.
    #[must_use]
    pub fn elements_key_at(&self, quality: Quality) -> String {
        let p = &self.state.project;
        // How hard touches come is for whoever chooses and judges: signals grow with the force. Nor is any touch
        // simulated with another tip.
        let touch = TouchKeys {
            forces_n: TouchKeys::default().forces_n,
            tip_tolerance_mm: TouchKeys::default().tip_tolerance_mm,
            ..p.touch.clone()
        };
        format!(
            "{} {touch:?} {:?} {:?} {:?} {:?}",
            self.model_key(),
            p.touch.region.as_ref().map(|name| self.mask_key(name)),
            p.sites,
            (quality, p.budget.seed, p.budget.limits_at(quality)),
            // A region that is not there cannot be computed with.
            p.feasible
                .keep_out
                .as_ref()
                .is_some_and(|name| !self.state.masks.contains_key(name))
        )
    }

    /// What a measured trade of speed against accuracy holds for: everything but its knobs.
    #[must_use]
    pub fn trade_key(&self) -> String {
        let project = crate::io::trade_file::without_knobs(&self.state.project);
        let (part, paint) = (Arc::as_ptr(&self.part), self.paint_key());
        format!("{part:p} {project:?} {paint:?}")
    }

    /// What is painted on all layers, and what is held.
    #[must_use]
    pub fn paint_key(&self) -> PaintKey {
        let of = |layer| self.layer(layer).map(|mask| self.fingerprints.of(mask));
        PaintKey(Layer::ALL.map(of), self.supports_key())
    }

    /// What the elastic model alone depends on.
    #[must_use]
    pub fn model_key(&self) -> String {
        let p = &self.state.project;
        format!(
            "{:p} {:?} {:?} {:?}",
            Arc::as_ptr(&self.part),
            self.part_key(),
            p.material,
            self.supports_key()
        )
    }

    /// Whether the part is taken as a solid.
    #[must_use]
    pub fn is_solid(&self) -> bool {
        self.state.project.part.model == PartModel::Solid
    }

    /// What is known of the part's walls depends on.
    #[must_use]
    pub fn walls_key(&self) -> String {
        let p = &self.state.project;
        let mask = |layer| self.layer(layer).map(|m| self.fingerprints.of(m));
        format!(
            "{:p} {} {} {} {:?} {} {:?} {:?}",
            Arc::as_ptr(&self.part),
            p.part.thickness_mm,
            p.touch.tip_radius_mm,
            p.touch.reach_mm,
            (p.budget.quality, p.budget.limits),
            p.touch.count,
            mask(Layer::Inside),
            mask(Layer::Outside)
        )
    }

    /// What the feasible region depends on, beside the simulation.
    #[must_use]
    pub fn feasible_key(&self) -> String {
        self.feasible_key_at(self.state.project.budget.quality)
    }

    /// As [`Self::feasible_key`], of a quality that need not be the project's.
    #[must_use]
    pub fn feasible_key_at(&self, quality: Quality) -> String {
        let p = &self.state.project;
        let painted = self.state.painted.as_ref().map(|m| self.fingerprints.of(m));
        // How far off gauges are glued, or drift, decides nothing of where they can go.
        let gauge = GaugeKeys {
            tolerance: ToleranceKeys::default(),
            drift_microstrain: GaugeKeys::default().drift_microstrain,
            ..p.gauge.clone()
        };
        format!(
            "{} {gauge:?} {:?} {painted:?} {:?}",
            self.simulation_key_at(quality),
            p.feasible,
            p.feasible.keep_out.as_ref().map(|name| self.mask_key(name)),
        )
    }

    /// What the candidates depend on, and the Gaussian process over them.
    #[must_use]
    pub fn candidates_key_at(&self, quality: Quality) -> String {
        let p = &self.state.project;
        let selection = &p.selection;
        format!(
            "{} {:?} {:?}",
            self.feasible_key_at(quality),
            p.candidates,
            (
                selection.sensors,
                selection.with_noise,
                &selection.gaussian_process
            )
        )
    }

    /// What the selections depend on: everything that is asked for, but neither the answer nor which
    /// selector's answer is shown.
    #[must_use]
    pub fn selection_key_at(&self, quality: Quality) -> String {
        let keys = &self.state.project.selection;
        let asked = SelectionKeys {
            sites: Vec::new(),
            // Where all of them choose, another in the lead changes nothing.
            selector: if keys.compare {
                SelectorKind::default()
            } else {
                keys.selector
            },
            ..keys.clone()
        };
        // One selector knows how hard touches come, and how far off gauges are glued.
        let (p, knowing) = (&self.state.project, SelectorKind::ExpectedError);
        let knows = p.selectors().contains(&knowing);
        let gauge = (p.gauge.tolerance, p.gauge.drift_microstrain);
        let known = knows.then_some((p.touch.forces_n, gauge));
        format!("{} {asked:?} {known:?}", self.candidates_key_at(quality))
    }

    /// What a whole design depends on.
    #[must_use]
    pub fn design_key(&self) -> String {
        self.design_key_at(self.state.project.budget.quality)
    }

    /// As [`Self::design_key`], of a quality that need not be the project's.
    #[must_use]
    pub fn design_key_at(&self, quality: Quality) -> String {
        let Project {
            evaluation,
            gauge,
            touch,
            calibration,
            ..
        } = &self.state.project;
        let off = (gauge.tolerance, gauge.drift_microstrain, calibration);
        let judged = (evaluation, off, touch.tip_tolerance_mm);
        // One estimator knows how hard anybody presses.
        let judging = self.state.project.judging();
        format!("{} {judged:?} {judging:?}", self.selection_key_at(quality))
    }
}

/// Hashes of masks that are asked for many times a frame.
///
/// A mask that is known here has a weak reference, so that whoever changes it in place is given a new
/// allocation: the same place in memory means the same values.
#[derive(Default)]
struct Fingerprints(RefCell<Vec<(Weak<Vec<bool>>, u64)>>);

impl Fingerprints {
    fn of(&self, mask: &Arc<Vec<bool>>) -> u64 {
        let mut known = self.0.borrow_mut();
        known.retain(|(weak, _)| weak.strong_count() > 0);
        let place = Arc::as_ptr(mask);
        if let Some((_, hash)) = known.iter().find(|(weak, _)| weak.as_ptr() == place) {
            return *hash;
        }
        let value = hash(mask);
        known.push((Arc::downgrade(mask), value));
        value
    }
}

fn hash(mask: &[bool]) -> u64 {
    use std::hash::{DefaultHasher, Hasher};
    let mut hasher = DefaultHasher::new();
    hasher.write_usize(mask.len());
    for chunk in mask.chunks(64) {
        hasher.write_u64(chunk.iter().fold(0, |bits, &m| bits << 1 | u64::from(m)));
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::EstimatorKind;
    use crate::mesh::SurfacePoint;

    fn document() -> Document {
        Document::new(crate::cli::bundled().unwrap(), None)
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
        let keys = |d: &Document| {
            [
                d.model_key(),
                d.simulation_key(),
                d.feasible_key(),
                d.design_key(),
            ]
        };
        let before = keys(&d);
        let changed = |d: &Document, expected: [bool; 4]| {
            let now = keys(d);
            let changed: Vec<bool> = now.iter().zip(&before).map(|(a, b)| a != b).collect();
            assert_eq!(changed, expected);
        };
        d.state.project.selection.sensors = 5;
        changed(&d, [false, false, false, true]);
        d = document();
        let before = keys(&d);
        d.state.project.feasible.edge_radius_mm = 1.0;
        let now = keys(&d);
        assert_eq!(now[1], before[1]);
        assert_ne!(now[2], before[2]);
        d.state.project.part.thickness_mm = 2.0;
        assert_ne!(keys(&d)[0], before[0]);
    }

    /// Which of candidates, selections and design go stale when a project with one selector is changed.
    fn stale(selector: SelectorKind, change: impl Fn(&mut Project)) -> [bool; 3] {
        let mut d = document();
        d.state.project.selection.selector = selector;
        d.state.project.selection.compare = false;
        let keys = |d: &Document| {
            let quality = d.state.project.budget.quality;
            [
                d.candidates_key_at(quality),
                d.selection_key_at(quality),
                d.design_key(),
            ]
        };
        let before = keys(&d);
        change(&mut d.state.project);
        let now = keys(&d);
        std::array::from_fn(|k| now[k] != before[k])
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
        // What only the judge's estimator knows.
        let drifting = |p: &mut Project| p.gauge.drift_microstrain = 2.0;
        let by_machine = |p: &mut Project| p.calibration.place_mm = 0.0;
        let sized = |p: &mut Project| p.touch.tip_tolerance_mm = 0.5;
        assert_eq!(stale(knows, drifting), [false, true, true]);
        assert_eq!(stale(knows, by_machine), [false, false, true]);
        assert_eq!(stale(knows, sized), [false, false, true]);
    }

    #[test]
    fn another_estimator_is_another_judge() {
        let trained = |p: &mut Project| p.evaluation.estimator = EstimatorKind::Svr;
        assert_eq!(stale(SelectorKind::PcaQr, trained), [false, false, true]);
        let mut d = document();
        d.state.project.evaluation.estimator = EstimatorKind::Matching;
        let before = d.design_key();
        d.state.project.live.largest_force_n = 200.0;
        assert_ne!(d.design_key(), before);
    }
}
