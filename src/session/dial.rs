//! The dial: the project set to what was measured to be quick or accurate enough.

use super::state::Session;
use crate::trade::{TradeConstraint, TradePoint, TradeSetting, answer, front};

impl Session {
    /// Sets the project to a measured setting; what is kept computed follows.
    pub fn apply_setting(&mut self, setting: &TradeSetting) {
        setting.apply(&mut self.document.state.project);
        self.document.settle();
    }

    /// Turns the dial: the setting of the front that keeps the promise, at once.
    pub fn ask_for(&mut self, asked: TradeConstraint) {
        let points = self.measured_points();
        match self.answer_to(asked, &points) {
            Ok((setting, said)) => {
                self.tell(said);
                self.apply_setting(&setting);
                self.select();
            }
            Err(why_not) => self.complain(why_not),
        }
    }

    fn answer_to(
        &self,
        asked: TradeConstraint,
        points: &[TradePoint],
    ) -> Result<(TradeSetting, String), String> {
        if points.is_empty() {
            return Err(
                "Nothing is measured of this project yet. Press “Measure the trade” first".into(),
            );
        }
        let best = front(&self.document.state.project, points);
        let clock = self.trade_clock();
        if let Some((point, m)) = answer(&best, asked, clock).and_then(|p| Some((p, p.measured()?)))
        {
            let said = format!(
                "Set to {:.2} mm in about {:.1} s: {}",
                m.error_mm,
                m.cpu_seconds * clock,
                point.setting.in_words()
            );
            return Ok((point.setting, said));
        }
        let quickest = best.first().and_then(|p| p.measured());
        Err(quickest.map_or_else(
            || "No setting that was measured could be computed. Measure more of them".to_owned(),
            |m| {
                format!(
                    "No measured setting answers as quickly: the quickest took {:.1} s. Ask for more time, or measure more settings",
                    m.cpu_seconds * clock
                )
            },
        ))
    }
}
