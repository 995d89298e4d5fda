//! The coefficients and the residual of every window, from sample to sample.
//!
//! One sample on, the samples that stay meet `q_j(k-1)` instead of `q_j(k)`. The differences `δ_j = Σ_k (q_j(k) - q_j(k-1)) y(k)` follow
//! from degree to degree in three operations (see [`crate::local_polynomials::basis::Differences`]), so
//!
//! ```text
//! c_j  ←  c_j - δ_j + q_j(last) y_new - q_j(first - 1) y_old,
//! RSS  ←  RSS + (e_new² - e_old²) / (1 + h),   h = Σ_j q_j(last + 1)²,
//! ```
//!
//! with `e_new = y_new - Σ c_j q_j(last + 1)` before the step and `e_old = y_old - Σ c_j q_j(first - 1)` after it. The residual only
//! ever sees residuals, so it keeps digits that `yᵀy - cᵀc` no longer has. A step costs `O(D)` whatever the window's length.
//!
//! Rounding errors of the coefficients are polynomials too and grow outside the window they were made in, so windows are reached
//! from *starts*: windows projected directly, from which a span of windows is reached by steps forwards and backwards. Going
//! backwards is going forwards through reversed time, where `c_j` becomes `(-1)^j c_j`. Spans fill the blocks that lanes work on.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::lanes::interleaved::{Cursor, Strips};
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::span::span;
use crate::simd::unroll::unroll;
use crate::simd::vectors::Lanes;

/// Blocks hold at least so many windows, so that vectors of any path are filled and written whole.
pub(crate) const SHORTEST_BLOCK: usize = 8;

/// Below this fraction of the window's energy a residual is rounding error.
///
/// The residual that slides along is wrong by some 1e-8 of itself where noise is 1e-6 of the signal and by 4e-4 at 1e-10, that is by
/// about 1e-24 of the energy: (κ ε)² with κ = 1e4.
pub(crate) const ROUNDING: f64 = 1e4 * 1e4 * f64::EPSILON * f64::EPSILON;

/// A lane starts afresh where the square of what left exceeds what stays by this factor: the rounding errors that a glitch leaves
/// behind are then still below 1e-9 of what the window holds without it.
const LOSS: f64 = 1e6;

/// After so many rows the watch is called.
const WATCHED: usize = 1 << 16;

/// Tables of the projection of windows of one length on `D` polynomials; rows beyond the plan's degrees are zero.
#[derive(Debug)]
pub(crate) struct Projection<const D: usize> {
    length: usize,
    span: usize,
    /// `q_j` at the positions that are not negative, from the centre outwards.
    rows: Vec<[f64; D]>,
    /// The recurrence of the differences.
    gain: [f64; D],
    damping: [f64; D],
    scale: [f64; D],
    /// `q_j(last)`: weight of the sample that enters.
    entering: [f64; D],
    /// `-q_j(first - 1)`: weight of the sample that leaves.
    leaving: [f64; D],
    /// `q_j(last + 1)`: predicts the sample that enters from the window before it.
    ahead: [f64; D],
    /// `q_j(first - 1)`: predicts the sample that left from the window after it.
    behind: [f64; D],
    /// `1 / (1 + h)`.
    step_gain: f64,
}

/// The state of one window in each lane.
#[derive(Clone, Copy)]
pub(crate) struct State<S: Lanes, const D: usize> {
    /// Projections on the orthonormal polynomials, after the reference was taken off.
    pub(crate) coefficients: [S::f64s; D],
    /// Residual sum of squares of the highest order.
    pub(crate) residual: S::f64s,
    /// Sum of squares of the samples, after the reference was taken off.
    pub(crate) energy: S::f64s,
}

impl<S: Lanes, const D: usize> State<S, D> {
    /// Reads what [`State::store`] wrote.
    #[inline(always)]
    pub(crate) fn load(simd: S, from: &[f64], index: usize) -> Self {
        let from = &from[index * (D + 2) * S::F64_LANES..][..(D + 2) * S::F64_LANES];
        let mut coefficients = [simd.splat_f64s(0.0); D];
        unroll!(J < D, { coefficients[J] = simd.load(from, J * S::F64_LANES) });
        let residual = simd.load(from, D * S::F64_LANES);
        Self { coefficients, residual, energy: simd.load(from, (D + 1) * S::F64_LANES) }
    }

    /// The coefficient of one degree of what [`State::store`] wrote.
    #[inline(always)]
    pub(crate) fn coefficient(simd: S, from: &[f64], index: usize, degree: usize) -> S::f64s {
        simd.load(from, (index * (D + 2) + degree) * S::F64_LANES)
    }

    /// Writes coefficients, residual and energy, one vector each, as the `index`-th of several states.
    #[inline(always)]
    pub(crate) fn store(&self, simd: S, to: &mut [f64], index: usize) {
        let to = &mut to[index * (D + 2) * S::F64_LANES..][..(D + 2) * S::F64_LANES];
        unroll!(J < D, { simd.store(to, J * S::F64_LANES, self.coefficients[J]) });
        simd.store(to, D * S::F64_LANES, self.residual);
        simd.store(to, (D + 1) * S::F64_LANES, self.energy);
    }
}

impl<const D: usize> Projection<D> {
    /// The plan for windows of any length, watched: their rows are copied to the kernels' degrees.
    ///
    /// # Errors
    /// If the watch cancels.
    pub(crate) fn watched(basis: &Basis, watch: &mut Watch<'_>) -> Result<Self, Error> {
        let degrees = basis.degrees();
        assert!(degrees <= D, "kernels of {D} degrees cannot hold {degrees}");
        let pad = |values: &[f64]| std::array::from_fn(|j| values.get(j).copied().unwrap_or(0.0));
        let last = basis.position(basis.length() - 1);
        let differences = basis.differences();
        let ahead: [f64; D] = pad(&basis.evaluate(last + 1.0, 0));
        let behind: [f64; D] = pad(&basis.evaluate(-last - 1.0, 0));
        let step_gain = 1.0 / (1.0 + ahead.iter().map(|q| q * q).sum::<f64>());
        let mut rows = Vec::with_capacity(basis.rows().len());
        for row in basis.rows() {
            rows.push(pad(row));
            if rows.len().is_multiple_of(WATCHED) && !watch(rows.len(), basis.rows().len()) {
                return Err(Error::Cancelled);
            }
        }
        Ok(Self {
            length: basis.length(),
            span: span(basis),
            rows,
            gain: pad(&differences.gain),
            damping: pad(&differences.damping),
            scale: pad(&differences.scale),
            entering: pad(&basis.evaluate(last, 0)),
            leaving: behind.map(|q| -q),
            ahead,
            behind,
            step_gain,
        })
    }

    /// Samples in a window.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Windows reached from one start: a power of two, or a multiple of 8.
    pub(crate) fn span(&self) -> usize {
        self.span
    }

    /// Windows of a span that come before its start.
    pub(crate) fn backward(&self) -> usize {
        self.span / 2
    }

    /// Windows that a lane works on in a run: one span, or several short ones.
    pub(crate) fn block(&self) -> usize {
        self.span.max(SHORTEST_BLOCK)
    }

    /// Projects the windows that begin at sample `first` of every lane's block.
    ///
    /// Sums and differences of mirrored samples halve the work, since the polynomials are even or odd. Without `RESIDUAL` the residual
    /// is zero, and its half of the work is saved.
    #[inline(always)]
    pub(crate) fn start<S: Lanes, const RESIDUAL: bool>(
        &self,
        simd: S,
        strips: &Strips,
        first: usize,
        reference: S::f64s,
    ) -> State<S, D> {
        let zero = simd.splat_f64s(0.0);
        let (centre, pairs) = self.rows.split_at(self.length % 2);
        let mut coefficients = [zero; D];
        let mut energy = zero;
        for row in centre {
            let sample = simd.sub_f64s(strips.at(simd, strips.cursor(first + self.length / 2)), reference);
            energy = simd.mul_f64s(sample, sample);
            unroll!(J < D, {
                coefficients[J] = simd.mul_f64s(simd.splat_f64s(row[J]), sample);
            });
        }
        let mut mirror = Mirror::new(strips, first, self.length);
        for row in pairs {
            let (right, left) = mirror.next(simd, strips, reference);
            let (even, odd) = (simd.add_f64s(right, left), simd.sub_f64s(right, left));
            unroll!(J < D, {
                let part = if J % 2 == 0 { even } else { odd };
                coefficients[J] = simd.mul_add_f64s(simd.splat_f64s(row[J]), part, coefficients[J]);
            });
            if !RESIDUAL {
                energy = simd.mul_add_f64s(right, right, energy);
                energy = simd.mul_add_f64s(left, left, energy);
            }
        }
        let mut residuals = [zero; 2];
        if !RESIDUAL {
            return State { coefficients, residual: zero, energy };
        }
        for row in centre {
            let sample = simd.sub_f64s(strips.at(simd, strips.cursor(first + self.length / 2)), reference);
            let error = error(simd, row, &coefficients, sample);
            residuals[0] = simd.mul_f64s(error, error);
        }
        let mut mirror = Mirror::new(strips, first, self.length);
        for row in pairs {
            let (right, left) = mirror.next(simd, strips, reference);
            let mut parts = [zero; 2];
            unroll!(J < D, {
                parts[J % 2] = simd.mul_add_f64s(simd.splat_f64s(row[J]), coefficients[J], parts[J % 2]);
            });
            let [even, odd] = parts;
            let on_the_right = simd.sub_f64s(simd.sub_f64s(right, even), odd);
            let on_the_left = simd.add_f64s(simd.sub_f64s(left, even), odd);
            residuals[0] = simd.mul_add_f64s(on_the_right, on_the_right, residuals[0]);
            residuals[1] = simd.mul_add_f64s(on_the_left, on_the_left, residuals[1]);
            energy = simd.mul_add_f64s(right, right, energy);
            energy = simd.mul_add_f64s(left, left, energy);
        }
        State { coefficients, residual: simd.add_f64s(residuals[0], residuals[1]), energy }
    }

    /// One sample on. Returns the lanes that must start afresh, because the sample that left was so much larger than
    /// the rest that its rounding errors would remain. Each lane decides by its own numbers only.
    ///
    /// Without `RESIDUAL` the residual is not followed.
    #[inline(always)]
    pub(crate) fn step<S: Lanes, const RESIDUAL: bool>(
        &self,
        simd: S,
        state: &mut State<S, D>,
        entering: S::f64s,
        leaving: S::f64s,
    ) -> S::m64s {
        let zero = simd.splat_f64s(0.0);
        let c = &mut state.coefficients;
        let (mut ahead, mut behind) = ([entering, zero, zero, zero], [leaving, zero, zero, zero]);
        // η of the degree before and of this one.
        let (mut last, mut current) = (zero, zero);
        unroll!(J < D, {
            let old = c[J];
            let mut new = simd.mul_add_f64s(simd.splat_f64s(self.entering[J]), entering, old);
            new = simd.mul_add_f64s(simd.splat_f64s(self.leaving[J]), leaving, new);
            if J != 0 {
                new = simd.negate_mul_add_f64s(simd.splat_f64s(self.scale[J]), current, new);
            }
            c[J] = new;
            if RESIDUAL {
                ahead[J % 4] = simd.negate_mul_add_f64s(simd.splat_f64s(self.ahead[J]), old, ahead[J % 4]);
                behind[J % 4] = simd.negate_mul_add_f64s(simd.splat_f64s(self.behind[J]), new, behind[J % 4]);
            }
            let next = match J {
                0 => simd.mul_f64s(simd.splat_f64s(self.gain[J]), old),
                _ => simd.mul_add_f64s(simd.splat_f64s(self.gain[J]), old, last),
            };
            last = current;
            current =
                if J != 0 { simd.negate_mul_add_f64s(simd.splat_f64s(self.damping[J]), current, next) } else { next };
        });
        let _ = (last, current);
        let energy = simd.negate_mul_add_f64s(leaving, leaving, state.energy);
        state.energy = simd.mul_add_f64s(entering, entering, energy);
        let (left, stays) = if RESIDUAL {
            let ahead = simd.add_f64s(simd.add_f64s(ahead[0], ahead[1]), simd.add_f64s(ahead[2], ahead[3]));
            let behind = simd.add_f64s(simd.add_f64s(behind[0], behind[1]), simd.add_f64s(behind[2], behind[3]));
            let change = simd.mul_f64s(simd.sub_f64s(ahead, behind), simd.add_f64s(ahead, behind));
            state.residual = simd.mul_add_f64s(change, simd.splat_f64s(self.step_gain), state.residual);
            let rounding = simd.mul_f64s(state.energy, simd.splat_f64s(ROUNDING));
            (simd.mul_f64s(behind, behind), simd.max_f64s(state.residual, rounding))
        } else {
            (simd.mul_f64s(leaving, leaving), state.energy)
        };
        simd.greater_than_f64s(left, simd.mul_f64s(stays, simd.splat_f64s(LOSS)))
    }
}

/// Goes through a window in mirrored pairs, from the centre outwards. The sample at the centre of an odd window is no pair.
struct Mirror {
    right: Cursor,
    left: Cursor,
}

impl Mirror {
    #[inline(always)]
    fn new(strips: &Strips, first: usize, length: usize) -> Self {
        let half = length / 2;
        Self { right: strips.cursor(first + length - half), left: strips.cursor(first + half.max(1) - 1) }
    }

    /// The next pair of samples of every lane, right and left.
    #[inline(always)]
    fn next<S: Lanes>(&mut self, simd: S, strips: &Strips, reference: S::f64s) -> (S::f64s, S::f64s) {
        let right = simd.sub_f64s(strips.at(simd, self.right), reference);
        let left = simd.sub_f64s(strips.at(simd, self.left), reference);
        (self.right, self.left) = (strips.after(self.right), strips.before(self.left));
        (right, left)
    }
}

/// `y - Σ_j c_j q_j`, in four sums that can be worked on at once.
#[inline(always)]
fn error<S: Lanes, const D: usize>(simd: S, q: &[f64; D], c: &[S::f64s; D], y: S::f64s) -> S::f64s {
    let zero = simd.splat_f64s(0.0);
    let mut sums = [y, zero, zero, zero];
    unroll!(J < D, { sums[J % 4] = simd.negate_mul_add_f64s(simd.splat_f64s(q[J]), c[J], sums[J % 4]) });
    simd.add_f64s(simd.add_f64s(sums[0], sums[1]), simd.add_f64s(sums[2], sums[3]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::{Kernel, dispatch};

    /// Errors of the windows farthest from a start against the same windows projected directly.
    struct Farthest<'a> {
        basis: &'a Basis,
        samples: &'a [f64],
    }

    impl Kernel for Farthest<'_> {
        /// The largest error of a coefficient over the norm of the samples, and the relative error of the residual.
        type Output = (f64, f64);

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> (f64, f64) {
            let projection = Projection::<16>::watched(self.basis, &mut |_, _| true).expect("nobody cancels");
            let mut strips = Strips::new(projection.block(), projection.length(), S::F64_LANES);
            let mut samples = self.samples.to_vec();
            samples.resize(strips.samples(), 0.0);
            strips.fill(simd, &samples);
            let reference = simd.splat_f64s(self.samples[0]);
            // Backwards is the farther way; through reversed time it is the same as forwards.
            let (length, reach) = (projection.length(), projection.backward());
            let mut state = projection.start::<S, true>(simd, &strips, 0, reference);
            for row in 0..reach {
                let entering = simd.sub_f64s(strips.at(simd, strips.cursor(row + length)), reference);
                let leaving = simd.sub_f64s(strips.at(simd, strips.cursor(row)), reference);
                projection.step::<S, true>(simd, &mut state, entering, leaving);
            }
            let direct = projection.start::<S, true>(simd, &strips, reach, reference);
            let mut worst = (0.0_f64, 0.0_f64);
            let lanes = |vector: S::f64s| pulp::bytemuck::cast_slice::<S::f64s, f64>(&[vector]).to_vec();
            let (energies, expected, found) = (lanes(direct.energy), lanes(direct.residual), lanes(state.residual));
            for lane in 0..S::F64_LANES {
                for j in 0..16 {
                    let error = lanes(state.coefficients[j])[lane] - lanes(direct.coefficients[j])[lane];
                    worst.0 = worst.0.max(error.abs() / energies[lane].sqrt());
                }
                worst.1 = worst.1.max((found[lane] / expected[lane] - 1.0).abs());
            }
            worst
        }
    }

    /// Worst errors over some recordings of a sine with uniform noise, five radians a window.
    fn farthest(length: usize, noise: f64) -> (f64, f64) {
        let basis = Basis::new(length, 16.min(length - 2)).expect("little memory");
        let mut state = 88_172_645_463_325_252_u64;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut worst = (0.0_f64, 0.0_f64);
        for phase in 0..20 {
            let sample = |i: usize| (i as f64 * 5.0 / length as f64 + f64::from(phase)).sin() + noise * random();
            let samples: Vec<f64> = (0..20 * length).map(sample).collect();
            let one = dispatch(Instructions::current(), Farthest { basis: &basis, samples: &samples });
            worst = (worst.0.max(one.0), worst.1.max(one.1));
        }
        worst
    }

    #[test]
    fn windows_far_from_their_start_are_as_good_as_promised() {
        for length in [17, 19, 21, 25, 31, 51, 101, 201, 2001, 20_001] {
            for noise in [1.0, 1e-6] {
                let (coefficients, residual) = farthest(length, noise);
                assert!(coefficients <= 2e-12, "coefficients at length {length}, noise {noise}: {coefficients:e}");
                // Shorter windows leave order 15 nearly no residual, and what is nearly nothing has no digits.
                let promised = match length {
                    51.. => 1e-6,
                    21.. => 1e-5,
                    _ => 1e-2,
                };
                assert!(residual <= promised, "residual at length {length}, noise {noise}: {residual:e}");
            }
        }
    }

    #[test]
    fn spans_fill_blocks() {
        for length in (5..400).chain([2001, 20_001]) {
            for degrees in [1, 4, 16.min(length)] {
                let basis = Basis::new(length, degrees).expect("little memory");
                let projection = Projection::<16>::watched(&basis, &mut |_, _| true).expect("nobody cancels");
                let (span, block) = (projection.span(), projection.block());
                assert!(span.is_power_of_two() || span % 8 == 0, "span {span} at length {length}");
                assert!(block % span == 0 && block % SHORTEST_BLOCK == 0, "block {block} at length {length}");
            }
        }
    }
}
