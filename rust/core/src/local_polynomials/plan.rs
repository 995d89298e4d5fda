//! Local polynomials in every window, of an order chosen in every window: values, derivatives, noise.
//!
//! [`LocalPolynomials`] is the plan: made once for a window length, run over any number of records (`records.rs`). Its engine is the one place
//! where samples are walked. [`LocalPolynomials::estimate`] enters it with absolute sample numbers and gives the same bits however a record is
//! cut, since windows are reached from starts that lie on a grid of absolute numbers and every lane keeps to itself.

use std::ops::Range;
use std::sync::OnceLock;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{GoOn, Watch};
use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::boundary::{Edge, End, Ends};
use crate::local_polynomials::criterion::Criterion;
use crate::local_polynomials::engine::{Walk, engine};
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::evaluate::Finish;
use crate::local_polynomials::options::{HIGHEST_ORDER, Order, PolynomialOptions, Selection};
use crate::local_polynomials::order_shares::{SelectionScratch, Selector, Wanted};
use crate::local_polynomials::pieces::PIECE;
use crate::local_polynomials::side_by_side::SideBySide;
use crate::local_polynomials::single_window::Window;
use crate::record::samples::Samples;
use crate::simd::vectors::MOST_LANES;

/// The plan for windows of one length.
#[derive(Debug)]
pub struct LocalPolynomials {
    options: PolynomialOptions,
    basis: Basis,
    pub(crate) ends: Ends,
    pub(crate) engine: Box<dyn Walk>,
    /// Made when it is first needed.
    selector: OnceLock<Option<Selector>>,
}

/// Memory of one thread: made once, used for any number of pieces.
#[derive(Debug)]
pub struct PolynomialScratch {
    pub(crate) walk: crate::local_polynomials::engine::EngineScratch,
    selection: Option<SelectionScratch>,
    /// Made when it is first needed.
    pub(crate) beside: Option<SideBySide>,
}

impl LocalPolynomials {
    /// Prepares the tables.
    ///
    /// Costs `O(M · D)` with `D` the number of orders.
    ///
    /// # Errors
    /// If the window is shorter than one sample, if an order is higher than [`HIGHEST_ORDER`], if a fixed order is not determined
    /// by the window, or if there is not the memory.
    pub fn new(options: PolynomialOptions) -> Result<Self, Error> {
        Self::watched(options, &mut |_, _| true)
    }

    /// The same, watched: the tables of a window of millions of samples take seconds.
    ///
    /// # Errors
    /// Likewise, or if the watch cancels.
    pub fn watched(options: PolynomialOptions, watch: &mut Watch<'_>) -> Result<Self, Error> {
        let window_length = options.window_length;
        if window_length == 0 {
            return Err(Error::WindowTooShort { window_length, least: 1 });
        }
        let (name, order) = match options.order {
            Order::Fixed(order) => ("order", order),
            Order::Chosen { highest, .. } => ("max_order", highest),
        };
        if order > HIGHEST_ORDER {
            return Err(Error::OrderTooHigh { name, order, most: HIGHEST_ORDER });
        }
        let degrees = match options.order {
            Order::Fixed(order) if order >= window_length => {
                return Err(Error::OrderNotDetermined { order, window_length });
            }
            Order::Fixed(order) => order + 1,
            Order::Chosen { criterion, highest } => {
                (0..=highest).take_while(|&n| criterion.penalty(n, window_length).is_some()).count()
            }
        };
        if degrees == 0 {
            return Err(Error::WindowTooShort { window_length, least: 4 });
        }
        // Both tables of half a window: of the basis, and for the kernels.
        memory::ask_for_numbers(window_length.saturating_mul(MOST_DEGREES))?;
        let basis = Basis::watched(window_length, degrees, watch)?;
        let residual = options.noise || matches!(options.order, Order::Chosen { .. });
        let engine = engine(&basis, Finish::new(&options, &basis), residual, options.instructions, watch)?;
        let ends = Ends::new(&options, &basis);
        Ok(Self { options, basis, ends, engine, selector: OnceLock::new() })
    }

    /// The options that it was made with.
    #[must_use]
    pub fn options(&self) -> &PolynomialOptions {
        &self.options
    }

    /// The polynomials of a window.
    pub(crate) fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Number of orders in play: one more than the highest.
    #[must_use]
    pub fn orders(&self) -> usize {
        self.basis.degrees()
    }

    /// Samples of a window before the one at its centre; where that lies between two samples, before the first of them.
    #[must_use]
    pub fn before_centre(&self) -> usize {
        (self.options.window_length - 1) / 2
    }

    /// Samples after one that settle its estimates, whatever follows: the rest of its window, and as many as its window may lie before
    /// the start that it is reached from. Where neighbours choose the order there is no such number.
    #[must_use]
    pub fn lookahead(&self) -> usize {
        self.options.window_length - 1 - self.before_centre() + self.engine.backward()
    }

    /// How many of a record's estimates are settled by its first `samples` samples, in steps of half a span: a span costs its start
    /// once for each half.
    #[must_use]
    pub fn settled(&self, samples: usize) -> usize {
        let Some(last) = samples.checked_sub(self.options.window_length) else { return 0 };
        let half = self.engine.backward();
        // The first window settles the samples before its centre.
        self.before_centre() + last.checked_div(half).map_or(last + 1, |halves| halves * half)
    }

    /// The first sample that estimates of a sample and those after it read.
    #[must_use]
    pub fn reads_from(&self, sample: usize) -> usize {
        // A span's first window, or one half of a span before it where the start of the last one moves.
        sample.saturating_sub(self.before_centre() + self.engine.block() + self.engine.backward())
    }

    /// Memory for one thread.
    #[must_use]
    pub fn scratch(&self) -> PolynomialScratch {
        self.scratch_for(Wanted::Derivatives)
    }

    pub(crate) fn scratch_for(&self, wanted: Wanted) -> PolynomialScratch {
        let selection = self.selector(wanted).map(Selector::scratch);
        PolynomialScratch { walk: self.engine.scratch(), selection, beside: None }
    }

    /// What looks at all orders, where it is needed: standard errors say how far the orders disagree.
    pub(crate) fn selector(&self, wanted: Wanted) -> Option<&Selector> {
        if wanted == Wanted::Derivatives && self.options.selection != Selection::Pooled {
            return None;
        }
        self.selector.get_or_init(|| Selector::new(&self.options, &self.basis)).as_ref()
    }

    /// Number of windows computed side by side. A record may be cut anywhere, but multiples of this waste no work.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.engine.block() * self.options.instructions.lanes()
    }

    /// Standard errors in the place of derivatives, as [`LocalPolynomials::errors`] gives them, at some samples of a record that is at least
    /// one window long, on memory made by [`LocalPolynomials::scratch_of_errors`].
    ///
    /// # Errors
    /// If the record is shorter than the window.
    pub fn errors_at(
        &self,
        record: &dyn Samples,
        samples: Range<usize>,
        estimates: &mut Estimates<'_>,
        scratch: &mut PolynomialScratch,
    ) -> Result<(), Error> {
        self.everywhere(record, samples, (Wanted::Errors, &|| true), estimates, scratch)
    }

    /// Memory for one thread that computes standard errors.
    #[must_use]
    pub fn scratch_of_errors(&self) -> PolynomialScratch {
        self.scratch_for(Wanted::Errors)
    }

    /// Estimates at the samples `samples` of a record that is at least one window long, with equations (2), (8) and (9).
    ///
    /// Samples nearer to an end than half a window are evaluated off the centre of the first or last full window, each derivative
    /// with the order that has the least estimated squared bias plus variance there. Windows with an unusable value are
    /// NaN, and no others.
    ///
    /// # Errors
    /// If the record is shorter than the window.
    pub fn estimate(
        &self,
        record: &dyn Samples,
        samples: Range<usize>,
        estimates: &mut Estimates<'_>,
        scratch: &mut PolynomialScratch,
    ) -> Result<(), Error> {
        self.everywhere(record, samples, (Wanted::Derivatives, &|| true), estimates, scratch)
    }

    /// The same for samples whose full window lies in the record: those from [`LocalPolynomials::before_centre`] on, as many as the
    /// record has windows.
    ///
    /// # Errors
    /// If the record is shorter than the window.
    ///
    /// # Panics
    /// If a sample's window does not lie in the record.
    pub fn estimate_centred(
        &self,
        record: &dyn Samples,
        samples: Range<usize>,
        estimates: &mut Estimates<'_>,
        scratch: &mut PolynomialScratch,
    ) -> Result<(), Error> {
        let (windows, before) = (self.windows(record.len())?, self.before_centre());
        assert!(before <= samples.start && samples.end <= before + windows, "every window must lie in the record");
        self.centred(record, samples, Wanted::Derivatives, estimates, scratch);
        Ok(())
    }

    /// Asks repeatedly whether to go on; after `false` what was estimated is incomplete.
    pub(crate) fn everywhere(
        &self,
        record: &dyn Samples,
        samples: Range<usize>,
        (wanted, go_on): (Wanted, &GoOn<'_>),
        estimates: &mut Estimates<'_>,
        scratch: &mut PolynomialScratch,
    ) -> Result<(), Error> {
        let (windows, half) = (self.windows(record.len())?, self.options.window_length / 2);
        let (start, end) = (half, record.len() - half);
        if samples.start < start {
            let orders = self.orders_at(record, 0, scratch);
            let edge = Edge { end: End::First, samples: samples.start..samples.end.min(start), wanted, go_on };
            self.ends.estimate(&self.basis, record, &edge, orders, estimates);
        }
        let interior = samples.start.max(start)..samples.end.min(end);
        if !interior.is_empty() && go_on() {
            self.centred(record, interior, wanted, estimates, scratch);
        }
        if samples.end > end && go_on() {
            let orders = self.orders_at(record, windows - 1, scratch);
            let edge = Edge { end: End::Last, samples: samples.start.max(end)..samples.end, wanted, go_on };
            self.ends.estimate(&self.basis, record, &edge, orders, estimates);
        }
        Ok(())
    }

    fn centred(
        &self,
        record: &dyn Samples,
        samples: Range<usize>,
        wanted: Wanted,
        estimates: &mut Estimates<'_>,
        scratch: &mut PolynomialScratch,
    ) {
        let before = self.before_centre();
        let windows = samples.start - before..samples.end - before;
        if let (Some(selector), Some(scratch)) = (self.selector(wanted), &mut scratch.selection) {
            selector.estimate(record, windows, wanted, estimates, scratch);
            return;
        }
        self.engine.walk(record, windows, estimates, &mut scratch.walk);
        if wanted == Wanted::Errors {
            let elements = estimates.elements.of(samples);
            for (functional, values) in self.engine.functionals().iter().zip(&mut estimates.derivatives) {
                let gains = functional.gains(self.orders());
                for element in elements.clone() {
                    values[element] = gains[usize::from(estimates.order[element])] * estimates.sigma[element];
                }
            }
        }
    }

    /// The orders that share in a window, where it does not know by itself.
    fn orders_at(
        &self,
        record: &dyn Samples,
        window: usize,
        scratch: &mut PolynomialScratch,
    ) -> Option<Vec<(usize, f64)>> {
        let (selector, scratch) = (self.selector(Wanted::Derivatives)?, scratch.selection.as_mut()?);
        Some(selector.orders(record, window, scratch))
    }

    /// Asks for what the scratch memory of so many threads will take.
    pub(crate) fn ask_for_scratch(&self, wanted: Wanted, threads: usize) -> Result<(), Error> {
        let window = self.options.window_length;
        // A run's samples as they are and side by side, those of a window at an end, and short records in the same two ways.
        let run = window.saturating_mul(3 + 2 * MOST_LANES).saturating_add(4 * PIECE + 4 * self.stride());
        // By order the coefficients, residuals and shares of the windows that are looked at together, and sums over their neighbours.
        let looked =
            self.selector(wanted).map_or(0, |selector| (2 * window).saturating_add(PIECE.max(selector.least_piece())));
        let numbers = run.saturating_add(looked.saturating_mul(4 * self.orders() + 8));
        memory::ask_for_numbers(numbers.saturating_mul(threads))
    }

    /// The criterion of every order in the window around a sample, equation (8); infinite for an order that is no candidate. Near an
    /// end that is the first or last full window.
    ///
    /// # Errors
    /// If the record is shorter than the window.
    pub fn scores(&self, record: &dyn Samples, sample: usize) -> Result<Vec<f64>, Error> {
        let windows = self.windows(record.len())?;
        let window = sample.saturating_sub(self.before_centre()).min(windows - 1);
        let criterion = match self.options.order {
            Order::Fixed(_) => Criterion::default(),
            Order::Chosen { criterion, .. } => criterion,
        };
        memory::ask_for_numbers(self.options.window_length)?;
        let mut samples = vec![0.0; self.options.window_length];
        record.read(window, &mut samples);
        let Some(window) = Window::project(&self.basis, &samples, self.options.quantisation_floor()) else {
            return Ok(vec![f64::NAN; self.orders()]);
        };
        let score = |(order, residual): (usize, &f64)| {
            criterion.score(residual.max(window.floor), order, self.options.window_length)
        };
        Ok(window.residuals.iter().enumerate().map(score).collect())
    }

    /// Number of full windows in a record.
    pub(crate) fn windows(&self, samples: usize) -> Result<usize, Error> {
        let window_length = self.options.window_length;
        (samples + 1)
            .checked_sub(window_length)
            .filter(|&windows| windows > 0)
            .ok_or(Error::WindowTooLong { window_length, samples })
    }
}
