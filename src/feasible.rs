//! Which sites a gauge can really sit on.

use glam::DVec3;
use serde::Serialize;

use crate::dataset::Site;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, TriMesh, geodesic, sample};

/// What a gauge needs, lengths in metres, strains as ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeasibleRules {
    /// Least distance over the surface from anything held.
    pub support_clearance: f64,
    /// The paper's k: neighbours whose centre of mass is looked at.
    pub edge_neighbours: usize,
    /// … and how far from the site it may lie.
    pub edge_radius: f64,
    /// The measuring grid of the gauge, along and across its direction.
    pub grid_length: f64,
    pub grid_width: f64,
    /// Largest height of the surface over the gauge's plane, under the gauge.
    pub flatness: f64,
    /// Standard deviation of the strain noise.
    pub noise: f64,
    /// Least ratio of rms strain to noise.
    pub least_signal_to_noise: f64,
    /// Largest strain gauge and amplifier can take.
    pub range: f64,
}

/// The filters, in the order they are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    SupportClearance,
    Edge,
    Footprint,
    Flatness,
    Noise,
    Range,
    Painted,
    KeptOut,
}

impl Filter {
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::SupportClearance => "Too near a support",
            Self::Edge => "At an edge",
            Self::Footprint => "Gauge overhangs",
            Self::Flatness => "Too curved",
            Self::Noise => "Signal below noise",
            Self::Range => "Strain beyond range",
            Self::Painted => "Not painted",
            Self::KeptOut => "Kept out",
        }
    }
}

/// The outcome: one verdict a site.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feasibility {
    /// The first filter that took the site, if any did.
    pub verdicts: Vec<Option<Filter>>,
}

impl Feasibility {
    /// Sites that passed, rising.
    #[must_use]
    pub fn sites(&self) -> Vec<usize> {
        (0..self.verdicts.len())
            .filter(|&i| self.verdicts[i].is_none())
            .collect()
    }

    /// How many sites each filter took, of those that had passed the ones before.
    #[must_use]
    pub fn taken(&self) -> Vec<(Filter, usize)> {
        use Filter::{Edge, Flatness, Footprint, KeptOut, Noise, Painted, Range, SupportClearance};
        [
            SupportClearance,
            Edge,
            Footprint,
            Flatness,
            Noise,
            Range,
            Painted,
            KeptOut,
        ]
        .map(|f| (f, self.verdicts.iter().filter(|&&v| v == Some(f)).count()))
        .to_vec()
    }
}

/// Everything the filters look at.
pub struct FeasibleInput<'a> {
    pub mesh: &'a TriMesh,
    pub index: &'a SurfaceIndex,
    /// Vertices with anything held.
    pub supported: &'a [u32],
    pub points: &'a [SurfacePoint],
    pub sites: &'a [Site],
    /// One value a site: in the painted region or not; absent when nothing was painted.
    pub painted: Option<&'a [bool]>,
    /// One value a site: where no gauge may go; absent when there is no such region.
    pub kept_out: Option<&'a [bool]>,
}

/// Applies all filters.
#[must_use]
pub fn feasible(input: &FeasibleInput, rules: &FeasibleRules) -> Feasibility {
    let clearance = geodesic::from_vertices(input.mesh, input.supported, f64::INFINITY);
    let centred = near_centre_of_mass(input.sites, rules);
    let verdicts = (0..input.sites.len())
        .map(|i| {
            let site = &input.sites[i];
            let checks: [(Filter, &dyn Fn() -> bool); 8] = [
                (Filter::SupportClearance, &|| {
                    input.mesh.interpolate(&clearance, input.points[i]) >= rules.support_clearance
                }),
                (Filter::Edge, &|| centred[i]),
                (Filter::Footprint, &|| {
                    footprint(input.mesh, input.index, site, rules).on_part
                }),
                (Filter::Flatness, &|| {
                    footprint(input.mesh, input.index, site, rules).height <= rules.flatness
                }),
                (Filter::Noise, &|| {
                    site.rms_strain >= rules.least_signal_to_noise * rules.noise
                }),
                (Filter::Range, &|| site.peak_strain <= rules.range),
                (Filter::Painted, &|| input.painted.is_none_or(|p| p[i])),
                (Filter::KeptOut, &|| input.kept_out.is_none_or(|k| !k[i])),
            ];
            checks.iter().find(|(_, passes)| !passes()).map(|c| c.0)
        })
        .collect();
    Feasibility { verdicts }
}

/// The paper's edge filter: at an edge the centre of mass of the k nearest sites lies to one side.
fn near_centre_of_mass(sites: &[Site], rules: &FeasibleRules) -> Vec<bool> {
    let k = rules.edge_neighbours.min(sites.len().saturating_sub(1));
    let positions: Vec<DVec3> = sites.iter().map(|s| s.position).collect();
    if k == 0 {
        return vec![true; sites.len()];
    }
    let lists = nearest(&positions, k);
    lists
        .iter()
        .enumerate()
        .map(|(i, list)| {
            let centre = list.iter().map(|&j| positions[j]).sum::<DVec3>() / list.len() as f64;
            centre.distance(positions[i]) <= rules.edge_radius
        })
        .collect()
}

/// The k nearest others of each position, by a search radius that grows until they are found.
fn nearest(positions: &[DVec3], k: usize) -> Vec<Vec<usize>> {
    let (lower, upper) = positions
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, u), &p| {
            (l.min(p), u.max(p))
        });
    let size = (upper - lower).length().max(f64::MIN_POSITIVE);
    let mut reach = size * (2.0 * k as f64 / positions.len() as f64).sqrt().min(1.0) / 2.0;
    loop {
        let near = sample::neighbours_within(positions, reach);
        if reach > size || near.iter().all(|list| list.len() >= k) {
            return near
                .into_iter()
                .map(|mut list| {
                    list.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
                    list.into_iter().take(k).map(|(j, _)| j).collect()
                })
                .collect();
        }
        reach *= 1.5;
    }
}

struct Footprint {
    on_part: bool,
    /// Largest distance of the surface from the gauge's plane (m).
    height: f64,
}

/// Lays the gauge's grid into the tangent plane and looks for the surface under it.
fn footprint(
    mesh: &TriMesh,
    index: &SurfaceIndex,
    site: &Site,
    rules: &FeasibleRules,
) -> Footprint {
    /// Overhang allowed, as a share of the grid's width.
    const SLACK: f64 = 0.05;
    let across = site.normal.cross(site.direction);
    let mut result = Footprint {
        on_part: true,
        height: 0.0,
    };
    for (a, b) in [-1.0, 0.0, 1.0]
        .into_iter()
        .flat_map(|a| [-1.0, 0.0, 1.0].map(|b| (a, b)))
    {
        let offset =
            site.direction * (a * rules.grid_length / 2.0) + across * (b * rules.grid_width / 2.0);
        let target = site.position + offset;
        let (at, _) = index.nearest(target);
        let gap = mesh.point(at) - target;
        let height = gap.dot(site.normal);
        let sideways = (gap - site.normal * height).length();
        // On a curved part the nearest point shifts by about height × slope: not an overhang.
        let slope = height.abs() * 2.0 / offset.length().max(f64::MIN_POSITIVE);
        result.on_part &= sideways <= SLACK * rules.grid_width + 1.5 * height.abs() * slope;
        result.height = result.height.max(height.abs());
    }
    result
}
