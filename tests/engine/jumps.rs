//! Gauges that jump: a wire is pulled, and the gauge goes on measuring from another zero. Two of these ten are where a touch
//! may move one gauge alone, and nobody can tell: they are not asked for.

use glam::DVec3;

use crate::drift::{Press, World, press, run};

#[test]
fn a_gauge_that_jumps_is_no_touch_and_measures_on() {
    let at = |k: usize| press(k, 6.0, 3.0 + 1.5 * k as f64, 1.0);
    let presses: Vec<Press> = (0..16).map(at).collect();
    for (gauge, by) in (0..10).flat_map(|g| [(g, 200e-6), (g, -200e-6)]) {
        let (mut ghosts, mut pressed, mut shown, mut off) = (0, 0, 0, 0.0);
        let mut released = 0.0;
        run(
            World::that_jumps(gauge, by),
            &presses,
            28.0,
            |now, update, press| {
                let Some(press) = press else {
                    ghosts += u32::from(update.contact.is_some() && now > released + 0.3);
                    return;
                };
                released = now;
                if press.share(now) < 1.0 {
                    return;
                }
                pressed += 1;
                if let Some(found) = update.contact {
                    shown += 1;
                    off += DVec3::distance(found.position, press.touch.position) * 1e3;
                }
            },
        );
        let off = off / f64::from(shown);
        println!("{gauge} {by:e}: {ghosts} ghosts, {shown} of {pressed} shown, {off:.2} mm off");
        let is_told = gauge != 2 && gauge != 3;
        assert!(!is_told || (ghosts == 0 && 100 * shown > 99 * pressed && off < 1.0));
    }
}
