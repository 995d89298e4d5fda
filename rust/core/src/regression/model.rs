//! The model: which unknowns of the equation of motion are windowed, and which are constant over the record.

use std::sync::Arc;

use crate::equation::rows::{Regressor, Rows};
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::regression::layout::Layout;
use crate::regression::noise_correction::RowNoise;
use crate::regression::problem::{Correlated, Problem};
use crate::regression::row_covariance::RowCovariance;

/// The regressors of the rows, by the kind of their coefficients.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Model {
    pub(crate) windowed: Vec<usize>,
    pub(crate) constant: Vec<usize>,
    /// Whether windowed coefficients may grow linearly within a window.
    pub(crate) linear: bool,
    /// Regressors that were taken off the right-hand side, and by which coefficient about: it has their noise.
    pub(crate) taken: Vec<(usize, f64)>,
}

impl Model {
    /// Sorts unknowns by whether they belong to windows.
    pub(crate) fn new(unknowns: &[usize], windowed: impl Iterator<Item = bool>, linear: bool) -> Self {
        let mut model = Self { linear, ..Self::default() };
        for (&index, windowed) in unknowns.iter().zip(windowed) {
            if windowed { model.windowed.push(index) } else { model.constant.push(index) }
        }
        model
    }

    pub(crate) fn layout(&self) -> Layout {
        Layout { windowed: self.windowed.len(), linear: self.linear, constant: self.constant.len() }
    }

    /// The windowed regressors times the covariance of the rows.
    pub(crate) fn correlated(
        &self,
        rows: &Rows,
        covariance: &RowCovariance,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Arc<Correlated>, Error> {
        let of = |pick: fn(&Regressor) -> &Vec<f64>| -> Vec<&[f64]> {
            self.windowed.iter().map(|&index| pick(&rows.regressors[index]).as_slice()).collect()
        };
        let (values, companions) = (of(|regressor| &regressor.value), of(|regressor| &regressor.companion));
        covariance.correlated(&values, &companions, rows.period, stages).map(Arc::new)
    }

    /// The least-squares problem of some rows, with a right-hand side. `noise` is the variance of the angle's noise.
    pub(crate) fn problem<'a>(
        &self,
        rows: &'a Rows,
        rhs: &'a [f64],
        noise: f64,
        correlated: Option<&Arc<Correlated>>,
    ) -> Problem<'a> {
        let of = |regressors: &[usize], pick: fn(&Regressor) -> &Vec<f64>| -> Vec<&'a [f64]> {
            regressors.iter().map(|&index| pick(&rows.regressors[index]).as_slice()).collect()
        };
        Problem {
            layout: self.layout(),
            correlated: correlated.cloned(),
            windowed: of(&self.windowed, |regressor| &regressor.value),
            companions: of(&self.windowed, |regressor| &regressor.companion),
            constants: of(&self.constant, |regressor| &regressor.value),
            rhs,
            usable: &rows.usable,
            // What is constant does not jump.
            jumps: if self.windowed.is_empty() { &[] } else { &rows.jumps },
            period: rows.period,
            roots: &rows.roots,
            noise: self.row_noise(rows, &self.rhs_noise(rows), noise),
        }
    }

    /// The problem of another right-hand side than that of the rows: what is taken off theirs, and the noise that comes with it, is none of its own.
    pub(crate) fn problem_of_another<'a>(&self, rows: &'a Rows, rhs: &'a [f64], noise: f64) -> Problem<'a> {
        let noise = self.row_noise(rows, &[], noise);
        Problem { noise, ..self.problem(rows, rhs, 0.0, None) }
    }

    /// The problem that remains once the constants are known: the same windows with fewer columns and the same numbers.
    pub(crate) fn without_constants<'a>(
        &self,
        rows: &Rows,
        whole: &Problem<'a>,
        rhs: &'a [f64],
        constants: &[f64],
        noise: f64,
    ) -> Problem<'a> {
        let rest = Self { constant: Vec::new(), ..self.clone() };
        let mut without = self.clone();
        without.taken.extend(self.constant.iter().copied().zip(constants.iter().copied()));
        let noise = rest.row_noise(rows, &without.rhs_noise(rows), noise);
        Problem { layout: rest.layout(), constants: Vec::new(), rhs, noise, ..whole.clone() }
    }

    /// The noise of the angle in the right-hand side.
    fn rhs_noise(&self, rows: &Rows) -> Vec<f64> {
        let mut noise = rows.rhs_noise.clone();
        for &(regressor, factor) in &self.taken {
            let kernel = &rows.regressors[regressor].noise[0];
            noise.resize(noise.len().max(kernel.len()), 0.0);
            noise.iter_mut().zip(kernel).for_each(|(sum, value)| *sum -= factor * value);
        }
        noise
    }

    fn row_noise(&self, rows: &Rows, rhs: &[f64], noise: f64) -> RowNoise {
        let kernels = |regressors: &[usize], which: usize| -> Vec<&[f64]> {
            regressors.iter().map(|&index| rows.regressors[index].noise[which].as_slice()).collect()
        };
        let windowed = [kernels(&self.windowed, 0), kernels(&self.windowed, 1)];
        RowNoise::new(&[windowed.concat(), kernels(&self.constant, 0), vec![rhs]].concat(), noise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::dyadic_windows::{WindowShape, solve_windows};
    use crate::regression::predictor::without_constants;
    use crate::regression::simulated::{CONSTANTS, assert_near, model, rows};
    use crate::regression::solved::local;
    use crate::simd::instructions::Instructions;

    /// Rows whose regressors have noise, each another.
    fn noisy_rows() -> Rows {
        let mut rows = rows(60, |time| [1.0 + 0.1 * time, 0.1], 0.3);
        for (index, regressor) in rows.regressors.iter_mut().enumerate() {
            regressor.noise = [vec![1.0, index as f64, 0.5], vec![0.0, 1.0, -1.0]];
        }
        rows
    }

    #[test]
    fn unknowns_are_sorted_by_what_they_belong_to() {
        let model = Model::new(&[0, 2, 3, 5], [false, true, false, true].into_iter(), true);
        assert_eq!((model.windowed.as_slice(), model.constant.as_slice()), ([2, 5].as_slice(), [0, 3].as_slice()));
        assert_eq!(model.layout(), Layout { windowed: 2, linear: true, constant: 2 });
    }

    #[test]
    fn a_problem_has_the_columns_of_its_unknowns() {
        let rows = rows(9, |_| [1.0, 0.0], 0.0);
        let model = Model { windowed: vec![2], constant: vec![0], linear: false, ..Model::default() };
        let problem = model.problem(&rows, &rows.rhs, 0.0, None);
        assert_eq!(problem.windowed, [rows.regressors[2].value.as_slice()]);
        assert_eq!(problem.companions, [rows.regressors[2].companion.as_slice()]);
        assert_eq!(problem.constants, [rows.regressors[0].value.as_slice()]);
        assert!(problem.noise.is_zero());
    }

    #[test]
    fn what_was_taken_off_leaves_its_noise() {
        let rows = noisy_rows();
        let whole = model();
        let problem = whole.problem(&rows, &rows.rhs, 0.01, None);
        let rhs = without_constants(&problem, &CONSTANTS);
        // The constants beside what was taken of them are zero, and a row's noise is the same.
        let beside = Model { taken: whole.constant.iter().copied().zip(CONSTANTS).collect(), ..whole.clone() };
        let rest = Model { constant: Vec::new(), ..beside.clone() }.problem(&rows, &rhs, 0.01, None);
        let beside = beside.problem(&rows, &rhs, 0.01, None);
        let known = whole.without_constants(&rows, &problem, &rhs, &CONSTANTS, 0.01);
        let columns = |problem: &Problem<'_>| 2 * problem.layout.windowed + problem.layout.constant + 1;
        let of = |problem: &Problem<'_>| {
            let mut factors = vec![0.0; columns(problem)];
            (factors[0], factors[columns(problem) - 1]) = (2.0, -1.0);
            problem.noise.variance(&factors)
        };
        assert_near(of(&rest), of(&known), 1e-12);
        assert_near(of(&beside), of(&known), 1e-12);
        assert!((of(&rest) / problem.noise.variance(&[2.0, 0.0, 0.0, 0.0, -1.0]) - 1.0).abs() > 0.1);
    }

    #[test]
    fn windows_without_known_constants_have_the_same_numbers() {
        let rows = noisy_rows();
        let model = model();
        // The noise of a constant's regressor is that of the right-hand side once it is taken off.
        for noise in [0.0, 0.01] {
            let whole = model.problem(&rows, &rows.rhs, noise, None);
            let rhs = without_constants(&whole, &CONSTANTS);
            let rest = model.without_constants(&rows, &whole, &rhs, &CONSTANTS, noise);
            let shapes = [WindowShape::of(0..20, 1)];
            let [whole, rest] = [&whole, &rest]
                .map(|problem| solve_windows(problem, 1, &(0..40), &shapes, Instructions::Scalar).swap_remove(0));
            for window in 0..40 {
                for unknown in 0..2 {
                    let expected = local(&whole, window, &CONSTANTS, unknown);
                    assert_near(local(&rest, window, &[], unknown), expected, 1e-10);
                }
            }
        }
    }
}
