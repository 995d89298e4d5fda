//! Constant parameters in strong form of a recording that goes on: recursive least squares, with or without forgetting.
//!
//! Every row is appended to a triangular factor; nothing is ever subtracted. With a forgetting factor `λ` the factor is multiplied by it
//! before each row, so that the sum `Σ λ^(n-k) (b_k - a_k x)²` is least (Ljung 1999, section 11.2). Its estimate has about the
//! covariance `σ² N⁻¹ Σ λ^(2k) / Σ λ^k`, which neighbouring rows that share samples increase: see `factors`.

use std::ops::Range;
use std::sync::Arc;

use crate::error::Error;
use crate::identify::strong::streaming::equations;
use crate::lanes::tile::Tile;
use crate::least_squares::givens_factor::{Dimensions, Many, append, empty, load, store};
use crate::least_squares::one_by_one::RowSource;
use crate::least_squares::plan::{RollingLeastSquares, Slots};
use crate::least_squares::solutions::finish;
use crate::least_squares::window_summary::WindowSummary;
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::samples::is_usable;
use crate::regression::limits::HARDLY_TOLD_APART;
use crate::regression::newey_west::Stretched;
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Kernel, Lanes, dispatch};
use crate::status::Status;
use crate::stream::rows::RecentRows;
use crate::stream::windowed::{NextSamples, Parameters, RowsState, StreamedMotion, StreamedRows, StreamedSamples};

/// Rows that the correlation of residuals is read off, at most; half-windows of polynomials that they hold, at least.
const MOST_ROWS: usize = 1 << 14;
const LEAST_HALVES: usize = 16;

/// The rows that were summed, without the samples that they come from.
#[derive(Clone, Debug, Default)]
struct Recursion {
    /// The triangular factor, one lane of it; empty before the first row.
    factor: Vec<f64>,
    /// Sums of weights and of their squares.
    weights: [f64; 2],
    /// Rows.
    count: usize,
}

/// Parameters that are the same all the time, as samples come.
///
/// Pieces may have any length. Values after all samples are those of [`crate::identify::identify_all`] to rounding, where nothing is
/// forgotten.
#[derive(Debug)]
pub struct ConstantStream {
    rows: StreamedRows,
    plan: RollingLeastSquares,
    first: usize,
    reach: usize,
    given: usize,
    step: usize,
    forgetting: f64,
    hold: bool,
    sums: Recursion,
    recent: RecentRows,
    /// Rows at which the next factors are read off, and the factors.
    next: usize,
    factors: Option<Vec<f64>>,
    tile: Tile,
    row: Vec<f64>,
    /// Its weight, and the row times the root of that.
    weight: f64,
    weighted: Vec<f64>,
    wide: Aligned,
}

/// What a stream of constants resumes from.
#[derive(Clone, Debug, Default)]
pub struct ConstantState {
    /// Angle, torque, orders.
    pub rows: RowsState,
    /// Samples that were given; rows summed; rows at which factors are read off next; number of the first recent row.
    pub places: [usize; 4],
    /// Sums of weights and squares, then the triangular factor.
    pub sums: Vec<f64>,
    /// The latest rows.
    pub recent: Vec<f64>,
    /// What standard errors of ordinary least squares are multiplied by, where known.
    pub factors: Vec<f64>,
}

impl ConstantStream {
    /// Begins a stream, or goes on from a state of one with the same settings. `derivatives` must be a plan for the value and the first two
    /// derivatives; after each row those before it count `forgetting` times as much.
    ///
    /// # Errors
    /// If the plan looks at neighbouring windows, or nothing or too much is unknown.
    pub fn resume(
        derivatives: Arc<LocalPolynomials>,
        (motion, samples): (StreamedMotion, StreamedSamples),
        step: usize,
        forgetting: f64,
        state: ConstantState,
    ) -> Result<Self, Error> {
        let (unknowns, instructions) = (motion.unknowns(), derivatives.options().instructions);
        let plan = RollingLeastSquares::new(unknowns + 1, unknowns, 1, Vec::new(), HARDLY_TOLD_APART, instructions)?;
        let (first, reach) = (derivatives.before_centre(), derivatives.options().window_length / 2);
        let [given, count, next, first_recent] = state.places;
        let (weights, factor) = state.sums.split_at(2.min(state.sums.len()));
        let weights = if let [one, two] = *weights { [one, two] } else { [0.0; 2] };
        let lanes = instructions.lanes();
        let size = Many { regressors: unknowns, rhs_count: 1 }.size();
        Ok(Self {
            rows: StreamedRows::resume(derivatives, motion, samples, &state.rows)?,
            tile: Tile::new(Slots::of(&plan).fields(), 1, lanes),
            recent: RecentRows::new(unknowns + 1, first_recent, state.recent),
            sums: Recursion { factor: factor.to_vec(), weights, count },
            next: next.max(LEAST_HALVES * reach.max(1)),
            factors: Some(state.factors).filter(|factors| !factors.is_empty()),
            row: vec![0.0; unknowns + 1],
            weight: 1.0,
            weighted: Vec::new(),
            wide: Aligned::zeros(size * lanes),
            hold: false,
            plan,
            first,
            reach,
            given,
            step,
            forgetting,
        })
    }

    /// The state to resume from.
    #[must_use]
    pub fn state(&self) -> ConstantState {
        let (first, recent) = self.recent.from(self.recent.len().saturating_sub(self.kept()));
        ConstantState {
            rows: self.rows.state(self.given),
            places: [self.given, self.sums.count, self.next, first],
            sums: self.sums.weights.iter().chain(&self.sums.factor).copied().collect(),
            recent: recent.to_vec(),
            factors: self.factors.clone().unwrap_or_default(),
        }
    }

    /// Samples from one to the constants with its row.
    #[must_use]
    pub fn delay(&self) -> usize {
        self.rows.angle.delay()
    }

    /// Samples taken in so far.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.rows.angle.samples()
    }

    /// Every how many samples parameters are given.
    #[must_use]
    pub fn step(&self) -> usize {
        self.step
    }

    /// The samples that are given next, once `count` more have been taken in.
    #[must_use]
    pub fn upcoming(&self, count: usize) -> Range<usize> {
        self.rows.angle.upcoming(count)
    }

    /// The samples that are given at the end.
    #[must_use]
    pub fn at_end(&self) -> Range<usize> {
        self.rows.angle.at_end()
    }

    /// Whether rows that come are left out, so that the constants stay as they are.
    pub fn hold(&mut self, hold: bool) {
        self.hold = hold;
    }

    /// Forgets all rows: the constants are those of the rows that follow.
    pub fn reset(&mut self) {
        self.sums = Recursion::default();
        self.recent = RecentRows::new(self.plan.columns(), 0, Vec::new());
        self.next = LEAST_HALVES * self.reach.max(1);
        self.factors = None;
    }

    /// Takes in samples and gives the constants after each row of [`ConstantStream::upcoming`].
    pub fn push(&mut self, channels: NextSamples<'_>, parameters: &mut Parameters<'_>) {
        for piece in channels.pieces() {
            let ready = self.rows.take(Some(piece));
            self.sum_up(ready, usize::MAX, parameters);
        }
    }

    /// Ends the stream and gives the constants of [`ConstantStream::at_end`].
    pub fn finish(&mut self, derivatives: &LocalPolynomials, parameters: &mut Parameters<'_>) {
        let ready = self.rows.take(None);
        let end = equations(derivatives, self.samples()).end;
        self.settle();
        self.sum_up(ready, end, parameters);
    }

    /// Rows that are kept to see how they correlate.
    fn kept(&self) -> usize {
        MOST_ROWS.max(LEAST_HALVES * self.reach)
    }

    /// Adds rows and gives the constants after each; rows from `end` on are no equations.
    fn sum_up(&mut self, samples: Range<usize>, end: usize, parameters: &mut Parameters<'_>) {
        let Parameters { regressions, order } = parameters;
        let elements = regressions.elements;
        for (place, sample) in samples.clone().enumerate() {
            for (value, column) in self.row.iter_mut().zip(&self.rows.columns) {
                *value = column[place];
            }
            self.weight = self.rows.row_weights.get(place).copied().unwrap_or(1.0);
            let is_equation = self.weight > 0.0
                && (self.first..end).contains(&sample)
                && self.row.iter().all(|value| is_usable(*value));
            let adds = is_equation && !self.hold;
            let wanted = elements.of(sample..sample + 1);
            self.advance(adds, !wanted.is_empty());
            for element in wanted {
                let condition = self.write(|field, unknown, value| match field {
                    0 => regressions.parameters[unknown][element] = value,
                    1 => regressions.errors[unknown][element] = value,
                    _ => regressions.deviations[0][element] = value,
                });
                regressions.condition[element] = condition;
                let mut status = Status::GOOD;
                if !condition.is_finite() {
                    status |= Status::INVALID | Status::RANK_DEFICIENT;
                } else if condition > HARDLY_TOLD_APART {
                    status |= Status::ILL_CONDITIONED;
                }
                regressions.status[element] = status.bits();
            }
        }
        self.rows.marks.give(samples.clone(), elements, order, regressions.status);
        self.given = samples.end;
    }

    /// Adds a row or not, and solves where that is wanted.
    fn advance(&mut self, adds: bool, wanted: bool) {
        let unknowns = self.plan.columns() - 1;
        if adds {
            let [one, two] = &mut self.sums.weights;
            (*one, *two) = (*one * self.forgetting + 1.0, *two * self.forgetting * self.forgetting + 1.0);
            self.sums.count += 1;
            let root = self.weight.sqrt();
            self.weighted.clear();
            self.weighted.extend(self.row.iter().map(|value| value * root));
            self.recent.extend(1, self.weighted.chunks(1));
            let kept = self.kept();
            self.recent.forget_before(self.recent.len().saturating_sub(kept));
        }
        let [one, two] = self.sums.weights;
        self.plan.window = self.sums.count.max(unknowns + 1);
        let freedom = 1.0 / (one - unknowns as f64 * two / one.max(f64::MIN_POSITIVE)).max(0.0);
        let kernel = Advance {
            plan: &self.plan,
            factor: &mut self.sums.factor,
            wide: &mut self.wide,
            row: adds.then_some((&self.row, self.weight)),
            forgetting: self.forgetting,
            freedom: wanted.then_some(freedom),
            tile: &mut self.tile,
        };
        dispatch(self.plan.instructions, kernel);
        if adds && self.sums.count >= self.next {
            self.settle();
            self.next = 2 * self.sums.count;
        }
    }

    /// Hands over field, unknown and value of the last solution. Returns its condition number.
    fn write(&self, mut give: impl FnMut(usize, usize, f64)) -> f64 {
        let (slots, lanes) = (Slots::of(&self.plan), self.plan.instructions.lanes());
        let unknowns = self.plan.columns() - 1;
        let [one, two] = self.sums.weights;
        let known = self.sums.count > unknowns;
        let at = |field: usize| if known { self.tile.one(field, 0, 0, lanes) } else { f64::NAN };
        for unknown in 0..unknowns {
            let factor = self.factors.as_ref().map_or(f64::NAN, |factors| factors[unknown]);
            give(0, unknown, at(unknown));
            give(1, unknown, at(slots.errors + unknown) * (two / one).sqrt() * factor);
        }
        give(2, 0, at(slots.deviations));
        if known { at(slots.condition) } else { f64::INFINITY }
    }

    /// Reads off how much standard errors exceed those of independent rows.
    fn settle(&mut self) {
        let (columns, kept) = (self.plan.columns(), self.kept());
        let from = self.recent.len().saturating_sub(kept);
        let (first, rows) = self.recent.from(from);
        if rows.len() < LEAST_HALVES * self.reach * columns {
            return;
        }
        let separate: Vec<Vec<f64>> =
            (0..columns).map(|column| rows.iter().skip(column).step_by(columns).copied().collect()).collect();
        let mut stretched = Stretched::new(columns, self.reach);
        let unusable = self.recent.unusable();
        stretched.push(&separate, |row| unusable.binary_search(&(first + row)).is_err());
        self.factors = stretched.factors().or(self.factors.take());
    }
}

/// Appends a row and solves. All lanes hold the same.
struct Advance<'a> {
    plan: &'a RollingLeastSquares,
    factor: &'a mut Vec<f64>,
    wide: &'a mut Aligned,
    /// Its numbers and its weight.
    row: Option<(&'a Vec<f64>, f64)>,
    forgetting: f64,
    freedom: Option<f64>,
    tile: &'a mut Tile,
}

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let unknowns = self.plan.columns() - 1;
        let shape = Many { regressors: unknowns, rhs_count: 1 };
        let mut factor = empty(simd, shape);
        for (place, value) in self.factor.iter().enumerate() {
            factor[place] = simd.splat_f64s(*value);
        }
        let mut scratch = shape.factor(simd.splat_f64s(0.0));
        if let Some((row, weight)) = self.row {
            if self.forgetting < 1.0 {
                let forgetting = simd.splat_f64s(self.forgetting);
                for place in (0..=unknowns).map(|i| shape.row(i)) {
                    factor[place] = simd.mul_f64s(factor[place], forgetting);
                }
            }
            for (column, value) in row.iter().enumerate() {
                scratch[column] = simd.splat_f64s(*value);
            }
            append(simd, shape, &mut factor, &mut scratch, 0, simd.splat_f64s(weight));
            store(simd, shape, self.wide, &factor);
            self.factor.clear();
            self.factor.extend(self.wide.iter().step_by(S::F64_LANES));
            // The same numbers as the next row will find.
            load(simd, shape, self.wide, &mut factor);
        }
        if let Some(freedom) = self.freedom {
            let (summary, freedom) = (WindowSummary { factor, sums: None }, simd.splat_f64s(freedom));
            let (fields, none) = (&mut self.tile.fields_of::<S>(0), |_: usize| simd.splat_f64s(f64::NAN));
            finish(simd, shape, self.plan, &summary, freedom, fields, &mut scratch, none);
        }
    }
}
