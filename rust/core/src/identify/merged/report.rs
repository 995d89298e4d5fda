//! Values, standard errors and flags from merged rows.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::merged::across::{averages_across, bridged, has_gaps};
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::found::{FoundElement, MergedFound};
use crate::identify::merged::lags::SuspectedChannels;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::identify::merged::suspected_terms::SuspectedTerms;
use crate::identify::results::{RowResults, SampleResults};
use crate::identify::scanned::Scan;
use crate::inference::across_trials::said_across;
use crate::inference::carried_on::far_from_equations;
use crate::inference::constancy::{self, Test};
use crate::inference::identifiability::is_mostly_noise;
use crate::inference::missing_terms::Missing;
use crate::inference::part_constants::NoiseFrom;
use crate::inference::window_averaging::{Averages, average};
use crate::noise::median::median;
use crate::regression::constants::weakest;
use crate::regression::fit::Fit;
use crate::regression::limits::{HARDLY_TOLD_APART, NOISE_MODEL_FAILS};
use crate::regression::magnitudes::Magnitudes;
use crate::regression::model::Model;
use crate::regression::predictor::without_constants;
use crate::regression::problem::Correlated;
use crate::regression::sandwich::joint_covariance;
use crate::regression::solved::sensitivity;
use crate::regression::subsample::{stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;
use crate::status::Status;

/// Mean squared error of predicting a row, over the noise's, from which on windows that leave the same in all trials do not follow what these share.
const UNFOLLOWED: f64 = 2.0;

/// Flags, standard errors of windowed elements, their covariances with others, and which those are, by row.
struct AtRows {
    status: Vec<u16>,
    errors: Vec<Vec<f64>>,
    covariances: Vec<Vec<f64>>,
    pairs: Vec<(usize, usize)>,
}

impl MergedSession<'_, '_, '_> {
    /// What there is to say of everything; the numbers at the rows are left to be put at the samples.
    pub(crate) fn report(&mut self, fitted: &MergedFit) -> Result<(MergedFound, RowResults), Error> {
        let (model, fit) = (&fitted.model, &fitted.fit);
        let noise = self.noise_of_rows(fitted)?;
        let inflation = noise.inflation;
        let correlated = self.correlated_by(fitted, &noise)?;
        let rows = &self.all.rows;
        let problem = model.problem(rows, &rows.rhs, 1.0, Some(&correlated));
        let covariance = fit.covariance(&problem, &noise.covariance, &mut self.stages)?;
        let mut covariance: Vec<f64> = covariance.into_iter().map(|entry| inflation * entry).collect();
        // What the noise of the channels does not explain may be correlated in any way.
        if model.windowed.is_empty() && fitted.error > NOISE_MODEL_FAILS {
            let of_blocks = self.in_blocks(model, &[1.0]).pop().flatten();
            covariance = of_blocks.map_or(covariance, |fit| fit.covariance);
        }
        let weakest = weakest(&fit.full, &fit.pooled.weights);
        let mostly_noise = is_mostly_noise(&problem, rows, model, fit, &weakest, 1.0, &mut self.stages)?;
        let averages = self.averages(fitted, &correlated, &noise)?;
        let shared = self.left_shared(fitted, &averages);
        let AtRows { mut status, mut errors, covariances, pairs } =
            self.at_rows(fitted, &averages, &shared.errors, &covariance, inflation);
        let spread = self.spread(fitted, &averages, &shared, &noise);
        let elements = elements(fitted, &covariance, spread);
        let mut found = MergedFound { elements, ..self.nothing_yet(fitted) };
        (found.constants, found.condition, found.weakest) = (model.constant.clone(), fit.pooled.condition, weakest);
        for (holds, flag) in [
            (self.at_end || fitted.has_shortest_windows(), Status::WINDOW_LIMIT),
            (
                found.condition > HARDLY_TOLD_APART || mostly_noise || fitted.misfit > NOISE_MODEL_FAILS,
                Status::ILL_CONDITIONED,
            ),
            (fitted.error > NOISE_MODEL_FAILS, Status::NOISE_MODEL),
            (fitted.contradicted, Status::KIND_CONTRADICTED),
        ] {
            found.record_status |= if holds { flag } else { Status::GOOD };
        }
        found.scan = std::mem::take(&mut self.scan);
        found.record_status |= found.scan.status_but_for(&found.constants_found(), 0.0);
        let SuspectedChannels { each, beside } = self.suspected_channels(fitted, &noise, &correlated)?;
        let SuspectedTerms { each: terms, beside: beside_terms } = self.suspected_terms(fitted, &noise, &correlated)?;
        found.changes_in_common = self.changes_in_common(fitted)?;
        let beside = [beside, beside_terms];
        let is_wrong = self.is_wrong(fitted, &found, &beside, (&errors, &covariance));
        for beside in beside.iter().flatten() {
            widen(fitted, beside, &mut errors, &mut covariance);
        }
        for one in &mut found.elements {
            one.stderr = stderr_of(fitted, one.element, &covariance);
        }
        status.iter_mut().filter(|_| is_wrong).for_each(|status| *status |= Status::NOISE_MODEL.bits());
        (found.covariance, found.pairs) = (covariance, pairs);
        (found.late, found.lacking) = each.into_iter().partition(|(_, suspect)| suspect.missing == Missing::Lag);
        found.lacking.retain(|(_, suspect)| suspect.is_conspicuous());
        let is_late = found.late.iter().any(|(_, late)| late.is_conspicuous());
        found.record_status |= if is_late { Status::LAG_SUSPECTED } else { Status::GOOD };
        found.record_status |= if found.lacking.is_empty() { Status::GOOD } else { Status::CHANNEL_SUSPECTED };
        found.record_status |= if terms.is_empty() { Status::GOOD } else { Status::TERM_SUSPECTED };
        found.terms = terms;
        let deviation = self.deviation(fitted)?;
        let ([first, stride], period) = (self.all.samples(), self.all.rows.period);
        let results = RowResults {
            first,
            stride,
            slopes: averages.slopes.iter().map(|column| column.iter().map(|one| one * period).collect()).collect(),
            values: averages.values,
            errors,
            covariances,
            condition: vec![found.condition; status.len()],
            deviation,
            status,
            jumps: fitted.jumps.clone(),
        };
        Ok((found, results))
    }

    /// Windowed regressors of a fit times the covariance of the rows that its errors rest on.
    pub(crate) fn correlated_by(&mut self, fitted: &MergedFit, noise: &NoiseOfRows) -> Result<Arc<Correlated>, Error> {
        match noise.from {
            NoiseFrom::Channels => Ok(Arc::clone(&fitted.correlated)),
            NoiseFrom::Equations => fitted.model.correlated(&self.all.rows, &noise.covariance, &mut self.stages),
        }
    }

    /// Windowed elements at every row.
    pub(crate) fn averages(
        &mut self,
        fitted: &MergedFit,
        correlated: &Arc<Correlated>,
        noise: &NoiseOfRows,
    ) -> Result<Averages, Error> {
        let (model, fit) = (&fitted.model, &fitted.fit);
        if model.windowed.is_empty() {
            return Ok(Averages::default());
        }
        let rows = &self.all.rows;
        let constants = &fit.pooled.values;
        let whole = model.problem(rows, &rows.rhs, 1.0, Some(correlated));
        let rhs = without_constants(&whole, constants);
        let rest = model.without_constants(rows, &whole, &rhs, constants, 1.0);
        let mut across = None;
        if let Some(scale) = fit.scale.filter(|scale| scale.is_across()) {
            let dealt = self.dealt();
            let covariance = noise.covariance.of_one_record(dealt.group, dealt.equations);
            let said = said_across(&rest, scale, dealt, &covariance, &mut self.stages)?;
            across = Some(averages_across(&rest, fit, &said));
        }
        if let Some(mut averages) = across.take_if(|averages| !has_gaps(averages)) {
            self.forget_untold(model, &fitted.scales, &mut averages);
            return Ok(averages);
        }
        let thinned = stretches_of_rows(rows.len()).map(|stretches| thinned_rows(rows, &stretches));
        let of_thinned = thinned.as_ref().map(|rows| model.problem(rows, &rows.rhs, 1.0, None));
        let thinned_rhs = of_thinned.as_ref().map_or_else(Vec::new, |problem| without_constants(problem, constants));
        let of_thinned = thinned
            .as_ref()
            .zip(of_thinned.as_ref())
            .map(|(rows, problem)| model.without_constants(rows, problem, &thinned_rhs, constants, 1.0));
        let judged = (noise.expected, fit.span, 0..rows.len());
        let instructions = self.options.instructions;
        let mut averages = average(&rest, of_thinned.as_ref(), &fitted.scales, judged, instructions, &mut self.stages)?;
        if let Some(across) = across {
            // Gaps in all trials are bridged by windows on either side of them.
            averages = bridged(across, &averages);
        }
        self.forget_untold(model, &fitted.scales, &mut averages);
        Ok(averages)
    }

    /// Makes an element no number where equations without it hold, and none with it for as long as a window: to a solver it is zero there,
    /// without an error. Shorter gaps are bridged by windows on either side.
    fn forget_untold(&self, model: &Model, scales: &[Scale], averages: &mut Averages) {
        let (rows, group, equations) = (&self.all.rows, self.all.group, self.merged.equations());
        let usable = &self.whole.as_ref().unwrap_or(rows).usable;
        let shortest = scales.iter().map(|scale| scale.one_sided()).min().unwrap_or(0);
        for (place, &element) in model.windowed.iter().enumerate() {
            let entries = &self.merged.elements[element].entries;
            let is_of = |row: usize| entries.iter().any(|entry| entry.equation == row % equations);
            let is_told = |time: usize| {
                let usable = &usable[time * group..((time + 1) * group).min(usable.len())];
                (0..usable.len()).any(|row| usable[row] && is_of(row))
            };
            let (times, mut first) = (usable.len().div_ceil(group), 0);
            while first < times {
                let last = (first..times).find(|&time| is_told(time)).unwrap_or(times);
                let run = first * group..(last * group).min(usable.len());
                if run.len() >= shortest && usable[run.clone()].contains(&true) {
                    run.for_each(|row| averages.forget(place, row));
                }
                first = last + 1;
            }
        }
    }

    /// Flags and standard errors of windowed elements, by row, which share some squared errors in all trials.
    fn at_rows(
        &self,
        fitted: &MergedFit,
        averages: &Averages,
        shared: &[f64],
        covariance: &[f64],
        inflation: f64,
    ) -> AtRows {
        let Model { windowed, constant, .. } = &fitted.model;
        let (fit, rows, group) = (&fitted.fit, &self.all.rows, self.all.group);
        let condition = fit.full.field(fit.full.fields.condition());
        let mut status = vec![0; rows.len()];
        let usable = &self.whole.as_ref().unwrap_or(rows).usable;
        let reach = fitted.scales.first().map_or(1, |scale| scale.reach);
        // One sample that is missing takes the rows of a test function, which short windows reach over.
        let carried = (fit.span / 4).max(reach);
        let far = if windowed.is_empty() { Vec::new() } else { far_from_equations(usable, carried) };
        for (time, usable) in usable.chunks(group).enumerate() {
            // What one trial misses others have; an element that is in none of the others' equations has no number.
            let lacks = || averages.values.iter().any(|column| column[time * group].is_nan());
            let is_whole = usable.iter().all(|usable| *usable);
            let gap =
                if is_whole || usable.iter().any(|usable| *usable) && !lacks() { Status::GOOD } else { Status::GAP };
            for row in time * group..time * group + usable.len() {
                let mut here = gap;
                if averages.values.iter().any(|column| !column[row].is_finite()) {
                    here |= Status::INVALID;
                }
                if !windowed.is_empty() && (far[row] || condition[fit.nearest(row)] > HARDLY_TOLD_APART) {
                    here |= Status::ILL_CONDITIONED;
                }
                status[row] = here.bits();
            }
        }
        let count = constant.len();
        let unfollowed = self.squared_bias(fitted, averages).into_iter().zip(shared);
        let (blur, steep) = (self.blur(fitted, averages), self.steep(fitted, averages));
        let bias: Vec<f64> = unfollowed.zip(blur).map(|((one, other), blur)| one.max(*other).max(blur)).collect();
        let off = |i: usize, row: usize| bias[i] + steep.get(i).map_or(0.0, |steep| steep[row]);
        let joint = |one: usize, other: usize, row: usize| {
            let place = fit.nearest(row);
            let later = (row as f64 - fit.centre(place)) * rows.period;
            // Averages over windows know nothing of what two windowed elements share beside the constants.
            let own = |i: usize, j: usize| {
                if i == j { averages.errors[i][row].powi(2) * inflation + off(i, row) } else { 0.0 }
            };
            let sensitive = |one: usize, constant: usize| sensitivity(&fit.full, place, one, constant, later);
            let between = |i: usize, j: usize| covariance[i * count + j];
            joint_covariance([one, other], [windowed.len(), count], own, sensitive, between)
        };
        let column = |one: usize, other: usize| (0..rows.len()).map(move |row| joint(one, other, row));
        let errors = (0..windowed.len()).map(|one| column(one, one).map(|variance| variance.max(0.0).sqrt()).collect());
        let errors: Vec<Vec<f64>> = errors.collect();
        let problem = fitted.model.problem(rows, &rows.rhs, 1.0, None);
        let untold = Magnitudes::new(&problem, &fit.pooled.values).untold(&errors, reach);
        for (status, _) in status.iter_mut().zip(untold).filter(|(_, untold)| *untold) {
            *status |= Status::ILL_CONDITIONED.bits();
        }
        let all = windowed.len() + count;
        let pairs: Vec<_> = (0..windowed.len()).flat_map(|one| (one + 1..all).map(move |other| (one, other))).collect();
        let covariances = pairs.iter().map(|&(one, other)| column(one, other).collect()).collect();
        let element = |place: usize| windowed.get(place).copied().unwrap_or_else(|| constant[place - windowed.len()]);
        let pairs = pairs.iter().map(|&(one, other)| (element(one), element(other))).collect();
        AtRows { status, errors, covariances, pairs }
    }

    /// Whether numbers are wrong by more than their errors say: windows do not follow what changes, a constant changes, or what is missing in the equations moves
    /// them.
    fn is_wrong(
        &self,
        fitted: &MergedFit,
        found: &MergedFound,
        beside: &[Option<Fit>; 2],
        (errors, covariance): (&[Vec<f64>], &[f64]),
    ) -> bool {
        let is_unfollowed = found.changes_in_common && fitted.error > UNFOLLOWED;
        let is_other = |beside: &Fit| self.are_others(fitted, beside, errors, covariance);
        is_unfollowed || self.is_contradicted(fitted) || beside.iter().flatten().any(is_other)
    }

    /// Whether a coefficient that stays constant differs between parts of the record, beside equations that leave more than noise explains.
    fn is_contradicted(&self, fitted: &MergedFit) -> bool {
        let mut of_constants = fitted.tests.iter().filter(|(one, _)| fitted.model.constant.contains(one));
        let differs = |(one, test): &(usize, Test)| {
            self.merged.elements[*one].is_of_motion() && test.probability < constancy::NO_CHANCE
        };
        fitted.error > NOISE_MODEL_FAILS && of_constants.any(differs)
    }

    /// What windows that are as short as can be and yet do not follow leave of every windowed element: rows are predicted worse than noise
    /// and the windows' own errors explain, and that is an error of the elements.
    fn squared_bias(&self, fitted: &MergedFit, averages: &Averages) -> Vec<f64> {
        let (windowed, rows) = (&fitted.model.windowed, &self.all.rows);
        let excess = (fitted.error - 1.0).max(0.0) * fitted.expected.variance;
        let of = |place: usize| {
            if !fitted.has_shortest_windows() {
                return 0.0;
            }
            let (value, errors) = (&rows.regressors[windowed[place]].value, &averages.errors[place]);
            let used = || (0..rows.len()).filter(|&row| rows.usable[row] && errors[row].is_finite());
            let (count, squares) =
                used().fold((0.0, 0.0), |(count, squares), row| (count + 1.0, squares + value[row].powi(2)));
            // Few rows at the ends, where windows lie on one side, have errors many times as large as all others.
            let own = median(&mut used().map(|row| errors[row].powi(2)).collect::<Vec<f64>>()).unwrap_or(0.0);
            // Several share what is left.
            (excess / windowed.len() as f64 * count / squares.max(f64::MIN_POSITIVE) - own).max(0.0)
        };
        (0..windowed.len()).map(of).collect()
    }

    /// What is left of the rows of every time, over the noise's standard deviation.
    fn deviation(&mut self, fitted: &MergedFit) -> Result<Vec<f64>, Error> {
        let (left, usable) = self.left_of(fitted)?;
        let rows = &self.all.rows;
        let span = fitted.fit.span.min(rows.len()).max(self.all.group);
        let mut deviation = vec![f64::NAN; rows.len()];
        // Means over the windows' length, one for every time.
        for (window, places) in deviation.chunks_mut(span).enumerate() {
            let here = window * span..(window * span + places.len()).min(rows.len());
            let used = || here.clone().filter(|&row| usable[row]);
            let count = used().count() as f64;
            let sum: f64 = used().map(|row| left[row] * left[row]).sum();
            if count > 0.0 {
                places.fill((sum / count / fitted.expected.variance).sqrt());
            }
        }
        Ok(deviation)
    }

    /// What is known before anything is reported.
    fn nothing_yet(&self, fitted: &MergedFit) -> MergedFound {
        let [_, stride] = self.all.samples();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "samples of a record")]
        let of_rows = (fitted.fit.span as f64 * stride).round() as usize;
        let span = fitted.fit.scale.map_or(of_rows, |scale| self.samples_in(scale));
        MergedFound {
            window_length: self.all.function.window_length(),
            exponent: self.all.function.exponent(),
            regression_window: span.min(self.merged.samples),
            lengths: fitted.lengths.clone(),
            prediction_error: fitted.error,
            misfit: if fitted.misfit > NOISE_MODEL_FAILS { fitted.misfit } else { 1.0 },
            jumps: fitted.jumps.iter().map(|jump| jump.sample).collect(),
            ..self.undetermined()
        }
    }

    /// Nothing but a status.
    pub(crate) fn undetermined(&self) -> MergedFound {
        let unknown = |element: usize| FoundElement {
            element,
            kind: Kind::Constant,
            values: vec![f64::NAN],
            stderr: vec![f64::NAN],
            test: None,
            spread: Vec::new(),
        };
        MergedFound {
            window_length: self.all.function.window_length(),
            exponent: self.all.function.exponent(),
            regression_window: 0,
            lengths: Vec::new(),
            prediction_error: 1.0,
            misfit: 1.0,
            changes_in_common: false,
            noise: (self.noise[0].clone(), self.noise[1].clone()),
            colours: self
                .colours
                .iter()
                .flatten()
                .map(|noise| (noise.density(0.0) / noise.density(PI)).max(1.0))
                .collect(),
            elements: self.merged.unknowns().into_iter().map(unknown).collect(),
            constants: Vec::new(),
            covariance: Vec::new(),
            pairs: Vec::new(),
            covariances: Vec::new(),
            condition: f64::INFINITY,
            weakest: Vec::new(),
            residual: Vec::new(),
            status: Vec::new(),
            record_status: Status::GOOD,
            jumps: Vec::new(),
            scan: Scan::default(),
            defects: Vec::new(),
            late: Vec::new(),
            lacking: Vec::new(),
            terms: Vec::new(),
        }
    }

    /// The result where the rows do not determine what is constant.
    pub(crate) fn nothing(&mut self) -> Result<MergedFound, Error> {
        let elements = self.merged.samples.div_ceil(self.options.step);
        let results = SampleResults::undetermined(0, elements, &mut self.stages)?;
        let mut found = MergedFound { record_status: Status::RANK_DEFICIENT, ..self.undetermined() };
        found.take(&[], results);
        Ok(found)
    }
}

/// The elements, in their order.
fn elements(fitted: &MergedFit, covariance: &[f64], spread: Vec<Vec<(f64, f64)>>) -> Vec<FoundElement> {
    let model = &fitted.model;
    let each = model.windowed.iter().chain(&model.constant).enumerate().zip(spread);
    let mut found: Vec<FoundElement> = each
        .map(|((place, &element), spread)| {
            let constant = place.checked_sub(model.windowed.len());
            FoundElement {
                element,
                kind: if constant.is_none() { Kind::Windowed } else { Kind::Constant },
                values: constant.map_or_else(Vec::new, |one| vec![fitted.fit.pooled.values[one]]),
                stderr: stderr_of(fitted, element, covariance),
                test: fitted.tests.iter().find(|(one, _)| *one == element).map(|(_, test)| test.clone()),
                spread,
            }
        })
        .collect();
    found.sort_by_key(|one| one.element);
    found
}

/// The standard error of an element that is a constant; none of one that is windowed.
fn stderr_of(fitted: &MergedFit, element: usize, covariance: &[f64]) -> Vec<f64> {
    let constants = &fitted.model.constant;
    let place = constants.iter().position(|one| *one == element);
    place.map(|one| covariance[one * (constants.len() + 1)].max(0.0).sqrt()).into_iter().collect()
}

/// Makes errors hold what estimates change by in a fit beside what is suspected to be missing.
fn widen(fitted: &MergedFit, beside: &Fit, errors: &mut [Vec<f64>], covariance: &mut [f64]) {
    for (one, errors) in errors.iter_mut().enumerate() {
        let change = beside.median(one) - fitted.fit.median(one);
        errors.iter_mut().filter(|_| change.is_finite()).for_each(|error| *error = error.hypot(change));
    }
    let count = fitted.model.constant.len();
    for one in 0..count {
        let change = beside.pooled.values[one] - fitted.fit.pooled.values[one];
        covariance[one * (count + 1)] += if change.is_finite() { change * change } else { 0.0 };
    }
}
