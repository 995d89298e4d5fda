//! Two-stage least squares: regressors that noise reaches are replaced by what instruments explain of them.
//!
//! With as many instruments as unknowns, `(ZᵀX) β = Zᵀb`: whatever noise is in `X` and `b`, the estimate is consistent as long as it does not
//! reach `Z` (Wright 1928). Errors are made from scores, `zᵢ (b - X β)ᵢ`, whose tapered sums need no model of the noise.

use faer::linalg::solvers::{DenseSolveCore, Qr};
use faer::{Mat, MatRef};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

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

impl TwoStage {
    pub(crate) fn variance(&self, one: usize) -> f64 {
        self.covariance[one * (self.values.len() + 1)]
    }

    /// Adds to the variance of one unknown.
    pub(crate) fn widen(&mut self, one: usize, variance: f64) {
        self.covariance[one * (self.values.len() + 1)] += variance;
    }

    /// The logarithm of the product of all variances.
    pub(crate) fn size(&self) -> f64 {
        (0..self.values.len()).map(|one| self.variance(one).ln()).sum()
    }
}

/// Solves rows whose regressors are `columns`, with one instrument for each. Neighbouring rows are correlated over `reach` rows; errors are those of
/// so many tapers.
pub(crate) fn two_stage(
    columns: &[&[f64]],
    instruments: &[&[f64]],
    rhs: &[f64],
    (reach, tapers): (usize, usize),
) -> Option<TwoStage> {
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
    let instruments = Qr::new(z.as_ref());
    let q = instruments.compute_thin_Q();
    let square = q.transpose() * &x;
    let condition_of = |matrix| condition(matrix).filter(|condition| *condition <= MOST_CONDITION);
    // Instruments that are one leave a direction made of rounding, of which the products with regressors say nothing.
    condition_of(instruments.thin_R())?;
    let condition = condition_of(square.as_ref())?;
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
    let covariance = sum_covariance(&scores(&influence), tapers);
    // Of a variance that is estimated, as Student's: errors are a little larger.
    let student = covariance.freedom / (covariance.freedom - 2.0).max(1.0);
    let entry = |index: usize| {
        let (one, other) = (index / count, index % count);
        student * covariance.entries[index] / (scales[one] * scales[other])
    };
    let difference = &ordinary - &influence;
    let apart = &ordinary * &b - &beta;
    let of_difference = sum_covariance(&scores(&difference), tapers);
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
pub(crate) fn distance(vector: &[f64], covariance: &[f64]) -> (f64, usize) {
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

/// The probability of a squared distance at least as large, of a covariance that is estimated (Hotelling).
pub(crate) fn beyond((squares, directions, freedom): (f64, usize, f64)) -> f64 {
    let (directions, rest) = (directions as f64, freedom - directions as f64 + 1.0);
    if directions == 0.0 || rest <= 0.0 {
        return f64::NAN;
    }
    let statistic = squares * rest / (freedom * directions);
    FisherSnedecor::new(directions, rest).map_or(f64::NAN, |fisher| fisher.sf(statistic))
}

pub(crate) fn condition(matrix: MatRef<'_, f64>) -> Option<f64> {
    let found = matrix.svd().ok()?;
    let strengths = found.S().column_vector();
    let each = (0..matrix.ncols()).map(|one| strengths[one]);
    Some(each.clone().fold(0.0, f64::max) / each.fold(f64::INFINITY, f64::min))
}

pub(crate) fn norm(column: &[f64]) -> f64 {
    column.iter().map(|value| value * value).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::regression::simulated::{least_squares, products, random, solved};

    const ROWS: usize = 80;
    /// Tapers of so many rows: one for every eight.
    const TAPERS: usize = 10;
    /// A sum over the rows loses a digit of rounding with each at most, and normal equations lose the square of the condition number, which is below 10.
    const ROUNDING: f64 = 100.0 * ROWS as f64 * f64::EPSILON;
    const REPEATS: u64 = 300;

    /// Instruments, and regressors that follow them and something else, in units that differ by six orders. The last is its own instrument.
    fn columns() -> [Vec<Vec<f64>>; 2] {
        let z: Vec<Vec<f64>> = vec![random(1, ROWS), random(2, ROWS), vec![1.0; ROWS]];
        let mixed = |row: usize, seed: usize| z[seed][row] + 0.4 * z[1 - seed][row] + 0.3;
        let follows = |seed: usize, unit: f64| -> Vec<f64> {
            let own = random(10 + seed as u64, ROWS);
            (0..ROWS).map(|row| unit * (mixed(row, seed) + 0.5 * own[row])).collect()
        };
        [vec![follows(0, 1e3), follows(1, 1e-3), z[2].clone()], z]
    }

    /// A right-hand side whose noise also reaches the first regressor, and grows along the rows.
    fn rhs(x: &[Vec<f64>]) -> Vec<f64> {
        let (own, reaching) = (random(20, ROWS), random(10, ROWS));
        let noise = |row: usize| (0.5 + row as f64 / ROWS as f64) * own[row] + 0.5 * reaching[row];
        (0..ROWS).map(|row| 2e-3 * x[0][row] - 700.0 * x[1][row] + 0.6 + noise(row)).collect()
    }

    fn solve(x: &[Vec<f64>], z: &[Vec<f64>], b: &[f64], reach: usize) -> Option<TwoStage> {
        let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
        let z: Vec<&[f64]> = z.iter().map(Vec::as_slice).collect();
        two_stage(&x, &z, b, (reach, 30))
    }

    /// How much every row adds to every unknown: `(ZᵀX)⁻¹ Zᵀ`, with plain sums.
    fn influence(x: &[Vec<f64>], z: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (count, rows) = (x.len(), x[0].len());
        let normal = products(&[z, x].concat())[..count].iter().map(|row| row[count..].to_vec()).collect::<Vec<_>>();
        let of: Vec<Vec<f64>> =
            (0..rows).map(|row| solved(normal.clone(), z.iter().map(|one| one[row]).collect())).collect();
        (0..count).map(|one| of.iter().map(|of| of[one]).collect()).collect()
    }

    fn dot(one: &[f64], other: &[f64]) -> f64 {
        one.iter().zip(other).map(|(one, other)| one * other).sum()
    }

    /// What unknowns leave of the right-hand side.
    fn left(x: &[Vec<f64>], b: &[f64], values: &[f64]) -> Vec<f64> {
        (0..b.len())
            .map(|row| b[row] - x.iter().zip(values).map(|(one, value)| one[row] * value).sum::<f64>())
            .collect()
    }

    /// The covariance of the sums of scores, every sine computed as such.
    fn tapered(influence: &[Vec<f64>], left: &[f64]) -> Vec<Vec<f64>> {
        let end = (ROWS + 1) as f64;
        let taper = |k: usize, row: usize| (2.0 / end).sqrt() * (PI * (k * (row + 1)) as f64 / end).sin();
        let sum = |k: usize, one: &[f64]| -> f64 { (0..ROWS).map(|row| taper(k, row) * one[row] * left[row]).sum() };
        let sums: Vec<Vec<f64>> = influence.iter().map(|one| (1..=TAPERS).map(|k| sum(k, one)).collect()).collect();
        let scale = ROWS as f64 / (TAPERS - 1) as f64;
        products(&sums).iter().map(|row| row.iter().map(|entry| scale * entry).collect()).collect()
    }

    #[track_caller]
    fn assert_within(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance, "{found}, not {expected} within {tolerance}");
    }

    #[test]
    fn estimates_and_their_covariance_are_those_of_plain_sums() {
        let [x, z] = columns();
        let b = rhs(&x);
        let found = solve(&x, &z, &b, 1).expect("strong instruments");
        assert!(found.condition < 10.0, "{}", found.condition);
        let influence = influence(&x, &z);
        let expected: Vec<f64> = influence.iter().map(|one| dot(one, &b)).collect();
        for (found, expected) in found.values.iter().zip(&expected) {
            assert_within(*found, *expected, ROUNDING * expected.abs());
        }
        let left = left(&x, &b, &expected);
        let residual = (dot(&left, &left) / (ROWS - 3) as f64).sqrt();
        assert_within(found.residual, residual, ROUNDING * residual);
        // Student's distribution of nine degrees of freedom has a variance of 9/7.
        let covariance = tapered(&influence, &left);
        for (i, row) in covariance.iter().enumerate() {
            for (j, expected) in row.iter().enumerate() {
                let size = (covariance[i][i] * covariance[j][j]).sqrt();
                assert_within(found.covariance[3 * i + j], 9.0 / 7.0 * expected, ROUNDING * size);
            }
        }
    }

    #[test]
    fn the_contrast_is_the_distance_to_least_squares_over_its_covariance() {
        let [x, z] = columns();
        let b = rhs(&x);
        let (two, one) = (influence(&x, &z), influence(&x, &x));
        let values: Vec<f64> = two.iter().map(|one| dot(one, &b)).collect();
        let apart: Vec<Vec<f64>> =
            one.iter().zip(&two).map(|(one, two)| one.iter().zip(two).map(|(a, b)| a - b).collect()).collect();
        let distance: Vec<f64> = apart.iter().map(|one| dot(one, &b)).collect();
        let covariance = tapered(&apart, &left(&x, &b, &values));
        // What is its own instrument is orthogonal to what either leaves, so the first two unknowns say all.
        let first: Vec<Vec<f64>> = covariance[..2].iter().map(|row| row[..2].to_vec()).collect();
        let squares = dot(&solved(first, distance[..2].to_vec()), &distance[..2]);
        let (found, directions, freedom) = solve(&x, &z, &b, 1).expect("strong instruments").contrast;
        assert_eq!((directions, freedom), (2, (TAPERS - 1) as f64));
        // Differences of influences lose as much again, and their covariance is inverted.
        assert_within(found, squares, 100.0 * ROUNDING * squares);
    }

    #[test]
    fn the_strength_is_what_instruments_explain_of_a_regressor_on_their_own() {
        let [x, z] = columns();
        let fits: Vec<Vec<f64>> = x
            .iter()
            .map(|one| {
                let values = least_squares(&[z.clone(), vec![one.clone()]].concat());
                let rest = left(&z, one, &values);
                one.iter().zip(rest).map(|(one, rest)| one - rest).collect()
            })
            .collect();
        // The third is explained by itself: it is as strong as can be.
        let each = (0..2).map(|one| {
            let others: Vec<Vec<f64>> = (0..3).filter(|&other| other != one).map(|other| fits[other].clone()).collect();
            let values = least_squares(&[others.clone(), vec![fits[one].clone()]].concat());
            let own = left(&others, &fits[one], &values);
            let rest: f64 = x[one].iter().zip(&fits[one]).map(|(x, fit)| (x - fit).powi(2)).sum();
            dot(&own, &own) / 3.0 / (rest / ROWS as f64)
        });
        let expected = each.fold(f64::INFINITY, f64::min);
        for reach in [0, 1, 7] {
            let found = solve(&x, &z, &rhs(&x), reach).expect("strong instruments").strength;
            assert_within(found * reach.max(1) as f64, expected, ROUNDING * expected);
        }
    }

    #[test]
    fn rows_of_zeros_change_no_estimate() {
        let [x, z] = columns();
        let b = rhs(&x);
        let padded = |column: &[f64]| -> Vec<f64> { [&[0.0; 5], column, &[0.0; 11]].concat() };
        let all = |columns: &[Vec<f64>]| -> Vec<Vec<f64>> { columns.iter().map(|one| padded(one)).collect() };
        let expected = solve(&x, &z, &b, 2).expect("strong instruments");
        let found = solve(&all(&x), &all(&z), &padded(&b), 2).expect("strong instruments");
        for (found, expected) in found.values.iter().zip(&expected.values) {
            assert_within(*found, *expected, ROUNDING * expected.abs());
        }
        assert_within(found.residual, expected.residual, ROUNDING * expected.residual);
        assert_within(found.strength, expected.strength, ROUNDING * expected.strength);
    }

    #[test]
    fn what_is_not_determined_is_not_given() {
        let [x, z] = columns();
        let b = rhs(&x);
        let with = |columns: &[Vec<f64>], place: usize, other: Vec<f64>| {
            let mut columns = columns.to_vec();
            columns[place] = other;
            columns
        };
        assert!(solve(&with(&x, 1, x[0].clone()), &z, &b, 1).is_none(), "two regressors are one");
        for nothing in [0.0, f64::NAN, f64::INFINITY] {
            assert!(solve(&with(&x, 1, vec![nothing; ROWS]), &z, &b, 1).is_none(), "a regressor of {nothing}");
            assert!(solve(&x, &with(&z, 1, vec![nothing; ROWS]), &b, 1).is_none(), "an instrument of {nothing}");
        }
        let doubled = z[0].iter().map(|value| 2.0 * value).collect();
        assert!(solve(&x, &with(&z, 1, doubled), &b, 1).is_none(), "two instruments are one");
        // More than two rows are needed for every unknown.
        let first = |count: usize| {
            let cut =
                |columns: &[Vec<f64>]| -> Vec<Vec<f64>> { columns.iter().map(|one| one[..count].to_vec()).collect() };
            solve(&cut(&x), &cut(&z), &b[..count], 1)
        };
        assert!(first(6).is_none());
        assert!(first(7).is_some());
    }

    /// Estimates of repeats of one unknown, 1, by 400 rows that follow an instrument, noise and, by a share, the noise of the right-hand side.
    fn repeats(share: f64) -> Vec<TwoStage> {
        let repeat = |repeat: u64| {
            let [z, own, noise] = [0, 1, 2].map(|column| random(1000 + 3 * repeat + column, 400));
            let x: Vec<f64> =
                (0..400).map(|row| 2.0 * z[row] + share * noise[row] + (1.0 - share) * own[row]).collect();
            let b: Vec<f64> = x.iter().zip(&noise).map(|(x, noise)| x + noise).collect();
            solve(&[x], &[z], &b, 1).expect("a strong instrument")
        };
        (0..REPEATS).map(repeat).collect()
    }

    /// Squared errors over their variance are 1 in the mean, as the variance of Student's distribution says. With 29 degrees of freedom the
    /// fourth moment makes their own variance `3 · 27/25 - 1`.
    #[test]
    fn errors_are_what_the_covariance_says_though_noise_reaches_the_regressor() {
        let deviation = ((3.0 * 27.0 / 25.0 - 1.0) / REPEATS as f64).sqrt();
        for share in [0.0, 1.0] {
            let squares: f64 = repeats(share).iter().map(|one| (one.values[0] - 1.0).powi(2) / one.covariance[0]).sum();
            assert_within(squares / REPEATS as f64, 1.0, 4.0 * deviation);
        }
    }

    /// Without noise that reaches the regressor the contrast follows an F distribution of 1 and 29 degrees of freedom: its mean is 29/27 and its
    /// variance 2.58. With it, least squares are 1/5 off, which is more than five errors: 0.2 against √(1/1600 - 1/2000) or so.
    #[test]
    fn the_contrast_tells_whether_noise_reaches_the_regressor() {
        let mean = |share: f64| repeats(share).iter().map(|one| one.contrast.0).sum::<f64>() / REPEATS as f64;
        assert_within(mean(0.0), 29.0 / 27.0, 4.0 * (2.58 / REPEATS as f64).sqrt());
        assert!(mean(1.0) > 25.0);
    }
}
