//! Rows of the equation of motion in weak form: dot products of the channels with the kernels of a test function.
//!
//! Row `r` belongs to sample `h + r · stride` and reads the samples within `h` of it. What is known moves to the
//! right-hand side; a known coefficient that changes is multiplied with the angle sample by sample and its product is
//! integrated by parts: `⟨φ Cθ̇⟩ = -⟨φ′ Cθ⟩ - ⟨φ Ċθ⟩` and `⟨φ Iθ̈⟩ = ⟨φ″ Iθ⟩ + 2⟨φ′ İθ⟩ + ⟨φ Ïθ⟩`. Terms that are not
//! linear in the angle are evaluated sample by sample and then multiplied with `φ`.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::equation::motion::Coefficient;
use crate::equation::rows::BLOCK;
use crate::equation::rows::{Regressor, Rows, joints};
use crate::error::Error;
use crate::exec::pool::{self, Piece, Watch};
use crate::noise::fused::AngleNoise;
use crate::noise::spectrum::mean_weight;
use crate::record::derived::{Late, Scaled, Whole};
use crate::record::samples::Samples;
use crate::weak_form::angle_noise::entered;
use crate::weak_form::filter_bank::{FilterBank, FilterScratch};
use crate::weak_form::test_function::{Kernels, TestFunction};

/// Windows shorter than so many test functions are hardly longer than one.
const SHORT: usize = 2;

/// Rows in a piece of work.
const PIECE: usize = 32 * BLOCK;

/// A term beside inertia, damping and stiffness, sample by sample.
#[derive(Clone, Copy)]
pub(crate) enum TermSamples<'a> {
    /// One everywhere.
    One,
    /// Given at every sample.
    Given(&'a dyn Samples),
    /// A function of the torque, as late as it is.
    OfTorque(&'a dyn Samples),
    /// The rate of the torque, which is the regressor of its lag.
    TorqueRate,
    /// Its second derivative, which is a constant's.
    TorqueCurvature,
    /// Its third derivative, which is a constant's.
    TorqueJerk,
}

/// The record that rows are built from.
#[derive(Clone)]
pub(crate) struct Record<'a> {
    pub(crate) angle: &'a dyn Samples,
    pub(crate) torque: &'a dyn Samples,
    /// What is known of the noise of an angle that was fused or integrated.
    pub(crate) noise: Option<&'a AngleNoise>,
    pub(crate) coefficients: [Coefficient<'a>; 3],
    /// Coefficients that are constant whatever is found: their regressors get no companions.
    pub(crate) constant: [bool; 3],
    pub(crate) terms: Vec<TermSamples<'a>>,
    /// Whether that holds for all terms.
    pub(crate) constant_terms: bool,
    /// Lag of the torque in samples.
    pub(crate) lag: f64,
    /// The angle at which an unknown spring is relaxed.
    pub(crate) angle_zero: f64,
    /// Where a sample may be the centre of a row.
    pub(crate) mask: Option<&'a [bool]>,
    /// One over the variance of every sample's noise, relative to the others; samples of weight zero are missing.
    pub(crate) weights: Option<&'a [f64]>,
}

/// All rows of a record, and the test function that they were built with.
#[derive(Clone, Debug)]
pub(crate) struct WeakRows {
    pub(crate) function: TestFunction,
    pub(crate) kernels: Kernels,
    /// The kernels by which the noise of the angle enters.
    pub(crate) noise: Kernels,
    /// The kernel of the torque.
    pub(crate) torque: Vec<f64>,
    /// Sample of the first row.
    pub(crate) first: usize,
    /// Samples from one row to the next.
    pub(crate) stride: usize,
    pub(crate) rows: Rows,
}

/// One channel, the kernels that are applied to it, and the columns that they give.
struct ChannelKernels<'a> {
    channel: Box<dyn Samples + 'a>,
    bank: FilterBank,
    columns: Range<usize>,
}

impl WeakRows {
    /// Other rows of the same record and test function.
    pub(crate) fn with(&self, rows: Rows) -> Self {
        let Self { function, ref kernels, ref noise, ref torque, first, stride, .. } = *self;
        Self { function, kernels: kernels.clone(), noise: noise.clone(), torque: torque.clone(), first, stride, rows }
    }

    /// Number of rows of a record of so many samples.
    pub(crate) fn count(function: TestFunction, samples: usize) -> usize {
        (samples + function.stride()).saturating_sub(function.window_length()) / function.stride()
    }

    /// Builds rows of a record, in parallel: all of them, or those in some stretches, one after another. Stretches begin at multiples of
    /// [`BLOCK`], and windows do not reach from one to the next.
    pub(crate) fn build(
        record: &Record<'_>,
        function: TestFunction,
        delta: f64,
        stretches: Option<&[Range<usize>]>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<Self, Error> {
        let (half, stride) = (function.half_width(), function.stride());
        let all = 0..Self::count(function, record.angle.len());
        let stretches = stretches.unwrap_or(std::slice::from_ref(&all));
        let count = stretches.iter().map(Range::len).sum();
        let kernels = function.kernels(0.0);
        let whole = record.lag.round();
        let late = function.kernels(record.lag - whole);
        let Tasks { tasks, width } = tasks(record, &kernels, &late, whole, stride, delta);

        let mut columns = vec![vec![0.0; count]; width];
        let mut usable: Vec<bool> = match record.mask {
            Some(mask) => stretches.iter().cloned().flatten().map(|row| mask[half + row * stride]).collect(),
            None => vec![true; count],
        };
        let mut pieces = Vec::new();
        {
            let mut outputs: Vec<&mut [f64]> = columns.iter_mut().map(Vec::as_mut_slice).collect();
            let mut usable = usable.as_mut_slice();
            for stretch in stretches {
                for first in stretch.clone().step_by(PIECE) {
                    let rows = ..PIECE.min(stretch.end - first);
                    let outputs: Vec<_> = outputs.iter_mut().filter_map(|output| output.split_off_mut(rows)).collect();
                    let usable = usable.split_off_mut(rows).unwrap_or_default();
                    pieces.push(Piece { size: usable.len() * stride, content: (first, outputs, usable) });
                }
            }
        }
        let work = |(first, mut outputs, usable): (usize, Vec<&mut [f64]>, &mut [bool]),
                    scratch: &mut FilterScratch| {
            for task in &tasks {
                task.bank.apply(&*task.channel, first, &mut outputs[task.columns.clone()], usable, scratch);
            }
            for output in outputs {
                output.iter_mut().zip(&*usable).filter(|(_, usable)| !**usable).for_each(|(value, _)| *value = 0.0);
            }
        };
        pool::run(pieces, workers, FilterScratch::default, work, watch)?;
        let torque = late.values[2].clone();
        let mut rows = Self {
            function,
            torque,
            first: half,
            stride,
            rows: Rows { usable, jumps: joints(stretches), period: stride as f64 * delta, ..Rows::default() },
            noise: entered(&kernels, record.noise, delta),
            kernels,
        };
        rows.assemble(record, columns);
        if let Some(weights) = record.weights {
            rows.weigh(weights, whole, stretches);
        }
        Ok(rows)
    }

    /// Sorts the columns that were built into regressors and the right-hand side.
    fn assemble(&mut self, record: &Record<'_>, columns: Vec<Vec<f64>>) {
        let mut columns = columns.into_iter();
        let mut next = || columns.next().unwrap_or_default();
        let values = [next(), next(), next()];
        let companions = record.constant.map(|constant| if constant { Vec::new() } else { next() });
        for (index, (value, companion)) in values.into_iter().zip(companions).enumerate() {
            let noise = [self.noise.values[index].clone(), self.noise.slopes[index].clone()];
            self.rows.regressors.push(Regressor { value, companion, noise });
        }
        if record.angle_zero != 0.0 {
            self.move_zero(record.angle_zero);
        }
        self.rows.rhs = next();
        for term in &record.terms {
            let (value, companion) = match term {
                TermSamples::One => (
                    self.rows.usable.iter().map(|&usable| f64::from(u8::from(usable))).collect(),
                    vec![0.0; self.rows.usable.len()],
                ),
                _ if record.constant_terms => (next(), Vec::new()),
                TermSamples::TorqueCurvature | TermSamples::TorqueJerk => (next(), vec![0.0; self.rows.usable.len()]),
                TermSamples::Given(_) | TermSamples::OfTorque(_) | TermSamples::TorqueRate => (next(), next()),
            };
            self.rows.regressors.push(Regressor { value, companion, noise: Default::default() });
        }
        for (index, coefficient) in record.coefficients.iter().enumerate() {
            let noise = &self.noise.values[index];
            let mut known = 0.0;
            match *coefficient {
                Coefficient::Unknown => continue,
                Coefficient::Number(number) => {
                    known = number;
                    let column = &self.rows.regressors[index].value;
                    self.rows.rhs.iter_mut().zip(column).for_each(|(rhs, value)| *rhs -= number * value);
                }
                Coefficient::Record(_) => {
                    // Its parts by derivative: as many as integrations by parts, and one.
                    for _ in index..3 {
                        self.rows.rhs.iter_mut().zip(next()).for_each(|(rhs, value)| *rhs -= value);
                    }
                }
            }
            if let Coefficient::Record(record) = *coefficient {
                known = mean(record);
            }
            if known != 0.0 {
                self.rows.rhs_noise.resize(noise.len(), 0.0);
                self.rows.rhs_noise.iter_mut().zip(noise).for_each(|(sum, value)| *sum -= known * value);
            }
        }
    }

    /// Multiplies every row by the square root of its weight: one over the variance of its noise, where that of every sample is one over its weight
    /// and enters with the kernel of the torque, which is late by whole samples.
    fn weigh(&mut self, weights: &[f64], late: f64, stretches: &[Range<usize>]) {
        #[allow(clippy::cast_possible_truncation, reason = "a lag of a few samples")]
        let late = late as isize;
        let weight = |row: usize| {
            let first = (row * self.stride).saturating_add_signed(late);
            let weights = weights.get(first..first + self.torque.len());
            weights.map_or(0.0, |weights| mean_weight(weights, &self.torque))
        };
        let roots = stretches.iter().cloned().flatten().map(|row| weight(row).sqrt()).collect();
        self.rows.weigh(roots);
    }

    /// Moves the angle at which the spring is relaxed.
    pub(crate) fn move_zero(&mut self, by: f64) {
        for row in (0..self.rows.usable.len()).filter(|&row| self.rows.usable[row]) {
            let moved = by * self.rows.root(row);
            self.rows.regressors[2].value[row] -= moved;
        }
    }

    /// The mean square of the largest torque: the recorded one, or that of inertia, damping or stiffness by itself, without what noise of some
    /// variance makes of it.
    pub(crate) fn largest_torque(&self, parameters: [f64; 3], variance: f64) -> f64 {
        let noise = |index: usize| self.rows.regressors[index].noise[0].iter().map(|value| value * value).sum::<f64>();
        let of = |(index, parameter): (usize, f64)| {
            parameter.powi(2) * (self.rows.mean_square_of(index) - variance * noise(index)).max(0.0)
        };
        parameters.into_iter().enumerate().map(of).fold(self.rows.mean_square(), f64::max)
    }

    /// Whether windows of so many rows are hardly longer than the test function: they follow anything as if it were motion.
    pub(crate) fn follow_anything(&self, rows: usize) -> bool {
        rows * self.stride < SHORT * self.function.window_length()
    }

    /// A regressor at the rows without the roots of their weights.
    pub(crate) fn plain_column(&self, regressor: usize) -> Vec<f64> {
        let mut values = self.rows.regressors[regressor].value.clone();
        values.iter_mut().zip(&self.rows.roots).for_each(|(value, root)| *value /= root.max(f64::MIN_POSITIVE));
        values
    }

    /// Rows that a test function reaches on either side.
    pub(crate) fn reach(&self) -> usize {
        self.function.half_width().div_ceil(self.stride)
    }
}

struct Tasks<'a> {
    tasks: Vec<ChannelKernels<'a>>,
    /// Number of columns.
    width: usize,
}

impl<'a> Tasks<'a> {
    fn add(&mut self, channel: Box<dyn Samples + 'a>, kernels: &[&[f64]], stride: usize) {
        let columns = self.width..self.width + kernels.len();
        self.width = columns.end;
        self.tasks.push(ChannelKernels { channel, bank: FilterBank::new(kernels, stride), columns });
    }
}

/// The channels and kernels to be computed, in the order in which [`WeakRows::assemble`] takes their results.
fn tasks<'a>(
    record: &Record<'a>,
    kernels: &Kernels,
    late: &Kernels,
    whole: f64,
    stride: usize,
    delta: f64,
) -> Tasks<'a> {
    let mut tasks = Tasks { tasks: Vec::new(), width: 0 };
    let slopes = kernels.slopes.iter().zip(record.constant).filter(|(_, constant)| !constant).map(|(slope, _)| slope);
    let all: Vec<&[f64]> = kernels.values.iter().chain(slopes).map(Vec::as_slice).collect();
    #[allow(clippy::cast_possible_truncation, reason = "a lag of a few samples")]
    let delayed = |channel: &'a dyn Samples| Box::new(Late { channel, samples: whole as isize });
    let torque = || delayed(record.torque);
    tasks.add(Box::new(Whole(record.angle)), &all, stride);
    tasks.add(torque(), &[&late.values[2]], stride);
    let jerk = rate_of(&late.values[0], delta);
    let [_, rate, value] = &kernels.values;
    let slope = &kernels.slopes[2];
    let of_a_term = if record.constant_terms { 1 } else { 2 };
    for term in &record.terms {
        match *term {
            TermSamples::One => {}
            TermSamples::Given(samples) => {
                tasks.add(Box::new(Whole(samples)), &[value.as_slice(), slope][..of_a_term], stride);
            }
            TermSamples::OfTorque(samples) => {
                tasks.add(delayed(samples), &[late.values[2].as_slice(), &late.slopes[2]][..of_a_term], stride);
            }
            TermSamples::TorqueRate => {
                tasks.add(torque(), &[late.values[1].as_slice(), &late.slopes[1]][..of_a_term], stride);
            }
            TermSamples::TorqueCurvature => tasks.add(torque(), &[&late.values[0]], stride),
            TermSamples::TorqueJerk => tasks.add(torque(), &[&jerk], stride),
        }
    }
    for (index, coefficient) in record.coefficients.iter().enumerate() {
        let Coefficient::Record(factor) = *coefficient else { continue };
        let mut part = |derivative: usize, kernel: &[f64]| {
            tasks.add(Box::new(Scaled { factor, angle: record.angle, derivative, delta }), &[kernel], stride);
        };
        match index {
            0 => {
                part(0, &kernels.values[0]);
                let twice: Vec<f64> = rate.iter().map(|value| -2.0 * value).collect();
                part(1, &twice);
                part(2, value);
            }
            1 => {
                part(0, rate);
                let minus: Vec<f64> = value.iter().map(|value| -value).collect();
                part(1, &minus);
            }
            _ => part(0, value),
        }
    }
    tasks
}

/// The kernel that gives the rate of what one gives: minus its derivative, by central differences. It is to be exact for constants.
pub(crate) fn rate_of(kernel: &[f64], delta: f64) -> Vec<f64> {
    let at = |place: Option<usize>| place.and_then(|place| kernel.get(place)).copied().unwrap_or(0.0);
    (0..kernel.len()).map(|place| (at(place.checked_sub(1)) - at(Some(place + 1))) / (2.0 * delta)).collect()
}

/// The mean of the usable samples.
pub(crate) fn mean(samples: &dyn Samples) -> f64 {
    let mut buffer = vec![0.0; samples.len()];
    samples.read(0, &mut buffer);
    let (sum, count) = buffer
        .iter()
        .filter(|&&value| crate::record::samples::is_usable(value))
        .fold((0.0, 0.0_f64), |(sum, count), value| (sum + value, count + 1.0));
    sum / count.max(1.0)
}
