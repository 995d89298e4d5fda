//! Times of rows: whether they increase, and how far they are from a uniform grid.

use crate::error::Error;
use crate::exec::huge_pages::zeros;
use crate::record::samples::{Samples, all_usable};
use crate::record::subsample::GOLDEN;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES, dispatch};

/// Times that are looked at while they are in the nearest cache.
const PIECE: usize = 1 << 10;

/// Steps that tell the usual one, spread over the record.
const LOOKED_AT: usize = 1 << 12;

/// Times of rows in seconds, and what all of them show.
#[derive(Clone, Debug)]
pub struct RowTimes {
    /// From the first row on: seconds since 1970 have no digits left for what a border is told by.
    pub(crate) since: Vec<f64>,
    shown: TimesShown,
}

/// What all times show.
#[derive(Clone, Copy, Debug)]
struct TimesShown {
    shortest: f64,
    longest: f64,
    farthest: f64,
    largest: f64,
}

impl RowTimes {
    /// Reads times.
    ///
    /// # Errors
    /// If there is not the memory for them.
    pub fn new(times: &dyn Samples, instructions: Instructions) -> Result<Self, Error> {
        let mut since = zeros(times.len())?;
        let shown = dispatch(instructions, Look { times, since: &mut since });
        Ok(Self { since, shown })
    }

    /// Whether every time is a number, and later than the one before.
    #[must_use]
    pub fn increase(&self) -> bool {
        self.shown.shortest > 0.0 && self.shown.largest.is_finite()
    }

    /// The shortest step and the longest.
    #[must_use]
    pub fn steps(&self) -> (f64, f64) {
        (self.shown.shortest, self.shown.longest)
    }

    /// How far times are from those of a uniform grid between the first and the last, at most.
    #[must_use]
    pub fn farthest(&self) -> f64 {
        self.shown.farthest
    }

    /// The largest magnitude of what was given.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.shown.largest
    }

    /// From the first time to the last.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.since.last().copied().unwrap_or(0.0)
    }

    /// The median of steps all over the record, of all where there are no more than some thousand.
    #[must_use]
    pub fn usual_step(&self) -> f64 {
        let all = self.since.len().saturating_sub(1);
        let count = all.min(LOOKED_AT);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of the steps")]
        let section = |step: usize| ((step as f64 * GOLDEN).fract() * all as f64) as usize;
        let places = (0..count).map(|step| if count == all { step } else { section(step) });
        let mut steps: Vec<f64> = places.map(|place| self.since[place + 1] - self.since[place]).collect();
        steps.sort_unstable_by(f64::total_cmp);
        match count {
            0 => 0.0,
            count => f64::midpoint(steps[(count - 1) / 2], steps[count / 2]),
        }
    }
}

/// The kernel that reads times and looks at them.
struct Look<'a> {
    times: &'a dyn Samples,
    since: &'a mut [f64],
}

/// What some times show, one or more in each lane.
struct TimesSeen<V> {
    shortest: V,
    longest: V,
    farthest: V,
    largest: V,
}

impl Kernel for Look<'_> {
    type Output = TimesShown;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> TimesShown {
        let Self { times, since } = self;
        let (count, nothing) = (since.len(), simd.splat_f64s(0.0));
        let infinite = simd.splat_f64s(f64::INFINITY);
        let mut seen = TimesSeen { shortest: infinite, longest: nothing, farthest: nothing, largest: nothing };
        let mut ends = [[0.0; 1]; 2];
        if count > 0 {
            times.read(0, &mut ends[0]);
            times.read(count - 1, &mut ends[1]);
        }
        let (origin, period) = (ends[0][0], (ends[1][0] - ends[0][0]) / count.saturating_sub(1).max(1) as f64);
        let mut numbers = [0.0; MOST_LANES];
        (0_u32..).zip(&mut numbers).for_each(|(lane, number)| *number = f64::from(lane));
        let numbers = simd.load(&numbers, 0);
        // The time before a piece comes first.
        let mut piece = [0.0; PIECE + 1];
        let mut are_numbers = true;
        for first in (0..count).step_by(PIECE) {
            let len = PIECE.min(count - first);
            times.read(first, &mut piece[1..=len]);
            let mut places = 0..len;
            while places.len() >= S::F64_LANES {
                let place = places.start;
                let (time, before) = (simd.load(&piece, place + 1), simd.load(&piece, place));
                let number = simd.add_f64s(numbers, simd.splat_f64s((first + place) as f64));
                let time_since = simd.sub_f64s(time, simd.splat_f64s(origin));
                simd.store(since, first + place, time_since);
                if first + place > 0 {
                    seen.step(simd, simd.sub_f64s(time, before));
                } else {
                    for place in 1..S::F64_LANES {
                        seen.step(simd, simd.splat_f64s(piece[place + 1] - piece[place]));
                    }
                }
                seen.time(simd, time, time_since, simd.mul_f64s(number, simd.splat_f64s(period)));
                places.start += S::F64_LANES;
            }
            for place in places {
                let (time, grid) = (piece[place + 1], (first + place) as f64 * period);
                since[first + place] = time - origin;
                if first + place > 0 {
                    seen.step(simd, simd.splat_f64s(time - piece[place]));
                }
                seen.time(simd, simd.splat_f64s(time), simd.splat_f64s(time - origin), simd.splat_f64s(grid));
            }
            piece[0] = piece[len];
            // What is no number compares as nothing: looked for where it would be lost.
            are_numbers &= all_usable(&since[first..first + len]);
        }
        let mut lanes = [[0.0; MOST_LANES]; 4];
        let found = [seen.shortest, seen.longest, seen.farthest, seen.largest];
        lanes.iter_mut().zip(found).for_each(|(lanes, found)| simd.store(lanes, 0, found));
        let most = |of: usize| lanes[of][..S::F64_LANES].iter().copied().fold(0.0, f64::max);
        let shortest = lanes[0][..S::F64_LANES].iter().copied().fold(f64::INFINITY, f64::min);
        TimesShown {
            shortest: if are_numbers { shortest } else { f64::NAN },
            longest: most(1),
            farthest: most(2),
            largest: most(3),
        }
    }
}

impl<V: Copy> TimesSeen<V> {
    #[inline(always)]
    fn step<S: Lanes<f64s = V>>(&mut self, simd: S, step: V) {
        self.shortest = simd.min_f64s(step, self.shortest);
        self.longest = simd.max_f64s(step, self.longest);
    }

    #[inline(always)]
    fn time<S: Lanes<f64s = V>>(&mut self, simd: S, time: V, since: V, grid: V) {
        self.farthest = simd.max_f64s(simd.abs_f64s(simd.sub_f64s(since, grid)), self.farthest);
        self.largest = simd.max_f64s(simd.abs_f64s(time), self.largest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(times: &[f64]) -> Vec<RowTimes> {
        let each = Instructions::available().into_iter();
        each.map(|instructions| RowTimes::new(&times, instructions).unwrap()).collect()
    }

    #[test]
    fn every_path_sees_the_same_of_any_number_of_times() {
        for count in [1, 2, 3, 7, 8, 9, 30, PIECE, PIECE + 1, 3 * PIECE + 5] {
            let times: Vec<f64> = (0..count).map(|row| 5.0 + row as f64 + 0.4 * (row as f64).sin()).collect();
            let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
            for found in of(&times) {
                assert!(
                    found.increase() && found.since.iter().zip(&times).all(|(since, time)| *since == time - times[0])
                );
                let (shortest, longest) = found.steps();
                assert_eq!(shortest, steps.iter().copied().fold(f64::INFINITY, f64::min));
                assert_eq!(longest, steps.iter().copied().fold(0.0, f64::max));
                assert_eq!(found.largest(), times[count - 1]);
                let period = found.length() / (count - 1).max(1) as f64;
                let away = times.iter().enumerate().map(|(row, time)| (time - times[0] - row as f64 * period).abs());
                assert_eq!(found.farthest(), away.fold(0.0, f64::max), "{count}");
            }
        }
    }

    #[test]
    fn times_that_stand_still_go_back_or_are_missing_do_not_increase() {
        let good: Vec<f64> = (0..3000).map(f64::from).collect();
        for place in [0, 1, 5, 8, 1023, 1024, 2999] {
            for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, good[place.max(1) - 1] - f64::from(place == 0)] {
                let mut times = good.clone();
                times[place] = wrong;
                let increases = place == 0 && wrong == -1.0;
                assert!(of(&times).iter().all(|found| found.increase() == increases), "{wrong} at {place}");
            }
        }
    }

    #[test]
    fn the_usual_step_is_the_median() {
        let times: Vec<f64> = (0..40_000).map(|row| f64::from(row) + if row % 10 == 3 { 0.5 } else { 0.0 }).collect();
        assert!(of(&times).iter().all(|found| found.usual_step() == 1.0));
        assert!(of(&[0.0, 1.0, 4.0]).iter().all(|found| found.usual_step() == 2.0));
        // Two of three steps are short, wherever steps are looked at.
        for count in [2 * LOOKED_AT + 1, 3 * LOOKED_AT + 1, 3 * LOOKED_AT + 2] {
            let mut time = 0.0;
            let steps = (0..count).map(|row| if row % 3 == 0 { 3.0 } else { 0.125 });
            let times: Vec<f64> = steps
                .map(|step| {
                    time += step;
                    time
                })
                .collect();
            assert!(of(&times).iter().all(|found| found.usual_step() == 0.125), "{count}");
        }
        assert!(of(&[0.0]).iter().all(|found| found.usual_step() == 0.0));
    }
}
