//! The ends of a record where window and order are chosen: coefficients shrunk by their covariance over the record.
//!
//! Towards the end of a window the noise of a derivative rises steeply with the order. One window cannot tell which of
//! its coefficients exceed their noise, but many can: over many windows of the same length near that end the coefficients
//! have the covariance `C + σ²`, `C` that of the signal. So the coefficients `c` of the first or last window are replaced by
//!
//! ```text
//! ĉ = U diag(λ/(λ + σ²)) Uᵀ c,   C = U diag(λ) Uᵀ,
//! ```
//!
//! the estimate of least mean squared error that is linear in them (Wiener), with `λ` taken to be zero where the signal
//! is below the noise. The constant is kept as it is, and coefficients of even and of odd degree are taken apart, as
//! they are uncorrelated in windows of a signal that looks the same forwards and backwards. All derivatives at all
//! places of the window follow from `ĉ`.
//!
//! The risk is measured at a dozen places: the same is done in all these windows, forwards and backwards, and compared there with a
//! reference from the centre of a window half as long as the record's best. In a record of few windows the best one is
//! uncertain and may smooth too much; the reference shows that, and its larger noise is subtracted. The estimates from
//! windows of several lengths are averaged with weights that fall with the square of the measured risk.

use std::ops::Range;
use std::rc::Rc;

use faer::linalg::solvers::{Llt, Qr};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, Par, Side};

use crate::auto_derivatives::block_means::{mean, step_at_end};
use crate::auto_derivatives::candidate_weights::Reference;
use crate::auto_derivatives::candidates::{Target, correlated};
use crate::auto_derivatives::differences::total;
use crate::auto_derivatives::global_choice::{CheckCancelled, Pair, rounded};
use crate::auto_derivatives::knots::{interpolated, knots};
use crate::auto_derivatives::local_weights::packet;
use crate::auto_derivatives::reference_line::ReferenceLine;
use crate::auto_derivatives::slopes::{BasisSums, SampleSlopes};
use crate::auto_derivatives::survey::{CLOSELY, Survey};
use crate::error::Error;
use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::boundary::End;
use crate::local_polynomials::coefficients::Projected;
use crate::local_polynomials::single_window::Window;
use crate::noise::correlated::CorrelatedNoise;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// The windows over the record's best, in half steps of a doubling, and every how many are tried in records that are not short.
const LADDER: Range<i32> = -4..5;
const EVERY: usize = 2;

/// The reference has a window so much shorter than the record's best.
const REFERENCE: f64 = 2.0;

/// Half-width of the shortest window.
const SHORTEST: usize = 8;

/// Samples near an end that are used, in half-widths of the record's best window, and at least.
const NEAR: usize = 64;
const LEAST_NEAR: usize = 1024;

/// The most windows that are used in short records and in others, and the fewest that give a risk.
const CLOSE_WINDOWS: usize = 1024;
const MOST_WINDOWS: usize = 256;
const FEWEST_WINDOWS: f64 = 20.0;

/// Estimates near an end, from the outermost sample inwards.
#[derive(Debug)]
pub(crate) struct AtEnd {
    pub(crate) values: Vec<f64>,
    pub(crate) errors: Vec<f64>,
    pub(crate) order: usize,
}

/// The estimates of one window length, by place from the end.
struct Shrunk {
    values: Vec<f64>,
    risks: Vec<f64>,
    order: usize,
}

/// Samples near an end.
struct Near<'a> {
    survey: &'a Survey<'a>,
    end: End,
    samples: Range<usize>,
    reference: Rc<ReferenceLine>,
}

/// Estimates the samples within half of a record's best window of both ends; NaN where no window gives an estimate.
/// `check_cancelled` is called repeatedly.
///
/// # Errors
/// Those of `check_cancelled`, at once.
pub(crate) fn estimate(
    survey: &Survey<'_>,
    pair: Pair,
    target: &Target<'_>,
    check_cancelled: &mut CheckCancelled<'_>,
) -> Result<Vec<(End, AtEnd)>, Error> {
    let samples = survey.record().len();
    let Some(reference) = Reference::new(pair, REFERENCE, target)? else { return Ok(Vec::new()) };
    let length = (NEAR * pair.half).max(LEAST_NEAR).min(samples);
    let first = Rc::new(ReferenceLine::new(survey, &(0..length), &reference));
    let ends = [(End::First, 0..length), (End::Last, samples - length..samples)];
    let at_end = |(end, samples): (End, Range<usize>)| {
        let reference = if samples.start == 0 {
            Rc::clone(&first)
        } else {
            Rc::new(ReferenceLine::new(survey, &samples, &reference))
        };
        let near = Near { survey, end, samples, reference };
        Ok((end, near.estimate(pair, target, check_cancelled)?))
    };
    ends.into_iter().map(at_end).collect()
}

/// Averages the estimates of windows of several lengths.
fn average(found: &[Shrunk], count: usize) -> AtEnd {
    let mut at_end = AtEnd { values: vec![f64::NAN; count], errors: vec![f64::NAN; count], order: 0 };
    let mut largest = 0.0;
    for place in 0..count {
        let known = || found.iter().filter(|one| one.risks.get(place).is_some_and(|risk| risk.is_finite()));
        let least = known().map(|one| one.risks[place]).fold(f64::INFINITY, f64::min);
        let (mut total, mut value, mut risk) = (0.0, 0.0, 0.0);
        for one in known() {
            // Risks of zero are those of a record without noise.
            let weight = if one.risks[place] > 0.0 { (least / one.risks[place]).powi(2) } else { 1.0 };
            total += weight;
            value += weight * one.values[place];
            risk += weight * one.risks[place];
            if place == 0 && weight > largest {
                (largest, at_end.order) = (weight, one.order);
            }
        }
        if total > 0.0 {
            (at_end.values[place], at_end.errors[place]) = (value / total, (risk / total).sqrt());
        }
    }
    at_end
}

impl Near<'_> {
    /// Averages the estimates of windows of several lengths at the first half of a record's best window.
    fn estimate(
        &self,
        pair: Pair,
        target: &Target<'_>,
        check_cancelled: &mut CheckCancelled<'_>,
    ) -> Result<AtEnd, Error> {
        let (survey, samples) = (self.survey, self.survey.record().len());
        let mut found = Vec::new();
        let closely = samples <= CLOSELY;
        for step in LADDER.step_by(if closely { 1 } else { EVERY }) {
            let half = rounded(pair.half as f64 * (0.5 * f64::from(step)).exp2());
            let half = if closely { half } else { survey.nearest_known(half) };
            if (SHORTEST..samples.div_ceil(4)).contains(&half) && 2 * half < samples / 2 {
                found.extend(self.shrink(half, pair.half, target, closely)?);
            }
            check_cancelled()?;
        }
        Ok(average(&found, pair.half))
    }

    /// The estimates of windows of one length at the first `count` places, or `None` if the outermost window cannot be used.
    fn shrink(&self, half: usize, count: usize, target: &Target<'_>, closely: bool) -> Result<Option<Shrunk>, Error> {
        let variance = target.noise.variance();
        let step = if closely { 1 } else { step_at_end(half) };
        let (inner, derivative) = (half / step, target.derivative);
        let length = (2 * inner + 1) * step;
        let (highest, count) = (target.highest(inner), count.min(length));
        if highest < derivative || length > self.samples.len() {
            return Ok(None);
        }
        let last = self.end == End::Last;
        let most = if closely { CLOSE_WINDOWS } else { MOST_WINDOWS };
        let tables = self.survey.tables(inner)?;
        let basis = &tables.basis;
        let mut samples = vec![0.0; length];
        self.survey.record().read(if last { self.samples.end - length } else { self.samples.start }, &mut samples);
        if last {
            samples.reverse();
        }
        let means: Vec<f64> = samples.chunks_exact(step).map(mean).collect();
        // In reversed time odd derivatives change their sign.
        let mirrored = if derivative % 2 == 1 { -1.0 } else { 1.0 };
        let sign = if last { mirrored } else { 1.0 };
        let Some(outermost) = Window::project(basis, &means, 0.0) else { return Ok(None) };
        let windows = self.survey.windows(half, &self.samples, most, last)?;
        let (starts, projected) = (&windows.starts, &windows.projected);
        let correlations = correlations(basis, highest, step, target.noise);
        let shrinkage = windows.shrinkage(highest, |all| shrinkage(all, highest, variance, &correlations));
        let power = i32::try_from(derivative).unwrap_or(i32::MAX);
        let scale = target.scale() / (step as f64).powi(power);
        let slopes = SampleSlopes::new(basis, step, derivative, highest + 1);
        let shrunk = |j: usize| shrinkage.iter().zip(&outermost.coefficients).map(|(row, c)| row[j] * c).sum::<f64>();
        let of_slopes = slopes.combined(&(0..=highest).map(shrunk).collect::<Vec<f64>>());
        let constant = f64::from(u8::from(derivative == 0));
        let sums = slopes.sums(&of_slopes, count, target.instructions);
        let values = sums.into_iter().map(|sum| sign * (scale * sum + constant * outermost.reference)).collect();
        let places = if closely { (0..count).collect() } else { knots(count) };
        let mut references = [Vec::new(), Vec::new()];
        let mut risk = |(&place, at_place): (&usize, [f64; MOST_DEGREES])| {
            let weights: Vec<f64> = shrinkage
                .iter()
                .map(|row| scale * row.iter().zip(&at_place).map(|(a, q)| a * q).sum::<f64>())
                .collect();
            let [forwards, backwards] = &mut references;
            self.reference.read(starts.iter().map(|start| start + place), forwards);
            self.reference.read(starts.iter().map(|start| start + length - 1 - place), backwards);
            let (weights, references) = (&*weights, &references);
            let differences = BoundaryDifferences { projected, weights, constant, mirrored, references };
            let (sum, count) = dispatch(target.instructions, differences);
            let own = if target.noise.is_white() {
                let share = 1.0 / step as f64;
                weights.iter().map(|weight| weight * (share * weight)).sum()
            } else {
                quadratic(weights, &correlations)
            };
            let shared = self.shared(basis, step, weights, (place, target));
            let risk = sum / count + variance * (2.0 * shared - self.reference.gain);
            if count < FEWEST_WINDOWS { f64::INFINITY } else { risk.max(variance * own) }
        };
        let at_places = slopes.of_coefficients_at(&places, target.instructions);
        let risks: Vec<f64> = places.iter().zip(at_places).map(&mut risk).collect();
        Ok(Some(Shrunk { values, risks: if closely { risks } else { interpolated(&places, &risks) }, order: highest }))
    }

    /// The product of the kernel at a place of a window, given by the weights of its coefficients, with that of the reference.
    fn shared(&self, basis: &Basis, step: usize, weights: &[f64], (place, target): (usize, &Target<'_>)) -> f64 {
        let length = basis.length() * step;
        let reference = correlated(self.reference.kernel.clone(), place.max(length - place), target.noise);
        let reach = reference.len() / 2;
        let meeting = place.saturating_sub(reach)..length.min(place + reach + 1);
        let at = |index: usize| reference[reach + index - place];
        let means = meeting.start / step..meeting.end.div_ceil(step);
        let value = |mean: usize| {
            let samples = meeting.start.max(mean * step)..meeting.end.min((mean + 1) * step);
            samples.map(at).sum::<f64>() / step as f64
        };
        let values: Vec<f64> = means.clone().map(value).collect();
        let sums = dispatch(target.instructions, BasisSums { basis, first: means.start, values: &values });
        sums.iter().zip(weights).map(|(sum, weight)| sum * weight).sum()
    }
}

/// Estimates at one place of every window, and at its mirror image, beside the reference there: the sum of the squared differences, in eight sums side
/// by side, and how many there are.
struct BoundaryDifferences<'a> {
    projected: &'a Projected,
    weights: &'a [f64],
    /// What a constant signal of one gives.
    constant: f64,
    /// One, or minus one where a derivative changes its sign in reversed time.
    mirrored: f64,
    /// The reference at these places, by window: forwards and backwards.
    references: &'a [Vec<f64>; 2],
}

impl Kernel for BoundaryDifferences<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> (f64, f64) {
        let Self { projected, weights, constant, mirrored, references } = self;
        let Projected { level, coefficients, .. } = projected;
        let (mut sum, mut known) = (Packet::ZERO, Packet::ZERO);
        for first in (0..level.len()).step_by(WIDTH) {
            let (mut even, mut odd) = (packet(level, first) * Packet::splat(constant), Packet::ZERO);
            for (pair, weights) in coefficients.chunks(2).zip(weights.chunks(2)) {
                even += packet(&pair[0], first) * Packet::splat(weights[0]);
                if let ([_, row], &[_, weight]) = (pair, weights) {
                    odd += packet(row, first) * Packet::splat(weight);
                }
            }
            // In reversed time odd coefficients change their sign, and so do odd derivatives.
            let forwards = even + odd - packet(&references[0], first);
            let backwards = (even - odd) * Packet::splat(mirrored) - packet(&references[1], first);
            for difference in [forwards, backwards] {
                let mut square = difference * difference;
                for lane in 0..WIDTH {
                    let counts = first + lane < level.len() && !square.0[lane].is_nan();
                    square.0[lane] = if counts { square.0[lane] } else { 0.0 };
                    known.0[lane] += if counts { 1.0 } else { 0.0 };
                }
                sum += square;
            }
        }
        (total(sum), total(known))
    }
}

/// The correlations `QᵀRQ` that the noise gives to the coefficients of a window of means of so many samples.
fn correlations(basis: &Basis, highest: usize, step: usize, noise: &CorrelatedNoise) -> Mat<f64> {
    let share = 1.0 / step as f64;
    if noise.is_white() {
        return Mat::from_fn(highest + 1, highest + 1, |i, j| if i == j { share } else { 0.0 });
    }
    let row = |degree: usize| {
        let values = (0..basis.length()).map(|index| basis.value(degree, index) * share);
        values.flat_map(|value| std::iter::repeat_n(value, step)).collect()
    };
    let rows: Vec<Vec<f64>> = (0..=highest).map(row).collect();
    let correlated: Vec<Vec<f64>> = rows.iter().map(|row| noise.correlate(row)).collect();
    // Even and odd degrees are uncorrelated; sums of what cancels would leave rounding.
    let product = |i: usize, j: usize| rows[i].iter().zip(&correlated[j]).map(|(a, b)| a * b).sum();
    Mat::from_fn(rows.len(), rows.len(), |i, j| if (i + j) % 2 == 0 { product(i, j) } else { 0.0 })
}

/// `wᵀMw`.
fn quadratic(weights: &[f64], matrix: &Mat<f64>) -> f64 {
    let row = |i: usize| weights.iter().enumerate().map(|(j, weight)| matrix[(i, j)] * weight).sum::<f64>();
    weights.iter().enumerate().map(|(i, weight)| weight * row(i)).sum()
}

/// The matrix that shrinks coefficients, row by row: `ĉ = Σ_i matrix_ij c_j` for the weights of derivatives, which are rows from the left.
///
/// With `σ² LLᵀ` the covariance of the noise, `L⁻¹c` has noise of equal variance in all directions.
fn shrinkage(projected: &Projected, highest: usize, variance: f64, correlations: &Mat<f64>) -> Vec<Vec<f64>> {
    let rows = &projected.coefficients[..=highest];
    let usable: Vec<usize> = (0..projected.level.len()).filter(|&window| !projected.level[window].is_nan()).collect();
    let mut matrix = vec![vec![0.0; rows.len()]; rows.len()];
    matrix[0][0] = 1.0;
    for first in [1, 2] {
        let degrees: Vec<usize> = (first..rows.len()).step_by(2).collect();
        let size = degrees.len();
        let own = Mat::from_fn(size, size, |i, j| correlations[(degrees[i], degrees[j])]);
        let Ok(factor) = Llt::new(own.as_ref(), Side::Lower) else { continue };
        let lower = factor.L();
        // Singular values of the coefficients rather than eigenvalues of their moments: squares would lose what is small beside the rest.
        let mut coefficients = Mat::from_fn(size, usable.len(), |j, row| rows[degrees[j]][usable[row]]);
        solve_lower_triangular_in_place(lower, coefficients.as_mut(), Par::Seq);
        // The triangular factor has the same singular values and directions as the thousands of rows that it is made of.
        let Ok(decomposed) = Qr::new(coefficients.transpose()).thin_R().thin_svd() else { continue };
        let (singular, vectors) = (decomposed.S().column_vector(), decomposed.V());
        // ĉ = L U diag(λ/(λ + σ²)) Uᵀ L⁻¹ c: directions on both sides.
        let outwards = lower * vectors;
        let mut inwards = vectors.to_owned();
        solve_upper_triangular_in_place(lower.transpose(), inwards.as_mut(), Par::Seq);
        for k in 0..singular.nrows() {
            let value = singular[k] * singular[k] / usable.len() as f64 - variance;
            if value > variance {
                let factor = value / (value + variance);
                for i in 0..size {
                    for j in 0..size {
                        matrix[degrees[j]][degrees[i]] += factor * outwards[(i, k)] * inwards[(j, k)];
                    }
                }
            }
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An orthonormal pair.
    const PAIR: [[f64; 2]; 2] = [[0.6, 0.8], [0.8, -0.6]];

    /// Four windows of which the coefficients of degrees 1 and 3 have moments of these eigenvalues, and one that cannot be used.
    fn projected(eigenvalues: [f64; 2]) -> Projected {
        let along = |window: usize, direction: usize| {
            let sign = if window < 2 { 1.0 } else { -1.0 };
            if window % 2 == direction { sign * (2.0 * eigenvalues[direction]).sqrt() } else { 0.0 }
        };
        let row = |place: usize| (0..4).map(|window| (0..2).map(|d| along(window, d) * PAIR[d][place]).sum()).collect();
        let mut coefficients: Vec<Vec<f64>> = vec![vec![5.0; 4], row(0), vec![0.0; 4], row(1)];
        for row in &mut coefficients {
            row.push(1e9);
        }
        Projected { level: vec![0.0, 0.0, 0.0, 0.0, f64::NAN], coefficients, residual: Vec::new() }
    }

    fn white() -> Mat<f64> {
        Mat::identity(4, 4)
    }

    /// Compares with what two eigenvalues leave of the coefficients along each of the pair.
    fn assert_shrinks(matrix: &[Vec<f64>], factors: [f64; 2]) {
        for (i, row) in matrix.iter().enumerate() {
            for (j, &found) in row.iter().enumerate() {
                let expected = match (i, j) {
                    (0, 0) => 1.0,
                    (1 | 3, 1 | 3) => (0..2).map(|d| factors[d] * PAIR[d][i / 2] * PAIR[d][j / 2]).sum(),
                    _ => 0.0,
                };
                assert!((found - expected).abs() < 8.0 * f64::EPSILON, "{i} {j}: {found} {expected}");
            }
        }
    }

    #[test]
    fn coefficients_shrink_as_wiener_says() {
        // Moments of 10 and 4 are signals of 9 and 3 beside noise of 1; a signal below the noise counts as none.
        assert_shrinks(&shrinkage(&projected([10.0, 4.0]), 3, 1.0, &white()), [0.9, 0.75]);
        assert_shrinks(&shrinkage(&projected([10.0, 1.9]), 3, 1.0, &white()), [0.9, 0.0]);
    }

    #[test]
    fn without_noise_small_coefficients_stay_beside_large_ones() {
        // The square of the smaller one is below the rounding of the larger one's.
        assert_shrinks(&shrinkage(&projected([1.0, 1e-20]), 3, 0.0, &white()), [1.0, 1.0]);
    }
}
