//! The covariance of constants beside a lag that was sought, and what they may be wrong by where the search did not settle.

use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::lag::{Followed, UNKNOWN};
use crate::identify::weak::report::doubted::StepRows;
use crate::identify::weak::report::errors::Errors;
use crate::identify::weak::session::Session;
use crate::regression::fit::Fit;
use crate::regression::problem::Problem;
use crate::weak_form::weak_rows::WeakRows;

/// Constants, those that change slowly first, beside a lag.
pub(crate) struct BesideLag {
    /// Their covariance.
    pub(crate) covariance: Vec<f64>,
    /// What all of them change by with what is not told of the lag; nothing where it is told.
    pub(crate) untold: Option<Vec<f64>>,
    /// Samples by which a lag that was found may be wrong since steps of the torque may lie anywhere between two of them: what it is then is the lag of
    /// this torque, beside which all else is right.
    pub(crate) of_steps: f64,
}

/// Samples of a lag that are not told, up to where its rate is no line any more.
pub(crate) fn untold_lag(decided: &Decided, weak: &WeakRows) -> f64 {
    decided.untold_lag.min(UNKNOWN * weak.function.half_width() as f64)
}

impl Session<'_, '_, '_> {
    /// The covariance of the constants from the noise, beside a lag if one was sought.
    pub(crate) fn covariance_of(
        &mut self,
        problem: &Problem<'_>,
        weak: &WeakRows,
        decided: &Decided,
        (fit, all): (&Fit, &Fit),
        errors: &Errors,
    ) -> Result<BesideLag, Error> {
        let mut found = if let Some(found) = self.beside_lag(problem, weak, decided, fit, errors)? {
            found
        } else {
            let covariance = self.covariance_by_errors(problem, decided, all, errors)?;
            BesideLag { covariance, untold: None, of_steps: 0.0 }
        };
        for entry in &mut found.covariance {
            *entry *= errors.inflation;
        }
        Ok(found)
    }

    /// The covariance of the constants of a fit from what errors are made from. What few windows leave is not what noise of low frequencies is, for they
    /// follow it: where that gives a negative variance, the noise of the channels is taken to be as large.
    fn covariance_by_errors(
        &mut self,
        problem: &Problem<'_>,
        decided: &Decided,
        all: &Fit,
        errors: &Errors,
    ) -> Result<Vec<f64>, Error> {
        let covariance = all.covariance(problem, &errors.covariance, &mut self.stages)?;
        if has_variances(&covariance) {
            return Ok(covariance);
        }
        let of_channels = decided.covariance.clone().with_variance(errors.covariance.variance());
        all.covariance(problem, &of_channels, &mut self.stages)
    }

    /// The same as `covariance_of` beside a lag, or `None` if none was sought or all is not determined beside it.
    fn beside_lag(
        &mut self,
        problem: &Problem<'_>,
        weak: &WeakRows,
        decided: &Decided,
        fit: &Fit,
        errors: &Errors,
    ) -> Result<Option<BesideLag>, Error> {
        if !self.finds_lag() {
            return Ok(None);
        }
        let (mut model, mut rows) = (decided.ordered(), decided.rows(&weak.rows).clone());
        let wanted = model.constant.len();
        let rhs = decided.rhs(&rows).to_vec();
        let rate = self.rate();
        let followed = self.beside_slow(&rows, &rows.regressors[rate].value, decided)?;
        let Some(Followed { left, by }) = followed else { return Ok(None) };
        rows.regressors[rate].value = left;
        model.constant.push(rate);
        let problem = model.problem(&rows, &rhs, self.noise[0], problem.correlated.as_ref());
        let Some(all) = fit.again(&problem, errors.expected, self.options.instructions, &mut self.stages)? else {
            return Ok(None);
        };
        let both = self.covariance_by_errors(&problem, decided, &all, errors)?;
        let moved = all.moved_by_rows(&problem, wanted..wanted + 1, &mut self.stages)?.swap_remove(0);
        let rate_column = Some(rows.regressors[rate].value.as_slice());
        let steps = self.by_steps(&moved, StepRows { weak, rate: rate_column, are_white: decided.white.is_some() });
        let of_steps = steps / self.options.delta;
        // What varies slowly follows the lag, too.
        let count = wanted + 1;
        let follows = |one: usize| by.get(one).copied().unwrap_or(0.0);
        let with_lag = |one: usize| both[one * count + wanted] - follows(one) * both[count * count - 1];
        let entry = |one: usize, other: usize| {
            both[one * count + other] - follows(one) * both[other * count + wanted] - follows(other) * with_lag(one)
        };
        let covariance = (0..wanted * wanted).map(|place| entry(place / wanted, place % wanted)).collect();
        let with_rate = &all.pooled.inverse[wanted * count..];
        let seconds = untold_lag(decided, weak) * self.options.delta;
        let change = |one: usize| seconds * (with_rate[one] / with_rate[wanted] - follows(one));
        let changes: Vec<f64> = (0..wanted).map(change).collect();
        let untold = Some(changes).filter(|all| seconds > 0.0 && all.iter().all(|one| one.is_finite()));
        Ok(Some(BesideLag { covariance, untold, of_steps }))
    }
}

/// Whether a covariance says how much each constant is known.
fn has_variances(covariance: &[f64]) -> bool {
    let count = covariance.len().isqrt();
    (0..count).all(|one| covariance[one * (count + 1)] >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::has_variances;

    #[test]
    fn a_variance_is_never_negative() {
        assert!(has_variances(&[1.0, -2.0, -2.0, 0.0]) && has_variances(&[]));
        assert!(!has_variances(&[1.0, 0.0, 0.0, -1e-9]) && !has_variances(&[f64::NAN]));
    }
}
