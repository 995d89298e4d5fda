//! The median, and what the median of squares says of the variance of normal noise.

/// The median of squares of normal noise over their variance: that of a χ² variable with one degree of freedom.
pub(crate) const MEDIAN_OF_SQUARES: f64 = 0.454_936;

/// The median, of an even number the larger of both; nothing of none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_middle_one_or_the_larger_of_two() {
        assert_eq!(median(&mut [3.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [3.0, -1.0, 2.0, 7.0]), Some(3.0));
        assert_eq!(median(&mut []), None);
    }
}
