//! Dot products of a channel with several kernels, around every `stride`-th sample.
//!
//! A kernel as wide as a window carries all its information at every sixth of its half-width or so. Therefore all rows
//! of a block are one matrix product: the Hankel matrix of the samples, which is only a view of them, times the
//! kernels. Blocks lie on a grid of absolute row numbers and always have the same shape, so the numbers do not depend
//! on how the work is cut.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use crate::equation::rows::BLOCK;
use crate::record::samples::{Samples, is_usable};
use crate::weak_form::test_function::sum;

/// Kernels of one length that are applied to one channel, around every `stride`-th sample.
#[derive(Clone, Debug)]
pub(crate) struct FilterBank {
    /// One column a kernel.
    kernels: Mat<f64>,
    /// Their sums: their response to a constant.
    sums: Vec<f64>,
    stride: usize,
}

/// Memory of one thread.
#[derive(Clone, Debug)]
pub(crate) struct FilterScratch {
    samples: Vec<f64>,
    /// Places in `samples` that cannot be used, in order.
    unusable: Vec<usize>,
    products: Mat<f64>,
}

impl Default for FilterScratch {
    fn default() -> Self {
        Self { samples: Vec::new(), unusable: Vec::new(), products: Mat::new() }
    }
}

impl FilterBank {
    /// Kernels of one length, at least one.
    pub(crate) fn new(kernels: &[&[f64]], stride: usize) -> Self {
        let length = kernels.first().copied().map_or(0, <[f64]>::len);
        Self {
            kernels: Mat::from_fn(length, kernels.len(), |row, column| kernels[column][row]),
            sums: kernels.iter().map(|kernel| sum(kernel)).collect(),
            stride,
        }
    }

    /// Number of kernels.
    pub(crate) fn kernels(&self) -> usize {
        self.kernels.ncols()
    }

    /// Applies the kernels in the rows from `first` on, of which row `r` begins at sample `r · stride`; `first` must be a multiple of
    /// [`BLOCK`]. One output a kernel; rows with an unusable sample are marked in `usable`.
    pub(crate) fn apply(
        &self,
        channel: &dyn Samples,
        first: usize,
        outputs: &mut [&mut [f64]],
        usable: &mut [bool],
        scratch: &mut FilterScratch,
    ) {
        assert_eq!(first % BLOCK, 0, "blocks lie on a grid of row numbers");
        for begin in (0..usable.len()).step_by(BLOCK) {
            let rows = begin..usable.len().min(begin + BLOCK);
            self.block(channel, first + begin, scratch);
            for (kernel, output) in outputs.iter_mut().enumerate() {
                let products = &scratch.products.col(kernel);
                output[rows.clone()].iter_mut().enumerate().for_each(|(row, value)| *value = products[row]);
            }
            let length = self.kernels.nrows();
            for (row, usable) in usable[rows].iter_mut().enumerate() {
                let begin = row * self.stride;
                let next = scratch.unusable.partition_point(|&place| place < begin);
                *usable &= scratch.unusable.get(next).is_none_or(|&place| place >= begin + length);
            }
        }
    }

    /// All products of one block. Samples beyond the record count as zero.
    fn block(&self, channel: &dyn Samples, first: usize, scratch: &mut FilterScratch) {
        let FilterScratch { samples, unusable, products } = scratch;
        let length = self.kernels.nrows();
        samples.resize((BLOCK - 1) * self.stride + length, 0.0);
        let begin = first * self.stride;
        let present = channel.len().saturating_sub(begin).min(samples.len());
        channel.read(begin, &mut samples[..present]);
        samples[present..].fill(0.0);
        unusable.clear();
        for (place, value) in samples[..present].iter_mut().enumerate() {
            if !is_usable(*value) {
                *value = 0.0;
                unusable.push(place);
            }
        }
        // An offset would cost digits: a typical sample is subtracted, and its response is added at the end.
        let last = present.max(1) - 1;
        let reference = middle([samples[0], samples[last / 2], samples[last]]);
        for value in samples.iter_mut() {
            *value -= reference;
        }
        if products.shape() != (BLOCK, self.kernels()) {
            *products = Mat::zeros(BLOCK, self.kernels());
        }
        // SAFETY: the last row ends at `(BLOCK - 1) · stride + length`, which is the length of the samples; rows may overlap, since they
        // are only read.
        let hankel = unsafe { MatRef::from_raw_parts(samples.as_ptr(), BLOCK, length, self.stride.cast_signed(), 1) };
        matmul(products.as_mut(), Accum::Replace, hankel, self.kernels.as_ref(), 1.0, Par::Seq);
        for (kernel, sum) in self.sums.iter().enumerate() {
            let offset = sum * reference;
            products.col_mut(kernel).iter_mut().for_each(|value| *value += offset);
        }
    }
}

/// The median of three numbers: never a single glitch.
fn middle([a, b, c]: [f64; 3]) -> f64 {
    a.max(b).min(a.min(b).max(c))
}
