//! What a model would cost, and how far off it would be.

use serde::Serialize;

use super::super::layout::simulation_bytes;
use super::super::{Inputs, SLOPE_TOUCHES};
use crate::budget::Budget;
use crate::elasticity::solid::ground::{Foreseen, SolidGround};
use crate::elasticity::solid::sizing::PartMeasures;
use crate::elasticity::system::bytes_in_work;
use crate::plain::digits;
use crate::project::PartModel;
use crate::units;

/// What a model would cost at the project's quality, and how far off it would be, as on other parts.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// The model that this is of.
    pub model: PartModel,
    /// Order that the tetrahedra of the part's file are raised to, where those are used.
    pub order: Option<usize>,
    /// Size of its elements (m).
    #[serde(rename = "element_mm", serialize_with = "units::as_mm")]
    pub element: f64,
    /// Degrees of freedom.
    pub unknowns: f64,
    /// CPU time of all its stages (s).
    pub seconds: f64,
    /// Memory of the largest stage (bytes).
    #[serde(rename = "memory_gb", serialize_with = "units::as_gigabytes")]
    pub memory: f64,
    /// Error of the displacement under a touch (%) that finer elements would take away: as on other parts where that of
    /// cells could not be computed, no number where that of a part's own tetrahedra could not.
    pub error_percent: f64,
    /// And what no elements take away (%): what the theory leaves out.
    pub theory_percent: f64,
}

impl Cost {
    /// The error of elements and of theory together (%).
    #[must_use]
    pub fn total(&self) -> f64 {
        self.error_percent + self.theory_percent
    }

    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        /// Up to here numbers are read without words.
        const FEW: f64 = 1e4;
        let theory = if self.theory_percent > 0.0 {
            format!(" and {} % of theory", digits(self.theory_percent))
        } else {
            String::new()
        };
        let size = digits(units::mm(self.element));
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
            format!("{} thousand", digits(units::thousands(self.unknowns)))
        };
        format!(
            "{elements}, about {unknowns} unknowns, {} s of processor time, {} GB, {error}{theory} under a touch",
            digits(self.seconds.round().max(1.0)),
            digits(units::gigabytes(self.memory).max(0.1)),
        )
    }
}

/// What the cost of a model hangs on, whichever it is.
pub struct Workload {
    /// What may be spent.
    pub budget: Budget,
    /// How many touches are computed.
    pub touches: usize,
    /// m.
    tip: f64,
    /// What is read at all sites of all touches (bytes).
    read: f64,
    /// Of the middles of the walls (m²).
    area: f64,
    /// Thickness of the wall and the radius it is bent to (m).
    wall: f64,
    radius: f64,
    /// Of the solid.
    shape: PartMeasures,
}

impl Workload {
    /// Of a part whose walls have middles of this area (m²) and are bent to a radius (m).
    #[must_use]
    pub fn new(inputs: &Inputs, area: f64, radius: f64, shape: PartMeasures) -> Self {
        let (project, budget) = (&inputs.project, inputs.project.budget.budget());
        let touches = project.touch.count.min(budget.touches);
        let spacing = project.sites.spacing();
        let sites = area / (spacing * spacing) * project.gauge.directions as f64;
        Self {
            read: simulation_bytes(sites as usize, touches, project.gauge.signal),
            touches,
            tip: inputs.project.tip().1,
            budget,
            area,
            wall: shape.wall,
            radius,
            shape,
        }
    }

    /// Of a shell, as on other parts.
    #[must_use]
    pub fn shell(&self) -> Cost {
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
            element: size,
            unknowns,
            seconds: SHELL.seconds(elements.passes as f64 * unknowns, unknowns, self.touches),
            memory: SHELL.memory(unknowns) + self.read,
            error_percent: OF_TIP * (size / self.tip).powi(2),
            theory_percent: OF_THEORY * self.wall / self.radius,
        }
    }

    /// Of a closed part of which nothing was solved: its own tetrahedra as they are, or cells as on other parts.
    #[must_use]
    pub fn unsolved(&self, solid: &SolidGround, sites: f64) -> Cost {
        let own = solid.as_they_are();
        own.map_or_else(
            || self.solid(),
            |own| self.looked_at(&own, Some(own.order), sites),
        )
    }

    /// Vertices of even triangles of a size (m).
    fn vertices(&self, size: f64) -> f64 {
        A_VERTEX * self.area / (size * size)
    }

    /// Of a solid in cells, as on other parts.
    #[must_use]
    pub fn solid(&self) -> Cost {
        let elements = &self.budget.elements;
        let sizes = SolidGround::foreseen(&self.shape, self.tip, elements, self.touches);
        let unknowns = |size: &f64| self.shape.unknowns(*size);
        let size = sizes.last().copied().unwrap_or(self.wall);
        let last = unknowns(&size);
        Cost {
            model: PartModel::Solid,
            order: None,
            element: size,
            unknowns: last,
            seconds: SOLID.seconds(sizes.iter().map(unknowns).sum(), last, self.touches),
            memory: SOLID.memory(last) + self.read,
            error_percent: SolidGround::error_percent(size, self.wall.min(self.tip)),
            theory_percent: 0.0,
        }
    }

    /// Of elements that were looked at, read at so many sites; of the part's own tetrahedra raised to an order.
    #[must_use]
    pub fn looked_at(&self, foreseen: &Foreseen, order: Option<usize>, sites: f64) -> Cost {
        // Touches, and some of them once more and made otherwise in two ways; strains, slopes of gauges and gauges.
        let loads = (self.touches + 3 * self.touches.min(SLOPE_TOUCHES)) as f64;
        let outputs = 6.0 * sites;
        let built = CUT * foreseen.boxes
            + ASSEMBLE * foreseen.assembled
            + FACTOR * foreseen.multiplications;
        let solved = (SOLVE * loads).min(READ * (loads + outputs)) * foreseen.entries;
        let held = foreseen.bytes + foreseen.before + bytes_in_work(foreseen.unknowns);
        Cost {
            model: PartModel::Solid,
            order,
            element: foreseen.size,
            unknowns: foreseen.unknowns,
            seconds: SOLID.once + built + PRESS * loads + solved,
            memory: held + self.read,
            error_percent: foreseen.estimate.displacement_percent,
            theory_percent: 0.0,
        }
    }
}

/// CPU time (s) of each box that a surface is found with, each entry of an element's matrix, each multiplication of a
/// factorization, each entry of a factor that a touch is solved with, or that is met by a touch or an output where one side is
/// solved for above a cut and the other divided out below it, and of laying a touch on the elements: as on limbs with tetrahedra
/// and in cells.
const CUT: f64 = 6e-6;
const ASSEMBLE: f64 = 4e-8;
const FACTOR: f64 = 5e-11;
const SOLVE: f64 = 6e-11;
const READ: f64 = 4e-12;
const PRESS: f64 = 6e-4;

/// Error of the displacement under a touch (%) with triangles as large as the tip's radius, which falls with the
/// square of their size; area of such triangles' vertices over their squared edge. As on the bundled limb.
const OF_TIP: f64 = 15.0;
const A_VERTEX: f64 = 1.15;
/// What a shell leaves out of the displacement under a touch (%), over thickness over radius: as on the slotted
/// tube.
const OF_THEORY: f64 = 30.0;

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

    /// Bytes.
    fn memory(&self, unknowns: f64) -> f64 {
        self.entries * unknowns.powf(4.0 / 3.0) * size_of::<f64>() as f64
    }
}
