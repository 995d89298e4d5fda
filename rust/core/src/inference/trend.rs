//! Regressors of constants that grow along the record.

use crate::equation::rows::{Regressor, Rows};

/// Some regressors, each multiplied by a line that runs from minus one to one along the record.
pub(crate) fn tilted(rows: &Rows, regressors: &[usize]) -> Vec<Regressor> {
    let half = 0.5 * (rows.len() as f64 - 1.0);
    let slope = 1.0 / (half * rows.period);
    let tilt = |&index: &usize| {
        let Regressor { value, companion, .. } = &rows.regressors[index];
        let line = value.iter().enumerate().map(|(row, value)| (row as f64 / half - 1.0) * value);
        let value = match companion.as_slice() {
            // Rows that were made white have none: a line hardly grows within a test function.
            [] => line.collect(),
            companion => line.zip(companion).map(|(value, companion)| value + slope * companion).collect(),
        };
        Regressor { value, ..Regressor::default() }
    };
    regressors.iter().map(tilt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_regressor_is_what_a_line_makes_of_its_constant() {
        let of = |value: &[f64], companion: &[f64]| Regressor {
            value: value.to_vec(),
            companion: companion.to_vec(),
            ..Regressor::default()
        };
        let rows = Rows {
            regressors: vec![of(&[1.0; 5], &[0.0; 5]), of(&[2.0; 5], &[]), of(&[0.0; 5], &[3.0; 5])],
            rhs: vec![0.0; 5],
            period: 0.25,
            ..Rows::default()
        };
        let found = tilted(&rows, &[2, 1, 0]);
        // From minus one to one in a second: a slope of two.
        assert_eq!(found[0].value, [6.0; 5]);
        assert_eq!(found[1].value, [-2.0, -1.0, 0.0, 1.0, 2.0]);
        assert_eq!(found[2].value, [-1.0, -0.5, 0.0, 0.5, 1.0]);
    }
}
