//! The part ready to be computed, as a shell or as a solid.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::layout::{check_shape, size};
use super::{DesignError, Inputs, LAYOUT, Meshed};
use crate::budget::{Cancelled, Watch};
use crate::elasticity::Model;
use crate::elasticity::estimate::{AccuracyTarget, Discretization};
use crate::elasticity::grade::{self, Graded};
use crate::elasticity::linearity::Linearity;
use crate::elasticity::model::LoadCheck;
use crate::elasticity::shell::check_section;
use crate::elasticity::solid::ground::SolidGround;
use crate::feasible::SiteSurroundings;
use crate::mesh::walls::WallSide;
use crate::mesh::winding::Winding;
use crate::mesh::{SurfacePoint, TriMesh};
use crate::plain;
use crate::project::{ElementKind, PartModel, Project};
use crate::units;

/// A part with its supports, ready to have elements laid on it or cells around it.
#[derive(Clone)]
pub enum Ground {
    /// A mid-surface, to be meshed with facets.
    Shell(Arc<grade::ShellGround>),
    /// A closed surface, to be immersed in cells.
    Solid(Arc<SolidGround>),
}

/// The elements, with the model built on them.
pub struct Built {
    /// What the model stands on.
    pub meshed: Meshed,
    /// The factored model.
    pub model: Box<dyn Model>,
    /// How far it is from converged.
    pub estimate: Discretization,
    /// Of a shell; a solid's is not estimated.
    pub linearity: Option<Linearity>,
    /// Whether memory did not hold as many elements as the budget would have allowed.
    pub is_short: bool,
    /// The worst balance of forces and energies over a sample of the loads.
    pub balance: LoadCheck,
    /// Assemblies and factorizations, and loads solved on the way here.
    pub models: u64,
    /// Loads solved on the way here.
    pub solves: u64,
}

/// The part with its supports, as its project means it.
///
/// # Errors
/// [`DesignError`] for supports without a region, and for parts that are not what the project says.
pub fn ground(inputs: &Inputs, watch: Watch) -> Result<Ground, DesignError> {
    let project = &inputs.project;
    let supports = project.supports(&inputs.masks)?;
    check_shape(&inputs.part)?;
    if project.part.model == PartModel::Solid {
        return Ok(Ground::Solid(Arc::new(solid_ground(inputs, watch)?)));
    }
    if project.part.thickness() > size(&inputs.part) {
        return Err(DesignError::ThickerThanWide {
            size: size(&inputs.part),
            thickness_mm: project.part.thickness_mm,
        });
    }
    let as_given = project.part.elements == ElementKind::AsGiven;
    let shell = grade::ShellGround::new(&inputs.part, project.section(), &supports, as_given);
    Ok(Ground::Shell(Arc::new(shell)))
}

/// The part as a solid, whatever its project takes it for.
///
/// # Errors
/// As [`ground`].
pub(super) fn solid_ground(inputs: &Inputs, watch: Watch) -> Result<SolidGround, DesignError> {
    let project = &inputs.project;
    let supports = project.supports(&inputs.masks)?;
    check_shape(&inputs.part)?;
    let declared_faces = declared_faces(inputs)?;
    let material = project.section().material;
    material.check()?;
    let fingertip = project.fingertip();
    let solid = SolidGround::touched_by(
        fingertip,
        &inputs.part,
        material,
        &supports,
        &declared_faces,
        watch,
    )?;
    Ok(solid)
}

/// What has to be known of a model that memory did not hold as it was asked for.
#[must_use]
pub fn short_of_memory(is_short: bool) -> Option<String> {
    is_short.then(|| {
        "Memory did not hold as many elements as this quality asks for: there are fewer. Allow more with --memory-gb.".into()
    })
}

/// What has to be known of a solid that touches move by so much of its size that small deformations are none; of a shell
/// its linearity says so.
#[must_use]
pub fn large_motion(
    part: &TriMesh,
    estimate: &Discretization,
    linearity: Option<&Linearity>,
) -> Option<String> {
    /// Of the part's size.
    const LARGE: f64 = 0.1;
    let moved_mm = 100.0 * estimate.displacement_mm / estimate.displacement_percent;
    let share = units::from_mm(moved_mm) / size(part);
    (linearity.is_none() && share > LARGE).then(|| {
        format!(
            "Touches move the part by about {}, {:.0} % of its size: the model is of small deformations, and says nothing there. Check the force, the material, the unit of the mesh and what is held.",
            plain::length(units::from_mm(moved_mm)),
            100.0 * share
        )
    })
}

/// What has to be known of a tip (its radius, m) that is larger than the part: nobody means that, but it can be computed.
#[must_use]
pub fn wide_tip(part: &TriMesh, tip_radius: f64) -> Option<String> {
    let size = size(part);
    (tip_radius > size).then(|| {
        format!(
            "A tip of {} in radius is larger than the part, which is {} across: it presses all that faces it. Check the unit of the mesh and the tip's radius (mm).",
            plain::length(tip_radius),
            plain::length(size)
        )
    })
}

/// What has to be known of a solid whose surface is not closed; its inside is guessed at there.
#[must_use]
pub fn open_solid(inputs: &Inputs) -> Option<String> {
    let solid = inputs.project.part.model == PartModel::Solid;
    let open = inputs.part.as_given().boundary_edges().count();
    (solid && open > 0).then(|| {
        format!(
            "The part is taken as a solid, and {open} edges of its surface are open: what lies behind its holes and seams is a guess. Fill or join them (part.fill_holes_mm, part.weld_mm), or close them in the program that wrote it."
        )
    })
}

/// What has to be known of a solid whose own tetrahedra have outer faces within others.
#[must_use]
pub fn overlapping_tetrahedra(inputs: &Inputs) -> Option<String> {
    /// How far in front of a face it is asked what is there, in roots of its area.
    const BEFORE: f64 = 1e-3;
    let solid = inputs.project.part.model == PartModel::Solid;
    let part = inputs.part.as_given();
    if !solid || part.volume().is_none() {
        return None;
    }
    let winding = Winding::new(part);
    let is_within = |&facet: &u32| {
        let [a, b, c] = part.corners(facet);
        let before = part.facet_normal(facet) * BEFORE * part.facet_area(facet).sqrt();
        winding.at((a + b + c) / 3.0 + before) > 0.5
    };
    let facets = (0..part.triangles().len() as u32).into_par_iter();
    let within = facets.filter(is_within).count();
    (within > 0).then(|| {
        format!(
            "{} within other elements: where tetrahedra overlap the part is too stiff, and where bodies lie against each other without being joined nothing passes between them. Mend the mesh in the program that wrote it.",
            plain::either(
                within,
                "outer face of the tetrahedra lies",
                "outer faces of the tetrahedra lie"
            )
        )
    })
}

/// What the user has said of the faces of a solid, by place (m).
fn declared_faces(
    inputs: &Inputs,
) -> Result<impl Fn(DVec3) -> Option<WallSide> + use<>, DesignError> {
    let part = Arc::clone(&inputs.part);
    let keys = &inputs.project.part;
    let mask = |key: &str, name: Option<&String>| {
        Project::mask(key, name, &inputs.masks).map(Option::<&Arc<Vec<bool>>>::cloned)
    };
    let inside = mask("part.inside", keys.inside.as_ref())?;
    let outside = mask("part.outside", keys.outside.as_ref())?;
    let is_said = inside.is_some() || outside.is_some();
    Ok(move |place: DVec3| {
        if !is_said {
            return None;
        }
        let at = part.index().nearest(place).0;
        let set = |mask: &Option<Arc<Vec<bool>>>| {
            mask.as_ref().is_some_and(|mask| part.mostly_in(mask, at))
        };
        match (set(&inside), set(&outside)) {
            (true, _) => Some(WallSide::Inside),
            (_, true) => Some(WallSide::Outside),
            _ => None,
        }
    })
}

impl Ground {
    /// What elements were laid on.
    #[must_use]
    pub fn of(meshed: &Meshed) -> Self {
        match meshed {
            Meshed::Shell(shell, _) => Self::Shell(Arc::clone(shell)),
            Meshed::Solid(solid, _) => Self::Solid(Arc::clone(solid)),
        }
    }

    /// Refuses at once what cannot be computed at all: a part that nothing holds is the likeliest mistake.
    ///
    /// # Errors
    /// [`DesignError`] saying what is wrong.
    pub fn check(&self, project: &Project) -> Result<(), DesignError> {
        check_section(&project.section())?;
        if let Self::Shell(shell) = self {
            shell.check_held()?;
        }
        Ok(())
    }

    /// The mesh that sites are laid out on, the same for every quality: the part, or where its triangles are
    /// too thin to measure distances on, even ones on its surface; of a solid the inside.
    #[must_use]
    pub fn site_layout(&self) -> Arc<TriMesh> {
        match self {
            Self::Shell(shell) => even_enough(shell),
            Self::Solid(solid) => Arc::clone(&solid.inside),
        }
    }

    /// As [`Self::site_layout`], for touches.
    #[must_use]
    pub fn touch_layout(&self) -> Arc<TriMesh> {
        match self {
            Self::Shell(shell) => even_enough(shell),
            Self::Solid(solid) => Arc::clone(&solid.outside),
        }
    }

    /// What lies before and behind points of the surface that gauges are glued to; a shell is all wall.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn surroundings(
        &self,
        points: &[SurfacePoint],
        watch: Watch,
    ) -> Result<Option<SiteSurroundings>, Cancelled> {
        let Self::Solid(solid) = self else {
            return Ok(None);
        };
        Ok(Some(SiteSurroundings {
            behind: solid.behind(points),
            room: solid.room(points, watch)?,
        }))
    }

    /// How thick the walls of a solid usually are, as measured (m).
    #[must_use]
    pub fn usual_wall(&self) -> Option<f64> {
        match self {
            Self::Shell(_) => None,
            Self::Solid(solid) => Some(solid.reach.usual).filter(|usual| usual.is_finite()),
        }
    }

    /// What of the part is neither touched nor glued to, in plain words.
    #[must_use]
    pub fn left_out(&self, surroundings: Option<&SiteSurroundings>) -> Vec<String> {
        let Self::Solid(solid) = self else {
            return Vec::new();
        };
        let mut words = solid.reach.words(solid.fingertip);
        if surroundings.is_some_and(SiteSurroundings::are_closed) {
            words.push(
                "No pad can be brought to the inside from outside: it is taken that gauges are glued before the part is closed.".into(),
            );
        }
        words
    }

    /// A mesh of about one edge length (m) where touches land.
    #[must_use]
    pub fn of_size(&self, size: f64) -> Arc<TriMesh> {
        match self {
            Self::Shell(shell) => shell.of_size(size).mesh,
            Self::Solid(solid) => solid.outside_of_size(size),
        }
    }

    /// Area where touches land (m²).
    #[must_use]
    pub fn area(&self) -> f64 {
        match self {
            Self::Shell(shell) => shell.area(),
            Self::Solid(solid) => solid.outside.area(),
        }
    }

    /// Elements for these touches, finer until the error is small enough or the budget spent. Few touches may have
    /// more elements than many: where memory does not hold those, half as many, and so on, which [`Built::is_short`] says.
    ///
    /// # Errors
    /// [`DesignError`] for what cannot be computed.
    pub fn build(&self, target: &AccuracyTarget, watch: Watch) -> Result<Built, DesignError> {
        /// Vertices of a model that says anything at all.
        const LEAST: usize = 400;
        let mut aim = *target.aim;
        let mut is_short = false;
        loop {
            let most = aim.most_for(target.count);
            let target = AccuracyTarget {
                aim: &aim,
                ..*target
            };
            match self.build_within(&target, watch) {
                Err(DesignError::Elastic(error)) if error.is_memory() && most > LEAST => {
                    aim.most_vertices = (most / 2).max(LEAST);
                    aim.vertices = aim.vertices.min(aim.most_vertices);
                    is_short = true;
                }
                built => {
                    return built.map(|built| Built {
                        is_short: is_short || built.is_short,
                        ..built
                    });
                }
            }
        }
    }

    fn build_within(&self, target: &AccuracyTarget, watch: Watch) -> Result<Built, DesignError> {
        match self {
            Self::Shell(shell) => {
                let Graded {
                    remeshed,
                    model,
                    estimate,
                    linearity,
                    balance,
                    models,
                    solves,
                    ..
                } = shell.grade(target, watch)?;
                Ok(Built {
                    meshed: Meshed::Shell(Arc::clone(shell), remeshed),
                    model: Box::new(model),
                    estimate,
                    linearity: Some(linearity),
                    is_short: false,
                    balance,
                    models,
                    solves,
                })
            }
            Self::Solid(solid) => {
                let graded = solid.grade(target, watch)?;
                Ok(Built {
                    meshed: Meshed::Solid(Arc::clone(solid), graded.fineness),
                    model: Box::new(graded.model),
                    estimate: graded.estimate,
                    linearity: None,
                    is_short: graded.is_short,
                    balance: graded.balance,
                    models: graded.models,
                    solves: graded.solves,
                })
            }
        }
    }

    /// A model that is quick to have.
    ///
    /// # Errors
    /// [`DesignError`] for what cannot be computed.
    pub fn quick(&self, watch: Watch) -> Result<Box<dyn Model>, DesignError> {
        /// Unknowns of a solid.
        const UNKNOWNS: f64 = 18_000.0;
        let meshed = match self {
            Self::Shell(shell) => Meshed::Shell(Arc::clone(shell), shell.even(LAYOUT)),
            Self::Solid(solid) => {
                let fineness = solid.fineness(solid.size_for(UNKNOWNS));
                Meshed::Solid(Arc::clone(solid), fineness)
            }
        };
        meshed.model(watch)
    }
}

/// The part, or where too much of it lies in facets that distances cannot be measured on, even ones on its surface.
fn even_enough(ground: &grade::ShellGround) -> Arc<TriMesh> {
    /// Share of the area that may lie in such facets.
    const SHARE: f64 = 0.02;
    let part = ground.part();
    let rim = part.boundary_vertices();
    let size = size(part);
    let unfit: f64 = (0..part.triangles().len() as u32)
        .filter(|&t| is_thin(part, t) || is_blind(part, t, &rim, size))
        .map(|t| part.facet_area(t))
        .sum();
    if unfit < SHARE * part.area() {
        ground.in_order()
    } else {
        ground.even(LAYOUT).mesh
    }
}

fn is_thin(part: &TriMesh, t: u32) -> bool {
    /// Height over length.
    const THIN: f64 = 0.1;
    part.thinness(t) < THIN
}

/// Whether a facet is large, and all its corners lie on free edges: between them everything then seems to be at an
/// edge, as on a plate of two triangles.
fn is_blind(part: &TriMesh, t: u32, rim: &[bool], size: f64) -> bool {
    /// Radius of the circle in it over the size of the part.
    const LARGE: f64 = 0.05;
    let corners = part.corners(t);
    let around: f64 = (0..3)
        .map(|i| corners[i].distance(corners[(i + 1) % 3]))
        .sum();
    let on_rim = part.triangles()[t as usize]
        .iter()
        .all(|&v| rim[v as usize]);
    on_rim && 2.0 * part.facet_area(t) > LARGE * size * around
}
