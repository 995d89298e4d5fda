//! Where windows are compared for a record as a whole, and what is known there.
//!
//! Every window is looked at where its means lie: at all places of a grid, or of one that lies within it. Long records are subsampled in
//! sixteen stretches.

use std::cell::RefCell;
use std::f64::consts::LN_2;
use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

use crate::auto_derivatives::block_means::{BlockMeans, COARSER, Grid, WHOLE, mean, step_at_end, step_for};
use crate::auto_derivatives::candidates::Bank;
use crate::error::Error;
use crate::exec::memory;
use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};
use crate::local_polynomials::tables::{TablesWanted, WindowTables, tables};
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;

/// Half-width of the longest window tried.
pub(crate) const LONGEST: usize = 10_000;

/// Stretches of a long record.
const STRETCHES: usize = 16;

/// Samples from one place to the next in stretches: of windows of any length at least, and at most.
const STEP: usize = 9;
const LONGEST_STEP: usize = 81;

/// Means of the longest windows that a stretch holds.
const MEANS: usize = 18;

/// Places at which candidates are compared, at most; every third sample at least where records are not short: their errors are the same to 0.1 %.
const MOST_PLACES: usize = 12 << 10;

/// Places in a half-width, at least, and windows in a half-width near an end, at most.
const PLACES: usize = 8;
const STRIDES: usize = 8;

/// Records that are looked at more closely: there it costs little, and a few windows decide.
pub(crate) const CLOSELY: usize = 1 << 11;

/// Where candidates are compared, and what is known there: the coefficients of windows serve all derivatives.
pub(crate) struct Survey<'a> {
    means: BlockMeans<'a>,
    highest: usize,
    instructions: Instructions,
    stretches: Vec<Range<usize>>,
    /// Samples from one place to the next.
    step: usize,
    closely: bool,
    /// By half-width, the coefficients at all places; NaN where there is no window.
    known: RefCell<Vec<(usize, Rc<Projected>)>>,
    parts: RefCell<Vec<Rc<PartOfWindows>>>,
    /// Memory that is used again.
    scratch: RefCell<(CoefficientScratch, Projected)>,
}

/// Windows in a part of a record.
pub(crate) struct PartOfWindows {
    half: usize,
    part: Range<usize>,
    /// Their first samples, and the first of all.
    begin: usize,
    pub(crate) starts: Vec<usize>,
    pub(crate) projected: Projected,
    /// What shrinks their coefficients, by the highest degree.
    shrinkages: RefCell<Vec<(usize, Rc<Shrinkage>)>>,
}

/// A matrix, row by row.
pub(crate) type Shrinkage = Vec<Vec<f64>>;

impl PartOfWindows {
    /// What shrinks the coefficients up to some degree, made once for all derivatives.
    pub(crate) fn shrinkage(&self, highest: usize, make: impl FnOnce(&Projected) -> Shrinkage) -> Rc<Shrinkage> {
        let mut known = self.shrinkages.borrow_mut();
        if let Some((_, found)) = known.iter().find(|(one, _)| *one == highest) {
            return Rc::clone(found);
        }
        let made = Rc::new(make(&self.projected));
        known.push((highest, Rc::clone(&made)));
        made
    }
}

/// By step, rows at the places of a grid of that step.
type CoarserRows = Vec<(usize, Rc<Vec<Vec<f64>>>)>;

/// The candidates of one window at all places, a row each; NaN where there is none.
#[derive(Debug)]
pub(crate) struct Surveyed {
    pub(crate) bank: Bank,
    pub(crate) rows: Rc<Vec<Vec<f64>>>,
    /// The places: of one stretch after the other as if they were one.
    pub(crate) grid: Grid,
    /// The samples where windows fit, if they fit at all places between: no sample is missing.
    pub(crate) whole: Option<Range<usize>>,
    /// By their step, the rows at the places of coarser grids: to look for them again would cost as much as to compare them.
    coarser: RefCell<CoarserRows>,
}

impl Surveyed {
    pub(crate) fn new(bank: Bank, rows: Vec<Vec<f64>>, grid: Grid) -> Self {
        let row = &rows[0];
        let first = row.iter().position(|value| !value.is_nan());
        let last = row.iter().rposition(|value| !value.is_nan());
        let fits = first.zip(last).filter(|&(first, last)| !row[first..=last].iter().any(|value| value.is_nan()));
        let whole = fits.map(|(first, last)| grid.sample(first)..grid.sample(last) + 1);
        Self { bank, rows: Rc::new(rows), grid, whole, coarser: RefCell::default() }
    }

    /// All candidates at the places of a grid that is not finer.
    pub(crate) fn at(&self, grid: Grid) -> Rc<Vec<Vec<f64>>> {
        if grid.step == self.grid.step {
            return Rc::clone(&self.rows);
        }
        let mut known = self.coarser.borrow_mut();
        if let Some((_, rows)) = known.iter().find(|(step, _)| *step == grid.step) {
            return Rc::clone(rows);
        }
        let (first, every) = ((grid.first - self.grid.first) / self.grid.step, grid.step / self.grid.step);
        let coarser = |row: &Vec<f64>| row[first..].iter().step_by(every).take(grid.count).copied().collect();
        let rows: Rc<Vec<Vec<f64>>> = Rc::new(self.rows.iter().map(coarser).collect());
        known.push((grid.step, Rc::clone(&rows)));
        rows
    }
}

impl<'a> Survey<'a> {
    /// Prepares to look at a record.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn new(record: &'a dyn Samples, highest: usize, instructions: Instructions) -> Result<Self, Error> {
        let samples = record.len();
        // Twice the longest window is a candidate, too.
        let longest = if samples > CLOSELY { (2 * LONGEST).min(samples / 4) } else { 0 };
        let (means, closely) = (BlockMeans::new(record, longest)?, samples <= CLOSELY);
        let (known, parts, scratch) = (RefCell::default(), RefCell::default(), RefCell::default());
        if samples <= WHOLE {
            let least = if closely { 1 } else { COARSER };
            let mut steps = std::iter::successors(Some(least), |step| Some(step * COARSER));
            let step = steps.find(|step| samples <= step * MOST_PLACES).unwrap_or(STEP);
            let stretches = std::iter::once(0..samples).collect();
            return Ok(Self { means, highest, instructions, stretches, step, closely, known, parts, scratch });
        }
        // Stretches of whole means of any window.
        let most = step_for(longest);
        let (grid, length) = (Grid::new(samples, most), MEANS.min(samples / most / STRETCHES));
        // The same from both ends of the record.
        let (last, spare) = (STRETCHES - 1, grid.count - length);
        let from_begin = |index: usize| spare * index / last;
        let mean = |index: usize| if 2 * index < last { from_begin(index) } else { spare - from_begin(last - index) };
        let first = |index: usize| grid.sample(mean(index)) - most / 2;
        let stretches = (0..STRETCHES).map(|index| first(index)..first(index) + length * most).collect();
        Ok(Self { means, highest, instructions, stretches, step: STEP, closely, known, parts, scratch })
    }

    /// Looks at the candidates of a window. The coefficients that they are made of are kept for other derivatives.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn look(&self, bank: Bank) -> Result<Surveyed, Error> {
        let rows = bank.combine(&*self.coefficients(&bank)?);
        let grid = self.grid(&bank);
        Ok(Surveyed::new(bank, rows, grid))
    }

    /// The same without keeping anything.
    pub(crate) fn look_once(&self, bank: Bank) -> Surveyed {
        let rows = self.known_coefficients(&bank).map_or_else(
            || {
                let (scratch, part) = &mut *self.scratch.borrow_mut();
                scratch.forget_plan();
                self.at_places(&bank, bank.orders.len(), |centres, every, rows| {
                    let found = bank.estimates(&self.means, centres, every, scratch, part);
                    rows.iter_mut().zip(found).for_each(|(row, found)| row.extend(&*found));
                })
            },
            |known| bank.combine(&known),
        );
        let grid = self.grid(&bank);
        Surveyed::new(bank, rows, grid)
    }

    /// The record that is surveyed, and its means.
    pub(crate) fn record(&self) -> &'a dyn Samples {
        self.means.record()
    }

    pub(crate) fn means(&self) -> &BlockMeans<'a> {
        &self.means
    }

    /// The half-width of a window of about the same length that was looked at, if there is one: tables are kept.
    pub(crate) fn nearest_known(&self, half: usize) -> usize {
        let distance = |one: usize| (one as f64 / half as f64).ln().abs();
        let known = self.known.borrow();
        let nearest = known.iter().map(|(one, _)| *one).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        nearest.filter(|&one| distance(one) < LN_2 / 4.0).unwrap_or(half)
    }

    /// Tables of windows of so many samples, or means, with all degrees.
    pub(crate) fn tables(&self, half: usize) -> Result<Arc<WindowTables>, Error> {
        let highest = self.highest.min(2 * half - 2);
        tables(TablesWanted { half, highest, first: 0, step: 1, instructions: self.instructions })
    }

    /// The first samples and the coefficients of windows in a part of the record, about so many, at equal distances from its ends: for the reversed
    /// record, the same counted from the other end.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn windows(
        &self,
        half: usize,
        part: &Range<usize>,
        most: usize,
        last: bool,
    ) -> Result<Rc<PartOfWindows>, Error> {
        let step = if self.closely { 1 } else { step_at_end(half) };
        let inner = half / step;
        // Means that begin at the end in question.
        let cut = if last { part.len() % step } else { 0 };
        let room = (part.len() / step).saturating_sub(2 * inner);
        let every = room.div_ceil(most).max(if self.closely { 1 } else { inner / STRIDES }).max(1);
        let beside = room.saturating_sub(1) % every;
        let beside = if last { beside - beside / 2 } else { beside / 2 };
        let begin = part.start + cut + beside * step;
        let found = |one: &&Rc<PartOfWindows>| one.half == half && one.begin == begin && one.part == *part;
        if let Some(known) = self.parts.borrow().iter().find(found) {
            return Ok(Rc::clone(known));
        }
        let mut means = Vec::new();
        if step > 1 {
            memory::ask_for_numbers(part.len() / step)?;
            let mut samples = vec![0.0; step << 10];
            for first in (part.start + cut..part.end + 1 - step).step_by(samples.len()) {
                let count = (part.end - first).min(samples.len());
                self.record().read(first, &mut samples[..count]);
                means.extend(samples[..count].chunks_exact(step).map(mean));
            }
        }
        let means = means.as_slice();
        let (record, first): (&dyn Samples, usize) = if step > 1 { (&means, beside) } else { (self.record(), begin) };
        let tables = self.tables(inner)?;
        let (scratch, mut projected) = (&mut self.scratch.borrow_mut().0, Projected::default());
        scratch.forget_plan();
        let windows = first..first + room.saturating_sub(beside);
        tables.coefficients().project(record, windows.clone(), every, &mut projected, scratch);
        let starts = windows.step_by(every).map(|start| begin + (start - first) * step).collect();
        let found = Rc::new(PartOfWindows {
            half,
            part: part.clone(),
            begin,
            starts,
            projected,
            shrinkages: RefCell::default(),
        });
        self.parts.borrow_mut().push(Rc::clone(&found));
        Ok(found)
    }

    /// Samples from one place of a window to the next.
    fn step_of(&self, bank: &Bank) -> usize {
        let most = if self.stretches.len() > 1 { LONGEST_STEP } else { STEP };
        let enough = if self.closely { 1 } else { COARSER.pow((bank.half / PLACES).clamp(1, most).ilog(COARSER)) };
        self.step.max(bank.step).max(enough)
    }

    /// The places of a window, in samples of one stretch after the other.
    fn grid(&self, bank: &Bank) -> Grid {
        let step = self.step_of(bank);
        if let [whole] = &*self.stretches {
            return Grid::new(whole.len(), step);
        }
        let samples: usize = self.stretches.iter().map(Range::len).sum();
        Grid { step, first: step / 2, count: samples / step }
    }

    /// The coefficients of all windows of a length at all places.
    fn coefficients(&self, bank: &Bank) -> Result<Rc<Projected>, Error> {
        if let Some(known) = self.known_coefficients(bank) {
            return Ok(known);
        }
        let own = bank.half / bank.step;
        let tables = self.tables(own)?;
        let (scratch, part) = &mut *self.scratch.borrow_mut();
        scratch.forget_plan();
        let mut rows = self.at_places(bank, tables.basis.degrees() + 1, |centres, every, rows| {
            let (windows, record) = (centres.start - own..centres.end - own, self.means.of(bank.step));
            tables.coefficients().project(record, windows, every, part, scratch);
            let found = part.coefficients.iter().chain([&part.level]);
            rows.iter_mut().zip(found).for_each(|(row, found)| row.extend(found));
        });
        let level = rows.pop().unwrap_or_default();
        let all = Rc::new(Projected { level, coefficients: rows, residual: Vec::new() });
        self.known.borrow_mut().push((bank.half, Rc::clone(&all)));
        Ok(all)
    }

    fn known_coefficients(&self, bank: &Bank) -> Option<Rc<Projected>> {
        let known = self.known.borrow();
        known.iter().find(|(one, _)| *one == bank.half).map(|(_, coefficients)| Rc::clone(coefficients))
    }

    /// Rows of numbers at all places of a window, NaN where it does not fit. The function appends to every row the numbers at every so many of
    /// some centres.
    fn at_places(
        &self,
        bank: &Bank,
        rows: usize,
        mut append: impl FnMut(Range<usize>, usize, &mut [Vec<f64>]),
    ) -> Vec<Vec<f64>> {
        let samples = self.record().len();
        let places = Grid::new(samples, self.step_of(bank));
        let count = self.stretches.iter().map(|stretch| places.means(stretch).len()).sum();
        let mut rows: Vec<Vec<f64>> = (0..rows).map(|_| Vec::with_capacity(count)).collect();
        let resize = |rows: &mut [Vec<f64>], count: usize| {
            for row in rows {
                row.resize(count, f64::NAN);
            }
        };
        for stretch in &self.stretches {
            let inside = places.means(stretch);
            let (wanted, centres) = bank.places(samples, places, &inside);
            let before = rows[0].len();
            if !wanted.is_empty() {
                resize(&mut rows, before + wanted.start - inside.start);
                append(centres, places.step / bank.step, &mut rows);
            }
            resize(&mut rows, before + inside.len());
        }
        rows
    }
}
