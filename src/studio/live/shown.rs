//! What is seen of a touch: over the limb, and as strips below it.

use std::fmt::Write as _;

use egui::{Align2, Color32, Painter, Rect, RichText, Role, Stroke, Ui, WidgetInfo, pos2, vec2};
use glam::DVec3;

use super::super::ask::Ask;
use super::super::paint::{LimbLook, label};
use super::super::theme;
use super::super::view::{Pane, Stage};
use super::super::words::live_in_words;
use crate::inference::{Contact, SeveralTouches, TouchKind};
use crate::live::{Health, ShownEstimator};
use crate::session::{Feed, STRIPS_S, Strip};

/// Of the estimators, apart for colour-blind eyes too.
const COLOURS: [Color32; 4] = [
    Color32::from_rgb(240, 228, 66),
    Color32::from_rgb(86, 180, 233),
    Color32::from_rgb(213, 94, 0),
    Color32::from_rgb(204, 121, 167),
];

fn colour(estimator: ShownEstimator) -> Color32 {
    COLOURS[ShownEstimator::ALL
        .iter()
        .position(|e| *e == estimator)
        .unwrap_or(0)]
}

/// What is heard of a touch, over the limb.
pub fn paint_live(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    paint_known(look, painter, pane);
    paint_proposed(look, painter, pane);
    look.session
        .live
        .look(|feed| paint_received(look, painter, pane, feed));
}

fn paint_received(look: LimbLook<'_>, painter: &Painter, pane: Pane, feed: &Feed) {
    let Some(update) = &feed.update else {
        return;
    };
    paint_trail(look, painter, pane, feed);
    if let Some((place, _)) = feed.truth
        && let Some(at) = look.place_in(pane, place)
    {
        painter.circle_stroke(at, 9.0, Stroke::new(1.5, Color32::WHITE));
    }
    for estimator in ShownEstimator::ALL {
        let shown = estimator == look.session.desk.estimator;
        let Some(guess) = update
            .by(estimator)
            .filter(|_| shown || look.session.desk.compare)
        else {
            continue;
        };
        let Some(at) = look.place_in(pane, guess.position) else {
            continue;
        };
        let colour = colour(estimator);
        if !shown {
            painter.circle(at, 4.0, colour, Stroke::new(1.0, Color32::BLACK));
            continue;
        }
        if estimator == ShownEstimator::Matching
            && let Some(touches) = &update.touches
        {
            paint_touches(look, painter, pane, touches, colour);
            continue;
        }
        painter.circle(at, 6.0, colour, Stroke::new(1.5, Color32::BLACK));
        if pane == Pane::Limb {
            paint_press(
                look,
                painter,
                guess.position,
                guess.force,
                update.contact.as_ref(),
                colour,
            );
        }
    }
}

/// All that touch: points with where they may be, or an area.
fn paint_touches(
    look: LimbLook<'_>,
    painter: &Painter,
    pane: Pane,
    touches: &SeveralTouches,
    colour: Color32,
) {
    for contact in &touches.contacts {
        let Some(at) = look.place_in(pane, contact.position) else {
            continue;
        };
        paint_outline(look, painter, pane, (contact, contact.region.axes), colour);
        if let TouchKind::Area(radius) = touches.kind {
            let along = contact.normal.any_orthonormal_vector() * radius;
            let axes = [along, contact.normal.cross(along)];
            paint_outline(look, painter, pane, (contact, axes), colour);
        }
        painter.circle(at, 6.0, colour, Stroke::new(1.5, Color32::BLACK));
        if pane == Pane::Limb {
            let (place, force) = (contact.position, contact.force);
            paint_press(look, painter, place, force, Some(contact), colour);
        }
    }
}

/// The press as an arrow that it comes along, with how hard and how sure.
fn paint_press(
    look: LimbLook<'_>,
    painter: &Painter,
    place: DVec3,
    force: f64,
    contact: Option<&Contact>,
    colour: Color32,
) {
    /// Force (N) at which the arrow is as long as it gets, and that length over the view.
    const FULL: f64 = 30.0;
    const LENGTH: f64 = 0.22;
    let (on, _) = look.scene.index.nearest(place);
    let contact = contact.filter(|_| look.session.desk.estimator == ShownEstimator::Matching);
    // Against the whole force, where it is known.
    let whole = contact.and_then(|c| (-c.on_part()).try_normalize());
    let from = whole.unwrap_or_else(|| look.session.document.part.normal(on));
    let share = 0.25 + 0.75 * (force / FULL).clamp(0.0, 1.0);
    let length = LENGTH * share * look.view.camera.distance;
    let ends = [place, place + from * length].map(|p| look.view.place(p));
    let [Some(tip), Some(tail)] = ends else {
        return;
    };
    painter.arrow(tail, tip - tail, Stroke::new(4.0, Color32::BLACK));
    painter.arrow(tail, tip - tail, Stroke::new(2.5, colour));
    let mut text = format!("{force:.1} N");
    if let Some(c) = contact {
        let _ = write!(text, " ± {:.1}", c.force_deviation);
        // Only what is clearly there.
        let aside = c.drag.length();
        if aside > 2.0 * c.drag_deviation && c.drag_deviation > 0.0 {
            let _ = write!(text, " · {aside:.1} N aside");
        }
        let _ = write!(text, " · ± {:.1} mm", c.region.radius * 1e3);
    }
    // Above the hint and within the view.
    let room = look.view.rect.shrink2(vec2(90.0, 44.0));
    label(
        painter,
        room.clamp(tail),
        Align2::CENTER_BOTTOM,
        &text,
        colour,
    );
}

/// An ellipse around a touch, laid onto the surface: the 90 % region, or an area.
fn paint_outline(
    look: LimbLook<'_>,
    painter: &Painter,
    pane: Pane,
    (contact, [a, b]): (&Contact, [DVec3; 2]),
    colour: Color32,
) {
    const POINTS: usize = 48;
    // How far the surface may fall away from the tangent plane before it is another part of it.
    let near = 2e-3 + 0.4 * a.length().max(b.length()).min(0.03);
    let on_surface = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
        let place = contact.position + a * cos + b * sin;
        let (at, away) = look.scene.index.nearest(place);
        let shown = (away < near).then(|| look.session.document.part.point(at))?;
        look.place_in(pane, shown)
    };
    let points: Vec<Option<egui::Pos2>> = (0..=POINTS).map(on_surface).collect();
    // Where the surface has an edge or a slot, the outline has a gap.
    let longest = 0.35 * look.view.rect_of(pane).height();
    for (width, colour) in [(3.5, Color32::from_black_alpha(140)), (1.5, colour)] {
        for pair in points.windows(2) {
            if let [Some(from), Some(to)] = *pair
                && from.distance(to) < longest
            {
                painter.line_segment([from, to], Stroke::new(width, colour));
            }
        }
    }
}

fn paint_trail(look: LimbLook<'_>, painter: &Painter, pane: Pane, feed: &Feed) {
    let Some(&(now, _, _)) = feed.trail.back() else {
        return;
    };
    let placed: Vec<_> = feed
        .trail
        .iter()
        .filter_map(|&(t, e, p)| Some((t, e, look.place_in(pane, p)?)))
        .collect();
    for pair in placed.windows(2) {
        let ((t, e, from), (_, _, to)) = (pair[0], pair[1]);
        // Over the seam of the unrolled view no line is drawn.
        if from.distance(to) < 60.0 {
            let fade = (1.0 - (now - t)).clamp(0.0, 1.0) as f32;
            painter.line_segment(
                [from, to],
                Stroke::new(3.0, colour(e).gamma_multiply(0.6 * fade)),
            );
        }
    }
}

/// Where known touches were pressed: crosses with their numbers, thin where they are left out.
fn paint_known(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    if look.view.stage != Stage::Live || !look.session.live.is_connected() {
        return;
    }
    for (shown, (number, touch)) in (1..).zip(look.session.known_list()) {
        let place = look.session.known_place(touch);
        let Some(at) = place.and_then(|place| look.place_in(pane, place)) else {
            continue;
        };
        let is_looked_at = look.view.known_hover == Some(number);
        let reach = if is_looked_at { 8.0 } else { 4.0 };
        let width = if touch.used { 2.0 } else { 0.8 };
        for d in [vec2(reach, reach), vec2(reach, -reach)] {
            painter.line_segment([at - d, at + d], Stroke::new(width + 2.0, Color32::BLACK));
            painter.line_segment([at - d, at + d], Stroke::new(width, Color32::WHITE));
        }
        if is_looked_at {
            let words = format!("known touch {shown}");
            label(
                painter,
                at + vec2(14.0, 0.0),
                Align2::LEFT_CENTER,
                &words,
                Color32::WHITE,
            );
        }
    }
}

/// Where the next known touch is to be pressed.
fn paint_proposed(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    let shown = look.view.stage == Stage::Live
        && look.session.live.is_connected()
        && look.session.live.simulated_board().is_none();
    let Some(place) = shown.then(|| look.session.proposed_touch()).flatten() else {
        return;
    };
    if let Some(at) = look.place_in(pane, place) {
        for d in [vec2(7.0, 7.0), vec2(7.0, -7.0)] {
            painter.line_segment([at - d, at + d], Stroke::new(4.0, Color32::BLACK));
            painter.line_segment([at - d, at + d], Stroke::new(2.0, theme::TOUCHED));
        }
    }
}

/// Strips of all gauges with their health, and how the line does.
pub fn live_tab(ask: &mut Ask<'_>, ui: &mut Ui) {
    let (words, warning) = live_in_words(ask.session);
    let compare = ask.session.desk.compare;
    ask.session.live.look(|feed| {
        line_and_estimates(ui, feed, RichText::new(words).strong(), warning, compare);
    });
}

/// How the line does and what every estimator says, over the strips.
fn line_and_estimates(
    ui: &mut Ui,
    feed: &Feed,
    words: RichText,
    warning: Option<Color32>,
    compare: bool,
) {
    ui.horizontal_wrapped(|ui| {
        ui.label(warning.map_or(words.clone(), |c| words.color(c)));
        facts(ui, feed);
    });
    if compare {
        compared(ui, feed);
    }
    let gauges = feed.health.len();
    if gauges == 0 {
        ui.add_space(8.0);
        ui.weak("Start a simulated board or connect one at the stage “Live”, and every gauge is drawn here");
        return;
    }
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), egui::Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Figure, true, "Strains of the gauges"));
    strips(ui.painter(), rect, feed, ui.visuals().weak_text_color());
}

/// Rate, losses, delay, touch.
fn facts(ui: &mut Ui, feed: &Feed) {
    let traffic = feed.traffic;
    let mut facts = vec![format!("{:.0} samples/s", feed.rate)];
    facts.push(format!("{} lost", traffic.lost));
    facts.push(format!("{} refused", traffic.refused));
    if let Some([half, most]) = feed.delays {
        facts.push(format!(
            "{half:.0} µs from byte to touch (99 %: {most:.0} µs)"
        ));
    }
    if let Some(update) = &feed.update {
        facts.extend(update.touches.as_ref().and_then(how_many));
        facts.push(format!(
            "{} of {} gauges good",
            update.good,
            feed.health.len()
        ));
    }
    facts.extend(traffic.temperature().map(|t| format!("board at {t:.1} °C")));
    for fact in facts {
        ui.separator();
        ui.label(fact);
    }
}

/// What touches, where that is not simply one point.
fn how_many(touches: &SeveralTouches) -> Option<String> {
    let sure = 100.0 * touches.probability;
    match (touches.kind, touches.contacts.len()) {
        (TouchKind::Points, 1) => None,
        (TouchKind::Points, count) => Some(format!("{count} touches ({sure:.0} % sure)")),
        (TouchKind::Area(radius), _) => Some(format!(
            "an area, {:.0} mm around its middle ({sure:.0} % sure)",
            radius * 1e3
        )),
        (TouchKind::Unclear, _) => Some("something touches that is no point".into()),
    }
}

/// What every estimator says, and how far off that is where the truth is known.
fn compared(ui: &mut Ui, feed: &Feed) {
    ui.horizontal_wrapped(|ui| {
        for estimator in ShownEstimator::ALL {
            let guess = feed.update.as_ref().and_then(|u| u.by(estimator));
            if estimator == ShownEstimator::Learned && guess.is_none() {
                continue;
            }
            let (dot, _) = ui.allocate_exact_size(vec2(9.0, 9.0), egui::Sense::hover());
            ui.painter()
                .circle_filled(dot.center(), 4.0, colour(estimator));
            let mut text = format!("{}: ", estimator.label());
            let _ = match (guess, feed.truth) {
                (Some(guess), Some((place, force))) => write!(
                    text,
                    "{:.1} N ({:+.1} N), {:.1} mm off",
                    guess.force,
                    guess.force - force,
                    guess.position.distance(place) * 1e3
                ),
                (Some(guess), None) => write!(text, "{:.1} N", guess.force),
                (None, _) => write!(text, "–"),
            };
            ui.label(text);
            ui.separator();
        }
    });
}

/// One strip a gauge, in columns where there are many.
fn strips(painter: &Painter, rect: Rect, feed: &Feed, weak: Color32) {
    const LEAST_HEIGHT: f32 = 22.0;
    let gauges = feed.health.len();
    let rows = ((rect.height() / LEAST_HEIGHT) as usize).clamp(1, gauges);
    let columns = gauges.div_ceil(rows);
    let rows = gauges.div_ceil(columns);
    let size = vec2(rect.width() / columns as f32, rect.height() / rows as f32);
    let now = feed.strips.back().map_or(0.0, |s| s.seconds);
    let largest = |s: &Strip| s.range.iter().fold(0.0_f32, |m, (l, h)| m.max(-l).max(*h));
    // All on one scale, so that levels can be compared; never finer than the noise.
    let scale = feed.strips.iter().map(largest).fold(20.0, f32::max);
    for gauge in 0..gauges {
        let corner = rect.min
            + vec2(
                size.x * (gauge / rows) as f32,
                size.y * (gauge % rows) as f32,
            );
        let cell = Rect::from_min_size(corner, size).shrink2(vec2(6.0, 1.0));
        let health = feed.health[gauge];
        strip(painter, cell, feed, gauge, (now, scale), weak);
        let colour = if health.is_good() { weak } else { theme::ERROR };
        let level = feed
            .update
            .as_ref()
            .and_then(|u| u.strain.as_ref()?.get(gauge).copied());
        let level = level.map_or(String::new(), |s| format!("{:+.0} µε", s * 1e6));
        let mut name = format!("{}  {level}", gauge + 1);
        if health != Health::Good {
            let _ = write!(name, "  {}", health.in_words());
        }
        let font = egui::FontId::proportional(11.0);
        painter.text(
            pos2(cell.min.x, cell.center().y),
            Align2::LEFT_CENTER,
            name,
            font,
            colour,
        );
    }
}

fn strip(
    painter: &Painter,
    cell: Rect,
    feed: &Feed,
    gauge: usize,
    (now, scale): (f64, f32),
    weak: Color32,
) {
    const NAMES: f32 = 118.0;
    let plot = Rect::from_min_max(pos2(cell.min.x + NAMES, cell.min.y), cell.max);
    painter.hline(
        plot.x_range(),
        plot.center().y,
        Stroke::new(0.5, weak.gamma_multiply(0.5)),
    );
    let colour = if feed.health[gauge].is_good() {
        COLOURS[1]
    } else {
        theme::ERROR
    };
    let y = |v: f32| plot.center().y - v / scale * plot.height() / 2.0;
    let mut last = None;
    for strip in &feed.strips {
        let Some(&(low, high)) = strip.range.get(gauge) else {
            continue;
        };
        let x = plot.max.x - ((now - strip.seconds) / STRIPS_S) as f32 * plot.width();
        let (top, bottom) = (pos2(x, y(high)), pos2(x, y(low)));
        painter.line_segment([top, bottom], Stroke::new(1.0, colour));
        let middle = top.lerp(bottom, 0.5);
        if let Some(before) = last {
            painter.line_segment([before, middle], Stroke::new(1.0, colour));
        }
        last = Some(middle);
    }
}
