//! Rows of all equations of all trials, side by side: those of one time follow each other, so that every window holds them all.
//!
//! Row `t·m + j·E + e` is that of equation `e` of trial `j` at time `t`; `m` rows belong to one time. They count as if a part `1/m` of the
//! stride lay between them, and what they say of a coefficient that grows is moved by as much, so nothing is approximated. Every equation
//! is divided by the standard deviation of its noise.

use crate::equation::motion::Coefficient;
use crate::equation::rows::{Regressor, Rows};
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::merged::colour::coloured_kernels;
use crate::identify::merged::system::{Element, Entry, Merged, Multiplied, Trial};
use crate::noise::correlated::CorrelatedNoise;
use crate::weak_form::test_function::{Kernels, TestFunction};
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

/// Rows of everything, and what they were built with.
pub(crate) struct Interleaved {
    pub(crate) function: TestFunction,
    pub(crate) kernels: Kernels,
    pub(crate) rows: Rows,
    /// Rows of one time.
    pub(crate) group: usize,
}

/// The rows of all channels of one trial.
pub(crate) struct Channels {
    each: Vec<WeakRows>,
    /// Mean squares of the regressors of each.
    squares: Vec<Vec<f64>>,
}

/// What is known of the noise: of every angle columns whose products are those of its noise in the kernels, values before slopes, and
/// what every equation is divided by.
#[derive(Clone, Debug)]
pub(crate) struct Weights {
    pub(crate) angles: Vec<[[Vec<f64>; 3]; 2]>,
    pub(crate) equations: Vec<f64>,
}

impl Channels {
    /// Builds the rows of a trial.
    fn build(
        trial: &Trial<'_>,
        function: TestFunction,
        delta: f64,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Self, Error> {
        let mut each = Vec::new();
        for (channel, angle) in trial.angles.iter().enumerate() {
            let torque = trial.torques[channel.min(trial.torques.len() - 1)];
            // Terms stand beside the first angle.
            let terms: &[_] = if channel == 0 { &trial.terms } else { &[] };
            let record = Record {
                angle: *angle,
                torque,
                noise: None,
                coefficients: [Coefficient::Unknown; 3],
                constant: [false; 3],
                terms: terms.iter().map(|&term| TermSamples::Given(term)).collect(),
                constant_terms: false,
                lag: 0.0,
                angle_zero: 0.0,
                mask: trial.mask,
                weights: trial.weights,
            };
            let workers = stages.workers;
            each.push(stages.stage(|watch| WeakRows::build(&record, function, delta, None, workers, watch))?);
        }
        let squares = |WeakRows { rows, .. }: &WeakRows| {
            (0..rows.regressors.len()).map(|regressor| rows.mean_square_of(regressor)).collect()
        };
        let squares = each.iter().map(squares).collect();
        Ok(Self { each, squares })
    }

    /// The mean square of a regressor.
    pub(crate) fn square(&self, of: Multiplied) -> f64 {
        match of {
            Multiplied::Motion { channel, coefficient } => self.squares[channel][coefficient],
            Multiplied::Term(term) => self.squares[0][3 + term],
        }
    }

    /// The mean square of the torque of an equation in the rows.
    pub(crate) fn mean_square(&self, equation: usize) -> f64 {
        self.each[equation.min(self.each.len() - 1)].rows.mean_square()
    }

    fn rows(&self) -> usize {
        self.each.first().map_or(0, |weak| weak.rows.len())
    }

    /// A regressor in a row.
    pub(crate) fn regressor(&self, factor: Multiplied) -> &Regressor {
        match factor {
            Multiplied::Motion { channel, coefficient } => &self.each[channel].rows.regressors[coefficient],
            Multiplied::Term(term) => &self.each[0].rows.regressors[3 + term],
        }
    }

    /// Whether a row of an equation is one.
    fn is_usable(&self, row: usize, needed: &[bool]) -> bool {
        self.each.iter().zip(needed).all(|(weak, needed)| !needed || weak.rows.usable[row])
    }
}

impl Interleaved {
    /// Builds the rows of all trials.
    pub(crate) fn build(
        merged: &Merged<'_>,
        function: TestFunction,
        delta: f64,
        stages: &mut Stages<'_, '_>,
    ) -> Result<(Self, Vec<Channels>), Error> {
        let mut trials = Vec::new();
        for trial in &merged.trials {
            trials.push(Channels::build(trial, function, delta, stages)?);
        }
        let group = merged.group();
        let times = WeakRows::count(function, merged.samples);
        let rows = Rows { period: function.stride() as f64 * delta / group as f64, ..Rows::default() };
        let mut all = Self { function, kernels: function.kernels(0.0), rows, group };
        all.rows.usable = vec![false; times * group];
        all.rows.rhs = vec![0.0; times * group];
        Ok((all, trials))
    }

    /// The row of a time and the place of an equation within the group, of every row of a trial that has a place: pairs of the row here and
    /// the row there, with by how many samples it lies after the middle of its group and how fast its position grows.
    fn places(&self, trial: &Trial<'_>, rows: usize) -> Vec<(usize, usize, f64, f64)> {
        let (half, stride) = (self.function.half_width(), self.function.stride());
        let times = self.rows.usable.len() / self.group;
        let Some(position) = trial.position else {
            return (0..rows.min(times)).map(|row| (row, row, 0.0, 1.0)).collect();
        };
        let mut nearest: Vec<Option<(usize, f64, f64)>> = vec![None; times];
        for row in 0..rows {
            let sample = half + row * stride;
            let (here, before, after) = (position[sample], position[sample - 1], position[sample + 1]);
            let exact = (here - half as f64) / stride as f64;
            if !exact.is_finite() || exact.round() < 0.0 || exact.round() >= times as f64 {
                continue;
            }
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the times")]
            let time = exact.round() as usize;
            let later = (exact - exact.round()) * stride as f64;
            if nearest[time].is_none_or(|(_, other, _)| later.abs() < other.abs()) {
                nearest[time] = Some((row, later, (after - before) / 2.0));
            }
        }
        let placed = nearest.into_iter().enumerate();
        placed.filter_map(|(time, one)| one.map(|(row, later, rate)| (time, row, later, rate))).collect()
    }

    /// Fills in the columns of all elements, every equation with its weight.
    pub(crate) fn fill(&mut self, merged: &Merged<'_>, trials: &[Channels], weights: &Weights, delta: f64) {
        let (group, equations) = (self.group, merged.equations());
        let count = self.rows.usable.len();
        let column = || vec![0.0; count];
        self.rows.usable.fill(false);
        self.rows.rhs.fill(0.0);
        self.rows.rhs_noise.clear();
        self.rows.jumps.clear();
        let weighted = merged.trials.iter().any(|trial| trial.weights.is_some());
        self.rows.roots = vec![1.0; if weighted { count } else { 0 }];
        self.rows.regressors = merged
            .elements
            .iter()
            .map(|_| Regressor { value: column(), companion: column(), noise: Default::default() })
            .collect();
        let middle = (group as f64 - 1.0) / 2.0;
        for (number, (trial, channels)) in merged.trials.iter().zip(trials).enumerate() {
            let places = self.places(trial, channels.rows());
            for equation in 0..equations {
                let needed = needed(merged, equation);
                let inner = number * equations + equation;
                let weight = weights.equations[equation];
                let early = (middle - inner as f64) * self.rows.period;
                let at: Vec<_> =
                    places.iter().filter(|(_, row, ..)| channels.is_usable(*row, &needed)).copied().collect();
                let rhs = &channels.each[equation.min(channels.each.len() - 1)].rows.rhs;
                for &(time, row, ..) in &at {
                    self.rows.usable[time * group + inner] = true;
                    self.rows.rhs[time * group + inner] = weight * rhs[row];
                    if weighted {
                        self.rows.roots[time * group + inner] = channels.each[0].rows.root(row);
                    }
                }
                for (element, regressor) in merged.elements.iter().zip(&mut self.rows.regressors) {
                    for entry in element.entries.iter().filter(|entry| entry.equation == equation) {
                        let from = channels.regressor(entry.of);
                        let factor = weight * entry.factor;
                        for &(time, row, later, rate) in &at {
                            let place = time * group + inner;
                            let moved = early + later * delta;
                            regressor.value[place] += factor * from.value[row];
                            regressor.companion[place] +=
                                factor * (rate * from.companion[row] + moved * from.value[row]);
                        }
                    }
                }
            }
        }
        self.set_noise(merged, weights);
        self.take_known(merged);
    }

    /// The columns by which the noise of an angle enters: its kernels, or where it is coloured what has their products.
    pub(crate) fn columns_of(&self, noise: &CorrelatedNoise) -> [[Vec<f64>; 3]; 2] {
        if !noise.is_white() {
            return coloured_kernels(noise, &self.kernels);
        }
        let deviation = noise.variance().sqrt();
        let scaled = |kernel: &Vec<f64>| kernel.iter().map(|value| deviation * value).collect();
        [&self.kernels.values, &self.kernels.slopes].map(|kernels| kernels.each_ref().map(scaled))
    }

    /// The kernels by which the noise of all angles enters all equations, one after another, so that their products are the sums over
    /// angles and the means over equations.
    fn set_noise(&mut self, merged: &Merged<'_>, weights: &Weights) {
        let (equations, length) = (merged.equations(), self.kernels.values[0].len());
        let share = 1.0 / (equations as f64).sqrt();
        for (element, regressor) in merged.elements.iter().zip(&mut self.rows.regressors) {
            let size = equations * weights.angles.len() * length;
            regressor.noise = [vec![0.0; size], vec![0.0; size]];
            for Entry { equation, of, factor } in &element.entries {
                let Multiplied::Motion { channel, coefficient } = *of else { continue };
                let first = (equation * weights.angles.len() + channel) * length;
                let factor = share * weights.equations[*equation] * factor;
                for (noise, columns) in regressor.noise.iter_mut().zip(&weights.angles[channel]) {
                    let column = &columns[coefficient];
                    noise[first..first + length].iter_mut().zip(column).for_each(|(sum, k)| *sum += factor * k);
                }
            }
        }
    }

    /// Moves what is known to the right-hand side.
    fn take_known(&mut self, merged: &Merged<'_>) {
        for (Element { known, .. }, regressor) in merged.elements.iter().zip(&self.rows.regressors) {
            let Some(known) = known.filter(|known| *known != 0.0) else { continue };
            self.rows.rhs.iter_mut().zip(&regressor.value).for_each(|(rhs, value)| *rhs -= known * value);
            let noise = &regressor.noise[0];
            self.rows.rhs_noise.resize(noise.len(), 0.0);
            self.rows.rhs_noise.iter_mut().zip(noise).for_each(|(sum, value)| *sum -= known * value);
        }
    }

    /// Rows that a test function reaches on either side.
    pub(crate) fn reach(&self) -> usize {
        self.function.half_width().div_ceil(self.function.stride()) * self.group
    }

    /// The sample of row 0, between the first times, and samples from one row to the next.
    pub(crate) fn samples(&self) -> [f64; 2] {
        let (half, stride) = (self.function.half_width() as f64, self.function.stride() as f64);
        let apart = stride / self.group as f64;
        [half - apart * (self.group as f64 - 1.0) / 2.0, apart]
    }
}

/// Which angles an equation asks for.
fn needed(merged: &Merged<'_>, equation: usize) -> Vec<bool> {
    let mut needed = vec![false; merged.channels()];
    // The torque of an equation stands beside the angle of the same number, terms beside the first.
    needed[equation.min(merged.channels() - 1)] = true;
    for entry in merged.elements.iter().flat_map(|element| &element.entries).filter(|one| one.equation == equation) {
        match entry.of {
            Multiplied::Motion { channel, .. } => needed[channel] = true,
            Multiplied::Term(_) => needed[0] = true,
        }
    }
    needed
}
