//! Windows that lie close to each other share one basis: their normal matrices are slid from window to window and decomposed side by side.
//!
//! A group of windows (see [`crate::irregular::window_places`]) has one time from -1 to 1 and one polynomial that is taken off its samples, so that sums are
//! as small as the noise and lose no digits to the motion. What a window's own fit adds to it, and what each order explains, follow from the factor of
//! its normal matrix. A window for which that may lose more than [`LOST`] is left to a QR decomposition of its own.

use std::array::from_fn;

use crate::irregular::order_table::{OrderTable, TableColumns};
use crate::irregular::shared_buffers::{GroupSamples, SlidSums};
use crate::irregular::shared_choice::{OrderResiduals, sums, turned};
use crate::irregular::shared_factor::{DERIVATIVES, SharedFactor};
use crate::irregular::shared_sums::{MOST, at};
use crate::irregular::window_estimates::{WindowFit, WindowFits};
use crate::irregular::window_places::{PlacedWindow, WindowGroup};
use crate::local_polynomials::options::Order;
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};

/// What rounding may change of a residual sum of squares, at most, as a part of it.
pub(crate) const LOST: f64 = 1e-8;

/// The rounding of the polynomial that is taken off, at most, as a part of the residual sum of squares: where that is rounding itself, or nearly.
const ROUNDED: f64 = 1e-6;

/// Whether windows of so many candidates and derivatives from 0 on can share a basis.
pub(crate) fn can_share(degrees: usize, derivatives: usize) -> bool {
    (1..=MOST).contains(&degrees) && derivatives < DERIVATIVES
}

/// Groups of windows, and where their results go.
pub(crate) struct WindowsAbreast<'a> {
    pub(crate) fit: &'a WindowFit,
    pub(crate) record: &'a [f64],
    /// Windows of a piece, the sample that each is for, and their tables.
    pub(crate) placed: &'a [PlacedWindow],
    pub(crate) samples: &'a dyn Fn(usize) -> usize,
    pub(crate) tables: &'a dyn Fn(usize) -> &'a OrderTable,
    pub(crate) groups: &'a [WindowGroup],
    pub(crate) memory: &'a mut GroupSamples,
    pub(crate) fits: &'a mut WindowFits,
    /// Becomes true for windows that are done.
    pub(crate) done: &'a mut [bool],
}

impl Kernel for WindowsAbreast<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let mut work = Workspace { columns: TableColumns::new(S::F64_LANES), factor: SharedFactor::zero(simd) };
        for same in self.groups.chunk_by(|one, other| one.degrees == other.degrees) {
            for groups in same.chunks(S::F64_LANES) {
                self.batch(simd, groups, &mut work);
            }
        }
    }
}

/// What batch after batch uses.
struct Workspace<S: Lanes> {
    columns: TableColumns,
    factor: SharedFactor<S>,
}

/// Windows side by side: what the kernel knows of each lane's.
struct Abreast {
    /// The number of each lane's window, where it has one.
    windows: [Option<usize>; MOST_LANES],
    /// Time of the sample that it is for, in the group's time, and one over the half length of the group.
    time: [f64; MOST_LANES],
    scale: [f64; MOST_LANES],
    /// What its own reference is above that of the group, and the reference of the group.
    above: [f64; MOST_LANES],
    reference: [f64; MOST_LANES],
}

/// What was found in windows side by side.
struct FoundAbreast {
    values: [[f64; MOST_LANES]; DERIVATIVES],
    errors: [[f64; MOST_LANES]; DERIVATIVES],
    order: [f64; MOST_LANES],
    variance: [f64; MOST_LANES],
    /// Bits of lanes.
    exact: u32,
    good: u32,
}

impl WindowsAbreast<'_> {
    /// Fits the windows of a group in each lane.
    #[inline(always)]
    fn batch<S: Lanes>(&mut self, simd: S, groups: &[WindowGroup], work: &mut Workspace<S>) {
        let degrees = groups[0].degrees;
        self.memory.read(S::F64_LANES, &self.fit.times, self.record, self.placed, groups);
        let mut sums = self.memory.begin(simd, degrees, &mut work.factor);
        let longest = groups.iter().map(|group| group.windows.len()).max().unwrap_or(0);
        for step in 0..longest {
            if step > 0 {
                let (mut entering, mut leaving) = (from_fn(|_| 0..0), from_fn(|_| 0..0));
                for (lane, group) in groups.iter().enumerate().filter(|(_, group)| step < group.windows.len()) {
                    let [first, old, new] =
                        [0, step - 1, step].map(|at| &self.placed[group.windows.start + at].samples);
                    entering[lane] = old.end - first.start..new.end - first.start;
                    leaving[lane] = old.start - first.start..new.start - first.start;
                }
                sums.slide(simd, degrees, self.memory, &entering, &leaving);
            }
            let abreast = self.abreast(groups, step, &mut work.columns);
            let found = self.solve(simd, degrees, &abreast, &sums, work);
            self.write(&abreast, &found);
        }
    }

    /// The window of each lane after so many steps.
    fn abreast(&self, groups: &[WindowGroup], step: usize, columns: &mut TableColumns) -> Abreast {
        let nothing = [0.0; MOST_LANES];
        let mut all = Abreast {
            windows: [None; MOST_LANES],
            time: nothing,
            scale: [1.0; MOST_LANES],
            above: nothing,
            reference: self.memory.references,
        };
        for (lane, group) in groups.iter().enumerate().filter(|(_, group)| step < group.windows.len()) {
            let number = group.windows.start + step;
            let window = &self.placed[number];
            let (middle, scale) = group.scale();
            all.windows[lane] = Some(number);
            all.time[lane] = (self.fit.times[(self.samples)(number)] - middle) * scale;
            all.scale[lane] = scale;
            let own = self.record[window.samples.start + window.samples.len() / 2];
            all.above[lane] = own - all.reference[lane];
            columns.set(lane, (self.tables)(window.samples.len()));
        }
        all
    }

    /// Decomposes the normal matrices of windows side by side, chooses their orders and estimates.
    #[inline(always)]
    fn solve<S: Lanes>(
        &self,
        simd: S,
        degrees: usize,
        abreast: &Abreast,
        window: &SlidSums<S>,
        work: &mut Workspace<S>,
    ) -> FoundAbreast {
        let Workspace { columns, factor } = work;
        let wanted = self.fit.derivatives + 1;
        let zero = simd.splat_f64s(0.0);
        let below = degrees + 2..degrees + 2 + wanted;
        factor.rows.0[degrees] = window.left.products.0;
        at(simd, degrees, simd.load(&abreast.time, 0), &mut factor.rows.0[below.clone()]);
        let before = sums(simd, degrees, &factor.rows.0[below], &window.coefficients.0);
        factor.decompose(simd, degrees, &window.left.moments.0, 2 + wanted);
        let own = OnLines(factor.rows.0[degrees]);
        let mut coefficients = turned(simd, degrees, factor, &window.coefficients.0);
        let (mut residual, mut far, mut rounded) = (window.square, zero, zero);
        for k in 0..degrees {
            let inverse = factor.inverse.0[k];
            let (left, end) = (own.0[k], factor.rows.0[degrees + 1][k]);
            residual = simd.negate_mul_add_f64s(simd.mul_f64s(left, left), inverse, residual);
            far = simd.mul_add_f64s(simd.mul_f64s(end, end), inverse, far);
            rounded = simd.mul_add_f64s(window.tails.0[k], inverse, rounded);
            coefficients.0[k] = simd.add_f64s(coefficients.0[k], left);
        }
        let floor = self.floor(simd, abreast, columns, window);
        let good = is_good(simd, degrees, columns, [far, factor.weakest], [residual, floor, window.peak, rounded]);
        let residuals = OrderResiduals::new(simd, degrees, residual, &coefficients.0, &factor.inverse.0, floor);
        let choice = match self.fit.order {
            Order::Fixed(_) => residuals.fixed(simd, columns),
            Order::Chosen { .. } => residuals.choose(simd, columns),
        };
        let (mut values, mut errors) = ([[0.0; MOST_LANES]; DERIVATIVES], [[0.0; MOST_LANES]; DERIVATIVES]);
        for derivative in 0..wanted {
            let row = &factor.rows.0[degrees + 2 + derivative];
            let mut full = before[derivative];
            for ((polynomial, inverse), own) in row.iter().zip(&factor.inverse.0).zip(&own.0).take(degrees) {
                full = simd.mul_add_f64s(simd.mul_f64s(*polynomial, *inverse), *own, full);
            }
            let parts = [row, &coefficients.0, &factor.inverse.0];
            let (value, error) = residuals.estimate(simd, columns, &choice, parts, full);
            simd.store(&mut values[derivative], 0, value);
            simd.store(&mut errors[derivative], 0, error);
        }
        let (mut order, mut variance) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
        simd.store(&mut order, 0, choice.order);
        simd.store(&mut variance, 0, choice.variance);
        FoundAbreast { values, errors, order, variance, exact: simd.bits(choice.exact), good: simd.bits(good) }
    }

    /// What rounding or quantisation leaves of residuals at least, from the samples' squares about a sample of the window's own.
    #[inline(always)]
    fn floor<S: Lanes>(&self, simd: S, abreast: &Abreast, columns: &TableColumns, window: &SlidSums<S>) -> S::f64s {
        let (length, above) = (simd.load(&columns.length, 0), simd.load(&abreast.above, 0));
        let twice = simd.sub_f64s(simd.mul_f64s(length, above), simd.add_f64s(window.level, window.level));
        let energy = simd.mul_add_f64s(above, twice, window.energy);
        let quantised = simd.splat_f64s(self.fit.quantisation * self.fit.quantisation / 12.0);
        simd.max_f64s(simd.mul_f64s(length, quantised), simd.mul_f64s(energy, simd.splat_f64s(ROUNDING)))
    }

    /// Writes what is good.
    fn write(&mut self, abreast: &Abreast, found: &FoundAbreast) {
        for (lane, window) in abreast.windows.iter().enumerate() {
            let Some(window) = *window else { continue };
            if found.good >> lane & 1 == 0 {
                continue;
            }
            self.done[window] = true;
            let mut scale = 1.0;
            for derivative in 0..=self.fit.derivatives {
                let level = if derivative == 0 { abreast.reference[lane] } else { 0.0 };
                self.fits.derivatives[derivative][window] = level + found.values[derivative][lane] * scale;
                self.fits.errors[derivative][window] = found.errors[derivative][lane] * scale;
                scale *= abreast.scale[lane];
            }
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "an order is a small whole number"
            )]
            let order = found.order[lane] as u8;
            let degrees = (self.tables)(self.placed[window].samples.len()).degrees;
            self.fits.order[window] = order;
            let exact = found.exact >> lane & 1 == 1;
            self.fits.status[window] = self.fit.status(usize::from(order), degrees, false, exact).bits();
            self.fits.sigma[window] = found.variance[lane].sqrt();
        }
    }
}

/// Whether rounding changes a window's residual by no more than it may.
///
/// Rounding changes the normal matrix by `ε` times the number of samples, and the right-hand side by the same part of its largest sum of squares.
/// That changes a residual by as much as solutions are amplified: as one that is made to grow, or where a diagonal is large beside
/// its pivot. The polynomial that was taken off adds the rounding of its own sums, divided by each pivot.
#[inline(always)]
fn is_good<S: Lanes>(
    simd: S,
    degrees: usize,
    columns: &TableColumns,
    amplified: [S::f64s; 2],
    sizes: [S::f64s; 4],
) -> S::m64s {
    let [far, weakest] = amplified;
    let [residual, floor, peak, tails] = sizes;
    let rounding = simd.mul_f64s(simd.load(&columns.length, 0), simd.splat_f64s(f64::EPSILON));
    let worst = simd.max_f64s(simd.mul_f64s(far, simd.splat_f64s(degrees as f64)), weakest);
    let lost = simd.mul_f64s(simd.mul_f64s(worst, rounding), peak);
    let known = simd.max_f64s(residual, floor);
    let is_kept = simd.less_than_or_equal_f64s(lost, simd.mul_f64s(known, simd.splat_f64s(LOST)));
    let rounded = simd.mul_f64s(simd.mul_f64s(tails, rounding), simd.splat_f64s(16.0 * f64::EPSILON));
    simd.and_m64s(is_kept, simd.less_than_or_equal_f64s(rounded, simd.mul_f64s(known, simd.splat_f64s(ROUNDED))))
}
