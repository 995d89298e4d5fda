//! Sums of a criterion over neighbouring windows, and the order that is best by the sum.
//!
//! The sum around window `w` goes over the windows that share a sample with it, `w - R … w + R` with `R = M - 1`, as far as there are
//! any. Nothing is ever subtracted: windows are cut into blocks of `2R + 1` by their absolute numbers, and a sum is that of the end of
//! one block and of the beginning of the next. So the bits do not depend on how a record is cut.

use std::ops::Range;

/// The best order of some windows so far.
#[derive(Debug, Default)]
pub(crate) struct Pool {
    windows: Range<usize>,
    /// Windows on either side of a window that its sum includes.
    reach: usize,
    lowest: Vec<f64>,
    order: Vec<u8>,
    /// Sums from an entry to the end of its block, and from the beginning of its block to it. Entry `e` is window `e - R`.
    suffix: Vec<f64>,
    prefix: Vec<f64>,
    /// The last sums.
    totals: Vec<f64>,
}

impl Pool {
    /// The windows of a record that the sums of some windows need.
    pub(crate) fn needs(windows: &Range<usize>, length: usize, count: usize) -> Range<usize> {
        let reach = length - 1;
        let entries = entries(windows, reach);
        entries.start.saturating_sub(reach).min(windows.start)..(entries.end - reach).min(count)
    }

    /// Starts a new search for the best order.
    pub(crate) fn begin(&mut self, windows: &Range<usize>, length: usize) {
        self.windows = windows.clone();
        self.reach = length - 1;
        self.lowest.clear();
        self.lowest.resize(windows.len(), f64::INFINITY);
        self.order.clear();
        self.order.resize(windows.len(), 0);
    }

    /// Tries an order, the lower ones before: `scores` are those of the windows from `first` on.
    pub(crate) fn add(&mut self, order: usize, scores: &[f64], first: usize) {
        self.sum(scores, first);
        let number = u8::try_from(order).unwrap_or(u8::MAX);
        for ((total, lowest), best) in self.totals.iter().zip(&mut self.lowest).zip(&mut self.order) {
            if total < lowest {
                (*lowest, *best) = (*total, number);
            }
        }
    }

    /// Sums numbers of the windows from `first` on around each of the windows begun with.
    pub(crate) fn sum(&mut self, scores: &[f64], first: usize) {
        let (reach, block) = (self.reach, 2 * self.reach + 1);
        let entries = entries(&self.windows, reach);
        let score = |entry: usize| entry.checked_sub(reach + first).and_then(|place| scores.get(place)).unwrap_or(&0.0);
        self.suffix.resize(entries.len(), 0.0);
        self.prefix.resize(entries.len(), 0.0);
        let mut sum = 0.0;
        for (entry, prefix) in entries.clone().zip(&mut self.prefix) {
            let before = if entry % block == 0 { 0.0 } else { sum };
            sum = before + score(entry);
            *prefix = sum;
        }
        sum = 0.0;
        for (entry, suffix) in entries.clone().zip(&mut self.suffix).rev() {
            let after = if (entry + 1) % block == 0 { 0.0 } else { sum };
            sum = after + score(entry);
            *suffix = sum;
        }
        self.totals.clear();
        self.totals.extend(self.windows.clone().map(|window| {
            let total = self.suffix[window - entries.start];
            if window % block == 0 { total } else { total + self.prefix[window + 2 * reach - entries.start] }
        }));
    }

    /// The last sums, one for each of the windows begun with.
    pub(crate) fn totals(&self) -> &[f64] {
        &self.totals
    }

    /// The best order of a window.
    pub(crate) fn order(&self, window: usize) -> usize {
        usize::from(self.order[window - self.windows.start])
    }
}

/// The entries that some windows' sums are made of, from the beginning of a block.
fn entries(windows: &Range<usize>, reach: usize) -> Range<usize> {
    let block = 2 * reach + 1;
    windows.start - windows.start % block..windows.end + 2 * reach
}
