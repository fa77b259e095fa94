//! What a study says of each design: numbers with names.

use glam::DVec3;

use super::file::ParameterStudy;
use super::service::ServiceResponse;
use crate::design::{Design, DesignError, Inputs};
use crate::elasticity::respond::gives_way;
use crate::elasticity::{Model, Touch};
use crate::placement::SensorSet;
use crate::project::PartModel;
use crate::regression::folds::evenly;
use crate::units;

/// A number with its name; absent where there is none.
pub type Figure = (String, Option<f64>);

/// Touches that say how stiff a part is.
const PRESSED: usize = 64;

/// The figures that a study has of a design. Errors are means over unseen touches, in mm.
///
/// # Errors
/// [`DesignError`] where the model cannot be built again.
pub fn figures(
    inputs: &Inputs,
    design: &Design,
    study: &ParameterStudy,
) -> Result<Vec<Figure>, DesignError> {
    let set = design.chosen_set();
    let mut all = vec![
        ("gauges".to_owned(), Some(design.chosen().len() as f64)),
        ("expected_mm".into(), set.and_then(SensorSet::promised_mm)),
        (
            "bound_mm".into(),
            set.and_then(|s| s.certificate).map(|c| c.bound_mm),
        ),
    ];
    all.extend(errors(design));
    all.extend(lost(design));
    let model = design.simulated.model()?;
    all.extend(mechanics(inputs, design, &*model));
    let sites = &design.simulated.dataset.sites;
    let places: Vec<DVec3> = sites.iter().map(|s| s.gauge.position).collect();
    let response = ServiceResponse::of(&*model, &study.service, &places)?;
    all.extend(response.iter().flat_map(in_service));
    let cm3 = units::cm3(volume(inputs));
    all.push(("mass_g".into(), Some(study.base.density_g_cm3 * cm3)));
    Ok(all)
}

/// Errors over all touches: at every force by matching, else by the regression at its own.
fn errors(design: &Design) -> Vec<Figure> {
    let mut all = Vec::new();
    for row in design.evaluation.by_force(design.chosen_id()) {
        let at = |what: &str| format!("{what}_{}n_mm", row.force_n);
        all.extend([
            (at("error"), Some(row.error_mm)),
            (at("p95"), Some(row.p95_mm)),
            (at("as_built"), Some(row.as_built_mm)),
            (at("calibrated"), row.calibrated_mm),
            (format!("blind_{}n", row.force_n), Some(row.blind)),
        ]);
    }
    if all.is_empty()
        && let Some(row) = design.chosen_row()
    {
        all.extend([
            ("error_mm".into(), Some(row.error_mm)),
            ("p95_mm".into(), Some(row.p95_mm)),
            ("as_built_mm".into(), Some(row.workshop_mm)),
        ]);
    }
    all
}

/// What is left when gauges are lost and nothing is done about it.
fn lost(design: &Design) -> Vec<Figure> {
    let of_chosen = design.evaluation.failures_of(design.chosen_by);
    let rows = of_chosen.iter().flat_map(|f| &f.rows);
    rows.filter(|r| r.failed > 0 && !r.retrained)
        .map(|r| (format!("lost_{}_mm", r.failed), Some(r.error_mm)))
        .collect()
}

/// How far the part gives way under the force of its touches, in the mean and at most, and the largest strain at any
/// site.
fn mechanics(inputs: &Inputs, design: &Design, model: &dyn Model) -> Vec<Figure> {
    let dataset = &design.simulated.dataset;
    let sample = evenly(dataset.touches.len(), PRESSED);
    let touches: Vec<Touch> = sample.iter().map(|&t| dataset.touches[t]).collect();
    let gives = gives_way(model, &touches);
    let mean = gives.iter().sum::<f64>() / gives.len().max(1) as f64;
    let most = gives.iter().copied().fold(0.0, f64::max);
    let force = inputs.project.touch.force_n;
    let strain = dataset
        .sites
        .iter()
        .map(|s| s.rms_strain)
        .fold(0.0, f64::max);
    vec![
        ("gives_way_mm".into(), Some(units::mm(mean))),
        ("gives_way_most_mm".into(), Some(units::mm(most))),
        (
            "stiffness_n_mm".into(),
            (mean > 0.0).then_some(force / (units::mm(mean))),
        ),
        (
            "largest_rms_microstrain".into(),
            Some(units::microstrain(strain)),
        ),
    ]
}

/// What the part does under its service load.
fn in_service(response: &ServiceResponse) -> [Figure; 4] {
    let gives_way = units::mm(response.gives_way);
    let stiffness = (gives_way > 0.0).then_some(response.force / gives_way);
    [
        ("service_gives_way_mm".into(), Some(gives_way)),
        ("service_stiffness_n_mm".into(), stiffness),
        (
            "service_moves_most_mm".into(),
            Some(units::mm(response.moves_most)),
        ),
        (
            "service_microstrain".into(),
            Some(units::microstrain(response.strain)),
        ),
    ]
}

/// Of a solid what its surface encloses, of a shell its middle surface times its wall.
fn volume(inputs: &Inputs) -> f64 {
    let part = &inputs.part;
    match inputs.project.part.model {
        PartModel::Solid => part.volume_enclosed().abs(),
        PartModel::Shell => part.area() * inputs.project.part.thickness(),
    }
}
