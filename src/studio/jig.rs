//! The jig over the limb: rods, rings and arms with their pads at the wall.

use egui::{Color32, Painter, Pos2, Shape, Stroke, pos2};
use glam::{DVec2, DVec3};

use super::paint::LimbLook;
use super::view::Pane;
use crate::jig::{JigFrame, Stack, bar, outline};

/// Rods that come in one after another, told apart also where colours are not seen.
const INKS: [[u8; 3]; 3] = [[0xd8, 0xdc, 0xe2], [0xf0, 0xc4, 0x8f], [0x9c, 0xc9, 0xe8]];
/// How much pieces cover what is behind them.
const COVER: f32 = 0.82;

/// Draws it on the limb, where it is asked for and planned.
pub fn paint_jig(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    if !look.view.jig_shown || pane != Pane::Limb {
        return;
    }
    let Some(jig) = look.session.jig() else {
        return;
    };
    let toward = look.view.camera.toward_eye();
    let mut pieces: Vec<(f64, Vec<Pos2>, Color32)> = Vec::new();
    for (k, stack) in jig.stacks.iter().enumerate() {
        let [r, g, b] = INKS[k % INKS.len()];
        let ink = Color32::from_rgb(r, g, b).gamma_multiply(COVER);
        let deep = stack.arms.last().map_or(0.0, |arm| arm.ring(&jig.sizes)[1]);
        let rod = bar(jig.sizes.rod, -stack.lift - 20.0, deep + 3.0);
        let arms = stack.arms.iter().flat_map(|a| a.bodies(&jig.sizes, 0.0));
        for body in std::iter::once(rod).chain(arms) {
            pieces.extend(seen(look, stack, &body, toward).map(|(near, at)| (near, at, ink)));
        }
    }
    pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let edge = Stroke::new(0.7, Color32::from_black_alpha(200));
    painter.extend(
        pieces
            .into_iter()
            .map(|(_, at, ink)| Shape::convex_polygon(at, ink, edge)),
    );
}

/// The outline of a body on the screen, and how near it is; nothing of one that is not all before the eye, or is cut away.
fn seen(
    look: LimbLook<'_>,
    stack: &Stack,
    body: &[DVec3],
    toward: DVec3,
) -> Option<(f64, Vec<Pos2>)> {
    let frame: &JigFrame = &stack.frame;
    let places: Vec<DVec3> = body.iter().map(|&p| frame.out_of(p)).collect();
    let middle = places.iter().sum::<DVec3>() / places.len().max(1) as f64;
    if look.view.is_cut(middle) {
        return None;
    }
    let on_screen: Option<Vec<DVec2>> = places
        .iter()
        .map(|&p| {
            look.view
                .place(p)
                .map(|at| DVec2::new(at.x.into(), at.y.into()))
        })
        .collect();
    let around = outline(on_screen?);
    let around = around.into_iter().map(|p| pos2(p.x as f32, p.y as f32));
    Some((middle.dot(toward), around.collect()))
}
