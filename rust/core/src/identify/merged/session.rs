//! The working data of merged rows: what every step needs of them.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::kinds::Kind;
use crate::identify::merged::colour::{memory, noisy, taper};
use crate::identify::merged::interleaved::{Channels, Interleaved, Weights};
use crate::identify::merged::system::{Entry, Merged, MergedOptions, Multiplied};
use crate::identify::scanned::Scan;
use crate::inference::jumps::jump::Jump;
use crate::noise::correlated::CorrelatedNoise;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::window_length::Scale;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};

/// Exponent of the test function before one is chosen.
pub(crate) const EXPONENT: usize = 9;
/// Half-widths of the test function that windows span while it is chosen.
const PILOT_WINDOW: usize = 4;
/// Fits with the weights that the last one gives.
const WEIGHTINGS: usize = 3;
/// The least noise of an equation, as a part of the torques' root mean square: no channel is known better than rounding lets it be.
pub(crate) const LEAST_NOISE: f64 = 1e-6;

/// So many times the noise of torques an equation without any counts as at least before anything is known of it.
const BEFORE: f64 = 1e4;

/// Merged rows under work.
pub(crate) struct MergedSession<'a, 'b, 'c> {
    pub(crate) merged: &'a Merged<'a>,
    pub(crate) options: &'a MergedOptions,
    /// Variances of the noise of angles and torques.
    pub(crate) noise: [Vec<f64>; 2],
    /// How many times its noise is left of every equation without a torque that is not explained; 1 of others.
    pub(crate) misfits: Vec<f64>,
    /// Whether nothing more is to be set free.
    pub(crate) is_decided: bool,
    /// Whether windows may be over few times.
    pub(crate) has_few_times: bool,
    /// Elements that are windowed although nobody asked for it, since constants leave too much.
    pub(crate) freed: Vec<usize>,
    /// The noise of every angle, and of every torque, with its colour.
    pub(crate) colours: [Vec<CorrelatedNoise>; 2],
    /// The elements' values as far as they are known, those of windowed ones about.
    pub(crate) parameters: Vec<f64>,
    pub(crate) weights: Weights,
    pub(crate) all: Interleaved,
    pub(crate) trials: Vec<Channels>,
    /// Whether the narrowest or widest test function was chosen of all that were tried.
    pub(crate) at_end: bool,
    /// Estimates by the width of the test function; empty where something is windowed or the width was given.
    pub(crate) scan: Scan,
    /// Where windowed elements jump, and all rows where some are left out for that.
    pub(crate) jumps: Vec<Jump>,
    pub(crate) whole: Option<Rows>,
    pub(crate) stages: Stages<'b, 'c>,
}

/// What was chosen and decided of merged rows, to come back to where another choice proves no better.
pub(crate) struct SessionState {
    parameters: Vec<f64>,
    misfits: Vec<f64>,
    freed: Vec<usize>,
    jumps: Vec<Jump>,
    scan: Scan,
    at_end: bool,
    is_decided: bool,
    function: TestFunction,
}

impl MergedSession<'_, '_, '_> {
    /// What was chosen and decided so far.
    pub(crate) fn state(&self) -> SessionState {
        SessionState {
            parameters: self.parameters.clone(),
            misfits: self.misfits.clone(),
            freed: self.freed.clone(),
            jumps: self.jumps.clone(),
            scan: self.scan.clone(),
            at_end: self.at_end,
            is_decided: self.is_decided,
            function: self.all.function,
        }
    }

    /// Comes back to what was chosen and decided, with the rows that belong to it.
    pub(crate) fn restore(&mut self, state: SessionState) -> Result<(), Error> {
        let SessionState { parameters, misfits, freed, jumps, scan, at_end, is_decided, function } = state;
        self.build(function)?;
        (self.parameters, self.misfits, self.freed, self.jumps) = (parameters, misfits, freed, jumps);
        (self.scan, self.at_end, self.is_decided) = (scan, at_end, is_decided);
        self.fill();
        Ok(())
    }

    /// What is windowed and what is constant, as asked or as it had to be.
    pub(crate) fn model(&self) -> Model {
        let unknowns = self.merged.unknowns();
        let is_windowed =
            |place: &usize| self.merged.elements[*place].kind == Kind::Windowed || self.freed.contains(place);
        Model::new(&unknowns, unknowns.iter().map(is_windowed), true)
    }

    /// Builds the rows of all trials with a test function.
    pub(crate) fn build(&mut self, function: TestFunction) -> Result<(), Error> {
        (self.all, self.trials) = Interleaved::build(self.merged, function, self.options.delta, &mut self.stages)?;
        Ok(())
    }

    /// Fills in the columns with the weights that belong to the parameters at hand.
    pub(crate) fn fill(&mut self) {
        self.weights = self.weights_now();
        self.all.fill(self.merged, &self.trials, &self.weights, self.options.delta);
        self.whole = self.exclude_jumps();
    }

    /// Windows of all lengths that the rows hold.
    pub(crate) fn scales(&self) -> Vec<Scale> {
        let times = self.all.rows.len() / self.all.group;
        Scale::grouped(times, self.all.reach() / self.all.group, self.all.group)
    }

    /// A first estimate, in windows of a few test functions.
    pub(crate) fn pilot(&mut self) -> Result<(), Error> {
        self.pilot_of(&self.model()).map(|_| ())
    }

    /// A first estimate of a model, in the rows as they are now.
    fn pilot_of(&mut self, model: &Model) -> Result<Option<Fit>, Error> {
        let mut last = None;
        for _ in 0..WEIGHTINGS {
            self.fill();
            let scale = if model.windowed.is_empty() {
                None
            } else {
                let scales = self.scales();
                let function = self.all.function;
                let wanted = PILOT_WINDOW * function.half_width() / function.stride() * self.all.group;
                Some(scales[Scale::nearest(&scales, wanted).ok_or(self.too_short())?])
            };
            let problem = model.problem(&self.all.rows, &self.all.rows.rhs, 1.0, None);
            let instructions = self.options.instructions;
            let fit = Fit::new(&problem, scale, Expected::UNKNOWN, instructions, &mut self.stages)?;
            let Some(fit) = fit else { return Ok(None) };
            self.remember(model, &fit);
            self.take_misfits(model, &fit)?;
            last = Some(fit);
        }
        Ok(last)
    }

    /// A first estimate of a model as if nothing were known, and what it leaves of the equations, over the noise's: with weights from the
    /// parameters of a wrong model, equations without a torque would hold all that they tie at what that model makes of it.
    pub(crate) fn begin_with(&mut self, model: &Model) -> Result<Option<f64>, Error> {
        self.parameters = self.merged.elements.iter().map(|element| element.known.unwrap_or(0.0)).collect();
        self.misfits.clear();
        let Some(fit) = self.pilot_of(model)? else { return Ok(None) };
        let left = self.left_of_equations(model, &fit)?;
        Ok(Some(left.iter().sum::<f64>() / left.len() as f64).filter(|left| left.is_finite()))
    }

    /// Takes the values of a fit as those of the elements, as far as they are numbers.
    pub(crate) fn remember(&mut self, model: &Model, fit: &Fit) {
        for (place, &element) in model.constant.iter().enumerate() {
            self.parameters[element] = fit.pooled.values[place];
        }
        for (place, &element) in model.windowed.iter().enumerate() {
            self.parameters[element] = fit.median(place);
        }
        self.parameters.iter_mut().filter(|value| !value.is_finite()).for_each(|value| *value = 0.0);
    }

    /// How the noise of an angle enters an equation at the parameters at hand.
    fn mixed(&self, equation: usize, channel: usize) -> Vec<f64> {
        let mut kernel = vec![0.0; self.all.kernels.values[0].len()];
        for (element, parameter) in self.merged.elements.iter().zip(&self.parameters) {
            for Entry { equation: one, of, factor } in &element.entries {
                match *of {
                    Multiplied::Motion { channel: other, coefficient } if *one == equation && other == channel => {
                        let values = &self.all.kernels.values[coefficient];
                        kernel.iter_mut().zip(values).for_each(|(sum, value)| *sum += parameter * factor * value);
                    }
                    _ => {}
                }
            }
        }
        kernel
    }

    /// What every equation is to be divided by, and the noise of the angles.
    fn weights_now(&self) -> Weights {
        let each = self.noise_of_equations().into_iter().enumerate();
        let equations = each.map(|(equation, variance)| 1.0 / (variance * self.factor_of(equation)).sqrt()).collect();
        let angles = self.colours[0].iter().map(|noise| self.all.columns_of(noise)).collect();
        Weights { angles, equations }
    }

    /// The variance of the noise of every equation with the parameters at hand.
    pub(crate) fn noise_of_equations(&self) -> Vec<f64> {
        let equations = self.merged.equations();
        let torque = &self.all.kernels.values[2];
        let variance = |equation: usize| {
            let of_angles = (0..self.merged.channels()).map(|channel| {
                let mixed = self.mixed(equation, channel);
                let (factor, noisy) = noisy(&self.colours[0][channel], &mixed);
                factor * products(&mixed, &noisy, 0)
            });
            let (factor, noisy) = noisy(&self.colours[1][equation], torque);
            factor * products(torque, &noisy, 0) + of_angles.sum::<f64>()
        };
        let each: Vec<f64> = (0..equations).map(variance).collect();
        let least = self.least_variance(&each);
        let is_unknown = self.is_unknown();
        let bounded = |(equation, variance): (usize, &f64)| {
            let least = self.least_of_silent(equation, least).unwrap_or(least);
            let before = if is_unknown && self.is_homogeneous(equation) { BEFORE } else { 1.0 };
            variance.max(least) * before
        };
        each.iter().enumerate().map(bounded).collect()
    }

    /// Whether nothing is known of the parameters yet.
    fn is_unknown(&self) -> bool {
        self.parameters.iter().all(|&value| value == 0.0)
    }

    /// The mean square of the largest torque in its rows.
    pub(crate) fn most_torque(&self) -> f64 {
        let mean = |equation: usize| {
            let of = self.trials.iter().map(|trial| trial.mean_square(equation));
            of.sum::<f64>() / self.trials.len().max(1) as f64
        };
        (0..self.merged.equations()).map(mean).fold(0.0, f64::max)
    }

    /// The variance that no equation's noise is below, of which there are estimates.
    fn least_variance(&self, estimates: &[f64]) -> f64 {
        let most = self.most_torque();
        let noise = self.noise[1].iter().copied().fold(0.0, f64::max);
        let torque = products(&self.all.kernels.values[2], &self.all.kernels.values[2], 0);
        // Before anything is known of the motion, an equation without torque counts as the others do.
        let least = (LEAST_NOISE * LEAST_NOISE * most).max(if self.is_unknown() { noise * torque } else { 0.0 });
        if least > 0.0 {
            return least;
        }
        // Where no torque acts at all, one of which nothing is known yet counts as that with the least noise of the others.
        let known = estimates.iter().copied().filter(|&variance| variance > 0.0).fold(f64::INFINITY, f64::min);
        if known < f64::INFINITY { known } else { 1.0 }
    }

    /// The covariance of the rows as the noise of all channels makes it, and what windows are expected to leave.
    ///
    /// The row at a distance is of the same equation, or of another one of the same trial, which has noise of the same angles.
    pub(crate) fn covariance(&self) -> (RowCovariance, Expected) {
        let (equations, channels, group) = (self.merged.equations(), self.merged.channels(), self.all.group);
        let (stride, torque) = (self.all.function.stride(), &self.all.kernels.values[2]);
        let mixed: Vec<Vec<Vec<f64>>> = (0..equations)
            .map(|equation| (0..channels).map(|channel| self.mixed(equation, channel)).collect())
            .collect();
        let of_angles: Vec<Vec<(f64, Vec<f64>)>> = mixed
            .iter()
            .map(|each| each.iter().zip(&self.colours[0]).map(|(kernel, noise)| noisy(noise, kernel)).collect())
            .collect();
        let of_torques: Vec<_> = self.colours[1].iter().map(|noise| noisy(noise, torque)).collect();
        let weights = &self.weights.equations;
        // Between a row of one equation and a row of another so many times later.
        let between = |one: usize, other: usize, times: usize| {
            let from_angles = (0..channels)
                .map(|channel| {
                    let (factor, noisy) = &of_angles[one][channel];
                    factor * products(&mixed[other][channel], noisy, times * stride)
                })
                .sum::<f64>();
            let (factor, noisy) = &of_torques[one];
            let taper = taper(&self.colours[1][one], torque.len(), times * stride);
            let of_torque = if one == other { taper * factor * products(torque, noisy, times * stride) } else { 0.0 };
            weights[one] * weights[other] * (from_angles + of_torque)
        };
        let memory = self.colours.iter().flatten().map(|noise| memory(noise, torque.len())).max().unwrap_or(0);
        let times = (torque.len() + memory).div_ceil(stride);
        let distances = (times - 1) * group + equations;
        let mut lags = vec![0.0; distances * equations];
        for time in 0..times {
            for one in 0..equations {
                for other in 0..equations {
                    if let Some(lag) = (time * group + other).checked_sub(one).filter(|_| time > 0 || other >= one) {
                        lags[lag * equations + one] += between(one, other, time);
                    }
                }
            }
        }
        let of_torque = (0..equations)
            .map(|one| {
                let (factor, noisy) = &of_torques[one];
                weights[one].powi(2) * factor * products(torque, noisy, 0) / equations as f64
            })
            .sum();
        let known = if (0..equations).all(|one| lags[one] <= 0.0) {
            // Without any noise rows count as if each had some of its own.
            RowCovariance::white()
        } else {
            RowCovariance::of_equations(equations, distances, |lag, one| lags[lag * equations + one])
        };
        let expected = Expected::new(&known, of_torque);
        (known, expected)
    }

    /// Samples of the longest trial.
    pub(crate) fn longest(&self) -> usize {
        let longest = self.merged.trials.iter().map(|trial| trial.angles[0].len()).max().unwrap_or(0);
        longest.min(self.merged.samples)
    }

    /// The exponent that is asked for, or that rows are made with before one is chosen.
    pub(crate) fn exponent(&self) -> usize {
        self.options.exponent.unwrap_or(EXPONENT)
    }

    pub(crate) fn too_short(&self) -> Error {
        let samples = self.longest();
        Error::RecordTooShortForWindows { samples, least: (16 * LEAST_HALF_WIDTH).max(samples + 1) }
    }
}

/// The sum of products of a kernel and another one so many samples later.
fn products(one: &[f64], other: &[f64], lag: usize) -> f64 {
    one.iter().zip(other.get(lag..).unwrap_or_default()).map(|(a, b)| a * b).sum()
}
