//! What windows of an incomplete record hold: the samples around some places, without those that are missing.

use std::ops::Range;

use crate::local_polynomials::incomplete_record::Incomplete;
use crate::local_polynomials::moment_sums::{LaidSamples, SampleColumns};
use crate::local_polynomials::weighted_samples::WeightedSamples;
use crate::simd::aligned::Aligned;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{MOST_LANES, dispatch};
use crate::status::Status;

/// A window that is to be fitted.
#[derive(Clone, Debug)]
pub(crate) struct HeldWindow {
    /// The place that it is for, among those that are wanted.
    pub(crate) number: usize,
    /// Of the window's samples those in its part of the record, and the one that it is for.
    inside: Range<usize>,
    pub(crate) at: usize,
    /// Where the first of them lies among those that are laid out.
    laid: usize,
    /// Samples that are there.
    pub(crate) count: usize,
    /// What is taken off all of them: the one in their middle.
    pub(crate) reference: f64,
    pub(crate) flags: Status,
}

/// Samples around some places, laid out window after window; those that windows share lie there once.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeldSamples {
    values: Vec<f64>,
    /// 0 where a sample is missing.
    weights: Vec<f64>,
    /// How many samples are there before each, and where each of them lies.
    before: Vec<usize>,
    there: Vec<usize>,
    /// Samples of the record that were laid out last, and where the first of them lies.
    last: Range<usize>,
    laid: usize,
}

impl HeldWindow {
    /// Whether all of the window's samples are in its part of the record, missing ones too.
    pub(crate) fn is_whole(&self, length: usize) -> bool {
        self.inside.len() == length
    }
}

impl HeldSamples {
    /// Forgets all samples.
    pub(crate) fn clear(&mut self) {
        for list in [&mut self.values, &mut self.weights] {
            list.clear();
        }
        for list in [&mut self.before, &mut self.there] {
            list.clear();
        }
        self.before.push(0);
        (self.last, self.laid) = (0..0, 0);
    }

    /// Lays out samples of a record; returns where the first lies. Those of the call before must not begin later.
    fn lay(&mut self, record: &Incomplete<'_>, samples: Range<usize>) -> usize {
        if samples.start > self.last.end || samples.start < self.last.start || self.last.is_empty() {
            (self.last, self.laid) = (samples.start..samples.start, self.values.len());
        }
        for sample in self.last.end..samples.end {
            let weight = record.weight(sample);
            if weight > 0.0 {
                self.there.push(self.values.len());
            }
            self.values.push(if weight > 0.0 { record.samples[sample] } else { 0.0 });
            self.weights.push(weight);
            self.before.push(self.there.len());
        }
        self.last.end = self.last.end.max(samples.end);
        self.laid + samples.start - self.last.start
    }

    /// Lays out the window of a length around a place, with so many samples before that; or its flags where it holds too little.
    pub(crate) fn window(
        &mut self,
        record: &Incomplete<'_>,
        (number, place): (usize, usize),
        (length, before): (usize, usize),
    ) -> Result<HeldWindow, Status> {
        let next = record.parts.partition_point(|part| part.end <= place);
        let part = record.parts.get(next).filter(|part| part.contains(&place)).ok_or(Status::GAP)?;
        // The window stays within its part, and the record, as it does near the ends of a record without gaps.
        let last = part.end.saturating_sub(length).max(part.start).min(record.samples.len() - length);
        let first = place.saturating_sub(before).clamp(part.start.min(last), last);
        let there = first.max(part.start)..(first + length).min(part.end);
        let mut flags = Status::GOOD;
        if place - first != before {
            flags |= Status::EDGE;
        }
        let laid = self.lay(record, there.clone());
        let [from, to] = [laid, laid + there.len()].map(|at| self.before[at]);
        let count = to - from;
        if count < length {
            flags |= Status::GAP;
        }
        if count < record.least.max(1) {
            return Err(flags);
        }
        let middle = self.there[from + count / 2];
        Ok(HeldWindow {
            number,
            inside: there.start - first..there.end - first,
            at: place - first,
            laid,
            count,
            reference: self.values[middle],
            flags,
        })
    }

    /// The samples of whole windows side by side: as they lie where each follows the one before, else laid into columns.
    pub(crate) fn side_by_side<'a>(
        &'a self,
        windows: &[HeldWindow],
        (instructions, weighted): (Instructions, bool),
        columns: &'a mut [Aligned; 2],
    ) -> SampleColumns<'a> {
        let (lanes, samples) = (instructions.lanes(), windows[0].inside.len());
        let last = windows.len() - 1;
        let mut references = [0.0; MOST_LANES];
        for (lane, reference) in references.iter_mut().enumerate() {
            *reference = windows[lane.min(last)].reference;
        }
        let is_next = |pair: &[HeldWindow]| pair[0].laid + 1 == pair[1].laid;
        if windows.len() == lanes && windows.windows(2).all(is_next) {
            let (weights, values, first) = (&self.weights[..], &self.values[..], windows[0].laid);
            return SampleColumns { weights, values, first, stride: 1, samples, references, weighted };
        }
        let mut lists = [[&[][..]; MOST_LANES]; 2];
        for lane in 0..lanes {
            let laid = windows[lane.min(last)].laid;
            for (lists, list) in lists.iter_mut().zip([&self.weights, &self.values]) {
                lists[lane] = &list[laid..laid + samples];
            }
        }
        dispatch(instructions, LaidSamples { lists, into: columns });
        let [weights, values] = &*columns;
        SampleColumns { weights, values, first: 0, stride: lanes, samples, references, weighted }
    }

    /// A window with the times of a whole one's samples.
    pub(crate) fn own<'a>(&'a self, window: &HeldWindow, times: &'a [f64]) -> WeightedSamples<'a> {
        let laid = window.laid..window.laid + window.inside.len();
        WeightedSamples {
            times: &times[window.inside.clone()],
            weights: &self.weights[laid.clone()],
            values: &self.values[laid],
            reference: window.reference,
            at: times[window.at],
            most: window.count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_share_what_lies_in_both() {
        let samples: Vec<f64> =
            (0..60).map(|sample| if sample % 10 == 3 { f64::NAN } else { f64::from(sample) }).collect();
        let weights: Vec<f64> =
            (0..60).map(|sample| if sample == 21 { 0.0 } else { f64::from(sample) + 1.0 }).collect();
        let record = Incomplete { samples: &samples, weights: Some(&weights), parts: &[0..48, 50..60], least: 5 };
        let times: Vec<f64> = (-3..=3).map(|time| f64::from(time) / 3.0).collect();
        let mut held = HeldSamples::default();
        // Twice, and one after the other or far from each other.
        for places in [&[18, 19, 45, 46][..], &[0, 1, 59, 30, 30]] {
            held.clear();
            let windows: Vec<HeldWindow> = (places.iter().enumerate())
                .map(|(number, &place)| held.window(&record, (number, place), (7, 3)).expect("it holds enough"))
                .collect();
            assert!(held.values.len() < 7 * places.len());
            for (window, &place) in windows.iter().zip(places) {
                let own = held.own(window, &times);
                let first = place - window.at;
                let expected: Vec<f64> = window.inside.clone().map(|at| record.weight(first + at)).collect();
                assert_eq!((own.weights, own.most), (&expected[..], expected.iter().filter(|one| **one > 0.0).count()));
                for (at, (value, weight)) in window.inside.clone().zip(own.values.iter().zip(own.weights)) {
                    assert!(*weight == 0.0 || value.to_bits() == samples[first + at].to_bits());
                }
                assert!(own.values.contains(&own.reference) && (own.at - times[window.at]).abs() < 1e-15);
                assert_eq!(window.flags.bits() & Status::EDGE.bits() > 0, window.at != 3);
            }
        }
        let lost = held.window(&record, (0, 49), (7, 3)).err();
        assert_eq!(lost, Some(Status::GAP));
    }
}
