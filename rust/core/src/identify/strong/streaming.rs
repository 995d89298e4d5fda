//! Strong form, streaming: local polynomials, rows of the equation of motion and least squares in one pass over pieces of records.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use crate::equation::motion::Motion;
use crate::error::Error;
use crate::exec::pool;
use crate::exec::pool::{GoOn, Piece, Watch};
use crate::identify::strong::beside_gaps::BesideGaps;
use crate::lanes::output::{Elements, split_off};
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::order_shares::Wanted;
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::samples::{Samples, is_usable};
use crate::record::subsample::stretches;
use crate::regression::limits::HARDLY_TOLD_APART;
use crate::regression::newey_west::Stretched;
use crate::status::Status;

/// Rows in a piece of work, about.
pub(crate) const PIECE: usize = 1 << 14;

/// Rows that the correlation of residuals is read off in a long record, and in how many stretches.
const MOST_ROWS: usize = 1 << 14;
const STRETCHES: usize = 8;

/// A record in strong form that is worked on piece by piece.
#[derive(Clone)]
pub struct StrongRecord<'a> {
    /// Its equation of motion.
    pub motion: Motion<'a>,
    /// One over the variance of every sample's noise, relative to the others; all alike if `None`.
    pub weights: Option<&'a [f64]>,
    /// Whether windows that lack samples are solved from the others, rather than given no number.
    pub leaves_out: bool,
}

impl StrongRecord<'_> {
    /// The plan of windows of its equations.
    pub(crate) fn windows(
        &self,
        derivatives: &LocalPolynomials,
        window: usize,
        covariances: Vec<(usize, usize)>,
    ) -> Result<RollingLeastSquares, Error> {
        let instructions = derivatives.options().instructions;
        let unknowns = self.motion.unknowns();
        let plan = RollingLeastSquares::new(window, unknowns, 1, covariances, HARDLY_TOLD_APART, instructions)?;
        Ok(plan.of_equations(self.leaves_out))
    }
}

/// Where results of one record are written. An empty slice stands for what is not wanted.
#[derive(Debug, Default)]
pub(crate) struct Identified<'a> {
    /// Parameters of every window; their elements say which samples all outputs belong to.
    pub(crate) regressions: Regressions<'a>,
    /// Order of the polynomial around each sample.
    pub(crate) order: &'a mut [u8],
}

impl Identified<'_> {
    pub(crate) fn split_off_before(&mut self, sample: usize) -> Self {
        let count = self.regressions.elements.of(0..sample).len();
        Identified { order: split_off(&mut self.order, count), regressions: self.regressions.split_off_before(sample) }
    }
}

/// Rows of a record between two samples.
pub(crate) struct Chunk {
    first: usize,
    /// Angle and its derivatives.
    derivatives: [Vec<f64>; 3],
    order: Vec<u8>,
    status: Vec<u16>,
    known: Vec<f64>,
    /// Unknowns, then the right-hand side.
    pub(crate) columns: Vec<Vec<f64>>,
    polynomials: crate::local_polynomials::plan::PolynomialScratch,
    beside_gaps: BesideGaps,
}

/// One column of a chunk, known by absolute sample numbers. Beyond the chunk, where no window that is wanted reaches, it is zero.
pub(crate) struct Column<'a> {
    first: usize,
    values: &'a [f64],
    samples: usize,
}

impl Samples for Column<'_> {
    fn len(&self) -> usize {
        self.samples
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        let (start, end) = (first.max(self.first), (first + into.len()).min(self.first + self.values.len()));
        into.fill(0.0);
        if start < end {
            into[start - first..end - first].copy_from_slice(&self.values[start - self.first..end - self.first]);
        }
    }
}

impl Chunk {
    pub(crate) fn new(plan: &LocalPolynomials, columns: usize) -> Self {
        Self {
            first: 0,
            derivatives: Default::default(),
            order: Vec::new(),
            status: Vec::new(),
            known: Vec::new(),
            columns: vec![Vec::new(); columns],
            polynomials: plan.scratch(),
            beside_gaps: BesideGaps::default(),
        }
    }

    /// Differentiates the angle at some samples and builds their rows. What is there is of no use once `go_on` has returned false.
    pub(crate) fn fill(
        &mut self,
        plan: &LocalPolynomials,
        record: &StrongRecord<'_>,
        samples: Range<usize>,
        go_on: &GoOn<'_>,
    ) -> Result<(), Error> {
        let motion = &record.motion;
        self.first = samples.start;
        motion.take_back(&mut self.derivatives, &mut self.columns);
        for derivative in &mut self.derivatives {
            derivative.resize(samples.len(), 0.0);
        }
        self.order.resize(samples.len(), 0);
        self.status.resize(samples.len(), 0);
        let mut estimates = Estimates {
            elements: Elements { first: samples.start, step: 1 },
            derivatives: self.derivatives.iter_mut().map(Vec::as_mut_slice).collect(),
            order: &mut self.order,
            status: &mut self.status,
            sigma: &mut [],
        };
        plan.estimate(motion.angle, samples.clone(), &mut estimates, &mut self.polynomials)?;
        if record.leaves_out || record.weights.is_some() {
            // Without weight a sample may be missing; others spoil their windows, unless those are left out.
            let weights = record.weights.as_ref().filter(|_| !record.leaves_out);
            let channels = (motion.angle, weights.map(|weights| weights as &dyn Samples));
            self.beside_gaps.fit(plan, channels, samples, &mut estimates, go_on);
        }
        motion.rows(self.first, &mut self.derivatives, &mut self.known, &mut self.columns);
        Ok(())
    }

    /// The columns by the sample numbers of their record.
    pub(crate) fn columns(&self, samples: usize) -> Vec<Column<'_>> {
        self.columns.iter().map(|values| Column { first: self.first, values, samples }).collect()
    }

    /// Multiplies rows by the square roots of the weights of their samples.
    fn weigh(&mut self, weights: &[f64]) {
        for column in &mut self.columns {
            column.iter_mut().zip(&weights[self.first..]).for_each(|(value, weight)| *value *= weight.sqrt());
        }
    }

    /// Whether a row of the chunk is an equation, of those of the record, and can be used.
    pub(crate) fn is_equation(&self, row: usize, rows: &Range<usize>) -> bool {
        rows.contains(&(self.first + row)) && self.columns.iter().all(|column| is_usable(column[row]))
    }
}

/// Pairs of unknown coefficients, by the places of the unknowns.
pub(crate) fn pairs(motion: &Motion<'_>) -> Vec<(usize, usize)> {
    let coefficients = motion.unknowns() - motion.terms.len();
    (0..coefficients).flat_map(|one| (one + 1..coefficients).map(move |other| (one, other))).collect()
}

/// The samples that are equations: those around which a full window of the angle lies.
pub(crate) fn equations(plan: &LocalPolynomials, samples: usize) -> Range<usize> {
    let before = plan.before_centre();
    before..(samples + before + 1).saturating_sub(plan.options().window_length).max(before)
}

/// Identifies parameters in a window of equations around some samples of every record: (3) and (4) of the paper, in parallel over all records. All
/// outputs belong to these samples.
///
/// `derivatives` must be a plan for the value and the first two derivatives, `least_squares` [`StrongRecord::windows`] of all of the records.
/// Standard errors are those of ordinary least squares; [`scatter`](super::scatter::scatter()) says by what they are too small.
///
/// # Errors
/// If a record is shorter than the window of the polynomials, or the watch cancels.
pub(crate) fn identify_parts(
    derivatives: &LocalPolynomials,
    least_squares: &RollingLeastSquares,
    parts: Vec<(&StrongRecord<'_>, (Range<usize>, Identified<'_>))>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<(), Error> {
    let mut pieces = Vec::new();
    for (record, (wanted, mut identified)) in parts {
        let total = record.motion.angle.len();
        derivatives.windows(total)?;
        for samples in least_squares.pieces(total, PIECE) {
            let samples = samples.start.max(wanted.start)..samples.end.min(wanted.end);
            if samples.is_empty() {
                continue;
            }
            let part = identified.split_off_before(samples.end);
            pieces.push(Piece { size: samples.len(), content: (record, samples, part) });
        }
    }
    let threads = workers.get().min(pieces.len());
    derivatives.ask_for_scratch(Wanted::Derivatives, threads)?;
    least_squares.ask_for_scratch(threads)?;
    let scratch = || (Chunk::new(derivatives, least_squares.columns()), least_squares.scratch());
    let failed = Mutex::new(None);
    let work = |(record, samples, mut part): (&StrongRecord<'_>, Range<usize>, Identified<'_>),
                (chunk, scratch): &mut (Chunk, crate::least_squares::side_by_side::RollingScratch),
                go_on: &GoOn<'_>| {
        let total = record.motion.angle.len();
        let needed = least_squares.rows_needed(samples.clone(), total);
        if let Err(error) = chunk.fill(derivatives, record, needed, go_on) {
            *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            return;
        }
        let columns = chunk.columns(total);
        let equations = Equations {
            columns: columns.iter().map(|column| column as &dyn Samples).collect(),
            weights: record.weights.as_ref().map(|weights| weights as &dyn Samples),
            rows: equations(derivatives, total),
        };
        least_squares.solve_while(&equations, samples.clone(), &mut part.regressions, scratch, go_on);
        finish(chunk, samples, &mut part);
    };
    pool::run_long(pieces, workers, scratch, work, watch)?;
    failed.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
}

/// Adds what is known of the polynomials to a piece of the results.
pub(crate) fn finish(chunk: &Chunk, samples: Range<usize>, part: &mut Identified<'_>) {
    let elements = part.regressions.elements;
    for element in elements.of(samples) {
        let place = elements.sample(element) - chunk.first;
        if let Some(order) = part.order.get_mut(element) {
            *order = chunk.order[place];
        }
        if let Some(status) = part.regressions.status.get_mut(element) {
            *status |= chunk.status[place] & !Status::INVALID.bits();
        }
    }
}

/// Rows farther apart than this hardly share noise: polynomials weigh the middle half of their windows.
fn correlated(derivatives: &LocalPolynomials) -> usize {
    derivatives.options().window_length / 2
}

/// The rows that [`variance_inflations`] looks at in a record of so many samples.
pub(crate) fn rows_of_variance_inflations(
    derivatives: &LocalPolynomials,
    samples: usize,
) -> impl Iterator<Item = Range<usize>> {
    let rows = equations(derivatives, samples);
    let most = MOST_ROWS.max(4 * STRETCHES * correlated(derivatives));
    stretches(rows.len(), most, STRETCHES).map(move |part| rows.start + part.start..rows.start + part.end)
}

/// By how much the standard errors of constants exceed those of ordinary least squares, from stretches of a long record.
pub(crate) fn variance_inflations(
    derivatives: &LocalPolynomials,
    record: &StrongRecord<'_>,
    chunk: &mut Chunk,
) -> Result<Vec<f64>, Error> {
    let motion = &record.motion;
    let rows = equations(derivatives, motion.angle.len());
    let mut stretched = Stretched::new(motion.unknowns() + 1, correlated(derivatives));
    for stretch in rows_of_variance_inflations(derivatives, motion.angle.len()) {
        chunk.fill(derivatives, record, stretch, &|| true)?;
        if let Some(weights) = record.weights {
            chunk.weigh(weights);
        }
        stretched.push(&chunk.columns, |row| chunk.is_equation(row, &rows));
    }
    Ok(stretched.factors().unwrap_or_else(|| vec![1.0; motion.unknowns()]))
}
