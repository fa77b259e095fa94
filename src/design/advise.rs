//! Shell or solid: what the walls of a part say, and what each model would cost. The user decides.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::ground::solid_ground;
use super::layout::size_mm;
use super::{DesignError, Ground, Inputs, SLOPE_TOUCHES, ground};
use crate::budget::{Budget, Watch};
use crate::elasticity::solid::ground::{Foreseen, SolidGround};
use crate::elasticity::solid::sizing::Shape;
use crate::elasticity::{ElasticError, Touch, scope};
use crate::mesh::TriMesh;
use crate::mesh::sample;
use crate::mesh::walls::Side;
use crate::plain::{self, digits};
use crate::project::PartModel;

/// What was measured of a part, and what follows.
#[derive(Clone, Debug, Serialize)]
pub struct Advice {
    /// Whether it encloses anything.
    pub closed: bool,
    /// Thickness (mm) that a tenth, half and nine tenths of the walls are thinner than; of an open part as its
    /// project says.
    pub wall_mm: [f64; 3],
    /// Radius (mm) that a tenth and half of the walls are bent tighter than; infinite where they are flat.
    pub radius_mm: [f64; 2],
    /// Diagonal of the part's box (mm).
    pub size_mm: f64,
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

/// What a model would cost at the project's quality, and how far off it would be, as on other parts.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// The model that this is of.
    pub model: PartModel,
    /// Order that the tetrahedra of the part's file are raised to, where those are used.
    pub order: Option<usize>,
    /// Size of its elements (mm).
    pub element_mm: f64,
    /// Degrees of freedom.
    pub unknowns: f64,
    /// CPU time of all its stages (s), and memory of the largest (GB).
    pub seconds: f64,
    /// Memory of the largest stage (GB).
    pub memory_gb: f64,
    /// Error of the displacement under a touch (%) that finer elements would take away: as on other parts where that of
    /// cells could not be computed, no number where that of a part's own tetrahedra could not.
    pub error_percent: f64,
    /// And what no elements take away (%): what the theory leaves out.
    pub theory_percent: f64,
}

impl Cost {
    fn total(&self) -> f64 {
        self.error_percent + self.theory_percent
    }

    fn words(&self) -> String {
        /// Up to here numbers are read without words.
        const FEW: f64 = 1e4;
        let theory = if self.theory_percent > 0.0 {
            format!(" and {} % of theory", digits(self.theory_percent))
        } else {
            String::new()
        };
        let size = digits(self.element_mm);
        let elements = match self.order {
            Some(order) => format!("the file's tetrahedra ({size} mm) at order {order}"),
            None => format!("elements of {size} mm"),
        };
        let error = if self.error_percent.is_nan() {
            "an error that could not be computed".into()
        } else {
            format!("{} % error of elements", digits(self.error_percent))
        };
        let unknowns = if self.unknowns < FEW {
            digits(self.unknowns)
        } else {
            format!("{} thousand", digits(self.unknowns / 1e3))
        };
        format!(
            "{elements}, about {unknowns} unknowns, {} s of processor time, {} GB, {error}{theory} under a touch",
            digits(self.seconds.round().max(1.0)),
            digits(self.memory_gb.max(0.1)),
        )
    }
}

/// The faces of a closed part, by its vertices.
#[derive(Clone, Debug)]
pub struct Faces {
    /// The side of its wall that each vertex is on.
    pub sides: Vec<Side>,
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

/// What the cost of a model hangs on, whichever it is.
struct Asked {
    budget: Budget,
    touches: usize,
    /// m.
    tip: f64,
    /// Of the middles of the walls (m²).
    area: f64,
    /// Thickness of the wall and the radius it is bent to (m).
    wall: f64,
    radius: f64,
    /// Of the solid.
    shape: Shape,
}

impl Asked {
    fn new(inputs: &Inputs, area: f64, radius: f64, shape: Shape) -> Self {
        let budget = inputs.project.budget.budget();
        Self {
            touches: inputs.project.touch.count.min(budget.touches),
            tip: inputs.project.tip().1,
            budget,
            area,
            wall: shape.wall,
            radius,
            shape,
        }
    }

    fn shell(&self) -> Cost {
        /// Share of the tolerance that elements are graded to.
        const AIM: f64 = 0.6;
        let elements = &self.budget.elements;
        let wanted =
            self.vertices(self.tip * (AIM * elements.displacement_percent / OF_TIP).sqrt());
        let most = elements.most_for(self.touches) as f64;
        let vertices = wanted.clamp(elements.vertices.min(most as usize) as f64, most);
        let size = (A_VERTEX * self.area / vertices).sqrt();
        let unknowns = 6.0 * vertices;
        Cost {
            model: PartModel::Shell,
            order: None,
            element_mm: size * 1e3,
            unknowns,
            seconds: SHELL.seconds(elements.passes as f64 * unknowns, unknowns, self.touches),
            memory_gb: SHELL.memory_gb(unknowns),
            error_percent: OF_TIP * (size / self.tip).powi(2),
            theory_percent: OF_THEORY * self.wall / self.radius,
        }
    }

    /// Of a closed part of which nothing was solved: its own tetrahedra as they are, or cells as on other parts.
    fn unsolved(&self, inputs: &Inputs, solid: &SolidGround) -> Cost {
        let own = solid.as_they_are();
        own.map_or_else(
            || self.solid(),
            |own| self.looked_at(&own, Some(own.order), sites(inputs, solid)),
        )
    }

    /// Vertices of even triangles of a size (m).
    fn vertices(&self, size: f64) -> f64 {
        A_VERTEX * self.area / (size * size)
    }

    fn solid(&self) -> Cost {
        let elements = &self.budget.elements;
        let sizes = SolidGround::foreseen(&self.shape, self.tip, elements, self.touches);
        let unknowns = |size: &f64| self.shape.unknowns(*size);
        let size = sizes.last().copied().unwrap_or(self.wall);
        let last = unknowns(&size);
        Cost {
            model: PartModel::Solid,
            order: None,
            element_mm: size * 1e3,
            unknowns: last,
            seconds: SOLID.seconds(sizes.iter().map(unknowns).sum(), last, self.touches),
            memory_gb: SOLID.memory_gb(last),
            error_percent: SolidGround::error_percent(size, self.wall.min(self.tip)),
            theory_percent: 0.0,
        }
    }

    /// Of elements that were looked at, read at so many sites; of the part's own tetrahedra raised to an order.
    fn looked_at(&self, foreseen: &Foreseen, order: Option<usize>, sites: f64) -> Cost {
        // Touches, and some of them once more and made otherwise in two ways; strains, slopes of gauges and gauges.
        let loads = (self.touches + 3 * self.touches.min(SLOPE_TOUCHES)) as f64;
        let outputs = 6.0 * sites;
        let built = CUT * foreseen.boxes
            + ASSEMBLE * foreseen.assembled
            + FACTOR * foreseen.multiplications;
        let solved = (SOLVE * loads).min(HALF * (loads + outputs)) * foreseen.entries;
        Cost {
            model: PartModel::Solid,
            order,
            element_mm: foreseen.size * 1e3,
            unknowns: foreseen.unknowns,
            seconds: SOLID.once + built + PRESS * loads + solved,
            memory_gb: (foreseen.bytes + foreseen.before) / 1e9,
            error_percent: foreseen.estimate.displacement_percent,
            theory_percent: 0.0,
        }
    }
}

/// CPU time (s) of each box that a surface is found with, each entry of an element's matrix, each multiplication of a
/// factorization, each entry of a factor that a touch is solved with or that it is divided out of a touch or an output, and
/// of laying a touch on the elements: as on limbs with tetrahedra and in cells.
const CUT: f64 = 6e-6;
const ASSEMBLE: f64 = 4e-8;
const FACTOR: f64 = 5e-11;
const SOLVE: f64 = 6e-11;
const HALF: f64 = 6e-12;
const PRESS: f64 = 6e-4;

/// Error of the displacement under a touch (%) with triangles as large as the tip's radius, which falls with the
/// square of their size; area of such triangles' vertices over their squared edge. As on the bundled limb.
const OF_TIP: f64 = 15.0;
const A_VERTEX: f64 = 1.15;
/// What a shell leaves out of the displacement under a touch (%), over thickness over radius: as on the slotted
/// tube.
const OF_THEORY: f64 = 30.0;
/// A shell that leaves out more than this (%) is the wrong model.
const MOST_THEORY: f64 = 5.0;
/// Cells that are this many times as wrong as a shell do not fit.
const MUCH: f64 = 3.0;

/// CPU time and memory of a model, as they were on limbs and shins.
struct CostModel {
    /// Once (s); for each unknown of every factor (s); for each unknown and touch, less its growth (s).
    once: f64,
    build: f64,
    solve: f64,
    /// Entries of the factor, over the unknowns to the power 4/3.
    entries: f64,
}

const SHELL: CostModel = CostModel {
    once: 0.2,
    build: 3e-5,
    solve: 1.8e-8,
    entries: 8.0,
};
const SOLID: CostModel = CostModel {
    once: 8.0,
    build: 1e-4,
    solve: 4e-8,
    entries: 9.0,
};

impl CostModel {
    fn seconds(&self, built: f64, unknowns: f64, touches: usize) -> f64 {
        /// Unknowns at which the times were taken: solves grow with the power 4/3.
        const AT: f64 = 5e4;
        let growth = (unknowns / AT).cbrt();
        self.once + self.build * built * growth + self.solve * unknowns * growth * touches as f64
    }

    fn memory_gb(&self, unknowns: f64) -> f64 {
        self.entries * unknowns.powf(4.0 / 3.0) * 8.0 / 1e9
    }
}

/// What the elements of a closed part would cost, and why their error could not be computed where that is so.
fn of_solid(
    asked: &Asked,
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
    let aim = &asked.budget.elements;
    match solid.foresee(&touches, &places, asked.touches, aim, watch) {
        Ok(foreseen) => Ok((asked.looked_at(&foreseen, order(&foreseen), sites), None)),
        Err(stop @ ElasticError::Cancelled(_)) => Err(stop.into()),
        Err(why) => Ok((asked.unsolved(inputs, solid), Some(why.to_string()))),
    }
}

/// About how many sites lie on the inside.
fn sites(inputs: &Inputs, solid: &SolidGround) -> f64 {
    let spacing = inputs.project.sites.spacing_mm * 1e-3;
    solid.inside.area() / (spacing * spacing)
}

fn of_closed(
    inputs: &Inputs,
    solid: &SolidGround,
    solves: bool,
    watch: Watch,
) -> Result<Advice, DesignError> {
    let whole = &solid.whole;
    let wall_mm = [0.1, 0.5, 0.9].map(|s| 1e3 * solid.walls.thinner_than(whole, s));
    let is_face = |t: u32| solid.walls.sides[t as usize] != Side::Rim;
    let faces: Vec<u32> = (0..whole.triangles().len() as u32)
        .filter(|&t| is_face(t))
        .collect();
    let area: f64 = faces.iter().map(|&t| whole.facet_area(t)).sum();
    let radius = scope::radii(whole, &faces, solid.wall());
    let asked = Asked::new(inputs, area / 2.0, radius[0], solid.shape());
    let (cells, why) = if solves {
        of_solid(&asked, inputs, solid, watch)?
    } else {
        (asked.unsolved(inputs, solid), None)
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
            digits(wall_mm[1]),
            digits(wall_mm[0]),
            digits(wall_mm[2]),
            bent(radius),
            digits(size_mm(&inputs.part))
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
        let told = match cells.order {
            Some(_) => "",
            None => "; its figures are those of other parts",
        };
        words.push(format!(
            "As a solid it could not be computed yet{told}: {why}."
        ));
    }
    Ok(Advice {
        closed: true,
        wall_mm,
        radius_mm: radius.map(|r| r * 1e3),
        size_mm: size_mm(&inputs.part),
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
    let wall = project.part.thickness_mm;
    let radius = scope::radii(part, &facets, wall * 1e-3);
    let asked = Asked::new(
        inputs,
        part.area(),
        radius[0],
        Shape::of_wall(wall * 1e-3, 2.0 * part.area()),
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
            digits(wall),
            bent(radius),
            digits(size_mm(part))
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
        wall_mm: [wall; 3],
        radius_mm: radius.map(|r| r * 1e3),
        size_mm: size_mm(part),
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
    let mm = digits(part.closes_within()? * 1e3);
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
            digits(radius[0] * 1e3)
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
