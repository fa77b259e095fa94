//! The report's section on what was computed: the part, where it came from, and how it is held.

use std::fmt::Write as _;

use crate::design::{Design, Inputs};
use crate::io::run::Provenance;
use crate::io::svg::escape;
use crate::plain::{self, quote};
use crate::project::{PartAxis, PartModel, SupportKeys, SupportKind};

/// Lines that say of which part, and under which assumptions, all other figures are.
pub(super) fn section(
    page: &mut String,
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
) {
    page.push_str("<h2>The part</h2><ul>");
    for line in lines(inputs, design, provenance) {
        let _ = write!(page, "<li>{}</li>", escape(&line));
    }
    page.push_str("</ul>");
}

/// Of which part, and under which assumptions, all other figures are: a sentence each.
#[must_use]
pub fn lines(inputs: &Inputs, design: &Design, provenance: &Provenance) -> Vec<String> {
    let mut lines = vec![
        mesh(inputs, provenance),
        stance(inputs),
        wall(inputs, design),
        material(inputs),
    ];
    lines.extend(inputs.project.supports.iter().map(|s| held(s, inputs)));
    lines.extend(
        (provenance.taken_in.as_ref()).map(|words| format!("When the mesh was read: {words}.")),
    );
    lines
}

fn mesh(inputs: &Inputs, provenance: &Provenance) -> String {
    let name = provenance.mesh_path.file_name().unwrap_or_default();
    let unit = inputs.project.part.unit.map_or("m", |unit| unit.name());
    format!(
        "Mesh: {}, in {unit}. All places and directions are in its coordinates, in millimetres.",
        name.to_string_lossy()
    )
}

fn stance(inputs: &Inputs) -> String {
    let stance = inputs.stance();
    let how = match inputs.project.part.axis {
        PartAxis::Auto => "found by its shape",
        PartAxis::Coordinate(_) | PartAxis::Along(_) => "as the project says",
    };
    let [up, front] = [stance.up(), stance.front()].map(|d| tidy(d.to_array()));
    format!("Its axis, which is up here, is along {up} ({how}); its front faces {front}.")
}

fn wall(inputs: &Inputs, design: &Design) -> String {
    let part = &inputs.project.part;
    match (part.model, design.simulated.usual_wall()) {
        (PartModel::Shell, _) => format!("Shell, {} mm thick.", part.thickness_mm),
        (PartModel::Solid, Some(wall)) => format!(
            "Solid; its walls are mostly {} mm thick, as measured on the mesh.",
            plain::digits(wall * 1e3)
        ),
        (PartModel::Solid, None) => "Solid.".to_owned(),
    }
}

fn material(inputs: &Inputs) -> String {
    let material = &inputs.project.material;
    format!(
        "Material: E {} GPa, ν {}, linearly elastic and the same in all directions.",
        material.youngs_modulus_gpa, material.poissons_ratio
    )
}

fn held(support: &SupportKeys, inputs: &Inputs) -> String {
    let how = match support.kind {
        SupportKind::Clamped => "clamped",
        SupportKind::Pinned => "pinned",
        SupportKind::Symmetry => "held as by a mirror plane",
    };
    let gives = support.bedding().and(support.bedding_n_per_mm3);
    let how = gives.map_or_else(
        || how.to_owned(),
        |b| format!("{how}, on a bedding of {} N/mm³,", plain::digits(b)),
    );
    let place = match (&support.box_mm, &support.vertices) {
        (Some([from, to]), _) => {
            let along = (support.box_axis).map_or_else(String::new, |axis| {
                format!(
                    ", along the front, the right and the up of the axis {}",
                    tidy(axis)
                )
            });
            format!("between {} and {} mm{along}", tidy(*from), tidy(*to))
        }
        (None, Some(name)) => {
            let mask = inputs.masks.get(name);
            let count = mask.map_or(0, |mask| mask.iter().filter(|&&held| held).count());
            let vertices = plain::either(count, "vertex", "vertices");
            format!("at {} ({vertices} of the surface)", quote(name))
        }
        (None, None) => return format!("Held: {how}."),
    };
    format!("Held: {how} {place}.")
}

/// Three numbers with as many digits as are read.
fn tidy(numbers: [f64; 3]) -> String {
    format!("[{}]", numbers.map(plain::digits).join(", "))
}
