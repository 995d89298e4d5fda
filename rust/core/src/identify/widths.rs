//! Comparing what rows of different widths say of the constants: blocks of a record, fits in them, and the widths that agree.
//!
//! Either form brings rows of its own, of test functions or of polynomials in windows of a length.

use std::ops::Range;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::identify::scanned::{BLOCKS, LONGER, Scan, Scans};
use crate::inference::scales::AtScale;
use crate::regression::block_fit::{NoFit, fit_in_blocks};
use crate::regression::model::Model;

/// Typical cycles of the motion that blocks last in which windowed unknowns grow linearly, and the fewest blocks.
const CYCLES: [f64; 3] = [3.0, 6.0, 12.0];
const FEWEST_BLOCKS: usize = 8;
/// Where so many blocks do not determine constants beside what is windowed, something else than their number is in the way.
const ENOUGH_BLOCKS: usize = 2 * FEWEST_BLOCKS;
/// Samples of a long record that are scanned, in so many stretches.
pub(crate) const MOST_SAMPLES: usize = 1 << 17;
pub(crate) const STRETCHES: usize = 8;

/// The rows of one width.
pub(crate) struct OfWidth<'a> {
    pub(crate) rows: &'a Rows,
    /// Where stretches of the record begin and end among them.
    pub(crate) stretches: &'a [Range<usize>],
    /// Samples from one row to the next.
    pub(crate) stride: usize,
    /// Rows on either side of one that share samples with it.
    pub(crate) reach: usize,
    /// Samples on either side of the centre, and the band in hertz.
    pub(crate) scale: (usize, f64),
}

/// Widths that are compared.
pub(crate) struct Widths {
    /// A model with constants to compare.
    model: Model,
    /// Samples of a block; `None` for a number of blocks.
    lengths: Vec<Option<f64>>,
    /// Variances of the angle's noise that estimates are corrected for.
    noises: Vec<f64>,
    /// By the length of blocks, then by the correction for noise.
    scans: Vec<Vec<Scan>>,
}

impl Widths {
    /// Of a model whose angle has noise of some variance, zero for none that estimates are to be corrected for, and whose motion has typical
    /// cycles of so many samples.
    pub(crate) fn new(model: &Model, noise: f64, cycle: impl FnOnce() -> Result<f64, Error>) -> Result<Self, Error> {
        let model = with_constants(model);
        let lengths = if model.windowed.is_empty() {
            vec![None]
        } else {
            let cycle = cycle()?;
            CYCLES.map(|cycles| Some(cycles * cycle)).to_vec()
        };
        let noises = if noise > 0.0 { vec![noise, 0.0] } else { vec![0.0] };
        let new = |&noise: &f64| Scan { unknowns: model.constant.clone(), corrected: noise > 0.0, ..Scan::default() };
        let scans = lengths.iter().map(|_| noises.iter().map(new).collect()).collect();
        Ok(Self { model, lengths, noises, scans })
    }

    /// The widest that a record of so many samples has room for.
    pub(crate) fn widest(&self, samples: usize) -> usize {
        samples / if self.model.windowed.is_empty() { 8 } else { 16 }
    }

    /// Estimates the constants with the rows of one more width.
    pub(crate) fn add(&mut self, one: &OfWidth<'_>, stages: &mut Stages<'_, '_>) -> Result<(), Error> {
        let fits_of = |length: Option<f64>| {
            let blocks = blocks(one, length);
            let few = length.is_some() && blocks.iter().any(|block| block.len() < 2 * one.reach);
            let fits = if few {
                vec![Err(NoFit::TooFewBlocks); self.noises.len()]
            } else {
                fit_in_blocks(one.rows, &self.model, &self.noises, &blocks, one.reach)
            };
            (fits, length.is_none() || blocks.len() >= ENOUGH_BLOCKS)
        };
        let pieces = self.lengths.iter().map(|&length| Piece { size: one.rows.len(), content: length }).collect();
        let fits = stages.map(pieces, || (), |length, (): &mut ()| fits_of(length))?;
        for (scans, (fits, enough)) in self.scans.iter_mut().zip(fits) {
            for (scan, fit) in scans.iter_mut().zip(fits) {
                // Too few blocks for the constants mean that the record is short, which says nothing against them; one block that holds all
                // that is known does.
                scan.tried += usize::from(enough || !matches!(fit, Err(NoFit::TooFewBlocks)));
                scan.scales.extend(fit.ok().map(|fit| AtScale::new(one.scale, fit)));
            }
        }
        Ok(())
    }

    /// What blocks of each length say with one of the corrections, from the shortest on and up to where longer ones contradict them: in these
    /// what is windowed does not grow linearly, which makes all widths wrong alike.
    fn unbiased(&self, noise: usize) -> Vec<Scan> {
        let mut found: Vec<Scan> = Vec::new();
        for scan in self.scans.iter().map(|scans| &scans[noise]) {
            if found.last().is_some_and(|shorter| shorter.contradicts(scan)) {
                break;
            }
            found.push(scan.clone());
        }
        found
    }

    /// The longest plateau, and the longest of those with the correction for noise.
    pub(crate) fn plateaus(&mut self) -> Scans {
        self.scans.iter_mut().flatten().for_each(Scan::find_plateau);
        self.longest_plateaus()
    }

    /// The same; where there is none, of widths that are alike, whose differences errors have to hold.
    pub(crate) fn plateaus_or_alike(&mut self) -> Scans {
        let found = self.plateaus();
        if !found.best.has_no_plateau() {
            return found;
        }
        self.scans.iter_mut().flatten().for_each(Scan::find_widths_alike);
        self.longest_plateaus()
    }

    /// Where plateaus are equally long, the one with the correction for noise stands.
    fn longest_plateaus(&self) -> Scans {
        let is_noisy = self.noises[0] > 0.0;
        let (mut best, mut corrected): (Option<Scan>, Option<Scan>) = (None, None);
        for scan in (0..self.noises.len()).flat_map(|noise| self.unbiased(noise)) {
            let longer = |than: &Option<Scan>| than.as_ref().is_none_or(|than| scan.factor() > LONGER * than.factor());
            if scan.corrected == is_noisy && longer(&corrected) {
                corrected = Some(scan.clone());
            }
            if longer(&best)
                || best.as_ref().is_some_and(|best| best.factor() <= 1.0 && scan.scales.len() > best.scales.len())
            {
                best = Some(scan);
            }
        }
        Scans { best: best.unwrap_or_default(), corrected: corrected.unwrap_or_default() }
    }
}

/// A model with something to compare: unknowns that the record's windows hold are compared as means of the record where nothing is constant.
fn with_constants(model: &Model) -> Model {
    if !model.constant.is_empty() || model.windowed.is_empty() {
        return model.clone();
    }
    let (constant, windowed): (Vec<_>, Vec<_>) = model.windowed.iter().partition(|&&index| index < 2);
    if constant.is_empty() {
        return Model { constant: windowed, windowed: Vec::new(), ..model.clone() };
    }
    Model { windowed, constant, ..model.clone() }
}

/// Blocks of rows: of a length in samples, or so many of a record.
fn blocks(one: &OfWidth<'_>, length: Option<f64>) -> Vec<Range<usize>> {
    let rows: usize = one.stretches.iter().map(Range::len).sum();
    let part = |stretch: &Range<usize>| -> Vec<Range<usize>> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the rows")]
        let count = match length {
            Some(length) => (stretch.len() as f64 * one.stride as f64 / length).ceil().max(1.0) as usize,
            None => (BLOCKS * stretch.len()).div_ceil(rows.max(1)),
        };
        let count = count.max(FEWEST_BLOCKS.div_ceil(one.stretches.len())).min(stretch.len().max(1));
        let at = |index: usize| stretch.start + stretch.len() * index / count;
        (0..count).map(|index| at(index)..at(index + 1)).collect()
    };
    one.stretches.iter().flat_map(part).collect()
}
