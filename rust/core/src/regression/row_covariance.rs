//! The covariance of rows: known from the noise of both channels, or estimated from the residuals.

use std::borrow::Cow;
use std::ops::Range;

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::regression::problem::Correlated;
use crate::regression::row_neighbours::{AddNeighbours, LaggedProducts, SumOfProducts, products};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};
use crate::weak_form::test_function::Kernels;

/// Correlations that exceed their standard deviation so many times are significant.
const CHANCE: f64 = 5.0;

/// Rounds of all equations whose weights are laid out side by side.
const ROUNDS: usize = 16;

/// Rows that are multiplied at a time.
const PIECE: usize = 1 << 11;

/// Covariance of rows by their distance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RowCovariance {
    /// By distance in rows, beginning with the variance; the mean over the places of rows where these differ.
    pub(crate) lags: Vec<f64>,
    /// Of rows of several equations that take turns.
    places: Option<EquationLags>,
}

/// Covariances of rows of several equations that take turns: every equation has another noise, which it shares with some of the others.
#[derive(Clone, Debug, PartialEq)]
struct EquationLags {
    /// How many equations there are.
    count: usize,
    /// That of row 0.
    first: usize,
    /// By distance, then by equation: the covariance of one of its rows with the row that comes so much later.
    lags: Vec<f64>,
}

impl RowCovariance {
    /// The covariance of rows that are all alike.
    pub(crate) fn by_distance(lags: Vec<f64>) -> Self {
        Self { lags, places: None }
    }

    /// The covariance of rows of several equations that take turns, beginning with the first: `between(distance, equation)` is that of a row
    /// of an equation with the row that comes so much later.
    pub(crate) fn of_equations(count: usize, distances: usize, between: impl Fn(usize, usize) -> f64) -> Self {
        let lags: Vec<f64> = (0..distances)
            .flat_map(|lag| (0..count).map(move |place| (lag, place)))
            .map(|(a, b)| between(a, b))
            .collect();
        let mean = lags.chunks(count).map(|lag| lag.iter().sum::<f64>() / count as f64).collect();
        Self { lags: mean, places: (count > 1).then_some(EquationLags { count, first: 0, lags }) }
    }

    /// The covariance of rows of one record, where the rows of many lie side by side: so many at every time, of which its own belong to `equations`. Rows of
    /// others have no noise in common with them.
    pub(crate) fn of_one_record(&self, group: usize, equations: usize) -> Self {
        let between = |lag: usize, one: usize| {
            let (times, other) = ((one + lag) / equations, (one + lag) % equations);
            (times * group + other).checked_sub(one).map_or(0.0, |lag| self.at(lag, one))
        };
        Self::of_equations(equations, self.lags.len().div_ceil(group) * equations, between)
    }

    /// The covariance of a row of an equation with the row that comes so much later.
    fn at(&self, lag: usize, equation: usize) -> f64 {
        let alike = || self.lags.get(lag).copied();
        let of_equation = |places: &EquationLags| places.lags.get(lag * places.count + equation).copied();
        self.places.as_ref().map_or_else(alike, of_equation).unwrap_or(0.0)
    }

    /// The mean over all equations.
    pub(crate) fn mean(&self) -> Self {
        Self::by_distance(self.lags.clone())
    }

    /// The same where a row is counted as row 0.
    pub(crate) fn beginning_at(&self, row: usize) -> Self {
        let mut moved = self.clone();
        if let Some(places) = &mut moved.places {
            places.first = (places.first + row) % places.count;
        }
        moved
    }

    /// The covariance that the noise of both channels gives rows `stride` samples apart. `parameters` are inertia,
    /// damping and stiffness; `kernels` are those by which the angle's noise enters; the noise is given by its variance, that of the angle first.
    pub(crate) fn known(
        kernels: &Kernels,
        torque: &[f64],
        parameters: [f64; 3],
        noise: [f64; 2],
        stride: usize,
    ) -> Self {
        let [inertia, damping, stiffness] = &kernels.values;
        let mixed: Vec<f64> = (0..inertia.len())
            .map(|k| parameters[0] * inertia[k] + parameters[1] * damping[k] + parameters[2] * stiffness[k])
            .collect();
        let lags = (0..inertia.len())
            .step_by(stride)
            .map(|lag| noise[0] * products(&mixed, &mixed, lag) + noise[1] * products(torque, torque, lag));
        Self::by_distance(lags.collect())
    }

    /// The covariance of rows with independent noise of variance one.
    pub(crate) fn white() -> Self {
        Self::by_distance(vec![1.0])
    }

    /// The covariance estimated from residuals up to some distance, tapered to stay positive semidefinite.
    pub(crate) fn of_residuals(residuals: &[f64], usable: &[bool], farthest: usize) -> Self {
        let whole = usable.iter().all(|&usable| usable);
        let missing = |(residual, usable): (&f64, &bool)| if *usable { *residual } else { 0.0 };
        let residuals: Cow<'_, [f64]> =
            if whole { residuals.into() } else { residuals.iter().zip(usable).map(missing).collect() };
        let mut sums = vec![0.0; farthest + 1];
        dispatch(Instructions::current(), LaggedProducts { values: &residuals, sums: &mut sums });
        let lags = sums.into_iter().enumerate().map(|(lag, sum)| {
            let rows = residuals.len().saturating_sub(lag);
            let later = residuals.len() - rows;
            let pairs = || usable[..rows].iter().zip(&usable[later..]);
            let count = if whole { rows } else { pairs().filter(|(early, late)| **early && **late).count() } as f64;
            (1.0 - lag as f64 / (farthest + 1) as f64) * sum / count.max(1.0)
        });
        Self::by_distance(lags.collect())
    }

    /// Whether rows that share no sample are correlated: by more than a share of the variance, and significantly.
    pub(crate) fn is_coloured(&self, reach: usize, part: f64, rows: usize) -> bool {
        let chance = CHANCE * (self.variance_inflation() / rows.max(1) as f64).sqrt();
        self.lags.iter().skip(reach + 1).any(|lag| lag.abs() > part.max(chance) * self.lags[0])
    }

    /// The sum of the squared correlations of the residuals, without the taper.
    pub(crate) fn squared_correlations(&self) -> f64 {
        let taper = |lag: usize| 1.0 - lag as f64 / self.lags.len() as f64;
        (1..self.lags.len()).map(|lag| (self.lags[lag] / taper(lag) / self.lags[0]).powi(2)).sum()
    }

    /// Variance of a row.
    pub(crate) fn variance(&self) -> f64 {
        self.lags[0]
    }

    /// The same correlations with another variance.
    pub(crate) fn with_variance(mut self, variance: f64) -> Self {
        let factor = variance / self.variance();
        let of_places = self.places.iter_mut().flat_map(|places| &mut places.lags);
        self.lags.iter_mut().chain(of_places).for_each(|lag| *lag *= factor);
        self
    }

    /// The variance inflation, the number of rows that carry the information of one independent row: the sum of the squared correlations.
    pub(crate) fn variance_inflation(&self) -> f64 {
        let squared = |lag: &f64| (lag / self.lags[0]).powi(2);
        1.0 + 2.0 * self.lags[1..].iter().map(squared).sum::<f64>()
    }

    /// The covariance times a column.
    pub(crate) fn times(&self, column: &[f64]) -> Vec<f64> {
        let mut result = vec![0.0; column.len()];
        // In pieces that stay in the nearest cache, however many lags there are.
        for (piece, part) in result.chunks_mut(PIECE).enumerate() {
            let first = piece * PIECE;
            self.add_product(column, first..first + part.len(), part);
        }
        result
    }

    /// The dot products of some columns with the covariance times another.
    pub(crate) fn products<C: AsRef<[f64]>>(&self, columns: &[C], with: &[f64]) -> Vec<f64> {
        let mut sums = vec![SumOfProducts::default(); columns.len()];
        let mut product = [0.0; PIECE];
        for first in (0..with.len()).step_by(PIECE) {
            let rows = first..with.len().min(first + PIECE);
            let product = &mut product[..rows.len()];
            product.fill(0.0);
            self.add_product(with, rows.clone(), product);
            for (column, sum) in columns.iter().zip(&mut sums) {
                sum.add(&column.as_ref()[rows.clone()], product);
            }
        }
        sums.iter().map(SumOfProducts::value).collect()
    }

    /// Adds some rows of the covariance times a column.
    pub(crate) fn add_product(&self, column: &[f64], rows: Range<usize>, sums: &mut [f64]) {
        self.add(column, rows, |covariance, _| [covariance; 2], sums);
    }

    /// The covariance times the windowed regressors and their companions, whose times count from their own row.
    pub(crate) fn correlated(
        &self,
        windowed: &[&[f64]],
        companions: &[&[f64]],
        period: f64,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Correlated, Error> {
        let columns = || windowed.iter().map(|column| vec![0.0; column.len()]).collect::<Vec<_>>();
        let mut found = Correlated { variance: self.variance(), windowed: columns(), companions: columns() };
        stages.fill(found.windowed.iter_mut().chain(&mut found.companions), |rows, columns| {
            let (values, slopes) = columns.split_at_mut(windowed.len());
            for (regressor, (value, slope)) in values.iter_mut().zip(slopes).enumerate() {
                self.add(windowed[regressor], rows.clone(), |covariance, _| [covariance; 2], value);
                self.add(companions[regressor], rows.clone(), |covariance, _| [covariance; 2], slope);
                let moved = |covariance: f64, lag: usize| {
                    let weight = covariance * lag as f64 * period;
                    [weight, -weight]
                };
                self.add(windowed[regressor], rows.clone(), moved, slope);
            }
        })?;
        Ok(found)
    }

    /// Adds a column to some of its rows, each row's neighbours with weights that follow from their covariance and distance: one for those
    /// that come later and one for those that came before.
    fn add(&self, column: &[f64], rows: Range<usize>, weights: impl Fn(f64, usize) -> [f64; 2], sums: &mut [f64]) {
        let instructions = Instructions::current();
        let lags = self.lags.len().min(column.len());
        match &self.places {
            None => {
                let weights = |lag: usize| weights(self.lags[lag], lag);
                dispatch(instructions, AddNeighbours { lags, column, rows, weights, sums });
            }
            Some(places) => dispatch(instructions, AddOfEquations { lags, places, column, rows, weights, sums }),
        }
    }
}

/// What [`RowCovariance::add`] does where equations take turns.
struct AddOfEquations<'a, W> {
    lags: usize,
    places: &'a EquationLags,
    column: &'a [f64],
    rows: Range<usize>,
    weights: W,
    sums: &'a mut [f64],
}

impl<W: Fn(f64, usize) -> [f64; 2]> Kernel for AddOfEquations<'_, W> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let Self { lags, places, column, rows, weights, sums } = self;
        let count = places.count;
        // Weights of some rounds of all equations, so that many rows are added at a time.
        let mut round = vec![0.0; ROUNDS * count];
        for lag in 0..lags {
            let covariances = &places.lags[lag * count..][..count];
            if covariances.iter().all(|&covariance| covariance == 0.0) {
                continue;
            }
            // The earlier row of a pair tells its covariance.
            let fill = |earlier: usize, which: usize, round: &mut [f64]| {
                for (place, weight) in round.iter_mut().enumerate() {
                    *weight = weights(covariances[(places.first + earlier + place) % count], lag)[which];
                }
            };
            let late = column.get(rows.start + lag..).unwrap_or_default();
            fill(rows.start, 0, &mut round);
            add_in_rounds(sums, late, &round);
            if lag > 0 && rows.end > lag {
                let first = rows.start.max(lag);
                let early = &column[first - lag..rows.end - lag];
                fill(first - lag, 1, &mut round);
                add_in_rounds(&mut sums[first - rows.start..], early, &round);
            }
        }
    }
}

/// Adds values with weights that repeat.
#[inline(always)]
fn add_in_rounds(sums: &mut [f64], values: &[f64], weights: &[f64]) {
    for (sums, values) in sums.chunks_mut(weights.len()).zip(values.chunks(weights.len())) {
        for ((sum, value), weight) in sums.iter_mut().zip(values).zip(weights) {
            *sum += weight * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::*;
    use crate::exec::pool::ROWS;

    /// The same sums in the same order, however few rows the last piece has.
    #[test]
    fn the_last_rows_of_a_long_column_have_fewer_neighbours() {
        let covariance = RowCovariance::by_distance(vec![1.0, -0.5, 0.25, 0.125, 3.0]);
        for count in (1..8).map(|more| ROWS + more).chain([1, 2, 3, 7, ROWS]) {
            let column: Vec<f64> = (0..count).map(|row| (row as f64 * 0.7).sin()).collect();
            let mut watch = |_: usize, _: usize| true;
            let mut stages = Stages::new(NonZeroUsize::MIN, 1, 1, &mut watch);
            let found = covariance.correlated(&[&column], &[&column], 0.5, &mut stages).expect("not cancelled");
            let at = |row: isize| usize::try_from(row).ok().and_then(|row| column.get(row)).copied().unwrap_or(0.0);
            for row in (0..count).rev().take(12) {
                let lags = covariance.lags.iter().enumerate().skip(1);
                let neighbours = lags.clone().map(|(lag, weight)| {
                    let (row, lag) = (row.cast_signed(), lag.cast_signed());
                    [weight * at(row + lag), weight * at(row - lag)]
                });
                let value = column[row] + neighbours.clone().map(|[late, early]| late + early).sum::<f64>();
                let slope = lags
                    .zip(neighbours)
                    .map(|((lag, _), [late, early])| lag as f64 * 0.5 * (late - early))
                    .sum::<f64>();
                let near = |a: f64, b: f64| (a - b).abs() < 20.0 * f64::EPSILON * 10.0;
                assert!(
                    near(found.windowed[0][row], value) && near(found.companions[0][row], value + slope),
                    "{row} of {count}"
                );
            }
        }
    }

    #[test]
    fn products_by_pieces_have_the_bits_of_whole_columns() {
        let covariance = RowCovariance::by_distance(vec![1.0, -0.5, 0.25]);
        for count in [0, 5, PIECE - 1, PIECE, 2 * PIECE + 13] {
            let column = |factor: f64| (0..count).map(|row| (row as f64 * factor).sin()).collect::<Vec<_>>();
            let columns = [0.7, 0.3, 1.9].map(column);
            let found = covariance.products(&columns, &columns[1]);
            let whole = covariance.times(&columns[1]);
            for (found, column) in found.iter().zip(&columns) {
                assert_eq!(found.to_bits(), products(column, &whole, 0).to_bits(), "{count}");
            }
        }
    }

    #[test]
    fn rows_of_one_record_among_many_have_the_covariance_of_its_own() {
        let (times, records) = (40, 5);
        for equations in [1, 2, 3] {
            let (own, group) = (3 * equations, records * equations);
            let between = |lag: usize, place: usize| ((lag * 7 + place * 3) as f64 * 0.9).cos() / (lag + 1) as f64;
            let one = RowCovariance::of_equations(equations, own, between);
            let beside = |lag: usize, place: usize| {
                let (later, other) = ((place + lag) / group, (place + lag) % group);
                if other < equations { between((later * equations + other).saturating_sub(place), place) } else { 0.0 }
            };
            let all = RowCovariance::of_equations(equations, 2 * group + equations, beside);
            let found = all.of_one_record(group, equations);
            let column: Vec<f64> = (0..times * equations).map(|row| (row as f64 * 0.7).sin()).collect();
            let mut among = vec![0.0; times * group];
            for (row, value) in column.iter().enumerate() {
                among[row / equations * group + row % equations] = *value;
            }
            let of_all = all.times(&among);
            for (row, value) in found.times(&column).iter().enumerate() {
                let other = of_all[row / equations * group + row % equations];
                assert!((value - other).abs() < 1e-13, "{equations}, {row}: {value} {other}");
            }
            assert_eq!(RowCovariance::white().of_one_record(group, equations).times(&column), column);
            assert!((one.variance() - found.variance()).abs() < 1e-15);
        }
    }

    /// Rows of three equations, of which each has noise of its own and shares some with the next: every pair of rows by itself.
    #[test]
    fn rows_of_equations_that_take_turns_have_the_covariance_of_their_pair() {
        let (count, distances, period) = (3, 8, 0.5);
        let between =
            |lag: usize, place: usize| if lag == 5 { 0.0 } else { ((lag * 7 + place * 3) as f64 * 0.9).cos() };
        let covariance = RowCovariance::of_equations(count, distances, between);
        for (lag, mean) in covariance.lags.iter().enumerate() {
            let sum: f64 = (0..count).map(|place| between(lag, place)).sum();
            assert!((mean - sum / count as f64).abs() < 1e-15, "{lag}");
        }
        for rows in [1, 2, 7, 50, ROWS + 5, PIECE + 17] {
            let column: Vec<f64> = (0..rows).map(|row| (row as f64 * 0.7).sin()).collect();
            for first in [0, 1, 5] {
                let pair = |one: usize, other: usize| {
                    let (early, lag) = (one.min(other), one.abs_diff(other));
                    if lag < distances { between(lag, (first + early) % count) } else { 0.0 }
                };
                let near = |row: usize| row.saturating_sub(distances)..(row + distances).min(rows);
                let found = covariance.beginning_at(first).times(&column);
                let mut watch = |_: usize, _: usize| true;
                let mut stages = Stages::new(NonZeroUsize::MIN, 1, 1, &mut watch);
                let both = covariance.beginning_at(first).correlated(&[&column], &[&column], period, &mut stages);
                let both = both.expect("not cancelled");
                for row in (0..rows).rev().take(60).chain(0..rows.min(60)) {
                    let value: f64 = near(row).map(|other| pair(row, other) * column[other]).sum();
                    let later = |other: usize| (other as f64 - row as f64) * period;
                    let moved: f64 = near(row).map(|other| pair(row, other) * later(other) * column[other]).sum();
                    for (found, expected) in
                        [(found[row], value), (both.windowed[0][row], value), (both.companions[0][row], value + moved)]
                    {
                        assert!((found - expected).abs() < 1e-12, "{row} of {rows} from {first}");
                    }
                }
            }
        }
    }
}
