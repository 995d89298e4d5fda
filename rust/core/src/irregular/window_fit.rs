//! Local polynomials where samples have times of their own: every window has a design of its own.
//!
//! The choice of the order, the derivatives near the ends and the standard errors are those of windows on a uniform grid
//! ([`crate::local_polynomials`]); a window holds so many samples, or those of so many seconds.
//!
//! Nearly all windows have neighbours with whom they share a basis ([`crate::irregular::shared_windows`]). The others, and all where samples have weights,
//! have polynomials of their own ([`crate::local_polynomials::weighted_windows`]), which take several times as long.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{Piece, Watch, run};
use crate::irregular::shared_buffers::GroupSamples;
use crate::irregular::shared_windows::{WindowsAbreast, can_share};
use crate::irregular::window_alone::AloneMemory;
use crate::irregular::window_estimates::{WindowFit, WindowFits};
use crate::irregular::window_places::{Numbered, PlacedWindow, WindowSpan, groups};
use crate::local_polynomials::options::Order;
use crate::local_polynomials::order_table::OrderTables;
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
    alone: AloneMemory,
    shared: GroupSamples,
    /// By length of the window.
    tables: OrderTables,
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
        let FitMemory { alone, tables, .. } = memory;
        let table = |length: usize| tables.of(length);
        let passes = [(instructions, false), (instructions, true)];
        self.apart(record, &placed, numbered, (&done, &passes), (&table, alone), &mut fits);
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
        memory.make_tables(self.order, placed);
        let FitMemory { shared, tables, .. } = memory;
        let table = |length: usize| tables.of(length);
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
}

impl FitMemory {
    /// Makes the tables of windows.
    fn make_tables(&mut self, order: Order, placed: &[PlacedWindow]) {
        for same in placed.chunk_by(|one, other| one.samples.len() == other.samples.len()) {
            self.tables.make(order, same[0].samples.len());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local_polynomials::criterion::Criterion;
    use crate::local_polynomials::kept_digits::LOST;

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

    /// Fits windows by polynomials of their own, made orthogonal twice: what a QR decomposition finds.
    fn alone(fit: &WindowFit, record: &[f64], (placed, done): (&[PlacedWindow], &[bool]), found: &mut FoundWindows) {
        let mut memory = FitMemory::default();
        memory.make_tables(fit.order, placed);
        let FitMemory { alone, tables, .. } = &mut memory;
        let table = |length: usize| tables.of(length);
        fit.apart(record, placed, EVERY, (done, &[(Instructions::Scalar, true)]), (&table, alone), &mut found.fits());
    }

    /// What a QR decomposition of every so-many-th window finds; of others nothing is known.
    fn one_by_one(fit: &WindowFit, record: &[f64], every: usize) -> FoundWindows {
        let placed = fit.span.places(&fit.times, 0..record.len(), 1);
        let mut found = FoundWindows::new(fit.derivatives, placed.len());
        let skipped: Vec<bool> = (0..placed.len()).map(|window| window % every > 0).collect();
        alone(fit, record, (&placed, &skipped), &mut found);
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
                alone(&fit, &record, (&placed, &done), &mut found);
                assert_same(&found, &expected, 0.0, &format!("{instructions:?}"));
            }
        }
    }
}
