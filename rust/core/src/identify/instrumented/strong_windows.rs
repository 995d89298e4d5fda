//! The window of the strong form's polynomials with an instrument: the longest, from the given one down, that follows the explained motion.

use std::num::NonZeroUsize;

use crate::equation::motion::{Motion, unknowns};
use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::pool::Watch;
use crate::exec::stages::Stages;
use crate::identify::instrumented::two_stage_rows::{Both, WEAK_INSTRUMENT, columns, solve};
use crate::identify::options::{StrongForm, Task};
use crate::identify::strong::rows::{differentiate, rows};
use crate::local_polynomials::options::{HIGHEST_ORDER, Order, PolynomialOptions};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::regression::tapered_sums::TAPERS;
use crate::regression::two_stage::TwoStage;

/// Of a standard error: what a window may take from a constant before shorter ones are tried. It is part of the error, which it makes 3 % larger.
const SMALL: f64 = 0.25;

/// Rows with polynomials of one window, and what they give.
struct OfWindow {
    both: Both,
    found: Option<TwoStage>,
}

/// Rows of both motions and their solution.
///
/// Polynomials smooth: of a motion with three periods in a window, those of order 15 lose 0.03 % of the acceleration, those of order 3 most of it. What a window
/// half as long changes is the bias of the longer one. The shorter window is taken where that makes errors with the bias smaller; what is left of it is part of the errors.
pub(crate) fn strong(
    form: &StrongForm<'_>,
    task: &Task<'_>,
    explained: &Motion<'_>,
    (workers, watch): (NonZeroUsize, &mut Watch<'_>),
) -> Result<(Both, Option<TwoStage>), Error> {
    // Orders chosen by the noise would smooth the motion away: inertia came out 2 to 3 % too large. Noise need not be smoothed, since
    // what the instrument explains is smooth, and sums with it leave nothing else.
    let options = form.derivatives.options();
    let order = match options.order {
        Order::Chosen { highest, .. } => highest.min(options.window_length.saturating_sub(2)),
        Order::Fixed(order) => order,
    };
    let mut of = |window_length: usize, order: usize| -> Result<OfWindow, Error> {
        let options = PolynomialOptions { order: Order::Fixed(order), window_length, ..options.clone() };
        let both = of_window(options, form, task, explained, (workers, &mut *watch))?;
        Ok(OfWindow { found: solve(&both, &task.motion), both })
    };
    let mut window = of(options.window_length, order)?;
    while let Some(found) = &mut window.found {
        let length = window.both.window_length;
        let shorter = half(length, order);
        let highest = HIGHEST_ORDER.min(length.saturating_sub(2));
        if shorter.is_none() && highest <= order {
            break;
        }
        let sharper = match shorter {
            Some(length) => of(length, order)?,
            None => of(length, highest)?,
        };
        let Some(bias) = bias(&window.both, &sharper.both, found, &task.motion) else { break };
        let is_small = bias.iter().enumerate().all(|(one, bias)| *bias <= SMALL * found.variance(one).sqrt());
        for (one, bias) in bias.iter().enumerate() {
            found.widen(one, bias * bias);
        }
        // The first stage is weak where polynomials are too long to leave anything, too.
        let enough = WEAK_INSTRUMENT.min(found.strength);
        let is_better = |sharper: &TwoStage| sharper.size() < found.size() && sharper.strength >= enough;
        if is_small || shorter.is_none() || !sharper.found.as_ref().is_some_and(is_better) {
            break;
        }
        window = sharper;
    }
    Ok((window.both, window.found))
}

/// An odd length of half as many samples, if polynomials of the order, and sharper ones to compare them with, can be fitted to them.
fn half(length: usize, order: usize) -> Option<usize> {
    let shorter = (length / 2) | 1;
    (shorter < length && shorter >= order + 4).then_some(shorter)
}

fn of_window(
    options: PolynomialOptions,
    form: &StrongForm<'_>,
    task: &Task<'_>,
    explained: &Motion<'_>,
    (workers, watch): (NonZeroUsize, &mut Watch<'_>),
) -> Result<Both, Error> {
    let window_length = options.window_length;
    let plan = LocalPolynomials::new(options)?;
    let mut stages = Stages::new(workers, task.motion.angle.len(), 4, watch);
    let mut built = Vec::new();
    for motion in [&task.motion, explained] {
        let lag = (task.lag.unwrap_or(0.0), form.filter_torque);
        let differentiated = differentiate(&plan, motion, lag, &mut stages)?;
        built.push(rows(&plan, motion, (task.mask, task.weights), false, &differentiated));
    }
    let mut built = built.into_iter();
    let (recorded, explained) = (built.next().unwrap_or_default(), built.next().unwrap_or_default());
    Ok(Both { recorded, explained, reach: window_length, window_length, exponent: None })
}

/// What polynomials take from the constants beside sharper ones: what least squares make of the difference between their rows, of each constant by
/// the motion that shows less. Noise of the angle is in the recorded motion's difference, noise of the instrument in that of the explained one.
fn bias(window: &Both, sharper: &Both, found: &TwoStage, motion: &Motion<'_>) -> Option<Vec<f64>> {
    let numbers = unknowns(&motion.coefficients, motion.terms.len());
    let by = |[smooth, sharp]: [&Rows; 2]| -> Option<Vec<f64>> {
        let lost = (0..smooth.rhs.len()).map(|row| {
            if !smooth.usable[row] || !sharp.usable[row] {
                return 0.0;
            }
            let each = numbers.iter().zip(&found.values);
            let of_unknowns = each.map(|(&number, value)| {
                value * (smooth.regressors[number].value[row] - sharp.regressors[number].value[row])
            });
            of_unknowns.sum::<f64>() + sharp.rhs[row] - smooth.rhs[row]
        });
        let lost = lost.collect();
        Some(columns(window, motion).with_rhs(lost).solve(0..smooth.rhs.len(), (window.reach, TAPERS))?.values)
    };
    let (recorded, explained) =
        (by([&window.recorded, &sharper.recorded])?, by([&window.explained, &sharper.explained])?);
    Some(recorded.iter().zip(explained).map(|(one, other)| one.abs().min(other.abs())).collect())
}
