//! Bandwidths of slow coefficients.

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::inference::bandwidths::outward;
use crate::inference::slow_curve::Varying;
use crate::inference::slow_equations::{QUADRATIC, Slow};
use crate::inference::slow_lengths::SlowSearch;
use crate::inference::slow_predictions::{PredictedBy, PredictedRows};
use crate::regression::problem::Problem;
use crate::regression::subsample::Compare;
use crate::regression::window_length::Scale;

/// The curves of one bandwidth, without equations near each row and with all, and what noise is more with them than expected.
#[derive(Clone, Debug)]
pub(crate) struct BestCurve {
    pub(crate) terms: usize,
    pub(crate) curves: [Varying; 2],
    pub(crate) reach: f64,
    pub(crate) excess: f64,
}

/// The bandwidths of a round.
pub(crate) struct Bandwidths<'a> {
    pub(crate) reaches: &'a [f64],
    /// Every so many of them are tried, and those beside the best ones where these predict better than constants do.
    pub(crate) every: usize,
    /// The last round's.
    pub(crate) last: Option<f64>,
    /// In which ways they are compared: there is a best one by each.
    pub(crate) ways: &'a [PredictedBy],
    /// Whether windows compare any: else the first one stands.
    pub(crate) compares: bool,
    /// The rows that compare them.
    pub(crate) rows: Compare,
}

impl SlowSearch<'_> {
    /// The curves of the bandwidths that predict best, by each way to compare them, or of the first one where nothing is compared. None where curves are not
    /// determined.
    pub(crate) fn best_curves(
        &self,
        equations: &Slow<'_>,
        problem: &Problem<'_>,
        scale: Scale,
        bandwidths: &Bandwidths<'_>,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<BestCurve>, Error> {
        let &Self { expected, simpler, instructions, .. } = self;
        let &Bandwidths { reaches, every, last, ways, compares, rows } = bandwidths;
        let triangles = equations.equations(problem);
        let rows = PredictedRows::new(equations, problem, (scale, rows));
        let mut best: Vec<(f64, BestCurve)> = Vec::new();
        let mut consider = |best: &mut Vec<(f64, BestCurve)>, terms: usize, reach: f64| -> Result<bool, Error> {
            if !best.is_empty() && !compares {
                return Ok(false);
            }
            let fitted = equations.fit(&triangles, terms, (reach, hole(scale)), instructions, stages)?;
            let Some(curves) = fitted else { return Ok(false) };
            let prediction = rows.error(&curves, if compares { ways } else { &[] }, expected);
            let counts = |way: PredictedBy| if terms == 1 { simpler * prediction.by(way) } else { prediction.by(way) };
            let found = BestCurve { terms, curves, reach, excess: prediction.excess };
            if best.is_empty() {
                best.extend(ways.iter().map(|&way| (counts(way), found.clone())));
                return Ok(true);
            }
            let mut is_better = false;
            for (&way, best) in ways.iter().zip(best).filter(|(way, (least, _))| counts(**way) < *least) {
                *best = (counts(way), found.clone());
                is_better = true;
            }
            Ok(is_better)
        };
        let sparse: Vec<f64> = reaches.iter().copied().step_by(every).collect();
        outward(&sparse, last, |reach| consider(&mut best, QUADRATIC, reach))?;
        if every > 1 && compares {
            let worth = best.iter().filter(|(least, _)| *least < self.before).map(|(_, best)| best.reach);
            for reach in beside(reaches, every, worth) {
                consider(&mut best, QUADRATIC, reach)?;
            }
        }
        // Between jumps a coefficient may be constant.
        if !self.breaks.is_empty() {
            consider(&mut best, 1, 2.0 * self.rows.len() as f64)?;
        }
        Ok(best.into_iter().map(|(_, curve)| curve).collect())
    }
}

/// Bandwidths that were left out beside the best of every so many.
fn beside(reaches: &[f64], every: usize, best: impl Iterator<Item = f64>) -> Vec<f64> {
    let best: Vec<f64> = best.collect();
    let is_near = |place: usize| {
        let near = &reaches[place.saturating_sub(every - 1)..(place + every).min(reaches.len())];
        best.iter().any(|best| near.contains(best))
    };
    (0..reaches.len()).filter(|place| place % every > 0 && is_near(*place)).map(|place| reaches[place]).collect()
}

/// Rows on either side that a prediction leaves out.
pub(crate) fn hole(scale: Scale) -> f64 {
    (scale.span() / 2 + scale.reach) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bandwidths_beside_the_best_of_every_so_many_are_those_between_it_and_its_neighbours() {
        let reaches = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let found = |every: usize, best: &[f64]| beside(&reaches, every, best.iter().copied());
        assert_eq!(found(2, &[3.0]), [2.0, 4.0]);
        assert_eq!(found(2, &[1.0]), [2.0]);
        assert_eq!(found(3, &[4.0]), [2.0, 3.0, 5.0, 6.0]);
        // The best ones of two ways to compare share what lies between them.
        assert_eq!(found(2, &[3.0, 5.0]), [2.0, 4.0, 6.0]);
        assert!(found(2, &[]).is_empty() && found(1, &[3.0]).is_empty());
    }

    #[test]
    fn a_prediction_leaves_out_the_rows_of_the_windows_around_and_those_that_share_samples_with_it() {
        for scale in Scale::all(400, 7) {
            assert!((hole(scale) - (scale.span() / 2 + 7) as f64).abs() < f64::EPSILON);
        }
    }
}
