//! The lower side: error against number of gauges, with failed gauges, the chosen sites, the reduction.

use egui::{RichText, Role, Ui, WidgetInfo};
use egui_plot::{Corner, HLine, Legend, Line, Plot, PlotPoints, Points};

use super::Studio;
use crate::io::artifacts::{as_chosen, range, signal_to_noise, signal_unit};
use crate::io::report::{curve, failure_curve, failure_name, failure_title};

/// What is shown below the view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Tab {
    #[default]
    Error,
    Failures,
    Sites,
    Reduction,
    Jobs,
}

impl Tab {
    const ALL: [Self; 5] = [
        Self::Error,
        Self::Failures,
        Self::Sites,
        Self::Reduction,
        Self::Jobs,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Error => "Error",
            Self::Failures => "Failures",
            Self::Sites => "Sites",
            Self::Reduction => "Reduction",
            Self::Jobs => "Jobs",
        }
    }
}

const COLOURS: [egui::Color32; 4] = [
    egui::Color32::from_rgb(86, 180, 233),
    egui::Color32::from_rgb(230, 159, 0),
    egui::Color32::from_rgb(0, 158, 115),
    egui::Color32::from_rgb(204, 121, 167),
];

impl Studio {
    pub(super) fn results(&mut self, ui: &mut Ui) {
        // A resizable panel that is not filled shrinks a little every frame.
        ui.set_min_height(ui.available_height());
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            for tab in Tab::ALL {
                ui.selectable_value(&mut self.results, tab, tab.name());
            }
            let stale = self.design_holds() == Some(false);
            if stale && !matches!(self.results, Tab::Sites | Tab::Jobs) {
                ui.colored_label(super::theme::STALE, "of settings that have changed since");
            }
        });
        ui.separator();
        if self.design.is_none() && !matches!(self.results, Tab::Sites | Tab::Jobs) {
            empty(
                ui,
                "Nothing selected yet. Press “Select gauges” to choose the sites and judge them on unseen touches",
            );
            return;
        }
        match self.results {
            Tab::Error => self.error_plots(ui),
            Tab::Failures => self.failure_plots(ui),
            Tab::Sites => self.site_table(ui),
            Tab::Reduction => self.reduction_plot(ui),
            Tab::Jobs => self.jobs_tab(ui),
        }
    }

    fn error_plots(&self, ui: &mut Ui) {
        let Some(result) = &self.design else {
            return;
        };
        let design = &result.design;
        let mut regions: Vec<&str> = Vec::new();
        for row in &design.evaluation.rows {
            if !regions.contains(&row.region.as_str()) {
                regions.push(&row.region);
            }
        }
        let height = ui.available_height() - 26.0;
        ui.columns(regions.len().max(1), |columns| {
            for (ui, region) in columns.iter_mut().zip(&regions) {
                let baseline = design
                    .evaluation
                    .rows
                    .iter()
                    .find(|r| r.selector == "all-candidates" && r.region == *region);
                ui.label(RichText::new(*region).strong());
                let plot = Plot::new(("error", region))
                    .height(height)
                    .legend(Legend::default().position(Corner::RightTop))
                    .x_axis_label("gauges")
                    .x_grid_spacer(egui_plot::uniform_grid_spacer(|_| [10.0, 5.0, 1.0]))
                    .y_axis_label("mean error (mm)")
                    .include_y(0.0)
                    .allow_scroll(false)
                    .allow_drag(false)
                    .allow_zoom(false)
                    .show(ui, |plot| {
                        for (k, selection) in design.selections.iter().enumerate() {
                            let points: Vec<[f64; 2]> = curve(design, selection.selector, region)
                                .into_iter()
                                .map(|(x, y)| [x, y])
                                .collect();
                            let title = selection.selector.title();
                            plot.line(
                                Line::new(title, PlotPoints::from(points.clone()))
                                    .color(COLOURS[k % COLOURS.len()])
                                    .width(2.0),
                            );
                            plot.points(
                                Points::new(title, points)
                                    .color(COLOURS[k % COLOURS.len()])
                                    .radius(3.0),
                            );
                        }
                        if let Some(row) = baseline {
                            plot.hline(
                                HLine::new(format!("all {} candidates", row.sensors), row.error_mm)
                                    .color(egui::Color32::GRAY),
                            );
                        }
                    });
                let label = format!("Error against number of gauges, {region}");
                plot.response
                    .widget_info(|| WidgetInfo::labeled(Role::Figure, true, &label));
            }
        });
    }

    fn failure_plots(&self, ui: &mut Ui) {
        let Some(result) = &self.design else {
            return;
        };
        let failures = &result.design.evaluation.failures;
        let height = ui.available_height() - 26.0;
        ui.columns(2, |columns| {
            for (ui, retrained) in columns.iter_mut().zip([false, true]) {
                let title = failure_title(retrained);
                ui.label(RichText::new(title).strong());
                let plot = Plot::new(("failures", retrained))
                    .height(height)
                    .legend(Legend::default().position(Corner::RightBottom))
                    .x_axis_label("failed gauges")
                    .x_grid_spacer(egui_plot::uniform_grid_spacer(|_| [10.0, 5.0, 1.0]))
                    .y_axis_label("mean error (mm)")
                    .include_y(0.0)
                    .allow_scroll(false)
                    .allow_drag(false)
                    .allow_zoom(false)
                    .show(ui, |plot| {
                        for (k, set) in failures.iter().enumerate() {
                            let points: Vec<[f64; 2]> = failure_curve(set, retrained)
                                .into_iter()
                                .map(|(x, y)| [x, y])
                                .collect();
                            let colour = COLOURS[k % COLOURS.len()];
                            let name = failure_name(set);
                            plot.line(
                                Line::new(name, PlotPoints::from(points.clone()))
                                    .color(colour)
                                    .width(2.0),
                            );
                            plot.points(Points::new(name, points).color(colour).radius(3.0));
                        }
                    });
                plot.response
                    .widget_info(|| WidgetInfo::labeled(Role::Figure, true, title));
            }
        });
    }

    fn reduction_plot(&self, ui: &mut Ui) {
        let Some(result) = &self.design else {
            return;
        };
        let candidates = &result.design.reduced.candidates;
        let points: Vec<[f64; 2]> = candidates
            .curve
            .iter()
            .map(|p| [p.sites as f64, 100.0 * p.unexplained])
            .collect();
        let plot = Plot::new("reduction")
            .height(ui.available_height() - 4.0)
            .legend(Legend::default().position(Corner::RightTop))
            .x_axis_label("sites kept")
            .y_axis_label("held-out variance unexplained (%)")
            .include_y(0.0)
            .allow_scroll(false)
            .show(ui, |plot| {
                plot.line(
                    Line::new("PCA-QR", PlotPoints::from(points.clone()))
                        .color(COLOURS[0])
                        .width(2.0),
                );
                plot.points(Points::new("PCA-QR", points).color(COLOURS[0]).radius(3.0));
                let target = 100.0 * result.inputs.project.candidates.unexplained;
                plot.hline(HLine::new("asked for", target).color(egui::Color32::GRAY));
            });
        plot.response.widget_info(|| {
            WidgetInfo::labeled(
                Role::Figure,
                true,
                "Unexplained variance against sites kept",
            )
        });
    }

    /// The project's sites; with a design also what they will report.
    fn site_table(&self, ui: &mut Ui) {
        let sites = &self.document.state.project.selection.sites;
        if sites.is_empty() {
            empty(ui, "No gauges chosen yet");
            return;
        }
        // Only where the table shows the very sites that the design chose.
        let design = self
            .design
            .as_ref()
            .filter(|d| as_chosen(&d.design.simulated.dataset.sites, d.design.chosen()) == *sites);
        egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            egui::Grid::new("sites")
                .num_columns(10)
                .striped(true)
                .spacing([18.0, 3.0])
                .show(ui, |ui| {
                    for title in ["Gauge", "x (mm)", "y (mm)", "z (mm)", "Direction"] {
                        ui.strong(title);
                    }
                    if let Some(d) = design {
                        let unit = signal_unit(d.design.simulated.dataset.signal);
                        ui.strong(format!("Signal, from – to ({unit})"));
                        ui.strong("Rms strain (µε)");
                        ui.strong("Signal to noise");
                    }
                    ui.end_row();
                    for (k, site) in sites.iter().enumerate() {
                        ui.monospace(format!("{:>3}", k + 1));
                        for x in site.position_mm {
                            ui.monospace(format!("{x:8.2}"));
                        }
                        let [x, y, z] = site.direction;
                        ui.monospace(format!("{x:+.3} {y:+.3} {z:+.3}"));
                        if let Some(d) = design {
                            let dataset = &d.design.simulated.dataset;
                            let index = d.design.chosen()[k];
                            let (low, high) = range(dataset, index);
                            let rms = dataset.sites[index].rms_strain;
                            let decimals = if signal_unit(dataset.signal) == "mm" {
                                3
                            } else {
                                0
                            };
                            ui.monospace(format!("{low:8.decimals$} – {high:8.decimals$}"));
                            ui.monospace(format!("{:7.0}", rms * 1e6));
                            ui.monospace(
                                signal_to_noise(&d.inputs, rms)
                                    .map_or("–".into(), |r| format!("{r:7.0}")),
                            );
                        }
                        ui.end_row();
                    }
                });
        });
    }
}

pub(super) fn empty(ui: &mut Ui, text: &str) {
    ui.add_space(12.0);
    ui.vertical_centered(|ui| ui.weak(text));
}
