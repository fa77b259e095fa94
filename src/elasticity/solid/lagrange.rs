//! Shape functions of a box: products of Lagrange polynomials through the Gauss–Lobatto points, and what
//! integrates them.

use glam::DVec3;

/// Highest order that is offered.
pub const HIGHEST: usize = 4;

/// Tensor-product shape functions of one order on [-1, 1]³. Node (i, j, k) has number i + n (j + n k).
#[derive(Clone, Debug)]
pub struct Lagrange {
    /// Gauss–Lobatto points, rising.
    points: Vec<f64>,
}

impl Lagrange {
    /// # Panics
    /// For an order that is not offered (1 to [`HIGHEST`]).
    #[must_use]
    pub fn new(order: usize) -> Self {
        let inner = match order {
            1 => vec![],
            2 => vec![0.0],
            3 => vec![-(0.2_f64.sqrt()), 0.2_f64.sqrt()],
            4 => vec![-((3.0 / 7.0_f64).sqrt()), 0.0, (3.0 / 7.0_f64).sqrt()],
            _ => panic!("orders 1 to {HIGHEST} are offered"),
        };
        let points = [vec![-1.0], inner, vec![1.0]].concat();
        Self { points }
    }

    /// Polynomial degree along each axis.
    #[must_use]
    pub fn order(&self) -> usize {
        self.points.len() - 1
    }

    /// Nodes along one side.
    #[must_use]
    pub fn points(&self) -> &[f64] {
        &self.points
    }

    /// Nodes of the box.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.points.len().pow(3)
    }

    /// Values and derivatives of the one-dimensional polynomials.
    fn line(&self, x: f64) -> ([f64; HIGHEST + 1], [f64; HIGHEST + 1]) {
        let p = &self.points;
        let (mut values, mut slopes) = ([0.0; HIGHEST + 1], [0.0; HIGHEST + 1]);
        for i in 0..p.len() {
            let others = (0..p.len()).filter(|&k| k != i);
            let scale: f64 = others.clone().map(|k| p[i] - p[k]).product();
            values[i] = others.clone().map(|k| x - p[k]).product::<f64>() / scale;
            let left_out = |m: usize| -> f64 {
                let rest = others.clone().filter(|&k| k != m);
                rest.map(|k| x - p[k]).product()
            };
            slopes[i] = others.clone().map(left_out).sum::<f64>() / scale;
        }
        (values, slopes)
    }

    /// Values of all shape functions at a point.
    pub fn values(&self, xi: DVec3, into: &mut Vec<f64>) {
        let n = self.points.len();
        let [x, y, z] = xi.to_array().map(|c| self.line(c).0);
        into.clear();
        for k in 0..n {
            for j in 0..n {
                into.extend(x[..n].iter().map(|x| x * y[j] * z[k]));
            }
        }
    }

    /// Values and gradients (along the box's own coordinates) of all shape functions at a point.
    #[must_use]
    pub fn at(&self, xi: DVec3) -> Vec<(f64, DVec3)> {
        let n = self.points.len();
        let [(x, dx), (y, dy), (z, dz)] = xi.to_array().map(|c| self.line(c));
        let mut shapes = Vec::with_capacity(self.nodes());
        for k in 0..n {
            for j in 0..n {
                for i in 0..n {
                    let gradient = DVec3::new(
                        dx[i] * y[j] * z[k],
                        x[i] * dy[j] * z[k],
                        x[i] * y[j] * dz[k],
                    );
                    shapes.push((x[i] * y[j] * z[k], gradient));
                }
            }
        }
        shapes
    }
}

/// Legendre polynomials of degrees 0 … at a point.
pub fn legendre(x: f64, into: &mut [f64]) {
    into[0] = 1.0;
    if into.len() > 1 {
        into[1] = x;
    }
    for n in 2..into.len() {
        let m = n as f64;
        into[n] = ((2.0 * m - 1.0) * x * into[n - 1] - (m - 1.0) * into[n - 2]) / m;
    }
}

/// Points and weights of the Gauss–Legendre rule on [-1, 1], exact for degree 2 n - 1.
#[must_use]
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    let polynomial = |x: f64| {
        let mut p = vec![0.0; n + 1];
        legendre(x, &mut p);
        let slope = n as f64 * (x * p[n] - p[n - 1]) / (x * x - 1.0);
        (p[n], slope)
    };
    (0..n)
        .map(|i| {
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            for _ in 0..8 {
                let (value, slope) = polynomial(x);
                x -= value / slope;
            }
            let slope = polynomial(x).1;
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_exact_for_their_degree() {
        for n in 1..=9 {
            for degree in 0..2 * n {
                let sum: f64 = gauss(n)
                    .iter()
                    .map(|(x, w)| w * x.powi(degree as i32))
                    .sum();
                let exact = if degree % 2 == 0 {
                    2.0 / (degree as f64 + 1.0)
                } else {
                    0.0
                };
                assert!((sum - exact).abs() < 1e-13, "{n} {degree}");
            }
        }
    }

    #[test]
    fn shapes_are_one_at_their_node_and_reproduce_polynomials() {
        for order in 1..=HIGHEST {
            let shapes = Lagrange::new(order);
            let p = shapes.points().to_vec();
            let n = p.len();
            let at = DVec3::new(0.3, -0.7, 0.9);
            let f = |q: DVec3| q.x.powi(order as i32) + q.y * q.z;
            let (mut value, mut slope) = (0.0, 0.0);
            for (a, (shape, gradient)) in shapes.at(at).into_iter().enumerate() {
                let node = DVec3::new(p[a % n], p[a / n % n], p[a / n / n]);
                let own = shapes.at(node)[a].0;
                assert!((own - 1.0).abs() < 1e-13);
                value += shape * f(node);
                slope += gradient.x * f(node);
            }
            assert!((value - f(at)).abs() < 1e-13);
            let exact = order as f64 * at.x.powi(order as i32 - 1);
            assert!((slope - exact).abs() < 1e-12);
        }
    }
}
