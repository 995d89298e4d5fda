//! The source of samples: anything that can copy a stretch of a record, addressed by absolute sample number.

/// The largest magnitude a sample may have: its square, summed over a long window and weighted, must not overflow.
///
/// Larger values are treated like infinities.
pub(crate) const LARGEST: f64 = 1e140;

/// A record of one channel.
///
/// The core only ever copies short stretches out of it, so a record may live in foreign memory, with any stride and number type,
/// or in a file.
pub trait Samples: Sync {
    /// Number of samples.
    fn len(&self) -> usize;

    /// Copies the samples `first .. first + into.len()`, all of which exist.
    fn read(&self, first: usize, into: &mut [f64]);

    /// Whether there is no sample at all.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Samples for &[f64] {
    fn len(&self) -> usize {
        <[f64]>::len(self)
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        into.copy_from_slice(&self[first..first + into.len()]);
    }
}

/// Copies samples from a place that may lie before the record or reach beyond its end; samples that do not exist are missing.
pub(crate) fn read_around(channel: &dyn Samples, begin: isize, into: &mut [f64]) {
    let end = begin + into.len().cast_signed();
    let present = begin.max(0)..end.min(channel.len().cast_signed());
    into.fill(f64::NAN);
    if !present.is_empty() {
        let place = (present.start - begin).unsigned_abs();
        let count = (present.end - present.start).unsigned_abs();
        channel.read(present.start.unsigned_abs(), &mut into[place..place + count]);
    }
}

/// Whether all samples are usable.
#[inline]
#[must_use]
pub(crate) fn all_usable(values: &[f64]) -> bool {
    // No early return, so that the loop becomes vector instructions.
    values.iter().fold(true, |usable, &value| usable & is_usable(value))
}

/// Whether a sample is usable: neither missing, nor infinite, nor so large that its square is.
#[inline]
#[must_use]
pub(crate) fn is_usable(value: f64) -> bool {
    value.abs() <= LARGEST
}
