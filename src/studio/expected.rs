//! What is expected of the gauges as they are, in words.

use egui::Ui;

use super::Studio;
use super::tools::Gesture;
use crate::session::ExpectedOf;

impl Studio {
    /// What is expected of the gauges: as they are, or while one moves, as they just were.
    pub(super) fn expected_shown(&self) -> Option<&ExpectedOf> {
        let moved = matches!(self.view.gesture, Gesture::Gauge(..));
        self.session.expected(moved)
    }

    /// Why nothing is known of the gauges yet.
    fn nothing_expected(&self) -> &'static str {
        if self.session.simulation_holds() != Some(true) {
            "Expected error: press “Simulate”"
        } else if self
            .session
            .document
            .state
            .project
            .selection
            .sites
            .is_empty()
        {
            "Expected error: no gauges yet"
        } else if self.session.simulated_sites().is_none() {
            "A gauge lies at none of the sites that were simulated"
        } else {
            "Expected error: …"
        }
    }

    /// What is expected of the gauges, over the view.
    pub(super) fn expected_lines(&self, ui: &mut Ui) {
        let (Some(answer), Some(in_hand)) = (self.expected_shown(), self.session.in_hand()) else {
            ui.weak(self.nothing_expected());
            return;
        };
        let expected = &answer.expected;
        let [lightest, hardest] = in_hand.forces_n;
        ui.label(format!(
            "Expected error: {:.2} mm, {lightest}–{hardest} N",
            expected.error_mm
        ))
        .on_hover_text(
            "Of model matching, over where touches come, how hard they are and what is off",
        );
        let sighted = expected.sighted_mm.filter(|_| expected.blind > 0.0);
        let without = sighted.map_or(String::new(), |mm| format!(", {mm:.2} mm without"));
        ui.label(format!(
            "{:.0} % blind at {} N{without}",
            100.0 * expected.blind,
            in_hand.force_n
        ))
        .on_hover_text(
            "Share of the touches that move no gauge by more than three deviations of its noise",
        );
    }
}
