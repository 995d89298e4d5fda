//! Columns of what the choice of the order knows of windows side by side.

use crate::local_polynomials::chebyshev_sums::MOST;
use crate::local_polynomials::order_table::OrderTable;
use crate::simd::aligned::Aligned;
use crate::simd::vectors::MOST_LANES;

/// Tables of windows side by side, by lane.
#[derive(Clone, Debug)]
pub(crate) struct TableColumns {
    lanes: usize,
    /// Samples of each lane's window.
    pub(crate) lengths: [usize; MOST_LANES],
    pub(crate) weights: Aligned,
    /// One over the degrees of freedom of the residual, by order; NaN where there are none.
    pub(crate) freedom: Aligned,
    pub(crate) least: Aligned,
    pub(crate) length: Aligned,
    /// Half the length as binary digits, the lowest first, and whether the length is odd.
    pub(crate) digits: Vec<Aligned>,
    pub(crate) odd: Aligned,
}

impl TableColumns {
    pub(crate) fn new(lanes: usize) -> Self {
        let column = |rows: usize| Aligned::zeros(rows * lanes);
        Self {
            lanes,
            lengths: [0; MOST_LANES],
            weights: column(MOST),
            freedom: column(MOST),
            least: column(1),
            length: column(1),
            digits: Vec::new(),
            odd: column(1),
        }
    }

    /// Sets what a lane's window has.
    pub(crate) fn set(&mut self, lane: usize, table: &OrderTable) {
        let (length, lanes) = (table.length, self.lanes);
        self.lengths[lane] = length;
        for (order, weight) in table.weights.iter().enumerate() {
            self.weights[order * lanes + lane] = *weight;
            let free = length - order - 1;
            self.freedom[order * lanes + lane] = if free == 0 { f64::NAN } else { (free as f64).recip() };
        }
        self.least[lane] = table.least;
        self.length[lane] = length as f64;
        self.odd[lane] = (length % 2) as f64;
        while (length / 2) >> self.digits.len() > 0 {
            self.digits.push(Aligned::zeros(lanes));
        }
        for (place, digits) in self.digits.iter_mut().enumerate() {
            digits[lane] = ((length / 2) >> place & 1) as f64;
        }
    }
}
