//! The latest samples of a record that goes on, known by their absolute sample numbers.

use crate::record::samples::Samples;

/// Samples that are still needed of all that came so far.
///
/// Samples that were forgotten read as zero: no window that is still wanted holds them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Retained {
    /// Number of the first sample in `values`.
    first: usize,
    values: Vec<f64>,
}

impl Retained {
    /// Samples from number `first` on.
    pub(crate) fn new(first: usize, values: Vec<f64>) -> Self {
        Self { first, values }
    }

    /// Appends samples `from ..` of a record, as many as there are.
    pub(crate) fn read_from(&mut self, record: &dyn Samples, from: usize, count: usize) {
        let held = self.values.len();
        self.values.resize(held + count, 0.0);
        record.read(from, &mut self.values[held..]);
    }

    /// Forgets samples before one; they are moved out only once half of the memory is theirs, so that a sample costs the same always.
    pub(crate) fn forget_before(&mut self, sample: usize) {
        let gone = sample.saturating_sub(self.first).min(self.values.len());
        if 2 * gone > self.values.len() {
            self.values.drain(..gone);
            self.first += gone;
        }
    }

    /// The samples from one on and the number of the first: what resuming needs.
    pub(crate) fn from(&self, sample: usize) -> (usize, &[f64]) {
        let gone = sample.saturating_sub(self.first).min(self.values.len());
        (self.first + gone, &self.values[gone..])
    }
}

impl Samples for Retained {
    fn len(&self) -> usize {
        self.first + self.values.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        let forgotten = self.first.saturating_sub(first).min(into.len());
        let (before, rest) = into.split_at_mut(forgotten);
        before.fill(0.0);
        if !rest.is_empty() {
            let place = first + forgotten - self.first;
            rest.copy_from_slice(&self.values[place..place + rest.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_stays_within_twice_of_what_is_needed() {
        let mut record = Retained::default();
        let mut largest = 0;
        for sample in 0..10_000_usize {
            record.read_from(&[sample as f64].as_slice(), 0, 1);
            record.forget_before((sample + 1).saturating_sub(100));
            largest = largest.max(record.values.len());
            let mut last = vec![0.0; 100.min(sample + 1)];
            record.read((sample + 1).saturating_sub(100), &mut last);
            assert!((0..last.len()).all(|back| last[last.len() - 1 - back] == (sample - back) as f64));
        }
        assert_eq!(record.len(), 10_000);
        assert!(largest <= 201, "{largest}");
    }

    #[test]
    fn what_was_forgotten_is_zero() {
        let record = Retained::new(5, vec![5.0, 6.0, 7.0]);
        let mut found = [9.0; 4];
        record.read(3, &mut found);
        assert_eq!(found, [0.0, 0.0, 5.0, 6.0]);
        assert_eq!(record.from(6), (6, &[6.0, 7.0][..]));
    }
}
