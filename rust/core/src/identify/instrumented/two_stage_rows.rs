//! Rows of the recorded motion and of the motion that an instrument explains, as two-stage least squares takes them.

use std::ops::Range;

use crate::equation::motion::{Motion, unknowns};
use crate::equation::rows::Rows;
use crate::regression::tapered_sums::TAPERS;
use crate::regression::two_stage::{TwoStage, two_stage};

/// F statistic of the first stage below which estimates are biased by more than a tenth of what least squares are (Staiger, Stock 1997).
pub const WEAK_INSTRUMENT: f64 = 10.0;

/// Rows of both motions, with what made them.
pub(crate) struct Both {
    pub(crate) recorded: Rows,
    pub(crate) explained: Rows,
    pub(crate) reach: usize,
    pub(crate) window_length: usize,
    pub(crate) exponent: Option<usize>,
}

/// Regressors, instruments and right-hand side: zero in rows that one of the motions lacks.
pub(crate) struct TwoStageRows {
    regressors: Vec<Vec<f64>>,
    instruments: Vec<Vec<f64>>,
    rhs: Vec<f64>,
}

impl TwoStageRows {
    /// Rows of the unknowns with these numbers.
    pub(crate) fn new(recorded: &Rows, explained: &Rows, numbers: &[usize]) -> Self {
        let there: Vec<bool> =
            recorded.usable.iter().zip(&explained.usable).map(|(one, other)| *one && *other).collect();
        let column = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(&there).map(|(value, there)| if *there { *value } else { 0.0 }).collect()
        };
        let of = |rows: &Rows| -> Vec<Vec<f64>> {
            numbers.iter().map(|&number| column(&rows.regressors[number].value)).collect()
        };
        Self { regressors: of(recorded), instruments: of(explained), rhs: column(&recorded.rhs) }
    }

    pub(crate) fn len(&self) -> usize {
        self.rhs.len()
    }

    /// How many unknowns there are.
    pub(crate) fn unknowns(&self) -> usize {
        self.regressors.len()
    }

    /// The regressors and the instruments, by unknown.
    pub(crate) fn columns(&self) -> [&[Vec<f64>]; 2] {
        [&self.regressors, &self.instruments]
    }

    pub(crate) fn rhs(&self) -> &[f64] {
        &self.rhs
    }

    /// The same rows with another right-hand side.
    pub(crate) fn with_rhs(self, rhs: Vec<f64>) -> Self {
        Self { rhs, ..self }
    }

    /// What some of the rows say, of which neighbours are correlated over `reach`, with errors of so many tapers.
    pub(crate) fn solve(&self, rows: Range<usize>, (reach, tapers): (usize, usize)) -> Option<TwoStage> {
        let regressors: Vec<&[f64]> = self.regressors.iter().map(|column| &column[rows.clone()]).collect();
        let instruments: Vec<&[f64]> = self.instruments.iter().map(|column| &column[rows.clone()]).collect();
        two_stage(&regressors, &instruments, &self.rhs[rows], (reach, tapers))
    }
}

/// Two-stage least squares of rows that both motions have.
pub(crate) fn solve(both: &Both, motion: &Motion<'_>) -> Option<TwoStage> {
    let columns = columns(both, motion);
    columns.solve(0..columns.len(), (both.reach, TAPERS))
}

pub(crate) fn columns(both: &Both, motion: &Motion<'_>) -> TwoStageRows {
    TwoStageRows::new(&both.recorded, &both.explained, &unknowns(&motion.coefficients, motion.terms.len()))
}
