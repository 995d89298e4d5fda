//! Solves a summary of rows: windowed unknowns, what remains for the constant ones, covariances and condition number.

use crate::regression::layout::{Fields, Layout, symmetric};
use crate::regression::noise_correction::{RowNoise, correct};
use crate::simd::f64x8::Packet;

/// Memory for [`solve`].
#[derive(Clone, Debug)]
pub(crate) struct SolveScratch {
    /// `E`, then `W`, then `U`: square, row by row.
    square: Vec<Packet>,
    factor: Vec<Packet>,
    rhs: Vec<Packet>,
    column: Vec<Packet>,
    inverse: Vec<Packet>,
    /// The reciprocal of every pivot: divisions take longest.
    pivots: Vec<Packet>,
}

impl SolveScratch {
    pub(crate) fn new(layout: Layout) -> Self {
        let p = layout.regressors();
        Self {
            square: vec![Packet::ZERO; p * p],
            factor: vec![Packet::ZERO; p * p],
            rhs: vec![Packet::ZERO; p],
            column: vec![Packet::ZERO; p.max(1)],
            inverse: vec![Packet::ZERO; layout.local() * layout.local()],
            pivots: vec![Packet::ZERO; p],
        }
    }
}

/// Solves a summary. `variance` is that of a row's noise; without it, it is estimated from the residuals (ordinary least squares).
#[inline(always)]
pub(crate) fn solve(
    layout: Layout,
    summary: &[Packet],
    noise: &RowNoise,
    variance: Option<f64>,
    scratch: &mut SolveScratch,
    fields: &mut [Packet],
) {
    let (p, local) = (layout.regressors(), layout.local());
    let SolveScratch { square, factor, rhs, column, inverse, pivots } = scratch;
    // Lengths that the compiler sees.
    let (square, factor) = (&mut square[..p * p], &mut factor[..p * p]);
    let (rhs, column, pivots) = (&mut rhs[..p], &mut column[..p.max(1)], &mut pivots[..p]);
    let inverse = &mut inverse[..local * local];
    for i in 0..p {
        pivots[i] = summary[layout.entry(i, i)].inverse_or_zero();
        rhs[i] = summary[layout.entry(i, p)];
        for j in i..p {
            factor[i * p + j] = summary[layout.entry(i, j)];
        }
    }
    let last = summary[layout.entry(p, p)];
    let mut residual = last * last;
    if !noise.is_zero() {
        correct(layout, summary, noise, square, factor, rhs, column, pivots, &mut residual);
    }

    let names = Fields { layout };
    // The local unknowns, for every constant and for the right-hand side.
    for c in 0..=layout.constant {
        for i in (0..local).rev() {
            let mut value = if c < layout.constant { factor[i * p + local + c] } else { rhs[i] };
            for j in i + 1..local {
                value -= factor[i * p + j] * fields[names.solution(j, c)];
            }
            fields[names.solution(i, c)] = value * pivots[i];
        }
    }
    for i in 0..layout.constant {
        for j in i..layout.constant {
            fields[names.left(i, j)] = factor[(local + i) * p + local + j];
        }
        fields[names.left(i, layout.constant)] = rhs[local + i];
        let mut squared = Packet::ZERO;
        for k in 0..=local + i {
            let value = summary[layout.entry(k, local + i)];
            squared += value * value;
        }
        fields[names.norm(i)] = squared;
    }
    fields[names.left(layout.constant, layout.constant)] = residual;
    let count = summary[layout.sums()];
    fields[names.count()] = count;
    errors(layout, summary, factor, pivots, residual, variance, inverse, column, fields);
}

/// Covariance of the local unknowns, what they take up of the rows' noise, and their condition number.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of one scratch")]
fn errors(
    layout: Layout,
    summary: &[Packet],
    factor: &[Packet],
    pivots: &[Packet],
    residual: Packet,
    variance: Option<f64>,
    inverse: &mut [Packet],
    column: &mut [Packet],
    fields: &mut [Packet],
) {
    let (p, local) = (layout.regressors(), layout.local());
    let names = Fields { layout };
    for j in 0..local {
        for i in (0..=j).rev() {
            let mut value = if i == j { Packet::ONE } else { Packet::ZERO };
            for k in i + 1..=j {
                value -= factor[i * p + k] * inverse[k * local + j];
            }
            inverse[i * local + j] = value * pivots[i];
        }
    }
    let mut squares = Packet::ZERO;
    for i in 0..local {
        let (mut norm, mut spread) = (Packet::ZERO, Packet::ZERO);
        for k in 0..=i {
            let value = factor[k * p + i];
            norm += value * value;
        }
        for k in i..local {
            let value = inverse[i * local + k];
            spread += value * value;
        }
        squares += norm * spread;
    }
    fields[names.condition()] = (squares * Packet::splat(local as f64)).sqrt();
    let count = summary[layout.sums()];
    let Some(variance) = variance else {
        let left = (count - Packet::splat(local as f64)).max(Packet::ONE);
        let variance = residual / left;
        for i in 0..local {
            for j in 0..=i {
                fields[names.covariance(i, j)] = variance * inverse_normal(inverse, local, i, j);
            }
        }
        fields[names.freedom()] = Packet::splat(f64::INFINITY);
        return;
    };
    // N = R⁻ᵀ M R⁻¹ is the noise in the coordinates of the factor; its trace is the expected reduction of the residual.
    let mut freedom = Packet::ZERO;
    let variance = Packet::splat(variance);
    for i in 0..local {
        for j in 0..=i {
            fields[names.covariance(i, j)] = Packet::ZERO;
        }
    }
    for a in 0..local {
        // Row a of R⁻ᵀ M.
        for j in 0..local {
            let mut value = Packet::ZERO;
            for k in 0..=a {
                value += inverse[k * local + a] * summary[layout.noise() + symmetric(k, j)];
            }
            column[j] = value;
        }
        for b in 0..local {
            let mut value = Packet::ZERO;
            for k in 0..=b {
                value += column[k] * inverse[k * local + b];
            }
            if a == b {
                freedom += value;
                // Correlated rows cannot give a smaller variance than independent ones.
                value = value.max(variance);
            }
            for i in 0..=a {
                for j in 0..=b.min(i) {
                    fields[names.covariance(i, j)] += inverse[i * local + a] * value * inverse[j * local + b];
                }
            }
        }
    }
    fields[names.freedom()] = freedom;
}

/// Entry of `(RᵀR)⁻¹`.
#[inline(always)]
fn inverse_normal(inverse: &[Packet], local: usize, i: usize, j: usize) -> Packet {
    let mut sum = Packet::ZERO;
    for k in i.max(j)..local {
        sum += inverse[i * local + k] * inverse[j * local + k];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{assert_near, least_squares, products, random};
    use crate::regression::summary::{absorb, count};

    const LAYOUT: Layout = Layout { windowed: 1, linear: true, constant: 1 };
    const ROWS: usize = 20;
    const ROUNDING: f64 = 1e-12;

    fn columns() -> Vec<Vec<f64>> {
        (1..5).map(|seed| random(seed, ROWS)).collect()
    }

    /// A window of these rows, its noise being the products of its local columns times a variance.
    fn window(variance: Option<f64>) -> Vec<f64> {
        let columns = columns();
        let mut summary = vec![Packet::ZERO; LAYOUT.size()];
        let mut rows: Vec<Packet> =
            (0..ROWS).flat_map(|row| columns.iter().map(move |one| Packet::splat(one[row]))).collect();
        absorb(LAYOUT, &mut summary, &mut rows, ROWS, false);
        (0..ROWS).for_each(|row| count(LAYOUT, &mut summary, Packet::ONE, row as f64));
        let products = products(&columns);
        for (i, j) in [(0, 0), (1, 0), (1, 1)] {
            summary[LAYOUT.noise() + symmetric(i, j)] = Packet::splat(variance.unwrap_or(0.0) * products[i][j]);
        }
        let mut fields = vec![Packet::ZERO; Fields { layout: LAYOUT }.size()];
        let noise = RowNoise::new(&[&[], &[], &[], &[]], 0.0);
        solve(LAYOUT, &summary, &noise, variance, &mut SolveScratch::new(LAYOUT), &mut fields);
        fields.iter().map(|field| field.0[6]).collect()
    }

    #[test]
    fn unknowns_of_a_window_depend_on_the_constant_as_least_squares_do() {
        let (fields, names, columns) = (window(None), Fields { layout: LAYOUT }, columns());
        for constant in [0.0, 1.0, -3.0] {
            let rest = (0..ROWS).map(|row| columns[3][row] - constant * columns[2][row]).collect();
            let expected = least_squares(&[columns[0].clone(), columns[1].clone(), rest]);
            for local in 0..2 {
                let found = fields[names.solution(local, 1)] - constant * fields[names.solution(local, 0)];
                assert_near(found, expected[local], ROUNDING);
            }
        }
    }

    #[test]
    fn what_is_left_gives_the_constant_and_the_sum_of_squares() {
        let (fields, names, columns) = (window(None), Fields { layout: LAYOUT }, columns());
        let expected = least_squares(&columns);
        assert_near(fields[names.left(0, 1)] / fields[names.left(0, 0)], expected[2], ROUNDING);
        let left = |row: usize| columns[3][row] - (0..3).map(|one| expected[one] * columns[one][row]).sum::<f64>();
        assert_near(fields[names.left(1, 1)], (0..ROWS).map(|row| left(row).powi(2)).sum(), ROUNDING);
        assert_near(fields[names.norm(0)], columns[2].iter().map(|x| x * x).sum(), ROUNDING);
        assert_near(fields[names.count()], ROWS as f64, 0.0);
    }

    #[test]
    fn errors_are_those_of_independent_rows_where_rows_are_independent() {
        let (names, normal) = (Fields { layout: LAYOUT }, products(&columns()));
        let [a, b, d] = [normal[0][0], normal[0][1], normal[1][1]];
        let determinant = a * d - b * b;
        let inverse = [[d, -b], [-b, a]].map(|row| row.map(|entry| entry / determinant));
        let (known, ordinary) = (window(Some(0.3)), window(None));
        let residual = ordinary[names.left(1, 1)] / (ROWS as f64 - 2.0);
        for (i, j) in [(0, 0), (1, 0), (1, 1)] {
            assert_near(known[names.covariance(i, j)], 0.3 * inverse[i][j], ROUNDING);
            assert_near(ordinary[names.covariance(i, j)], residual * inverse[i][j], ROUNDING);
        }
        // Two unknowns take up the noise of two rows.
        assert_near(known[names.freedom()], 0.6, ROUNDING);
        assert_eq!(ordinary[names.freedom()], f64::INFINITY);
        let condition = (2.0 * (a * inverse[0][0] + d * inverse[1][1])).sqrt();
        assert_near(known[names.condition()], condition, ROUNDING);
    }
}
