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
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Model {
    pub(crate) windowed: Vec<usize>,
    pub(crate) constant: Vec<usize>,
    /// Whether windowed coefficients may grow linearly within a window.
    pub(crate) linear: bool,
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
            jumps: &rows.jumps,
            period: rows.period,
            noise: self.row_noise(rows, &rows.rhs_noise, noise),
        }
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
        let mut rhs_noise = rows.rhs_noise.clone();
        for (&regressor, constant) in self.constant.iter().zip(constants) {
            let kernel = &rows.regressors[regressor].noise[0];
            rhs_noise.resize(rhs_noise.len().max(kernel.len()), 0.0);
            rhs_noise.iter_mut().zip(kernel).for_each(|(sum, value)| *sum -= constant * value);
        }
        let noise = rest.row_noise(rows, &rhs_noise, noise);
        Problem { layout: rest.layout(), constants: Vec::new(), rhs, noise, ..whole.clone() }
    }

    fn row_noise(&self, rows: &Rows, rhs: &[f64], noise: f64) -> RowNoise {
        let kernels = |regressors: &[usize], which: usize| -> Vec<&[f64]> {
            regressors.iter().map(|&index| rows.regressors[index].noise[which].as_slice()).collect()
        };
        let windowed = [kernels(&self.windowed, 0), kernels(&self.windowed, 1)];
        RowNoise::new(&[windowed.concat(), kernels(&self.constant, 0), vec![rhs]].concat(), noise)
    }
}
