//! A least-squares problem: the rows of a record and what is known of their noise.

use std::ops::Range;
use std::sync::Arc;

use crate::regression::layout::Layout;
use crate::regression::noise_correction::RowNoise;

/// Rows of a record. Rows that are no equations are zero in every column.
#[derive(Clone, Debug)]
pub(crate) struct Problem<'a> {
    pub(crate) layout: Layout,
    /// Windowed regressors, and their companions where the layout is linear.
    pub(crate) windowed: Vec<&'a [f64]>,
    pub(crate) companions: Vec<&'a [f64]>,
    pub(crate) constants: Vec<&'a [f64]>,
    pub(crate) rhs: &'a [f64],
    pub(crate) usable: &'a [bool],
    /// The first rows after jumps of windowed coefficients, in order. A window over a jump counts as one without rows.
    pub(crate) jumps: &'a [usize],
    /// Seconds from one row to the next.
    pub(crate) period: f64,
    /// The noise of the angle in a row.
    pub(crate) noise: RowNoise,
    /// The windowed regressors times the covariance of the rows; without it standard errors are those of ordinary least squares.
    pub(crate) correlated: Option<Arc<Correlated>>,
}

/// Windowed regressors and their companions, multiplied by the covariance of the rows.
#[derive(Clone, Debug)]
pub(crate) struct Correlated {
    /// Variance of a row's noise.
    pub(crate) variance: f64,
    pub(crate) windowed: Vec<Vec<f64>>,
    pub(crate) companions: Vec<Vec<f64>>,
}

impl Problem<'_> {
    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rhs.len()
    }

    /// The rows from the first usable one to the last.
    pub(crate) fn inside(&self) -> Range<usize> {
        let first = self.usable.iter().position(|&usable| usable).unwrap_or(0);
        first..self.usable.iter().rposition(|&usable| usable).map_or(first, |last| last + 1)
    }

    /// Whether there is a jump after the first of some rows and not after the end of them.
    pub(crate) fn jumps_within(&self, rows: &Range<isize>) -> bool {
        let next = self.jumps.partition_point(|&jump| jump.cast_signed() <= rows.start);
        self.jumps.get(next).is_some_and(|&jump| jump.cast_signed() <= rows.end)
    }
}
