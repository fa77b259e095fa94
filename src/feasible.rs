//! Which sites a gauge can really sit on.

use std::borrow::Cow;

use glam::DVec3;
use serde::Serialize;

use crate::bounds::Bounds;
use crate::dataset::Site;
use crate::gauge::Gauge;
use crate::mesh::{SurfacePoint, TriMesh, geodesic, sample};
use crate::statistics::median;

/// What a gauge needs, lengths in metres, strains as ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeasibleRules {
    /// Radius of the pad that presses a gauge on while its glue cures.
    pub pad: f64,
    /// Least distance over the surface from anything held.
    pub support_clearance: f64,
    /// The paper's k: neighbours whose centre of mass is looked at.
    pub edge_neighbours: usize,
    /// … and how far from the site it may lie.
    pub edge_radius: f64,
    /// The measuring grid of the gauge, along and across its direction.
    pub grid_length: f64,
    /// Width of the measuring grid, across its direction.
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
    /// Of a solid: not the back of a wall that is touched.
    NotBehind,
    /// Of a solid: no pad gets there.
    OutOfReach,
    /// Nearer to a support than is allowed.
    SupportClearance,
    /// At an edge, by the paper's centre of mass.
    Edge,
    /// The gauge would overhang an edge.
    Footprint,
    /// The surface is too curved for the gauge.
    Flatness,
    /// The signal is too small beside the noise.
    Noise,
    /// The strain is beyond what gauge or amplifier can take.
    Range,
    /// No arm of a jig gets there.
    Jig,
    /// Outside the painted region.
    Painted,
    /// Where no gauge may go.
    KeptOut,
}

impl Filter {
    /// In the order they are applied.
    pub const ALL: [Self; 11] = [
        Self::NotBehind,
        Self::OutOfReach,
        Self::SupportClearance,
        Self::Edge,
        Self::Footprint,
        Self::Flatness,
        Self::Noise,
        Self::Range,
        Self::Jig,
        Self::Painted,
        Self::KeptOut,
    ];

    /// What is wrong with a site that it takes out, for people.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::NotBehind => "Not behind a wall that is touched",
            Self::OutOfReach => "Out of a hand's reach",
            Self::SupportClearance => "Too near a support",
            Self::Edge => "At an edge",
            Self::Footprint => "Gauge overhangs",
            Self::Flatness => "Too curved",
            Self::Noise => "Signal below noise",
            Self::Range => "Strain beyond range",
            Self::Jig => "No arm of a jig gets there",
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
        Filter::ALL.map(|f| (f, self.taken_by(f).count())).to_vec()
    }

    /// The sites that a filter took, rising.
    fn taken_by(&self, filter: Filter) -> impl Iterator<Item = usize> + '_ {
        let verdicts = self.verdicts.iter().enumerate();
        verdicts.filter_map(move |(i, &v)| (v == Some(filter)).then_some(i))
    }
}

/// What lies behind and before sites, one value a site.
#[derive(Clone, Debug, PartialEq)]
pub struct SiteSurroundings {
    /// Whether a site is on the back of a wall that touches come to.
    pub behind: Vec<bool>,
    /// Radius of the largest pad that can be brought there (m).
    pub room: Vec<f64>,
}

impl SiteSurroundings {
    /// Whether nothing can be brought to any site: what is closed is glued before it is closed.
    #[must_use]
    pub fn are_closed(&self) -> bool {
        self.room.iter().all(|&room| room <= 0.0)
    }

    /// The same, where what is closed is open for those who glue.
    #[must_use]
    pub fn opened(self) -> Self {
        if self.are_closed() { self.open() } else { self }
    }

    /// The same, all of it open for those who glue.
    #[must_use]
    pub fn open(mut self) -> Self {
        self.room.fill(f64::INFINITY);
        self
    }
}

/// Everything the filters look at.
pub struct FeasibleInput<'a> {
    /// The surface that gauges are glued to (m).
    pub mesh: &'a TriMesh,
    /// Vertices with anything held.
    pub supported: &'a [u32],
    /// Where the sites lie on it.
    pub points: &'a [SurfacePoint],
    /// What the sites report.
    pub sites: &'a [Site],
    /// What lies before and behind the sites of a solid; absent for a shell, which is all wall.
    pub surroundings: Option<&'a SiteSurroundings>,
    /// One value a site: whether a jig gets to it; absent where that is not asked.
    pub jig: Option<&'a [bool]>,
    /// One value a site: in the painted region or not; absent when nothing was painted.
    pub painted: Option<&'a [bool]>,
    /// One value a site: where no gauge may go; absent when there is no such region.
    pub kept_out: Option<&'a [bool]>,
}

/// Applies all filters.
#[must_use]
pub fn feasible(input: &FeasibleInput, rules: &FeasibleRules) -> Feasibility {
    SiteFilters::new(input, rules).verdicts()
}

/// How far each vertex of a mesh is from anything held, over the surface (m).
#[must_use]
pub fn clearance(mesh: &TriMesh, supported: &[u32]) -> Vec<f64> {
    geodesic::from_vertices(mesh, supported, f64::INFINITY)
}

/// As [`feasible`], of gauges beside the sites: `sites`, where these are (m), say how near to an edge each gauge is, and
/// `clearance` ([`clearance`]) how far from what is held.
#[must_use]
pub fn feasible_beside(
    input: &FeasibleInput,
    rules: &FeasibleRules,
    clearance: &[f64],
    sites: &[DVec3],
) -> Feasibility {
    let off_centre = (input.sites.iter())
        .map(|site| off_centre_of(sites, site.gauge.position, rules.edge_neighbours))
        .collect();
    let filters = SiteFilters {
        clearance: Cow::Borrowed(clearance),
        off_centre,
        input,
        rules,
    };
    filters.verdicts()
}

/// The filter that keeps most sites out, and what would let some of them in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blame {
    /// That filter.
    pub filter: Filter,
    /// How many sites pass all other filters.
    pub alone: usize,
    /// The filter's limit at which so many sites would pass it as were asked for, or all that it took where those
    /// are fewer: lengths in metres, strains as ratios. Nothing for a filter that has no limit.
    pub limit: Option<f64>,
}

/// Finds the filter to relax so that `more` sites pass; nothing where none took any. Of several that keep out as
/// many, the last: what the others took had to pass that one too.
#[must_use]
pub fn blame(
    input: &FeasibleInput,
    rules: &FeasibleRules,
    feasibility: &Feasibility,
    more: usize,
) -> Option<Blame> {
    let filters = SiteFilters::new(input, rules);
    let of = |filter: Filter| {
        let taken: Vec<usize> = feasibility.taken_by(filter).collect();
        let alone: Vec<usize> = (taken.iter().copied())
            .filter(|&i| filters.passes_after(filter, i))
            .collect();
        (!taken.is_empty()).then_some((filter, taken, alone))
    };
    let all = Filter::ALL.into_iter().filter_map(of);
    let (filter, taken, alone) = all.max_by_key(|(_, _, alone)| alone.len())?;
    let among = if alone.is_empty() { &taken } else { &alone };
    Some(Blame {
        filter,
        alone: alone.len(),
        limit: filters.limit_for(filter, among, more),
    })
}

/// The filters with what they look at.
struct SiteFilters<'a> {
    input: &'a FeasibleInput<'a>,
    rules: &'a FeasibleRules,
    /// From anything held, over the surface (m), a vertex of the mesh.
    clearance: Cow<'a, [f64]>,
    /// From each site to the centre of mass of its neighbours (m).
    off_centre: Vec<f64>,
}

impl<'a> SiteFilters<'a> {
    fn new(input: &'a FeasibleInput<'a>, rules: &'a FeasibleRules) -> Self {
        Self {
            clearance: Cow::Owned(clearance(input.mesh, input.supported)),
            off_centre: off_centre(input.sites, rules.edge_neighbours),
            input,
            rules,
        }
    }

    fn verdicts(&self) -> Feasibility {
        let verdict = |i: usize| Filter::ALL.into_iter().find(|&f| !self.passes(f, i));
        Feasibility {
            verdicts: (0..self.input.sites.len()).map(verdict).collect(),
        }
    }

    fn passes(&self, filter: Filter, i: usize) -> bool {
        let (input, rules) = (self.input, self.rules);
        let site = &input.sites[i];
        match filter {
            Filter::NotBehind => input.surroundings.is_none_or(|s| s.behind[i]),
            Filter::OutOfReach => self.room(i) >= rules.pad,
            Filter::SupportClearance => self.distance(i) >= rules.support_clearance,
            Filter::Edge => self.off_centre[i] <= rules.edge_radius,
            Filter::Footprint => self.footprint(i).on_part,
            Filter::Flatness => self.footprint(i).height <= rules.flatness,
            Filter::Noise => site.rms_strain >= rules.least_signal_to_noise * rules.noise,
            Filter::Range => site.peak_strain <= rules.range,
            Filter::Jig => input.jig.is_none_or(|reached| reached[i]),
            Filter::Painted => input.painted.is_none_or(|p| p[i]),
            Filter::KeptOut => input.kept_out.is_none_or(|k| !k[i]),
        }
    }

    /// Whether a site passes all filters that come after one.
    fn passes_after(&self, filter: Filter, i: usize) -> bool {
        let mut after = Filter::ALL.into_iter().skip_while(|&f| f != filter).skip(1);
        after.all(|f| self.passes(f, i))
    }

    /// The limit at which `count` of some sites pass a filter, or all where they are fewer.
    fn limit_for(&self, filter: Filter, sites: &[usize], count: usize) -> Option<f64> {
        let measured = sites.iter().filter_map(|&i| self.measured(filter, i));
        let mut values: Vec<f64> = measured.collect();
        values.sort_by(f64::total_cmp);
        if matches!(
            filter,
            Filter::OutOfReach | Filter::SupportClearance | Filter::Noise
        ) {
            // These want much of what they measure.
            values.reverse();
        }
        let last = count.min(values.len()).max(1) - 1;
        values.get(last).copied()
    }

    /// What a filter compares with its limit (m, or strain), where it has one.
    fn measured(&self, filter: Filter, i: usize) -> Option<f64> {
        match filter {
            Filter::OutOfReach => Some(self.room(i)),
            Filter::SupportClearance => Some(self.distance(i)),
            Filter::Edge => Some(self.off_centre[i]),
            Filter::Flatness => Some(self.footprint(i).height),
            Filter::Noise => Some(self.input.sites[i].rms_strain),
            Filter::Range => Some(self.input.sites[i].peak_strain),
            Filter::NotBehind
            | Filter::Footprint
            | Filter::Jig
            | Filter::Painted
            | Filter::KeptOut => None,
        }
    }

    fn room(&self, i: usize) -> f64 {
        (self.input.surroundings).map_or(f64::INFINITY, |s| s.room[i])
    }

    fn distance(&self, i: usize) -> f64 {
        let at = self.input.points[i];
        self.input.mesh.interpolate(&self.clearance, at)
    }

    fn footprint(&self, i: usize) -> Footprint {
        let input = self.input;
        footprint(input.mesh, &input.sites[i].gauge, self.rules)
    }
}

/// What the paper's edge filter looks at: how far the centre of mass of the k nearest sites lies from each (m). At
/// an edge it lies to one side.
fn off_centre(sites: &[Site], neighbours: usize) -> Vec<f64> {
    let k = neighbours.min(sites.len().saturating_sub(1));
    let positions: Vec<DVec3> = sites.iter().map(|s| s.gauge.position).collect();
    if k == 0 {
        return vec![0.0; sites.len()];
    }
    let lists = nearest(&positions, k);
    lists
        .iter()
        .enumerate()
        .map(|(i, list)| {
            let centre = list.iter().map(|&j| positions[j]).sum::<DVec3>() / list.len() as f64;
            centre.distance(positions[i])
        })
        .collect()
}

/// The same for a gauge beside the sites, where these are (m): of a gauge on a site, as for the site itself.
fn off_centre_of(sites: &[DVec3], gauge: DVec3, neighbours: usize) -> f64 {
    /// A gauge so near to a site is on it (m²).
    const SAME: f64 = 1e-12;
    let mut near: Vec<(f64, usize)> = (sites.iter().enumerate())
        .map(|(i, site)| (site.distance_squared(gauge), i))
        .collect();
    near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // The site itself is no neighbour of its own.
    let own = usize::from(near.first().is_some_and(|n| n.0 <= SAME));
    let near = &near[own..];
    // Between sites of a regular grid many are equally far: the first ones of them would all lie to one side.
    let equally = |last: f64| near.partition_point(|n| n.0 <= last * (1.0 + 1e-9));
    let count = match near.get(neighbours.wrapping_sub(1)) {
        Some(&(last, _)) if own == 0 => equally(last),
        _ => neighbours.min(near.len()),
    };
    if count == 0 {
        return 0.0;
    }
    let list: Vec<DVec3> = near[..count].iter().map(|&(_, i)| sites[i]).collect();
    let centre = list.iter().sum::<DVec3>() / list.len() as f64;
    centre.distance(gauge)
}

/// The k nearest others of each position, by a search radius that grows for those that have not found as many: what
/// lies far from the rest costs the rest nothing.
fn nearest(positions: &[DVec3], k: usize) -> Vec<Vec<usize>> {
    let bounds = Bounds::around(positions.iter().copied());
    let size = bounds.size().length().max(f64::MIN_POSITIVE);
    let mut found: Vec<Vec<usize>> = vec![Vec::new(); positions.len()];
    let mut reach = usual_reach(positions, k).max(1e-6 * size);
    loop {
        let near = sample::neighbours_of(positions, &|i| found[i].len() < k, reach);
        for (found, mut near) in found.iter_mut().zip(near) {
            if near.len() >= k {
                near.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
                *found = near.into_iter().take(k).map(|(j, _)| j).collect();
            }
        }
        if reach > size || found.iter().all(|list| list.len() >= k) {
            return found;
        }
        reach *= 1.5;
    }
}

/// A little more than how far half of the positions have their k-th nearest other, as a few of them say.
fn usual_reach(positions: &[DVec3], k: usize) -> f64 {
    const ASKED: usize = 32;
    const MORE: f64 = 1.2;
    let step = positions.len().div_ceil(ASKED).max(1);
    let kth = |p: &DVec3| {
        let mut squares: Vec<f64> = positions.iter().map(|q| q.distance_squared(*p)).collect();
        // The nearest is the position itself.
        *squares.select_nth_unstable_by(k, f64::total_cmp).1
    };
    MORE * median(positions.iter().step_by(step).map(kth)).map_or(0.0, f64::sqrt)
}

struct Footprint {
    on_part: bool,
    /// Largest distance of the surface from the gauge's plane (m).
    height: f64,
}

/// Lays the gauge's grid into the tangent plane and looks for the surface under it.
fn footprint(mesh: &TriMesh, gauge: &Gauge, rules: &FeasibleRules) -> Footprint {
    /// Overhang allowed, as a share of the grid's width.
    const SLACK: f64 = 0.05;
    let mut result = Footprint {
        on_part: true,
        height: 0.0,
    };
    for (a, b) in [-1.0, 0.0, 1.0]
        .into_iter()
        .flat_map(|a| [-1.0, 0.0, 1.0].map(|b| (a, b)))
    {
        let offset = gauge.direction * (a * rules.grid_length / 2.0)
            + gauge.across() * (b * rules.grid_width / 2.0);
        let target = gauge.position + offset;
        let (at, _) = mesh.index().nearest(target);
        let gap = mesh.point(at) - target;
        let height = gap.dot(gauge.normal);
        let sideways = (gap - gauge.normal * height).length();
        // On a curved part the nearest point shifts by about height × slope: not an overhang.
        let slope = height.abs() * 2.0 / offset.length().max(f64::MIN_POSITIVE);
        result.on_part &= sideways <= SLACK * rules.grid_width + 1.5 * height.abs() * slope;
        result.height = result.height.max(height.abs());
    }
    result
}

#[cfg(test)]
mod tests;
