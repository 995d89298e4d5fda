//! Eight numbers side by side, for small dense algebra on eight problems at once.
//!
//! Plain arithmetic on arrays of a fixed length becomes vector instructions of whatever width the kernel around it is
//! compiled for (see [`crate::simd::vectors::dispatch`]). Nothing is fused or reordered, so every width gives the same
//! bits.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Problems side by side.
pub(crate) const WIDTH: usize = 8;

/// One number of each problem.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub(crate) struct Packet(pub(crate) [f64; WIDTH]);

impl Packet {
    pub(crate) const ZERO: Self = Self([0.0; WIDTH]);
    pub(crate) const ONE: Self = Self([1.0; WIDTH]);

    #[inline(always)]
    pub(crate) fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }

    /// The first eight numbers of a column, which must hold as many. A copy of a slice whose length is not known would be a call.
    #[inline(always)]
    pub(crate) fn load(from: &[f64]) -> Self {
        debug_assert!(from.len() >= WIDTH, "eight numbers are read");
        Self(from.first_chunk().copied().unwrap_or_default())
    }

    /// Every `step`-th number of a column from a place on; zero beyond its ends.
    ///
    /// A plain loop: closures over arrays are not inlined into vector kernels and cost a third of the time.
    #[inline(always)]
    pub(crate) fn gather(column: &[f64], place: isize, step: usize) -> Self {
        let mut values = [0.0; WIDTH];
        let inside = usize::try_from(place).ok().and_then(|place| column.get(place..place + (WIDTH - 1) * step + 1));
        if let Some(inside) = inside {
            for (lane, value) in values.iter_mut().enumerate() {
                *value = inside[lane * step];
            }
        } else {
            for (lane, value) in values.iter_mut().enumerate() {
                let place = usize::try_from(place + (lane * step).cast_signed()).unwrap_or(usize::MAX);
                if place < column.len() {
                    *value = column[place];
                }
            }
        }
        Self(values)
    }

    /// One where a flag is set and zero where it is not, as [`Packet::gather`].
    #[inline(always)]
    pub(crate) fn gather_flags(column: &[bool], place: isize, step: usize) -> Self {
        let mut values = [0.0; WIDTH];
        for (lane, value) in values.iter_mut().enumerate() {
            let place = usize::try_from(place + (lane * step).cast_signed()).unwrap_or(usize::MAX);
            if place < column.len() {
                *value = f64::from(u8::from(column[place]));
            }
        }
        Self(values)
    }

    #[inline(always)]
    pub(crate) fn store(self, to: &mut [f64]) {
        debug_assert!(to.len() >= WIDTH, "eight numbers are written");
        if let Some(to) = to.first_chunk_mut() {
            *to = self.0;
        }
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }

    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// The reciprocal, or zero where the number is zero.
    #[inline(always)]
    pub(crate) fn inverse_or_zero(self) -> Self {
        self.map(|a| if a == 0.0 { 0.0 } else { 1.0 / a })
    }

    /// The magnitude with the sign of another number.
    #[inline(always)]
    pub(crate) fn with_sign_of(self, sign: Self) -> Self {
        self.zip(sign, f64::copysign)
    }

    // Written out: a loop over eight numbers would be unrolled by the compiler, which takes it several times as long.
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let a = self.0;
        Self([f(a[0]), f(a[1]), f(a[2]), f(a[3]), f(a[4]), f(a[5]), f(a[6]), f(a[7])])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.0, other.0);
        Self([
            f(a[0], b[0]),
            f(a[1], b[1]),
            f(a[2], b[2]),
            f(a[3], b[3]),
            f(a[4], b[4]),
            f(a[5], b[5]),
            f(a[6], b[6]),
            f(a[7], b[7]),
        ])
    }
}

impl Add for Packet {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Packet {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Packet {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Div for Packet {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}

impl Neg for Packet {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl AddAssign for Packet {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Packet {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
