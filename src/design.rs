//! The whole pipeline, stage by stage: simulate, filter, reduce, select, evaluate.
//!
//! Each stage is a pure function of the ones before it, so that a caller can keep what has not changed.

mod advise;
mod as_built;
mod by_hand;
mod choose;
pub mod curves;
mod doubt;
mod drawn;
mod filter;
mod finest;
mod ground;
mod in_hand;
mod inner_face;
mod inputs;
mod judge;
mod kept;
mod known;
mod layout;
mod meshed;
mod nearness;
mod on_supports;
mod pipeline;
mod presses;
mod pressing;
mod reduce;
mod reference;
mod refine;
mod request;
mod sensing;
mod shortage;
mod simulate;
pub mod simulated_board;
mod taught;
mod telling;
mod training;
mod walled;

use glam::DVec3;

use crate::budget::Cancelled;
use crate::elasticity::ElasticError;
use crate::placement::PlacementError;
use crate::plain;
use crate::project::BadValue;
use crate::units;

pub use self::advise::*;
pub use self::by_hand::judge_set;
pub use self::choose::*;
pub use self::doubt::*;
pub use self::drawn::PROPOSED;
pub use self::filter::filter;
pub use self::finest::*;
pub use self::ground::*;
pub use self::in_hand::*;
pub use self::inner_face::InnerFace;
pub use self::inputs::Inputs;
pub use self::judge::*;
pub use self::kept::*;
pub use self::known::expected_errors;
pub use self::layout::*;
pub use self::meshed::Meshed;
pub use self::nearness::*;
pub use self::on_supports::on_what_is_held;
pub use self::pipeline::*;
pub use self::presses::{Press, PressReadings};
pub use self::reduce::{Located, ReducedSites, reduce_sites};
pub use self::reference::Reference;
pub use self::refine::refine;
pub use self::request::DesignRequest;
pub use self::sensing::*;
pub use self::shortage::*;
pub use self::simulate::*;
pub use self::taught::*;
pub use self::telling::most_telling;
pub use self::training::*;
pub use self::walled::*;

/// Why a stage ended without a result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// A key of the project has a value out of its range.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// The elastic model cannot be built or solved.
    #[error(transparent)]
    Elastic(#[from] ElasticError),
    /// The selector found no set.
    #[error(transparent)]
    Placement(#[from] PlacementError),
    /// Fewer sites are feasible than gauges were asked for.
    #[error(transparent)]
    Shortage(#[from] Shortage),
    /// Too few touches to train on.
    #[error("{touches} touches are too few to learn from, which takes at least {least}: {remedy}")]
    TooFewTouches {
        /// How many there are.
        touches: usize,
        /// How many are needed.
        least: usize,
        /// What to do.
        remedy: String,
    },
    /// No touch lands on the part.
    #[error("no touch lands on the part: {remedy}")]
    NoTouches {
        /// What to do.
        remedy: String,
    },
    /// The lattice has more sites than can be handled.
    #[error(
        "{count} sites at a spacing of {spacing_mm} mm are more than the {limit} this version handles: widen sites.spacing_mm or check the unit of the mesh (the part is {:.0} mm across)",
        units::mm(*size)
    )]
    TooManySites {
        /// How many it would have.
        count: usize,
        /// The most there may be.
        limit: usize,
        /// The spacing asked for (mm).
        spacing_mm: f64,
        /// Diagonal of the part's box (m).
        size: f64,
    },
    /// A point that was given lies far from the part.
    #[error(
        "{what} {number} lies {} from the part, which is {} across: check the unit of the mesh and of the points (mm)",
        plain::length(*distance),
        plain::length(*size)
    )]
    OffThePart {
        /// A touch or a site.
        what: &'static str,
        /// Which one.
        number: usize,
        /// How far off it is (m).
        distance: f64,
        /// Diagonal of the part's box (m).
        size: f64,
    },
    /// A gauge's direction points out of the surface.
    #[error(
        "the direction of site {number} points {angle_deg:.0}° out of the surface: a gauge lies in it, give dx, dy, dz along it"
    )]
    AcrossTheWall {
        /// Which gauge.
        number: usize,
        /// Angle between direction and surface (degrees).
        angle_deg: f64,
    },
    /// No row of a table can be answered.
    #[error(
        "none of the {count} {what} can be answered: each is off the part or points out of its surface. Check the unit of the mesh and of the points (mm), and the directions"
    )]
    NothingLeft {
        /// Touches or sites.
        what: &'static str,
        /// How many there were.
        count: usize,
    },
    /// The wall of a shell is thicker than the part is wide.
    #[error(
        "the part is {:.3} mm across and its wall {thickness_mm:.3} mm thick: this is no shell. Check the unit of the mesh and part.thickness_mm",
        units::mm(*size)
    )]
    ThickerThanWide {
        /// Diagonal of the part's box (m).
        size: f64,
        /// Thickness of the wall (mm).
        thickness_mm: f64,
    },
    /// One vertex lies far from all others.
    #[error(
        "one vertex of the part, at {:.3} mm, lies {:.3} mm from all the others, which are {:.3} mm across: remove or move it in the program that wrote the mesh",
        units::mm(*place),
        units::mm(*distance),
        units::mm(*size)
    )]
    FarVertex {
        /// Where it is (m).
        place: DVec3,
        /// How far from the others (m).
        distance: f64,
        /// Diagonal of the others' box (m).
        size: f64,
    },
    /// The part is all long thin triangles.
    #[error(
        "the part is too slender for elements: its longest edge has {:.3} mm, and all of its surface {:.3} mm². Remove the long thin triangles in the program that wrote the mesh, or check for vertices in a wrong place",
        units::mm(*longest),
        units::mm2(*area)
    )]
    Slender {
        /// Its longest edge (m).
        longest: f64,
        /// Its area (m²).
        area: f64,
    },
    /// The unrolled part is too large for a lattice of this spacing.
    #[error(
        "unrolled about its axis the part is {:.0} mm round and {:.0} mm high, too much for sites every {spacing_mm} mm: choose sites.lattice = \"even\", another part.axis, or a wider sites.spacing_mm",
        units::mm(*round),
        units::mm(*high)
    )]
    WideLattice {
        /// Length around the axis (m).
        round: f64,
        /// Length along it (m).
        high: f64,
        /// The spacing asked for (mm).
        spacing_mm: f64,
    },
    /// The spacing is too wide for even one site.
    #[error(
        "no site fits on the part: {spacing_mm} mm (sites.spacing_mm) is too wide for a part of {:.3} mm across and {:.3} mm². Lower it to less than {:.3}, or check the unit of the mesh",
        units::mm(*size),
        units::mm2(*area),
        units::mm(area.sqrt())
    )]
    NoRoom {
        /// The spacing asked for (mm).
        spacing_mm: f64,
        /// Diagonal of the part's box (m).
        size: f64,
        /// Of the surface that gauges are glued to (m²), as wide as which one site fits.
        area: f64,
    },
    /// More memory would be needed than may be taken.
    #[error(
        "{} would be needed for {sites} sites × {touches} touches, more than the {} that may be taken: {}, or allow more with --memory-gb",
        plain::needed(*needed),
        plain::allowed(*limit),
        said_by.remedy()
    )]
    TooLarge {
        /// How much is needed (bytes).
        needed: f64,
        /// How much may be taken (bytes).
        limit: f64,
        /// Sites asked for.
        sites: usize,
        /// Touches asked for.
        touches: usize,
        /// Where these numbers come from, and so what to change.
        said_by: SaidBy,
    },
    /// The project has no chosen gauges.
    #[error(
        "the project has no gauges yet: place them in the studio, or with `hapdef design`, whose design.hapdef.toml has them"
    )]
    NoGauges,
    /// The caller asked for a stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl DesignError {
    /// Whether somebody asked for the stop.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Cancelled(_)
                | Self::Elastic(ElasticError::Cancelled(_))
                | Self::Placement(
                    PlacementError::Cancelled(_)
                        | PlacementError::Signals(crate::pca::PcaError::Cancelled(_))
                )
        )
    }
}

/// Who says how many sites and touches there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaidBy {
    /// The keys of the project.
    Project,
    /// Tables with a row each.
    Tables,
}

impl SaidBy {
    fn remedy(self) -> &'static str {
        match self {
            Self::Project => "lower touch.count, widen sites.spacing_mm",
            Self::Tables => "give fewer touches or sites at a time",
        }
    }
}

/// Below this neither folds nor held-out touches mean anything.
const LEAST_TOUCHES: usize = 20;
const MOST_SITES: usize = 50_000;
/// Vertices of the mesh that sites and touches are laid out on: the same for every quality.
pub const LAYOUT: usize = 3500;
/// Seeds of the independent draws, apart from each other.
const TEST_SEED: u64 = 0x7e57;
const NOISE_SEED: u64 = 0x0153;
const SELECTION_NOISE_SEED: u64 = 0x4ea8d;
const WORKSHOP_SEED: u64 = 0x30b0;
const PRESS_SEED: u64 = 0x94e55;
const MADE_SEED: u64 = 0x3ade;
