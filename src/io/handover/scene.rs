//! The limb with its gauges, and a touch where there is one, as a GLB.

use glam::DVec3;

use crate::colormap::ColorMap;
use crate::io::glb::{ScenePiece, write_scene};
use crate::mesh::{Facets, TriMesh};
use crate::workshop::{Inner, arrow, frame, plate};

const LIMB: [u8; 3] = [0xc9, 0xcd, 0xd3];
const GAUGE: [u8; 3] = [0xd5, 0x5e, 0x00];
const TOUCH: [u8; 3] = [0x00, 0x72, 0xb2];

/// What a scene shows.
pub struct StepScene<'a> {
    /// The limb (m).
    pub limb: &'a TriMesh,
    /// What colours it, 0–1 a vertex; grey where there is nothing.
    pub field: Option<&'a [f64]>,
    /// The gauges.
    pub inner: &'a Inner,
    /// Length and width of a gauge's grid (mm).
    pub grid_mm: [f64; 2],
    /// Where it is touched (m), and which way the touch pushes.
    pub touch: Option<(DVec3, DVec3)>,
    /// The key of the run that it is of.
    pub run: Option<&'a str>,
}

impl StepScene<'_> {
    /// Its bytes.
    ///
    /// # Errors
    /// What serialization reports.
    pub fn glb(&self) -> Result<Vec<u8>, String> {
        /// A gauge with its film (m).
        const THICK: f64 = 0.3e-3;
        let colour = |k: usize| match self.field {
            Some(field) => ColorMap::Viridis
                .at(field[k])
                .map(|c| (255.0 * c).round() as u8),
            None => LIMB,
        };
        let corners = self.limb.positions();
        let mut pieces = vec![ScenePiece {
            name: "limb".into(),
            positions: corners.to_vec(),
            triangles: self.limb.triangles().to_vec(),
            colours: (0..corners.len()).map(colour).collect(),
        }];
        let [length, width] = self.grid_mm.map(|mm| mm * 1e-3);
        for gauge in &self.inner.gauges {
            let (place, turn) = frame(gauge);
            let inside = place - gauge.gauge.normal * (THICK / 2.0);
            let solid = plate(inside, &turn, DVec3::new(length, width, THICK));
            pieces.push(piece(&format!("gauge {}", gauge.number), solid, GAUGE));
        }
        if let Some((place, way)) = self.touch {
            let (low, high) = self.limb.bounds();
            let length = 0.2 * (high - low).length();
            pieces.push(piece("touch", arrow(place, way, length), TOUCH));
        }
        let by = (self.run).map_or("hapdef".into(), |run| format!("hapdef, run {run}"));
        write_scene(&pieces, self.inner.stance, by).map_err(|e| e.to_string())
    }
}

fn piece(name: &str, solid: Facets, colour: [u8; 3]) -> ScenePiece {
    ScenePiece {
        name: name.to_owned(),
        colours: vec![colour; solid.positions.len()],
        positions: solid.positions,
        triangles: solid.triangles,
    }
}
