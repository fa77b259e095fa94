//! Which sites gauges may have.

use std::sync::Arc;

use super::pressing::JigFilter;
use super::{Inputs, Shortage, Simulated};
use crate::dataset::Site;
use crate::elasticity::support::supported_vertices;
use crate::feasible::{Feasibility, FeasibleInput, blame, feasible};
use crate::mesh::TriMesh;

/// Filters the sites.
#[must_use]
pub fn filter(inputs: &Inputs, simulated: &Simulated) -> Feasibility {
    let looked = LookedAt::of(inputs, simulated);
    feasible(&looked.input(simulated), &inputs.project.feasible_rules())
}

/// Why so many gauges have no room.
pub(super) fn shortage(
    inputs: &Inputs,
    simulated: &Simulated,
    feasibility: &Feasibility,
    wanted: usize,
) -> Shortage {
    let looked = LookedAt::of(inputs, simulated);
    let rules = inputs.project.feasible_rules();
    let more = wanted.saturating_sub(feasibility.sites().len());
    let blame = blame(&looked.input(simulated), &rules, feasibility, more);
    Shortage::of(inputs, feasibility, wanted, blame)
}

/// What the filters look at, beside the simulation.
struct LookedAt {
    supported: Vec<u32>,
    painted: Option<Vec<bool>>,
    kept_out: Option<Vec<bool>>,
    jig: Option<Vec<bool>>,
}

impl LookedAt {
    fn of(inputs: &Inputs, simulated: &Simulated) -> Self {
        // Gauges that were moved off the lattice are no sites to choose.
        let sites = &simulated.dataset.sites[..simulated.lattice];
        let on = |mask: &Arc<Vec<bool>>| painted_sites(&inputs.part, mask, sites);
        let named = inputs.project.feasible.keep_out.as_ref();
        Self {
            supported: supported_vertices(&simulated.held),
            painted: inputs.painted.as_ref().map(on),
            kept_out: named.and_then(|name| inputs.masks.get(name)).map(on),
            jig: JigFilter::of(inputs, simulated).map(|jig| jig.gets_to(sites)),
        }
    }

    fn input<'a>(&'a self, simulated: &'a Simulated) -> FeasibleInput<'a> {
        FeasibleInput {
            mesh: &simulated.mesh,
            supported: &self.supported,
            points: &simulated.points[..simulated.lattice],
            sites: &simulated.dataset.sites[..simulated.lattice],
            surroundings: simulated.surroundings.as_ref(),
            painted: self.painted.as_deref(),
            kept_out: self.kept_out.as_deref(),
            jig: self.jig.as_deref(),
        }
    }
}

/// Whether each site lies where the mask (one value a vertex of the part) is mostly set.
pub(super) fn painted_sites(part: &TriMesh, mask: &[bool], sites: &[Site]) -> Vec<bool> {
    sites
        .iter()
        .map(|site| part.mostly_in(mask, part.index().nearest(site.gauge.position).0))
        .collect()
}
