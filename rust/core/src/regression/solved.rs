//! The results of solved windows, field by field, and the windowed unknowns that follow from them.

use crate::regression::layout::{Fields, Layout};
use crate::simd::f64x8::{Packet, WIDTH};

/// Numbers of consecutive windows, field by field.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    pub(crate) fields: Fields,
    /// The number of the first window; it may begin before the record.
    pub(crate) first: isize,
    count: usize,
    padded: usize,
    values: Vec<f64>,
}

impl Solved {
    pub(crate) fn new(layout: Layout, first: isize, count: usize) -> Self {
        let (fields, padded) = (Fields { layout }, count.next_multiple_of(WIDTH));
        Self { fields, first, count, padded, values: vec![0.0; fields.size() * padded] }
    }

    /// Number of windows.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// A field of every window.
    pub(crate) fn field(&self, field: usize) -> &[f64] {
        &self.values[field * self.padded..][..self.count]
    }

    /// The place of a window in the fields, or `None` if it is not there.
    pub(crate) fn place(&self, window: isize) -> Option<usize> {
        usize::try_from(window - self.first).ok().filter(|&place| place < self.count)
    }

    /// Joins consecutive windows.
    pub(crate) fn join(parts: &[&Self]) -> Self {
        Self::join_first(parts, parts.iter().map(|part| part.count).sum())
    }

    /// Joins so many of consecutive windows.
    pub(crate) fn join_first(parts: &[&Self], count: usize) -> Self {
        let mut all = Self::new(parts[0].fields.layout, parts[0].first, count);
        for field in 0..all.fields.size() {
            let values = &mut all.values[field * all.padded..][..count];
            let mut place = 0;
            for part in parts {
                let end = (place + part.count).min(count);
                values[place..end].copy_from_slice(&part.field(field)[..end - place]);
                place = end;
            }
        }
        all
    }

    /// Marks a window as one without rows.
    pub(crate) fn disregard(&mut self, place: usize) {
        self.values[self.fields.count() * self.padded + place] = 0.0;
    }

    /// Writes eight windows, each so many after the one before; those beyond the last are left out.
    pub(crate) fn put_apart(&mut self, place: usize, apart: usize, fields: &[Packet]) {
        for (field, values) in fields.iter().zip(self.values.chunks_exact_mut(self.padded.max(WIDTH))) {
            for (value, place) in field.0.iter().zip((place..self.count).step_by(apart)) {
                values[place] = *value;
            }
        }
    }

    /// Writes eight windows.
    pub(crate) fn put(&mut self, place: usize, fields: &[Packet]) {
        for (field, value) in fields.iter().enumerate() {
            value.store(&mut self.values[field * self.padded + place..]);
        }
    }
}

/// A window's own unknown for given constants: a value at the centre, or its growth per second.
pub(crate) fn local(full: &Solved, window: usize, values: &[f64], local: usize) -> f64 {
    let fields = full.fields;
    let mut value = full.field(fields.solution(local, fields.layout.constant))[window];
    for (constant, factor) in values.iter().enumerate() {
        value -= full.field(fields.solution(local, constant))[window] * factor;
    }
    value
}

/// The derivative of a window's own unknown with respect to a constant, `later` seconds after the window's centre.
pub(crate) fn sensitivity(full: &Solved, window: usize, local: usize, constant: usize, later: f64) -> f64 {
    let (fields, layout) = (full.fields, full.fields.layout);
    let mut value = full.field(fields.solution(local, constant))[window];
    if layout.linear {
        value += later * full.field(fields.solution(layout.windowed + local, constant))[window];
    }
    -value
}

/// The fewest rows that determine a window: more than its unknowns and one.
pub(crate) fn fewest_rows(layout: Layout) -> f64 {
    (layout.regressors() + 2) as f64
}

/// Whether a window has more rows than unknowns.
pub(crate) fn is_determined(solved: &Solved, window: usize) -> bool {
    solved.field(solved.fields.count())[window] >= fewest_rows(solved.fields.layout)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::layout::Layout;

    const LAYOUT: Layout = Layout { windowed: 1, linear: true, constant: 1 };

    /// Windows of which every field of window `w` is `w` plus a hundred times the field's number.
    fn windows(first: isize, count: usize) -> Solved {
        let mut solved = Solved::new(LAYOUT, first, count);
        for place in (0..count).step_by(WIDTH) {
            let window = |lane: usize| first as f64 + (place + lane) as f64;
            let field = |field: usize| Packet(std::array::from_fn(|lane| window(lane) + 100.0 * field as f64));
            solved.put(place, &(0..solved.fields.size()).map(field).collect::<Vec<_>>());
        }
        solved
    }

    #[test]
    fn windows_are_where_they_were_put_and_joined() {
        let parts = [windows(-3, 11), windows(8, 2), windows(10, 17)];
        let all = Solved::join(&parts.iter().collect::<Vec<_>>());
        assert_eq!(all.len(), 30);
        for field in 0..all.fields.size() {
            let expected: Vec<f64> = (-3..27).map(|window| f64::from(window) + 100.0 * field as f64).collect();
            assert_eq!(all.field(field), expected);
        }
        assert_eq!([-4, -3, 26, 27].map(|window| all.place(window)), [None, Some(0), Some(29), None]);
        for count in [0, 11, 12, 30] {
            let some = Solved::join_first(&parts.iter().collect::<Vec<_>>(), count);
            (0..all.fields.size()).for_each(|field| assert_eq!(some.field(field), &all.field(field)[..count]));
        }
    }

    #[test]
    fn a_window_is_determined_by_more_rows_than_unknowns_and_one() {
        let mut solved = windows(0, 8);
        let counts = Packet(std::array::from_fn(|lane| lane as f64));
        solved.put(0, &vec![counts; solved.fields.size()]);
        assert_eq!((0..8).filter(|&window| is_determined(&solved, window)).collect::<Vec<_>>(), [5, 6, 7]);
        solved.disregard(6);
        assert!(!is_determined(&solved, 6));
    }

    #[test]
    fn unknowns_of_a_window_follow_from_the_constants_and_the_time() {
        let (solved, window) = (windows(0, 8), 5);
        let at = |field: usize| solved.field(field)[window];
        let fields = solved.fields;
        let expected = at(fields.solution(1, 1)) - 0.5 * at(fields.solution(1, 0));
        assert_eq!(local(&solved, window, &[0.5], 1), expected);
        let expected = -(at(fields.solution(0, 0)) + 2.0 * at(fields.solution(1, 0)));
        assert_eq!(sensitivity(&solved, window, 0, 0, 2.0), expected);
    }
}
