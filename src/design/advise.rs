//! Shell or solid: what the walls of a part say, and what each model would cost. The user decides.

use std::sync::Arc;

use serde::Serialize;

use super::layout::size_mm;
use super::{DesignError, Ground, Inputs, ground};
use crate::elasticity::ElasticError;
use crate::elasticity::solid::ground::SolidGround;
use crate::mesh::TriMesh;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::walls::Side;
use crate::project::PartModel;

/// What was measured of a part, and what follows.
#[derive(Clone, Debug, Serialize)]
pub struct Advice {
    /// Whether it encloses anything.
    pub closed: bool,
    /// Thickness (mm) that a tenth, half and nine tenths of the walls are thinner than; of an open part as its
    /// project says.
    pub wall_mm: [f64; 3],
    pub size_mm: f64,
    /// Share of a closed part's area that is the face of a wall, and not its end or a lump.
    pub walls: f64,
    /// What fits.
    pub fits: PartModel,
    /// The models that can be computed, with what they would cost.
    pub costs: Vec<Cost>,
    /// In words.
    pub words: Vec<String>,
    #[serde(skip)]
    pub faces: Option<Faces>,
}

/// What a model would cost at the project's quality.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    pub model: PartModel,
    pub unknowns: f64,
    /// Processor time (s), memory of the factor (GB), and error of the displacement under a touch (%), all as
    /// they were on other parts.
    pub seconds: f64,
    pub memory_gb: f64,
    pub error_percent: f64,
}

/// The faces of a closed part, by its vertices.
#[derive(Clone, Debug)]
pub struct Faces {
    pub sides: Vec<Side>,
    /// m; zero where there is no wall.
    pub thickness: Vec<f64>,
}

/// Looks at a part, whatever its project takes it for.
///
/// # Errors
/// [`DesignError`] for values out of range.
pub fn advise(inputs: &Inputs) -> Result<Advice, DesignError> {
    let mut as_solid = inputs.clone();
    as_solid.project.part.model = PartModel::Solid;
    match ground(&as_solid) {
        Ok(Ground::Solid(solid)) => Ok(of_closed(inputs, &solid)),
        Ok(Ground::Shell(_)) => unreachable!("a solid was asked for"),
        Err(DesignError::Elastic(ElasticError::Open { rims })) => Ok(of_open(inputs, rims)),
        Err(error) => Err(error),
    }
}

fn of_closed(inputs: &Inputs, solid: &SolidGround) -> Advice {
    let project = &inputs.project;
    let whole = &solid.whole;
    let wall_mm = [0.1, 0.5, 0.9].map(|s| 1e3 * solid.walls.thinner_than(whole, s));
    let size_mm = size_mm(&inputs.part);
    let faces = (0..whole.triangles().len() as u32)
        .filter(|&t| solid.walls.sides[t as usize] != Side::Rim)
        .map(|t| whole.facet_area(t))
        .sum::<f64>();
    let budget = project.budget.quality.budget();
    let touches = project.touch.count.min(budget.touches);
    let size = solid.size_allowed(&budget.elements, touches);
    let unknowns = solid.unknowns(size);
    let cost = Cost {
        model: PartModel::Solid,
        unknowns,
        seconds: seconds(unknowns, touches),
        memory_gb: memory_gb(unknowns),
        error_percent: solid.error_percent(size),
    };
    let mut words = vec![format!(
        "The mesh is closed, with walls {:.2} mm thick (a tenth thinner than {:.2} mm, a tenth thicker than {:.2} mm) on a part {size_mm:.0} mm across.",
        wall_mm[1], wall_mm[0], wall_mm[2]
    )];
    words.push(format!(
        "As a solid at {} quality: cells of {:.1} mm, about {:.0} thousand unknowns, {:.0} s of processor time, {:.1} GB, {:.0} % error under a touch.",
        budget.quality.name(),
        size * 1e3,
        unknowns / 1e3,
        cost.seconds,
        cost.memory_gb,
        cost.error_percent
    ));
    let thin = wall_mm[1] < size_mm / 50.0 && wall_mm[2] < 1.5 * wall_mm[1];
    words.push(if thin {
        "Its walls are thin and even: a mid-surface of it as a shell would be several times faster. As it is, taken as a shell, both faces of each wall would be walls of their own: a solid fits.".into()
    } else {
        "Taken as a shell, both faces of each wall would be walls of their own: a solid fits.".into()
    });
    Advice {
        closed: true,
        wall_mm,
        size_mm,
        walls: faces / whole.area(),
        fits: PartModel::Solid,
        costs: vec![cost],
        words,
        faces: Some(carried(&inputs.part, solid)),
    }
}

fn of_open(inputs: &Inputs, rims: usize) -> Advice {
    let project = &inputs.project;
    let budget = project.budget.quality.budget();
    let touches = project.touch.count.min(budget.touches);
    let unknowns = 6.0 * budget.elements.most_for(touches) as f64;
    let wall = project.part.thickness_mm;
    let size_mm = size_mm(&inputs.part);
    let cost = Cost {
        model: PartModel::Shell,
        unknowns,
        seconds: seconds(unknowns, touches),
        memory_gb: memory_gb(unknowns),
        error_percent: budget.elements.displacement_percent,
    };
    let mut words = vec![
        format!(
            "The mesh is open ({rims} free edges): it is the middle of a wall, {wall} mm thick on a part {size_mm:.0} mm across. A shell fits."
        ),
        format!(
            "As a shell at {} quality: at most {:.0} thousand unknowns, {:.0} s of processor time, {:.0} % error under a touch.",
            budget.quality.name(),
            unknowns / 1e3,
            cost.seconds,
            cost.error_percent
        ),
    ];
    if let Ok(Ground::Shell(shell)) = ground(inputs) {
        words.extend(shell.cautions(project.tip().1));
    }
    Advice {
        closed: false,
        wall_mm: [wall; 3],
        size_mm,
        walls: 1.0,
        fits: PartModel::Shell,
        costs: vec![cost],
        words,
        faces: None,
    }
}

/// Processor time (s) of a factor and its solves, as measured on limbs and shins.
fn seconds(unknowns: f64, touches: usize) -> f64 {
    /// Per unknown; and per unknown to the power 4/3 and touch.
    const BUILD: f64 = 2e-4;
    const SOLVE: f64 = 1.2e-8;
    BUILD * unknowns + SOLVE * unknowns.powf(4.0 / 3.0) * touches as f64
}

/// Memory of a factor (GB), as measured on limbs and shins.
fn memory_gb(unknowns: f64) -> f64 {
    const ENTRIES: f64 = 18.0;
    ENTRIES * unknowns.powf(4.0 / 3.0) * 8.0 / 1e9
}

/// Faces and thickness at the vertices of the part that is shown.
fn carried(part: &Arc<TriMesh>, solid: &SolidGround) -> Faces {
    let index = SurfaceIndex::new(&solid.whole);
    let (mut sides, mut thickness) = (Vec::new(), Vec::new());
    for (p, n) in part.positions().iter().zip(part.vertex_normals()) {
        // A little over the surface: thin walls have another face near.
        let at = index.nearest(*p + *n * (0.1 * solid.wall())).0.triangle as usize;
        sides.push(solid.walls.sides[at]);
        let t = solid.walls.thickness[at];
        thickness.push(if t.is_nan() { 0.0 } else { t });
    }
    Faces { sides, thickness }
}
