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
        let mut all = Self::new(parts[0].fields.layout, parts[0].first, parts.iter().map(|part| part.count).sum());
        for field in 0..all.fields.size() {
            let mut place = field * all.padded;
            for part in parts {
                all.values[place..place + part.count].copy_from_slice(part.field(field));
                place += part.count;
            }
        }
        all
    }

    /// Marks a window as one without rows.
    pub(crate) fn disregard(&mut self, place: usize) {
        self.values[self.fields.count() * self.padded + place] = 0.0;
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

/// Whether a window has more rows than unknowns.
pub(crate) fn is_determined(solved: &Solved, window: usize) -> bool {
    let Fields { layout } = solved.fields;
    solved.field(solved.fields.count())[window] > (layout.regressors() + 1) as f64
}
