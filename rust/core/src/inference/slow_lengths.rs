//! What slow coefficients are searched in, and lengths of windows beside them.

use std::borrow::Cow;
use std::ops::Range;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::inference::cross_validation::{best_length, is_inside, near, rule_out};
use crate::regression::constants::Expected;
use crate::regression::layout::Layout;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::subsample::{few_stretches, places_of, thinned_column, thinned_rows};
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// The data in which slow coefficients are estimated.
pub(crate) struct SlowSearch<'a> {
    pub(crate) rows: &'a Rows,
    /// The slow coefficients come first among its constants.
    pub(crate) model: &'a Model,
    pub(crate) coefficients: usize,
    /// Variance of the angle's noise.
    pub(crate) noise: f64,
    pub(crate) expected: Expected,
    /// Lengths of windows for the windowed coefficients.
    pub(crate) scales: &'a [Scale],
    /// Rows that windows span at most, if that is known.
    pub(crate) longest: Option<usize>,
    /// The error of predicting rows without what varies slowly.
    pub(crate) before: f64,
    /// The error from which on a round is the last: what is only tried is worth no more.
    pub(crate) hopeless: f64,
    /// The first rows after places where they may jump.
    pub(crate) breaks: &'a [usize],
    /// What errors of constants between jumps are multiplied by, in comparison with those of curves.
    pub(crate) simpler: f64,
    pub(crate) instructions: Instructions,
}

/// Few of many rows, and how many of the shortest lengths of windows they hold.
pub(crate) struct FewRows {
    rows: Rows,
    stretches: Vec<Range<usize>>,
    held: usize,
}

impl FewRows {
    pub(crate) fn of(rows: &Rows, scales: &[Scale]) -> Option<Self> {
        let (stretches, held) = few_stretches(rows.len(), scales)?;
        Some(Self { rows: thinned_rows(rows, &stretches), stretches, held })
    }
}

impl SlowSearch<'_> {
    /// The length of windows that predicts best what slow coefficients leave, and its error. Lengths near the best one of the round before are tried
    /// first, and a few rows rule out most of all.
    pub(crate) fn best_length(
        &self,
        problem: &Problem<'_>,
        (rest, before): (&Model, Option<Scale>),
        few: &mut Option<FewRows>,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<(Scale, f64)>, Error> {
        let &Self { noise, expected, scales, instructions, .. } = self;
        let place_of = |scale: Scale| scales.iter().position(|one| *one == scale);
        if let Some(place) = before.and_then(place_of) {
            let near = near(place, scales.len());
            let found = best_length(problem, (scales, &scales[near.clone()]), expected, instructions, stages)?;
            let best = found.and_then(|(best, _)| place_of(best));
            if best.is_some_and(|best| is_inside(best, &near, scales.len())) {
                return Ok(found);
            }
        }
        let left = match few {
            Some(FewRows { rows, stretches, held }) => {
                rows.rhs = thinned_column(problem.rhs, stretches);
                let few = rest.problem(rows, &rows.rhs, noise, None);
                Cow::Owned(rule_out(&few, &places_of(stretches), (scales, *held), expected, instructions, stages)?.0)
            }
            None => Cow::Borrowed(scales),
        };
        best_length(problem, (scales, &left), expected, instructions, stages)
    }

    /// The windows of the next round after one whose windows predict best: as long as those, but for `most`. Where rows are predicted badly without what
    /// varies they must be long enough to compare bandwidths, or the first one would stand.
    pub(crate) fn next_length(&self, best: Scale, most: usize, layout: Layout) -> Scale {
        let scale = self.shortened(best, most);
        let compares = |one: &Scale| !self.is_lost() || one.predicts(layout);
        if compares(&scale) { scale } else { self.scales.iter().copied().find(compares).unwrap_or(scale) }
    }

    /// Whether rows are predicted badly without what varies slowly.
    pub(crate) fn is_lost(&self) -> bool {
        self.before >= NOISE_MODEL_FAILS
    }

    /// Windows of some length, or else the longest of no more than `most` rows.
    pub(crate) fn shortened(&self, scale: Scale, most: usize) -> Scale {
        let short = self.scales.iter().rev().find(|one| one.span() <= most);
        if scale.span() <= most { scale } else { short.or(self.scales.first()).copied().unwrap_or(scale) }
    }
}

#[cfg(test)]
impl<'a> SlowSearch<'a> {
    /// The search for one coefficient in simulated rows whose noise has a deviation.
    pub(crate) fn simulated(rows: &'a Rows, model: &'a Model, scales: &'a [Scale], deviation: f64) -> Self {
        SlowSearch {
            rows,
            model,
            coefficients: 1,
            noise: 0.0,
            expected: crate::regression::simulated::white(deviation * deviation),
            scales,
            longest: None,
            before: 1.0,
            hopeless: f64::INFINITY,
            breaks: &[],
            simpler: 1.0,
            instructions: Instructions::Scalar,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{model, rows};

    #[test]
    fn windows_are_no_longer_than_they_may_be_and_compare_bandwidths_where_rows_are_predicted_badly() {
        let (rows, model, scales) = (rows(400, |_| [1.0, 0.0], 0.1), model(), Scale::all(400, 3));
        let search = SlowSearch::simulated(&rows, &model, &scales, 0.1);
        let (shortest, longest) = (scales[0], *scales.last().expect("lengths"));
        // So many constants that the shortest windows do not hold the rows that determine them.
        let layout = Layout { windowed: 1, linear: true, constant: 2 * shortest.one_sided() };
        assert_eq!(search.shortened(longest, usize::MAX), longest);
        assert_eq!(search.shortened(longest, scales[2].span()).span(), scales[2].span());
        assert_eq!(search.shortened(longest, 0), shortest);
        assert!(!shortest.predicts(layout));
        assert_eq!(search.next_length(shortest, usize::MAX, layout), shortest);
        let lost = SlowSearch { before: NOISE_MODEL_FAILS, ..search };
        let next = lost.next_length(shortest, usize::MAX, layout);
        assert!(next.predicts(layout) && next.span() < longest.span());
        assert_eq!(lost.next_length(longest, usize::MAX, layout), longest);
    }
}
