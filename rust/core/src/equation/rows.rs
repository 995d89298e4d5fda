//! Rows of the equation of motion of one record, in strong or weak form.

use std::ops::Range;

/// Rows of a block.
pub(crate) const BLOCK: usize = 128;

/// The regressor of the first term: inertia, damping and stiffness come before.
const FIRST_TERM: usize = 3;

/// Numbers that differ by no more, relative to their size, are rounded differently: by kernels of some thousand samples, and by weights.
const ALIKE: f64 = 1e-9;

/// One regressor in every row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Regressor {
    /// For a factor that is constant around the row.
    pub(crate) value: Vec<f64>,
    /// For a factor that grows by one a second and is zero at the row's centre.
    pub(crate) companion: Vec<f64>,
    /// The kernels that the angle's noise enters by, of both; empty where it does not or nothing is known of it.
    pub(crate) noise: [Vec<f64>; 2],
}

/// All rows of a record. Those that are no equations are zero in every column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    /// Inertia, damping, stiffness and terms, known or not.
    pub(crate) regressors: Vec<Regressor>,
    /// The torque, with what is known taken off.
    pub(crate) rhs: Vec<f64>,
    /// The kernel that the angle's noise enters the right-hand side by; empty where it does not.
    pub(crate) rhs_noise: Vec<f64>,
    pub(crate) usable: Vec<bool>,
    /// The first rows after jumps of windowed coefficients, in order.
    pub(crate) jumps: Vec<usize>,
    /// Seconds from one row to the next.
    pub(crate) period: f64,
    /// What every row was multiplied by, so that the noise of all is alike: the square root of its weight. Empty where all count alike.
    pub(crate) roots: Vec<f64>,
}

/// Rows that are no equations for a while, each once, and what they were.
pub(crate) struct SetAside {
    rows: Vec<usize>,
    usable: Vec<bool>,
    numbers: Vec<f64>,
}

impl Rows {
    /// What a row was multiplied by.
    pub(crate) fn root(&self, row: usize) -> f64 {
        self.roots.get(row).copied().unwrap_or(1.0)
    }

    /// Multiplies every row by the square root of its weight.
    pub(crate) fn weigh(&mut self, roots: Vec<f64>) {
        let multiply = |column: &mut [f64]| column.iter_mut().zip(&roots).for_each(|(value, root)| *value *= root);
        multiply(&mut self.rhs);
        for Regressor { value, companion, .. } in &mut self.regressors {
            multiply(value);
            multiply(companion);
        }
        self.roots = roots;
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rhs.len()
    }

    /// The mean square of the right-hand side; beside an offset, of what a constant one leaves: where a sensor has its zero says nothing of the motion.
    pub(crate) fn mean_square(&self) -> f64 {
        let used = || (0..self.len()).filter(|&row| self.usable[row]);
        let offset = self.offset();
        let at = |row: usize| offset.map_or(0.0, |regressor| self.regressors[regressor].value[row]);
        let (product, square) = used()
            .fold((0.0, 0.0), |(product, square), row| (product + self.rhs[row] * at(row), square + at(row) * at(row)));
        let level = if square > 0.0 { product / square } else { 0.0 };
        let (sum, count) = used().fold((0.0, 0.0_f64), |(sum, count), row| {
            let left = self.rhs[row] - level * at(row);
            (sum + left * left, count + 1.0)
        });
        sum / count.max(1.0)
    }

    /// The term that is the same in every equation of weight one.
    fn offset(&self) -> Option<usize> {
        (FIRST_TERM..self.regressors.len()).find(|&regressor| {
            let column = &self.regressors[regressor].value;
            let mut sizes = (0..column.len())
                .filter(|&row| self.usable[row] && self.root(row) > 0.0)
                .map(|row| column[row] / self.root(row));
            let first = sizes.next().filter(|size| *size != 0.0 && column.len() == self.len());
            first.is_some_and(|size| sizes.all(|one| (one - size).abs() <= ALIKE * size.abs()))
        })
    }

    /// The mean square of a regressor over all rows.
    pub(crate) fn mean_square_of(&self, regressor: usize) -> f64 {
        self.regressors[regressor].value.iter().map(|value| value * value).sum::<f64>() / self.len() as f64
    }

    /// Puts rows of the same unknowns behind these. Windows do not reach from one part to the next.
    pub(crate) fn append(&mut self, mut other: Self) {
        if self.regressors.is_empty() {
            *self = other;
            return;
        }
        let before = self.len();
        self.jumps.push(before);
        self.jumps.extend(other.jumps.iter().map(|jump| before + jump));
        self.rhs.append(&mut other.rhs);
        self.usable.append(&mut other.usable);
        self.roots.append(&mut other.roots);
        for (one, mut more) in self.regressors.iter_mut().zip(other.regressors) {
            one.value.append(&mut more.value);
            one.companion.append(&mut more.companion);
        }
    }

    /// Makes rows no equations.
    pub(crate) fn exclude(&mut self, rows: impl Iterator<Item = usize>) {
        for row in rows {
            self.usable[row] = false;
            self.clear(row);
        }
    }

    /// Makes rows no equations for a while.
    pub(crate) fn set_aside(&mut self, rows: Vec<usize>) -> SetAside {
        let usable = rows.iter().map(|&row| std::mem::replace(&mut self.usable[row], false)).collect();
        let mut numbers = Vec::new();
        for column in self.columns_mut() {
            numbers.extend(rows.iter().filter_map(|&row| column.get_mut(row).map(std::mem::take)));
        }
        SetAside { rows, usable, numbers }
    }

    /// Makes rows that were set aside what they were.
    pub(crate) fn take_back(&mut self, SetAside { rows, usable, numbers }: SetAside) {
        let mut numbers = numbers.into_iter();
        for column in self.columns_mut() {
            for &row in &rows {
                if let Some(value) = column.get_mut(row) {
                    *value = numbers.next().unwrap_or_default();
                }
            }
        }
        rows.into_iter().zip(usable).for_each(|(row, usable)| self.usable[row] = usable);
    }

    /// The right-hand side and all regressors, some of which have no companions.
    fn columns_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        let regressors = self.regressors.iter_mut();
        let regressors = regressors.flat_map(|one| [one.value.as_mut_slice(), one.companion.as_mut_slice()]);
        std::iter::once(self.rhs.as_mut_slice()).chain(regressors)
    }

    /// Makes every column zero in the rows that are no equations.
    pub(crate) fn clear_unusable(&mut self) {
        for row in 0..self.len() {
            if !self.usable[row] {
                self.clear(row);
            }
        }
    }

    /// Breaks off where other rows of the same record do.
    pub(crate) fn exclude_as(&mut self, other: &Self) {
        self.jumps.clone_from(&other.jumps);
        self.exclude((0..other.len()).filter(|&row| !other.usable[row]));
    }

    /// Makes every column zero in a row.
    pub(crate) fn clear(&mut self, row: usize) {
        self.rhs[row] = 0.0;
        for Regressor { value, companion, .. } in &mut self.regressors {
            value[row] = 0.0;
            if let Some(value) = companion.get_mut(row) {
                *value = 0.0;
            }
        }
    }
}

/// Where one stretch ends and the next begins, counted along them.
pub(crate) fn joints(stretches: &[Range<usize>]) -> Vec<usize> {
    let ends = stretches.iter().scan(0, |end, stretch| {
        *end += stretch.len();
        Some(*end)
    });
    ends.take(stretches.len().saturating_sub(1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three regressors of a motion, and a term.
    fn rows_with(term: Vec<f64>, rhs: Vec<f64>) -> Rows {
        let of = |value| Regressor { value, ..Regressor::default() };
        let motion = (1..4).map(|one| of(rhs.iter().map(|value| value * f64::from(one)).collect()));
        Rows { usable: vec![true; rhs.len()], regressors: motion.chain([of(term)]).collect(), rhs, ..Rows::default() }
    }

    #[test]
    fn a_torque_is_measured_from_its_mean_where_there_is_an_offset() {
        let torque: Vec<f64> = vec![2.0, -1.0, 4.0, -5.0, 3.0, -3.0];
        let square = torque.iter().map(|value| value * value).sum::<f64>() / 6.0;
        let moved = |by: f64| torque.iter().map(|value| value + by).collect::<Vec<_>>();
        for by in [0.0, 8.0, -1e3] {
            let found = rows_with(vec![0.25; 6], moved(by)).mean_square();
            assert!((found - square).abs() < 1e-9 * square, "{by}: {found}");
        }
        // What is no offset explains none, and without equations nothing is recorded.
        let other = rows_with(vec![1.0, 1.0, 1.0, -1.0, 1.0, 1.0], moved(8.0)).mean_square();
        assert_eq!(other, moved(8.0).iter().map(|value| value * value).sum::<f64>() / 6.0);
        let mut none = rows_with(vec![0.25; 6], moved(8.0));
        none.exclude(0..6);
        assert_eq!(none.mean_square(), 0.0);
    }

    #[test]
    fn an_offset_is_known_among_equations_of_other_weights() {
        let torque = [2.0, -1.0, 4.0, -5.0, 3.0, -3.0];
        let of = |by: f64| {
            let mut rows = rows_with(vec![0.3; 6], torque.iter().map(|value| value + by).collect());
            rows.weigh(vec![1.0, 0.1, 0.7, 3.0, 0.0, 1.3]);
            rows.mean_square()
        };
        assert!((of(8.0) - of(0.0)).abs() < 1e-9 * of(0.0), "{} {}", of(8.0), of(0.0));
    }

    #[test]
    fn rows_that_were_set_aside_come_back_as_they_were() {
        let column = |from: f64| (0..6).map(|row| from + f64::from(row)).collect::<Vec<_>>();
        let of = |value, companion| Regressor { value, companion, ..Regressor::default() };
        let mut rows = Rows {
            regressors: vec![of(column(1.0), column(10.0)), of(column(20.0), Vec::new())],
            rhs: column(30.0),
            usable: vec![true, true, false, true, true, true],
            ..Rows::default()
        };
        let before = rows.clone();
        let aside = rows.set_aside(vec![1, 2, 5]);
        let mut excluded = before.clone();
        excluded.exclude([1, 2, 5].into_iter());
        assert_eq!(rows.usable, excluded.usable);
        for (found, expected) in rows.columns_mut().zip(excluded.columns_mut()) {
            assert_eq!(found, expected);
        }
        rows.take_back(aside);
        assert_eq!(rows.usable, before.usable);
        for (found, expected) in rows.columns_mut().zip(before.clone().columns_mut()) {
            assert_eq!(found, expected);
        }
    }
}
