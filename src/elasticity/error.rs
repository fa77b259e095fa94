//! Why a part cannot be computed.

use glam::DVec3;

use crate::budget::Cancelled;
use crate::plain;
use crate::units;

/// Why a model cannot be built or solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ElasticError {
    /// No support touches the part.
    #[error(
        "no triangle of the part is held by a support: move a support box onto the part, or where there is none write a project that has one, as in [[support]] kind = \"clamped\", box_mm = [[x, y, z], [x, y, z]] (the part lies between {:.1} and {:.1} mm)",
        units::mm(*lower),
        units::mm(*upper)
    )]
    NothingHeld {
        /// Lower corner of the part's box (m).
        lower: DVec3,
        /// Upper corner (m).
        upper: DVec3,
    },
    /// Supports leave a rigid motion.
    #[error(
        "the part can still move as a rigid body: the supports hold it, but not in every direction. Clamp it, or add supports"
    )]
    Loose,
    /// A piece of the part is not held.
    #[error(
        "the shell is not held anywhere near vertex {vertex} at {:.1} mm: join it to the rest or support it",
        units::mm(*place)
    )]
    NotHeld {
        /// A vertex of that piece.
        vertex: usize,
        /// Where it lies (m).
        place: DVec3,
    },
    /// A value is out of its range.
    #[error("{what} must be {rule}, but is {value}")]
    Value {
        /// Which value.
        what: &'static str,
        /// What it must be.
        rule: &'static str,
        /// What it is.
        value: f64,
    },
    /// Everything is held.
    #[error(
        "every point of the part is held, so nothing can deform: make the support boxes smaller"
    )]
    AllHeld,
    /// A facet has no area.
    #[error(
        "a triangle of the mesh near {:.1} mm has no area, so nothing can be computed on it: repair the mesh there (part.weld_mm joins what lies too close)",
        units::mm(*place)
    )]
    NoArea {
        /// Where it lies (m).
        place: DVec3,
    },
    /// A solid whose surface is not closed.
    #[error(
        "the mesh {}, or take it as a shell (part.model = \"shell\")",
        no_solid(*rims, *closes_within)
    )]
    Open {
        /// Its free edges.
        rims: usize,
        /// Distance (m) within which its vertices would have to be joined to close it, where that does.
        closes_within: Option<f64>,
    },
    /// Walls too thin for the cells to find.
    #[error(
        "no material was found in cells of {:.3} mm: the walls are thinner than a thousandth of that. Check the unit of the mesh, or take its middle as a shell (part.model = \"shell\")",
        units::mm(*size)
    )]
    NoMaterial {
        /// Size of the cells (m).
        size: f64,
    },
    /// No inside or no outside was found.
    #[error(
        "no {face} face was found on the part: paint it, so that it is known where gauges go and where touches land"
    )]
    NoFace {
        /// Which of the two.
        face: &'static str,
    },
    /// The factor would need more memory than may be taken.
    #[error(
        "the factored model would take {}, more than the {} that may be taken: choose a lower quality, lower budget.limits.vertices, mesh the part coarser where the file's own elements are taken, or allow more with --memory-gb",
        plain::needed(*needed),
        plain::allowed(*limit)
    )]
    TooLarge {
        /// How much it needs (bytes).
        needed: f64,
        /// How much may be taken (bytes).
        limit: f64,
    },
    /// The machine has no memory left.
    #[error(
        "the model does not fit into memory: choose a lower quality, lower budget.limits.vertices, or end other programs"
    )]
    OutOfMemory,
    /// The caller asked for a stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl ElasticError {
    /// Whether it is memory that was wanting.
    #[must_use]
    pub fn is_memory(&self) -> bool {
        matches!(self, Self::TooLarge { .. } | Self::OutOfMemory)
    }
}

/// Why it is no solid, and what helps.
fn no_solid(rims: usize, closes_within: Option<f64>) -> String {
    if rims == 0 {
        return "is closed, but behind much of its surface there is nothing: a vertex lies far off, facets look the wrong way round, or bodies lie within each other. Mend it in the program that wrote it".into();
    }
    format!(
        "encloses nothing (it has {}), so it is no solid: {} in the program that wrote it, fill its holes (part.fill_holes_mm)",
        plain::count(rims, "free edge"),
        closing(closes_within)
    )
}

/// How an open mesh is closed, by joining vertices within a distance (m) where that does.
fn closing(within: Option<f64>) -> String {
    let join = |metres: f64| {
        let mm = plain::digits(units::mm(metres));
        format!(
            "it closes when vertices within {mm} mm are joined (part.weld_mm = {mm}). Or close it"
        )
    };
    within.map_or_else(|| "close it".to_owned(), join)
}

/// A value that must obey a rule.
pub(super) fn range(
    what: &'static str,
    rule: &'static str,
    value: f64,
    ok: bool,
) -> Result<(), ElasticError> {
    if ok && value.is_finite() {
        Ok(())
    } else {
        Err(ElasticError::Value { what, rule, value })
    }
}
