//! Shell or solid: what was measured of the part, kept while it holds.

use std::sync::Arc;

use egui::{Context, Ui};

use super::Studio;
use super::drive::Finished;
use super::jobs::Task;
use crate::design::{self, Advice};
use crate::document::Layer;
use crate::mesh::walls::Side;

impl Studio {
    /// What was measured of the part as it is, if it was.
    #[must_use]
    pub fn advice(&self) -> Option<&Advice> {
        self.current_advice().map(|a| &**a)
    }

    /// What is known of the part as it is.
    pub(super) fn current_advice(&self) -> Option<&Arc<Advice>> {
        let (key, advice) = self.advice.as_ref()?;
        (*key == self.document.walls_key()).then_some(advice)
    }

    /// Measures the walls in the background, unless that is under way.
    pub(super) fn start_advising(&mut self, ctx: &Context) {
        let key = self.document.walls_key();
        let under_way =
            (self.jobs.running.iter()).any(|r| r.task == Task::Advise && r.job.key == key);
        if under_way {
            return;
        }
        let inputs = self.document.inputs();
        self.jobs.start(ctx, Task::Advise, key, move |reporter| {
            let watch = |progress| reporter.report(progress);
            let advice = design::advise(&inputs, &watch).map_err(|e| super::drive::stop(&e))?;
            Ok(Finished::Advised(Arc::new(advice)))
        });
    }

    /// The sides of a solid, or how thick its walls are (mm), a vertex of the part.
    pub(super) fn wall_values(&mut self, ctx: &Context, sides: bool) -> Option<Vec<f64>> {
        if self.current_advice().is_none() && !self.view.is_stroking() {
            self.start_advising(ctx);
        }
        // Until it is measured anew what was known of this part stays.
        let (_, advice) = self.advice.as_ref()?;
        let faces = advice.faces.as_ref()?;
        if faces.sides.len() != self.document.part.positions().len() {
            return None;
        }
        let of_side = |side: &Side| match side {
            Side::Outside => -1.0,
            Side::Rim | Side::Frame => 0.0,
            Side::Inside => 1.0,
        };
        Some(if sides {
            let mut values: Vec<f64> = faces.sides.iter().map(of_side).collect();
            // What the brush says counts at once.
            for (layer, value) in [(Layer::Inside, 1.0), (Layer::Outside, -1.0)] {
                let painted = self.document.layer(layer).map_or(&[][..], |m| m);
                for (shown, _) in values.iter_mut().zip(painted).filter(|(_, p)| **p) {
                    *shown = value;
                }
            }
            values
        } else {
            faces.thickness.iter().map(|t| t * 1e3).collect()
        })
    }

    /// What was found, in words.
    pub(super) fn advice_lines(&self, ui: &mut Ui) {
        let Some(advice) = self.current_advice() else {
            return;
        };
        for line in &advice.words {
            ui.add(egui::Label::new(line).wrap());
        }
    }
}
