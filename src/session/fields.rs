//! Fields over the part that take a while to compute.

use std::sync::Arc;

use super::attention::Attention;
use super::jobs::Task;
use super::slot::{Slot, current, take_in};
use super::state::Session;
use super::state::fields::{FieldInputs, FieldKind, FieldValues};
use crate::design::Simulated;
use crate::job::Reporter;

impl Session {
    fn field_inputs(&self, kind: FieldKind) -> Option<FieldInputs> {
        Some(FieldInputs {
            kind,
            design: self.results.design_mark()?,
            gauges: match kind {
                FieldKind::Error => Vec::new(),
                FieldKind::Uncertainty => self.gauge_places(),
            },
        })
    }

    /// A field, a vertex of the part: until it is computed, the last of its kind.
    #[must_use]
    pub fn field(&self, kind: FieldKind) -> Option<&FieldValues> {
        let vertices = self.document.part.positions().len();
        let last = self.caches.field.as_ref();
        last.filter(|f| f.inputs.kind == kind && f.value.len() == vertices)
    }

    /// Computes the field that is looked at.
    pub(super) fn refresh_field(&mut self, attention: &Attention) {
        let Some(inputs) = attention.field().and_then(|kind| self.field_inputs(kind)) else {
            return;
        };
        let known = current(self.caches.field.as_ref(), &inputs).is_some();
        if !known && self.jobs.is_new(Task::Field, &inputs) {
            self.start_field(inputs);
        }
    }

    fn start_field(&mut self, inputs: FieldInputs) {
        let vertices = self.document.part.positions().len();
        let Some(design) = (self.results.design.as_ref()).map(|d| Arc::clone(&d.value.design))
        else {
            return;
        };
        if design.simulated.carried.len() != vertices {
            return;
        }
        let (kind, gauges) = (inputs.kind, inputs.gauges.clone());
        let work = move |_: &Reporter| {
            // On the mesh that was computed on, whose size has a limit, and carried from there.
            let mesh = &design.simulated.mesh;
            let map = match kind {
                FieldKind::Error => design.error_map(mesh),
                FieldKind::Uncertainty => design.uncertainty_map(mesh, &gauges),
            };
            let map = map.unwrap_or_else(|| vec![0.0; mesh.positions().len()]);
            let carried = design.simulated.carried.iter();
            let values = carried.map(|&at| mesh.interpolate(&map, at)).collect();
            Ok(Arc::new(values))
        };
        self.jobs
            .start(Task::Field, inputs, work, |s, inputs, value| {
                let now = s.field_inputs(inputs.kind);
                take_in(&mut s.caches.field, Slot { inputs, value }, now.as_ref());
            });
    }

    /// Carries values of the simulation's sites to the part's vertices, by the sites' places in their triangles.
    #[must_use]
    pub fn carried_from_sites(&self, values: &[f64]) -> Vec<f64> {
        let vertices = self.document.part.positions().len();
        self.results.simulation.as_ref().map_or_else(
            || vec![0.0; vertices],
            |simulation| carried(&simulation.value.simulated, values),
        )
    }
}

/// Carries values of a simulation's sites to the part's vertices, by the sites' places in their triangles.
fn carried(simulated: &Simulated, values: &[f64]) -> Vec<f64> {
    let mesh = &simulated.mesh;
    let (mut sum, mut weight) = (
        vec![0.0; mesh.positions().len()],
        vec![0.0; mesh.positions().len()],
    );
    for (at, value) in simulated.points.iter().zip(values) {
        for (v, w) in mesh.triangles()[at.triangle as usize]
            .into_iter()
            .zip(at.barycentric)
        {
            sum[v as usize] += w * value;
            weight[v as usize] += w;
        }
    }
    // On a mesh finer than the sites some vertices have none beside them: take the neighbours'.
    for _ in 0..4 {
        let (old_sum, old_weight) = (sum.clone(), weight.clone());
        for edge in mesh.edges() {
            for (a, b) in [(edge.a, edge.b), (edge.b, edge.a)] {
                if old_weight[a as usize] == 0.0 && old_weight[b as usize] > 0.0 {
                    sum[a as usize] += old_sum[b as usize] / old_weight[b as usize];
                    weight[a as usize] += 1.0;
                }
            }
        }
    }
    let values: Vec<f64> = sum
        .iter()
        .zip(&weight)
        .map(|(s, w)| if *w > 0.0 { s / w } else { 0.0 })
        .collect();
    let places = simulated.carried.iter();
    places.map(|&at| mesh.interpolate(&values, at)).collect()
}
