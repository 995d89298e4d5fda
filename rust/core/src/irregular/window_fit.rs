//! Local polynomials where samples have times of their own: every window has a design of its own.
//!
//! The choice of the order, the derivatives near the ends and the standard errors are those of windows on a uniform grid
//! ([`crate::local_polynomials`]); a window holds so many samples, or those of so many seconds.
//!
//! A QR decomposition says what a window's fit is. Nearly all windows have neighbours with whom they share a basis, which gives the same in a tenth to a
//! hundredth of the time ([`crate::irregular::shared_windows`]).

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{Piece, Watch, run};
use crate::irregular::order_sums::OrderSums;
use crate::irregular::order_table::{NEGLIGIBLE, OrderTable};
use crate::irregular::own_basis::{OwnBasis, dot};
use crate::irregular::shared_buffers::GroupSamples;
use crate::irregular::shared_windows::{WindowsAbreast, can_share};
use crate::irregular::window_estimates::{WindowFit, WindowFits};
use crate::irregular::window_places::{Numbered, OwnWindow, PlacedWindow, WindowSpan, groups};
use crate::local_polynomials::options::Order;
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::record::samples::is_usable;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::dispatch;

/// Windows of a piece of work, at least. So many times as long as a window, it has several groups of windows for each lane.
const WINDOWS: usize = 256;
const LENGTHS: usize = 4;
/// Pieces of a record at least, if they are no smaller than that, and samples in the windows of a piece at most: it may be that nothing can be shared.
const PIECES: usize = 16;
const MOST_SAMPLES: usize = 1 << 22;

/// The fewest samples of a window.
pub const FEWEST: usize = 5;

/// Memory of one thread.
#[derive(Debug, Default)]
struct FitMemory {
    basis: OwnBasis,
    shared: GroupSamples,
    /// By length of the window.
    tables: Vec<Option<Box<OrderTable>>>,
}

/// One window's polynomials.
struct FittedWindow {
    coefficients: Vec<f64>,
    /// Residual sum of squares of every order, and what rounding or quantisation leaves of it at least.
    residuals: Vec<f64>,
    floor: f64,
    reference: f64,
    /// Root of the weight that residuals are those of.
    unit: f64,
}

impl WindowFit {
    /// Fits the window around every `step`-th sample; `fits` has a place for each. Standard errors cost a fifth more.
    ///
    /// # Errors
    /// If the watch cancels.
    pub fn fit(
        &self,
        record: &[f64],
        step: usize,
        mut fits: WindowFits<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let count = record.len().div_ceil(step);
        let shares = self.weights.is_none() && can_share(1, self.derivatives);
        let lengths = if shares { LENGTHS } else { 0 };
        let usual = self.usual_length().max(1);
        let most = (MOST_SAMPLES / usual).min(count.div_ceil(PIECES));
        let at_once = WINDOWS.max((lengths * usual / step).min(most));
        let ranges = (0..count).step_by(at_once).map(|first| first..count.min(first + at_once));
        let piece = |windows: Range<usize>| Piece {
            size: windows.len(),
            content: (Numbered { first: windows.start, step }, fits.take_first(windows.len())),
        };
        let pieces = ranges.map(piece).collect();
        let instructions = Instructions::current();
        let work = |(numbered, fits): (Numbered, WindowFits<'_>), memory: &mut FitMemory| {
            self.piece(record, numbered, fits, instructions, memory);
        };
        run(pieces, workers, FitMemory::default, work, watch)
    }

    /// Samples of a window, on average.
    fn usual_length(&self) -> usize {
        match self.span {
            WindowSpan::Samples(length) => length,
            WindowSpan::Seconds(length) => {
                let record = self.times[self.times.len() - 1] - self.times[0];
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of samples")]
                let samples = (length / record.max(length) * self.times.len() as f64) as usize;
                samples
            }
        }
    }

    /// Fits some windows: those that share a basis side by side, and the others one by one.
    fn piece(
        &self,
        record: &[f64],
        numbered: Numbered,
        mut fits: WindowFits<'_>,
        instructions: Instructions,
        memory: &mut FitMemory,
    ) {
        let windows = numbered.first..numbered.first + fits.order.len();
        let placed = self.span.places(&self.times, windows, numbered.step);
        let done = self.side_by_side(record, &placed, numbered, instructions, memory, &mut fits);
        self.one_by_one(record, &placed, numbered, &done, &mut memory.basis, &mut fits);
    }

    /// Fits the windows that share a basis and lose nothing by it; returns which do.
    fn side_by_side(
        &self,
        record: &[f64],
        placed: &[PlacedWindow],
        numbered: Numbered,
        instructions: Instructions,
        memory: &mut FitMemory,
        fits: &mut WindowFits<'_>,
    ) -> Vec<bool> {
        let FitMemory { shared, tables, .. } = memory;
        for same in placed.chunk_by(|one, other| one.samples.len() == other.samples.len()) {
            let length = same[0].samples.len();
            if length >= tables.len() {
                tables.resize(length + 1, None);
            }
            tables[length].get_or_insert_with(|| Box::new(OrderTable::new(self.order, length)));
        }
        let table = |length: usize| tables[length].as_deref().expect("made for every window");
        let degrees = |length: usize| {
            let degrees = table(length).degrees;
            let shares = self.weights.is_none() && length >= FEWEST.max(self.least);
            (shares && can_share(degrees, self.derivatives)).then_some(degrees)
        };
        let mut groups = groups(&self.times, record, placed, degrees);
        groups.sort_by_key(|group| group.degrees);
        let mut done = vec![false; placed.len()];
        let kernel = WindowsAbreast {
            fit: self,
            record,
            placed,
            numbered,
            tables: &table,
            groups: &groups,
            memory: shared,
            fits,
            done: &mut done,
        };
        dispatch(instructions, kernel);
        done
    }

    /// Fits the windows that are not done, each by a QR decomposition of its own.
    fn one_by_one(
        &self,
        record: &[f64],
        placed: &[PlacedWindow],
        numbered: Numbered,
        done: &[bool],
        basis: &mut OwnBasis,
        fits: &mut WindowFits<'_>,
    ) {
        let mut last: Option<(OwnWindow<'_>, Option<FittedWindow>)> = None;
        for (place, window) in placed.iter().enumerate().filter(|(place, _)| !done[*place]) {
            let sample = numbered.sample(place);
            let own = self.span.own(&self.times, sample, window);
            // Near the ends many samples have the same window.
            let fitted = match &last {
                Some((before, fitted)) if *before == own => fitted,
                _ => &last.insert((own, self.fitted(record, own, basis))).1,
            };
            match fitted {
                Some(fitted) => self.one(own, fitted, sample, basis, fits, place),
                None => fits.invalidate(place),
            }
        }
    }

    /// The criterion of every candidate order in the window around a sample; NaN where it cannot be fitted.
    #[must_use]
    pub fn scores(&self, record: &[f64], sample: usize) -> Vec<f64> {
        let mut basis = OwnBasis::default();
        let window = self.span.around(&self.times, sample);
        let own = self.span.own(&self.times, sample, &window);
        let Order::Chosen { criterion, highest } = self.order else { return vec![f64::NAN] };
        let score = |fitted: FittedWindow| {
            let length = window.samples.len();
            let of = |(order, residual): (usize, &f64)| criterion.score(residual.max(fitted.floor), order, length);
            fitted.residuals.iter().enumerate().map(of).collect()
        };
        self.fitted(record, own, &mut basis).map_or_else(|| vec![f64::NAN; highest + 1], score)
    }

    /// Fits all candidates to a window, or `None` where it holds an unusable sample or too few.
    fn fitted(&self, record: &[f64], window: OwnWindow<'_>, basis: &mut OwnBasis) -> Option<FittedWindow> {
        let range = window.placed.samples.clone();
        let (samples, length) = (&record[range.clone()], range.len());
        let candidates = OrderTable::new(self.order, length).degrees;
        if length < self.least || candidates == 0 || !samples.iter().all(|&value| is_usable(value)) {
            return None;
        }
        let (unit, roots) = self.roots_of_weights(range.clone());
        let times: Vec<f64> = self.times[range].iter().map(|time| (time - window.middle) / window.half).collect();
        basis.make(&times, roots.as_deref(), candidates);
        let reference = samples[length / 2];
        let mut left: Vec<f64> = samples.iter().map(|value| value - reference).collect();
        if let Some(roots) = &roots {
            left.iter_mut().zip(roots).for_each(|(value, root)| *value *= root);
        }
        let energy = dot(&left, &left);
        let coefficients = basis.project(&mut left);
        if roots.is_some() && matches!(self.order, Order::Fixed(order) if order >= coefficients.len()) {
            return None;
        }
        let mut residuals = vec![dot(&left, &left); coefficients.len()];
        for order in (0..coefficients.len() - 1).rev() {
            residuals[order] = residuals[order + 1] + coefficients[order + 1].powi(2);
        }
        let count = roots.as_ref().map_or(length as f64, |roots| dot(roots, roots));
        let floor = (count * self.quantisation * self.quantisation / 12.0).max(ROUNDING * energy);
        Some(FittedWindow { coefficients, residuals, floor, reference, unit })
    }

    /// Writes the estimates of a window that was fitted alone, whose basis is the last that was made.
    fn one(
        &self,
        window: OwnWindow<'_>,
        fitted: &FittedWindow,
        sample: usize,
        basis: &OwnBasis,
        fits: &mut WindowFits<'_>,
        place: usize,
    ) {
        let (edge, length, degrees) = (window.placed.edge, window.placed.samples.len(), fitted.coefficients.len());
        let variance = |order: usize| {
            let free = length - order - 1;
            if free == 0 { f64::NAN } else { fitted.residuals[order].max(fitted.floor) / free as f64 }
        };
        let (order, shares) = match self.order {
            Order::Fixed(order) => (order.min(degrees - 1), None),
            Order::Chosen { criterion, .. } => {
                let weight = |order: usize| fitted.residuals[order].max(fitted.floor) * criterion.weight(order, length);
                let best = (0..degrees).fold(0, |best, one| if weight(one) < weight(best) { one } else { best });
                let least = weight(best).max(f64::MIN_POSITIVE);
                let share = |order: usize| {
                    let above = length as f64 * (weight(order).max(f64::MIN_POSITIVE) / least).ln();
                    if above < NEGLIGIBLE { (-above / 2.0).exp() } else { 0.0 }
                };
                (best, Some((0..degrees).map(share).collect::<Vec<f64>>()))
            }
        };
        let polynomials = basis.at((self.times[sample] - window.middle) / window.half, self.derivatives);
        for (derivative, polynomials) in polynomials.iter().enumerate() {
            let scale = window.half.powi(-i32::try_from(derivative).unwrap_or(i32::MAX));
            let level = if derivative == 0 { fitted.reference } else { 0.0 };
            let sums = OrderSums::new(polynomials, &fitted.coefficients);
            let taken = match shares {
                Some(_) if edge => sums.best(order, derivative, variance(order)),
                _ => order,
            };
            fits.derivatives[derivative][place] = level + sums.values[taken] * scale;
            let Some(errors) = fits.errors.get_mut(derivative) else { continue };
            let error = match &shares {
                Some(shares) if !edge => sums.error(taken, shares, variance),
                _ => (variance(order) * sums.gains[taken]).sqrt(),
            };
            errors[place] = error * scale;
        }
        let exact = fitted.residuals[order] <= fitted.floor;
        fits.order[place] = u8::try_from(order).unwrap_or(u8::MAX);
        fits.status[place] = self.status(order, degrees, edge, exact).bits();
        fits.sigma[place] = variance(order).sqrt() * fitted.unit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::irregular::shared_windows::LOST;
    use crate::local_polynomials::criterion::Criterion;

    /// Numbers between zero and one.
    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*seed >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Noise of variance one.
    fn noise(seed: &mut u64) -> f64 {
        (-2.0 * random(seed).ln()).sqrt() * (std::f64::consts::TAU * random(seed)).cos()
    }

    /// Steps of time: hardly, somewhat and much scattered, exponential, and with gaps.
    const STEPS: [fn(&mut u64) -> f64; 5] = [
        |seed| 1.0 + 0.02 * (random(seed) - 0.5),
        |seed| 1.0 + 0.24 * (random(seed) - 0.5),
        |seed| 0.5 + random(seed),
        |seed| -random(seed).ln(),
        |seed| if random(seed) < 0.01 { 40.0 } else { 0.9 + 0.2 * random(seed) },
    ];

    /// Noise of different levels, an offset, a motion that windows are too long for, and outliers.
    const SIGNALS: [fn(f64, &mut u64) -> f64; 5] = [
        |time, seed| (40.0 * time).sin() + 1e-3 * noise(seed),
        |time, seed| (40.0 * time).sin() + 1e-10 * noise(seed),
        |time, seed| 1e6 + (40.0 * time).sin() + 1e-3 * noise(seed),
        |time, seed| (400.0 * time).sin() + 1e-3 * noise(seed),
        |time, seed| (40.0 * time).sin() + 1e-3 * noise(seed) + if random(seed) < 0.002 { 1e6 } else { 0.0 },
    ];

    fn plan(times: Vec<f64>, span: WindowSpan, order: Order) -> WindowFit {
        WindowFit { times, span, order, derivatives: 2, quantisation: 0.0, weights: None, least: FEWEST }
    }

    /// What was found in windows.
    struct FoundWindows {
        derivatives: Vec<Vec<f64>>,
        errors: Vec<Vec<f64>>,
        order: Vec<u8>,
        status: Vec<u16>,
        sigma: Vec<f64>,
    }

    impl FoundWindows {
        /// Windows of which nothing is known yet, and which have standard errors.
        fn new(derivatives: usize, windows: usize) -> Self {
            let columns = vec![vec![f64::NAN; windows]; derivatives + 1];
            let (order, status, sigma) = (vec![0; windows], vec![0; windows], vec![f64::NAN; windows]);
            Self { derivatives: columns.clone(), errors: columns, order, status, sigma }
        }

        fn fits(&mut self) -> WindowFits<'_> {
            WindowFits {
                derivatives: self.derivatives.iter_mut().map(Vec::as_mut_slice).collect(),
                errors: self.errors.iter_mut().map(Vec::as_mut_slice).collect(),
                order: &mut self.order,
                status: &mut self.status,
                sigma: &mut self.sigma,
            }
        }

        /// All windows of a record, with their standard errors where they are asked for.
        fn of(fit: &WindowFit, record: &[f64], errors: bool) -> Self {
            let mut found = Self::new(fit.derivatives, record.len());
            if !errors {
                found.errors.clear();
            }
            fit.fit(record, 1, found.fits(), NonZeroUsize::MIN, &mut |_, _| true).expect("nothing cancels");
            found
        }
    }

    /// Which samples the windows of a whole record are around.
    const EVERY: Numbered = Numbered { first: 0, step: 1 };

    /// What a QR decomposition of every so-many-th window finds; of others nothing is known.
    fn one_by_one(fit: &WindowFit, record: &[f64], every: usize) -> FoundWindows {
        let placed = fit.span.places(&fit.times, 0..record.len(), 1);
        let mut found = FoundWindows::new(fit.derivatives, placed.len());
        let skipped: Vec<bool> = (0..placed.len()).map(|window| window % every > 0).collect();
        fit.one_by_one(record, &placed, EVERY, &skipped, &mut OwnBasis::default(), &mut found.fits());
        found
    }

    /// Compares windows in standard errors of their own. Where the noise is hardly above rounding, both are as far from the truth.
    fn assert_same(found: &FoundWindows, expected: &FoundWindows, rounding: f64, what: &str) {
        for window in (0..found.order.len()).filter(|window| !expected.sigma[*window].is_nan()) {
            assert_eq!(found.order[window], expected.order[window], "{what}, order at {window}");
            assert_eq!(found.status[window], expected.status[window], "{what}, status at {window}");
            let near = |one: f64, other: f64, scale: f64| (one - other).abs() <= (10.0 * LOST + rounding) * scale;
            let sigma = expected.sigma[window];
            assert!(near(found.sigma[window], sigma, sigma), "{what}, noise at {window}");
            for derivative in 0..found.derivatives.len() {
                let error = expected.errors[derivative][window];
                if let Some(errors) = found.errors.get(derivative) {
                    assert!(near(errors[window], error, error), "{what}, error at {window}");
                }
                let [one, other] = [found, expected].map(|fits| fits.derivatives[derivative][window]);
                let digits = 4.0 * f64::EPSILON * other.abs();
                assert!(
                    (one - other).abs() <= (10.0 * LOST + rounding) * error + digits,
                    "{what}, {derivative} at {window}"
                );
            }
        }
    }

    #[test]
    fn windows_that_share_a_basis_are_what_each_is_alone() {
        let chosen = |highest| Order::Chosen { criterion: Criterion::Aicc, highest };
        for (steps, signal) in (0..STEPS.len()).flat_map(|steps| (0..SIGNALS.len()).map(move |signal| (steps, signal)))
        {
            let (mut seed, mut time) = (11, 3.0);
            let mut step = || {
                time += STEPS[steps](&mut seed) / 1000.0;
                time
            };
            let times: Vec<f64> = (0..250).map(|_| step()).collect();
            let record: Vec<f64> = times.iter().map(|time| SIGNALS[signal](*time, &mut seed)).collect();
            for (case, (length, order)) in
                [(11, chosen(10)), (51, Order::Fixed(4)), (51, chosen(15))].into_iter().enumerate()
            {
                let by_count = (steps + signal + case) % 2 == 0;
                let span =
                    if by_count { WindowSpan::Samples(length) } else { WindowSpan::Seconds(length as f64 / 1000.0) };
                let fit = plan(times.clone(), span, order);
                let what = format!("steps {steps}, signal {signal}, {span:?}, {order:?}");
                // Rounding of the samples is 1e-16, in 1e-10 of noise.
                let rounding = if signal == 1 { 1e-4 } else { 0.0 };
                let expected = one_by_one(&fit, &record, 5);
                for errors in [true, false] {
                    assert_same(&FoundWindows::of(&fit, &record, errors), &expected, rounding, &what);
                }
            }
        }
    }

    #[test]
    fn nearly_all_windows_of_jittering_times_share_a_basis_on_every_path() {
        let (mut seed, mut time) = (5, 0.0);
        let mut step = || {
            time += STEPS[2](&mut seed) / 1000.0;
            time
        };
        let times: Vec<f64> = (0..800).map(|_| step()).collect();
        let record: Vec<f64> = times.iter().map(|time| SIGNALS[0](*time, &mut seed)).collect();
        let order = Order::Chosen { criterion: Criterion::Aicc, highest: 15 };
        for span in [WindowSpan::Samples(101), WindowSpan::Seconds(0.051)] {
            let fit = plan(times.clone(), span, order);
            let expected = one_by_one(&fit, &record, 10);
            for instructions in Instructions::available() {
                let placed = fit.span.places(&fit.times, 0..record.len(), 1);
                let mut found = FoundWindows::new(fit.derivatives, placed.len());
                let mut memory = FitMemory::default();
                let done = fit.side_by_side(&record, &placed, EVERY, instructions, &mut memory, &mut found.fits());
                let missed = placed.iter().zip(&done).filter(|(window, done)| !window.edge && !**done).count();
                assert!(missed * 50 < record.len(), "{missed} with {instructions:?}");
                fit.one_by_one(&record, &placed, EVERY, &done, &mut OwnBasis::default(), &mut found.fits());
                assert_same(&found, &expected, 0.0, &format!("{instructions:?}"));
            }
        }
    }
}
