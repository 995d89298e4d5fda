//! Where samples come from: anything that can copy a stretch of a record, known by absolute sample numbers.

/// The largest magnitude a sample may have: its square, summed over a long window and weighted, must not overflow.
///
/// Larger values are treated like infinities.
pub const LARGEST: f64 = 1e140;

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

/// Whether all samples can be worked with.
#[inline]
#[must_use]
pub(crate) fn all_usable(values: &[f64]) -> bool {
    // No early return, so that the loop becomes vector instructions.
    values.iter().fold(true, |usable, &value| usable & is_usable(value))
}

/// Whether a sample can be worked with: neither missing, nor infinite, nor so large that its square is.
#[inline]
#[must_use]
pub fn is_usable(value: f64) -> bool {
    value.abs() <= LARGEST
}
