//! Cross-validation of window lengths: how well each predicts rows that it does not contain.

use std::ops::Range;

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::inference::largest_square::{LargestSquare, MOST};
use crate::inference::moving::moving;
use crate::regression::block_sums::BlockSums;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::predictor::{Predictor, without_constants};
use crate::regression::problem::Problem;
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// So many of the longest windows that some rows hold are tried again on all rows, where one of them is best.
pub(crate) const OVERLAP: usize = 2;

/// Parts of the rows that must compare a length with the best, and standard errors beyond which it predicts worse.
const FEWEST_PARTS: usize = 6;
const WORSE: f64 = 3.0;

/// The part more than the best windows that longer ones may leave where noise explains neither, and the error from which on it is so large: beyond what
/// fails it grows from nothing, for what few rows leave more is no reason for long windows.
const TOLERATED: f64 = 0.25;
const FAR_BEYOND: f64 = 1.5 * NOISE_MODEL_FAILS;

/// Parts of the rows that tell by how much the errors of two lengths differ by chance, and standard errors up to which one predicts as well.
const PARTS: usize = 16;
const AS_WELL: f64 = 2.0;
/// Constants are known far better where the variance of one falls to this part.
const FAR_BETTER_KNOWN: f64 = 1.0 / 9.0;

/// A fit in windows of one length and its cross-validation error.
#[derive(Clone, Debug)]
pub(crate) struct Validated {
    pub(crate) fit: Fit,
    /// Mean squared error of the rows over the noise's variance.
    pub(crate) error: f64,
    /// The same of every part of the rows.
    parts: Vec<f64>,
}

impl Validated {
    /// Whether it predicts as well as another length, by what differs between parts of the rows.
    fn predicts_as_well_as(&self, other: &Self) -> bool {
        let pairs = self.parts.iter().zip(&other.parts);
        let differences: Vec<f64> = pairs.map(|(one, other)| one - other).filter(|one| one.is_finite()).collect();
        let (mean, error) = mean_and_error(&differences);
        differences.len() >= FEWEST_PARTS && mean <= AS_WELL * error
    }

    /// Whether it knows some constant far better than another length does.
    fn knows_far_better_than(&self, other: &Self) -> bool {
        self.fit.variances().zip(other.fit.variances()).any(|(one, other)| one <= FAR_BETTER_KNOWN * other)
    }
}

/// Fits a problem in windows of every length and returns their cross-validation errors, in the order of the lengths.
/// Lengths whose constants are not determined are left out.
pub(crate) fn validate(
    problem: &Problem<'_>,
    (scales, largest): (&[Scale], LargestSquare),
    expected: Expected,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<Validated>, Error> {
    let compared = ComparedRows::new(problem, scales, largest);
    let sums = BlockSums::new(problem, scales.iter().map(|scale| scale.step), instructions, stages)?;
    let mut validated = Vec::new();
    for some in Scale::together(scales, problem.rows()) {
        let fits = Fit::of_lengths((problem, sums.as_ref()), some, expected, instructions, stages)?;
        for (&scale, fit) in some.iter().zip(fits).filter_map(|(scale, fit)| Some((scale, fit?))) {
            let (error, parts) = compared.errors(problem, scale, &fit, expected.variance);
            validated.push(Validated { fit, error, parts });
        }
    }
    Ok(validated)
}

/// The same rows for all lengths, so that they are compared on equal terms, and which rows of the record move.
pub(crate) struct ComparedRows {
    rows: Range<usize>,
    moving: Vec<bool>,
    largest: LargestSquare,
}

impl ComparedRows {
    pub(crate) fn new(problem: &Problem<'_>, scales: &[Scale], largest: LargestSquare) -> Self {
        let (rows, inside) = (problem.rows(), problem.inside());
        let full = || scales.iter().map(|scale| scale.full_rows(rows));
        let start = full().map(|rows| rows.start).max().unwrap_or(0).min(inside.start + inside.len() / 4);
        let end = full().map(|rows| rows.end).min().unwrap_or(rows).max(inside.start + 3 * inside.len() / 4);
        let reach = scales.first().map_or(1, |scale| scale.reach);
        Self { rows: start..end, moving: moving(problem, reach), largest }
    }

    /// Mean squared error, over the noise's variance, of predicting rows from the windows on both sides of them: of all, or of those that move, if it is
    /// larger.
    pub(crate) fn error(&self, problem: &Problem<'_>, scale: Scale, fit: &Fit, variance: f64) -> f64 {
        self.errors(problem, scale, fit, variance).0
    }

    /// That, and the mean squared error of every part of the rows.
    fn errors(&self, problem: &Problem<'_>, scale: Scale, fit: &Fit, variance: f64) -> (f64, Vec<f64>) {
        let Some(squared) = squared_errors(problem, scale, fit, variance) else { return (f64::NAN, Vec::new()) };
        self.errors_of(squared)
    }

    /// The same of what predictions of rows leave, squared, over the variance of the noise.
    pub(crate) fn errors_of(&self, squared: impl Fn(usize) -> Option<f64>) -> (f64, Vec<f64>) {
        let [mut all, mut moving] = [(0.0, 0.0_f64); 2];
        let mut parts = [(0.0, 0.0); PARTS];
        let length = self.rows.len().div_ceil(PARTS).max(1);
        let squares: Vec<f64> = self.rows.clone().map(|row| squared(row).unwrap_or(f64::NAN)).collect();
        let of_moving = self.rows.clone().zip(&squares).filter(|(row, _)| self.moving[*row]).map(|(_, square)| *square);
        let most = self.largest.of(of_moving, MOST);
        for (row, square) in self.rows.clone().zip(squares).filter(|(_, square)| !square.is_nan()) {
            let squared = square.min(most);
            all = (all.0 + squared, all.1 + 1.0);
            if self.moving[row] {
                moving = (moving.0 + squared, moving.1 + 1.0);
            }
            let part = &mut parts[(row - self.rows.start) / length];
            *part = (part.0 + squared, part.1 + 1.0);
        }
        let mean = |(sum, count): (f64, f64)| sum / count;
        let error = if all.1 == 0.0 { f64::INFINITY } else { mean(all).max(mean(moving)) };
        (error, parts.map(mean).to_vec())
    }
}

/// Lengths of windows that few rows ruled out, and their errors.
pub(crate) type RuledOut = Vec<(Scale, f64)>;

/// Lengths of windows that few rows, which lie in some parts, do not rule out, and the errors of the others. So many of the shortest are held by these rows;
/// longer ones are ruled out with the longest that are held.
pub(crate) fn rule_out(
    few: &Problem<'_>,
    parts: &[Range<usize>],
    (scales, held): (&[Scale], usize),
    expected: Expected,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<(Vec<Scale>, RuledOut), Error> {
    let found = validate(few, (&scales[..held], LargestSquare::Growing), expected, instructions, stages)?;
    let stays = not_ruled_out(few, &found, parts, expected.variance);
    let out = found.iter().zip(stays).filter(|(_, stays)| !stays);
    let out: RuledOut = out.filter_map(|(one, _)| Some((one.fit.scale?, one.error))).collect();
    let is_out = |scale: &Scale| out.iter().any(|(one, _)| one == scale);
    let longest = &scales[held.saturating_sub(OVERLAP)..held];
    let left = if longest.iter().all(is_out) { &scales[..held] } else { scales };
    Ok((left.iter().copied().filter(|scale| !is_out(scale)).collect(), out))
}

/// The best of the lengths that are left, and its error on the rows that all lengths are compared on; the longest that are as good where that is far more
/// than noise explains. Fits of short windows are as large as the record: none is kept.
pub(crate) fn best_length(
    problem: &Problem<'_>,
    (scales, left): (&[Scale], &[Scale]),
    expected: Expected,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Option<(Scale, f64)>, Error> {
    let compared = ComparedRows::new(problem, scales, LargestSquare::Growing);
    let sums = BlockSums::new(problem, left.iter().map(|scale| scale.step), instructions, stages)?;
    let mut found: Vec<(Scale, f64)> = Vec::new();
    for some in Scale::together(left, problem.rows()) {
        let fits = Fit::of_lengths((problem, sums.as_ref()), some, expected, instructions, stages)?;
        for (&scale, fit) in some.iter().zip(fits).filter_map(|(scale, fit)| Some((scale, fit?))) {
            found.push((scale, compared.error(problem, scale, &fit, expected.variance)));
        }
    }
    let best = found.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let Some(&best) = best else { return Ok(None) };
    Ok(found.into_iter().filter(|(_, error)| is_as_good(*error, best.1)).max_by_key(|(scale, _)| scale.span()))
}

/// So many lengths on either side of the one that was best before are tried first.
const NEAR: usize = 2;

/// Lengths near one of so many, by their places.
pub(crate) fn near(place: usize, count: usize) -> Range<usize> {
    place.saturating_sub(NEAR)..(place + NEAR + 1).min(count)
}

/// Whether the best of some lengths near another has neighbours among them: then none farther away is tried.
pub(crate) fn is_inside(best: usize, near: &Range<usize>, count: usize) -> bool {
    (best > near.start || near.start == 0) && (best + 1 < near.end || near.end == count)
}

/// The fit with the smallest error, or `None` if none predicts any row.
pub(crate) fn best(validated: &[Validated]) -> Option<&Validated> {
    validated.iter().filter(|one| one.error.is_finite()).min_by(|a, b| a.error.total_cmp(&b.error))
}

/// The fit with the smallest error, or where that is far more than noise explains the one in the longest windows that are as good.
pub(crate) fn longest_as_good(validated: &[Validated]) -> Option<&Validated> {
    let best = best(validated)?;
    validated.iter().filter(|one| is_as_good(one.error, best.error)).max_by_key(|one| one.fit.span)
}

/// Whether windows leave hardly more than the best do. Where that is far more than noise explains they follow what is missing, and the shorter the more.
fn is_as_good(error: f64, best: f64) -> bool {
    let beyond = (best - NOISE_MODEL_FAILS) / (FAR_BEYOND - NOISE_MODEL_FAILS);
    error <= best * (1.0 + TOLERATED * beyond.clamp(0.0, 1.0))
}

/// The longest windows that predict as well as the best, where some constant is known far better with them. Along a sweep hardly a frequency passes
/// through a window, and a stiffness that is followed there is told from the inertia by long windows alone, while short ones predict what is near as well.
pub(crate) fn better_known<'a>(validated: &'a [Validated], best: &'a Validated) -> &'a Validated {
    let is_longer = |one: &&Validated| one.fit.span > best.fit.span;
    let is_better = |one: &&Validated| one.knows_far_better_than(best) && one.predicts_as_well_as(best);
    validated.iter().filter(is_longer).filter(is_better).max_by_key(|one| one.fit.span).unwrap_or(best)
}

/// The mean of some numbers, and its standard error by their scatter.
fn mean_and_error(numbers: &[f64]) -> (f64, f64) {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let squared = numbers.iter().map(|one| (one - mean).powi(2)).sum::<f64>();
    (mean, (squared / (count * (count - 1.0))).sqrt())
}

/// Which of some lengths parts of the rows do not rule out. Those are ruled out that predict worse than the best in every part, or on average by
/// more than that differs between parts. A length that too few parts compare with the best is not ruled out.
fn not_ruled_out(problem: &Problem<'_>, validated: &[Validated], parts: &[Range<usize>], variance: f64) -> Vec<bool> {
    let squares: Vec<Vec<f64>> = validated
        .iter()
        .map(|one| {
            let squared = one.fit.scale.and_then(|scale| squared_errors(problem, scale, &one.fit, variance));
            let of = |row| squared.as_ref().and_then(|squared| squared(row)).unwrap_or(f64::NAN);
            (0..problem.rows()).map(of).collect()
        })
        .collect();
    let place = longest_as_good(validated).and_then(|best| validated.iter().position(|one| std::ptr::eq(one, best)));
    let Some(best) = place.map(|place| &squares[place]) else { return vec![true; validated.len()] };
    let most = LargestSquare::Growing.of(best.iter().copied(), MOST);
    let is_worse = |squares: &Vec<f64>| {
        let differences: Vec<f64> = parts
            .iter()
            .filter_map(|part| {
                let both =
                    part.clone().map(|row| (squares[row], best[row])).filter(|(one, best)| !(one - best).is_nan());
                let differences = both.map(|(one, best)| one.min(most) - best.min(most));
                let (sum, count) = differences.fold((0.0, 0.0), |(sum, count), one| (sum + one, count + 1.0));
                (count > 0.0).then(|| sum / count)
            })
            .collect();
        let (mean, error) = mean_and_error(&differences);
        let always = differences.iter().all(|one| *one > 0.0);
        differences.len() >= FEWEST_PARTS && (always || mean > WORSE * error)
    };
    squares.iter().map(|squares| !is_worse(squares)).collect()
}

/// The squared error of predicting a row from the windows on both sides of it, over the noise's variance.
fn squared_errors<'a>(
    problem: &'a Problem<'_>,
    scale: Scale,
    fit: &'a Fit,
    variance: f64,
) -> Option<impl Fn(usize) -> Option<f64> + 'a> {
    let left = left_of_rows(problem, scale, fit)?;
    Some(move |row: usize| left(row).filter(|_| problem.usable[row]).map(|left| left * left / variance))
}

/// What predictions from the windows on both sides of a row leave of it; `None` if there are no such windows.
pub(crate) fn left_of_rows<'a>(
    problem: &'a Problem<'_>,
    scale: Scale,
    fit: &'a Fit,
) -> Option<impl Fn(usize) -> Option<f64> + 'a> {
    let rhs = without_constants(problem, &fit.pooled.values);
    let predictor = Predictor::new(fit.leave_gap_out.as_ref()?, &fit.pooled.values);
    Some(move |row: usize| {
        let cell = scale.cell(row);
        let place = predictor.place(cell)?;
        let later = (row as f64 - scale.centres(cell)[1]) * problem.period;
        Some(rhs[row] - predictor.predict(problem, place, row, later))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{CONSTANTS, model, rows, staged, white};

    const ROWS: usize = 1500;
    const DEVIATION: f64 = 0.2;

    /// How well windows of every length predict rows whose coefficient is a sine of some period in seconds.
    fn validated(period: f64, excluded: &[usize]) -> Vec<Validated> {
        let pace = 2.0 * std::f64::consts::PI / period;
        let mut rows = rows(ROWS, |time| [(pace * time).sin(), pace * (pace * time).cos()], DEVIATION);
        rows.exclude(excluded.iter().copied());
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let (scales, expected) = (Scale::all(ROWS, 3), white(DEVIATION * DEVIATION));
        staged(|stages| validate(&problem, (&scales, LargestSquare::Growing), expected, Instructions::Scalar, stages))
    }

    #[test]
    fn windows_that_follow_predict_with_the_noise_and_what_they_do_not_know_themselves() {
        for one in validated(1e9, &[]) {
            // Two unknowns from so many rows on both sides, constants from all; the mean of some thousand squares scatters by 3 %.
            let scale = one.fit.scale.expect("a length");
            let own = 2.0 / (2.0 * scale.one_sided() as f64);
            assert!(one.error > 0.85 && one.error < 1.15 + 4.0 * own, "{}: {}", scale.span(), one.error);
        }
    }

    #[test]
    fn the_quicker_the_change_the_shorter_the_windows_that_predict_best() {
        let spans: Vec<usize> = [1e9, 400.0, 100.0, 40.0]
            .iter()
            .map(|&period| best(&validated(period, &[])).expect("one").fit.span)
            .collect();
        assert!(spans.is_sorted_by(|long, short| long > short), "{spans:?}");
        // Of long windows chance decides which is best where nothing changes.
        assert!(spans[0] > 100 && spans[3] < 40, "{spans:?}");
    }

    /// How well windows of every length predict rows as of a sweep: a constant differs from what is windowed beside it only over the record.
    fn of_a_sweep(changing: impl Fn(f64) -> [f64; 2]) -> Vec<Validated> {
        let mut rows = rows(ROWS, changing, DEVIATION);
        let windowed = rows.regressors[0].value.clone();
        let before = rows.regressors[1].value.clone();
        let companion = rows.regressors[0].companion.clone();
        let square = |row: usize| 4.0 * (row as f64 / ROWS as f64).powi(2);
        for row in 0..ROWS {
            let now = square(row) * windowed[row];
            rows.rhs[row] += CONSTANTS[0] * (now - before[row]);
            rows.regressors[1].value[row] = now;
            rows.regressors[1].companion[row] = square(row) * companion[row];
        }
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let (scales, expected) = (Scale::all(ROWS, 3), white(DEVIATION * DEVIATION));
        staged(|stages| validate(&problem, (&scales, LargestSquare::Growing), expected, Instructions::Scalar, stages))
    }

    #[test]
    fn longer_windows_are_taken_that_predict_as_well_and_tell_constants_far_better() {
        let still = of_a_sweep(|_| [1.0, 0.0]);
        let short = still.iter().find(|one| one.fit.span > 100).expect("a short one");
        let found = better_known(&still, short);
        assert!(found.fit.span > 3 * short.fit.span, "{} {}", short.fit.span, found.fit.span);
        assert!(found.knows_far_better_than(short) && found.predicts_as_well_as(short));
        let error = |one: &Validated| (one.fit.pooled.values[0] - CONSTANTS[0]).abs();
        assert!(error(found) < 0.3 * error(short), "{} {}", error(short), error(found));
        // Not where long windows do not follow what changes.
        let moving = of_a_sweep(|time| [(time / 12.0).sin(), (time / 12.0).cos() / 12.0]);
        let first = best(&moving).expect("one");
        assert_eq!(better_known(&moving, first).fit.span, first.fit.span);
        // Nor where they tell constants no better.
        let rich = validated(1e9, &[]);
        let short = rich.iter().find(|one| one.fit.span > 100).expect("a short one");
        assert_eq!(better_known(&rich, short).fit.span, short.fit.span);
    }

    #[test]
    fn lengths_that_predict_worse_in_every_part_are_ruled_out_and_others_are_not() {
        let mut rows = rows(ROWS, |time| [(0.06 * time).sin(), 0.06 * (0.06 * time).cos()], DEVIATION);
        let parts: Vec<Range<usize>> = (0..8).map(|part| part * ROWS / 8..(part + 1) * ROWS / 8).collect();
        let scales = &Scale::all(ROWS, 3)[..9];
        let expected = white(DEVIATION * DEVIATION);
        let mut stays = |excluded: Range<usize>| {
            rows.exclude(excluded);
            let problem = model().problem(&rows, &rows.rhs, 0.0, None);
            let found = staged(|stages| {
                validate(&problem, (scales, LargestSquare::Growing), expected, Instructions::Scalar, stages)
            });
            not_ruled_out(&problem, &found, &parts, expected.variance)
        };
        let all = stays(0..0);
        let left = all.iter().filter(|stays| **stays).count();
        assert!(all.len() == scales.len() && (1..6).contains(&left) && !all[0] && !all[8], "{all:?}");
        // Rows in five parts alone rule nothing out.
        let few = stays(5 * ROWS / 8..ROWS);
        assert!(few.iter().all(|stays| *stays), "{few:?}");
    }

    #[test]
    fn nothing_is_best_where_no_row_is_predicted() {
        assert!(best(&[]).is_none());
        let all: Vec<usize> = (0..ROWS).collect();
        assert!(validated(1e9, &all).is_empty());
    }

    #[test]
    fn a_row_counts_with_nine_times_the_noise_at_most() {
        let mut rows = rows(ROWS, |_| [1.0, 0.0], 0.0);
        rows.rhs[700] += 1e6;
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let scale = Scale::all(ROWS, 3)[4];
        let fit = staged(|stages| Fit::with_leave_gap_out(&problem, scale, white(1.0), Instructions::Scalar, stages));
        let fit = fit.expect("constants");
        // No window of another row but those within its reach holds the row; its own prediction is the only one that is not zero alone.
        let held = scale.span() + 1;
        let error = |moving: Range<usize>| {
            let moving = (0..ROWS).map(|row| moving.contains(&row)).collect();
            ComparedRows { rows: 600..800, moving, largest: LargestSquare::Growing }.error(&problem, scale, &fit, 1.0)
        };
        let found = error(0..ROWS);
        assert!(found >= MOST / 200.0 && found <= MOST * held as f64 / 200.0, "{found}");
        // Where others do not move it counts among those that do; and it counts where it does not move itself.
        assert!(error(650..750) >= found.max(MOST / 100.0));
        assert_eq!(error(0..600), found);
    }
}
