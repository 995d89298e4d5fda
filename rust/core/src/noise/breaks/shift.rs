//! Shifts of time at the border of two samples: a channel goes on there as it would some samples later.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::noise::breaks::windows::{Size, borders, orthonormal, product, take_off};
use crate::noise::median::median;
use crate::record::samples::{Samples, all_usable};

/// A shift stands out by so many times that of the usual window, and that of what is left beside it.
const CONSPICUOUS: f64 = 6.0;

/// It is by about as many samples as those that are known.
const AS_MANY: [f64; 2] = [0.5, 1.7];

/// The least squares of a shift of time in the middle of a window, beside a polynomial.
pub(crate) struct Shifts {
    half: usize,
    /// An orthonormal basis of the polynomials, the change of each by a sample more after the middle, without what the basis explains, and the
    /// products of these changes.
    basis: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
    products: Vec<Vec<f64>>,
}

impl Shifts {
    /// Of windows of so many samples on either side, with a polynomial of a degree.
    pub(crate) fn new(half: usize, degree: usize) -> Self {
        let length = 2 * half;
        let mut both: Vec<Vec<f64>> = Vec::new();
        for exponent in 0..=degree {
            // The samples, then the borders between them, where the same combination of powers is taken.
            let at = |twice: usize| ((twice as f64 - length as f64) / length as f64).powf(exponent as f64);
            let samples = (0..length).map(|place| at(2 * place + 1)).chain((0..=length).map(|border| at(2 * border)));
            both.push(orthonormal(samples.collect(), &both, length));
        }
        let basis: Vec<Vec<f64>> = both.iter().map(|column| column[..length].to_vec()).collect();
        let change = |column: &Vec<f64>| {
            let borders = column[length..].windows(2).enumerate();
            let change = borders.map(|(place, pair)| if place < half { 0.0 } else { pair[1] - pair[0] });
            let mut change: Vec<f64> = change.collect();
            take_off(&mut change, &basis, length);
            change
        };
        let changes: Vec<Vec<f64>> = both.iter().map(change).collect();
        let products = changes.iter().map(|one| changes.iter().map(|other| product(one, other)).collect()).collect();
        Self { half, basis, changes, products }
    }

    /// How many samples a window is late after its middle, and how much that stands out.
    fn of(&self, window: &[f64]) -> (f64, Size) {
        let window: Vec<f64> = window.iter().map(|value| value - window[0]).collect();
        let coefficients: Vec<f64> = self.basis.iter().map(|column| product(column, &window)).collect();
        let with_changes: Vec<f64> = self.changes.iter().map(|column| product(column, &window)).collect();
        let moved = product(&coefficients, &with_changes);
        let square: f64 =
            coefficients.iter().zip(&self.products).map(|(one, row)| one * product(row, &coefficients)).sum();
        let squares = product(&window, &window);
        let (size, samples) = if square > 0.0 { (moved / square.sqrt(), moved / square) } else { (0.0, 0.0) };
        let left = (squares - product(&coefficients, &coefficients) - size * size).max(squares * f64::EPSILON);
        let freedom = window.len() - self.basis.len() - 1;
        (samples, Size { size, left: left / freedom as f64 })
    }

    /// The shifts that are about as long as those at known breaks, of a channel that was rounded to a `quantum`. Costs some 200 ns a sample.
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
        let (length, mut window) = (2 * self.half, vec![0.0; 2 * self.half]);
        let mut lost = Vec::new();
        for &place in known.iter().filter(|&&place| place >= self.half && place + self.half <= channel.len()) {
            channel.read(place - self.half, &mut window);
            lost.extend(all_usable(&window).then(|| self.of(&window).0));
        }
        let Some(typical) = median(&mut lost).filter(|lost| *lost > 0.0) else { return Ok(Vec::new()) };
        let Some(usual) = Size::usual(channel, length, quantum, |window| self.of(window).1) else {
            return Ok(Vec::new());
        };
        let as_many = AS_MANY[0] * typical..AS_MANY[1] * typical;
        borders(channel, self.half, known, watch, |values, standing| {
            let windows = values.windows(length).enumerate().filter(|(_, window)| all_usable(window));
            standing.extend(windows.filter_map(|(place, window)| {
                let (samples, size) = self.of(window);
                (as_many.contains(&samples) && size.stands_out(usual, CONSPICUOUS)).then_some((place, size.size))
            }));
        })
    }
}
