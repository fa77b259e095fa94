//! The shell against a three-dimensional solid model of a slotted limb that shares nothing with it but
//! its geometry: 747 000 freedoms, quadratic wedges (`tests/fixtures/slotted/solid.py`; its own two
//! finest meshes differ by 0.04 % under the load and by 0.2 % in strain).
//!
//! Wall 3 mm on a radius of 30 mm: the thick end of what a shell is for.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::design::Inputs;
use hapdef::given;
use hapdef::io::mesh_file::read_mesh;
use hapdef::io::points::{read_sites, read_touches};
use hapdef::mesh::repair::Repair;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{Masks, Project, SupportKeys, SupportKind, Unit};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/slotted")
        .join(name)
}

fn inputs() -> Inputs {
    let mesh = read_mesh(&fixture("shell.obj"), Some(Unit::Millimetre), 0, Repair::default());
    let mut project = Project::around("shell.obj", Some(Unit::Millimetre));
    project.part.thickness_mm = 3.0;
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([[-80.0, -80.0, -1.0], [80.0, 80.0, 6.0]]),
        vertices: None,
        normal: Axis::Z,
    });
    Inputs {
        project,
        part: std::sync::Arc::new(mesh.unwrap().mesh),
        painted: None,
        masks: Masks::new(),
    }
}

/// Displacement of the middle of the wall (mm) and strain of the inside, by touch and site.
fn solid() -> BTreeMap<(usize, usize), (DVec3, f64)> {
    let text = std::fs::read_to_string(fixture("solid.csv")).unwrap();
    text.lines()
        .skip(1)
        .map(|line| {
            let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            ((v[0] as usize, v[1] as usize), (DVec3::new(v[2], v[3], v[4]), v[5]))
        })
        .collect()
}

#[test]
fn a_slotted_limb_agrees_with_a_solid_model() {
    let (inputs, solid) = (inputs(), solid());
    let touches = read_touches(&fixture("touches.csv")).unwrap();
    let sites = read_sites(&fixture("sites.csv")).unwrap();
    // Rms and worst of the displacement under the load, rms of the strain beyond two tip radii (%).
    for (quality, most) in [
        (Quality::Draft, [5.0, 10.0, 5.0]),
        (Quality::Standard, [2.0, 6.0, 2.0]),
        (Quality::Reference, [1.0, 4.0, 1.0]),
    ] {
        let answer =
            given::answer(&inputs, &touches, &sites, &quality.budget(), &unwatched).unwrap();
        let (mut under, mut strain) = (Vec::new(), Vec::new());
        let mut largest = vec![0.0f64; touches.len()];
        let far = |t: usize, s: usize| {
            // The first sites are the touches themselves.
            s >= touches.len()
                && sites[s].position.distance(touches[t].position) > 2.0 * touches[t].tip_radius
        };
        for (&(t, s), &(_, e)) in solid.iter().filter(|((t, s), _)| far(*t, *s)) {
            let _ = s;
            largest[t] = largest[t].max(e.abs());
        }
        for pair in answer.pairs() {
            let (u, e) = solid[&(pair.touch, pair.site)];
            if pair.site == pair.touch {
                let n = touches[pair.touch].normal;
                under.push(pair.displacement.dot(n) * 1000.0 / u.dot(n) - 1.0);
            } else if far(pair.touch, pair.site) {
                strain.push((pair.strain - e) / largest[pair.touch]);
            }
        }
        let rms = |v: &[f64]| 100.0 * (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
        let worst = under.iter().fold(0.0f64, |m, x| m.max(100.0 * x.abs()));
        let found = [rms(&under), worst, rms(&strain)];
        println!(
            "{}: under the load {:.2} % rms, {:.2} % at worst; strain {:.2} % rms; estimated {:.2} % and {:.2} %",
            quality.name(),
            found[0],
            found[1],
            found[2],
            answer.discretization.displacement_percent,
            answer.discretization.strain_percent
        );
        for (found, most) in found.into_iter().zip(most) {
            assert!(found < most, "{}: {found:.2} of {most}", quality.name());
        }
        assert!(answer.notes.iter().any(|n| n.contains("radius of curvature")));
    }
}
