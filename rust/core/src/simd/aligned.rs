//! Memory aligned to cache lines, so that no vector crosses one.

use std::ops::{Deref, DerefMut, Index, IndexMut};

/// Bytes of a cache line, and of the longest vector.
const LINE: usize = 64;

/// Numbers of which the first lies at the beginning of a cache line.
#[derive(Debug, Default)]
pub(crate) struct Aligned {
    values: Vec<f64>,
    /// `first + len` is at most the length of `values`, whose length never changes.
    first: usize,
    len: usize,
}

impl Aligned {
    /// A column of zeros.
    pub(crate) fn zeros(len: usize) -> Self {
        let values = vec![0.0; len + LINE / size_of::<f64>()];
        let first = values.as_ptr().align_offset(LINE).min(values.len() - len);
        Self { values, first, len }
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut other = Self::zeros(self.len);
        other.copy_from_slice(self);
        other
    }
}

impl Deref for Aligned {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        debug_assert!(self.first + self.len <= self.values.len());
        // SAFETY: the range lies within the values since they were made. Kernels come here for every vector: checked, a window of
        // least squares takes 17 % more instructions.
        unsafe { self.values.get_unchecked(self.first..self.first + self.len) }
    }
}

impl DerefMut for Aligned {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        debug_assert!(self.first + self.len <= self.values.len());
        // SAFETY: as above.
        unsafe { self.values.get_unchecked_mut(self.first..self.first + self.len) }
    }
}

/// Has what is to be read or written soon brought into a near cache meanwhile. Nothing is waited for, and no number changes.
#[inline(always)]
pub(crate) fn bring_near<T>(numbers: &[T]) {
    #[cfg(target_arch = "x86_64")]
    for place in (0..size_of_val(numbers)).step_by(LINE) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every processor of this kind has the instruction, which reads nothing into the program; the place is one of the numbers.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(numbers.as_ptr().cast::<i8>().wrapping_add(place)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = numbers;
}

/// Vectors that begin with a cache line. What registers cannot hold stays on the stack, which is aligned to less: there each second vector
/// might cross a line, at twice the cost.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct OnLines<V, const N: usize>(pub(crate) [V; N]);

impl<V, const N: usize> Index<usize> for OnLines<V, N> {
    type Output = V;

    #[inline(always)]
    fn index(&self, place: usize) -> &V {
        &self.0[place]
    }
}

impl<V, const N: usize> IndexMut<usize> for OnLines<V, N> {
    #[inline(always)]
    fn index_mut(&mut self, place: usize) -> &mut V {
        &mut self.0[place]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_brought_near_stays_as_it_is() {
        for count in [0, 1, 8, 9, 1000] {
            let numbers: Vec<u16> = (0..count).collect();
            bring_near(&numbers);
            assert_eq!(numbers, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn it_begins_at_a_cache_line_wherever_it_is() {
        for len in [0, 1, 7, 8, 1000] {
            let values = Aligned::zeros(len);
            assert_eq!(values.len(), len);
            let moved = Box::new(values.clone());
            for one in [&values, &*moved] {
                assert_eq!(one.as_ptr().align_offset(LINE), 0);
            }
        }
    }
}
