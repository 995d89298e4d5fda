//! Flags of samples and of records. Data never raises: it gets a status, and the rest of the record goes on.

use std::ops::{BitOr, BitOrAssign};

/// Flags of one window or sample, or of a whole record. Zero is good.
///
/// There are two groups. [`Status::INVALID`] to [`Status::ILL_CONDITIONED`] say what holds at one sample; [`Status::NOISE_MODEL`] to
/// [`Status::CHANNEL_SUSPECTED`] concern the record. Of a record [`Status::RANK_DEFICIENT`] and [`Status::ILL_CONDITIONED`] are about what is
/// constant, the latter about signs that no machine has, too; at a sample [`Status::NOISE_MODEL`] says that much more is left around it than elsewhere, or that it lies outside a mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub struct Status(u16);

impl Status {
    /// Nothing to report.
    pub const GOOD: Self = Self(0);
    /// There is no value here: it is NaN. The only flag that goes with NaN.
    pub const INVALID: Self = Self(1);
    /// Near an end of the record: evaluated off the centre of its window, or with fewer equations.
    pub const EDGE: Self = Self(1 << 1);
    /// Samples are missing or masked out here: the value comes from the samples around.
    pub const GAP: Self = Self(1 << 2);
    /// The lowest candidate order was chosen; the paper advises a longer window.
    pub const LOWEST_ORDER: Self = Self(1 << 3);
    /// The highest candidate order was chosen; the paper advises a shorter window or a higher `max_order`.
    pub const HIGHEST_ORDER: Self = Self(1 << 4);
    /// The residual is at the floor set by rounding or quantisation: there is no noise to compare orders with.
    pub const EXACT: Self = Self(1 << 5);
    /// The equations do not determine the parameters. Goes with [`Status::INVALID`].
    pub const RANK_DEFICIENT: Self = Self(1 << 6);
    /// The regressors are nearly collinear: the equations hardly distinguish the parameters.
    pub const ILL_CONDITIONED: Self = Self(1 << 7);

    /// Rows are predicted much worse than the noise of the channels explains: standard errors are estimated from the residuals.
    pub const NOISE_MODEL: Self = Self(1 << 8);
    /// The residuals are correlated over more than a test function.
    pub const COLOURED: Self = Self(1 << 9);
    /// A parameter taken as constant differs between parts of the record.
    pub const KIND_CONTRADICTED: Self = Self(1 << 10);
    /// The best length of a window or test function is the shortest or longest that was tried.
    pub const WINDOW_LIMIT: Self = Self(1 << 11);
    /// The torque seems to be delayed.
    pub const LAG_SUSPECTED: Self = Self(1 << 12);
    /// A term seems to be missing: friction, an offset or a hardening spring.
    pub const TERM_SUSPECTED: Self = Self(1 << 13);

    /// Test functions of different widths find different parameters, and no range of widths agrees: the record does not obey the equation.
    pub const SCALES_DISAGREE: Self = Self(1 << 14);

    /// A channel seems to be clipped, held, interpolated, wrapped or filtered by more than a lag.
    pub const CHANNEL_SUSPECTED: Self = Self(1 << 15);

    /// Every flag that exists, with its name.
    pub const NAMED: [(&'static str, Self); 16] = [
        ("INVALID", Self::INVALID),
        ("EDGE", Self::EDGE),
        ("GAP", Self::GAP),
        ("LOWEST_ORDER", Self::LOWEST_ORDER),
        ("HIGHEST_ORDER", Self::HIGHEST_ORDER),
        ("EXACT", Self::EXACT),
        ("RANK_DEFICIENT", Self::RANK_DEFICIENT),
        ("ILL_CONDITIONED", Self::ILL_CONDITIONED),
        ("NOISE_MODEL", Self::NOISE_MODEL),
        ("COLOURED", Self::COLOURED),
        ("KIND_CONTRADICTED", Self::KIND_CONTRADICTED),
        ("WINDOW_LIMIT", Self::WINDOW_LIMIT),
        ("LAG_SUSPECTED", Self::LAG_SUSPECTED),
        ("TERM_SUSPECTED", Self::TERM_SUSPECTED),
        ("SCALES_DISAGREE", Self::SCALES_DISAGREE),
        ("CHANNEL_SUSPECTED", Self::CHANNEL_SUSPECTED),
    ];

    /// The flags as a number, as they are stored in arrays.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Flags as they are stored in arrays, in the same memory.
    pub(crate) fn of_column(column: Vec<u16>) -> Vec<Self> {
        column.into_iter().map(Self).collect()
    }

    /// Whether every flag of `other` is set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl BitOr for Status {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Status {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_flags_stays_where_it_is() {
        let column = vec![0_u16, 1, 64, u16::MAX];
        let (place, room) = (column.as_ptr(), column.capacity());
        let flags = Status::of_column(column);
        assert_eq!(flags, [Status::GOOD, Status::INVALID, Status::RANK_DEFICIENT, Status(u16::MAX)]);
        assert_eq!((flags.as_ptr().cast(), flags.capacity()), (place, room));
        let back: Vec<u16> = flags.into_iter().map(Status::bits).collect();
        assert_eq!((back.as_ptr(), back.capacity()), (place, room));
    }
}
