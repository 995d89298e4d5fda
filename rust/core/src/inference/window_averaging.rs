//! Windowed coefficients at every row: windows of many lengths before, around and after it, averaged by their local cross-validation error.
//!
//! A window predicts rows that it does not contain. Its weight at a row is `exp(-½ (n e + n₀ ē))`. Here `e` is its mean squared error around the row
//! over the noise variance, `n` the number of independent rows in that mean, and `ē` and `n₀` the same over the record. So jumps are followed from
//! both sides, and long windows dominate where nothing changes. What windows differ by that predict alike is part of the standard errors: it is all
//! that is seen of what a coefficient bends within them.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{ROWS, ranges};
use crate::exec::stages::Stages;
use crate::inference::moving::moving;
use crate::inference::over_record::{ErrorSums, OverRecord};
use crate::inference::weighted_windows::WeightedWindows;
use crate::inference::windows_around::Around;
use crate::regression::constants::Expected;
use crate::regression::problem::Problem;
use crate::regression::sides::Sides;
use crate::regression::subsample::holds;
use crate::regression::window_length::{Cells, Scale};
use crate::simd::instructions::Instructions;

/// Squared errors over the noise variance are clipped to this, so that single rows do not dominate.
const MOST: f64 = 16.0;
/// Independent rows that the errors over the record count as, at least, and per length of the best window.
const RECORD: [f64; 2] = [16.0, 5.0];
/// Cells of at least so many rows are solved once for all pieces.
const COARSE: usize = 8;
/// Cells that are judged and those around the rows that are wanted are solved together where these are hardly more than the former: at most
/// so many times as many.
const LITTLE: (usize, usize) = (5, 4);
/// If so many of the longest lengths in the subsample are negligible, all longer ones are assumed to be.
const OVERLAP: usize = 2;
/// A window whose exponent over the record is so much larger than the best one's gets no weight anywhere.
const HOPELESS: f64 = 24.0;

/// Windowed coefficients at every row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Averages {
    /// Windowed unknowns, by row; NaN where no window determines them.
    pub(crate) values: Vec<Vec<f64>>,
    /// Their growth per second.
    pub(crate) slopes: Vec<Vec<f64>>,
    /// Their standard errors for given constants.
    pub(crate) errors: Vec<Vec<f64>>,
}

impl Averages {
    pub(crate) fn new(windowed: usize, rows: usize) -> Self {
        let columns = |count: usize| vec![vec![f64::NAN; rows]; count];
        Self { values: columns(windowed), slopes: columns(windowed), errors: columns(windowed) }
    }

    /// Makes an unknown no number in a row.
    pub(crate) fn forget(&mut self, unknown: usize, row: usize) {
        for column in [&mut self.values, &mut self.slopes, &mut self.errors] {
            column[unknown][row] = f64::NAN;
        }
    }

    fn columns(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        self.values.iter_mut().chain(&mut self.slopes).chain(&mut self.errors)
    }
}

/// Positions of a window relative to a row: before it, around it, after it.
const POSITIONS: usize = 3;

/// A length of windows and its error over the record.
struct Candidate {
    scale: Scale,
    /// All cells, if they are few, and which of their windows are solved.
    cells: Option<(Cells, Sides)>,
    /// Mean squared error over the record, by position; infinite if the length is not used there.
    record: [OverRecord; POSITIONS],
}

impl Candidate {
    /// Whether it may serve in a position: in rows of the least weight or in those of the greatest.
    fn promises(&self, which: usize, hopeless: &[(f64, f64)]) -> bool {
        hopeless.iter().any(|&(weight, most)| self.record[which].at(weight) <= most)
    }

    /// The windows of the positions that promise something, or of those that do not.
    fn sides(&self, hope: bool, hopeless: &[(f64, f64)]) -> Sides {
        let [before, around, after] = [0, 1, 2].map(|which| self.promises(which, hopeless) == hope);
        Sides { one: (before || after) && self.scale.stands_alone(), both: around }
    }

    /// The windows that rows can be judged by.
    fn judging(&self) -> Sides {
        Sides { one: self.scale.stands_alone(), both: true }
    }
}

/// Averages windows of several lengths at the rows that are `wanted` of a problem without constants; others are left NaN. `best` is the length of
/// windows with the smallest error, in rows. If `thinned` is a subsample of a long record, errors over the record are estimated from it, for all
/// lengths that it holds.
pub(crate) fn average(
    problem: &Problem<'_>,
    thinned: Option<&Problem<'_>>,
    scales: &[Scale],
    (expected, best, wanted): (Expected, usize, Range<usize>),
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Averages, Error> {
    let rows = problem.rows();
    let reach = scales.first().map_or(1, |scale| scale.reach);
    let view = View { problem, variance: expected.variance, reach, instructions };
    let nearby = view.nearby(expected);
    let mut candidates: Vec<_> =
        scales.iter().map(|&scale| Candidate { scale, cells: None, record: [OverRecord::UNUSED; POSITIONS] }).collect();
    let record = RECORD[0].max(RECORD[1] * best as f64 / expected.variance_inflation);
    let hope = HOPELESS / record;
    let middle = rows / 5..(4 * rows / 5).max(rows / 5 + 1).min(rows);
    let short = match thinned {
        None => 0,
        Some(thinned) => {
            let short = scales.partition_point(|scale| holds(*scale));
            let view = View { problem: thinned, ..view };
            view.judge(&mut candidates[..short], (0..thinned.rows(), None), stages)?;
            short
        }
    };
    let ends = ends_of_weights(problem);
    let errors = |candidates: &[Candidate], weight: f64| {
        candidates.iter().flat_map(|candidate| candidate.record).map(|one| one.at(weight)).fold(f64::INFINITY, f64::min)
    };
    let long = short.saturating_sub(OVERLAP);
    let promise =
        |&weight: &f64| errors(&candidates[long..short], weight) <= errors(&candidates[..short], weight) + hope;
    if thinned.is_none() || ends.iter().any(promise) {
        let both = middle.start.min(wanted.start.saturating_sub(nearby.rows))
            ..middle.end.max((wanted.end + nearby.rows).min(rows));
        let kept = (rows <= ROWS && both.len() * LITTLE.1 <= middle.len() * LITTLE.0).then_some(both);
        view.judge(&mut candidates[short..], (middle, kept), stages)?;
    }
    let hopeless = ends.map(|weight| (weight, errors(&candidates, weight) + hope));
    for candidate in &mut candidates {
        let chosen = (0..POSITIONS).any(|which| candidate.promises(which, &hopeless));
        if chosen && candidate.scale.step >= COARSE && candidate.cells.is_none() {
            let (all, sides) = (candidate.scale.one_sided_cells(rows), candidate.sides(true, &hopeless));
            let cells = candidate.scale.solve(problem, (&all, sides), instructions, stages)?;
            candidate.cells = Some((cells, sides));
        }
    }

    let ready = ready(&candidates);
    let mut averages = Averages::new(problem.layout.windowed, rows);
    stages.fill(averages.columns(), |rows, columns| {
        let some = rows.start.max(wanted.start)..rows.end.min(wanted.end);
        if !some.is_empty() {
            let inside = some.start - rows.start..some.end - rows.start;
            let mut columns: Vec<_> = columns.iter_mut().map(|column| &mut column[inside.clone()]).collect();
            view.average((&candidates, &ready), some, nearby, record, &hopeless, &mut columns);
        }
    })?;
    Ok(averages)
}

/// The least and the greatest weight of a row.
fn ends_of_weights(problem: &Problem<'_>) -> [f64; 2] {
    let used = (0..problem.rows()).filter(|&row| problem.usable[row]).map(|row| problem.weight(row));
    let (least, greatest) =
        used.fold((f64::INFINITY, 0.0_f64), |(least, greatest), weight| (least.min(weight), greatest.max(weight)));
    if least <= greatest { [least, greatest] } else { [1.0; 2] }
}

/// Windows ready to predict, and on which sides of a row.
type Ready<'a> = (Around<'a>, Sides);

/// Windows of the candidates whose cells are all solved, ready to predict in every piece.
fn ready(candidates: &[Candidate]) -> Vec<Option<Ready<'_>>> {
    let ready = candidates.iter().map(|candidate| {
        let (cells, sides) = candidate.cells.as_ref()?;
        Some((Around::new(candidate.scale, cells, &[]), *sides))
    });
    ready.collect()
}

/// Rows on either side of a row over which its errors are averaged, and the number of independent rows among them.
#[derive(Clone, Copy)]
struct Nearby {
    rows: usize,
    independent: f64,
}

#[derive(Clone, Copy)]
struct View<'a, 'b> {
    problem: &'a Problem<'b>,
    variance: f64,
    /// Rows that a test function reaches on either side.
    reach: usize,
    instructions: Instructions,
}

impl View<'_, '_> {
    /// Computes the errors of the candidates over some rows of the record. Their cells around rows that are `kept` stay: of a record of one piece.
    fn judge(
        &self,
        candidates: &mut [Candidate],
        (rows, kept): (Range<usize>, Option<Range<usize>>),
        stages: &mut Stages<'_, '_>,
    ) -> Result<(), Error> {
        let mut solved = Vec::new();
        for candidate in &*candidates {
            let (scale, all) = (candidate.scale, candidate.scale.one_sided_cells(self.problem.rows()));
            let sides = candidate.judging();
            let cells = if scale.step >= COARSE {
                Some(scale.solve(self.problem, (&all, sides), self.instructions, stages)?)
            } else {
                kept.as_ref().map(|kept| self.cells(candidate, (kept, sides)))
            };
            let cells = cells.map(|cells| (cells, sides));
            solved.push(Candidate { scale, cells, record: candidate.record });
        }
        let ready = ready(&solved);
        let moving = moving(self.problem, self.reach);
        let work = |piece: Range<usize>, (): &mut ()| {
            let counted = piece.start.max(rows.start)..piece.end.min(rows.end);
            let both = solved.iter().zip(&ready);
            both.map(|(candidate, ready)| self.sums(candidate, ready.as_ref(), (&counted, &moving))).collect::<Vec<_>>()
        };
        let sums = stages.map(ranges(self.problem.rows()), || (), work)?;
        for (index, candidate) in candidates.iter_mut().enumerate() {
            for which in 0..POSITIONS {
                let [mut all, mut moving] = [ErrorSums::default(); 2];
                for sums in &sums {
                    all.merge(sums[index][which][0]);
                    moving.merge(sums[index][which][1]);
                }
                if all.count > 0.0 {
                    candidate.record[which] = if moving.count > 0.0 { moving } else { all }.over_record();
                }
            }
        }
        drop(ready);
        if kept.is_some() {
            candidates.iter_mut().zip(solved).for_each(|(candidate, solved)| candidate.cells = solved.cells);
        }
        Ok(())
    }

    fn nearby(&self, expected: Expected) -> Nearby {
        let rows = self.reach;
        Nearby { rows, independent: (2 * rows + 1) as f64 / expected.variance_inflation }
    }

    /// The cells of a candidate around some rows.
    fn cells(&self, candidate: &Candidate, (rows, sides): (&Range<usize>, Sides)) -> Cells {
        let scale = candidate.scale;
        let all = scale.one_sided_cells(self.problem.rows());
        let wanted = scale.cell(rows.start).max(all.start)..(scale.cell(rows.end.max(1) - 1) + 1).min(all.end);
        let wanted = wanted.start..wanted.end.max(wanted.start);
        scale.solve_here(self.problem, (&wanted, sides), self.instructions)
    }

    /// What is left of a row squared, over the noise's variance.
    fn squared(&self, left: f64) -> f64 {
        (left * left / self.variance).min(MOST)
    }

    /// Sums over rows, and over those of them that move, by position.
    fn sums(
        &self,
        candidate: &Candidate,
        ready: Option<&Ready<'_>>,
        (rows, moving): (&Range<usize>, &[bool]),
    ) -> [[ErrorSums; 2]; POSITIONS] {
        let mut sums = [[ErrorSums::default(); 2]; POSITIONS];
        if rows.start >= rows.end {
            return sums;
        }
        let (cells, here);
        let around = if let Some((ready, _)) = ready {
            ready
        } else {
            cells = self.cells(candidate, (rows, candidate.judging()));
            here = Around::new(candidate.scale, &cells, &[]);
            &here
        };
        for (which, sums) in sums.iter_mut().enumerate() {
            around.errors(self.problem, rows, which, |row, left| {
                if self.problem.usable[row] {
                    let (error, weight) = (self.squared(left), self.problem.weight(row));
                    sums.iter_mut().take(1 + usize::from(moving[row])).for_each(|sums| sums.add(error, weight));
                }
            });
        }
        sums
    }

    /// Averages all candidates at some rows.
    fn average(
        &self,
        (candidates, ready): (&[Candidate], &[Option<Ready<'_>>]),
        rows: Range<usize>,
        nearby: Nearby,
        record: f64,
        hopeless: &[(f64, f64)],
        columns: &mut [&mut [f64]],
    ) {
        let (windowed, total) = (self.problem.layout.windowed, self.problem.rows());
        let wide = rows.start.saturating_sub(nearby.rows)..(rows.end + nearby.rows).min(total);
        let mut weighted = WeightedWindows::new(rows.len(), windowed);
        let mut errors = vec![[0.0, 0.0]; wide.len() + 1];
        // Rows that no promising window reaches, near an end or a gap, use the others.
        for hope in [true, false] {
            let wanted: Vec<bool> = weighted.are_missing().map(|missing| hope || missing).collect();
            if !wanted.contains(&true) {
                break;
            }
            let chosen =
                |candidate: &Candidate| (0..POSITIONS).any(|which| candidate.promises(which, hopeless) == hope);
            for (candidate, ready) in candidates.iter().zip(ready).filter(|(candidate, _)| chosen(candidate)) {
                let sides = candidate.sides(hope, hopeless);
                let (cells, here);
                let around = if let Some((ready, _)) = ready.as_ref().filter(|(_, solved)| solved.hold(sides)) {
                    ready
                } else {
                    cells = self.cells(candidate, (&wide, sides));
                    here = Around::new(candidate.scale, &cells, &[]);
                    &here
                };
                for which in (0..POSITIONS).filter(|&which| candidate.promises(which, hopeless) == hope) {
                    self.running_errors(around, &wide, which, &mut errors);
                    around.numbers(self.problem, &rows, which, |row, numbers| {
                        let place = row - rows.start;
                        if !wanted[place] {
                            return;
                        }
                        let first = row.saturating_sub(nearby.rows).max(wide.start) - wide.start;
                        let last = (row + nearby.rows + 1).min(wide.end) - wide.start;
                        let (sum, count) = (errors[last][0] - errors[first][0], errors[last][1] - errors[first][1]);
                        // Within a gap there are no errors nearby, and those over the record decide.
                        let here = if count == 0.0 { 0.0 } else { nearby.independent * sum / count };
                        let expected = candidate.record[which].at(self.problem.weight(row)).min(MOST);
                        weighted.add(place, 0.5 * (here + record * expected), numbers);
                    });
                }
            }
        }
        weighted.into_means(columns);
    }

    /// Running sums of the errors of some rows and of their number, so that every mean costs two differences; they restart with every piece.
    fn running_errors(&self, around: &Around<'_>, rows: &Range<usize>, which: usize, errors: &mut [[f64; 2]]) {
        let (mut sum, mut filled) = ([0.0, 0.0], 1);
        around.errors(self.problem, rows, which, |row, left| {
            if self.problem.usable[row] {
                let place = row - rows.start + 1;
                errors[filled..place].fill(sum);
                sum = [sum[0] + self.squared(left), sum[1] + 1.0];
                errors[place] = sum;
                filled = place + 1;
            }
        });
        errors[filled..].fill(sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::model::Model;
    use crate::regression::row_covariance::RowCovariance;
    use crate::regression::simulated::{PERIOD, random, rows, staged, white};

    const ROWS: usize = 1000;
    const DEVIATION: f64 = 0.1;

    /// What is averaged of one coefficient alone.
    fn averaged(rows: &Rows, best: usize) -> Averages {
        averaged_at(rows, best, 0..rows.len())
    }

    fn averaged_at(rows: &Rows, best: usize, wanted: Range<usize>) -> Averages {
        let model = Model { windowed: vec![0], constant: Vec::new(), linear: true, ..Model::default() };
        let covariance = RowCovariance::by_distance(vec![DEVIATION * DEVIATION]);
        let correlated = staged(|stages| model.correlated(rows, &covariance, stages));
        let problem = model.problem(rows, &rows.rhs, 0.0, Some(&correlated));
        let (scales, expected) = (Scale::all(ROWS, 3), white(DEVIATION * DEVIATION));
        staged(|stages| average(&problem, None, &scales, (expected, best, wanted), Instructions::Scalar, stages))
    }

    /// Rows of one coefficient alone.
    fn alone(coefficient: impl Fn(f64) -> [f64; 2]) -> Rows {
        let (mut rows, noise) = (rows(ROWS, &coefficient, 0.0), random(77, ROWS));
        for (row, noise) in noise.into_iter().enumerate() {
            let ([value, rate], regressor) = (coefficient(row as f64 * PERIOD), &rows.regressors[0]);
            rows.rhs[row] = value * regressor.value[row] + rate * regressor.companion[row] + DEVIATION * noise;
        }
        rows
    }

    #[test]
    fn where_nothing_happens_long_windows_rule_and_errors_are_as_small() {
        let found = averaged(&alone(|time| [2.0 + 0.01 * time, 0.01]), 500);
        for row in 0..ROWS {
            let off = found.values[0][row] - (2.0 + 0.01 * row as f64 * PERIOD);
            assert!(off.abs() < 5.0 * found.errors[0][row], "{row}: {off}");
            assert!((found.slopes[0][row] - 0.01).abs() < 0.005, "{row}: {}", found.slopes[0][row]);
        }
        // In the middle a mean of some hundred rows and more.
        assert!(found.errors[0][ROWS / 2] < DEVIATION / 10.0);
    }

    #[test]
    fn a_step_is_followed_from_both_sides() {
        let found = averaged(&alone(|time| [if time < 250.0 { 1.0 } else { 4.0 }, 0.0]), 60);
        for (row, value) in found.values[0].iter().enumerate() {
            // Five rows to either side are a test function's width; a window that serves alone keeps it away.
            if row.abs_diff(500) > 5 {
                let expected = if row < 500 { 1.0 } else { 4.0 };
                assert!((value - expected).abs() < 0.3, "{row}: {value}");
            }
        }
    }

    #[test]
    fn rows_that_are_wanted_have_the_numbers_of_all() {
        let rows = alone(|time| [2.0 + time.sin(), time.cos()]);
        let (whole, part) = (averaged(&rows, 60), averaged_at(&rows, 60, 350..600));
        for row in 0..ROWS {
            let (one, other) = (whole.values[0][row], part.values[0][row]);
            // Running sums of squared errors begin elsewhere, which is rounding.
            let same = (one - other).abs() < 1e-9 && (whole.errors[0][row] - part.errors[0][row]).abs() < 1e-9;
            assert!(if (350..600).contains(&row) { same } else { other.is_nan() }, "{row}: {one} and {other}");
        }
    }

    #[test]
    fn missing_rows_are_bridged() {
        let mut rows = alone(|time| [2.0 + 0.01 * time, 0.01]);
        rows.exclude(400..430);
        let found = averaged(&rows, 500);
        for row in 400..430 {
            let off = found.values[0][row] - (2.0 + 0.01 * row as f64 * PERIOD);
            assert!(off.abs() < 5.0 * found.errors[0][row], "{row}: {off}");
        }
    }
}
