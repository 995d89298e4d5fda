//! What is said of a record once it is decided what changes: values at every sample, their errors, and what looks wrong.

use std::borrow::Cow;
use std::sync::Arc;

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::results::{RowResults, SampleResults};
use crate::identify::weak::decide::{Decided, rows_of};
use crate::identify::weak::outside_mask::{Inside, Outside};
use crate::identify::weak::session::{Chosen, Constant, Session, WeakIdentified};
use crate::inference::constancy::NO_CHANCE;
use crate::inference::identifiability::is_mostly_noise;
use crate::inference::missing_terms::{JudgedTerm, Missing, Suspect};
use crate::inference::window_averaging::average;
use crate::record::derived::{Cubed, VelocitySign};
use crate::regression::centred_windows::every_window;
use crate::regression::constants::{Expected, weakest};
use crate::regression::fit::Fit;
use crate::regression::limits::{HARDLY_TOLD_APART, NOISE_MODEL_FAILS};
use crate::regression::predictor::without_constants;
use crate::regression::problem::Problem;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::sandwich::joint_covariance;
use crate::regression::solved::{is_determined, sensitivity};
use crate::regression::subsample::{holds, stretches_of_rows, thinned_column, thinned_rows};
use crate::status::Status;
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

/// A correlation of the residuals beyond the reach of a test function that no white noise shows, at least.
const COLOURED: f64 = 0.15;

/// How errors are made.
struct Errors {
    covariance: RowCovariance,
    expected: Expected,
    /// What variances are multiplied by.
    inflation: f64,
    /// Mean squared error of predicting rows, or of what is left of them where nothing is windowed, over the noise's variance.
    error: f64,
    /// What is wrong with the noise.
    status: Status,
}

/// What changes, at rows from `first` on, whatever it was taken from.
struct Tracks {
    first: isize,
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
    /// Covariances for given constants, the lower half row by row.
    covariances: Vec<Vec<f64>>,
    sensitivities: Vec<Vec<f64>>,
    condition: Vec<f64>,
    status: Vec<u16>,
}

impl Tracks {
    /// Marks rows that are no equations, and those outside the mask where the model fails.
    fn mark(&mut self, usable: &[bool], outside: Option<&Outside>) {
        let first = self.first;
        let mut flag = |row: usize, status: Status| {
            self.status[(row.cast_signed() - first).unsigned_abs()] |= status.bits();
        };
        (0..usable.len()).filter(|&row| !usable[row]).for_each(|row| flag(row, Status::GAP));
        for &row in outside.iter().filter(|outside| outside.fails()).flat_map(|outside| &outside.rows) {
            flag(row, Status::NOISE_MODEL);
        }
    }
}

impl Session<'_, '_, '_> {
    pub(crate) fn report(&mut self, chosen: Chosen, decided: &Decided) -> Result<WeakIdentified, Error> {
        let Chosen { mut weak, at_end, .. } = chosen;
        let stride = weak.stride;
        let ordered = decided.ordered();
        let mut found = WeakIdentified {
            function: weak.function,
            noise: self.noise,
            equations: 0,
            lengths: decided.lengths.clone(),
            prediction_error: decided.error,
            weighted: decided.white.is_some(),
            pooling: decided.found.as_ref().map(|found| 2.0 * found.reach * stride as f64),
            constants: Vec::new(),
            covariance: Vec::new(),
            condition: f64::INFINITY,
            weakest: Vec::new(),
            mostly_noise: false,
            suspects: Vec::new(),
            lag: None,
            outside_mask: None,
            changing: decided.model.windowed.iter().chain(&decided.slow).copied().collect(),
            constant_pairs: Vec::new(),
            pairs: Vec::new(),
            jumps: decided.jumps.iter().map(|jump| jump.sample).collect(),
            results: SampleResults::default(),
        };
        let Some(fit) = &decided.fit else { return Ok(self.undetermined(found, decided)) };
        let given = self.options.equations.filter(|_| !self.options.average);
        found.equations = given.unwrap_or(fit.span * stride).min(self.record.angle.len());
        let errors = self.errors(&weak, decided, fit)?;
        found.prediction_error = errors.error;
        let rows = decided.rows(&weak.rows);
        let correlated = match &decided.correlated {
            Some(correlated) if errors.covariance == decided.covariance => Arc::clone(correlated),
            _ => ordered.correlated(rows, &errors.covariance, &mut self.stages)?,
        };
        let problem = ordered.problem(rows, decided.rhs(rows), self.noise[0], Some(&correlated));
        let all = self.all_unknowns(&problem, decided, fit, &errors)?;
        let Some(all) = all.as_deref() else { return Ok(self.undetermined(found, decided)) };
        found.condition = all.pooled.condition;
        found.weakest = weakest(&all.full, &all.pooled.weights);
        found.covariance = all.covariance(&problem, &errors.covariance, &mut self.stages)?;
        let (rhs, expected) = (decided.rhs(rows), errors.expected);
        if let Some(covariance) =
            self.covariance_beside_lag(rows, &ordered, rhs, fit, expected, (&errors.covariance, &correlated))?
        {
            found.covariance = covariance;
        }
        found.covariance.iter_mut().for_each(|entry| *entry *= errors.inflation);

        let slow = decided.slow.len();
        let count = ordered.constant.len();
        let mut values = vec![0.0; slow];
        values.extend(&fit.pooled.values);
        for (place, &unknown) in decided.model.constant.iter().enumerate() {
            let test = decided.tests.iter().find(|(one, _)| *one == unknown).map(|(_, test)| test.clone());
            let variance = found.covariance[(place + slow) * (count + 1)];
            found.constants.push(Constant { unknown, value: values[place + slow], error: variance.sqrt(), test });
        }
        found.constant_pairs = pairs_of(&ordered.constant, slow, &found.covariance);
        let mut status = errors.status;
        let contradicted = |one: &Constant| one.test.as_ref().is_some_and(|test| test.probability < NO_CHANCE);
        if found.constants.iter().any(contradicted) {
            status |= Status::KIND_CONTRADICTED;
        }
        if at_end || decided.scales.first().is_some_and(|first| Some(*first) == fit.scale) && decided.scales.len() > 1 {
            status |= Status::WINDOW_LIMIT;
        }
        let weakest = &found.weakest;
        let noise = self.noise[0];
        found.mostly_noise = is_mostly_noise(&problem, rows, &ordered, all, weakest, noise, &mut self.stages)?;
        if found.condition > HARDLY_TOLD_APART || found.mostly_noise {
            status |= Status::ILL_CONDITIONED;
        }
        let mut tracks = self.tracks(&problem, &weak, decided, (fit, all), &values, errors.expected)?;
        let variances: Vec<f64> = (slow..count).map(|place| found.covariance[place * (count + 1)]).collect();
        let outside = self.outside_mask(
            &weak,
            &Inside {
                decided,
                fit,
                constants: &values[slow..],
                variances: &variances,
                covariance: &errors.covariance,
                expected: errors.expected,
                inflation: errors.inflation,
            },
        )?;
        let usable = &decided.whole.as_ref().unwrap_or(&weak.rows).usable;
        tracks.mark(usable, outside.as_ref());
        found.outside_mask = outside;
        let results = self.rows_results(&weak, &problem, decided, all, &errors, tracks, &found.covariance, &values)?;
        let (results, pairs) = results;
        found.pairs = pairs;
        let rhs = decided.rhs(&weak.rows).to_vec();
        found.suspects = self.suspects(&mut weak, decided, fit, &rhs, &errors)?;
        for suspect in found.suspects.iter().filter(|suspect| suspect.is_conspicuous()) {
            status |= if suspect.missing == Missing::Lag { Status::LAG_SUSPECTED } else { Status::TERM_SUSPECTED };
        }
        found.results = results.at_samples(self.record.angle.len(), self.options.step, &mut self.stages)?;
        found.results.status.iter_mut().for_each(|one| *one |= status.bits());
        Ok(found)
    }

    /// The fit of all unknowns that do not belong to windows. The one at hand is, unless some change slowly or the noise fails to explain what
    /// is left of the rows.
    fn all_unknowns<'a>(
        &mut self,
        problem: &Problem<'_>,
        decided: &Decided,
        fit: &'a Fit,
        errors: &Errors,
    ) -> Result<Option<Cow<'a, Fit>>, Error> {
        if decided.slow.is_empty() && errors.covariance == decided.covariance {
            return Ok(Some(Cow::Borrowed(fit)));
        }
        let again = fit.again(problem, errors.expected, self.options.instructions, &mut self.stages)?;
        Ok(again.map(Cow::Owned))
    }

    /// Nothing but a status.
    fn undetermined(&self, mut found: WeakIdentified, decided: &Decided) -> WeakIdentified {
        let elements = self.record.angle.len().div_ceil(self.options.step);
        for &unknown in &decided.model.constant {
            found.constants.push(Constant { unknown, value: f64::NAN, error: f64::NAN, test: None });
        }
        found.results = SampleResults::undetermined(found.changing.len(), elements);
        found
    }

    /// The covariance that errors are made from: that of the channels' noise, or where it fails to explain the residuals, theirs.
    fn errors(&mut self, weak: &WeakRows, decided: &Decided, fit: &Fit) -> Result<Errors, Error> {
        let mut errors = Errors {
            covariance: decided.covariance.clone(),
            expected: decided.expected,
            inflation: decided.error.max(1.0),
            error: decided.error,
            status: Status::GOOD,
        };
        let (shown, coloured) = self.shown(weak, decided, fit)?;
        if coloured {
            errors.status |= Status::COLOURED;
        }
        let whole = decided.model.windowed.is_empty();
        errors.error = if whole { shown.variance() / errors.expected.variance } else { decided.error };
        if whole {
            errors.inflation = errors.error.max(1.0);
        }
        if errors.error > NOISE_MODEL_FAILS {
            errors.status |= Status::NOISE_MODEL;
            errors.inflation = 1.0;
            errors.expected = Expected::new(&shown, shown.variance());
            errors.covariance = shown;
        }
        Ok(errors)
    }

    /// The covariance that the residuals of a fit show, and whether they are correlated where rows share no sample.
    pub(crate) fn shown(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        fit: &Fit,
    ) -> Result<(RowCovariance, bool), Error> {
        let rows = decided.rows(&weak.rows);
        let problem = decided.model.problem(rows, decided.rhs(rows), self.noise[0], None);
        let (residuals, usable) = residuals(&problem, fit, &mut self.stages)?;
        let reach = 2 * weak.reach();
        let shown = RowCovariance::of_residuals(&residuals, &usable, 2 * reach);
        let coloured = shown.is_coloured(reach, COLOURED, usable.iter().filter(|usable| **usable).count());
        Ok((shown, coloured))
    }

    /// What changes, at every row.
    fn tracks(
        &mut self,
        problem: &Problem<'_>,
        weak: &WeakRows,
        decided: &Decided,
        (fit, all): (&Fit, &Fit),
        constants: &[f64],
        expected: Expected,
    ) -> Result<Tracks, Error> {
        let rows = &weak.rows;
        let instructions = self.options.instructions;
        let windowed = problem.layout.windowed;
        if windowed == 0 {
            let nothing = || Vec::new();
            return Ok(Tracks {
                first: 0,
                values: nothing(),
                slopes: nothing(),
                covariances: nothing(),
                sensitivities: nothing(),
                condition: vec![1.0; rows.len()],
                status: vec![0; rows.len()],
            });
        }
        if !self.options.average {
            // Rows that would lie before and after the record have windows too, as long as half of them is there.
            let beyond = weak.first.div_ceil(weak.stride).cast_signed();
            let range = -beyond..rows.len().cast_signed() + beyond + 1;
            let (ill, stages) = (HARDLY_TOLD_APART, &mut self.stages);
            let window = self.options.equations.map_or(fit.span, |samples| rows_of(samples, weak.stride));
            let found = every_window(problem, window, range.clone(), constants, ill, instructions, stages)?;
            let slopes = found.values.iter().map(|column| vec![0.0; column.len()]).collect();
            return Ok(Tracks {
                first: range.start,
                values: found.values,
                slopes,
                covariances: found.covariances,
                sensitivities: found.sensitivities,
                condition: found.condition,
                status: found.status,
            });
        }
        let stretches = stretches_of_rows(rows.len());
        let thinned =
            stretches.map(|stretches| (thinned_rows(rows, &stretches), thinned_column(decided.rhs(rows), &stretches)));
        let ordered = decided.ordered();
        let thinned = thinned.as_ref().map(|(rows, rhs)| (rows, ordered.problem(rows, rhs, self.noise[0], None)));
        let thinned_rhs = thinned.as_ref().map_or_else(Vec::new, |(_, problem)| without_constants(problem, constants));
        let noise = self.noise[0];
        let thinned = thinned
            .as_ref()
            .map(|(rows, problem)| ordered.without_constants(rows, problem, &thinned_rhs, constants, noise));
        let rhs = without_constants(problem, constants);
        let rest = ordered.without_constants(rows, problem, &rhs, constants, noise);
        let (judged, stages) = ((expected, fit.span), &mut self.stages);
        let averages = average(&rest, thinned.as_ref(), &decided.scales, judged, instructions, stages)?;
        let names = fit.full.fields;
        let condition = fit.full.field(names.condition());
        let usable = &decided.whole.as_ref().unwrap_or(rows).usable;
        let status = (0..rows.len()).map(|row| {
            let mut status = if usable[row] { Status::GOOD } else { Status::GAP };
            if averages.values.iter().any(|column| column[row].is_nan()) {
                status |= Status::INVALID;
            }
            if condition[fit.nearest(row)] > HARDLY_TOLD_APART {
                status |= Status::ILL_CONDITIONED;
            }
            status.bits()
        });
        let status = status.collect();
        let mut covariances = Vec::new();
        for unknown in 0..windowed {
            for other in 0..=unknown {
                let squared =
                    averages.errors[unknown].iter().map(|error| if other == unknown { error * error } else { 0.0 });
                covariances.push(squared.collect());
            }
        }
        Ok(Tracks {
            first: 0,
            covariances,
            slopes: averages
                .slopes
                .iter()
                .map(|column| column.iter().map(|slope| slope * rows.period).collect())
                .collect(),
            values: averages.values,
            sensitivities: sensitivities(problem, all, &mut self.stages)?,
            condition: (0..rows.len()).map(|row| condition[fit.nearest(row)]).collect(),
            status,
        })
    }

    /// Puts together what changes and its errors.
    #[allow(clippy::too_many_arguments, reason = "all that was found")]
    fn rows_results(
        &mut self,
        weak: &WeakRows,
        problem: &Problem<'_>,
        decided: &Decided,
        all: &Fit,
        errors: &Errors,
        tracks: Tracks,
        covariance: &[f64],
        constants: &[f64],
    ) -> Result<(RowResults, Vec<(usize, usize)>), Error> {
        let count = problem.layout.constant;
        let (windowed, slow) = (problem.layout.windowed, decided.slow.len());
        let column = || vec![0.0; tracks.status.len()];
        let row_of = |place: usize| (tracks.first + place.cast_signed()) as f64;
        // Residuals are those of the rows as they are, whose unit is the torque's.
        let (ordered, rows) = (decided.ordered(), &weak.rows);
        let plain = decided.white.as_ref().map(|_| ordered.problem(rows, &rows.rhs, self.noise[0], None));
        let plain = plain.as_ref().unwrap_or(problem);
        let deviation = deviation(plain, &tracks, constants, all.span, &mut self.stages)?;
        // A slow coefficient is taken from a part of the record only, so its error is larger.
        let share = |constant: usize, place: usize| match &decided.found {
            Some(found) if constant < slow => {
                let whole = all.pooled.inverse[constant * (count + 1)];
                (found.varying.variance(constant, row_of(place)) / whole).sqrt()
            }
            _ => 1.0,
        };
        let between = |one: usize, other: usize, place: usize| {
            share(one, place) * share(other, place) * covariance[one * count + other]
        };
        let sensitive =
            |unknown: usize, constant: usize, place: usize| tracks.sensitivities[unknown * count + constant][place];
        let covariance = |one: usize, other: usize, place: usize| {
            let own = |one, other| {
                tracks.covariances[crate::regression::layout::symmetric(one, other)][place] * errors.inflation
            };
            let sensitive = |unknown, constant| sensitive(unknown, constant, place);
            joint_covariance([one, other], [windowed, count], own, sensitive, |i, j| between(i, j, place))
        };
        let mut slowly = vec![column(); 2 * slow];
        if let Some(found) = &decided.found {
            self.stages.fill(&mut slowly, |places, columns| {
                let (values, slopes) = columns.split_at_mut(slow);
                for (coefficient, (values, slopes)) in values.iter_mut().zip(slopes).enumerate() {
                    for (place, (value, slope)) in places.clone().zip(values.iter_mut().zip(slopes.iter_mut())) {
                        (*value, *slope) = found.varying.at(coefficient, row_of(place));
                    }
                }
            })?;
        }
        let slow_slopes = slowly.split_off(slow);
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
        let Tracks { first, values, slopes, condition, status, .. } = tracks;
        let results = RowResults {
            first: weak.first as f64 + first as f64 * weak.stride as f64,
            stride: weak.stride as f64,
            values: values.into_iter().chain(slowly).collect(),
            slopes: slopes.into_iter().chain(slow_slopes).collect(),
            errors: standard,
            covariances,
            deviation,
            condition,
            status,
            jumps: decided.jumps.clone(),
        };
        Ok((results, pairs.into_iter().map(|(one, other)| (names[one], names[other])).collect()))
    }

    /// Looks for what may have been left out.
    fn suspects(
        &mut self,
        weak: &mut WeakRows,
        decided: &Decided,
        fit: &Fit,
        rhs: &[f64],
        errors: &Errors,
    ) -> Result<Vec<Suspect>, Error> {
        if !self.options.diagnose {
            return Ok(Vec::new());
        }
        let (velocity, samples) = (weak.rows.regressors[1].value.clone(), self.record.angle.len());
        let cubed = Cubed(self.record.angle);
        let direction = VelocitySign { velocity: &velocity, first: weak.first, stride: weak.stride, samples };
        let all = [
            (Missing::Offset, TermSamples::One),
            (Missing::Coulomb, TermSamples::Given(&direction)),
            (Missing::Cubic, TermSamples::Given(&cubed)),
            (Missing::Lag, TermSamples::TorqueRate),
        ];
        let terms: Vec<_> =
            all.into_iter().filter(|(missing, _)| !self.options.not_missing.contains(missing)).collect();
        let record = Record { terms: terms.iter().map(|(_, samples)| *samples).collect(), ..self.record.clone() };
        let (function, delta, workers) = (weak.function, self.options.delta, self.stages.workers);
        let stretches = stretches_of_rows(weak.rows.len()).filter(|_| fit.scale.is_some_and(holds));
        let mut rhs = rhs.to_vec();
        if let Some(stretches) = &stretches {
            (weak.rows, rhs) = (thinned_rows(&weak.rows, stretches), thinned_column(&rhs, stretches));
        }
        let stretches = stretches.as_deref();
        let more = self.stages.stage(|watch| WeakRows::build(&record, function, delta, stretches, workers, watch))?;
        let first = weak.rows.regressors.len();
        weak.rows.regressors.extend(more.rows.regressors.into_iter().skip(3));
        weak.rows.clear_unusable();
        if decided.white.is_some() {
            weak.rows = decided.as_white(std::mem::take(&mut weak.rows), &mut self.stages)?;
            rhs.clone_from(&weak.rows.rhs);
        }
        let correlated = decided.model.correlated(&weak.rows, &errors.covariance, &mut self.stages)?;
        let mut suspects = Vec::new();
        for (place, (missing, _)) in terms.iter().enumerate() {
            let judged = JudgedTerm {
                rows: &weak.rows,
                model: &decided.model,
                rhs: &rhs,
                noise: self.noise[0],
                fit,
                covariance: &errors.covariance,
                correlated: &correlated,
                expected: errors.expected,
                inflation: errors.inflation,
                instructions: self.options.instructions,
            };
            if let Some((value, error)) = judged.factor(first + place, &mut self.stages)? {
                let unit = if *missing == Missing::Lag { -1.0 / self.options.delta } else { 1.0 };
                suspects.push(Suspect { missing: *missing, value: unit * value, error: unit.abs() * error });
            }
        }
        Ok(suspects)
    }
}

/// Pairs of constants, those that change slowly and come first left out, and their covariance.
fn pairs_of(constants: &[usize], slow: usize, covariance: &[f64]) -> Vec<(usize, usize, f64)> {
    let pairs = (slow..constants.len()).flat_map(|one| (slow..one).map(move |other| (one, other)));
    pairs.map(|(one, other)| (constants[one], constants[other], covariance[one * constants.len() + other])).collect()
}

/// How what is windowed changes with each constant, row by row: what the window nearest to a row says.
fn sensitivities(problem: &Problem<'_>, all: &Fit, stages: &mut Stages<'_, '_>) -> Result<Vec<Vec<f64>>, Error> {
    let layout = problem.layout;
    let determined: Vec<usize> = (0..all.full.len()).filter(|&window| is_determined(&all.full, window)).collect();
    let beside = |wanted: usize| {
        let next = determined.partition_point(|&window| window < wanted);
        let around = [next.checked_sub(1), Some(next)].into_iter().flatten();
        let around = around.filter_map(|place| determined.get(place).copied());
        around.min_by_key(|place| place.abs_diff(wanted)).unwrap_or(wanted)
    };
    let mut columns = vec![vec![0.0; problem.rows()]; layout.windowed * layout.constant];
    stages.fill(&mut columns, |rows, columns| {
        for (index, row) in rows.enumerate() {
            let wanted = all.nearest(row);
            let place = if is_determined(&all.full, wanted) { wanted } else { beside(wanted) };
            let later = (row as f64 - all.centre(place)) * problem.period;
            for (number, column) in columns.iter_mut().enumerate() {
                let (unknown, constant) = (number / layout.constant, number % layout.constant);
                column[index] = sensitivity(&all.full, place, unknown, constant, later);
            }
        }
    })?;
    Ok(columns)
}

/// Standard deviation of what is left, over windows of so many rows.
fn deviation(
    problem: &Problem<'_>,
    tracks: &Tracks,
    constants: &[f64],
    span: usize,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<f64>, Error> {
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
    let mut sums = vec![[0.0, 0.0]];
    let (mut sum, mut count) = (0.0, 0.0);
    sums.extend(errors.iter().zip(problem.usable).map(|(error, &usable)| {
        if usable && error.is_finite() {
            sum += error * error;
            count += 1.0;
        }
        [sum, count]
    }));
    let mut deviation = vec![f64::NAN; tracks.status.len()];
    stages.fill([&mut deviation], |places, columns| {
        for (place, deviation) in places.zip(&mut *columns[0]) {
            let row = (tracks.first + place.cast_signed()).max(0).unsigned_abs();
            let rows = errors.len();
            let (first, end) = (row.saturating_sub(span / 2).min(rows), (row + span.div_ceil(2)).min(rows));
            let (sum, count) = (sums[end][0] - sums[first][0], sums[end][1] - sums[first][1]);
            if count > 0.0 {
                *deviation = (sum / count).max(0.0).sqrt();
            }
        }
    })?;
    Ok(deviation)
}
