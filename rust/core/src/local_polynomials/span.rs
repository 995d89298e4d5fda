//! The span: how many windows may be reached from one start before rounding errors matter.

use crate::local_polynomials::basis::Basis;

/// How much the rounding errors of the steps between a start and the farthest window reached from it may grow, all together, for a
/// window of [`GROWTH_LENGTH`] samples. The residual sums over more errors in longer windows, so that more is allowed there.
///
/// Keeps the coefficients good to 2e-12 of the window's norm, and the residual to 1e-6 of itself where noise is 1e-6 of the signal.
const GROWTH: f64 = 40_000.0;
const GROWTH_LENGTH: f64 = 51.0;

/// No span is longer than this, or than a quarter of the window where that is more: what a run needs should stay near the processor.
const LONGEST_SPAN: usize = 256;

/// Windows in a span: as many as keep rounding errors in bounds.
///
/// An error made in one window is a polynomial that is met again outside that window, where the basis grows as fast as anything of its
/// degree can. `r` steps make `√r` errors, one upon the other at random.
pub(crate) fn span(basis: &Basis) -> usize {
    let length = basis.length() as f64;
    let last = basis.position(basis.length() - 1);
    let grown = |steps: usize| {
        let values = basis.evaluate(last + steps as f64, 0);
        (length * steps as f64 * values.iter().map(|q| q * q).sum::<f64>()).sqrt()
    };
    let allowed = GROWTH * (length / GROWTH_LENGTH).max(1.0).powf(0.3);
    // Every window reached holds the sample at the start's centre: where that is a glitch and all samples are counted from it, none
    // suffers but those that hold it.
    let longest = LONGEST_SPAN.max(basis.length() / 4).min(basis.length());
    // The largest reach within bounds, by halving.
    let (mut reach, mut too_far) = (0, longest / 2 + 1);
    while reach + 1 < too_far {
        let middle = reach.midpoint(too_far);
        if grown(middle) <= allowed {
            reach = middle;
        } else {
            too_far = middle;
        }
    }
    // Backwards one window more than forwards.
    match 2 * reach {
        0 => 1,
        span @ 1..16 => 1 << span.ilog2(),
        span => span - span % 8,
    }
}
