//! Constants that swing, as damping over a stride does, beside equations that leave hardly more than noise.
//!
//! Eighths of the records that hold a cycle or more are alike, and a damping that swings by half leaves a tenth more than the noise: no more than a noise that
//! is known to a tenth. So what short parts tell beyond chance is followed by lines between nodes, all else as it is, and has to explain what is more than
//! the noise, and that better than friction or a spring that hardens.

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::identify::merged::suspected_terms::sum_of_squares;
use crate::inference::constancy::Test;
use crate::inference::part_constants::TestNoise;
use crate::inference::short_parts::{LEFT_OF_SWINGS, Swinging, shortest, swinging};
use crate::regression::residuals::residuals;

/// Standard deviations of the mean square of what is left, by which it may be more than the noise by chance.
const BY_CHANCE: f64 = 2.0;
/// Probability below which short parts differ by no chance, whatever else is tested.
const FAR_BEYOND_CHANCE: f64 = 1e-5;
/// The part of what a swing explains that terms may explain in its place.
const BY_TERMS: f64 = 0.5;

/// A constant that differs between short parts of the records.
pub(crate) struct Swing {
    pub(crate) element: usize,
    pub(crate) test: Test,
    /// Times of the longest parts that hardly hide by how much.
    times: usize,
}

impl Swing {
    /// Whether parts differ by no chance, whatever else is tested.
    pub(crate) fn is_far_beyond_chance(&self) -> bool {
        self.test.probability < FAR_BEYOND_CHANCE
    }
}

impl MergedSession<'_, '_, '_> {
    /// Constants of the motion that differ between short parts of the records, those first that differ most: none where no more is left than noise leaves by
    /// chance.
    pub(crate) fn swinging(&mut self, fitted: &MergedFit) -> Result<Vec<Swing>, Error> {
        if fitted.error < 1.0 + BY_CHANCE * self.deviation_by_chance(fitted) {
            return Ok(Vec::new());
        }
        let NoiseOfRows { covariance, expected, inflation, from } = NoiseOfRows::of_channels(fitted);
        let rows = &self.all.rows;
        let problem = fitted.model.problem(rows, &rows.rhs, 1.0, Some(&fitted.correlated));
        let noise =
            TestNoise { expected, covariance: &covariance, inflation, from, equations: self.merged.equations() };
        let constants = &fitted.model.constant;
        let may = |one: &usize| self.merged.elements[*one].is_of_motion() && self.is_tried(*one);
        let may: Vec<bool> = constants.iter().map(may).collect();
        let found = swinging(&problem, (&fitted.fit, &may), noise, self.options.instructions, &mut self.stages)?;
        let group = self.all.group;
        let swing = |one: Swinging| Swing {
            element: constants[one.constant],
            test: one.test,
            times: (one.length / group).max(1),
        };
        Ok(found.into_iter().map(swing).collect())
    }

    /// The standard deviation of the mean square of what noise leaves of the rows.
    fn deviation_by_chance(&self, fitted: &MergedFit) -> f64 {
        let usable = self.all.rows.usable.iter().filter(|usable| **usable).count();
        (2.0 * fitted.expected.variance_inflation / usable.max(1) as f64).sqrt()
    }

    /// Those of some swings that explain what is more than noise, with what each leaves.
    pub(crate) fn told_swings(&mut self, fitted: &MergedFit, swings: Vec<Swing>) -> Result<Vec<(Swing, f64)>, Error> {
        let swings: Vec<Swing> = swings.into_iter().filter(Swing::is_far_beyond_chance).collect();
        if swings.is_empty() {
            return Ok(Vec::new());
        }
        let most = self.most_left_of_swings(fitted);
        let residuals = self.left_of(fitted)?;
        let left = |one: &Swing| fitted.error - self.explained_by_swing(fitted, &residuals, (one.element, one.times));
        let told = swings.into_iter().map(|one| (left(&one), one)).filter(|(left, _)| *left < most);
        let mut told: Vec<(Swing, f64)> = told.map(|(left, one)| (one, left)).collect();
        if !told.is_empty() {
            let by_terms = self.explained_by_terms(fitted, &residuals)?;
            told.retain(|(_, left)| by_terms < BY_TERMS * (fitted.error - left));
        }
        Ok(told)
    }

    /// What a swing that explains all but noise leaves of rows at most, over the noise's variance.
    pub(crate) fn most_left_of_swings(&self, fitted: &MergedFit) -> f64 {
        1.0 + LEFT_OF_SWINGS * (fitted.error - 1.0) + BY_CHANCE * self.deviation_by_chance(fitted)
    }

    /// Constants that differ between short parts, if lines between nodes that are as far apart leave less than so much of rows for any, but for some: to
    /// compare parts takes longer.
    pub(crate) fn swinging_well(
        &mut self,
        fitted: &MergedFit,
        most: f64,
        but_for: &[usize],
    ) -> Result<Vec<Swing>, Error> {
        let residuals = self.left_of(fitted)?;
        let times = (shortest(self.all.rows.len(), fitted.fit.span) / self.all.group).max(1);
        let of =
            |&one: &usize| self.merged.elements[one].is_of_motion() && self.is_tried(one) && !but_for.contains(&one);
        let leaves = |one: usize| fitted.error - self.explained_by_swing(fitted, &residuals, (one, times));
        let mut of_motion = fitted.model.constant.iter().copied().filter(of);
        if of_motion.any(|one| leaves(one) < most) { self.swinging(fitted) } else { Ok(Vec::new()) }
    }

    /// What the mean square of rows falls by, over the noise's, where an element follows lines between nodes so many times apart, all else as it is, beyond
    /// what chance explains so.
    fn explained_by_swing(
        &self,
        fitted: &MergedFit,
        (left, usable): &(Vec<f64>, Vec<bool>),
        (element, times): (usize, usize),
    ) -> f64 {
        let (rows, group) = (&self.all.rows, self.all.group);
        let regressor = &rows.regressors[element];
        let lines = (rows.len() / group).div_ceil(times).max(1);
        let (mut squares, mut beside, mut sums) = (vec![0.0; lines + 1], vec![0.0; lines], vec![0.0; lines + 1]);
        let used = || (0..rows.len()).filter(|&row| usable[row]);
        let per_time = 1.0 / (times as f64 * rows.period);
        for row in used() {
            let time = row / group;
            let line = (time / times).min(lines - 1);
            let later = (time - line * times) as f64 / times as f64;
            let value = regressor.value[row];
            let steeper = regressor.companion.get(row).map_or(0.0, |one| one * per_time);
            let [first, second] = [(1.0 - later) * value - steeper, later * value + steeper];
            squares[line] += first * first;
            squares[line + 1] += second * second;
            beside[line] += first * second;
            sums[line] += first * left[row];
            sums[line + 1] += second * left[row];
        }
        let noise = fitted.expected.variance;
        let by_chance = (lines + 1) as f64 * fitted.expected.variance_inflation * noise;
        let explained = explained(squares, &beside, sums) - by_chance;
        explained.max(0.0) / used().count().max(1) as f64 / noise
    }

    /// What it falls by beside friction and springs that harden.
    fn explained_by_terms(&mut self, fitted: &MergedFit, before: &(Vec<f64>, Vec<bool>)) -> Result<f64, Error> {
        let first = self.all.rows.regressors.len();
        let columns: Vec<usize> = self.candidates()?.iter().map(|one| one.column).collect();
        let rows = &self.all.rows;
        let noise = NoiseOfRows::of_channels(fitted);
        let judged = noise.judged(rows, fitted, &fitted.correlated, self.options.instructions);
        let mut explained = 0.0;
        if let Some((problem, fit)) = judged.beside(&columns, &mut self.stages)? {
            let count = before.1.iter().filter(|usable| **usable).count().max(1) as f64;
            let fallen = sum_of_squares(before) - sum_of_squares(&residuals(&problem, &fit, &mut self.stages)?);
            explained = fallen / count / fitted.expected.variance;
        }
        self.all.rows.regressors.truncate(first);
        Ok(explained)
    }
}

/// What a sum of squares falls by with columns of which only neighbours overlap: their squares, products of neighbours, and products with what is explained.
fn explained(mut squares: Vec<f64>, beside: &[f64], mut sums: Vec<f64>) -> f64 {
    let mut explained = 0.0;
    for place in 0..squares.len() {
        if place > 0 && squares[place - 1] > 0.0 {
            let factor = beside[place - 1] / squares[place - 1];
            squares[place] -= factor * beside[place - 1];
            sums[place] -= factor * sums[place - 1];
        }
        if squares[place] > 0.0 {
            explained += sums[place] * sums[place] / squares[place];
        }
    }
    explained
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_between_nodes_explain_what_lies_on_them_and_nothing_else() {
        // Two lines of four places each, from 1 to 3 to 2 by place, times a column that changes its sign.
        let column = [1.0, -2.0, 0.5, 1.5, -1.0, 2.0, 1.0, -0.5];
        let line = [1.0, 1.5, 2.0, 2.5, 3.0, 2.75, 2.5, 2.25];
        let (mut squares, mut beside, mut sums) = (vec![0.0; 3], vec![0.0; 2], vec![0.0; 3]);
        let mut whole = 0.0;
        for place in 0..8 {
            let (node, later) = (place / 4, (place % 4) as f64 / 4.0);
            let [first, second] = [(1.0 - later) * column[place], later * column[place]];
            let value = line[place] * column[place];
            squares[node] += first * first;
            squares[node + 1] += second * second;
            beside[node] += first * second;
            sums[node] += first * value;
            sums[node + 1] += second * value;
            whole += value * value;
        }
        assert!((explained(squares.clone(), &beside, sums) - whole).abs() < 1e-12 * whole);
        assert!(explained(squares, &beside, vec![0.0; 3]).abs() < f64::MIN_POSITIVE);
    }
}
