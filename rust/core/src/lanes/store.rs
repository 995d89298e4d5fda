//! The kernel that writes finished windows to the outputs.

use std::ops::Range;

use crate::lanes::output::{FinishedRows, Outputs};
use crate::lanes::tile::{TILE, Tile};
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};

/// Writes out some windows of every lane, which the tile holds.
pub(crate) struct Write<'a, 'b> {
    pub(crate) tile: &'a Tile,
    /// The windows of each lane's block.
    pub(crate) rows: Range<usize>,
    /// The window in row 0 of lane 0, and the windows from one lane to the next: none where each lane has a record of its own.
    pub(crate) base: isize,
    pub(crate) block: usize,
    /// The records of the first lanes, where each has its own.
    pub(crate) records: Option<Records>,
    /// Windows that are wanted.
    pub(crate) windows: Range<usize>,
    /// The sample of window `w` is `w + ahead`.
    pub(crate) ahead: isize,
    /// The order of every window, where the tile holds no codes.
    pub(crate) fixed_order: Option<u8>,
    pub(crate) outputs: &'a mut Outputs<'b>,
}

/// Records side by side, one in each of the first lanes. Their elements lie end to end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Records {
    pub(crate) count: usize,
    /// Elements of each.
    pub(crate) elements: usize,
}

impl Kernel for Write<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let lanes = S::F64_LANES;
        let first = self.base + self.rows.start.cast_signed();
        let end = self.base + (self.rows.end + (lanes - 1) * self.block).cast_signed();
        let wanted = self.windows.start.cast_signed() <= first && end <= self.windows.end.cast_signed();
        let full = self.records.is_none_or(|records| records.count == lanes);
        if wanted && full && self.rows.len() >= lanes && self.outputs.elements.step == 1 {
            self.write_squares(simd);
        } else if let (true, Some(rows)) = (wanted, self.same_rows()) {
            self.write_rows(lanes, rows);
        } else {
            self.write_lanes::<S>();
        }
    }
}

impl Write<'_, '_> {
    /// Writes out all windows to neighbouring elements. The last square overlaps the one before it where need be.
    #[inline(always)]
    fn write_squares<S: Lanes>(&mut self, simd: S) {
        let lanes = S::F64_LANES;
        let apart = self.block + self.records.map_or(0, |records| records.elements);
        let Self { tile, rows, outputs, .. } = self;
        let zero = self.base + self.ahead - outputs.elements.first.cast_signed();
        let squares = || rows.clone().step_by(lanes).map(|row| row.min(rows.end - lanes));
        let place = |row: usize| (zero + row.cast_signed()).unsigned_abs();
        // Field by field: fewer places in memory are written to at a time.
        for (field, values) in outputs.values.iter_mut().enumerate().filter(|(_, values)| !values.is_empty()) {
            for row in squares() {
                let square = tile.square(simd, field, row);
                let values = &mut values[place(row)..place(row) + (lanes - 1) * apart + lanes];
                for (lane, &vector) in square[..lanes].iter().enumerate() {
                    simd.store(values, lane * apart, vector);
                }
            }
        }
        if outputs.status.is_empty() && outputs.order.is_empty() {
            return;
        }
        for row in squares() {
            let (mut orders, mut statuses) = ([self.fixed_order.unwrap_or(0); MOST_LANES], [0; MOST_LANES]);
            let codes = match self.fixed_order {
                Some(_) => [simd.splat_f64s(0.0); MOST_LANES],
                None => tile.square(simd, outputs.values.len(), row),
            };
            for (lane, &codes) in codes[..lanes].iter().enumerate() {
                if self.fixed_order.is_none() {
                    simd.split(codes, &mut orders, &mut statuses);
                }
                let elements = place(row) + lane * apart..place(row) + lane * apart + lanes;
                if !outputs.order.is_empty() {
                    outputs.order[elements.clone()].copy_from_slice(&orders[..lanes]);
                }
                if !outputs.status.is_empty() {
                    outputs.status[elements].copy_from_slice(&statuses[..lanes]);
                }
            }
        }
    }

    /// The rows that elements belong to, where those are the same in all lanes.
    fn same_rows(&self) -> Option<FinishedRows> {
        let elements = self.outputs.elements;
        let rows = elements.rows_from(self.base + self.ahead, self.block);
        (elements.step > 1 && rows.step() == elements.step && self.block % elements.step == 0).then_some(rows)
    }

    /// Writes out every row that elements belong to, one element for each lane. Not in the kernel, where it would take registers from the squares.
    #[inline(never)]
    fn write_rows(&mut self, lanes: usize, finished: FinishedRows) {
        let Self { tile, rows, outputs, .. } = self;
        let step = outputs.elements.step;
        let zero = self.base + self.ahead - outputs.elements.first.cast_signed();
        let apart = self.block / step;
        for row in rows.clone().filter(|&row| finished.hold(row)) {
            let first = (zero + row.cast_signed()).unsigned_abs() / step;
            let fields = outputs.values.len();
            for (field, values) in outputs.values.iter_mut().enumerate().filter(|(_, values)| !values.is_empty()) {
                for (lane, value) in values[first..].iter_mut().step_by(apart).take(lanes).enumerate() {
                    *value = tile.one(field, row, lane, lanes);
                }
            }
            if outputs.status.is_empty() && outputs.order.is_empty() {
                continue;
            }
            for lane in 0..lanes {
                let (order, status) =
                    self.fixed_order.map_or_else(|| parts(tile.one(fields, row, lane, lanes)), |order| (order, 0));
                if let Some(slot) = outputs.order.get_mut(first + lane * apart) {
                    *slot = order;
                }
                if let Some(slot) = outputs.status.get_mut(first + lane * apart) {
                    *slot = status;
                }
            }
        }
    }

    /// Writes out what is wanted of every lane to whatever elements there are.
    #[inline(always)]
    fn write_lanes<S: Lanes>(&mut self) {
        let lanes = S::F64_LANES;
        // Lanes that are written, and elements from one to the next beside those of the windows between them.
        let (used, apart) = self.records.map_or((lanes, 0), |records| (records.count, records.elements));
        let Self { tile, rows, outputs, .. } = self;
        for lane in 0..used {
            let zero = self.base + (lane * self.block).cast_signed();
            let row =
                |window: usize| (window.cast_signed() - zero).clamp(rows.start.cast_signed(), rows.end.cast_signed());
            let wanted = row(self.windows.start).unsigned_abs()..row(self.windows.end).unsigned_abs();
            for first in wanted.clone().step_by(TILE) {
                let part = first..wanted.end.min(first + TILE);
                let sample = (zero + self.ahead + first.cast_signed()).unsigned_abs();
                let mut column = [0.0; TILE];
                for (field, values) in outputs.values.iter_mut().enumerate().filter(|(_, values)| !values.is_empty()) {
                    for (value, row) in column.iter_mut().zip(part.clone()) {
                        *value = tile.one(field, row, lane, lanes);
                    }
                    outputs.elements.put(&mut values[lane * apart..], sample, &column[..part.len()]);
                }
                let (mut orders, mut statuses) = ([self.fixed_order.unwrap_or(0); TILE], [0; TILE]);
                if self.fixed_order.is_none() {
                    for ((order, status), row) in orders.iter_mut().zip(&mut statuses).zip(part.clone()) {
                        (*order, *status) = parts(tile.one(outputs.values.len(), row, lane, lanes));
                    }
                }
                let (own_order, own_status) =
                    (outputs.order.get_mut(lane * apart..), outputs.status.get_mut(lane * apart..));
                outputs.elements.put(own_order.unwrap_or_default(), sample, &orders[..part.len()]);
                outputs.elements.put(own_status.unwrap_or_default(), sample, &statuses[..part.len()]);
            }
        }
    }
}

/// Writes the first window of every lane, which the tile holds, to neighbouring elements.
pub(crate) fn write_row(
    tile: &Tile,
    lanes: usize,
    elements: Range<usize>,
    fixed_order: Option<u8>,
    outputs: &mut Outputs<'_>,
) {
    let one = |field: usize, lane: usize| tile.one(field, 0, lane, lanes);
    for (field, values) in outputs.values.iter_mut().enumerate().filter(|(_, values)| !values.is_empty()) {
        for (lane, value) in values[elements.clone()].iter_mut().enumerate() {
            *value = one(field, lane);
        }
    }
    let code = |lane: usize| fixed_order.map_or_else(|| parts(one(outputs.values.len(), lane)), |order| (order, 0));
    if !outputs.order.is_empty() {
        for (lane, order) in outputs.order[elements.clone()].iter_mut().enumerate() {
            *order = code(lane).0;
        }
    }
    if !outputs.status.is_empty() {
        for (lane, status) in outputs.status[elements].iter_mut().enumerate() {
            *status = code(lane).1;
        }
    }
}

/// Writes the windows that the tile holds, those of all lanes one after the other from its first place on, to neighbouring elements.
#[inline(always)]
pub(crate) fn write_block<S: Lanes>(simd: S, tile: &Tile, elements: Range<usize>, outputs: &mut Outputs<'_>) {
    let lanes = S::F64_LANES;
    let whole = elements.len() - elements.len() % lanes;
    for (field, values) in outputs.values.iter_mut().enumerate().filter(|(_, values)| !values.is_empty()) {
        let (from, to) = (tile.all(field, lanes), &mut values[elements.clone()]);
        for at in (0..whole).step_by(lanes) {
            simd.store(to, at, simd.load(from, at));
        }
        for (to, from) in to[whole..].iter_mut().zip(&from[whole..]) {
            *to = *from;
        }
    }
    if !outputs.status.is_empty() {
        let (codes, to) = (tile.all(outputs.values.len(), lanes), &mut outputs.status[elements]);
        let mut orders = [0; MOST_LANES];
        for at in (0..whole).step_by(lanes) {
            simd.split(simd.load(codes, at), &mut orders, &mut to[at..at + lanes]);
        }
        for (status, &code) in to[whole..].iter_mut().zip(&codes[whole..]) {
            *status = parts(code).1;
        }
    }
}

/// The order and the flags of a code.
fn parts(code: f64) -> (u8, u16) {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number below 2^24")]
    let [order, low, high, _] = (code as u32).to_le_bytes();
    (order, u16::from_le_bytes([low, high]))
}
