//! Which windows of a cell are solved: some work needs those on one side of its rows alone, other work those on both.

/// Which windows of a cell are solved: those on one side of its rows, and those on both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sides {
    pub(crate) one: bool,
    pub(crate) both: bool,
}

impl Sides {
    pub(crate) const ALL: Self = Self { one: true, both: true };

    /// Whether others are among them.
    pub(crate) fn hold(self, others: Self) -> bool {
        (self.one || !others.one) && (self.both || !others.both)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_sides_hold_any_and_one_holds_itself() {
        let [one, both, neither] =
            [(true, false), (false, true), (false, false)].map(|(one, both)| Sides { one, both });
        for sides in [one, both, neither, Sides::ALL] {
            assert!(Sides::ALL.hold(sides) && sides.hold(sides) && sides.hold(neither));
        }
        assert!(!one.hold(both) && !both.hold(one) && !both.hold(Sides::ALL) && !neither.hold(one));
    }
}
