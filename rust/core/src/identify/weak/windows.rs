//! The length of windows with the smallest cross-validation error, and the constants estimated with it.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::weak::decide::BADLY;
use crate::identify::weak::decided::{Decided, rows_of};
use crate::identify::weak::session::Session;
use crate::inference::cross_validation::{
    OVERLAP, RuledOut, Validated, better_known, is_inside, longest_as_good, near, rule_out, validate,
};
use crate::inference::largest_square::LargestSquare;
use crate::regression::constants::misfits;
use crate::regression::fit::Fit;
use crate::regression::subsample::{are_many, few_stretches, holds, places_of, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;
use crate::weak_form::weak_rows::WeakRows;

/// Lengths of windows that were compared by how well they predict, and the others.
struct ComparedLengths {
    validated: Vec<Validated>,
    ruled_out: RuledOut,
}

impl Session<'_, '_, '_> {
    /// Fits everything that is not windowed as constant, in windows of the length that predicts best. What the noise makes of rows depends on
    /// the parameters, so a first fit gives those that the last one is made with. Of many rows that is a sketch, to be completed: windows in stretches of them.
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
                if last && model.windowed.is_empty() {
                    // Whatever the noise of the rows is, constants alone are the same.
                    break;
                }
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
        let mut compared = self.compared_roughly(rows, decided, &tried)?;
        if compared.is_none() {
            compared = self.near_best_before(weak, decided, &tried)?;
            decided.near = self.best_before.filter(|_| compared.is_some());
        }
        let ComparedLengths { validated, ruled_out } = match compared {
            Some(compared) => compared,
            None => self.compare(rows, decided, &tried)?,
        };
        let compared = validated.iter().filter_map(|one| Some((one.fit.scale?, one.error)));
        decided.lengths = compared.chain(ruled_out).map(|(scale, error)| (scale.span() * stride, error)).collect();
        decided.lengths.sort_unstable_by_key(|(length, _)| *length);
        // Where no row can be predicted any length is as good, and the longest tells most.
        let Some(best) = longest_as_good(&validated).or(validated.last()) else { return Ok(()) };
        // Windows that predict badly follow what is missing, and long ones tell nothing better.
        let best = if best.error < BADLY { better_known(&validated, best) } else { best };
        decided.error = if best.error.is_finite() { best.error } else { 1.0 };
        (decided.covariance, decided.expected) = self.covariance(weak, self.parameters(&model, &best.fit));
        decided.first = best.fit.scale;
        let place = validated.iter().position(|one| std::ptr::eq(one, best));
        let best = place.and_then(|place| validated.into_iter().nth(place)).map(|one| one.fit);
        decided.correlated = Some(model.correlated(rows, &decided.covariance, &mut self.stages)?);
        decided.fit = best.map(|fit| Fit { leave_gap_out: None, ..fit });
        decided.is_sketch = true;
        if stretches_of_rows(rows.len()).is_some() { Ok(()) } else { self.complete(weak, decided) }
    }

    /// Fits all rows where stretches of them told only which windows are best.
    pub(crate) fn complete(&mut self, weak: &WeakRows, decided: &mut Decided) -> Result<(), Error> {
        if std::mem::take(&mut decided.is_sketch) {
            let problem = decided.problem(&weak.rows, self.noise[0]);
            let (scale, expected, instructions) = (decided.first, decided.expected, self.options.instructions);
            decided.fit = Fit::new(&problem, scale, expected, instructions, &mut self.stages)?;
        }
        Ok(())
    }

    /// Works with lengths of windows that few rows of many compare: good enough for what is only tried.
    pub(crate) fn roughly<R>(&mut self, work: impl FnOnce(&mut Self) -> Result<R, Error>) -> Result<R, Error> {
        self.is_rough = true;
        let done = work(self);
        self.is_rough = false;
        done
    }

    /// How well windows predict few rows of many, where that is enough; `None` too where windows longer than these rows hold may be better.
    fn compared_roughly(
        &mut self,
        rows: &Rows,
        decided: &Decided,
        lengths: &[Scale],
    ) -> Result<Option<ComparedLengths>, Error> {
        let stretches = few_stretches(rows.len(), lengths).filter(|_| self.is_rough && are_many(rows.len()));
        let Some((stretches, held)) = stretches else { return Ok(None) };
        let validated = self.validate(&thinned_rows(rows, &stretches), decided, &lengths[..held])?;
        let best = longest_as_good(&validated).and_then(|best| best.fit.scale);
        let is_inside = best
            .is_some_and(|best| held == lengths.len() || !lengths[held.saturating_sub(OVERLAP)..held].contains(&best));
        Ok(is_inside.then_some(ComparedLengths { validated, ruled_out: Vec::new() }))
    }

    /// How well windows near the length that was best a step before predict, or `None` if none is known or a length farther away may be better.
    fn near_best_before(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        scales: &[Scale],
    ) -> Result<Option<ComparedLengths>, Error> {
        let before = self.best_before.and_then(|samples| Scale::nearest(scales, rows_of(samples, weak.stride)));
        let Some(before) = before else { return Ok(None) };
        let near = near(before, scales.len());
        let compared = self.compare(&weak.rows, decided, &scales[near.clone()])?;
        let best = longest_as_good(&compared.validated).and_then(|best| best.fit.scale);
        let place = best.and_then(|best| scales.iter().position(|scale| *scale == best));
        Ok(place.is_some_and(|place| is_inside(place, &near, scales.len())).then_some(compared))
    }

    /// How well windows of some lengths predict rows that were left out. A few rows rule out what they can; the others are compared on all
    /// rows, or on stretches of a long record as far as they hold windows so long, and on all of it beyond where the longest of those are best.
    fn compare(&mut self, rows: &Rows, decided: &Decided, lengths: &[Scale]) -> Result<ComparedLengths, Error> {
        let (scales, ruled_out) = self.rule_out(rows, decided, lengths)?;
        let all = |validated| Ok(ComparedLengths { validated, ruled_out });
        let Some(stretches) = stretches_of_rows(rows.len()).filter(|_| scales.len() > 1) else {
            return all(self.validate(rows, decided, &scales)?);
        };
        let short = scales.partition_point(|scale| holds(*scale));
        let found = self.validate(&thinned_rows(rows, &stretches), decided, &scales[..short])?;
        let held = lengths.partition_point(|scale| holds(*scale)).saturating_sub(OVERLAP);
        let long = scales.partition_point(|scale| lengths[..held].contains(scale));
        all(match longest_as_good(&found).and_then(|best| best.fit.scale) {
            Some(best) if short == scales.len() || !scales[long..].contains(&best) => found,
            Some(_) => self.validate(rows, decided, &scales[long..])?,
            // The stretches miss the few rows that there are.
            None => self.validate(rows, decided, &scales)?,
        })
    }

    /// Lengths of windows that a few rows do not rule out, and the errors of the others.
    fn rule_out(&mut self, rows: &Rows, decided: &Decided, scales: &[Scale]) -> Result<(Vec<Scale>, RuledOut), Error> {
        let Some((stretches, held)) = few_stretches(rows.len(), scales) else {
            return Ok((scales.to_vec(), Vec::new()));
        };
        let few = thinned_rows(rows, &stretches);
        let correlated = decided.model.correlated(&few, &decided.covariance, &mut self.stages)?;
        let problem = decided.model.problem(&few, &few.rhs, self.noise[0], Some(&correlated));
        let (parts, instructions) = (places_of(&stretches), self.options.instructions);
        rule_out(&problem, &parts, (scales, held), decided.expected, instructions, &mut self.stages)
    }

    /// Fits in windows of some lengths, compared by how well they predict some rows.
    fn validate(&mut self, rows: &Rows, decided: &Decided, scales: &[Scale]) -> Result<Vec<Validated>, Error> {
        let correlated = decided.model.correlated(rows, &decided.covariance, &mut self.stages)?;
        let problem = decided.model.problem(rows, &rows.rhs, self.noise[0], Some(&correlated));
        validate(
            &problem,
            (scales, LargestSquare::Growing),
            decided.expected,
            self.options.instructions,
            &mut self.stages,
        )
    }
}
