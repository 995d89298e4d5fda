//! Two-stage least squares: regressors that noise reaches are replaced by what instruments explain of them.
//!
//! With as many instruments as unknowns, `(ZᵀX) β = Zᵀb`: whatever noise is in `X` and `b`, the estimate is consistent as long as it does not
//! reach `Z` (Wright 1928). Errors are made from scores, `zᵢ (b - X β)ᵢ`, whose tapered sums need no model of the noise.

use faer::linalg::solvers::{DenseSolveCore, Qr};
use faer::{Mat, MatRef};

use crate::regression::tapered_sums::sum_covariance;

/// Beyond this condition number, times the rounding error, instruments determine nothing.
const MOST_CONDITION: f64 = 1e10;

/// Directions of a covariance below this share of the largest are rounding.
const ROUNDING: f64 = 1e-10;

/// What two stages give.
#[derive(Clone, Debug)]
pub(crate) struct TwoStage {
    pub(crate) values: Vec<f64>,
    /// Row by row.
    pub(crate) covariance: Vec<f64>,
    pub(crate) residual: f64,
    pub(crate) condition: f64,
    /// Squared distance to ordinary least squares over its covariance, of how many unknowns, and the freedom of that covariance.
    pub(crate) contrast: (f64, usize, f64),
    /// The smallest F statistic of the first stage: how much of a regressor instruments explain on their own, over chance.
    pub(crate) strength: f64,
}

/// Solves rows whose regressors are `columns`, with one instrument for each. Neighbouring rows are correlated over `reach` rows.
pub(crate) fn two_stage(columns: &[&[f64]], instruments: &[&[f64]], rhs: &[f64], reach: usize) -> Option<TwoStage> {
    let (rows, count) = (rhs.len(), columns.len());
    let used = (0..rows).filter(|&row| instruments.iter().any(|column| column[row] != 0.0)).count();
    if used <= 2 * count {
        return None;
    }
    let scales: Vec<f64> = columns.iter().map(|column| norm(column)).collect();
    let instrument_scales: Vec<f64> = instruments.iter().map(|column| norm(column)).collect();
    if scales.iter().chain(&instrument_scales).any(|scale| *scale == 0.0 || !scale.is_finite()) {
        return None;
    }
    let x = Mat::from_fn(rows, count, |row, column| columns[column][row] / scales[column]);
    let z = Mat::from_fn(rows, count, |row, column| instruments[column][row] / instrument_scales[column]);
    let b = Mat::from_fn(rows, 1, |row, _| rhs[row]);
    let q = Qr::new(z.as_ref()).compute_thin_Q();
    let square = q.transpose() * &x;
    let condition = condition(square.as_ref())?;
    if condition.is_nan() || condition > MOST_CONDITION {
        return None;
    }
    let inverse = square.partial_piv_lu().inverse();
    let influence = &inverse * q.transpose();
    let beta = &influence * &b;
    let left = &b - &x * &beta;
    let ordinary_qr = Qr::new(x.as_ref());
    let ordinary_q = ordinary_qr.compute_thin_Q();
    let ordinary = ordinary_qr.thin_R().to_owned().partial_piv_lu().inverse() * ordinary_q.transpose();
    let scores = |influence: &Mat<f64>| -> Vec<Vec<f64>> {
        (0..count).map(|one| (0..rows).map(|row| influence[(one, row)] * left[(row, 0)]).collect()).collect()
    };
    let covariance = sum_covariance(&scores(&influence));
    // Of a variance that is estimated, as Student's: errors are a little larger.
    let student = covariance.freedom / (covariance.freedom - 2.0).max(1.0);
    let entry = |index: usize| {
        let (one, other) = (index / count, index % count);
        student * covariance.entries[index] / (scales[one] * scales[other])
    };
    let difference = &ordinary - &influence;
    let apart = &ordinary * &b - &beta;
    let of_difference = sum_covariance(&scores(&difference));
    let distances: Vec<f64> = (0..count).map(|one| apart[(one, 0)]).collect();
    let (squares, directions) = distance(&distances, &of_difference.entries);
    let residual = (0..rows).map(|row| left[(row, 0)].powi(2)).sum::<f64>() / (used - count) as f64;
    Some(TwoStage {
        values: (0..count).map(|one| beta[(one, 0)] / scales[one]).collect(),
        covariance: (0..count * count).map(entry).collect(),
        residual: residual.sqrt(),
        condition,
        contrast: (squares, directions, of_difference.freedom),
        strength: strength(x.as_ref(), q.as_ref(), square.as_ref(), (used, reach)),
    })
}

/// The smallest F statistic of the first stage.
fn strength(x: MatRef<'_, f64>, q: MatRef<'_, f64>, square: MatRef<'_, f64>, (used, reach): (usize, usize)) -> f64 {
    let count = x.ncols();
    let left = x.to_owned() - q * square;
    let gram = (square.transpose() * square).partial_piv_lu().inverse();
    let each = (0..count).map(|one| {
        let squares = (0..left.nrows()).map(|row| left[(row, one)].powi(2)).sum::<f64>() / used as f64;
        // What explains nothing but itself, as an offset does, is as strong as can be. Rows that overlap are worth fewer.
        let own = 1.0 / gram[(one, one)];
        own / (squares * (count * reach.max(1)) as f64)
    });
    each.fold(f64::INFINITY, f64::min)
}

/// The squared length of a vector in units of its covariance, and in how many directions that is more than rounding.
fn distance(vector: &[f64], covariance: &[f64]) -> (f64, usize) {
    let count = vector.len();
    let Ok(found) = Mat::from_fn(count, count, |i, j| covariance[i * count + j]).svd() else { return (0.0, 0) };
    let strengths = found.S().column_vector();
    let largest = (0..count).map(|one| strengths[one]).fold(0.0, f64::max);
    let (mut squares, mut directions) = (0.0, 0);
    for one in 0..count {
        if strengths[one] > ROUNDING * largest {
            let along: f64 = (0..count).map(|row| found.U()[(row, one)] * vector[row]).sum();
            squares += along * along / strengths[one];
            directions += 1;
        }
    }
    (squares, directions)
}

fn condition(matrix: MatRef<'_, f64>) -> Option<f64> {
    let found = matrix.svd().ok()?;
    let strengths = found.S().column_vector();
    let each = (0..matrix.ncols()).map(|one| strengths[one]);
    Some(each.clone().fold(0.0, f64::max) / each.fold(f64::INFINITY, f64::min))
}

fn norm(column: &[f64]) -> f64 {
    column.iter().map(|value| value * value).sum::<f64>().sqrt()
}
