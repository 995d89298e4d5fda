//! Pulses of the windowed stiffness, which are taken off the torque so that everything else is identified as if there were none.
//!
//! Windows that hold rows over a pulse follow it in part, so these rows are found and left out in turns before the pulses are placed. Then
//! the record is identified with the torque that it would have without them, and they are placed again from what that leaves.

use std::ops::Range;

use crate::error::Error;
use crate::identify::results::SampleResults;
use crate::identify::weak::angle_zero::spring::{STIFFNESS, SpringColumn};
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::found::WeakIdentified;
use crate::identify::weak::session::Session;
use crate::inference::constancy::NO_CHANCE;
use crate::inference::jumps::pulses::{Pulse, PulseSearch};
use crate::record::derived::{Interpolated, Ones};
use crate::record::samples::Samples;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::residuals::{residuals, usual_variance};
use crate::weak_form::weak_rows::{Record, WeakRows};

/// Times that rows over pulses are left out and what is left of all is looked at again.
const TURNS: usize = 3;
/// The largest part of the rows that may be over pulses: what happens more often is no event.
const MOST: f64 = 0.3;

/// The least change of the stiffness that is a pulse, as a part of it: the bend of a ramp looks like a smaller one. And the largest part of a
/// pulse by which the stiffness may differ before and after it: what does not come back is a jump.
const LEAST: f64 = 0.1;
const COMES_BACK: f64 = 0.25;
/// Standard errors within which 95 % of normal numbers are.
const WITHIN: f64 = 1.96;
/// The least part of the squares of what stands out that must be pulses.
const EXPLAINED: f64 = 0.9;
/// By how much less the squared errors of independent rows must be with pulses than without, or with a touch, a spike of the torque or
/// pulses of the inertia in their places, over the noise's variance.
const BETTER: f64 = 20.0;

/// Where pulses could not be found, and how large they are.
pub(crate) struct Hidden {
    places: Vec<Range<usize>>,
    change: f64,
}

/// What windows leave of every row, whether they say anything of it, and their stiffness there.
#[derive(Default)]
struct Left {
    rows: Vec<f64>,
    usable: Vec<bool>,
    stiffness: Vec<f64>,
    /// Rows of a window.
    span: usize,
    /// Whether parts of the record differ by more than chance in what is held constant: that leaves something, too.
    others_change: bool,
}

impl Left {
    /// Adds something to what is left of every row.
    fn add(&mut self, more: &[f64]) {
        self.rows.iter_mut().zip(more).for_each(|(left, more)| *left += more);
    }

    /// Whether the stiffness around some rows is such as a pulse in them leaves it.
    fn comes_back(&self, pulse: &Pulse, rows: &Range<usize>) -> bool {
        let reach = self.span / 2 + 1;
        let last = self.stiffness.len() - 1;
        let [before, after] =
            [rows.start.saturating_sub(reach), (rows.end + reach).min(last)].map(|row| self.stiffness[row]);
        let change = largest_change(pulse);
        change > LEAST * f64::midpoint(before.abs(), after.abs()) && (after - before).abs() < COMES_BACK * change
    }
}

impl Session<'_, '_, '_> {
    /// The pulses of the stiffness where it is what is windowed. `known` ones are taken off the torque already; `torque` is as it was recorded.
    pub(crate) fn pulses(
        &mut self,
        chosen: &mut Chosen,
        model: &Model,
        known: &[Pulse],
        torque: &dyn Samples,
    ) -> Result<Vec<Pulse>, Error> {
        let decides = self.options.averaging && self.options.lag == Some(0.0) && !self.finds_lag();
        if !decides || model.windowed != [STIFFNESS] {
            return Ok(Vec::new());
        }
        let sketch = self.take_sketch(chosen, model)?;
        let (error, expected) = (sketch.error, sketch.expected);
        chosen.fitted = Some(sketch);
        if error > NOISE_MODEL_FAILS {
            return Ok(known.to_vec());
        }
        let fitted = self.take_fitted(chosen, model)?;
        let left = self.left_of_all_rows(&chosen.weak, &chosen.weak.rows.usable, &fitted)?;
        chosen.fitted = Some(fitted);
        let Some(mut left) = left else { return Ok(known.to_vec()) };
        let added = if known.is_empty() { None } else { self.better_by(chosen, model, (torque, error))? };
        let Some(added) = added.or(known.is_empty().then(Vec::new)) else { return Ok(Vec::new()) };
        left.add(&added);
        let search = self.search(&chosen.weak, expected, &left);
        let mut over = search.conspicuous();
        if search.is_chance(&over) {
            return Ok(Vec::new());
        }
        let turns = if known.is_empty() { TURNS } else { 0 };
        for _ in 0..turns {
            let Some(again) = self.left_without(chosen, model, &over)? else { return Ok(Vec::new()) };
            left = again;
            let before = over;
            over = self.search(&chosen.weak, expected, &left).conspicuous();
            if over == before {
                break;
            }
        }
        if left.others_change {
            return Ok(Vec::new());
        }
        let placed = self.pulses_in(&chosen.weak, expected, &left, &over);
        if placed.is_some() || known.is_empty() {
            return Ok(placed.unwrap_or_default());
        }
        // One that was misplaced leaves something in windows that hold its rows, and seems not to come back.
        let Some(mut left) = self.left_without(chosen, model, &over)? else { return Ok(Vec::new()) };
        left.add(&added);
        let over = self.search(&chosen.weak, expected, &left).conspicuous();
        if left.others_change {
            return Ok(Vec::new());
        }
        Ok(self.pulses_in(&chosen.weak, expected, &left, &over).unwrap_or_default())
    }

    /// The pulses in some stretches of rows, if they explain what stands out there, and better than anything else in their places.
    fn pulses_in(&self, weak: &WeakRows, expected: Expected, left: &Left, over: &[Range<usize>]) -> Option<Vec<Pulse>> {
        // A touch is a torque of its own, and what is held for a while an inertia.
        let (accelerations, samples) = (weak.plain_column(0), self.record.angle.len());
        let (first, stride) = (weak.first, weak.stride);
        let acceleration = Interpolated { values: &accelerations, first, stride, samples };
        let others: [&dyn Samples; 2] = [&Ones(samples), &acceleration];
        let search = PulseSearch { others: &others, ..self.search(weak, expected, left) };
        let pulse = |rows: &Range<usize>| search.within(rows).filter(|pulse| left.comes_back(pulse, rows));
        let found: Vec<Option<Pulse>> = over.iter().map(pulse).collect();
        // A few rows that stand out little do not speak against pulses that stand out much.
        let squares = |rows: &Range<usize>| -> f64 { left.rows[rows.clone()].iter().map(|left| left * left).sum() };
        let all: f64 = over.iter().map(squares).sum();
        let explained: f64 =
            over.iter().zip(&found).filter(|(_, pulse)| pulse.is_some()).map(|(rows, _)| squares(rows)).sum();
        let pulses: Vec<Pulse> = found.into_iter().flatten().collect();
        let above_others: f64 = pulses.iter().map(|pulse| pulse.above_others).sum();
        (explained >= EXPLAINED * all && above_others > BETTER).then_some(pulses)
    }

    /// What pulses that were taken off add to rows, which were predicted with some error without them, or `None` if the same rows of the torque as it
    /// was recorded are predicted hardly worse.
    fn better_by(
        &mut self,
        chosen: &mut Chosen,
        model: &Model,
        (torque, error): (&dyn Samples, f64),
    ) -> Result<Option<Vec<f64>>, Error> {
        let record = Record { torque, ..self.record.clone() };
        let (function, delta, workers) = (chosen.weak.function, self.options.delta, self.stages.workers);
        let whole = self.stages.stage(|watch| WeakRows::build(&record, function, delta, None, workers, watch))?;
        let added = whole.rows.rhs.iter().zip(&chosen.weak.rows.rhs).map(|(whole, calm)| whole - calm).collect();
        let calm = std::mem::replace(&mut chosen.weak.rows.rhs, whole.rows.rhs);
        let without = self.error_of(chosen, model);
        chosen.weak.rows.rhs = calm;
        let independent = self.record.angle.len() as f64 / function.half_width() as f64;
        Ok(((without? - error) * independent > BETTER).then_some(added))
    }

    /// Samples at which a pulse like those that were found could hardly be found, and the change of such a pulse.
    pub(crate) fn hidden_pulses(&self, chosen: &Chosen, pulses: &[Pulse]) -> Option<Hidden> {
        let expected = chosen.fitted.as_ref()?.expected;
        let mut lengths: Vec<usize> = pulses.iter().map(|pulse| pulse.samples.len()).collect();
        let mut changes: Vec<f64> = pulses.iter().map(largest_change).collect();
        lengths.sort_unstable();
        changes.sort_by(f64::total_cmp);
        let (&length, &change) = (lengths.get(lengths.len() / 2)?, changes.get(changes.len() / 2)?);
        let left = Left { usable: chosen.weak.rows.usable.clone(), ..Left::default() };
        let search = self.search(&chosen.weak, expected, &left);
        Some(Hidden { places: search.hidden(length, change), change })
    }

    fn search<'a>(&'a self, weak: &'a WeakRows, expected: Expected, left: &'a Left) -> PulseSearch<'a> {
        // Windows that follow a pulse leave more than noise of all rows in them: what is usual counts.
        let usual = usual_variance(&left.rows, &left.usable).unwrap_or(0.0);
        PulseSearch {
            left: &left.rows,
            usable: &left.usable,
            roots: &weak.rows.roots,
            signal: self.record.angle,
            others: &[],
            function: &weak.kernels.values[2],
            first: weak.first,
            stride: weak.stride,
            variance: expected.variance.max(usual),
            inflation: expected.variance_inflation,
        }
    }

    /// What is left of every row by windows that hold none of some rows, and whether they say anything of it; `None` if these are none or too many.
    fn left_without(
        &mut self,
        chosen: &mut Chosen,
        model: &Model,
        rows: &[Range<usize>],
    ) -> Result<Option<Left>, Error> {
        let count: usize = rows.iter().map(Range::len).sum();
        if rows.is_empty() || count as f64 > MOST * chosen.weak.rows.len() as f64 {
            return Ok(None);
        }
        let mut over: Vec<usize> = rows.iter().cloned().flatten().collect();
        over.sort_unstable();
        over.dedup();
        let aside = chosen.weak.rows.set_aside(over);
        let mut fitted = self.roughly(|session| session.fit_first(chosen, model))?;
        self.test(&chosen.weak.rows, &mut fitted)?;
        chosen.weak.rows.take_back(aside);
        let usable = chosen.weak.rows.usable.clone();
        let left = self.left_of_all_rows(&chosen.weak, &usable, &fitted)?;
        let others_change = fitted.tests.iter().any(|(_, test)| test.probability < NO_CHANCE);
        Ok(left.map(|left| Left { others_change, ..left }))
    }

    fn left_of_all_rows(&mut self, weak: &WeakRows, usable: &[bool], fitted: &Decided) -> Result<Option<Left>, Error> {
        let Some(fit) = fitted.fit.as_ref().filter(|fit: &&Fit| fit.scale.is_some()) else { return Ok(None) };
        let spring = SpringColumn::new(&fitted.model, fit, weak.rows.len(), weak.rows.period);
        let Some(spring) = spring else { return Ok(None) };
        let mut problem = fitted.problem(&weak.rows, self.noise[0]);
        problem.usable = usable;
        let (rows, usable) = residuals(&problem, fit, &mut self.stages)?;
        Ok(Some(Left { rows, usable, stiffness: spring.stiffness().to_vec(), span: fit.span, others_change: false }))
    }
}

fn largest_change(pulse: &Pulse) -> f64 {
    pulse.change.iter().fold(0.0, |most, change| most.max(change.abs()))
}

/// Makes the errors of values such that they hold a pulse where one could not be found, but for where one was.
pub(crate) fn allow_hidden(found: &mut WeakIdentified, place: usize, step: usize, hidden: &Hidden, pulses: &[Pulse]) {
    let errors = &mut found.results.errors[place];
    let mut unseen = vec![false; errors.len()];
    let elements = |samples: &Range<usize>| samples.start.div_ceil(step)..samples.end.div_ceil(step);
    for places in &hidden.places {
        unseen[elements(places)].fill(true);
    }
    for pulse in pulses {
        unseen[elements(&(pulse.first..pulse.first + pulse.change.len()))].fill(false);
    }
    for (error, _) in errors.iter_mut().zip(unseen).filter(|(_, unseen)| *unseen) {
        *error = error.hypot(hidden.change / WITHIN);
    }
}

/// Whether pulses are those of the last round, to a sample.
pub(crate) fn are_the_same(pulses: &[Pulse], before: &[Pulse]) -> bool {
    let near = |(one, other): (&Pulse, &Pulse)| {
        one.samples.start.abs_diff(other.samples.start) <= 1 && one.samples.end.abs_diff(other.samples.end) <= 1
    };
    pulses.len() == before.len() && pulses.iter().zip(before).all(near)
}

/// The torque without what pulses of the stiffness make of it.
pub(crate) fn without_pulses(torque: &dyn Samples, angle: &dyn Samples, pulses: &[Pulse]) -> Vec<f64> {
    let mut left = vec![0.0; torque.len()];
    torque.read(0, &mut left);
    for pulse in pulses {
        let mut angles = vec![0.0; pulse.change.len()];
        angle.read(pulse.first, &mut angles);
        for ((left, angle), change) in left[pulse.first..].iter_mut().zip(&angles).zip(&pulse.change) {
            *left -= change * angle;
        }
    }
    left
}

/// Adds pulses to the values of the stiffness, which are at some place, one every `step` samples, and to their errors; their ends are jumps.
pub(crate) fn add_pulses(found: &mut WeakIdentified, place: usize, step: usize, pulses: &[Pulse]) {
    let SampleResults { values, errors, .. } = &mut found.results;
    for pulse in pulses {
        let samples = pulse.first..pulse.first + pulse.change.len();
        for sample in samples.filter(|sample| sample % step == 0) {
            let (element, index) = (sample / step, sample - pulse.first);
            values[place][element] += pulse.change[index];
            let error = &mut errors[place][element];
            *error = error.hypot(pulse.variance[index].sqrt());
        }
    }
    found.pulses = pulses.iter().map(|pulse| pulse.samples.clone()).collect();
    found.jumps.extend(found.pulses.iter().flat_map(|pulse| [pulse.start, pulse.end]));
    found.jumps.sort_unstable();
}
