//! Splines of odd order through samples at any increasing times, several side by side.
//!
//! A sum of B-splines `Σ c_j B_j(t)` of order `k` (degree, odd) whose knots are the samples' own times, without the `(k-1)/2` times next to each end
//! (*not a knot*), passes through every sample where `B c = y`, `B_ij = B_j(t_i)`. The matrix is totally positive, so elimination without exchanging
//! rows is stable (de Boor and Pinkus 1977). A row has at most `k + 1` numbers, from the column of the first B-spline at its time on, and elimination
//! makes no others. Splines through as many samples have their numbers in the same places: each is a lane. Then a lane is one of the times at which a
//! spline is wanted.

use std::ops::RangeInclusive;

use crate::lanes::lists::{gather, one_by_one, side_by_side};
use crate::simd::aligned::Aligned;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES, dispatch};

/// One number more than the highest order.
const MOST: usize = 8;

/// Splines through as many samples each, and the factors of their equations.
pub(crate) struct Splines {
    shape: EquationShape,
    instructions: Instructions,
    /// Those of one spline after the other, and then enough for whole vectors.
    knots: Vec<Vec<f64>>,
    /// The rows of the equations, `[row][number][lane]`: multipliers of elimination, the inverse of the pivot, and what is right of it.
    rows: Aligned,
}

/// Where the numbers of the equations stand.
#[derive(Clone, Copy, Debug)]
struct EquationShape {
    order: usize,
    /// Samples.
    count: usize,
}

impl EquationShape {
    /// Knots at every end that are no samples' own: half of those of a B-spline.
    fn half(self) -> usize {
        self.order.div_ceil(2)
    }

    /// The knot on the left of a sample.
    fn left(self, row: usize) -> usize {
        (row + self.half()).clamp(self.order, self.count - 1)
    }

    /// Columns of a row whose numbers are not zero. Where its time is a knot the last B-spline only begins.
    fn columns(self, row: usize) -> RangeInclusive<usize> {
        let left = self.left(row);
        let is_knot = row >= self.half() && row + self.half() < self.count;
        left - self.order..=left - usize::from(is_knot)
    }

    /// Where a number stands in the memory of so many lanes.
    fn place(self, row: usize, column: usize, lanes: usize) -> usize {
        (row * (self.order + 1) + column + self.order - self.left(row)) * lanes
    }
}

impl Splines {
    /// The splines of the highest order up to `order` that so many times allow. Times must increase; of every spline there must be as many, and one at
    /// least. There are at most as many splines as lanes.
    pub(crate) fn new(times: &[&[f64]], order: usize, instructions: Instructions) -> Self {
        let count = times[0].len();
        let order = match count {
            1 => 0,
            few if few <= order => (few - 2) / 2 * 2 + 1,
            _ => order,
        };
        let shape = EquationShape { order, count };
        let knots = |times: &&[f64]| {
            let mut knots = vec![times[0]; order + 1];
            knots.extend_from_slice(&times[shape.half()..(count - shape.half()).max(shape.half())]);
            knots.resize(count + order + 1 + MOST_LANES, times[count - 1]);
            knots
        };
        let knots = times.iter().map(knots).collect();
        let mut splines = Self { shape, instructions, knots, rows: Aligned::default() };
        if order > 1 {
            splines.rows = dispatch(instructions, FactorEquations { splines: &splines, times });
        }
        splines
    }

    /// The coefficients of the splines through some values, and then enough for whole vectors.
    pub(crate) fn coefficients(&self, values: &[&[f64]]) -> Vec<Vec<f64>> {
        if self.shape.order <= 1 {
            let padded = |values: &&[f64]| [*values, &[0.0; MOST_LANES]].concat();
            return values.iter().map(padded).collect();
        }
        dispatch(self.instructions, Solve { splines: self, values, transposed: false })
    }

    /// By how much each sample counts in the integrals of the splines.
    pub(crate) fn weights(&self) -> Vec<Vec<f64>> {
        // The integral is `gᵀ c` with `g_j = ∫ B_j`, so the weights solve `Bᵀ w = g`.
        let EquationShape { order, count } = self.shape;
        let integral = |knots: &[f64], place: usize| (knots[place + order + 1] - knots[place]) / (order + 1) as f64;
        let integrals = |knots: &Vec<f64>| (0..count).map(|place| integral(knots, place)).collect();
        let integrals: Vec<Vec<f64>> = self.knots.iter().map(integrals).collect();
        if order <= 1 {
            return integrals;
        }
        let values: Vec<&[f64]> = integrals.iter().map(Vec::as_slice).collect();
        let mut found = dispatch(self.instructions, Solve { splines: self, values: &values, transposed: true });
        for weights in &mut found {
            weights.truncate(count);
        }
        found
    }

    /// Values at increasing times within the samples', of one of the splines with these coefficients: one list for each of them.
    pub(crate) fn values(&self, spline: usize, coefficients: &[&[f64]], at: &[f64]) -> Vec<Vec<f64>> {
        dispatch(self.instructions, Values { splines: self, spline, coefficients, at })
    }
}

/// The kernel that makes the factors of the equations.
struct FactorEquations<'a> {
    splines: &'a Splines,
    times: &'a [&'a [f64]],
}

impl Kernel for FactorEquations<'_> {
    type Output = Aligned;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Aligned {
        match self.splines.shape.order {
            7 => self.run_with::<S, 7>(simd),
            5 => self.run_with::<S, 5>(simd),
            _ => self.run_with::<S, 3>(simd),
        }
    }
}

impl FactorEquations<'_> {
    #[inline(always)]
    fn run_with<S: Lanes, const ORDER: usize>(self, simd: S) -> Aligned {
        let (lanes, shape) = (S::F64_LANES, EquationShape { order: ORDER, ..self.splines.shape });
        let lists: Vec<&[f64]> = self.splines.knots.iter().map(Vec::as_slice).collect();
        let knots = side_by_side(simd, &lists, shape.count + ORDER + 1);
        let times = side_by_side(simd, self.times, shape.count);
        let mut rows = Aligned::zeros(shape.count * (ORDER + 1) * lanes);
        let one = simd.splat_f64s(1.0);
        let knot = |number: usize| simd.load(&knots, number * lanes);
        // One over the distances from a knot to those after it, of the last few knots: each row needs those of one more.
        let mut inverse = [[one; ORDER]; MOST];
        let mut known = 0;
        for row in 0..shape.count {
            let left = shape.left(row);
            while known < left {
                known += 1;
                for (after, inverse) in (known + 1..).zip(&mut inverse[known % MOST]) {
                    *inverse = simd.div_f64s(one, simd.sub_f64s(knot(after), knot(known)));
                }
            }
            let time = simd.load(&times, row * lanes);
            let mut later = [time; 2 * MOST];
            for (number, later) in (left + 1 - ORDER..).zip(&mut later[..2 * ORDER]) {
                *later = simd.sub_f64s(knot(number), time);
            }
            let share = |value, knot: usize, order: usize| {
                simd.mul_f64s(value, inverse[(left + 1 - ORDER + knot) % MOST][order - 1])
            };
            let basis = basis::<S, ORDER>(simd, &later, share);
            let numbers = &mut rows[shape.place(row, left - ORDER, lanes)..][..(ORDER + 1) * lanes];
            for (place, &value) in (0..).step_by(lanes).zip(&basis[..=ORDER]) {
                simd.store(numbers, place, value);
            }
            self.eliminate::<S, ORDER>(simd, &mut rows, row);
        }
        rows
    }

    /// Takes the rows before a row off it.
    #[inline(always)]
    fn eliminate<S: Lanes, const ORDER: usize>(&self, simd: S, rows: &mut [f64], row: usize) {
        let (lanes, shape) = (S::F64_LANES, EquationShape { order: ORDER, ..self.splines.shape });
        for pivot in *shape.columns(row).start()..row {
            let place = shape.place(row, pivot, lanes);
            let factor = simd.mul_f64s(simd.load(rows, place), simd.load(rows, shape.place(pivot, pivot, lanes)));
            simd.store(rows, place, factor);
            for column in pivot + 1..=*shape.columns(pivot).end() {
                let (own, above) = (shape.place(row, column, lanes), shape.place(pivot, column, lanes));
                let value = simd.negate_mul_add_f64s(factor, simd.load(rows, above), simd.load(rows, own));
                simd.store(rows, own, value);
            }
        }
        let diagonal = shape.place(row, row, lanes);
        let inverse = simd.div_f64s(simd.splat_f64s(1.0), simd.load(rows, diagonal));
        simd.store(rows, diagonal, inverse);
    }
}

/// The B-splines that are not zero right of a knot, from how much later than a time the `ORDER` knots up to that one and those after it are. `share` is
/// what a B-spline of the order before is over the distance of knots: from the one at a place to the one so many orders on.
#[inline(always)]
fn basis<S: Lanes, const ORDER: usize>(
    simd: S,
    later: &[S::f64s; 2 * MOST],
    share: impl Fn(S::f64s, usize, usize) -> S::f64s,
) -> [S::f64s; MOST] {
    let mut basis = [simd.splat_f64s(0.0); MOST];
    basis[0] = simd.splat_f64s(1.0);
    for order in 1..=ORDER {
        let mut saved = simd.splat_f64s(0.0);
        for (place, value) in basis[..order].iter_mut().enumerate() {
            let knot = ORDER + place - order;
            let share = share(*value, knot, order);
            *value = simd.mul_add_f64s(later[knot + order], share, saved);
            saved = simd.neg_f64s(simd.mul_f64s(later[knot], share));
        }
        basis[order] = saved;
    }
    basis
}

/// The kernel that solves the equations, or those of the transposed matrix.
struct Solve<'a> {
    splines: &'a Splines,
    values: &'a [&'a [f64]],
    transposed: bool,
}

impl Kernel for Solve<'_> {
    type Output = Vec<Vec<f64>>;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Vec<Vec<f64>> {
        let shape = self.splines.shape;
        let mut solved = side_by_side(simd, self.values, shape.count);
        for row in 0..shape.count {
            let columns = shape.columns(row);
            if self.transposed {
                self.divide(simd, &mut solved, row);
                for later in row + 1..=*columns.end() {
                    self.take(simd, &mut solved, later, (row, later), row);
                }
            } else {
                for column in *columns.start()..row {
                    self.take(simd, &mut solved, row, (row, column), column);
                }
            }
        }
        for row in (0..shape.count).rev() {
            let columns = shape.columns(row);
            if self.transposed {
                for earlier in *columns.start()..row {
                    self.take(simd, &mut solved, earlier, (row, earlier), row);
                }
            } else {
                // What was solved last comes last: it is waited for.
                for column in (row + 1..=*columns.end()).rev() {
                    self.take(simd, &mut solved, row, (row, column), column);
                }
                self.divide(simd, &mut solved, row);
            }
        }
        one_by_one(simd, &solved, self.values.len())
    }
}

impl Solve<'_> {
    /// Takes a number times a factor off another.
    #[inline(always)]
    fn take<S: Lanes>(&self, simd: S, solved: &mut [f64], from: usize, (row, column): (usize, usize), of: usize) {
        let (lanes, Splines { shape, rows, .. }) = (S::F64_LANES, self.splines);
        let factor = simd.load(rows, shape.place(row, column, lanes));
        let value = simd.negate_mul_add_f64s(factor, simd.load(solved, of * lanes), simd.load(solved, from * lanes));
        simd.store(solved, from * lanes, value);
    }

    /// Divides by a pivot.
    #[inline(always)]
    fn divide<S: Lanes>(&self, simd: S, solved: &mut [f64], row: usize) {
        let (lanes, Splines { shape, rows, .. }) = (S::F64_LANES, self.splines);
        let inverse = simd.load(rows, shape.place(row, row, lanes));
        let value = simd.mul_f64s(simd.load(solved, row * lanes), inverse);
        simd.store(solved, row * lanes, value);
    }
}

/// The kernel that evaluates sums of the B-splines of one of the splines, at as many times as there are lanes together.
struct Values<'a> {
    splines: &'a Splines,
    spline: usize,
    coefficients: &'a [&'a [f64]],
    at: &'a [f64],
}

impl Kernel for Values<'_> {
    type Output = Vec<Vec<f64>>;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Vec<Vec<f64>> {
        match self.splines.shape.order {
            7 => self.run_with::<S, 7>(simd),
            5 => self.run_with::<S, 5>(simd),
            3 => self.run_with::<S, 3>(simd),
            1 => self.run_with::<S, 1>(simd),
            _ => self.run_with::<S, 0>(simd),
        }
    }
}

impl Values<'_> {
    #[inline(always)]
    fn run_with<S: Lanes, const ORDER: usize>(self, simd: S) -> Vec<Vec<f64>> {
        let (lanes, knots) = (S::F64_LANES, &self.splines.knots[self.spline][..]);
        let mut found = vec![vec![0.0; self.at.len() + MOST_LANES]; self.coefficients.len()];
        let (mut left, mut lefts) = (ORDER, [0; MOST_LANES]);
        for first in (0..self.at.len()).step_by(lanes) {
            let some = &self.at[first..self.at.len().min(first + lanes)];
            // In the lanes beyond the last time it stands again.
            let mut times = [some[some.len() - 1]; MOST_LANES];
            times[..some.len()].copy_from_slice(some);
            for (of, &time) in lefts.iter_mut().zip(&times[..lanes]) {
                while left + 1 < self.splines.shape.count && time >= knots[left + 1] {
                    left += 1;
                }
                *of = left;
            }
            let time = simd.load(&times, 0);
            let mut near = [simd.splat_f64s(0.0); 2 * MOST];
            gather(simd, knots, &lefts, (ORDER, 1), &mut near[..2 * ORDER]);
            let mut later = near;
            for later in &mut later[..2 * ORDER] {
                *later = simd.sub_f64s(*later, time);
            }
            let share =
                |value, knot: usize, order: usize| simd.div_f64s(value, simd.sub_f64s(near[knot + order], near[knot]));
            let basis = basis::<S, ORDER>(simd, &later, share);
            for (coefficients, found) in self.coefficients.iter().zip(&mut found) {
                let mut of = [simd.splat_f64s(0.0); MOST];
                gather(simd, coefficients, &lefts, (ORDER, 0), &mut of[..=ORDER]);
                let mut sum = simd.mul_f64s(of[0], basis[0]);
                for place in 1..=ORDER {
                    sum = simd.mul_add_f64s(of[place], basis[place], sum);
                }
                simd.store(found, first, sum);
            }
        }
        for found in &mut found {
            found.truncate(self.at.len());
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times with steps between a third and five thirds.
    fn times(count: i32) -> Vec<f64> {
        (0..count).map(|place| f64::from(place) + 0.33 * (1.7 * f64::from(place)).sin()).collect()
    }

    fn through(times: &[f64], order: usize, function: impl Fn(f64) -> f64, at: &[f64]) -> Vec<f64> {
        let values: Vec<f64> = times.iter().map(|&time| function(time)).collect();
        let found = |instructions| {
            let splines = Splines::new(&[times], order, instructions);
            splines.values(0, &[&splines.coefficients(&[&values])[0]], at).remove(0)
        };
        let all: Vec<Vec<f64>> = Instructions::available().into_iter().map(found).collect();
        assert!(all.iter().all(|found| *found == all[0]));
        all[0].clone()
    }

    #[test]
    fn a_polynomial_of_the_order_is_its_own_spline() {
        let times = times(40);
        let at: Vec<f64> = (1..380).map(|place| f64::from(place) / 10.0).collect();
        for order in [1, 3, 5, 7] {
            let power = i32::try_from(order).unwrap();
            let polynomial = |time: f64| (time / 20.0 - 1.0).powi(power) + 0.5 * time;
            for (found, time) in through(&times, order, polynomial, &at).iter().zip(&at) {
                assert!((found - polynomial(*time)).abs() < 1e-12, "order {order} at {time}: {found}");
            }
        }
    }

    #[test]
    fn few_samples_lower_the_order_and_a_spline_passes_through_all() {
        for count in 1..20 {
            let times = times(count);
            for order in [1, 3, 5, 7] {
                let wave = |time: f64| (0.7 * time).cos();
                for (found, time) in through(&times, order, wave, &times).iter().zip(&times) {
                    assert!((found - wave(*time)).abs() < 1e-13, "order {order} of {count} samples: {found}");
                }
            }
        }
    }

    #[test]
    fn splines_side_by_side_are_as_each_alone() {
        let all: Vec<Vec<f64>> =
            [0.0, 0.2, 0.5].map(|shift| times(60).iter().map(|time| time * (1.0 + shift)).collect()).into();
        for instructions in Instructions::available() {
            let some = &all[..instructions.lanes().min(3)];
            let lists: Vec<&[f64]> = some.iter().map(Vec::as_slice).collect();
            for order in [1, 3, 5, 7] {
                let together = Splines::new(&lists, order, instructions);
                let (coefficients, weights) = (together.coefficients(&lists), together.weights());
                for (spline, times) in lists.iter().enumerate() {
                    let alone = Splines::new(&[times], order, instructions);
                    assert_eq!(alone.coefficients(&[times]), coefficients[spline..=spline]);
                    assert_eq!(alone.weights(), weights[spline..=spline]);
                    let [one, other] = [(&alone, 0), (&together, spline)]
                        .map(|(splines, place)| splines.values(place, &[&coefficients[spline]], times));
                    assert_eq!(one, other);
                }
            }
        }
    }

    #[test]
    fn weights_give_the_integral_of_a_polynomial() {
        let times = times(30);
        let length = times[29] - times[0];
        for order in [1, 3, 5, 7] {
            let power = i32::try_from(order).unwrap();
            let sum: f64 = Splines::new(&[&times], order, Instructions::current()).weights()[0]
                .iter()
                .zip(&times)
                .map(|(weight, time)| weight * ((time - times[0]) / length).powi(power))
                .sum();
            let expected = length / f64::from(power + 1);
            assert!((sum / expected - 1.0).abs() < 1e-12, "order {order}: {sum} {expected}");
        }
    }
}
