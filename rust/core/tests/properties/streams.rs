//! A stream gives the bits of the batch, whatever the pieces that it comes in, and goes on from its state.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::Arc;

use crate::columns::{Columns, kinds_of_regression};
use proptest::prelude::*;
use tvident::lanes::Elements;
use tvident::least_squares::{Alignment, Equations, HALF_OF_THE_DIGITS, Regressions, RollingLeastSquares};
use tvident::local_polynomials::{Criterion, Estimates, LocalPolynomials, Order, PolynomialOptions, Selection};
use tvident::record::Samples;
use tvident::simd::Instructions;
use tvident::stream::{PolynomialStream, RollingStream};

/// Appends what was found in a piece to what was found before.
fn append(all: &mut Columns, more: Columns) {
    all.numbers.iter_mut().zip(more.numbers).for_each(|(all, some)| all.extend(some));
    all.order.extend(more.order);
    all.status.extend(more.status);
}

/// The elements of some samples, with a step.
fn elements(samples: &Range<usize>, step: usize) -> (Elements, usize) {
    let grid = Elements { first: 0, step };
    let some = grid.of(samples.clone());
    (Elements { first: some.start * step, step }, some.len())
}

/// Calls `take` with estimates that are written to new columns: derivatives, noise, then errors.
fn polynomials(
    derivatives: usize,
    samples: &Range<usize>,
    step: usize,
    take: impl FnOnce(&mut Estimates<'_>, &mut [&mut [f64]]),
) -> Columns {
    let (elements, count) = elements(samples, step);
    let mut found = Columns::new(2 * derivatives + 1, count);
    let (values, rest) = found.numbers.split_at_mut(derivatives);
    let (sigma, errors) = rest.split_at_mut(1);
    let mut errors: Vec<&mut [f64]> = errors.iter_mut().map(Vec::as_mut_slice).collect();
    let mut estimates = Estimates {
        elements,
        derivatives: values.iter_mut().map(Vec::as_mut_slice).collect(),
        order: &mut found.order,
        status: &mut found.status,
        sigma: &mut sigma[0],
    };
    take(&mut estimates, &mut errors);
    found
}

/// Calls `take` with regressions that are written to new columns.
fn regressions(
    p: usize,
    q: usize,
    rows: &Range<usize>,
    step: usize,
    take: impl FnOnce(&mut Regressions<'_>),
) -> Columns {
    let (elements, count) = elements(rows, step);
    let kinds = kinds_of_regression(p, q);
    let mut found = Columns::new(kinds.iter().sum(), count);
    let numbers = found.numbers.iter_mut().map(Vec::as_mut_slice).collect();
    take(&mut crate::columns::regressions(kinds, numbers, &mut found.status, elements));
    found
}

/// Lengths of pieces that repeat until a record is used up.
fn pieces(lengths: &[usize], count: usize) -> Vec<Range<usize>> {
    let mut all = Vec::new();
    let mut first = 0;
    for length in lengths.iter().cycle() {
        if first == count {
            break;
        }
        let end = count.min(first + length);
        all.push(first..end);
        first = end;
    }
    all
}

/// A signal with noise, with samples that are no number and glitches.
fn signal(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed | 1;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut values: Vec<f64> = (0..count).map(|i| (i as f64 * 0.05).sin() + 0.01 * random()).collect();
    if seed % 3 == 0 {
        values[count / 3] = f64::NAN;
        values[count / 2] = 1e9;
    }
    values
}

const LENGTHS: [usize; 6] = [7, 21, 51, 64, 101, 401];

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn polynomials_are_those_of_the_batch(
        length in prop::sample::select(&LENGTHS[..]),
        fixed in any::<bool>(),
        average in any::<bool>(),
        step in prop::sample::select(&[1_usize, 1, 3, 64][..]),
        lengths in prop::collection::vec(1_usize..200, 1..6),
        seed in any::<u64>(),
        resume in any::<bool>(),
    ) {
        let options = PolynomialOptions {
            window_length: length,
            order: if fixed { Order::Fixed(5) } else { Order::Chosen { criterion: Criterion::Aicc, highest: 15 } },
            selection: if average { Selection::Average } else { Selection::Window },
            derivatives: vec![0, 1, 2],
            delta: 0.001,
            noise: true,
            quantisation: 0.0,
            instructions: Instructions::current(),
        };
        let plan = Arc::new(LocalPolynomials::new(options).expect("valid"));
        let record = signal(1500, seed);
        let whole = 0..record.len();
        let one = NonZeroUsize::MIN;
        let slice = record.as_slice();
        let mut expected = polynomials(3, &whole, step, |estimates, _| {
            let estimates = std::mem::replace(estimates, Estimates { elements: estimates.elements, derivatives: Vec::new(), order: &mut [], status: &mut [], sigma: &mut [] });
            plan.run(&[&slice], estimates, true, one, &mut |_, _| true).expect("long enough");
        });
        let errors = polynomials(3, &whole, step, |estimates, _| {
            let estimates = std::mem::replace(estimates, Estimates { elements: estimates.elements, derivatives: Vec::new(), order: &mut [], status: &mut [], sigma: &mut [] });
            plan.errors(&[&slice], estimates, one, &mut |_, _| true).expect("long enough");
        });
        expected.numbers.truncate(4);
        expected.numbers.extend(errors.numbers.into_iter().take(3));

        let mut stream = PolynomialStream::new(Arc::clone(&plan), step, true).expect("no pooling");
        let mut found = Columns::new(7, 0);
        for piece in pieces(&lengths, record.len()) {
            let ready = stream.upcoming(piece.len());
            let due = if piece.end < length { 0 } else { piece.end - stream.delay() };
            prop_assert_eq!(ready.end, ready.start.max(due));
            append(&mut found, polynomials(3, &ready, step, |estimates, errors| stream.push(&&record[piece.clone()], estimates, errors)));
            if resume && piece.end % 5 == 0 {
                let state = stream.state();
                prop_assert!(state.samples.len() <= 4 * length + 600, "{} samples held", state.samples.len());
                stream = PolynomialStream::resume(Arc::clone(&plan), step, true, state).expect("no pooling");
            }
        }
        let rest = stream.at_end();
        append(&mut found, polynomials(3, &rest, step, |estimates, errors| stream.finish(estimates, errors)));
        prop_assert!(stream.at_end().is_empty());
        prop_assert_eq!(found.bits(), expected.bits());
    }

    #[test]
    fn windows_are_those_of_the_batch(
        (p, q) in (1_usize..6, 1_usize..3),
        window in prop::sample::select(&[7_usize, 20, 64, 301, 2500][..]),
        step in prop::sample::select(&[1_usize, 1, 4][..]),
        lengths in prop::collection::vec(prop::sample::select(&[1_usize, 2, 9, 100, 700][..]), 1..6),
        alignment in prop::sample::select(&[Alignment::Centre, Alignment::Trailing, Alignment::Leading][..]),
        (leaves_out, fades) in (any::<bool>(), any::<bool>()),
        (seed, resume) in (any::<u64>(), any::<bool>()),
    ) {
        let columns: Vec<Vec<f64>> = (0..p + q).map(|column| signal(4000, seed.wrapping_add(1 + column as u64))).collect();
        let pairs: Vec<(usize, usize)> = (1..p).map(|i| (0, i)).collect();
        let plan = || {
            let plan = RollingLeastSquares::new(window, p, q, pairs.clone(), HALF_OF_THE_DIGITS, Instructions::current());
            let plan = plan.expect("valid").aligned(alignment);
            let plan = if fades && alignment != Alignment::Centre { plan.with_half_life(40.0) } else { plan };
            if leaves_out { plan.of_at_least(p + 1) } else { plan }
        };
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let rows = 0..columns[0].len();
        let expected = regressions(p, q, &rows, step, |regressions| {
            let equations = Equations { columns: slices.iter().map(|column| column as &dyn Samples).collect(), weights: None, rows: rows.clone() };
            let plan = plan();
            plan.solve(&equations, rows.clone(), regressions, &mut plan.scratch());
        });
        let mut stream = RollingStream::new(plan(), step).expect("memory");
        let mut found = regressions(p, q, &(0..0), step, |_| ());
        for piece in pieces(&lengths, rows.end) {
            let some: Vec<&[f64]> = slices.iter().map(|column| &column[piece.clone()]).collect();
            let some: Vec<&dyn Samples> = some.iter().map(|column| column as &dyn Samples).collect();
            let ready = stream.upcoming(piece.len());
            append(&mut found, regressions(p, q, &ready, step, |regressions| stream.push(&some, regressions)));
            if resume && piece.end % 7 == 0 {
                let state = stream.state();
                prop_assert!(state.rows.len() <= 2 * window * (p + q));
                stream = RollingStream::resume(plan(), step, state).expect("memory");
            }
        }
        let rest = stream.at_end();
        append(&mut found, regressions(p, q, &rest, step, |regressions| stream.finish(regressions)));
        prop_assert_eq!(found.bits(), expected.bits());
    }
}

#[test]
fn a_stream_that_ends_before_its_first_window_knows_nothing() {
    let options = PolynomialOptions {
        window_length: 21,
        order: Order::Fixed(3),
        selection: Selection::Window,
        derivatives: vec![0],
        delta: 1.0,
        noise: true,
        quantisation: 0.0,
        instructions: Instructions::current(),
    };
    let plan = Arc::new(LocalPolynomials::new(options).expect("valid"));
    let mut stream = PolynomialStream::new(plan, 1, false).expect("no pooling");
    let empty =
        polynomials(1, &(0..0), 1, |estimates, errors| stream.push(&[1.0; 5].as_slice(), estimates, &mut errors[..0]));
    assert_eq!(empty.status, []);
    let found = polynomials(1, &(0..5), 1, |estimates, errors| stream.finish(estimates, &mut errors[..0]));
    let nothing = (tvident::Status::EDGE | tvident::Status::INVALID).bits();
    assert_eq!(found.status, [nothing; 5]);
    assert!(found.numbers[0].iter().all(|value| value.is_nan()));
}
