//! The layout of the numbers in a summary of rows and in a solved window.

/// Which columns rows have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Number of windowed regressors.
    pub(crate) windowed: usize,
    /// Whether windowed coefficients may grow linearly within a window.
    pub(crate) linear: bool,
    /// Number of regressors whose coefficients are constant over the record.
    pub(crate) constant: usize,
}

impl Layout {
    /// Number of unknowns of one window.
    pub(crate) fn local(self) -> usize {
        self.windowed * if self.linear { 2 } else { 1 }
    }

    /// All unknowns.
    pub(crate) fn regressors(self) -> usize {
        self.local() + self.constant
    }

    /// Numbers in a row.
    pub(crate) fn columns(self) -> usize {
        self.regressors() + 1
    }

    /// Where an entry of the factor is, `row ≤ column`.
    #[inline(always)]
    pub(crate) fn entry(self, row: usize, column: usize) -> usize {
        row * self.columns() - row * (row + 1) / 2 + column
    }

    /// Where the sums over the rows begin: their number, their times and the squares of their times.
    #[inline(always)]
    pub(crate) fn sums(self) -> usize {
        triangle(self.columns())
    }

    /// Where the noise of the local unknowns begins: a symmetric matrix.
    #[inline(always)]
    pub(crate) fn noise(self) -> usize {
        self.sums() + 3
    }

    /// Numbers in a summary.
    pub(crate) fn size(self) -> usize {
        self.noise() + triangle(self.local())
    }
}

/// Entries of a symmetric matrix.
#[inline(always)]
pub(crate) fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

/// Where an entry of a symmetric matrix is that is kept row by row, the lower half.
#[inline(always)]
pub(crate) fn symmetric(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    triangle(high) + low
}

/// Where the numbers of a solved window are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fields {
    pub(crate) layout: Layout,
}

impl Fields {
    /// How a local unknown depends on a constant one (`constant < layout.constant`, its negative), or its value where all those
    /// are zero (`constant == layout.constant`).
    #[inline(always)]
    pub(crate) fn solution(self, local: usize, constant: usize) -> usize {
        local * (self.layout.constant + 1) + constant
    }

    /// Entry of the covariance of the local unknowns.
    #[inline(always)]
    pub(crate) fn covariance(self, i: usize, j: usize) -> usize {
        self.layout.local() * (self.layout.constant + 1) + symmetric(i, j)
    }

    /// Entry of the factor that remains for the constant unknowns once the local ones are eliminated, `row ≤ column`; in the last
    /// place the residual sum of squares.
    #[inline(always)]
    pub(crate) fn left(self, row: usize, column: usize) -> usize {
        let columns = self.layout.constant + 1;
        self.covariance(0, 0) + triangle(self.layout.local()) + row * columns - row * (row + 1) / 2 + column
    }

    /// Squared norm of the column of a constant unknown before anything was eliminated.
    #[inline(always)]
    pub(crate) fn norm(self, constant: usize) -> usize {
        self.left(self.layout.constant, self.layout.constant) + 1 + constant
    }

    /// What the local unknowns absorb of the rows' noise, as a sum of squares: the expected residual is smaller by it. Infinite where the noise of rows is not
    /// known.
    #[inline(always)]
    pub(crate) fn freedom(self) -> usize {
        self.norm(self.layout.constant)
    }

    /// Number of rows.
    #[inline(always)]
    pub(crate) fn count(self) -> usize {
        self.freedom() + 1
    }

    /// Condition number of the local regressors, each scaled to the same norm.
    #[inline(always)]
    pub(crate) fn condition(self) -> usize {
        self.freedom() + 2
    }

    /// Numbers of a window.
    pub(crate) fn size(self) -> usize {
        self.freedom() + 3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUTS: [Layout; 4] = [
        Layout { windowed: 1, linear: true, constant: 2 },
        Layout { windowed: 2, linear: true, constant: 0 },
        Layout { windowed: 0, linear: false, constant: 3 },
        Layout { windowed: 3, linear: false, constant: 1 },
    ];

    /// Every place from zero on exactly once.
    fn assert_fills(mut places: Vec<usize>, size: usize) {
        places.sort_unstable();
        assert_eq!(places, (0..size).collect::<Vec<_>>());
    }

    #[test]
    fn every_number_of_a_summary_has_a_place_of_its_own() {
        for layout in LAYOUTS {
            let columns = layout.columns();
            let factor = (0..columns).flat_map(|row| (row..columns).map(move |column| layout.entry(row, column)));
            let sums = layout.sums()..layout.sums() + 3;
            let noise = (0..layout.local()).flat_map(|i| (0..=i).map(move |j| layout.noise() + symmetric(i, j)));
            assert_fills(factor.chain(sums).chain(noise).collect(), layout.size());
        }
    }

    #[test]
    fn every_number_of_a_solved_window_has_a_place_of_its_own() {
        for layout in LAYOUTS {
            let (fields, local, constant) = (Fields { layout }, layout.local(), layout.constant);
            let mut places = vec![fields.freedom(), fields.count(), fields.condition()];
            places.extend((0..local).flat_map(|one| (0..=constant).map(move |other| fields.solution(one, other))));
            places.extend((0..local).flat_map(|i| (0..=i).map(move |j| fields.covariance(i, j))));
            places.extend((0..=constant).flat_map(|i| (i..=constant).map(move |j| fields.left(i, j))));
            places.extend((0..constant).map(|one| fields.norm(one)));
            assert_fills(places, fields.size());
        }
    }

    #[test]
    fn a_symmetric_matrix_is_kept_once() {
        assert!((0..5).all(|i| (0..5).all(|j| symmetric(i, j) == symmetric(j, i))));
    }
}
