//! Polynomials of any order on the unit tetrahedron, and what integrates them.

use glam::DVec3;

use super::lagrange::gauss;

/// Highest order that is offered.
pub const HIGHEST: usize = 5;

/// Lagrange's polynomials of one order through the points of an even lattice.
#[derive(Clone, Debug)]
pub struct Simplex {
    order: usize,
    /// How many steps of the lattice each node is from the faces opposite to corners 0, 1, 2 and 3.
    lattice: Vec<[usize; 4]>,
}

impl Simplex {
    /// # Panics
    /// For an order that is not offered (1 to [`HIGHEST`]).
    #[must_use]
    pub fn new(order: usize) -> Self {
        assert!(
            (1..=HIGHEST).contains(&order),
            "orders 1 to {HIGHEST} are offered"
        );
        let mut lattice = Vec::new();
        for x in 0..=order {
            for y in 0..=order - x {
                for z in 0..=order - x - y {
                    lattice.push([order - x - y - z, x, y, z]);
                }
            }
        }
        Self { order, lattice }
    }

    /// Nodes of an order.
    #[must_use]
    pub fn count(order: usize) -> usize {
        (order + 1) * (order + 2) * (order + 3) / 6
    }

    /// Polynomial degree.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// The steps of each node from the faces opposite to the corners: where all but some are zero, the node lies
    /// on the edge or face between those corners.
    #[must_use]
    pub fn lattice(&self) -> &[[usize; 4]] {
        &self.lattice
    }

    /// Where a node lies in the unit tetrahedron.
    #[must_use]
    pub fn place(&self, node: usize) -> DVec3 {
        let [_, x, y, z] = self.lattice[node].map(|steps| steps as f64);
        DVec3::new(x, y, z) / self.order as f64
    }

    /// Π (p l - s) / (s + 1) over s below 0, 1, … `order`, and its derivative.
    fn line(&self, l: f64) -> ([f64; HIGHEST + 1], [f64; HIGHEST + 1]) {
        let p = self.order as f64;
        let (mut values, mut slopes) = ([0.0; HIGHEST + 1], [0.0; HIGHEST + 1]);
        values[0] = 1.0;
        for m in 1..=self.order {
            let step = m as f64;
            let factor = (p * l - (step - 1.0)) / step;
            slopes[m] = slopes[m - 1] * factor + values[m - 1] * p / step;
            values[m] = values[m - 1] * factor;
        }
        (values, slopes)
    }

    /// Values of all shape functions at a point of the unit tetrahedron.
    pub fn values(&self, xi: DVec3, into: &mut Vec<f64>) {
        let lines = [1.0 - xi.x - xi.y - xi.z, xi.x, xi.y, xi.z].map(|l| self.line(l).0);
        let shape = |steps: &[usize; 4]| (0..4).map(|c| lines[c][steps[c]]).product::<f64>();
        into.clear();
        into.extend(self.lattice.iter().map(shape));
    }

    /// Values and gradients (in the unit tetrahedron) of all shape functions at a point of it.
    #[must_use]
    pub fn at(&self, xi: DVec3) -> Vec<(f64, DVec3)> {
        let lines = [1.0 - xi.x - xi.y - xi.z, xi.x, xi.y, xi.z].map(|l| self.line(l));
        let shape = |steps: &[usize; 4]| {
            let value = |c: usize| lines[c].0[steps[c]];
            let slope = |c: usize| {
                let others = (0..4).filter(|&e| e != c).map(value);
                lines[c].1[steps[c]] * others.product::<f64>()
            };
            let gradient = DVec3::new(slope(1), slope(2), slope(3)) - slope(0);
            ((0..4).map(value).product::<f64>(), gradient)
        };
        self.lattice.iter().map(shape).collect()
    }

    /// Points and weights of Gauss's rule on a cube that is collapsed to the unit tetrahedron (A. H. Stroud 1971),
    /// exact for degree 2 p - 1 at least. Products of gradients have 2 p - 2 between straight sides; on the curved
    /// ones of a limb's walls what is left is a ten thousandth, which takes one point more at low orders.
    #[must_use]
    pub fn rule(&self) -> Vec<(DVec3, f64)> {
        let points = (self.order + 2).min(self.order.max(4) + 1);
        let line: Vec<(f64, f64)> = gauss(points)
            .into_iter()
            .map(|(x, weight)| (0.5 * (1.0 + x), 0.5 * weight))
            .collect();
        let mut points = Vec::with_capacity(line.len().pow(3));
        for &(x, u) in &line {
            for &(b, v) in &line {
                let y = b * (1.0 - x);
                for &(c, w) in &line {
                    let left = 1.0 - x - y;
                    points.push((DVec3::new(x, y, c * left), u * v * w * (1.0 - x) * left));
                }
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_exact_for_their_degree() {
        for order in 1..=HIGHEST {
            let rule = Simplex::new(order).rule();
            let degree = 2 * order as i32 - 1;
            let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
            for i in 0..=degree {
                for j in 0..=degree - i {
                    let k = degree - i - j;
                    let f = |p: DVec3| p.x.powi(i) * p.y.powi(j) * p.z.powi(k);
                    let sum: f64 = rule.iter().map(|(p, w)| w * f(*p)).sum();
                    let exact = factorial(i) * factorial(j) * factorial(k) / factorial(degree + 3);
                    assert!((sum / exact - 1.0).abs() < 1e-9, "{order}: {i} {j} {k}");
                }
            }
        }
    }

    #[test]
    fn shapes_are_one_at_their_node_and_reproduce_polynomials() {
        for order in 1..=HIGHEST {
            let simplex = Simplex::new(order);
            let at = DVec3::new(0.2, 0.35, 0.15);
            let power = order as i32;
            let f = |q: DVec3| q.x.powi(power) - 2.0 * q.y.powi(power) + q.z;
            let (mut value, mut gradient) = (0.0, DVec3::ZERO);
            let mut values = Vec::new();
            simplex.values(at, &mut values);
            assert!(values.iter().zip(simplex.at(at)).all(|(v, a)| *v == a.0));
            for (node, (shape, slope)) in simplex.at(at).into_iter().enumerate() {
                let place = simplex.place(node);
                for (other, (there, _)) in simplex.at(place).into_iter().enumerate() {
                    let own = if other == node { 1.0 } else { 0.0 };
                    assert!((there - own).abs() < 1e-12);
                }
                value += shape * f(place);
                gradient += slope * f(place);
            }
            let p = f64::from(power);
            let along = |x: f64| p * x.powi(power - 1);
            let exact = DVec3::new(along(at.x), -2.0 * along(at.y), 1.0);
            assert!((value - f(at)).abs() < 1e-12, "{order}");
            assert!(gradient.distance(exact) < 1e-11, "{order}: {gradient}");
        }
    }
}
