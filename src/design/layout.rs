//! Where sites and touches lie on the part, and whether all of it fits into memory: what cannot is refused before
//! anything is begun.

use glam::DVec3;
use rayon::prelude::*;

use super::{DesignError, Inputs, LAYOUT, MOST_SITES, SaidBy, TEST_SEED};
use crate::bounds::Bounds;
use crate::budget::Budget;
use crate::dataset::{self, GluingSlopes, Often, Signal, TouchPattern, TouchRegion};
use crate::elasticity::load::Touch;
use crate::memory;
use crate::mesh::reach::Finger;
use crate::mesh::unroll::Unrolling;
use crate::mesh::{Edge, SurfacePoint, TriMesh, sample};
use crate::project::{BadValue, PartModel, Project, SiteLattice};
use crate::units;

/// Most touches that the slopes of gluing are found for, evenly chosen: a variance needs no more.
pub const SLOPE_TOUCHES: usize = 1300;

/// Diagonal of a part's box (m).
pub(super) fn size(mesh: &TriMesh) -> f64 {
    let (lower, upper) = mesh.bounds();
    (upper - lower).length()
}

/// Refuses a part that no elements can be laid on: one with a vertex far away from all the others, or so slender
/// that elements of its own scale would never end along it.
///
/// # Errors
/// [`DesignError::FarVertex`], [`DesignError::Slender`].
pub fn check_shape(part: &TriMesh) -> Result<(), DesignError> {
    /// Elements along all edges of the part, each one counted for itself.
    const MOST_ALONG: f64 = 5e6;
    // An edge to a vertex far away has been halved into others that lie between.
    let part = part.before_halving();
    if let Some((place, distance, size)) = far_vertex(part) {
        return Err(DesignError::FarVertex {
            place,
            distance,
            size,
        });
    }
    let p = part.positions();
    let length = |e: &Edge| p[e.a as usize].distance(p[e.b as usize]);
    let rims: f64 = part.boundary_edges().map(length).sum();
    let vertices = LAYOUT as f64;
    let size = (part.area() / vertices).sqrt().max(rims / (2.0 * vertices));
    let edges = part.edges();
    let longest = edges.iter().map(length).fold(0.0, f64::max);
    let along: f64 = edges.iter().map(length).sum::<f64>() / size;
    if along - edges.len() as f64 > MOST_ALONG {
        return Err(DesignError::Slender {
            longest,
            area: part.area(),
        });
    }
    Ok(())
}

/// The one vertex that lies far away from all the others, how far, and the size of the rest (m).
fn far_vertex(part: &TriMesh) -> Option<(DVec3, f64, f64)> {
    /// In sizes of the rest: no point of a part is as sharp.
    const FAR: f64 = 50.0;
    let positions = part.positions();
    let mean = positions.iter().sum::<DVec3>() / positions.len() as f64;
    let from_mean = |v: &usize| positions[*v].distance_squared(mean);
    let farthest = (0..positions.len()).max_by(|a, b| from_mean(a).total_cmp(&from_mean(b)))?;
    let rest = positions.iter().enumerate().filter(|(v, _)| *v != farthest);
    let bounds = Bounds::around(rest.map(|(_, &p)| p));
    let size = bounds.size().length();
    let place = positions[farthest];
    let distance = place.distance(place.clamp(bounds.lower, bounds.upper));
    (distance > FAR * size).then_some((place, distance, size))
}

/// Refuses sites and touches that the area of a shell says will be too many, before it is worked on. How much of a
/// solid faces inward is only known later.
///
/// # Errors
/// [`DesignError::TooManySites`], [`DesignError::TooLarge`].
pub(super) fn check_foreseen(inputs: &Inputs, budget: &Budget) -> Result<(), DesignError> {
    if inputs.project.part.model == PartModel::Solid {
        return Ok(());
    }
    count_sites(&inputs.part, &inputs.project)?;
    let (sites, touches, _) = expected_size(inputs, budget);
    check_memory(sites, touches, inputs.project.gauge.signal)
}

/// How many places for sites there are on a mesh, about.
///
/// # Errors
/// [`DesignError::TooManySites`].
fn count_sites(mesh: &TriMesh, project: &Project) -> Result<usize, DesignError> {
    let spacing = project.sites.spacing();
    let places = mesh.area() / (spacing * spacing);
    let sites = places * project.gauge.directions as f64;
    if sites > MOST_SITES as f64 {
        return Err(DesignError::TooManySites {
            count: sites as usize,
            limit: MOST_SITES,
            spacing_mm: project.sites.spacing_mm,
            size: size(mesh),
        });
    }
    Ok(places.round() as usize)
}

/// The sites of a project on a mesh of its part.
///
/// # Errors
/// [`DesignError`] where there would be none or far too many.
pub fn lay_out_sites(mesh: &TriMesh, inputs: &Inputs) -> Result<Vec<SurfacePoint>, DesignError> {
    let project = &inputs.project;
    let count = count_sites(mesh, project)?;
    let points = match project.sites.lattice {
        SiteLattice::Even => sample::even(mesh, count, project.budget.seed, |_| true),
        SiteLattice::Unrolled => unrolled_sites(mesh, inputs)?,
    };
    if points.is_empty() {
        return Err(DesignError::NoRoom {
            spacing_mm: project.sites.spacing_mm,
            size: size(mesh),
            area: mesh.area(),
        });
    }
    // A place with several directions is as many sites.
    let directions = project.gauge.directions;
    Ok(points
        .into_iter()
        .flat_map(|at| std::iter::repeat_n(at, directions))
        .collect())
}

/// Sites in rows and columns about the axis.
fn unrolled_sites(mesh: &TriMesh, inputs: &Inputs) -> Result<Vec<SurfacePoint>, DesignError> {
    /// Places of the lattice that are looked at, whether the part is there or not.
    const MOST_PLACES: f64 = 5e6;
    let project = &inputs.project;
    let spacing = project.sites.spacing();
    let unrolling = Unrolling::of(mesh, inputs.stance());
    let round = unrolling.circumference();
    let high = unrolling.height.1 - unrolling.height.0;
    if (round / spacing) * (high / spacing) > MOST_PLACES {
        return Err(DesignError::WideLattice {
            round,
            high,
            spacing_mm: project.sites.spacing_mm,
        });
    }
    Ok(unrolling.lattice(mesh.index(), spacing))
}

pub(super) fn lay_out_touches(
    mesh: &TriMesh,
    inputs: &Inputs,
    budget: &Budget,
) -> Result<Vec<Touch>, DesignError> {
    /// Radius (m) of a tip that is a point: no element is as small.
    const POINT: f64 = 1e-6;
    let count = inputs.project.touch.count.min(budget.touches);
    let seed = inputs.project.budget.seed;
    let mut touches = touches_on(mesh, inputs, count, seed, (true, true))?;
    if budget.point_tip {
        for touch in &mut touches {
            touch.tip_radius = touch.tip_radius.min(POINT);
        }
    }
    Ok(touches)
}

/// The touches that designs are judged on, on the surface of the judge's elements: drawn uniformly at random with a seed
/// of their own, so that they lie off any node and are nobody's training touches.
pub(super) fn test_touches(
    surface: &TriMesh,
    inputs: &Inputs,
    count: usize,
) -> Result<Vec<Touch>, DesignError> {
    let seed = inputs.project.budget.seed.wrapping_add(TEST_SEED);
    touches_on(surface, inputs, count, seed, (false, true))
}

/// Touches on a surface: evenly spread or drawn at random, and more of them where they come often if they are `weighed`.
///
/// # Errors
/// [`DesignError`] for masks that are not there, or where no touch comes.
pub(super) fn touches_on(
    mesh: &TriMesh,
    inputs: &Inputs,
    count: usize,
    seed: u64,
    (even, weighed): (bool, bool),
) -> Result<Vec<Touch>, DesignError> {
    let project = &inputs.project;
    let margin = project.touch.edge_margin();
    let mask = Project::mask("touch.region", project.touch.region.as_ref(), &inputs.masks)?;
    let index = inputs.part.index();
    let reached = reached_places(inputs)?;
    let contains = |p: DVec3| {
        mask.is_none_or(|mask| inputs.part.mostly_in(mask, index.nearest(p).0)) && reached(p)
    };
    let mut triangles = match mask {
        Some(mask) => near_mask(mesh, &inputs.part, mask),
        None => vec![true; mesh.triangles().len()],
    };
    if project.part.model == PartModel::Shell {
        // The outside of a solid is of reached facets already.
        keep_reached(mesh, &reached, &mut triangles);
    }
    let often = Project::mask("touch.often", project.touch.often.as_ref(), &inputs.masks)?;
    let often = often.filter(|_| weighed);
    let frequented =
        |p: DVec3| often.is_some_and(|mask| inputs.part.mostly_in(mask, index.nearest(p).0));
    let region = TouchRegion {
        triangles,
        contains: &contains,
        often: often.map(|mask| Often {
            triangles: near_mask(mesh, &inputs.part, mask),
            contains: &frequented,
            times: project.touch.often_times,
        }),
    };
    let pattern = TouchPattern {
        count,
        seed,
        margin,
        even,
        tip: project.tip(),
    };
    let touches = dataset::distribute_touches(mesh, &pattern, Some(&region));
    if touches.is_empty() {
        return Err(no_touches(mesh, inputs));
    }
    if often.is_some() && !touches.iter().any(|t| frequented(t.position)) {
        return Err(DesignError::Value(BadValue {
            key: "touch.often".into(),
            rule: "a region that touches come to, and not too small for one of them. Paint it where they land, or take it out".into(),
            value: project.touch.often.clone().unwrap_or_default(),
        }));
    }
    Ok(touches)
}

/// Whether the fingertip of a project gets to a place (m) of its part, or the user has said that it does.
///
/// # Errors
/// [`DesignError`] for a mask that is not there.
fn reached_places(inputs: &Inputs) -> Result<impl Fn(DVec3) -> bool + Sync, DesignError> {
    let (project, part) = (&inputs.project, &*inputs.part);
    let solid = project.part.model == PartModel::Solid;
    let outside = project.part.outside.as_ref().filter(|_| solid);
    let declared = Project::mask("part.outside", outside, &inputs.masks)?;
    let finger = Finger::new(part, project.fingertip());
    Ok(move |place: DVec3| {
        let at = part.index().nearest(place).0;
        let (point, normal) = (part.point(at), part.facet_normal(at.triangle));
        declared.is_some_and(|mask| part.mostly_in(mask, at))
            || finger.reaches(point, normal)
            // An open mid-surface faces as its file says: either side of it may be the outside.
            || !solid && finger.reaches(point, -normal)
    })
}

/// Leaves out the triangles that are out of reach in their middle and near all of their corners.
fn keep_reached(mesh: &TriMesh, reached: &(impl Fn(DVec3) -> bool + Sync), triangles: &mut [bool]) {
    /// How near to the corner.
    const NEAR: f64 = 0.9;
    let any_reached = |t: u32| {
        let corners = mesh.corners(t);
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        reached(middle) || corners.iter().any(|&c| reached(middle.lerp(c, NEAR)))
    };
    triangles
        .par_iter_mut()
        .enumerate()
        .filter(|(_, kept)| **kept)
        .for_each(|(t, kept)| *kept = any_reached(t as u32));
}

/// What keeps all touches away: the region that they are asked for, or the margin.
fn no_touches(mesh: &TriMesh, inputs: &Inputs) -> DesignError {
    /// Touches that are tried without the region.
    const TRIED: usize = 20;
    let project = &inputs.project;
    let (seed, margin_mm) = (project.budget.seed, project.touch.edge_margin_mm);
    let region = project.touch.region.as_ref();
    let pattern = TouchPattern {
        count: TRIED,
        seed,
        margin: project.touch.edge_margin(),
        even: false,
        tip: project.tip(),
    };
    let anywhere = || dataset::distribute_touches(mesh, &pattern, None);
    let mask = region.and_then(|name| inputs.masks.get(name));
    let remedy = if mask.is_some_and(|mask| !mask.contains(&true)) {
        "the region that touches come to (touch.region) is empty. Paint it, or take it out"
            .to_owned()
    } else if region.is_some() && !anywhere().is_empty() {
        format!(
            "the region that touches come to (touch.region) has no place farther than {margin_mm} mm (touch.edge_margin_mm) from a free edge, or lies where touches do not land. Widen it, or lower the margin"
        )
    } else if !anywhere().is_empty() {
        format!(
            "a fingertip of {} mm (touch.reach_mm) gets to none of its places from outside. Lower it, or see that the faces of the mesh look outward",
            project.touch.reach_mm
        )
    } else {
        format!(
            "every place lies nearer to a free edge than touch.edge_margin_mm ({margin_mm} mm). Lower it, or check the unit of the mesh (the part is {:.3} mm across)",
            units::mm(size(mesh))
        )
    };
    DesignError::NoTouches { remedy }
}

/// For each triangle of a mesh whether a mask of the part's vertices may reach into it: whether any of its
/// corners, middles of sides and centre lies on a triangle of the part with a vertex that is set.
fn near_mask(mesh: &TriMesh, part: &TriMesh, mask: &[bool]) -> Vec<bool> {
    let near = |p: DVec3| {
        let corners = part.triangles()[part.index().nearest(p).0.triangle as usize];
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

pub(super) fn check_memory(
    sites: usize,
    touches: usize,
    signal: Signal,
) -> Result<(), DesignError> {
    // Then the kernel of the evaluation and its distances, on every thread.
    let kernels = 2.0 * (touches as f64).powi(2) * rayon::current_num_threads() as f64;
    let most = simulation_numbers(sites, touches, signal).max(kernels);
    check_numbers(most, sites, touches, SaidBy::Project)
}

/// Memory of the strains and signals that a simulation holds at its largest (bytes).
pub(super) fn simulation_bytes(sites: usize, touches: usize, signal: Signal) -> f64 {
    bytes(simulation_numbers(sites, touches, signal))
}

/// Numbers in double precision that a simulation holds at its largest.
fn simulation_numbers(sites: usize, touches: usize, signal: Signal) -> f64 {
    // The signal itself beside what it is read from: the components of the strain, and of the displacement.
    let components = match signal {
        Signal::Strain => 3.0,
        Signal::Displacement | Signal::NormalDisplacement => 6.0,
    };
    // The strains are let go before gauges are read as they are glued.
    let glued = match signal {
        Signal::Strain => GluingSlopes::HELD * touches.min(SLOPE_TOUCHES) as f64,
        Signal::Displacement | Signal::NormalDisplacement => 0.0,
    };
    let (sites, touches) = (sites as f64, touches as f64);
    sites * (touches + glued.max(components * touches))
}

/// What a simulation will hold at its largest: about how many sites, how many touches, and the memory of
/// its strains and signals (bytes), known before anything is allocated. Of a solid about half of the surface faces
/// inward.
#[must_use]
pub fn expected_size(inputs: &Inputs, budget: &Budget) -> (usize, usize, f64) {
    let spacing = inputs.project.sites.spacing();
    let share = match inputs.project.part.model {
        PartModel::Solid => 0.5,
        PartModel::Shell => 1.0,
    };
    let places = (share * inputs.part.area() / (spacing * spacing)).round();
    let sites = (places * inputs.project.gauge.directions as f64) as usize;
    let touches = inputs.project.touch.count.min(budget.touches);
    let bytes = simulation_bytes(sites, touches, inputs.project.gauge.signal);
    (sites, touches, bytes)
}

/// Refuses a result of `each` numbers for every site and touch of two tables that cannot be held, before it is
/// allocated.
///
/// # Errors
/// [`DesignError::TooLarge`].
pub fn check_room(sites: usize, touches: usize, each: usize) -> Result<(), DesignError> {
    let numbers = sites as f64 * touches as f64 * each as f64;
    check_numbers(numbers, sites, touches, SaidBy::Tables)
}

fn check_numbers(
    numbers: f64,
    sites: usize,
    touches: usize,
    said_by: SaidBy,
) -> Result<(), DesignError> {
    let (needed, limit) = (bytes(numbers), memory::allowed());
    if needed > limit {
        return Err(DesignError::TooLarge {
            needed,
            limit,
            sites,
            touches,
            said_by,
        });
    }
    Ok(())
}

fn bytes(numbers: f64) -> f64 {
    numbers * size_of::<f64>() as f64
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::project::{Masks, Unit};

    #[test]
    fn what_is_held_is_the_larger_of_strains_and_glued_gauges() {
        let each = |touches: usize, signal| {
            let numbers = simulation_numbers(100, touches, signal);
            numbers / (100.0 * touches as f64)
        };
        assert_eq!(each(10_000, Signal::Strain), 4.0);
        assert_eq!(each(800, Signal::Strain), 1.0 + GluingSlopes::HELD);
        assert_eq!(each(800, Signal::Displacement), 7.0);
    }

    #[test]
    fn a_refusal_names_the_sites_that_were_given() {
        let refused = check_room(10_000_000, 4000, 24).unwrap_err();
        let DesignError::TooLarge { sites, touches, .. } = refused else {
            panic!("{refused}");
        };
        assert_eq!((sites, touches), (10_000_000, 4000));
        // What applies to tables, and not the keys that lay sites and touches out.
        let said = refused.to_string();
        assert!(said.contains("7680 GB"), "{said}");
        assert!(!said.contains("touch.count"), "{said}");
        assert!(said.contains("fewer touches or sites"), "{said}");
        let said = check_memory(40_000, 40_000_000, Signal::Strain).unwrap_err();
        assert!(said.to_string().contains("touch.count"), "{said}");
        assert!(check_room(10, 10, 24).is_ok());
    }

    #[test]
    fn a_vertex_far_away_is_named_where_the_edges_to_it_were_halved() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let (mut positions, mut triangles) = (square.to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        positions.push(DVec3::new(0.5, 1e4, 0.0));
        triangles.push([3, 2, 4]);
        let (part, _) = TriMesh::new(&positions, &triangles, 0).unwrap();
        let fine = part.with_long_edges_halved(1.0);
        assert!(fine.positions().len() > 1000);
        let said = check_shape(&fine).unwrap_err().to_string();
        assert!(said.contains("one vertex of the part"), "{said}");
    }

    #[test]
    fn a_hardly_bent_panel_is_not_unrolled_all_the_way_round() {
        const RADIUS: f64 = 300.0;
        let at = |column: i32, z: f64| {
            let angle = f64::from(column) * 0.1 / RADIUS;
            DVec3::new(RADIUS * angle.cos(), RADIUS * angle.sin(), z)
        };
        let positions: Vec<DVec3> = (-1..=1).flat_map(|k| [at(k, 0.0), at(k, 1.0)]).collect();
        let triangles = [[0, 2, 1], [2, 3, 1], [2, 4, 3], [4, 5, 3]];
        let (panel, _) = TriMesh::new(&positions, &triangles, 0).unwrap();
        let mut project = Project::around("panel.obj", Some(Unit::Metre));
        project.sites.spacing_mm = 4.0;
        project.sites.lattice = SiteLattice::Unrolled;
        let inputs = Inputs {
            project,
            part: Arc::new(panel.clone()),
            painted: None,
            masks: Masks::default(),
        };
        let refused = lay_out_sites(&panel, &inputs).unwrap_err();
        assert!(
            matches!(refused, DesignError::WideLattice { .. }),
            "{refused}"
        );
        assert!(check_shape(&panel).is_ok());
    }
}
