//! Where gauges may be that leave their places.

use std::sync::Arc;

use glam::DVec3;

use crate::budget::Watch;
use crate::dataset::{Move, Site};
use crate::design::filter::painted_sites;
use crate::design::pressing::JigFilter;
use crate::design::{DesignError, Inputs, Simulated};
use crate::elasticity::support::supported_vertices;
use crate::feasible::{FeasibleInput, FeasibleRules, SiteSurroundings, clearance, feasible_beside};
use crate::gauge::Gauge;
use crate::mesh::SurfacePoint;

/// Where gauges may be.
pub(super) struct GaugeRoom<'a> {
    pub(super) inputs: &'a Inputs,
    pub(super) simulated: &'a Simulated,
    rules: FeasibleRules,
    /// From what is held (m), a vertex of the surface.
    clearance: Vec<f64>,
    /// Where the sites of the lattice are (m), and how far from each other.
    lattice: Vec<DVec3>,
    pub(super) spacing: f64,
    /// Where only what a jig gets to is asked for.
    pressing: Option<JigFilter>,
}

impl<'a> GaugeRoom<'a> {
    pub(super) fn new(inputs: &'a Inputs, simulated: &'a Simulated) -> Self {
        let sites = &simulated.dataset.sites[..simulated.lattice];
        let held = supported_vertices(&simulated.held);
        Self {
            rules: inputs.project.feasible_rules(),
            clearance: clearance(&simulated.mesh, &held),
            lattice: sites.iter().map(|site| site.gauge.position).collect(),
            spacing: inputs.project.sites.spacing(),
            pressing: JigFilter::of(inputs, simulated),
            inputs,
            simulated,
        }
    }

    /// A gauge after a move along the surface; nothing where that ends or turns away.
    pub(super) fn moved(&self, site: &Site, to: Move) -> Option<Site> {
        /// Share of a step that the surface may be off its end.
        const OFF: f64 = 0.5;
        /// Cosine of the angle that it may turn by.
        const BENT: f64 = 0.5;
        let gauge = &site.gauge;
        let turned = gauge.turned(to.turn);
        let aim = gauge.moved(to.along, to.across).position;
        let step = aim - gauge.position;
        if step == DVec3::ZERO {
            return Some(Site {
                gauge: turned,
                ..*site
            });
        }
        let mesh = &self.simulated.mesh;
        let at = mesh.index().nearest(aim).0;
        let (position, normal) = (mesh.point(at), mesh.normal(at));
        let on = position.distance(aim) <= OFF * step.length() && normal.dot(gauge.normal) >= BENT;
        let flat = (turned.direction - normal * turned.direction.dot(normal)).try_normalize();
        let gauge = Gauge {
            position,
            direction: flat.filter(|_| on)?,
            normal,
        };
        Some(Site { gauge, ..*site })
    }

    /// Whether gauges may be where these are, for all that is seen of the surface around them.
    pub(super) fn allowed(&self, sites: &[Site]) -> Vec<bool> {
        self.judged(sites, &self.points(sites), None)
    }

    /// The same, and whether they can be reached there.
    pub(super) fn allowed_wholly(
        &self,
        sites: &[Site],
        watch: Watch,
    ) -> Result<Vec<bool>, DesignError> {
        let points = self.points(sites);
        let around = self.simulated.surroundings_of(&points, watch)?;
        Ok(self.judged(sites, &points, around.as_ref()))
    }

    fn points(&self, sites: &[Site]) -> Vec<SurfacePoint> {
        let index = self.simulated.mesh.index();
        let at = |site: &Site| index.nearest(site.gauge.position).0;
        sites.iter().map(at).collect()
    }

    fn judged(
        &self,
        sites: &[Site],
        points: &[SurfacePoint],
        surroundings: Option<&SiteSurroundings>,
    ) -> Vec<bool> {
        let on = |mask: &Arc<Vec<bool>>| painted_sites(&self.inputs.part, mask, sites);
        let named = self.inputs.project.feasible.keep_out.as_ref();
        let painted = self.inputs.painted.as_ref().map(on);
        let kept_out = named.and_then(|name| self.inputs.masks.get(name)).map(on);
        let jig = self.pressing.as_ref().map(|jig| jig.gets_to(sites));
        let input = FeasibleInput {
            mesh: &self.simulated.mesh,
            supported: &[],
            points,
            sites,
            surroundings,
            painted: painted.as_deref(),
            kept_out: kept_out.as_deref(),
            jig: jig.as_deref(),
        };
        let found = feasible_beside(&input, &self.rules, &self.clearance, &self.lattice);
        found.verdicts.iter().map(Option::is_none).collect()
    }

    /// Whether a gauge that goes from one place to another keeps its distance from a third: the spacing that is asked
    /// for, and that of the lattice, where it was not nearer before. Gauges at one place stay together.
    pub(super) fn keeps_apart(&self, from: DVec3, to: DVec3, other: DVec3) -> bool {
        /// Nearer than this (m) is the same place.
        const SAME: f64 = 1e-9;
        let least = self.inputs.project.selection.spacing();
        let (before, after) = (from.distance(other), to.distance(other));
        if before <= SAME {
            return after <= SAME;
        }
        after >= least && (after >= self.spacing || after >= before)
    }

    /// Whether a gauge costs no more at one place than at another.
    pub(super) fn is_no_dearer(&self, chosen: DVec3, to: DVec3) -> bool {
        let cost = self.inputs.project.selection.costs_at(&[chosen, to]);
        cost[1] <= cost[0]
    }
}
