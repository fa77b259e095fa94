//! The face of the wall that gauges are glued to, and where they are on it.

use glam::DVec3;

use crate::design::{Design, InnerFace, Inputs};
use crate::gauge::Gauge;
use crate::jig::PressedGauge;
use crate::mesh::stance::Stance;
use crate::mesh::{SurfacePoint, TriMesh};

/// A gauge on the wall's inner face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GluedGauge {
    /// From 1.
    pub number: usize,
    /// On the inner face; its normal is from the inside to the outside.
    pub gauge: Gauge,
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
    face: InnerFace,
    /// Which way the part stands.
    pub stance: Stance,
    /// The chosen gauges.
    pub gauges: Vec<GluedGauge>,
}

impl Inner {
    /// Of a design. The wall of a shell lies half of its thickness to each side of the surface that is computed with.
    #[must_use]
    pub fn of(inputs: &Inputs, design: &Design) -> Self {
        let drawn = &design.simulated.mesh;
        let face = InnerFace::of(&inputs.project.part);
        let mesh = face.mesh(drawn);
        let dataset = &design.simulated.dataset;
        let gauges = (1..).zip(design.chosen()).map(|(number, &s)| {
            let site = &dataset.sites[s];
            let row = dataset.x.row(s);
            let ends = row
                .iter()
                .fold([0.0_f64; 2], |[l, h], v| [l.min(*v), h.max(*v)]);
            GluedGauge {
                number,
                gauge: face.gauge(&site.gauge),
                strain: ends,
                rms: site.rms_strain,
            }
        });
        let gauges = gauges.collect();
        Self {
            mesh,
            face,
            stance: inputs.stance(),
            gauges,
        }
    }

    /// Of a project, with the gauges that are chosen in it.
    #[must_use]
    pub fn of_project(inputs: &Inputs) -> Self {
        let project = &inputs.project;
        let face = InnerFace::of(&project.part);
        let part = &inputs.part;
        let gauges = (1..).zip(&project.selection.sites).map(|(number, site)| {
            let at = site.position();
            let (on, _) = part.index().nearest(at);
            let on = Gauge {
                position: at,
                ..Gauge::on(part, on, DVec3::from_array(site.direction))
            };
            GluedGauge {
                number,
                gauge: face.gauge(&on),
                strain: [0.0; 2],
                rms: 0.0,
            }
        });
        Self {
            gauges: gauges.collect(),
            mesh: face.mesh(part),
            face,
            stance: inputs.stance(),
        }
    }

    /// A face by itself, which looks outwards, with gauges on it.
    #[must_use]
    pub fn outward(mesh: TriMesh, stance: Stance, gauges: Vec<GluedGauge>) -> Self {
        Self {
            mesh,
            face: InnerFace::OUTWARD,
            stance,
            gauges,
        }
    }

    /// The gauges as a jig presses them.
    #[must_use]
    pub fn pressed(&self) -> Vec<PressedGauge> {
        let of = |g: &GluedGauge| PressedGauge {
            number: g.number,
            gauge: g.gauge,
        };
        self.gauges.iter().map(of).collect()
    }

    /// A gauge of the surface that is computed with, on the face.
    #[must_use]
    pub fn gauge(&self, gauge: &Gauge) -> Gauge {
        self.face.gauge(gauge)
    }

    /// From the inside to the outside at a point.
    #[must_use]
    pub fn out(&self, at: SurfacePoint) -> DVec3 {
        self.face.out(self.mesh.normal(at))
    }

    /// From the inside to the outside of a facet.
    #[must_use]
    pub fn facet_out(&self, triangle: u32) -> DVec3 {
        self.face.out(self.mesh.facet_normal(triangle))
    }
}
