//! Rows at which windows are carried on from beside a gap.

/// Rows that are farther than a reach from every row that is an equation: what is windowed is carried on there from beside the gap, and no error knows what
/// it does meanwhile.
pub(crate) fn far_from_equations(usable: &[bool], reach: usize) -> Vec<bool> {
    let mut far = vec![true; usable.len()];
    let mut near = 0;
    for row in (0..usable.len()).filter(|&row| usable[row]) {
        let end = (row + reach + 1).min(usable.len());
        far[near.max(row.saturating_sub(reach))..end].fill(false);
        near = end;
    }
    far
}

#[cfg(test)]
mod tests {
    use super::far_from_equations;

    #[test]
    fn rows_are_far_from_equations_beyond_the_reach_of_all() {
        let usable = [false, false, true, true, false, false, false, false, false, true, false];
        let far = |reach| far_from_equations(&usable, reach).iter().map(|&far| u8::from(far)).collect::<Vec<_>>();
        assert_eq!(far(0), [1, 1, 0, 0, 1, 1, 1, 1, 1, 0, 1]);
        assert_eq!(far(1), [1, 0, 0, 0, 0, 1, 1, 1, 0, 0, 0]);
        assert_eq!(far(2), [0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
        assert_eq!(far(3), [0; 11]);
        assert_eq!(far_from_equations(&[false; 3], 5), [true; 3]);
    }
}
