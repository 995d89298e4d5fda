//! Windowed parameters in strong form of a recording that goes on: the paper's method, sample by sample.

use std::ops::Range;
use std::sync::Arc;

use crate::equation::motion::{Coefficient, Measured, Motion, Term};
use crate::equation::terms::BuiltInTerm;
use crate::error::Error;
use crate::identify::strong::beside_gaps::{BesideGaps, reach};
use crate::identify::strong::scatter::Scattering;
use crate::identify::strong::streaming::equations;
use crate::lanes::output::Elements;
use crate::least_squares::plan::{Regressions, RollingLeastSquares};
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::retained::Retained;
use crate::record::samples::Samples;
use crate::regression::limits::HARDLY_TOLD_APART;
use crate::status::Status;
use crate::stream::polynomials::{PIECE, PolynomialState, PolynomialStream};
use crate::stream::rolling::{RollingState, RollingStream};

/// The equation of motion of a stream.
#[derive(Clone, Debug, Default)]
pub struct StreamedMotion {
    /// Inertia, damping and stiffness where they are known; zero leaves one out.
    pub known: [Option<f64>; 3],
    /// Terms with unknown factors.
    pub terms: Vec<&'static BuiltInTerm>,
}

impl StreamedMotion {
    /// Number of unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.known.iter().filter(|known| known.is_none()).count() + self.terms.len()
    }

    /// The equation with a torque.
    pub(crate) fn with<'a>(&self, torque: &'a dyn Samples) -> Motion<'a> {
        Motion {
            angle: torque,
            measured: Measured::default(),
            torque,
            coefficients: self.known.map(|known| known.map_or(Coefficient::Unknown, Coefficient::Number)),
            terms: self.terms.iter().copied().map(Term::BuiltIn).collect(),
        }
    }
}

/// Where the numbers of a piece go: one element for every wanted sample that is given. `regressions` need no covariances.
#[derive(Debug)]
pub struct Parameters<'a> {
    /// Parameters, standard errors, deviations of residuals, condition and status.
    pub regressions: Regressions<'a>,
    /// Order of the polynomial around each sample.
    pub order: &'a mut [u8],
}

/// What is done about samples that are missing, or count more or less than others.
#[derive(Clone, Copy, Debug, Default)]
pub struct StreamedSamples {
    /// Missing samples are left out, rather than spoil their windows.
    pub leaves_out: bool,
    /// Every sample comes with a weight: one over the variance of its noise, relative to the others. Samples of weight zero must be missing.
    pub weighted: bool,
}

impl StreamedSamples {
    /// Whether windows that lack samples are fitted on what is there.
    fn fits_beside_gaps(self) -> bool {
        self.leaves_out || self.weighted
    }
}

/// The next samples of a stream.
#[derive(Clone, Copy, Debug)]
pub struct NextSamples<'a> {
    /// All of the same length.
    pub angle: &'a [f64],
    /// In the unit of the equation.
    pub torque: &'a [f64],
    /// Where the stream has weights.
    pub weights: Option<&'a [f64]>,
}

impl<'a> NextSamples<'a> {
    /// Pieces of them.
    pub(crate) fn pieces(self) -> impl Iterator<Item = NextSamples<'a>> {
        (0..self.angle.len()).step_by(PIECE).map(move |first| {
            let piece = |channel: &'a [f64]| &channel[first..channel.len().min(first + PIECE)];
            NextSamples { angle: piece(self.angle), torque: piece(self.torque), weights: self.weights.map(piece) }
        })
    }
}

/// Rows of a recording that comes piece by piece: its angle differentiated, the equation of motion at every sample.
#[derive(Debug)]
pub(crate) struct StreamedRows {
    derivatives_of: Arc<LocalPolynomials>,
    motion: StreamedMotion,
    samples: StreamedSamples,
    pub(crate) angle: PolynomialStream,
    pub(crate) torque: Retained,
    /// Of the latest samples, where they have any.
    weights: Retained,
    beside_gaps: BesideGaps,
    /// Of the latest samples, until their windows are given.
    pub(crate) marks: Marks,
    derivatives: [Vec<f64>; 3],
    known: Vec<f64>,
    /// Unknowns, then the right-hand side.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Of the rows in `columns`, where there are any.
    pub(crate) row_weights: Vec<f64>,
}

/// Orders and flags of the latest samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct Marks {
    first: usize,
    order: Vec<u8>,
    status: Vec<u16>,
}

impl Marks {
    /// Adds orders and flags to the elements of some samples, and forgets samples before the last of them.
    pub(crate) fn give(&mut self, samples: Range<usize>, elements: Elements, order: &mut [u8], status: &mut [u16]) {
        for element in elements.of(samples.clone()) {
            let place = elements.sample(element) - self.first;
            if let Some(order) = order.get_mut(element) {
                *order = self.order[place];
            }
            if let Some(status) = status.get_mut(element) {
                *status |= self.status[place] & !Status::INVALID.bits();
            }
        }
        let gone = samples.end.saturating_sub(self.first).min(self.order.len());
        if 2 * gone > self.order.len() {
            self.order.drain(..gone);
            self.status.drain(..gone);
            self.first += gone;
        }
    }

    /// What it resumes from, as numbers: the first sample, then order and flags by turns.
    fn state(&self, sample: usize) -> Vec<f64> {
        let gone = sample.saturating_sub(self.first).min(self.order.len());
        let pairs = self.order[gone..].iter().zip(&self.status[gone..]);
        let numbers = pairs.flat_map(|(order, status)| [f64::from(*order), f64::from(*status)]);
        std::iter::once((self.first + gone) as f64).chain(numbers).collect()
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers, as they were stored")]
    fn resume(numbers: &[f64]) -> Self {
        let Some((first, pairs)) = numbers.split_first() else { return Self::default() };
        Self {
            first: *first as usize,
            order: pairs.iter().step_by(2).map(|order| *order as u8).collect(),
            status: pairs.iter().skip(1).step_by(2).map(|status| *status as u16).collect(),
        }
    }
}

impl StreamedRows {
    pub(crate) fn resume(
        derivatives: Arc<LocalPolynomials>,
        motion: StreamedMotion,
        samples: StreamedSamples,
        state: &RowsState,
    ) -> Result<Self, Error> {
        let columns = vec![Vec::new(); motion.unknowns() + 1];
        let neighbours = if samples.fits_beside_gaps() { reach(&derivatives) } else { 0 };
        let angle = PolynomialStream::resume(Arc::clone(&derivatives), 1, false, state.angle.clone())?;
        Ok(Self {
            derivatives_of: derivatives,
            motion,
            samples,
            angle: angle.with_neighbours(neighbours),
            torque: Retained::new(state.first, state.torque.clone()),
            weights: Retained::new(state.first_weight, state.weights.clone()),
            beside_gaps: BesideGaps::default(),
            row_weights: Vec::new(),
            marks: Marks::resume(&state.marks),
            derivatives: Default::default(),
            known: Vec::new(),
            columns,
        })
    }

    /// What it resumes from, where windows before `given` were given.
    pub(crate) fn state(&self, given: usize) -> RowsState {
        let next = self.angle.at_end().start;
        let (first, torque) = self.torque.from(next);
        let (first_weight, weights) = self.weights.from(self.weights_from(next));
        RowsState {
            angle: self.angle.state(),
            first,
            torque: torque.to_vec(),
            first_weight,
            weights: weights.to_vec(),
            marks: self.marks.state(given),
        }
    }

    /// The columns of the rows, with the weights where there are any.
    fn all_columns(&self) -> impl Iterator<Item = &[f64]> {
        let weights = self.samples.weighted.then_some(&self.row_weights);
        self.columns.iter().chain(weights).map(Vec::as_slice)
    }

    /// The first weight that rows from one on need.
    fn weights_from(&self, row: usize) -> usize {
        row.saturating_sub(reach(&self.derivatives_of))
    }

    /// Takes in a piece, or ends where there is none. Returns the samples whose rows are in `columns` now.
    pub(crate) fn take(&mut self, piece: Option<NextSamples<'_>>) -> Range<usize> {
        if let Some(NextSamples { torque, weights, .. }) = piece {
            self.torque.read_from(&torque, 0, torque.len());
            if let Some(weights) = weights {
                self.weights.read_from(&weights, 0, weights.len());
            }
        }
        let ready = piece.map_or_else(|| self.angle.at_end(), |piece| self.angle.upcoming(piece.angle.len()));
        let motion = self.motion.with(&self.torque);
        motion.take_back(&mut self.derivatives, &mut self.columns);
        self.derivatives.iter_mut().for_each(|derivative| derivative.resize(ready.len(), 0.0));
        let held = self.marks.order.len();
        self.marks.order.resize(held + ready.len(), 0);
        self.marks.status.resize(held + ready.len(), 0);
        let mut estimates = Estimates {
            elements: Elements { first: ready.start, step: 1 },
            derivatives: self.derivatives.iter_mut().map(Vec::as_mut_slice).collect(),
            order: &mut self.marks.order[held..],
            status: &mut self.marks.status[held..],
            sigma: &mut [],
        };
        match piece {
            Some(NextSamples { angle, .. }) => self.angle.push(&angle, &mut estimates, &mut []),
            None => self.angle.finish(&mut estimates, &mut []),
        }
        let StreamedSamples { leaves_out, weighted } = self.samples;
        if self.samples.fits_beside_gaps() && self.angle.samples() >= self.derivatives_of.options().window_length {
            // As the batch has it.
            let weights = (!leaves_out).then_some(&self.weights as &dyn Samples);
            let channels = (self.angle.record() as &dyn Samples, weights);
            self.beside_gaps.fit(&self.derivatives_of, channels, ready.clone(), &mut estimates, &|| true);
        }
        if weighted {
            self.row_weights.resize(ready.len(), 0.0);
            self.weights.read(ready.start, &mut self.row_weights);
        }
        motion.rows(ready.start, &mut self.derivatives, &mut self.known, &mut self.columns);
        self.torque.forget_before(ready.end);
        self.weights.forget_before(self.weights_from(ready.end));
        ready
    }
}

/// What rows resume from.
#[derive(Clone, Debug, Default)]
pub struct RowsState {
    /// The angle.
    pub angle: PolynomialState,
    /// Number of the first sample in `torque`.
    pub first: usize,
    /// The latest samples of the torque.
    pub torque: Vec<f64>,
    /// Number of the first sample in `weights`.
    pub first_weight: usize,
    /// The latest weights, where there are any.
    pub weights: Vec<f64>,
    /// Orders and flags of the latest samples.
    pub marks: Vec<f64>,
}

/// Parameters in a window around every sample, as samples come.
///
/// Pieces may have any length; values have the bits that [`crate::identify::identify_all`] gives them. Standard errors are those of ordinary
/// least squares times the scatter of windows so far, or times given factors.
#[derive(Debug)]
pub struct WindowedStream {
    rows: StreamedRows,
    windows: RollingStream,
    step: usize,
    factors: Option<Vec<f64>>,
    scattering: Scattering,
}

/// What a stream of windowed parameters resumes from.
#[derive(Clone, Debug, Default)]
pub struct WindowedState {
    /// Angle, torque, orders.
    pub rows: RowsState,
    /// Rows of the equation.
    pub windows: RollingState,
    /// The next window that is compared, how many until factors change, and what was compared.
    pub scatter: Option<(usize, usize, Vec<f64>)>,
}

impl WindowedStream {
    /// Begins a stream, or goes on from a state of one with the same settings. `derivatives` must be a plan for the value and the first two
    /// derivatives, `factors` what standard errors of ordinary least squares are multiplied by, where that is known.
    ///
    /// # Errors
    /// If windows are too short, the plan looks at neighbouring windows, or there is not the memory.
    pub fn resume(
        derivatives: Arc<LocalPolynomials>,
        regression_window: usize,
        (motion, samples): (StreamedMotion, StreamedSamples),
        step: usize,
        factors: Option<Vec<f64>>,
        state: WindowedState,
    ) -> Result<Self, Error> {
        let (unknowns, instructions) = (motion.unknowns(), derivatives.options().instructions);
        let plan =
            RollingLeastSquares::new(regression_window, unknowns, 1, Vec::new(), HARDLY_TOLD_APART, instructions)?;
        let plan = plan.of_equations(samples.leaves_out);
        let mut scattering = Scattering::new(&derivatives, regression_window, unknowns);
        if let Some((next, patience, numbers)) = &state.scatter {
            scattering.resume((*next, *patience, numbers));
        }
        let first = derivatives.before_centre();
        let windows = RollingStream::with_weights(plan, step, samples.weighted, state.windows)?;
        Ok(Self {
            rows: StreamedRows::resume(derivatives, motion, samples, &state.rows)?,
            windows: windows.with_equations_from(first),
            step,
            factors,
            scattering,
        })
    }

    /// The state to resume from.
    #[must_use]
    pub fn state(&self) -> WindowedState {
        let windows = self.windows.state();
        WindowedState { rows: self.rows.state(windows.given), windows, scatter: Some(self.scattering.state()) }
    }

    /// Samples from one to its parameters.
    #[must_use]
    pub fn delay(&self) -> usize {
        self.rows.angle.delay() + self.windows.delay()
    }

    /// Samples taken in so far.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.rows.angle.samples()
    }

    /// The samples whose parameters are given next, once `count` more have been taken in.
    #[must_use]
    pub fn upcoming(&self, count: usize) -> Range<usize> {
        let given = self.windows.at_end().start;
        given..self.rows.angle.upcoming(count).end.saturating_sub(self.windows.delay()).max(given)
    }

    /// The samples whose parameters are given at the end.
    #[must_use]
    pub fn at_end(&self) -> Range<usize> {
        let windows = self.windows.at_end();
        windows.start..if self.rows.angle.at_end().is_empty() { windows.end } else { self.samples() }
    }

    /// Takes in samples and gives the parameters of [`WindowedStream::upcoming`], to elements that begin with the first of them.
    pub fn push(&mut self, channels: NextSamples<'_>, parameters: &mut Parameters<'_>) {
        for piece in channels.pieces() {
            let ready = self.rows.take(Some(piece));
            let around = self.windows.upcoming(ready.len());
            self.windows.push_rows(ready.len(), self.rows.all_columns(), &mut parameters.regressions);
            self.complete(around.clone(), around.end, parameters);
        }
    }

    /// Ends the stream and gives the parameters of [`WindowedStream::at_end`].
    pub fn finish(&mut self, derivatives: &LocalPolynomials, parameters: &mut Parameters<'_>) {
        let ready = self.rows.take(None);
        self.windows.append(ready.len(), self.rows.all_columns());
        let around = self.windows.at_end();
        let end = equations(derivatives, self.samples()).end;
        self.windows.finish_with(end, &mut parameters.regressions);
        self.complete(around, end.saturating_sub(self.windows.delay()), parameters);
    }

    /// Adds what is known of the polynomials, and multiplies standard errors. Windows are whole up to one.
    fn complete(&mut self, around: Range<usize>, whole: usize, parameters: &mut Parameters<'_>) {
        let Parameters { regressions, order } = parameters;
        let elements = regressions.elements;
        self.rows.marks.give(around.clone(), elements, order, regressions.status);
        for element in elements.of(around) {
            let sample = elements.sample(element);
            if self.factors.is_none() && (self.scattering.next()..whole).contains(&sample) {
                let values = regressions.parameters.iter().map(|column| &column[element]);
                self.scattering.see(values, regressions.errors.iter().map(|column| &column[element]));
            }
            for (unknown, errors) in regressions.errors.iter_mut().enumerate() {
                errors[element] *= match &self.factors {
                    Some(factors) => factors[unknown],
                    None => self.scattering.factor(unknown),
                };
            }
        }
    }

    /// Every how many samples parameters are given.
    #[must_use]
    pub fn step(&self) -> usize {
        self.step
    }
}
