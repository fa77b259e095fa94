//! One sample as a line of JSON. Written by hand, because a thousand of them come in a second.

use std::fmt::Write as _;

use crate::dataset::SignalMatrix;
use crate::inference::{Contact, TouchKind};
use crate::learning::TouchEstimator;
use crate::live::{Guess, Health, LiveUpdate, ShownEstimator};

/// Where nothing touches.
const NOTHING: &str = "\"x_mm\":null,\"y_mm\":null,\"z_mm\":null,\"force_n\":null,\"fx_n\":null,\"fy_n\":null,\"fz_n\":null,\"uncertainty_mm\":null";

/// Of the touch by one of the estimators. Nulls where nothing touches. `uncertainty_mm` is the radius within which a touch lies with a probability of 90 %;
/// `force_n` presses straight in, and `fx_n`, `fy_n` and `fz_n` are all of the force. Of several touches, the hardest stands
/// first and by itself; `count` is null where it is not clear what touches.
pub(super) fn of(update: &LiveUpdate, health: &[Health], estimator: ShownEstimator) -> String {
    let mut line = format!("{{\"t_us\":{},", update.time_us);
    let guess = update
        .by(estimator)
        .filter(|_| estimator != ShownEstimator::Matching);
    match (&update.contact, guess) {
        (Some(contact), _) if estimator == ShownEstimator::Matching => touch(&mut line, contact),
        (_, Some(guess)) => guessed(&mut line, &guess),
        _ => line.push_str(NOTHING),
    }
    several(&mut line, update);
    end(line, update, health)
}

/// As [`of`], by a regression that was learned from presses; its radius holds nine of ten places that it was tested on.
pub(super) fn learned(
    update: &LiveUpdate,
    health: &[Health],
    estimator: &TouchEstimator,
) -> String {
    let mut line = format!("{{\"t_us\":{},", update.time_us);
    let strain = update.strain.as_ref().filter(|_| update.contact.is_some());
    let answer = strain.and_then(|strain| {
        let reading = SignalMatrix::new(1, strain.clone());
        estimator.find(&reading).pop()
    });
    match answer {
        Some(answer) => {
            let [x, y, z] = answer.place_mm;
            let force = (answer.force_n).map_or("null".to_owned(), |f| format!("{f:.4}"));
            let _ = write!(
                line,
                "\"x_mm\":{x:.3},\"y_mm\":{y:.3},\"z_mm\":{z:.3},\"force_n\":{force},\"fx_n\":null,\"fy_n\":null,\"fz_n\":null,\"uncertainty_mm\":{:.3}",
                answer.radius_mm
            );
        }
        None => line.push_str(NOTHING),
    }
    several(&mut line, update);
    end(line, update, health)
}

/// What is said of the gauges themselves: those that are left out by their numbers, from 1.
fn end(mut line: String, update: &LiveUpdate, health: &[Health]) -> String {
    let blind = (update.blind).map_or("null".to_owned(), |share| format!("{share:.3}"));
    let _ = write!(line, ",\"channels_ok\":{},\"left_out\":{{", update.good);
    let ill = (health.iter().zip(1..)).filter(|(health, _)| !health.is_good());
    for (k, (health, gauge)) in ill.enumerate() {
        let comma = if k == 0 { "" } else { "," };
        let _ = write!(line, "{comma}\"{gauge}\":\"{}\"", health.in_words());
    }
    let _ = write!(line, "}},\"blind_share\":{blind}}}");
    line
}

/// By a regression, which says no more.
fn guessed(line: &mut String, guess: &Guess) {
    let p = guess.position * 1e3;
    let _ = write!(
        line,
        "\"x_mm\":{:.3},\"y_mm\":{:.3},\"z_mm\":{:.3},\"force_n\":{:.4},\"fx_n\":null,\"fy_n\":null,\"fz_n\":null,\"uncertainty_mm\":null",
        p.x, p.y, p.z, guess.force
    );
}

fn touch(line: &mut String, contact: &Contact) {
    let (p, f) = (contact.position * 1e3, contact.on_part());
    let _ = write!(
        line,
        "\"x_mm\":{:.3},\"y_mm\":{:.3},\"z_mm\":{:.3},\"force_n\":{:.4},\"fx_n\":{:.4},\"fy_n\":{:.4},\"fz_n\":{:.4},\"uncertainty_mm\":{:.3}",
        p.x,
        p.y,
        p.z,
        contact.force,
        f.x,
        f.y,
        f.z,
        contact.region.radius * 1e3
    );
}

/// How many touch, and each of them.
fn several(line: &mut String, update: &LiveUpdate) {
    let Some(touches) = &update.touches else {
        line.push_str(
            ",\"kind\":null,\"count\":0,\"count_probability\":null,\"area_radius_mm\":null,\"unexplained\":null,\"touches\":[]",
        );
        return;
    };
    let kind = match touches.kind {
        TouchKind::Points => "points",
        TouchKind::Area(_) => "area",
        TouchKind::Unclear => "unclear",
    };
    let _ = write!(line, ",\"kind\":\"{kind}\",\"count\":");
    let _ = match touches.count() {
        Some(count) => write!(line, "{count}"),
        None => write!(line, "null"),
    };
    let probability = touches.probability;
    let _ = write!(
        line,
        ",\"count_probability\":{probability:.3},\"area_radius_mm\":"
    );
    let _ = match touches.kind {
        TouchKind::Area(radius) => write!(line, "{:.2}", radius * 1e3),
        TouchKind::Points | TouchKind::Unclear => write!(line, "null"),
    };
    let _ = write!(
        line,
        ",\"unexplained\":{:.1},\"touches\":[",
        touches.unexplained
    );
    for (k, contact) in touches.contacts.iter().enumerate() {
        line.push_str(if k == 0 { "{" } else { ",{" });
        touch(line, contact);
        line.push('}');
    }
    line.push(']');
}
