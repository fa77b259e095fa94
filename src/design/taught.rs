//! Matching as presses have taught it: what is known of the model, of how its gauges are glued, and of what is left.
//!
//! A regression knows nothing of the part, and needs thousands of presses to learn what a model knows beforehand; a model
//! never becomes better than it is. Here the presses calibrate the gauges (`inference::calibration`), and what is still left
//! is learned as a remainder of the map (`inference::remainder`): a few presses help at once, and thousands end where the
//! map is what was measured.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Sensing;
use crate::budget::{Cancelled, Watch};
use crate::dataset::SignalMatrix;
use crate::inference::calibration::{calibrate, noise_of_mean};
use crate::inference::remainder::{self, Remainder};
use crate::inference::{Deviations, KnownPress, Matching, Nuisances, ReadingErrors, ResponseMap};
use crate::learning::{ByModel, Estimate, MeasuredTouches};
use crate::live::{GaugeModel, PipelineSettings};
use crate::project::Project;
use crate::regression::folds::evenly;
use crate::uncertainty::{Gluing, HandPressing, Uncertainty};
use crate::units;

/// Readings that gauges are calibrated by, at most: what more of them say is learned as a remainder.
const CALIBRATED_BY: usize = 600;
/// Touches farther from the part than this (m, median) are of another part, or in another unit.
const BESIDE: f64 = 3e-3;
/// Readings more often as large as the model's, or as small, are in another unit.
const UNLIKE: f64 = 5.0;

/// No reading is taken to be better than this (strain), as in matching.
const LEAST_NOISE: f64 = 1e-9;

/// Matching by a map that presses have taught.
#[derive(Clone)]
pub struct Taught {
    /// What a newton reads anywhere.
    pub map: Arc<ResponseMap>,
    /// How far each of these may be off by itself.
    pub own: Arc<ResponseMap>,
    /// What touches may have about them; see [`Nuisances`].
    pub tip: Option<Arc<ResponseMap>>,
    /// See [`Nuisances`].
    pub axes: Option<Arc<[ResponseMap; 3]>>,
    /// What else is known of the readings.
    pub known: TaughtKnowledge,
    /// Errors over the radius, of touches that nothing was learned from.
    pub ratios: Vec<f64>,
}

/// What is known of readings beside the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaughtKnowledge {
    /// Standard deviation of the noise of a reading that was learned from (strain).
    pub noise: f64,
    /// What the map leaves, over the reading; see [`ReadingErrors::relative`].
    pub relative: f64,
    /// Nobody presses harder (N).
    pub most_force: f64,
    /// How far the tip's radius may be off (m), how far touches push aside (over their force), how far all channels drift
    /// together (strain), and how far forces are off in all.
    pub tip: f64,
    /// See [`Self::tip`].
    pub friction: f64,
    /// See [`Self::tip`].
    pub drift: f64,
    /// See [`Self::tip`].
    pub stiffness: f64,
    /// What was learned beside the gluing.
    pub remainder: Option<remainder::RemainderSettings>,
}

/// Why presses teach a model nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TeachingError {
    /// Nobody knows how hard the presses were.
    #[error("matching learns from presses of known force, and the data have no force_n")]
    NoForces,
    /// Another number of channels.
    #[error(
        "the data have {data} channels, and the project has {project} gauges: they are of another limb"
    )]
    Channels {
        /// Of the data.
        data: usize,
        /// Of the project.
        project: usize,
    },
    /// The presses lie elsewhere.
    #[error(
        "the touches lie {:.0} mm from the project's part (median): p_m must be metres, in the frame of its mesh",
        units::mm(*apart)
    )]
    Elsewhere {
        /// How far (m).
        apart: f64,
    },
    /// The readings are in another unit.
    #[error(
        "readings are {times:.1e} times what the model says of such presses: X must be strain (not microstrain, and no counts)"
    )]
    Unlike {
        /// Readings over the model's.
        times: f64,
    },
    /// The caller asked for a stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Presses on the part, as far as they can be learned from.
pub struct PressLessons<'a> {
    sensing: &'a Sensing,
    project: &'a Project,
    off: Uncertainty,
    noise: Vec<f64>,
    known: Vec<KnownPress>,
}

impl<'a> PressLessons<'a> {
    /// Of lessons whose readings are strains, made as exactly as `pressing` says. None at all teach what is known beforehand.
    ///
    /// # Errors
    /// [`TeachingError`] for what is no press on this part.
    pub fn new(
        sensing: &'a Sensing,
        project: &'a Project,
        lessons: &MeasuredTouches,
        pressing: HandPressing,
    ) -> Result<Self, TeachingError> {
        let none = lessons.places_mm.is_empty();
        if lessons.forces.len() != lessons.places_mm.len() {
            return Err(TeachingError::NoForces);
        }
        let (data, gauges) = (lessons.x.rows(), sensing.gauges.len());
        if data != gauges && !none {
            return Err(TeachingError::Channels {
                data,
                project: gauges,
            });
        }
        let mesh = &sensing.drawn.map.mesh;
        let mut away = Vec::with_capacity(lessons.places_mm.len());
        let known = (lessons.places_mm.iter().zip(lessons.forces).enumerate())
            .map(|(t, (place, &force))| {
                let (at, distance) = mesh
                    .index()
                    .nearest(units::from_mm(DVec3::from_array(*place)));
                away.push(distance);
                KnownPress {
                    at,
                    force,
                    reading: (0..data).map(|c| lessons.x.row(c)[t]).collect(),
                }
            })
            .collect();
        let presses = Self {
            off: Uncertainty {
                elements: sensing.off.elements,
                pressing,
                ..project.uncertainty()
            },
            noise: vec![sensing.off.of_channel(); gauges],
            sensing,
            project,
            known,
        };
        let median = crate::statistics::median(away).unwrap_or(0.0);
        if median > BESIDE {
            return Err(TeachingError::Elsewhere { apart: median });
        }
        if !none {
            presses.check_unit()?;
        }
        Ok(presses)
    }

    /// That readings are as large as the model's.
    fn check_unit(&self) -> Result<(), TeachingError> {
        let (mut read, mut said) = (0.0, f64::MIN_POSITIVE);
        for press in &self.known {
            let model = self.sensing.drawn.map.at(press.at);
            for (x, g) in press.reading.iter().zip(model) {
                read += x * x;
                said += (press.force * g).powi(2);
            }
        }
        let times = f64::sqrt(read / said);
        if (UNLIKE.recip()..UNLIKE).contains(&times) {
            Ok(())
        } else {
            Err(TeachingError::Unlike { times })
        }
    }

    /// Matching as some of the presses teach it, which come in an order that means nothing.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn teach(&self, some: &[usize], way: ByModel, watch: Watch) -> Result<Taught, Cancelled> {
        let pushes = |t: &&usize| self.known[**t].force > 0.0;
        let known: Vec<KnownPress> = (some.iter().filter(pushes))
            .map(|&t| self.known[t].clone())
            .collect();
        let few: Vec<KnownPress> = (evenly(known.len(), CALIBRATED_BY).into_iter())
            .map(|k| known[k].clone())
            .collect();
        let drawn = &self.sensing.drawn;
        let calibration = calibrate(drawn, &few, &self.noise, &self.off);
        let off = self.off_of_touches();
        let map = drawn.calibrated(&calibration);
        let own = drawn.deviations_of(&calibration.doubts, &off).own;
        let noise = noise_of_mean(&self.noise);
        let learned = match way {
            ByModel::Matching => None,
            ByModel::MatchingRemainder => Remainder::learn(&map, &known, &noise, watch)?,
        };
        let remainder = learned.as_ref().map(|r| r.settings);
        let [map, own] = match &learned {
            Some(remainder) => remainder.add_to(&map, &own, watch)?.map(Arc::new),
            None => [Arc::new(map), own],
        };
        let making = off.making_allowed();
        let Nuisances { tip, axes, .. } = drawn.nuisances(making);
        Ok(Taught {
            map,
            own,
            tip,
            axes,
            known: TaughtKnowledge {
                noise: noise.first().copied().unwrap_or(0.0).max(LEAST_NOISE),
                relative: remainder.map_or(calibration.relative, |r| r.scatter),
                most_force: self.project.live.largest_force_n,
                tip: making.tip,
                friction: making.friction,
                drift: off.drift,
                stiffness: off.stiffness,
                remainder,
            },
            ratios: Vec::new(),
        })
    }

    /// What is off with touches, whoever makes them later.
    fn off_of_touches(&self) -> Uncertainty {
        let live = &self.project.live;
        Uncertainty {
            stiffness: live.stiffness_percent / 100.0,
            allowed: live.friction_percent / 100.0,
            ..self.sensing.off
        }
    }
}

impl Taught {
    /// How many channels a reading has.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.map.channels()
    }

    /// As live touch takes it.
    #[must_use]
    pub fn model(&self) -> GaugeModel {
        let off = self.off();
        let nuisances = Nuisances::new(off.making_allowed(), self.tip.clone(), self.axes.clone());
        GaugeModel {
            map: Arc::clone(&self.map),
            deviations: Some(Deviations::new(Arc::clone(&self.own), nuisances)),
            off,
        }
    }

    /// A project's settings of live touch, with what was learned in place of what the project knows.
    #[must_use]
    pub fn settings(&self, of: PipelineSettings) -> PipelineSettings {
        PipelineSettings {
            relative: self.known.relative,
            most_force: self.known.most_force,
            ..of
        }
    }

    fn off(&self) -> Uncertainty {
        Uncertainty {
            gluing: Gluing::EXACT,
            making: crate::uncertainty::Making {
                tip: self.known.tip,
                friction: self.known.friction,
            },
            drift: self.known.drift,
            stiffness: self.known.stiffness,
            ..Uncertainty::NONE
        }
    }

    /// What readings (channels × touches, strain) say, touch by touch.
    #[must_use]
    pub fn find(&self, x: &SignalMatrix) -> Vec<Estimate> {
        use rayon::prelude::*;
        let model = self.model();
        let channels = self.channels();
        let errors = ReadingErrors {
            relative: self.known.relative,
            noise: vec![self.known.noise; channels],
            ..ReadingErrors::known(&model.off, channels, model.deviations)
        };
        let matching = Matching::new(model.map, errors, self.known.most_force);
        (0..x.columns())
            .into_par_iter()
            .map_init(
                || matching.clone(),
                |matching, t| {
                    let reading: Vec<f64> = (0..channels).map(|c| x.row(c)[t]).collect();
                    let contact = matching.find(&reading);
                    Estimate {
                        place_mm: units::mm(contact.position).to_array(),
                        radius_mm: units::mm(contact.region.radius),
                        force_n: Some(contact.force),
                    }
                },
            )
            .collect()
    }
}
