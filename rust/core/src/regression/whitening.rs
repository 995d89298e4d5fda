//! Whitening: rows are transformed so that their noise is uncorrelated.
//!
//! Rows that share samples have correlated noise. Where the noise of the angle dominates, it is smallest near the resonance,
//! where `I θ̈ + C θ̇ + K θ` is small; least squares with equal weights ignore that. With the factor `Γ = L Lᵀ` of the rows'
//! covariance, the rows `L⁻¹ X` and `L⁻¹ b` have noise of variance one, and their least squares are generalised least squares
//! (Aitken 1935). They equal maximum likelihood in the frequency domain, within the band that the test function passes.
//!
//! Γ is banded and so is L; its rows become stationary some rows after a gap. The noise of the angle adds `tr(Γ⁻¹ G)`
//! to the normal matrix for the products `G` of two kernels. This is the derivative of `log det Γ` in the direction of
//! `G`, and it is computed exactly, row by row, by differentiating the factorisation.

use std::collections::VecDeque;

use crate::equation::rows::{Regressor, Rows};
use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::row_neighbours::products;
use crate::simd::f64x8::{Packet, WIDTH};

/// Added to the variance of a row, relative to it, so that frequencies that the test function suppresses do not count.
const RIDGE: f64 = 1e-6;

/// The rows of the factor are stationary once they change by less than this, relative to the diagonal.
const SETTLED: f64 = 1e-8;

/// The most rows after a gap before the factor is assumed stationary.
const MOST: usize = 1 << 13;

/// Rows that are whitened before the last of them move to the front of what stays in the nearest cache.
const PIECE: usize = 256;

/// The transformation that whitens rows.
#[derive(Clone, Debug)]
pub(crate) struct Whitening {
    /// Rows of the factor after a gap, until they are stationary: the diagonal entry, then those of the rows before it, nearest first.
    factor: Vec<Vec<f64>>,
    /// What noise of variance one adds in these rows to the product of every pair of kernels.
    grams: Vec<Vec<f64>>,
}

/// A row of the factor, and its derivatives in some directions.
struct Factored {
    entries: Vec<f64>,
    changes: Vec<Vec<f64>>,
}

impl Whitening {
    /// The whitening of rows with a given covariance, or `None` if it is not positive definite.
    pub(crate) fn new(covariance: &RowCovariance, rows: &Rows, stride: usize) -> Option<Self> {
        let mut lags = covariance.lags.clone();
        lags[0] *= 1.0 + RIDGE;
        let kernels = kernels(rows);
        let directions: Vec<Vec<f64>> =
            pairs(kernels.len()).map(|(i, j)| both(kernels[i], kernels[j], lags.len(), stride)).collect();
        let (mut factor, mut grams) = (Vec::<Vec<f64>>::new(), Vec::new());
        let mut before: VecDeque<Factored> = VecDeque::new();
        while factor.len() < rows.len().min(MOST) {
            let next = Factored::after(&before, &lags, &directions)?;
            let gram = next.changes.iter().map(|change| 2.0 * change[0] / next.entries[0]);
            grams.push(gram.collect());
            let settled = factor.last().is_some_and(|last| {
                let moved = last.iter().zip(&next.entries).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                last.len() == lags.len() && moved <= SETTLED * next.entries[0]
            });
            factor.push(next.entries.clone());
            if settled {
                break;
            }
            before.push_front(next);
            before.truncate(lags.len() - 1);
        }
        (!factor.is_empty()).then_some(Self { factor, grams })
    }

    /// The whitened rows.
    pub(crate) fn apply(&self, rows: &Rows, stages: &mut Stages<'_, '_>) -> Result<Rows, Error> {
        let columns: Vec<&[f64]> =
            rows.regressors.iter().map(|regressor| regressor.value.as_slice()).chain([rows.rhs.as_slice()]).collect();
        let pieces = columns.chunks(WIDTH).map(|some| Piece { size: rows.len(), content: some });
        let mut white =
            stages.map(pieces.collect(), || (), |some: &[&[f64]], (): &mut ()| self.columns(rows, some))?.concat();
        let rhs = white.pop().unwrap_or_default();
        let roots = self.noise(rows);
        let mut roots = roots.into_iter();
        let mut root =
            |kernel: &Vec<f64>| if kernel.is_empty() { Vec::new() } else { roots.next().unwrap_or_default() };
        let regressors = white.into_iter().zip(&rows.regressors).map(|(value, regressor)| Regressor {
            value,
            companion: Vec::new(),
            noise: [root(&regressor.noise[0]), Vec::new()],
        });
        let regressors = regressors.collect();
        let rhs_noise = root(&rows.rhs_noise);
        let (usable, jumps) = (rows.usable.clone(), rows.jumps.clone());
        Ok(Rows { regressors, rhs, rhs_noise, usable, jumps, period: rows.period, roots: Vec::new() })
    }

    /// Some columns, whitened side by side: every row waits for those before it, so each column alone would wait as long.
    fn columns(&self, rows: &Rows, columns: &[&[f64]]) -> Vec<Vec<f64>> {
        let depth = self.factor.iter().map(Vec::len).max().unwrap_or(1) - 1;
        let mut white = vec![vec![0.0; rows.len()]; columns.len()];
        // Behind the last rows of the piece before.
        let mut piece = vec![Packet::ZERO; depth + PIECE];
        for (row, since) in since_gaps(rows).enumerate() {
            let place = depth + row % PIECE;
            if place == depth {
                piece.copy_within(PIECE.., 0);
            }
            let Some(since) = since else {
                piece[place] = Packet::ZERO;
                continue;
            };
            let factor = self.at(since);
            let mut value = Packet::ZERO;
            value.0.iter_mut().zip(columns).for_each(|(lane, column)| *lane = column[row]);
            let before = factor[1..].iter().zip(piece[..place].iter().rev());
            let sum = before.fold(Packet::ZERO, |sum, (entry, value)| sum + Packet::splat(*entry) * *value);
            value = (value - sum) / Packet::splat(factor[0]);
            piece[place] = value;
            white.iter_mut().zip(value.0).for_each(|(column, value)| column[row] = value);
        }
        white
    }

    fn at(&self, since: usize) -> &[f64] {
        &self.factor[since.min(self.factor.len() - 1)]
    }

    /// Vectors that replace the kernels: their products are what noise of variance one adds to a row on average.
    fn noise(&self, rows: &Rows) -> Vec<Vec<f64>> {
        let size = kernels(rows).len();
        let (mut mean, mut count) = (vec![0.0; size * (size + 1) / 2], 0.0_f64);
        for since in since_gaps(rows).flatten() {
            let gram = &self.grams[since.min(self.grams.len() - 1)];
            mean.iter_mut().zip(gram).for_each(|(sum, entry)| *sum += entry);
            count += 1.0;
        }
        let mean: Vec<f64> = mean.into_iter().map(|sum| sum / count.max(1.0)).collect();
        square_root(&mean, size)
    }
}

impl Factored {
    /// The row of the factor that follows some others, the nearest first, or `None` if the covariance is not positive definite.
    fn after(before: &VecDeque<Self>, lags: &[f64], directions: &[Vec<f64>]) -> Option<Self> {
        let depth = before.len();
        let mut entries = vec![0.0; depth + 1];
        let mut changes = vec![vec![0.0; depth + 1]; directions.len()];
        for k in (1..=depth).rev() {
            let other = &before[k - 1];
            let shared = || (k + 1..=depth).zip(1..other.entries.len());
            let sum = lags[k] - shared().map(|(own, its)| entries[own] * other.entries[its]).sum::<f64>();
            entries[k] = sum / other.entries[0];
            for ((change, direction), theirs) in changes.iter_mut().zip(directions).zip(&other.changes) {
                let products = shared().map(|(own, its)| change[own] * other.entries[its] + entries[own] * theirs[its]);
                let sum = direction[k] - products.sum::<f64>();
                change[k] = (sum - entries[k] * theirs[0]) / other.entries[0];
            }
        }
        let squared = lags[0] - entries.iter().map(|entry| entry * entry).sum::<f64>();
        if squared.is_nan() || squared <= 0.0 {
            return None;
        }
        entries[0] = squared.sqrt();
        for (change, direction) in changes.iter_mut().zip(directions) {
            let products = (1..=depth).map(|k| entries[k] * change[k]).sum::<f64>();
            change[0] = (direction[0] - 2.0 * products) / (2.0 * entries[0]);
        }
        Some(Self { entries, changes })
    }
}

/// The kernels by which the noise of the angle enters: of the regressors, then of the right-hand side. Columns without noise have none.
fn kernels(rows: &Rows) -> Vec<&[f64]> {
    let all = rows.regressors.iter().map(|regressor| &regressor.noise[0]).chain([&rows.rhs_noise]);
    all.filter(|kernel| !kernel.is_empty()).map(Vec::as_slice).collect()
}

/// Indices of the lower triangle of a square matrix, row by row.
fn pairs(size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..size).flat_map(|i| (0..=i).map(move |j| (i, j)))
}

/// The covariance that noise of variance one gives two columns, by the distance of the rows; the mean of either row coming first.
fn both(one: &[f64], other: &[f64], lags: usize, stride: usize) -> Vec<f64> {
    let either = |lag: usize| f64::midpoint(products(one, other, lag * stride), products(other, one, lag * stride));
    (0..lags).map(either).collect()
}

/// For every usable row, how many usable rows precede it since the last gap.
fn since_gaps(rows: &Rows) -> impl Iterator<Item = Option<usize>> {
    let mut since = 0;
    rows.usable.iter().map(move |&usable| {
        let place = since;
        since = if usable { place + 1 } else { 0 };
        usable.then_some(place)
    })
}

/// Vectors with given products, the lower half row by row.
fn square_root(products: &[f64], size: usize) -> Vec<Vec<f64>> {
    let mut root = vec![vec![0.0; size]; size];
    for (place, (i, j)) in pairs(size).enumerate() {
        let left = products[place] - (0..j).map(|k| root[i][k] * root[j][k]).sum::<f64>();
        let scale = products[place];
        root[i][j] = if i == j {
            // A vector that depends on the others leaves only rounding errors.
            if left > f64::EPSILON.sqrt() * scale { left.sqrt() } else { 0.0 }
        } else if root[j][j] > 0.0 {
            left / root[j][j]
        } else {
            0.0
        };
    }
    root
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::*;
    use crate::weak_form::test_function::TestFunction;

    const STRIDE: usize = 5;
    /// Rows of the factor are made from sums of a few products, each row from those before it: relative errors stay near those of one sum.
    const ROUNDING: f64 = 1e-9;

    /// Rows whose regressors are the columns of a unit matrix, some of them missing, for the kernels of inertia, damping and stiffness.
    fn units(count: usize, missing: &[usize]) -> (Rows, RowCovariance) {
        let function = TestFunction::new(30, 8, 1e-3).expect("a test function");
        let kernels = function.kernels(0.0).values;
        let covariance =
            RowCovariance::known(&function.kernels(0.0), &kernels[2], [0.01, 0.1, 15.0], [1e-4, 1e-2], STRIDE);
        let column = |one: usize| (0..count).map(|row| f64::from(u8::from(row == one))).collect::<Vec<_>>();
        let noise = |one: usize| [kernels.get(one).cloned().unwrap_or_default(), Vec::new()];
        let regressors =
            (0..count).map(|one| Regressor { value: column(one), companion: Vec::new(), noise: noise(one) });
        let usable = (0..count).map(|row| !missing.contains(&row)).collect();
        let mut rows = Rows { regressors: regressors.collect(), rhs: vec![0.0; count], usable, ..Rows::default() };
        rows.clear_unusable();
        (rows, covariance)
    }

    fn whitened(rows: &Rows, covariance: &RowCovariance) -> Rows {
        let mut watch = |_: usize, _: usize| true;
        let mut stages = Stages::new(NonZeroUsize::MIN, 1, 1, &mut watch);
        let whitening = Whitening::new(covariance, rows, STRIDE).expect("a covariance");
        whitening.apply(rows, &mut stages).expect("not cancelled")
    }

    /// A number for every two rows by their distance, zero where either is missing or a gap lies between them.
    fn banded(rows: &Rows, by_distance: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
        let entry = |i: usize, j: usize| {
            let between = i.min(j)..=i.max(j);
            if between.clone().all(|row| rows.usable[row]) { by_distance(i.abs_diff(j)) } else { 0.0 }
        };
        (0..rows.len()).map(|i| (0..rows.len()).map(|j| entry(i, j)).collect()).collect()
    }

    /// `W A Wᵀ` at some rows, for what is made of unit columns.
    fn between(white: &Rows, middle: &[Vec<f64>], i: usize, j: usize) -> f64 {
        let all = || 0..white.len();
        let value = |row: usize, column: usize| white.regressors[column].value[row];
        all().map(|k| all().map(|l| value(i, k) * middle[k][l] * value(j, l)).sum::<f64>()).sum()
    }

    #[test]
    fn the_noise_of_white_rows_is_white_and_gaps_are_new_beginnings() {
        let (rows, covariance) = units(90, &[0, 31, 32, 60]);
        let white = whitened(&rows, &covariance);
        let lag = |distance: usize| covariance.lags.get(distance).copied().unwrap_or(0.0);
        let ridge = |distance: usize| if distance == 0 { (1.0 + RIDGE) * lag(0) } else { lag(distance) };
        let noise = banded(&rows, ridge);
        for i in 0..rows.len() {
            for j in 0..rows.len() {
                let expected = f64::from(u8::from(i == j && rows.usable[i]));
                let found = between(&white, &noise, i, j);
                assert!((found - expected).abs() < ROUNDING / RIDGE.sqrt(), "{i} {j}: {found}");
            }
        }
    }

    #[test]
    fn what_the_angles_noise_adds_is_exact_over_all_rows() {
        let (rows, covariance) = units(70, &[25]);
        let white = whitened(&rows, &covariance);
        let kernel = |one: usize| rows.regressors[one].noise[0].as_slice();
        for (one, other) in pairs(3) {
            let lags = both(kernel(one), kernel(other), covariance.lags.len(), STRIDE);
            let added = banded(&rows, |distance| lags.get(distance).copied().unwrap_or(0.0));
            let expected: f64 = (0..rows.len()).map(|row| between(&white, &added, row, row)).sum();
            let root = |which: usize| &white.regressors[which].noise[0];
            let found: f64 = 69.0 * root(one).iter().zip(root(other)).map(|(a, b)| a * b).sum::<f64>();
            let scale: f64 = [one, other].map(|one| root(one).iter().map(|a| a * a).sum::<f64>()).iter().product();
            assert!((found - expected).abs() < ROUNDING * 69.0 * scale.sqrt(), "{one} {other}: {found} {expected}");
        }
    }

    #[test]
    fn long_records_go_on_as_soon_as_rows_have_settled() {
        let (mut rows, covariance) = units(3, &[]);
        rows.rhs.resize(4000, 0.0);
        rows.usable.resize(4000, true);
        let whitening = Whitening::new(&covariance, &rows, STRIDE).expect("a covariance");
        assert!(whitening.factor.len() < 2000, "{}", whitening.factor.len());
        let longer = RowCovariance::by_distance(vec![1.0, 0.6]);
        assert!(Whitening::new(&longer, &rows, STRIDE).is_none(), "no covariance has such neighbours");
    }
}
