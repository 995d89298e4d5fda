//! Steps of a channel at the border of two samples, beside a smooth motion whose derivatives may change there.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::noise::breaks::windows::{Size, borders, orthonormal, product};
use crate::record::samples::{Samples, all_usable};

/// A step stands out by so many times that of the usual window, and that of what is left beside it.
const CONSPICUOUS: f64 = 8.0;

/// A change of the velocity within so many samples of a border looks like a step there: an impact, nothing lost.
const KINK: f64 = 1.5;

/// The least squares of a step in the middle of a window, beside a polynomial whose derivatives may change there.
pub(crate) struct Steps {
    half: usize,
    /// An orthonormal basis of what is no step.
    beside: Vec<Vec<f64>>,
    /// The step without what the basis explains, with norm one, and that norm before.
    step: Vec<f64>,
    norm: f64,
    /// What gives the change of the slope beside it, by sample.
    slope: Vec<f64>,
}

impl Steps {
    /// Of windows of so many samples on either side, with a polynomial of a degree of which the first derivatives, so many, may change.
    pub(crate) fn new(half: usize, degree: usize, changing: usize) -> Self {
        let length = 2 * half;
        let times: Vec<f64> = (0..length).map(|place| (place as f64 - half as f64 + 0.5) / half as f64).collect();
        let power = |exponent: usize| times.iter().map(|time| time.powf(exponent as f64)).collect::<Vec<f64>>();
        let after = |exponent: usize| -> Vec<f64> {
            let values = power(exponent).into_iter().zip(&times);
            values.map(|(value, &time)| if time > 0.0 { value } else { 0.0 }).collect()
        };
        let basis = |columns: &mut dyn Iterator<Item = Vec<f64>>| {
            let mut basis: Vec<Vec<f64>> = Vec::new();
            for column in columns {
                let column = orthonormal(column, &basis, length);
                basis.push(column);
            }
            basis
        };
        let beside = basis(&mut (0..=degree).map(power).chain((1..=changing).map(after)));
        let step = orthonormal(after(0), &beside, length);
        let norm = product(&step, &after(0));
        let but_slope = basis(&mut (0..=degree).map(power).chain((2..=changing).map(after)).chain([after(0)]));
        let slope = orthonormal(after(1), &but_slope, length);
        let scale = product(&slope, &after(1)) * half as f64;
        let slope = slope.iter().map(|value| value / scale).collect();
        Self { half, beside, step, norm, slope }
    }

    fn of(&self, window: &[f64]) -> Size {
        // An offset would cost digits.
        let window: Vec<f64> = window.iter().map(|value| value - window[0]).collect();
        let size = product(&self.step, &window);
        let explained: f64 = self.beside.iter().map(|column| product(column, &window).powi(2)).sum();
        let squares = product(&window, &window);
        // Rounding of what is explained.
        let left = (squares - explained - size * size).max(squares * f64::EPSILON);
        Size { size, left: left / (window.len() - self.beside.len() - 1) as f64 }
    }

    /// Whether a step of some size is what a change of the velocity beside the border makes.
    fn is_kink(&self, window: &[f64], size: f64) -> bool {
        let change: f64 = self.slope.iter().zip(window).map(|(factor, value)| factor * (value - window[0])).sum();
        size.abs() / self.norm < KINK * change.abs()
    }

    /// The sizes of steps in all windows of some samples, NaN where one is missing.
    fn sizes(&self, values: &[f64], into: &mut Vec<f64>) {
        into.clear();
        into.resize(values.len() + 1 - 2 * self.half, 0.0);
        // What is no step is the same set backwards, so the step is odd about the border.
        for (place, factor) in self.step[self.half..].iter().enumerate() {
            let (after, before) = (&values[self.half + place..], &values[self.half - 1 - place..]);
            for ((size, after), before) in into.iter_mut().zip(after).zip(before) {
                *size += factor * (after - before);
            }
        }
    }

    /// The steps beside those that are known, of a channel that was rounded to a `quantum`. Costs some 5 ns a sample.
    ///
    /// # Errors
    /// If the watch cancels.
    pub(crate) fn find(
        &self,
        channel: &dyn Samples,
        quantum: f64,
        known: &[usize],
        watch: &mut Watch<'_>,
    ) -> Result<Vec<usize>, Error> {
        let length = 2 * self.half;
        let Some(usual) = Size::usual(channel, length, quantum, |window| self.of(window)) else {
            return Ok(Vec::new());
        };
        let mut sizes = Vec::new();
        borders(channel, self.half, known, watch, |_, values, standing| {
            self.sizes(values, &mut sizes);
            let large = sizes.iter().enumerate().filter(|(_, size)| size.abs() > CONSPICUOUS * usual.size);
            standing.extend(large.filter_map(|(place, size)| {
                let window = &values[place..place + length];
                let stands_out = all_usable(window)
                    && self.of(window).stands_out(usual, CONSPICUOUS)
                    && !self.is_kink(window, *size);
                stands_out.then_some((place, size.abs()))
            }));
        })
    }
}
