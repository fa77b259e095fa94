//! Which panel lies where, and what is drawn over what: the one place that knows all panels.

use egui::{Context, Rect, Ui};

use super::ask::Ask;
use super::bench;
use super::dialogs::Dialogs;
use super::live::LiveForm;
use super::paint::LimbLook;
use super::palette::{self, Palette};
use super::recovery::Recovery;
use super::study::StudyView;
use super::trade::Dial;
use super::view::{Backdrop, Pane, Stage, Tab};
use super::{
    confusions, inspector, jig, jobs, kept, legend, live, measure, overlay, results, study, trade,
};

/// What is typed in panels, and what is open over them.
#[derive(Default)]
pub struct Panels {
    pub dialogs: Dialogs,
    pub palette: Option<Palette>,
    pub dial: Dial,
    pub live: LiveForm,
    pub study: StudyView,
}

impl Panels {
    /// The settings of the stage that is looked at.
    pub fn inspector(&mut self, ask: &mut Ask<'_>, ui: &mut Ui) {
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                inspector::heading(ask.view.stage, ui);
                match ask.view.stage {
                    Stage::Bench => bench::bench_form(ask, ui),
                    Stage::Live => live::live_form(ask, &mut self.live, ui),
                    _ => inspector::settings(ask, ui),
                }
            });
    }

    /// The tabs, and the one that is chosen.
    pub fn results(&mut self, ask: &mut Ask<'_>, ui: &mut Ui) {
        if !results::header(ask, ui) {
            return;
        }
        match ask.view.tab {
            Tab::Error => results::error_plots(ask, ui),
            Tab::Failures => results::failure_plots(ask, ui),
            Tab::Gauges => results::gauge_table(ask, ui),
            Tab::Confusions => confusions::confusions_tab(ask, ui),
            Tab::Compare => kept::compare_tab(ask, ui),
            Tab::Reduction => results::reduction_plot(ask, ui),
            Tab::Trade => trade::trade_tab(ask, &mut self.dial, ui),
            Tab::Study => study::study_tab(ask, &mut self.study, ui),
            Tab::Live => live::live_tab(ask, ui),
            Tab::Jobs => jobs::jobs_tab(ask, ui),
        }
    }

    /// What is open over the panels.
    pub fn over(&mut self, ctx: &Context, ask: &mut Ask<'_>, recovery: Option<&Recovery>) {
        self.dialogs.show(ctx, ask);
        if let Some(mut palette) = self.palette.take()
            && palette::show(&mut palette, ctx, ask)
        {
            self.palette = Some(palette);
        }
        if let Some(recovery) = recovery {
            recovery.show(ctx, ask);
        }
    }

    /// Whether anything is open over the panels.
    #[must_use]
    pub fn is_covered(&self) -> bool {
        self.dialogs.any() || self.palette.is_some()
    }
}

/// Draws the views, after all that happened in either: what is hovered in one shows in the other.
pub fn draw(look: LimbLook<'_>, ui: &Ui, panes: &[(Pane, Rect)]) {
    for &(pane, rect) in panes {
        match pane {
            Pane::Limb => {
                let pace = overlay::pace(look, ui);
                overlay::paint_limb(look, ui, rect, Backdrop::Window, pace);
            }
            Pane::Unrolled => overlay::paint_unrolled(look, ui, rect),
        }
        draw_over(look, ui, pane, rect);
    }
    if let Some((_, flat)) = panes.get(1) {
        let line = ui.visuals().widgets.noninteractive.bg_stroke;
        ui.painter().vline(flat.left(), flat.y_range(), line);
    }
}

fn draw_over(look: LimbLook<'_>, ui: &Ui, pane: Pane, rect: Rect) {
    let painter = &ui.painter_at(rect);
    jig::paint_jig(look, painter, pane);
    bench::paint_bench(look, painter, pane);
    kept::paint_kept(look, painter, pane);
    confusions::paint_confusions(look, painter, pane);
    overlay::paint_gauges(look, painter, pane);
    overlay::paint_touch(look, painter, pane);
    live::paint_live(look, painter, pane);
    measure::paint_measure(look, painter, pane);
    overlay::paint_brush(look, painter, pane);
    overlay::paint_outline(look, painter, pane);
    if pane == Pane::Unrolled {
        legend::paint_stretch(look, painter, rect);
    } else {
        legend::paint_legend(look, painter, rect);
        legend::paint_region_key(look, painter, rect);
        legend::paint_hint(look, painter, rect);
    }
}

/// The limb with all that belongs to it, for a picture.
pub fn picture(look: LimbLook<'_>, ui: &Ui, rect: Rect, backdrop: Backdrop) {
    overlay::paint_limb(look, ui, rect, backdrop, overlay::PicturePace::Kept);
    let painter = &ui.painter_at(rect);
    jig::paint_jig(look, painter, Pane::Limb);
    bench::paint_bench(look, painter, Pane::Limb);
    kept::paint_kept(look, painter, Pane::Limb);
    overlay::paint_gauges(look, painter, Pane::Limb);
    overlay::paint_touch(look, painter, Pane::Limb);
    live::paint_live(look, painter, Pane::Limb);
    legend::paint_legend(look, painter, rect);
}
