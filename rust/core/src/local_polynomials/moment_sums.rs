//! Moments of windows on a uniform grid side by side, and products of their samples with Chebyshev polynomials.

use crate::lanes::lists::lay;
use crate::local_polynomials::chebyshev_sums::MOST;
use crate::local_polynomials::moment_tables::MomentTables;
use crate::local_polynomials::weighted_samples::{numbers, unit_of};
use crate::simd::aligned::{Aligned, OnLines};
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};

/// Rows of samples that are weighed together: they stay in the nearest cache until all polynomials are summed.
const ROWS: usize = 16;

/// Samples of windows side by side: of neighbouring windows each number follows that of the window before, others were laid side by side.
#[derive(Clone, Copy)]
pub(crate) struct SampleColumns<'a> {
    pub(crate) weights: &'a [f64],
    pub(crate) values: &'a [f64],
    /// Where the first sample of the first window lies, and from one sample to the next.
    pub(crate) first: usize,
    pub(crate) stride: usize,
    /// Samples of a window.
    pub(crate) samples: usize,
    /// What is taken off the samples of each.
    pub(crate) references: [f64; MOST_LANES],
    /// Whether weights are other than 0 and 1.
    pub(crate) weighted: bool,
}

/// Lays weights and values of windows side by side, one window a lane.
pub(crate) struct LaidSamples<'a> {
    pub(crate) lists: [[&'a [f64]; MOST_LANES]; 2],
    pub(crate) into: &'a mut [Aligned; 2],
}

impl Kernel for LaidSamples<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let size = self.lists[0][0].len() * S::F64_LANES;
        for (lists, into) in self.lists.iter().zip(self.into) {
            if into.len() != size {
                *into = Aligned::zeros(size);
            }
            lay(simd, &lists[..S::F64_LANES], into);
        }
    }
}

/// Sums over windows side by side.
pub(crate) struct MomentSums<S: Lanes> {
    /// What weights were multiplied by, so that the greatest is about one.
    pub(crate) unit: S::f64s,
    /// Sum of the weights, and weighted sum of the samples' squares.
    pub(crate) weight: S::f64s,
    pub(crate) energy: S::f64s,
    pub(crate) moments: OnLines<S::f64s, { 2 * MOST }>,
    pub(crate) products: OnLines<S::f64s, MOST>,
}

/// What mirrored samples of some rows have together, and the differences.
struct Mirrored<S: Lanes> {
    both: OnLines<S::f64s, ROWS>,
    apart: OnLines<S::f64s, ROWS>,
}

impl<S: Lanes> Mirrored<S> {
    #[inline(always)]
    fn zero(simd: S) -> Self {
        let zero = OnLines([simd.splat_f64s(0.0); ROWS]);
        Self { both: zero.clone(), apart: zero }
    }

    #[inline(always)]
    fn put(&mut self, simd: S, row: usize, [later, earlier]: [S::f64s; 2]) {
        self.both.0[row] = simd.add_f64s(later, earlier);
        self.apart.0[row] = simd.sub_f64s(later, earlier);
    }

    #[inline(always)]
    fn rows(&self, count: usize) -> [&[S::f64s]; 2] {
        [&self.both.0[..count], &self.apart.0[..count]]
    }
}

impl SampleColumns<'_> {
    /// What weights are multiplied by.
    #[inline(always)]
    fn unit<S: Lanes>(&self, simd: S) -> S::f64s {
        if !self.weighted {
            return simd.splat_f64s(1.0);
        }
        let mut greatest = simd.splat_f64s(0.0);
        for sample in 0..self.samples {
            greatest = simd.max_f64s(greatest, simd.load(self.weights, self.first + sample * self.stride));
        }
        let units = numbers(simd, greatest).map(unit_of);
        simd.load(&units, 0)
    }

    /// Weights and values of the sample of a row and of the one that mirrors it; a sample that is its own mirror counts once.
    #[inline(always)]
    fn row<S: Lanes>(&self, simd: S, row: usize, unit: S::f64s, reference: S::f64s) -> [[S::f64s; 2]; 2] {
        let later = self.samples / 2 + row;
        let places = [later, self.samples - 1 - later].map(|sample| self.first + sample * self.stride);
        let mut weights = [unit; 2];
        let mut values = [unit; 2];
        for side in 0..2 {
            weights[side] = simd.mul_f64s(simd.load(self.weights, places[side]), unit);
            values[side] = simd.sub_f64s(simd.load(self.values, places[side]), reference);
        }
        if places[0] == places[1] {
            weights[1] = simd.splat_f64s(0.0);
        }
        [weights, values]
    }

    /// Sums over the windows.
    #[inline(always)]
    pub(crate) fn sums<S: Lanes>(&self, simd: S, degrees: usize, tables: &MomentTables) -> MomentSums<S> {
        let (zero, reference) = (simd.splat_f64s(0.0), simd.load(&self.references, 0));
        let unit = self.unit(simd);
        let mut sums = MomentSums {
            unit,
            weight: zero,
            energy: zero,
            moments: OnLines([zero; 2 * MOST]),
            products: OnLines([zero; MOST]),
        };
        let (mut of_weights, mut of_samples) = (Mirrored::zero(simd), Mirrored::zero(simd));
        let mut energies = [zero; 2];
        for first in (0..tables.rows()).step_by(ROWS) {
            let count = ROWS.min(tables.rows() - first);
            for row in 0..count {
                let [weights, values] = self.row(simd, first + row, unit, reference);
                let mut products = weights;
                for side in 0..2 {
                    products[side] = simd.mul_f64s(weights[side], values[side]);
                    energies[side] = simd.mul_add_f64s(products[side], values[side], energies[side]);
                }
                of_weights.put(simd, row, weights);
                of_samples.put(simd, row, products);
            }
            tables.add(simd, 2 * degrees - 1, first, of_weights.rows(count), &mut sums.moments.0);
            tables.add(simd, degrees, first, of_samples.rows(count), &mut sums.products.0);
        }
        sums.weight = sums.moments.0[0];
        sums.energy = simd.add_f64s(energies[0], energies[1]);
        sums
    }

    /// Takes a polynomial off the samples: products of what is left replace those of the samples; returns its sum of squares.
    #[inline(always)]
    pub(crate) fn take_off<S: Lanes>(
        &self,
        simd: S,
        degrees: usize,
        tables: &MomentTables,
        coefficients: &[S::f64s; MOST],
        sums: &mut MomentSums<S>,
    ) -> S::f64s {
        let (zero, reference) = (simd.splat_f64s(0.0), simd.load(&self.references, 0));
        let mut squares = [zero; 2];
        sums.products = OnLines([zero; MOST]);
        let mut left = Mirrored::zero(simd);
        for first in (0..tables.rows()).step_by(ROWS) {
            let count = ROWS.min(tables.rows() - first);
            for row in 0..count {
                let [weights, values] = self.row(simd, first + row, sums.unit, reference);
                let taken = tables.values(simd, first + row, degrees, coefficients);
                let mut products = weights;
                for side in 0..2 {
                    let value = simd.sub_f64s(values[side], taken[side]);
                    products[side] = simd.mul_f64s(weights[side], value);
                    squares[side] = simd.mul_add_f64s(products[side], value, squares[side]);
                }
                left.put(simd, row, products);
            }
            tables.add(simd, degrees, first, left.rows(count), &mut sums.products.0);
        }
        simd.add_f64s(squares[0], squares[1])
    }
}
