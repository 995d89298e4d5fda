//! Local polynomials of a signal that goes on, of which samples are missing or have weights: the batch's numbers, later than without.
//!
//! What a window holds, and where the parts between gaps end that it may reach into, depends on the samples within [`reach`] of its own.

use std::ops::Range;
use std::sync::Arc;

use crate::error::Error;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::incomplete::{IncompleteEstimate, IncompleteMemory};
use crate::local_polynomials::incomplete_record::{Incomplete, parts_of};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::derived::Cut;
use crate::record::retained::Retained;
use crate::record::samples::Samples;
use crate::status::Status;
use crate::stream::polynomials::{PIECE, PolynomialState, PolynomialStream};

/// What windows that lack samples reach across, and must hold.
#[derive(Clone, Copy, Debug)]
pub struct StreamedGaps {
    /// Missing samples are left out; where there are weights, else, they spoil their windows.
    pub leaves_out: bool,
    /// Every sample comes with a weight: one over the variance of its noise, relative to the others. Those of weight zero must be zero.
    pub weighted: bool,
    /// Samples of the longest gap that windows reach across.
    pub longest_gap: usize,
    /// Samples that a window must hold.
    pub least: usize,
}

/// Samples on either side of one that decide what is found around it: windows that begin or end with it, and gaps beside them.
fn reach(plan: &LocalPolynomials, gaps: StreamedGaps) -> usize {
    plan.options().window_length + gaps.longest_gap
}

/// Local polynomials of a signal that comes piece by piece; where nothing was said of gaps, as [`PolynomialStream`] has them.
#[derive(Debug)]
pub struct IncompleteStream {
    plan: Arc<LocalPolynomials>,
    stream: PolynomialStream,
    gaps: Option<StreamedGaps>,
    weights: Retained,
    /// Samples and weights around those that are given.
    around: [Vec<f64>; 2],
    memory: IncompleteMemory,
}

/// What a stream of samples with weights resumes from.
#[derive(Clone, Debug, Default)]
pub struct IncompleteState {
    /// The samples.
    pub samples: PolynomialState,
    /// Number of the first sample in `weights`.
    pub first_weight: usize,
    /// The latest weights, where there are any.
    pub weights: Vec<f64>,
}

impl IncompleteStream {
    /// Begins a stream, or goes on from a state of one with the same plan: estimates of every `step`-th sample, with `errors` their standard
    /// errors too.
    ///
    /// # Errors
    /// If the plan looks at neighbouring windows to choose an order, or there is not the memory.
    pub fn resume(
        plan: Arc<LocalPolynomials>,
        step: usize,
        errors: bool,
        gaps: Option<StreamedGaps>,
        state: IncompleteState,
    ) -> Result<Self, Error> {
        let mut stream = PolynomialStream::resume(Arc::clone(&plan), step, errors, state.samples)?;
        if let Some(gaps) = gaps {
            stream = stream.with_neighbours(reach(&plan, gaps));
        }
        let weights = Retained::new(state.first_weight, state.weights);
        Ok(Self { plan, stream, gaps, weights, around: Default::default(), memory: IncompleteMemory::default() })
    }

    /// The state to resume from.
    #[must_use]
    pub fn state(&self) -> IncompleteState {
        let samples = self.stream.state();
        let (first_weight, weights) = self.weights.from(samples.first);
        IncompleteState { first_weight, weights: weights.to_vec(), samples }
    }

    /// As [`PolynomialStream::delay`].
    #[must_use]
    pub fn delay(&self) -> usize {
        self.stream.delay()
    }

    /// Samples taken in so far.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.stream.samples()
    }

    /// The samples whose estimates are given next, once `count` more have been taken in.
    #[must_use]
    pub fn upcoming(&self, count: usize) -> Range<usize> {
        self.stream.upcoming(count)
    }

    /// The samples whose estimates are given at the end.
    #[must_use]
    pub fn at_end(&self) -> Range<usize> {
        self.stream.at_end()
    }

    /// Takes in samples, and as many weights where there are any, and gives the estimates of [`IncompleteStream::upcoming`]; errors go to
    /// `errors`, one slice a derivative. The elements of the outputs must begin with the first that is given.
    pub fn push(
        &mut self,
        samples: &dyn Samples,
        weights: Option<&dyn Samples>,
        estimates: &mut Estimates<'_>,
        errors: &mut [&mut [f64]],
    ) {
        for from in (0..samples.len()).step_by(PIECE) {
            let piece = Cut { channel: samples, samples: from..samples.len().min(from + PIECE) };
            let ready = self.stream.upcoming(piece.len());
            if let Some(weights) = weights {
                self.weights.read_from(weights, from, piece.len());
            }
            self.stream.push(&piece, estimates, errors);
            self.complete(ready, estimates, errors);
            self.weights.forget_before(self.stream.needed_from());
        }
    }

    /// Ends the stream and gives the estimates of [`IncompleteStream::at_end`]. Where there was no full window they are NaN.
    pub fn finish(&mut self, estimates: &mut Estimates<'_>, errors: &mut [&mut [f64]]) {
        let rest = self.stream.at_end();
        self.stream.finish(estimates, errors);
        self.complete(rest, estimates, errors);
    }

    /// Fits the windows around some samples, whose estimates were given, that lack samples or whose samples have weights.
    fn complete(&mut self, given: Range<usize>, estimates: &mut Estimates<'_>, errors: &mut [&mut [f64]]) {
        let Some(gaps) = self.gaps else { return };
        let grid = estimates.elements;
        let elements = grid.of(given.clone());
        let wanted = |element: usize, status: &[u16]| {
            let is_lost = status[element] & Status::INVALID.bits() != 0;
            if gaps.weighted { gaps.leaves_out || !is_lost } else { is_lost }
        };
        let samples = self.stream.samples();
        if samples < self.plan.options().window_length
            || !elements.clone().any(|element| wanted(element, estimates.status))
        {
            return;
        }
        let reach = reach(&self.plan, gaps);
        let first = given.start.saturating_sub(reach);
        let count = (given.end + reach).min(samples) - first;
        let [values, weights] = &mut self.around;
        values.resize(count, 0.0);
        self.stream.record().read(first, values);
        weights.resize(if gaps.weighted { count } else { 0 }, 0.0);
        self.weights.read(first, weights);
        let weights = gaps.weighted.then_some(&weights[..]);
        let parts = parts_of(values, weights, gaps.longest_gap);
        let record = Incomplete { samples: values, weights, parts: &parts, least: gaps.least };
        let elements: Vec<usize> = elements.filter(|element| wanted(*element, estimates.status)).collect();
        let places: Vec<usize> = elements.iter().map(|element| grid.sample(*element) - first).collect();
        let mut found = vec![None; places.len()];
        self.plan.fit_incomplete(&record, &places, &mut self.memory, &mut found, &|| true);
        for (element, found) in elements.into_iter().zip(found.into_iter().flatten()) {
            put(&found, element, estimates, errors);
        }
    }
}

/// Puts what was found around a sample into its place; a derivative above the order is zero, without an error.
fn put(found: &IncompleteEstimate, element: usize, estimates: &mut Estimates<'_>, errors: &mut [&mut [f64]]) {
    for (values, (value, _)) in estimates.derivatives.iter_mut().zip(&found.derivatives) {
        values[element] = *value;
    }
    for (derivative, (values, (_, error))) in errors.iter_mut().zip(&found.derivatives).enumerate() {
        values[element] = if derivative > found.order { f64::NAN } else { *error };
    }
    estimates.order[element] = u8::try_from(found.order).unwrap_or(u8::MAX);
    estimates.status[element] = found.status.bits();
    estimates.sigma[element] = found.sigma;
}
