//! Slowly varying coefficients as curves over time, given by their values at equidistant points.

/// Slowly varying coefficients over time.
#[derive(Clone, Debug)]
pub(crate) struct Varying {
    /// Rows from one point to the next.
    pub(crate) spacing: f64,
    /// Stretches between which they may jump: the row of the first point of each, and its place among the points.
    pub(crate) stretches: Vec<(f64, usize)>,
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
        let (points, first) = self.stretch(&self.values[coefficient], row);
        interpolate(points, (row - first) / self.spacing, self.spacing)
    }

    /// Its mean, each point counting as much as it is known.
    pub(crate) fn mean(&self, coefficient: usize) -> f64 {
        let points = self.values[coefficient].iter().zip(&self.variances[coefficient]);
        let [sum, weights] = points.fold([0.0; 2], |[sum, weights], (value, variance)| {
            let weight = if *variance > 0.0 { variance.recip() } else { 0.0 };
            [sum + weight * value, weights + weight]
        });
        if weights > 0.0 { sum / weights } else { 0.0 }
    }

    /// Coefficients by their regressors, each by its mean.
    pub(crate) fn levels(&self, regressors: &[usize]) -> Vec<(usize, f64)> {
        regressors.iter().enumerate().map(|(coefficient, &one)| (one, self.mean(coefficient))).collect()
    }

    /// The first rows of stretches, but for the first stretch.
    pub(crate) fn breaks(&self) -> Vec<usize> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rows")]
        let rows = |(first, _): &(f64, usize)| *first as usize;
        self.stretches.iter().skip(1).map(rows).collect()
    }

    /// The points of the stretch that a row belongs to, and the row of the first of them.
    fn stretch<'a>(&self, points: &'a [f64], row: f64) -> (&'a [f64], f64) {
        let next = self.stretches.partition_point(|(first, _)| *first <= row).max(1);
        let (first, place) = self.stretches[next - 1];
        let end = self.stretches.get(next).map_or(points.len(), |(_, place)| *place);
        (&points[place..end], first)
    }

    /// Its variance over that of a row's noise.
    pub(crate) fn variance(&self, coefficient: usize, row: f64) -> f64 {
        let (points, first) = self.stretch(&self.variances[coefficient], row);
        let place = (row - first) / self.spacing;
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
        let stretches = vec![(0.0, 0)];
        Varying { spacing: 4.0, stretches, values: vec![values], variances: vec![variances], constants: Vec::new() }
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
    fn a_mean_counts_points_as_much_as_they_are_known() {
        // Zero to eight, the ends known a ninth as well as the others.
        let curve = curve(|row| row / 4.0);
        assert!((curve.mean(0) - 4.0).abs() < 1e-12);
        let mut uneven = curve.clone();
        uneven.variances[0] = vec![1.0; 9];
        uneven.variances[0][8] = f64::INFINITY;
        assert_eq!(uneven.levels(&[7]), [(7, 3.5)]);
    }

    #[test]
    fn beyond_the_ends_nothing_changes() {
        let curve = curve(|row| 1.0 + row);
        assert_eq!(curve.at(0, -7.0), (1.0, 0.0));
        assert_eq!(curve.at(0, 40.0), (33.0, 0.0));
    }

    #[test]
    fn stretches_know_nothing_of_each_other() {
        let mut curve = curve(|row| if row < 18.0 { 1.0 } else { 5.0 });
        curve.stretches = vec![(0.0, 0), (18.0, 5)];
        assert!((0..72).all(|quarter| curve.at(0, f64::from(quarter) / 4.0) == (1.0, 0.0)));
        assert!((72..160).all(|quarter| curve.at(0, f64::from(quarter) / 4.0) == (5.0, 0.0)));
        assert_eq!(curve.at(0, -3.0), (1.0, 0.0));
        assert_eq!([0.0, 18.0, 30.0].map(|row| curve.variance(0, row)), [9.0, 1.0, 9.0]);
    }

    #[test]
    fn a_variance_is_nowhere_below_those_of_the_points_beside_it() {
        let curve = curve(|_| 0.0);
        assert_eq!([0.0, 8.0, 16.0, 32.0].map(|row| curve.variance(0, row)), [9.0, 1.0, 1.0, 9.0]);
        assert!((0..=320).all(|tenth| curve.variance(0, f64::from(tenth) / 10.0) >= 1.0));
    }
}
