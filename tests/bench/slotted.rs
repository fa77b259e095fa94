//! The shell against a three-dimensional solid model of a slotted limb that shares nothing with it but
//! its geometry: 747 000 degrees of freedom, quadratic wedges (`tests/fixtures/slotted/solid.py`; its own two
//! finest meshes differ by 0.04 % under the load and by 0.2 % in strain).
//!
//! Wall 3 mm on a radius of 30 mm: the thick end of what a shell is for.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::design::Inputs;
use hapdef::given::{self, GivenAnswer};
use hapdef::io::mesh_file::read_mesh;
use hapdef::io::points::{read_sites, read_touches};
use hapdef::mesh::repair::Repair;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{Masks, Project, SupportKeys, SupportKind, Unit};

pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/slotted")
        .join(name)
}

pub fn inputs() -> Inputs {
    let mesh = read_mesh(
        &fixture("shell.obj"),
        Some(Unit::Millimetre),
        0,
        Repair::default(),
    );
    let mut project = Project::around("shell.obj", Some(Unit::Millimetre));
    project.part.thickness_mm = 3.0;
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([[-80.0, -80.0, -1.0], [80.0, 80.0, 6.0]]),
        box_axis: None,
        vertices: None,
        normal: Axis::Z,
        bedding_n_per_mm3: None,
    });
    Inputs {
        project,
        part: std::sync::Arc::new(mesh.unwrap().mesh),
        painted: None,
        masks: Masks::new(),
    }
}

/// Displacement of the middle of the wall (mm) and strain of the inside, by touch and site.
pub fn solid() -> BTreeMap<(usize, usize), (DVec3, f64)> {
    let text = std::fs::read_to_string(fixture("solid.csv")).unwrap();
    text.lines()
        .skip(1)
        .map(|line| {
            let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            (
                (v[0] as usize, v[1] as usize),
                (DVec3::new(v[2], v[3], v[4]), v[5]),
            )
        })
        .collect()
}

/// What a quality reaches against the solid (%).
pub struct Agreement {
    /// Rms and worst over the loads of the displacement under the load.
    pub under_rms: f64,
    pub under_worst: f64,
    /// Rms of the strain beyond two tip radii over the load's largest there.
    pub strain_rms: f64,
    pub answer: GivenAnswer,
}

pub fn agreement(quality: Quality) -> Agreement {
    let (inputs, solid) = (inputs(), solid());
    let touches = read_touches(&fixture("touches.csv")).unwrap();
    let sites = read_sites(&fixture("sites.csv")).unwrap();
    let answer = given::answer(&inputs, &touches, &sites, &quality.budget(), &unwatched).unwrap();
    let far = |t: usize, s: usize| {
        // The first sites are the touches themselves.
        s >= touches.len()
            && sites[s].position.distance(touches[t].position) > 2.0 * touches[t].tip_radius
    };
    let mut largest = vec![0.0f64; touches.len()];
    for (&(t, s), &(_, e)) in &solid {
        if far(t, s) {
            largest[t] = largest[t].max(e.abs());
        }
    }
    let (mut under, mut strain) = (Vec::new(), Vec::new());
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
    Agreement {
        under_rms: rms(&under),
        under_worst: under.iter().fold(0.0f64, |m, x| m.max(100.0 * x.abs())),
        strain_rms: rms(&strain),
        answer,
    }
}
