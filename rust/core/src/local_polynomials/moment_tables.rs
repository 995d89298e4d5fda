//! Chebyshev polynomials at the samples of a whole window, and sums of them over the two halves of windows side by side.
//!
//! `T_k` is even or odd as `k` is, so that a sum over a window is one over its half: of the sums of what mirrored samples have, or of the differences.

use crate::simd::vectors::Lanes;

/// Polynomials of neighbouring degrees that are summed together.
pub(crate) const TOGETHER: usize = 4;

/// Rows of samples that are added by turns, so that none waits for the one before.
const TURNS: usize = 2;

/// Polynomials at the samples from a window's centre on: some degrees, then all samples of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct MomentTables(Vec<Vec<[f64; TOGETHER]>>);

impl MomentTables {
    /// Polynomials below a degree, and enough to make groups whole, at times from zero or the first one after it to 1.
    pub(crate) fn new(times: &[f64], degrees: usize) -> Self {
        let mut groups = vec![vec![[0.0; TOGETHER]; times.len()]; degrees.div_ceil(TOGETHER)];
        for (row, time) in times.iter().enumerate() {
            // T_{k+1} = 2 t T_k - T_{k-1}, and T_{-1} = T_1.
            let (mut last, mut before) = (1.0, *time);
            for value in groups.iter_mut().flat_map(|group| &mut group[row]) {
                *value = last;
                (last, before) = (2.0_f64.mul_add(time * last, -before), last);
            }
        }
        Self(groups)
    }

    /// Samples of half a window.
    pub(crate) fn rows(&self) -> usize {
        self.0.first().map_or(0, Vec::len)
    }

    /// Adds sums of the polynomials below a degree, and of those that make their last group whole, over some rows from a first one on: of what
    /// mirrored samples have together, and of the differences.
    #[inline(always)]
    pub(crate) fn add<S: Lanes>(
        &self,
        simd: S,
        degrees: usize,
        first: usize,
        samples: [&[S::f64s]; 2],
        sums: &mut [S::f64s],
    ) {
        let count = samples[0].len();
        for (group, sums) in self.0.iter().zip(sums.chunks_exact_mut(TOGETHER)).take(degrees.div_ceil(TOGETHER)) {
            let mut totals = [[simd.splat_f64s(0.0); TOGETHER]; TURNS];
            totals[0].copy_from_slice(sums);
            let (rows, last) = group[first..first + count].as_chunks::<TURNS>();
            let (both, _) = samples[0].as_chunks::<TURNS>();
            let (apart, _) = samples[1].as_chunks::<TURNS>();
            for ((rows, both), apart) in rows.iter().zip(both).zip(apart) {
                for turn in 0..TURNS {
                    for place in 0..TOGETHER {
                        let value = if place % 2 == 0 { both[turn] } else { apart[turn] };
                        let polynomial = simd.splat_f64s(rows[turn][place]);
                        totals[turn][place] = simd.mul_add_f64s(polynomial, value, totals[turn][place]);
                    }
                }
            }
            if let [row] = last {
                for place in 0..TOGETHER {
                    let value = samples[place % 2][count - 1];
                    totals[0][place] = simd.mul_add_f64s(simd.splat_f64s(row[place]), value, totals[0][place]);
                }
            }
            for (place, sum) in sums.iter_mut().enumerate() {
                *sum = simd.add_f64s(totals[0][place], totals[1][place]);
            }
        }
    }

    /// The value of a sum of polynomials at the sample of a row and at the one that mirrors it.
    #[inline(always)]
    pub(crate) fn values<S: Lanes>(
        &self,
        simd: S,
        row: usize,
        degrees: usize,
        coefficients: &[S::f64s],
    ) -> [S::f64s; 2] {
        let (mut even, mut odd) = (simd.splat_f64s(0.0), simd.splat_f64s(0.0));
        let (coefficients, _) = coefficients.as_chunks::<TOGETHER>();
        for (group, coefficients) in self.0.iter().zip(coefficients).take(degrees.div_ceil(TOGETHER)) {
            let polynomials = &group[row];
            even = simd.mul_add_f64s(simd.splat_f64s(polynomials[0]), coefficients[0], even);
            odd = simd.mul_add_f64s(simd.splat_f64s(polynomials[1]), coefficients[1], odd);
            even = simd.mul_add_f64s(simd.splat_f64s(polynomials[2]), coefficients[2], even);
            odd = simd.mul_add_f64s(simd.splat_f64s(polynomials[3]), coefficients[3], odd);
        }
        [simd.add_f64s(even, odd), simd.sub_f64s(even, odd)]
    }
}
