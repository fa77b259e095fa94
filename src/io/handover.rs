//! What whoever builds the limb is given: the report on paper, templates at full size, wiring, and the sketch's settings.
//!
//! | file | holds |
//! |---|---|
//! | `report.pdf` | what is promised, pictures, a card for each gauge, wiring, assembly, settings |
//! | `template.pdf` | 1 : 1, seen from inside: a patch for each gauge, and the unrolled inside over several sheets |
//! | `wiring.csv` | gauge, channel, pin, expected ranges, length of cable |
//! | `bill.csv` | what must be bought |
//! | `hapd_config.h` | pins, name and electric constants for the sketch |
//! | `gauges.urdf` | a frame for each gauge on the robot's link |
//! | `scene.glb` | the limb with its gauges, coloured by the error of touches, for any viewer |
//! | `jig/*.stl`, `jig/jig.csv` | what presses the gauges to the wall, to be printed, and the order in which it is put together |
//! | `zones.csv` | error, and what is not felt, at each vertex, in the link's frame |

mod cards;
mod document;
mod drawing;
pub mod jig;
mod jig_pages;
mod marks;
mod scene;
mod source;
mod stamp;
mod tables;
mod templates;

use self::source::HandoverSource;
use super::bench_folder::limb_key;
use super::mesh_file::urdf::link_of;
use super::run::{Provenance, as_computed, run_key};
use crate::budget::unwatched;
use crate::design::{Design, Inputs};
use crate::paper::{self, SheetSize};
use crate::plain::robust_top;
use crate::workshop::{self, Inner, Wiring};

pub use self::scene::StepScene;

/// The names of all files.
pub const FILES: [&str; 8] = [
    "report.pdf",
    "template.pdf",
    "wiring.csv",
    "bill.csv",
    "hapd_config.h",
    "gauges.urdf",
    "zones.csv",
    "scene.glb",
];

/// All files with their names, as [`FILES`] has them.
///
/// # Errors
/// Why a document could not be made.
pub fn files(
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
    format: SheetSize,
) -> Result<Vec<(String, Vec<u8>)>, String> {
    let inner = Inner::of(inputs, design);
    let landmarks = workshop::landmarks(&inner);
    let source = HandoverSource {
        jig: workshop::jig_of(inputs, &inner, &unwatched).map_err(|e| e.to_string())?,
        wiring: wiring(inputs, &inner, &landmarks),
        name: name(provenance),
        run: run_key(inputs, design),
        inputs,
        design,
        provenance,
        inner,
        landmarks,
        format,
    };
    let title = format!("Gauge placement for {}", source.name);
    let report = paper::pdf(&title, &document::sheets(&source))?;
    let title = format!("Templates for {}", source.name);
    let template = paper::pdf(&title, &templates::sheets(&source)?)?;
    let header = workshop::header(&source.wiring, &source.name, board(inputs, design));
    let texts = [
        tables::wiring(&source.wiring),
        tables::bill(source.bill()),
        header,
        workshop::urdf(&source.inner.gauges, &source.name, &link(provenance)),
        tables::zones(design),
    ];
    let files = [report, template]
        .into_iter()
        .chain(texts.map(String::into_bytes));
    let files = files.chain([scene(&source)?]);
    let named = FILES.into_iter().map(String::from).zip(files);
    let all = named.chain(jig::files(&source.jig));
    let stamped = all.map(|(name, bytes)| {
        let bytes = stamp::of_run(&name, bytes, &source.run);
        (name, bytes)
    });
    Ok(stamped.collect())
}

/// The limb coloured by the mean error of touches around each place, where that was judged.
fn scene(source: &HandoverSource<'_>) -> Result<Vec<u8>, String> {
    let mesh = &source.design.simulated.mesh;
    let errors = source.design.error_map(mesh);
    let field = errors.map(|errors| {
        let top = robust_top(&errors).max(f64::MIN_POSITIVE);
        errors
            .iter()
            .map(|e| (e / top).min(1.0))
            .collect::<Vec<f64>>()
    });
    let keys = &source.inputs.project.gauge;
    StepScene {
        limb: mesh,
        field: field.as_deref(),
        inner: &source.inner,
        grid_mm: [keys.grid_length_mm, keys.grid_width_mm],
        touch: None,
        run: Some(&source.run),
    }
    .glb()
}

/// The robot's link that the limb is: the one that was opened, or a name like the mesh's.
#[must_use]
pub fn link(provenance: &Provenance) -> String {
    link_of(provenance.mesh_path).unwrap_or_else(|| name(provenance))
}

fn name(provenance: &Provenance) -> String {
    if let Some(link) = link_of(provenance.mesh_path) {
        return link;
    }
    let stem = provenance.mesh_path.file_stem();
    stem.map_or_else(|| "limb".to_owned(), |s| s.to_string_lossy().into_owned())
}

fn wiring(inputs: &Inputs, inner: &Inner, landmarks: &[workshop::Landmarks]) -> Wiring {
    let project = &inputs.project;
    let settings = project.live.settings(inner.gauges.len());
    let heights: Vec<f64> = landmarks.iter().map(|l| l.above_foot).collect();
    let forces = [project.touch.force_n, project.touch.forces_n[1]];
    workshop::wiring(
        &inner.gauges,
        &settings.channels,
        &heights,
        settings.chain,
        forces,
    )
}

/// A number for the board: of the limb and the gauges that were chosen.
fn board(inputs: &Inputs, design: &Design) -> u32 {
    let chosen = Inputs {
        project: as_computed(&inputs.project, design),
        ..inputs.clone()
    };
    let key = limb_key(&chosen);
    u32::from_str_radix(&key[..key.len().min(8)], 16).unwrap_or(1)
}
