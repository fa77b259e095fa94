//! The presses on the limb, and how the machine comes to them.

use egui::{Align2, Color32, Painter, Pos2, Shape, Stroke, pos2, vec2};
use glam::DVec3;

use super::super::paint::{LimbLook, label};
use super::super::theme;
use super::super::view::{Pane, Stage};
use crate::session::{PlannedRun, PressState, PressingPlan};
use crate::test_bed::Ready;

const TO_COME: Color32 = Color32::from_rgb(222, 226, 232);
/// Told apart from what failed by shape, too.
const MADE: Color32 = Color32::from_rgb(86, 180, 233);
const FAILED: Color32 = Color32::from_rgb(213, 94, 0);
/// Of a place that is pressed (points).
const DOT: f32 = 3.2;

/// Draws the plan while the stage is looked at.
pub fn paint_bench(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    if look.view.stage != Stage::Bench {
        return;
    }
    let drawn = look.session.bench.look(|plan| {
        if pane == Pane::Limb
            && let PlannedRun::Machine(ready) = &plan.run
        {
            paint_table(look, painter, ready);
        }
        paint_presses(look, painter, pane, plan);
    });
    if drawn.is_some() && pane == Pane::Limb {
        paint_key(look, painter);
    }
}

fn paint_presses(look: LimbLook<'_>, painter: &Painter, pane: Pane, plan: &PressingPlan) {
    let toward = look.view.camera.toward_eye();
    let place = look.scene.placing(look.view, pane);
    let rect = look.view.rect_of(pane);
    let seen = |at: DVec3, normal: DVec3| {
        // What lies on the other side is behind the wall.
        let faces = pane == Pane::Unrolled || normal.dot(toward) > 0.0;
        place(at).filter(|at| faces && rect.contains(*at))
    };
    for (number, (&(at, normal), state)) in plan.places.iter().zip(&plan.states).enumerate() {
        let Some(at) = seen(at, normal) else {
            continue;
        };
        match state {
            PressState::Now => paint_now(look, painter, pane, (plan, number), at),
            state => paint_press(painter, at, state),
        }
    }
    if let Some((_, Some(moved))) = plan.hand {
        paint_moved(look, painter, pane, moved);
    }
}

/// Where somebody says that the press of now is, if not where it was asked for.
fn paint_moved(look: LimbLook<'_>, painter: &Painter, pane: Pane, moved: DVec3) {
    if let Some(at) = look.scene.placing(look.view, pane)(moved) {
        let edge = Stroke::new(1.5, Color32::BLACK);
        painter.circle(at, 2.0 * DOT, theme::TOUCHED, edge);
        let beside = at + vec2(3.0 * DOT, 0.0);
        label(
            painter,
            beside,
            Align2::LEFT_CENTER,
            "pressed here",
            theme::TOUCHED,
        );
    }
}

fn paint_press(painter: &Painter, at: Pos2, state: &PressState) {
    let edge = Stroke::new(1.0, Color32::from_black_alpha(200));
    match state {
        PressState::Made => drop(painter.circle(at, DOT, MADE, edge)),
        PressState::Failed(_) => cross(painter, at),
        PressState::ToCome | PressState::Now => {
            painter.circle_stroke(at, DOT, Stroke::new(2.2, Color32::from_black_alpha(170)));
            painter.circle_stroke(at, DOT, Stroke::new(1.2, TO_COME));
        }
    }
}

fn cross(painter: &Painter, at: Pos2) {
    for (width, colour) in [(4.0, Color32::from_black_alpha(200)), (2.0, FAILED)] {
        for slope in [1.0, -1.0] {
            let half = vec2(DOT, slope * DOT);
            painter.line_segment([at - half, at + half], Stroke::new(width, colour));
        }
    }
}

/// What is pressed just now, with the tip on its way to it.
fn paint_now(
    look: LimbLook<'_>,
    painter: &Painter,
    pane: Pane,
    (plan, number): (&PressingPlan, usize),
    at: Pos2,
) {
    let moved = matches!(plan.hand, Some((_, Some(_))));
    if moved {
        return paint_press(painter, at, &PressState::ToCome);
    }
    painter.circle(
        at,
        2.0 * DOT,
        theme::TOUCHED,
        Stroke::new(1.5, Color32::BLACK),
    );
    if pane == Pane::Unrolled {
        return;
    }
    let (place, normal) = plan.places[number];
    let from = match &plan.run {
        PlannedRun::Machine(ready) => {
            ready.mount.turn.transpose() * ready.reach.presses[number].pose.from()
        }
        PlannedRun::Hand(_) => normal,
    };
    let length = 0.16 * look.view.camera.distance;
    if let Some(tail) = look.view.place(place + from * length) {
        painter.arrow(tail, at - tail, Stroke::new(5.0, Color32::BLACK));
        painter.arrow(tail, at - tail, Stroke::new(3.0, theme::TOUCHED));
    }
}

/// The axis that the machine turns the limb about, and where its tip comes from at angle zero: how the limb stands in it.
fn paint_table(look: LimbLook<'_>, painter: &Painter, ready: &Ready) {
    /// Of the axis beyond the limb, over its length.
    const BEYOND: f64 = 0.12;
    let mount = &ready.mount;
    let part = &look.session.document.part;
    let heights = part.positions().iter().map(|&p| mount.place(p).z);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
        (low.min(z), high.max(z))
    });
    let beyond = BEYOND * (high - low);
    let at = |x: f64, z: f64| look.view.place(mount.limb(DVec3::new(x, 0.0, z)));
    let line = Stroke::new(1.4, Color32::from_rgb(150, 158, 170));
    if let (Some(foot), Some(head)) = (at(0.0, low - beyond), at(0.0, high + beyond)) {
        painter.extend(Shape::dashed_line(&[foot, head], line, 7.0, 5.0));
        label(
            painter,
            head,
            Align2::CENTER_BOTTOM,
            "machine's axis",
            line.color,
        );
    }
    // Beside the limb's middle, where it is in nobody's way.
    let reach = ready.reach.retreat;
    let zero = [1.3 * reach, 1.05 * reach].map(|x| at(x, f64::midpoint(low, high)));
    if let [Some(tail), Some(tip)] = zero {
        let tail = look.view.rect.shrink2(vec2(60.0, 48.0)).clamp(tail);
        painter.arrow(tail, tip - tail, line);
        label(painter, tail, Align2::CENTER_TOP, "tip at 0°", line.color);
    }
}

fn paint_key(look: LimbLook<'_>, painter: &Painter) {
    let rect = look.view.rect;
    let entries = [
        (PressState::ToCome, "to come"),
        (PressState::Made, "pressed"),
        (PressState::Failed(String::new()), "failed"),
    ];
    let mut at = pos2(rect.right() - 86.0, rect.center().y - 24.0);
    let plate = egui::Rect::from_min_size(at - vec2(14.0, 14.0), vec2(92.0, 72.0));
    painter.rect_filled(plate, 5.0, Color32::from_black_alpha(150));
    for (state, text) in entries {
        paint_press(painter, at, &state);
        let font = egui::FontId::proportional(12.5);
        painter.text(
            at + vec2(10.0, 0.0),
            Align2::LEFT_CENTER,
            text,
            font,
            TO_COME,
        );
        at.y += 22.0;
    }
}
