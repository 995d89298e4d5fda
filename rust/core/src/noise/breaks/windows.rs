//! Windows around every border of two samples: what is usual in them, and where one stands out.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::noise::median::median;
use crate::record::samples::{Samples, all_usable};
use crate::record::subsample::stretches;

/// Windows that the usual one is taken from, in so many stretches.
const MOST: usize = 1 << 11;
const STRETCHES: usize = 16;

/// Windows that are looked at together, and how many such parts between two looks at the watch.
const TOGETHER: usize = 1 << 12;
const PARTS: usize = 64;

/// The median magnitude of a normal variable of variance one.
const MEDIAN: f64 = 0.6745;

/// How much something stands out of a window, in units of its noise, and the mean square that is left beside it.
#[derive(Clone, Copy)]
pub(crate) struct Size {
    pub(crate) size: f64,
    pub(crate) left: f64,
}

impl Size {
    /// What is usual in windows of a channel that was rounded to a `quantum`, which makes steps of its own. `None` if all hold a missing sample.
    pub(crate) fn usual(
        channel: &dyn Samples,
        length: usize,
        quantum: f64,
        of: impl Fn(&[f64]) -> Self,
    ) -> Option<Self> {
        let (mut sizes, mut left) = (Vec::new(), Vec::new());
        let windows = (channel.len() + 1).saturating_sub(length);
        for places in stretches(windows, MOST, STRETCHES).filter(|places| !places.is_empty()) {
            let mut samples = vec![0.0; places.len() + length - 1];
            channel.read(places.start, &mut samples);
            for found in samples.windows(length).filter(|window| all_usable(window)).map(&of) {
                sizes.push(found.size.abs());
                left.push(found.left);
            }
        }
        let (size, left) = (deviation(&mut sizes)?, median(&mut left)? / 2.0);
        Some(Self { size: size.max(quantum / 2.0), left: left.max(quantum * quantum / 4.0) })
    }

    /// Whether it is `times` as large as usual, and as what is left beside it lets one expect.
    pub(crate) fn stands_out(self, usual: Self, times: f64) -> bool {
        let least = times * self.left.max(usual.left).sqrt();
        self.size.abs() > (times * usual.size).max(least)
    }
}

/// The borders at which windows stand out most, each the first of those within half a window, but none near `known` ones. `conspicuous` gives the
/// windows that stand out among those of consecutive samples, from the first on, and how much.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn borders(
    channel: &dyn Samples,
    half: usize,
    known: &[usize],
    watch: &mut Watch<'_>,
    mut conspicuous: impl FnMut(usize, &[f64], &mut Vec<(usize, f64)>),
) -> Result<Vec<usize>, Error> {
    let (length, samples) = (2 * half, channel.len());
    let windows = (samples + 1).saturating_sub(length);
    let is_known = |border: usize| {
        let after = known.partition_point(|&place| place + half <= border);
        known.get(after).is_some_and(|&place| place < border + half)
    };
    let (mut found, mut values, mut standing): (Vec<(usize, f64)>, _, _) = (Vec::new(), Vec::new(), Vec::new());
    for (part, first) in (0..windows).step_by(TOGETHER).enumerate() {
        if part > 0 && part % PARTS == 0 && !watch(0, samples) {
            return Err(Error::Cancelled);
        }
        values.resize((windows - first).min(TOGETHER) + length - 1, 0.0);
        channel.read(first, &mut values);
        standing.clear();
        conspicuous(first, &values, &mut standing);
        let borders = standing.iter().map(|&(place, size)| (first + place + half, size));
        for (border, size) in borders.filter(|&(border, _)| !is_known(border)) {
            match found.last_mut() {
                Some(before) if before.0 + half > border => {
                    if size > before.1 {
                        *before = (border, size);
                    }
                }
                _ => found.push((border, size)),
            }
        }
    }
    Ok(found.into_iter().map(|(border, _)| border).collect())
}

/// Takes off a column what others explain whose first elements, so many, are orthonormal. Twice, since the first time leaves rounding.
fn take_off(column: &mut [f64], others: &[Vec<f64>], first: usize) {
    for _ in 0..2 {
        for other in others {
            let part = product(&column[..first], &other[..first]);
            column.iter_mut().zip(other).for_each(|(value, other)| *value -= part * other);
        }
    }
}

/// A column without what others explain, its first elements, so many, of norm one.
pub(crate) fn orthonormal(mut column: Vec<f64>, others: &[Vec<f64>], first: usize) -> Vec<f64> {
    take_off(&mut column, others, first);
    let norm = product(&column[..first], &column[..first]).sqrt();
    for value in &mut column {
        *value /= norm;
    }
    column
}

/// The sum of products.
pub(crate) fn product(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

/// The standard deviation of a normal variable that has such magnitudes.
pub(crate) fn deviation(magnitudes: &mut [f64]) -> Option<f64> {
    median(magnitudes).map(|magnitude| magnitude / MEDIAN)
}
