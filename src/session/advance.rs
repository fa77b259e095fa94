//! A session goes on: what jobs and workers have brought is taken in, and what is next is started.

use super::attention::Attention;
use super::state::Session;
use crate::job::Outcome;

impl Session {
    /// Takes in what jobs and workers have brought, and starts what is next.
    pub fn advance(&mut self, attention: &Attention) {
        self.collect_jobs();
        self.save_waiting();
        self.collect_touches();
        self.go_on(attention);
        if !attention.hand {
            self.refresh_feasibility();
        }
        self.refresh_by_hand(attention);
        self.refresh_expected(attention);
        self.refresh_confusions(attention);
        self.refresh_field(attention);
        self.refresh_walls(attention);
        self.refresh_jig(attention);
        self.refresh_live();
        if !attention.hand {
            self.refresh_trade();
        }
    }

    /// What jobs have brought is done with as they were told when they were started.
    fn collect_jobs(&mut self) {
        for ended in self.jobs.collect() {
            self.wake.now();
            // What was read or computed of a project that is closed is nobody's; what was written is there.
            if ended.session != self.jobs.session() && !ended.task.writes() {
                continue;
            }
            match ended.result {
                Outcome::Done(finish) => finish(self),
                Outcome::Failed(message) => {
                    self.complain(format!("{}: {message}", ended.task.name()));
                    self.jobs.fail(ended.task, ended.inputs, message);
                }
                Outcome::Cancelled => {}
            }
        }
    }

    /// Takes the last change back.
    pub fn undo(&mut self) {
        self.document.undo();
        self.drive.take = self.as_designed();
    }

    /// Makes the change again.
    pub fn redo(&mut self) {
        self.document.redo();
        self.drive.take = self.as_designed();
    }
}
