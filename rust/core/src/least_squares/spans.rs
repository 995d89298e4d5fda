//! Which rows lie in windows of a duration on irregular times, and which windows reach over one boundary.

use std::ops::Range;
use std::sync::Arc;

use crate::error::Error;
use crate::exec::huge_pages::zeros;
use crate::least_squares::row_times::RowTimes;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES, dispatch};

/// Times that are compared with the borders of neighbouring windows at a time: where no more lie between these, no branch is foreseen wrongly.
const LOOKED_AT: usize = 12;

/// One window of a duration for every row: it holds the rows from `begin` after the time of its own row on, up to before `duration` later.
/// No window begins or ends before the one before it.
#[derive(Clone, Debug)]
pub struct Spans {
    times: Arc<RowTimes>,
    begin: f64,
    duration: f64,
    runs: Vec<Run>,
    /// Rows of every window before the boundary of its run, and from there on.
    before: Vec<u32>,
    after: Vec<u32>,
    most: usize,
    fewest: usize,
}

/// Windows that reach up to a boundary or over it.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) windows: Range<usize>,
    /// Rows before this one, and from it on.
    pub(crate) boundary: usize,
    pub(crate) before: usize,
    pub(crate) after: usize,
}

/// The places that windows begin and end at, which only move on.
#[derive(Clone, Copy, Debug, Default)]
struct SpanPlaces {
    first: usize,
    end: usize,
}

/// The rows of neighbouring windows, one in each of the first lanes: first rows, and those after the last.
struct RowsSpanned {
    count: usize,
    first: [usize; MOST_LANES],
    end: [usize; MOST_LANES],
}

impl Spans {
    /// The windows of a duration around, before or after the times of rows, which must [`RowTimes::increase`].
    ///
    /// # Errors
    /// If there is not the memory for what they hold.
    ///
    /// # Panics
    /// If times do not increase, or spans are no numbers.
    pub fn new(times: Arc<RowTimes>, begin: f64, duration: f64, instructions: Instructions) -> Result<Self, Error> {
        assert!(times.increase() && begin.is_finite() && (0.0..f64::INFINITY).contains(&duration), "spans in order");
        let count = times.since.len();
        if u32::try_from(count).is_err() {
            return Err(Error::Memory { bytes: usize::MAX });
        }
        let (before, after) = (zeros(count)?, zeros(count)?);
        let mut spans = Self { times, begin, duration, runs: Vec::new(), before, after, most: 0, fewest: usize::MAX };
        dispatch(instructions, SpanSurvey(&mut spans));
        Ok(spans)
    }

    /// Rows, and windows.
    #[must_use]
    pub fn count(&self) -> usize {
        self.times.since.len()
    }

    /// Rows in the window that holds most of them, and in the one that holds fewest.
    #[must_use]
    pub fn most_and_fewest(&self) -> (usize, usize) {
        (self.most, self.fewest)
    }

    /// Windows that hold fewer rows than that.
    #[must_use]
    pub fn fewer_than(&self, least: usize) -> Vec<usize> {
        if self.fewest >= least {
            return Vec::new();
        }
        (0..self.count()).filter(|&window| self.held(window) < least).collect()
    }

    /// Windows that reach farther than `reach` beyond the first or the last row, and how much of their duration is no farther than that.
    #[must_use]
    pub fn near_ends(&self, reach: f64) -> (Vec<usize>, Vec<f64>) {
        let (since, length) = (&self.times.since, self.times.length());
        let begin = |time: f64| time + self.begin;
        let from_start = since.partition_point(|&time| begin(time) < -reach);
        let to_end = since.partition_point(|&time| begin(time) + self.duration <= length + reach).max(from_start);
        let within = |window: usize| {
            let begin = begin(since[window]);
            (begin + self.duration).min(length + reach) - begin.max(-reach)
        };
        let windows: Vec<usize> = (0..from_start).chain(to_end..since.len()).collect();
        let within = windows.iter().map(|&window| within(window)).collect();
        (windows, within)
    }

    pub(crate) fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// How many rows some windows hold before the boundary of their run, and from there on.
    #[inline(always)]
    pub(crate) fn around_boundary(&self, windows: Range<usize>) -> (&[u32], &[u32]) {
        (&self.before[windows.clone()], &self.after[windows])
    }

    /// Rows of a window.
    fn held(&self, window: usize) -> usize {
        self.before[window] as usize + self.after[window] as usize
    }
}

impl Run {
    /// Some neighbouring windows, as far as there are so many.
    pub(crate) fn some(&self, first: usize, count: usize) -> Range<usize> {
        let of = |window: usize| self.windows.end.min(self.windows.start + window);
        of(first)..of(first + count)
    }
}

impl SpanPlaces {
    /// The rows of the windows from one on up to before another, as many as there are lanes.
    #[inline(always)]
    fn next<S: Lanes>(&mut self, simd: S, spans: &Spans, windows: Range<usize>) -> RowsSpanned {
        let since = &spans.times.since[..];
        let count = S::F64_LANES.min(windows.len());
        let own = if count == S::F64_LANES {
            simd.load(since, windows.start)
        } else {
            let mut own = [since[windows.start + count - 1]; MOST_LANES];
            own[..count].copy_from_slice(&since[windows.start..windows.start + count]);
            simd.load(&own, 0)
        };
        let begins = simd.add_f64s(own, simd.splat_f64s(spans.begin));
        let ends = simd.add_f64s(begins, simd.splat_f64s(spans.duration));
        let (first, first_of) = not_before(simd, since, self.first, begins);
        let (end, end_of) = not_before(simd, since, self.end, ends);
        *self = Self { first, end };
        RowsSpanned { count, first: first_of, end: end_of }
    }
}

/// For times that never decrease from lane to lane, the first row that is not before each, from a row on: that of the last lane, and all.
#[inline(always)]
fn not_before<S: Lanes>(simd: S, since: &[f64], from: usize, times: S::f64s) -> (usize, [usize; MOST_LANES]) {
    let mut lanes = [0.0; MOST_LANES];
    simd.store(&mut lanes, 0, times);
    let last = lanes[S::F64_LANES - 1];
    let (one, none) = (simd.splat_u64s(1), simd.splat_u64s(0));
    let (mut passed, mut rest) = (none, &since[from..]);
    // So many at a time without asking: those that are not before the last are before none.
    while let Some((some, others)) = rest.split_first_chunk::<LOOKED_AT>() {
        for &time in some {
            let is_before = simd.less_than_f64s(simd.splat_f64s(time), times);
            passed = simd.add_u64s(passed, simd.select_u64s(is_before, one, none));
        }
        rest = others;
        if some[LOOKED_AT - 1] >= last {
            rest = &[];
        }
    }
    for &time in rest {
        let is_before = simd.less_than_f64s(simd.splat_f64s(time), times);
        passed = simd.add_u64s(passed, simd.select_u64s(is_before, one, none));
    }
    simd.store(&mut lanes, 0, simd.transmute_f64s_u64s(passed));
    let mut rows = [from; MOST_LANES];
    for (row, passed) in rows[..S::F64_LANES].iter_mut().zip(lanes) {
        *row += usize::try_from(passed.to_bits()).unwrap_or(usize::MAX);
    }
    (rows[S::F64_LANES - 1], rows)
}

/// The kernel that finds the runs of windows and how many rows they hold.
struct SpanSurvey<'a>(&'a mut Spans);

impl Kernel for SpanSurvey<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self(spans) = self;
        let total = spans.count();
        let (mut runs, mut most, mut fewest) = (Vec::<Run>::new(), 0, usize::MAX);
        let (mut befores, mut afters) = (std::mem::take(&mut spans.before), std::mem::take(&mut spans.after));
        // No run yet: the first window is beyond its boundary.
        let (mut walk, mut boundary, mut end) = (SpanPlaces::default(), None, 0);
        for window in (0..total).step_by(S::F64_LANES) {
            let rows = walk.next(simd, spans, window..total);
            // In the lanes beyond the last window it stands again.
            for lane in 0..S::F64_LANES {
                let held = rows.end[lane] - rows.first[lane];
                most = most.max(held);
                fewest = fewest.min(held);
            }
            let mut of = [boundary.unwrap_or(0); MOST_LANES];
            if boundary.is_none_or(|boundary| rows.first[rows.count - 1] > boundary) {
                for lane in 0..rows.count {
                    if boundary.is_none_or(|boundary| rows.first[lane] > boundary) {
                        close(&mut runs, window + lane, end);
                        boundary = Some(rows.end[lane]);
                        let before = rows.end[lane] - rows.first[lane];
                        runs.push(Run { windows: window + lane..total, boundary: rows.end[lane], before, after: 0 });
                        of[lane..].fill(rows.end[lane]);
                    }
                    end = rows.end[lane];
                }
            }
            let (mut before, mut after) = ([0; MOST_LANES], [0; MOST_LANES]);
            #[allow(clippy::cast_possible_truncation, reason = "there are no more rows than that")]
            for lane in 0..S::F64_LANES {
                before[lane] = (of[lane] - rows.first[lane]) as u32;
                after[lane] = (rows.end[lane] - of[lane]) as u32;
            }
            for (all, some) in [(&mut befores, &before), (&mut afters, &after)] {
                if rows.count == S::F64_LANES {
                    all[window..window + S::F64_LANES].copy_from_slice(&some[..S::F64_LANES]);
                } else {
                    all[window..].copy_from_slice(&some[..rows.count]);
                }
            }
            end = rows.end[rows.count - 1];
        }
        close(&mut runs, total, end);
        (spans.runs, spans.most, spans.fewest) = (runs, most, fewest);
        (spans.before, spans.after) = (befores, afters);
    }
}

/// Ends the last run before a window, where windows reach up to before a row.
fn close(runs: &mut [Run], window: usize, end: usize) {
    if let Some(run) = runs.last_mut() {
        run.windows.end = window;
        run.after = end - run.boundary;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps from very short to long ones, the same at every call.
    fn times(count: u32) -> Vec<f64> {
        let steps = (0..count).map(|row| 10.0_f64.powf(3.0 * (f64::from(row) * 0.7).sin() - 1.0));
        let next = |time: &mut f64, step: f64| Some(std::mem::replace(time, *time + step));
        steps.scan(100.0, next).collect()
    }

    #[test]
    fn windows_hold_the_rows_within_and_runs_reach_over_their_boundaries() {
        for count in [1, 2, 7, 8, 9, 400] {
            let given = times(count);
            let count = given.len();
            for (begin, duration) in [(-1.0, 2.0), (-30.0, 30.5), (-1e-3, 100.0), (0.0, 0.0), (-1e6, 2e6), (5.0, 1.0)] {
                for instructions in Instructions::available() {
                    let times = Arc::new(RowTimes::new(&given.as_slice(), instructions).unwrap());
                    let since = times.since.clone();
                    let spans = Spans::new(times, begin, duration, instructions).unwrap();
                    let of = |border: f64| since.partition_point(|&time| time < border);
                    let rows: Vec<Range<usize>> =
                        since.iter().map(|time| of(time + begin)..of(time + begin + duration)).collect();
                    let held = || rows.iter().map(Range::len);
                    assert_eq!(Some(spans.most_and_fewest()), held().max().zip(held().min()));
                    let least = held().sum::<usize>() / count;
                    let fewer = (0..count).filter(|&window| rows[window].len() < least);
                    assert_eq!(spans.fewer_than(least), fewer.collect::<Vec<_>>());
                    let mut next = 0;
                    for run in spans.runs() {
                        assert_eq!(run.windows.start, next);
                        next = run.windows.end;
                        let mine = &rows[run.windows.clone()];
                        assert!(mine.iter().all(|rows| rows.start <= run.boundary && rows.end >= run.boundary));
                        assert_eq!((mine[0].len(), mine[0].end), (run.before, run.boundary));
                        assert_eq!(mine[mine.len() - 1].end, run.boundary + run.after);
                        assert!(rows.get(next).is_none_or(|rows| rows.start > run.boundary));
                        let (before, after) = spans.around_boundary(run.windows.clone());
                        for (rows, (&before, &after)) in mine.iter().zip(before.iter().zip(after)) {
                            assert_eq!(*rows, run.boundary - before as usize..run.boundary + after as usize);
                        }
                    }
                    assert_eq!(next, count);
                }
            }
        }
    }

    #[test]
    fn windows_near_the_ends_have_only_part_of_their_duration() {
        let given: Vec<f64> = (0..100).map(f64::from).collect();
        let instructions = Instructions::current();
        let times = Arc::new(RowTimes::new(&given.as_slice(), instructions).unwrap());
        let spans = Spans::new(times, -10.0, 20.0, instructions).unwrap();
        let (windows, within) = spans.near_ends(0.5);
        assert_eq!(windows, (0..10).chain(90..100).collect::<Vec<_>>());
        assert!(within.iter().zip(&windows).all(|(within, &window)| *within == 10.5 + window.min(99 - window) as f64));
    }
}
