//! Channels computed from other channels while they are read, so that no long record is held twice.

use std::ops::Range;

use crate::record::samples::{Samples, read_around};

/// One at every sample.
pub(crate) struct Ones(pub(crate) usize);

impl Samples for Ones {
    fn len(&self) -> usize {
        self.0
    }

    fn read(&self, _first: usize, into: &mut [f64]) {
        into.fill(1.0);
    }
}

/// A channel as it is.
pub(crate) struct Whole<'a>(pub(crate) &'a dyn Samples);

impl Samples for Whole<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.0.read(first, into);
    }
}

/// Some samples of a channel, as a record of their own.
pub(crate) struct Cut<'a> {
    pub(crate) channel: &'a dyn Samples,
    pub(crate) samples: Range<usize>,
}

impl Samples for Cut<'_> {
    fn len(&self) -> usize {
        self.samples.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.channel.read(self.samples.start + first, into);
    }
}

/// A channel that counts from another zero.
pub(crate) struct Shifted<'a> {
    pub(crate) channel: &'a dyn Samples,
    pub(crate) zero: f64,
}

impl Samples for Shifted<'_> {
    fn len(&self) -> usize {
        self.channel.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.channel.read(first, into);
        for value in into {
            *value -= self.zero;
        }
    }
}

/// A channel that is delayed by whole samples. Samples beyond its ends are missing.
pub(crate) struct Late<'a> {
    pub(crate) channel: &'a dyn Samples,
    pub(crate) samples: isize,
}

impl Samples for Late<'_> {
    fn len(&self) -> usize {
        self.channel.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        read_around(self.channel, first.cast_signed() + self.samples, into);
    }
}

/// A derivative of a known coefficient times the angle.
pub(crate) struct Scaled<'a> {
    pub(crate) factor: &'a dyn Samples,
    pub(crate) angle: &'a dyn Samples,
    pub(crate) derivative: usize,
    pub(crate) delta: f64,
}

impl Samples for Scaled<'_> {
    fn len(&self) -> usize {
        self.angle.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.angle.read(first, into);
        let total = self.factor.len();
        let begin = first.saturating_sub(1);
        let mut factor = vec![0.0; (first + into.len() + 1).min(total) - begin];
        self.factor.read(begin, &mut factor);
        // Beyond an end the coefficient stays as it is.
        let at = |sample: isize| {
            let place = (sample - begin.cast_signed()).clamp(0, factor.len().cast_signed() - 1);
            factor[place.unsigned_abs()]
        };
        for (sample, value) in (first.cast_signed()..).zip(into) {
            let (before, here, after) = (at(sample - 1), at(sample), at(sample + 1));
            *value *= match self.derivative {
                0 => here,
                1 => (after - before) / (2.0 * self.delta),
                _ => (after - 2.0 * here + before) / (self.delta * self.delta),
            };
        }
    }
}

/// A function of a channel, applied in place.
pub(crate) struct Mapped<'a> {
    pub(crate) channel: &'a dyn Samples,
    pub(crate) function: fn(&mut [f64]),
}

impl Samples for Mapped<'_> {
    fn len(&self) -> usize {
        self.channel.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.channel.read(first, into);
        (self.function)(into);
    }
}

/// A channel that is known every `stride` samples from sample `first` on, interpolated between them.
pub(crate) struct Interpolated<'a> {
    pub(crate) values: &'a [f64],
    pub(crate) first: usize,
    pub(crate) stride: usize,
    pub(crate) samples: usize,
}

impl Samples for Interpolated<'_> {
    fn len(&self) -> usize {
        self.samples
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        let last = self.values.len() - 1;
        for (sample, value) in (first..).zip(into) {
            let place = (sample as f64 - self.first as f64) / self.stride as f64;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the rows")]
            let row = place.floor().clamp(0.0, last as f64) as usize;
            let part = (place - row as f64).clamp(0.0, 1.0);
            let (here, next) = (self.values[row], self.values[(row + 1).min(last)]);
            *value = here + part * (next - here);
        }
    }
}

/// The sign of a number; zero has none.
pub(crate) fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}
