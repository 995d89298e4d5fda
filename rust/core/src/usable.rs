//! How many rows of a record hold no missing sample, by the half-width of their test function.

use crate::samples::is_usable;
use crate::weak_form::Record;

/// A width that leaves less than this part of the rows that the narrowest leaves is no place to begin.
const FEW: f64 = 0.5;

/// Where samples are missing and where centres may lie.
pub(crate) struct Usable {
    /// Missing samples before each sample.
    missing: Vec<u32>,
    /// Samples that may be centres, where not all may.
    centres: Option<Vec<usize>>,
}

impl Usable {
    pub(crate) fn new(record: &Record<'_>) -> Self {
        let samples = record.angle.len();
        let (mut angle, mut torque) = (vec![0.0; samples], vec![0.0; samples]);
        record.angle.read(0, &mut angle);
        record.torque.read(0, &mut torque);
        let mut missing = Vec::with_capacity(samples + 1);
        let mut count = 0;
        missing.push(count);
        for (angle, torque) in angle.iter().zip(&torque) {
            count += u32::from(!is_usable(*angle) || !is_usable(*torque));
            missing.push(count);
        }
        let centres = record.mask.map(|mask| (0..samples).filter(|&sample| mask[sample]).collect());
        Self { missing, centres }
    }

    /// The part of all rows of a half-width that can be used.
    pub(crate) fn share(&self, half: usize) -> f64 {
        let samples = self.missing.len() - 1;
        if samples <= 2 * half {
            return 0.0;
        }
        let inside = half..samples - half;
        let whole = |centre: &usize| self.missing[centre + half + 1] == self.missing[centre - half];
        let count = match &self.centres {
            None if self.missing[samples] == 0 => return 1.0,
            None => inside.clone().filter(whole).count(),
            Some(centres) => {
                centres.iter().filter(|centre| inside.contains(centre)).filter(|centre| whole(centre)).count()
            }
        };
        count as f64 / inside.len() as f64
    }

    /// The half-width nearest to one below it, of some in rising order, that gaps leave enough rows.
    pub(crate) fn widest(&self, wanted: usize, widths: &[usize]) -> usize {
        let Some(&narrowest) = widths.first() else { return wanted };
        let enough = FEW * self.share(narrowest);
        if self.share(wanted) >= enough {
            return wanted;
        }
        widths.iter().rev().copied().find(|&width| width < wanted && self.share(width) >= enough).unwrap_or(narrowest)
    }
}
