//! What is chosen in the tab, and the pictures that are kept of it.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{Color32, Ui};

use super::limb::Thumbnail;
use super::raster::{Raster, RasterKey};
use crate::session::OpenStudy;

/// Designs that are in range, those that no other beats, and the others.
pub const KEPT: Color32 = Color32::from_rgb(86, 180, 233);
pub const FRONT: Color32 = Color32::from_rgb(230, 159, 0);
pub const REST: Color32 = Color32::from_rgb(125, 133, 143);
/// What is chosen in the tab.
#[derive(Default)]
pub struct StudyView {
    pub folder: String,
    /// Columns of the scatter plot.
    pub across: [usize; 2],
    /// Columns of the lines.
    pub shown: Vec<usize>,
    /// What of a column is kept, from one value to another.
    pub ranges: BTreeMap<usize, [f64; 2]>,
    /// The unit that was clicked, and the one under the pointer.
    pub picked: Option<usize>,
    pub hovered: Option<usize>,
    pub dots: Raster,
    pub lines: Raster,
    pub thumbnail: Thumbnail,
    /// The study that all of this is of.
    of: Option<Arc<OpenStudy>>,
}

impl StudyView {
    /// Begins anew where another study was opened.
    pub fn follow(&mut self, study: &Arc<OpenStudy>) {
        if self.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, study)) {
            return;
        }
        let folder = std::mem::take(&mut self.folder);
        let figures = |k: &usize| !study.columns[*k].is_axis;
        let asked = |k: &usize| study.columns[*k].is_asked;
        let all = || 0..study.columns.len();
        let minimize = &study.collected.folder.study.aim.minimize;
        let mut across = minimize.iter().filter_map(|name| study.column(name));
        let mut rest = all().filter(figures).chain(all());
        let y = across.next().or_else(|| rest.next()).unwrap_or(0);
        let x = across
            .next()
            .or_else(|| rest.find(|k| *k != y))
            .unwrap_or(y);
        *self = Self {
            folder,
            across: [x, y],
            shown: all()
                .filter(|k| study.columns[*k].is_axis || asked(k))
                .filter(|k| {
                    study.columns[*k]
                        .range
                        .is_some_and(|[low, high]| low < high)
                })
                .collect(),
            of: Some(Arc::clone(study)),
            ..Self::default()
        };
    }

    /// Whether a unit lies in all ranges.
    pub fn keeps(&self, study: &OpenStudy, unit: usize) -> bool {
        self.ranges.iter().all(|(&column, [low, high])| {
            let value = study.columns[column].values[unit];
            (*low..=*high).contains(&value)
        })
    }

    /// The unit that is looked at.
    pub fn looked_at(&self) -> Option<usize> {
        self.hovered.or(self.picked)
    }
}

/// What a picture of these columns is of.
pub fn key(view: &StudyView, size: [usize; 2], columns: &[usize], ui: &Ui) -> RasterKey {
    let ranges = view
        .ranges
        .iter()
        .map(|(k, range)| (*k, range.map(f64::to_bits)));
    (
        size,
        ranges.collect(),
        columns.to_vec(),
        ui.visuals().dark_mode,
    )
}
