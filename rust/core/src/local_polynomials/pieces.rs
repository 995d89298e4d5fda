//! Records cut into pieces of work: parts of a long one, or several short ones side by side.

use std::ops::Range;

use crate::exec::pool::Piece;
use crate::local_polynomials::estimates::Estimates;
use crate::record::samples::Samples;

/// Samples in a piece of work, about: well below 20 ms on any processor, so that a call can be interrupted.
pub(crate) const PIECE: usize = 1 << 14;

/// A piece of work: some samples of a record, or all that are wanted of several.
pub(crate) struct PartOfRecords<'a, 'b> {
    pub(crate) records: &'a [&'a dyn Samples],
    pub(crate) samples: Range<usize>,
    /// Elements of each record.
    pub(crate) elements: usize,
    pub(crate) estimates: Estimates<'b>,
}

/// Where records of one length are cut.
pub(crate) struct Cuts {
    /// The samples that are wanted.
    pub(crate) samples: Range<usize>,
    /// Samples before the one at the centre of the first window, and the number of windows.
    pub(crate) before: usize,
    pub(crate) windows: usize,
    /// Windows in a piece of a record.
    pub(crate) piece: usize,
}

impl Cuts {
    /// Pieces of records whose estimates lie end to end, so many of them together where `joins` says that it is worth it.
    pub(crate) fn pieces<'a, 'b>(
        &self,
        records: &'a [&'a dyn Samples],
        mut estimates: Estimates<'b>,
        together: usize,
        joins: impl Fn(usize) -> bool,
    ) -> Vec<Piece<PartOfRecords<'a, 'b>>> {
        let (samples, mut pieces) = (&self.samples, Vec::new());
        let elements = estimates.elements.of(0..samples.end).len();
        for group in records.chunks(together.max(1)) {
            if joins(group.len()) {
                let (samples, estimates) = (samples.clone(), estimates.split_off(group.len() * elements));
                let size = group.len() * samples.len();
                pieces.push(Piece { size, content: PartOfRecords { records: group, samples, elements, estimates } });
                continue;
            }
            for records in group.chunks(1) {
                self.cut(records, estimates.split_off(elements), &mut pieces);
            }
        }
        pieces
    }

    /// Cuts one record.
    fn cut<'a, 'b>(
        &self,
        records: &'a [&'a dyn Samples],
        mut estimates: Estimates<'b>,
        pieces: &mut Vec<Piece<PartOfRecords<'a, 'b>>>,
    ) {
        let Self { samples, before, windows, piece } = self;
        let mut first = samples.start;
        while first < samples.end {
            let next = (first.max(*before) - before) / piece * piece + piece + before;
            let end = if next >= before + windows { samples.end } else { next.min(samples.end) };
            let elements = estimates.elements.of(0..end).len();
            let part =
                PartOfRecords { records, samples: first..end, elements, estimates: estimates.split_off_before(end) };
            pieces.push(Piece { size: end - first, content: part });
            first = end;
        }
    }
}
