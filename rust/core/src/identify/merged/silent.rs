//! Equations without a torque, which any multiple of their parameters satisfies, none at all best.
//!
//! Where such an equation is wrong, as long as a spring that changes is taken as constant, it pulls its parameters towards zero, and weights
//! that follow from smaller parameters are larger and pull more. So what it leaves counts as its noise while it is not explained, and
//! its parameters are not trusted if it stays so.

use crate::error::Error;
use crate::identify::merged::session::MergedSession;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::residuals::{residuals, usual_variance};

impl MergedSession<'_, '_, '_> {
    /// Whether no torque acts on a mass.
    pub(crate) fn is_silent(&self, equation: usize) -> bool {
        self.noise[1].get(equation) == Some(&0.0) && self.trials.iter().all(|trial| trial.mean_square(equation) == 0.0)
    }

    /// What a fit leaves of the usual row of every equation, over the variance of its noise.
    pub(crate) fn left_of_equations(&mut self, model: &Model, fit: &Fit) -> Result<Vec<f64>, Error> {
        let problem = model.problem(&self.all.rows, &self.all.rows.rhs, 1.0, None);
        let (left, usable) = residuals(&problem, fit, &mut self.stages)?;
        let equations = self.merged.equations();
        let of = |equation: usize| {
            let rows: Vec<bool> =
                usable.iter().enumerate().map(|(row, usable)| *usable && row % equations == equation).collect();
            let misfit = self.misfits.get(equation).unwrap_or(&1.0);
            usual_variance(&left, &rows).map_or(0.0, |variance| variance * misfit)
        };
        Ok((0..equations).map(of).collect())
    }

    /// Takes what a fit leaves of equations without a torque for their noise, where that does not explain it.
    pub(crate) fn take_misfits(&mut self, model: &Model, fit: &Fit) -> Result<(), Error> {
        if !(0..self.merged.equations()).any(|equation| self.is_silent(equation)) {
            return Ok(());
        }
        let left = self.left_of_equations(model, fit)?;
        let of = |(equation, &left): (usize, &f64)| {
            if left > NOISE_MODEL_FAILS && self.is_silent(equation) { left } else { 1.0 }
        };
        self.misfits = left.iter().enumerate().map(of).collect();
        Ok(())
    }

    /// The largest misfit of an equation without a torque.
    pub(crate) fn misfit(&self) -> f64 {
        self.misfits.iter().copied().fold(1.0, f64::max)
    }
}
