//! What the pointer does on the limb, in space or unrolled.

use egui::{PointerButton, Pos2, Response, Ui};
use glam::DVec2;
use rayon::prelude::*;

use super::action::{Action, BenchAction, BoardAction, Compute, HandAction, History};
use super::ask::Ask;
use super::paint::exaggeration;
use super::scene::{PartScene, pick_on};
use super::view::{Field, Gesture, Pane, Stage, Tool, ViewState};
use crate::document::Brush;
use crate::mesh::{SurfacePoint, TriMesh};
use crate::project::ChosenSite;
use crate::test_bed::HandOrder;

/// A click that moves less than this (points) is no drag.
const TREMBLE: f32 = 4.0;
/// How near (points) the pointer must be to a gauge to take it.
const REACH: f32 = 14.0;

/// Orbit with the right button (or the left one where the tool has no use for it), pan with the middle one or with Shift,
/// zoom with the wheel; with Shift the wheel sets the brush.
pub fn navigate(view: &mut ViewState, ui: &Ui, response: &Response, pane: Pane) {
    let drag = response.drag_delta();
    let shift = ui.input(|i| i.modifiers.shift);
    let left = response.dragged_by(PointerButton::Primary);
    let free = !view.tool.drags() || view.is_idle();
    let turning = response.dragged_by(PointerButton::Secondary) || left && free;
    let panning = response.dragged_by(PointerButton::Middle) || turning && shift;
    let moved = DVec2::new(f64::from(drag.x), f64::from(drag.y));
    match pane {
        Pane::Unrolled if panning || turning => view.pan_flat(drag),
        Pane::Limb if panning => {
            let height = f64::from(view.rect.height());
            view.camera.pan(moved, height);
        }
        Pane::Limb if turning => view.camera.orbit(moved),
        _ => {}
    }
    if !response.hovered() {
        return;
    }
    let wheel = ui.input(|i| {
        // With Shift a wheel scrolls sideways.
        let scroll = i.smooth_scroll_delta();
        scroll.x + scroll.y + 400.0 * (i.zoom_delta() - 1.0)
    });
    if wheel == 0.0 {
        return;
    }
    let factor = (-0.0022 * f64::from(wheel)).exp();
    match (pane, response.hover_pos()) {
        _ if shift && view.tool.is_brush() => view.brush /= factor,
        (Pane::Limb, _) => view.camera.zoom(factor),
        (Pane::Unrolled, Some(at)) => view.zoom_flat(at, factor),
        _ => {}
    }
}

/// What the tool in hand does where the pointer is.
pub fn use_tool(scene: &PartScene, ask: &mut Ask<'_>, ui: &Ui, response: &Response, pane: Pane) {
    let covered = ask.view.covered;
    let free = |at: &Pos2| !covered.contains(*at);
    if let Some(at) = response.hover_pos().filter(free) {
        ask.view.hover = scene.pick(ask.view, pane, at);
    }
    let at = response.interact_pointer_pos().or(response.hover_pos());
    if response.clicked() && at.as_ref().is_none_or(free) {
        click(scene, ask, response, pane);
    }
    let from = pressed_at(ui).filter(free);
    if let Some(from) = from.filter(|_| response.contains_pointer()) {
        begin(scene, ask, ui, pane, from);
    }
    // In the same frame too: where frames are slow, a hand has pressed and moved on in one.
    if let Some(at) = at {
        go_on(scene, ask, ui, pane, at);
    }
    if !ui.input(|i| i.pointer.primary_down()) {
        let_go(scene, ask, ui, pane);
    }
}

fn click(scene: &PartScene, ask: &mut Ask<'_>, response: &Response, pane: Pane) {
    match ask.view.tool {
        Tool::Touch => press(scene, ask, pane, response.interact_pointer_pos()),
        Tool::Measure => {
            let at = response.interact_pointer_pos().or(response.hover_pos());
            let place = at.and_then(|at| scene.pick(ask.view, pane, at));
            ask.view.measure.take(place);
            if let Some(ends) = ask.view.measure.ends() {
                ask.act(Compute::Distance(ends));
            }
        }
        _ => {}
    }
}

/// The left button goes down.
fn begin(scene: &PartScene, ask: &mut Ask<'_>, ui: &Ui, pane: Pane, from: Pos2) {
    match ask.view.tool {
        Tool::Gauges => grab(scene, ask, ui, pane, from),
        Tool::Paint | Tool::Erase if scene.pick(ask.view, pane, from).is_some() => {
            ask.view.gesture = Gesture::Stroke(pane, from);
            stroke(scene, ask, ui, pane, from);
        }
        Tool::Box | Tool::Lasso => {
            ask.view.gesture = Gesture::Outline(pane, vec![from]);
        }
        _ => {}
    }
}

/// The pointer moves while something is under way in this view.
fn go_on(scene: &PartScene, ask: &mut Ask<'_>, ui: &Ui, pane: Pane, at: Pos2) {
    let tool = ask.view.tool;
    match &mut ask.view.gesture {
        Gesture::Stroke(own, _) if *own == pane => stroke(scene, ask, ui, pane, at),
        Gesture::Outline(own, outline) if *own == pane => match tool {
            Tool::Box => outline.splice(1.., [at]).for_each(drop),
            _ if outline.last().is_some_and(|last| last.distance(at) > 3.0) => outline.push(at),
            _ => {}
        },
        Gesture::Gauge(own, number, from) if *own == pane && from.distance(at) > TREMBLE => {
            // From here on it follows however little the pointer moves.
            *from = Pos2::new(f32::MAX, 0.0);
            let number = *number;
            let there = number < ask.project().selection.sites.len();
            if let Some(site) = site_at(scene, ask, pane, at, number).filter(|_| there) {
                ask.act(HandAction::PutGauge(number, site));
            }
        }
        _ => {}
    }
}

fn let_go(scene: &PartScene, ask: &mut Ask<'_>, ui: &Ui, pane: Pane) {
    let own = match &ask.view.gesture {
        Gesture::None => return,
        Gesture::Stroke(own, _) | Gesture::Outline(own, _) | Gesture::Gauge(own, ..) => *own,
    };
    if own != pane {
        return;
    }
    match std::mem::take(&mut ask.view.gesture) {
        Gesture::Outline(_, outline) => mark_inside(scene, ask, ui, pane, outline),
        // What the move does to the error is found out when the window is next drawn.
        Gesture::Gauge(..) => ui.ctx().request_repaint(),
        _ => {}
    }
    ask.act(History::Settle);
}

fn press(scene: &PartScene, ask: &mut Ask<'_>, pane: Pane, at: Option<Pos2>) {
    let Some(place) = at.and_then(|at| pick_shown(scene, ask, pane, at)) else {
        // Beside the limb: it is pressed where it was asked for after all.
        return ask.act(if says_place(ask) {
            BenchAction::Hand(HandOrder::Elsewhere(None)).into()
        } else {
            Action::from(Compute::LetGo)
        });
    };
    if clicks_known_touches(ask) {
        let at = ask.session.document.inputs().part.point(place);
        return ask.act(BoardAction::AskKnownAt(at));
    }
    if says_place(ask) {
        let at = ask.session.document.inputs().part.point(place);
        return ask.act(BenchAction::Hand(HandOrder::Elsewhere(Some(at))));
    }
    ask.act(Compute::Press(place));
    if !matches!(ask.view.field, Field::Strain | Field::Displacement) {
        ask.view.field = Field::Strain;
    }
}

/// Whether a click on the limb says where it is pressed by hand.
fn says_place(ask: &Ask<'_>) -> bool {
    ask.view.stage == Stage::Bench && ask.session.bench.takes_place()
}

/// Whether a click on the limb says where the next known touch is pressed.
fn clicks_known_touches(ask: &Ask<'_>) -> bool {
    let session = ask.session;
    ask.view.stage == Stage::Live && session.live.is_connected() && session.desk.known_by_click
}

/// The point of the limb under a place of the window, on the shape that is shown there.
fn pick_shown(scene: &PartScene, ask: &Ask<'_>, pane: Pane, at: Pos2) -> Option<SurfacePoint> {
    match ask.session.caches.touching.result() {
        Some(touched) if pane == Pane::Limb && exaggeration(ask.session, ask.view).is_some() => {
            pick_on(ask.view, &touched.index, at)
        }
        _ => scene.pick(ask.view, pane, at),
    }
}

/// The pointer goes down with the gauges in hand: on one it is picked and may be moved, beside them none is. Shift picks
/// several, Control puts a new one there.
fn grab(scene: &PartScene, ask: &mut Ask<'_>, ui: &Ui, pane: Pane, at: Pos2) {
    let modifiers = ui.input(|i| i.modifiers);
    let away = |n: &usize| {
        let place = ask.session.gauge_place(*n);
        let place = place.and_then(|p| scene.place_in(ask.view, pane, p));
        place.map_or(f32::INFINITY, |p| p.distance(at))
    };
    let count = ask.project().selection.sites.len();
    let nearest = (0..count).min_by(|a, b| away(a).total_cmp(&away(b)));
    match nearest.filter(|n| away(n) < REACH) {
        Some(number) if modifiers.shift => {
            let picked = &mut ask.view.picked;
            match picked.iter().position(|&n| n == number) {
                Some(k) => drop(picked.remove(k)),
                None => picked.push(number),
            }
        }
        Some(number) => {
            ask.view.picked = vec![number];
            ask.view.gesture = Gesture::Gauge(pane, number, at);
        }
        None if modifiers.command => {
            if let Some(site) = site_at(scene, ask, pane, at, usize::MAX) {
                ask.view.picked = vec![count];
                ask.act(HandAction::AddGauge(site));
            }
        }
        None if !modifiers.shift => ask.view.picked.clear(),
        None => {}
    }
}

/// The site for a gauge nearest to a place of a view.
fn site_at(
    scene: &PartScene,
    ask: &Ask<'_>,
    pane: Pane,
    at: Pos2,
    number: usize,
) -> Option<ChosenSite> {
    let place = scene.pick(ask.view, pane, at)?;
    ask.session.site_near(place, number)
}

/// What a brush or outline does now: Control turns it around, as elsewhere.
fn brush(view: &ViewState, ui: &Ui) -> Brush {
    let erases = view.tool == Tool::Erase;
    if erases == ui.input(|i| i.modifiers.ctrl) {
        Brush::Paint
    } else {
        Brush::Erase
    }
}

/// Dabs along the way from the last pointer sample, so that a fast stroke has no gaps: half a radius apart, nearer where
/// that is less than a few points of the window.
fn stroke(scene: &PartScene, ask: &mut Ask<'_>, ui: &Ui, pane: Pane, to: Pos2) {
    const MOST: f32 = 256.0;
    let Gesture::Stroke(_, from) = ask.view.gesture else {
        return;
    };
    let part = &ask.session.document.part;
    let step = dab_step(scene, ask.view, part, pane, to).max(4.0);
    let steps = ((to - from).length() / step).ceil().clamp(1.0, MOST) as usize;
    let radius = ask.view.brush;
    let mut dabs = Vec::new();
    for k in 1..=steps {
        let at = from.lerp(to, k as f32 / steps as f32);
        let Some(place) = scene.pick(ask.view, pane, at) else {
            continue;
        };
        dabs.push(place);
        if let Some(image) = scene.image(ask.view, part.point(place)) {
            let (image, off) = scene.index.nearest(image);
            // A part that is not its own mirror image has nothing there.
            if off < radius {
                dabs.push(image);
            }
        }
    }
    let brush = brush(ask.view, ui);
    ask.act(HandAction::Dab(ask.view.layer, brush, dabs, radius));
    ask.view.gesture = Gesture::Stroke(pane, to);
}

/// Half the brush's radius in points of the window.
fn dab_step(scene: &PartScene, view: &ViewState, part: &TriMesh, pane: Pane, at: Pos2) -> f32 {
    match pane {
        Pane::Unrolled => (0.5 * view.brush / view.flat.1) as f32,
        Pane::Limb => {
            let Some(place) = scene.pick(view, pane, at) else {
                return 0.0;
            };
            let p = part.point(place);
            let side = view.camera.side() * view.brush * 0.5;
            let ends = [view.place(p), view.place(p + side)];
            match ends {
                [Some(a), Some(b)] => a.distance(b),
                _ => 0.0,
            }
        }
    }
}

/// Marks the vertices inside an outline: those that can be seen, or all where walls are see-through.
fn mark_inside(scene: &PartScene, ask: &mut Ask<'_>, ui: &Ui, pane: Pane, mut outline: Vec<Pos2>) {
    if let (Tool::Box, [a, b]) = (ask.view.tool, &outline[..]) {
        outline = vec![*a, Pos2::new(b.x, a.y), *b, Pos2::new(a.x, b.y)];
    }
    if outline.len() < 3 {
        return;
    }
    let (session, view) = (ask.session, &*ask.view);
    let part = &session.document.part;
    let bounds = egui::Rect::from_points(&outline);
    let place = scene.placing(view, pane);
    let drawn: Vec<u32> = (0..part.positions().len() as u32)
        .filter(|&v| {
            let at = place(part.positions()[v as usize]);
            at.is_some_and(|at| bounds.contains(at) && encloses(&outline, at))
        })
        .collect();
    let through = pane == Pane::Unrolled || view.see_through;
    let inside: Vec<u32> = (drawn.into_par_iter())
        .filter(|&v| through || is_seen(scene, view, part, v))
        .collect();
    let (layer, brush) = (view.layer, brush(view, ui));
    drop(place);
    ask.act(HandAction::Mark(layer, brush, inside));
}

/// Whether nothing of the part lies between the eye and one of its vertices.
fn is_seen(scene: &PartScene, view: &ViewState, part: &TriMesh, vertex: u32) -> bool {
    let p = part.positions()[vertex as usize];
    let Some(at) = view.place(p) else {
        return false;
    };
    let near = 1e-3 * view.camera.distance + part.mean_edge();
    let hit = scene.pick(view, Pane::Limb, at);
    hit.is_none_or(|hit| part.point(hit).distance(p) < near)
}

/// Where the left button went down in this frame.
fn pressed_at(ui: &Ui) -> Option<Pos2> {
    let down = |event: &egui::Event| match event {
        egui::Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed: true,
            ..
        } => Some(*pos),
        _ => None,
    };
    ui.input(|i| i.events.iter().find_map(down))
}

/// Whether a point lies inside a polygon (even-odd rule).
fn encloses(outline: &[Pos2], at: Pos2) -> bool {
    let mut inside = false;
    for (k, a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        if (a.y > at.y) != (b.y > at.y) {
            let x = a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x);
            inside ^= at.x < x;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_may_bend_inwards() {
        let outline = [
            (0.0, 0.0),
            (10.0, 0.0),
            (10.0, 10.0),
            (5.0, 2.0),
            (0.0, 10.0),
        ]
        .map(|(x, y)| Pos2::new(x, y));
        assert!(encloses(&outline, Pos2::new(1.0, 5.0)));
        assert!(!encloses(&outline, Pos2::new(5.0, 5.0)));
        assert!(!encloses(&outline, Pos2::new(-1.0, 1.0)));
    }
}
