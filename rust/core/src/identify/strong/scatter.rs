//! The scatter of windows, compared with their standard errors.
//!
//! Ordinary least squares assume independent equations and constant unknowns within a window. Neither holds: derivatives at
//! neighbouring samples come from nearly the same samples, and unknowns that change within a window bias it. Windows that share no
//! equation show both effects. The second difference of three of them, `x₀ − (x₋ + x₊)/2`, has the variance `v₀ + (v₋ + v₊)/4` if
//! their variances are right, and a steady drift adds nothing to it. An error common to all windows cannot be found this way.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::identify::strong::streaming::{
    Chunk, Identified, StrongRecord, equations, identify_parts, variance_inflations,
};
use crate::lanes::output::Elements;
use crate::least_squares::plan::{Regressions, RollingLeastSquares};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::noise::median::{MEDIAN_OF_SQUARES, median};
use crate::record::subsample::stretches;

/// Windows that are looked at in a long record, and in how many stretches at most.
const MOST_WINDOWS: usize = 1 << 15;
const STRETCHES: usize = 8;

/// Differences that begin within the distance of two windows, which is a multiple of it.
const DENSITY: usize = 8;

/// A squared difference counts at most so many times what the median says of its mean: a jump is no error of the windows around it.
const MOST: f64 = 25.0;

/// What windows around samples say: unknowns and their standard errors, one slice an unknown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track<'a> {
    /// Values by unknown.
    pub(crate) values: &'a [&'a [f64]],
    /// Standard errors by unknown.
    pub(crate) errors: &'a [&'a [f64]],
}

/// By how much standard errors of windowed unknowns exceed those of ordinary least squares: one factor an unknown, in every record.
///
/// The tracks hold what [`identify_parts`] found at every sample. The factors are never less than one. Where
/// a record is too short for windows that share no equation they come from the correlation of the residuals. They cost well below a
/// millisecond.
///
/// # Errors
/// If a record is shorter than the window of the polynomials.
pub(crate) fn scatter(
    derivatives: &LocalPolynomials,
    least_squares: &RollingLeastSquares,
    records: &[(&StrongRecord<'_>, Track<'_>)],
) -> Result<Vec<Vec<f64>>, Error> {
    let mut all = Vec::new();
    for (record, track) in records {
        let factors = scatter_of(derivatives, least_squares.window(), record.motion.angle.len(), *track);
        all.push(or_variance_inflations(factors, derivatives, least_squares, record)?);
    }
    Ok(all)
}

/// Identifies some samples of every record as [`identify_parts`] does, for outputs of which not every sample has an element, and returns
/// the factors of [`scatter`] as well: the windows that they need, 32 768 or so, are solved in the same go.
///
/// # Errors
/// If a record is shorter than the window of the polynomials, or the watch cancels.
pub(crate) fn identify_with_scatter(
    derivatives: &LocalPolynomials,
    least_squares: &RollingLeastSquares,
    records: Vec<(&StrongRecord<'_>, Range<usize>, Identified<'_>)>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Vec<f64>>, Error> {
    let taken = |record: &StrongRecord<'_>| -> Vec<Taken> {
        let motion = &record.motion;
        let compared = Compared::new(derivatives, least_squares.window(), motion.angle.len());
        let stretches = compared.stretches().into_iter();
        stretches.map(|around| Taken::empty(motion.unknowns(), around, &compared)).collect()
    };
    let all: Vec<&StrongRecord<'_>> = records.iter().map(|(record, ..)| *record).collect();
    let mut taken: Vec<Vec<Taken>> = all.iter().map(|record| taken(record)).collect();
    let mut parts = Vec::new();
    for ((record, wanted, identified), taken) in records.into_iter().zip(&mut taken) {
        parts.push((record, (wanted, identified)));
        parts.extend(taken.iter_mut().map(|taken| (record, (taken.around.clone(), taken.outputs()))));
    }
    identify_parts(derivatives, least_squares, parts, workers, watch)?;
    let each = all.into_iter().zip(taken);
    each.map(|(record, taken)| {
        or_variance_inflations(factors(record.motion.unknowns(), taken), derivatives, least_squares, record)
    })
    .collect()
}

/// The factors of one record, from the correlation of its residuals where windows give none.
fn or_variance_inflations(
    factors: Option<Vec<f64>>,
    derivatives: &LocalPolynomials,
    least_squares: &RollingLeastSquares,
    record: &StrongRecord<'_>,
) -> Result<Vec<f64>, Error> {
    match factors {
        Some(factors) => Ok(factors),
        None => variance_inflations(derivatives, record, &mut Chunk::new(derivatives, least_squares.columns())),
    }
}

/// Which windows are compared.
struct Compared {
    /// Samples from one window of a difference to the next: they share no equation, nor nearly any of the polynomials' windows.
    distance: usize,
    /// Samples around which a full window of equations lies.
    inside: Range<usize>,
}

impl Compared {
    fn new(derivatives: &LocalPolynomials, window: usize, samples: usize) -> Self {
        let rows = equations(derivatives, samples);
        Self {
            distance: (window + derivatives.options().window_length / 2).next_multiple_of(DENSITY),
            inside: rows.start + window / 2..(rows.end + window / 2 + 1).saturating_sub(window),
        }
    }

    /// Parts of the record that are looked at: none where it is too short for one difference that is independent of another.
    fn stretches(&self) -> Vec<Range<usize>> {
        if self.inside.len() < 3 * self.distance {
            return Vec::new();
        }
        let most = MOST_WINDOWS.max(12 * self.distance);
        let count = (most / (4 * self.distance)).min(STRETCHES);
        let first = self.inside.start;
        stretches(self.inside.len(), most, count).map(|part| first + part.start..first + part.end).collect()
    }
}

/// What windows of a stretch say, one in every eighth of a distance: by unknown.
struct Taken {
    around: Range<usize>,
    step: usize,
    values: Vec<Vec<f64>>,
    errors: Vec<Vec<f64>>,
}

impl Taken {
    fn empty(unknowns: usize, around: Range<usize>, compared: &Compared) -> Self {
        let step = compared.distance / DENSITY;
        let values = vec![vec![0.0; around.len().div_ceil(step)]; unknowns];
        Self { around, step, errors: values.clone(), values }
    }

    /// Picked from the windows around every sample of a record.
    fn of(track: Track<'_>, around: Range<usize>, compared: &Compared) -> Self {
        let step = compared.distance / DENSITY;
        let pick = |columns: &[&[f64]]| {
            let some = columns.iter().map(|column| column[around.clone()].iter().copied().step_by(step).collect());
            some.collect()
        };
        Self { step, values: pick(track.values), errors: pick(track.errors), around }
    }

    /// Where windows that are solved for it go.
    fn outputs(&mut self) -> Identified<'_> {
        let regressions = Regressions {
            elements: Elements { first: self.around.start, step: self.step },
            parameters: self.values.iter_mut().map(Vec::as_mut_slice).collect(),
            errors: self.errors.iter_mut().map(Vec::as_mut_slice).collect(),
            ..Regressions::default()
        };
        Identified { regressions, order: &mut [] }
    }

    /// Adds squared differences over the variances that standard errors give them, by unknown.
    fn add(&self, squares: &mut [Vec<f64>]) {
        for ((squares, values), errors) in squares.iter_mut().zip(&self.values).zip(&self.errors) {
            for centre in DENSITY..values.len().saturating_sub(DENSITY) {
                let (before, after) = (centre - DENSITY, centre + DENSITY);
                let difference = values[centre] - f64::midpoint(values[before], values[after]);
                let variance = errors[centre].powi(2) + (errors[before].powi(2) + errors[after].powi(2)) / 4.0;
                let square = difference * difference / variance;
                if square.is_finite() {
                    squares.push(square);
                }
            }
        }
    }
}

/// Samples whose windows are compared in a record of so many.
pub(crate) fn compared_windows(derivatives: &LocalPolynomials, window: usize, samples: usize) -> Vec<Range<usize>> {
    Compared::new(derivatives, window, samples).stretches()
}

/// The scatter of windows that go on coming: the factors so far, from the latest windows.
///
/// They change at windows that follow from their numbers alone, so they do not depend on the pieces that windows come in. After a
/// record that is no longer than what is kept, they are those of [`scatter_of`].
#[derive(Clone, Debug)]
pub(crate) struct Scattering {
    step: usize,
    /// The next window that is looked at, and how many more are until factors change.
    next: usize,
    patience: usize,
    values: Vec<Vec<f64>>,
    errors: Vec<Vec<f64>>,
    factors: Option<Vec<f64>>,
}

impl Scattering {
    /// Of so many unknowns in windows of so many rows.
    pub(crate) fn new(derivatives: &LocalPolynomials, window: usize, unknowns: usize) -> Self {
        let compared = Compared::new(derivatives, window, 0);
        let nothing = vec![Vec::new(); unknowns];
        let (step, next) = (compared.distance / DENSITY, compared.inside.start);
        Self { step, next, patience: 3 * DENSITY, values: nothing.clone(), errors: nothing, factors: None }
    }

    /// The next window that is looked at.
    pub(crate) fn next(&self) -> usize {
        self.next
    }

    /// Looks at that window, or at the one after it that there is.
    pub(crate) fn see<'a>(&mut self, values: impl Iterator<Item = &'a f64>, errors: impl Iterator<Item = &'a f64>) {
        self.values.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
        self.errors.iter_mut().zip(errors).for_each(|(column, error)| column.push(*error));
        self.next += self.step;
        self.patience -= 1;
        if self.patience == 0 {
            self.settle();
            self.patience = DENSITY.max(self.count() / DENSITY);
        }
    }

    /// What standard errors are multiplied by; NaN until windows that share no equation can be compared.
    pub(crate) fn factor(&self, unknown: usize) -> f64 {
        self.factors.as_ref().map_or(f64::NAN, |factors| factors[unknown])
    }

    fn count(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    fn settle(&mut self) {
        let most = MOST_WINDOWS.max(12 * DENSITY * self.step) / self.step;
        let gone = self.count().saturating_sub(most);
        self.values.iter_mut().chain(&mut self.errors).for_each(|column| drop(column.drain(..gone)));
        let taken = Taken { around: 0..0, step: self.step, values: self.values.clone(), errors: self.errors.clone() };
        self.factors = factors(self.values.len(), [taken]).or(self.factors.take());
    }

    /// The numbers that it resumes from: the windows so far, and the factors.
    pub(crate) fn state(&self) -> (usize, usize, Vec<f64>) {
        let windows =
            (0..self.count()).flat_map(|place| self.values.iter().chain(&self.errors).map(move |one| one[place]));
        let factors = (0..self.values.len()).map(|unknown| self.factor(unknown));
        (self.next, self.patience, factors.chain(windows).collect())
    }

    /// Goes on from there.
    pub(crate) fn resume(&mut self, (next, patience, numbers): (usize, usize, &[f64])) {
        let unknowns = self.values.len();
        let (factors, windows) = numbers.split_at(unknowns.min(numbers.len()));
        self.factors =
            (factors.len() == unknowns && factors.iter().all(|factor| !factor.is_nan())).then(|| factors.to_vec());
        (self.next, self.patience) = (next, patience);
        for window in windows.chunks_exact(2 * unknowns.max(1)) {
            let columns = self.values.iter_mut().chain(&mut self.errors);
            columns.zip(window).for_each(|(column, value)| column.push(*value));
        }
    }
}

/// The scatter of windows around every sample of a record over their standard errors, or `None` if the record is too short.
pub(crate) fn scatter_of(
    derivatives: &LocalPolynomials,
    window: usize,
    samples: usize,
    track: Track<'_>,
) -> Option<Vec<f64>> {
    let compared = Compared::new(derivatives, window, samples);
    factors(track.values.len(), compared.stretches().into_iter().map(|around| Taken::of(track, around, &compared)))
}

/// Columns as slices.
pub(crate) fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

/// The root mean square of the differences of every unknown, robust against single ones, or `None` if an unknown has none.
fn factors(unknowns: usize, taken: impl IntoIterator<Item = Taken>) -> Option<Vec<f64>> {
    let mut squares = vec![Vec::new(); unknowns];
    taken.into_iter().for_each(|taken| taken.add(&mut squares));
    let factor = |squares: &mut Vec<f64>| {
        let most = MOST / MEDIAN_OF_SQUARES * median(squares)?;
        let mean = squares.iter().map(|square| square.min(most)).sum::<f64>() / squares.len() as f64;
        Some(mean.sqrt().max(1.0))
    };
    squares.iter_mut().map(factor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::newey_west::tests::white;

    /// The factor of one unknown with the same standard error everywhere.
    fn factor(values: &[f64], error: f64) -> f64 {
        let errors = vec![error; values.len()];
        let (track, all) = (Track { values: &[values], errors: &[&errors] }, 0..values.len());
        let taken = Taken::of(track, all.clone(), &Compared { distance: 24, inside: all });
        factors(1, [taken]).expect("long enough")[0]
    }

    // 13 000 differences: the root of their mean square scatters by a hundredth.
    const CHANCE: f64 = 0.05;

    #[test]
    fn errors_that_are_right_keep_their_size_and_others_get_it() {
        let values = white(40_000, 3);
        for (stated, expected) in [(1.0, 1.0), (0.25, 4.0), (4.0, 1.0)] {
            assert!((factor(&values, stated) / expected - 1.0).abs() < CHANCE);
        }
    }

    #[test]
    fn a_drift_and_a_jump_are_no_errors() {
        let noise = white(40_000, 5);
        let drifting: Vec<f64> = (0..40_000).map(|row| noise[row] + 0.01 * row as f64).collect();
        // Of 13 000 differences 16 reach over the jump, each of which counts 25 times at most.
        let jumping: Vec<f64> = (0..40_000).map(|row| noise[row] + if row < 20_000 { 0.0 } else { 1e6 }).collect();
        for values in [drifting, jumping] {
            assert!((factor(&values, 1.0) - 1.0).abs() < CHANCE);
        }
    }

    #[test]
    fn a_record_too_short_for_differences_has_no_stretches() {
        let compared = Compared { distance: 100, inside: 50..349 };
        assert!(compared.stretches().is_empty());
        let stretches = Compared { inside: 50..350, ..compared }.stretches();
        assert_eq!((stretches.len(), stretches.first()), (1, Some(&(50..350))));
    }
}
