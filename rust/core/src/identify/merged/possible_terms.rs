//! What equations of masses may lack: dry friction, a spring that hardens and a drag, of the motion of each mass and of that between two, as
//! columns of one more constant each.

use crate::equation::rows::Regressor;
use crate::equation::terms::BuiltInTerm;
use crate::error::Error;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::system::Multiplied;
use crate::identify::weak::friction::{Sliding, expected_sign};
use crate::inference::missing_terms::Missing;
use crate::noise::spectrum::bridge;
use crate::record::samples::read_around;
use crate::weak_form::weak_rows::TermSamples;

/// What may be lacking: functions of a velocity and of an angle.
pub(crate) const FRICTION: &str = "coulomb";
const SPRING: &str = "cubic";
const DRAG: &str = "quadratic_drag";

/// Columns whose cosine is as large are of one term.
const SAME: f64 = 0.9;

/// Samples of every trial.
type ByTrial = Vec<Vec<f64>>;

/// The motion that a term is a function of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotionOf {
    /// The mass, which is an equation, too.
    pub mass: usize,
    /// The channel that it moves against: another mass or the base. None where it moves on its own.
    pub against: Option<usize>,
}

/// A term that may be missing, and its column among the regressors.
pub(crate) struct PossibleTerm {
    pub(crate) motion: MotionOf,
    pub(crate) missing: Missing,
    pub(crate) column: usize,
}

impl MergedSession<'_, '_, '_> {
    /// Adds the columns of what may be missing, and says what they are: not where trials are aligned on a phase, and in equations of masses
    /// that a torque acts on and a spring holds.
    pub(crate) fn candidates(&mut self) -> Result<Vec<PossibleTerm>, Error> {
        let mut candidates = Vec::new();
        if self.merged.trials.iter().any(|trial| trial.position.is_some()) {
            return Ok(candidates);
        }
        let equations = 0..self.merged.equations();
        let alone = equations.clone().filter(|&mass| self.has_spring(mass));
        let alone = alone.map(|mass| MotionOf { mass, against: None });
        let motions: Vec<MotionOf> =
            alone.chain(self.joints()).filter(|one| !self.equations_of(*one).is_empty()).collect();
        let mut possible = Vec::new();
        for motion in motions {
            let of = self.samples_of(motion)?.into_iter();
            possible.extend(of.map(|(missing, samples)| (motion, missing, samples)));
        }
        let samples: Vec<Vec<&[f64]>> =
            possible.iter().map(|(_, _, samples)| samples.iter().map(Vec::as_slice).collect()).collect();
        let mut columns: Vec<Regressor> = vec![Regressor::default(); possible.len()];
        for equation in equations {
            let sign = |motion| self.equations_of(motion).into_iter().find(|(one, _)| *one == equation);
            let here: Vec<(usize, f64)> = possible
                .iter()
                .enumerate()
                .filter_map(|(place, (motion, ..))| sign(*motion).map(|(_, sign)| (place, sign)))
                .collect();
            if here.is_empty() {
                continue;
            }
            let of_trial = |trial: usize| -> Vec<TermSamples<'_>> {
                here.iter().map(|(place, _)| TermSamples::Given(&samples[*place][trial])).collect()
            };
            let terms: Vec<_> = (0..self.merged.trials.len()).map(of_trial).collect();
            for ((place, sign), own) in here.iter().zip(self.columns_of(equation, &terms)?) {
                add(&mut columns[*place], *sign, own);
            }
        }
        let is_kept = |place: usize| {
            let (motion, missing, _) = &possible[place];
            // Against a base that hardly moves a mass moves as it does on its own: a structure says which of them is held.
            let is_against = possible.iter().zip(&columns).any(|((other, same, _), column)| {
                other.mass == motion.mass
                    && same == missing
                    && other.against.is_some()
                    && are_alike(column, &columns[place])
            });
            (motion.against.is_some() || !is_against) && !self.is_given(motion.mass, &columns[place])
        };
        let kept: Vec<bool> = (0..possible.len()).map(is_kept).collect();
        for (((motion, missing, _), regressor), _) in possible.into_iter().zip(columns).zip(kept).filter(|one| one.1) {
            candidates.push(PossibleTerm { motion, missing, column: self.all.rows.regressors.len() });
            self.all.rows.regressors.push(regressor);
        }
        Ok(candidates)
    }

    /// Equations in which a term of a motion acts, with its sign there.
    pub(crate) fn equations_of(&self, motion: MotionOf) -> Vec<(usize, f64)> {
        let there = motion.against.filter(|&other| other < self.merged.equations()).map(|other| (other, -1.0));
        [(motion.mass, 1.0)].into_iter().chain(there).filter(|(equation, _)| !self.is_silent(*equation)).collect()
    }

    /// Whether the angle of an equation's mass pulls a spring in it.
    fn has_spring(&self, equation: usize) -> bool {
        let mut entries = self.merged.elements.iter().flat_map(|element| &element.entries);
        entries.any(|entry| {
            entry.equation == equation && entry.of == Multiplied::Motion { channel: equation, coefficient: 2 }
        })
    }

    /// Masses that a spring or a damper connects, and a mass and the moving base.
    fn joints(&self) -> Vec<MotionOf> {
        let equations = self.merged.equations();
        let mut found: Vec<MotionOf> = Vec::new();
        for element in &self.merged.elements {
            for entry in &element.entries {
                let Multiplied::Motion { channel, coefficient: coefficient @ 1.. } = entry.of else { continue };
                let is_own = |of: Multiplied| of == Multiplied::Motion { channel: entry.equation, coefficient };
                // What is no mass is a base, if the same element holds the mass; the momenta of a mechanism stand alone.
                let is_base = element.entries.iter().any(|one| one.equation == entry.equation && is_own(one.of));
                if channel == entry.equation || (channel >= equations && !is_base) {
                    continue;
                }
                let (mass, other) = if channel < equations {
                    (entry.equation.min(channel), entry.equation.max(channel))
                } else {
                    (entry.equation, channel)
                };
                let joint = MotionOf { mass, against: Some(other) };
                if !found.contains(&joint) {
                    found.push(joint);
                }
            }
        }
        found
    }

    /// Terms of a motion at every sample, by trial.
    fn samples_of(&mut self, motion: MotionOf) -> Result<Vec<(Missing, ByTrial)>, Error> {
        let (delta, workers, instructions) = (self.options.delta, self.stages.workers, self.options.instructions);
        let [mut friction, mut spring, mut drag] = [const { Vec::new() }; 3];
        for trial in &self.merged.trials {
            let mut angle = vec![0.0; trial.angles[motion.mass].len()];
            read_around(trial.angles[motion.mass], 0, &mut angle);
            if let Some(other) = motion.against {
                let mut against = vec![0.0; angle.len()];
                read_around(trial.angles[other], 0, &mut against);
                angle.iter_mut().zip(against).for_each(|(angle, other)| *angle -= other);
            }
            spring.push(angle.iter().map(|angle| angle.powi(3)).collect());
            // Equations near a gap ask for the velocity there, too.
            bridge(&mut angle);
            let angle = angle.as_slice();
            let sliding = self.stages.stage(|watch| Sliding::of(&angle, (delta, instructions), workers, watch))?;
            let signs = sliding.velocity.iter().zip(&sliding.errors).map(|(&one, &error)| expected_sign(one, error));
            // At rest friction may be anything.
            friction.push(signs.map(|sign| if sign.is_nan() { 0.0 } else { sign }).collect());
            let squares = sliding.velocity.iter().map(|velocity| velocity * velocity.abs());
            drag.push(squares.map(|square| if square.is_nan() { 0.0 } else { square }).collect());
        }
        let each = [(FRICTION, friction), (SPRING, spring), (DRAG, drag)];
        let named = each.into_iter().filter_map(|(name, samples)| Some((BuiltInTerm::named(name)?, samples)));
        Ok(named.map(|(term, samples)| (Missing::Term(term), samples)).collect())
    }

    /// Whether one of the terms of an equation is nearly a multiple of a column.
    fn is_given(&self, equation: usize, column: &Regressor) -> bool {
        let (equations, group) = (self.merged.equations(), self.all.group);
        let entries = self.merged.elements.iter().flat_map(|element| &element.entries);
        let terms = entries.filter(|entry| entry.equation == equation && matches!(entry.of, Multiplied::Term(_)));
        terms.into_iter().any(|entry| {
            let (mut both, mut own, mut other) = (0.0, 0.0, 0.0);
            for (number, trial) in self.trials.iter().enumerate() {
                for (time, term) in trial.regressor(entry.of).value.iter().enumerate() {
                    let row = time * group + number * equations + equation;
                    if let Some(value) = column.value.get(row).filter(|value| **value != 0.0) {
                        both += value * term;
                        own += value * value;
                        other += term * term;
                    }
                }
            }
            both.abs() > SAME * (own * other).sqrt()
        })
    }
}

/// Adds the rows of one equation to a column.
fn add(column: &mut Regressor, sign: f64, of_equation: Regressor) {
    if column.value.is_empty() {
        *column = Regressor { value: vec![0.0; of_equation.value.len()], ..of_equation.clone() };
    }
    column.value.iter_mut().zip(of_equation.value).for_each(|(sum, value)| *sum += sign * value);
}

/// Whether two columns are nearly multiples of each other.
fn are_alike(one: &Regressor, other: &Regressor) -> bool {
    let product = |one: &[f64], other: &[f64]| -> f64 { one.iter().zip(other).map(|(a, b)| a * b).sum() };
    let sizes = product(&one.value, &one.value) * product(&other.value, &other.value);
    product(&one.value, &other.value).abs() > SAME * sizes.sqrt()
}
