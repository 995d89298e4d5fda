//! Bandwidths of slow coefficients.

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::inference::bandwidths::outward;
use crate::inference::slow_curve::Varying;
use crate::inference::slow_equations::{QUADRATIC, Slow};
use crate::inference::slow_lengths::SlowSearch;
use crate::inference::slow_predictions::{PredictedBy, PredictedRows, Prediction};
use crate::regression::problem::Problem;
use crate::regression::window_length::Scale;

/// The curves of one bandwidth, without equations near each row and with all, and what noise is more with them than expected.
pub(crate) struct BestCurve {
    pub(crate) terms: usize,
    pub(crate) curves: [Varying; 2],
    pub(crate) reach: f64,
    pub(crate) excess: f64,
}

impl SlowSearch<'_> {
    /// The curves of the bandwidth that predicts best, or the first one where nothing is compared.
    pub(crate) fn best_curve(
        &self,
        equations: &Slow<'_>,
        problem: &Problem<'_>,
        (scale, compared): (Scale, Option<PredictedBy>),
        (reaches, last): (&[f64], Option<f64>),
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<BestCurve>, Error> {
        let &Self { expected, simpler, instructions, .. } = self;
        let triangles = equations.equations(problem);
        let rows = PredictedRows::new(equations, problem, scale);
        let mut best: Option<BestCurve> = None;
        let mut least = f64::INFINITY;
        let mut consider = |terms: usize, reach: f64| -> Result<bool, Error> {
            if best.is_some() && compared.is_none() {
                return Ok(false);
            }
            let fitted = equations.fit(&triangles, terms, (reach, hole(scale)), instructions, stages)?;
            let Some(curves) = fitted else { return Ok(false) };
            let Prediction { error, excess } = rows.error(&curves, compared, expected);
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
pub(crate) fn hole(scale: Scale) -> f64 {
    (scale.span() / 2 + scale.reach) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prediction_leaves_out_the_rows_of_the_windows_around_and_those_that_share_samples_with_it() {
        for scale in Scale::all(400, 7) {
            assert!((hole(scale) - (scale.span() / 2 + 7) as f64).abs() < f64::EPSILON);
        }
    }
}
