//! Lists of numbers laid side by side, one a lane, and one by one again.

use std::array::from_fn;

use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Lanes, MOST_LANES};

/// Numbers of several lists, of which there are at most as many as lanes, one list a lane; the last list stands again in the lanes beyond.
#[inline(always)]
pub(crate) fn side_by_side<S: Lanes>(simd: S, lists: &[&[f64]], count: usize) -> Aligned {
    let mut all = Aligned::zeros(count * S::F64_LANES);
    let of_lanes: [&[f64]; MOST_LANES] = from_fn(|lane| lists[lane.min(lists.len() - 1)]);
    lay(simd, &of_lanes[..S::F64_LANES], &mut all);
    all
}

/// Lays a list for each lane side by side, as many numbers of each as there is room for; zeros follow those that are shorter.
#[inline(always)]
pub(crate) fn lay<S: Lanes>(simd: S, lists: &[&[f64]], all: &mut [f64]) {
    let lanes = S::F64_LANES;
    let count = all.len() / lanes;
    let mut square = [simd.splat_f64s(0.0); MOST_LANES];
    let whole = lists.iter().map(|list| list.len()).min().unwrap_or(0).min(count) / lanes * lanes;
    for first in (0..whole).step_by(lanes) {
        for (vector, list) in square[..lanes].iter_mut().zip(lists) {
            *vector = simd.load(list, first);
        }
        simd.transpose(&mut square[..lanes]);
        for (place, &vector) in (first..).zip(&square[..lanes]) {
            simd.store(all, place * lanes, vector);
        }
    }
    for place in whole..count {
        for (lane, list) in lists.iter().enumerate() {
            all[place * lanes + lane] = list.get(place).copied().unwrap_or(0.0);
        }
    }
}

/// The numbers of the first lanes, one list for each, and then enough zeros for whole vectors.
#[inline(always)]
pub(crate) fn one_by_one<S: Lanes>(simd: S, all: &[f64], lists: usize) -> Vec<Vec<f64>> {
    let lanes = S::F64_LANES;
    let count = all.len() / lanes;
    let mut found = vec![vec![0.0; count + MOST_LANES]; lists];
    let mut square = [simd.splat_f64s(0.0); MOST_LANES];
    for first in (0..count).step_by(lanes) {
        let there = lanes.min(count - first);
        for (place, vector) in (first..first + there).zip(&mut square) {
            *vector = simd.load(all, place * lanes);
        }
        simd.transpose(&mut square[..lanes]);
        for (list, &vector) in found.iter_mut().zip(&square[..lanes]) {
            simd.store(list, first, vector);
        }
    }
    for list in &mut found {
        list[count..].fill(0.0);
    }
    found
}

/// Neighbouring numbers of a list, beginning so many before each place and then so many after that: one place a lane.
#[inline(always)]
pub(crate) fn gather<S: Lanes>(
    simd: S,
    list: &[f64],
    places: &[usize; MOST_LANES],
    (before, after): (usize, usize),
    found: &mut [S::f64s],
) {
    let mut square = [simd.splat_f64s(0.0); MOST_LANES];
    for (number, found) in (0..).step_by(S::F64_LANES).zip(found.chunks_mut(S::F64_LANES)) {
        for (vector, place) in square[..S::F64_LANES].iter_mut().zip(places) {
            *vector = simd.load(list, place + after + number - before);
        }
        simd.transpose(&mut square[..S::F64_LANES]);
        found.copy_from_slice(&square[..found.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::{Kernel, dispatch};

    struct ThereAndBack<'a>(&'a [&'a [f64]]);

    impl Kernel for ThereAndBack<'_> {
        type Output = (Vec<Vec<f64>>, Vec<f64>);

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Self::Output {
            let (lists, lanes) = (&self.0[..self.0.len().min(S::F64_LANES)], S::F64_LANES);
            let all = side_by_side(simd, lists, lists[0].len());
            assert_eq!(all[4 * lanes + lanes - 1], lists[lists.len() - 1][4]);
            let back = one_by_one(simd, &all, lists.len());
            let places = [5, 4, 3, 2, 2, 3, 4, 5];
            let mut found = [simd.splat_f64s(0.0); 3];
            gather(simd, &back[0], &places, (2, 1), &mut found);
            let mut numbers = vec![0.0; 3 * lanes];
            for (number, &vector) in found.iter().enumerate() {
                simd.store(&mut numbers, number * lanes, vector);
            }
            (back, numbers)
        }
    }

    #[test]
    fn lists_come_back_and_neighbours_are_gathered() {
        let lists: Vec<Vec<f64>> =
            (0..3_u32).map(|list| (0..11).map(|k| f64::from(100 * list + k)).collect()).collect();
        let slices: Vec<&[f64]> = lists.iter().map(Vec::as_slice).collect();
        for instructions in Instructions::available() {
            let (back, numbers) = dispatch(instructions, ThereAndBack(&slices));
            for (back, list) in back.iter().zip(&lists) {
                assert_eq!((&back[..11], &back[11..]), (&list[..], &[0.0; MOST_LANES][..]));
            }
            // One number after the other, and within it lane by lane: those from one before each place on.
            let lanes = instructions.lanes();
            for (number, of_lanes) in numbers.chunks_exact(lanes).enumerate() {
                for (value, place) in of_lanes.iter().zip([5, 4, 3, 2, 2, 3, 4, 5]) {
                    assert_eq!(*value, f64::from(place - 1) + number as f64);
                }
            }
        }
    }
}
