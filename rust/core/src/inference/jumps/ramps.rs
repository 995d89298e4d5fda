//! Whether a windowed coefficient jumps, or changes within some samples: evenly, or as a logistic function does.
//!
//! A ramp is the mean of jumps at its samples, and so is what it leaves of every row, before it is squared. A logistic function is nearly the mean of three
//! ramps. Each shape is far less probable beforehand than a jump, which needs no width: noise of the rows tells jumps from narrow ramps by little.

use crate::inference::jumps::jump::{Jump, JumpSearch};
use crate::inference::jumps::placement::JumpPlace;

/// Half-widths of ramps, in eighths of the test function's half-width. What changes within more is followed by windows: the last one is a part of others only.
const EIGHTHS: [usize; 5] = [1, 2, 4, 8, 16];

/// The parts of ramps of one, two and four half-widths that make a logistic function to 2 %, with a scale of two thirds of the half-width.
const LOGISTIC: [f64; 3] = [0.41, 0.45, 0.14];

/// The probability of each shape beforehand, over that of a jump.
const RARE: f64 = 0.01;

/// Shapes of a change: by how much each ramp is a part of it.
struct Shapes {
    half_widths: Vec<usize>,
    parts: Vec<Vec<f64>>,
}

impl Shapes {
    fn new(half: usize) -> Self {
        let mut half_widths: Vec<usize> = EIGHTHS.iter().map(|eighths| eighths * half / 8).collect();
        half_widths.retain(|&half| half > 0);
        half_widths.dedup();
        let count = half_widths.len();
        let shape = |first: usize, parts: &[f64]| {
            let mut shape = vec![0.0; count];
            shape[first..first + parts.len()].copy_from_slice(parts);
            shape
        };
        let ramps = (0..count.saturating_sub(1)).map(|first| shape(first, &[1.0]));
        let logistic = (0..(count + 1).saturating_sub(LOGISTIC.len())).map(|first| shape(first, &LOGISTIC));
        Self { parts: ramps.chain(logistic).collect(), half_widths }
    }
}

impl JumpSearch<'_> {
    /// A jump with the probability that it has happened by each sample, or the part of it that has, if it is none. `left` is what a jump before each candidate
    /// leaves.
    pub(crate) fn jump_or_ramp(&self, place: &JumpPlace<'_>, left: &[f64], best: usize) -> Jump {
        let candidates = place.candidates;
        let shapes = Shapes::new(self.function.len() / 2);
        let Some(left_of_shapes) = self.left_of_shapes(place, &shapes) else {
            return self.jump(left, best, candidates.start, place.over.len() as f64);
        };
        let least = left_of_shapes.iter().flatten().copied().fold(left[best], f64::min);
        let noise = self.noise(least, place.over.len() as f64);
        let weight = |left: f64| (-(left - least) / (2.0 * noise)).exp();
        // By how much each sample changes it, from the first on that any ramp begins at.
        let widest = shapes.half_widths.last().copied().unwrap_or(0);
        let first = candidates.start.saturating_sub(widest);
        let mut changes = vec![0.0; candidates.end + widest - first];
        for (candidate, &left) in candidates.clone().zip(left) {
            changes[candidate - first] += weight(left);
        }
        for (place, &half) in shapes.half_widths.iter().enumerate() {
            for (index, candidate) in candidates.clone().enumerate() {
                let parts = shapes.parts.iter().zip(&left_of_shapes);
                let part: f64 = parts.map(|(parts, left)| RARE * parts[place] * weight(left[index])).sum();
                for sample in candidate.saturating_sub(half)..=candidate + half {
                    changes[sample.max(first) - first] += part / (2 * half + 1) as f64;
                }
            }
        }
        let total: f64 = changes.iter().sum();
        let happened = changes.iter().scan(0.0, |sum, change| {
            *sum += change / total;
            Some(*sum)
        });
        Jump { sample: candidates.start + best, first, happened: happened.collect(), of_constants: false }
    }

    /// The residual sum of squares of the rows for every shape around each candidate, or `None` if too few rows are usable.
    fn left_of_shapes(&self, place: &JumpPlace<'_>, shapes: &Shapes) -> Option<Vec<Vec<f64>>> {
        let mut left = vec![vec![0.0; place.candidates.len()]; shapes.parts.len()];
        let (mut sums, mut means) = (Vec::new(), vec![0.0; shapes.half_widths.len()]);
        self.each_row(place, |begin, errors| {
            sums.clear();
            sums.push(0.0);
            for error in errors {
                sums.push(sums[sums.len() - 1] + error);
            }
            let (ends, last) = ([errors[0], errors[errors.len() - 1]], errors.len());
            // What jumps before each of all samples up to one leave, from the row's first sample on.
            let until = |sample: isize| {
                let later = sample - begin.cast_signed();
                match usize::try_from(later) {
                    Err(_) => later as f64 * ends[0],
                    Ok(later) if later <= last => sums[later],
                    Ok(later) => sums[last] + (later - last) as f64 * ends[1],
                }
            };
            for (index, candidate) in place.candidates.clone().enumerate() {
                let middle = candidate.cast_signed();
                for (mean, &half) in means.iter_mut().zip(&shapes.half_widths) {
                    let wide = half.cast_signed();
                    *mean = (until(middle + wide + 1) - until(middle - wide)) / (2 * half + 1) as f64;
                }
                for (left, parts) in left.iter_mut().zip(&shapes.parts) {
                    left[index] += parts.iter().zip(&means).map(|(part, mean)| part * mean).sum::<f64>().powi(2);
                }
            }
        })?;
        Some(left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::jumps::simulated::{HALF, STRIDE, Spring, searched, spring};

    const MIDDLE: usize = 1500;

    /// From which sample on, and how far from 10 to 13, a spring is said to be whose change is some function of the samples after the middle.
    fn found(change: impl Fn(f64) -> f64) -> (usize, Vec<f64>) {
        let spring: Spring = spring(|sample| 10.0 + 3.0 * change(sample as f64 - MIDDLE as f64));
        let row = (MIDDLE - HALF).div_ceil(STRIDE);
        let lines = [vec![[10.0, 0.0]], vec![[13.0, 0.0]]];
        let (over, candidates) = (row - 24..row + 24, MIDDLE - HALF..MIDDLE + HALF + 1);
        let place = JumpPlace { lines: &lines, row, over: &over, candidates: &candidates };
        searched(&spring, |search| {
            let left = search.left(&place).expect("usable rows");
            let best = (0..left.len()).min_by(|&a, &b| left[a].total_cmp(&left[b])).expect("candidates");
            let jump = search.jump_or_ramp(&place, &left, best);
            (jump.first, jump.happened)
        })
    }

    #[test]
    fn changes_are_followed_and_jumps_stay_jumps() {
        for half in [0, HALF / 4, HALF / 2, HALF] {
            let part = |later: f64| ((later + half as f64 + 1.0) / (2 * half + 1) as f64).clamp(0.0, 1.0);
            let (first, happened) = found(part);
            assert!(happened.is_sorted() && (happened[happened.len() - 1] - 1.0).abs() < 1e-12);
            for (place, happened) in happened.iter().enumerate() {
                let later = (first + place) as f64 - MIDDLE as f64;
                // Noise hides whether a jump is one, or a ramp of a sample or two.
                let most = if half == 0 && later.abs() <= 2.0 { 1.0 } else { 0.15 };
                assert!((happened - part(later)).abs() < most, "{half}, {later}: {happened} for {}", part(later));
            }
        }
    }

    #[test]
    fn a_logistic_function_is_followed_into_its_tails() {
        for scale in [2.0, 4.0] {
            let part = |later: f64| 1.0 / (1.0 + (-(later + 0.5) / scale).exp());
            let (first, happened) = found(part);
            for (place, happened) in happened.iter().enumerate() {
                let later = (first + place) as f64 - MIDDLE as f64;
                let off = happened - part(later);
                let most = if later.abs() > 4.0 * scale { 0.02 } else { 0.1 };
                assert!(off.abs() < most, "{scale}, {later}: {off}");
            }
        }
    }

    #[test]
    fn shapes_are_ramps_and_their_means() {
        let shapes = Shapes::new(16);
        assert_eq!((shapes.half_widths.as_slice(), shapes.parts.len()), ([2, 4, 8, 16, 32].as_slice(), 7));
        assert!(shapes.parts.iter().all(|parts| (parts.iter().sum::<f64>() - 1.0).abs() < 1e-12));
        assert_eq!(Shapes::new(1).half_widths, [1, 2]);
        assert_eq!(Shapes::new(1).parts, [[1.0, 0.0]]);
        assert_eq!(Shapes::new(0).parts.len(), 0);
    }
}
