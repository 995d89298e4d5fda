//! Windows over few times: where there are many trials, few times determine what these share. What they leave of a trial that they are not made from, and
//! what they say themselves.
//!
//! Windows before and after a row keep a test function away from it, since they may share no samples with what they predict. Other trials share none
//! with it at any time. So trials are dealt into parts, and the rows of a part are predicted from those of the others within the same window.

use std::ops::Range;

use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};
use faer::{Col, Mat};

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::regression::block_products::dot;
use crate::regression::problem::Problem;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::window_length::Scale;
use crate::simd::f64x8::Packet;

/// Rows of a window for every unknown that it has alone, at least.
pub(crate) const ROWS_OF_UNKNOWN: usize = 8;
/// Parts that trials are dealt into, at most.
const PARTS: usize = 16;
/// Rows that are predicted at least, of very many.
const ENOUGH_ROWS: usize = 1 << 15;
/// Cells in a piece of work.
const PIECE: usize = 64;

/// How the rows of one time belong to trials: so many rows, and so many of each trial.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dealt {
    pub(crate) group: usize,
    pub(crate) equations: usize,
}

impl Dealt {
    fn parts(self) -> usize {
        PARTS.min(self.group / self.equations)
    }

    /// The part of trials that a row belongs to.
    fn part(self, row: usize) -> usize {
        row % self.group / self.equations % self.parts()
    }

    /// Times from one that is predicted to the next: all of few.
    fn apart(self, rows: usize) -> usize {
        (rows / ENOUGH_ROWS.max(self.group)).max(1)
    }
}

/// Sums over the rows of one part of the trials in a window.
#[derive(Clone)]
struct SumsOfPart {
    normal: Mat<f64>,
    moments: Col<f64>,
    /// Number of rows, sum of their times after the centre, and of the squares of these.
    times: [f64; 3],
}

impl SumsOfPart {
    fn new(local: usize) -> Self {
        Self { normal: Mat::zeros(local, local), moments: Col::zeros(local), times: [0.0; 3] }
    }

    fn add(&mut self, columns: &[f64], rhs: f64, later: f64) {
        for (i, one) in columns.iter().enumerate() {
            columns.iter().enumerate().for_each(|(j, other)| self.normal[(i, j)] += one * other);
            self.moments[i] += one * rhs;
        }
        self.times = [self.times[0] + 1.0, self.times[1] + later, self.times[2] + later * later];
    }

    /// The sums over all parts.
    fn merged(parts: &[Self], local: usize) -> Self {
        let mut all = Self::new(local);
        for part in parts {
            all.normal += &part.normal;
            all.moments += &part.moments;
            all.times.iter_mut().zip(part.times).for_each(|(sum, one)| *sum += one);
        }
        all
    }

    /// The normal matrix and the moments of all rows but those of a part of them, if there are any, without what noise makes of them.
    fn without(&self, part: Option<&Self>, problem: &Problem<'_>) -> Option<(Llt<f64>, Col<f64>)> {
        let (layout, local) = (problem.layout, problem.layout.local());
        let (mut normal, mut moments, mut times) = (self.normal.clone(), self.moments.clone(), self.times);
        if let Some(part) = part {
            normal -= &part.normal;
            moments -= &part.moments;
            times.iter_mut().zip(part.times).for_each(|(sum, one)| *sum -= one);
        }
        if times[0] < (ROWS_OF_UNKNOWN * local) as f64 {
            return None;
        }
        if !problem.noise.is_zero() {
            let mut summary = vec![Packet::ZERO; layout.size()];
            summary[layout.sums()..layout.noise()].copy_from_slice(&times.map(Packet::splat));
            let expected = |i: usize, j: usize| problem.noise.expected(layout, &summary, i, j).0[0];
            normal -= Mat::from_fn(local, local, expected);
            moments -= Col::from_fn(local, |i| expected(i, local));
        }
        Some((Llt::new(normal.as_ref(), faer::Side::Lower).ok()?, moments))
    }
}

/// A window over few times of a problem without constants.
struct WindowAcross<'a, 'b> {
    rest: &'a Problem<'b>,
    rows: Range<usize>,
    centre: f64,
}

impl<'a, 'b> WindowAcross<'a, 'b> {
    /// The window of a cell, unless a jump lies within.
    fn new(rest: &'a Problem<'b>, scale: Scale, cell: isize) -> Option<Self> {
        let window = scale.full_window(cell);
        let centre = (window.start + window.end - 1) as f64 / 2.0;
        let rows = window.start.unsigned_abs()..window.end.unsigned_abs();
        (!rest.jumps_within(&(window.start..window.end - 1))).then_some(Self { rest, rows, centre })
    }

    /// Seconds after the window's centre.
    fn later(&self, row: usize) -> f64 {
        (row as f64 - self.centre) * self.rest.period
    }

    /// What the unknowns are multiplied with in a row: values at the centre, then growths per second.
    fn fill(&self, row: usize, columns: &mut [f64]) {
        let (values, slopes) = columns.split_at_mut(self.rest.layout.windowed);
        for (value, column) in values.iter_mut().zip(&self.rest.windowed) {
            *value = column[row];
        }
        for ((slope, column), value) in slopes.iter_mut().zip(&self.rest.companions).zip(values) {
            *slope = column[row] + self.later(row) * *value;
        }
    }

    /// The sums of every part of the trials.
    fn sums(&self, dealt: Dealt) -> Vec<SumsOfPart> {
        let local = self.rest.layout.local();
        let mut columns = vec![0.0; local];
        let mut parts = vec![SumsOfPart::new(local); dealt.parts()];
        for row in self.rows.clone().filter(|&row| self.rest.usable[row]) {
            self.fill(row, &mut columns);
            parts[dealt.part(row)].add(&columns, self.rest.rhs[row], self.later(row));
        }
        parts
    }

    /// The covariance of the moments, as that of the rows of one trial makes it.
    fn noise_of_moments(&self, dealt: Dealt, covariance: &RowCovariance) -> Mat<f64> {
        let (local, equations) = (self.rest.layout.local(), dealt.equations);
        let times = self.rows.len() / dealt.group;
        let mut noise = Mat::zeros(local, local);
        let mut columns = vec![0.0; local];
        let mut of_trial = vec![vec![0.0; times * equations]; local];
        for trial in 0..dealt.group / equations {
            for place in 0..times * equations {
                let row = self.rows.start + place / equations * dealt.group + trial * equations + place % equations;
                columns.fill(0.0);
                if self.rest.usable[row] {
                    self.fill(row, &mut columns);
                }
                of_trial.iter_mut().zip(&columns).for_each(|(column, value)| column[place] = *value);
            }
            for (j, column) in of_trial.iter().enumerate() {
                let with = covariance.times(column);
                for (i, other) in of_trial.iter().enumerate() {
                    noise[(i, j)] += dot(other, &with);
                }
            }
        }
        noise
    }
}

/// What a window over few times says of the unknowns at its centre, and the covariance of all.
pub(crate) struct SaidAcross {
    unknowns: Col<f64>,
    covariance: Mat<f64>,
}

impl SaidAcross {
    fn new(window: &WindowAcross<'_, '_>, dealt: Dealt, covariance: &RowCovariance) -> Option<Self> {
        // Rows on one side of a gap say little of the window's centre.
        let times = window.rows.clone().step_by(dealt.group);
        let told =
            times.clone().filter(|&first| window.rest.usable[first..first + dealt.group].contains(&true)).count();
        if 2 * told <= times.len() {
            return None;
        }
        let all = SumsOfPart::merged(&window.sums(dealt), window.rest.layout.local());
        let (factor, moments) = all.without(None, window.rest)?;
        let inverse = factor.inverse();
        let noise = window.noise_of_moments(dealt, covariance);
        Some(Self { unknowns: &inverse * &moments, covariance: &inverse * noise * &inverse })
    }

    pub(crate) fn value(&self, windowed: usize) -> f64 {
        self.unknowns[windowed]
    }

    /// The standard error of a windowed unknown.
    pub(crate) fn error(&self, windowed: usize) -> f64 {
        self.covariance[(windowed, windowed)].max(0.0).sqrt()
    }
}

/// Works on some cells, all or those that are so many apart, in parallel; what each gives, with its number.
fn of_cells<R: Send>(
    rest: &Problem<'_>,
    (scale, apart): (Scale, usize),
    stages: &mut Stages<'_, '_>,
    of: impl Fn(isize, &WindowAcross<'_, '_>) -> R + Sync,
) -> Result<Vec<(isize, R)>, Error> {
    let cells = scale.full_cells(rest.rows());
    let pieces =
        (cells.start..cells.end).step_by(PIECE).map(|first| first..(first + PIECE.cast_signed()).min(cells.end));
    let pieces = pieces.map(|cells| Piece { size: cells.len() * scale.step, content: cells });
    let work = |cells: Range<isize>, (): &mut ()| {
        let some = cells.filter(|cell| cell % apart.cast_signed() == 0);
        some.filter_map(|cell| Some((cell, of(cell, &WindowAcross::new(rest, scale, cell)?)))).collect::<Vec<_>>()
    };
    Ok(stages.map(pieces.collect(), || (), work)?.into_iter().flatten().collect())
}

/// What windows over few times say, by cell; nothing where their rows do not determine it. The problem is one without constants, and the covariance that of
/// the rows of one trial.
pub(crate) fn said_across(
    rest: &Problem<'_>,
    scale: Scale,
    dealt: Dealt,
    covariance: &RowCovariance,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<Option<SaidAcross>>, Error> {
    let mut said: Vec<Option<SaidAcross>> = scale.full_cells(rest.rows()).map(|_| None).collect();
    let of = |_: isize, window: &WindowAcross<'_, '_>| SaidAcross::new(window, dealt, covariance);
    for (cell, one) in of_cells(rest, (scale, 1), stages, of)? {
        said[cell.unsigned_abs()] = one;
    }
    Ok(said)
}

/// What is left of rows in the middle of windows over few times once they are predicted from the other trials in these; not a number where they are not. The
/// problem is one without constants.
pub(crate) fn left_across(
    rest: &Problem<'_>,
    scale: Scale,
    dealt: Dealt,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<f64>, Error> {
    let of = |cell: isize, window: &WindowAcross<'_, '_>| left_of_cell(window, (scale, cell), dealt);
    let mut all = vec![f64::NAN; rest.rows()];
    for (row, left) in of_cells(rest, (scale, dealt.apart(rest.rows())), stages, of)?.into_iter().flat_map(|one| one.1)
    {
        all[row] = left;
    }
    Ok(all)
}

/// What is left of the rows of one cell.
fn left_of_cell(window: &WindowAcross<'_, '_>, (scale, cell): (Scale, isize), dealt: Dealt) -> Vec<(usize, f64)> {
    let rest = window.rest;
    let parts = window.sums(dealt);
    let all = SumsOfPart::merged(&parts, rest.layout.local());
    let solved = |part: &SumsOfPart| {
        let (factor, moments) = all.without(Some(part), rest)?;
        let mut unknowns = Mat::from_fn(moments.nrows(), 1, |i, _| moments[i]);
        factor.solve_in_place(&mut unknowns);
        Some(unknowns)
    };
    let unknowns: Vec<Option<Mat<f64>>> = parts.iter().map(solved).collect();
    let mut columns = vec![0.0; rest.layout.local()];
    let left = |row: usize| {
        let unknowns = unknowns[dealt.part(row)].as_ref()?;
        window.fill(row, &mut columns);
        Some((row, rest.rhs[row] - dot(&columns, unknowns.col_as_slice(0))))
    };
    scale.rows_of_cell(cell).filter(|&row| rest.usable[row]).filter_map(left).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::model::Model;
    use crate::regression::simulated::{assert_near, least_squares, products, rows, solved, staged};

    const DEALT: Dealt = Dealt { group: 24, equations: 2 };
    const TIMES: usize = 30;

    /// A problem with one unknown that changes, and nothing that is constant.
    fn problem_of(rows: &Rows) -> Problem<'_> {
        let model = Model { windowed: vec![0], constant: Vec::new(), linear: true, ..Model::default() };
        model.problem(rows, &rows.rhs, 0.0, None)
    }

    /// Value and growth at the centre of a window, and the right-hand side, of its rows that are wanted.
    fn columns(rows: &Rows, window: &Range<usize>, wanted: impl Fn(usize) -> bool) -> Vec<Vec<f64>> {
        let centre = (window.start + window.end - 1) as f64 / 2.0;
        let some: Vec<usize> = window.clone().filter(|&row| rows.usable[row] && wanted(row)).collect();
        let regressor = &rows.regressors[0];
        let later = |row: usize| (row as f64 - centre) * rows.period;
        vec![
            some.iter().map(|&row| regressor.value[row]).collect(),
            some.iter().map(|&row| regressor.companion[row] + later(row) * regressor.value[row]).collect(),
            some.iter().map(|&row| rows.rhs[row]).collect(),
        ]
    }

    #[test]
    fn rows_of_trials_are_predicted_from_the_others_in_the_same_window() {
        let mut rows = rows(TIMES * DEALT.group, |time| [1.0 + 0.01 * time, 0.01], 0.3);
        rows.exclude([100, 101, 130].into_iter());
        let problem = problem_of(&rows);
        for times in [1, 3, 5] {
            let scale = Scale::across(times, 4, DEALT.group);
            let left = staged(|stages| left_across(&problem, scale, DEALT, stages));
            for row in [5 * DEALT.group, 9 * DEALT.group + 7, 20 * DEALT.group + 23, 4 * DEALT.group + 4] {
                let first = (row / DEALT.group - times / 2) * DEALT.group;
                let window = first..first + times * DEALT.group;
                let others = columns(&rows, &window, |other| DEALT.part(other) != DEALT.part(row));
                let [value, slope] = least_squares(&others)[..] else { unreachable!("two unknowns") };
                if !rows.usable[row] {
                    assert!(left[row].is_nan());
                    continue;
                }
                let own = columns(&rows, &window, |other| other == row);
                assert_near(left[row], own[2][0] - value * own[0][0] - slope * own[1][0], 1e-9);
            }
            // Ends have no windows.
            assert_eq!(left[0].is_nan(), times > 1);
        }
    }

    #[test]
    fn windows_say_what_least_squares_of_their_rows_does_with_the_error_that_the_covariance_makes() {
        let rows = rows(TIMES * DEALT.group, |time| [1.0 + 0.01 * time, 0.01], 0.3);
        let problem = problem_of(&rows);
        let white = RowCovariance::by_distance(vec![0.04]);
        for times in [1, 3] {
            let scale = Scale::across(times, 4, DEALT.group);
            let said = staged(|stages| said_across(&problem, scale, DEALT, &white, stages));
            for cell in [0, 7, 20] {
                let window = cell * DEALT.group..(cell + times) * DEALT.group;
                let all = columns(&rows, &window, |_| true);
                let one = said[cell].as_ref().expect("enough rows");
                assert_near(one.value(0), least_squares(&all)[0], 1e-9);
                let expected = (0.04 * solved(products(&all[..2]), vec![1.0, 0.0])[0]).sqrt();
                assert_near(one.error(0), expected, 1e-9);
            }
        }
    }

    #[test]
    fn windows_over_jumps_and_with_too_few_rows_say_nothing() {
        let mut rows = rows(TIMES * DEALT.group, |_| [1.0, 0.0], 0.1);
        rows.jumps = vec![10 * DEALT.group];
        rows.exclude((20 * DEALT.group..21 * DEALT.group).filter(|row| row % 3 > 0));
        let problem = problem_of(&rows);
        let told = |times: usize| {
            let scale = Scale::across(times, 4, DEALT.group);
            let said = staged(|stages| said_across(&problem, scale, DEALT, &RowCovariance::white(), stages));
            said.iter().map(Option::is_some).collect::<Vec<_>>()
        };
        let [alone, three] = [1, 3].map(told);
        assert_eq!((alone.len(), three.len()), (TIMES, TIMES - 2));
        // A third of 24 rows are too few for two unknowns.
        assert_eq!(alone.iter().filter(|told| !**told).count(), 1);
        assert!(!alone[20] && three[7] && !three[8] && !three[9] && three[10]);
    }
}
