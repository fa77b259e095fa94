//! Project files: readable, commented, versioned TOML, with arrays in NPZ beside them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::mesh_file::{LoadedMesh, read_mesh};
use super::npz::{NpzFile, read_mask};
use super::{FileError, atomic};
use crate::design::Inputs;
use crate::mesh::RepairReport;
use crate::project::{FORMAT, Kept, Masks, Project};

/// Name of the painted mask among the arrays.
const PAINTED: &str = "painted";

/// A project with what it refers to.
pub struct LoadedProject {
    pub inputs: Inputs,
    pub repairs: RepairReport,
    /// Where the project file lies, and the mesh it names.
    pub path: PathBuf,
    pub mesh_path: PathBuf,
    /// The limb inside the program: its mesh lies in no file yet.
    pub bundled: bool,
}

/// Between the name of a mask and the fingerprint of its values, in a file.
const MARK: char = '@';

/// Reads a project, its mesh and its masks.
///
/// # Errors
/// [`FileError`] naming the file, the place in it and the remedy.
pub fn load(path: &Path) -> Result<LoadedProject, FileError> {
    let text = std::fs::read_to_string(path).map_err(|e| FileError::of(path, &e))?;
    let mut project = parse(&text).map_err(|m| FileError::broken(path, m))?;
    let mesh_path = path
        .parent()
        .unwrap_or(Path::new("."))
        .join(&project.part.mesh);
    let LoadedMesh {
        mesh,
        repairs,
        groups,
    } = read_mesh(
        &mesh_path,
        project.part.unit,
        project.part.body,
        project.part.repair(),
    )?;
    let vertices = mesh.positions().len();
    let masks = read_masks(path, &mut project, groups, vertices)?;
    let painted = match &project.feasible.painted {
        Some(name) => Some(read_painted(path, name, vertices)?),
        None => None,
    };
    if let Some(name) = &mut project.feasible.painted {
        *name = plain(name).to_owned();
    }
    Ok(LoadedProject {
        inputs: Inputs {
            project,
            part: Arc::new(mesh),
            painted: painted.map(Arc::new),
            masks,
        },
        repairs,
        path: path.to_owned(),
        mesh_path,
        bundled: false,
    })
}

/// The masks that a project names, which are then named without their fingerprints: arrays beside the
/// project come before groups of the mesh file.
fn read_masks(
    path: &Path,
    project: &mut Project,
    groups: Masks,
    vertices: usize,
) -> Result<Masks, FileError> {
    let mut masks = groups;
    let arrays = arrays_path(path);
    for name in project.mask_names() {
        let own = plain(name).to_owned();
        if arrays.is_file() && super::npz::holds(&arrays, name)? {
            // A mask for another mesh gives way to the group of that name, where the file has one.
            match read_painted(path, name, vertices) {
                Ok(mask) => drop(masks.insert(own.clone(), Arc::new(mask))),
                Err(_) if masks.contains_key(&own) => {}
                Err(error) => return Err(error),
            }
        }
        *name = own;
    }
    Ok(masks)
}

/// The name without its fingerprint.
fn plain(name: &str) -> &str {
    match name.rsplit_once(MARK) {
        Some((plain, mark)) if !mark.is_empty() && mark.bytes().all(|b| b.is_ascii_hexdigit()) => {
            plain
        }
        _ => name,
    }
}

/// The name with the fingerprint of what it names: other values stand under another name, so that arrays
/// for the old project and for the new one can lie in a file together.
fn marked(name: &str, mask: &[bool]) -> String {
    // FNV-1a: the same on every machine.
    let hash = mask.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, &set| {
        (h ^ u64::from(set)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{}{MARK}{hash:016x}", plain(name))
}

fn read_painted(path: &Path, name: &str, vertices: usize) -> Result<Vec<bool>, FileError> {
    let arrays = arrays_path(path);
    let mask = read_mask(&arrays, name)?;
    if mask.len() != vertices {
        return Err(FileError::broken(
            &arrays,
            format!(
                "the mask \"{}\" is for a mesh of {} vertices, but the part has {vertices}. Paint it again, or give that support a box",
                plain(name),
                mask.len()
            ),
        ));
    }
    Ok(mask)
}

/// Whether a path names a project and not a mesh, by its ending.
#[must_use]
pub fn is_project(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// The path with the ending that projects have, added where it is missing.
#[must_use]
pub fn with_ending(path: &Path) -> PathBuf {
    if is_project(path) {
        return path.to_owned();
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".hapdef.toml");
    path.with_file_name(name)
}

/// Where a project's arrays lie: `limb.hapdef.toml` has `limb.hapdef.npz`.
#[must_use]
pub fn arrays_path(project: &Path) -> PathBuf {
    project.with_extension("npz")
}

/// Parses and checks a project's text.
///
/// # Errors
/// A message in the user's terms, with the line where there is one.
pub fn parse(text: &str) -> Result<Project, String> {
    #[derive(serde::Deserialize)]
    struct Versioned {
        format: Option<i64>,
    }
    let readable = |e: toml::de::Error| format!("this is not a readable project file. {e}");
    let version: Versioned = toml::from_str(text).map_err(readable)?;
    match version.format {
        Some(v) if v == i64::from(FORMAT) => {}
        Some(v) if v > i64::from(FORMAT) => {
            return Err(format!(
                "the project is of format {v}, written by a newer version of HapDef; this one reads up to format {FORMAT}. Update HapDef"
            ));
        }
        Some(v) => {
            return Err(format!(
                "format {v} has never existed. Set format = {FORMAT}"
            ));
        }
        None => {
            return Err(format!(
                "the key \"format\" is missing. Add format = {FORMAT} as the first line"
            ));
        }
    }
    let project: Project = toml::from_str(text).map_err(readable)?;
    project.check().map_err(|e| e.to_string())?;
    Ok(project)
}

/// Saves a project atomically, one backup kept, its masks beside it. Paths in it are taken as they are:
/// relative to the file. Whenever it is interrupted, the project is wholly the old one or the new one: the
/// arrays of both lie beside it, those of the old one for its backup.
///
/// # Errors
/// [`FileError`] naming the file that could not be written; what was there before is whole, in its place
/// or as its `.bak`.
pub fn save(
    path: &Path,
    project: &Project,
    painted: Option<&[bool]>,
    masks: &Masks,
) -> Result<(), FileError> {
    let mut project = project.clone();
    let mut kept: BTreeMap<String, &[bool]> = BTreeMap::new();
    for name in project.mask_names() {
        if let Some(mask) = masks.get(plain(name)) {
            *name = marked(name, mask);
            kept.insert(name.clone(), mask);
        }
    }
    project.feasible.painted = painted.map(|mask| marked(PAINTED, mask));
    if let (Some(name), Some(mask)) = (&project.feasible.painted, painted) {
        kept.insert(name.clone(), mask);
    }
    let arrays = arrays_path(path);
    let old = old_arrays(path);
    if !kept.is_empty() {
        let mut both: BTreeMap<&str, &[bool]> = (old.iter())
            .map(|(name, mask)| (name.as_str(), mask.as_slice()))
            .collect();
        both.extend(kept.iter().map(|(name, mask)| (name.as_str(), *mask)));
        write_arrays(&arrays, &both)?;
    }
    atomic::write_with_backup(path, to_text(&project).as_bytes())
}

/// The arrays that the project in a file names; none where there is no readable one.
fn old_arrays(path: &Path) -> BTreeMap<String, Vec<bool>> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let Ok(mut old) = parse(&text) else {
        return BTreeMap::new();
    };
    let painted = old.feasible.painted.clone();
    let names: Vec<String> = old.mask_names().map(|n| n.clone()).chain(painted).collect();
    let arrays = arrays_path(path);
    names
        .into_iter()
        .filter_map(|name| {
            let mask = read_mask(&arrays, &name).ok()?;
            Some((name, mask))
        })
        .collect()
}

fn write_arrays(path: &Path, arrays: &BTreeMap<&str, &[bool]>) -> Result<(), FileError> {
    let mut file = NpzFile::default();
    for (name, mask) in arrays {
        file.add(name, &[mask.len()], mask)
            .map_err(|e| FileError::of(path, &e))?;
    }
    file.save(path)
}

/// A path as a project at `project` should name it: relative where it can be.
#[must_use]
pub fn relative_to(project: &Path, target: &Path) -> String {
    let absolute = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_owned());
    let (from, to) = (absolute(project), absolute(target));
    let folder = from.parent().unwrap_or(Path::new("/")).to_owned();
    let common = folder
        .components()
        .zip(to.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = folder.components().count() - common;
    if common <= 1 {
        return to.to_string_lossy().into_owned();
    }
    let mut relative = PathBuf::new();
    (0..up).for_each(|_| relative.push(".."));
    relative.extend(to.components().skip(common));
    relative.to_string_lossy().replace('\\', "/")
}

/// The commented text of a project.
#[must_use]
pub fn to_text(project: &Project) -> String {
    let mut t = Text::default();
    t.line("# A HapDef project. Lengths in millimetres, forces in newtons; paths are relative to this file.");
    t.key("format", project.format, "version of this file's format");
    part(&mut t, project);
    touch(&mut t, project);
    gauge(&mut t, project);
    feasible(&mut t, project);
    selection(&mut t, project);
    evaluation(&mut t, project);
    for selection in &project.kept {
        kept(&mut t, selection);
    }
    t.0
}

fn part(t: &mut Text, project: &Project) {
    t.table("part");
    let part = &project.part;
    t.key("mesh", quoted(&part.mesh), "glTF/GLB, OBJ, STL or PLY");
    t.maybe(
        "unit",
        part.unit.map(|u| quoted(u.name())),
        "unit of the mesh file: \"mm\", \"cm\", \"m\" or \"in\"; glTF is in metres and needs none",
    );
    t.key(
        "body",
        part.body,
        "which connected body, 0 being the largest",
    );
    t.key(
        "weld_mm",
        float(part.weld_mm),
        "vertices nearer than this are joined; 0 joins equal ones only",
    );
    t.key(
        "fill_holes_mm",
        float(part.fill_holes_mm),
        "holes up to this far across are filled",
    );
    t.key(
        "elements",
        serialized(&part.elements),
        "\"graded\": computed on a mesh of its own, finer where the strain changes; \"as-given\": on the file's triangles",
    );
    t.key(
        "model",
        quoted("shell"),
        "\"shell\": the mesh is the mid-surface",
    );
    t.key("thickness_mm", float(part.thickness_mm), "of the shell");
    t.key(
        "axis",
        serialized(&part.axis),
        "the axis the part is unrolled about: \"x\", \"y\" or \"z\"",
    );
    t.table("material");
    t.key(
        "youngs_modulus_gpa",
        float(project.material.youngs_modulus_gpa),
        "",
    );
    t.key(
        "poissons_ratio",
        float(project.material.poissons_ratio),
        "above -1 and below 0.5",
    );
    for support in &project.supports {
        t.list("support");
        t.key("kind", serialized(&support.kind), "\"clamped\" (no displacement, no rotation), \"pinned\" (no displacement) or \"symmetry\"");
        t.maybe(
            "box_mm",
            support.box_mm.as_ref().map(corners),
            "every point of the part inside it is held",
        );
        t.maybe(
            "vertices",
            support.vertices.as_deref().map(quoted),
            "instead of a box: a mask in the NPZ file beside this one, or a group of the mesh file",
        );
        t.key(
            "normal",
            serialized(&support.normal),
            "of a symmetry plane; unused otherwise",
        );
    }
}

fn touch(t: &mut Text, project: &Project) {
    t.table("touch");
    t.key(
        "force_n",
        float(project.touch.force_n),
        "pressed along the inward normal",
    );
    t.key(
        "tip_radius_mm",
        float(project.touch.tip_radius_mm),
        "the tip spreads the force as (1 - r²/a²)²",
    );
    t.key(
        "count",
        project.touch.count,
        "touches simulated; lower qualities take fewer",
    );
    t.key(
        "edge_margin_mm",
        float(project.touch.edge_margin_mm),
        "least distance of a touch from a free edge",
    );
    t.maybe(
        "region",
        project.touch.region.as_deref().map(quoted),
        "touches come only here: a mask in the NPZ file beside this one, or a group of the mesh file",
    );
    t.table("sites");
    t.key(
        "spacing_mm",
        float(project.sites.spacing_mm),
        "of the possible gauge positions on the inside",
    );
    t.key(
        "lattice",
        serialized(&project.sites.lattice),
        "\"even\" (any surface) or \"unrolled\" (rows and columns about the axis)",
    );
}

fn feasible(t: &mut Text, project: &Project) {
    t.table("feasible");
    t.key(
        "support_clearance_mm",
        float(project.feasible.support_clearance_mm),
        "least distance over the surface from anything held",
    );
    t.key(
        "edge_neighbours",
        project.feasible.edge_neighbours,
        "k of the centre-of-mass filter …",
    );
    t.key(
        "edge_radius_mm",
        float(project.feasible.edge_radius_mm),
        "… and its radius",
    );
    t.maybe(
        "painted",
        project.feasible.painted.as_deref().map(quoted),
        "painted region, an array in the NPZ file beside this one",
    );
    t.maybe(
        "keep_out",
        project.feasible.keep_out.as_deref().map(quoted),
        "no gauge goes here: a mask in the NPZ file beside this one, or a group of the mesh file",
    );
    t.table("candidates");
    t.key(
        "unexplained",
        float(project.candidates.unexplained),
        "share of the held-out variance the candidates may leave unexplained",
    );
    t.maybe(
        "count",
        project.candidates.count,
        "a fixed number of candidates instead",
    );
}

fn evaluation(t: &mut Text, project: &Project) {
    t.table("evaluation");
    for region in &project.evaluation.regions {
        t.list("evaluation.region");
        t.key(
            "name",
            quoted(&region.name),
            "errors are quoted for it, beside all touches",
        );
        t.key("box_mm", corners(&region.box_mm), "");
    }
    t.table("budget");
    t.key(
        "quality",
        quoted(project.budget.quality.name()),
        "\"draft\", \"standard\" or \"reference\"",
    );
    t.key("seed", project.budget.seed, "of every random draw");
}

fn gauge(t: &mut Text, project: &Project) {
    let gauge = &project.gauge;
    t.table("gauge");
    t.key(
        "signal",
        quoted(gauge.signal.name()),
        "\"strain\", \"displacement\" or \"normal-displacement\"",
    );
    t.key(
        "directions",
        gauge.directions,
        "a place may take a gauge in: 1 along the largest strain, 2 also across, up to 4",
    );
    t.key(
        "noise_microstrain",
        float(gauge.noise_microstrain),
        "standard deviation of a reading",
    );
    t.key(
        "range_microstrain",
        float(gauge.range_microstrain),
        "largest strain gauge and amplifier can take",
    );
    t.key(
        "least_signal_to_noise",
        float(gauge.least_signal_to_noise),
        "rms strain over noise that a site must reach",
    );
    t.key(
        "grid_length_mm",
        float(gauge.grid_length_mm),
        "of the measuring grid, along the gauge",
    );
    t.key("grid_width_mm", float(gauge.grid_width_mm), "across it");
    t.key(
        "flatness_mm",
        float(gauge.flatness_mm),
        "largest height of the surface over the gauge's plane",
    );
}

fn selection(t: &mut Text, project: &Project) {
    let selection = &project.selection;
    t.table("selection");
    t.key(
        "selector",
        quoted(selection.selector.name()),
        "\"greedy-svr\", \"pca-qr\", \"entropy\" or \"mutual-information\"",
    );
    t.key("sensors", selection.sensors, "gauges to place");
    t.key(
        "c_mm",
        float(selection.c_mm),
        "C of greedy SVR's regression (targets in mm, features standardized)",
    );
    t.key("epsilon_mm", float(selection.epsilon_mm), "its ε");
    t.key("gamma", float(selection.gamma), "its γ");
    t.key(
        "spacing_mm",
        float(selection.spacing_mm),
        "least distance between two gauges",
    );
    let required: Vec<String> = selection.required_mm.iter().map(triple).collect();
    t.maybe(
        "required_mm",
        (!required.is_empty()).then(|| format!("[{}]", required.join(", "))),
        "places of gauges that must be there, [[x, y, z], …]; the nearest site is taken",
    );
    t.maybe(
        "target_mm",
        selection.target_mm.map(float),
        "error at which greedy SVR adds no more gauges",
    );
    t.maybe(
        "cost_budget",
        selection.cost_budget.map(float),
        "what all gauges together may cost: 1 each, or as in [[selection.cost]]",
    );
    t.key(
        "with_noise",
        selection.with_noise,
        "choose from signals with the gauge's noise added",
    );
    t.key(
        "failure",
        float(selection.failure),
        "probability that one gauge has failed when it is needed (greedy SVR)",
    );
    let process = &selection.gaussian_process;
    t.table("selection.gaussian_process");
    t.maybe(
        "length_mm",
        process.length_mm.map(float),
        "length of the kernel of entropy and mutual information; searched when left out",
    );
    t.maybe(
        "power",
        process.power.map(float),
        "its power, up to 2; searched when left out",
    );
    t.key(
        "noise",
        float(process.noise),
        "variance of a measurement's noise over the field's",
    );
    for cost in &selection.costs {
        t.list("selection.cost");
        t.key("box_mm", corners(&cost.box_mm), "a gauge in here costs");
        t.key("cost", float(cost.cost), "");
    }
    for site in &selection.sites {
        t.list("selection.site");
        t.key("position_mm", triple(&site.position_mm), "");
        t.key("direction", triple(&site.direction), "");
    }
}

fn kept(t: &mut Text, kept: &Kept) {
    t.list("kept");
    t.key(
        "name",
        quoted(&kept.name),
        "a selection kept to be compared",
    );
    t.key("selector", quoted(&kept.selector), "");
    t.key("quality", quoted(kept.quality.name()), "");
    t.key("cost", float(kept.cost), "of all its gauges");
    t.key("seconds", float(kept.seconds), "that choosing it took");
    for site in &kept.sites {
        t.list("kept.site");
        t.key("position_mm", triple(&site.position_mm), "");
        t.key("direction", triple(&site.direction), "");
    }
    for error in &kept.errors {
        t.list("kept.error");
        t.key("region", quoted(&error.region), "");
        t.key("sensors", error.sensors, "");
        t.key("mean_mm", float(error.mean_mm), "");
        t.key("median_mm", float(error.median_mm), "");
        t.key("p95_mm", float(error.p95_mm), "");
    }
    for failure in &kept.failures {
        t.list("kept.failure");
        t.key("failed", failure.failed, "");
        t.key("retrained", failure.retrained, "");
        t.key("mean_mm", float(failure.mean_mm), "");
    }
}

#[derive(Default)]
struct Text(String);

impl Text {
    fn line(&mut self, line: &str) {
        self.0.push_str(line);
        self.0.push('\n');
    }
    fn table(&mut self, name: &str) {
        self.line(&format!("\n[{name}]"));
    }
    fn list(&mut self, name: &str) {
        self.line(&format!("\n[[{name}]]"));
    }
    fn key(&mut self, key: &str, value: impl std::fmt::Display, comment: &str) {
        let mut line = format!("{key} = {value}");
        if !comment.is_empty() {
            let _ = write!(line, "  # {comment}");
        }
        self.line(&line);
    }
    fn maybe(&mut self, key: &str, value: Option<impl std::fmt::Display>, comment: &str) {
        match value {
            Some(value) => self.key(key, value, comment),
            None => self.line(&format!("# {key}: {comment}")),
        }
    }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A float with its point, in the shortest form that reads back the same.
fn float(value: f64) -> String {
    format!("{value:?}")
}

fn triple(values: &[f64; 3]) -> String {
    format!("[{}]", values.map(float).join(", "))
}

fn corners(values: &[[f64; 3]; 2]) -> String {
    format!("[{}]", values.each_ref().map(triple).join(", "))
}

/// An enum as its file name.
fn serialized(value: &impl serde::Serialize) -> String {
    toml::Value::try_from(value).map_or_else(|_| String::new(), |v| v.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::unroll::Axis;
    use crate::project::{
        ChosenSite, CostKeys, KeptError, KeptFailure, RegionKeys, SupportKeys, SupportKind, Unit,
    };

    fn full() -> Project {
        let mut p = Project::around("a \"part\".stl", Some(Unit::Inch));
        p.supports.push(SupportKeys {
            kind: SupportKind::Symmetry,
            box_mm: Some([[0.0, 1e-3, -2.0], [1.0, 2.0, 3.0]]),
            vertices: None,
            normal: Axis::X,
        });
        p.supports.push(SupportKeys {
            kind: SupportKind::Pinned,
            box_mm: None,
            vertices: Some("rim \"left\"".into()),
            normal: Axis::Z,
        });
        p.candidates.count = Some(407);
        p.feasible.painted = Some("painted".into());
        p.feasible.keep_out = Some("connector".into());
        p.touch.region = Some("grip".into());
        p.selection.sites.push(ChosenSite {
            position_mm: [0.1, 1.0 / 3.0, -7e-17],
            direction: [0.0, 0.0, 1.0],
        });
        p.selection.with_noise = true;
        p.selection.cost_budget = Some(12.5);
        p.selection.costs.push(CostKeys {
            box_mm: [[0.0; 3], [1.0; 3]],
            cost: 2.5,
        });
        p.kept.push(Kept {
            name: "greedy \"ten\"".into(),
            selector: "by-hand".into(),
            quality: crate::budget::Quality::Draft,
            cost: 3.5,
            seconds: 12.25,
            sites: p.selection.sites.clone(),
            errors: vec![KeptError {
                region: "all touches".into(),
                sensors: 1,
                mean_mm: 3.0,
                median_mm: 1.5,
                p95_mm: 9.0,
            }],
            failures: vec![KeptFailure {
                failed: 2,
                retrained: true,
                mean_mm: 5.5,
            }],
        });
        p.evaluation.regions.push(RegionKeys {
            name: "middle".into(),
            box_mm: [[-1.0; 3], [1.0; 3]],
        });
        p
    }

    #[test]
    fn what_is_written_reads_back_the_same() {
        for project in [Project::around("limb.glb", None), full()] {
            let text = to_text(&project);
            assert_eq!(parse(&text).as_ref(), Ok(&project), "{text}");
        }
    }

    #[test]
    fn a_newer_or_foreign_file_is_refused_with_the_remedy() {
        let text = to_text(&full()).replace("format = 1", "format = 2");
        assert!(parse(&text).unwrap_err().contains("newer version"));
        assert!(parse("[part]\n").unwrap_err().contains("format"));
        let typo = to_text(&full()).replace("force_n", "force");
        let message = parse(&typo).unwrap_err();
        assert!(
            message.contains("force") && message.contains("line"),
            "{message}"
        );
        let negative = to_text(&full()).replace("force_n = 10.0", "force_n = -1.0");
        assert!(parse(&negative).unwrap_err().contains("touch.force_n"));
    }

    #[test]
    fn paths_are_kept_relative() {
        let project = Path::new("/home/a/work/p.hapdef.toml");
        assert_eq!(
            relative_to(project, Path::new("/home/a/work/limb.glb")),
            "limb.glb"
        );
        assert_eq!(
            relative_to(project, Path::new("/home/a/mesh/limb.glb")),
            "../mesh/limb.glb"
        );
    }
}
