//! What touches in a sample: followed where it goes on, and looked for where it does not.

use super::{DOUBTFUL, Pipeline, SEARCH_EVERY, SEARCH_EVERY_S};
use crate::inference::{Contact, SeveralTouches};

impl Pipeline {
    /// The touches, and whether they explain the sample; nothing where the reading is rather of something that lets go.
    pub(super) fn find(&mut self, time_us: u64, strain: &[f64]) -> (Option<SeveralTouches>, bool) {
        let several = self.counting.track(&self.matching, time_us, strain);
        if let Some((touches, explained)) = several {
            let left = if explained {
                touches.unexplained
            } else {
                f64::INFINITY
            };
            // What is hardly felt any more is followed as long as it is.
            if !self.feeling.clearly() || !self.counting.is_due(time_us, left) {
                self.last = None;
                return (Some(touches), self.counting.is_settled(left));
            }
        }
        let one = self.find_one(time_us, strain);
        if one.is_some() || self.feeling.clearly() {
            self.last = one;
        }
        let Some(one) = one else {
            return (None, false);
        };
        (self.counting).see_one(&self.matching, time_us, strain, &one);
        let several = self.counting.shown().is_some();
        if several || self.counting.is_due(time_us, one.unexplained) {
            (self.counting).look(&mut self.matching, time_us, strain, &one);
        }
        if let Some(shown) = self.counting.shown() {
            self.last = None;
            let settled = self.counting.is_settled(shown.unexplained);
            return (Some(shown.clone()), settled && !shown.contacts.is_empty());
        }
        let clear = one.unexplained < DOUBTFUL * one.strength;
        let settled = clear && self.counting.is_settled(one.unexplained);
        (clear.then(|| self.counting.one(one)), settled)
    }

    /// The touch, if there is one.
    fn find_one(&mut self, time_us: u64, strain: &[f64]) -> Option<Contact> {
        let often = f64::from(SEARCH_EVERY).max(SEARCH_EVERY_S * self.rate);
        let recently = self.searched > 0 && f64::from(self.searched) < often;
        let clearly = self.feeling.clearly();
        let last = self.last.filter(|_| recently || !clearly);
        let known = last.and_then(|last| {
            if last.narrow {
                self.matching.track(strain, &last)
            } else {
                let (reading, found) = self.search.as_ref()?;
                self.matching.hold(strain, reading, found)
            }
        });
        if let Some(contact) = known {
            self.searched += 1;
            return Some(contact);
        }
        if !clearly {
            // A touch that goes is followed, and not looked for: a little above the noise fits a large force where hardly
            // anything is felt.
            return None;
        }
        self.searched = 1;
        let found = self.matching.find(strain);
        let at = (time_us, strain);
        let several = &self.counting.several;
        if (self.release).is_seen(&mut self.matching, several, at, &found, self.proved) {
            return None;
        }
        self.search = Some((strain.to_vec(), found));
        Some(found)
    }
}
