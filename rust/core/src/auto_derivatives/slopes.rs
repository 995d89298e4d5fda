//! Derivatives of a basis at many places of a window, and sums over such places.

use crate::auto_derivatives::deconvolution::AtCentre;
use std::ops::{Add, Mul, Sub};

use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// A derivative at the samples of a window that is made of means, or of samples.
pub(crate) struct SampleSlopes<'a> {
    basis: &'a Basis,
    step: usize,
    derivative: usize,
    /// Samples before the window that places are counted from.
    before: usize,
    /// The polynomials whose means those of the basis are, in terms of the basis; none where they are the same.
    polynomials: Vec<Vec<f64>>,
}

impl<'a> SampleSlopes<'a> {
    pub(crate) fn new(basis: &'a Basis, step: usize, derivative: usize, degrees: usize) -> Self {
        let polynomials = if step == 1 { Vec::new() } else { AtCentre::new(basis, step).polynomials(degrees) };
        Self { basis, step, derivative, before: 0, polynomials }
    }

    /// The same with places counted from so many samples before a window of means.
    pub(crate) fn after(self, before: usize) -> Self {
        Self { before, ..self }
    }

    /// The products of some factors with the derivative of every polynomial of the basis, summed, at the first samples of the window: at
    /// eight at a time, with the bits of each by itself.
    pub(crate) fn sums(&self, factors: &[f64], count: usize, instructions: Instructions) -> Vec<f64> {
        let mut sums = vec![0.0; count];
        dispatch(instructions, SlopeSums { slopes: self, factors, sums: &mut sums });
        sums
    }

    /// The derivative of what every coefficient belongs to at some samples: eight at a time, with the bits of each by itself.
    pub(crate) fn of_coefficients_at(&self, places: &[usize], instructions: Instructions) -> Vec<[f64; MOST_DEGREES]> {
        let mut all = vec![[0.0; MOST_DEGREES]; places.len()];
        dispatch(instructions, SlopesAt { slopes: self, places, all: &mut all });
        if self.step > 1 {
            for slopes in &mut all {
                *slopes = self.combine(slopes);
            }
        }
        all
    }

    /// Where a sample lies from the centre, in means.
    fn between(&self, place: usize) -> f64 {
        let centre = self.before as f64 + (self.basis.length() * self.step - 1) as f64 / 2.0;
        (place as f64 - centre) / self.step as f64
    }

    /// The derivative of what every coefficient belongs to, from those of the basis.
    fn combine(&self, of_basis: &[f64; MOST_DEGREES]) -> [f64; MOST_DEGREES] {
        let mut slopes = [0.0; MOST_DEGREES];
        for (value, polynomial) in slopes.iter_mut().zip(&self.polynomials) {
            *value = polynomial.iter().zip(of_basis).map(|(factor, slope)| factor * slope).sum();
        }
        slopes
    }

    /// What coefficients are of the derivatives of the basis: for many places.
    pub(crate) fn combined(&self, coefficients: &[f64]) -> Vec<f64> {
        if self.step == 1 {
            return coefficients.to_vec();
        }
        let mut sums = vec![0.0; coefficients.len()];
        for (c, polynomial) in coefficients.iter().zip(&self.polynomials) {
            sums.iter_mut().zip(polynomial).for_each(|(sum, factor)| *sum += c * factor);
        }
        sums
    }
}

/// The `d`-th derivatives from those below, of one number or of several side by side.
#[inline(always)]
fn legendre_slopes<N>(basis: &Basis, x: N, d: usize, values: &mut [N; MOST_DEGREES], of: impl Fn(f64) -> N)
where
    N: Copy + Add<Output = N> + Sub<Output = N> + Mul<Output = N>,
{
    // The derivative of the last degree and of this one, while `values` still holds the one below.
    let mut last = of(0.0);
    let mut current = of(if d == 0 { 1.0 / (basis.length() as f64).sqrt() } else { 0.0 });
    for (value, &(ratio, inverse)) in values.iter_mut().zip(basis.steps()).take(basis.degrees()) {
        let below = std::mem::replace(value, current);
        let following = (x * current + of(d as f64) * below) * of(inverse) - of(ratio) * last;
        (last, current) = (current, following);
    }
}

/// [`SampleSlopes::sums`].
struct SlopeSums<'a> {
    slopes: &'a SampleSlopes<'a>,
    factors: &'a [f64],
    sums: &'a mut [f64],
}

impl Kernel for SlopeSums<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        let Self { slopes, factors, sums } = self;
        let last = sums.len().saturating_sub(1);
        for (index, part) in sums.chunks_mut(WIDTH).enumerate() {
            let mut places = [0; WIDTH];
            for (lane, place) in places.iter_mut().enumerate() {
                // Lanes beyond the last sample are not used.
                *place = (index * WIDTH + lane).min(last);
            }
            let values = slopes.at_eight(&places);
            // As sums of numbers begin.
            let mut sum = Packet::splat(-0.0);
            for (&value, &factor) in values.iter().zip(factors) {
                sum += value * Packet::splat(factor);
            }
            part.copy_from_slice(&sum.0[..part.len()]);
        }
    }
}

/// The derivatives of the basis in [`SampleSlopes::of_coefficients_at`].
struct SlopesAt<'a> {
    slopes: &'a SampleSlopes<'a>,
    places: &'a [usize],
    all: &'a mut [[f64; MOST_DEGREES]],
}

impl Kernel for SlopesAt<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        for (some, all) in self.places.chunks(WIDTH).zip(self.all.chunks_mut(WIDTH)) {
            let mut places = [some[0]; WIDTH];
            places[..some.len()].copy_from_slice(some);
            let values = self.slopes.at_eight(&places);
            for (degree, value) in values.iter().enumerate() {
                for (slopes, &value) in all.iter_mut().zip(&value.0) {
                    slopes[degree] = value;
                }
            }
        }
    }
}

impl SampleSlopes<'_> {
    /// The derivative of every polynomial of the basis at eight samples.
    #[inline(always)]
    fn at_eight(&self, places: &[usize; WIDTH]) -> [Packet; MOST_DEGREES] {
        let (mut values, mut x) = ([Packet::ZERO; MOST_DEGREES], Packet::ZERO);
        for (lane, &place) in places.iter().enumerate() {
            if self.step > 1 {
                x.0[lane] = self.between(place);
                continue;
            }
            x.0[lane] = self.basis.position(place);
            let (row, mirrored) = self.basis.row(place);
            for (degree, &value) in row.iter().enumerate() {
                values[degree].0[lane] = if mirrored && degree % 2 == 1 { -value } else { value };
            }
        }
        for d in usize::from(self.step == 1)..=self.derivative {
            legendre_slopes(self.basis, x, d, &mut values, Packet::splat);
        }
        values
    }
}

/// The products of numbers at some samples, or means, of a window with every polynomial of its basis, summed.
pub(crate) struct BasisSums<'a> {
    pub(crate) basis: &'a Basis,
    pub(crate) first: usize,
    pub(crate) values: &'a [f64],
}

impl Kernel for BasisSums<'_> {
    type Output = [f64; MOST_DEGREES];

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> [f64; MOST_DEGREES] {
        match self.basis.degrees() / WIDTH {
            0 => self.of_groups::<0>(),
            1 => self.of_groups::<1>(),
            _ => self.of_groups::<2>(),
        }
    }
}

impl BasisSums<'_> {
    /// Groups of eight degrees at once, and the others one by one.
    #[inline(always)]
    fn of_groups<const GROUPS: usize>(&self) -> [f64; MOST_DEGREES] {
        let mut groups = [Packet::ZERO; GROUPS];
        let mut sums = [0.0; MOST_DEGREES];
        for (place, &value) in (self.first..).zip(self.values) {
            let (row, mirrored) = self.basis.row(place);
            let (whole, rest) = row.split_at(GROUPS * WIDTH);
            let odd = if mirrored { -value } else { value };
            let values = Packet([value, odd, value, odd, value, odd, value, odd]);
            for (group, row) in groups.iter_mut().zip(whole.chunks_exact(WIDTH)) {
                *group += Packet::load(row) * values;
            }
            for (degree, (sum, q)) in sums[GROUPS * WIDTH..].iter_mut().zip(rest).enumerate() {
                *sum += q * if degree % 2 == 0 { value } else { odd };
            }
        }
        for (sums, group) in sums.chunks_mut(WIDTH).zip(groups) {
            sums.copy_from_slice(&group.0);
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative of every polynomial of the basis at a sample.
    fn of_basis(of: &SampleSlopes<'_>, place: usize) -> [f64; MOST_DEGREES] {
        if of.step == 1 {
            return slopes(of.basis, place, of.derivative);
        }
        slopes_between(of.basis, of.between(place), of.derivative)
    }

    /// The derivative of every polynomial of a basis at a sample of the window, in working precision: [`Basis::evaluate`] has twice that and takes ten
    /// times as long.
    fn slopes(basis: &Basis, place: usize, derivative: usize) -> [f64; MOST_DEGREES] {
        let mut values = [0.0; MOST_DEGREES];
        let known = values.iter_mut().take(basis.degrees()).enumerate();
        known.for_each(|(degree, value)| *value = basis.value(degree, place));
        for d in 1..=derivative {
            legendre_slopes(basis, basis.position(place), d, &mut values, |number| number);
        }
        values
    }

    /// The same at any position, from the centre, of a window that is much longer than the basis has polynomials.
    fn slopes_between(basis: &Basis, x: f64, derivative: usize) -> [f64; MOST_DEGREES] {
        let mut values = [0.0; MOST_DEGREES];
        for d in 0..=derivative {
            legendre_slopes(basis, x, d, &mut values, |number| number);
        }
        values
    }

    #[test]
    fn coefficients_combined_give_the_same_derivative() {
        let basis = Basis::new(97, 8).expect("little memory");
        let coefficients: Vec<f64> = (0..8).map(|j| 1.0 / f64::from(j + 1)).collect();
        for (step, derivative) in [(1, 0), (1, 2), (3, 1), (9, 2)] {
            let slopes = SampleSlopes::new(&basis, step, derivative, 8);
            let combined = slopes.combined(&coefficients);
            for place in [0, 1, 40 * step, 97 * step - 1] {
                let sum = |slopes: [f64; MOST_DEGREES], factors: &[f64]| -> f64 {
                    factors.iter().zip(slopes).map(|(factor, slope)| factor * slope).sum()
                };
                let of_coefficients = slopes.of_coefficients_at(&[place], Instructions::current())[0];
                let (one, other) = (sum(of_basis(&slopes, place), &combined), sum(of_coefficients, &coefficients));
                assert!((one - other).abs() < 1e-13 * one.abs().max(1.0), "{one} {other}");
            }
        }
    }

    #[test]
    fn sums_at_eight_samples_have_the_bits_of_each() {
        let basis = Basis::new(97, 8).expect("little memory");
        let factors: Vec<f64> = (0..8).map(|j| (f64::from(j) - 2.5) / 3.0).collect();
        for (step, derivative) in [(1, 0), (1, 1), (1, 2), (3, 0), (9, 2)] {
            let slopes = SampleSlopes::new(&basis, step, derivative, 8);
            for instructions in Instructions::available() {
                for count in [0, 1, 8, 51, 97 * step] {
                    let sums = slopes.sums(&factors, count, instructions);
                    assert_eq!(sums.len(), count);
                    for (place, found) in sums.iter().enumerate() {
                        let of_basis = of_basis(&slopes, place);
                        let sum: f64 = of_basis.iter().zip(&factors).map(|(slope, factor)| slope * factor).sum();
                        assert_eq!(found.to_bits(), sum.to_bits(), "{step} {derivative} {place}");
                    }
                }
            }
        }
    }

    #[test]
    fn some_samples_have_the_bits_of_each() {
        let basis = Basis::new(97, 8).expect("little memory");
        for (step, derivative) in [(1, 0), (1, 2), (9, 0), (9, 2)] {
            let slopes = SampleSlopes::new(&basis, step, derivative, 8);
            let places: Vec<usize> = (0..11).map(|i| i * 9 * step).collect();
            for instructions in Instructions::available() {
                let all = slopes.of_coefficients_at(&places, instructions);
                assert_eq!(all.len(), places.len());
                for (&place, found) in places.iter().zip(all) {
                    let of_basis = of_basis(&slopes, place);
                    let expected = if step == 1 { of_basis } else { slopes.combine(&of_basis) };
                    assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{step} {derivative} {place}");
                }
            }
        }
    }

    #[test]
    fn sums_over_a_basis_are_those_of_the_definition() {
        for degrees in [3, 8, 11, 16, 19] {
            let basis = Basis::new(41, degrees).expect("little memory");
            let values: Vec<f64> = (0..30).map(|i| (f64::from(i) * 0.7).sin()).collect();
            for instructions in Instructions::available() {
                let sums = dispatch(instructions, BasisSums { basis: &basis, first: 6, values: &values });
                for (degree, found) in sums.into_iter().enumerate() {
                    let known = (6..).zip(&values).take_while(|_| degree < degrees);
                    let sum = known.map(|(place, value)| basis.value(degree, place) * value).sum::<f64>();
                    assert_eq!(found, sum, "{degree} of {degrees}");
                }
            }
        }
    }

    #[test]
    fn derivatives_in_working_precision_are_as_good_as_it() {
        for length in [17, 51, 201, 2001] {
            let basis = Basis::new(length, 16).expect("little memory");
            for place in (0..length).step_by(1 + length / 50) {
                for derivative in 0..4 {
                    let found = slopes(&basis, place, derivative);
                    let expected = basis.evaluate(basis.position(place), derivative);
                    let mut size = 0.0_f64;
                    for (value, expected) in found.iter().zip(&expected) {
                        size = size.max(expected.abs());
                        // Three roundings a degree, and derivatives upon each other.
                        assert!(
                            (value - expected).abs() <= 100.0 * f64::EPSILON * size,
                            "{derivative} at {place} of {length}"
                        );
                    }
                }
            }
        }
    }
}
