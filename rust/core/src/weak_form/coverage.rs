//! The share of rows without a missing sample, by the half-width of the test function.

use crate::record::samples::is_usable;
use crate::weak_form::weak_rows::Record;

/// A half-width is no start if it leaves less than this share of the rows that the narrowest one leaves.
const FEW: f64 = 0.5;

/// Samples that are read together.
const PIECE: usize = 4096;

/// Where samples are missing and where centres may lie.
pub(crate) struct Usable {
    samples: usize,
    /// Missing samples before each sample, and in all; `None` if none is missing.
    missing: Vec<u32>,
    /// Samples that may be centres, or `None` if all may.
    centres: Option<Vec<usize>>,
}

impl Usable {
    pub(crate) fn new(record: &Record<'_>) -> Self {
        let samples = record.angle.len();
        let (mut angle, mut torque) = (vec![0.0; PIECE], vec![0.0; PIECE]);
        let mut missing = Vec::new();
        let mut count = 0;
        for first in (0..samples).step_by(PIECE) {
            let piece = PIECE.min(samples - first);
            record.angle.read(first, &mut angle[..piece]);
            record.torque.read(first, &mut torque[..piece]);
            let lost = |place: usize| !is_usable(angle[place]) || !is_usable(torque[place]);
            if missing.is_empty() && !(0..piece).any(lost) {
                continue;
            }
            missing.resize(missing.len().max(first + 1), 0);
            missing.extend((0..piece).map(|place| {
                count += u32::from(lost(place));
                count
            }));
        }
        let centres = record.mask.map(|mask| (0..samples).filter(|&sample| mask[sample]).collect());
        Self { samples, missing, centres }
    }

    /// The usable share of all rows of a half-width.
    pub(crate) fn share(&self, half: usize) -> f64 {
        let samples = self.samples;
        if samples <= 2 * half {
            return 0.0;
        }
        let inside = half..samples - half;
        let missing = &self.missing;
        let whole = |centre: &usize| missing.is_empty() || missing[centre + half + 1] == missing[centre - half];
        let count = match &self.centres {
            None if missing.is_empty() => return 1.0,
            None => inside.clone().filter(whole).count(),
            Some(centres) => {
                centres.iter().filter(|centre| inside.contains(centre)).filter(|centre| whole(centre)).count()
            }
        };
        count as f64 / inside.len() as f64
    }

    /// The nearest half-width below a given one for which gaps leave enough rows. `halves` rise.
    pub(crate) fn widest(&self, wanted: usize, widths: &[usize]) -> usize {
        let Some(&narrowest) = widths.first() else { return wanted };
        let enough = FEW * self.share(narrowest);
        if self.share(wanted) >= enough {
            return wanted;
        }
        widths.iter().rev().copied().find(|&width| width < wanted && self.share(width) >= enough).unwrap_or(narrowest)
    }
}
