//! The choice of the test function of merged rows: that of every equation as if its mass stood alone, and their mean.

use std::f64::consts::PI;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::system::Multiplied;
use crate::noise::channel::weighted_variance;
use crate::noise::spectrum::power_in_pieces;
use crate::record::samples::{Samples, is_usable};
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};
use crate::weak_form::test_function_choice::{Candidates, Evidence, half_widths, spectrum_length};

/// Rounds of choosing the test function and estimating what the choice depends on.
const ROUNDS: usize = 6;

/// Variances of the noise of every angle and of every torque, of a sample of weight one: means over the trials.
pub(crate) fn noise_of(session: &mut MergedSession<'_, '_, '_>) -> Result<[Vec<f64>; 2], Error> {
    if let Some((angles, torques)) = &session.options.noise {
        return Ok([angles.clone(), torques.clone()]);
    }
    let instructions = session.options.instructions;
    let merged = session.merged;
    let mut pieces = Vec::new();
    for trial in &merged.trials {
        let channels = trial.angles.iter().chain(&trial.torques);
        pieces.extend(channels.map(|one| Piece { size: one.len(), content: (*one, trial.weights) }));
    }
    let level = |(channel, weights): (&dyn Samples, Option<&[f64]>), (): &mut ()| {
        (weighted_variance(channel, weights, None, instructions), counted(channel, weights))
    };
    let levels = session.stages.map(pieces, || (), level)?;
    let each = merged.channels() + merged.equations();
    let mean = |place: usize| {
        let of = levels.iter().skip(place).step_by(each);
        let (sum, weights) = of.fold((0.0, 0.0), |(sum, weights), (variance, samples)| {
            (sum + variance * *samples as f64, weights + *samples as f64)
        });
        if weights > 0.0 { sum / weights } else { 0.0 }
    };
    Ok([(0..merged.channels()).map(mean).collect(), (merged.channels()..each).map(mean).collect()])
}

/// Samples of a channel that are there and have a weight: a trial that lacks a channel tells nothing of its noise.
fn counted(channel: &dyn Samples, weights: Option<&[f64]>) -> usize {
    let mut samples = vec![0.0; channel.len()];
    channel.read(0, &mut samples);
    let weight = |place: usize| weights.is_none_or(|weights| weights[place] > 0.0);
    samples.iter().enumerate().filter(|&(place, sample)| is_usable(*sample) && weight(place)).count()
}

impl MergedSession<'_, '_, '_> {
    /// Chooses half-width and exponent where they are not given, and builds the rows.
    pub(crate) fn choose(&mut self) -> Result<(), Error> {
        if self.options.window_length.is_some() || !self.asks_for_constants() {
            return self.choose_by_spectra();
        }
        if !self.spectra_tell() {
            return self.onto_plateau(None);
        }
        self.choose_by_spectra()?;
        self.onto_plateau(Some(self.all.function))
    }

    /// Chooses them by the spectra of the angles.
    fn choose_by_spectra(&mut self) -> Result<(), Error> {
        let delta = self.options.delta;
        let width = self.options.window_length.map(|length| length / 2);
        let longest = self.merged.trials.iter().map(|trial| trial.angles[0].len()).max().unwrap_or(0);
        let widest = self.longest() / 16;
        let length = spectrum_length(longest, 200);
        let periods = (0..self.merged.equations()).map(|one| Ok(self.evidence(one, length)?.period()));
        let periods = periods.collect::<Result<Vec<f64>, Error>>()?;
        let typical = periods.iter().copied().fold(f64::INFINITY, f64::min).min(widest as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the record's length")]
        let typical = (typical.round() as usize).max(LEAST_HALF_WIDTH);
        let widths = width.map_or_else(|| half_widths((4 * typical).min(widest)), |width| vec![width]);
        let Some(&widest) = widths.last() else { return Err(self.too_short()) };
        let length = spectrum_length(longest, widest);
        let mut candidates = Vec::new();
        let equations = self.merged.equations();
        let no_force = (0..equations).all(|equation| self.is_silent(equation));
        for equation in 0..equations {
            let evidence = self.evidence(equation, length)?;
            // Beside a force that is known to be zero there is no noise of a torque to weigh the angle's with. Where none acts at all that of
            // the angle counts alone: motion is slow, and a function as wide as it hides what a spring does.
            let is_told = no_force && evidence.unknown.contains(&true);
            if evidence.noise[1] > 0.0 || equations == 1 || is_told {
                let share = |half: usize| self.merged.share(half);
                candidates.push((
                    equation,
                    Candidates::new(evidence, &widths, self.options.exponent, share, &mut self.stages)?,
                ));
            }
        }
        let start = width.unwrap_or_else(|| typical.min(widest));
        let mut current = TestFunction::new(start, self.exponent(), delta)?;
        let mut tried = Vec::new();
        loop {
            self.build(current)?;
            if no_force {
                // What another width made of a wrong model would hold all that no force holds.
                self.begin_with(&self.model())?;
            } else {
                self.pilot()?;
            }
            let best: Vec<TestFunction> =
                candidates.iter().filter_map(|(one, tried)| tried.best(self.alone(*one))).collect();
            let Some(first) = best.first().filter(|_| tried.len() < ROUNDS) else { break };
            let mean = best.iter().map(|one| (one.half_width() as f64).ln()).sum::<f64>() / best.len() as f64;
            let away = |half: &usize| ((*half as f64).ln() - mean).abs();
            let half = widths.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(start);
            let next = TestFunction::new(half, first.exponent(), delta)?;
            if next == current || tried.contains(&next) {
                break;
            }
            tried.push(current);
            current = next;
        }
        self.at_end =
            width.is_none() && [widths.first(), widths.last()].contains(&Some(&self.all.function.half_width()));
        Ok(())
    }

    /// What the choice is made from, for the equation of one mass.
    fn evidence(&mut self, equation: usize, length: usize) -> Result<Evidence, Error> {
        let channel = equation.min(self.merged.channels() - 1);
        let mut power: Vec<f64> = Vec::new();
        let mut count = 0.0;
        for trial in &self.merged.trials {
            if trial.angles[channel].len() < length {
                continue;
            }
            let one = power_in_pieces(trial.angles[channel], trial.weights, length, &mut self.stages)?;
            if one.iter().all(|value| value.is_finite()) {
                power.resize(one.len(), 0.0);
                power.iter_mut().zip(one).for_each(|(sum, value)| *sum += value);
                count += 1.0;
            }
        }
        power.resize(length / 2 + 1, 0.0);
        for sum in &mut power {
            *sum /= f64::max(count, 1.0);
        }
        let samples = self.merged.trials.iter().map(|trial| trial.angles[channel].len()).sum();
        let unknown = std::array::from_fn(|coefficient| {
            let is_it = |of: Multiplied| of == Multiplied::Motion { channel, coefficient };
            let of = |entry: &crate::identify::merged::system::Entry| entry.equation == equation && is_it(entry.of);
            self.merged.elements.iter().any(|one| one.known.is_none() && one.entries.iter().any(of))
        });
        let noise = [self.noise[0][channel], self.noise[1][equation]];
        let colour = &self.colours[0][channel];
        let density = |bin: usize| colour.density(2.0 * PI * bin as f64 / length as f64);
        let coloured = (!colour.is_white()).then(|| (0..power.len()).map(density).collect());
        Ok(Evidence { power, samples, noise, coloured, delta: self.options.delta, unknown })
    }

    /// Inertia, damping and stiffness of a mass with everything else held.
    fn alone(&self, equation: usize) -> [f64; 3] {
        let channel = equation.min(self.merged.channels() - 1);
        std::array::from_fn(|coefficient| {
            let of = Multiplied::Motion { channel, coefficient };
            let each = self.merged.elements.iter().zip(&self.parameters);
            let sum = each.flat_map(|(element, value)| {
                let entries = element.entries.iter().filter(move |one| one.equation == equation && one.of == of);
                entries.map(move |entry| entry.factor * value)
            });
            let sum = sum.sum::<f64>();
            if coefficient == 1 { sum.max(0.0) } else { sum }
        })
    }
}

impl crate::identify::merged::system::Merged<'_> {
    /// The share of the samples that may be centres of rows of a half-width.
    fn share(&self, half: usize) -> f64 {
        let (inside, all) = self
            .trials
            .iter()
            .map(|trial| trial.angles[0].len())
            .fold((0, 0), |(inside, all), one| (inside + one.saturating_sub(2 * half), all + one));
        inside as f64 / (all as f64).max(1.0)
    }
}
