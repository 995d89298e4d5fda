//! The noise of the angle in the normal matrix, and its removal inside the triangular factor.
//!
//! Where the regressors carry noise of a known covariance, it is removed *inside* the factor. With `R` the factor, `E`
//! the expected noise in `RᵀR` and `W = R⁻ᵀ E R⁻¹`, the corrected normal matrix is `Rᵀ (1 - W) R = (U R)ᵀ (U R)` with
//! `UᵀU = 1 - W`. So `U R` is the corrected factor. The condition number is never squared, and the correction stays
//! positive definite because `W` is bounded.

use crate::regression::layout::Layout;
use crate::simd::f64x8::Packet;

/// The largest share of a window's information that is attributed to noise.
const GUARD: f64 = 0.9;

/// Covariance in one row of the noise that comes from the angle: of the values of all regressors, the companions of the windowed ones
/// and of the right-hand side, in the order of [`Layout`].
#[derive(Clone, Debug)]
pub(crate) struct RowNoise {
    gram: Vec<f64>,
    size: usize,
}

impl RowNoise {
    /// The Gram matrix of kernels times the variance of the samples, in the order: values of the windowed regressors, their
    /// companions, constant regressors, right-hand side. A kernel without entries is that of a column without noise.
    pub(crate) fn new(kernels: &[&[f64]], variance: f64) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let gram = kernels.iter().flat_map(|a| kernels.iter().map(move |b| variance * dot(a, b))).collect();
        Self { gram, size: kernels.len() }
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.gram.iter().all(|&value| value == 0.0)
    }

    #[inline(always)]
    fn at(&self, i: usize, j: usize) -> Packet {
        Packet::splat(self.gram[i * self.size + j])
    }

    /// The variance of the noise in one row of all columns, each times a factor.
    pub(crate) fn variance(&self, factors: &[f64]) -> f64 {
        let each = || factors.iter().enumerate().filter(|(_, factor)| **factor != 0.0);
        each().map(|(i, a)| a * each().map(|(j, b)| b * self.gram[i * self.size + j]).sum::<f64>()).sum()
    }

    /// The variance in one row of the noise of a constant regressor less windowed regressors times some factors.
    pub(crate) fn without_windowed(&self, layout: Layout, constant: usize, factors: &[f64]) -> f64 {
        let at = |i: usize, j: usize| self.gram[i * self.size + j];
        let own = 2 * layout.windowed + constant;
        let each = || factors.iter().enumerate();
        let beside = each().map(|(j, factor)| factor * at(own, j)).sum::<f64>();
        let squared = each().flat_map(|(i, a)| each().map(move |(j, b)| a * b * at(i, j))).sum::<f64>();
        at(own, own) - 2.0 * beside + squared
    }

    /// What the noise adds to entry `(i, j)` of the normal matrix, the right-hand side being the last column.
    #[inline(always)]
    pub(crate) fn expected(&self, layout: Layout, summary: &[Packet], i: usize, j: usize) -> Packet {
        let sums = &summary[layout.sums()..layout.noise()];
        let (count, times, squares) = (sums[0], sums[1], sums[2]);
        let q = layout.windowed;
        // Kernels are listed with companions whether or not the layout uses them.
        let kernel = |column: usize| if column < layout.local() { column } else { column - layout.local() + 2 * q };
        let companion = |column: usize| (q..layout.local()).contains(&column);
        let (a, b) = (kernel(i), kernel(j));
        match (companion(i), companion(j)) {
            (false, false) => count * self.at(a, b),
            (true, false) => count * self.at(a, b) + times * self.at(a - q, b),
            (false, true) => count * self.at(a, b) + times * self.at(a, b - q),
            (true, true) => {
                count * self.at(a, b)
                    + times * (self.at(a - q, b) + self.at(a, b - q))
                    + squares * self.at(a - q, b - q)
            }
        }
    }
}

/// Removes the expected noise from a factor and a right-hand side, as the head of this file says.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of one scratch")]
pub(crate) fn correct(
    layout: Layout,
    summary: &[Packet],
    noise: &RowNoise,
    square: &mut [Packet],
    factor: &mut [Packet],
    rhs: &mut [Packet],
    column: &mut [Packet],
    pivots: &mut [Packet],
    residual: &mut Packet,
) {
    let p = layout.regressors();
    // W = R⁻ᵀ E R⁻¹, first from the left, then from the right.
    for j in 0..p {
        for i in 0..p {
            let mut value = noise.expected(layout, summary, i, j);
            for k in 0..i {
                value -= factor[k * p + i] * square[k * p + j];
            }
            square[i * p + j] = value * pivots[i];
        }
    }
    let mut norm = Packet::ZERO;
    for i in 0..p {
        for j in 0..p {
            let mut value = square[i * p + j];
            for k in 0..j {
                value -= square[i * p + k] * factor[k * p + j];
            }
            square[i * p + j] = value * pivots[j];
            norm += square[i * p + j] * square[i * p + j];
        }
    }
    // No eigenvalue of W exceeds its norm.
    let part = Packet::ONE.min(Packet::splat(GUARD) * norm.sqrt().inverse_or_zero()).max(Packet::ZERO);
    let part = zero_where_zero(norm, part);
    // g = R⁻ᵀ e, and the right-hand side of the corrected factor: U⁻ᵀ (d - g).
    let mut before = Packet::ZERO;
    for i in 0..p {
        let mut value = part * noise.expected(layout, summary, i, p);
        for k in 0..i {
            value -= factor[k * p + i] * column[k];
        }
        column[i] = value * pivots[i];
        before += rhs[i] * rhs[i];
        rhs[i] -= column[i];
    }
    // U, the factor of 1 - W, in the place of W; and U⁻ᵀ (d - g) in the place of d - g.
    let mut after = Packet::ZERO;
    for i in 0..p {
        let mut diagonal = Packet::ONE - part * square[i * p + i];
        for k in 0..i {
            diagonal -= square[k * p + i] * square[k * p + i];
        }
        let diagonal = diagonal.max(Packet::splat((1.0 - GUARD) * f64::EPSILON)).sqrt();
        let inverse = Packet::ONE / diagonal;
        square[i * p + i] = diagonal;
        for j in i + 1..p {
            let mut value = -(part * square[i * p + j]);
            for k in 0..i {
                value -= square[k * p + i] * square[k * p + j];
            }
            square[i * p + j] = value * inverse;
        }
        let mut value = rhs[i];
        for k in 0..i {
            value -= square[k * p + i] * rhs[k];
        }
        rhs[i] = value * inverse;
        after += rhs[i] * rhs[i];
        pivots[i] = pivots[i] * inverse;
    }
    for i in 0..p {
        for j in (i..p).rev() {
            let mut value = Packet::ZERO;
            for k in i..=j {
                value += square[i * p + k] * factor[k * p + j];
            }
            factor[i * p + j] = value;
        }
    }
    *residual = (*residual + before - after - part * noise.expected(layout, summary, p, p)).max(Packet::ZERO);
}

/// `value`, or zero in lanes where `zero` is zero.
#[inline(always)]
fn zero_where_zero(zero: Packet, value: Packet) -> Packet {
    let mut result = value;
    for (value, zero) in result.0.iter_mut().zip(zero.0) {
        *value = if zero == 0.0 { 0.0 } else { *value };
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::layout::Layout;
    use crate::regression::simulated::{assert_near, products, random};
    use crate::regression::summary::{absorb, count};

    const LAYOUT: Layout = Layout { windowed: 1, linear: true, constant: 1 };
    const ROWS: usize = 12;
    const ROUNDING: f64 = 1e-12;

    /// Kernels of the value, its companion, the constant and the right-hand side.
    const KERNELS: [&[f64]; 4] = [&[1.0, 2.0, -1.0], &[0.5, 0.0, 1.0], &[0.0, 1.0, 1.0], &[1.0, 0.0, 0.0]];

    fn columns() -> Vec<Vec<f64>> {
        let value = random(1, ROWS);
        let companion = (0..ROWS).map(|row| random(2, ROWS)[row] + row as f64 * value[row]).collect();
        vec![value, companion, random(3, ROWS), random(4, ROWS)]
    }

    fn summary() -> Vec<Packet> {
        let columns = columns();
        let mut summary = vec![Packet::ZERO; LAYOUT.size()];
        let mut rows: Vec<Packet> =
            (0..ROWS).flat_map(|row| columns.iter().map(move |one| Packet::splat(one[row]))).collect();
        absorb(LAYOUT, &mut summary, &mut rows, ROWS, false);
        (0..ROWS).for_each(|row| count(LAYOUT, &mut summary, Packet::ONE, row as f64));
        summary
    }

    /// What noise adds to the products of two columns: row by row, the companion's kernel with the row's time.
    fn added(i: usize, j: usize, variance: f64) -> f64 {
        let kernel = |column: usize, row: usize, k: usize| {
            let own = KERNELS[column].get(k).copied().unwrap_or(0.0);
            own + if column == 1 { row as f64 * KERNELS[0][k] } else { 0.0 }
        };
        (0..ROWS).map(|row| (0..3).map(|k| variance * kernel(i, row, k) * kernel(j, row, k)).sum::<f64>()).sum()
    }

    #[test]
    fn the_noise_of_a_combination_of_columns_is_that_of_their_kernels_combined() {
        let noise = RowNoise::new(&KERNELS, 0.3);
        let of = |factors: [f64; 4]| -> f64 {
            let kernel = (0..3).map(|k| {
                let each = KERNELS.iter().zip(factors);
                each.map(|(kernel, factor)| factor * kernel.get(k).copied().unwrap_or(0.0)).sum::<f64>()
            });
            kernel.map(|value| 0.3 * value * value).sum()
        };
        for factors in [[1.0, 0.0, 0.0, 0.0], [0.5, -2.0, 3.0, -1.0], [0.0, 0.0, 2.0, 1.0]] {
            assert_near(noise.variance(&factors), of(factors), ROUNDING);
        }
        assert_near(noise.without_windowed(LAYOUT, 0, &[0.7]), of([-0.7, 0.0, 1.0, 0.0]), ROUNDING);
    }

    #[test]
    fn noise_adds_the_products_of_kernels_row_by_row() {
        let (noise, summary) = (RowNoise::new(&KERNELS, 0.3), summary());
        for i in 0..4 {
            for j in 0..4 {
                assert_near(noise.expected(LAYOUT, &summary, i, j).0[5], added(i, j, 0.3), ROUNDING);
            }
        }
        assert!(!noise.is_zero());
        assert!(RowNoise::new(&KERNELS, 0.0).is_zero());
        assert!(RowNoise::new(&[&[], &[], &[], &[]], 1.0).is_zero());
    }

    /// The factor without the noise, as products of its columns; its right-hand side; and the squares that are left.
    fn corrected(variance: f64) -> (Vec<Vec<f64>>, Vec<f64>, f64) {
        let (summary, p) = (summary(), LAYOUT.regressors());
        let mut factor = vec![Packet::ZERO; p * p];
        let (mut rhs, mut pivots) = (vec![Packet::ZERO; p], vec![Packet::ZERO; p]);
        for i in 0..p {
            rhs[i] = summary[LAYOUT.entry(i, p)];
            pivots[i] = summary[LAYOUT.entry(i, i)].inverse_or_zero();
            (i..p).for_each(|j| factor[i * p + j] = summary[LAYOUT.entry(i, j)]);
        }
        let (mut square, mut column) = (vec![Packet::ZERO; p * p], vec![Packet::ZERO; p]);
        let last = summary[LAYOUT.entry(p, p)];
        let mut residual = last * last;
        let noise = RowNoise::new(&KERNELS, variance);
        correct(LAYOUT, &summary, &noise, &mut square, &mut factor, &mut rhs, &mut column, &mut pivots, &mut residual);
        let columns: Vec<Vec<f64>> = (0..p).map(|j| (0..=j).map(|i| factor[i * p + j].0[0]).collect()).collect();
        let rhs_products = columns.iter().map(|one| one.iter().zip(&rhs).map(|(a, b)| a * b.0[0]).sum()).collect();
        (products(&columns), rhs_products, residual.0[0])
    }

    #[test]
    fn the_corrected_factor_is_that_of_the_products_without_the_noise() {
        let (raw, variance) = (products(&columns()), 0.005);
        let (normal, rhs_products, residual) = corrected(variance);
        for i in 0..3 {
            for j in 0..3 {
                assert_near(normal[i][j], raw[i][j] - added(i, j, variance), ROUNDING);
            }
            assert_near(rhs_products[i], raw[i][3] - added(i, 3, variance), ROUNDING);
        }
        let best = crate::regression::simulated::solved(normal, rhs_products.clone());
        let explained: f64 = best.iter().zip(&rhs_products).map(|(value, rhs)| value * rhs).sum();
        assert_near(residual, raw[3][3] - added(3, 3, variance) - explained, 100.0 * ROUNDING);
    }

    #[test]
    fn noise_that_would_be_all_there_is_is_subtracted_in_part() {
        let raw = products(&columns());
        let (normal, _, residual) = corrected(1e6);
        // The same part is taken off every product, and a tenth of each direction is left at least.
        let part = (raw[0][0] - normal[0][0]) / added(0, 0, 1e6);
        assert!(part > 0.0 && part < 1e-3);
        for i in 0..3 {
            for j in 0..3 {
                assert_near(normal[i][j], raw[i][j] - part * added(i, j, 1e6), 1e3 * ROUNDING);
            }
            assert!(normal[i][i] >= (1.0 - GUARD) * (1.0 - 1e-9) * raw[i][i]);
        }
        assert!(residual >= 0.0);
    }
}
