//! Which of the given points can be meant for a part, before anything is computed for them.

use glam::DVec3;

use crate::design::{DesignError, Nearness, OFF};
use crate::elasticity::Touch;
use crate::mesh::{SurfacePoint, TriMesh};

/// A direction that points further out of the surface (degrees) is no direction along it.
const STEEPEST: f64 = 30.0;

/// A table of given points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GivenTable {
    /// Touches.
    Touches,
    /// Gauges.
    Sites,
}

impl GivenTable {
    /// One row of it in words.
    #[must_use]
    pub fn row(self) -> &'static str {
        match self {
            Self::Touches => "touch",
            Self::Sites => "site",
        }
    }

    /// All of them in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Touches => "touches",
            Self::Sites => "sites",
        }
    }
}

/// A row that cannot be answered, and why.
#[derive(Debug)]
pub struct LeftOutRow {
    /// The table it stands in.
    pub table: GivenTable,
    /// Counted from 0.
    pub row: usize,
    /// The error that answering it would be.
    pub why: DesignError,
}

/// The rows that can be answered, and how far each row is off.
#[derive(Debug)]
pub struct Sifted {
    /// Rows that are left, counted from 0.
    pub touches: Vec<usize>,
    /// Rows of sites that are left, counted from 0.
    pub sites: Vec<usize>,
    /// What was left out, and why.
    pub left_out: Vec<LeftOutRow>,
    /// How far each row lies from the part (m).
    pub touch_distances: Vec<f64>,
    /// How far each site lies from the part (m).
    pub site_distances: Vec<f64>,
    /// How far the direction of each gauge points out of the surface (degrees).
    pub site_angles: Vec<f64>,
}

/// Tells the rows that can be meant for a part from those that cannot: too far off it, or gauges that point out of
/// its surface.
#[must_use]
pub fn sift(part: &TriMesh, touches: &[Touch], sites: &[GivenSite]) -> Sifted {
    let near = Nearness::of(part);
    let touch_distances: Vec<f64> = (touches.iter())
        .map(|t| near.distance(t.position))
        .collect();
    let site_distances: Vec<f64> = (sites.iter()).map(|s| near.distance(s.position)).collect();
    let site_angles: Vec<f64> = (sites.iter().zip(&site_distances))
        .map(|(site, &distance)| {
            // Of what lies far away there is no surface beside it.
            let beside = distance <= OFF * near.size;
            if beside { angle_out(part, site) } else { 0.0 }
        })
        .collect();
    let far = |table: GivenTable, row: usize, distance: f64| {
        (distance > OFF * near.size).then(|| near.off(table.row(), row, distance))
    };
    let across = |row: usize| {
        let angle_deg = site_angles[row];
        (angle_deg > STEEPEST).then_some(DesignError::AcrossTheWall {
            number: row,
            angle_deg,
        })
    };
    let mut left_out = Vec::new();
    let touches = kept(GivenTable::Touches, touches.len(), &mut left_out, |row| {
        far(GivenTable::Touches, row, touch_distances[row])
    });
    let sites = kept(GivenTable::Sites, sites.len(), &mut left_out, |row| {
        far(GivenTable::Sites, row, site_distances[row]).or_else(|| across(row))
    });
    Sifted {
        touches,
        sites,
        left_out,
        touch_distances,
        site_distances,
        site_angles,
    }
}

impl Sifted {
    /// Refuses where any row was left out, by the first.
    ///
    /// # Errors
    /// [`DesignError`] as it says why.
    pub fn refuse_any(&mut self) -> Result<(), DesignError> {
        if self.left_out.is_empty() {
            return Ok(());
        }
        Err(self.left_out.swap_remove(0).why)
    }

    /// Refuses where no row of a table is left.
    ///
    /// # Errors
    /// [`DesignError::NothingLeft`].
    pub fn check(&self) -> Result<(), DesignError> {
        for (table, left, distances) in [
            (GivenTable::Touches, &self.touches, &self.touch_distances),
            (GivenTable::Sites, &self.sites, &self.site_distances),
        ] {
            if left.is_empty() {
                return Err(DesignError::NothingLeft {
                    what: table.name(),
                    count: distances.len(),
                });
            }
        }
        Ok(())
    }
}

/// The rows of a table with nothing against them.
fn kept(
    table: GivenTable,
    rows: usize,
    left_out: &mut Vec<LeftOutRow>,
    against: impl Fn(usize) -> Option<DesignError>,
) -> Vec<usize> {
    let mut kept = Vec::with_capacity(rows);
    for row in 0..rows {
        match against(row) {
            None => kept.push(row),
            Some(why) => left_out.push(LeftOutRow { table, row, why }),
        }
    }
    kept
}

/// How far a direction points out of the surface beside it (degrees). At an edge or a corner the facet that it lies
/// in best counts.
fn angle_out(part: &TriMesh, site: &GivenSite) -> f64 {
    let at = part.index().nearest(site.position).0;
    let direction = site.direction.normalize_or(DVec3::NAN);
    let out = |normal: DVec3| {
        // NaN.min(1.0) is 1: what is no direction points out as far as any.
        let share = normal.dot(direction).abs().min(1.0);
        share.asin().to_degrees()
    };
    let facets = facets_at(part, at).into_iter();
    let angles = facets.map(|t| out(part.facet_normal(t)));
    angles.fold(out(part.normal(at)), f64::min)
}

/// The facets that share a point: several where it lies on an edge or a corner.
fn facets_at(part: &TriMesh, at: SurfacePoint) -> Vec<u32> {
    /// Weights below this are rounding.
    const NONE: f64 = 1e-6;
    let corners = part.triangles()[at.triangle as usize];
    let on: Vec<u32> = (corners.into_iter().zip(at.barycentric))
        .filter(|&(_, weight)| weight > NONE)
        .map(|(v, _)| v)
        .collect();
    let Some(&first) = on.first().filter(|_| on.len() < corners.len()) else {
        return vec![at.triangle];
    };
    let around = part.vertex_triangles()[first as usize].iter().copied();
    let shares = |&t: &u32| {
        let corners = part.triangles()[t as usize];
        on.iter().all(|v| corners.contains(v))
    };
    around.filter(shares).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two square plates (100 mm) at right angles along x.
    fn corner() -> TriMesh {
        let p = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::Y,
            DVec3::new(1.0, 0.0, 1.0),
            DVec3::Z,
        ]
        .map(|p| p * 0.1);
        let t = [[0, 1, 2], [0, 2, 3], [1, 0, 5], [1, 5, 4]];
        TriMesh::new(&p, &t, 0).unwrap().0
    }

    fn site(x: f64, y: f64, z: f64, direction: DVec3) -> GivenSite {
        GivenSite {
            position: DVec3::new(x, y, z) * 1e-3,
            direction,
        }
    }

    #[test]
    fn only_rows_that_are_off_are_left_out() {
        let sites = [
            site(50.0, 50.0, 0.0, DVec3::new(1.0, 0.0, 0.5)),
            site(50.0, 50.0, 0.0, DVec3::new(1.0, 0.0, 0.6)),
            site(50.0, 50.0, -30.0, DVec3::X),
            site(50.0, 50.0, f64::NAN, DVec3::X),
            site(50.0, 50.0, 0.0, DVec3::ZERO),
            // On the edge that both plates share, along either.
            site(50.0, 0.0, 0.0, DVec3::Y),
            site(50.0, 0.0, 0.0, DVec3::Z),
        ];
        let touch = |z: f64| Touch {
            position: DVec3::new(0.05, 0.05, z),
            normal: DVec3::Z,
            force: 1.0,
            tip_radius: 1e-3,
        };
        let sifted = sift(&corner(), &[touch(2e-3), touch(0.03), touch(1e200)], &sites);
        assert_eq!(sifted.touches, [0]);
        assert_eq!(sifted.sites, [0, 5, 6]);
        assert!((sifted.site_angles[0] - 0.5_f64.atan().to_degrees()).abs() < 1e-9);
        let rows = |table| {
            let rows = sifted.left_out.iter().filter(move |l| l.table == table);
            rows.map(|l| l.row).collect::<Vec<_>>()
        };
        assert_eq!(rows(GivenTable::Touches), [1, 2]);
        assert_eq!(rows(GivenTable::Sites), [1, 2, 3, 4]);
        assert!(sifted.check().is_ok());
        let none = sift(&corner(), &[touch(1.0)], &sites).check().unwrap_err();
        assert!(none.to_string().contains("1 touches"), "{none}");
    }
}

/// A gauge at a given place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenSite {
    /// m.
    pub position: DVec3,
    /// The direction the gauge measures along; its part in the surface counts.
    pub direction: DVec3,
}
