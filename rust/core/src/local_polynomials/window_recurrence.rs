//! The recurrence that polynomials follow which are orthogonal on the samples of a window, for windows side by side, one a lane.

use crate::local_polynomials::weighted_samples::{MOST, WeightedMemory, WeightedSamples, numbers, numbers_of, unit_of};
use crate::simd::aligned::{Aligned, OnLines};
use crate::simd::vectors::Lanes;

/// What is known of windows side by side.
pub(crate) struct Recurrence<S: Lanes> {
    /// `s_j`, zero where the polynomial is not told apart, and one over it.
    pub(crate) squares: OnLines<S::f64s, MOST>,
    pub(crate) inverse: OnLines<S::f64s, MOST>,
    /// `a_j`, and `s_j / s_{j-1}`.
    pub(crate) middles: OnLines<S::f64s, MOST>,
    pub(crate) ratios: OnLines<S::f64s, MOST>,
    pub(crate) coefficients: OnLines<S::f64s, MOST>,
    /// What weights are multiplied by.
    pub(crate) unit: S::f64s,
    pub(crate) energy: S::f64s,
    pub(crate) left: S::f64s,
    /// Polynomials that are told apart.
    pub(crate) columns: S::f64s,
    pub(crate) orthogonal: Orthogonality<S>,
}

/// Products of the last two polynomials with those before them, and the greatest so far.
pub(crate) struct Orthogonality<S: Lanes> {
    now: OnLines<S::f64s, MOST>,
    before: OnLines<S::f64s, MOST>,
    /// `√(s_j / s_{j-1})`; the first is not used.
    steps: OnLines<S::f64s, MOST>,
    pub(crate) worst: S::f64s,
}

/// Sums over the samples of a polynomial: of its squares, of those times the time, and of its products with what is left of the samples.
pub(crate) struct PolynomialSums<S: Lanes> {
    square: S::f64s,
    moment: S::f64s,
    product: S::f64s,
}

impl<S: Lanes> Recurrence<S> {
    /// Begins with the constant, and takes references off the samples.
    #[inline(always)]
    pub(crate) fn begin(simd: S, memory: &mut WeightedMemory, windows: &[WeightedSamples<'_>]) -> Self {
        let (zero, one, lanes) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0), S::F64_LANES);
        let mut sums = PolynomialSums::<S> { square: zero, moment: zero, product: zero };
        let mut energy = zero;
        let reference = numbers_of(simd, windows, |window| window.reference);
        let mut greatest = zero;
        for weight in memory.weights.chunks_exact(lanes) {
            greatest = simd.max_f64s(greatest, simd.load(weight, 0));
        }
        let unit = simd.load(&numbers(simd, greatest).map(unit_of), 0);
        let samples = memory.times.chunks_exact(lanes).zip(memory.weights.chunks_exact_mut(lanes));
        let columns = memory.columns[0].chunks_exact_mut(lanes);
        for (((time, weights), values), column) in samples.zip(memory.left.chunks_exact_mut(lanes)).zip(columns) {
            let (time, weight) = (simd.load(time, 0), simd.mul_f64s(simd.load(weights, 0), unit));
            let value = simd.sub_f64s(simd.load(values, 0), reference);
            simd.store(weights, 0, weight);
            simd.store(values, 0, value);
            let weighted = simd.mul_f64s(weight, value);
            sums.square = simd.add_f64s(sums.square, weight);
            sums.moment = simd.mul_add_f64s(weight, time, sums.moment);
            sums.product = simd.add_f64s(sums.product, weighted);
            energy = simd.mul_add_f64s(weighted, value, energy);
            simd.store(column, 0, one);
        }
        let nothing = OnLines([zero; MOST]);
        let is_there = simd.greater_than_f64s(sums.square, zero);
        let mut found = Self {
            squares: nothing.clone(),
            inverse: nothing.clone(),
            middles: nothing.clone(),
            ratios: nothing.clone(),
            coefficients: nothing.clone(),
            unit,
            energy,
            left: zero,
            columns: simd.select_f64s(is_there, one, zero),
            orthogonal: Orthogonality { now: nothing.clone(), before: nothing.clone(), steps: nothing, worst: zero },
        };
        found.orthogonal.now[0] = one;
        found.put(simd, 0, &sums, is_there);
        found
    }

    /// Puts what follows from the sums of a polynomial into its place.
    #[inline(always)]
    fn put(&mut self, simd: S, degree: usize, sums: &PolynomialSums<S>, is_told: S::m64s) {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let inverse = simd.select_f64s(is_told, simd.div_f64s(one, sums.square), zero);
        self.squares[degree] = simd.select_f64s(is_told, sums.square, zero);
        self.inverse[degree] = inverse;
        self.coefficients[degree] = simd.select_f64s(is_told, simd.mul_f64s(sums.product, inverse), zero);
        self.middles[degree] = simd.select_f64s(is_told, simd.mul_f64s(sums.moment, inverse), zero);
        if degree > 0 {
            self.ratios[degree] = simd.mul_f64s(self.squares[degree], self.inverse[degree - 1]);
        }
    }

    /// Makes a polynomial from the two before it, in the place of the first of them, and takes the last one off the samples. Also returns the
    /// square of what it was before those two were taken off.
    #[inline(always)]
    pub(crate) fn make(&mut self, simd: S, memory: &mut WeightedMemory, degree: usize) -> (PolynomialSums<S>, S::f64s) {
        let (zero, lanes) = (simd.splat_f64s(0.0), S::F64_LANES);
        let mut sums = PolynomialSums::<S> { square: zero, moment: zero, product: zero };
        let [even, odd] = &mut memory.columns[..2] else { unreachable!("two columns are made") };
        let (last, next) = if degree % 2 == 1 { (even, odd) } else { (odd, even) };
        let (middle, coefficient) = (self.middles[degree - 1], self.coefficients[degree - 1]);
        let ratio = self.ratios[degree - 1];
        let samples = memory.times.chunks_exact(lanes).zip(memory.weights.chunks_exact(lanes));
        let columns = last.chunks_exact(lanes).zip(next.chunks_exact_mut(lanes));
        for (((time, weight), left), (last, next)) in samples.zip(memory.left.chunks_exact_mut(lanes)).zip(columns) {
            let (time, weight, now) = (simd.load(time, 0), simd.load(weight, 0), simd.load(last, 0));
            let value = simd.negate_mul_add_f64s(coefficient, now, simd.load(left, 0));
            let raised = simd.mul_f64s(simd.sub_f64s(time, middle), now);
            let before = if degree > 1 { simd.load(next, 0) } else { zero };
            let polynomial = simd.negate_mul_add_f64s(ratio, before, raised);
            sums.add(simd, time, weight, value, polynomial);
            simd.store(left, 0, value);
            simd.store(next, 0, polynomial);
        }
        // ‖t p_j‖² = s_{j+1} + a_j² s_j + (s_j / s_{j-1})² s_{j-1}.
        let mut whole = simd.mul_add_f64s(simd.mul_f64s(middle, middle), self.squares[degree - 1], sums.square);
        if degree > 1 {
            whole = simd.mul_add_f64s(simd.mul_f64s(ratio, ratio), self.squares[degree - 2], whole);
        }
        (sums, whole)
    }

    /// Makes a polynomial that is orthogonal to all before it, and takes the last one off the samples; also returns the square of what it was.
    #[inline(always)]
    pub(crate) fn make_twice(
        &mut self,
        simd: S,
        memory: &mut WeightedMemory,
        degree: usize,
    ) -> (PolynomialSums<S>, S::f64s) {
        let (zero, lanes) = (simd.splat_f64s(0.0), S::F64_LANES);
        let WeightedMemory { times, weights, left, columns, taken, .. } = memory;
        let (before, next) = columns.split_at_mut(degree);
        let next = &mut next[0];
        let coefficient = self.coefficients[degree - 1];
        let mut whole = zero;
        for place in (0..times.len()).step_by(lanes) {
            let now = simd.load(&before[degree - 1], place);
            let raised = simd.mul_f64s(simd.load(times, place), now);
            let value = simd.negate_mul_add_f64s(coefficient, now, simd.load(left, place));
            whole = simd.mul_add_f64s(simd.mul_f64s(simd.load(weights, place), raised), raised, whole);
            simd.store(next, place, raised);
            simd.store(left, place, value);
        }
        let mut parts = OnLines([zero; MOST]);
        for _ in 0..2 {
            for (column, (part, inverse)) in before.iter().zip(parts.0.iter_mut().zip(&self.inverse.0)) {
                let mut product = zero;
                for place in (0..times.len()).step_by(lanes) {
                    let weighted = simd.mul_f64s(simd.load(weights, place), simd.load(column, place));
                    product = simd.mul_add_f64s(weighted, simd.load(next, place), product);
                }
                let own = simd.mul_f64s(product, *inverse);
                for place in (0..times.len()).step_by(lanes) {
                    let less = simd.negate_mul_add_f64s(own, simd.load(column, place), simd.load(next, place));
                    simd.store(next, place, less);
                }
                *part = simd.add_f64s(*part, own);
            }
        }
        if taken.len() != MOST * MOST * lanes {
            *taken = Aligned::zeros(MOST * MOST * lanes);
        }
        for (other, &part) in parts.0.iter().enumerate().take(degree) {
            simd.store(taken, ((degree - 1) * MOST + other) * lanes, part);
        }
        let mut sums = PolynomialSums::<S> { square: zero, moment: zero, product: zero };
        for place in (0..times.len()).step_by(lanes) {
            let (time, weight) = (simd.load(times, place), simd.load(weights, place));
            sums.add(simd, time, weight, simd.load(left, place), simd.load(next, place));
        }
        (sums, whole)
    }

    /// Ends a polynomial that was made: returns whether more is left of it than of one that depends on those before it.
    #[inline(always)]
    pub(crate) fn end(
        &mut self,
        simd: S,
        degree: usize,
        sums: &PolynomialSums<S>,
        dependent: S::f64s,
        is_there: S::m64s,
    ) -> S::m64s {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let is_above = simd.greater_than_f64s(sums.square, dependent);
        // One that is not told apart ends the polynomials of its window.
        let are_all = simd.equal_f64s(self.columns, simd.splat_f64s(degree as f64));
        let told = simd.select_f64s(is_there, simd.select_f64s(is_above, one, zero), zero);
        let told = simd.select_f64s(are_all, told, zero);
        let is_told = simd.greater_than_f64s(told, zero);
        self.columns = simd.add_f64s(self.columns, told);
        self.put(simd, degree, sums, is_told);
        is_told
    }

    /// Follows how much orthogonality rounding may have lost with a polynomial (Simon's recurrence).
    #[inline(always)]
    pub(crate) fn lose(&mut self, simd: S, degree: usize, is_told: S::m64s) {
        let zero = simd.splat_f64s(0.0);
        let rounding = simd.splat_f64s(f64::EPSILON);
        let Orthogonality { now, before, steps, worst } = &mut self.orthogonal;
        let step = simd.sqrt_f64s(simd.mul_f64s(self.squares[degree], self.inverse[degree - 1]));
        steps[degree] = step;
        let inverse = simd.div_f64s(simd.splat_f64s(1.0), step);
        let middle = self.middles[degree - 1];
        let (mut next, mut lower) = (OnLines([zero; MOST]), zero);
        for other in 0..degree {
            let value = if other + 1 == degree {
                simd.mul_f64s(rounding, steps[1])
            } else {
                let apart = simd.sub_f64s(self.middles[other], middle);
                let mut sum = simd.mul_f64s(steps[other + 1], now[other + 1]);
                sum = simd.mul_add_f64s(apart, now[other], sum);
                sum = simd.mul_add_f64s(steps[other], lower, sum);
                sum = simd.negate_mul_add_f64s(steps[degree - 1], before[other], sum);
                let more = simd.mul_f64s(rounding, simd.add_f64s(steps[other + 1], steps[degree - 1]));
                let is_below = simd.less_than_f64s(sum, zero);
                simd.add_f64s(sum, simd.select_f64s(is_below, simd.neg_f64s(more), more))
            };
            lower = now[other];
            next[other] = simd.mul_f64s(value, inverse);
            *worst = simd.max_f64s(*worst, simd.select_f64s(is_told, simd.abs_f64s(next[other]), zero));
        }
        next[degree] = simd.splat_f64s(1.0);
        std::mem::swap(before, now);
        *now = next;
    }

    /// Takes the last polynomial off the samples, and sums the squares of what is left.
    #[inline(always)]
    pub(crate) fn take_last(&mut self, simd: S, memory: &WeightedMemory, degrees: usize, twice: bool) {
        let lanes = S::F64_LANES;
        let column = &memory.columns[if twice { degrees - 1 } else { (degrees - 1) % 2 }];
        for place in (0..memory.left.len()).step_by(lanes) {
            let (now, value) = (simd.load(column, place), simd.load(&memory.left, place));
            let left = simd.negate_mul_add_f64s(self.coefficients[degrees - 1], now, value);
            let weighted = simd.mul_f64s(simd.load(&memory.weights, place), left);
            self.left = simd.mul_add_f64s(weighted, left, self.left);
        }
    }

    /// Every polynomial and its derivatives at a time of each lane.
    #[inline(always)]
    pub(crate) fn at(
        &self,
        simd: S,
        degrees: usize,
        rows: usize,
        time: S::f64s,
        memory: &mut WeightedMemory,
        twice: bool,
    ) {
        let lanes = S::F64_LANES;
        let WeightedMemory { taken, derivatives, .. } = memory;
        if derivatives.len() != rows * MOST * lanes {
            *derivatives = Aligned::zeros(rows * MOST * lanes);
        }
        for row in 0..rows {
            let factor = simd.splat_f64s(row as f64);
            simd.store(derivatives, row * MOST * lanes, simd.splat_f64s(if row == 0 { 1.0 } else { 0.0 }));
            for degree in 0..degrees - 1 {
                let own = |row: usize, degree: usize| (row * MOST + degree) * lanes;
                let now = simd.load(derivatives, own(row, degree));
                let mut value = simd.mul_f64s(time, now);
                if row > 0 {
                    value = simd.mul_add_f64s(factor, simd.load(derivatives, own(row - 1, degree)), value);
                }
                if twice {
                    for other in 0..=degree {
                        let part = simd.load(taken, (degree * MOST + other) * lanes);
                        value = simd.negate_mul_add_f64s(part, simd.load(derivatives, own(row, other)), value);
                    }
                } else {
                    value = simd.negate_mul_add_f64s(self.middles[degree], now, value);
                    if degree > 0 {
                        let before = simd.load(derivatives, own(row, degree - 1));
                        value = simd.negate_mul_add_f64s(self.ratios[degree], before, value);
                    }
                }
                simd.store(derivatives, own(row, degree + 1), value);
            }
        }
    }
}

impl<S: Lanes> PolynomialSums<S> {
    #[inline(always)]
    fn add(&mut self, simd: S, time: S::f64s, weight: S::f64s, value: S::f64s, polynomial: S::f64s) {
        let weighted = simd.mul_f64s(weight, polynomial);
        let square = simd.mul_f64s(weighted, polynomial);
        self.square = simd.add_f64s(self.square, square);
        self.moment = simd.mul_add_f64s(square, time, self.moment);
        self.product = simd.mul_add_f64s(weighted, value, self.product);
    }
}
