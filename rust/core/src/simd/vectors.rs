//! Vectors of 64-bit numbers for every instruction set, and the operations that kernels need beyond `pulp`.
//!
//! Every kernel is written once over [`Lanes`] and keeps its lanes apart: no lane ever reads another. So the numbers of
//! a window do not depend on its lane or on its neighbours. Multiplications and additions are fused where they are
//! written fused, on every path.

use pulp::{NullaryFnOnce, Scalar, Simd};

use crate::simd::instructions::Instructions;

/// The longest vector of any instruction set, in numbers of 64 bits.
pub(crate) const MOST_LANES: usize = 8;

/// Vectors of 64-bit numbers of one instruction set.
pub(crate) trait Lanes: Simd {
    /// Transposes a square of [`Simd::F64_LANES`] rows in place.
    fn transpose(self, rows: &mut [Self::f64s]);

    /// A mask as bits, that of the first lane lowest.
    fn bits(self, mask: Self::m64s) -> u32;

    /// Looks up entries of a table by whole numbers below 16.
    #[inline(always)]
    fn table_lookup(self, table: &[f64; TABLE], index: Self::f64s) -> Self::f64s {
        let mut values = [0.0; MOST_LANES];
        self.store(&mut values, 0, index);
        for value in &mut values[..Self::F64_LANES] {
            *value = table[whole(*value) as usize % TABLE];
        }
        self.load(&values, 0)
    }

    /// The numbers of a vector in another order: of every lane, whose number it takes.
    #[inline(always)]
    fn permute(self, numbers: Self::f64s, order: &[usize; MOST_LANES]) -> Self::f64s {
        let (mut from, mut to) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
        self.store(&mut from, 0, numbers);
        for (to, &lane) in to[..Self::F64_LANES].iter_mut().zip(order) {
            *to = from[lane % Self::F64_LANES];
        }
        self.load(&to, 0)
    }

    /// Writes the low byte of whole numbers below 2^24 to one place and the two bytes above it to another.
    #[inline(always)]
    fn split(self, codes: Self::f64s, low: &mut [u8], high: &mut [u16]) {
        let mut values = [0.0; MOST_LANES];
        self.store(&mut values, 0, codes);
        for ((code, low), high) in values[..Self::F64_LANES].iter().zip(low).zip(high) {
            [*low, ..] = whole(*code).to_le_bytes();
            let [_, first, second, _] = whole(*code).to_le_bytes();
            *high = u16::from_le_bytes([first, second]);
        }
    }

    /// Reads a vector that begins anywhere.
    #[inline(always)]
    fn load(self, from: &[f64], at: usize) -> Self::f64s {
        check_bounds(from, at, Self::F64_LANES);
        // SAFETY: the slice holds the bytes of one vector from there on, any of which are valid, and the read asks for no alignment.
        unsafe { from.as_ptr().add(at).cast::<Self::f64s>().read_unaligned() }
    }

    /// Writes a vector that begins anywhere.
    #[inline(always)]
    fn store(self, to: &mut [f64], at: usize, value: Self::f64s) {
        check_bounds(to, at, Self::F64_LANES);
        // SAFETY: the slice holds the bytes of one vector from there on, and the write asks for no alignment.
        unsafe { to.as_mut_ptr().add(at).cast::<Self::f64s>().write_unaligned(value) }
    }
}

/// Panics if a slice does not hold so many values from a place on. The last place is the same for all vectors of a slice, so that each costs
/// one comparison.
#[inline(always)]
fn check_bounds(slice: &[f64], at: usize, lanes: usize) {
    if slice.len().checked_sub(lanes).is_none_or(|last| at > last) {
        out_of_bounds(slice.len(), at, lanes);
    }
}

#[cold]
#[inline(never)]
fn out_of_bounds(len: usize, at: usize, lanes: usize) -> ! {
    panic!("a vector of {lanes} numbers at {at} reaches beyond the {len} that there are");
}

/// Entries of a table that is looked up in: one for every order.
pub(crate) const TABLE: usize = 16;

/// A whole number that a kernel holds as floating point.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "kernels hold small whole numbers")]
fn whole(value: f64) -> u32 {
    value as u32
}

/// Work written over any vector length.
pub(crate) trait Kernel {
    type Output;

    /// Does the work. Implementations are `#[inline(always)]`, so that they are compiled for the instructions of `S`.
    fn run<S: Lanes>(self, simd: S) -> Self::Output;
}

/// Runs a kernel with the given instructions.
pub(crate) fn dispatch<K: Kernel>(instructions: Instructions, kernel: K) -> K::Output {
    with_vectors(instructions, kernel).unwrap_or_else(|kernel| kernel.run(Scalar::new()))
}

/// The same with instructions that have vectors. Kernels that are compiled for many sizes need not be compiled for single numbers as well.
pub(crate) fn dispatch_vectors<K: Kernel>(instructions: Instructions, kernel: K) -> K::Output {
    with_vectors(instructions, kernel).unwrap_or_else(|_| unreachable!("{instructions:?} has no vectors"))
}

/// Runs a kernel where there are vectors, or gives it back.
fn with_vectors<K: Kernel>(instructions: Instructions, kernel: K) -> Result<K::Output, K> {
    match instructions {
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => {
            let simd = pulp::x86::V4::try_new().expect("only instructions that run here are chosen");
            Ok(apart(simd, kernel))
        }
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => {
            let simd = pulp::x86::V3::try_new().expect("only instructions that run here are chosen");
            Ok(apart(simd, kernel))
        }
        #[cfg(target_arch = "aarch64")]
        Instructions::Neon => {
            let simd = pulp::aarch64::Neon::try_new().expect("only instructions that run here are chosen");
            Ok(apart(simd, kernel))
        }
        _ => Err(kernel),
    }
}

/// Runs a part of a kernel that is compiled apart from it, for the same instructions. What several kernels use is compiled once then.
#[inline(always)]
pub(crate) fn apart<S: Lanes, K: Kernel>(simd: S, kernel: K) -> K::Output {
    simd.vectorize(On { simd, kernel })
}

/// A kernel and the instructions it runs with.
struct On<S, K> {
    simd: S,
    kernel: K,
}

impl<S: Lanes, K: Kernel> NullaryFnOnce for On<S, K> {
    type Output = K::Output;

    #[inline(always)]
    fn call(self) -> K::Output {
        self.kernel.run(self.simd)
    }
}

impl Lanes for Scalar {
    #[inline(always)]
    fn transpose(self, _rows: &mut [f64]) {}

    #[inline(always)]
    fn bits(self, mask: Self::m64s) -> u32 {
        u32::from(mask)
    }
}

#[cfg(target_arch = "aarch64")]
impl Lanes for pulp::aarch64::Neon {
    #[inline(always)]
    fn transpose(self, rows: &mut [Self::f64s]) {
        let numbers: &mut [f64] = pulp::bytemuck::cast_slice_mut(rows);
        numbers.swap(1, 2);
    }

    #[inline(always)]
    fn bits(self, mask: Self::m64s) -> u32 {
        let words: [u64; 2] = pulp::bytemuck::cast(self.transmute_u64s_m64s(mask));
        u32::from(words[0] != 0) | u32::from(words[1] != 0) << 1
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    #[inline(always)]
    fn transpose(self, rows: &mut [Self::f64s]) {
        use pulp::bytemuck::cast;
        let [a, b, c, d] = [cast(rows[0]), cast(rows[1]), cast(rows[2]), cast(rows[3])];
        let (even_ab, odd_ab) = (self.avx._mm256_unpacklo_pd(a, b), self.avx._mm256_unpackhi_pd(a, b));
        let (even_cd, odd_cd) = (self.avx._mm256_unpacklo_pd(c, d), self.avx._mm256_unpackhi_pd(c, d));
        rows[0] = cast(self.avx._mm256_permute2f128_pd::<0x20>(even_ab, even_cd));
        rows[1] = cast(self.avx._mm256_permute2f128_pd::<0x20>(odd_ab, odd_cd));
        rows[2] = cast(self.avx._mm256_permute2f128_pd::<0x31>(even_ab, even_cd));
        rows[3] = cast(self.avx._mm256_permute2f128_pd::<0x31>(odd_ab, odd_cd));
    }

    #[inline(always)]
    fn bits(self, mask: Self::m64s) -> u32 {
        self.avx._mm256_movemask_pd(pulp::bytemuck::cast(self.transmute_u64s_m64s(mask))).cast_unsigned()
    }

    #[inline(always)]
    fn split(self, codes: Self::f64s, low: &mut [u8], high: &mut [u16]) {
        use pulp::bytemuck::{cast, cast_slice_mut};
        let (low, high): (&mut [u8], &mut [u8]) = (&mut low[..4], cast_slice_mut(&mut high[..4]));
        let words = self.avx._mm256_cvtpd_epi32(cast(codes));
        let order = |places: [u8; 16]| -> u128 { cast(self.ssse3._mm_shuffle_epi8(words, cast(places))) };
        low.copy_from_slice(&order([0, 4, 8, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]).to_le_bytes()[..4]);
        high.copy_from_slice(&order([1, 2, 5, 6, 9, 10, 13, 14, 0, 0, 0, 0, 0, 0, 0, 0]).to_le_bytes()[..8]);
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V4 {
    #[inline(always)]
    fn transpose(self, rows: &mut [Self::f64s]) {
        use pulp::bytemuck::cast;
        let avx = self.avx512f;
        // Pairs of rows, then quarters, then halves: three rounds of eight shuffles.
        let mut pairs = [avx._mm512_setzero_pd(); 8];
        for i in 0..4 {
            let (upper, lower) = (cast(rows[2 * i]), cast(rows[2 * i + 1]));
            pairs[2 * i] = avx._mm512_unpacklo_pd(upper, lower);
            pairs[2 * i + 1] = avx._mm512_unpackhi_pd(upper, lower);
        }
        for i in 0..2 {
            let low = avx._mm512_shuffle_f64x2::<0b10_00_10_00>(pairs[i], pairs[2 + i]);
            let high = avx._mm512_shuffle_f64x2::<0b11_01_11_01>(pairs[i], pairs[2 + i]);
            let low_below = avx._mm512_shuffle_f64x2::<0b10_00_10_00>(pairs[4 + i], pairs[6 + i]);
            let high_below = avx._mm512_shuffle_f64x2::<0b11_01_11_01>(pairs[4 + i], pairs[6 + i]);
            rows[i] = cast(avx._mm512_shuffle_f64x2::<0b10_00_10_00>(low, low_below));
            rows[4 + i] = cast(avx._mm512_shuffle_f64x2::<0b11_01_11_01>(low, low_below));
            rows[2 + i] = cast(avx._mm512_shuffle_f64x2::<0b10_00_10_00>(high, high_below));
            rows[6 + i] = cast(avx._mm512_shuffle_f64x2::<0b11_01_11_01>(high, high_below));
        }
    }

    #[inline(always)]
    fn bits(self, mask: Self::m64s) -> u32 {
        u32::from(mask.0)
    }

    #[inline(always)]
    fn table_lookup(self, table: &[f64; TABLE], index: Self::f64s) -> Self::f64s {
        use pulp::bytemuck::cast;
        // Added to 2^52, a whole number stands in the low bits.
        let index = self.add_f64s(index, self.splat_f64s(4_503_599_627_370_496.0));
        let (first, last) = (self.load(table, 0), self.load(table, 8));
        cast(self.avx512f._mm512_permutex2var_pd(cast(first), cast(index), cast(last)))
    }

    #[inline(always)]
    fn permute(self, numbers: Self::f64s, order: &[usize; MOST_LANES]) -> Self::f64s {
        use pulp::bytemuck::cast;
        cast(self.avx512f._mm512_permutexvar_pd(cast(*order), cast(numbers)))
    }

    #[inline(always)]
    fn split(self, codes: Self::f64s, low: &mut [u8], high: &mut [u16]) {
        use pulp::bytemuck::{cast, cast_slice_mut};
        let words = self.avx512f._mm512_cvtpd_epi32(cast(codes));
        let orders: [u64; 2] = cast(self.avx512f._mm256_cvtepi32_epi8(words));
        low[..8].copy_from_slice(&orders[0].to_le_bytes());
        let flags: u128 = cast(self.avx512f._mm256_cvtepi32_epi16(self.avx2._mm256_srli_epi32::<8>(words)));
        cast_slice_mut::<u16, u8>(&mut high[..8]).copy_from_slice(&flags.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Transpose;

    impl Kernel for Transpose {
        type Output = ();

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) {
            let lanes = S::F64_LANES;
            let numbers: Vec<f64> = (0..lanes * lanes).map(|i| i as f64).collect();
            let mut rows: Vec<S::f64s> = (0..lanes).map(|row| simd.load(&numbers, row * lanes)).collect();
            simd.transpose(&mut rows);
            let mut column = vec![0.0; lanes];
            for (i, &row) in rows.iter().enumerate() {
                simd.store(&mut column, 0, row);
                for (j, &value) in column.iter().enumerate() {
                    assert_eq!(value, numbers[j * lanes + i], "row {i}, column {j}");
                }
            }
        }
    }

    #[test]
    fn every_path_transposes() {
        for instructions in Instructions::available() {
            dispatch(instructions, Transpose);
        }
    }

    struct Permute;

    impl Kernel for Permute {
        type Output = ();

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) {
            let numbers: [f64; MOST_LANES] = std::array::from_fn(|lane| 10.0 + lane as f64);
            let order = std::array::from_fn(|lane| (5 * lane + 3) % S::F64_LANES);
            let mut permuted = [0.0; MOST_LANES];
            simd.store(&mut permuted, 0, simd.permute(simd.load(&numbers, 0), &order));
            for (number, lane) in permuted[..S::F64_LANES].iter().zip(order) {
                assert_eq!(*number, 10.0 + lane as f64);
            }
        }
    }

    #[test]
    fn every_path_permutes() {
        for instructions in Instructions::available() {
            dispatch(instructions, Permute);
        }
    }

    #[test]
    fn the_fastest_path_is_taken_unless_another_is_forced() {
        let fastest = Instructions::available()[0];
        assert_eq!(Instructions::current(), fastest);
        assert!(Instructions::available().contains(&Instructions::Scalar));
        assert!(fastest.lanes() <= MOST_LANES);
    }
}
