//! The length of windows with the smallest cross-validation error, and the constants estimated with it.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::weak::decided::{Decided, rows_of};
use crate::identify::weak::session::Session;
use crate::inference::cross_validation::{Validated, best, validate};
use crate::regression::constants::misfits;
use crate::regression::fit::Fit;
use crate::regression::subsample::{holds, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;
use crate::weak_form::weak_rows::WeakRows;

/// So many of the longest windows that stretches of a long record hold are tried again on all of it, where one of them is best.
const OVERLAP: usize = 2;

/// So many lengths on either side of the one that was best a step before are tried first.
const NEAR: usize = 2;

impl Session<'_, '_, '_> {
    /// Fits everything that is not windowed as constant, in windows of the length that predicts best. What the noise makes of rows depends on
    /// the parameters, so a first fit gives those that the last one is made with.
    pub(crate) fn fit_constants(&mut self, weak: &WeakRows, decided: &mut Decided) -> Result<(), Error> {
        let (rows, stride) = (&weak.rows, weak.stride);
        let instructions = self.options.instructions;
        let model = decided.model.clone();
        let wanted = self.options.regression_window.map(|samples| rows_of(samples, stride));
        if model.windowed.is_empty() || !self.options.averaging {
            let window = wanted.unwrap_or(rows.len()).min(rows.len());
            for last in [false, true] {
                let correlated = model.correlated(rows, &decided.covariance, &mut self.stages)?;
                let problem = model.problem(rows, &rows.rhs, self.noise[0], Some(&correlated));
                decided.correlated = Some(correlated);
                decided.fit = if model.windowed.is_empty() {
                    Fit::new(&problem, None, decided.expected, instructions, &mut self.stages)?
                } else {
                    Fit::in_rows(&problem, window, decided.expected, instructions)
                };
                let Some(fit) = &decided.fit else { return Ok(()) };
                if !model.windowed.is_empty() {
                    let misfits = misfits(&fit.full, &(0..fit.full.len()), &fit.pooled.values, decided.expected);
                    decided.error = misfits.iter().sum::<f64>() / misfits.len().max(1) as f64;
                }
                if !last {
                    (decided.covariance, decided.expected) = self.covariance(weak, self.parameters(&model, fit));
                }
            }
            let weighted = self.options.averaging && self.of_kind(Kind::Varying).is_empty();
            return if weighted { self.whiten(weak, decided) } else { Ok(()) };
        }
        let scales = &decided.scales;
        let tried = match wanted {
            Some(wanted) => scales[Scale::nearest(scales, wanted).ok_or(self.too_short())?..][..1].to_vec(),
            None => scales.clone(),
        };
        if tried.is_empty() {
            return Err(self.too_short());
        }
        let validated = match self.near_best_before(weak, decided, &tried)? {
            Some(validated) => validated,
            None => self.validate(rows, decided, &tried)?,
        };
        let span = |one: &Validated| one.fit.scale.map_or(0, |scale| scale.span() * stride);
        decided.lengths = validated.iter().map(|one| (span(one), one.error)).collect();
        // Where no row can be predicted any length is as good, and the longest tells most.
        let Some(best) = best(&validated).or(validated.last()) else { return Ok(()) };
        decided.error = if best.error.is_finite() { best.error } else { 1.0 };
        (decided.covariance, decided.expected) = self.covariance(weak, self.parameters(&model, &best.fit));
        let scale = best.fit.scale;
        decided.first = scale;
        drop(validated);
        let correlated = model.correlated(rows, &decided.covariance, &mut self.stages)?;
        let problem = model.problem(rows, &rows.rhs, self.noise[0], Some(&correlated));
        decided.correlated = Some(correlated);
        decided.fit = Fit::new(&problem, scale, decided.expected, instructions, &mut self.stages)?;
        Ok(())
    }

    /// How well windows near the length that was best a step before predict, or `None` if none is known or a length farther away may be better.
    fn near_best_before(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        scales: &[Scale],
    ) -> Result<Option<Vec<Validated>>, Error> {
        let before = self.best_before.and_then(|samples| Scale::nearest(scales, rows_of(samples, weak.stride)));
        let Some(before) = before else { return Ok(None) };
        let near = before.saturating_sub(NEAR)..(before + NEAR + 1).min(scales.len());
        let validated = self.validate(&weak.rows, decided, &scales[near.clone()])?;
        let best = best(&validated).and_then(|best| best.fit.scale);
        let place = best.and_then(|best| scales.iter().position(|scale| *scale == best));
        let is_inside = |place: usize| {
            (place > near.start || near.start == 0) && (place + 1 < near.end || near.end == scales.len())
        };
        Ok(place.is_some_and(is_inside).then_some(validated))
    }

    /// How well windows of some lengths predict what they have not seen: on stretches of a long record as far as they hold windows so
    /// long, and on all of it beyond where the longest of those are best.
    fn validate(&mut self, rows: &Rows, decided: &Decided, scales: &[Scale]) -> Result<Vec<Validated>, Error> {
        let (instructions, expected) = (self.options.instructions, decided.expected);
        let mut validated = |rows: &Rows, scales: &[Scale]| {
            let correlated = decided.model.correlated(rows, &decided.covariance, &mut self.stages)?;
            let problem = decided.model.problem(rows, &rows.rhs, self.noise[0], Some(&correlated));
            validate(&problem, scales, expected, instructions, &mut self.stages)
        };
        let Some(stretches) = stretches_of_rows(rows.len()).filter(|_| scales.len() > 1) else {
            return validated(rows, scales);
        };
        let short = scales.partition_point(|scale| holds(*scale));
        let found = validated(&thinned_rows(rows, &stretches), &scales[..short])?;
        let long = short.saturating_sub(OVERLAP);
        match best(&found).and_then(|best| best.fit.scale) {
            Some(best) if !scales[long..].contains(&best) => Ok(found),
            Some(_) => validated(rows, &scales[long..]),
            // The stretches miss the few rows that there are.
            None => validated(rows, scales),
        }
    }
}
