//! Where the motion ends, and how much noise the torque has, where channels were low-passed: noise falls with the frequency there, and cannot be read at
//! the highest ones.

use crate::identify::weak::options::WeakOptions;
use crate::noise::low_passed::{is_low_passed, largest_density_at_rest};
use crate::noise::shared_band::{noise_above, shared_until};
use crate::weak_form::weak_rows::Record;

/// What is known of a record of which a channel was low-passed, or both by the same filter.
pub(crate) struct BelowFilter {
    /// Where the motion ends, if the width of the test function is to be chosen.
    pub(crate) until: Option<f64>,
    /// Variances of the torque's noise: what it shows above the motion, and at the highest frequencies, where a filter of the torque alone left less.
    pub(crate) torque_noise: [f64; 2],
}

impl BelowFilter {
    /// Of a torque whose quietest band has so much noise.
    pub(crate) fn new(record: &Record<'_>, options: &WeakOptions, quietest: f64) -> Self {
        let (Record { angle, torque, weights, .. }, is_chosen) = (record, options.half_width.is_none());
        let mut known = Self { until: None, torque_noise: [quietest; 2] };
        if record.noise.is_some() {
            return known;
        }
        let until = || if is_chosen { shared_until(*angle, *torque) } else { None };
        match [*angle, *torque].map(is_low_passed) {
            [false, false] => {}
            [true, false] => known.until = until(),
            [false, true] => {
                if options.noise[1].is_none() {
                    known.torque_noise[0] = quietest.max(largest_density_at_rest(*angle, *torque, *weights));
                }
                known.until = until();
            }
            [true, true] => {
                if options.noise == [None; 2]
                    && weights.is_none()
                    && let Some(until) = shared_until(*angle, *torque)
                    && let Some(density) = noise_above(until, *angle, *torque)
                {
                    known.torque_noise = [quietest.max(density); 2];
                    known.until = Some(until).filter(|_| is_chosen);
                }
            }
        }
        known
    }
}
