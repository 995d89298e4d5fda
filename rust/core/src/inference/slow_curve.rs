//! Slowly varying coefficients as curves over time, given by their values at equidistant points.

/// Slowly varying coefficients over time.
#[derive(Clone, Debug)]
pub(crate) struct Varying {
    /// Row of the first point, and rows from one to the next.
    pub(crate) first: f64,
    pub(crate) spacing: f64,
    /// By coefficient, by point.
    pub(crate) values: Vec<Vec<f64>>,
    /// Their variances over that of a row's noise, as if all equations were independent.
    pub(crate) variances: Vec<Vec<f64>>,
    /// The constants that were estimated with them.
    pub(crate) constants: Vec<f64>,
}

impl Varying {
    /// A coefficient at a row and its growth per row.
    pub(crate) fn at(&self, coefficient: usize, row: f64) -> (f64, f64) {
        interpolate(&self.values[coefficient], (row - self.first) / self.spacing, self.spacing)
    }

    /// Its variance over that of a row's noise.
    pub(crate) fn variance(&self, coefficient: usize, row: f64) -> f64 {
        let (points, place) = (&self.variances[coefficient], (row - self.first) / self.spacing);
        let last = points.len() - 1;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the points")]
        let index = (place.clamp(0.0, last as f64).floor() as usize).min(last.saturating_sub(1));
        // Where the variance falls steeply the cubic overshoots, below zero too.
        let least = points[index].min(points[(index + 1).min(last)]);
        interpolate(points, place, 1.0).0.max(least)
    }
}

/// Interpolates between points a distance of `spacing` apart by the cubic through the nearest four; constant beyond the ends. Returns
/// the value and its slope.
fn interpolate(values: &[f64], place: f64, spacing: f64) -> (f64, f64) {
    let last = values.len() - 1;
    let clamped = place.clamp(0.0, last as f64);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the points")]
    let index = (clamped.floor() as usize).min(last.saturating_sub(1));
    let part = clamped - index as f64;
    let at = |offset: isize| values[index.saturating_add_signed(offset).min(last)];
    let (before, here, next, after) = (at(-1), at(0), at(1), at(2));
    let (begin, end) = ((next - before) / 2.0, (after - here) / 2.0);
    let (second, third) = (3.0 * (next - here) - 2.0 * begin - end, 2.0 * (here - next) + begin + end);
    let value = here + part * (begin + part * (second + part * third));
    let slope = if clamped == place { begin + part * (2.0 * second + 3.0 * part * third) } else { 0.0 };
    (value, slope / spacing)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(values: impl Fn(f64) -> f64) -> Varying {
        let values = (0..9).map(|point| values(f64::from(point) * 4.0)).collect();
        let variances = vec![9.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 9.0];
        Varying { first: 0.0, spacing: 4.0, values: vec![values], variances: vec![variances], constants: Vec::new() }
    }

    #[test]
    fn parabolas_are_interpolated_exactly_between_inner_points() {
        let curve = curve(|row| 3.0 - 0.5 * row + 0.02 * row * row);
        for row in 4..28 {
            let row = f64::from(row) + 0.25;
            let (value, slope) = curve.at(0, row);
            assert!((value - (3.0 - 0.5 * row + 0.02 * row * row)).abs() < 1e-12);
            assert!((slope - (-0.5 + 0.04 * row)).abs() < 1e-12);
        }
    }

    #[test]
    fn beyond_the_ends_nothing_changes() {
        let curve = curve(|row| 1.0 + row);
        assert_eq!(curve.at(0, -7.0), (1.0, 0.0));
        assert_eq!(curve.at(0, 40.0), (33.0, 0.0));
    }

    #[test]
    fn a_variance_is_nowhere_below_those_of_the_points_beside_it() {
        let curve = curve(|_| 0.0);
        assert_eq!([0.0, 8.0, 16.0, 32.0].map(|row| curve.variance(0, row)), [9.0, 1.0, 1.0, 9.0]);
        assert!((0..=320).all(|tenth| curve.variance(0, f64::from(tenth) / 10.0) >= 1.0));
    }
}
