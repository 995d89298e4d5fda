//! Equations without a torque, which any multiple of their parameters satisfies, none at all best.
//!
//! Where such an equation is wrong, as long as a spring that changes is taken as constant, it pulls its parameters towards zero, and weights
//! that follow from smaller parameters are larger and pull more. So what it leaves counts as its noise while it is not explained, and
//! its parameters are not trusted if it stays so.
//!
//! That alone does not hold them. Let the equations with a torque hold a factor `s` on these parameters with a ratio `r` of signal to noise. The
//! next factor is `r / (r + 1 / s²)`, which ends at `(1 + √(1 - 4 / r)) / 2`: 15 % too low where the ratio is 8, and at zero below 4. Where one is
//! wrong, all therefore count a hundred times less in addition: then equations with a torque say what they share with them, and they say only
//! what no other equation holds, for which their weight does not matter. All alike, since one may be held by another alone, but for every step
//! away from a torque a hundred times less again where only constants are asked for: of two without one, the farther would draw to zero what
//! they share.

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::{LEAST_NOISE, MergedSession};
use crate::identify::merged::system::Multiplied;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::residuals::{residuals, usual_variance};

/// What is left of an equation, over the variance of its noise, from which on it is wrong.
const WRONG: f64 = 1.5;
/// So many times less it counts then, for every step to an equation with a torque, and after how many steps it is no less.
const LESS: f64 = 100.0;
const FARTHEST: i32 = 4;
/// The misfit of an equation of which nothing is left: beyond that of any other.
const DRAWN_TO_ZERO: f64 = 1e12;
/// A part of other torques, squared, that no variance is below: weights stay numbers.
const NEVER: f64 = 1e-40;

impl MergedSession<'_, '_, '_> {
    /// Whether no torque acts on a mass.
    pub(crate) fn is_silent(&self, equation: usize) -> bool {
        self.noise[1].get(equation) == Some(&0.0) && self.trials.iter().all(|trial| trial.mean_square(equation) == 0.0)
    }

    /// The variance that the noise of an equation without a torque is not below: a part of its own terms. A part of other torques would be more than
    /// all of its terms where its parameters are drawn to zero, and nothing would seem to be left of it.
    pub(crate) fn least_of_silent(&self, equation: usize, of_torques: f64) -> Option<f64> {
        let least = LEAST_NOISE * LEAST_NOISE * self.square_of_terms(equation);
        Some(least.max(NEVER * of_torques)).filter(|_| least > 0.0 && self.is_homogeneous(equation))
    }

    /// The sum of the mean squares of the terms of an equation.
    fn square_of_terms(&self, equation: usize) -> f64 {
        let each = self.merged.elements.iter().zip(&self.parameters);
        let squares = each.flat_map(|(element, parameter)| {
            let entries = element.entries.iter().filter(|entry| entry.equation == equation);
            entries.map(move |entry| (parameter * entry.factor).powi(2) * self.mean_square_of(entry.of))
        });
        squares.sum()
    }

    /// Whether any multiple of the parameters of an equation satisfies it: nothing of it is known.
    pub(crate) fn is_homogeneous(&self, equation: usize) -> bool {
        let known = self.merged.elements.iter().filter(|element| element.known.is_some_and(|value| value != 0.0));
        let mut entries = known.flat_map(|element| &element.entries);
        self.is_silent(equation) && entries.all(|entry| entry.equation != equation)
    }

    /// By how much the variance of an equation counts as more than that of its noise: alike for all that are homogeneous and as near to a torque, since
    /// one may be held by another alone.
    pub(crate) fn factor_of(&self, equation: usize) -> f64 {
        let misfit = |equation: usize| self.misfits.get(equation).copied().unwrap_or(1.0);
        if !self.is_homogeneous(equation) {
            return misfit(equation);
        }
        let homogeneous = (0..self.merged.equations()).filter(|&other| self.is_homogeneous(other));
        let most = homogeneous.map(misfit).fold(1.0, f64::max);
        // Where something may be set free, windows are compared on these rows before their equation is explained: they must count.
        let steps = if self.is_held_by_torques() { self.steps_to_a_torque(equation) } else { 1 };
        if most > 1.0 { LESS.powi(steps) * most } else { 1.0 }
    }

    /// Whether nothing is to be set free, so that equations may count less for every step to a torque.
    fn is_held_by_torques(&self) -> bool {
        self.is_decided || self.asks_for_constants()
    }

    /// Whether an element multiplies no motion and stands in equations alone that any multiple of their parameters satisfies: windows that follow it would
    /// take whatever else is left there.
    pub(crate) fn takes_all(&self, element: usize) -> bool {
        let mut entries = self.merged.elements[element].entries.iter();
        entries.all(|entry| matches!(entry.of, Multiplied::Term(_)) && self.is_homogeneous(entry.equation))
    }

    /// How many equations stand between a homogeneous one and one with a torque, with this one: those that share an unknown are neighbours.
    fn steps_to_a_torque(&self, equation: usize) -> i32 {
        let share = |one: usize, other: usize| {
            let unknown = self.merged.elements.iter().filter(|element| element.known.is_none());
            unknown.map(|element| &element.entries).any(|entries| {
                [one, other].iter().all(|&equation| entries.iter().any(|entry| entry.equation == equation))
            })
        };
        let (mut reached, mut steps) = (vec![equation], 0);
        while steps < FARTHEST && reached.iter().all(|&one| self.is_homogeneous(one)) {
            let is_next = |other: &usize| reached.contains(other) || reached.iter().any(|&one| share(one, *other));
            reached = (0..self.merged.equations()).filter(is_next).collect();
            steps += 1;
        }
        steps
    }

    /// A fit with equations that count less for every step to a torque, where one that no torque acts on is wrong and nothing more is to be set
    /// free that could explain it.
    pub(crate) fn held_by_torques(&mut self, fitted: MergedFit) -> Result<MergedFit, Error> {
        let is_far = |equation: usize| self.is_homogeneous(equation) && self.steps_to_a_torque(equation) > 1;
        let is_right = fitted.misfit <= NOISE_MODEL_FAILS;
        if self.is_held_by_torques() || is_right || !(0..self.merged.equations()).any(is_far) {
            return Ok(fitted);
        }
        self.is_decided = true;
        self.begin_with(&fitted.model)?;
        Ok(match self.fitted(&fitted.model)? {
            Some(again) => fitted.with_values_of(again),
            None => fitted,
        })
    }

    /// The mean square of a regressor in the rows of all trials.
    fn mean_square_of(&self, regressor: Multiplied) -> f64 {
        let sum: f64 = self.trials.iter().map(|trial| trial.square(regressor)).sum();
        sum / self.trials.len().max(1) as f64
    }

    /// What a fit, of which the parameters were taken, leaves of the usual row of every equation, over the variance of its noise.
    pub(crate) fn left_of_equations(&mut self, model: &Model, fit: &Fit) -> Result<Vec<f64>, Error> {
        let problem = model.problem(&self.all.rows, &self.all.rows.rhs, 1.0, None);
        let (left, usable) = residuals(&problem, fit, &mut self.stages)?;
        let equations = self.merged.equations();
        // Rows were divided by what the parameters before made of the noise.
        let noise = self.noise_of_equations();
        let of = |equation: usize| {
            let rows: Vec<bool> =
                usable.iter().enumerate().map(|(row, usable)| *usable && row % equations == equation).collect();
            let divided = self.weights.equations[equation].powi(2) * noise[equation];
            usual_variance(&left, &rows).map_or(0.0, |variance| variance / divided)
        };
        Ok((0..equations).map(of).collect())
    }

    /// What is left of an equation without a torque, over the variance of its noise, from which on it is wrong: one that no other holds is pulled
    /// by less.
    fn wrong(&self, equation: usize) -> f64 {
        if self.is_homogeneous(equation) { WRONG } else { NOISE_MODEL_FAILS }
    }

    /// Takes what a fit leaves of equations without a torque for their noise, where that does not explain it.
    pub(crate) fn take_misfits(&mut self, model: &Model, fit: &Fit) -> Result<(), Error> {
        if !(0..self.merged.equations()).any(|equation| self.is_silent(equation)) {
            return Ok(());
        }
        let left = self.left_of_equations(model, fit)?;
        let of = |(equation, &left): (usize, &f64)| {
            if left > self.wrong(equation) && self.is_silent(equation) { left } else { 1.0 }
        };
        self.misfits = left.iter().enumerate().map(of).collect();
        Ok(())
    }

    /// The largest misfit of an equation without a torque, and more than any where the parameters of one were drawn to zero.
    pub(crate) fn misfit(&self) -> f64 {
        let least = LEAST_NOISE * LEAST_NOISE * self.most_torque();
        let is_zero = |equation: usize| self.is_homogeneous(equation) && self.square_of_terms(equation) < least;
        let zero = (0..self.merged.equations()).any(is_zero);
        self.misfits.iter().copied().fold(if zero { DRAWN_TO_ZERO } else { 1.0 }, f64::max)
    }
}
