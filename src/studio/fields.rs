//! What colours the limb: the fields a vertex, their legends, and the shape that is shown.

use std::sync::Arc;

use super::view::{Field, ViewState};
use crate::colormap::ColorMap;
use crate::document::{Layer, PaintInputs, WallInputs};
use crate::elasticity::support::held_freedoms;
use crate::feasible::Feasibility;
use crate::mesh::flatten::Flat;
use crate::mesh::walls::WallSide;
use crate::plain::{robust_top, round_up};
use crate::project::Project;
use crate::render::gpu::Shown;
use crate::session::{self, FieldKind, Session};

/// Faces are ±1 on colours that reach this far, so that both are bright.
pub const FACE_RANGE: f64 = 1.7;

/// What the regions were built from.
#[derive(Clone, PartialEq)]
struct RegionInputs {
    verdicts: Option<Arc<Feasibility>>,
    paint: PaintInputs,
}

/// What a field was built from.
#[derive(Clone, PartialEq)]
struct BuiltFrom {
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
pub struct BuiltField {
    /// What the field and the regions were built from.
    field: BuiltFrom,
    region: RegionInputs,
    pub shown: Arc<Vec<Shown>>,
    /// The same for the unrolled part when that is shown, and what it was made from.
    pub flat: Option<FlatShown>,
    pub legend: Option<Legend>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    pub title: String,
    pub low: f64,
    pub high: f64,
    pub map: ColorMap,
}

/// What is shown of the unrolled part, and what it was made from.
pub struct FlatShown {
    of: Arc<Vec<Shown>>,
    pub shown: Arc<Vec<Shown>>,
}

fn legend(title: &str, [low, high]: [f64; 2], map: ColorMap) -> Legend {
    Legend {
        title: title.to_owned(),
        low,
        high,
        map,
    }
}

/// Of what begins at nothing.
fn rising(title: &str, top: f64) -> Legend {
    legend(title, [0.0, top], ColorMap::Viridis)
}

impl BuiltField {
    /// What is shown a vertex, made anew where anything it depends on has changed since the last; of the unrolled part
    /// too where that is shown.
    #[must_use]
    pub fn of(last: Option<Self>, flat: &Flat, session: &Session, view: &ViewState) -> Self {
        let mut built = Self::coloured(last, FieldSource { session, view });
        built.flat = view.unrolled_shown.then(|| built.laid_flat(flat));
        built
    }

    fn coloured(last: Option<Self>, source: FieldSource<'_>) -> Self {
        let (field, region) = (source.field_inputs(), source.region_inputs());
        match last {
            Some(built) if built.field == field && built.region == region => built,
            Some(mut built) if built.field == field => {
                let shown: &mut Vec<Shown> = Arc::make_mut(&mut built.shown);
                source.colour_regions(shown);
                built.region = region;
                built
            }
            _ => {
                let (mut shown, legend) = source.field_shown();
                source.colour_regions(&mut shown);
                Self {
                    field,
                    region,
                    shown: Arc::new(shown),
                    flat: None,
                    legend,
                }
            }
        }
    }

    /// The same for the unrolled part, made anew where what is shown has changed.
    fn laid_flat(&mut self, flat: &Flat) -> FlatShown {
        let known = self.flat.take();
        known
            .filter(|k| Arc::ptr_eq(&k.of, &self.shown))
            .unwrap_or_else(|| {
                let shown = flat.vertices.iter().map(|&v| Shown {
                    displacement: [0.0; 3],
                    ..self.shown[v as usize]
                });
                FlatShown {
                    shown: Arc::new(shown.collect()),
                    of: Arc::clone(&self.shown),
                }
            })
    }
}

/// What fields are made of.
#[derive(Clone, Copy)]
struct FieldSource<'a> {
    session: &'a Session,
    view: &'a ViewState,
}

impl<'a> FieldSource<'a> {
    fn project(&self) -> &'a Project {
        &self.session.document.state.project
    }

    fn field_inputs(&self) -> BuiltFrom {
        let field = self.view.field;
        let of_field = match field {
            Field::Region | Field::Strain | Field::Displacement => OfField::Nothing,
            Field::SignalToNoise => OfField::Noise(self.project().gauge.noise_microstrain),
            Field::Expected => {
                let version = self.session.caches.expected.version;
                OfField::Expected(version, self.view.expected(self.session).is_some())
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
        BuiltFrom {
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

    /// The field over its range, a vertex, with the shape that is shown.
    fn field_shown(&self) -> (Vec<Shown>, Option<Legend>) {
        let field = self.view.field;
        let found = self.field_values().map(|(values, mut legend)| {
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
    fn field_values(&self) -> Option<(Vec<f64>, Legend)> {
        match self.view.field {
            Field::Region => None,
            Field::Strain => {
                let touched = self.session.caches.touching.result()?;
                let micro: Vec<f64> = touched.strain.iter().map(|e| e * 1e6).collect();
                let top = robust_top(&micro);
                let map = ColorMap::BlueOrange;
                Some((micro, legend("strain (microstrain)", [-top, top], map)))
            }
            Field::Displacement => {
                let touched = self.session.caches.touching.result()?;
                let top = round_up(touched.largest * 1000.0);
                let mm = touched.displacement.iter().map(|d| d.length() * 1000.0);
                Some((mm.collect(), rising("displacement (mm)", top)))
            }
            Field::SignalToNoise => {
                let ratio = self.signal_to_noise()?;
                let top = robust_top(&ratio);
                Some((ratio, rising("signal to noise (rms)", top)))
            }
            Field::Faces => {
                let sides = self.wall_values(true)?;
                let ends = [-FACE_RANGE, FACE_RANGE];
                Some((sides, legend("faces", ends, ColorMap::BlueOrange)))
            }
            Field::Thickness => {
                let mm = self.wall_values(false)?;
                let top = robust_top(&mm);
                Some((mm, rising("wall thickness (mm)", top)))
            }
            Field::Error => {
                let errors = &*self.session.field(FieldKind::Error)?.value;
                Some((errors.clone(), rising("error (mm)", robust_top(errors))))
            }
            Field::Expected => self.expected_values(),
            Field::Uncertainty => {
                let variances = &*self.session.field(FieldKind::Uncertainty)?.value;
                Some((variances.clone(), rising("variance left", 1.0)))
            }
        }
    }

    fn signal_to_noise(&self) -> Option<Vec<f64>> {
        let noise = self.project().uncertainty().of_channel();
        let simulation = self.session.results.simulation.as_ref();
        let simulation = simulation.filter(|_| noise > 0.0)?;
        let sites = simulation.value.simulated.dataset.sites.iter();
        let rms: Vec<f64> = sites.map(|s| s.rms_strain / noise).collect();
        Some(self.session.carried_from_sites(&rms))
    }

    fn expected_values(&self) -> Option<(Vec<f64>, Legend)> {
        let vertices = self.session.document.part.positions().len();
        let answer = self.view.expected(self.session)?;
        let values = answer.expected.map_mm.clone();
        let [lightest, hardest] = self.session.in_hand()?.forces_n;
        let title = format!("expected error (mm), {lightest}–{hardest} N");
        (values.len() == vertices).then(|| (values, rising(&title, answer.top_mm)))
    }

    /// What the gauges are blind to, a vertex of the part, where that is marked.
    fn blind_shown(&self) -> Option<&[f64]> {
        let answer = self.view.expected(self.session);
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
        let often = mask(Layer::Often);
        let supports = self.project().supports(&self.session.document.state.masks);
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
            // Where they come often in full; where they come at all half as strong beside that.
            let touched = match often {
                Some(_) => set(often, v).max(set(touch, v) / 2),
                None => set(touch, v),
            };
            shown.region = [feasible, touched, u8::from(held) * 255, set(out, v)];
        }
    }

    /// The sides of a solid, or how thick its walls are (mm), a vertex of the part.
    fn wall_values(&self, sides: bool) -> Option<Vec<f64>> {
        // Until it is measured anew what was known of this part stays.
        let advice = &self.session.caches.walls.as_ref()?.value;
        let faces = advice.faces.as_ref()?;
        if faces.sides.len() != self.session.document.part.positions().len() {
            return None;
        }
        let of_side = |side: &WallSide| match side {
            WallSide::Outside => -1.0,
            WallSide::Rim | WallSide::Frame => 0.0,
            WallSide::Inside => 1.0,
        };
        Some(if sides {
            let mut values: Vec<f64> = faces.sides.iter().map(of_side).collect();
            // What the brush says counts at once.
            for (layer, value) in [(Layer::Inside, 1.0), (Layer::Outside, -1.0)] {
                let painted = self.session.document.layer(layer).map_or(&[][..], |m| m);
                for (shown, _) in values.iter_mut().zip(painted).filter(|(_, p)| **p) {
                    *shown = value;
                }
            }
            values
        } else {
            faces.thickness.iter().map(|t| t * 1e3).collect()
        })
    }
}
