//! Gaps of parameters and torque: short ones are bridged by the nearest value, longer ones end the simulation.

use std::ops::Range;

use crate::record::samples::is_usable;

/// Puts the nearest usable value into gaps of at most `most` samples. What comes before the first usable sample or after the last is a gap
/// with one side.
pub(crate) fn bridge(values: &mut [f64], most: usize) {
    let mut place = 0;
    while place < values.len() {
        if is_usable(values[place]) {
            place += 1;
            continue;
        }
        let first = place;
        place = (first..values.len()).find(|&sample| is_usable(values[sample])).unwrap_or(values.len());
        let gap = first..place;
        let before = first.checked_sub(1).map(|sample| values[sample]);
        let after = values.get(place).copied();
        if gap.len() > most {
            continue;
        }
        let middle = match (before, after) {
            (Some(_), Some(_)) => gap.start + gap.len() / 2,
            (Some(_), None) => gap.end,
            _ => gap.start,
        };
        for sample in gap {
            let nearest = if sample < middle { before } else { after };
            values[sample] = nearest.unwrap_or(f64::NAN);
        }
    }
}

/// Runs of samples at which every column has a value; columns of one value have it everywhere.
pub(crate) fn runs<'a>(samples: usize, columns: impl Iterator<Item = &'a [f64]>) -> Vec<Range<usize>> {
    let mut there = vec![true; samples];
    for column in columns {
        if let [value] = column {
            if !is_usable(*value) {
                return Vec::new();
            }
        } else {
            there.iter_mut().zip(column).for_each(|(there, &value)| *there &= is_usable(value));
        }
    }
    let mut runs = Vec::new();
    let mut first = None;
    for (sample, there) in there.iter().copied().chain(std::iter::once(false)).enumerate() {
        match (first, there) {
            (None, true) => first = Some(sample),
            (Some(begin), false) => {
                runs.push(begin..sample);
                first = None;
            }
            _ => {}
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAP: f64 = f64::NAN;

    #[test]
    fn short_gaps_get_the_nearest_value_and_long_ones_stay() {
        let mut values = [GAP, 1.0, GAP, GAP, GAP, 2.0, GAP, GAP, GAP, GAP, 3.0, GAP];
        bridge(&mut values, 3);
        assert_eq!(values[..6], [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
        assert!(values[6..10].iter().all(|value| value.is_nan()));
        assert_eq!(values[10..], [3.0, 3.0]);
    }

    #[test]
    fn runs_lie_between_gaps() {
        let columns: [&[f64]; 2] = [&[1.0, GAP, 1.0, 1.0, 1.0], &[5.0]];
        assert_eq!(runs(5, columns.into_iter()), [0..1, 2..5]);
        assert_eq!(runs(5, [[GAP].as_slice()].into_iter()), []);
    }
}
