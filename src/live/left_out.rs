//! Gauges that are left out, for whoever looks on: each illness is told once it lasts, and so is that it is over.

use super::health::Health;
use super::news::LiveNews;

/// Seconds of an illness that are worth a word, and of health after it. A touch that is too hard for a moment is none.
const ILL_S: f64 = 0.5;
const WELL_S: f64 = 2.0;

/// What has been told of every gauge.
#[derive(Default)]
pub(super) struct LeftOut {
    gauges: Vec<Told>,
}

/// Of one gauge.
#[derive(Clone, Copy, Default)]
struct Told {
    /// How it is, and seconds since that began.
    now: Health,
    since_s: f64,
    /// As it was told last.
    said: Health,
}

impl Told {
    /// How it is some seconds later, where that is worth a word now.
    fn take(&mut self, health: Health, step_s: f64) -> Option<Health> {
        self.since_s = if health == self.now {
            self.since_s + step_s
        } else {
            0.0
        };
        self.now = health;
        let lasts_s = if health.is_good() { WELL_S } else { ILL_S };
        if self.said == health || self.since_s < lasts_s {
            return None;
        }
        self.said = health;
        Some(health)
    }
}

impl LeftOut {
    /// How every gauge is, some seconds after the last time.
    pub fn news<'a>(
        &'a mut self,
        health: &'a [Health],
        step_s: f64,
    ) -> impl Iterator<Item = LiveNews> + 'a {
        self.gauges.resize(health.len(), Told::default());
        let gauges = self.gauges.iter_mut().zip(health).enumerate();
        gauges.filter_map(move |(gauge, (told, health))| {
            let told = told.take(*health, step_s)?;
            Some(LiveNews::Gauge(gauge, told))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is told, and in which sample, of gauges that are so.
    fn told(samples: usize, health: impl Fn(usize) -> Vec<Health>) -> Vec<(usize, LiveNews)> {
        let mut left_out = LeftOut::default();
        let mut all = Vec::new();
        for k in 0..samples {
            all.extend(left_out.news(&health(k), 0.01).map(|news| (k, news)));
        }
        all
    }

    #[test]
    fn an_illness_is_told_once_and_so_is_that_it_is_over() {
        let stuck = |k| (100..400).contains(&k);
        let how = |k| {
            if stuck(k) {
                Health::Stuck
            } else {
                Health::Good
            }
        };
        let found = told(1000, |k| vec![Health::Good, how(k)]);
        let gauge = |health| LiveNews::Gauge(1, health);
        assert_eq!(
            found,
            [(150, gauge(Health::Stuck)), (600, gauge(Health::Good))]
        );
    }

    #[test]
    fn what_comes_and_goes_is_not_worth_a_word() {
        let noisy = |k: usize| k % 40 < 20;
        let how = |k| {
            if noisy(k) {
                Health::Noisy
            } else {
                Health::Good
            }
        };
        assert_eq!(told(1000, |k| vec![how(k)]), []);
    }

    #[test]
    fn of_gauges_that_fail_together_each_is_told() {
        let found = told(200, |_| vec![Health::Dead, Health::Good, Health::OffScale]);
        let gauges = found.iter().map(|(_, news)| *news).collect::<Vec<_>>();
        let of = |gauge, health| LiveNews::Gauge(gauge, health);
        assert_eq!(gauges, [of(0, Health::Dead), of(2, Health::OffScale)]);
    }
}
