//! What colours the limb: the fields a vertex, their legends, and the shape that is shown.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Studio;
use super::tools::Tool;
use crate::colormap::ColorMap;
use crate::document::{Layer, PaintInputs, WallInputs};
use crate::elasticity::support::held_freedoms;
use crate::feasible::Feasibility;
use crate::io::report::{robust_top, round_up};
use crate::render::gpu::Shown;
use crate::session::{self, FieldKind};

/// What colours the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Field {
    #[default]
    Region,
    Strain,
    Displacement,
    SignalToNoise,
    Error,
    /// By matching, of the gauges as they are; what they are blind to is marked.
    Expected,
    Uncertainty,
    Faces,
    Thickness,
}

impl Field {
    pub const ALL: [Self; 9] = [
        Self::Region,
        Self::Strain,
        Self::Displacement,
        Self::SignalToNoise,
        Self::Error,
        Self::Expected,
        Self::Uncertainty,
        Self::Faces,
        Self::Thickness,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Region => "Regions",
            Self::Strain => "Strain, inside",
            Self::Displacement => "Displacement",
            Self::SignalToNoise => "Signal to noise",
            Self::Error => "Localization error",
            Self::Expected => "Expected error",
            Self::Uncertainty => "GP variance",
            Self::Faces => "Faces",
            Self::Thickness => "Wall thickness",
        }
    }
}

/// Ranges of the colours that stay whatever the values are, in the legend's units.
#[derive(Default)]
pub(super) struct Ranges(BTreeMap<Field, (f64, f64)>);

impl Ranges {
    pub fn of(&self, field: Field) -> Option<(f64, f64)> {
        self.0.get(&field).copied()
    }

    /// Fixes a range, or lets it go. Bounds that are no numbers, endless or equal can be typed, but nothing can be
    /// coloured by them: they leave the range before.
    pub fn set(&mut self, field: Field, range: Option<(f64, f64)>) {
        match range {
            Some((low, high)) if (high - low).is_finite() && low != high => {
                self.0.insert(field, (low, high));
            }
            Some(_) => {}
            None => drop(self.0.remove(&field)),
        }
    }
}

/// Faces are ±1 on colours that reach this far, so that both are bright.
pub(super) const FACE_RANGE: f64 = 1.7;

/// What the regions were built from.
#[derive(Clone, PartialEq)]
struct RegionInputs {
    verdicts: Option<Arc<Feasibility>>,
    paint: PaintInputs,
}

/// What a field was built from.
#[derive(Clone, PartialEq)]
struct FieldInputs {
    field: Field,
    range: Option<(f64, f64)>,
    /// Counts touches, and results of the project.
    touch: u64,
    results: u64,
    of_field: OfField,
}

/// What only some fields are built from.
#[derive(Clone, PartialEq)]
enum OfField {
    Nothing,
    Noise(f64),
    /// Counts answers; whether the last is of the gauges as they are.
    Expected(u64, bool),
    Slow(Option<Box<session::FieldInputs>>),
    Walls(Box<OfWalls>),
}

/// What a field of the walls is built from.
#[derive(Clone, PartialEq)]
struct OfWalls {
    /// What is known of them, whether it still holds, and whether a hand is painting.
    known: Option<WallInputs>,
    holds: bool,
    stroking: bool,
    paint: PaintInputs,
}

/// A field ready to be shown, and the legend that goes with it.
pub(super) struct Built {
    /// What the field and the regions were built from.
    field: FieldInputs,
    region: RegionInputs,
    pub shown: Arc<Vec<Shown>>,
    /// The same for the unrolled part when that is shown, and what it was made from.
    pub flat: Option<FlatShown>,
    pub legend: Option<Legend>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Legend {
    pub title: String,
    pub low: f64,
    pub high: f64,
    pub map: ColorMap,
}

pub(super) struct FlatShown {
    of: Arc<Vec<Shown>>,
    pub shown: Arc<Vec<Shown>>,
}

impl Studio {
    /// Builds what is shown a vertex, where anything it depends on has changed.
    pub(super) fn build_field(&mut self) {
        let slow = self.slow_field();
        let field = self.field_inputs();
        let region = self.region_inputs();
        let last = self.view.built.take();
        let same_field = last.as_ref().is_some_and(|b| b.field == field);
        let same_region = last.as_ref().is_some_and(|b| b.region == region);
        let mut built = match last {
            Some(built) if same_field && same_region => built,
            Some(mut built) if same_field => {
                let shown: &mut Vec<Shown> = Arc::make_mut(&mut built.shown);
                self.colour_regions(shown);
                built.region = region;
                built
            }
            _ => {
                let (mut shown, legend) = self.field_shown(slow.as_deref());
                self.colour_regions(&mut shown);
                Built {
                    field,
                    region,
                    shown: Arc::new(shown),
                    flat: None,
                    legend,
                }
            }
        };
        if self.view.unrolled_shown {
            let known = built.flat.as_ref();
            if known.is_none_or(|k| !Arc::ptr_eq(&k.of, &built.shown)) {
                let flat = self.view.unrolled.flat.vertices.iter().map(|&v| Shown {
                    displacement: [0.0; 3],
                    ..built.shown[v as usize]
                });
                built.flat = Some(FlatShown {
                    shown: Arc::new(flat.collect()),
                    of: Arc::clone(&built.shown),
                });
            }
        } else {
            built.flat = None;
        }
        self.view.built = Some(built);
    }

    /// Whether colours with a legend are shown.
    #[must_use]
    pub fn shows_field(&self) -> bool {
        self.view.built.as_ref().is_some_and(|b| b.legend.is_some())
    }

    fn field_inputs(&self) -> FieldInputs {
        let field = self.view.field;
        let of_field = match field {
            Field::Region | Field::Strain | Field::Displacement => OfField::Nothing,
            Field::SignalToNoise => {
                OfField::Noise(self.session.document.state.project.gauge.noise_microstrain)
            }
            Field::Expected => {
                let version = self.session.caches.expected.version;
                OfField::Expected(version, self.expected_shown().is_some())
            }
            Field::Error | Field::Uncertainty => {
                let shown = self.session.caches.field.as_ref();
                OfField::Slow(shown.map(|f| Box::new(f.inputs.clone())))
            }
            Field::Faces | Field::Thickness => OfField::Walls(Box::new(OfWalls {
                known: (self.session.caches.walls.as_ref()).map(|w| w.inputs.clone()),
                holds: self.session.advice().is_some(),
                // What is painted is seen at once, and measured when the hand lets go.
                stroking: self.view.is_stroking(),
                paint: self.session.document.paint_inputs(),
            })),
        };
        FieldInputs {
            field,
            range: self.view.ranges.of(field),
            touch: self.session.caches.touching.version,
            results: self.session.results.version,
            of_field,
        }
    }

    fn region_inputs(&self) -> RegionInputs {
        RegionInputs {
            verdicts: self.verdicts_shown().cloned(),
            paint: self.session.document.paint_inputs(),
        }
    }

    /// The filters' verdicts while they hold and no stroke changes them.
    fn verdicts_shown(&self) -> Option<&Arc<Feasibility>> {
        let verdicts = self.session.current_verdicts();
        verdicts.filter(|_| !self.view.is_stroking())
    }

    /// A field that is computed in the background, once it is there.
    fn slow_field(&mut self) -> Option<Arc<Vec<f64>>> {
        let kind = match self.view.field {
            Field::Error => FieldKind::Error,
            Field::Uncertainty => FieldKind::Uncertainty,
            _ => return None,
        };
        self.session.field(kind)
    }

    /// The field over its range, a vertex, with the shape that is shown.
    fn field_shown(&mut self, slow: Option<&Vec<f64>>) -> (Vec<Shown>, Option<Legend>) {
        let field = self.view.field;
        let found = self.field_values(slow).map(|(values, mut legend)| {
            if let Some((low, high)) = self.view.ranges.of(field) {
                (legend.low, legend.high) = (low, high);
            }
            (values, legend)
        });
        let moved = self
            .session
            .caches
            .touching
            .result()
            .map(|t| &t.displacement);
        let shown = (0..self.session.document.part.positions().len()).map(|v| Shown {
            displacement: moved.map_or([0.0; 3], |d| d[v].as_vec3().to_array()),
            value: found.as_ref().map_or(0.0, |(values, legend)| {
                ((values[v] - legend.low) / (legend.high - legend.low)) as f32
            }),
            region: [0; 4],
        });
        (shown.collect(), found.map(|f| f.1))
    }

    /// The chosen field a vertex of the part, in the units of its legend.
    fn field_values(&mut self, slow: Option<&Vec<f64>>) -> Option<(Vec<f64>, Legend)> {
        let legend = |title: &str, low, high, map| Legend {
            title: title.to_owned(),
            low,
            high,
            map,
        };
        match self.view.field {
            Field::Region => None,
            Field::Strain => {
                let touched = self.session.caches.touching.result()?;
                let micro: Vec<f64> = touched.strain.iter().map(|e| e * 1e6).collect();
                let top = robust_top(&micro);
                let map = ColorMap::BlueOrange;
                Some((micro, legend("strain (microstrain)", -top, top, map)))
            }
            Field::Displacement => {
                let touched = self.session.caches.touching.result()?;
                let top = round_up(touched.largest * 1000.0);
                let mm = touched.displacement.iter().map(|d| d.length() * 1000.0);
                let map = ColorMap::Viridis;
                Some((mm.collect(), legend("displacement (mm)", 0.0, top, map)))
            }
            Field::SignalToNoise => {
                let noise = self.session.document.state.project.gauge.noise_microstrain * 1e-6;
                let simulation = self
                    .session
                    .results
                    .simulation
                    .as_ref()
                    .filter(|_| noise > 0.0)?;
                let sites = simulation.value.simulated.dataset.sites.iter();
                let rms: Vec<f64> = sites.map(|s| s.rms_strain / noise).collect();
                let ratio = self.session.carried_from_sites(&rms);
                let top = robust_top(&ratio);
                let map = ColorMap::Viridis;
                Some((ratio, legend("signal to noise (rms)", 0.0, top, map)))
            }
            Field::Faces => {
                let sides = self.wall_values(true)?;
                let map = ColorMap::BlueOrange;
                Some((sides, legend("faces", -FACE_RANGE, FACE_RANGE, map)))
            }
            Field::Thickness => {
                let mm = self.wall_values(false)?;
                let top = robust_top(&mm);
                Some((
                    mm,
                    legend("wall thickness (mm)", 0.0, top, ColorMap::Viridis),
                ))
            }
            Field::Error => {
                let errors = slow?;
                let top = robust_top(errors);
                let map = ColorMap::Viridis;
                Some((errors.clone(), legend("error (mm)", 0.0, top, map)))
            }
            Field::Expected => {
                let vertices = self.session.document.part.positions().len();
                let answer = self.expected_shown()?;
                let values = answer.expected.map_mm.clone();
                let [lightest, hardest] = self.session.in_hand()?.forces_n;
                let title = format!("expected error (mm), {lightest}–{hardest} N");
                let found = legend(&title, 0.0, answer.top_mm, ColorMap::Viridis);
                (values.len() == vertices).then_some((values, found))
            }
            Field::Uncertainty => {
                let variances = slow?;
                let map = ColorMap::Viridis;
                let title = "variance left";
                Some((variances.clone(), legend(title, 0.0, 1.0, map)))
            }
        }
    }

    /// What the gauges are blind to, a vertex of the part, where that is marked.
    fn blind_shown(&self) -> Option<&[f64]> {
        let answer = self.expected_shown();
        let answer = answer.filter(|_| self.view.field == Field::Expected)?;
        Some(&answer.expected.blind_map)
    }

    /// Writes the layers into what is shown, or what the gauges are blind to in place of the first.
    fn colour_regions(&self, shown: &mut [Shown]) {
        let shades = |weight: f64| (255.0 * weight.clamp(0.0, 1.0)) as u8;
        if let Some(blind) = self.blind_shown() {
            for (shown, blind) in shown.iter_mut().zip(blind) {
                shown.region = [shades(*blind), 0, 0, 0];
            }
            return;
        }
        let verdicts = self.verdicts_shown().map(|verdicts| {
            let passed = verdicts
                .verdicts
                .iter()
                .map(|v| f64::from(u8::from(v.is_none())));
            self.session.carried_from_sites(&passed.collect::<Vec<_>>())
        });
        let mask = |layer| self.session.document.layer(layer).map(|m| m.as_slice());
        let painted = mask(Layer::Feasible);
        let (touch, out) = (mask(Layer::Touch), mask(Layer::KeepOut));
        let supports = self
            .session
            .document
            .state
            .project
            .supports(&self.session.document.state.masks);
        let held = supports
            .map(|s| held_freedoms(&self.session.document.part, &s))
            .unwrap_or_default();
        let set =
            |mask: Option<&[bool]>, v: usize| if mask.is_some_and(|m| m[v]) { 255 } else { 0 };
        for (v, shown) in shown.iter_mut().enumerate() {
            let feasible = match &verdicts {
                Some(passed) => shades(passed[v]),
                None => set(painted, v),
            };
            let held = held.get(v).is_some_and(|h| h.0 != 0);
            shown.region = [feasible, set(touch, v), u8::from(held) * 255, set(out, v)];
        }
    }

    /// How much the deformation is exaggerated; nothing without a touch, nor with other tools: they work
    /// on the limb at rest.
    #[must_use]
    pub fn exaggeration(&self) -> Option<f64> {
        let touched = self.session.caches.touching.result()?;
        touched
            .exaggeration
            .filter(|_| self.view.tool == Tool::Touch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_that_nothing_can_be_coloured_by_leave_the_range_before() {
        let field = Field::Strain;
        let mut ranges = Ranges::default();
        ranges.set(field, Some((f64::NAN, 1.0)));
        assert_eq!(ranges.of(field), None);
        ranges.set(field, Some((-2.0, 3.0)));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            ranges.set(field, Some((bad, 3.0)));
            ranges.set(field, Some((-2.0, bad)));
        }
        ranges.set(field, Some((f64::MIN, f64::MAX)));
        ranges.set(field, Some((3.0, 3.0)));
        assert_eq!(ranges.of(field), Some((-2.0, 3.0)));
        ranges.set(field, None);
        assert_eq!(ranges.of(field), None);
    }
}
