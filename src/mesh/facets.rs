//! Triangles that nothing is asked of but that they are seen from outside.

use glam::DVec3;

/// Corners and triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facets {
    /// Places, in the unit of whoever has made them.
    pub positions: Vec<DVec3>,
    /// Of these.
    pub triangles: Vec<[u32; 3]>,
}

impl Facets {
    /// What they enclose; less than nothing where they are seen from inside.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let p = |v: u32| self.positions[v as usize];
        let of = |t: &[u32; 3]| p(t[0]).dot(p(t[1]).cross(p(t[2]))) / 6.0;
        self.triangles.iter().map(of).sum()
    }
}
