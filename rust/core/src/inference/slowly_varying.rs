//! Coefficients that vary more slowly than the windowed ones, estimated by local polynomials in time.
//!
//! Windows of one length, with their own unknowns eliminated, leave equations for the slow coefficients around each
//! window's centre. A quadratic in time is fitted to the equations within a bandwidth of each point, with weights that
//! fall with the distance. The bandwidth is chosen by cross-validation: a point's own neighbourhood is left out to
//! predict its rows.

use std::borrow::Cow;
use std::ops::Range;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::inference::bandwidths::{outward, within};
use crate::inference::constancy::BLOCKS;
use crate::inference::cross_validation::{ComparedRows, best_length, is_inside, near, rule_out};
use crate::inference::slow_curve::Varying;
use crate::inference::slow_equations::{QUADRATIC, Slow};
use crate::inference::slow_predictions::{PredictedRows, Prediction};
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::subsample::{few_stretches, places_of, thinned_column, thinned_rows};
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// The part of the record, or of its shortest stretch between jumps, that windows span at most: one whose parts are told to differ is followed
/// from part to part.
pub(crate) const STRETCH: usize = BLOCKS;

/// Rounds of estimating the slow coefficients, each starting from the last one's result.
const ROUNDS: usize = 3;
/// A round is the last that chooses the same and changes the error by no more than this part.
const SETTLED: f64 = 2e-3;

/// The slow coefficients found.
#[derive(Clone, Debug)]
pub(crate) struct SlowCoefficients {
    pub(crate) varying: Varying,
    /// The right-hand side without them, and what they take off it.
    pub(crate) rhs: Vec<f64>,
    pub(crate) taken: Vec<(usize, f64)>,
    /// The length of windows with the smallest cross-validation error.
    pub(crate) scale: Scale,
    /// The length of the windows that left the equations for them.
    pub(crate) equations_of: Scale,
    /// Mean squared error of predicting rows, over the noise's variance.
    pub(crate) error: f64,
    /// The same where a row is predicted by slow coefficients from equations without it; the error where nothing may jump, for nothing is
    /// compared with it.
    pub(crate) predicted: f64,
    /// Bandwidth: rows on either side that they are estimated from.
    pub(crate) reach: f64,
    /// Coefficients of the polynomials in time.
    terms: usize,
}

/// The data in which slow coefficients are estimated.
pub(crate) struct SlowSearch<'a> {
    pub(crate) rows: &'a Rows,
    /// The slow coefficients come first among its constants.
    pub(crate) model: &'a Model,
    pub(crate) coefficients: usize,
    /// Variance of the angle's noise.
    pub(crate) noise: f64,
    pub(crate) expected: Expected,
    /// Lengths of windows for the windowed coefficients.
    pub(crate) scales: &'a [Scale],
    /// Rows that windows span at most, if that is known.
    pub(crate) longest: Option<usize>,
    /// The error from which on a round is the last: what is only tried is worth no more.
    pub(crate) hopeless: f64,
    /// The first rows after places where they may jump.
    pub(crate) breaks: &'a [usize],
    /// What errors of constants between jumps are multiplied by, in comparison with those of curves.
    pub(crate) simpler: f64,
    pub(crate) instructions: Instructions,
}

/// The curves of one bandwidth, without equations near each row and with all, and what noise is more with them than expected.
struct BestCurve {
    terms: usize,
    curves: [Varying; 2],
    reach: f64,
    excess: f64,
}

/// Few of many rows, and how many of the shortest lengths of windows they hold.
struct FewRows {
    rows: Rows,
    stretches: Vec<Range<usize>>,
    held: usize,
}

impl FewRows {
    fn of(rows: &Rows, scales: &[Scale]) -> Option<Self> {
        let (stretches, held) = few_stretches(rows.len(), scales)?;
        Some(Self { rows: thinned_rows(rows, &stretches), stretches, held })
    }
}

impl SlowSearch<'_> {
    /// The length of windows that predicts best what slow coefficients leave, and its error. Lengths near the best one of the round before are tried
    /// first, and a few rows rule out most of all.
    fn best_length(
        &self,
        problem: &Problem<'_>,
        (rest, before): (&Model, Option<Scale>),
        few: &mut Option<FewRows>,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<(Scale, f64)>, Error> {
        let &Self { noise, expected, scales, instructions, .. } = self;
        let place_of = |scale: Scale| scales.iter().position(|one| *one == scale);
        if let Some(place) = before.and_then(place_of) {
            let near = near(place, scales.len());
            let found = best_length(problem, (scales, &scales[near.clone()]), expected, instructions, stages)?;
            let best = found.and_then(|(best, _)| place_of(best));
            if best.is_some_and(|best| is_inside(best, &near, scales.len())) {
                return Ok(found);
            }
        }
        let left = match few {
            Some(FewRows { rows, stretches, held }) => {
                rows.rhs = thinned_column(problem.rhs, stretches);
                let few = rest.problem(rows, &rows.rhs, noise, None);
                Cow::Owned(rule_out(&few, &places_of(stretches), (scales, *held), expected, instructions, stages)?.0)
            }
            None => Cow::Borrowed(scales),
        };
        best_length(problem, (scales, &left), expected, instructions, stages)
    }

    /// The curves of the bandwidth that predicts best, or the first one where nothing is compared.
    fn best_curve(
        &self,
        equations: &Slow<'_>,
        problem: &Problem<'_>,
        (scale, compares): (Scale, bool),
        (reaches, last): (&[f64], Option<f64>),
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<BestCurve>, Error> {
        let &Self { expected, simpler, instructions, .. } = self;
        let triangles = equations.equations(problem);
        let rows = PredictedRows::new(equations, problem, scale);
        let mut best: Option<BestCurve> = None;
        let mut least = f64::INFINITY;
        let mut consider = |terms: usize, reach: f64| -> Result<bool, Error> {
            if best.is_some() && !compares {
                return Ok(false);
            }
            let fitted = equations.fit(&triangles, terms, (reach, hole(scale)), instructions, stages)?;
            let Some(curves) = fitted else { return Ok(false) };
            let Prediction { error, excess } = rows.error(&curves[0], &curves[1], expected);
            let counts = if terms == 1 { simpler * error } else { error };
            let is_better = best.is_none() || counts < least;
            if is_better {
                least = counts;
                best = Some(BestCurve { terms, curves, reach, excess });
            }
            Ok(is_better)
        };
        outward(reaches, last, |reach| consider(QUADRATIC, reach))?;
        // Between jumps a coefficient may be constant.
        if !self.breaks.is_empty() {
            consider(1, 2.0 * self.rows.len() as f64)?;
        }
        Ok(best)
    }
}

/// Rows on either side that a prediction leaves out.
fn hole(scale: Scale) -> f64 {
    (scale.span() / 2 + scale.reach) as f64
}

/// Estimates slow coefficients, or returns `None` if they are not determined. `first` is the length of windows to begin with.
pub(crate) fn find(
    search: &SlowSearch<'_>,
    first: Scale,
    stages: &mut Stages<'_, '_>,
) -> Result<Option<SlowCoefficients>, Error> {
    let &SlowSearch { rows, model, coefficients, noise, expected, scales, breaks, instructions, .. } = search;
    let slow = &model.constant[..coefficients];
    let rest = Model { constant: model.constant[coefficients..].to_vec(), ..model.clone() };
    let whole = rows.len() as f64;
    let ends = breaks.iter().copied().chain([rows.len()]);
    // A jump may lie behind the last row.
    let stretches = std::iter::once(0).chain(breaks.iter().copied()).zip(ends);
    let shortest = stretches.filter_map(|(start, end)| end.checked_sub(start)).min();
    let mut most = (shortest.unwrap_or(0) / STRETCH).min(search.longest.unwrap_or(usize::MAX));
    let shortened = |scale: Scale, most: usize| {
        let short = scales.iter().rev().find(|one| one.span() <= most);
        if scale.span() <= most { scale } else { short.or(scales.first()).copied().unwrap_or(scale) }
    };
    let mut scale = shortened(first, most);
    let mut found: Option<SlowCoefficients> = None;
    let mut last: Option<f64> = None;
    let mut few = FewRows::of(rows, scales);
    for round in 1..=ROUNDS {
        let current = found.as_ref().map(|found| &found.varying);
        let rhs = found.as_ref().map_or_else(|| rows.rhs.clone(), |found| found.rhs.clone());
        let taken = found.as_ref().map_or_else(Vec::new, |found| found.taken.clone());
        let model = Model { taken, ..model.clone() };
        let problem = model.problem(rows, &rhs, noise, None);
        // Windows on both sides of a row that are too short to predict it compare nothing: the first bandwidth stands.
        let compares = scale.predicts(problem.layout);
        let fit = if compares {
            Fit::with_leave_gap_out(&problem, scale, expected, instructions, stages)?
        } else {
            Fit::new(&problem, Some(scale), expected, instructions, stages)?
        };
        let Some(fit) = fit else { return Ok(None) };
        let ones = vec![1.0; fit.full.len()];
        let weights = if current.is_some() { &fit.pooled.weights } else { &ones };
        let companions = slow.iter().map(|&one| rows.regressors[one].companion.as_slice()).collect();
        let equations = Slow { fit: &fit, coefficients, companions, current, weights, rows: rows.len(), breaks };
        let reaches = within(hole(scale), whole);
        let best = search.best_curve(&equations, &problem, (scale, compares), (&reaches, last), stages)?;
        let Some(BestCurve { terms, curves: [leave_gap_out, varying], reach, excess }) = best else { return Ok(None) };
        let reach = reach.min(whole / 2.0);
        last = (terms > 1).then_some(reach);
        if last.is_some() && last == reaches.first().copied() {
            // Shorter bandwidths need shorter windows.
            most = most.min(scale.span() / 2);
        }
        let rhs = without(rows, &rows.rhs, slow, &varying);
        let taken = varying.levels(slow);
        let rest = Model { taken: taken.clone(), ..rest.clone() };
        let problem = rest.problem(rows, &rhs, noise, None);
        let before = found.as_ref().map(|found| found.scale);
        let best = search.best_length(&problem, (&rest, before), &mut few, stages)?;
        let Some((best, error)) = best else { return Ok(None) };
        let error = error - excess;
        let is_settled = found.as_ref().is_some_and(|found| {
            let chosen = (found.scale, found.equations_of, found.reach, found.terms);
            chosen == (best, scale, reach, terms) && (error - found.error).abs() <= SETTLED * error
        });
        let is_last = round == ROUNDS || is_settled || error > search.hopeless;
        let mut predicted = error;
        if is_last && !rows.jumps.is_empty() {
            let rhs = without(rows, &rows.rhs, slow, &leave_gap_out);
            let problem = rest.problem(rows, &rhs, noise, None);
            let fit = Fit::with_leave_gap_out(&problem, best, expected, instructions, stages)?;
            let compared = ComparedRows::new(&problem, scales);
            predicted =
                fit.map_or(f64::INFINITY, |fit| compared.error(&problem, best, &fit, expected.variance)) - excess;
        }
        found = Some(SlowCoefficients {
            varying,
            rhs,
            taken,
            scale: best,
            equations_of: scale,
            error,
            predicted,
            reach,
            terms,
        });
        if is_last {
            break;
        }
        scale = shortened(best, most);
    }
    Ok(found)
}

/// What slow coefficients would follow of another right-hand side with the bandwidth that was found, or `None` if they are not determined: as much more of
/// one that is as much larger, whatever noise is expected.
pub(crate) fn followed(
    search: &SlowSearch<'_>,
    found: &SlowCoefficients,
    rhs: &[f64],
    stages: &mut Stages<'_, '_>,
) -> Result<Option<Varying>, Error> {
    let &SlowSearch { rows, model, coefficients, noise, instructions, .. } = search;
    let scale = found.equations_of;
    let problem = model.problem_of_another(rows, rhs, noise);
    let fit = Fit::new(&problem, Some(scale), Expected::UNKNOWN, instructions, stages)?;
    let Some(fit) = fit else { return Ok(None) };
    let companions =
        model.constant[..coefficients].iter().map(|&one| rows.regressors[one].companion.as_slice()).collect();
    let weights = vec![1.0; fit.full.len()];
    let (rows, breaks) = (rows.len(), found.varying.breaks());
    let equations =
        Slow { fit: &fit, coefficients, companions, current: None, weights: &weights, rows, breaks: &breaks };
    let equations_of = equations.equations(&problem);
    let fitted = equations.fit(&equations_of, found.terms, (found.reach, hole(scale)), instructions, stages)?;
    Ok(fitted.map(|[_, full]| full))
}

/// A right-hand side without slow coefficients.
pub(crate) fn without(rows: &Rows, rhs: &[f64], slow: &[usize], varying: &Varying) -> Vec<f64> {
    let mut rhs = rhs.to_vec();
    for (coefficient, &regressor) in slow.iter().enumerate() {
        let regressor = &rows.regressors[regressor];
        for (row, rhs) in rhs.iter_mut().enumerate() {
            let (value, slope) = varying.at(coefficient, row as f64);
            *rhs -= value * regressor.value[row] + slope / rows.period * regressor.companion[row];
        }
    }
    rhs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{CONSTANTS, PERIOD, model, rows, staged, white};

    const ROWS: usize = 1200;
    const DEVIATION: f64 = 0.1;

    /// The first constant over time, by row, and its rate per second.
    fn slow(row: f64) -> [f64; 2] {
        let pace = 2.0 * std::f64::consts::PI / ROWS as f64;
        [CONSTANTS[0] + 0.5 * (pace * row).sin(), 0.5 * pace / PERIOD * (pace * row).cos()]
    }

    fn changing() -> Rows {
        let mut rows = rows(ROWS, |time| [(0.05 * time).sin(), 0.05 * (0.05 * time).cos()], DEVIATION);
        for row in 0..ROWS {
            let ([value, rate], regressor) = (slow(row as f64), &rows.regressors[1]);
            rows.rhs[row] += (value - CONSTANTS[0]) * regressor.value[row] + rate * regressor.companion[row];
        }
        rows
    }

    fn search<'a>(rows: &'a Rows, model: &'a Model, scales: &'a [Scale]) -> SlowSearch<'a> {
        SlowSearch {
            rows,
            model,
            coefficients: 1,
            noise: 0.0,
            expected: white(DEVIATION * DEVIATION),
            scales,
            longest: None,
            hopeless: f64::INFINITY,
            breaks: &[],
            simpler: 1.0,
            instructions: Instructions::Scalar,
        }
    }

    /// What a search for one coefficient that varies finds, which begins with windows of a length.
    fn found_from(rows: &Rows, scales: &[Scale], first: Scale) -> Option<SlowCoefficients> {
        staged(|stages| find(&search(rows, &model(), scales), first, stages))
    }

    #[test]
    fn a_slow_coefficient_is_followed_beside_a_quick_one() {
        let (rows, scales) = (changing(), Scale::all(ROWS, 3));
        let found = found_from(&rows, &scales, scales[2]).expect("a curve");
        // Rows are predicted with little more than their noise.
        assert!(found.error < 1.3, "{}", found.error);
        assert!((found.varying.constants[0] - CONSTANTS[1]).abs() < 0.02);
        let (mut squares, mut scores) = (0.0, 0.0);
        for row in 0..ROWS {
            let off = found.varying.at(0, row as f64).0 - slow(row as f64)[0];
            squares += off * off;
            scores += off * off / (DEVIATION * DEVIATION * found.varying.variance(0, row as f64));
        }
        // The sine's deviation is 0.35: a twentieth of it is left at most, and that is what the variances say.
        assert!((squares / ROWS as f64).sqrt() < 0.018, "{}", (squares / ROWS as f64).sqrt());
        let score = (scores / ROWS as f64).sqrt();
        assert!((0.3..2.5).contains(&score), "{score}");
    }

    #[test]
    fn what_is_hopeless_takes_one_round() {
        let (rows, scales, model) = (changing(), Scale::all(ROWS, 3), model());
        let found = |hopeless: f64| {
            let search = SlowSearch { hopeless, ..search(&rows, &model, &scales) };
            staged(|stages| find(&search, scales[2], stages)).expect("a curve")
        };
        let (all, first) = (found(f64::INFINITY), found(0.0));
        // The first round stands with the windows that it began with.
        assert_eq!(first.equations_of.span(), scales[2].span());
        // What is better than hopeless takes as many as ever.
        assert_eq!(found(2.0).error.to_bits(), all.error.to_bits());
        assert_ne!(first.error.to_bits(), all.error.to_bits());
    }

    #[test]
    fn a_jump_behind_the_last_row_parts_nothing() {
        let (rows, scales, model) = (changing(), Scale::all(ROWS, 3), model());
        let found = |breaks: &[usize]| {
            let search = SlowSearch { breaks, ..search(&rows, &model, &scales) };
            staged(|stages| find(&search, scales[2], stages)).expect("a curve").equations_of.span()
        };
        assert_eq!(found(&[ROWS + 1]), found(&[]));
    }

    #[test]
    fn windows_become_short_where_a_coefficient_bends_quickly_beside_one_that_rests() {
        // What rests suits windows of half the record; the bump's are a sixteenth of it.
        let bump = |row: f64| 0.6 * (-0.5 * ((row - 0.5 * ROWS as f64) / 40.0).powi(2)).exp();
        let mut rows = rows(ROWS, |_| [1.0, 0.0], DEVIATION);
        for row in 0..ROWS {
            rows.rhs[row] += bump(row as f64) * rows.regressors[1].value[row];
        }
        let scales = Scale::all(ROWS, 3);
        let longest = *scales.last().expect("lengths");
        let found = found_from(&rows, &scales, longest).expect("a curve");
        let off = (0..ROWS).map(|row| (found.varying.at(0, row as f64).0 - CONSTANTS[0] - bump(row as f64)).powi(2));
        let off = (off.sum::<f64>() / ROWS as f64).sqrt();
        assert!(found.equations_of.span() <= ROWS / 16 && off < 0.03, "{}, {off}", found.equations_of.span());
    }

    #[test]
    fn what_changes_slowly_is_taken_off_with_its_growth() {
        // A line is interpolated exactly, so nothing of it is left.
        let mut rows = rows(ROWS, |_| [0.0, 0.0], 0.0);
        let line = |row: f64| 1.0 + 0.01 * row;
        for row in 0..ROWS {
            let regressor = &rows.regressors[1];
            rows.rhs[row] = line(row as f64) * regressor.value[row] + 0.01 / PERIOD * regressor.companion[row];
        }
        let points: Vec<f64> = (-2..152).map(|point| line(f64::from(point) * 8.0)).collect();
        let variances = vec![vec![1.0; points.len()]];
        let stretches = vec![(-16.0, 0)];
        let varying = Varying { spacing: 8.0, stretches, values: vec![points], variances, constants: Vec::new() };
        assert!(without(&rows, &rows.rhs, &[1], &varying).iter().all(|left| left.abs() < 1e-10));
    }

    #[test]
    fn another_column_is_followed_as_far_as_it_is_a_slow_coefficient_times_the_regressor() {
        let (rows, scales, model) = (changing(), Scale::all(ROWS, 3), model());
        let found = found_from(&rows, &scales, scales[2]).expect("a curve");
        // A column that is the regressor times a factor that grows, beside the growth's companion, and a part that is no such thing.
        let growth = 1.0 / (ROWS as f64 * PERIOD);
        let regressor = &rows.regressors[1];
        let other = crate::regression::simulated::random(77, ROWS);
        let column: Vec<f64> = (0..ROWS)
            .map(|row| {
                let followed = row as f64 / ROWS as f64 * regressor.value[row] + growth * regressor.companion[row];
                followed + other[row]
            })
            .collect();
        let search = search(&rows, &model, &scales);
        let varying = staged(|stages| followed(&search, &found, &column, stages)).expect("determined");
        let left = without(&rows, &column, &[1], &varying);
        // The part that is followed is a third of the column's mean square, and a few of so many rows are taken by the curve.
        let off: f64 = left.iter().zip(&other).map(|(left, other)| (left - other).powi(2)).sum();
        assert!(off < 0.05 * other.iter().map(|other| other * other).sum::<f64>(), "{off}");
        let level: f64 = varying.values[0].iter().sum::<f64>() / varying.values[0].len() as f64;
        assert!((level - 0.5).abs() < 0.2, "{level}");
    }
}
