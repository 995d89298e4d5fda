//! Coefficients that vary more slowly than the windowed ones, estimated by local polynomials in time.
//!
//! Windows of one length, with their own unknowns eliminated, leave equations for the slow coefficients around each
//! window's centre. A quadratic in time is fitted to the equations within a bandwidth of each point, with weights that
//! fall with the distance. The bandwidth is chosen by cross-validation: a point's own neighbourhood is left out to
//! predict its rows.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::inference::bandwidths::within;
use crate::inference::constancy::BLOCKS;
use crate::inference::cross_validation::ComparedRows;
use crate::inference::largest_square::LargestSquare;
use crate::inference::short_parts::LEFT_WHERE_LOST;
use crate::inference::slow_bandwidths::{Bandwidths, BestCurve, hole};
use crate::inference::slow_curve::Varying;
use crate::inference::slow_equations::Slow;
use crate::inference::slow_lengths::{FewRows, SlowSearch};
use crate::inference::slow_predictions::PredictedBy;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::subsample::Compare;
use crate::regression::window_length::Scale;

/// The part of the record, or of its shortest stretch between jumps, that windows span at most: one whose parts are told to differ is followed
/// from part to part.
pub(crate) const STRETCH: usize = BLOCKS;

/// Rounds of estimating the slow coefficients, each starting from the last one's result.
const ROUNDS: usize = 3;
/// So many where rows are predicted badly and each round leaves no more than a part of what the one before did.
const MOST_ROUNDS: usize = 9;
const FALLING: f64 = 0.7;
/// The first round of a search that may come to nothing tries every so many of the bandwidths.
const SPARSE: usize = 2;
/// The part of the error of predicting rows that may be left where hardly a row is within the noise for a constant to change: without the equations near a
/// row curves leave .02 to .25 of it where it does, with a friction or a drag missing as well, .35 and more where a friction is followed as if a damping
/// changed, and .9 where an angle was low-passed or a torque is late.
pub(crate) const EXPLAINED: f64 = 0.3;
/// The part of what those curves leave that curves with all equations may leave.
const FAR_LESS: f64 = 0.5;
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

/// Whether another round is not worth its time after so many, the last of which changed the error of predicting rows.
fn is_enough(round: usize, (before, error): (Option<f64>, f64)) -> bool {
    let is_falling = error >= NOISE_MODEL_FAILS && before.is_some_and(|before| error < FALLING * before);
    round >= if is_falling { MOST_ROUNDS } else { ROUNDS }
}

/// Estimates slow coefficients, or returns `None` if they are not determined. `first` is the length of windows to begin with.
///
/// Where rows are predicted badly it is not known whether the coefficients move so quickly that no curve without the equations near a row can follow them:
/// curves with all equations are compared, too. They follow half of whatever is missing, so they stand only where they leave far less than others, which show
/// that something changes, or else next to nothing.
pub(crate) fn find(
    search: &SlowSearch<'_>,
    first: Scale,
    stages: &mut Stages<'_, '_>,
) -> Result<Option<SlowCoefficients>, Error> {
    let both = [PredictedBy::OtherEquations, PredictedBy::AllEquations];
    let ways = if search.is_lost() { &both[..] } else { &both[..1] };
    let scale = search.next_length(first, most_rows(search), search.model.layout());
    // The equations of the first round are the same whatever compares bandwidths.
    let mut begun = curves(search, (None, scale, None), ways, stages)?.into_iter();
    let found = find_by((search, both[0]), (scale, begun.next()), stages)?;
    let is_told = found.as_ref().is_some_and(|found| found.error < NOISE_MODEL_FAILS);
    if is_told || !search.is_lost() {
        return Ok(found);
    }
    // A first round that leaves more than constants do comes to nothing.
    let worth = SlowSearch { hopeless: search.hopeless.min(search.before), ..*search };
    let quick = find_by((&worth, both[1]), (scale, begun.next()), stages)?;
    let by_others = found.as_ref().map_or(f64::INFINITY, |found| found.error);
    let is_followed = by_others < EXPLAINED * search.before;
    let stands = |quick: f64| quick < FAR_LESS * by_others && (is_followed || quick < LEFT_WHERE_LOST * search.before);
    Ok(quick.filter(|quick| stands(quick.error)).or(found))
}

/// Rows that windows of a search span at most.
fn most_rows(search: &SlowSearch<'_>) -> usize {
    let &SlowSearch { rows, breaks, longest, .. } = search;
    let ends = breaks.iter().copied().chain([rows.len()]);
    // A jump may lie behind the last row.
    let stretches = std::iter::once(0).chain(breaks.iter().copied()).zip(ends);
    let shortest = stretches.filter_map(|(start, end)| end.checked_sub(start)).min();
    (shortest.unwrap_or(0) / STRETCH).min(longest.unwrap_or(usize::MAX))
}

/// Bandwidths that are tried beside windows of a length.
fn reaches(search: &SlowSearch<'_>, scale: Scale) -> Vec<f64> {
    within(hole(scale), search.rows.len() as f64)
}

/// The curves of a round with windows of a length, by each way to compare them; none if they are not determined. `last` is the last round's bandwidth.
fn curves(
    search: &SlowSearch<'_>,
    (found, scale, last): (Option<&SlowCoefficients>, Scale, Option<f64>),
    ways: &[PredictedBy],
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<BestCurve>, Error> {
    let &SlowSearch { rows, model, coefficients, noise, expected, breaks, instructions, .. } = search;
    let current = found.map(|found| &found.varying);
    let rhs = found.map_or(&rows.rhs, |found| &found.rhs);
    let model = Model { taken: found.map_or_else(Vec::new, |found| found.taken.clone()), ..model.clone() };
    let problem = model.problem(rows, rhs, noise, None);
    // Windows on both sides of a row that are too short to predict it compare nothing: the first bandwidth stands.
    let compares = scale.predicts(problem.layout);
    let fit = if compares {
        Fit::with_leave_gap_out(&problem, scale, expected, instructions, stages)?
    } else {
        Fit::new(&problem, Some(scale), expected, instructions, stages)?
    };
    let Some(fit) = fit else { return Ok(Vec::new()) };
    let ones = vec![1.0; fit.full.len()];
    let weights = if current.is_some() { &fit.pooled.weights } else { &ones };
    let slow = &model.constant[..coefficients];
    let companions = slow.iter().map(|&one| rows.regressors[one].companion.as_slice()).collect();
    let equations = Slow { fit: &fit, coefficients, companions, current, weights, rows: rows.len(), breaks };
    let reaches = reaches(search, scale);
    // Where a search may come to nothing its first round need only come near: the next ones look around what it found.
    let is_near_enough = search.is_lost() && found.is_none();
    let every = if is_near_enough { SPARSE } else { 1 };
    let rows = if is_near_enough { Compare::Some } else { Compare::Most };
    let bandwidths = Bandwidths { reaches: &reaches, every, last, ways, compares, rows };
    search.best_curves(&equations, &problem, scale, &bandwidths, stages)
}

/// Estimates them with bandwidths that are compared in one way. The curve of the first round is known.
fn find_by(
    (search, compared): (&SlowSearch<'_>, PredictedBy),
    (mut scale, first): (Scale, Option<BestCurve>),
    stages: &mut Stages<'_, '_>,
) -> Result<Option<SlowCoefficients>, Error> {
    let &SlowSearch { rows, model, coefficients, noise, scales, .. } = search;
    let (slow, rest) = model.constant.split_at(coefficients);
    let rest = Model { constant: rest.to_vec(), ..model.clone() };
    let mut most = most_rows(search);
    let mut found: Option<SlowCoefficients> = None;
    let mut without_near: Option<(Varying, f64)> = None;
    let mut few = FewRows::of(rows, scales);
    let mut next = first;
    for round in 1.. {
        let before = found.as_ref().map(|found| found.error);
        let Some(BestCurve { terms, curves: [leave_gap_out, varying], reach, excess }) = next else { return Ok(None) };
        let reach = reach.min(rows.len() as f64 / 2.0);
        let last = (terms > 1).then_some(reach);
        if last.is_some() && last == reaches(search, scale).first().copied() {
            // Shorter bandwidths need shorter windows.
            most = most.min(scale.span() / 2);
        }
        let rhs = without(rows, &rows.rhs, slow, &varying);
        let taken = varying.levels(slow);
        let rest = Model { taken: taken.clone(), ..rest.clone() };
        let problem = rest.problem(rows, &rhs, noise, None);
        let scale_before = found.as_ref().map(|found| found.scale);
        let best = search.best_length(&problem, (&rest, scale_before), &mut few, stages)?;
        let Some((best, error)) = best else { return Ok(None) };
        let error = error - excess;
        let is_settled = found.as_ref().is_some_and(|found| {
            let chosen = (found.scale, found.equations_of, found.reach, found.terms);
            chosen == (best, scale, reach, terms) && (error - found.error).abs() <= SETTLED * error
        });
        if before.is_some_and(|before| error >= NOISE_MODEL_FAILS && error > before) {
            // Rounds that leave more and more come to nothing.
            break;
        }
        let is_last = is_settled || error > search.hopeless || is_enough(round, (before, error));
        found = Some(SlowCoefficients {
            varying,
            rhs,
            taken,
            scale: best,
            equations_of: scale,
            error,
            predicted: error,
            reach,
            terms,
        });
        without_near = Some((leave_gap_out, excess));
        if is_last {
            break;
        }
        scale = search.next_length(best, most, model.layout());
        next = curves(search, (found.as_ref(), scale, last), &[compared], stages)?.pop();
    }
    if let (Some(found), Some(curve)) = (&mut found, without_near)
        && !rows.jumps.is_empty()
    {
        found.predicted = predicted(search, found, curve, stages)?;
    }
    Ok(found)
}

/// The error of predicting rows with a curve from equations without them, as noise of that excess over what is expected leaves it.
fn predicted(
    search: &SlowSearch<'_>,
    found: &SlowCoefficients,
    (curve, excess): (Varying, f64),
    stages: &mut Stages<'_, '_>,
) -> Result<f64, Error> {
    let &SlowSearch { rows, model, coefficients, noise, expected, scales, instructions, .. } = search;
    let (slow, rest) = model.constant.split_at(coefficients);
    let rest = Model { constant: rest.to_vec(), taken: found.taken.clone(), ..model.clone() };
    let rhs = without(rows, &rows.rhs, slow, &curve);
    let problem = rest.problem(rows, &rhs, noise, None);
    let fit = Fit::with_leave_gap_out(&problem, found.scale, expected, instructions, stages)?;
    let rows = ComparedRows::new(&problem, scales, LargestSquare::Growing);
    let error = fit.map_or(f64::INFINITY, |fit| rows.error(&problem, found.scale, &fit, expected.variance));
    Ok(error - excess)
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
        swinging(1.0, row)
    }

    /// The same with so many cycles in the record.
    fn swinging(cycles: f64, row: f64) -> [f64; 2] {
        let pace = 2.0 * std::f64::consts::PI * cycles / ROWS as f64;
        [CONSTANTS[0] + 0.5 * (pace * row).sin(), 0.5 * pace / PERIOD * (pace * row).cos()]
    }

    fn changing() -> Rows {
        changing_by(1.0, DEVIATION)
    }

    fn changing_by(cycles: f64, deviation: f64) -> Rows {
        let mut rows = rows(ROWS, |time| [(0.05 * time).sin(), 0.05 * (0.05 * time).cos()], deviation);
        for row in 0..ROWS {
            let ([value, rate], regressor) = (swinging(cycles, row as f64), &rows.regressors[1]);
            rows.rhs[row] += (value - CONSTANTS[0]) * regressor.value[row] + rate * regressor.companion[row];
        }
        rows
    }

    fn search<'a>(rows: &'a Rows, model: &'a Model, scales: &'a [Scale]) -> SlowSearch<'a> {
        SlowSearch::simulated(rows, model, scales, DEVIATION)
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
    fn curves_with_all_equations_stand_only_where_they_leave_next_to_nothing_of_what_constants_do() {
        let (scales, model) = (Scale::all(ROWS, 3), model());
        let found = |cycles: f64, before: f64| {
            let (rows, expected) = (changing_by(cycles, 1e-2), white(1e-4));
            let search = SlowSearch { expected, before, ..search(&rows, &model, &scales) };
            staged(|stages| find(&search, scales[2], stages)).expect("a curve")
        };
        // Of what changes within windows others leave nearly all.
        let [quick, half, other] = [1e4, 100.0, 1.0].map(|before| found(40.0, before));
        // Few bandwidths, compared by some rows, come near all of them.
        assert!((half.error / other.error - 1.0).abs() < 2.0 * SETTLED, "{} {}", half.error, other.error);
        assert!(
            quick.error < LEFT_WHERE_LOST * other.error && quick.reach < other.reach,
            "{} {}",
            quick.error,
            other.error
        );
        // What others follow is told by them.
        assert_eq!(found(3.0, 1e4).error.to_bits(), found(3.0, 1.0).error.to_bits());
    }

    #[test]
    fn more_rounds_are_worth_it_only_where_rows_are_predicted_badly_and_each_leaves_far_less() {
        for (before, error, enough) in
            [(None, 1e3, 3), (Some(1.2), 1.0, 3), (Some(1e3), 800.0, 3), (Some(1e3), 500.0, 9)]
        {
            assert_eq!((1..20).find(|&round| is_enough(round, (before, error))), Some(enough), "{before:?} {error}");
        }
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
