//! Samples of several blocks of windows laid side by side, one block a lane.
//!
//! Lane `l` works on the windows that begin at samples `l B … (l+1) B - 1` of a run. Sample `k` of every lane's block must come as
//! one vector, so the run is kept as `B` rows: row `r` holds the samples `r, B + r, 2B + r, …`. Sample `k = q B + r` of all lanes is
//! then the vector that begins at column `q` of row `r`, and every sample is stored once.

use crate::simd::aligned::Aligned;
use crate::simd::vectors::Lanes;

/// The samples of one run.
#[derive(Clone, Debug)]
pub(crate) struct Strips {
    block: usize,
    columns: usize,
    values: Aligned,
}

/// A place in a block, moved sample by sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cursor {
    row: usize,
    column: usize,
}

impl Strips {
    /// Room for `lanes` blocks of `block` windows of `length` samples.
    pub(crate) fn new(block: usize, length: usize, lanes: usize) -> Self {
        let columns = lanes + length.div_ceil(block);
        Self { block, columns, values: Aligned::zeros(columns * block) }
    }

    /// Number of samples that [`Strips::fill`] takes.
    pub(crate) fn samples(&self) -> usize {
        self.columns * self.block
    }

    /// Lays out the samples of a run.
    #[inline(always)]
    pub(crate) fn fill<S: Lanes>(&mut self, simd: S, samples: &[f64]) {
        let (lanes, block, columns) = (S::F64_LANES, self.block, self.columns);
        let mut square = [simd.splat_f64s(0.0); crate::simd::vectors::MOST_LANES];
        if block < lanes {
            for (index, &value) in samples.iter().enumerate() {
                self.values[index % block * columns + index / block] = value;
            }
            return;
        }
        // The last squares overlap those before them where rows or columns are no multiple of the lanes.
        for column in (0..columns).step_by(lanes).map(|column| column.min(columns - lanes)) {
            for row in (0..block).step_by(lanes).map(|row| row.min(block - lanes)) {
                for (lane, vector) in square[..lanes].iter_mut().enumerate() {
                    *vector = simd.load(samples, (column + lane) * block + row);
                }
                simd.transpose(&mut square[..lanes]);
                for (lane, &vector) in square[..lanes].iter().enumerate() {
                    simd.store(&mut self.values, (row + lane) * columns + column, vector);
                }
            }
        }
    }

    /// Makes one of the samples that were filled in zero.
    pub(crate) fn clear(&mut self, index: usize) {
        self.values[index % self.block * self.columns + index / self.block] = 0.0;
    }

    /// Where [`Strips::in_place`] finds sample `row` of the block that comes `block` blocks after each lane's. Samples of several channels
    /// have the same places.
    #[inline(always)]
    pub(crate) fn place(&self, row: usize, block: usize) -> usize {
        row * self.columns + block
    }

    /// The sample at a place of [`Strips::place`], one of each lane.
    #[inline(always)]
    pub(crate) fn in_place<S: Lanes>(&self, simd: S, place: usize) -> S::f64s {
        simd.load(&self.values, place)
    }

    /// What is held from sample `row` of every lane's block on.
    pub(crate) fn rows_on_from(&self, row: usize) -> &[f64] {
        &self.values[row * self.columns..]
    }

    /// Numbers from one sample of a block to the next.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// The place of sample `index` of every lane's block.
    #[inline(always)]
    pub(crate) fn cursor(&self, index: usize) -> Cursor {
        Cursor { row: index % self.block, column: index / self.block }
    }

    /// The sample at a place, one of each lane.
    #[inline(always)]
    pub(crate) fn at<S: Lanes>(&self, simd: S, cursor: Cursor) -> S::f64s {
        self.in_place(simd, self.place(cursor.row, cursor.column))
    }

    /// The next place.
    #[inline(always)]
    pub(crate) fn after(&self, cursor: Cursor) -> Cursor {
        if cursor.row + 1 < self.block {
            Cursor { row: cursor.row + 1, ..cursor }
        } else {
            Cursor { row: 0, column: cursor.column + 1 }
        }
    }

    /// The place before, which must exist unless it is not used.
    #[inline(always)]
    pub(crate) fn before(&self, cursor: Cursor) -> Cursor {
        if cursor.row > 0 {
            Cursor { row: cursor.row - 1, ..cursor }
        } else {
            Cursor { row: self.block - 1, column: cursor.column.wrapping_sub(1) }
        }
    }
}
