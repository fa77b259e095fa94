//! Colours and spacing. The limb is the brightest thing on the screen; the controls stay quiet.

use egui::{Color32, Context, Theme, ThemePreference, Visuals};

use super::view::Backdrop;

/// Chosen gauges.
pub const CHOSEN: Color32 = Color32::from_rgb(230, 110, 30);
/// The applied touch.
pub const TOUCHED: Color32 = Color32::from_rgb(70, 170, 255);
/// Results of settings that have changed since.
pub const STALE: Color32 = Color32::from_rgb(225, 180, 80);
/// What went wrong, or is not to be trusted.
pub const ERROR: Color32 = Color32::from_rgb(235, 110, 95);

/// Behind the limb.
#[must_use]
pub fn backdrop(backdrop: Backdrop, theme: Theme) -> Color32 {
    match (backdrop, theme) {
        (Backdrop::Transparent, _) => Color32::TRANSPARENT,
        (Backdrop::Neutral, _) => Color32::from_rgb(206, 211, 217),
        (Backdrop::Dark, _) | (_, Theme::Dark) => Color32::from_rgb(24, 27, 32),
        (_, Theme::Light) => Color32::from_rgb(226, 230, 235),
    }
}

/// Gives a context these colours and spacings.
pub fn apply(ctx: &Context) {
    ctx.set_theme(ThemePreference::System);
    let mut dark = Visuals::dark();
    dark.panel_fill = Color32::from_rgb(32, 35, 41);
    dark.window_fill = Color32::from_rgb(38, 42, 49);
    dark.extreme_bg_color = Color32::from_rgb(22, 24, 29);
    dark.widgets.noninteractive.fg_stroke.color = Color32::from_gray(196);
    dark.widgets.inactive.weak_bg_fill = Color32::from_rgb(52, 57, 66);
    dark.selection.bg_fill = Color32::from_rgb(38, 92, 140);
    ctx.set_visuals_of(Theme::Dark, dark);
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(8.0, 6.0);
        style.spacing.button_padding = egui::vec2(8.0, 4.0);
    });
}

/// Colours of kept selections, apart from each other for colour-blind eyes and from the selectors' own
/// (M. Okabe and K. Ito, 2008; P. Tol, 2021).
const KEPT: [Color32; 6] = [
    Color32::from_rgb(240, 228, 66),
    Color32::from_rgb(170, 68, 153),
    Color32::from_rgb(136, 204, 238),
    Color32::from_rgb(153, 153, 51),
    Color32::from_rgb(204, 102, 119),
    Color32::from_rgb(187, 187, 187),
];

/// The colour of a kept selection, by its number.
#[must_use]
pub fn kept_colour(k: usize) -> Color32 {
    KEPT[k % KEPT.len()]
}

/// A plot that stays as it is: nobody drags it, or comes nearer.
pub fn still(plot: egui_plot::Plot<'_>) -> egui_plot::Plot<'_> {
    plot.allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
}
