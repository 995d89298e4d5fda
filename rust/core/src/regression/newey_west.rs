//! Standard errors of the strong form: corrected for the correlation of rows that share samples.
//!
//! Rows of the strong form are made from derivatives in overlapping windows, so their residuals are correlated. With
//! the covariance Γ of the rows, estimated from the residuals, least squares have the covariance `N⁻¹ Xᵀ Γ X N⁻¹`
//! instead of `σ² N⁻¹` (Newey and West 1987).

use std::cmp::Ordering;

use crate::least_squares::stacked_qr::Summary;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::sandwich::sandwich;

/// Rows of several stretches of a record, column by column, separated by unusable rows.
#[derive(Clone, Debug)]
pub(crate) struct Stretched {
    /// Unknowns, then the right-hand side.
    columns: Vec<Vec<f64>>,
    usable: Vec<bool>,
    /// Rows farther apart than this are assumed independent.
    reach: usize,
}

impl Stretched {
    pub(crate) fn new(columns: usize, reach: usize) -> Self {
        Self { columns: vec![Vec::new(); columns], usable: Vec::new(), reach }
    }

    /// Appends a stretch of rows.
    pub(crate) fn push(&mut self, columns: &[Vec<f64>], usable: impl Fn(usize) -> bool) {
        let rows = columns.first().map_or(0, Vec::len);
        self.usable.extend((0..rows).map(usable));
        self.usable.extend(std::iter::repeat_n(false, self.reach));
        let length = self.usable.len();
        for (all, column) in self.columns.iter_mut().zip(columns) {
            all.extend_from_slice(column);
            all.resize(length, 0.0);
        }
    }

    /// The covariance of the rows, if the first column holds residuals.
    pub(crate) fn covariance(&self) -> RowCovariance {
        RowCovariance::of_residuals(&self.columns[0], &self.usable, self.reach)
    }

    /// The factor by which the standard error of each unknown exceeds that of ordinary least squares, or `None` if the
    /// unknowns are not determined.
    ///
    /// The unknowns are assumed constant over all rows. No factor is less than one.
    pub(crate) fn factors(mut self) -> Option<Vec<f64>> {
        let solved = Summary::of(&self.columns, |row| self.usable[row]).solve()?;
        let mut residuals = self.columns.pop()?;
        for column in self.columns.iter_mut().chain([&mut residuals]) {
            column.iter_mut().zip(&self.usable).filter(|(_, usable)| !**usable).for_each(|(value, _)| *value = 0.0);
        }
        for (column, value) in self.columns.iter().zip(&solved.values) {
            residuals.iter_mut().zip(column).for_each(|(residual, factor)| *residual -= value * factor);
        }
        let covariance = RowCovariance::of_residuals(&residuals, &self.usable, self.reach);
        let unknowns = solved.values.len();
        let variance = solved.residual * solved.residual;
        let inverse: Vec<f64> = solved.covariance.iter().map(|entry| entry / variance).collect();
        let honest = sandwich(&self.columns, &inverse, &covariance);
        let ordinary = inverse.iter().map(|entry| covariance.variance() * entry);
        Some(factors(&honest, &ordinary.collect::<Vec<f64>>(), unknowns))
    }
}

/// The square roots of the diagonal of one covariance over that of another, row by row; none is less than one.
fn factors(honest: &[f64], ordinary: &[f64], unknowns: usize) -> Vec<f64> {
    let diagonal = (0..unknowns).map(|unknown| unknown * (unknowns + 1));
    // If all residuals are zero the quotient is NaN, and `max` makes it one.
    diagonal.map(|place| (honest[place] / ordinary[place]).sqrt().max(1.0)).collect()
}

/// Multiplies the standard error of each unknown by a factor.
pub(crate) fn enlarge(covariance: &mut [f64], factors: &[f64]) {
    for (row, one) in covariance.chunks_exact_mut(factors.len().max(1)).zip(factors) {
        row.iter_mut().zip(factors).for_each(|(entry, other)| *entry *= one * other);
    }
}

/// A covariance whose standard errors are at least those of another, or that other one where the first has a variance that is not
/// positive: rows that gaps leave apart take its middle matrix its sign.
pub(crate) fn at_least(mut honest: Vec<f64>, ordinary: &[f64], unknowns: usize) -> Vec<f64> {
    if (0..unknowns).any(|unknown| honest[unknown * (unknowns + 1)].partial_cmp(&0.0) != Some(Ordering::Greater)) {
        return ordinary.to_vec();
    }
    let factors = factors(ordinary, &honest, unknowns);
    enlarge(&mut honest, &factors);
    honest
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Normal numbers, near enough: each the sum of twelve uniform ones.
    pub(crate) fn white(count: usize, mut seed: u64) -> Vec<f64> {
        let mut uniform = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum()).collect()
    }

    /// Rows of one regressor whose noise is a mean over `width` samples.
    fn factor(width: usize) -> f64 {
        let noise = white(20_000 + width, 7);
        let rhs: Vec<f64> = (0..20_000).map(|row| noise[row..row + width].iter().sum::<f64>() / width as f64).collect();
        let mut rows = Stretched::new(2, 4 * width);
        rows.push(&[vec![1.0; rhs.len()], rhs], |_| true);
        rows.factors().expect("determined")[0]
    }

    #[test]
    fn a_mean_of_moving_means_scatters_as_much_as_its_samples() {
        // White noise averaged over w samples keeps 1/w of its variance and correlates like a triangle: the variance of the mean is w
        // times that of independent rows. Bartlett's taper over 4 w takes a twelfth of it, chance some hundredths.
        assert!((factor(1) - 1.0).abs() < 0.1);
        let expected = 20.0_f64.sqrt();
        assert!((factor(20) / expected - 1.0).abs() < 0.15, "{}", factor(20));
    }

    #[test]
    fn a_variance_that_is_not_positive_is_no_variance() {
        let ordinary = [4.0, 1.0, 1.0, 9.0];
        assert_eq!(at_least(vec![1.0, 0.0, 0.0, 36.0], &ordinary, 2), [4.0, 0.0, 0.0, 36.0]);
        for wrong in [-1e-3, 0.0, f64::NAN] {
            assert_eq!(at_least(vec![16.0, 0.0, 0.0, wrong], &ordinary, 2), ordinary);
        }
    }

    #[test]
    fn nothing_that_is_left_leaves_errors_as_they_are() {
        let column: Vec<f64> = (0..50).map(f64::from).collect();
        let mut rows = Stretched::new(2, 3);
        rows.push(&[column, vec![0.0; 50]], |_| true);
        assert_eq!(rows.factors(), Some(vec![1.0]));
    }
}
