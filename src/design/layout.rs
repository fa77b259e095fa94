//! Where sites and touches lie on the part, and whether all of it fits into memory.

use glam::DVec3;

use super::{DesignError, Inputs, MOST_SITES};
use crate::budget::Budget;
use crate::dataset::{self, TouchRegion};
use crate::elasticity::load::Touch;
use crate::memory;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::unroll::Unrolling;
use crate::mesh::{SurfacePoint, TriMesh, sample};
use crate::project::{Lattice, Project};

pub(super) fn size_mm(mesh: &TriMesh) -> f64 {
    let (lower, upper) = mesh.bounds();
    (upper - lower).length() * 1000.0
}

/// The sites of a project on a mesh.
///
/// # Errors
/// [`DesignError`] where there would be none or far too many.
pub fn lay_out_sites(mesh: &TriMesh, project: &Project) -> Result<Vec<SurfacePoint>, DesignError> {
    let spacing = project.sites.spacing_mm * 1e-3;
    let estimate = mesh.area() / (spacing * spacing);
    let directions = project.gauge.directions;
    if estimate * directions as f64 > MOST_SITES as f64 {
        return Err(DesignError::TooManySites {
            count: estimate as usize * directions,
            limit: MOST_SITES,
            spacing_mm: project.sites.spacing_mm,
            size_mm: size_mm(mesh),
        });
    }
    let points = match project.sites.lattice {
        Lattice::Even => sample::even(mesh, estimate.round() as usize, project.budget.seed, |_| {
            true
        }),
        Lattice::Unrolled => {
            Unrolling::of(mesh, project.part.axis).lattice(&SurfaceIndex::new(mesh), spacing)
        }
    };
    if points.is_empty() {
        let area_mm2 = mesh.area() * 1e6;
        return Err(DesignError::NoRoom {
            spacing_mm: project.sites.spacing_mm,
            size_mm: size_mm(mesh),
            area_mm2,
            fits_mm: area_mm2.sqrt(),
        });
    }
    // A place with several directions is as many sites.
    Ok(points
        .into_iter()
        .flat_map(|at| std::iter::repeat_n(at, directions))
        .collect())
}

pub(super) fn lay_out_touches(
    mesh: &TriMesh,
    inputs: &Inputs,
    budget: &Budget,
) -> Result<Vec<Touch>, DesignError> {
    /// Radius (m) of a tip that is a point: no element is as small.
    const POINT: f64 = 1e-6;
    let count = inputs.project.touch.count.min(budget.touches);
    let mut touches = touches_on(mesh, inputs, count, inputs.project.budget.seed, true)?;
    if budget.point_tip {
        for touch in &mut touches {
            touch.tip_radius = touch.tip_radius.min(POINT);
        }
    }
    Ok(touches)
}

pub(super) fn touches_on(
    mesh: &TriMesh,
    inputs: &Inputs,
    count: usize,
    seed: u64,
    even: bool,
) -> Result<Vec<Touch>, DesignError> {
    let project = &inputs.project;
    let margin = project.touch.edge_margin_mm * 1e-3;
    let region = Project::mask("touch.region", project.touch.region.as_ref(), &inputs.masks)?;
    let index = region.map(|mask| (SurfaceIndex::new(&inputs.part), mask));
    let contains = |p: DVec3| {
        (index.as_ref()).is_none_or(|(index, mask)| inputs.part.mostly_in(mask, index.nearest(p).0))
    };
    let region = index.as_ref().map(|(index, mask)| TouchRegion {
        triangles: near_mask(mesh, &inputs.part, index, mask),
        contains: &contains,
    });
    let tip = project.tip();
    let touches = dataset::spread_touches(mesh, count, seed, margin, even, tip, region.as_ref());
    if touches.is_empty() {
        return Err(no_touches(mesh, inputs));
    }
    Ok(touches)
}

/// What keeps all touches away: the region that they are asked for, or the margin.
fn no_touches(mesh: &TriMesh, inputs: &Inputs) -> DesignError {
    /// Touches that are tried without the region.
    const TRIED: usize = 20;
    let project = &inputs.project;
    let (seed, margin_mm) = (project.budget.seed, project.touch.edge_margin_mm);
    let region = project.touch.region.as_ref();
    let anywhere = || {
        dataset::spread_touches(
            mesh,
            TRIED,
            seed,
            margin_mm * 1e-3,
            false,
            project.tip(),
            None,
        )
    };
    let mask = region.and_then(|name| inputs.masks.get(name));
    let remedy = if mask.is_some_and(|mask| !mask.contains(&true)) {
        "the region that touches come to (touch.region) is empty. Paint it, or take it out"
            .to_owned()
    } else if region.is_some() && !anywhere().is_empty() {
        format!(
            "the region that touches come to (touch.region) has no place farther than {margin_mm} mm (touch.edge_margin_mm) from a free edge, or lies where touches do not land. Widen it, or lower the margin"
        )
    } else {
        format!(
            "every place lies nearer to a free edge than touch.edge_margin_mm ({margin_mm} mm). Lower it, or check the unit of the mesh (the part is {:.3} mm across)",
            size_mm(mesh)
        )
    };
    DesignError::NoTouches { remedy }
}

/// For each triangle of a mesh whether a mask of the part's vertices may reach into it: whether any of its
/// corners, middles of sides and centre lies on a triangle of the part with a vertex that is set.
fn near_mask(mesh: &TriMesh, part: &TriMesh, index: &SurfaceIndex, mask: &[bool]) -> Vec<bool> {
    let near = |p: DVec3| {
        let corners = part.triangles()[index.nearest(p).0.triangle as usize];
        corners.iter().any(|&v| mask[v as usize])
    };
    (0..mesh.triangles().len() as u32)
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            let sides = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
            let places = [a, b, c, (a + b + c) / 3.0].into_iter().chain(sides);
            { places }.any(near)
        })
        .collect()
}

pub(super) fn check_memory(sites: usize, touches: usize) -> Result<(), DesignError> {
    // The signal itself beside three strain components a site and touch; then the kernel of the
    // evaluation and its distances, on every thread.
    let kernels = 2 * touches * touches * rayon::current_num_threads();
    check_room(4 * sites, touches)?;
    check_room(kernels.div_ceil(touches.max(1)), touches).map_err(|error| match error {
        DesignError::TooLarge {
            needed_gb,
            limit_gb,
            touches,
            ..
        } => DesignError::TooLarge {
            needed_gb,
            limit_gb,
            sites,
            touches,
        },
        other => other,
    })
}

/// What a simulation will hold at its largest: about how many sites, how many touches, and the memory of
/// its strains and signals (GB), known before anything is allocated.
#[must_use]
pub fn expected_size(inputs: &Inputs, budget: &Budget) -> (usize, usize, f64) {
    let spacing = inputs.project.sites.spacing_mm * 1e-3;
    let places = (inputs.part.area() / (spacing * spacing)).round() as usize;
    let sites = places * inputs.project.gauge.directions;
    let touches = inputs.project.touch.count.min(budget.touches);
    let bytes = 4.0 * sites as f64 * touches as f64 * size_of::<f64>() as f64;
    (sites, touches, bytes / 1e9)
}

/// Refuses a dense result of `rows` × `columns` that cannot be held, before it is allocated.
///
/// # Errors
/// [`DesignError::TooLarge`].
pub fn check_room(rows: usize, columns: usize) -> Result<(), DesignError> {
    let needed_gb = rows as f64 * columns as f64 * size_of::<f64>() as f64 / 1e9;
    if needed_gb > memory::allowed_gb() {
        return Err(DesignError::TooLarge {
            needed_gb,
            limit_gb: memory::allowed_gb(),
            sites: rows / 4,
            touches: columns,
        });
    }
    Ok(())
}
