//! Local polynomials of a signal that goes on: the batch's numbers, each a fixed number of samples after its own.

use std::ops::Range;
use std::sync::Arc;

use crate::error::Error;
use crate::lanes::output::Elements;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Order, Selection};
use crate::local_polynomials::plan::{LocalPolynomials, PolynomialScratch};
use crate::record::retained::Retained;
use crate::record::samples::Samples;

/// Samples that are taken in at a time, about: what is held beyond what windows need.
pub(crate) const PIECE: usize = 1 << 14;

/// Estimates of elements in a row: those from `given` on are still to be given.
#[derive(Debug, Default)]
struct Made {
    /// Derivatives, then their errors where wanted, then the noise.
    numbers: Vec<Vec<f64>>,
    order: Vec<u8>,
    status: Vec<u16>,
    given: usize,
}

/// Derivatives of a signal that comes piece by piece.
///
/// Pieces may have any length; every estimate has the bits that [`LocalPolynomials::run`] gives it, since spans lie at the same absolute
/// sample numbers. Work is done for half a span at a time, and estimates are given one by one, [`PolynomialStream::delay`] samples late.
#[derive(Debug)]
pub struct PolynomialStream {
    plan: Arc<LocalPolynomials>,
    step: usize,
    errors: bool,
    /// Neighbours on either side of a sample that must be there when its estimate is given.
    neighbours: usize,
    record: Retained,
    /// Samples whose estimates were made, and those that were given.
    made: usize,
    given: usize,
    ended: bool,
    found: Made,
    scratch: PolynomialScratch,
    scratch_of_errors: Option<PolynomialScratch>,
}

/// What a stream of local polynomials resumes from.
#[derive(Clone, Debug, Default)]
pub struct PolynomialState {
    /// Number of the first sample in `samples`.
    pub first: usize,
    /// The latest samples.
    pub samples: Vec<f64>,
    /// Samples whose estimates were given.
    pub given: usize,
    /// Whether the stream has ended.
    pub ended: bool,
}

impl PolynomialStream {
    /// Begins a stream: estimates of every `step`-th sample, with `errors` their standard errors too.
    ///
    /// # Errors
    /// If the plan looks at neighbouring windows to choose an order, or there is not the memory.
    pub fn new(plan: Arc<LocalPolynomials>, step: usize, errors: bool) -> Result<Self, Error> {
        Self::resume(plan, step, errors, PolynomialState::default())
    }

    /// Goes on from a state of a stream with the same plan.
    ///
    /// # Errors
    /// As [`PolynomialStream::new`].
    pub fn resume(
        plan: Arc<LocalPolynomials>,
        step: usize,
        errors: bool,
        state: PolynomialState,
    ) -> Result<Self, Error> {
        if plan.options().selection == Selection::Pooled && matches!(plan.options().order, Order::Chosen { .. }) {
            return Err(Error::NotInAStream { what: "selection=\"pooled\"", cure: "use \"window\" or \"average\"" });
        }
        let (scratch, scratch_of_errors) = (plan.scratch(), errors.then(|| plan.scratch_of_errors()));
        let numbers = plan.options().derivatives.len() * (1 + usize::from(errors)) + 1;
        let mut stream = Self {
            step,
            errors,
            neighbours: 0,
            record: Retained::new(state.first, state.samples),
            made: state.given,
            given: state.given,
            ended: state.ended,
            found: Made { numbers: vec![Vec::new(); numbers], ..Made::default() },
            scratch,
            scratch_of_errors,
            plan,
        };
        if !stream.ended {
            stream.make(stream.plan.settled(stream.record.len()).max(stream.made));
        }
        Ok(stream)
    }

    /// The same with neighbours of samples that must be there when their estimates are given, which come later for it.
    pub(crate) fn with_neighbours(mut self, neighbours: usize) -> Self {
        self.neighbours = neighbours;
        self
    }

    /// The samples that are held: those around the latest that were given are among them.
    pub(crate) fn record(&self) -> &Retained {
        &self.record
    }

    /// The first sample that is still needed.
    pub(crate) fn needed_from(&self) -> usize {
        self.plan.reads_from(self.given).min(self.given.saturating_sub(self.neighbours))
    }

    /// The state to resume from.
    #[must_use]
    pub fn state(&self) -> PolynomialState {
        let (first, samples) = self.record.from(self.needed_from());
        PolynomialState { first, samples: samples.to_vec(), given: self.given, ended: self.ended }
    }

    /// Samples from one to its estimate: the estimate of a sample is given with the sample so many later, and none before the first window
    /// is full.
    #[must_use]
    pub fn delay(&self) -> usize {
        self.plan.lookahead().max(self.neighbours)
    }

    /// Samples taken in so far.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.record.len()
    }

    /// The samples whose estimates are given next, once `count` more have been taken in.
    #[must_use]
    pub fn upcoming(&self, count: usize) -> Range<usize> {
        let samples = self.record.len() + count;
        let ready = if samples < self.plan.options().window_length { 0 } else { samples.saturating_sub(self.delay()) };
        self.given..ready.max(self.given)
    }

    /// The samples whose estimates are given at the end.
    #[must_use]
    pub fn at_end(&self) -> Range<usize> {
        self.given..if self.ended { self.given } else { self.record.len() }
    }

    /// Takes in samples and gives the estimates of [`PolynomialStream::upcoming`]; errors go to `errors`, one slice a derivative.
    ///
    /// The elements of the outputs must begin with the first that is given.
    pub fn push(&mut self, samples: &dyn Samples, estimates: &mut Estimates<'_>, errors: &mut [&mut [f64]]) {
        let mut from = 0;
        while from < samples.len() {
            let count = PIECE.min(samples.len() - from);
            self.record.forget_before(self.needed_from());
            self.record.read_from(samples, from, count);
            from += count;
            let settled = self.plan.settled(self.record.len());
            if settled > self.made {
                self.make(settled);
            }
            let ready = self.upcoming(0);
            self.give(ready, estimates, errors);
        }
    }

    /// Ends the stream and gives the estimates of [`PolynomialStream::at_end`]. Where there was no full window they are NaN.
    pub fn finish(&mut self, estimates: &mut Estimates<'_>, errors: &mut [&mut [f64]]) {
        let rest = self.at_end();
        if !self.ended {
            self.make(rest.end);
            self.ended = true;
        }
        self.give(rest, estimates, errors);
    }

    /// Makes estimates up to a sample.
    fn make(&mut self, end: usize) {
        let Self { found, record, plan, .. } = self;
        let grid = Elements { first: 0, step: self.step };
        let new = grid.of(self.made..end);
        let elements = Elements { first: grid.sample(new.start), step: self.step };
        let samples = self.made..end;
        self.made = end;
        if new.is_empty() {
            return;
        }
        found.forget();
        let held = found.order.len();
        found.grow(new.len());
        let derivatives = plan.options().derivatives.len();
        let (numbers, sigma) = found.numbers.split_at_mut(derivatives * (1 + usize::from(self.errors)));
        let (values, errors) = numbers.split_at_mut(derivatives);
        let mut estimates = Estimates {
            elements,
            derivatives: values.iter_mut().map(|values| &mut values[held..]).collect(),
            order: &mut found.order[held..],
            status: &mut found.status[held..],
            sigma: &mut sigma[0][held..],
        };
        if plan.estimate(record, samples.clone(), &mut estimates, &mut self.scratch).is_err() {
            // There is no full window: nothing is known.
            (0..new.len()).for_each(|element| estimates.nothing(element));
            for errors in errors {
                errors[held..].fill(f64::NAN);
            }
            return;
        }
        if let Some(scratch) = &mut self.scratch_of_errors {
            // What is said of a window beside its errors was said above.
            let count = new.len();
            let (mut order, mut status, mut sigma) = (vec![0; count], vec![0; count], vec![0.0; count]);
            let mut estimates = Estimates {
                elements,
                derivatives: errors.iter_mut().map(|values| &mut values[held..]).collect(),
                order: &mut order,
                status: &mut status,
                sigma: &mut sigma,
            };
            // The record is long enough, as above.
            let _ = plan.errors_at(record, samples, &mut estimates, scratch);
        }
    }

    /// Gives the estimates of some samples, which were made.
    fn give(&mut self, samples: Range<usize>, estimates: &mut Estimates<'_>, errors: &mut [&mut [f64]]) {
        let count = (Elements { first: 0, step: self.step }).of(samples.clone()).len();
        let to = estimates.elements.of(samples.clone());
        let from = self.found.given..self.found.given + count;
        let mut numbers = self.found.numbers.iter().map(|values| &values[from.clone()]);
        for (output, values) in estimates.derivatives.iter_mut().zip(&mut numbers) {
            copy(output, to.clone(), values);
        }
        if self.errors {
            errors.iter_mut().zip(&mut numbers).for_each(|(output, values)| copy(output, to.clone(), values));
        }
        numbers.for_each(|sigma| copy(estimates.sigma, to.clone(), sigma));
        copy(estimates.order, to.clone(), &self.found.order[from.clone()]);
        copy(estimates.status, to, &self.found.status[from.clone()]);
        self.found.given = from.end;
        self.given = samples.end;
    }
}

impl Made {
    /// Drops what was given.
    fn forget(&mut self) {
        let given = std::mem::take(&mut self.given);
        self.numbers.iter_mut().for_each(|values| drop(values.drain(..given)));
        self.order.drain(..given);
        self.status.drain(..given);
    }

    /// Makes room for more elements.
    fn grow(&mut self, count: usize) {
        let length = self.order.len() + count;
        self.numbers.iter_mut().for_each(|values| values.resize(length, 0.0));
        self.order.resize(length, 0);
        self.status.resize(length, 0);
    }
}

/// Copies values to an output that may not be wanted.
fn copy<T: Copy>(output: &mut [T], elements: Range<usize>, values: &[T]) {
    if !output.is_empty() {
        output[elements].copy_from_slice(values);
    }
}
