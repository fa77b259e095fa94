//! What the colours over the limb mean, and what to do where there are none.

use egui::{Align2, Color32, FontId, Painter, Rect, pos2, vec2};

use super::paint::{LimbLook, label, plate};
use super::view::{Field, Stage, Tool};
use crate::colormap::ColorMap;
use crate::document::Layer;

/// What stands for the stripes of blind places in a key.
const BLIND_KEY: Color32 = Color32::from_gray(150);

/// The scale of the colours.
pub fn paint_legend(look: LimbLook<'_>, painter: &Painter, rect: Rect) {
    let mut bottom = rect.bottom() - 16.0;
    if let Some(scale) = look.exaggeration() {
        let text = format!("Deformation × {scale}");
        label(
            painter,
            pos2(rect.right() - 16.0, bottom),
            Align2::RIGHT_BOTTOM,
            &text,
            Color32::WHITE,
        );
        bottom -= 26.0;
    }
    let Some(legend) = look.scene.built.as_ref().and_then(|b| b.legend.clone()) else {
        return;
    };
    if look.view.field == Field::Faces {
        return; // they have a key of their own
    }
    let bar = Rect::from_min_max(
        pos2(rect.right() - 34.0, bottom - 210.0),
        pos2(rect.right() - 16.0, bottom),
    );
    let font = FontId::proportional(11.5);
    let title = painter.layout_no_wrap(legend.title.clone(), font, Color32::WHITE);
    let left = (bar.left() - 86.0).min(bar.right() - title.size().x - 8.0);
    let board = Rect::from_min_max(pos2(left, bar.top() - 30.0), bar.max + vec2(8.0, 8.0));
    painter.rect_filled(board, 6.0, Color32::from_black_alpha(150));
    let strips = 64;
    for k in 0..strips {
        let t = f64::from(k) / f64::from(strips);
        let [r, g, b] = legend
            .map
            .at(t + 0.5 / f64::from(strips))
            .map(|c| (c * 255.0) as u8);
        let y = bar.bottom() - bar.height() * t as f32;
        let strip = Rect::from_min_max(
            pos2(bar.left(), y - bar.height() / strips as f32 - 0.5),
            pos2(bar.right(), y),
        );
        painter.rect_filled(strip, 0.0, Color32::from_rgb(r, g, b));
    }
    for k in 0..=4 {
        let t = f64::from(k) / 4.0;
        let y = bar.bottom() - bar.height() * t as f32;
        let text = tidy(legend.low + (legend.high - legend.low) * t);
        painter.text(
            pos2(bar.left() - 6.0, y),
            Align2::RIGHT_CENTER,
            text,
            FontId::proportional(11.5),
            Color32::WHITE,
        );
    }
    let corner = board.right_top() + vec2(-8.0 - title.size().x, 6.0);
    painter.galley(corner, title, Color32::WHITE);
}

/// What to do next with the tool in hand.
pub fn paint_hint(look: LimbLook<'_>, painter: &Painter, rect: Rect) {
    let text = match look.view.tool {
        _ if look.session.caches.touching.is_waiting() => "Computing the touch …",
        Tool::Paint => {
            "Drag over the limb: paint   ·   Ctrl: erase   ·   [ ]: radius   ·   right-drag: look around"
        }
        Tool::Erase => {
            "Drag over the limb: erase   ·   Ctrl: paint   ·   [ ]: radius   ·   right-drag: look around"
        }
        Tool::Box | Tool::Lasso => {
            "Drag around what is to be painted   ·   Ctrl: erase   ·   walls behind only when see-through"
        }
        Tool::Gauges => {
            "Click a gauge to pick it, drag it to another place   ·   Shift: pick several   ·   right-drag: look around"
        }
        Tool::Measure => "Click two points of the limb",
        Tool::Touch => field_hint(look),
    };
    // Beside what the other corner says.
    let corner = if look.exaggeration().is_some() {
        150.0
    } else {
        28.0
    };
    let room = (rect.width() - corner).max(60.0);
    let ink = Color32::from_gray(215);
    let galley = painter.layout(text.to_owned(), FontId::proportional(12.5), ink, room);
    plate(
        painter,
        rect.left_bottom() + vec2(14.0, -14.0),
        Align2::LEFT_BOTTOM,
        galley,
    );
}

/// Of the limb where touches come, and beside where they come often.
const TOUCHES_COME: Color32 = Color32::from_rgb(128, 153, 230);
const BESIDE_OFTEN: Color32 = Color32::from_rgb(165, 178, 216);

/// What the colours of the regions mean, of those that are there.
pub fn paint_region_key(look: LimbLook<'_>, painter: &Painter, rect: Rect) {
    if look.view.field == Field::Faces && look.scene.shows_field() {
        return face_key(painter, rect);
    }
    if look.view.field == Field::Expected && look.scene.shows_field() {
        let force = look.project().touch.force_n;
        let blind = format!("Blind at {force} N");
        return colour_key(painter, rect, std::iter::once((&*blind, BLIND_KEY)));
    }
    if look.view.field != Field::Region {
        return;
    }
    let painted = |layer: Layer| look.session.document.layer(layer).is_some();
    // The filters' verdicts are shown while they hold; what is painted, always.
    let verdicts = look.session.current_verdicts().is_some() || painted(Layer::Feasible);
    let often = painted(Layer::Often);
    let touches_come = if often { BESIDE_OFTEN } else { TOUCHES_COME };
    let rows = [
        (verdicts, "Gauges may go", Color32::from_rgb(107, 191, 173)),
        (
            painted(Layer::KeepOut),
            "Keep out",
            Color32::from_rgb(219, 115, 92),
        ),
        (
            !look.project().supports.is_empty(),
            "Held",
            Color32::from_rgb(219, 189, 87),
        ),
        (painted(Layer::Touch), "Touches come", touches_come),
        (often, "Touches come often", TOUCHES_COME),
    ];
    let there = rows.into_iter().filter(|r| r.0);
    colour_key(painter, rect, there.map(|(_, name, colour)| (name, colour)));
}

/// Under the unrolled view: what became of lengths there.
pub fn paint_stretch(look: LimbLook<'_>, painter: &Painter, rect: Rect) {
    let words = look.scene.unrolled.flat.stretch.words();
    let room = rect.width() - 40.0;
    let font = FontId::proportional(12.5);
    let galley = painter.layout(words, font, Color32::WHITE, room.max(80.0));
    let at = rect.center_bottom() - vec2(0.0, 14.0);
    plate(painter, at, Align2::CENTER_BOTTOM, galley);
}

/// What is missing before a field can be seen, or how to look around.
fn field_hint(look: LimbLook<'_>) -> &'static str {
    match look.view.field {
        Field::Strain | Field::Displacement if look.session.caches.touching.result().is_none() => {
            "Click on the limb to press it and see this field"
        }
        Field::SignalToNoise if look.session.results.simulation.is_none() => {
            "Press “Simulate” to see the signal at each site"
        }
        Field::Error if look.session.results.design.is_none() => {
            "Press “Select gauges” to see where touches are found well and where not"
        }
        Field::Expected if look.session.simulation_holds() != Some(true) => {
            "Press “Simulate” to see where touches are expected to be found well and where not"
        }
        Field::Expected
            if look
                .session
                .document
                .state
                .project
                .selection
                .sites
                .is_empty() =>
        {
            "Put gauges to see what is expected of them: tool “Gauges”, Ctrl-click"
        }
        Field::Expected if look.expected().is_some() => {
            "Point at the limb: what a touch there is taken for   ·   drag gauges with the tool “Gauges”"
        }
        Field::Expected => "Preparing the expected error …",
        Field::Uncertainty if look.session.results.design.is_none() => {
            "Press “Select gauges” to see what the gauges leave uncertain"
        }
        Field::Faces | Field::Thickness if look.session.caches.walls.is_some() => {
            if look
                .scene
                .built
                .as_ref()
                .is_some_and(|b| b.legend.is_some())
            {
                "Paint the layer “Inside face” or “Outside face” where this is wrong"
            } else {
                "The part encloses nothing: it has no inside of its own"
            }
        }
        Field::Faces | Field::Thickness => "Measuring the walls …",
        Field::Error | Field::Uncertainty
            if look.scene.built.as_ref().is_none_or(|b| b.legend.is_none()) =>
        {
            "Computing the field …"
        }
        _ if look.view.stage == Stage::Bench && look.session.bench.takes_place() => {
            "Click: where it is pressed   ·   drag: look around   ·   Shift-drag: shift   ·   wheel: zoom"
        }
        _ => {
            "Click: press the limb   ·   drag: look around   ·   Shift-drag: shift   ·   wheel: zoom"
        }
    }
}

/// What the colours of the faces of a solid mean.
fn face_key(painter: &Painter, rect: Rect) {
    let colour = |side: f64| {
        let t = f64::midpoint(side / super::fields::FACE_RANGE, 1.0);
        let [r, g, b] = ColorMap::BlueOrange.at(t).map(|c| (c * 255.0) as u8);
        Color32::from_rgb(r, g, b)
    };
    let rows = [
        ("Outside: touches land", colour(-1.0)),
        ("Inside: gauges go", colour(1.0)),
        ("Ends of walls", colour(0.0)),
    ];
    colour_key(painter, rect, rows.into_iter());
}

/// Names with squares of their colours, in the upper right corner.
fn colour_key<'n>(painter: &Painter, rect: Rect, rows: impl Iterator<Item = (&'n str, Color32)>) {
    let mut at = rect.right_top() + vec2(-16.0, 12.0);
    for (name, colour) in rows {
        let font = FontId::proportional(11.5);
        let galley = painter.layout_no_wrap(name.to_owned(), font, Color32::WHITE);
        let height = galley.size().y;
        let board = plate(painter, at, Align2::RIGHT_TOP, galley);
        let middle = pos2(board.left() - 10.0, board.center().y);
        let square = Rect::from_center_size(middle, vec2(11.0, 11.0));
        painter.rect_filled(square, 2.0, colour);
        at.y += height + 10.0;
    }
}

fn tidy(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".into()
    } else if (0.01..1e5).contains(&size) {
        let text = format!("{value:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.1e}")
    }
}
