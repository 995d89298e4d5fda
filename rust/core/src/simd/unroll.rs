//! Loops that the compiler unrolls completely.

/// Writes a block of code once for every `J` below a bound known when compiling, upwards or downwards.
///
/// Loops over the degrees must be unrolled whole, so that the coefficients stay in registers.
macro_rules! unroll {
    ($index:ident < $bound:expr, $body:block) => {
        $crate::simd::unroll::unroll!(@ $index, $bound, $body, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19)
    };
    (rev $index:ident < $bound:expr, $body:block) => {
        $crate::simd::unroll::unroll!(@ $index, $bound, $body, 19 18 17 16 15 14 13 12 11 10 9 8 7 6 5 4 3 2 1 0)
    };
    (@ $index:ident, $bound:expr, $body:block, $($value:literal)*) => {
        $({
            const $index: usize = $value;
            if $index < $bound $body
        })*
    };
}
pub(crate) use unroll;
