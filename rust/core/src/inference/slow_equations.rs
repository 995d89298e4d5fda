//! Equations for slowly varying coefficients, left by windows whose own unknowns are eliminated, and local polynomials
//! in time fitted to them.

use std::ops::Range;

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::inference::slow_curve::Varying;
use crate::inference::slow_points::{DENSITY, Points};
use crate::inference::slow_triangles::Triangles;
use crate::regression::constants::{Expected, pool};
use crate::regression::fit::Fit;
use crate::regression::problem::Problem;
use crate::regression::solved::{Solved, is_determined};
use crate::simd::instructions::Instructions;

/// Coefficients of the polynomials in time.
pub(crate) const QUADRATIC: usize = 3;

/// The part that an equation counts at least whose regressor is nothing but noise: its error is larger than anything.
const LEAST: f64 = 1e-3;

/// The equations that windows leave for slow coefficients, which come first among their constants.
pub(crate) struct Slow<'a> {
    pub(crate) fit: &'a Fit,
    /// Number of slow coefficients.
    pub(crate) coefficients: usize,
    /// The regressors of their growth, by coefficient.
    pub(crate) companions: Vec<&'a [f64]>,
    /// The slow coefficients of the previous round, which were subtracted from the right-hand side.
    pub(crate) current: Option<&'a Varying>,
    /// Weight of every window.
    pub(crate) weights: &'a [f64],
    /// Rows of the record.
    pub(crate) rows: usize,
    /// The first rows of stretches between which the slow coefficients may jump, but for the first stretch.
    pub(crate) breaks: &'a [usize],
}

impl Slow<'_> {
    /// The stretches between which the slow coefficients may jump.
    fn stretches(&self) -> impl Iterator<Item = Range<usize>> {
        let ends = self.breaks.iter().copied().chain([self.rows]);
        std::iter::once(0).chain(self.breaks.iter().copied()).zip(ends).map(|(a, b)| a..b)
    }

    /// Fits the slow coefficients, polynomials in time of so many terms, to equations up to `reach` rows away: without those nearer than `hole`
    /// rows, and with them. Returns `None` if they are not determined.
    pub(crate) fn fit(
        &self,
        equations: &[Triangles],
        terms: usize,
        (reach, hole): (f64, f64),
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<[Varying; 2]>, Error> {
        let spacing = reach / DENSITY as f64;
        let stretches: Vec<Range<usize>> = self.stretches().collect();
        let mut solve = |(rows, equations): (&Range<usize>, &Triangles)| {
            let last = rows.len() as f64 - 1.0;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "points of a record")]
            let count = (last.max(0.0) / spacing).ceil() as usize + 1;
            let (coefficients, start) = (self.coefficients, rows.start);
            Points { equations, coefficients, terms, start, reach, hole, count }.solved(instructions, stages)
        };
        let solved: Vec<[Solved; 2]> = stretches.iter().zip(equations).map(&mut solve).collect::<Result<_, Error>>()?;
        let starts = solved.iter().scan(0, |next, [one, _]| Some(std::mem::replace(next, *next + one.len())));
        let starts: Vec<_> = stretches.iter().map(|rows| rows.start as f64).zip(starts).collect();
        let curve = |which: usize| {
            let solved = Solved::join(&solved.iter().map(|both| &both[which]).collect::<Vec<_>>());
            self.curve(&solved, terms, (spacing, starts.clone()), instructions)
        };
        Ok(curve(0).zip(curve(1)).map(|(without, with)| [without, with]))
    }

    /// The curves through solved points.
    fn curve(
        &self,
        solved: &Solved,
        terms: usize,
        (spacing, stretches): (f64, Vec<(f64, usize)>),
        instructions: Instructions,
    ) -> Option<Varying> {
        let points = solved.len();
        let fields = solved.fields;
        let constants = if fields.layout.constant == 0 {
            Vec::new()
        } else {
            pool(solved, 0..points, Expected::UNKNOWN, instructions)?.values
        };
        let value = |coefficient: usize, point: usize| {
            is_determined(solved, point)
                .then(|| crate::regression::solved::local(solved, point, &constants, coefficient))
        };
        let mut values = Vec::new();
        let mut variances = Vec::new();
        for coefficient in 0..self.coefficients {
            values.push(fill(&(0..points).map(|point| value(coefficient * terms, point)).collect::<Vec<_>>())?);
            let variance = solved.field(fields.covariance(coefficient * terms, coefficient * terms));
            let variance = (0..points).map(|point| is_determined(solved, point).then(|| variance[point]));
            variances.push(fill(&variance.collect::<Vec<_>>())?);
        }
        Some(Varying { spacing, stretches, values, variances, constants })
    }

    /// The right-hand side of an equation of a window, with what the slow coefficients of the previous round took from it.
    fn rhs(&self, window: usize, row: f64, equation: usize) -> f64 {
        let full = &self.fit.full;
        let (fields, all) = (full.fields, full.fields.layout.constant);
        let own = full.field(fields.left(equation, all))[window];
        (equation..self.coefficients).fold(own, |rhs, j| {
            let entry = full.field(fields.left(equation, j))[window];
            rhs + entry * self.current.map_or(0.0, |current| current.at(j, row).0)
        })
    }

    /// The part of an equation of every window that counts: where its regressor is mostly the angle's noise once windowed ones are eliminated, the
    /// removal of that noise is bounded, and what is left draws coefficients to zero.
    fn told(&self, problem: &Problem<'_>, equation: usize) -> Vec<f64> {
        let full = &self.fit.full;
        let (fields, layout) = (full.fields, full.fields.layout);
        let of = |window: usize| {
            let factors: Vec<f64> =
                (0..layout.windowed).map(|one| full.field(fields.solution(one, equation))[window]).collect();
            let noise = problem.noise.without_windowed(layout, equation, &factors);
            let left = full.field(fields.left(equation, equation))[window];
            [left * left, noise.max(0.0) * full.field(fields.count())[window]]
        };
        let sums: Vec<[f64; 2]> = std::iter::once([0.0; 2])
            .chain((0..full.len()).map(|window| if is_determined(full, window) { of(window) } else { [0.0; 2] }))
            .scan([0.0; 2], |sum, [left, noise]| {
                *sum = [sum[0] + left, sum[1] + noise];
                Some(*sum)
            })
            .collect();
        let near = self.fit.span.div_ceil(self.fit.step);
        let part = |window: usize| {
            let (first, end) = (window.saturating_sub(near), (window + near + 1).min(full.len()));
            let [left, noise] = [0, 1].map(|which| sums[end][which] - sums[first][which]);
            if noise > 0.0 { ((2.0 * left - noise) / (2.0 * left + noise)).max(LEAST) } else { 1.0 }
        };
        (0..full.len()).map(part).collect()
    }

    /// The equations of every stretch, the same for every reach.
    pub(crate) fn equations(&self, problem: &Problem<'_>) -> Vec<Triangles> {
        let full = &self.fit.full;
        let all = full.fields.layout.constant;
        let told: Vec<Vec<f64>> = (0..all).map(|equation| self.told(problem, equation)).collect();
        let windows: Vec<(usize, f64)> = (0..full.len())
            .filter(|&window| is_determined(full, window))
            .map(|window| (window, self.fit.centre(window)))
            .collect();
        let of = |stretch: Range<usize>| {
            let within = stretch.start as f64 - 0.5..stretch.end as f64 - 0.5;
            let mut found = Triangles::new(all);
            for &(window, row) in windows.iter().filter(|(_, row)| within.contains(row)) {
                let root = self.weights[window].sqrt();
                let rows = found.push(row, root > 0.0);
                for (i, of_row) in rows.chunks_exact_mut(all + 1).enumerate() {
                    let root = root * told[i][window].sqrt();
                    for (j, entry) in of_row.iter_mut().enumerate().take(all).skip(i) {
                        *entry = root * full.field(full.fields.left(i, j))[window];
                    }
                    of_row[all] = root * self.rhs(window, row, i);
                }
            }
            found
        };
        self.stretches().map(of).collect()
    }
}

/// Fills gaps with the nearest number, or returns `None` if there is none.
fn fill(values: &[Option<f64>]) -> Option<Vec<f64>> {
    let known: Vec<(usize, f64)> =
        values.iter().enumerate().filter_map(|(place, value)| value.map(|value| (place, value))).collect();
    let nearest = |place: usize| known.iter().min_by_key(|(other, _)| other.abs_diff(place)).map(|(_, value)| *value);
    (0..values.len()).map(|place| values[place].or_else(|| nearest(place))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::simulated::{CONSTANTS, model, rows, staged, white};
    use crate::regression::window_length::Scale;

    const ROWS: usize = 900;

    /// Rows whose first constant is a parabola in time, without its growth within a row.
    fn bent(change: f64) -> Rows {
        let mut rows = rows(ROWS, |time| [time.sin(), time.cos()], 0.0);
        for row in 0..ROWS {
            rows.rhs[row] += (parabola(row as f64, change) - CONSTANTS[0]) * rows.regressors[1].value[row];
        }
        rows
    }

    fn parabola(row: f64, change: f64) -> f64 {
        let part = row / ROWS as f64;
        CONSTANTS[0] + change * (part - 2.0 * part * part)
    }

    /// The curve that some rows within reach give, the line of every window taken as it is.
    fn curve(rows: &Rows, reach: f64, hole: f64) -> Varying {
        let model = model();
        let problem = model.problem(rows, &rows.rhs, 0.0, None);
        let scale = Scale::all(ROWS, 3)[0];
        let fit = staged(|stages| Fit::new(&problem, Some(scale), white(1.0), Instructions::Scalar, stages));
        let fit = fit.expect("constants");
        let ones = vec![1.0; fit.full.len()];
        let companions = vec![rows.regressors[1].companion.as_slice()];
        let slow =
            Slow { fit: &fit, coefficients: 1, companions, current: None, weights: &ones, rows: ROWS, breaks: &[] };
        let equations = slow.equations(&problem);
        let fitted = staged(|stages| slow.fit(&equations, QUADRATIC, (reach, hole), Instructions::Scalar, stages));
        let [without, with] = fitted.expect("curves");
        if hole > 0.0 { without } else { with }
    }

    /// The largest distance between two curves, the ends left out, where points reach over half of what they see.
    fn off(curve: &Varying, expected: impl Fn(f64) -> f64) -> f64 {
        (100..ROWS - 100).map(|row| (curve.at(0, row as f64).0 - expected(row as f64)).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_coefficient_that_rests_is_found_whatever_changes_beside_it() {
        // The sine bends within the shortest windows by what is left of it there.
        let windowed = |time: f64| [1.0 + 0.1 * time, 0.1];
        let rows = rows(ROWS, windowed, 0.0);
        for (reach, hole) in [(100.0, 0.0), (100.0, 40.0), (400.0, 0.0), (400.0, 100.0)] {
            let found = curve(&rows, reach, hole);
            assert!(off(&found, |_| CONSTANTS[0]) < 1e-9);
            assert!((found.constants[0] - CONSTANTS[1]).abs() < 1e-9);
            assert!(found.variances[0].iter().all(|variance| *variance > 0.0));
        }
    }

    #[test]
    fn a_parabola_is_followed_whatever_the_reach() {
        for (reach, hole) in [(150.0, 0.0), (150.0, 50.0), (300.0, 0.0)] {
            // What is left of the windowed sine in a window, and the parabola's own bend there, are the same for each reach.
            let found = curve(&bent(1.0), reach, hole);
            let still = curve(&bent(0.0), reach, hole);
            let moved = off(&found, |row| parabola(row, 1.0) - CONSTANTS[0] + still.at(0, row).0);
            assert!(moved < 0.02, "{reach} {hole}: {moved}");
        }
    }

    #[test]
    fn the_more_equations_the_smaller_the_variance() {
        let rows = bent(0.0);
        let middle = |reach: f64, hole: f64| curve(&rows, reach, hole).variance(0, ROWS as f64 / 2.0);
        assert!(middle(100.0, 0.0) > 1.7 * middle(200.0, 0.0));
        assert!(middle(200.0, 60.0) > middle(200.0, 0.0));
    }

    #[test]
    fn gaps_take_the_nearest_number() {
        assert_eq!(fill(&[None, Some(2.0), None, None, None, Some(5.0)]), Some(vec![2.0, 2.0, 2.0, 2.0, 5.0, 5.0]));
        assert_eq!(fill(&[None, None]), None);
    }
}
