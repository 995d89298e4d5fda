//! Windows around places at which a jump may lie.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::OnceLock;

use crate::regression::problem::Problem;
use crate::regression::sides::Sides;
use crate::regression::window_length::{Cells, Scale};
use crate::simd::instructions::Instructions;

/// Windows of every length, around one place each; or those of the whole record, once, where as many places are looked at that
/// this is less work. So the work grows with the record, however many events it holds: long windows reach over most of it.
pub(crate) struct SharedWindows<'a> {
    problem: &'a Problem<'a>,
    instructions: Instructions,
    /// How many places are looked at.
    places: usize,
    whole: Vec<(Scale, OnceLock<Cells>)>,
}

impl<'a> SharedWindows<'a> {
    pub(crate) fn new(problem: &'a Problem<'a>, scales: &[Scale], places: usize, instructions: Instructions) -> Self {
        let whole = scales.iter().map(|&scale| (scale, OnceLock::new())).collect();
        Self { problem, instructions, places, whole }
    }

    /// Windows of one length, of some cells at least, on some sides at least. A window has the same bits either way.
    pub(crate) fn of(&self, scale: Scale, cells: &Range<isize>, sides: Sides) -> Cow<'_, Cells> {
        let rows = self.problem.rows();
        let shared = self.whole.iter().find(|(other, _)| *other == scale);
        match shared.filter(|_| self.places.saturating_mul(scale.span()) > rows) {
            Some((_, whole)) => {
                Cow::Borrowed(whole.get_or_init(|| self.solve(scale, &scale.one_sided_cells(rows), Sides::ALL)))
            }
            None => Cow::Owned(self.solve(scale, cells, sides)),
        }
    }

    fn solve(&self, scale: Scale, cells: &Range<isize>, sides: Sides) -> Cells {
        scale.solve_here(self.problem, (cells, sides), self.instructions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{model, rows};

    #[test]
    fn windows_have_the_same_bits_alone_and_shared() {
        let rows = rows(400, |time| [1.0 + 0.1 * time, 0.0], 0.3);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let scales = Scale::all(400, 3);
        let of = |places| SharedWindows::new(&problem, &scales, places, Instructions::Scalar);
        let (alone, shared) = (of(0), of(usize::MAX / 1000));
        for &scale in &scales {
            let all = scale.one_sided_cells(400);
            let cells = all.start + all.end / 3..all.start + all.end / 2;
            let (some, whole) = (alone.of(scale, &cells, Sides::ALL), shared.of(scale, &cells, Sides::ALL));
            assert!(matches!(some, Cow::Owned(_)) && matches!(whole, Cow::Borrowed(_)));
            let pairs = [
                (&some.one_sided, &whole.one_sided),
                (&some.leave_gap_out, &whole.leave_gap_out),
                (&some.full, &whole.full),
            ];
            for (some, whole) in pairs {
                for cell in cells.clone() {
                    let (Some(one), Some(other)) = (some.place(cell), whole.place(cell)) else { continue };
                    for field in 0..some.fields.size() {
                        let [one, other] = [some.field(field)[one], whole.field(field)[other]];
                        assert_eq!(one.to_bits(), other.to_bits(), "{scale:?}, cell {cell}");
                    }
                }
            }
        }
    }
}
