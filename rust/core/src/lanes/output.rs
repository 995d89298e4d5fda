//! Outputs: which samples their elements belong to, and how they are cut into pieces.

use std::ops::Range;

use crate::status::Status;

/// Which samples of a record the elements of an output belong to: element `k` to sample `first + k · step`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Elements {
    /// Sample of the first element.
    pub first: usize,
    /// Samples from one element to the next.
    pub step: usize,
}

impl Elements {
    /// The sample that an element belongs to.
    #[must_use]
    pub fn sample(self, element: usize) -> usize {
        self.first + element * self.step
    }

    /// The elements that belong to some of the samples.
    #[must_use]
    pub fn of(self, samples: Range<usize>) -> Range<usize> {
        let element = |sample: usize| sample.saturating_sub(self.first).div_ceil(self.step);
        element(samples.start)..element(samples.end)
    }

    /// The rows that elements belong to, of windows of which row zero has a sample: as a mask and what is left of a row under it. All rows, where
    /// the step is not a power of two up to `most`.
    pub(crate) fn rows_from(self, sample: isize, most: usize) -> FinishedRows {
        let mask = if self.step.is_power_of_two() && self.step <= most { self.step - 1 } else { 0 };
        FinishedRows { mask, rest: (self.first.cast_signed() - sample).cast_unsigned() & mask }
    }

    /// The same, counted from an element on.
    pub(crate) fn from(self, element: usize) -> Self {
        Self { first: self.sample(element), step: self.step }
    }

    /// Copies results of consecutive samples, of which the first is `sample`, to the elements that belong to them.
    ///
    /// An empty output is one that is not wanted.
    #[inline(always)]
    pub(crate) fn put<T: Copy>(self, output: &mut [T], sample: usize, results: &[T]) {
        let elements = self.of(sample..sample + results.len());
        if output.is_empty() || elements.is_empty() {
            return;
        }
        let skipped = self.sample(elements.start) - sample;
        let output = &mut output[elements];
        if self.step == 1 {
            output.copy_from_slice(&results[skipped..]);
        } else {
            for (value, &result) in output.iter_mut().zip(results[skipped..].iter().step_by(self.step)) {
                *value = result;
            }
        }
    }
}

/// Rows of windows that are finished: those that a power of two divides with the same rest.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FinishedRows {
    mask: usize,
    rest: usize,
}

impl FinishedRows {
    /// Whether a row is one of them.
    #[inline(always)]
    pub(crate) fn hold(self, row: usize) -> bool {
        row & self.mask == self.rest
    }

    /// Rows from one to the next.
    pub(crate) fn step(self) -> usize {
        self.mask + 1
    }
}

/// The outputs of a kernel, field by field. Outputs that are not wanted are empty.
#[derive(Debug)]
pub(crate) struct Outputs<'a> {
    pub(crate) elements: Elements,
    pub(crate) values: Vec<&'a mut [f64]>,
    pub(crate) order: &'a mut [u8],
    /// Bits of [`Status`].
    pub(crate) status: &'a mut [u16],
}

impl Outputs<'_> {
    /// Some of the elements, such as those of one of several records.
    pub(crate) fn part(&mut self, elements: Range<usize>) -> Outputs<'_> {
        let values = self.values.iter_mut();
        Outputs {
            elements: self.elements,
            values: values.map(|values| values.get_mut(elements.clone()).unwrap_or_default()).collect(),
            order: self.order.get_mut(elements.clone()).unwrap_or_default(),
            status: self.status.get_mut(elements).unwrap_or_default(),
        }
    }

    /// Makes some samples NaN, with a status.
    pub(crate) fn invalidate(&mut self, samples: Range<usize>, status: Status) {
        let elements = self.elements.of(samples);
        for values in &mut self.values {
            fill(values, &elements, f64::NAN);
        }
        fill(self.order, &elements, 0);
        fill(self.status, &elements, status.bits());
    }
}

/// Fills some elements of an output that may not be wanted.
fn fill<T: Copy>(output: &mut [T], elements: &Range<usize>, value: T) {
    if !output.is_empty() {
        output[elements.clone()].fill(value);
    }
}

/// Cuts off the first values, or none of an output that is not wanted.
#[allow(clippy::mut_mut, reason = "the slice itself moves on")]
pub(crate) fn split_off<'a, T>(values: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let count = count.min(values.len());
    let (front, rest) = std::mem::take(values).split_at_mut(count);
    *values = rest;
    front
}
