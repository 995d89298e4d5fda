//! Window and order chosen together, for a record as a whole and then where they are used.
//!
//! For each derivative of each record: a survey (`survey.rs`) finds the window and the order of least mean squared error; a refinement
//! (`refinement.rs`) weighs the candidates around them sample by sample; within half a window of the ends shrunk coefficients
//! (`shrinkage.rs`) take over. A record's derivatives have windows of their own, since the best ones differ.

use std::num::NonZeroUsize;

use crate::bank::Target;
use crate::ends::End;
use crate::error::Error;
use crate::local_polynomials::HIGHEST_ORDER;
use crate::parallel::Watch;
use crate::refinement::{Outputs, Refinement};
use crate::samples::Samples;
use crate::shrinkage;
use crate::simd::Instructions;
use crate::status::Status;
use crate::survey::{Pair, Survey};

/// The fewest samples of a record for which a window can be chosen.
pub const FEWEST_SAMPLES: usize = 64;

/// What to estimate.
#[derive(Clone, Copy, Debug)]
pub struct AutomaticOptions {
    /// Which derivative; 0 is the value.
    pub derivative: usize,
    /// The highest order, which is the only one where it is fixed.
    pub highest: usize,
    /// Whether the order is fixed.
    pub fixed: bool,
    /// Sample period in seconds.
    pub delta: f64,
    /// Standard deviation of the noise: see [`crate::noise`].
    pub sigma: f64,
    /// Instructions to use.
    pub instructions: Instructions,
}

/// Where the estimates of all samples go. Slices that are empty are not wanted.
#[derive(Debug)]
pub struct AutomaticEstimates<'a> {
    /// The derivative.
    pub values: &'a mut [f64],
    /// Its standard errors, with what the candidates disagree by.
    pub errors: &'a mut [f64],
    /// The order of most weight.
    pub order: &'a mut [u8],
    /// Bits of [`Status`].
    pub status: &'a mut [u16],
}

/// The window and the order that suit a record as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// Samples in the window.
    pub window_length: usize,
    /// Order of the polynomial.
    pub order: usize,
}

/// Estimates one derivative of one record with window and order chosen, and says which suit the record as a whole: nothing where no
/// window holds only values that can be used.
///
/// The numbers do not depend on the number of workers.
///
/// # Errors
/// If the record has fewer than [`FEWEST_SAMPLES`], if the derivative is higher than the order or the order too high, or if the watch cancels.
pub fn estimate_automatically(
    record: &dyn Samples,
    options: &AutomaticOptions,
    estimates: &mut AutomaticEstimates<'_>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Option<Chosen>, Error> {
    let samples = record.len();
    let &AutomaticOptions { derivative, highest, fixed, delta, sigma, instructions } = options;
    if samples < FEWEST_SAMPLES {
        return Err(Error::RecordTooShort { samples, least: FEWEST_SAMPLES });
    }
    if highest > HIGHEST_ORDER {
        let name = if fixed { "order" } else { "max_order" };
        return Err(Error::OrderTooHigh { name, order: highest, most: HIGHEST_ORDER });
    }
    if highest < derivative {
        return Err(Error::OrderTooLow { order: highest, derivative });
    }
    let target = Target { derivative, highest, fixed, delta, instructions };
    let total = 2 * samples;
    let variance = sigma * sigma;
    let best = Survey::new(record).best(&target, variance, &mut || look_up(watch, 0, total))?;
    let planned = best.and_then(|pair| Some((pair, Refinement::new(samples, pair, &target, variance)?)));
    let Some((pair, refinement)) = planned else {
        estimates.values.fill(f64::NAN);
        estimates.errors.fill(f64::NAN);
        estimates.order.fill(0);
        estimates.status.fill(Status::INVALID.bits());
        look_up(watch, total, total)?;
        return Ok(None);
    };
    let mut outputs = Outputs { values: estimates.values, errors: estimates.errors, order: estimates.order };
    refinement.estimate(record, &mut outputs, workers, watch)?;
    for end in [End::First, End::Last] {
        let reference = refinement.reference();
        let mut look_up = || look_up(watch, total, total);
        let at_end = shrinkage::estimate(record, end, pair, &target, variance, reference, &mut look_up)?;
        for (place, (&value, &error)) in at_end.values.iter().zip(&at_end.errors).enumerate() {
            let sample = if end == End::First { place } else { samples - 1 - place };
            // What the windows at the end cannot give may still come from shorter ones inside.
            if !value.is_nan() {
                put(estimates.values, sample, value);
                put(estimates.errors, sample, error);
                put(estimates.order, sample, u8::try_from(at_end.order).unwrap_or(u8::MAX));
            }
        }
    }
    for (sample, (status, value)) in estimates.status.iter_mut().zip(&*estimates.values).enumerate() {
        let mut flags = Status::GOOD;
        if sample < pair.half || sample >= samples - pair.half {
            flags |= Status::EDGE;
        }
        if value.is_nan() {
            flags |= Status::INVALID;
        }
        *status = flags.bits();
    }
    let Pair { half, order } = pair;
    Ok(Some(Chosen { window_length: 2 * half + 1, order }))
}

fn look_up(watch: &mut Watch<'_>, done: usize, total: usize) -> Result<(), Error> {
    if watch(done, total) { Ok(()) } else { Err(Error::Cancelled) }
}

fn put<T>(values: &mut [T], place: usize, value: T) {
    if let Some(slot) = values.get_mut(place) {
        *slot = value;
    }
}
