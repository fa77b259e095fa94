//! A simulation in a file, for whoever needs one of the same inputs: units of a study that differ in nothing that a simulation
//! knows of read it, whichever process or machine they run on. Nobody waits for anybody: those that begin at once compute it each.
//!
//! The file is named by what it was computed from, is written by an atomic rename, and may be deleted whenever one likes.
//! What cannot be read is computed anew.
//!
//! | array | shape | is |
//! |---|---|---|
//! | `scalars` | 20 | error of displacement (mm, %), strain, reading (%), loads, places; checks (4); unknowns; work (5); of a shell largest and median change (%), beyond, loads |
//! | `force_n` | 1 | the largest force that linearity was tried with |
//! | `shell_positions`, `shell_triangles`, `places`, `lines` | × 3, 3, 4, 2 | elements of a shell (m), where their vertices lie on the part, and edges on feature lines |
//! | `fineness` | 6 | of the elements of a solid |
//! | `touches` | touches × 8 | place (m), normal, force (N), radius of the tip (m) |
//! | `sites` | sites × 11 | place (m), direction, normal, rms and peak strain |
//! | `x` | sites × touches | what sites report |
//! | `slopes_of`, `slopes`; `making_of`, `making` | touches; 3 × sites × touches | what that changes by |

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::FileError;
use super::fingerprint::Fingerprint;
use super::npz::{Arrays, NpzFile};
use super::response_maps::{self, flat, numbers};
use crate::budget::Work;
use crate::dataset::{Dataset, GluingSlopes, MakingSlopes, Signal, SignalMatrix, Site};
use crate::design::{Checks, KeptElements, KeptSimulation, Simulated};
use crate::elasticity::Touch;
use crate::elasticity::estimate::Discretization;
use crate::elasticity::linearity::Linearity;
use crate::elasticity::solid::immersed::Fineness;
use crate::gauge::Gauge;
use crate::memory;
use crate::mesh::remesh::Remeshed;
use crate::mesh::{SurfacePoint, TriMesh};

/// Bytes that are held for a number while it is written, of the array and of the file; and the share of the memory that they
/// may take.
const BYTES_WRITTEN: f64 = 16.0;
const SHARE: f64 = 0.25;
/// Numbers of a touch, of a site and of a place.
const OF_A_TOUCH: usize = 8;
const OF_A_SITE: usize = 11;
const OF_A_PLACE: usize = 4;
const SCALARS: usize = 20;
const FINENESS: usize = 6;

/// Where a simulation of a key lies in a folder.
#[must_use]
pub fn path_in(folder: &Path, key: &str) -> PathBuf {
    folder.join(format!("{key}.npz"))
}

/// The key of what was computed from some inputs, as they say themselves, on a part, by this program.
#[must_use]
pub fn key(inputs: &str, part: &TriMesh) -> String {
    let mut key = Fingerprint::default();
    key.add(super::kept_model::program().bytes());
    key.add(inputs.bytes());
    key.add_numbers(&flat(part.positions()));
    key.add(
        part.triangles()
            .as_flattened()
            .iter()
            .flat_map(|v| v.to_le_bytes()),
    );
    key.hex()
}

/// Writes a simulation, where it is one that memory has not cut short, nor would, and whose gauges all lie on its lattice:
/// whether it was.
///
/// # Errors
/// [`FileError`] where it cannot be written.
pub fn write(path: &Path, of: &Simulated) -> Result<bool, FileError> {
    let bytes = BYTES_WRITTEN * of.dataset.x.values().len() as f64;
    let is_large = bytes > SHARE * memory::allowed();
    if of.is_short || is_large || of.lattice != of.dataset.sites.len() {
        return Ok(false);
    }
    let build = || -> std::io::Result<NpzFile> {
        let mut file = NpzFile::default();
        file.add("scalars", &[SCALARS], &scalars(of))?;
        let force = of.linearity.map_or(f64::NAN, |l| l.force_n);
        file.add("force_n", &[1], &[force])?;
        add_elements(&mut file, &of.kept_elements())?;
        add_dataset(&mut file, &of.dataset)?;
        Ok(file)
    };
    build().map_err(|e| FileError::of(path, &e))?.save(path)?;
    Ok(true)
}

fn scalars(of: &Simulated) -> [f64; SCALARS] {
    let (e, c, w) = (&of.discretization, &of.checks, &of.dataset.work);
    let l = of.linearity;
    let of_shell = |number: fn(&Linearity) -> f64| l.as_ref().map_or(f64::NAN, number);
    [
        e.displacement_mm,
        e.displacement_percent,
        e.strain_percent,
        e.reading_percent,
        e.loads as f64,
        e.places as f64,
        c.reaction_error,
        c.energy_error,
        c.smallest_pivot,
        c.pieces_held as f64,
        of.unknowns as f64,
        w.assemblies as f64,
        w.factorizations as f64,
        w.solves as f64,
        w.kernel_evaluations as f64,
        w.fits as f64,
        of_shell(|l| l.largest_percent),
        of_shell(|l| l.median_percent),
        of_shell(|l| l.beyond as f64),
        of_shell(|l| l.loads as f64),
    ]
}

fn add_elements(file: &mut NpzFile, elements: &KeptElements) -> std::io::Result<()> {
    match elements {
        KeptElements::Shell(remeshed) => {
            response_maps::add_mesh(file, "shell", &remeshed.mesh)?;
            let place = |at: &SurfacePoint| {
                let [a, b, c] = at.barycentric;
                [f64::from(at.triangle), a, b, c]
            };
            let places: Vec<f64> = remeshed.places.iter().flat_map(place).collect();
            file.add("places", &[remeshed.places.len(), OF_A_PLACE], &places)?;
            let mut lines: Vec<[u32; 2]> = remeshed.lines.iter().map(|&(a, b)| [a, b]).collect();
            lines.sort_unstable();
            file.add("lines", &[lines.len(), 2], lines.as_flattened())
        }
        KeptElements::Solid(f) => {
            let numbers = [
                f.size,
                f.order as f64,
                f.tolerance,
                f.least,
                f64::from(f.halvings),
                f.carried_on,
            ];
            file.add("fineness", &[FINENESS], &numbers)
        }
    }
}

fn add_dataset(file: &mut NpzFile, of: &Dataset) -> std::io::Result<()> {
    let touch = |t: &Touch| {
        let ([x, y, z], [a, b, c]) = (t.position.to_array(), t.normal.to_array());
        [x, y, z, a, b, c, t.force, t.tip_radius]
    };
    let touches: Vec<f64> = of.touches.iter().flat_map(touch).collect();
    file.add("touches", &[of.touches.len(), OF_A_TOUCH], &touches)?;
    let site = |s: &Site| {
        let gauge = [s.gauge.position, s.gauge.direction, s.gauge.normal];
        gauge
            .into_iter()
            .flat_map(|v| v.to_array())
            .chain([s.rms_strain, s.peak_strain])
    };
    let sites: Vec<f64> = of.sites.iter().flat_map(site).collect();
    file.add("sites", &[of.sites.len(), OF_A_SITE], &sites)?;
    file.add("x", &[of.x.rows(), of.x.columns()], of.x.values())?;
    let signal = match of.signal {
        Signal::Strain => 0_u8,
        Signal::Displacement => 1,
        Signal::NormalDisplacement => 2,
    };
    file.add("signal", &[1], &[signal])?;
    let mut add = |name: &str, touches: &[usize], all: [&[f32]; 3]| {
        let touches: Vec<u64> = touches.iter().map(|&t| t as u64).collect();
        file.add(&format!("{name}_of"), &[touches.len()], &touches)?;
        let one = |k: usize| format!("{name}_{k}");
        (0..3).try_for_each(|k| file.add(&one(k), &[all[k].len()], all[k]))
    };
    if let Some(slopes) = &of.slopes {
        add("slopes", slopes.columns().touches(), slopes.all())?;
    }
    if let Some(making) = &of.making {
        add("making", making.columns().touches(), making.all())?;
    }
    Ok(())
}

/// What lies there, where it is whole.
#[must_use]
pub fn read(path: &Path) -> Option<KeptSimulation> {
    let mut from = Arrays::open(path).ok()?;
    // Not everything is known of everything: what is not is no number.
    let scalars = from.numbers("scalars").ok()?.values;
    let force = from.numbers("force_n").ok()?.values;
    let (
        &[
            e0,
            e1,
            e2,
            e3,
            e4,
            e5,
            c0,
            c1,
            c2,
            c3,
            unknowns,
            w0,
            w1,
            w2,
            w3,
            w4,
            l0,
            l1,
            l2,
            l3,
        ],
        &[force_n],
    ) = (&scalars[..], &force[..])
    else {
        return None;
    };
    let work = Work {
        assemblies: w0 as u64,
        factorizations: w1 as u64,
        solves: w2 as u64,
        kernel_evaluations: w3 as u64,
        fits: w4 as u64,
    };
    Some(KeptSimulation {
        elements: elements(&mut from)?,
        estimate: Discretization {
            displacement_mm: e0,
            displacement_percent: e1,
            strain_percent: e2,
            reading_percent: e3,
            loads: e4 as usize,
            places: e5 as usize,
        },
        linearity: (!l3.is_nan()).then_some(Linearity {
            largest_percent: l0,
            median_percent: l1,
            beyond: l2 as usize,
            loads: l3 as usize,
            force_n,
        }),
        checks: Checks {
            reaction_error: c0,
            energy_error: c1,
            smallest_pivot: c2,
            pieces_held: c3 as usize,
        },
        dataset: dataset(&mut from, work)?,
        unknowns: unknowns as usize,
    })
}

fn elements(from: &mut Arrays) -> Option<KeptElements> {
    if from.holds("fineness") {
        let numbers = from.numbers("fineness").ok()?.values;
        let &[size, order, tolerance, least, halvings, carried_on] = &numbers[..] else {
            return None;
        };
        return Some(KeptElements::Solid(Fineness {
            size,
            order: order as usize,
            tolerance,
            least,
            halvings: halvings as u32,
            carried_on,
        }));
    }
    let mesh = response_maps::mesh(from, "shell")?;
    let places = numbers(from, "places", &[mesh.positions().len(), OF_A_PLACE])?;
    let place = |at: &[f64]| SurfacePoint {
        triangle: at[0] as u32,
        barycentric: [at[1], at[2], at[3]],
    };
    let lines = from.numbers("lines").ok()?.values;
    Some(KeptElements::Shell(Remeshed {
        places: places.chunks_exact(OF_A_PLACE).map(place).collect(),
        lines: lines
            .chunks_exact(2)
            .map(|ends| (ends[0] as u32, ends[1] as u32))
            .collect(),
        mesh,
    }))
}

fn dataset(from: &mut Arrays, work: Work) -> Option<Dataset> {
    let x = from.numbers("x").ok()?;
    let [sites, touches] = x.shape[..] else {
        return None;
    };
    let of_touches = numbers(from, "touches", &[touches, OF_A_TOUCH])?;
    let vector = |of: &[f64], at: usize| DVec3::new(of[at], of[at + 1], of[at + 2]);
    let touch = |t: &[f64]| Touch {
        position: vector(t, 0),
        normal: vector(t, 3),
        force: t[6],
        tip_radius: t[7],
    };
    let of_sites = numbers(from, "sites", &[sites, OF_A_SITE])?;
    let site = |s: &[f64]| Site {
        gauge: Gauge {
            position: vector(s, 0),
            direction: vector(s, 3),
            normal: vector(s, 6),
        },
        rms_strain: s[9],
        peak_strain: s[10],
    };
    let signal = match numbers(from, "signal", &[1])?[0] {
        0.0 => Signal::Strain,
        1.0 => Signal::Displacement,
        2.0 => Signal::NormalDisplacement,
        _ => return None,
    };
    Some(Dataset {
        signal,
        sites: of_sites.chunks_exact(OF_A_SITE).map(site).collect(),
        touches: of_touches.chunks_exact(OF_A_TOUCH).map(touch).collect(),
        slopes: slopes(from, "slopes", GluingSlopes::known)?,
        making: slopes(from, "making", MakingSlopes::known)?,
        x: SignalMatrix::new(touches, x.values),
        work,
    })
}

/// Slopes, or none where none were kept; nothing where they are damaged.
#[allow(clippy::option_option, reason = "damaged is not absent")]
fn slopes<T>(
    from: &mut Arrays,
    name: &str,
    known: impl FnOnce(Vec<usize>, [Vec<f32>; 3]) -> T,
) -> Option<Option<T>> {
    if !from.holds(&format!("{name}_of")) {
        return Some(None);
    }
    let touches = from.numbers(&format!("{name}_of")).ok()?.values;
    let touches = touches.iter().map(|&t| t as usize).collect();
    let mut one = |k: usize| -> Option<Vec<f32>> {
        let values = from.numbers(&format!("{name}_{k}")).ok()?.values;
        Some(values.iter().map(|&v| v as f32).collect())
    };
    let all = [one(0)?, one(1)?, one(2)?];
    Some(Some(known(touches, all)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::{Quality, unwatched};
    use crate::design::{Inputs, simulate, simulate_kept};
    use crate::io::opening::bundled;
    use crate::project::ElementKind;

    fn inputs(elements: ElementKind) -> Inputs {
        let mut inputs = bundled().unwrap().inputs;
        inputs.project.part.elements = elements;
        inputs.project.touch.count = 60;
        inputs.project.sites.spacing_mm = 6.1;
        inputs.project.touch.friction_percent = 20.0;
        inputs
    }

    /// All of it, on elements of its own and on those of the file; of other inputs it is none, and damaged neither.
    #[test]
    fn what_was_kept_comes_back_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = path_in(folder.path(), "0123");
        let budget = Quality::Draft.budget();
        for elements in [ElementKind::Graded, ElementKind::AsGiven] {
            let inputs = inputs(elements);
            let first = simulate(&inputs, &budget, &unwatched).unwrap();
            assert!(write(&path, &first).unwrap());
            let kept = read(&path).unwrap();
            let again = simulate_kept(&inputs, &budget, kept, &unwatched)
                .unwrap()
                .unwrap();
            assert_eq!(
                format!("{:?}", first.dataset),
                format!("{:?}", again.dataset)
            );
            assert!(first.dataset.slopes.is_some() && first.dataset.making.is_some());
            assert_eq!(first.mesh.positions(), again.mesh.positions());
            assert_eq!(first.mesh.triangles(), again.mesh.triangles());
            assert_eq!((&first.held, &first.carried), (&again.held, &again.carried));
            assert_eq!(
                (&first.points, first.unknowns),
                (&again.points, again.unknowns)
            );
            assert_eq!(
                (first.discretization, first.linearity),
                (again.discretization, again.linearity)
            );
            assert_eq!(
                (first.checks, &first.achieved),
                (again.checks, &again.achieved)
            );
            let systems = [&first, &again].map(|of| of.model().unwrap().system().smallest_pivot());
            assert_eq!(systems[0], systems[1]);

            let mut others = inputs.clone();
            others.project.sites.spacing_mm = 9.0;
            let of_others = simulate_kept(&others, &budget, read(&path).unwrap(), &unwatched);
            assert!(of_others.unwrap().is_none());
        }
        let whole = std::fs::read(&path).unwrap();
        for cut in [0, 10, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            assert!(read(&path).is_none(), "cut at {cut}");
        }
        let mut turned = whole.clone();
        turned[whole.len() / 2] ^= 4;
        std::fs::write(&path, &turned).unwrap();
        assert!(read(&path).is_none());
    }

    #[test]
    fn a_key_is_of_inputs_and_part() {
        let part = bundled().unwrap().inputs.part;
        let other = part.thickened(1e-3);
        let keys = [key("a", &part), key("b", &part), key("a", &other)];
        assert!(keys[0] != keys[1] && keys[0] != keys[2]);
        assert_eq!(keys[0], key("a", &part));
    }
}
