//! Windows that lie close to each other share one basis: their normal matrices are slid from window to window and decomposed side by side.
//!
//! A group of windows (see [`crate::irregular::window_places`]) has one time from -1 to 1 and one polynomial that is taken off its samples, so that sums are
//! as small as the noise and lose no digits to the motion. What a window's own fit adds to it, and what each order explains, follow from the factor of
//! its normal matrix. A window for which that may lose more than [`LOST`](crate::local_polynomials::kept_digits::LOST) is left to a QR decomposition of its own.

use std::array::from_fn;
use std::ops::Range;

use crate::irregular::shared_buffers::{GroupSamples, Moves, SlidSums};
use crate::irregular::window_estimates::{WindowFit, WindowFits};
use crate::irregular::window_places::{Numbered, PlacedWindow, WindowGroup, WindowSpan};
use crate::lanes::tile::{Tile, WindowFields};
use crate::local_polynomials::chebyshev_factor::ChebyshevFactor;
use crate::local_polynomials::chebyshev_sums::{DERIVATIVES, MOST, at};
use crate::local_polynomials::kept_digits::KeptDigits;
use crate::local_polynomials::options::Order;
use crate::local_polynomials::order_table::OrderTable;
use crate::local_polynomials::orders_abreast::{ChosenOrders, DerivativeParts, OrderResiduals, OrderShares, sums};
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::local_polynomials::table_columns::TableColumns;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};
use crate::status::Status;

/// Whether windows of so many candidates and derivatives from 0 on can share a basis.
pub(crate) fn can_share(degrees: usize, derivatives: usize) -> bool {
    (1..=MOST).contains(&degrees) && derivatives < DERIVATIVES
}

/// Groups of windows, and where their results go.
pub(crate) struct WindowsAbreast<'a, 'b> {
    pub(crate) fit: &'a WindowFit,
    pub(crate) record: &'a [f64],
    /// Windows of a piece, the samples that they are for, and their tables.
    pub(crate) placed: &'a [PlacedWindow],
    pub(crate) numbered: Numbered,
    pub(crate) tables: &'a dyn Fn(usize) -> &'a OrderTable,
    pub(crate) groups: &'a [WindowGroup],
    pub(crate) memory: &'a mut GroupSamples,
    pub(crate) fits: &'a mut WindowFits<'b>,
    /// Becomes true for windows that are done.
    pub(crate) done: &'a mut [bool],
}

impl Kernel for WindowsAbreast<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let nothing = OnLines([simd.splat_f64s(0.0); MOST]);
        let mut work = Workspace {
            columns: TableColumns::new(S::F64_LANES),
            tile: Tile::new(self.fields().good + 1, S::F64_LANES, S::F64_LANES),
            factor: ChebyshevFactor::zero(simd),
            polynomials: OnLines([nothing.0; DERIVATIVES]),
            coefficients: nothing.clone(),
            left: nothing,
        };
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
    /// What was found in the last few windows of each lane.
    tile: Tile,
    factor: ChebyshevFactor<S>,
    /// Polynomials and their derivatives at the samples that windows are for.
    polynomials: OnLines<[S::f64s; MOST], DERIVATIVES>,
    /// In the orthogonal polynomials of each window: what was taken off the samples, and what the window adds to that.
    coefficients: OnLines<S::f64s, MOST>,
    /// What is to be added to what was taken off, over each polynomial's sum of squares.
    left: OnLines<S::f64s, MOST>,
}

/// Windows side by side: what the kernel knows of each lane's.
struct Abreast {
    /// Time of the sample that it is for.
    time: [f64; MOST_LANES],
    /// What its own reference is above that of the group, and the reference of the group.
    above: [f64; MOST_LANES],
    reference: [f64; MOST_LANES],
    /// The middle of the group, and one over its half length.
    middle: [f64; MOST_LANES],
    scale: [f64; MOST_LANES],
}

/// What was found in windows side by side, in the group's time.
struct FoundAbreast<S: Lanes> {
    values: [S::f64s; DERIVATIVES],
    errors: [S::f64s; DERIVATIVES],
    order: S::f64s,
    sigma: S::f64s,
    exact: S::m64s,
    good: S::m64s,
}

/// Where the fields of a window are in the tile: derivatives come first.
#[derive(Clone, Copy)]
struct FieldsAbreast {
    errors: usize,
    sigma: usize,
    /// The order, and 256 times the flags.
    code: usize,
    /// One where the window is good, zero where it is not.
    good: usize,
}

impl Abreast {
    /// Groups side by side, before their first windows.
    fn of(groups: &[WindowGroup], reference: [f64; MOST_LANES]) -> Self {
        let nothing = [0.0; MOST_LANES];
        let (mut middle, mut scale) = (nothing, [1.0; MOST_LANES]);
        for ((middle, scale), group) in middle.iter_mut().zip(&mut scale).zip(groups) {
            (*middle, *scale) = group.scale();
        }
        Self { time: nothing, above: nothing, reference, middle, scale }
    }
}

impl WindowsAbreast<'_, '_> {
    /// Fits the windows of a group in each lane.
    #[inline(always)]
    fn batch<S: Lanes>(&mut self, simd: S, groups: &[WindowGroup], work: &mut Workspace<S>) {
        let degrees = groups[0].degrees;
        self.memory.read(simd, &self.fit.times, self.record, self.placed, groups);
        let mut sums = self.memory.begin(simd, degrees, &mut work.factor);
        let mut abreast = Abreast::of(groups, self.memory.references);
        let longest = groups.iter().map(|group| group.windows.len()).max().unwrap_or(0);
        for step in 0..longest {
            if step > 0 {
                sums.slide(simd, degrees, self.memory, &self.moves(groups, step));
            }
            self.step_to(&mut abreast, groups, step, &mut work.columns);
            let found = self.solve(simd, degrees, &abreast, &sums, work);
            self.put(simd, degrees, &abreast, &found, &mut work.tile.fields_of::<S>(step));
            let next = step + 1;
            if next % S::F64_LANES == 0 || next == longest {
                self.write(simd, groups, step / S::F64_LANES * S::F64_LANES..next, &work.tile);
            }
        }
    }

    /// Which samples enter the windows and which leave them on the way to a step.
    fn moves(&self, groups: &[WindowGroup], step: usize) -> Moves {
        let of_group = |group: &WindowGroup| {
            let [first, old, new] = [0, step - 1, step].map(|at| &self.placed[group.windows.start + at].samples);
            [old.end - first.start..new.end - first.start, old.start - first.start..new.start - first.start]
        };
        let mut there = groups.iter().enumerate().filter(|(_, group)| step < group.windows.len());
        if matches!(self.fit.span, WindowSpan::Samples(_)) {
            // Lanes that have no window any more move on: nobody looks at them.
            return Moves::Alike(there.next().map_or([0..0, 0..0], |(_, group)| of_group(group)));
        }
        let mut moves = [from_fn(|_| 0..0), from_fn(|_| 0..0)];
        for (lane, group) in there {
            [moves[0][lane], moves[1][lane]] = of_group(group);
        }
        Moves::Apart(moves)
    }

    /// Steps to a window of each group. Lanes that have no window any more stay: what is found there goes nowhere.
    #[inline(always)]
    fn step_to(&self, abreast: &mut Abreast, groups: &[WindowGroup], step: usize, columns: &mut TableColumns) {
        for (lane, group) in groups.iter().enumerate().take(MOST_LANES) {
            let number = group.windows.start + step;
            if number >= group.windows.end {
                continue;
            }
            let samples = &self.placed[number].samples;
            abreast.time[lane] = self.fit.times[self.numbered.sample(number)];
            abreast.above[lane] = self.record[samples.start + samples.len() / 2] - abreast.reference[lane];
            if columns.lengths[lane] != samples.len() {
                columns.set(lane, (self.tables)(samples.len()));
            }
        }
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
    ) -> FoundAbreast<S> {
        let Workspace { columns, factor, polynomials, coefficients, left, .. } = work;
        let errors = !self.fits.errors.is_empty();
        let wanted = self.fit.derivatives + 1;
        let time = simd.sub_f64s(simd.load(&abreast.time, 0), simd.load(&abreast.middle, 0));
        let time = simd.mul_f64s(time, simd.load(&abreast.scale, 0));
        let polynomials = &mut polynomials.0[..wanted];
        at(simd, degrees, time, polynomials);
        let before = sums(simd, degrees, polynomials, &window.coefficients.0);
        factor.decompose(simd, degrees, &window.left.moments.0, &window.left.products.0, &window.coefficients.0);
        factor.at(simd, degrees, time, polynomials);
        let (own, off) = (&factor.own.0, &factor.turned.0);
        let kept = KeptDigits::new(simd, degrees, factor, window.square, &window.tails.0);
        let residual = kept.residual;
        let floor = self.floor(simd, abreast, columns, window);
        let length = simd.load(&columns.length, 0);
        let good = kept.are_enough(simd, degrees, (length, length), (floor, window.peak));
        let is_fixed = matches!(self.fit.order, Order::Fixed(_));
        // What each order leaves asks for the polynomial that was taken off, too.
        for (coefficient, (&off, &own)) in coefficients.0.iter_mut().zip(off.iter().zip(own)).take(degrees) {
            *coefficient = simd.add_f64s(off, own);
        }
        let residuals = OrderResiduals::new(simd, degrees, residual, &coefficients.0, &factor.inverse.0, floor);
        let choice = if is_fixed { residuals.fixed(simd, columns) } else { residuals.choose(simd, columns) };
        let mut found = FoundAbreast::of(simd, &choice, good);
        if errors {
            let shares = if is_fixed { None } else { Some(residuals.shares(simd, columns)) };
            let chosen = (&residuals, &choice, shares.as_ref(), &*columns);
            found.estimate_with_errors(simd, chosen, factor, (&coefficients.0, polynomials), &before[..wanted]);
        } else {
            choice.left(simd, degrees, [own, off, &factor.inverse.0], &mut left.0);
            found.estimate(simd, degrees, &left.0, polynomials, &before[..wanted]);
        }
        found
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

    /// Where the fields of a window are in the tile.
    fn fields(&self) -> FieldsAbreast {
        let errors = self.fits.derivatives.len();
        let sigma = errors + self.fits.errors.len();
        FieldsAbreast { errors, sigma, code: sigma + 1, good: sigma + 2 }
    }

    /// Puts what was found into the tile.
    #[inline(always)]
    fn put<S: Lanes>(
        &self,
        simd: S,
        degrees: usize,
        abreast: &Abreast,
        found: &FoundAbreast<S>,
        tile: &mut WindowFields<'_>,
    ) {
        let fields = self.fields();
        let (zero, one, of_group) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0), simd.load(&abreast.scale, 0));
        let (mut level, mut scale) = (simd.load(&abreast.reference, 0), one);
        for (derivative, &value) in found.values.iter().enumerate().take(fields.errors) {
            tile.put(simd, derivative, simd.add_f64s(level, simd.mul_f64s(value, scale)));
            if fields.errors + derivative < fields.sigma {
                let error = simd.mul_f64s(found.errors[derivative], scale);
                tile.put(simd, fields.errors + derivative, error);
            }
            (level, scale) = (zero, simd.mul_f64s(scale, of_group));
        }
        tile.put(simd, fields.sigma, found.sigma);
        // The flags of the lowest order, of the highest, and of one that is exact.
        let [lowest, highest] = [0, degrees - 1].map(|order| self.fit.status(order, degrees, false, false));
        let is_highest = simd.greater_than_or_equal_f64s(found.order, simd.splat_f64s((degrees - 1) as f64));
        let mut code = found.order;
        for (is_so, flags) in
            [(simd.less_than_f64s(found.order, one), lowest), (is_highest, highest), (found.exact, Status::EXACT)]
        {
            let flags = simd.splat_f64s(256.0 * f64::from(flags.bits()));
            code = simd.add_f64s(code, simd.select_f64s(is_so, flags, zero));
        }
        tile.put(simd, fields.code, code);
        tile.put(simd, fields.good, simd.select_f64s(found.good, one, zero));
    }

    /// Writes the windows of some steps, which the tile holds. Those that are not good are written again.
    #[inline(always)]
    fn write<S: Lanes>(&mut self, simd: S, groups: &[WindowGroup], steps: Range<usize>, tile: &Tile) {
        let fields = self.fields();
        let windows_of = |group: &WindowGroup| {
            group.windows.end.min(group.windows.start + steps.start)
                ..group.windows.end.min(group.windows.start + steps.end)
        };
        let rows = self.fits.derivatives.iter_mut().chain(&mut self.fits.errors).map(|row| &mut **row);
        for (field, row) in rows.chain([&mut *self.fits.sigma]).enumerate() {
            let square = tile.square(simd, field, steps.start);
            for (group, &values) in groups.iter().zip(&square) {
                let into = &mut row[windows_of(group)];
                if into.len() == S::F64_LANES {
                    simd.store(into, 0, values);
                } else {
                    let mut lanes = [0.0; MOST_LANES];
                    simd.store(&mut lanes, 0, values);
                    into.copy_from_slice(&lanes[..into.len()]);
                }
            }
        }
        let (codes, good) = (tile.square(simd, fields.code, steps.start), tile.square(simd, fields.good, steps.start));
        let half = simd.splat_f64s(0.5);
        for (group, (&codes, &good)) in groups.iter().zip(codes.iter().zip(&good)) {
            let windows = windows_of(group);
            let (mut orders, mut flags) = ([0; MOST_LANES], [0; MOST_LANES]);
            simd.split(codes, &mut orders, &mut flags);
            self.fits.order[windows.clone()].copy_from_slice(&orders[..windows.len()]);
            self.fits.status[windows.clone()].copy_from_slice(&flags[..windows.len()]);
            let good = simd.bits(simd.greater_than_f64s(good, half));
            for (place, done) in self.done[windows].iter_mut().enumerate() {
                *done = good >> place & 1 == 1;
            }
        }
    }
}

impl<S: Lanes> FoundAbreast<S> {
    /// What is chosen, before anything is estimated.
    #[inline(always)]
    fn of(simd: S, choice: &ChosenOrders<S>, good: S::m64s) -> Self {
        let nothing = [simd.splat_f64s(0.0); DERIVATIVES];
        let sigma = simd.sqrt_f64s(choice.variance);
        Self { values: nothing, errors: nothing, order: choice.order, sigma, exact: choice.exact, good }
    }

    /// Estimates every derivative with its standard error.
    #[inline(always)]
    fn estimate_with_errors(
        &mut self,
        simd: S,
        (residuals, choice, shares, columns): (
            &OrderResiduals<S>,
            &ChosenOrders<S>,
            Option<&OrderShares<S>>,
            &TableColumns,
        ),
        factor: &ChebyshevFactor<S>,
        (coefficients, polynomials): (&[S::f64s; MOST], &[[S::f64s; MOST]]),
        before: &[S::f64s],
    ) {
        let degrees = residuals.degrees;
        let own = &factor.own.0;
        for (derivative, (&before, row)) in before.iter().zip(polynomials).enumerate() {
            let mut full = before;
            for ((polynomial, inverse), own) in row.iter().zip(&factor.inverse.0).zip(own).take(degrees) {
                full = simd.mul_add_f64s(simd.mul_f64s(*polynomial, *inverse), *own, full);
            }
            let inverse = &factor.inverse.0;
            let parts = DerivativeParts { polynomials: row, coefficients, inverse, full, off_centre: None };
            (self.values[derivative], self.errors[derivative]) =
                residuals.estimate(simd, columns, (choice, shares), &parts);
        }
    }

    /// Estimates every derivative by one polynomial: what is left of the samples, and orders that were taken off too many.
    #[inline(always)]
    fn estimate(
        &mut self,
        simd: S,
        degrees: usize,
        left: &[S::f64s; MOST],
        polynomials: &[[S::f64s; MOST]],
        before: &[S::f64s],
    ) {
        let more = sums(simd, degrees, &polynomials[..before.len()], left);
        for ((value, &before), more) in self.values.iter_mut().zip(before).zip(more) {
            *value = simd.add_f64s(before, more);
        }
    }
}
