//! The report of one record after all decisions: values at every sample, standard errors and flags.

use std::borrow::Cow;
use std::sync::Arc;

use crate::error::Error;
use crate::identify::options::WidthFrom;
use crate::identify::results::{Constant, RowResults, SampleResults};
use crate::identify::scanned::Scan;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::found::WeakIdentified;
use crate::identify::weak::lag::Lag;
use crate::identify::weak::outside_mask::Inside;
use crate::identify::weak::report::at_rows::{Fitted, OfAllRows};
use crate::identify::weak::report::beside_lag::untold_lag;
use crate::identify::weak::report::errors::Errors;
use crate::identify::weak::report::explained::Explained;
use crate::identify::weak::report::filter::{LEAST_CHANGE, LeftOfFilter};
use crate::identify::weak::session::Session;
use crate::inference::constancy::{HARDLY_DIFFERS, NO_CHANCE, Test};
use crate::inference::identifiability::is_mostly_noise;
use crate::inference::missing_terms::{Missing, Suspect};
use crate::inference::signs::Changing;
use crate::regression::constants::weakest;
use crate::regression::fit::Fit;
use crate::regression::limits::{HARDLY_TOLD_APART, UNEXPLAINED};
use crate::regression::problem::Problem;
use crate::status::Status;
use crate::weak_form::weak_rows::WeakRows;

impl Session<'_, '_, '_> {
    /// What there is to say of a record, but for the numbers at its samples: those at the rows, for which nothing else is needed any more. Another scan than
    /// the last may be told of.
    pub(crate) fn report(
        &mut self,
        chosen: Chosen,
        decided: &Decided,
        told: Option<&Scan>,
    ) -> Result<(WeakIdentified, Option<RowResults>), Error> {
        let Chosen { weak, at_end, .. } = chosen;
        let ordered = decided.ordered();
        let mut found = WeakIdentified { width_from: self.width_from(at_end), ..self.nothing_yet(&weak, decided) };
        let Some(fit) = &decided.fit else { return Ok((self.undetermined(found, decided)?, None)) };
        let given = self.options.regression_window.filter(|_| !self.options.averaging);
        found.regression_window = given.unwrap_or(fit.span * weak.stride).min(self.record.angle.len());
        let errors = self.errors(&weak, decided, fit)?;
        let explained = self.is_explained(&weak, decided, fit, errors.left)?;
        found.prediction_error = errors.over_channels;
        let rows = decided.rows(&weak.rows);
        let correlated = match &decided.correlated {
            Some(correlated) if errors.covariance == decided.covariance => Arc::clone(correlated),
            _ => ordered.correlated(rows, &errors.covariance, &mut self.stages)?,
        };
        let problem = ordered.problem(rows, decided.rhs(rows), self.noise[0], Some(&correlated));
        let all = self.all_unknowns(&problem, decided, fit, &errors)?;
        let Some(all) = all.as_deref() else { return Ok((self.undetermined(found, decided)?, None)) };
        (found.condition, found.weakest) = (all.pooled.condition, weakest(&all.full, &all.pooled.weights));
        let beside = self.covariance_of(&problem, &weak, decided, (fit, all), &errors)?;
        found.lag_of_steps = beside.of_steps;
        let left = self.left_of_filter(&weak, decided, fit, &errors)?;
        let mut changes = changes_of(beside.untold.as_deref(), left.as_ref());
        let first = changes.len();
        found.covariance = with_changes(beside.covariance, &changes);

        let (slow, count) = (decided.slow.len(), ordered.constant.len());
        let mut values = vec![0.0; slow];
        values.extend(&fit.pooled.values);
        found.constants = constants(decided, &values, &found.covariance);
        found.filtered = left.as_ref().and_then(|left| filtered(left, &found.constants, slow));
        found.unexplained = self.is_unexplained(explained, &found.constants);
        if found.unexplained && explained != Explained::BesideOutliers {
            let nothing = WeakIdentified { unexplained: true, jumps: Vec::new(), ..self.nothing_yet(&weak, decided) };
            return Ok((self.undetermined(nothing, decided)?, None));
        }
        let suspected = self.suspects(&weak, decided, fit, Arc::clone(&correlated), &errors)?;
        let widths = told.unwrap_or(&self.scan);
        let apart = widths.apart(&found.constants, slow);
        // Where widths of the test function contradict the constants, these errors would only hide it.
        if widths.status(&found.constants) == Status::GOOD {
            changes.extend(suspected.changes.iter().chain(&apart).map(Vec::as_slice));
            found.covariance = with_changes(found.covariance, &changes[first..]);
            found.constants = constants(decided, &values, &found.covariance);
        }
        found.constant_pairs = pairs_of(&ordered.constant, slow, &found.covariance);
        found.mostly_noise =
            is_mostly_noise(&problem, rows, &ordered, all, &found.weakest, self.noise[0], &mut self.stages)?;
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
        tracks.mark(&decided.whole.as_ref().unwrap_or(&weak.rows).usable, outside.as_ref());
        found.outside_mask = outside;
        let fitted = Fitted {
            weak: &weak,
            problem: &problem,
            decided,
            all,
            errors: &errors,
            covariance: &found.covariance,
            changes: &changes,
            constants: &values,
        };
        let (results, OfAllRows { pairs, in_common }) = self.at_rows(&fitted, tracks)?;
        (found.pairs, found.in_common) = (pairs, in_common);
        (found.suspects, found.with_lag) = (suspected.each, suspected.with_lag);
        found.late = late(self.options.lag, &found.suspects, errors.is_explained(&weak.rows));
        let contradicted = self.is_contradicted(&weak, &found.constants);
        forget_what_is_said(&mut found, contradicted);
        found.record_status = errors.status | record_status(&found, &results, decided, at_end);
        found.record_status |= if contradicted { Status::KIND_CONTRADICTED } else { Status::GOOD };
        Ok((found, Some(results)))
    }

    /// Whether a constant differs between parts of the record. An offset that drifts by next to nothing of the torque, as noise of low
    /// frequencies makes it, is constant enough, and so is a parameter that was to vary if it does and hardly differs.
    fn is_contradicted(&self, weak: &WeakRows, constants: &[Constant]) -> bool {
        let matters = |one: &Constant, deviation: f64| {
            let value = weak.rows.regressors[one.unknown].value.iter().copied().fold(0.0, f64::max);
            !self.is_still(one.unknown) || (deviation * value).powi(2) > UNEXPLAINED * weak.rows.mean_square()
        };
        let undecided = self.undecided();
        let differs = |one: &Constant| {
            let may_differ = |test: &Test| undecided.contains(&one.unknown) && test.spread < HARDLY_DIFFERS;
            one.test
                .as_ref()
                .is_some_and(|test| test.probability < NO_CHANCE && matters(one, test.deviation) && !may_differ(test))
        };
        constants.iter().any(differs)
    }

    /// Whether the torque is not explained, nor any constant of the motion found that is no chance.
    fn is_unexplained(&self, explained: Explained, constants: &[Constant]) -> bool {
        match explained {
            Explained::Plainly => false,
            Explained::NoTorque => true,
            Explained::BesideOutliers | Explained::ByNothing => !self.is_moved_by(constants),
        }
    }

    /// Where the test function came from, if the record chose it.
    fn width_from(&self, at_end: bool) -> Option<WidthFrom> {
        match self.options.half_width {
            Some(_) => self.options.width_from,
            None if self.scan.moved => Some(WidthFrom::Plateau),
            None if at_end => Some(WidthFrom::End),
            None => Some(WidthFrom::Spectra),
        }
    }

    /// What is known before anything is fitted.
    fn nothing_yet(&self, weak: &WeakRows, decided: &Decided) -> WeakIdentified {
        let stride = weak.stride;
        WeakIdentified {
            function: weak.function,
            width_from: None,
            noise: self.channel_noise,
            shown_noise: self.noise[1],
            regression_window: 0,
            near: decided.near,
            lengths: decided.lengths.clone(),
            prediction_error: decided.error,
            weighted: decided.white.is_some(),
            pooling: decided.found.as_ref().map(|found| 2.0 * found.reach * stride as f64),
            constants: Vec::new(),
            covariance: Vec::new(),
            condition: f64::INFINITY,
            weakest: Vec::new(),
            mostly_noise: false,
            unexplained: false,
            late: None,
            with_lag: Vec::new(),
            suspects: Vec::new(),
            lag: None,
            untold_lag: untold_lag(decided, weak),
            lag_of_steps: 0.0,
            filtered: None,
            angle_zero: None,
            free_offset: self.free_offset,
            outside_mask: None,
            changing: decided.model.windowed.iter().chain(&decided.slow).copied().collect(),
            in_common: Vec::new(),
            constant_pairs: Vec::new(),
            pairs: Vec::new(),
            jumps: decided.jumps.iter().map(|jump| jump.sample).collect(),
            pulses: Vec::new(),
            spikes: Vec::new(),
            lost: Vec::new(),
            limits: [None; 2],
            unread: [const { Vec::new() }; 2],
            scan: Scan::default(),
            resting: 0.0,
            defects: Vec::new(),
            record_status: Status::GOOD,
            results: SampleResults::default(),
        }
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
    fn undetermined(&mut self, mut found: WeakIdentified, decided: &Decided) -> Result<WeakIdentified, Error> {
        let elements = self.record.angle.len().div_ceil(self.options.step);
        for &unknown in &decided.model.constant {
            found.constants.push(Constant { unknown, value: f64::NAN, error: f64::NAN, test: None });
        }
        found.record_status = Status::RANK_DEFICIENT;
        found.results = SampleResults::undetermined(found.changing.len(), elements, &mut self.stages)?;
        Ok(found)
    }
}

/// What the constants may be wrong by with what is not told of a lag, and with a filter.
fn changes_of<'a>(untold: Option<&'a [f64]>, left: Option<&'a LeftOfFilter>) -> Vec<&'a [f64]> {
    untold.into_iter().chain(left.map(|left| left.changes.as_slice())).collect()
}

/// The covariance of the constants, with what they may be wrong by.
fn with_changes(mut covariance: Vec<f64>, changes: &[&[f64]]) -> Vec<f64> {
    for changes in changes {
        for (one, change) in changes.iter().enumerate() {
            for (other, with) in changes.iter().enumerate() {
                covariance[one * changes.len() + other] += change * with;
            }
        }
    }
    covariance
}

/// Which channel is filtered, and the largest change of a constant, those that change slowly left out, as a part of it.
fn filtered(left: &LeftOfFilter, constants: &[Constant], slow: usize) -> Option<(usize, f64)> {
    let part = largest_part(constants, &left.changes[slow..]);
    (left.late || part > LEAST_CHANGE).then_some((usize::from(left.of_torque), part))
}

/// The largest change of a coefficient of the motion, as a part of it.
fn largest_part(constants: &[Constant], changes: &[f64]) -> f64 {
    let parts = constants.iter().zip(changes).filter(|(one, _)| one.unknown < 3);
    parts.map(|(one, change)| (change / one.value).abs()).fold(0.0, f64::max)
}

/// The constants with their standard errors and tests.
fn constants(decided: &Decided, values: &[f64], covariance: &[f64]) -> Vec<Constant> {
    let (slow, count) = (decided.slow.len(), values.len());
    let constant = |(place, &unknown): (usize, &usize)| {
        let test = decided.tests.iter().find(|(one, _)| *one == unknown).map(|(_, test)| test.clone());
        let variance = covariance[(place + slow) * (count + 1)];
        Constant { unknown, value: values[place + slow], error: variance.sqrt(), test }
    };
    decided.model.constant.iter().enumerate().map(constant).collect()
}

/// What the torque seems to be late by: what is suspected beside the lag that was given. Where next to nothing is left to explain, that one is right.
fn late(given: Option<f64>, suspects: &[Suspect], is_explained: bool) -> Option<Lag> {
    if is_explained {
        return given.map(|value| Lag { value, error: 0.0 });
    }
    let suspected = suspects.iter().find(|one| one.missing == Missing::Lag);
    suspected.map(|one| Lag { value: given.unwrap_or(0.0) + one.value, error: one.error })
}

/// Forgets suspects that only repeat what is said already: what a filter does, and, where something changes that should not, what the torque tells of it.
fn forget_what_is_said(found: &mut WeakIdentified, contradicted: bool) {
    let is_filtered = found.filtered.is_some();
    let is_said = |one: &Suspect| one.missing == Missing::Resonance && is_filtered;
    found.suspects.retain(|one| !(is_said(one) || contradicted && one.missing.is_of_torque()));
}

/// Flags of the whole record, beside those of its noise.
fn record_status(found: &WeakIdentified, results: &RowResults, decided: &Decided, at_end: bool) -> Status {
    let mut status = Status::GOOD;
    if at_end || decided.has_shortest_windows() {
        status |= Status::WINDOW_LIMIT;
    }
    let is_alike = found.condition > HARDLY_TOLD_APART || found.mostly_noise;
    let changing = Changing {
        unknowns: &found.changing,
        values: &results.values,
        errors: &results.errors,
        pairs: &found.pairs,
        covariances: &results.covariances,
    };
    if is_alike || found.unexplained || changing.signs_contradict() {
        status |= Status::ILL_CONDITIONED;
    }
    for suspect in found.suspects.iter().filter(|suspect| suspect.is_conspicuous()) {
        status |= match suspect.missing {
            Missing::Lag => Status::LAG_SUSPECTED,
            Missing::Term(_) | Missing::Resonance => Status::TERM_SUSPECTED,
            Missing::Gain | Missing::TorqueSquare | Missing::TorqueCube => Status::CHANNEL_SUSPECTED,
        };
    }
    status
}

/// Pairs of constants, those that change slowly and come first left out, and their covariance.
fn pairs_of(constants: &[usize], slow: usize, covariance: &[f64]) -> Vec<(usize, usize, f64)> {
    let pairs = (slow..constants.len()).flat_map(|one| (slow..one).map(move |other| (one, other)));
    pairs.map(|(one, other)| (constants[one], constants[other], covariance[one * constants.len() + other])).collect()
}
