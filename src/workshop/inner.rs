//! The face of the wall that gauges are glued to, and where they are on it.

use glam::DVec3;

use crate::dataset::Site;
use crate::design::{Design, Inputs};
use crate::jig::PressedGauge;
use crate::mesh::stance::Stance;
use crate::mesh::{SurfacePoint, TriMesh};
use crate::project::PartModel;

/// A gauge on the wall's inner face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glued {
    /// From 1.
    pub number: usize,
    /// On the inner face (m).
    pub place: DVec3,
    /// From the inside to the outside, of unit length.
    pub out: DVec3,
    /// In which it measures.
    pub direction: DVec3,
    /// Smallest and largest strain that it reads under the touches of the design.
    pub strain: [f64; 2],
    /// Rms strain under them.
    pub rms: f64,
}

/// The wall's inner face.
#[derive(Clone, Debug)]
pub struct Inner {
    /// The face (m).
    pub mesh: TriMesh,
    /// Whether its normals look inwards.
    looks_in: bool,
    /// From the surface that is computed with to the face (m).
    depth: f64,
    /// Which way the part stands.
    pub stance: Stance,
    /// The chosen gauges.
    pub gauges: Vec<Glued>,
}

impl Inner {
    /// Of a design. The wall of a shell lies half of its thickness to each side of the surface that is computed with.
    #[must_use]
    pub fn of(inputs: &Inputs, design: &Design) -> Self {
        let drawn = &design.simulated.mesh;
        let (looks_in, depth) = match inputs.project.part.model {
            PartModel::Solid => (true, 0.0),
            PartModel::Shell => (false, 0.5e-3 * inputs.project.part.thickness_mm),
        };
        let mesh = drawn.offset(-depth);
        let dataset = &design.simulated.dataset;
        let gauges = (1..).zip(design.chosen()).map(|(number, &s)| {
            let site = &dataset.sites[s];
            let out = if looks_in { -site.normal } else { site.normal };
            let row = dataset.x.row(s);
            let ends = row
                .iter()
                .fold([0.0_f64; 2], |[l, h], v| [l.min(*v), h.max(*v)]);
            Glued {
                number,
                place: site.position - out * depth,
                out,
                direction: site.direction,
                strain: ends,
                rms: site.rms_strain,
            }
        });
        let gauges = gauges.collect();
        Self {
            mesh,
            looks_in,
            depth,
            stance: inputs.stance(),
            gauges,
        }
    }

    /// Of a project, with the gauges that are chosen in it.
    #[must_use]
    pub fn of_project(inputs: &Inputs) -> Self {
        let project = &inputs.project;
        let (looks_in, depth) = match project.part.model {
            PartModel::Solid => (true, 0.0),
            PartModel::Shell => (false, 0.5 * project.part.thickness()),
        };
        let part = &inputs.part;
        let gauges = (1..).zip(&project.selection.sites).map(|(number, site)| {
            let at = site.position();
            let (on, _) = part.index().nearest(at);
            let out = if looks_in {
                -part.normal(on)
            } else {
                part.normal(on)
            };
            let direction = DVec3::from_array(site.direction).reject_from_normalized(out);
            Glued {
                number,
                place: at - out * depth,
                out,
                direction: direction.normalize_or(out.any_orthonormal_vector()),
                strain: [0.0; 2],
                rms: 0.0,
            }
        });
        Self {
            gauges: gauges.collect(),
            mesh: part.offset(-depth),
            looks_in,
            depth,
            stance: inputs.stance(),
        }
    }

    /// A face by itself, which looks outwards, with gauges on it.
    #[must_use]
    pub fn outward(mesh: TriMesh, stance: Stance, gauges: Vec<Glued>) -> Self {
        Self {
            mesh,
            looks_in: false,
            depth: 0.0,
            stance,
            gauges,
        }
    }

    /// The gauges as a jig presses them.
    #[must_use]
    pub fn pressed(&self) -> Vec<PressedGauge> {
        let of = |g: &Glued| PressedGauge {
            number: g.number,
            place: g.place,
            out: g.out,
            direction: g.direction,
        };
        self.gauges.iter().map(of).collect()
    }

    /// A gauge at a site of the design, as a jig presses it.
    #[must_use]
    pub fn site(&self, site: &Site) -> PressedGauge {
        let out = if self.looks_in {
            -site.normal
        } else {
            site.normal
        };
        PressedGauge {
            number: 0,
            place: site.position - out * self.depth,
            out,
            direction: site.direction,
        }
    }

    /// From the inside to the outside at a point.
    #[must_use]
    pub fn out(&self, at: SurfacePoint) -> DVec3 {
        let normal = self.mesh.normal(at);
        if self.looks_in { -normal } else { normal }
    }

    /// From the inside to the outside of a facet.
    #[must_use]
    pub fn facet_out(&self, triangle: u32) -> DVec3 {
        let normal = self.mesh.facet_normal(triangle);
        if self.looks_in { -normal } else { normal }
    }
}
