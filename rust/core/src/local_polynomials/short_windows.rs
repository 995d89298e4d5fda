//! Short windows of a fixed order: what is wanted of them is a sum over their samples, each by itself.
//!
//! Where no residual is followed, a few samples cost less than steps from one window to the next, whose coefficients are summed anew for every
//! derivative.

use std::ops::Range;

use crate::lanes::output::Outputs;
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::evaluate::Finish;
use crate::local_polynomials::mirrored_kernels::{LONGEST, MirroredKernels, MirroredScratch};
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;
use crate::status::Status;

/// The plan for windows of one length.
#[derive(Debug)]
pub(crate) struct ShortWindows {
    kernels: MirroredKernels,
    /// Samples before the one at the centre, as many as after it.
    half: usize,
    order: u8,
}

impl ShortWindows {
    /// Prepares what is wanted, where windows have a sample at their centre and one order.
    pub(crate) fn new(basis: &Basis, finish: &Finish, instructions: Instructions) -> Option<Self> {
        let (half, order) = (basis.length() / 2, finish.fixed_order(false)?);
        if basis.length().is_multiple_of(2) || half > LONGEST || finish.functionals().is_empty() {
            return None;
        }
        let kernels: Vec<_> = finish.functionals().iter().map(|one| one.kernel(basis)).collect();
        Some(Self { kernels: MirroredKernels::new(half, &kernels, instructions), half, order })
    }

    /// Whether they cost less so than by steps with so many degrees, of which few are wanted: half of what steps to all coefficients cost. All of them
    /// must, so that every `step`-th is the same as among all.
    pub(crate) fn serve(&self, outputs: &Outputs<'_>, degrees: usize) -> bool {
        let serve = |step: usize| self.kernels.serve(step, degrees / 2);
        outputs.values.iter().any(|values| !values.is_empty()) && serve(1) && serve(outputs.elements.step)
    }

    /// Writes what is wanted of some windows of a record.
    pub(crate) fn write(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        outputs: &mut Outputs<'_>,
        scratch: &mut MirroredScratch,
    ) {
        let all = outputs.elements;
        let elements = all.of(windows.start + self.half..windows.end + self.half);
        if elements.is_empty() {
            return;
        }
        let windows = all.sample(elements.start) - self.half..windows.end;
        let mut own = outputs.part(elements.clone());
        self.kernels.apply(record, windows, all.step, (&mut [], &mut own.values), scratch);
        if own.order.is_empty() && own.status.is_empty() {
            return;
        }
        own.order.fill(self.order);
        own.status.fill(0);
        let is_unusable = |place: &usize| own.values.iter().any(|row| row.get(*place).is_some_and(|one| one.is_nan()));
        let unusable: Vec<usize> = (0..elements.len()).filter(is_unusable).collect();
        for place in unusable {
            let sample = all.sample(elements.start + place);
            outputs.invalidate(sample..sample + 1, Status::INVALID);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::output::Elements;
    use crate::local_polynomials::estimates::Estimates;
    use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
    use crate::local_polynomials::plan::LocalPolynomials;

    const SAMPLES: usize = 700;
    const LENGTH: usize = 11;
    const UNUSABLE: usize = 300;

    fn record() -> Vec<f64> {
        let mut record: Vec<f64> = (0..SAMPLES).map(|k| 1e6 + (k as f64 * 0.3).sin() + (k % 7) as f64).collect();
        record[UNUSABLE] = f64::NAN;
        record
    }

    /// Value, first derivative and second, of which the second may not be wanted, with orders and flags, of every `step`-th window.
    fn estimated(step: usize, last: bool) -> (Vec<Vec<f64>>, Vec<u8>, Vec<u16>) {
        let plan = LocalPolynomials::new(PolynomialOptions {
            window_length: LENGTH,
            order: Order::Fixed(3),
            selection: Selection::Window,
            derivatives: vec![0, 1, 2],
            delta: 0.5,
            noise: false,
            quantisation: 0.0,
            instructions: Instructions::current(),
        });
        let (plan, record) = (plan.expect("valid options"), record());
        let windows = SAMPLES - LENGTH + 1;
        let (count, first) = (windows.div_ceil(step), LENGTH / 2);
        let mut rows = vec![vec![1.0; count]; 3];
        rows[2].resize(if last { count } else { 0 }, 1.0);
        let (mut order, mut status) = (vec![9; count], vec![9; count]);
        let mut estimates = Estimates {
            elements: Elements { first, step },
            derivatives: rows.iter_mut().map(Vec::as_mut_slice).collect(),
            order: &mut order,
            status: &mut status,
            sigma: &mut [],
        };
        let found =
            plan.estimate_centred(&record.as_slice(), first..first + windows, &mut estimates, &mut plan.scratch());
        found.expect("a record longer than a window");
        (rows, order, status)
    }

    #[test]
    fn windows_are_polynomials_of_their_samples_and_those_with_an_unusable_one_have_none() {
        let ((rows, order, status), record) = (estimated(1, true), record());
        let basis = Basis::new(LENGTH, 4).expect("little memory");
        for (window, samples) in record.windows(LENGTH).enumerate() {
            let unusable = (window..window + LENGTH).contains(&UNUSABLE);
            assert_eq!((order[window], status[window]), if unusable { (0, Status::INVALID.bits()) } else { (3, 0) });
            for (derivative, row) in rows.iter().enumerate() {
                let level = samples[LENGTH / 2];
                let of_degree = |degree: usize, factor: f64| -> f64 {
                    factor * (0..LENGTH).map(|k| basis.value(degree, k) * (samples[k] - level)).sum::<f64>()
                };
                let factors = basis.evaluate(0.0, derivative).into_iter().enumerate();
                let sum: f64 = factors.map(|(degree, factor)| of_degree(degree, factor)).sum();
                let expected = sum / 0.5_f64.powi(i32::try_from(derivative).expect("small"));
                let expected = if derivative == 0 { level + expected } else { expected };
                let rounding = if derivative == 0 { 4.0 * f64::EPSILON * level } else { 1e-12 };
                let close = (row[window] - expected).abs() <= rounding;
                assert_eq!(row[window].is_nan(), unusable, "{window} {derivative}");
                assert!(unusable || close, "{window} {derivative}: {} {expected}", row[window]);
            }
        }
    }

    #[test]
    fn some_windows_and_some_derivatives_are_those_of_all() {
        let all = estimated(1, true);
        for step in [1, 2, 5, 7] {
            let (rows, order, status) = estimated(step, false);
            assert!(rows[2].is_empty());
            for (place, window) in (0..all.1.len()).step_by(step).enumerate() {
                assert_eq!((order[place], status[place]), (all.1[window], all.2[window]));
                for (row, all) in rows[..2].iter().zip(&all.0) {
                    assert_eq!(row[place].to_bits(), all[window].to_bits(), "{step} {window}");
                }
            }
        }
    }
}
