//! How the limb stands on the table: a rotation and a shift, fitted to points that the tip has touched.

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, Vector3};

/// From the limb's coordinates to the table's (m): turned, then shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableMount {
    /// Of the limb.
    pub turn: DMat3,
    /// m.
    pub shift: DVec3,
}

/// A point that the tip has touched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchedPoint {
    /// On the limb (m).
    pub limb: DVec3,
    /// The limb's outward normal there.
    pub normal: DVec3,
    /// The middle of the tip as the table saw it (m).
    pub tip: DVec3,
}

impl TableMount {
    /// The limb stands along the table's axis, its own `up` along the table's z, its front where the tip comes from at angle
    /// 0, and the middle of its axis over the table's.
    #[must_use]
    pub fn upright(up: DVec3, front: DVec3, middle: DVec3) -> Self {
        let right = up.cross(front);
        let turn = DMat3::from_cols(front, right, up).transpose();
        let along = middle - up * middle.dot(up);
        Self {
            turn,
            shift: -(turn * along),
        }
    }

    /// On the table (m).
    #[must_use]
    pub fn place(&self, limb: DVec3) -> DVec3 {
        self.turn * limb + self.shift
    }

    /// On the limb (m).
    #[must_use]
    pub fn limb(&self, table: DVec3) -> DVec3 {
        self.turn.transpose() * (table - self.shift)
    }

    /// A direction on the table.
    #[must_use]
    pub fn direction(&self, limb: DVec3) -> DVec3 {
        self.turn * limb
    }

    /// The mount that fits touched points best, in the least squares (Kabsch 1976), and how far each of them is off (m). A tip
    /// of this radius (m) touches with its side that the surface faces.
    ///
    /// # Errors
    /// Where the points do not say how the limb stands.
    pub fn fit(touched: &[TouchedPoint], tip_radius: f64) -> Result<(Self, Vec<f64>), String> {
        /// Spread over the largest one, below which points lie on a line.
        const ON_A_LINE: f64 = 0.05;
        if touched.len() < 3 {
            return Err(format!(
                "how the limb stands takes three touched points, and there are {}",
                touched.len()
            ));
        }
        let pairs: Vec<(DVec3, DVec3)> = (touched.iter())
            .map(|t| (t.limb + t.normal * tip_radius, t.tip))
            .collect();
        let count = pairs.len() as f64;
        let mean =
            |side: fn(&(DVec3, DVec3)) -> DVec3| pairs.iter().map(side).sum::<DVec3>() / count;
        let (own, seen) = (mean(|p| p.0), mean(|p| p.1));
        let mut cross = Matrix3::zeros();
        let mut spread = Matrix3::zeros();
        for (limb, tip) in &pairs {
            let [a, b] = [limb - own, tip - seen].map(|v| Vector3::from(v.to_array()));
            cross += a * b.transpose();
            spread += a * a.transpose();
        }
        let mut widths = spread.symmetric_eigenvalues();
        widths.as_mut_slice().sort_by(f64::total_cmp);
        if widths[1] <= (ON_A_LINE * ON_A_LINE) * widths[2] {
            return Err(
                "the touched points lie on a line: touch some on other sides of the limb too"
                    .into(),
            );
        }
        let svd = cross.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
            return Err("the touched points cannot be fitted".into());
        };
        let v = v_t.transpose();
        let hand = (v * u.transpose()).determinant().signum();
        let turn = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, hand)) * u.transpose();
        let column = |c: usize| DVec3::new(turn[(0, c)], turn[(1, c)], turn[(2, c)]);
        let turn = DMat3::from_cols(column(0), column(1), column(2));
        let mount = Self {
            turn,
            shift: seen - turn * own,
        };
        let off = pairs
            .iter()
            .map(|(limb, tip)| mount.place(*limb).distance(*tip))
            .collect();
        Ok((mount, off))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touched(mount: &TableMount, points: &[(DVec3, DVec3)]) -> Vec<TouchedPoint> {
        points
            .iter()
            .map(|&(limb, normal)| TouchedPoint {
                limb,
                normal,
                tip: mount.place(limb + normal * 4e-3),
            })
            .collect()
    }

    #[test]
    fn a_limb_that_stands_askew_is_found() {
        let truth = TableMount {
            turn: DMat3::from_rotation_x(0.1) * DMat3::from_rotation_z(2.0),
            shift: DVec3::new(3e-3, -2e-3, 40e-3),
        };
        let points = [
            (DVec3::new(20e-3, 0.0, 0.0), DVec3::X),
            (DVec3::new(0.0, 20e-3, 60e-3), DVec3::Y),
            (DVec3::new(-20e-3, 0.0, 90e-3), DVec3::NEG_X),
            (DVec3::new(0.0, -20e-3, 30e-3), DVec3::NEG_Y),
        ];
        let mut touched = touched(&truth, &points);
        let (found, off) = TableMount::fit(&touched, 4e-3).unwrap();
        assert!((found.turn.x_axis - truth.turn.x_axis).length() < 1e-9);
        assert!((found.shift - truth.shift).length() < 1e-9);
        assert!(off.iter().all(|off| *off < 1e-9));
        let p = DVec3::new(1e-3, 2e-3, 3e-3);
        assert!((found.limb(found.place(p)) - p).length() < 1e-12);
        // Mounted the wrong way round: what was touched does not fit.
        touched[0].tip = truth.place(DVec3::new(-20e-3, 0.0, 60e-3));
        let (_, off) = TableMount::fit(&touched, 4e-3).unwrap();
        assert!(off.iter().any(|off| *off > 5e-3), "{off:?}");
    }

    #[test]
    fn points_that_say_too_little_are_refused() {
        let here = TableMount::upright(DVec3::Z, DVec3::X, DVec3::ZERO);
        let line = touched(
            &here,
            &[1.0, 2.0, 3.0].map(|z| (DVec3::new(20e-3, 0.0, 30e-3 * z), DVec3::X)),
        );
        assert!(TableMount::fit(&line, 4e-3).is_err_and(|why| why.contains("line")));
        assert!(TableMount::fit(&line[..2], 4e-3).is_err_and(|why| why.contains("three")));
    }

    #[test]
    fn a_limb_stands_upright_where_nothing_was_touched() {
        let mount = TableMount::upright(DVec3::Y, DVec3::Z, DVec3::new(1.0, 2.0, 3.0));
        assert!((mount.direction(DVec3::Y) - DVec3::Z).length() < 1e-12);
        assert!((mount.direction(DVec3::Z) - DVec3::X).length() < 1e-12);
        assert!((mount.place(DVec3::new(1.0, 7.0, 3.0)) - DVec3::Z * 7.0).length() < 1e-12);
    }
}
