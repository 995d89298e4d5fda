//! A single window, projected directly: for the ends of a record and for the values of the criterion.
//!
//! Windows of several records are projected side by side, one a lane. Operations are not fused, so that they have the bits that each has alone.

use pulp::Scalar;

use crate::exec::pool::GoOn;
use crate::lanes::interleaved::Strips;
use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::record::samples::is_usable;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};

/// After so many pairs of samples it is asked whether to go on: they take about a millisecond.
const ASKED: usize = 1 << 16;

/// The projection of one window.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    /// The sample at the centre, which was subtracted from all samples.
    pub(crate) reference: f64,
    /// Projections on the orthonormal polynomials.
    pub(crate) coefficients: Vec<f64>,
    /// Residual sum of squares of every order.
    pub(crate) residuals: Vec<f64>,
    /// The floor of the residuals, from rounding or quantisation.
    pub(crate) floor: f64,
}

impl Window {
    /// Projects a window, or returns `None` if it holds an unusable sample. Residuals are at least `floor`.
    pub(crate) fn project(basis: &Basis, samples: &[f64], floor: f64) -> Option<Self> {
        Self::project_while(basis, samples, floor, &|| true)
    }

    /// The same for windows of any length, asking repeatedly whether to go on; after `false` the projection is incomplete.
    pub(crate) fn project_while(basis: &Basis, samples: &[f64], floor: f64, go_on: &GoOn<'_>) -> Option<Self> {
        if !samples.iter().all(|&value| is_usable(value)) {
            return None;
        }
        let projected = project(Scalar::new(), basis, Places { samples, apart: 1 }, go_on);
        let coefficients = projected.coefficients[..basis.degrees()].to_vec();
        Some(Self::new(projected.reference, coefficients, projected.residual, projected.energy, floor))
    }

    /// A window of which coefficients, the residual of the highest order and the sum of squares are known.
    fn new(reference: f64, coefficients: Vec<f64>, residual: f64, energy: f64, floor: f64) -> Self {
        let mut residuals = vec![residual; coefficients.len()];
        for order in (0..residuals.len() - 1).rev() {
            residuals[order] = residuals[order + 1] + coefficients[order + 1].powi(2);
        }
        Self { reference, coefficients, residuals, floor: floor.max(ROUNDING * energy) }
    }

    /// The order whose residual, multiplied by its weight, is the smallest; the lowest of several.
    pub(crate) fn best(&self, weights: &[f64]) -> usize {
        let score = |order: usize| self.residuals[order].max(self.floor) * weights[order];
        (0..self.residuals.len()).fold(0, |best, order| if score(order) < score(best) { order } else { best })
    }
}

/// The projection of one window in each lane.
struct WindowInEachLane<S: Lanes> {
    reference: S::f64s,
    coefficients: [S::f64s; MOST_DEGREES],
    /// Residual sum of squares of the highest order.
    residual: S::f64s,
    energy: S::f64s,
}

/// The samples of one window in each lane.
#[derive(Clone, Copy)]
struct Places<'a> {
    samples: &'a [f64],
    /// Numbers from one sample of a window to the next.
    apart: usize,
}

impl Places<'_> {
    #[inline(always)]
    fn at<S: Lanes>(self, simd: S, place: usize) -> S::f64s {
        simd.load(self.samples, place * self.apart)
    }

    /// Samples right and left of the centre, without the reference.
    #[inline(always)]
    fn mirrored<S: Lanes>(self, simd: S, (right, left): (usize, usize), reference: S::f64s) -> (S::f64s, S::f64s) {
        (simd.sub_f64s(self.at(simd, right), reference), simd.sub_f64s(self.at(simd, left), reference))
    }
}

/// Projects one window in each lane.
#[inline(always)]
fn project<S: Lanes>(simd: S, basis: &Basis, samples: Places<'_>, go_on: &GoOn<'_>) -> WindowInEachLane<S> {
    let is_over = |row: usize| row % ASKED == ASKED - 1 && !go_on();
    let zero = simd.splat_f64s(0.0);
    let (half, odd) = (basis.length() / 2, basis.length() % 2);
    let reference = samples.at(simd, half);
    let pair = |row: usize| (half + row, half + odd - 1 - row);
    let mut all = [zero; MOST_DEGREES];
    let coefficients = &mut all[..basis.degrees()];
    // The sample at the centre is the reference.
    for (row, q) in basis.rows().enumerate().skip(odd) {
        if is_over(row) {
            break;
        }
        let (right, left) = samples.mirrored(simd, pair(row), reference);
        let parts = [simd.add_f64s(right, left), simd.sub_f64s(right, left)];
        for (j, (coefficient, value)) in coefficients.iter_mut().zip(q).enumerate() {
            *coefficient = simd.add_f64s(*coefficient, simd.mul_f64s(simd.splat_f64s(*value), parts[j % 2]));
        }
    }
    let (mut residual, mut energy) = (zero, zero);
    for (row, q) in basis.rows().enumerate() {
        if is_over(row) {
            break;
        }
        let (right, left) = samples.mirrored(simd, pair(row), reference);
        let mut parts = [zero; 2];
        for (j, (coefficient, value)) in coefficients.iter().zip(q).enumerate() {
            parts[j % 2] = simd.add_f64s(parts[j % 2], simd.mul_f64s(*coefficient, simd.splat_f64s(*value)));
        }
        let [even, uneven] = parts;
        let error = simd.sub_f64s(simd.sub_f64s(right, even), uneven);
        residual = simd.add_f64s(residual, simd.mul_f64s(error, error));
        energy = simd.add_f64s(energy, simd.mul_f64s(right, right));
        if odd == 0 || row > 0 {
            let error = simd.add_f64s(simd.sub_f64s(left, even), uneven);
            residual = simd.add_f64s(residual, simd.mul_f64s(error, error));
            energy = simd.add_f64s(energy, simd.mul_f64s(left, left));
        }
    }
    WindowInEachLane { reference, coefficients: all, residual, energy }
}

/// Projects the windows of several records that begin at one sample, one record a lane.
pub(crate) struct WindowsOf<'a> {
    pub(crate) basis: &'a Basis,
    /// The records, as one block a lane.
    pub(crate) strips: &'a Strips,
    pub(crate) first: usize,
    /// Residuals are at least this.
    pub(crate) floor: f64,
}

impl Kernel for WindowsOf<'_> {
    /// The window of every lane.
    type Output = Vec<Window>;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Vec<Window> {
        let Self { basis, strips, first, floor } = self;
        let samples = Places { samples: strips.rows_on_from(first), apart: strips.columns() };
        let projected = project(simd, basis, samples, &|| true);
        let mut numbers = [[0.0; MOST_LANES]; MOST_DEGREES + 3];
        let WindowInEachLane { reference, coefficients, residual, energy } = projected;
        for (numbers, vector) in numbers.iter_mut().zip([reference, residual, energy].iter().chain(&coefficients)) {
            simd.store(numbers, 0, *vector);
        }
        let [references, residuals, energies, coefficients @ ..] = &numbers;
        let window = |lane: usize| {
            let coefficients = coefficients[..basis.degrees()].iter().map(|numbers| numbers[lane]).collect();
            Window::new(references[lane], coefficients, residuals[lane], energies[lane], floor)
        };
        (0..S::F64_LANES).map(window).collect()
    }
}
