//! The connection is looked after: settings, trained estimators and known touches follow what is heard.

use std::sync::Arc;

use crate::design::Sensing;
use crate::job::Reporter;
use crate::link::ListenerCommand;
use crate::live::ShownEstimator;
use crate::session::jobs::{Task, stop};
use crate::session::live::training::{train, training_touches};
use crate::session::slot::{Slot, current};
use crate::session::state::Session;

impl Session {
    /// Looks after the connection.
    pub(in crate::session) fn refresh_live(&mut self) {
        let (messages, news, ended) = match self.live.feed.lock() {
            Ok(mut feed) => (
                std::mem::take(&mut feed.messages),
                std::mem::take(&mut feed.news),
                feed.ended.take(),
            ),
            Err(_) => return,
        };
        for message in messages {
            self.tell(format!("Board: {message}"));
        }
        for news in news {
            self.news.report(news);
        }
        match ended {
            // A recording that is over stays as it was at its end.
            Some(Ok(())) => self.live.connection = None,
            Some(Err(message)) => {
                self.disconnect();
                self.complain(message);
            }
            None => {}
        }
        if !self.live.is_connected() {
            return;
        }
        self.doubt_learned();
        // What was learned on other gauges, or closed, shows nothing.
        if self.desk.estimator == ShownEstimator::Learned && !self.learns_alone() {
            self.show_estimator(ShownEstimator::Matching);
        }
        self.apply_settings();
        self.keep_trained();
        self.gather_known();
    }

    /// What was learned with another board is not believed of this one.
    fn doubt_learned(&mut self) {
        let hello = self.live.look(|f| f.hello.as_ref().map(|h| h.board));
        let (Some(learnt), Some(board)) = (&self.live.learnt, hello.flatten()) else {
            return;
        };
        if let Err(why) = learnt.file.check_board(&format!("{board:08x}")) {
            self.close_estimator();
            self.complain(why);
        }
    }

    /// Settings that were changed, or brought back by undo, reach the pipeline.
    fn apply_settings(&mut self) {
        let live = &self.document.state.project.live;
        if self.live.applied.as_ref() == Some(live) {
            return;
        }
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        self.live.applied = Some(live.clone());
        let (model, settings) = self.gauge_model(&sensing);
        let learned = self.learned_alone();
        self.live
            .send(ListenerCommand::Do(Box::new(move |pipeline| {
                pipeline.set_model(model, settings);
                pipeline.set_learned(learned);
            })));
    }

    /// The trained estimators are trained when they are wanted, and again when gauges fail or recover.
    fn keep_trained(&mut self) {
        let trained = [ShownEstimator::Normalized, ShownEstimator::Raw];
        if !self.desk.compare && !trained.contains(&self.desk.estimator) {
            return;
        }
        let used = self.live.look(|f| f.used.clone()).unwrap_or_default();
        let inputs = self.document.sensing_inputs();
        let trained = current(self.live.trained.as_ref(), &inputs);
        let done = trained.is_some_and(|(u, _)| *u == used);
        let begun = self.live.training_for.as_ref() == Some(&used) && self.jobs.runs(Task::Train);
        if used.iter().filter(|u| **u).count() < 3 || done || begun {
            return;
        }
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        self.live.training_for = Some(used.clone());
        self.start_training(sensing, used);
    }

    fn start_training(&mut self, sensing: Arc<Sensing>, used: Vec<bool>) {
        let inputs = self.document.inputs();
        let noise = self.live.look(|f| f.noise.first().copied()).flatten();
        let noise = noise.unwrap_or(1e-6);
        let count = training_touches(self.quality());
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let trained = train((&sensing, &inputs), &used, noise, count, &watch);
            Ok((used, trained.map_err(|e| stop(&e))?))
        };
        self.start_sensing(Task::Train, work, |s, inputs, (used, trained)| {
            s.live.trained = Some(Slot {
                inputs,
                value: (used.clone(), trained.clone()),
            });
            s.live.send(ListenerCommand::Do(Box::new(move |p| {
                p.set_trained(trained, used);
            })));
        });
    }
}
