//! Windowed and slowly varying coefficients with their standard errors, combined at every row.

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::results::RowResults;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::report::errors::Errors;
use crate::identify::weak::report::tracks::Tracks;
use crate::identify::weak::report::window_sums::WindowSums;
use crate::identify::weak::session::Session;
use crate::noise::median::median;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::layout::symmetric;
use crate::regression::limits::{NOISE_MODEL_FAILS, UNEXPLAINED};
use crate::regression::magnitudes::Magnitudes;
use crate::regression::predictor::without_constants;
use crate::regression::problem::Problem;
use crate::regression::sandwich::joint_covariance;
use crate::status::Status;
use crate::weak_form::weak_rows::WeakRows;

/// The squares of independent rows of a window, over the noise's variance, add up to more than this by no chance.
const BEYOND_CHANCE: f64 = 60.0;

/// Rows that are looked at for what all rows have in common.
const LOOKED_AT: usize = 1024;

/// Standard errors and covariances by row, and what holds for all rows.
type ErrorsAtRows = (Vec<Vec<f64>>, Vec<Vec<f64>>, OfAllRows);

/// What holds for the errors of all rows.
pub(crate) struct OfAllRows {
    /// Pairs of unknowns whose covariances there are.
    pub(crate) pairs: Vec<(usize, usize)>,
    /// By unknown: the part of its variance that all rows have in common.
    pub(crate) in_common: Vec<f64>,
}

/// What was found of a record before its rows are put together.
pub(crate) struct Fitted<'a> {
    pub(crate) weak: &'a WeakRows,
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) decided: &'a Decided,
    /// The fit of all unknowns that do not belong to windows.
    pub(crate) all: &'a Fit,
    pub(crate) errors: &'a Errors,
    /// Covariance and values of the constants, those that change slowly first.
    pub(crate) covariance: &'a [f64],
    /// What all of them may be wrong by together all along the record, for one reason and for another; each is part of the covariance.
    pub(crate) changes: &'a [&'a [f64]],
    pub(crate) constants: &'a [f64],
}

impl Session<'_, '_, '_> {
    /// Puts together time-varying parameters and their errors.
    pub(crate) fn at_rows(&mut self, fitted: &Fitted<'_>, tracks: Tracks) -> Result<(RowResults, OfAllRows), Error> {
        let Fitted { weak, problem, decided, all, constants, .. } = *fitted;
        let slow = decided.slow.len();
        // Residuals are those of the rows as they are, whose unit is the torque's.
        let (ordered, rows) = (decided.ordered(), &weak.rows);
        let plain = decided.white.as_ref().map(|_| ordered.problem(rows, &rows.rhs, self.noise[0], None));
        let plain = plain.as_ref().unwrap_or(problem);
        let left = LeftInWindows::new(plain, &tracks, constants, all.span, &mut self.stages)?;
        let mut slowly = vec![vec![0.0; tracks.status.len()]; 2 * slow];
        if let Some(found) = &decided.found {
            self.stages.fill(&mut slowly, |places, columns| {
                let (values, slopes) = columns.split_at_mut(slow);
                for (coefficient, (values, slopes)) in values.iter_mut().zip(slopes).enumerate() {
                    for (place, (value, slope)) in places.clone().zip(values.iter_mut().zip(slopes.iter_mut())) {
                        (*value, *slope) = found.varying.at(coefficient, tracks.row(place));
                    }
                }
            })?;
        }
        let slow_slopes = slowly.split_off(slow);
        let (mut errors, mut covariances, of_all) = self.errors_at_rows(fitted, &tracks)?;
        let Tracks { first, values, slopes, condition, mut status, .. } = tracks;
        let untold = Magnitudes::new(plain, constants).untold(&errors[..problem.layout.windowed], weak.reach());
        for (status, _) in status.iter_mut().zip(untold).filter(|(_, untold)| *untold) {
            *status |= Status::ILL_CONDITIONED.bits();
        }
        let least = UNEXPLAINED * rows.mean_square();
        for (place, factor) in left.unexplained(least, &fitted.errors.expected) {
            status[place] |= Status::NOISE_MODEL.bits();
            for errors in &mut errors {
                errors[place] *= factor;
            }
            // The second of a pair changes, too; the first may be a constant.
            for (&(one, _), covariances) in of_all.pairs.iter().zip(&mut covariances) {
                let constant = decided.model.constant.contains(&one);
                covariances[place] *= if constant { factor } else { factor * factor };
            }
        }
        let results = RowResults {
            first: weak.first as f64 + first as f64 * weak.stride as f64,
            stride: weak.stride as f64,
            values: values.into_iter().chain(slowly).collect(),
            slopes: slopes.into_iter().chain(slow_slopes).collect(),
            errors,
            covariances,
            deviation: left.deviation,
            condition,
            status,
            jumps: decided.jumps.clone(),
        };
        Ok((results, of_all))
    }

    /// By slow coefficient: the variance that noise gives it where equations are said to determine it to a variance of one, over its variance as
    /// a constant of the whole record.
    fn variances_of_slow(&mut self, fitted: &Fitted<'_>) -> Result<Vec<f64>, Error> {
        let Fitted { problem, decided, all, errors, .. } = *fitted;
        let count = problem.layout.constant;
        let Some(found) = &decided.found else { return Ok(Vec::new()) };
        let mut variances: Vec<f64> =
            (0..decided.slow.len()).map(|place| all.pooled.inverse[place * (count + 1)].recip()).collect();
        if all.scale.is_none_or(|scale| scale == found.equations_of) {
            return Ok(variances);
        }
        // They come from windows of another length than the constants beside them, each row of which counts in another number of them.
        let (instructions, stages) = (self.options.instructions, &mut self.stages);
        let own = Fit::new(problem, Some(found.equations_of), errors.expected, instructions, stages)?;
        let Some(own) = own else { return Ok(variances) };
        for (place, variance) in variances.iter_mut().enumerate() {
            let of = |fit: &Fit, stages: &mut _| fit.variance_of(problem, place, &errors.covariance, stages);
            let ratio = of(&own, &mut self.stages)? / of(all, &mut self.stages)?;
            if ratio.is_finite() {
                *variance = ratio / own.pooled.inverse[place * (count + 1)];
            }
        }
        Ok(variances)
    }

    /// Standard errors of time-varying parameters and covariances of pairs of coefficients.
    fn errors_at_rows(&mut self, fitted: &Fitted<'_>, tracks: &Tracks) -> Result<ErrorsAtRows, Error> {
        let Fitted { problem, decided, errors, covariance, changes, .. } = *fitted;
        let count = problem.layout.constant;
        let (windowed, slow) = (problem.layout.windowed, decided.slow.len());
        let column = || vec![0.0; tracks.status.len()];
        // A slow coefficient is taken from a part of the record only, so its error is larger.
        let equations = self.variances_of_slow(fitted)?;
        let share = |constant: usize, place: usize| match &decided.found {
            Some(found) if constant < slow => {
                (found.varying.variance(constant, tracks.row(place)) * equations[constant]).sqrt()
            }
            _ => 1.0,
        };
        let between = |one: usize, other: usize, place: usize| {
            let everywhere: f64 = changes.iter().map(|changes| changes[one] * changes[other]).sum();
            share(one, place) * share(other, place) * (covariance[one * count + other] - everywhere) + everywhere
        };
        let sensitive =
            |unknown: usize, constant: usize, place: usize| tracks.sensitivities[unknown * count + constant][place];
        let covariance = |one: usize, other: usize, place: usize| {
            let own = |one, other| tracks.covariances[symmetric(one, other)][place] * errors.inflation;
            let sensitive = |unknown, constant| sensitive(unknown, constant, place);
            joint_covariance([one, other], [windowed, count], own, sensitive, |i, j| between(i, j, place))
        };
        let names: Vec<usize> =
            decided.model.windowed.iter().chain(&decided.slow).chain(&decided.model.constant).copied().collect();
        let changing = windowed + slow;
        let all_pairs = (0..names.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
        let wanted = |&(one, other): &(usize, usize)| other < changing && names[one] < 3 && names[other] < 3;
        let pairs: Vec<_> = all_pairs.filter(wanted).collect();
        let (mut standard, mut covariances) = (vec![column(); changing], vec![column(); pairs.len()]);
        self.stages.fill(standard.iter_mut().chain(&mut covariances), |places, columns| {
            let (errors, covariances) = columns.split_at_mut(changing);
            for (one, errors) in errors.iter_mut().enumerate() {
                for (place, error) in places.clone().zip(errors.iter_mut()) {
                    let variance = covariance(one, one, place);
                    // Rounding may leave less than nothing; what is NaN stays NaN.
                    *error = if variance < 0.0 { 0.0 } else { variance.sqrt() };
                }
            }
            for (&(one, other), covariances) in pairs.iter().zip(covariances) {
                places
                    .clone()
                    .zip(covariances.iter_mut())
                    .for_each(|(place, entry)| *entry = covariance(one, other, place));
            }
        })?;
        let part = |one: usize| {
            let step = tracks.status.len().div_ceil(LOOKED_AT).max(1);
            let own = |place: usize| tracks.covariances[symmetric(one, one)][place] * errors.inflation;
            let parts =
                (0..tracks.status.len()).step_by(step).map(|place| 1.0 - own(place) / covariance(one, one, place));
            median(&mut parts.filter(|part| part.is_finite()).collect::<Vec<_>>())
                .map_or(1.0, |part| part.clamp(0.0, 1.0))
        };
        // All of a slow coefficient follows from a few numbers.
        let in_common = (0..changing).map(|one| if one < windowed { part(one) } else { 1.0 }).collect();
        let pairs = pairs.into_iter().map(|(one, other)| (names[one], names[other])).collect();
        Ok((standard, covariances, OfAllRows { pairs, in_common }))
    }
}

/// What is left in the window around each place.
struct LeftInWindows {
    /// Standard deviation, NaN where nothing is known.
    deviation: Vec<f64>,
    /// Rows that it is made of.
    rows: Vec<f64>,
}

impl LeftInWindows {
    fn new(
        problem: &Problem<'_>,
        tracks: &Tracks,
        constants: &[f64],
        span: usize,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Self, Error> {
        let mut errors = without_constants(problem, constants);
        stages.fill([&mut errors], |rows, columns| {
            for (row, error) in rows.zip(&mut *columns[0]) {
                let place = (row.cast_signed() - tracks.first).unsigned_abs();
                for unknown in 0..problem.layout.windowed {
                    *error -= tracks.values[unknown][place] * problem.windowed[unknown][row];
                    if problem.layout.linear {
                        *error -= tracks.slopes[unknown][place] / problem.period * problem.companions[unknown][row];
                    }
                }
            }
        })?;
        let counted = errors
            .iter()
            .zip(problem.usable)
            .map(|(error, &usable)| if usable && error.is_finite() { [error * error, 1.0] } else { [0.0, 0.0] });
        let counted: Vec<_> = counted.collect();
        drop(errors);
        let between = BetweenJumps::new(&counted, problem.jumps, span);
        let sums = WindowSums::new(counted, span);
        let samples = tracks.status.len();
        let mut left = Self { deviation: vec![f64::NAN; samples], rows: vec![0.0; samples] };
        stages.fill([&mut left.deviation, &mut left.rows], |places, columns| {
            for (index, place) in places.enumerate() {
                let row = (tracks.first + place.cast_signed()).max(0).unsigned_abs();
                let of_part = between.around(row);
                // All rows between two jumps may lie over one of them.
                let [sum, count] = if of_part[1] > 0.0 { of_part } else { sums.around(row) };
                if count > 0.0 {
                    columns[0][index] = (sum / count).sqrt();
                    columns[1][index] = count;
                }
            }
        })?;
        Ok(left)
    }

    /// Places whose windows leave so much more than the usual one, and than is expected, that neither the noise nor chance explains it, and how many
    /// times the usual standard deviation: a touch, or a change that no window follows. What is next to nothing of the torque is not worth a word.
    fn unexplained(&self, least: f64, expected: &Expected) -> Vec<(usize, f64)> {
        let mut known: Vec<f64> = self.deviation.iter().copied().filter(|deviation| deviation.is_finite()).collect();
        let Some(usual) = median(&mut known) else { return Vec::new() };
        let explained = expected.variance.max(usual * usual);
        let places = self.deviation.iter().zip(&self.rows).enumerate();
        let far = places.filter(|&(_, (deviation, rows))| {
            let most = NOISE_MODEL_FAILS.max(BEYOND_CHANCE * expected.variance_inflation / rows) * explained;
            deviation.powi(2) > most.max(least)
        });
        far.map(|(place, (deviation, _))| (place, deviation / usual)).filter(|(_, factor)| factor.is_finite()).collect()
    }
}

/// Sums over windows that end at jumps; nothing without jumps.
struct BetweenJumps<'a> {
    jumps: &'a [usize],
    sums: Vec<WindowSums<2>>,
}

impl<'a> BetweenJumps<'a> {
    fn new(rows: &[[f64; 2]], jumps: &'a [usize], span: usize) -> Self {
        let ends = jumps.iter().copied().chain([rows.len()]);
        let begins = std::iter::once(0).chain(jumps.iter().copied());
        let parts = begins.zip(ends).filter(|_| !jumps.is_empty());
        Self { jumps, sums: parts.map(|(begin, end)| WindowSums::new(rows[begin..end].to_vec(), span)).collect() }
    }

    fn around(&self, row: usize) -> [f64; 2] {
        let place = self.jumps.partition_point(|&jump| jump <= row);
        let begin = if place == 0 { 0 } else { self.jumps[place - 1] };
        self.sums.get(place).map_or([0.0; 2], |sums| sums.around(row - begin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_end_at_jumps() {
        let rows: Vec<[f64; 2]> = (0..10).map(|row| [f64::from(row), 1.0]).collect();
        let between = BetweenJumps::new(&rows, &[4, 6], 5);
        assert_eq!(
            [0, 3, 4, 5, 6, 9].map(|row| between.around(row)),
            [[3.0, 3.0], [6.0, 3.0], [9.0, 2.0], [9.0, 2.0], [21.0, 3.0], [24.0, 3.0],]
        );
        assert_eq!(BetweenJumps::new(&rows, &[], 5).around(3), [0.0; 2]);
    }

    #[test]
    fn what_chance_explains_or_is_next_to_nothing_is_explained() {
        let expected = |variance: f64, variance_inflation: f64| Expected { variance, torque: 0.0, variance_inflation };
        let deviation = vec![1.0, 1.0, 1.5, f64::NAN, 3.0, 1.0, 1.0];
        let left = LeftInWindows { rows: vec![30.0; deviation.len()], deviation };
        assert_eq!(left.unexplained(0.0, &expected(1.0, 1.0)), [(4, 3.0)]);
        assert_eq!(left.unexplained(10.0, &expected(1.0, 1.0)), []);
        // Two independent rows leave nine times as much by chance.
        assert_eq!(left.unexplained(0.0, &expected(1.0, 15.0)), []);
        // The noise of the channels explains all of it.
        assert_eq!(left.unexplained(0.0, &expected(9.0, 1.0)), []);
        let few = LeftInWindows { rows: vec![2.0; left.rows.len()], ..left };
        assert_eq!(few.unexplained(0.0, &expected(1.0, 1.0)), []);
        let unknown = LeftInWindows { deviation: vec![f64::NAN], rows: vec![0.0] };
        assert_eq!(unknown.unexplained(0.0, &expected(1.0, 1.0)), []);
    }
}
