//! Local polynomials in every window, of an order chosen in every window: values, derivatives, noise.
//!
//! [`LocalPolynomials`] is the plan: made once for a window length, run over any number of records. [`LocalPolynomials::estimate`] is
//! the one place where samples are walked. It is entered with absolute sample numbers and gives the same bits however a record is
//! cut, since windows are reached from starts that lie on a grid of absolute numbers and every lane keeps to itself.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::basis::Basis;
use crate::criterion::Criterion;
use crate::ends::{End, Ends};
use crate::error::Error;
use crate::output::{Elements, split_off};
use crate::parallel::{self, Piece, Watch};
use crate::samples::Samples;
use crate::simd::Instructions;
use crate::walk::{Engine, Walk};
use crate::window::Window;

/// The highest polynomial order that is offered.
pub const HIGHEST_ORDER: usize = 15;

/// Samples in a piece of work, about: well below 20 ms on any processor, so that a call can be interrupted.
const PIECE: usize = 1 << 14;

/// How the order of a window comes about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The same in every window: the classic filter of Savitzky and Golay.
    Fixed(usize),
    /// The candidate in `0 ..= highest` that minimises a criterion.
    Chosen {
        /// What is minimised.
        criterion: Criterion,
        /// The highest candidate.
        highest: usize,
    },
}

/// What to estimate, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// Samples in a window, `M`.
    pub window_length: usize,
    /// How the order comes about.
    pub order: Order,
    /// Which derivatives are wanted; 0 is the value.
    pub derivatives: Vec<usize>,
    /// Sample period in seconds.
    pub delta: f64,
    /// Whether the noise is wanted too, where the order is fixed. It is always known where the order is chosen.
    pub noise: bool,
    /// Instructions to use.
    pub instructions: Instructions,
}

/// Where estimates are written. An empty slice stands for what is not wanted.
#[derive(Debug)]
pub struct Estimates<'a> {
    /// Which samples the elements of every slice belong to.
    pub elements: Elements,
    /// One slice a derivative, in the order in which [`Options::derivatives`] names them.
    pub derivatives: Vec<&'a mut [f64]>,
    /// Order chosen. Near the ends of a record each derivative may take a lower one.
    pub order: &'a mut [u8],
    /// Bits of [`crate::Status`].
    pub status: &'a mut [u16],
    /// Standard deviation of the noise.
    pub sigma: &'a mut [f64],
}

impl Estimates<'_> {
    /// Cuts off what belongs to the samples before `sample`.
    fn split_off_before(&mut self, sample: usize) -> Self {
        let (elements, count) = (self.elements, self.elements.of(0..sample).len());
        self.elements = elements.from(count);
        Estimates {
            elements,
            derivatives: self.derivatives.iter_mut().map(|values| split_off(values, count)).collect(),
            order: split_off(&mut self.order, count),
            status: split_off(&mut self.status, count),
            sigma: split_off(&mut self.sigma, count),
        }
    }
}

/// The plan for windows of one length.
#[derive(Debug)]
pub struct LocalPolynomials {
    options: Options,
    basis: Basis,
    ends: Ends,
    engine: Box<dyn Walk>,
}

/// What one thread needs to work: made once, used for any number of pieces.
#[derive(Debug)]
pub struct Scratch(crate::walk::Scratch);

impl LocalPolynomials {
    /// Prepares the tables.
    ///
    /// Costs `O(M · D)` with `D` the number of orders.
    ///
    /// # Errors
    /// If the window is shorter than one sample, if an order is higher than [`HIGHEST_ORDER`], or if a fixed order is not determined
    /// by the window.
    pub fn new(options: Options) -> Result<Self, Error> {
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
        let basis = Basis::new(window_length, degrees);
        let residual = options.noise || matches!(options.order, Order::Chosen { .. });
        let engine: Box<dyn Walk> = match (residual, degrees) {
            (true, ..=8) => Box::new(Engine::<8, true>::new(&options, &basis)),
            (true, _) => Box::new(Engine::<16, true>::new(&options, &basis)),
            (false, ..=4) => Box::new(Engine::<4, false>::new(&options, &basis)),
            (false, ..=6) => Box::new(Engine::<6, false>::new(&options, &basis)),
            (false, ..=8) => Box::new(Engine::<8, false>::new(&options, &basis)),
            (false, ..=12) => Box::new(Engine::<12, false>::new(&options, &basis)),
            (false, ..=16) => Box::new(Engine::<16, false>::new(&options, &basis)),
            (false, _) => Box::new(Engine::<20, false>::new(&options, &basis)),
        };
        let ends = Ends::new(&options);
        Ok(Self { options, basis, ends, engine })
    }

    /// What was asked for.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.options
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

    /// Memory for one thread.
    #[must_use]
    pub fn scratch(&self) -> Scratch {
        Scratch(self.engine.scratch())
    }

    /// Windows that are worked on side by side: a record may be cut anywhere, but multiples of this waste nothing.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.engine.block() * self.options.instructions.lanes()
    }

    /// Estimates at the samples `samples` of a record that is at least one window long, with equations (2), (8) and (9).
    ///
    /// Samples nearer to an end than half a window are evaluated off the centre of the first or last full window, each derivative
    /// with the order that has the least estimated squared bias plus variance there. Windows that hold a value that is no number are
    /// NaN, and no others.
    ///
    /// # Errors
    /// If the record is shorter than the window.
    pub fn estimate(
        &self,
        record: &dyn Samples,
        samples: Range<usize>,
        estimates: &mut Estimates<'_>,
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        self.windows(record.len())?;
        let half = self.options.window_length / 2;
        let interior = samples.start.max(half)..samples.end.min(record.len() - half);
        if samples.start < half {
            let wanted = samples.start..samples.end.min(half);
            self.ends.estimate(&self.basis, record, End::First, wanted, estimates);
        }
        if !interior.is_empty() {
            self.estimate_centred(record, interior, estimates, scratch)?;
        }
        if samples.end > record.len() - half {
            let wanted = samples.start.max(record.len() - half)..samples.end;
            self.ends.estimate(&self.basis, record, End::Last, wanted, estimates);
        }
        Ok(())
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
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        let (windows, before) = (self.windows(record.len())?, self.before_centre());
        assert!(before <= samples.start && samples.end <= before + windows, "every window must lie in the record");
        self.engine.walk(record, samples.start - before..samples.end - before, estimates, &mut scratch.0);
        Ok(())
    }

    /// Estimates at all samples of several records, in parallel. Every element of the outputs must belong to a sample.
    ///
    /// The numbers do not depend on the number of workers.
    ///
    /// # Errors
    /// If a record is shorter than the window, or the watch cancels.
    pub fn run(
        &self,
        records: Vec<(&dyn Samples, Estimates<'_>)>,
        ends: bool,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let piece = PIECE.next_multiple_of(self.stride());
        let mut pieces = Vec::new();
        for (record, mut estimates) in records {
            let (windows, before) = (self.windows(record.len())?, self.before_centre());
            let samples = if ends { 0..record.len() } else { before..before + windows };
            let mut first = samples.start;
            while first < samples.end {
                let next = (first.max(before) - before) / piece * piece + piece + before;
                let end = if next >= before + windows { samples.end } else { next };
                let part = estimates.split_off_before(end);
                pieces.push(Piece { size: end - first, content: (record, first..end, part) });
                first = end;
            }
        }
        let work = |(record, samples, mut estimates): (&dyn Samples, Range<usize>, Estimates<'_>),
                    scratch: &mut Scratch| {
            let outcome = if ends {
                self.estimate(record, samples, &mut estimates, scratch)
            } else {
                self.estimate_centred(record, samples, &mut estimates, scratch)
            };
            debug_assert_eq!(outcome, Ok(()), "the lengths of all records were checked");
        };
        parallel::run(pieces, workers, || self.scratch(), work, watch)
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
        let mut samples = vec![0.0; self.options.window_length];
        record.read(window, &mut samples);
        let Some(window) = Window::project(&self.basis, &samples) else {
            return Ok(vec![f64::NAN; self.orders()]);
        };
        let score = |(order, residual): (usize, &f64)| {
            criterion.score(residual.max(window.floor), order, self.options.window_length)
        };
        Ok(window.residuals.iter().enumerate().map(score).collect())
    }

    /// By what the noise standard deviation is multiplied to give the standard error of a derivative at the centre, by order: element
    /// `d · orders + n` belongs to the `d`-th derivative asked for and order `n`.
    #[must_use]
    pub fn gains(&self) -> Vec<f64> {
        self.engine.functionals().iter().flat_map(|functional| functional.gains(self.orders())).collect()
    }

    /// Standard errors of every derivative near one end, where orders and gains differ from sample to sample: one row a derivative,
    /// in the order of the samples.
    ///
    /// # Errors
    /// If the record is shorter than the window.
    pub fn end_errors(&self, record: &dyn Samples, end: End) -> Result<Vec<Vec<f64>>, Error> {
        self.windows(record.len())?;
        Ok(self.ends.errors(&self.basis, record, end))
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
