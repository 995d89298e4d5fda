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
    /// What every row was multiplied by; empty where all count alike.
    pub(crate) roots: &'a [f64],
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

    /// What a row was multiplied by.
    pub(crate) fn root(&self, row: usize) -> f64 {
        self.roots.get(row).copied().unwrap_or(1.0)
    }

    /// The weight of a row: the square of that.
    pub(crate) fn weight(&self, row: usize) -> f64 {
        self.root(row) * self.root(row)
    }

    /// The rows from the first usable one to the last.
    pub(crate) fn inside(&self) -> Range<usize> {
        let first = self.usable.iter().position(|&usable| usable).unwrap_or(0);
        first..self.usable.iter().rposition(|&usable| usable).map_or(first, |last| last + 1)
    }

    /// Jumps in some rows, counted from the first of them.
    pub(crate) fn jumps_of(&self, rows: &Range<usize>) -> Vec<usize> {
        self.jumps.iter().filter(|&jump| rows.contains(jump)).map(|jump| jump - rows.start).collect()
    }

    /// Some rows as if there were no others, with the jumps in them.
    pub(crate) fn part<'b>(&'b self, rows: &Range<usize>, jumps: &'b [usize]) -> Problem<'b> {
        let cut =
            |columns: &[&'b [f64]]| -> Vec<&'b [f64]> { columns.iter().map(|column| &column[rows.clone()]).collect() };
        Problem {
            windowed: cut(&self.windowed),
            companions: cut(&self.companions),
            constants: cut(&self.constants),
            rhs: &self.rhs[rows.clone()],
            usable: &self.usable[rows.clone()],
            jumps,
            roots: self.roots.get(rows.clone()).unwrap_or_default(),
            correlated: None,
            ..self.clone()
        }
    }

    /// Whether there is a jump after the first of some rows and not after the end of them.
    pub(crate) fn jumps_within(&self, rows: &Range<isize>) -> bool {
        let next = self.jumps.partition_point(|&jump| jump.cast_signed() <= rows.start);
        self.jumps.get(next).is_some_and(|&jump| jump.cast_signed() <= rows.end)
    }
}

#[cfg(test)]
mod tests {
    use crate::regression::simulated::{model, rows};

    #[test]
    fn jumps_lie_between_two_rows() {
        let mut rows = rows(20, |_| [1.0, 0.0], 0.0);
        rows.jumps = vec![5, 12];
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        // Rows 4 and 5 have a jump between them, rows 5 and 11 have not.
        for (range, within) in
            [(0..4, false), (4..5, true), (5..11, false), (5..12, true), (12..19, false), (-9..30, true)]
        {
            assert_eq!(problem.jumps_within(&range), within, "{range:?}");
        }
    }

    #[test]
    fn equations_reach_from_the_first_to_the_last() {
        let mut rows = rows(10, |_| [1.0, 0.0], 0.0);
        rows.exclude([0, 1, 5, 9].into_iter());
        assert_eq!(model().problem(&rows, &rows.rhs, 0.0, None).inside(), 2..9);
        rows.exclude(0..10);
        assert!(model().problem(&rows, &rows.rhs, 0.0, None).inside().is_empty());
    }
}
