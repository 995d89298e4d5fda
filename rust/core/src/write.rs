//! The kernel that writes finished windows out.

use std::ops::Range;

use crate::local_polynomials::Estimates;
use crate::simd::{Kernel, Lanes};
use crate::status::Status;
use crate::tile::{TILE, Tile};

/// Fills some elements of an output that may not be wanted.
pub(crate) fn fill<T: Copy>(output: &mut [T], elements: &Range<usize>, value: T) {
    if !output.is_empty() {
        output[elements.clone()].fill(value);
    }
}

/// Writes out the windows of the tile at `places`.
pub(crate) struct Write<'a, 'b> {
    pub(crate) tile: &'a mut Tile,
    /// The order of every window, where the tile holds neither noise nor order.
    pub(crate) fixed_order: Option<u8>,
    pub(crate) places: Range<usize>,
    /// The window at the first place in lane 0, and the windows from one lane to the next.
    pub(crate) offset: isize,
    pub(crate) block: usize,
    /// Windows that are wanted.
    pub(crate) windows: Range<usize>,
    /// Samples from a window's first to the one it is around.
    pub(crate) before: usize,
    pub(crate) estimates: &'a mut Estimates<'b>,
}

impl Kernel for Write<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let (lanes, places) = (S::F64_LANES, self.places.clone());
        let windows = self.windows.start.cast_signed()..self.windows.end.cast_signed();
        let end = self.offset + ((lanes - 1) * self.block + places.len()).cast_signed();
        let squares = places.start % lanes == 0 && places.end % lanes == 0;
        let plain =
            self.estimates.elements.step == 1 && self.estimates.order.is_empty() == self.estimates.status.is_empty();
        if squares && plain && windows.start <= self.offset && end <= windows.end {
            self.write_squares(simd);
            return;
        }
        for lane in 0..lanes {
            let offset = self.offset + (lane * self.block).cast_signed();
            let wanted = (windows.start - offset).max(0)..(windows.end - offset).min(places.len().cast_signed());
            if !wanted.is_empty() {
                let window = (offset + wanted.start).unsigned_abs();
                let wanted = places.start + wanted.start.unsigned_abs()..places.start + wanted.end.unsigned_abs();
                self.write_lane::<S>(lane, wanted, window);
            }
        }
    }
}

impl Write<'_, '_> {
    /// Writes out all lanes' windows, a whole number of squares, to neighbouring elements.
    #[inline(always)]
    fn write_squares<S: Lanes>(&mut self, simd: S) {
        let Self { tile, places, block, estimates, .. } = self;
        let fields = estimates.derivatives.len();
        let offset = self.offset.unsigned_abs() + self.before - estimates.elements.first;
        for group in places.clone().step_by(S::F64_LANES) {
            let first = offset + group - places.start;
            for (field, derivative) in estimates.derivatives.iter_mut().enumerate() {
                let square = tile.square(simd, field, group);
                for (lane, &vector) in square[..S::F64_LANES].iter().enumerate() {
                    simd.store(derivative, first + lane * *block, vector);
                }
            }
            if self.fixed_order.is_none() && !estimates.sigma.is_empty() {
                let square = tile.square(simd, fields, group);
                for (lane, &vector) in square[..S::F64_LANES].iter().enumerate() {
                    simd.store(estimates.sigma, first + lane * *block, vector);
                }
            }
            if estimates.order.is_empty() {
                continue;
            }
            if let Some(order) = self.fixed_order {
                for lane in 0..S::F64_LANES {
                    let place = first + lane * *block..first + lane * *block + S::F64_LANES;
                    fill(estimates.order, &place, order);
                    fill(estimates.status, &place, Status::GOOD.bits());
                }
            } else {
                let square = tile.square(simd, fields + 1, group);
                for (lane, &vector) in square[..S::F64_LANES].iter().enumerate() {
                    let place = first + lane * *block..first + lane * *block + S::F64_LANES;
                    simd.split(vector, &mut estimates.order[place.clone()], &mut estimates.status[place]);
                }
            }
        }
    }

    /// Writes out the windows of one lane at `places` of the tile, of which the first is `window`.
    #[inline(always)]
    fn write_lane<S: Lanes>(&mut self, lane: usize, places: Range<usize>, window: usize) {
        let column = self.tile.lane::<S>(lane, &places);
        let (estimates, sample) = (&mut *self.estimates, window + self.before);
        let elements = estimates.elements;
        let mut fields = column.chunks_exact(TILE);
        for (to, from) in estimates.derivatives.iter_mut().zip(&mut fields) {
            elements.put(to, sample, &from[places.clone()]);
        }
        let (mut orders, mut statuses) = ([self.fixed_order.unwrap_or(0); TILE], [Status::GOOD.bits(); TILE]);
        if let (None, Some(sigma), Some(codes)) = (self.fixed_order, fields.next(), fields.next()) {
            elements.put(estimates.sigma, sample, &sigma[places.clone()]);
            for place in places.clone() {
                (orders[place], statuses[place]) = parts(codes[place]);
            }
        }
        elements.put(estimates.order, sample, &orders[places.clone()]);
        elements.put(estimates.status, sample, &statuses[places]);
    }
}

/// The order and the flags of a code.
fn parts(code: f64) -> (u8, u16) {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number below 2^24")]
    let [order, low, high, _] = (code as u32).to_le_bytes();
    (order, u16::from_le_bytes([low, high]))
}
