//! Derivatives beside missing samples: windows that hold short gaps are fitted on what is there.
//!
//! Gaps are followed that are no longer than the part of a window that a coefficient of its highest order stands for. Near a longer gap
//! there are no equations, as near the ends of a record; nor is there one of a sample that is missing. What is found around a sample
//! depends on the samples within [`reach`] of it alone.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::GoOn;
use crate::exec::stages::Stages;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::incomplete::{IncompleteEstimate, IncompleteMemory};
use crate::local_polynomials::incomplete_record::{Incomplete, parts_between_gaps};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::samples::{Samples, all_usable, is_usable};
use crate::status::Status;

/// Windows with gaps that are fitted before their estimates are put into columns: what is kept of each takes some hundred bytes.
const TOGETHER: usize = 1 << 14;

/// The longest gap that is followed.
fn longest_gap(plan: &LocalPolynomials) -> usize {
    plan.options().window_length / plan.orders().max(2)
}

/// Samples on either side of one that decide what is found around it.
pub(crate) fn reach(plan: &LocalPolynomials) -> usize {
    plan.options().window_length / 2 + longest_gap(plan)
}

/// Samples of a record whose windows lack some, and the parts of it that windows do not reach out of.
struct Lacking {
    parts: Vec<Range<usize>>,
    places: Vec<usize>,
}

impl Lacking {
    fn of(plan: &LocalPolynomials, samples: &[f64], is_wanted: impl Fn(usize) -> bool) -> Self {
        let (length, before) = (plan.options().window_length, plan.before_centre());
        let parts = parts_between_gaps(samples.len(), longest_gap(plan), |sample| is_usable(samples[sample]));
        let mut places = Vec::new();
        for part in &parts {
            let centres = part.start + before..(part.end + before + 1).saturating_sub(length).max(part.start + before);
            // Missing samples of the window that ends with a sample.
            let mut lost = 0_usize;
            let is_lost = |sample: usize| usize::from(!is_usable(samples[sample]));
            for sample in part.start..part.end {
                lost += is_lost(sample);
                lost -= sample.checked_sub(length).filter(|gone| *gone >= part.start).map_or(0, is_lost);
                let centre = (sample + before + 1).saturating_sub(length);
                let is_there = centres.contains(&centre) && is_usable(samples[centre]);
                if lost > 0 && is_there && is_wanted(centre) {
                    places.push(centre);
                }
            }
        }
        Self { parts, places }
    }

    fn record<'a>(&'a self, plan: &LocalPolynomials, samples: &'a [f64]) -> Incomplete<'a> {
        Incomplete { samples, weights: None, parts: &self.parts, least: plan.options().window_length.div_ceil(2) }
    }
}

/// Fits the windows of a whole record that lack samples, around samples that are wanted, and puts their derivatives into their places; `take`
/// gets the order and the flags of each.
pub(crate) fn fit_whole(
    plan: &LocalPolynomials,
    samples: &[f64],
    derivatives: &mut [Vec<f64>],
    is_wanted: impl Fn(usize) -> bool,
    stages: &mut Stages<'_, '_>,
    mut take: impl FnMut(usize, u8, u16),
) -> Result<(), Error> {
    let lacking = Lacking::of(plan, samples, is_wanted);
    if lacking.places.is_empty() {
        return Ok(());
    }
    let record = lacking.record(plan, samples);
    let workers = stages.workers;
    for places in lacking.places.chunks(TOGETHER) {
        let found = stages.stage(|watch| plan.run_incomplete(&record, places, workers, watch))?;
        for (&place, estimate) in places.iter().zip(found) {
            for (column, (value, _)) in derivatives.iter_mut().zip(&estimate.derivatives) {
                column[place] = *value;
            }
            take(place, order_of(&estimate), flags_of(&estimate));
        }
    }
    Ok(())
}

fn order_of(estimate: &IncompleteEstimate) -> u8 {
    u8::try_from(estimate.order).unwrap_or(u8::MAX)
}

/// A sample that is there is no gap, though its window has one.
fn flags_of(estimate: &IncompleteEstimate) -> u16 {
    estimate.status.bits() & !Status::GAP.bits()
}

/// The same for a part of a record, as pieces of it come by.
#[derive(Clone, Debug, Default)]
pub(crate) struct BesideGaps {
    samples: Vec<f64>,
    weights: Vec<f64>,
    memory: IncompleteMemory,
}

impl BesideGaps {
    /// Fits the windows around some samples that lack others, one element a sample. With `weights` windows are left as they are that lack a
    /// sample whose weight is not zero. Stops once `go_on` returns false.
    pub(crate) fn fit(
        &mut self,
        plan: &LocalPolynomials,
        (record, weights): (&dyn Samples, Option<&dyn Samples>),
        wanted: Range<usize>,
        estimates: &mut Estimates<'_>,
        go_on: &GoOn<'_>,
    ) {
        let around = wanted.start.saturating_sub(reach(plan))..(wanted.end + reach(plan)).min(record.len());
        let first = around.start;
        self.samples.resize(around.len(), 0.0);
        record.read(first, &mut self.samples);
        if all_usable(&self.samples) {
            return;
        }
        let length = plan.options().window_length;
        if let Some(weights) = weights {
            self.weights.resize(around.len(), 0.0);
            weights.read(first, &mut self.weights);
        }
        let (samples, weights) = (&self.samples[..], weights.map(|_| &self.weights[..]));
        let is_spoilt = |place: usize| {
            let window = place - plan.before_centre()..place - plan.before_centre() + length;
            weights.is_some_and(|weights| {
                window.into_iter().any(|place| weights[place] > 0.0 && !is_usable(samples[place]))
            })
        };
        let lacking = Lacking::of(plan, samples, |place| wanted.contains(&(first + place)) && !is_spoilt(place));
        let record = lacking.record(plan, samples);
        let mut found = vec![None; lacking.places.len()];
        plan.fit_incomplete(&record, &lacking.places, &mut self.memory, &mut found, go_on);
        for (place, found) in lacking.places.iter().zip(found) {
            let Some(found) = found else { return };
            let element = first + place - wanted.start;
            for (column, (value, _)) in estimates.derivatives.iter_mut().zip(&found.derivatives) {
                column[element] = *value;
            }
            estimates.order[element] = order_of(&found);
            estimates.status[element] = flags_of(&found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::output::Elements;
    use crate::local_polynomials::criterion::Criterion;
    use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
    use crate::simd::instructions::Instructions;

    const SAMPLES: usize = 400;

    fn plan() -> LocalPolynomials {
        let options = PolynomialOptions {
            window_length: 41,
            order: Order::Chosen { criterion: Criterion::Aicc, highest: 5 },
            selection: Selection::Window,
            derivatives: vec![0, 1, 2],
            delta: 0.1,
            noise: false,
            quantisation: 0.0,
            instructions: Instructions::Scalar,
        };
        LocalPolynomials::new(options).expect("a plan")
    }

    /// A signal with short and long gaps, at its ends too.
    fn signal() -> Vec<f64> {
        let is_lost = |sample: usize| sample < 2 || sample % 37 == 5 || (200..215).contains(&sample) || sample == 399;
        (0..SAMPLES).map(|sample| if is_lost(sample) { f64::NAN } else { (0.1 * sample as f64).sin() }).collect()
    }

    /// What is found of some samples, NaN elsewhere.
    fn found(weights: Option<&dyn Samples>, wanted: Range<usize>) -> Vec<f64> {
        let plan = plan();
        let signal = signal();
        let mut columns = [(); 3].map(|()| vec![f64::NAN; wanted.len()]);
        let (mut order, mut status) = (vec![0; wanted.len()], vec![0; wanted.len()]);
        let mut estimates = Estimates {
            elements: Elements { first: wanted.start, step: 1 },
            derivatives: columns.iter_mut().map(Vec::as_mut_slice).collect(),
            order: &mut order,
            status: &mut status,
            sigma: &mut [],
        };
        BesideGaps::default().fit(&plan, (&signal.as_slice(), weights), wanted, &mut estimates, &|| true);
        columns.concat()
    }

    #[test]
    fn parts_have_the_bits_of_the_whole() {
        let whole = found(None, 0..SAMPLES);
        assert!(whole.iter().filter(|value| value.is_finite()).count() > 3 * SAMPLES / 2);
        for (first, end) in [(0, 30), (30, 195), (195, 196), (196, 230), (230, SAMPLES)] {
            let part = found(None, first..end);
            for derivative in 0..3 {
                let expected = &whole[derivative * SAMPLES..][first..end];
                let got = &part[derivative * (end - first)..][..end - first];
                assert!(expected.iter().zip(got).all(|(one, other)| one.to_bits() == other.to_bits()));
            }
        }
    }

    #[test]
    fn windows_that_lack_what_counts_are_left_alone() {
        let ones = vec![1.0; SAMPLES];
        assert!(found(Some(&ones.as_slice()), 0..SAMPLES).iter().all(|value| value.is_nan()));
        let zeros = vec![0.0; SAMPLES];
        let all = found(Some(&zeros.as_slice()), 0..SAMPLES);
        assert!(all.iter().zip(found(None, 0..SAMPLES)).all(|(one, other)| one.to_bits() == other.to_bits()));
    }
}
