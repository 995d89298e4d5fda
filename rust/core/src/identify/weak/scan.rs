//! Scanning the width of the test function: do equations of every scale agree, and which widths may be believed?

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::scanned::{BLOCKS, LONGER, Scan, Scans, wider};
use crate::identify::weak::session::Session;
use crate::inference::scales::AtScale;
use crate::regression::block_fit::fit_in_blocks;
use crate::regression::model::Model;
use crate::regression::subsample::stretches_of_blocks;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};
use crate::weak_form::test_function_choice::spectrum_length;
use crate::weak_form::weak_rows::WeakRows;

/// The exponent where none is given.
const EXPONENT: usize = 9;
/// Typical cycles of the motion that blocks last in which windowed unknowns grow linearly, and the fewest blocks.
const CYCLES: [f64; 3] = [3.0, 6.0, 12.0];
const FEWEST_BLOCKS: usize = 8;
/// Samples of a long record that are scanned, in so many stretches.
const MOST_SAMPLES: usize = 1 << 17;
const STRETCHES: usize = 8;

impl Session<'_, '_, '_> {
    /// Scans the widths unless that was done, moves to the plateau where the test function that the spectra suggest is off it, and on to wider ones where
    /// windows follow noise.
    pub(crate) fn onto_plateau(
        &mut self,
        chosen: Chosen,
        model: &Model,
        scans: &mut Option<Scans>,
    ) -> Result<Chosen, Error> {
        let given = self.options.half_width.is_some();
        // Without a coefficient of the motion among the unknowns there is nothing that widths could tell apart.
        let moves = self.unknowns().iter().any(|&unknown| unknown < 3);
        if given && !self.options.diagnose || !moves {
            return Ok(chosen);
        }
        let scans = match scans {
            Some(scans) => scans,
            None => scans.insert(self.scan(model)?),
        };
        let before = chosen.weak.function.half_width();
        let moved = if given { None } else { scans.believed(before) };
        let half_width = moved.unwrap_or(before);
        self.scan = scans.best.clone();
        let mut chosen = if half_width == before { chosen } else { self.chosen_with(half_width, model)? };
        if !given && self.options.averaging {
            chosen = self.without_shortest_windows(chosen, model)?;
        }
        let used = chosen.weak.function.half_width();
        self.scan.moved = used != before;
        self.scan.contradicted = scans.contradict(used);
        Ok(chosen)
    }

    /// Rows of a half-width.
    fn chosen_with(&mut self, half_width: usize, model: &Model) -> Result<Chosen, Error> {
        let exponent = self.options.exponent.unwrap_or(EXPONENT);
        let weak = self.rows(TestFunction::new(half_width, exponent, self.options.delta)?)?;
        let parameters = self.pilot(&weak, model)?;
        Ok(Chosen { weak, parameters, at_end: false, fitted: None })
    }

    /// The first test function, of one and wider ones of the plateau, whose best windows are not the shortest there are; the widest where all
    /// are.
    ///
    /// Noise that was low-passed, held or rounded is correlated over many samples: in narrow test functions short windows follow it as if it
    /// were motion. In wider ones, whose band ends below the noise's corner, it is as good as white.
    fn without_shortest_windows(&mut self, first: Chosen, model: &Model) -> Result<Chosen, Error> {
        let mut width = first.weak.function.half_width();
        let widest = self.scan.plateau.map_or(0, |plateau| self.scan.scales[plateau.last].half_width);
        let mut tried = first;
        loop {
            let fitted = self.fit_first(&tried, model)?;
            let shortest = fitted.has_shortest_windows();
            tried.fitted = Some(fitted);
            width *= 2;
            if !shortest || self.scan.has_no_plateau() || width > widest {
                return Ok(tried);
            }
            tried = self.chosen_with(width, model)?;
        }
    }

    /// Estimates what is constant with test functions of all widths, and looks for widths that agree.
    fn scan(&mut self, model: &Model) -> Result<Scans, Error> {
        let model = &with_constants(model);
        let samples = self.record.angle.len();
        let widest = samples / if model.windowed.is_empty() { 8 } else { 16 };
        let cycle =
            if model.windowed.is_empty() { 0.0 } else { self.evidence(spectrum_length(samples, 200))?.period() };
        let lengths: Vec<Option<f64>> =
            if model.windowed.is_empty() { vec![None] } else { CYCLES.map(|cycles| Some(cycles * cycle)).to_vec() };
        let noises = [self.noise[0], 0.0];
        let noises = if noises[0] > 0.0 { &noises[..] } else { &noises[1..] };
        let new = |&noise: &f64| Scan { unknowns: model.constant.clone(), corrected: noise > 0.0, ..Scan::default() };
        // By the length of blocks, then by the correction for noise.
        let mut scans: Vec<Vec<Scan>> = lengths.iter().map(|_| noises.iter().map(new).collect()).collect();
        let mut half = LEAST_HALF_WIDTH;
        while 2 * half < widest {
            let function = TestFunction::new(half, self.options.exponent.unwrap_or(EXPONENT), self.options.delta)?;
            let (weak, stretches) = self.rows_to_scan(function)?;
            let fits_of = |length: Option<f64>| {
                let blocks = blocks(&weak, &stretches, length);
                let few = length.is_some() && blocks.iter().any(|block| block.len() < 2 * weak.reach());
                if few { Vec::new() } else { fit_in_blocks(&weak.rows, model, noises, &blocks, weak.reach()) }
            };
            let pieces = lengths.iter().map(|&length| Piece { size: weak.rows.len(), content: length }).collect();
            let fits = self.stages.map(pieces, || (), |length, (): &mut ()| fits_of(length))?;
            for (scans, fits) in scans.iter_mut().zip(fits) {
                for scan in scans.iter_mut() {
                    scan.tried += 1;
                }
                for (scan, fit) in scans.iter_mut().zip(fits) {
                    scan.scales.extend(fit.map(|fit| AtScale::new(&function, fit)));
                }
            }
            half = wider(half);
        }
        for scan in scans.iter_mut().flatten() {
            scan.find_plateau();
        }
        let mut best: Option<Scan> = None;
        let mut corrected: Option<Scan> = None;
        // Where plateaus are equally long, the one with the correction stands.
        for scan in (0..noises.len()).flat_map(|noise| scans.iter().map(move |scans| scans[noise].clone())) {
            let longer = |than: &Option<Scan>| than.as_ref().is_none_or(|than| scan.factor() > LONGER * than.factor());
            if scan.corrected == (self.noise[0] > 0.0) && longer(&corrected) {
                corrected = Some(scan.clone());
            }
            if longer(&best)
                || best.as_ref().is_some_and(|best| best.factor() <= 1.0 && scan.scales.len() > best.scales.len())
            {
                best = Some(scan);
            }
        }
        Ok(Scans { best: best.unwrap_or_default(), corrected: corrected.unwrap_or_default() })
    }

    /// Rows of all of a record, or of stretches of a long one, and where the stretches begin and end among them.
    fn rows_to_scan(&mut self, function: TestFunction) -> Result<(WeakRows, Vec<Range<usize>>), Error> {
        let samples = self.record.angle.len();
        let count = WeakRows::count(function, samples);
        let stretches = if samples <= 2 * MOST_SAMPLES {
            None
        } else {
            Some(stretches_of_blocks(count, MOST_SAMPLES / function.stride(), STRETCHES))
        };
        let (record, delta, workers) = (&self.record, self.options.delta, self.stages.workers);
        let weak = self
            .stages
            .stage(|watch| WeakRows::build(record, function, delta, stretches.as_deref(), workers, watch))?;
        let whole = std::slice::from_ref(&(0..count)).to_vec();
        let ends = stretches.unwrap_or(whole).into_iter().scan(0, |end, stretch| {
            let first = *end;
            *end += stretch.len();
            Some(first..*end)
        });
        Ok((weak, ends.collect()))
    }
}

/// A model with something to compare: unknowns that the record's windows hold are compared as means of the record where nothing is constant.
fn with_constants(model: &Model) -> Model {
    if !model.constant.is_empty() || model.windowed.is_empty() {
        return model.clone();
    }
    let (constant, windowed): (Vec<_>, Vec<_>) = model.windowed.iter().partition(|&&index| index < 2);
    if constant.is_empty() {
        return Model { constant: windowed, windowed: Vec::new(), linear: model.linear };
    }
    Model { constant, windowed, linear: model.linear }
}

/// Blocks of rows: of a length in samples, or so many of a record.
fn blocks(weak: &WeakRows, stretches: &[Range<usize>], length: Option<f64>) -> Vec<Range<usize>> {
    let rows: usize = stretches.iter().map(Range::len).sum();
    let part = |stretch: &Range<usize>| -> Vec<Range<usize>> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the rows")]
        let count = match length {
            Some(length) => (stretch.len() as f64 * weak.stride as f64 / length).ceil().max(1.0) as usize,
            None => (BLOCKS * stretch.len()).div_ceil(rows.max(1)),
        };
        let count = count.max(FEWEST_BLOCKS.div_ceil(stretches.len())).min(stretch.len().max(1));
        let at = |index: usize| stretch.start + stretch.len() * index / count;
        (0..count).map(|index| at(index)..at(index + 1)).collect()
    };
    stretches.iter().flat_map(part).collect()
}
