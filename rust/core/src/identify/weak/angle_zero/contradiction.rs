//! Whether an offset beside a stiffness that changes is constant: tests from what is known anyway, but where something else is odd.

use crate::error::Error;
use crate::identify::weak::angle_zero::first_guess::with_free_offset;
use crate::identify::weak::angle_zero::outcome::FreeOffset;
use crate::identify::weak::angle_zero::spring::SpringColumn;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decide::BADLY;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::regression::model::Model;
use crate::regression::residuals::residuals;
use crate::regression::subsample::are_many;
use crate::weak_form::weak_rows::WeakRows;

/// What is left of rows follows the stiffness beyond so many standard errors, as a term is suspected.
const CONSPICUOUS: f64 = 5.0;

impl Session<'_, '_, '_> {
    /// Whether a record whose rows are predicted badly, in the shortest windows only, or with more noise than its channels show, is predicted better with an offset that is free in
    /// every window.
    pub(crate) fn offset_is_missed(
        &mut self,
        chosen: &mut Chosen,
        model: &Model,
        offset: usize,
    ) -> Result<bool, Error> {
        let fitted = self.take_sketch(chosen, model)?;
        let is_raised = self.noise != self.channel_noise;
        let (error, is_odd) = (fitted.error, fitted.error > BADLY || fitted.has_shortest_windows() || is_raised);
        chosen.fitted = Some(fitted);
        if !is_odd {
            return Ok(false);
        }
        let free = with_free_offset(model, offset);
        let is_many = are_many(chosen.weak.rows.len());
        let [few, free] = self.roughly(|session| {
            let few = if is_many { session.error_of(chosen, model)? } else { error };
            Ok([few, session.error_of(chosen, &free)?])
        })?;
        // Few of many rows tell what part a free offset leaves.
        let free = if is_many && few.is_finite() { error * free / few } else { free };
        self.free_offset = FreeOffset { error, free };
        Ok(self.free_offset.is_better())
    }

    /// Whether the record contradicts a constant offset: it differs between parts, or what is left of the rows follows the stiffness.
    pub(crate) fn offset_is_contradicted(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        offset: usize,
    ) -> Result<bool, Error> {
        Ok(decided.differs(offset) || self.follows_stiffness(weak, decided)?)
    }

    /// The error of predicting rows with a model in which everything that is not windowed is constant.
    pub(crate) fn error_of(&mut self, chosen: &Chosen, model: &Model) -> Result<f64, Error> {
        let fitted = self.sketch_first(chosen, model)?;
        Ok(if fitted.fit.is_some() { fitted.error } else { f64::INFINITY })
    }

    /// Whether what is left of the rows follows the stiffness.
    fn follows_stiffness(&mut self, weak: &WeakRows, decided: &Decided) -> Result<bool, Error> {
        let Some(fit) = &decided.fit else { return Ok(false) };
        let Some(spring) = SpringColumn::new(&decided.model, fit, weak.rows.len(), weak.rows.period) else {
            return Ok(false);
        };
        let problem = decided.problem(&weak.rows, self.noise[0]);
        let (left, usable) = residuals(&problem, fit, &mut self.stages)?;
        let weights = without_mean(spring.stiffness(), &usable);
        let mut noisy = vec![0.0; weights.len()];
        self.stages.fill([&mut noisy], |rows, parts| {
            for part in parts {
                decided.covariance.add_product(&weights, rows.clone(), part);
            }
        })?;
        let dot = |other: &[f64]| weights.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
        let variance = decided.inflation() * dot(&noisy);
        Ok(dot(&left).abs() > CONSPICUOUS * variance.sqrt())
    }
}

/// Numbers minus their mean over some rows, zero in all others.
fn without_mean(values: &[f64], rows: &[bool]) -> Vec<f64> {
    let used = || values.iter().zip(rows).filter(|(_, row)| **row).map(|(value, _)| value);
    let mean = used().sum::<f64>() / used().count().max(1) as f64;
    values.iter().zip(rows).map(|(value, &row)| if row { value - mean } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_taken_over_the_rows_that_count() {
        assert_eq!(without_mean(&[1.0, 5.0, 9.0], &[true, false, true]), [-4.0, 0.0, 4.0]);
        assert_eq!(without_mean(&[1.0], &[false]), [0.0]);
    }
}
