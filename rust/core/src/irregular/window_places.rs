//! Where windows lie whose samples have times of their own, and which lie so close to each other that they share one basis.

use std::ops::Range;

use crate::record::samples::{all_usable, is_usable};

/// A polynomial that is at most one in a window is at most `cosh(p acosh(1 + d))` at a distance of `d` half lengths from it (Chebyshev). Windows share a
/// basis while that is less than `cosh(GROWTH)`, 202, at the far ends of all of them together: what rounding changes is amplified by its square.
const GROWTH: f64 = 6.0;

/// All of them together are longer than the shortest by no more than this part of it: low orders would fit them worse and worse.
const REACH: f64 = 0.25;

/// How long windows are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowSpan {
    /// So many samples, an odd number.
    Samples(usize),
    /// The samples of so many seconds.
    Seconds(f64),
}

/// Where a window lies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlacedWindow {
    pub(crate) samples: Range<usize>,
    pub(crate) edge: bool,
}

/// A window that is fitted alone: its middle and its half length in seconds.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct OwnWindow<'a> {
    pub(crate) placed: &'a PlacedWindow,
    pub(crate) middle: f64,
    pub(crate) half: f64,
}

/// Which samples windows are around that follow each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numbered {
    /// The number of the first, and samples from one to the next.
    pub(crate) first: usize,
    pub(crate) step: usize,
}

impl Numbered {
    /// The sample that a window is around.
    pub(crate) fn sample(self, window: usize) -> usize {
        (self.first + window) * self.step
    }
}

/// Windows that follow each other and share a basis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WindowGroup {
    /// Their numbers.
    pub(crate) windows: Range<usize>,
    /// Time of the first sample, and of the last.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Candidates in each of them.
    pub(crate) degrees: usize,
    /// From the first sample of the shortest to its last.
    shortest: f64,
}

impl WindowSpan {
    /// The window around a sample, within the record, where samples before `begin` and all up to `end` are known to lie before its begin and end.
    pub(crate) fn place(self, times: &[f64], sample: usize, begin: usize, end: usize) -> PlacedWindow {
        let count = times.len();
        match self {
            Self::Samples(length) => {
                let half = length / 2;
                let begin = sample.saturating_sub(half).min(count - length.min(count));
                let samples = begin..count.min(begin + length);
                PlacedWindow { samples, edge: sample < half || sample + half >= count }
            }
            Self::Seconds(length) => {
                let half = length / 2.0;
                let middle = Self::middle(times, sample, half);
                let before = |from: usize, is_before: &dyn Fn(f64) -> bool| {
                    from + times[from..].iter().take_while(|&&time| is_before(time)).count()
                };
                // At the record's ends its first and last sample are in the window, whatever rounding makes of its own ends.
                let is_first = middle <= times[0] + half;
                let begin = if is_first { 0 } else { before(begin, &|time| time < middle - half) };
                let is_last = middle >= times[count - 1] - half;
                let end = if is_last { count } else { before(end.max(begin), &|time| time <= middle + half) };
                PlacedWindow { samples: begin..end, edge: (middle - times[sample]).abs() > 0.0 }
            }
        }
    }

    /// A window around a sample with the time that a basis of its own has.
    pub(crate) fn own<'a>(self, times: &[f64], sample: usize, placed: &'a PlacedWindow) -> OwnWindow<'a> {
        match self {
            Self::Samples(_) => {
                let (from, to) = (times[placed.samples.start], times[placed.samples.end - 1]);
                OwnWindow { placed, middle: f64::midpoint(from, to), half: (to - from) / 2.0 }
            }
            Self::Seconds(length) => {
                let half = length / 2.0;
                OwnWindow { placed, middle: Self::middle(times, sample, half), half }
            }
        }
    }

    /// The middle of a window of seconds, which lies within the record.
    fn middle(times: &[f64], sample: usize, half: f64) -> f64 {
        times[sample].min(times[times.len() - 1] - half).max(times[0] + half)
    }

    /// The window around a sample, whatever lies before.
    pub(crate) fn around(self, times: &[f64], sample: usize) -> PlacedWindow {
        let Self::Seconds(length) = self else { return self.place(times, sample, 0, 0) };
        // Twice as long a way back holds every window that the record's ends move.
        let begin = times.partition_point(|&time| time < times[sample] - 1.5 * length);
        self.place(times, sample, begin, begin)
    }

    /// The windows around every `step`-th sample, by their numbers.
    pub(crate) fn places(self, times: &[f64], windows: Range<usize>, step: usize) -> Vec<PlacedWindow> {
        if let Self::Samples(_) = self {
            return windows.map(|window| self.place(times, window * step, 0, 0)).collect();
        }
        let mut places: Vec<PlacedWindow> = Vec::with_capacity(windows.len());
        for window in windows {
            let place = match places.last() {
                Some(before) => self.place(times, window * step, before.samples.start, before.samples.end),
                None => self.around(times, window * step),
            };
            places.push(place);
        }
        places
    }
}

/// By what part all windows of a group may be longer than the shortest.
fn reach(degrees: usize) -> f64 {
    let highest = degrees.saturating_sub(1).max(1) as f64;
    // A distance of one is half a window.
    (((GROWTH / highest).cosh() - 1.0) / 2.0).min(REACH)
}

/// Groups of windows that share a basis: those within the record whose samples are all usable and of which `degrees` says how many candidates they have.
pub(crate) fn groups(
    times: &[f64],
    record: &[f64],
    windows: &[PlacedWindow],
    degrees: impl Fn(usize) -> Option<usize>,
) -> Vec<WindowGroup> {
    let mut groups: Vec<WindowGroup> = Vec::new();
    let (Some(begin), Some(last)) = (windows.first(), windows.last()) else { return groups };
    let all = all_usable(&record[begin.samples.start..last.samples.end.max(begin.samples.start)]);
    // Samples are usable from this one to the one before `seen`.
    let (mut usable, mut seen) = (0, 0);
    let (mut most, mut usual) = ((usize::MAX, 0.0), (usize::MAX, None));
    for (number, window) in windows.iter().enumerate() {
        if !all {
            let new = seen.max(window.samples.start);
            if let Some(last) = record[new..window.samples.end.max(new)].iter().rposition(|&value| !is_usable(value)) {
                usable = new + last + 1;
            }
            seen = seen.max(window.samples.end);
        }
        let length = window.samples.len();
        if usual.0 != length {
            usual = (length, degrees(length));
        }
        let Some(degrees) = usual.1 else { continue };
        if window.edge || usable > window.samples.start {
            continue;
        }
        let (from, to) = (times[window.samples.start], times[window.samples.end - 1]);
        let length = to - from;
        if let Some(group) = groups.last_mut() {
            let shortest = group.shortest.min(length);
            if most.0 != degrees {
                most = (degrees, 1.0 + reach(degrees));
            }
            let near = to - group.from <= most.1 * shortest && to >= group.to;
            if near && group.windows.end == number && group.degrees == degrees {
                (group.windows.end, group.to, group.shortest) = (number + 1, to, shortest);
                continue;
            }
        }
        groups.push(WindowGroup { windows: number..number + 1, from, to, degrees, shortest: length });
    }
    groups
}
