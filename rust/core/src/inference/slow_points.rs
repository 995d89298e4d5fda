//! Local polynomials in time fitted to equations around many points, with and without those near each.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::inference::slow_triangles::Triangles;
use crate::regression::layout::{Fields, Layout};
use crate::regression::noise_correction::RowNoise;
use crate::regression::solve::{SolveScratch, solve};
use crate::regression::solved::Solved;
use crate::regression::summary::{absorb, merge};
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Points within one bandwidth.
pub(crate) const DENSITY: usize = 8;

/// Equations that are absorbed at a time.
const AT_A_TIME: usize = 6;

/// One coefficient as a parabola beside two constants, the most frequent layout: the compiler unrolls its loops.
const BESIDE_TWO: Layout = Layout { windowed: 3, linear: false, constant: 2 };

/// Eights of points that are solved at a time.
const PIECE: usize = 64;

/// Points of a stretch, each with the equations around it.
pub(crate) struct Points<'a> {
    /// The equations of the stretch that they lie in, of which so many coefficients are slow.
    pub(crate) equations: &'a Triangles,
    pub(crate) coefficients: usize,
    /// Coefficients of the polynomials in time.
    pub(crate) terms: usize,
    /// The first row of the stretch.
    pub(crate) start: usize,
    pub(crate) reach: f64,
    pub(crate) hole: f64,
    pub(crate) count: usize,
}

/// The kernel: some eights of them. Returns their fields without equations nearer than the hole, and with all.
struct Eights<'a> {
    points: &'a Points<'a>,
    which: Range<usize>,
}

impl Kernel for Eights<'_> {
    type Output = [Vec<Packet>; 2];

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) -> [Vec<Packet>; 2] {
        let Self { points, which } = self;
        let layout = points.layout();
        if layout == BESIDE_TWO && points.coefficients == 1 && S::F64_LANES > 1 {
            points.solve::<S>(BESIDE_TWO, (1, 3), which)
        } else {
            points.solve::<S>(layout, (points.coefficients, points.terms), which)
        }
    }
}

impl Points<'_> {
    fn layout(&self) -> Layout {
        let constant = self.equations.unknowns - self.coefficients;
        Layout { windowed: self.terms * self.coefficients, linear: false, constant }
    }

    /// Points side by side lie so far apart: each sees equations of its own, and none that another sees alone.
    fn apart(&self) -> usize {
        self.count.div_ceil(WIDTH)
    }

    /// Solves all of them, in parallel: without equations nearer than the hole, and with all.
    pub(crate) fn solved(&self, instructions: Instructions, stages: &mut Stages<'_, '_>) -> Result<[Solved; 2], Error> {
        let (layout, apart) = (self.layout(), self.apart());
        let pieces = (0..apart).step_by(PIECE).map(|first| first..apart.min(first + PIECE));
        let pieces: Vec<_> = pieces.map(|which| Piece { size: which.len(), content: which }).collect();
        let firsts: Vec<usize> = pieces.iter().map(|piece| piece.content.start).collect();
        let solve = |which: Range<usize>, (): &mut ()| dispatch(instructions, Eights { points: self, which });
        let found = stages.map(pieces, || (), solve)?;
        let size = Fields { layout }.size();
        let mut solved = [Solved::new(layout, 0, self.count), Solved::new(layout, 0, self.count)];
        for (first, both) in firsts.into_iter().zip(&found) {
            for (solved, fields) in solved.iter_mut().zip(both) {
                let eights = fields.chunks_exact(size).zip(first..);
                eights.for_each(|(fields, place)| solved.put_apart(place, apart, fields));
            }
        }
        Ok(solved)
    }

    #[inline(always)]
    fn solve<S: Lanes>(&self, layout: Layout, (slow, terms): (usize, usize), which: Range<usize>) -> [Vec<Packet>; 2] {
        let noise = RowNoise::new(&vec![[].as_slice(); 2 * layout.windowed + layout.constant + 1], 0.0);
        let size = Fields { layout }.size();
        let mut solved = [(); 2].map(|()| Vec::with_capacity(which.len() * size));
        let mut scratch = SolveScratch::new(layout);
        let mut sides = [Side::new(layout), Side::new(layout)];
        let mut merged = vec![Packet::ZERO; layout.columns() * layout.columns()];
        let mut fields = vec![Packet::ZERO; size];
        for first in which {
            sides.iter_mut().for_each(Side::clear);
            let nearby = AroundPoints::new(self, first, self.apart());
            // Every part is called from one place: each is long, and compiled wherever it is called.
            for step in 0..=nearby.steps {
                let seen = nearby.seen(self, step);
                for (side, weight) in sides.iter_mut().zip(seen.weights) {
                    if weight != Packet::ZERO {
                        side.push((layout, slow, terms), self.equations, &seen, weight);
                    }
                    if side.waiting == AT_A_TIME * (slow + layout.constant) || step == nearby.steps {
                        absorb(layout, &mut side.summary, &mut side.rows, side.waiting, false);
                        side.waiting = 0;
                    }
                }
            }
            let [outside, inside] = &mut sides;
            for (which, solved) in solved.iter_mut().enumerate() {
                if which == 1 {
                    merge(layout, &mut outside.summary, &inside.summary, 0.0, &mut merged);
                }
                solve(layout, &outside.summary, &noise, Some(1.0), &mut scratch, &mut fields);
                solved.extend_from_slice(&fields);
            }
        }
        solved
    }
}

/// The equations around eight points.
struct AroundPoints {
    points: [f64; WIDTH],
    /// The first equation of each, and how many there are.
    first: [usize; WIDTH],
    count: [usize; WIDTH],
    /// The largest of these numbers.
    steps: usize,
}

/// One equation of each of eight points: its place, its distance over the reach, and its weight outside the hole and inside.
struct Seen {
    places: [usize; WIDTH],
    distance: Packet,
    weights: [Packet; 2],
    /// Whether it counts.
    counts: [bool; WIDTH],
}

impl AroundPoints {
    #[inline(always)]
    fn new(points: &Points<'_>, first: usize, apart: usize) -> Self {
        let spacing = points.reach / DENSITY as f64;
        let places = &points.equations.places;
        let mut nearby = Self { points: [0.0; WIDTH], first: [0; WIDTH], count: [0; WIDTH], steps: 0 };
        for lane in 0..WIDTH {
            let index = first + lane * apart;
            let point = points.start as f64 + index as f64 * spacing;
            nearby.points[lane] = point;
            if index < points.count {
                let begin = places.partition_point(|(row, _)| *row < point - points.reach);
                let end = places.partition_point(|(row, _)| *row <= point + points.reach);
                (nearby.first[lane], nearby.count[lane]) = (begin, end - begin);
                nearby.steps = nearby.steps.max(end - begin);
            }
        }
        nearby
    }

    /// The equations that are so many after the first of each point: none after the last of all.
    #[inline(always)]
    fn seen(&self, points: &Points<'_>, step: usize) -> Seen {
        let mut seen =
            Seen { places: [0; WIDTH], distance: Packet::ZERO, weights: [Packet::ZERO; 2], counts: [false; WIDTH] };
        for lane in 0..WIDTH {
            if step < self.count[lane] {
                let place = self.first[lane] + step;
                let (row, counts) = points.equations.places[place];
                let distance = (row - self.points[lane]) / points.reach;
                let is_outside = distance.abs() * points.reach >= points.hole;
                (seen.places[lane], seen.counts[lane], seen.distance.0[lane]) = (place, counts, distance);
                seen.weights[usize::from(!is_outside)].0[lane] = (1.0 - distance * distance).max(0.0);
            }
        }
        seen
    }
}

/// What is summed up outside the hole, or inside.
struct Side {
    summary: Vec<Packet>,
    rows: Vec<Packet>,
    /// Rows that are to be absorbed.
    waiting: usize,
}

impl Side {
    fn new(layout: Layout) -> Self {
        let unknowns = layout.regressors();
        let rows = vec![Packet::ZERO; AT_A_TIME * unknowns * layout.columns()];
        Self { summary: vec![Packet::ZERO; layout.size()], rows, waiting: 0 }
    }

    fn clear(&mut self) {
        self.summary.fill(Packet::ZERO);
        self.waiting = 0;
    }

    /// Adds one equation of each point.
    #[inline(always)]
    fn push(
        &mut self,
        (layout, slow, terms): (Layout, usize, usize),
        equations: &Triangles,
        seen: &Seen,
        weight: Packet,
    ) {
        let (all, columns) = (slow + layout.constant, layout.columns());
        let root = weight.sqrt();
        for i in 0..all {
            let row = &mut self.rows[self.waiting * columns..(self.waiting + 1) * columns];
            row.fill(Packet::ZERO);
            for j in i..=all {
                let mut value = root * equations.gather(&seen.places, i * (all + 1) + j);
                if j >= slow {
                    row[layout.windowed + j - slow] = value;
                    continue;
                }
                for term in 0..terms {
                    row[j * terms + term] = value;
                    value = value * seen.distance;
                }
            }
            self.waiting += 1;
        }
        for (count, (&counts, weight)) in self.summary[layout.sums()].0.iter_mut().zip(seen.counts.iter().zip(weight.0))
        {
            *count += if counts && weight > 0.0 { all as f64 } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{assert_near, random, staged};
    use crate::regression::solved::{is_determined, local};

    const EQUATIONS: usize = 300;
    /// Triangles of some hundred equations, six at a time.
    const ROUNDING: f64 = 1e-10;

    fn parabola(row: f64) -> f64 {
        3.0 - 0.02 * row + 1e-4 * row * row
    }

    /// Equations of a parabola beside so many constants, which are 1, 2 and so on; some are missing, and noise is added to the right-hand sides.
    fn equations(constants: usize, deviation: f64) -> Triangles {
        let all = 1 + constants;
        let (entries, noise) = (random(7, EQUATIONS * all * all), random(8, EQUATIONS * all));
        let mut found = Triangles::new(all);
        for one in (0..EQUATIONS).filter(|one| one % 17 != 3 && !(100..115).contains(one)) {
            let row = 2.0 * one as f64;
            let rows = found.push(row, true);
            for i in 0..all {
                for j in i..all {
                    let entry = entries[(one * all + i) * all + j];
                    rows[i * (all + 1) + j] = entry;
                    rows[i * (all + 1) + all] += entry * if j == 0 { parabola(row) } else { j as f64 };
                }
                rows[i * (all + 1) + all] += deviation * noise[one * all + i];
            }
        }
        found
    }

    fn solved(equations: &Triangles, hole: f64, instructions: Instructions) -> [Solved; 2] {
        let points = Points { equations, coefficients: 1, terms: 3, start: 0, reach: 80.0, hole, count: 61 };
        staged(|stages| points.solved(instructions, stages))
    }

    #[test]
    fn a_parabola_is_found_with_and_without_the_equations_near_a_point() {
        for constants in 0..4 {
            let values: Vec<f64> = (1..=constants).map(|one| one as f64).collect();
            for one in solved(&equations(constants, 0.0), 30.0, Instructions::Scalar) {
                for point in 0..one.len() {
                    assert!(is_determined(&one, point));
                    assert_near(local(&one, point, &values, 0), parabola(10.0 * point as f64), ROUNDING);
                }
            }
        }
    }

    #[test]
    fn what_is_left_out_is_what_lies_within_the_hole() {
        let noisy = equations(2, 1.0);
        let mut holed = Triangles::new(3);
        let centre = 300.0;
        let size = 12;
        for (place, &(row, counts)) in
            noisy.places.iter().enumerate().filter(|(_, (row, _))| (row - centre).abs() >= 30.0)
        {
            let rows = holed.push(row, counts);
            (0..size).for_each(|entry| rows[entry] = noisy.gather(&[place; WIDTH], entry).0[0]);
        }
        let at = |solved: &Solved| local(solved, 30, &[1.0, 2.0], 0);
        let [without, with] = solved(&noisy, 30.0, Instructions::Scalar);
        let [nothing_left_out, all] = solved(&noisy, 0.0, Instructions::Scalar);
        let [_, alone] = solved(&holed, 0.0, Instructions::Scalar);
        assert_near(at(&without), at(&alone), ROUNDING);
        assert!((at(&without) - at(&with)).abs() > 1e-3);
        for point in 0..61 {
            let near = |one: &Solved| local(one, point, &[1.0, 2.0], 0);
            assert_near(near(&all), near(&with), ROUNDING);
            assert_near(near(&all), near(&nothing_left_out), ROUNDING);
        }
    }

    #[test]
    fn every_point_of_many_is_where_it_belongs() {
        let found = equations(2, 0.0);
        // More points than are solved at a time, one a row.
        let count = 601;
        assert!(count > WIDTH * PIECE);
        let points = Points { equations: &found, coefficients: 1, terms: 3, start: 0, reach: 8.0, hole: 0.0, count };
        let [_, all] = staged(|stages| points.solved(Instructions::Scalar, stages));
        let determined: Vec<usize> = (0..count).filter(|&point| is_determined(&all, point)).collect();
        assert!(determined.len() > count / 2);
        for point in determined {
            assert_near(local(&all, point, &[1.0, 2.0], 0), parabola(point as f64), 100.0 * ROUNDING);
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        for constants in 1..4 {
            let equations = equations(constants, 1.0);
            let [one, other] =
                [Instructions::Scalar, Instructions::current()].map(|which| solved(&equations, 25.0, which));
            for (one, other) in one.iter().zip(&other) {
                for field in 0..one.fields.size() {
                    assert_eq!(one.field(field), other.field(field));
                }
            }
        }
    }
}
