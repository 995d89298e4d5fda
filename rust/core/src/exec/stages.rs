//! The stages of one long call: their worker threads and their share of the progress.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{self, Piece, Watch, ranges};

/// Worker threads and progress of a call that consists of several stages.
pub(crate) struct Stages<'a, 'b> {
    pub(crate) workers: NonZeroUsize,
    watch: &'a mut Watch<'b>,
    /// The total that the watch is told.
    total: usize,
    /// What it was told.
    told: usize,
    /// Stages done, and the expected number of stages.
    done: usize,
    expected: usize,
}

impl<'a, 'b> Stages<'a, 'b> {
    pub(crate) fn new(workers: NonZeroUsize, total: usize, expected: usize, watch: &'a mut Watch<'b>) -> Self {
        Self { workers, watch, total, told: 0, done: 0, expected }
    }

    /// Does every piece once and returns what each gave, in their order.
    pub(crate) fn map<P: Send, S, R: Send>(
        &mut self,
        pieces: Vec<Piece<P>>,
        scratch: impl Fn() -> S + Sync,
        work: impl Fn(P, &mut S) -> R + Sync,
    ) -> Result<Vec<R>, Error> {
        let workers = self.workers;
        self.stage(|watch| pool::map(pieces, workers, scratch, work, watch))
    }

    /// Fills columns in pieces: `work` gets some rows and their part of every column.
    pub(crate) fn fill<'c>(
        &mut self,
        columns: impl IntoIterator<Item = &'c mut Vec<f64>>,
        work: impl Fn(Range<usize>, &mut [&mut [f64]]) + Sync,
    ) -> Result<(), Error> {
        let mut columns: Vec<_> = columns.into_iter().map(Vec::as_mut_slice).collect();
        let rows = columns.first().map_or(0, |column| column.len());
        let cut = |Piece { size, content }: Piece<Range<usize>>| {
            let parts = columns.iter_mut().filter_map(|column| column.split_off_mut(..size)).collect();
            Piece { size, content: (content, parts) }
        };
        let pieces = ranges(rows).into_iter().map(cut).collect();
        self.map(
            pieces,
            || (),
            |(rows, mut parts): (Range<usize>, Vec<&mut [f64]>), (): &mut ()| work(rows, &mut parts),
        )?;
        Ok(())
    }

    /// Tells the watch that all is done, however many stages there were.
    pub(crate) fn finish(&mut self) -> Result<(), Error> {
        if (self.watch)(self.total, self.total) { Ok(()) } else { Err(Error::Cancelled) }
    }

    /// Does one stage, of which the watch sees its share of the whole. Work that begins anew within it is told as nothing new.
    pub(crate) fn stage<R>(&mut self, work: impl FnOnce(&mut Watch<'_>) -> Result<R, Error>) -> Result<R, Error> {
        let (total, expected, done) = (self.total, self.expected, self.done);
        let (watch, told) = (&mut *self.watch, &mut self.told);
        let share = |part: f64| (total as f64 * ((done as f64 + part) / expected as f64).min(1.0)).floor();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between zero and the total")]
        let result = work(&mut |now, all| {
            *told = (*told).max(share(now as f64 / all.max(1) as f64) as usize);
            watch(*told, total)
        });
        self.done += 1;
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_never_goes_back_where_a_stage_does_several_works() {
        let mut told = Vec::new();
        let mut watch = |done: usize, total: usize| {
            told.push((done, total));
            true
        };
        let mut stages = Stages::new(NonZeroUsize::MIN, 100, 4, &mut watch);
        for _ in 0..6 {
            let of_two_works = |watch: &mut Watch<'_>| {
                for (done, total) in [(0, 7), (7, 7), (0, 3), (2, 3), (3, 3)] {
                    assert!(watch(done, total));
                }
                Ok(())
            };
            assert_eq!(stages.stage(of_two_works), Ok(()));
        }
        assert_eq!(stages.finish(), Ok(()));
        assert!(told.is_sorted());
        assert_eq!((told[0], told.last()), ((0, 100), Some(&(100, 100))));
    }
}
