//! What sites report of a touch at some places.

/// What every site reports, per newton and in units of the noise, at some places: how much, how that changes over
/// the surface (a millimetre along two directions), the variance of what else is off, and what a deviation of each
/// nuisance of the touch adds. Filled up with silence to whole blocks of places.
#[derive(Default)]
pub(in crate::placement::expected_error) struct Reports {
    /// Places, filled up.
    pub(super) count: usize,
    pub(super) rows: usize,
    /// Site by site: values, slopes along, slopes across, variances, nuisances.
    pub(super) values: Vec<f32>,
}

/// Places that are computed side by side.
pub(in crate::placement::expected_error) const LANES: usize = 16;
/// Rows that every site has.
pub(super) const ROWS: usize = 4;

/// Rows of [`Reports`] of one site.
pub(in crate::placement::expected_error) struct Report<'a> {
    pub value: &'a [f32],
    pub slopes: [&'a [f32]; 2],
    pub variance: &'a [f32],
    /// One row after the other.
    nuisances: &'a [f32],
}

impl<'a> Report<'a> {
    /// What a deviation of each nuisance adds.
    pub fn nuisances(&self) -> impl Iterator<Item = &'a [f32]> + use<'a> {
        self.nuisances.chunks_exact(self.value.len().max(1))
    }
}

impl Reports {
    /// The rows of one site, one after the other.
    pub(in crate::placement::expected_error) fn of_mut(&mut self, site: usize) -> &mut [f32] {
        let length = self.rows * self.count;
        &mut self.values[site * length..][..length]
    }

    /// What one site reports.
    pub fn of(&self, site: usize) -> Report<'_> {
        let length = self.rows * self.count;
        let all = &self.values[site * length..][..length];
        let row = |k: usize| &all[k * self.count..][..self.count];
        Report {
            value: row(0),
            slopes: [row(1), row(2)],
            variance: row(3),
            nuisances: &all[ROWS * self.count..],
        }
    }
}
