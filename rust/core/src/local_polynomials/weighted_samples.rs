//! Samples of windows that have polynomials of their own, laid side by side, and what is found in them.

use crate::lanes::lists::lay;
use crate::local_polynomials::options::HIGHEST_ORDER;
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Lanes, MOST_LANES};

/// Polynomials at most.
pub(crate) const MOST: usize = HIGHEST_ORDER + 1;

/// Windows of more samples are made orthogonal twice one by one: all polynomials of some side by side take much memory.
pub(crate) const LONG: usize = 1 << 15;

/// One window's samples. Those that are missing have the weight 0 and any value.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WeightedSamples<'a> {
    /// From -1 to 1.
    pub(crate) times: &'a [f64],
    pub(crate) weights: &'a [f64],
    pub(crate) values: &'a [f64],
    /// What is taken off all samples.
    pub(crate) reference: f64,
    /// Time that derivatives are wanted at.
    pub(crate) at: f64,
    /// Polynomials at most: no more than samples that are there.
    pub(crate) most: usize,
}

/// What was found in one window: nothing of what is above `columns` polynomials.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnPolynomials {
    /// Polynomials that are told apart.
    pub(crate) columns: usize,
    /// Coefficients of the samples in polynomials of length 1.
    pub(crate) projections: [f64; MOST],
    /// What weights were multiplied by, so that the greatest is about one: a power of two, which changes no digit.
    pub(crate) unit: f64,
    /// Sum of the weights.
    pub(crate) weight: f64,
    /// Weighted sum of squares of the samples, and of what the last polynomial leaves.
    pub(crate) energy: f64,
    pub(crate) left: f64,
    /// Derivatives from 0 on of every polynomial of length 1, where they are wanted.
    pub(crate) derivatives: Vec<[f64; MOST]>,
    /// Whether rounding left the polynomials orthogonal.
    pub(crate) orthogonal: bool,
}

/// Memory of one thread.
#[derive(Clone, Debug, Default)]
pub(crate) struct WeightedMemory {
    pub(crate) times: Aligned,
    pub(crate) weights: Aligned,
    pub(crate) left: Aligned,
    pub(crate) columns: Vec<Aligned>,
    /// Of polynomials that are made orthogonal twice: parts of `t p_j` in every polynomial up to it.
    pub(crate) taken: Aligned,
    /// Derivatives of every polynomial.
    pub(crate) derivatives: Aligned,
    pub(crate) found: [OwnPolynomials; MOST_LANES],
}

/// The power of two that the weights of a window are multiplied by, given the greatest of them.
pub(crate) fn unit_of(greatest: f64) -> f64 {
    if greatest > 0.0 { (-greatest.log2().round().clamp(-1000.0, 1000.0)).exp2() } else { 1.0 }
}

impl WeightedMemory {
    /// Numbers that windows of a length need in one thread.
    pub(crate) fn numbers(length: usize) -> usize {
        length.saturating_mul(MOST_LANES * 5).saturating_add(length.min(LONG) * MOST_LANES * MOST)
    }

    /// Lays samples side by side. Lanes without a window have no weight.
    #[inline(always)]
    pub(crate) fn interleave<S: Lanes>(&mut self, simd: S, windows: &[WeightedSamples<'_>], columns: usize) {
        let lanes = S::F64_LANES;
        let samples = windows.iter().map(|window| window.times.len()).max().unwrap_or(0);
        let size = samples * lanes;
        if self.times.len() != size || self.columns.len() < columns {
            [self.times, self.weights, self.left] = [(); 3].map(|()| Aligned::zeros(size));
            self.columns = (0..columns).map(|_| Aligned::zeros(size)).collect();
        }
        let mut lists = [[&[][..]; MOST_LANES]; 3];
        for (lane, window) in windows.iter().enumerate().take(lanes) {
            (lists[0][lane], lists[1][lane], lists[2][lane]) = (window.times, window.weights, window.values);
        }
        for (all, lists) in [&mut self.times, &mut self.weights, &mut self.left].into_iter().zip(&lists) {
            lay(simd, &lists[..lanes], all);
        }
    }
}

/// A number of every window, zero in lanes without one.
#[inline(always)]
pub(crate) fn numbers_of<S: Lanes>(
    simd: S,
    windows: &[WeightedSamples<'_>],
    number: impl Fn(&WeightedSamples<'_>) -> f64,
) -> S::f64s {
    let mut numbers = [0.0; MOST_LANES];
    for (one, window) in numbers.iter_mut().zip(windows) {
        *one = number(window);
    }
    simd.load(&numbers, 0)
}

/// The numbers of a vector.
#[inline(always)]
pub(crate) fn numbers<S: Lanes>(simd: S, vector: S::f64s) -> [f64; MOST_LANES] {
    let mut numbers = [0.0; MOST_LANES];
    simd.store(&mut numbers, 0, vector);
    numbers
}
