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

/// Covariance of the local unknowns, the degrees of freedom that they take, and their condition number.
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
        fields[names.freedom()] = Packet::splat(local as f64);
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
