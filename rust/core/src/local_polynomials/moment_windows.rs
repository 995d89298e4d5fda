//! Windows on a uniform grid that lack samples, or whose samples have weights, fitted from their moments, side by side.
//!
//! A whole window's samples have the same times everywhere, so that sums of Chebyshev polynomials over them are products with one table
//! ([`crate::local_polynomials::moment_tables`]); a missing sample has the weight 0. The orthogonal polynomials follow from the moments
//! ([`crate::local_polynomials::chebyshev_factor`]). The polynomial that fits best is taken off the samples first, and what is left is fitted
//! again, so that sums are as small as the noise. Windows for which that may lose more than [`LOST`](crate::local_polynomials::kept_digits::LOST)
//! are left to [`crate::local_polynomials::weighted_windows`].

use crate::local_polynomials::chebyshev_factor::ChebyshevFactor;
use crate::local_polynomials::chebyshev_sums::{DERIVATIVES, MOST, at};
use crate::local_polynomials::kept_digits::{KeptDigits, tails_of};
use crate::local_polynomials::moment_sums::SampleColumns;
use crate::local_polynomials::moment_tables::MomentTables;
use crate::local_polynomials::orders_abreast::{DerivativeParts, OrderResiduals, sums};
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::local_polynomials::table_columns::TableColumns;
use crate::local_polynomials::weighted_samples::numbers;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};

/// Whether windows with so many candidates and derivatives from 0 on can be fitted from their moments.
pub(crate) fn has_moments(degrees: usize, derivatives: usize) -> bool {
    (1..=MOST).contains(&degrees) && derivatives < DERIVATIVES
}

/// Windows, one a lane, and each whole but for samples of weight 0.
pub(crate) struct MomentWindows<'a> {
    pub(crate) samples: SampleColumns<'a>,
    pub(crate) tables: &'a MomentTables,
    pub(crate) columns: &'a TableColumns,
    /// Times that derivatives are wanted at.
    pub(crate) times: [f64; MOST_LANES],
    /// Zero where the window is full and around its sample, else 1.
    pub(crate) off_centre: [f64; MOST_LANES],
    /// Polynomials, and whether their number is chosen.
    pub(crate) degrees: usize,
    pub(crate) is_chosen: bool,
    /// The highest derivative that is wanted.
    pub(crate) derivatives: usize,
    /// What a quantisation leaves of a squared residual.
    pub(crate) quantised: f64,
}

/// What was found, by lane.
pub(crate) struct MomentFits {
    /// Derivatives and their standard errors, in windows' time.
    pub(crate) values: [[f64; MOST_LANES]; DERIVATIVES],
    pub(crate) errors: [[f64; MOST_LANES]; DERIVATIVES],
    pub(crate) order: [f64; MOST_LANES],
    pub(crate) sigma: [f64; MOST_LANES],
    /// Whether an order leaves rounding only, and whether the fit is to be used.
    pub(crate) exact: u32,
    pub(crate) good: u32,
}

impl Kernel for MomentWindows<'_> {
    type Output = MomentFits;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> MomentFits {
        let Self { samples, tables, columns, degrees, derivatives, .. } = &self;
        let (degrees, zero, wanted) = (*degrees, simd.splat_f64s(0.0), derivatives + 1);
        let mut window = samples.sums(simd, degrees, tables);
        let mut factor = ChebyshevFactor::zero(simd);
        factor.decompose(simd, degrees, &window.moments.0, &window.products.0, &[zero; MOST]);
        let off = factor.solve(simd, degrees);
        let square = samples.take_off(simd, degrees, tables, &off.0, &mut window);
        factor.decompose(simd, degrees, &window.moments.0, &window.products.0, &off.0);
        let kept = KeptDigits::new(simd, degrees, &factor, square, &tails_of(simd, degrees, &off.0).0);
        let quantised = simd.mul_f64s(window.weight, simd.splat_f64s(self.quantised));
        let floor = simd.max_f64s(quantised, simd.mul_f64s(window.energy, simd.splat_f64s(ROUNDING)));
        let length = simd.splat_f64s(samples.samples as f64);
        // Standard errors follow from the pivots, however little of the samples is left beside a quantisation.
        let peak = simd.max_f64s(square, floor);
        let good = kept.are_enough(simd, degrees, (length, window.weight), (floor, peak));
        let mut coefficients = OnLines([zero; MOST]);
        for k in 0..degrees {
            coefficients.0[k] = simd.add_f64s(factor.own.0[k], factor.turned.0[k]);
        }
        let inverse = &factor.inverse.0;
        let residuals = OrderResiduals::new(simd, degrees, kept.residual, &coefficients.0, inverse, floor);
        let (choice, shares) = if self.is_chosen {
            (residuals.choose(simd, columns), Some(residuals.shares(simd, columns)))
        } else {
            (residuals.fixed(simd, columns), None)
        };
        let time = simd.load(&self.times, 0);
        let mut polynomials = OnLines([[zero; MOST]; DERIVATIVES]);
        at(simd, degrees, time, &mut polynomials.0[..wanted]);
        let before = sums(simd, degrees, &polynomials.0[..wanted], &off.0);
        factor.at(simd, degrees, time, &mut polynomials.0[..wanted]);
        let is_off = simd.greater_than_f64s(simd.load(&self.off_centre, 0), simd.splat_f64s(0.5));
        let mut found = MomentFits {
            values: [[0.0; MOST_LANES]; DERIVATIVES],
            errors: [[0.0; MOST_LANES]; DERIVATIVES],
            order: numbers(simd, choice.order),
            sigma: numbers(simd, simd.sqrt_f64s(simd.div_f64s(choice.variance, window.unit))),
            exact: simd.bits(choice.exact),
            good: simd.bits(good),
        };
        for (derivative, (row, &before)) in polynomials.0.iter().zip(&before).enumerate().take(wanted) {
            let mut all = before;
            for k in 0..degrees {
                all = simd.mul_add_f64s(simd.mul_f64s(row[k], inverse[k]), factor.own.0[k], all);
            }
            let parts = DerivativeParts {
                polynomials: row,
                coefficients: &coefficients.0,
                inverse,
                full: all,
                off_centre: self.is_chosen.then_some((derivative, is_off)),
            };
            let (value, error) = residuals.estimate(simd, columns, (&choice, shares.as_ref()), &parts);
            // Rounding is left of a derivative that a polynomial of the order does not have.
            let is_none = simd.less_than_f64s(choice.order, simd.splat_f64s(derivative as f64));
            found.values[derivative] = numbers(simd, simd.select_f64s(is_none, zero, value));
            found.errors[derivative] = numbers(simd, error);
        }
        found
    }
}
