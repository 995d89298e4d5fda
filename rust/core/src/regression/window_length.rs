//! Windows of one length at a row: before it, after it, on both sides of it, and over it.
//!
//! A window is validated on rows that it does not contain: the torque of a row is predicted from the window before it,
//! the window after it and both together, each at least the test function's half-width away. Where an estimate is
//! wanted, the row's own neighbourhood is included. `step` neighbouring rows share their windows: they form a *cell*.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::regression::block_sums::BlockSums;
use crate::regression::dyadic_windows::{PIECE, WindowShape, solve_shapes, solve_windows};
use crate::regression::layout::Layout;
use crate::regression::problem::Problem;
use crate::regression::sides::Sides;
use crate::regression::solved::{Solved, fewest_rows};
use crate::simd::instructions::Instructions;

/// Of at most so many rows windows of several lengths are solved together.
const MOST_TOGETHER: usize = 1 << 15;

/// Rows of the smallest blocks: a third of a test function's half-width.
const FINEST: usize = 2;

/// Lengths of one-sided windows, in blocks of two rows, then of four and so on.
const BLOCKS: [usize; 2] = [6, 9];

/// Shorter one-sided windows: rows of a block, and blocks. They only serve in pairs.
const SHORT: [[usize; 2]; 4] = [[1, 3], [FINEST, 2], [FINEST, 3], [FINEST, 4]];

/// The shortest one-sided window that may serve alone, in rows: two and a half half-widths.
pub(crate) const SHORTEST_ALONE: usize = 15;

/// One length of windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Scale {
    /// Rows of a cell, and of a block.
    pub(crate) step: usize,
    /// Blocks of a one-sided window.
    blocks: usize,
    /// Blocks in the gap between the windows before and after.
    gap: usize,
    /// Rows between a window and the row that it predicts.
    pub(crate) reach: usize,
}

/// The windows of consecutive cells; there are none of those that were not to be solved.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    /// One-sided windows: that of cell `g` lies before its rows. They reach beyond the cells, so that the windows after the last cells
    /// are included.
    pub(crate) one_sided: Solved,
    /// Both sides, with the gap between them left out.
    pub(crate) leave_gap_out: Solved,
    /// Both sides and the gap.
    pub(crate) full: Solved,
}

impl Scale {
    /// All lengths that fit into so many rows, from the shortest to half of the rows.
    pub(crate) fn all(rows: usize, reach: usize) -> Vec<Self> {
        let mut scales: Vec<Self> = SHORT.iter().map(|&[step, blocks]| Self::new(step, blocks, reach)).collect();
        let mut step = FINEST;
        while scales.last().is_some_and(|scale| 2 * scale.span() <= rows) {
            scales.extend(BLOCKS.map(|blocks| Self::new(step, blocks, reach)));
            step *= 2;
        }
        scales.retain(|scale| 2 * scale.span() <= rows);
        scales
    }

    /// All lengths that fit into so many times, where `group` rows belong to every time: blocks hold whole groups.
    pub(crate) fn grouped(times: usize, reach: usize, group: usize) -> Vec<Self> {
        let of_times = Self::all(times, reach).into_iter();
        let grouped = of_times.map(|one| Self::new(one.step * group, one.blocks, reach * group));
        grouped.filter(|one| 2 * one.span() <= times * group).collect()
    }

    /// Windows over some times around a row, where `group` rows belong to every time: many trials determine what they share so, and one is predicted from
    /// the others.
    pub(crate) fn across(times: usize, reach: usize, group: usize) -> Self {
        Self { step: group, blocks: 0, gap: times, reach: reach * group }
    }

    /// Whether it holds only what lies between one-sided windows: these predict nothing, other trials do.
    pub(crate) fn is_across(self) -> bool {
        self.blocks == 0
    }

    /// The fewest rows that windows of any length fit into.
    pub(crate) fn fewest_rows(reach: usize) -> usize {
        let spans = SHORT.iter().map(|&[step, blocks]| Self::new(step, blocks, reach).span());
        2 * spans.min().unwrap_or(0)
    }

    fn new(step: usize, blocks: usize, reach: usize) -> Self {
        // Every row of a cell keeps its distance from both sides.
        Self { step, blocks, gap: (2 * reach + step).saturating_sub(2).div_ceil(step), reach }
    }

    /// The scale whose full window is nearest to a number of rows.
    pub(crate) fn nearest(scales: &[Self], rows: usize) -> Option<usize> {
        let distance = |scale: &Self| (scale.span() as f64 / rows as f64).ln().abs();
        (0..scales.len()).min_by(|&a, &b| distance(&scales[a]).total_cmp(&distance(&scales[b])))
    }

    /// Rows of a one-sided window.
    pub(crate) fn one_sided(self) -> usize {
        self.blocks * self.step
    }

    /// Rows of a full window.
    pub(crate) fn span(self) -> usize {
        (2 * self.blocks + self.gap) * self.step
    }

    /// Whether a one-sided window is long enough to serve alone.
    pub(crate) fn stands_alone(self) -> bool {
        self.one_sided() >= SHORTEST_ALONE
    }

    /// Whether the windows on both sides of a row together may hold the rows that determine what they predict it with.
    pub(crate) fn predicts(self, layout: Layout) -> bool {
        (2 * self.one_sided()) as f64 >= fewest_rows(layout)
    }

    /// The rows of a cell's full window.
    pub(crate) fn full_window(self, cell: isize) -> Range<isize> {
        let first = cell * self.step.cast_signed();
        first..first + self.span().cast_signed()
    }

    /// The cell that a row belongs to. Its windows need not exist.
    pub(crate) fn cell(self, row: usize) -> isize {
        (row.cast_signed() - self.first_row()).div_euclid(self.step.cast_signed())
    }

    /// The rows that belong to a cell; there are none before the record.
    pub(crate) fn rows_of_cell(self, cell: isize) -> Range<usize> {
        let row = |cell: isize| (self.first_row() + cell * self.step.cast_signed()).max(0).unsigned_abs();
        row(cell)..row(cell + 1)
    }

    /// The first row of cell 0.
    fn first_row(self) -> isize {
        (self.one_sided() + (self.gap - 1) * self.step / 2).cast_signed()
    }

    /// The one-sided window after the rows of a cell, given by the number of its own cell.
    pub(crate) fn after(self, cell: isize) -> isize {
        cell + (self.blocks + self.gap).cast_signed()
    }

    /// The rows of the window before a cell.
    pub(crate) fn one_sided_rows(self, cell: isize) -> Range<isize> {
        let first = cell * self.step.cast_signed();
        first..first + self.one_sided().cast_signed()
    }

    /// Cells whose full windows lie within the rows.
    pub(crate) fn full_cells(self, rows: usize) -> Range<isize> {
        0..((rows + self.step).saturating_sub(self.span()) / self.step).cast_signed()
    }

    /// Cells whose windows before them lie within the rows.
    pub(crate) fn one_sided_cells(self, rows: usize) -> Range<isize> {
        0..((rows + self.step).saturating_sub(self.one_sided()) / self.step).cast_signed()
    }

    /// Rows whose cells have full windows.
    pub(crate) fn full_rows(self, rows: usize) -> Range<usize> {
        let first = self.first_row().unsigned_abs();
        first..(first + self.full_cells(rows).len() * self.step).min(rows)
    }

    /// The centres of a cell's windows, in rows: of the one before it, and of the full one, with or without the gap.
    pub(crate) fn centres(self, cell: isize) -> [f64; 2] {
        let first = (cell * self.step.cast_signed()) as f64;
        [first + (self.one_sided() as f64 - 1.0) / 2.0, first + (self.span() as f64 - 1.0) / 2.0]
    }

    /// Solves the windows of some cells, in parallel.
    pub(crate) fn solve(
        self,
        problem: &Problem<'_>,
        (cells, sides): (&Range<isize>, Sides),
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Cells, Error> {
        let shapes = self.shapes();
        let mut pieces = Vec::new();
        let end = if sides.one { self.after(cells.end) } else { cells.end };
        let mut first = cells.start;
        while first < end {
            let next = (first + PIECE.cast_signed()).min(end);
            pieces.push(Piece { size: (next - first).unsigned_abs() * self.step, content: first..next });
            first = next;
        }
        let work =
            |blocks: Range<isize>, (): &mut ()| self.part(problem, &shapes, (cells, sides), &blocks, instructions);
        Ok(join(stages.map(pieces, || (), work)?, problem.layout))
    }

    /// Solves the full windows only, in parallel.
    pub(crate) fn solve_full(
        self,
        problem: &Problem<'_>,
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Solved, Error> {
        let ([_, _, full], cells) = (self.shapes(), self.full_cells(problem.rows()).len());
        Ok(solve_shapes((problem, None), self.step, &[(full, cells)], instructions, stages)?.swap_remove(0))
    }

    /// Solves the windows of lengths that have one step, those that leave the gap out and the full ones, in parallel.
    pub(crate) fn solve_leave_gap_out(
        scales: &[Self],
        (problem, sums): (&Problem<'_>, Option<&BlockSums>),
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<[Solved; 2]>, Error> {
        let Some(first) = scales.first() else { return Ok(Vec::new()) };
        let of = |scale: &Self| {
            let ([_, leave_gap_out, full], cells) = (scale.shapes(), scale.full_cells(problem.rows()).len());
            [(leave_gap_out, cells), (full, cells)]
        };
        let shapes: Vec<_> = scales.iter().flat_map(of).collect();
        let mut solved = solve_shapes((problem, sums), first.step, &shapes, instructions, stages)?.into_iter();
        Ok(std::iter::from_fn(|| Some([solved.next()?, solved.next()?])).collect())
    }

    /// Lengths in turn, those of one step together: they share the sums of their blocks. Of many rows one by one, for the memory.
    pub(crate) fn together(scales: &[Self], rows: usize) -> Vec<&[Self]> {
        if rows > MOST_TOGETHER {
            scales.chunks(1).collect()
        } else {
            scales.chunk_by(|a, b| a.step == b.step).collect()
        }
    }

    /// Solves the windows of some cells on this thread.
    pub(crate) fn solve_here(
        self,
        problem: &Problem<'_>,
        (cells, sides): (&Range<isize>, Sides),
        instructions: Instructions,
    ) -> Cells {
        let blocks = cells.start..if sides.one { self.after(cells.end) } else { cells.end };
        join(vec![self.part(problem, &self.shapes(), (cells, sides), &blocks, instructions)], problem.layout)
    }

    /// The shapes of a cell's windows: one-sided, with the gap left out, and full.
    fn shapes(self) -> [WindowShape; 3] {
        let (second, all) = (self.blocks + self.gap, 2 * self.blocks + self.gap);
        let full = WindowShape::of(0..all, self.step);
        let leave_gap_out = WindowShape { parts: vec![0..self.blocks, second..all], centre: full.centre };
        [WindowShape::of(0..self.blocks, self.step), leave_gap_out, full]
    }

    /// Solves the windows that begin at some blocks. Beyond the last cell only one-sided windows are needed.
    fn part(
        self,
        problem: &Problem<'_>,
        shapes: &[WindowShape; 3],
        (cells, sides): (&Range<isize>, Sides),
        blocks: &Range<isize>,
        instructions: Instructions,
    ) -> Vec<Solved> {
        let wanted = &shapes[usize::from(!sides.one)..if sides.both { 3 } else { 1 }];
        let whole = blocks.start..blocks.end.min(cells.end).max(blocks.start);
        let rest = whole.end..blocks.end;
        let mut solved = solve_windows(problem, self.step, &whole, wanted, instructions);
        if sides.one && !rest.is_empty() {
            let mut one_sided = solve_windows(problem, self.step, &rest, &shapes[..1], instructions);
            solved[0] =
                if whole.is_empty() { one_sided.swap_remove(0) } else { Solved::join(&[&solved[0], &one_sided[0]]) };
        }
        let nothing = || Solved::new(problem.layout, blocks.start, 0);
        let missing = usize::from(!sides.one);
        solved.splice(0..0, std::iter::repeat_with(nothing).take(missing));
        solved.resize_with(shapes.len(), nothing);
        solved
    }
}

/// Joins the parts of each shape.
fn join(mut parts: Vec<Vec<Solved>>, layout: Layout) -> Cells {
    let mut of = |shape: usize| match &mut parts[..] {
        [] => Solved::new(layout, 0, 0),
        [part] => std::mem::replace(&mut part[shape], Solved::new(layout, 0, 0)),
        parts => Solved::join(&of_shape(parts, shape)),
    };
    Cells { one_sided: of(0), leave_gap_out: of(1), full: of(2) }
}

fn of_shape(parts: &[Vec<Solved>], shape: usize) -> Vec<&Solved> {
    parts.iter().map(|part| &part[shape]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::model::Model;
    use crate::regression::simulated::{model, rows, staged};
    use crate::regression::solved::is_determined;

    #[test]
    fn windows_keep_a_test_functions_reach_away_from_the_row_that_they_predict() {
        for (count, reach) in [(300, 3), (1000, 6), (90, 1)] {
            let scales = Scale::all(count, reach);
            assert!(scales.len() > 4);
            for scale in scales {
                let (full, reach) = (scale.full_rows(count), reach.cast_signed());
                assert!(full.start < full.end && full.end <= count);
                for row in full {
                    let cell = scale.cell(row);
                    assert!(scale.full_cells(count).contains(&cell));
                    let (before, after) = (scale.one_sided_rows(cell), scale.one_sided_rows(scale.after(cell)));
                    let row = row.cast_signed();
                    assert!(before.start >= 0 && before.end + reach <= row + 1, "{scale:?}, row {row}: {before:?}");
                    assert!(after.start >= row + reach && after.end <= count.cast_signed(), "{scale:?}, row {row}");
                    assert_eq!(before.len(), scale.one_sided());
                    assert_eq!((after.end - before.start).unsigned_abs(), scale.span());
                    let [one, all] = scale.centres(cell);
                    assert_eq!(one, (before.start + before.end - 1) as f64 / 2.0);
                    assert_eq!(all, (before.start + after.end - 1) as f64 / 2.0);
                }
            }
        }
    }

    #[test]
    fn windows_too_short_to_predict_a_row_determine_nothing_on_both_sides_of_one() {
        let rows = rows(120, |time| [time.sin(), time.cos()], 0.1);
        let model = Model { windowed: vec![0, 1], constant: vec![2], linear: true, ..Model::default() };
        let problem = model.problem(&rows, &rows.rhs, 0.0, None);
        let scales = Scale::all(120, 2);
        let (mut short, mut long) = (0, 0);
        for scale in scales {
            let solved =
                staged(|stages| Scale::solve_leave_gap_out(&[scale], (&problem, None), Instructions::Scalar, stages));
            let [leave_gap_out, _] = &solved[0];
            let any = (0..leave_gap_out.len()).any(|window| is_determined(leave_gap_out, window));
            assert_eq!(any, scale.predicts(problem.layout), "{scale:?}");
            *(if any { &mut long } else { &mut short }) += 1;
        }
        assert!(short > 0 && long > 0);
    }

    #[test]
    fn blocks_of_grouped_lengths_hold_whole_groups() {
        for (times, reach, group) in [(300, 6, 2), (160, 7, 50), (90, 1, 3)] {
            let scales = Scale::grouped(times, reach, group);
            assert!(!scales.is_empty());
            for scale in scales {
                assert_eq!((scale.step % group, scale.one_sided() % group), (0, 0));
                assert!(2 * scale.span() <= times * group);
                for row in scale.full_rows(times * group) {
                    let cell = scale.cell(row);
                    let (before, after) = (scale.one_sided_rows(cell), scale.one_sided_rows(scale.after(cell)));
                    // A row less than the reach, at which a test function is next to nothing.
                    let least = ((reach - 1) * group).cast_signed();
                    assert!(before.end + least <= row.cast_signed() + 1 && after.start >= row.cast_signed() + least);
                }
            }
        }
    }

    #[test]
    fn lengths_grow_up_to_half_of_the_rows() {
        let scales = Scale::all(2000, 6);
        assert!(scales.windows(2).all(|pair| pair[0].span() < pair[1].span()));
        let longest = scales.last().expect("lengths").span();
        assert!((500..=1000).contains(&longest), "{longest}");
        assert!(Scale::all(Scale::fewest_rows(6) - 1, 6).is_empty());
        assert_eq!(Scale::all(Scale::fewest_rows(6), 6).len(), 1);
        for (place, scale) in scales.iter().enumerate() {
            assert_eq!(Scale::nearest(&scales, scale.span()), Some(place));
        }
        assert_eq!(Scale::nearest(&[], 100), None);
    }

    #[test]
    fn windows_are_the_same_whether_solved_together_or_in_parts() {
        let rows = rows(900, |time| [time.sin(), time.cos()], 0.1);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        for scale in Scale::all(900, 6) {
            let all = scale.one_sided_cells(900);
            let whole = staged(|stages| scale.solve(&problem, (&all, Sides::ALL), Instructions::Scalar, stages));
            let some = 5.min(all.end - 1)..9.min(all.end);
            let here = |one, both| scale.solve_here(&problem, (&some, Sides { one, both }), Instructions::Scalar);
            let (beside, part) = (here(true, false), here(false, true));
            assert_eq!([beside.leave_gap_out.len(), beside.full.len(), part.one_sided.len()], [0; 3]);
            let part = Cells { one_sided: beside.one_sided, ..part };
            let alone =
                staged(|stages| Scale::solve_leave_gap_out(&[scale], (&problem, None), Instructions::Scalar, stages));
            let [gap, full] = &alone[0];
            for cell in some.clone() {
                let pairs = [
                    (&whole.one_sided, &part.one_sided),
                    (&whole.leave_gap_out, &part.leave_gap_out),
                    (&whole.full, &part.full),
                ];
                for (whole, part) in pairs {
                    let (one, other) = (whole.place(cell).expect("a cell"), part.place(cell).expect("a cell"));
                    for field in 0..whole.fields.size() {
                        assert_eq!(whole.field(field)[one], part.field(field)[other], "{scale:?}, cell {cell}");
                    }
                }
                if let (Some(place), Some(same)) = (full.place(cell), whole.full.place(cell)) {
                    let count = full.fields.count();
                    assert_eq!(full.field(count)[place], whole.full.field(count)[same]);
                    assert_eq!(full.field(count)[place], scale.span() as f64);
                    assert_eq!(gap.field(count)[place], 2.0 * scale.one_sided() as f64);
                }
            }
        }
    }

    #[test]
    fn lengths_of_one_step_are_the_same_together_and_alone() {
        let rows = rows(900, |time| [time.sin(), time.cos()], 0.1);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let scales = Scale::all(900, 6);
        let together = Scale::together(&scales, 900);
        assert!(together.iter().any(|some| some.len() > 4) && together.concat() == scales);
        assert_eq!(Scale::together(&scales, MOST_TOGETHER + 1).len(), scales.len());
        for some in together {
            let all = staged(|stages| Scale::solve_leave_gap_out(some, (&problem, None), Instructions::Scalar, stages));
            assert_eq!(all.len(), some.len());
            for (scale, both) in some.iter().zip(&all) {
                let alone = staged(|stages| {
                    Scale::solve_leave_gap_out(&[*scale], (&problem, None), Instructions::Scalar, stages)
                });
                for (one, other) in both.iter().zip(&alone[0]) {
                    assert_eq!((one.first, one.len()), (other.first, scale.full_cells(900).len()));
                    (0..one.fields.size()).for_each(|field| assert_eq!(one.field(field), other.field(field)));
                }
            }
        }
    }
}
