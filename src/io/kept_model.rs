//! The model of a project's gauges beside the project (`limb.hapdef.cache`), so that live touch starts at once the next
//! time: an NPZ of what the elastic model said, with the key of what it was said of.
//!
//! It may be deleted whenever one likes. What cannot be read, is of other values or of another program is computed anew
//! and written over, without a word.
//!
//! | array | shape | is |
//! |---|---|---|
//! | `key` | bytes | the fingerprint of program, part and project |
//! | `scalars` | 2 | mean edge of the elements (mm), error of their strain (%) |
//! | `gauges` | gauges × 9 | place (m), direction, normal |
//! | `pressed_positions`, `pressed_triangles` | × 3 | the surface that touches press on (m) |
//! | `weights` | vertices × gauges × 3 | strain a newton along x, y, z |
//! | `map_positions`, `map_triangles` | × 3 | the surface that readings are known on (m) |
//! | `readings` | maps × nodes × gauges | as drawn, its three changes, then by the tip's size (1) and along the axes (3) where `asked` has them |

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::FileError;
use super::fingerprint::Fingerprint;
use super::npz::{Arrays, NpzFile};
use super::response_maps::{self, Maps, flat, numbers, vectors};
use crate::budget::{Budget, Watch};
use crate::design::{self, Computed, DesignError, Inputs, Sensing};
use crate::elasticity::sensitivity::Sensitivity;
use crate::gauge::Gauge;
use crate::inference::{AsDrawn, ResponseMap};
use crate::project::LiveKeys;

/// Of the file.
const FORMAT: u32 = 2;
/// Numbers of a gauge.
const OF_A_GAUGE: usize = 9;

/// The model of a project's gauges: the one that was kept beside the project (a file that is there), where it is of these
/// inputs, or computed and kept.
///
/// # Errors
/// As [`design::sensing`].
pub fn sensing(
    inputs: &Inputs,
    project: Option<&Path>,
    budget: &Budget,
    watch: Watch,
) -> Result<Sensing, DesignError> {
    let path = project.filter(|p| p.is_file()).map(path_beside);
    let key = key(inputs, budget);
    if let Some(known) = path.as_deref().and_then(|path| read(path, &key)) {
        inputs.project.check()?;
        return Sensing::from_kept(known, inputs, budget);
    }
    let sensing = design::sensing(inputs, budget, watch)?;
    if let (Some(path), Some(computed)) = (path, sensing.to_keep()) {
        // Where it cannot be written it is computed the next time too.
        let _ = write(&path, &key, &computed);
    }
    Ok(sensing)
}

/// Where it lies: `limb.hapdef.toml` has `limb.hapdef.cache`.
#[must_use]
pub fn path_beside(project: &Path) -> PathBuf {
    project.with_extension("cache")
}

/// Of all that the model depends on, the program among it: another build may compute otherwise.
fn key(inputs: &Inputs, budget: &Budget) -> String {
    let mut project = inputs.project.clone();
    project.part.mesh.clear();
    project.feasible.painted = None;
    // What is heard, and what else was chosen, changes nothing; but for what touches may push aside, which readings are
    // known for or not.
    project.live = LiveKeys {
        friction_percent: project.live.friction_percent,
        ..LiveKeys::default()
    };
    project.kept.clear();
    let mut key = Fingerprint::default();
    key.add(FORMAT.to_le_bytes());
    key.add(env!("CARGO_PKG_VERSION").bytes());
    key.add(program().bytes());
    key.add(serde_json::to_string(&project).unwrap_or_default().bytes());
    key.add(format!("{budget:?}").bytes());
    key.add_part(inputs);
    key.hex()
}

/// Size and time of the program's file.
pub(super) fn program() -> String {
    let of = std::env::current_exe().and_then(std::fs::metadata);
    of.map(|of| format!("{} {:?}", of.len(), of.modified().ok()))
        .unwrap_or_default()
}

fn write(path: &Path, key: &str, of: &Computed) -> Result<(), FileError> {
    let build = || -> std::io::Result<NpzFile> {
        let mut file = NpzFile::default();
        file.add("key", &[key.len()], key.as_bytes())?;
        file.add("scalars", &[2], &[of.element_mm, of.strain_percent])?;
        let gauges: Vec<f64> = of.gauges.iter().flat_map(numbers_of).collect();
        file.add("gauges", &[of.gauges.len(), OF_A_GAUGE], &gauges)?;
        response_maps::add_mesh(&mut file, "pressed", &of.sensitivity.mesh)?;
        let weights = flat(of.sensitivity.weights());
        let vertices = of.sensitivity.mesh.positions().len();
        file.add("weights", &[vertices, of.gauges.len(), 3], &weights)?;
        let drawn = &of.drawn;
        let own: Vec<&ResponseMap> = [&*drawn.map].into_iter().chain(&drawn.changes).collect();
        response_maps::add(&mut file, &own, drawn.tip.as_deref(), drawn.axes.as_deref())?;
        Ok(file)
    };
    build().map_err(|e| FileError::of(path, &e))?.save(path)
}

fn numbers_of(gauge: &Gauge) -> [f64; OF_A_GAUGE] {
    let ([px, py, pz], [dx, dy, dz]) = (gauge.position.to_array(), gauge.direction.to_array());
    let [nx, ny, nz] = gauge.normal.to_array();
    [px, py, pz, dx, dy, dz, nx, ny, nz]
}

/// What lies there, where it has this key and is whole.
fn read(path: &Path, key: &str) -> Option<Computed> {
    let mut from = Arrays::open(path).ok()?;
    let bytes = numbers(&mut from, "key", &[key.len()])?;
    let same = bytes.iter().map(|&b| b as u8).eq(key.bytes());
    if !same {
        return None;
    }
    let scalars = numbers(&mut from, "scalars", &[2])?;
    let gauges = from.numbers("gauges").ok()?;
    let [count, OF_A_GAUGE] = gauges.shape[..] else {
        return None;
    };
    let pressed = response_maps::mesh(&mut from, "pressed")?;
    let weights = numbers(&mut from, "weights", &[pressed.positions().len(), count, 3])?;
    let drawn = drawn(&mut from, count)?;
    Some(Computed {
        gauges: gauges
            .values
            .chunks_exact(OF_A_GAUGE)
            .map(gauge_of)
            .collect(),
        sensitivity: Arc::new(Sensitivity::of(pressed, count, vectors(&weights))),
        drawn: Arc::new(drawn),
        element_mm: scalars[0],
        strain_percent: scalars[1],
    })
}

fn gauge_of(numbers: &[f64]) -> Gauge {
    let vector = |at: usize| DVec3::new(numbers[at], numbers[at + 1], numbers[at + 2]);
    Gauge {
        position: vector(0),
        direction: vector(3),
        normal: vector(6),
    }
}

fn drawn(from: &mut Arrays, gauges: usize) -> Option<AsDrawn> {
    let Maps { own, tip, axes } = response_maps::read(from, 4, gauges)?;
    let [map, along, across, turned] = own.try_into().ok()?;
    Some(AsDrawn {
        map: Arc::new(map),
        changes: [along, across, turned],
        tip,
        axes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::{Quality, unwatched};
    use crate::io::opening::bundled;

    /// The model, and how often its computation asked whether to go on.
    fn counted(inputs: &Inputs, project: &Path) -> (Sensing, usize) {
        let asked = std::sync::atomic::AtomicUsize::new(0);
        let watch = |_| {
            asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            std::ops::ControlFlow::Continue(())
        };
        let budget = Quality::Draft.budget();
        let sensing = sensing(inputs, Some(project), &budget, &watch).unwrap();
        (sensing, asked.into_inner())
    }

    #[test]
    fn the_second_start_computes_nothing_and_reads_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let project = folder.path().join("limb.hapdef.toml");
        let mut inputs = bundled().unwrap().inputs;
        // Nothing is kept beside what is no file.
        let (bare, _) = counted(&inputs, &project);
        assert!(!path_beside(&project).exists());
        std::fs::write(&project, "").unwrap();
        let (first, computed) = counted(&inputs, &project);
        let (second, kept) = counted(&inputs, &project);
        assert!(computed > 0 && kept == 0, "{computed}, {kept}");
        for of in [&first, &second] {
            assert_eq!(bare.gauges, of.gauges);
            assert_eq!(bare.sensitivity.weights(), of.sensitivity.weights());
            let live = &inputs.project.live;
            let (here, there) = (bare.map_for(live), of.map_for(live));
            assert_eq!(here.map.values(), there.map.values());
            let (here, there) = (here.deviations.unwrap(), there.deviations.unwrap());
            assert_eq!(here.all.values(), there.all.values());
            assert_eq!(bare.proposed, of.proposed);
        }
        // Elements are there for whoever asks, and are the same.
        let gluing = crate::uncertainty::Gluing::EXACT;
        let truth = |of: &Sensing| {
            of.reference(&inputs, &gluing, 0, &unwatched)
                .unwrap()
                .0
                .weights()
                .to_vec()
        };
        assert_eq!(truth(&first), truth(&second));

        // Whatever is otherwise is computed, and so is what is damaged.
        inputs.project.gauge.grid_length_mm *= 2.0;
        assert!(counted(&inputs, &project).1 > 0);
        assert!(counted(&inputs, &project).1 == 0);
        inputs.project.live.friction_percent += 20.0;
        assert!(counted(&inputs, &project).1 > 0);
        inputs.project.live.stiffness_percent += 5.0;
        assert!(counted(&inputs, &project).1 == 0);
        let path = path_beside(&project);
        let whole = std::fs::read(&path).unwrap();
        for cut in [0, 10, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            assert!(counted(&inputs, &project).1 > 0, "cut at {cut}");
            assert_eq!(std::fs::read(&path).unwrap(), whole);
        }
    }
}
