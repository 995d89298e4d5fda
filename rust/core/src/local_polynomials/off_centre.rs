//! A window's polynomials off its centre: their derivatives at several positions, one a lane, each by the order that is best there.
//!
//! With `d_n` the estimate by order `n`, `top` an order that fits the window and `σ²` its noise, the order is the one with the least
//!
//! ```text
//! bias_n² + var(d_n),   bias_n² = max(0, (d_n - d_top)² - var(d_top - d_n)),   var(d_n) = σ² Σ_{j≤n} q_j^(d)(x)².
//! ```
//!
//! Orders below the derivative's are left out where the window's own order is not one of them: zero with an error of zero is no estimate.
//! Operations are not fused, so that every path of instructions gives the same bits.

use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};

/// An order that a window is fitted with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Top {
    pub(crate) order: usize,
    pub(crate) share: f64,
    /// Of the noise; NaN where the order leaves no residual to tell it from.
    pub(crate) variance: f64,
}

/// A derivative at each lane's position and its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Evaluated {
    pub(crate) values: [f64; MOST_LANES],
    pub(crate) errors: [f64; MOST_LANES],
}

/// Tabulates the polynomials and their derivatives at one sample of a window in each lane: by derivative, by degree, by lane.
pub(crate) struct Tabulate<'a> {
    pub(crate) basis: &'a Basis,
    /// The first sample; lanes beyond the window repeat the last.
    pub(crate) place: usize,
    pub(crate) table: &'a mut [f64],
}

impl Kernel for Tabulate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { basis, place, table } = self;
        let mut polynomials = [simd.splat_f64s(0.0); MOST_DEGREES];
        let x = tabulate(simd, basis, place, &mut polynomials[..basis.degrees()]);
        for (derivative, table) in table.chunks_exact_mut(basis.degrees() * S::F64_LANES).enumerate() {
            if derivative > 0 {
                differentiate(simd, basis, x, derivative, &mut polynomials);
            }
            for (degree, &polynomial) in polynomials[..basis.degrees()].iter().enumerate() {
                simd.store(table, degree * S::F64_LANES, polynomial);
            }
        }
    }
}

/// Evaluates a window at one position in each lane.
pub(crate) struct OffCentre<'a> {
    /// What [`Tabulate`] gave.
    pub(crate) table: &'a [f64],
    pub(crate) coefficients: &'a [f64],
    /// The orders that share in the window.
    pub(crate) tops: &'a [Top],
    /// Whether a lower order may be taken.
    pub(crate) chosen: bool,
    /// Whether standard errors are wanted.
    pub(crate) errors: bool,
    /// The derivatives from 0 on, per sample.
    pub(crate) found: &'a mut [Evaluated],
}

/// The polynomials at one position in each lane, and a window's coefficients.
#[derive(Clone, Copy)]
struct Terms<'a> {
    table: &'a [f64],
    coefficients: &'a [f64],
}

/// Sums over the degrees up to an order: the estimate, and its variance over that of the noise.
#[derive(Clone, Copy)]
struct Sums<S: Lanes> {
    value: S::f64s,
    gain: S::f64s,
}

impl Kernel for OffCentre<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { table, coefficients, tops, chosen, errors, found } = self;
        let tables = table.chunks_exact(coefficients.len() * S::F64_LANES);
        for (derivative, (found, table)) in found.iter_mut().zip(tables).enumerate() {
            let terms = Terms { table, coefficients };
            if let [top] = tops {
                let (value, variance) = best(simd, top, terms, derivative, chosen);
                simd.store(&mut found.values, 0, value);
                if errors {
                    simd.store(&mut found.errors, 0, simd.sqrt_f64s(variance));
                }
            } else {
                let (value, error) = shared(simd, tops, terms, derivative, chosen);
                simd.store(&mut found.values, 0, value);
                simd.store(&mut found.errors, 0, error);
            }
        }
    }
}

/// The polynomials at each lane's sample. Returns the positions.
#[inline(always)]
fn tabulate<S: Lanes>(simd: S, basis: &Basis, first: usize, polynomials: &mut [S::f64s]) -> S::f64s {
    let mut positions = [0.0; MOST_LANES];
    let mut table = [0.0; MOST_DEGREES * MOST_LANES];
    for (lane, position) in positions[..S::F64_LANES].iter_mut().enumerate() {
        let place = (first + lane).min(basis.length() - 1);
        *position = basis.position(place);
        let (values, mirrored) = basis.row(place);
        for ((degree, value), rows) in values.iter().enumerate().zip(table.chunks_exact_mut(MOST_LANES)) {
            rows[lane] = if mirrored && degree % 2 == 1 { -value } else { *value };
        }
    }
    for (polynomial, row) in polynomials.iter_mut().zip(table.chunks_exact(MOST_LANES)) {
        *polynomial = simd.load(row, 0);
    }
    simd.load(&positions, 0)
}

/// The derivative of every polynomial from the one below it (see [`Basis::steps`]). Only one product and one sum wait for
/// the degree before.
#[inline(always)]
fn differentiate<S: Lanes>(
    simd: S,
    basis: &Basis,
    x: S::f64s,
    derivative: usize,
    values: &mut [S::f64s; MOST_DEGREES],
) {
    let zero = simd.splat_f64s(0.0);
    let (mut last, mut current) = (zero, zero);
    for (value, &(ratio, inverse)) in values.iter_mut().zip(basis.steps()) {
        let lower = simd.mul_f64s(simd.splat_f64s(derivative as f64 * inverse), *value);
        let waits = simd.sub_f64s(lower, simd.mul_f64s(simd.splat_f64s(ratio), last));
        let next = simd.add_f64s(waits, simd.mul_f64s(simd.mul_f64s(x, simd.splat_f64s(inverse)), current));
        *value = current;
        (last, current) = (current, next);
    }
}

/// The estimate of the best order up to one that fits the window, not below `lowest`, and its variance.
#[inline(always)]
fn best<S: Lanes>(simd: S, top: &Top, terms: Terms<'_>, lowest: usize, chosen: bool) -> (S::f64s, S::f64s) {
    let variance = simd.splat_f64s(top.variance);
    let zero = Sums { value: simd.splat_f64s(0.0), gain: simd.splat_f64s(0.0) };
    let mut up_to = zero;
    for degree in 0..=top.order {
        up_to = terms.add(simd, degree, up_to);
    }
    let (mut value, mut gain) = (up_to.value, up_to.gain);
    if chosen && !top.variance.is_nan() && lowest < top.order {
        // From the lowest order up, so that sums need not be kept: of equal errors the first counts.
        let mut sums = zero;
        for degree in 0..lowest {
            sums = terms.add(simd, degree, sums);
        }
        let mut least = simd.splat_f64s(f64::INFINITY);
        for order in lowest..top.order {
            sums = terms.add(simd, order, sums);
            let difference = simd.sub_f64s(sums.value, up_to.value);
            let chance = simd.mul_f64s(variance, simd.sub_f64s(up_to.gain, sums.gain));
            let bias = simd.sub_f64s(simd.mul_f64s(difference, difference), chance);
            let bias = simd.max_f64s(bias, zero.value);
            let error = simd.add_f64s(bias, simd.mul_f64s(variance, sums.gain));
            let better = simd.less_than_f64s(error, least);
            least = simd.select_f64s(better, error, least);
            value = simd.select_f64s(better, sums.value, value);
            gain = simd.select_f64s(better, sums.gain, gain);
        }
        let better = simd.less_than_f64s(simd.mul_f64s(variance, up_to.gain), least);
        value = simd.select_f64s(better, up_to.value, value);
        gain = simd.select_f64s(better, up_to.gain, gain);
    }
    (value, simd.mul_f64s(variance, gain))
}

impl Terms<'_> {
    /// Adds the term of one more degree.
    #[inline(always)]
    fn add<S: Lanes>(self, simd: S, degree: usize, sums: Sums<S>) -> Sums<S> {
        let q = simd.load(self.table, degree * S::F64_LANES);
        let term = simd.mul_f64s(simd.splat_f64s(self.coefficients[degree]), q);
        Sums { value: simd.add_f64s(sums.value, term), gain: simd.add_f64s(sums.gain, simd.mul_f64s(q, q)) }
    }
}

/// The average of several orders' estimates, and an error that knows how far they disagree.
#[inline(always)]
fn shared<S: Lanes>(simd: S, tops: &[Top], terms: Terms<'_>, lowest: usize, chosen: bool) -> (S::f64s, S::f64s) {
    let zero = simd.splat_f64s(0.0);
    let mut estimates = [(zero, zero); MOST_DEGREES];
    let mut value = zero;
    for (top, estimate) in tops.iter().zip(&mut estimates) {
        let (one, variance) = best(simd, top, terms, lowest, chosen);
        *estimate = (one, simd.sqrt_f64s(variance));
        value = simd.add_f64s(value, simd.mul_f64s(simd.splat_f64s(top.share), one));
    }
    let mut error = zero;
    for (top, (one, its_error)) in tops.iter().zip(estimates) {
        let off = simd.sub_f64s(one, value);
        let square = simd.add_f64s(simd.mul_f64s(its_error, its_error), simd.mul_f64s(off, off));
        error = simd.add_f64s(error, simd.mul_f64s(simd.splat_f64s(top.share), simd.sqrt_f64s(square)));
    }
    (value, error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::dispatch;

    fn tabulated(basis: &Basis, derivatives: usize, place: usize, instructions: Instructions) -> Vec<f64> {
        let mut table = vec![0.0; derivatives * basis.degrees() * instructions.lanes()];
        dispatch(instructions, Tabulate { basis, place, table: &mut table });
        table
    }

    #[test]
    fn derivatives_in_working_precision_are_as_good_as_it() {
        for length in [5, 17, 18, 51, 201, 2001, 20_001] {
            let basis = Basis::new(length, length.min(MOST_DEGREES)).expect("little memory");
            for index in (0..length).step_by(1 + length / 50) {
                let found = tabulated(&basis, 4, index, Instructions::Scalar);
                for (derivative, found) in found.chunks_exact(basis.degrees()).enumerate() {
                    let expected = basis.evaluate(basis.position(index), derivative);
                    let mut size = 0.0_f64;
                    for (j, (value, expected)) in found.iter().zip(&expected).enumerate() {
                        size = size.max(expected.abs());
                        let error = (value - expected).abs();
                        // Three roundings a degree, and derivatives upon each other.
                        assert!(
                            error <= 100.0 * f64::EPSILON * size,
                            "degree {j}, derivative {derivative}, sample {index} of {length}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn every_path_and_lane_gives_the_same_bits() {
        let basis = Basis::new(51, 16).expect("little memory");
        let coefficients: Vec<f64> = (0..16).map(|j| (f64::from(j) * 0.7).sin() / f64::from(1 + j)).collect();
        let tops = [3, 7, 15].map(|order| Top { order, share: 0.25, variance: 1e-3 });
        for tops in [&tops[..], &tops[1..2]] {
            let one = |instructions: Instructions, place: usize| {
                let table = tabulated(&basis, 3, place, instructions);
                let (mut found, coefficients) = ([Evaluated::default(); 3], &coefficients);
                let kernel =
                    OffCentre { table: &table, coefficients, tops, chosen: true, errors: true, found: &mut found };
                dispatch(instructions, kernel);
                found
            };
            for instructions in Instructions::available() {
                for first in (0..51).step_by(instructions.lanes()) {
                    let together = one(instructions, first);
                    for place in first..51.min(first + instructions.lanes()) {
                        for (alone, together) in one(Instructions::Scalar, place).iter().zip(&together) {
                            let lane = place - first;
                            assert_eq!(alone.values[0].to_bits(), together.values[lane].to_bits());
                            assert_eq!(alone.errors[0].to_bits(), together.errors[lane].to_bits());
                        }
                    }
                }
            }
        }
    }
}
