//! Scanning the length of the polynomials' windows: do derivatives of every smoothness obey the same equation?
//!
//! The user fixed the window, so this is done when it is asked for, and moves nothing.

use std::f64::consts::PI;
use std::num::NonZeroUsize;
use std::ops::Range;

use crate::equation::motion::{Motion, unknowns};
use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::pool::Watch;
use crate::exec::stages::Stages;
use crate::identify::kinds::{Kind, in_strong_form};
use crate::identify::options::{StrongForm, Task};
use crate::identify::scanned::{Scan, wider};
use crate::identify::strong::rows::{differentiate, rows};
use crate::identify::widths::{MOST_SAMPLES, OfWidth, STRETCHES, Widths};
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::options::PolynomialOptions;
use crate::local_polynomials::plan::LocalPolynomials;
use crate::noise::channel::variance_after;
use crate::noise::spectrum::power_in_pieces;
use crate::record::subsample::stretches;
use crate::regression::model::Model;
use crate::weak_form::test_function::LEAST_HALF_WIDTH;
use crate::weak_form::test_function_choice::{Evidence, spectrum_length};

/// Stages of a call, about: only for showing progress.
const STAGES: usize = 60;
/// Windows that a stretch of a long record holds at least.
const WINDOWS_OF_STRETCH: usize = 4;
/// Frequencies at which the response of a window is looked at, for every cycle that it holds.
const OF_CYCLE: f64 = 16.0;

/// Estimates by the length of the polynomials' windows, from stretches of a long record. Inertia and damping are taken as constant, what else is
/// windowed grows linearly within blocks; errors are from how blocks of the record scatter.
///
/// # Errors
/// If there is not the memory, or the watch cancels.
pub fn scan_windows(
    task: &Task<'_>,
    form: &StrongForm<'_>,
    kinds: &[Kind],
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Scan, Error> {
    let motion = &task.motion;
    let (samples, options) = (motion.angle.len(), form.derivatives.options());
    let mut stages = Stages::new(workers, samples, STAGES, watch);
    let numbers = unknowns(&motion.coefficients, motion.terms.len());
    let kinds = in_strong_form(kinds, &numbers);
    let windowed = kinds.iter().zip(&numbers).map(|(kind, &number)| *kind == Kind::Windowed && number >= 2);
    let model = Model::new(&numbers, windowed, true);
    let mut widths = Widths::new(&model, 0.0, || cycle(motion, options, &mut stages))?;
    let most = if samples > 2 * MOST_SAMPLES { MOST_SAMPLES } else { samples };
    let parts: Vec<Range<usize>> = stretches(samples, most, STRETCHES).collect();
    let shortest = parts.iter().map(Range::len).min().unwrap_or(0);
    let widest = widths.widest(samples).min(if parts.len() > 1 { shortest / WINDOWS_OF_STRETCH } else { samples });
    let mut half = LEAST_HALF_WIDTH;
    while 2 * half < widest {
        let options = PolynomialOptions { window_length: 2 * half + 1, ..options.clone() };
        let plan = stages.stage(|watch| LocalPolynomials::watched(options, watch))?;
        let (rows, order) = rows_to_scan(&plan, task, form.filter_torque, &parts, &mut stages)?;
        let ends = (0..parts.len()).map(|part| part * shortest..(part + 1) * shortest);
        let band = half_power(plan.basis(), order) / plan.options().delta;
        let one =
            OfWidth { rows: &rows, stretches: &ends.collect::<Vec<_>>(), stride: 1, reach: half, scale: (half, band) };
        widths.add(&one, &mut stages)?;
        half = wider(half);
    }
    stages.finish()?;
    let found = widths.plateaus().best;
    let place = |number: &usize| numbers.iter().position(|one| one == number).unwrap_or(*number);
    Ok(Scan { unknowns: found.unknowns.iter().map(place).collect(), ..found })
}

/// Samples of a typical cycle of the motion.
fn cycle(motion: &Motion<'_>, options: &PolynomialOptions, stages: &mut Stages<'_, '_>) -> Result<f64, Error> {
    let samples = motion.angle.len();
    let quantisation = (options.quantisation > 0.0).then_some(options.quantisation);
    let noise = variance_after(motion.measured.passed[0], motion.angle, None, quantisation, options.instructions);
    let evidence = Evidence {
        power: power_in_pieces(motion.angle, None, spectrum_length(samples, 200), stages)?,
        samples,
        noise: [noise, 0.0],
        coloured: None,
        delta: options.delta,
        unknown: [true; 3],
    };
    Ok(evidence.with_noise(motion.measured.noise).period())
}

/// Rows of parts of a record, one after another, and the order that is usual among them.
fn rows_to_scan(
    plan: &LocalPolynomials,
    task: &Task<'_>,
    filter_torque: bool,
    parts: &[Range<usize>],
    stages: &mut Stages<'_, '_>,
) -> Result<(Rows, usize), Error> {
    let mut all = Rows::default();
    let mut orders = Vec::new();
    for part in parts {
        let (mask, weights) = (task.mask.map(|mask| &mask[part.clone()]), task.weights.map(|one| &one[part.clone()]));
        let (rows, order) = task.motion.within(part, |motion| {
            let found = differentiate(plan, motion, (task.lag.unwrap_or(0.0), filter_torque), stages)?;
            Ok((rows(plan, motion, (mask, weights), true, &found), found.order))
        })?;
        orders.extend(order.into_iter().zip(&rows.usable).filter(|(_, usable)| **usable).map(|(order, _)| order));
        all.append(rows);
    }
    let middle = orders.len() / 2;
    let usual = if orders.is_empty() { 0 } else { *orders.select_nth_unstable(middle).1 };
    Ok((all, usual.into()))
}

/// Where a polynomial of some order in a window passes half the power of what it is fitted to, in cycles a sample: the highest frequency there is
/// if it passes all.
fn half_power(basis: &Basis, order: usize) -> f64 {
    let (length, centre) = (basis.length(), basis.length() / 2);
    let row = |index: usize| (0..basis.degrees().min(order + 1)).map(move |degree| basis.value(degree, index));
    let weights: Vec<f64> =
        (centre..length).map(|index| row(centre).zip(row(index)).map(|(one, other)| one * other).sum()).collect();
    let passes = |frequency: f64| {
        let wave = |(place, weight): (usize, &f64)| weight * (2.0 * PI * frequency * place as f64).cos();
        let response = 2.0 * weights.iter().enumerate().map(wave).sum::<f64>() - weights[0];
        response * response > 0.5
    };
    let step = 1.0 / (OF_CYCLE * length as f64);
    let mut low = 0.0;
    while low < 0.5 && passes(low + step) {
        low += step;
    }
    let mut high = low + step;
    while high - low > 1e-3 * step {
        let middle = f64::midpoint(low, high);
        if passes(middle) { low = middle } else { high = middle }
    }
    low.min(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_power_of_a_mean_passes_below_half_a_cycle_of_its_window() {
        // sin(x)/x is a half of its power's root at x = 1.3916: 0.443 cycles in a window.
        let found = half_power(&Basis::new(1001, 1).expect("little memory"), 0);
        assert!((found * 1001.0 - 1.391_557 / PI).abs() < 1e-3, "{found}");
        // A polynomial through all samples passes everything.
        assert!((half_power(&Basis::new(5, 5).expect("little memory"), 4) - 0.5).abs() < 0.01);
    }
}
