//! Samples go through the pipeline, and what comes out is told.

use std::time::Instant;

use super::listener::{ConnectionState, Listener, SessionEvent};
use crate::live::{Sample, Unusable};

impl Listener {
    /// Says where a gauge is on a channel that does not come, whether a board has told how many there are or its
    /// lines show it; each number of channels once.
    pub(super) fn compare_channels(
        &mut self,
        channels: usize,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        if self.compared.replace(channels) == Some(channels) {
            return;
        }
        let mut gauges = self.pipeline.settings.channels.iter().enumerate();
        if let Some((gauge, channel)) = gauges.find(|(_, c)| **c >= channels) {
            let many = if channels == 1 { "" } else { "s" };
            tell(SessionEvent::Message(&format!(
                "gauge {} is on channel {channel}, but this board has only {channels} channel{many} (from 0): nothing can be told of a touch. Correct “Channels of the gauges”, or channels in the project's table [live]",
                gauge + 1
            )));
            return;
        }
        let read = self.pipeline.settings.channels.iter().max();
        let read = read.map_or(0, |highest| highest + 1);
        // Frames name their channels; of lines, nobody knows what a comma is.
        if self.receiver.speaks_lines() && channels > read {
            let gauges = self.pipeline.settings.channels.len();
            tell(SessionEvent::Message(&format!(
                "the board prints {channels} numbers in a line, and {} only the first {read}. {}",
                if gauges == 1 {
                    "the gauge takes".to_owned()
                } else {
                    format!("the {gauges} gauges take")
                },
                if channels >= 2 * read.max(1) {
                    "If its numbers have decimal commas, each is taken for two: print decimal points, or whole numbers"
                } else {
                    "If a clock or another number stands before them, set “Channels of the gauges”, or channels in the project's table [live]"
                }
            )));
        }
    }

    /// Says once that the commas of plain lines may be decimal ones.
    fn doubt_commas(&mut self, tell: &mut impl FnMut(SessionEvent)) {
        let doubt = Unusable::Fractions;
        if !self.receiver.may_have_decimal_commas() || self.explained.contains(&doubt) {
            return;
        }
        self.explained.push(doubt);
        if let Some(words) = doubt.in_words() {
            tell(SessionEvent::Message(&words));
        }
    }

    pub(super) fn measure(
        &mut self,
        sample: &Sample,
        arrived: Instant,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        self.measured += 1;
        if self.state != ConnectionState::Live {
            self.enter(ConnectionState::Live, tell);
        }
        if self.pipeline.rest().is_none() && !self.pipeline.is_taring() {
            self.pipeline.tare();
            self.record(|r| r.own("tare"));
        }
        self.compare_channels(sample.counts.len(), tell);
        self.doubt_commas(tell);
        let update = self.pipeline.push(sample);
        for news in self.pipeline.news() {
            tell(SessionEvent::News(*news));
        }
        // What nobody touches is soon computed, and would hide the rest.
        if update.contact.is_some() {
            self.timing.push(arrived.elapsed().as_secs_f32() * 1e6);
        }
        let truths = self.truths.as_ref().and_then(|t| t.lock().ok());
        let truth = truths.and_then(|mut truths| truths.at(sample.time_us));
        if let Some(touch) = truth.map(|truth| truth.place()) {
            self.record(|r| r.truth(touch));
            tell(SessionEvent::Truth(touch));
        }
        self.record_clock(sample.time_us);
        self.record(|r| r.sample(sample));
        tell(SessionEvent::Sample {
            sample,
            update: &update,
            pipeline: &self.pipeline,
        });
        // Not when it arrived: one that is slow to compute is not silent.
        self.last_arrival = Instant::now();
    }
}
