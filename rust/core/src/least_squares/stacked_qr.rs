//! Least squares over the whole record: one problem with very many rows.
//!
//! The rows of each piece are summarised by the triangular factor of their QR decomposition. The factors are stacked
//! and decomposed again. Pieces lie on a grid of absolute sample numbers and are stacked in its order, so the result
//! does not depend on which thread computed which.

use faer::linalg::solvers::Qr;
use faer::{Mat, MatRef};

/// The triangular factor `R` of rows `[a | b]`, and their number.
#[derive(Clone, Debug)]
pub struct Summary {
    factor: Mat<f64>,
    rows: usize,
}

/// Parameters that are the same over the whole record.
#[derive(Clone, Debug)]
pub struct SharedParameters {
    /// The values.
    pub values: Vec<f64>,
    /// Their covariance, row by row. From a summary it is that of ordinary least squares, for independent residuals of one variance.
    pub covariance: Vec<f64>,
    /// Standard deviation of the residuals.
    pub residual: f64,
    /// Condition number of the regressors, each scaled to the same norm.
    pub condition: f64,
}

impl Summary {
    /// The summary of no rows, with so many columns, the right-hand side included.
    #[must_use]
    pub fn empty(columns: usize) -> Self {
        Self { factor: Mat::zeros(0, columns), rows: 0 }
    }

    /// The numbers that it consists of: those of the factor row by row, how many columns it has, and how many rows it stands for.
    #[must_use]
    pub fn numbers(&self) -> (Vec<f64>, usize, usize) {
        let (count, columns) = (self.factor.nrows(), self.factor.ncols());
        let numbers = (0..count * columns).map(|place| self.factor[(place / columns, place % columns)]).collect();
        (numbers, columns, self.rows)
    }

    /// The summary that consists of these numbers, or `None` if they are none.
    #[must_use]
    pub fn of_numbers(numbers: &[f64], columns: usize, rows: usize) -> Option<Self> {
        let is_factor = columns > 0 && numbers.len().is_multiple_of(columns) && numbers.len() / columns <= columns;
        let count = numbers.len() / columns.max(1);
        is_factor
            .then(|| Self { factor: Mat::from_fn(count, columns, |row, column| numbers[row * columns + column]), rows })
    }

    /// Summarises rows given column by column.
    pub(crate) fn of(columns: &[Vec<f64>], keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..columns.first().map_or(0, Vec::len)).filter(|&row| keep(row)).collect();
        let rows = Mat::from_fn(kept.len(), columns.len(), |row, column| columns[column][kept[row]]);
        Self { rows: kept.len(), factor: triangle(rows.as_ref()) }
    }

    /// Summarises rows given entry by entry.
    pub(crate) fn from_rows(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        Self { rows, factor: triangle(Mat::from_fn(rows, columns, entry).as_ref()) }
    }

    /// Solves with each column scaled by the square root of a number: the values, the inverse of the normal matrix row by row and the
    /// condition number of the scaled columns. Returns `None` if the rows do not determine the values.
    pub(crate) fn solution(&self, squared: &[f64]) -> Option<(Vec<f64>, Vec<f64>, f64)> {
        let p = self.factor.ncols() - 1;
        if self.factor.nrows() < p || squared.iter().any(|norm| *norm <= 0.0) {
            return None;
        }
        let norms: Vec<f64> = squared.iter().map(|norm| norm.sqrt()).collect();
        let (inverse, condition) = self.scaled_inverse(&norms)?;
        let gram = &inverse * inverse.transpose();
        let entry = |i: usize, j: usize| gram[(i, j)] / (squared[i] * squared[j]).sqrt();
        let normal = (0..p * p).map(|index| entry(index / p, index % p)).collect();
        Some((self.values(&inverse, &norms), normal, condition))
    }

    /// The inverse of the factor with each column divided by a number, and its condition number, or `None` if rounding dominates.
    fn scaled_inverse(&self, norms: &[f64]) -> Option<(Mat<f64>, f64)> {
        let p = norms.len();
        let scaled = Mat::from_fn(p, p, |i, j| self.factor[(i, j)] / norms[j]);
        let mut inverse = Mat::<f64>::identity(p, p);
        faer::linalg::triangular_solve::solve_upper_triangular_in_place(
            scaled.as_ref(),
            inverse.as_mut(),
            faer::Par::Seq,
        );
        let condition = (p as f64).sqrt() * inverse.norm_l2();
        let is_determined = condition * f64::EPSILON * (self.rows as f64) < 1.0;
        is_determined.then_some((inverse, condition))
    }

    /// The parameters, from the inverse of the scaled factor.
    fn values(&self, inverse: &Mat<f64>, norms: &[f64]) -> Vec<f64> {
        let p = norms.len();
        let value = |i: usize| (i..p).map(|j| inverse[(i, j)] * self.factor[(j, p)]).sum::<f64>() / norms[i];
        (0..p).map(value).collect()
    }

    /// The direction in which columns, each scaled by the square root of a number, are smallest: the last right singular
    /// vector, up to its sign.
    pub(crate) fn weakest(&self, squared: &[f64]) -> Vec<f64> {
        let p = self.factor.ncols() - 1;
        let scaled = Mat::from_fn(self.factor.nrows().min(p), p, |i, j| {
            if squared[j] > 0.0 { self.factor[(i, j)] / squared[j].sqrt() } else { 0.0 }
        });
        let Ok(decomposed) = scaled.svd() else { return vec![0.0; p] };
        (0..p).map(|i| decomposed.V()[(i, p - 1)]).collect()
    }

    /// Adds the rows of another summary.
    pub fn add(&mut self, other: &Self) {
        let (above, below) = (self.factor.nrows(), other.factor.nrows());
        let stacked = Mat::from_fn(above + below, self.factor.ncols(), |row, column| {
            if row < above { self.factor[(row, column)] } else { other.factor[(row - above, column)] }
        });
        self.factor = triangle(stacked.as_ref());
        self.rows += other.rows;
    }

    /// Solves for the parameters, or returns `None` if the rows do not determine them.
    pub(crate) fn solve(&self) -> Option<SharedParameters> {
        let p = self.factor.ncols() - 1;
        if self.rows <= p || self.factor.nrows() < p {
            return None;
        }
        let norms: Vec<f64> = (0..p).map(|j| self.factor.col(j).norm_l2()).collect();
        if norms.contains(&0.0) {
            return None;
        }
        let (inverse, condition) = self.scaled_inverse(&norms)?;
        let values = self.values(&inverse, &norms);
        let residual =
            if self.factor.nrows() > p { self.factor[(p, p)].abs() / ((self.rows - p) as f64).sqrt() } else { 0.0 };
        let gram = &inverse * inverse.transpose();
        let entry = |i: usize, j: usize| residual * residual * gram[(i, j)] / (norms[i] * norms[j]);
        let covariance = (0..p * p).map(|index| entry(index / p, index % p)).collect();
        Some(SharedParameters { values, covariance, residual, condition })
    }
}

/// The upper triangular factor of a matrix: as many rows as it has columns, or fewer where it has fewer rows.
fn triangle(rows: MatRef<'_, f64>) -> Mat<f64> {
    Qr::new(rows).thin_R().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Orthonormal directions, times 3.
    const DIRECTIONS: [[f64; 3]; 3] = [[1.0, 2.0, 2.0], [2.0, 1.0, -2.0], [2.0, -2.0, 1.0]];

    #[test]
    fn the_weakest_direction_is_told_from_one_that_is_nearly_as_weak() {
        // Rows along orthonormal directions, and a right-hand side. Rounding moves the weakest by 1e-16 of the strongest over the
        // distance of the next, 1e-5; in the normal matrix it would be over 1e-10.
        let strengths = [1.0, 1e-5, 1e-10];
        let entry = |row: usize, column: usize| DIRECTIONS[row].get(column).map_or(0.5, |d| strengths[row] * d / 3.0);
        let scales = [1.0, 4.0, 9.0_f64];
        let summary = Summary::from_rows(3, 4, |row, column| {
            entry(row, column) * scales.get(column).map_or(1.0, |scale| scale.sqrt())
        });
        let found = summary.weakest(&scales);
        let sign = found[0].signum();
        for (found, expected) in found.iter().zip(DIRECTIONS[2]) {
            assert!((sign * found - expected / 3.0).abs() < 20.0 * f64::EPSILON / strengths[1], "{found} {expected}");
        }
    }

    #[test]
    fn what_fewer_rows_than_columns_leave_open_is_weakest() {
        let summary = Summary::from_rows(1, 3, |_, column| [3.0, 4.0, 1.0][column]);
        let found = summary.weakest(&[1.0, 1.0]);
        assert!((found[0] * found[0].signum() - 0.8).abs() < 4.0 * f64::EPSILON);
        assert!((found[1] * found[0].signum() + 0.6).abs() < 4.0 * f64::EPSILON);
    }
}
