//! Shell or solid: what was measured of the part, as colours and in words.

use egui::Ui;

use super::Studio;
use crate::document::Layer;
use crate::mesh::walls::Side;

impl Studio {
    /// The sides of a solid, or how thick its walls are (mm), a vertex of the part.
    pub(super) fn wall_values(&mut self, sides: bool) -> Option<Vec<f64>> {
        if self.session.advice().is_none() && !self.view.is_stroking() {
            self.session.measure_walls();
        }
        // Until it is measured anew what was known of this part stays.
        let advice = &self.session.caches.walls.as_ref()?.value;
        let faces = advice.faces.as_ref()?;
        if faces.sides.len() != self.session.document.part.positions().len() {
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

    /// What was found, in words.
    pub(super) fn advice_lines(&self, ui: &mut Ui) {
        let Some(advice) = self.session.advice() else {
            return;
        };
        for line in &advice.words {
            ui.add(egui::Label::new(line).wrap());
        }
    }
}
