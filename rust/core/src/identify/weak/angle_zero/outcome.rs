//! What was found of the angle at which the spring is relaxed, and of an offset that is free instead.

use crate::inference::short_parts::LEFT_WHERE_LOST;
use crate::regression::limits::NOISE_MODEL_FAILS;

/// The part of the mean squared error of predicting rows that a free offset must leave at most to be worth it.
const BETTER: f64 = 0.9;

/// The angle at which the spring is relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleZero {
    /// In the unit of the angle.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// Mean squared errors of predicting rows, over the noise's: with the offset as it is, and with one that is free in every window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeOffset {
    /// With the offset as it is.
    pub error: f64,
    /// With a free one.
    pub free: f64,
}

impl Default for FreeOffset {
    /// Nothing was compared.
    fn default() -> Self {
        Self { error: f64::NAN, free: f64::NAN }
    }
}

impl FreeOffset {
    /// Whether a free one is worth it. It follows a little of whatever is missing: where hardly a row is within the noise it must explain
    /// nearly all of that.
    #[must_use]
    pub fn is_better(&self) -> bool {
        let most = NOISE_MODEL_FAILS.max(LEFT_WHERE_LOST * self.error);
        let explains = self.error < NOISE_MODEL_FAILS || self.free < most;
        explains && self.free < BETTER * self.error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_free_offset_is_worth_it_where_it_predicts_a_tenth_better() {
        assert!(FreeOffset { error: 2.0, free: 1.7 }.is_better());
        assert!(!FreeOffset { error: 2.0, free: 1.9 }.is_better());
        assert!(!FreeOffset::default().is_better());
        assert!(FreeOffset { error: 40.0, free: 2.0 }.is_better());
        assert!(!FreeOffset { error: 40.0, free: 5.0 }.is_better());
        assert!(FreeOffset { error: 19_000.0, free: 56.0 }.is_better());
        assert!(!FreeOffset { error: 19_000.0, free: 9_000.0 }.is_better());
    }
}
