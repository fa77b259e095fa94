//! What colours the limb: the fields a vertex, their legends, and the shape that is shown.

use std::sync::Arc;

use super::Studio;
use super::viewport::Tool;
use crate::colormap::ColorMap;
use crate::io::report::{robust_top, round_up};
use crate::render::gpu::Shown;

/// What colours the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Field {
    #[default]
    Region,
    Strain,
    Displacement,
    SignalToNoise,
    Error,
}

impl Field {
    pub const ALL: [Self; 5] = [
        Self::Region,
        Self::Strain,
        Self::Displacement,
        Self::SignalToNoise,
        Self::Error,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Region => "Feasible region",
            Self::Strain => "Strain, inside",
            Self::Displacement => "Displacement",
            Self::SignalToNoise => "Signal to noise",
            Self::Error => "Localization error",
        }
    }
}

/// A field ready to be shown: one value a vertex, and the legend that goes with it.
pub(super) struct Built {
    pub signature: String,
    pub shown: Arc<Vec<Shown>>,
    pub legend: Option<Legend>,
}

#[derive(Clone)]
pub(super) struct Legend {
    pub title: &'static str,
    pub low: f64,
    pub high: f64,
    pub map: ColorMap,
}

/// How large the largest displacement is drawn, as a share of the limb.
const SHOWN_DEFORMATION: f64 = 0.06;

impl Studio {
    /// Builds what is shown a vertex, when anything it depends on has changed.
    pub(super) fn build_field(&mut self) {
        let signature = format!(
            "{:?} {} {:?} {:?} {:?} {:?}",
            self.view.field,
            self.touching.version,
            self.feasibility
                .as_ref()
                .filter(|f| !self.view.is_stroking() && f.0 == self.document.feasible_key())
                .map(|f| Arc::as_ptr(&f.1)),
            self.simulation.as_ref().map(|s| Arc::as_ptr(&s.simulated)),
            self.design.as_ref().map(|d| Arc::as_ptr(&d.design)),
            self.document.state.painted.as_ref().map(|m| {
                use std::hash::{DefaultHasher, Hash, Hasher};
                let mut hasher = DefaultHasher::new();
                m.hash(&mut hasher);
                hasher.finish()
            }),
        );
        if self
            .view
            .built
            .as_ref()
            .is_some_and(|b| b.signature == signature)
        {
            return;
        }
        let (values, legend) = self.field_values();
        let region = self.region_values();
        let shown = (0..self.document.part.positions().len())
            .map(|v| Shown {
                displacement: self
                    .touching
                    .result()
                    .map_or([0.0; 3], |t| t.displacement[v].as_vec3().to_array()),
                value: values.as_ref().map_or(0.0, |x| x[v] as f32),
                region: region[v] as f32,
            })
            .collect();
        self.view.built = Some(Built {
            signature,
            shown: Arc::new(shown),
            legend,
        });
    }

    /// The chosen field over the legend's range (0–1 a vertex).
    fn field_values(&self) -> (Option<Vec<f64>>, Option<Legend>) {
        match self.view.field {
            Field::Region => (None, None),
            Field::Strain => self.touching.result().map_or((None, None), |t| {
                let micro: Vec<f64> = t.strain.iter().map(|e| e * 1e6).collect();
                let top = robust_top(&micro);
                let values = micro.iter().map(|e| 0.5 + 0.5 * e / top).collect();
                (
                    Some(values),
                    Some(Legend {
                        title: "strain (microstrain)",
                        low: -top,
                        high: top,
                        map: ColorMap::BlueOrange,
                    }),
                )
            }),
            Field::Displacement => self.touching.result().map_or((None, None), |t| {
                let top = round_up(t.largest * 1000.0);
                let values = t
                    .displacement
                    .iter()
                    .map(|d| d.length() * 1000.0 / top)
                    .collect();
                (
                    Some(values),
                    Some(Legend {
                        title: "displacement (mm)",
                        low: 0.0,
                        high: top,
                        map: ColorMap::Viridis,
                    }),
                )
            }),
            Field::Error => {
                // On the mesh that was computed on, whose size has a limit, and carried from there.
                let vertices = self.document.part.positions().len();
                let simulated = (self.design.as_ref())
                    .map(|d| (&d.design, &d.design.simulated))
                    .filter(|(_, simulated)| simulated.carried.len() == vertices);
                let Some((simulated, map)) =
                    simulated.and_then(|(design, s)| Some((s, design.error_map(&s.mesh)?)))
                else {
                    return (None, None);
                };
                let errors: Vec<f64> = (simulated.carried.iter())
                    .map(|&at| simulated.mesh.interpolate(&map, at))
                    .collect();
                let top = robust_top(&errors);
                (
                    Some(errors.iter().map(|e| e / top).collect()),
                    Some(Legend {
                        title: "error (mm)",
                        low: 0.0,
                        high: top,
                        map: ColorMap::Viridis,
                    }),
                )
            }
            Field::SignalToNoise => {
                let noise = self.document.state.project.gauge.noise_microstrain * 1e-6;
                let Some(simulation) = self.simulation.as_ref().filter(|_| noise > 0.0) else {
                    return (None, None);
                };
                let rms: Vec<f64> = simulation
                    .simulated
                    .dataset
                    .sites
                    .iter()
                    .map(|s| s.rms_strain / noise)
                    .collect();
                let ratio = self.carried_from_sites(&rms);
                let top = robust_top(&ratio);
                let values = ratio.iter().map(|r| r / top).collect();
                (
                    Some(values),
                    Some(Legend {
                        title: "signal to noise (rms)",
                        low: 0.0,
                        high: top,
                        map: ColorMap::Viridis,
                    }),
                )
            }
        }
    }

    /// 1 where gauges may go: the filters' verdicts where they are known, else what was painted.
    fn region_values(&self) -> Vec<f64> {
        let current = self
            .feasibility
            .as_ref()
            .filter(|f| !self.view.is_stroking() && f.0 == self.document.feasible_key());
        if let Some((_, verdicts)) = current {
            let passed: Vec<f64> = verdicts
                .verdicts
                .iter()
                .map(|v| f64::from(u8::from(v.is_none())))
                .collect();
            return self.carried_from_sites(&passed);
        }
        match &self.document.state.painted {
            Some(mask) => mask.iter().map(|&m| f64::from(u8::from(m))).collect(),
            None => vec![0.0; self.document.part.positions().len()],
        }
    }

    /// Carries values of sites to the part's vertices, by the sites' places in their triangles.
    fn carried_from_sites(&self, values: &[f64]) -> Vec<f64> {
        let vertices = self.document.part.positions().len();
        let Some(simulation) = self.simulation.as_ref() else {
            return vec![0.0; vertices];
        };
        let mesh = &simulation.simulated.mesh;
        let (mut sum, mut weight) = (
            vec![0.0; mesh.positions().len()],
            vec![0.0; mesh.positions().len()],
        );
        for (at, value) in simulation.simulated.points.iter().zip(values) {
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
        let carried = &simulation.simulated.carried;
        carried
            .iter()
            .map(|&at| mesh.interpolate(&values, at))
            .collect()
    }

    /// How much the deformation is exaggerated; nothing without a touch, nor while painting: the brush
    /// works on the limb at rest.
    #[must_use]
    pub fn exaggeration(&self) -> Option<f64> {
        let touched = self
            .touching
            .result()
            .filter(|t| self.view.tool == Tool::Touch && t.largest > 0.0)?;
        let (lower, upper) = self.document.part.bounds();
        let wanted =
            SHOWN_DEFORMATION * (upper - lower).length() / touched.largest.max(f64::MIN_POSITIVE);
        let power = 10f64.powf(wanted.log10().floor());
        [5.0, 2.0, 1.0]
            .map(|m| m * power)
            .into_iter()
            .find(|s| *s <= wanted)
    }
}
