//! What is expected of the gauges as they are, in words.

use egui::Ui;

use super::super::ask::Ask;

/// Why nothing is known of the gauges yet.
fn nothing_expected(ask: &Ask<'_>) -> &'static str {
    if ask.session.simulation_holds() != Some(true) {
        "Expected error: press “Simulate”"
    } else if ask.project().selection.sites.is_empty() {
        "Expected error: no gauges yet"
    } else if ask.session.simulated_sites().is_none() {
        "A gauge lies at none of the sites that were simulated"
    } else {
        "Expected error: …"
    }
}

/// What is expected of the gauges, over the view.
pub fn expected_lines(ask: &Ask<'_>, ui: &mut Ui) {
    let (Some(answer), Some(in_hand)) = (ask.view.expected(ask.session), ask.session.in_hand())
    else {
        ui.weak(nothing_expected(ask));
        return;
    };
    let found = &answer.expected;
    let [lightest, hardest] = in_hand.forces_n;
    ui.label(format!(
        "Expected error: {:.2} mm, {lightest}–{hardest} N",
        found.error_mm
    ))
    .on_hover_text("Of model matching, over where touches come, how hard they are and what is off");
    let sighted = found.sighted_mm.filter(|_| found.blind > 0.0);
    let without = sighted.map_or(String::new(), |mm| format!(", {mm:.2} mm without"));
    ui.label(format!(
        "{:.0} % blind at {} N{without}",
        100.0 * found.blind,
        in_hand.force_n
    ))
    .on_hover_text(
        "Share of the touches that move no gauge by more than three deviations of its noise",
    );
}
