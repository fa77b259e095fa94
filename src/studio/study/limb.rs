//! The limb of a unit as a small picture: its facets from the farthest to the nearest.

use std::sync::Arc;

use egui::{Color32, Mesh, Rect, Shape, Ui, pos2};
use glam::DVec3;

use crate::session::UnitLimb;

/// The picture of the limb that was last drawn, in a square from 0 to 1.
#[derive(Default)]
pub struct Thumbnail {
    of: Option<Arc<UnitLimb>>,
    mesh: Mesh,
}

impl Thumbnail {
    /// Draws a limb into a rectangle.
    pub fn show(&mut self, limb: &Arc<UnitLimb>, rect: Rect, ui: &Ui) {
        if !self.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, limb)) {
            self.mesh = drawn(limb);
            self.of = Some(Arc::clone(limb));
        }
        let side = rect.width().min(rect.height());
        let corner = rect.center() - egui::vec2(side, side) / 2.0;
        let mut mesh = self.mesh.clone();
        for vertex in &mut mesh.vertices {
            vertex.pos = corner + vertex.pos.to_vec2() * side;
        }
        ui.painter().with_clip_rect(rect).add(Shape::mesh(mesh));
    }
}

/// Seen a little from above, half from the side.
fn drawn(limb: &UnitLimb) -> Mesh {
    let stance = &limb.stance;
    let eye = (stance.front() + 0.55 * stance.right() + 0.35 * stance.up()).normalize();
    let right = stance.up().cross(eye).normalize();
    let up = eye.cross(right);
    let part = &limb.mesh;
    let (lower, upper) = part.bounds();
    let middle = (lower + upper) / 2.0;
    // What is seen of it fills the square.
    let half = part.positions().iter().fold(f64::MIN_POSITIVE, |half, &p| {
        let off = p - middle;
        half.max(off.dot(right).abs()).max(off.dot(up).abs())
    });
    let seen = |p: DVec3| {
        let off = (p - middle) / (2.04 * half);
        let at = pos2(0.5 + off.dot(right) as f32, 0.5 - off.dot(up) as f32);
        (at, off.dot(eye))
    };
    let corners: Vec<_> = part.positions().iter().map(|&p| seen(p)).collect();
    let light = (eye + 0.5 * up - 0.4 * right).normalize();
    let mut facets: Vec<(f64, [u32; 3])> = (part.triangles().iter())
        .map(|t| (t.iter().map(|&v| corners[v as usize].1).sum(), *t))
        .collect();
    facets.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut mesh = Mesh::default();
    for (_, triangle) in facets {
        let [a, b, c] = triangle.map(|v| part.positions()[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // Both sides of a wall are seen.
        let bright = 0.3 + 0.7 * normal.dot(light).abs();
        let colour = Color32::from_gray((225.0 * bright) as u8);
        let first = mesh.vertices.len() as u32;
        for v in triangle {
            mesh.colored_vertex(corners[v as usize].0, colour);
        }
        mesh.add_triangle(first, first + 1, first + 2);
    }
    mesh
}
