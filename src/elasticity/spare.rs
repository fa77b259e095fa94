//! What is large to make, kept for whoever needs one next: jobs are split into more parts than there are threads.

use std::sync::{Mutex, PoisonError};

/// Things that nobody uses at the moment.
pub(super) struct Spare<T>(Mutex<Vec<T>>);

impl<T> Default for Spare<T> {
    fn default() -> Self {
        Self(Mutex::new(Vec::new()))
    }
}

impl<T> Spare<T> {
    /// Works with one of them, or with a new one.
    pub fn with<R>(&self, make: impl FnOnce() -> T, work: impl FnOnce(&mut T) -> R) -> R {
        let spare = self.items(Vec::pop);
        let mut item = spare.unwrap_or_else(make);
        let result = work(&mut item);
        self.items(|items| items.push(item));
        result
    }

    fn items<R>(&self, with: impl FnOnce(&mut Vec<T>) -> R) -> R {
        with(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_made_for_each_at_a_time() {
        let (spare, mut made) = (Spare::default(), 0);
        for _ in 0..3 {
            spare.with(
                || {
                    made += 1;
                    made
                },
                |item| assert_eq!(*item, 1),
            );
        }
        let two = spare.with(|| 1, |one| spare.with(|| 2, |two| (*one, *two)));
        assert_eq!(two, (1, 2));
    }
}
