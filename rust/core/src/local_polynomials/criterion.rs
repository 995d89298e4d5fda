//! How the order of a window is chosen: Akaike's criterion, corrected for small samples, and its relatives.
//!
//! With `RSS_n` the residual sum of squares of order `n` in a window of `M` samples, the paper minimises
//!
//! ```text
//! (8) AICc_n = M ln σ_n² + 2K + 2K(K+1)/(M-K-1),   K = n + 1,      (9) σ_n² = RSS_n / (M-1).
//! ```
//!
//! The minimum over `n` of `M ln RSS_n + penalty_n` is that of `RSS_n · exp(penalty_n / M)`: the weights are computed once, and no
//! logarithm is taken of any window.

use crate::local_polynomials::sliding_projection::{ROUNDING, State};
use crate::simd::unroll::unroll;
use crate::simd::vectors::{Lanes, TABLE};

/// What is minimised to choose the order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// Akaike's criterion, corrected for small samples, with the paper's count of parameters, `K = n + 1`: equation (8).
    #[default]
    Aicc,
    /// The same with the noise variance counted as a parameter, `K = n + 2` (Hurvich and Tsai 1989).
    AiccTextbook,
    /// Akaike's criterion without the correction.
    Aic,
    /// The Bayesian information criterion.
    Bic,
}

impl Criterion {
    /// What an order costs in a window of `length` samples, or `None` where it is no candidate: no sample would be left to judge it by.
    #[must_use]
    pub fn penalty(self, order: usize, length: usize) -> Option<f64> {
        let parameters = if self == Self::AiccTextbook { order + 2 } else { order + 1 };
        if length < parameters + 2 {
            return None;
        }
        let (k, m) = (parameters as f64, length as f64);
        Some(match self {
            Self::Aicc | Self::AiccTextbook => 2.0 * k + 2.0 * k * (k + 1.0) / (m - k - 1.0),
            Self::Aic => 2.0 * k,
            Self::Bic => k * m.ln(),
        })
    }

    /// The criterion of an order, equation (8), or infinity where it is no candidate.
    #[must_use]
    pub fn score(self, residual: f64, order: usize, length: usize) -> f64 {
        let m = length as f64;
        self.penalty(order, length).map_or(f64::INFINITY, |penalty| m * (residual / (m - 1.0)).ln() + penalty)
    }

    /// What a residual is multiplied by before residuals of different orders are compared; infinite where an order is no candidate.
    #[must_use]
    pub fn weight(self, order: usize, length: usize) -> f64 {
        self.penalty(order, length).map_or(f64::INFINITY, |penalty| (penalty / length as f64).exp())
    }
}

/// What the choice knows of every order.
#[derive(Debug)]
pub(crate) struct Tables {
    /// What residuals are multiplied by before orders are compared; zero for what is no candidate.
    pub(crate) weights: [f64; TABLE],
    /// Bits that take the place of the last ones of a score: the order; for what is no candidate the largest number there is.
    pub(crate) tags: [u64; TABLE],
    /// `σ² = score · variance[order]`.
    pub(crate) variance: [f64; TABLE],
    /// A whole number that says all about an order, and what is added where the residual is rounding.
    pub(crate) code: [f64; TABLE],
    pub(crate) exact: f64,
    /// No residual is taken to be smaller.
    pub(crate) floor: f64,
}

/// Bits of a score that the order takes.
const TAG: u64 = TABLE as u64 - 1;

impl Tables {
    /// Weights of candidates, by order; what follows from them is set as told.
    pub(crate) fn new(weights: &[Option<f64>; TABLE]) -> Self {
        let tag = |order: usize| if weights[order].is_some() { order as u64 } else { f64::MAX.to_bits() };
        Self {
            weights: weights.map(|weight| weight.unwrap_or(0.0)),
            tags: std::array::from_fn(tag),
            variance: [f64::NAN; TABLE],
            code: [0.0; TABLE],
            exact: 0.0,
            floor: 0.0,
        }
    }
}

/// The order of each lane's window.
pub(crate) struct Choice<S: Lanes> {
    pub(crate) order: S::f64s,
    /// Noise variance of that order.
    pub(crate) variance: S::f64s,
    pub(crate) code: S::f64s,
}

/// Chooses the order of each lane's window: the smallest weighted residual, the lowest order where several tie.
///
/// The order is carried along in the last four bits of its score, so that the smallest score brings it with it. Scores that agree to
/// 16 units in the last place are a tie.
#[inline(always)]
pub(crate) fn choose<S: Lanes, const D: usize>(simd: S, tables: &Tables, state: &State<S, D>) -> Choice<S> {
    let zero = simd.splat_f64s(0.0);
    let floor = simd.max_f64s(simd.mul_f64s(state.energy, simd.splat_f64s(ROUNDING)), simd.splat_f64s(tables.floor));
    let mut residual = state.residual;
    let mut best = simd.splat_f64s(f64::MAX);
    unroll!(rev N < D, {
        if N < TABLE {
            let score = simd.mul_f64s(simd.max_f64s(residual, floor), simd.splat_f64s(tables.weights[N % TABLE]));
            best = simd.min_f64s(tagged(simd, score, simd.splat_u64s(tables.tags[N % TABLE])), best);
            residual = simd.mul_add_f64s(state.coefficients[N], state.coefficients[N], residual);
        }
    });
    let _ = residual;
    let tag = simd.and_u64s(simd.transmute_u64s_f64s(best), simd.splat_u64s(TAG));
    // Put into the last bits of 2^52, a whole number is that much more than 2^52.
    let base = simd.splat_f64s(4_503_599_627_370_496.0);
    let order = simd.sub_f64s(simd.transmute_f64s_u64s(simd.or_u64s(tag, simd.transmute_u64s_f64s(base))), base);
    let floor = tagged(simd, simd.mul_f64s(floor, simd.table_lookup(&tables.weights, order)), tag);
    let exact = simd.select_f64s(simd.equal_f64s(best, floor), simd.splat_f64s(tables.exact), zero);
    Choice {
        order,
        variance: simd.mul_f64s(best, simd.table_lookup(&tables.variance, order)),
        code: simd.add_f64s(simd.table_lookup(&tables.code, order), exact),
    }
}

/// A score whose last bits are replaced.
#[inline(always)]
fn tagged<S: Lanes>(simd: S, score: S::f64s, tag: S::u64s) -> S::f64s {
    let kept = simd.and_u64s(simd.transmute_u64s_f64s(score), simd.splat_u64s(!TAG));
    simd.transmute_f64s_u64s(simd.or_u64s(kept, tag))
}
