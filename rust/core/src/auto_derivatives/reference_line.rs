//! The reference that windows near an end are compared with, at any sample there.
//!
//! It is made of means as the candidates are, and brought to samples by interpolation: windows are compared at a few hundred places, and a
//! reference at every sample would cost more than all else where windows are long.

use std::ops::Range;

use crate::auto_derivatives::block_means::{COARSER, Grid};
use crate::auto_derivatives::candidate_weights::Reference;
use crate::auto_derivatives::interpolated_average::{Line, POINTS, Stencil};
use crate::auto_derivatives::survey::Survey;
use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};

/// It is brought to all samples at once where these are at most so many, otherwise to those that are asked for.
const MOST_AT_ONCE: usize = 1 << 15;

/// The reference at some samples.
pub(crate) struct ReferenceLine {
    line: Line,
    stencil: Stencil,
    pub(crate) kernel: Vec<f64>,
    /// Its variance, over that of the noise.
    pub(crate) gain: f64,
}

impl ReferenceLine {
    pub(crate) fn new(survey: &Survey<'_>, samples: &Range<usize>, reference: &Reference) -> Self {
        let bank = &reference.bank;
        let count = survey.record().len();
        let grid = Grid::new(count, bank.step);
        let (means, centres) = bank.places(count, grid, &grid.means(samples));
        let mut line = Line { grid, first: means.start, values: Vec::new() };
        if !centres.is_empty() {
            let (mut scratch, mut projected) = (CoefficientScratch::default(), Projected::default());
            let estimates = bank.estimates(survey.means(), centres, 1, &mut scratch, &mut projected);
            line.values = std::mem::take(&mut estimates[0]);
        }
        while line.grid.step > 1 && (POINTS..=MOST_AT_ONCE / COARSER).contains(&line.values.len()) {
            let last = line.values[line.values.len() - POINTS / 2];
            line = line.finer(Grid::new(count, line.grid.step / COARSER));
            // As far from the one end as from the other.
            line.values.push(last);
        }
        let stencil = Stencil::new(line.grid.step);
        Self { line, stencil, kernel: bank.kernel(0), gain: bank.gains[0] }
    }

    /// The reference at some samples, NaN where there is none.
    pub(crate) fn read(&self, samples: impl Iterator<Item = usize>, into: &mut Vec<f64>) {
        into.clear();
        let Line { grid, first, values } = &self.line;
        if grid.step > 1 {
            into.extend(samples.map(|sample| self.line.at(sample, &self.stencil)));
            return;
        }
        let begin = grid.sample(*first);
        into.extend(samples.map(|sample| values.get(sample.wrapping_sub(begin)).copied().unwrap_or(f64::NAN)));
    }
}
