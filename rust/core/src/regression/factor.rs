//! Summaries of rows of equations: the triangular factor of their QR decomposition, and what the errors need. Eight at once.
//!
//! A row holds, in this order, the regressors of what is wanted in every window, their companions where it may grow linearly within
//! the window, the regressors of what is constant over the record, and the right-hand side. Summaries are merged, never subtracted
//! from, so a sum of millions of rows and a window next to a glitch keep their digits.
//!
//! Where the regressors carry noise of a known covariance, it is taken off *inside* the factor: with `R` the factor, `E` the expected
//! noise in `RᵀR` and `W = R⁻ᵀ E R⁻¹`, the corrected normal matrix is `Rᵀ (1 - W) R = (U R)ᵀ (U R)` with `UᵀU = 1 - W`. So `U R` is the
//! corrected factor, the condition number is never squared, and the correction is kept positive definite by bounding `W`.

use crate::simd::f64x8::Packet;

/// The largest part of a window's information that is ever believed to be noise.
const GUARD: f64 = 0.9;

/// Which columns rows have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Regressors of what is wanted in every window.
    pub(crate) windowed: usize,
    /// Whether what is wanted may grow linearly within a window.
    pub(crate) linear: bool,
    /// Regressors of what is constant over the record.
    pub(crate) constant: usize,
}

impl Layout {
    /// Unknowns that belong to one window.
    pub(crate) fn local(self) -> usize {
        self.windowed * if self.linear { 2 } else { 1 }
    }

    /// All unknowns.
    pub(crate) fn regressors(self) -> usize {
        self.local() + self.constant
    }

    /// Numbers in a row.
    pub(crate) fn columns(self) -> usize {
        self.regressors() + 1
    }

    /// Where an entry of the factor is, `row ≤ column`.
    #[inline(always)]
    pub(crate) fn entry(self, row: usize, column: usize) -> usize {
        row * self.columns() - row * (row + 1) / 2 + column
    }

    /// Where the sums over the rows begin: their number, their times and the squares of their times.
    #[inline(always)]
    fn sums(self) -> usize {
        triangle(self.columns())
    }

    /// Where the noise of the local unknowns begins: a symmetric matrix.
    #[inline(always)]
    pub(crate) fn noise(self) -> usize {
        self.sums() + 3
    }

    /// Numbers in a summary.
    pub(crate) fn size(self) -> usize {
        self.noise() + triangle(self.local())
    }
}

/// Entries of a symmetric matrix.
#[inline(always)]
pub(crate) fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

/// Where an entry of a symmetric matrix is that is kept row by row, the lower half.
#[inline(always)]
pub(crate) fn symmetric(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    triangle(high) + low
}

/// Adds rows to a factor by Householder reflections. `rows` holds them one after another and is used up.
///
/// With `triangular` row `i` has nothing before column `i`.
#[inline(always)]
pub(crate) fn absorb(layout: Layout, factor: &mut [Packet], rows: &mut [Packet], count: usize, triangular: bool) {
    let columns = layout.columns();
    for j in 0..columns {
        let active = if triangular { (j + 1).min(count) } else { count };
        let pivot = factor[layout.entry(j, j)];
        let mut below = Packet::ZERO;
        for i in 0..active {
            let value = rows[i * columns + j];
            below += value * value;
        }
        let squared = pivot * pivot + below;
        // The new pivot gets the sign that does not cancel.
        let turned = -squared.sqrt().with_sign_of(pivot);
        let head = pivot - turned;
        let weight = (squared - turned * pivot).inverse_or_zero();
        factor[layout.entry(j, j)] = turned;
        for k in j + 1..columns {
            let entry = layout.entry(j, k);
            let mut sum = head * factor[entry];
            for i in 0..active {
                sum += rows[i * columns + j] * rows[i * columns + k];
            }
            let sum = sum * weight;
            factor[entry] -= sum * head;
            for i in 0..active {
                let value = rows[i * columns + j];
                rows[i * columns + k] -= sum * value;
            }
        }
    }
}

/// Counts a row in, at a time after the summary's own.
#[inline(always)]
pub(crate) fn count(layout: Layout, summary: &mut [Packet], usable: Packet, time: f64) {
    let sums = layout.sums();
    summary[sums] += usable;
    summary[sums + 1] += usable * Packet::splat(time);
    summary[sums + 2] += usable * Packet::splat(time * time);
}

/// Adds a summary whose rows begin `later` seconds after this one's. `rows` is scratch for as many rows as there are columns.
#[inline(always)]
pub(crate) fn merge(layout: Layout, summary: &mut [Packet], other: &[Packet], later: f64, rows: &mut [Packet]) {
    let columns = layout.columns();
    for i in 0..columns {
        for j in i..columns {
            rows[i * columns + j] = other[layout.entry(i, j)];
        }
    }
    let shift = Packet::splat(later);
    if layout.linear {
        for regressor in 0..layout.windowed {
            for i in 0..=regressor {
                let value = rows[i * columns + regressor];
                rows[i * columns + layout.windowed + regressor] += shift * value;
            }
        }
    }
    absorb(layout, summary, rows, columns, true);
    let mut moved = [Packet::ZERO; 3];
    moved.copy_from_slice(&other[layout.sums()..layout.noise()]);
    move_sums(&mut moved, shift);
    for (sum, more) in summary[layout.sums()..layout.noise()].iter_mut().zip(moved) {
        *sum += more;
    }
    for i in 0..layout.local() {
        for j in 0..=i {
            summary[layout.noise() + symmetric(i, j)] += moved_noise(layout, other, shift, i, j);
        }
    }
}

/// Moves the time that a summary's rows are counted from to `later` seconds after it.
#[inline(always)]
pub(crate) fn recentre(layout: Layout, summary: &mut [Packet], later: f64, noise: &mut [Packet]) {
    let shift = Packet::splat(-later);
    for i in 0..layout.local() {
        for j in 0..=i {
            noise[symmetric(i, j)] = moved_noise(layout, summary, shift, i, j);
        }
    }
    summary[layout.noise()..layout.size()].copy_from_slice(&noise[..triangle(layout.local())]);
    if layout.linear {
        for regressor in 0..layout.windowed {
            for i in 0..=regressor {
                let value = summary[layout.entry(i, regressor)];
                summary[layout.entry(i, layout.windowed + regressor)] += shift * value;
            }
        }
    }
    move_sums(&mut summary[layout.sums()..layout.noise()], shift);
}

#[inline(always)]
fn move_sums(sums: &mut [Packet], shift: Packet) {
    let (count, times) = (sums[0], sums[1]);
    sums[1] += shift * count;
    sums[2] += shift * (times + times + shift * count);
}

/// An entry of the noise after all companions got `shift` times their regressor.
#[inline(always)]
fn moved_noise(layout: Layout, summary: &[Packet], shift: Packet, i: usize, j: usize) -> Packet {
    let at = |i: usize, j: usize| summary[layout.noise() + symmetric(i, j)];
    let q = layout.windowed;
    match (i >= q, j >= q) {
        (false, false) => at(i, j),
        (true, false) => at(i, j) + shift * at(i - q, j),
        (false, true) => at(i, j) + shift * at(i, j - q),
        (true, true) => at(i, j) + shift * (at(i - q, j) + at(i, j - q)) + shift * shift * at(i - q, j - q),
    }
}

/// Covariance of the noise that the angle's noise makes in one row: of all regressors' values, of the companions of the windowed ones
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

    fn is_zero(&self) -> bool {
        self.gram.iter().all(|&value| value == 0.0)
    }

    #[inline(always)]
    fn at(&self, i: usize, j: usize) -> Packet {
        Packet::splat(self.gram[i * self.size + j])
    }

    /// What the noise adds to entry `(i, j)` of the normal matrix, the right-hand side being the last column.
    #[inline(always)]
    fn expected(&self, layout: Layout, summary: &[Packet], i: usize, j: usize) -> Packet {
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

/// Where the numbers of a solved window are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fields {
    pub(crate) layout: Layout,
}

impl Fields {
    /// How a local unknown depends on a constant one (`constant < layout.constant`, its negative), or its value where all those
    /// are zero (`constant == layout.constant`).
    #[inline(always)]
    pub(crate) fn solution(self, local: usize, constant: usize) -> usize {
        local * (self.layout.constant + 1) + constant
    }

    /// Entry of the covariance of the local unknowns.
    #[inline(always)]
    pub(crate) fn covariance(self, i: usize, j: usize) -> usize {
        self.layout.local() * (self.layout.constant + 1) + symmetric(i, j)
    }

    /// Entry of the factor that is left for the constant unknowns once the local ones are eliminated, `row ≤ column`; in the last
    /// place the residual sum of squares.
    #[inline(always)]
    pub(crate) fn left(self, row: usize, column: usize) -> usize {
        let columns = self.layout.constant + 1;
        self.covariance(0, 0) + triangle(self.layout.local()) + row * columns - row * (row + 1) / 2 + column
    }

    /// Squared norm of the column of a constant unknown before anything was eliminated.
    #[inline(always)]
    pub(crate) fn norm(self, constant: usize) -> usize {
        self.left(self.layout.constant, self.layout.constant) + 1 + constant
    }

    /// What the rows' noise would leave of itself in the local unknowns: the residual's expectation is that much smaller.
    #[inline(always)]
    pub(crate) fn freedom(self) -> usize {
        self.norm(self.layout.constant)
    }

    /// Number of rows.
    #[inline(always)]
    pub(crate) fn count(self) -> usize {
        self.freedom() + 1
    }

    /// Condition number of the local regressors, each scaled to the same norm.
    #[inline(always)]
    pub(crate) fn condition(self) -> usize {
        self.freedom() + 2
    }

    /// Numbers of a window.
    pub(crate) fn size(self) -> usize {
        self.freedom() + 3
    }
}

/// Memory for [`solve`].
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    /// `E`, then `W`, then `U`: square, row by row.
    square: Vec<Packet>,
    factor: Vec<Packet>,
    side: Vec<Packet>,
    column: Vec<Packet>,
    inverse: Vec<Packet>,
    /// One over every pivot: divisions are what takes longest.
    pivots: Vec<Packet>,
}

impl Scratch {
    pub(crate) fn new(layout: Layout) -> Self {
        let p = layout.regressors();
        Self {
            square: vec![Packet::ZERO; p * p],
            factor: vec![Packet::ZERO; p * p],
            side: vec![Packet::ZERO; p],
            column: vec![Packet::ZERO; p.max(1)],
            inverse: vec![Packet::ZERO; layout.local() * layout.local()],
            pivots: vec![Packet::ZERO; p],
        }
    }
}

/// Solves what a summary says. `variance` is that of a row's noise; without one the residuals say it (ordinary least squares).
#[inline(always)]
pub(crate) fn solve(
    layout: Layout,
    summary: &[Packet],
    noise: &RowNoise,
    variance: Option<f64>,
    scratch: &mut Scratch,
    fields: &mut [Packet],
) {
    let (p, local) = (layout.regressors(), layout.local());
    let Scratch { square, factor, side, column, inverse, pivots } = scratch;
    // Lengths that the compiler sees.
    let (square, factor) = (&mut square[..p * p], &mut factor[..p * p]);
    let (side, column, pivots) = (&mut side[..p], &mut column[..p.max(1)], &mut pivots[..p]);
    let inverse = &mut inverse[..local * local];
    for i in 0..p {
        pivots[i] = summary[layout.entry(i, i)].inverse_or_zero();
        side[i] = summary[layout.entry(i, p)];
        for j in i..p {
            factor[i * p + j] = summary[layout.entry(i, j)];
        }
    }
    let last = summary[layout.entry(p, p)];
    let mut residual = last * last;
    if !noise.is_zero() {
        correct(layout, summary, noise, square, factor, side, column, pivots, &mut residual);
    }

    let names = Fields { layout };
    // The local unknowns, for every constant and for the right-hand side.
    for c in 0..=layout.constant {
        for i in (0..local).rev() {
            let mut value = if c < layout.constant { factor[i * p + local + c] } else { side[i] };
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
        fields[names.left(i, layout.constant)] = side[local + i];
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

/// Takes the expected noise off a factor and a side: see the head of this file.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the parts of one scratch")]
fn correct(
    layout: Layout,
    summary: &[Packet],
    noise: &RowNoise,
    square: &mut [Packet],
    factor: &mut [Packet],
    side: &mut [Packet],
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
    // g = R⁻ᵀ e, and the side that goes with the corrected factor: U⁻ᵀ (d - g).
    let mut before = Packet::ZERO;
    for i in 0..p {
        let mut value = part * noise.expected(layout, summary, i, p);
        for k in 0..i {
            value -= factor[k * p + i] * column[k];
        }
        column[i] = value * pivots[i];
        before += side[i] * side[i];
        side[i] -= column[i];
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
        let mut value = side[i];
        for k in 0..i {
            value -= square[k * p + i] * side[k];
        }
        side[i] = value * inverse;
        after += side[i] * side[i];
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

/// A number, but zero where another one is.
#[inline(always)]
fn zero_where_zero(zero: Packet, value: Packet) -> Packet {
    let mut result = value;
    for (value, zero) in result.0.iter_mut().zip(zero.0) {
        *value = if zero == 0.0 { 0.0 } else { *value };
    }
    result
}

/// Covariance of the local unknowns, what they take of the residual, and how hard they are to tell apart.
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
    // N = R⁻ᵀ M R⁻¹ is the noise in the coordinates of the factor; its trace is what the local unknowns take of the residual.
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
                // Rows that agree with each other cannot make a window better than independent ones would.
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
