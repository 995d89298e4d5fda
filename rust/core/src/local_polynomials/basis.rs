//! One orthonormal basis serves every window of a length.
//!
//! On a uniform grid all windows of `M` samples share the Gram (discrete Legendre) polynomials `q_0, q_1, …`, orthonormal
//! over the positions `k = -(M-1)/2 … (M-1)/2`. In orthonormal form the three-term recurrence reads
//!
//! ```text
//! b_{j+1} q_{j+1}(x) = x q_j(x) - b_j q_{j-1}(x),   b_j² = j² (M² - j²) / (4 (4 j² - 1)),   q_0 = 1/√M.
//! ```
//!
//! A least-squares polynomial of any order is then a truncated sum of the same coefficients `c_j = Σ_k q_j(k) y(k)`, which is
//! what makes choosing the order cheap. The recurrence loses digits where the degree comes near the window's length, and a raw
//! Vandermonde matrix loses all of them; every table here is computed with twice the precision and rounded once.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{self, Piece, Watch};
use crate::local_polynomials::double_double::DoubleDouble;

/// The most degrees that any kernel has.
pub(crate) const MOST_DEGREES: usize = 20;

/// The orthonormal polynomials of one window length, tabulated on the window and ready to be evaluated anywhere.
#[derive(Clone, Debug)]
pub struct Basis {
    length: usize,
    degrees: usize,
    /// `b_0 = 0, b_1, …, b_degrees` of the recurrence.
    recurrence: Vec<DoubleDouble>,
    /// Their reciprocals.
    inverses: Vec<DoubleDouble>,
    /// `b_j / b_{j+1}` and `1 / b_{j+1}` in working precision.
    steps: Vec<(f64, f64)>,
    /// `q_j` at the positions that are not negative, position by position.
    values: Vec<f64>,
}

/// The recurrence that gives `δ_j = Σ_k (q_j(k) - q_j(k-1)) y(k)` from `c_j = Σ_k q_j(k) y(k)`, three operations a degree:
///
/// ```text
/// η_{j+1} = gain_j c_j - damping_j η_j + η_{j-1},   δ_j = scale_j η_j,   η_0 = η_{-1} = 0.
/// ```
#[derive(Clone, Debug)]
pub struct Differences {
    /// `gain_j`; the last is not used.
    pub gain: Vec<f64>,
    /// `damping_j`; the last is not used.
    pub damping: Vec<f64>,
    /// `scale_j`; the first is zero.
    pub scale: Vec<f64>,
}

impl Basis {
    /// The polynomials of degree `0 … degrees - 1` on windows of `length` samples.
    ///
    /// Costs `O(length · degrees)`.
    ///
    /// # Errors
    /// If there is not the memory.
    ///
    /// # Panics
    /// If `degrees` is zero or larger than `length`: that many polynomials are not independent on the window.
    pub fn new(length: usize, degrees: usize) -> Result<Self, Error> {
        Self::watched(length, degrees, &mut |_, _| true)
    }

    /// The same for windows of any length, watched.
    ///
    /// # Errors
    /// If there is not the memory, or the watch cancels.
    pub(crate) fn watched(length: usize, degrees: usize, watch: &mut Watch<'_>) -> Result<Self, Error> {
        assert!((1..=length).contains(&degrees), "{degrees} polynomials are not independent on {length} samples");
        let recurrence = recurrence(length, degrees);
        let inverses: Vec<DoubleDouble> = recurrence.iter().map(|&b| DoubleDouble::ONE / b).collect();
        let pairs = recurrence.windows(2).zip(&inverses[1..]);
        let steps = pairs.map(|(b, inverse)| ((b[0] / b[1]).to_f64(), inverse.to_f64())).collect();
        let mut basis = Self { length, degrees, recurrence, inverses, steps, values: Vec::new() };
        let rows = length - length / 2;
        memory::ask_for_numbers(rows.saturating_mul(degrees))?;
        let mut values = vec![0.0; rows * degrees];
        let pieces = pool::ranges(rows).into_iter().zip(values.chunks_mut(pool::ROWS * degrees));
        let pieces = pieces.map(|(Piece { size, content }, values)| Piece { size, content: (content, values) });
        let lower = vec![DoubleDouble::ZERO; degrees];
        let tabulate = |(rows, values): (Range<usize>, &mut [f64]), row_of: &mut Vec<DoubleDouble>| {
            for (row, values) in rows.zip(values.chunks_exact_mut(degrees)) {
                basis.legendre_slopes(basis.position(length / 2 + row), 0, &lower, row_of);
                values.iter_mut().zip(&*row_of).for_each(|(value, exact)| *value = exact.to_f64());
            }
        };
        let scratch = || {
            let mut row_of = lower.clone();
            row_of[0] = basis.mean();
            row_of
        };
        pool::run(pieces.collect(), NonZeroUsize::MIN, scratch, tabulate, watch)?;
        basis.values = values;
        Ok(basis)
    }

    /// Samples in a window.
    #[must_use]
    pub fn length(&self) -> usize {
        self.length
    }

    /// Number of polynomials: the highest degree plus one.
    #[must_use]
    pub fn degrees(&self) -> usize {
        self.degrees
    }

    /// Position of sample `index` of the window, in samples from the centre: whole for odd lengths, halves for even ones.
    #[must_use]
    pub fn position(&self, index: usize) -> f64 {
        index as f64 - (self.length - 1) as f64 / 2.0
    }

    /// `q_0 … q_{degrees-1}` at the positions that are not negative, from the centre outwards, one row a position.
    ///
    /// The other half follows from the parity `q_j(-x) = (-1)^j q_j(x)`.
    #[must_use]
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.degrees)
    }

    /// `q_j` at sample `index` of the window.
    ///
    /// # Panics
    /// If `degree` or `index` is out of range.
    #[must_use]
    pub fn value(&self, degree: usize, index: usize) -> f64 {
        assert!(degree < self.degrees && index < self.length, "no such polynomial or sample");
        let mirrored = index < self.length / 2;
        let outward = if mirrored { self.length - 1 - index } else { index } - self.length / 2;
        let value = self.values[outward * self.degrees + degree];
        if mirrored && degree % 2 == 1 { -value } else { value }
    }

    /// The `derivative`-th derivative of every polynomial at any position, in samples from the centre.
    ///
    /// The unit of the `d`-th derivative is one over samples to the power `d`.
    #[must_use]
    pub fn evaluate(&self, position: f64, derivative: usize) -> Vec<f64> {
        self.polynomials(position, derivative).iter().map(|value| value.to_f64()).collect()
    }

    /// How sums over the polynomials change when they are shifted by one sample.
    ///
    /// With `δf(x) = f(x + ½) - f(x - ½)` and `μf(x) = (f(x + ½) + f(x - ½))/2` the basis obeys, like Legendre's polynomials and their
    /// derivatives, `μq_j = (b_{j+1}/(j+1)) δq_{j+1} - (b_j/j) δq_{j-1}`. See `Differences` for what follows.
    #[must_use]
    pub fn differences(&self) -> Differences {
        let rate = |j: usize| self.recurrence.get(j).map_or(DoubleDouble::ZERO, |&b| DoubleDouble::from(j as f64) / b);
        // η_j = δ_j / scale_j, scaled so that η_{j-1} enters η_{j+1} with a factor of one.
        let mut scale = vec![DoubleDouble::ONE; self.degrees];
        for j in 1..self.degrees.max(1) - 1 {
            scale[j + 1] = scale[j - 1] * rate(j + 1) / rate(j);
        }
        let mut differences = Differences { gain: Vec::new(), damping: Vec::new(), scale: Vec::new() };
        for j in 0..self.degrees {
            let gain = scale.get(j + 1).map_or(DoubleDouble::ZERO, |&next| rate(j + 1) / next);
            differences.gain.push(gain.to_f64());
            differences.damping.push((gain * scale[j] / DoubleDouble::from(2.0)).to_f64());
            differences.scale.push(if j == 0 { 0.0 } else { scale[j].to_f64() });
        }
        differences
    }

    /// Every polynomial at the sample that mirrors one of the window or is it itself: at the position that is not negative. And whether
    /// it is mirrored, so that odd polynomials change their sign.
    pub(crate) fn row(&self, index: usize) -> (&[f64], bool) {
        let mirrored = index < self.length / 2;
        let outward = if mirrored { self.length - 1 - index } else { index } - self.length / 2;
        (&self.values[outward * self.degrees..][..self.degrees], mirrored)
    }

    /// `b_j / b_{j+1}` and `1 / b_{j+1}`, by which each derivative of every polynomial follows from the one below it:
    ///
    /// ```text
    /// q_{j+1}^(d) = (d q_j^(d-1) + x q_j^(d) - b_j q_{j-1}^(d)) / b_{j+1}.
    /// ```
    ///
    /// In working precision, `O(degrees)` a position: for many of them, where [`Basis::evaluate`] would be slow.
    pub(crate) fn steps(&self) -> &[(f64, f64)] {
        &self.steps
    }

    /// `q_j^{(derivative)}(position)` for every degree, to twice the precision.
    ///
    /// Differentiating the recurrence `d` times adds `d q_j^{(d-1)}` to its right-hand side.
    fn polynomials(&self, position: f64, derivative: usize) -> Vec<DoubleDouble> {
        let mut lower = vec![DoubleDouble::ZERO; self.degrees];
        let mut values = lower.clone();
        for d in 0..=derivative {
            std::mem::swap(&mut lower, &mut values);
            values[0] = if d == 0 { self.mean() } else { DoubleDouble::ZERO };
            self.legendre_slopes(position, d, &lower, &mut values);
        }
        values
    }

    /// The polynomial of degree zero.
    fn mean(&self) -> DoubleDouble {
        DoubleDouble::ONE / DoubleDouble::from(self.length as f64).sqrt()
    }

    /// The `d`-th derivative of every polynomial from that of degree zero and the derivatives before. Products with inverses take
    /// a third of the time that quotients take.
    fn legendre_slopes(&self, position: f64, d: usize, lower: &[DoubleDouble], values: &mut [DoubleDouble]) {
        let x = DoubleDouble::from(position);
        for j in 0..self.degrees - 1 {
            let mut value = x * values[j];
            if d > 0 {
                value = value + DoubleDouble::from(d as f64) * lower[j];
            }
            if j > 0 {
                value = value - self.recurrence[j] * values[j - 1];
            }
            values[j + 1] = value * self.inverses[j + 1];
        }
    }
}

/// `b_0 … b_degrees` of the recurrence in orthonormal form; `b_degrees` closes the matrices and is zero where the window holds
/// no further polynomial.
fn recurrence(length: usize, degrees: usize) -> Vec<DoubleDouble> {
    let m = length as f64;
    let coefficient = |j: usize| {
        if j == 0 || j == length {
            return DoubleDouble::ZERO;
        }
        let j = j as f64;
        let square = DoubleDouble::from(j * j) * DoubleDouble::from(m - j) * DoubleDouble::from(m + j)
            / DoubleDouble::from(4.0 * (4.0 * j * j - 1.0));
        square.sqrt()
    };
    (0..=degrees).map(coefficient).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_polynomials_are_the_mean_and_the_slope() {
        let basis = Basis::new(5, 2).expect("little memory");
        let slope = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| k / 10_f64.sqrt());
        for (index, expected) in slope.into_iter().enumerate() {
            assert!((basis.value(0, index) - 1.0 / 5_f64.sqrt()).abs() < f64::EPSILON);
            assert!((basis.value(1, index) - expected).abs() < f64::EPSILON);
        }
    }

    #[test]
    #[should_panic(expected = "not independent")]
    fn more_polynomials_than_samples_are_refused() {
        let _ = Basis::new(5, 6);
    }
}
