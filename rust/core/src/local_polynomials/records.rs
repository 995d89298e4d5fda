//! Many records in one call, in parallel: long ones piece by piece, short ones side by side.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{self, GoOn, Piece, Watch};
use crate::local_polynomials::boundary::End;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::order_shares::{Selector, Wanted};
use crate::local_polynomials::pieces::{Cuts, PIECE, PartOfRecords};
use crate::local_polynomials::plan::{LocalPolynomials, PolynomialScratch};
use crate::local_polynomials::side_by_side::SideBySide;
use crate::record::samples::Samples;

impl LocalPolynomials {
    /// Estimates at all samples of records of one length, in parallel. Every element of the outputs must belong to a sample; those of the
    /// records lie end to end.
    ///
    /// The numbers depend neither on the number of workers nor on the other records.
    ///
    /// # Errors
    /// If a record is shorter than the window, or the watch cancels.
    ///
    /// # Panics
    /// If records have different lengths.
    pub fn run(
        &self,
        records: &[&dyn Samples],
        estimates: Estimates<'_>,
        ends: bool,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        self.run_part(records, estimates, ends, None, workers, watch)
    }

    /// The same at the samples of a part, to which every element of the outputs must belong.
    ///
    /// # Errors
    /// As [`LocalPolynomials::run`].
    ///
    /// # Panics
    /// As [`LocalPolynomials::run`].
    pub fn run_part(
        &self,
        records: &[&dyn Samples],
        estimates: Estimates<'_>,
        ends: bool,
        part: Option<&Range<usize>>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let work = |part: PartOfRecords<'_, '_>, scratch: &mut PolynomialScratch, go_on: &GoOn<'_>| {
            let PartOfRecords { records, samples, elements, mut estimates } = part;
            let outcome = match records {
                [record] if ends => {
                    self.everywhere(*record, samples, (Wanted::Derivatives, go_on), &mut estimates, scratch)
                }
                [record] => self.estimate_centred(*record, samples, &mut estimates, scratch),
                _ => self.side_by_side(records, ends, elements, &mut estimates, scratch),
            };
            debug_assert_eq!(outcome, Ok(()), "the lengths of all records were checked");
        };
        let pieces = self.pieces(records, estimates, ends, part, Wanted::Derivatives)?;
        self.ask_for_scratch(Wanted::Derivatives, workers.get().min(pieces.len()))?;
        pool::run_long(pieces, workers, || self.scratch(), work, watch)
    }

    /// Estimates at all samples of a few records, side by side.
    fn side_by_side(
        &self,
        records: &[&dyn Samples],
        ends: bool,
        elements: usize,
        estimates: &mut Estimates<'_>,
        scratch: &mut PolynomialScratch,
    ) -> Result<(), Error> {
        let (samples, half) = (records.first().map_or(0, |record| record.len()), self.options().window_length / 2);
        self.windows(samples)?;
        let PolynomialScratch { walk, beside, .. } = scratch;
        let instructions = self.options().instructions;
        let beside = match beside {
            Some(beside) if beside.samples() == samples => beside,
            _ => beside.insert(SideBySide::new(samples, instructions.lanes())),
        };
        beside.load(records, instructions);
        self.engine.walk_side_by_side(beside, elements, estimates, walk);
        if ends {
            for (end, samples) in [(End::First, 0..half), (End::Last, samples - half..samples)] {
                self.ends.estimate_side_by_side(self.basis(), beside, end, samples, elements, estimates);
            }
        }
        Ok(())
    }

    /// Standard errors in the place of derivatives, at all samples of records of one length, in parallel.
    ///
    /// They are the noise times the gain of the order that is given; where it was chosen, `Σ w_n √(σ_n² g_n² + (d_n - d)²)`,
    /// `d` the estimate. The plan must know the noise, and all outputs must be wanted.
    ///
    /// # Errors
    /// As [`LocalPolynomials::run`].
    ///
    /// # Panics
    /// As [`LocalPolynomials::run`].
    pub fn errors(
        &self,
        records: &[&dyn Samples],
        estimates: Estimates<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        self.errors_of_part(records, estimates, None, workers, watch)
    }

    /// The same at the samples of a part, to which every element of the outputs must belong.
    ///
    /// # Errors
    /// As [`LocalPolynomials::run`].
    ///
    /// # Panics
    /// As [`LocalPolynomials::run`].
    pub fn errors_of_part(
        &self,
        records: &[&dyn Samples],
        estimates: Estimates<'_>,
        part: Option<&Range<usize>>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let work = |mut part: PartOfRecords<'_, '_>, scratch: &mut PolynomialScratch, go_on: &GoOn<'_>| {
            for record in part.records {
                let (samples, estimates) = (part.samples.clone(), &mut part.estimates);
                let outcome = self.everywhere(*record, samples, (Wanted::Errors, go_on), estimates, scratch);
                debug_assert_eq!(outcome, Ok(()), "the lengths of all records were checked");
            }
        };
        let pieces = self.pieces(records, estimates, true, part, Wanted::Errors)?;
        self.ask_for_scratch(Wanted::Errors, workers.get().min(pieces.len()))?;
        pool::run_long(pieces, workers, || self.scratch_for(Wanted::Errors), work, watch)
    }

    /// Cuts records into pieces of work.
    fn pieces<'a, 'b>(
        &self,
        records: &'a [&'a dyn Samples],
        estimates: Estimates<'b>,
        ends: bool,
        part: Option<&Range<usize>>,
        wanted: Wanted,
    ) -> Result<Vec<Piece<PartOfRecords<'a, 'b>>>, Error> {
        let Some(first) = records.first() else { return Ok(Vec::new()) };
        let length = first.len();
        assert!(records.iter().all(|record| record.len() == length), "records have one length");
        let (windows, before, step) = (self.windows(length)?, self.before_centre(), estimates.elements.step);
        let there = if ends { 0..length } else { before..before + windows };
        let samples = part.map_or(there.clone(), |part| part.start.max(there.start)..part.end.min(there.end));
        let selector = self.selector(wanted);
        let piece = PIECE.max(selector.map_or(0, Selector::least_piece)).next_multiple_of(self.engine.stride(step));
        let lanes = self.options().instructions.lanes();
        let short = wanted == Wanted::Derivatives && selector.is_none() && samples == there && length * lanes <= PIECE;
        let joins = |records: usize| short && self.engine.joins(records, windows, step);
        Ok(Cuts { samples, before, windows, piece }.pieces(records, estimates, lanes, joins))
    }
}
