//! The parameters of a lattice limb.

/// Parameters of a lattice limb. Lengths in millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct LimbSpec {
    /// Unrolled length around the limb. The mid-surface radius is `circumference / (arc in radians)`.
    pub circumference: f64,
    /// Angle the limb covers (degrees); 360 closes the tube.
    pub arc_degrees: f64,
    /// From rim to rim.
    pub height: f64,
    /// Radius at the top over radius at the bottom.
    pub taper: f64,
    /// Centres of the columns along s.
    pub columns: Vec<f64>,
    /// Width of the columns.
    pub column_width: f64,
    /// Lower and upper end of each hoop, from the bottom up, touching neither each other nor beyond
    /// the height; the first and last form the rims.
    pub hoops: Vec<(f64, f64)>,
    /// How it is held.
    pub support: LimbSupport,
    /// Radius of the windows' corners; 0 leaves them sharp.
    pub corner_radius: f64,
    /// Largest side of an element.
    pub element: f64,
}

/// How the limb is held.
#[derive(Clone, Debug, PartialEq)]
pub enum LimbSupport {
    /// Bosses of this half-width about each of these s, this tall, at both ends.
    Bosses {
        /// Places of the bosses along s.
        centres: Vec<f64>,
        /// Half the width of each.
        half_width: f64,
        /// Height of each, from the rim.
        depth: f64,
    },
    /// Both rims all round, this deep.
    Rims {
        /// How deep the rims are held.
        depth: f64,
    },
}

/// Why a limb cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LimbError {
    /// A parameter is out of its range.
    #[error("{what} must be {rule}, but is {value}")]
    Range {
        /// Which one.
        what: &'static str,
        /// What it must be.
        rule: &'static str,
        /// What it is.
        value: f64,
    },
    /// Hoops overlap, or leave no window.
    #[error(
        "hoops must lie one above the other between 0 and the height, with windows between them"
    )]
    Hoops,
    /// Columns overlap, or leave no window.
    #[error("columns must lie apart from each other around the limb, with windows between them")]
    Columns,
}

impl Default for LimbSpec {
    /// The bundled limb.
    fn default() -> Self {
        Self {
            circumference: 200.0,
            arc_degrees: 360.0,
            height: 120.0,
            taper: 1.0,
            columns: vec![20.0, 70.0, 130.0, 180.0],
            column_width: 12.0,
            hoops: vec![
                (0.0, 10.0),
                (27.0, 37.0),
                (55.0, 65.0),
                (83.0, 93.0),
                (110.0, 120.0),
            ],
            support: LimbSupport::Bosses {
                centres: vec![70.0, 130.0],
                half_width: 6.0,
                depth: 5.0,
            },
            corner_radius: 0.0,
            element: 2.5,
        }
    }
}

/// A supported patch, in mm: the box that holds exactly its part of the surface.
pub type BoxMm = [[f64; 3]; 2];

impl LimbSpec {
    /// A regular grid of windows: `columns` equal columns and `hoops` equal hoops, rims included.
    #[must_use]
    pub fn grid(&self, columns: usize, hoops: usize, hoop_width: f64) -> Self {
        let pitch = self.circumference / columns as f64;
        let step = (self.height - hoop_width) / (hoops.max(2) - 1) as f64;
        Self {
            columns: (0..columns).map(|i| (i as f64 + 0.5) * pitch).collect(),
            hoops: (0..hoops)
                .map(|j| (j as f64 * step, j as f64 * step + hoop_width))
                .collect(),
            ..self.clone()
        }
    }

    /// Whether it goes all the way round.
    #[must_use]
    pub fn closed(&self) -> bool {
        self.arc_degrees >= 360.0
    }

    /// Mid-surface radius at the bottom (mm).
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.circumference / self.arc_degrees.to_radians()
    }

    /// Unrolled patches (s from, s to, z from, z to) that are held.
    pub(super) fn support_patches(&self) -> Vec<[f64; 4]> {
        let ends = |depth: f64| [(0.0, depth), (self.height - depth, self.height)];
        match &self.support {
            LimbSupport::Rims { depth } => ends(*depth)
                .iter()
                .map(|&(z0, z1)| [0.0, self.circumference, z0, z1])
                .collect(),
            LimbSupport::Bosses {
                centres,
                half_width,
                depth,
            } => ends(*depth)
                .iter()
                .flat_map(|&(z0, z1)| {
                    centres
                        .iter()
                        .map(move |c| [c - half_width, c + half_width, z0, z1])
                })
                .collect(),
        }
    }
}
