//! The polynomials that are orthogonal in windows that share a basis: a window in each lane.
//!
//! Their recurrence of three terms, and with it the factor `G = L D L'` of the normal matrix, follows from the sums of `T_0 .. T_2p` by Chebyshev's
//! algorithm (Sack and Donovan 1972, Wheeler 1974). With `π_{k+1} = (2 u - α_k) π_k - β_k π_{k-1}` the products `σ_{k,l} = Σ π_k T_l` are
//!
//! ```text
//! σ_{0,l} = Σ T_l,    σ_{k+1,l} = σ_{k,l+1} + σ_{k,|l-1|} - α_k σ_{k,l} - β_k σ_{k-1,l},
//! ```
//!
//! where `α_k` and `β_k` make the next products with lower `T_l` zero. `σ_{k,l}` is `D L'`: what is solved for is eliminated by each row
//! as soon as it is known, so that nothing but two rows of products is kept. No number of a row waits for another.

use pulp::NullaryFnOnce;

use crate::local_polynomials::chebyshev_sums::{DERIVATIVES, MOST};
use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// Orthogonal polynomials and what they find in the samples.
pub(crate) struct ChebyshevFactor<S: Lanes> {
    /// `L⁻¹ b` of the samples: their products with each polynomial.
    pub(crate) own: OnLines<S::f64s, MOST>,
    /// `L⁻¹ b` of a row that is made to grow: for the condition.
    pub(crate) grown: OnLines<S::f64s, MOST>,
    /// `V' a`: what the polynomial with coefficients `a` in the shared basis has in each.
    pub(crate) turned: OnLines<S::f64s, MOST>,
    /// One over each polynomial's sum of squares.
    pub(crate) inverse: OnLines<S::f64s, MOST>,
    /// The largest ratio of a diagonal of the normal matrix to its pivot.
    pub(crate) weakest: S::f64s,
    steps: OnLines<Step<S::f64s>, MOST>,
    /// Products with the shared polynomials: of the last orthogonal one and of the one before.
    products: OnLines<[S::f64s; 2 * MOST], 2>,
}

impl<S: Lanes> ChebyshevFactor<S> {
    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        let zero = simd.splat_f64s(0.0);
        let column = OnLines([zero; MOST]);
        Self {
            own: column.clone(),
            grown: column.clone(),
            turned: column.clone(),
            inverse: column,
            weakest: zero,
            steps: OnLines([Step { alpha: zero, beta: zero }; MOST]),
            products: OnLines([[zero; 2 * MOST]; 2]),
        }
    }

    /// Finds the polynomials from the moments of windows, the products of samples with them, and what a sum of shared polynomials has in each.
    #[inline(always)]
    pub(crate) fn decompose(
        &mut self,
        simd: S,
        degrees: usize,
        moments: &[S::f64s; 2 * MOST],
        samples: &[S::f64s; MOST],
        coefficients: &[S::f64s; MOST],
    ) {
        self.weakest = simd.splat_f64s(1.0);
        let given = Given { moments, samples, coefficients };
        simd.vectorize(EliminatedRows { simd, factor: self, degrees: degrees.min(MOST), given });
    }

    /// The coefficients in the shared basis of the polynomial that fits the samples best.
    #[inline(always)]
    pub(crate) fn solve(&self, simd: S, degrees: usize) -> OnLines<S::f64s, MOST> {
        let (zero, half) = (simd.splat_f64s(0.0), simd.splat_f64s(0.5));
        let mut solution = OnLines([zero; MOST]);
        // Coefficients of two orthogonal polynomials, the lowest of each twice: `2 u` takes them to both neighbours, of which the lowest has one.
        let (mut one, mut other) = (OnLines([zero; MOST + 2]), OnLines([zero; MOST + 2]));
        let (mut last, mut before) = (&mut one, &mut other);
        last.0[0] = simd.splat_f64s(2.0);
        for (k, Step { alpha, beta }) in self.steps.0.iter().enumerate().take(degrees.min(MOST)) {
            let scaled = simd.mul_f64s(self.own.0[k], self.inverse.0[k]);
            let mut lower = last.0[1];
            let step = if k == 0 { half } else { simd.splat_f64s(1.0) };
            for l in 0..=k {
                let (same, higher) = (last.0[l], last.0[l + 1]);
                solution.0[l] = simd.mul_add_f64s(same, scaled, solution.0[l]);
                let value = simd.mul_f64s(simd.add_f64s(lower, higher), step);
                let value = simd.negate_mul_add_f64s(*alpha, same, value);
                before.0[l] = simd.negate_mul_add_f64s(*beta, before.0[l], value);
                lower = same;
            }
            before.0[k + 1] = simd.mul_f64s(lower, step);
            std::mem::swap(&mut last, &mut before);
        }
        solution.0[0] = simd.mul_f64s(solution.0[0], half);
        solution
    }

    /// The orthogonal polynomials and their derivatives at a time: by derivative, then by degree.
    #[inline(always)]
    pub(crate) fn at(&self, simd: S, degrees: usize, time: S::f64s, derivatives: &mut [[S::f64s; MOST]]) {
        match derivatives {
            [_] => self.at_with::<1>(simd, degrees, time, derivatives),
            [_, _] => self.at_with::<2>(simd, degrees, time, derivatives),
            [_, _, _] => self.at_with::<3>(simd, degrees, time, derivatives),
            _ => self.at_with::<DERIVATIVES>(simd, degrees, time, derivatives),
        }
    }

    #[inline(always)]
    fn at_with<const N: usize>(&self, simd: S, degrees: usize, time: S::f64s, derivatives: &mut [[S::f64s; MOST]]) {
        let (zero, twice) = (simd.splat_f64s(0.0), simd.add_f64s(time, time));
        let (mut last, mut before) = ([zero; N], [zero; N]);
        last[0] = simd.splat_f64s(1.0);
        for (k, Step { alpha, beta }) in self.steps.0.iter().enumerate().take(degrees.min(MOST)) {
            // The first step has half of `2 u`.
            let (at, slope) = if k == 0 { (time, 1.0) } else { (twice, 2.0) };
            let along = simd.sub_f64s(at, *alpha);
            let mut lower = zero;
            for derivative in 0..N {
                if let Some(values) = derivatives.get_mut(derivative) {
                    values[k] = last[derivative];
                }
                let raised = simd.mul_f64s(*beta, before[derivative]);
                let raised = simd.mul_add_f64s(along, last[derivative], simd.neg_f64s(raised));
                let factor = simd.splat_f64s(slope * derivative as f64);
                (before[derivative], lower, last[derivative]) =
                    (last[derivative], last[derivative], simd.mul_add_f64s(factor, lower, raised));
            }
        }
    }

    /// Takes two polynomials off all higher ones, and finds the products of the next two. The first two are found in what is given.
    #[inline(always)]
    fn pair<const FIRST: bool>(&mut self, simd: S, degrees: usize, k: usize, given: &Given<'_, S>) {
        let Self { own, grown, turned, inverse, weakest, steps, products } = self;
        let (own, grown) = (&mut own.0, &mut grown.0);
        let Given { moments, coefficients, .. } = *given;
        let [rows, before] = &mut products.0;
        let pivot = given.product::<FIRST>(rows, k);
        let mut one = ReducedRow::new(simd, pivot, coefficients[k]);
        one.compare(simd, [moments[2 * k], moments[0]], weakest);
        inverse.0[k] = one.inverse;
        [own[k], grown[k]] = one.take(simd, given.below::<FIRST>(simd, [own, grown], k));
        turned.0[k] = one.turned;
        if k + 1 == degrees {
            return;
        }
        let next = given.product::<FIRST>(rows, k + 1);
        let beta = if FIRST { simd.splat_f64s(0.0) } else { simd.mul_f64s(pivot, inverse.0[k - 1]) };
        let left = if FIRST { next } else { simd.negate_mul_add_f64s(beta, before[k], next) };
        let step = Step { alpha: simd.mul_f64s(left, one.inverse), beta };
        let higher = given.product::<FIRST>(rows, k + 2);
        let second = step.next::<S, FIRST>(simd, [pivot, next, higher], before[k + 1]);
        let mut two = ReducedRow::new(simd, second, coefficients[k + 1]);
        two.compare(simd, [moments[2 * k + 2], moments[0]], weakest);
        inverse.0[k + 1] = two.inverse;
        let reduced = one.eliminate(simd, next, coefficients[k + 1], given.below::<FIRST>(simd, [own, grown], k + 1));
        [own[k + 1], grown[k + 1]] = two.take(simd, reduced);
        steps.0[k] = step;
        if k + 2 < degrees {
            let third = step.next::<S, FIRST>(simd, [next, higher, given.product::<FIRST>(rows, k + 3)], before[k + 2]);
            let beta = simd.mul_f64s(second, one.inverse);
            let beta = if FIRST { simd.add_f64s(beta, beta) } else { beta };
            let alpha = simd.mul_f64s(simd.negate_mul_add_f64s(beta, next, third), two.inverse);
            steps.0[k + 1] = Step { alpha, beta };
            let mut pass = PassedPair {
                steps: [step, steps.0[k + 1]],
                first: [higher, given.product::<FIRST>(rows, k + 3)],
                second: [second, third],
            };
            for l in k + 2..degrees {
                let reduced =
                    one.eliminate(simd, pass.first[0], coefficients[l], given.below::<FIRST>(simd, [own, grown], l));
                [own[l], grown[l]] = two.eliminate(simd, pass.second[1], coefficients[l], reduced);
                let higher = given.product::<FIRST>(rows, l + 2);
                pass.go::<FIRST>(simd, higher, [&mut rows[l..=l], &mut before[l..l + 2]]);
            }
            for l in degrees..2 * degrees - 3 - k {
                let higher = given.product::<FIRST>(rows, l + 2);
                pass.go::<FIRST>(simd, higher, [&mut rows[l..=l], &mut before[l..l + 2]]);
            }
        }
        turned.0[k] = one.turned;
        turned.0[k + 1] = two.turned;
    }
}

/// What is known of windows.
#[derive(Clone, Copy)]
struct Given<'a, S: Lanes> {
    moments: &'a [S::f64s; 2 * MOST],
    samples: &'a [S::f64s; MOST],
    /// Of what was taken off.
    coefficients: &'a [S::f64s; MOST],
}

impl<S: Lanes> Given<'_, S> {
    /// A product of the last orthogonal polynomial; of the first it is a moment.
    #[inline(always)]
    fn product<const FIRST: bool>(&self, rows: &[S::f64s; 2 * MOST], l: usize) -> S::f64s {
        if FIRST { self.moments[l] } else { rows[l] }
    }

    /// What is solved for of a row, and of the one that is made to grow.
    #[inline(always)]
    fn below<const FIRST: bool>(&self, simd: S, [own, grown]: [&[S::f64s; MOST]; 2], l: usize) -> [S::f64s; 2] {
        if FIRST { [self.samples[l], simd.splat_f64s(0.0)] } else { [own[l], grown[l]] }
    }
}

/// A row of products by which what is solved for is eliminated.
struct ReducedRow<S: Lanes> {
    /// One over the pivot, and minus what is solved for over it.
    inverse: S::f64s,
    own: S::f64s,
    grown: S::f64s,
    turned: S::f64s,
}

impl<S: Lanes> ReducedRow<S> {
    #[inline(always)]
    fn new(simd: S, pivot: S::f64s, coefficient: S::f64s) -> Self {
        let (one, zero) = (simd.splat_f64s(1.0), simd.splat_f64s(0.0));
        let inverse = simd.div_f64s(one, pivot);
        Self { inverse, own: zero, grown: zero, turned: simd.mul_f64s(pivot, coefficient) }
    }

    /// Compares the diagonal of the normal matrix, half the sum of two moments, with the pivot.
    #[inline(always)]
    fn compare(&self, simd: S, [one, other]: [S::f64s; 2], weakest: &mut S::f64s) {
        let half = simd.splat_f64s(0.5);
        let ratio = simd.mul_f64s(simd.mul_f64s(simd.add_f64s(one, other), half), self.inverse);
        // Where a pivot is negative or no number, so is the ratio: it counts as infinite.
        let counts = simd.greater_than_or_equal_f64s(ratio, half);
        *weakest = simd.max_f64s(*weakest, simd.select_f64s(counts, ratio, simd.splat_f64s(f64::INFINITY)));
    }

    /// What is solved for is known of this row; the row that is made to grow does.
    #[inline(always)]
    fn take(&mut self, simd: S, [own, grown]: [S::f64s; 2]) -> [S::f64s; 2] {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let is_negative = simd.less_than_f64s(grown, zero);
        let grown = simd.add_f64s(grown, simd.select_f64s(is_negative, simd.neg_f64s(one), one));
        self.own = simd.neg_f64s(simd.mul_f64s(own, self.inverse));
        self.grown = simd.neg_f64s(simd.mul_f64s(grown, self.inverse));
        [own, grown]
    }

    /// Eliminates what is solved for of a higher row.
    #[inline(always)]
    fn eliminate(
        &mut self,
        simd: S,
        product: S::f64s,
        coefficient: S::f64s,
        [own, grown]: [S::f64s; 2],
    ) -> [S::f64s; 2] {
        self.turned = simd.mul_add_f64s(product, coefficient, self.turned);
        [simd.mul_add_f64s(product, self.own, own), simd.mul_add_f64s(product, self.grown, grown)]
    }
}

/// A step of the recurrence.
#[derive(Clone, Copy)]
struct Step<V> {
    alpha: V,
    beta: V,
}

impl<V: Copy> Step<V> {
    /// The product of the next polynomial from three of the last, and one of that before; the first step has half of `2 u` and nothing before.
    #[inline(always)]
    fn next<S: Lanes<f64s = V>, const FIRST: bool>(self, simd: S, [lower, same, higher]: [V; 3], before: V) -> V {
        let both = simd.add_f64s(lower, higher);
        if FIRST {
            return simd.negate_mul_add_f64s(self.alpha, same, simd.mul_f64s(both, simd.splat_f64s(0.5)));
        }
        // `α` is known last.
        simd.negate_mul_add_f64s(self.alpha, same, simd.negate_mul_add_f64s(self.beta, before, both))
    }
}

/// Two rows of products that are replaced by the next two in one pass: in registers is what lies beside the place that the pass is at.
struct PassedPair<S: Lanes> {
    steps: [Step<S::f64s>; 2],
    /// Of the first row at the place and at the one after it; of the second at the one before it and at the place.
    first: [S::f64s; 2],
    second: [S::f64s; 2],
}

impl<S: Lanes> PassedPair<S> {
    /// Replaces the products at a place; `higher` is that of the first row two places on.
    #[inline(always)]
    fn go<const FIRST: bool>(&mut self, simd: S, higher: S::f64s, [row, before]: [&mut [S::f64s]; 2]) {
        let [[same, next], [below, second]] = [self.first, self.second];
        let above = self.steps[0].next::<S, FIRST>(simd, [same, next, higher], before[1]);
        before[0] = second;
        row[0] = self.steps[1].next::<S, false>(simd, [below, second, above], same);
        (self.first, self.second) = ([next, higher], [second, above]);
    }
}

/// All rows, two by two: compiled apart from what uses them.
struct EliminatedRows<'a, S: Lanes> {
    simd: S,
    factor: &'a mut ChebyshevFactor<S>,
    degrees: usize,
    given: Given<'a, S>,
}

impl<S: Lanes> NullaryFnOnce for EliminatedRows<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd, factor, degrees, given } = self;
        factor.pair::<true>(simd, degrees, 0, &given);
        for k in (2..degrees).step_by(2) {
            factor.pair::<false>(simd, degrees, k, &given);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local_polynomials::chebyshev_sums::{ChebyshevSums, at};
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::{Kernel, dispatch};

    /// Samples at uneven times, other ones in each lane.
    const SAMPLES: usize = 40;

    /// Compares what follows from moments with sums of the polynomials themselves over the samples.
    struct OverSamples {
        degrees: usize,
    }

    impl Kernel for OverSamples {
        type Output = ();

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) {
            let Self { degrees } = self;
            let zero = simd.splat_f64s(0.0);
            let number = |place: usize, lane: usize| {
                let turn = (place * 7 + lane * 3) as f64;
                (-1.0 + 2.0 * place as f64 / (SAMPLES - 1) as f64 + 0.01 * turn.sin(), (0.3 * turn).cos())
            };
            let vectors = |place: usize| {
                let (mut times, mut samples) = ([0.0; 8], [0.0; 8]);
                for lane in 0..S::F64_LANES {
                    (times[lane], samples[lane]) = number(place, lane);
                }
                [simd.load(&times, 0), simd.load(&samples, 0)]
            };
            let mut sums = ChebyshevSums::zero(simd);
            for place in 0..SAMPLES {
                let [time, sample] = vectors(place);
                sums.add(simd, degrees, &[time], &[simd.splat_f64s(1.0)], &[sample]);
            }
            let mut off = [zero; MOST];
            for (k, coefficient) in off.iter_mut().enumerate().take(degrees) {
                *coefficient = simd.splat_f64s(1.0 / (k + 1) as f64);
            }
            let mut factor = ChebyshevFactor::zero(simd);
            factor.decompose(simd, degrees, &sums.moments.0, &sums.products.0, &off);
            let best = factor.solve(simd, degrees);
            // Sums of squares and products with the samples, with what is taken off, and with all lower ones.
            let mut found = [[zero; MOST]; 3];
            let mut across = zero;
            let (mut values, mut shared) = ([[zero; MOST]], [[zero; MOST]]);
            let value = |polynomials: &[S::f64s; MOST], coefficients: &[S::f64s; MOST]| {
                let pairs = polynomials.iter().zip(coefficients).take(degrees);
                pairs.fold(zero, |sum, (one, other)| simd.mul_add_f64s(*one, *other, sum))
            };
            for place in 0..SAMPLES {
                let [time, sample] = vectors(place);
                factor.at(simd, degrees, time, &mut values);
                at(simd, degrees, time, &mut shared);
                let left = simd.sub_f64s(sample, value(&shared[0], &best.0));
                let taken = value(&shared[0], &off);
                for (k, value) in values[0].iter().enumerate().take(degrees) {
                    for (sum, other) in found.iter_mut().zip([*value, sample, taken]) {
                        sum[k] = simd.mul_add_f64s(*value, other, sum[k]);
                    }
                }
                let last = values[0][degrees - 1];
                let lower = simd.sub_f64s(value(&values[0], &[simd.splat_f64s(1.0); MOST]), last);
                let lower = simd.add_f64s(lower, left);
                across = simd.mul_add_f64s(last, lower, across);
            }
            let assert_near = |one: S::f64s, other: S::f64s, what: &str| {
                let (mut ones, mut others) = ([0.0; 8], [0.0; 8]);
                simd.store(&mut ones, 0, one);
                simd.store(&mut others, 0, other);
                for lane in 0..S::F64_LANES {
                    // Sums of 40 samples of up to one, and rounding that orders to 15 amplify by less than 1e3.
                    let most = 1e3 * SAMPLES as f64 * f64::EPSILON;
                    assert!((ones[lane] - others[lane]).abs() < most, "{what} of {degrees} in lane {lane}");
                }
            };
            let [squares, of_samples, of_taken] = found;
            let known = [&factor.own.0, &factor.turned.0, &factor.inverse.0].map(|column| column[..degrees].iter());
            let [own, turned, inverse] = known;
            for (square, inverse) in squares.iter().zip(inverse) {
                assert_near(simd.mul_f64s(*square, *inverse), simd.splat_f64s(1.0), "sum of squares");
            }
            for (sum, own) in of_samples.iter().zip(own) {
                assert_near(*sum, *own, "products with samples");
            }
            for (sum, turned) in of_taken.iter().zip(turned) {
                assert_near(*sum, *turned, "products with what is taken off");
            }
            assert_near(across, zero, "orthogonality");
        }
    }

    #[test]
    fn polynomials_from_moments_are_orthogonal_over_the_samples() {
        for instructions in Instructions::available() {
            for degrees in 1..=MOST {
                dispatch(instructions, OverSamples { degrees });
            }
        }
    }
}
