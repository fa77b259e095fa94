//! Shell or solid: what the walls of a part say, and what each model would cost. The user decides.

mod cost;

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use self::cost::Workload;
use super::ground::solid_ground;
use super::layout::size;
use super::{DesignError, Ground, Inputs, ground};
use crate::budget::Watch;
use crate::elasticity::estimate::AccuracyTarget;
use crate::elasticity::solid::ground::{Foreseen, SolidGround};
use crate::elasticity::solid::sizing::PartMeasures;
use crate::elasticity::{ElasticError, Touch, scope};
use crate::mesh::TriMesh;
use crate::mesh::sample;
use crate::mesh::walls::WallSide;
use crate::plain::{self, digits};
use crate::project::PartModel;
use crate::units;

pub use self::cost::Cost;

/// Cells that are this many times as wrong as a shell do not fit.
const MUCH: f64 = 3.0;
/// A shell that leaves out more than this (%) is the wrong model.
const MOST_THEORY: f64 = 5.0;

/// What was measured of a part, and what follows.
#[derive(Clone, Debug, Serialize)]
pub struct Advice {
    /// Whether it encloses anything.
    pub closed: bool,
    /// Thickness (m) that a tenth, half and nine tenths of the walls are thinner than; of an open part as its
    /// project says.
    #[serde(rename = "wall_mm", serialize_with = "units::all_as_mm")]
    pub wall: [f64; 3],
    /// Radius (m) that a tenth and half of the walls are bent tighter than; infinite where they are flat.
    #[serde(rename = "radius_mm", serialize_with = "units::all_as_mm")]
    pub radius: [f64; 2],
    /// Diagonal of the part's box (m).
    #[serde(rename = "size_mm", serialize_with = "units::as_mm")]
    pub size: f64,
    /// Share of a closed part's area that is the face of a wall, and not its end or a lump.
    pub walls: f64,
    /// What fits.
    pub fits: PartModel,
    /// What the shell and the solid would cost.
    pub costs: [Cost; 2],
    /// In words.
    pub words: Vec<String>,
    /// What each vertex belongs to; absent for an open part.
    #[serde(skip)]
    pub faces: Option<Faces>,
}

/// The faces of a closed part, by its vertices.
#[derive(Clone, Debug)]
pub struct Faces {
    /// The side of its wall that each vertex is on.
    pub sides: Vec<WallSide>,
    /// m; zero where there is no wall.
    pub thickness: Vec<f64>,
}

/// Looks at a part, whatever its project takes it for.
///
/// # Errors
/// [`DesignError`] for values out of range, and when the watch asks for a stop.
pub fn advise(inputs: &Inputs, watch: Watch) -> Result<Advice, DesignError> {
    advise_on(inputs, true, watch)
}

/// As [`advise`] with nothing solved: faces and thickness. What a solid in cells would cost, and with it what fits, is as on
/// other parts, and stands in no words.
///
/// # Errors
/// As [`advise`].
pub fn advise_by_walls(inputs: &Inputs, watch: Watch) -> Result<Advice, DesignError> {
    advise_on(inputs, false, watch)
}

fn advise_on(inputs: &Inputs, solves: bool, watch: Watch) -> Result<Advice, DesignError> {
    let mut as_solid = inputs.clone();
    as_solid.project.part.model = PartModel::Solid;
    match solid_ground(&as_solid, watch) {
        Ok(solid) => of_closed(inputs, &solid, solves, watch),
        // What is closed and yet encloses nothing is neither.
        Err(DesignError::Elastic(ElasticError::Open { rims, .. })) if rims > 0 => {
            Ok(of_open(inputs, rims, watch))
        }
        Err(error) => Err(error),
    }
}

/// What the elements of a closed part would cost, and why their error could not be computed where that is so.
fn of_solid(
    asked: &Workload,
    inputs: &Inputs,
    solid: &SolidGround,
    watch: Watch,
) -> Result<(Cost, Option<String>), DesignError> {
    /// Touches and places that the error is looked at with.
    const TOUCHES: usize = 24;
    const PLACES: usize = 120;
    let (force, tip_radius) = inputs.project.tip();
    let (outside, inside) = (&solid.outside, &solid.inside);
    let touch = |at| Touch {
        position: outside.point(at),
        normal: outside.normal(at),
        force,
        tip_radius,
    };
    let on_outside = sample::random(outside, TOUCHES, 1, |_| true);
    let touches: Vec<Touch> = on_outside.into_iter().map(touch).collect();
    let on_inside = sample::random(inside, PLACES, 2, |_| true);
    let places: Vec<DVec3> = on_inside.into_iter().map(|at| inside.point(at)).collect();
    let sites = sites(inputs, solid);
    let order = |foreseen: &Foreseen| solid.has_tetrahedra().then_some(foreseen.order);
    let target = AccuracyTarget {
        count: asked.touches,
        ..AccuracyTarget::new(&touches, &places, &asked.budget.elements)
    };
    match solid.foresee(&target, watch) {
        Ok(foreseen) => Ok((asked.looked_at(&foreseen, order(&foreseen), sites), None)),
        Err(stop @ ElasticError::Cancelled(_)) => Err(stop.into()),
        Err(why) => Ok((asked.unsolved(solid, sites), Some(why.to_string()))),
    }
}

/// About how many sites lie on the inside.
fn sites(inputs: &Inputs, solid: &SolidGround) -> f64 {
    let spacing = inputs.project.sites.spacing();
    solid.inside.area() / (spacing * spacing)
}

fn of_closed(
    inputs: &Inputs,
    solid: &SolidGround,
    solves: bool,
    watch: Watch,
) -> Result<Advice, DesignError> {
    let whole = &solid.whole;
    let wall = [0.1, 0.5, 0.9].map(|s| solid.walls.thinner_than(whole, s));
    let is_face = |t: u32| solid.walls.sides[t as usize] != WallSide::Rim;
    let faces: Vec<u32> = (0..whole.triangles().len() as u32)
        .filter(|&t| is_face(t))
        .collect();
    let area: f64 = faces.iter().map(|&t| whole.facet_area(t)).sum();
    let radius = scope::radii(whole, &faces, solid.wall());
    let asked = Workload::new(inputs, area / 2.0, radius[0], solid.measures());
    let (cells, why) = if solves {
        of_solid(&asked, inputs, solid, watch)?
    } else {
        (asked.unsolved(solid, sites(inputs, solid)), None)
    };
    let costs = [asked.shell(), cells];
    let [shell, cells] = &costs;
    // The user's own tetrahedra follow the walls, whatever those are.
    let fits = if cells.order.is_none() && cells.total() > MUCH * shell.total() {
        PartModel::Shell
    } else {
        PartModel::Solid
    };
    let mut words = vec![
        format!(
            "The mesh is closed{}, with walls {} mm thick (a tenth thinner than {} mm, a tenth thicker than {} mm){} on a part {} mm across.",
            open_edges(inputs.part.as_given()),
            digits(units::mm(wall[1])),
            digits(units::mm(wall[0])),
            digits(units::mm(wall[2])),
            bent(radius),
            digits(units::mm(size(&inputs.part)))
        ),
        format!(
            "As a solid at {} quality: {}.",
            asked.budget.quality.name(),
            cells.words()
        ),
        format!("Its middle, as a shell: {}.", shell.words()),
        if fits == PartModel::Shell {
            "A shell fits: the walls are too thin for cells. Draw the middle of the walls in the program that wrote the part and open that; as it is, taken as a shell, both faces of each wall would be walls of their own.".into()
        } else {
            "As it is a solid fits: taken as a shell, both faces of each wall would be walls of their own.".into()
        },
    ];
    if !solves {
        // Told from other parts, they may say the opposite of what solving says.
        words.truncate(1);
        words.push("What a shell and a solid would cost, and which of them fits, has not been looked at for the part as it is: ask again (Shell or solid?, F4).".into());
    }
    if let Some(why) = why {
        let hedge = match cells.order {
            Some(_) => "",
            None => "; its figures are those of other parts",
        };
        words.push(format!(
            "As a solid it could not be computed yet{hedge}: {why}."
        ));
    }
    Ok(Advice {
        closed: true,
        wall,
        radius,
        size: size(&inputs.part),
        walls: area / whole.area(),
        fits,
        costs,
        words,
        faces: Some(carried(&inputs.part, solid)),
    })
}

fn of_open(inputs: &Inputs, rims: usize, watch: Watch) -> Advice {
    let project = &inputs.project;
    let part = inputs.part.as_given();
    let facets: Vec<u32> = (0..part.triangles().len() as u32).collect();
    let wall = project.part.thickness();
    let radius = scope::radii(part, &facets, wall);
    let asked = Workload::new(
        inputs,
        part.area(),
        radius[0],
        PartMeasures::of_wall(wall, 2.0 * part.area()),
    );
    let costs = [asked.shell(), asked.solid()];
    let [shell, cells] = &costs;
    let fits = if shell.theory_percent > MOST_THEORY && cells.total() < shell.total() {
        PartModel::Solid
    } else {
        PartModel::Shell
    };
    let mut words = vec![
        format!(
            "The mesh is open ({}): it is the middle of a wall, {} mm thick{}, on a part {} mm across.",
            plain::count(rims, "free edge"),
            digits(units::mm(wall)),
            bent(radius),
            digits(units::mm(size(part)))
        ),
        format!(
            "As a shell at {} quality: {}.",
            asked.budget.quality.name(),
            shell.words()
        ),
        format!("Its closed body, as a solid: {}.", cells.words()),
        if fits == PartModel::Solid {
            "The wall is thick for what it is bent to: its closed body, taken as a solid, would be nearer to the truth.".into()
        } else {
            "A shell fits.".into()
        },
    ];
    if inputs.project.part.model == PartModel::Solid {
        words.insert(1, refused(part, rims));
    } else {
        words.extend(meant_closed(part));
    }
    let mut as_shell = inputs.clone();
    as_shell.project.part.model = PartModel::Shell;
    if let Ok(Ground::Shell(shell)) = ground(&as_shell, watch) {
        words.extend(shell.cautions(project.tip().1));
    }
    Advice {
        closed: false,
        wall: [wall; 3],
        radius,
        size: size(part),
        walls: 1.0,
        fits,
        costs,
        words,
        faces: None,
    }
}

/// That the project asks for a solid, which it cannot have.
fn refused(part: &TriMesh, rims: usize) -> String {
    let why = ElasticError::Open {
        rims,
        closes_within: part.closes_within(),
    };
    format!("As a solid, which the project asks for, it is refused: {why}.")
}

/// What closes an open part, where joining near vertices does.
fn meant_closed(part: &TriMesh) -> Option<String> {
    let mm = digits(units::mm(part.closes_within()?));
    Some(format!(
        "If it is meant to be closed: it is when vertices within {mm} mm are joined (part.weld_mm = {mm})."
    ))
}

/// What keeps a mesh that is taken for a closed one from being it.
fn open_edges(part: &TriMesh) -> String {
    match part.boundary_edges().count() {
        0 => String::new(),
        open => format!(
            " but for {}: what lies behind its holes and seams is a guess (part.fill_holes_mm and part.weld_mm close some)",
            plain::either(open, "open edge", "open edges")
        ),
    }
}

fn bent(radius: [f64; 2]) -> String {
    if radius[0].is_finite() {
        format!(
            ", a tenth of them bent to less than {} mm",
            digits(units::mm(radius[0]))
        )
    } else {
        ", flat".into()
    }
}

/// Faces and thickness at the vertices of the part that is shown.
fn carried(part: &Arc<TriMesh>, solid: &SolidGround) -> Faces {
    let index = solid.whole.index();
    let (mut sides, mut thickness) = (Vec::new(), Vec::new());
    let over = 0.1 * solid.wall();
    for (p, n) in part.positions().iter().zip(part.vertex_normals()) {
        // A little over the surface: thin walls have another face near.
        let at = index.nearest(*p + *n * over).0.triangle as usize;
        sides.push(solid.walls.sides[at]);
        let t = solid.walls.thickness[at];
        thickness.push(if t.is_nan() { 0.0 } else { t });
    }
    Faces { sides, thickness }
}
