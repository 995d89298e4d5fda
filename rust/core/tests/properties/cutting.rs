//! Any cutting of a record gives the same bits, alone or beside others: every kind of plan, on every path of instructions, with samples that are no number and
//! glitches that make lanes start afresh.

use std::num::NonZeroUsize;

use crate::columns::{Columns, kinds_of_regression, regressions};
use crate::random::uniform_apart;
use proptest::prelude::*;
use tvident::lanes::Elements;
use tvident::least_squares::HALF_OF_THE_DIGITS;
use tvident::least_squares::{Equations, RollingLeastSquares};
use tvident::local_polynomials::{Criterion, Estimates, LocalPolynomials, Order, PolynomialOptions, Selection};
use tvident::record::Samples;
use tvident::simd::Instructions;

/// Where a range of so many is cut: at any places, in order.
fn pieces(cuts: &[usize], count: usize) -> Vec<std::ops::Range<usize>> {
    let mut bounds = vec![0, count];
    bounds.extend(cuts.iter().map(|cut| cut % (count + 1)));
    bounds.sort_unstable();
    bounds.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// Slices of all the numbers, the last of them apart.
fn slices(numbers: &mut [Vec<f64>], elements: std::ops::Range<usize>) -> Vec<&mut [f64]> {
    numbers.iter_mut().map(|values| &mut values[elements.clone()]).collect()
}

fn estimate(options: &PolynomialOptions, record: &[f64], cuts: &[usize], step: usize) -> Columns {
    let plan = LocalPolynomials::new(options.clone()).expect("valid options");
    let mut all = Columns::new(options.derivatives.len() + 1, record.len().div_ceil(step));
    let mut scratch = plan.scratch();
    for samples in pieces(cuts, record.len()) {
        let elements = samples.start.div_ceil(step)..samples.end.div_ceil(step);
        let mut derivatives = slices(&mut all.numbers, elements.clone());
        let sigma = derivatives.pop().expect("there is one more than derivatives");
        let diagnostics = options.noise;
        let mut estimates = Estimates {
            elements: Elements { first: elements.start * step, step },
            derivatives,
            order: if diagnostics { &mut all.order[elements.clone()] } else { &mut [] },
            status: if diagnostics { &mut all.status[elements] } else { &mut [] },
            sigma: if diagnostics { sigma } else { &mut [] },
        };
        plan.estimate(&record, samples, &mut estimates, &mut scratch).expect("the record is long enough");
    }
    all
}

/// The same by several threads.
fn estimate_in_parallel(options: &PolynomialOptions, record: &[f64], workers: usize) -> Columns {
    let plan = LocalPolynomials::new(options.clone()).expect("valid options");
    let mut all = Columns::new(options.derivatives.len() + 1, record.len());
    let mut derivatives = slices(&mut all.numbers, 0..record.len());
    let sigma = derivatives.pop().expect("there is one more than derivatives");
    let estimates = Estimates {
        elements: Elements { first: 0, step: 1 },
        derivatives,
        order: if options.noise { &mut all.order } else { &mut [] },
        status: if options.noise { &mut all.status } else { &mut [] },
        sigma: if options.noise { sigma } else { &mut [] },
    };
    let workers = NonZeroUsize::new(workers).expect("not zero");
    plan.run(&[&record], estimates, true, workers, &mut |_, _| true).expect("the record is long enough");
    all
}

/// Records of one length, all in one call or one by one, with their ends or without, by several threads.
fn estimate_records(
    options: &PolynomialOptions,
    records: &[Vec<f64>],
    (ends, step, workers): (bool, usize, usize),
    together: bool,
) -> Columns {
    let plan = LocalPolynomials::new(options.clone()).expect("valid options");
    let (first, samples) =
        if ends { (0, records[0].len()) } else { (plan.before_centre(), records[0].len() + 1 - options.window_length) };
    let each = samples.div_ceil(step);
    let mut all = Columns::new(options.derivatives.len() + 1, records.len() * each);
    let slices_of: Vec<&[f64]> = records.iter().map(Vec::as_slice).collect();
    let sources: Vec<&dyn Samples> = slices_of.iter().map(|record| record as &dyn Samples).collect();
    let workers = NonZeroUsize::new(workers).expect("not zero");
    for (number, some) in sources.chunks(if together { sources.len() } else { 1 }).enumerate() {
        let elements = number * some.len() * each..(number + 1) * some.len() * each;
        let mut derivatives = slices(&mut all.numbers, elements.clone());
        let sigma = derivatives.pop().expect("there is one more than derivatives");
        let estimates = Estimates {
            elements: Elements { first, step },
            derivatives,
            order: if options.noise { &mut all.order[elements.clone()] } else { &mut [] },
            status: if options.noise { &mut all.status[elements] } else { &mut [] },
            sigma: if options.noise { sigma } else { &mut [] },
        };
        plan.run(some, estimates, ends, workers, &mut |_, _| true).expect("records are long enough");
    }
    all
}

struct Problem {
    columns: Vec<Vec<f64>>,
    regressors: usize,
    window: usize,
}

fn solve(problem: &Problem, cuts: &[usize], instructions: Instructions) -> Columns {
    let (p, n) = (problem.regressors, problem.columns[0].len());
    let q = problem.columns.len() - p;
    let pairs: Vec<(usize, usize)> = (1..p).map(|i| (0, i)).collect();
    let kinds = kinds_of_regression(p, q);
    let plan = RollingLeastSquares::new(problem.window, p, q, pairs, HALF_OF_THE_DIGITS, instructions).expect("valid");
    let columns: Vec<&[f64]> = problem.columns.iter().map(Vec::as_slice).collect();
    let equations = Equations {
        columns: columns.iter().map(|column| column as &dyn Samples).collect(),
        rows: 0..n,
        ..Equations::default()
    };
    let mut all = Columns::new(kinds.iter().sum(), n);
    let mut scratch = plan.scratch();
    for rows in pieces(cuts, n) {
        let numbers = slices(&mut all.numbers, rows.clone());
        let elements = Elements { first: rows.start, step: 1 };
        let mut regressions = regressions(kinds, numbers, &mut all.status[rows.clone()], elements);
        plan.solve(&equations, rows, &mut regressions, &mut scratch);
    }
    all
}

/// Two waves and noise, with some bad samples.
fn record(seed: u64, n: usize, bad: &[(usize, f64)]) -> Vec<f64> {
    let mut noise = uniform_apart(seed);
    let mut samples: Vec<f64> =
        (0..n).map(|i| (i as f64 * 0.05).sin() + 0.5 * (i as f64 * 0.17).cos() + 0.01 * noise()).collect();
    for (place, value) in bad {
        samples[place % n] = *value;
    }
    samples
}

fn bad_samples() -> impl Strategy<Value = Vec<(usize, f64)>> {
    let values = prop::sample::select(vec![f64::NAN, f64::INFINITY, 1e300, 1e8, -1e8, 0.0]);
    prop::collection::vec((any::<usize>(), values), 0..4)
}

fn orders() -> impl Strategy<Value = Order> {
    let criteria = prop::sample::select(vec![Criterion::Aicc, Criterion::AiccTextbook, Criterion::Aic, Criterion::Bic]);
    prop_oneof![
        (0_usize..=15).prop_map(Order::Fixed),
        (criteria, 0_usize..=15).prop_map(|(criterion, highest)| Order::Chosen { criterion, highest }),
    ]
}

fn paths() -> impl Strategy<Value = Instructions> {
    prop::sample::select(Instructions::available())
}

/// Window lengths: mostly short, sometimes longer than a span or a segment of suffixes.
fn lengths() -> impl Strategy<Value = usize> {
    prop_oneof![6 => 5_usize..80, 2 => 80_usize..400, 1 => 400_usize..3000]
}

fn options(
    length: usize,
    order: Order,
    derivatives: Vec<usize>,
    noise: bool,
    instructions: Instructions,
) -> PolynomialOptions {
    let order = match order {
        Order::Fixed(order) => Order::Fixed(order.min(length - 1)),
        chosen @ Order::Chosen { .. } => chosen,
    };
    let noise = noise || matches!(order, Order::Chosen { .. });
    let selection = Selection::Window;
    PolynomialOptions {
        window_length: length,
        order,
        selection,
        derivatives,
        delta: 1e-3,
        noise,
        quantisation: 0.0,
        instructions,
    }
}

fn cuts() -> impl Strategy<Value = Vec<usize>> {
    prop::collection::vec(any::<usize>(), 1..6)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn of_local_polynomials(
        (seed, length, more) in (any::<u64>(), lengths(), 0_usize..3000),
        (order, derivatives) in (orders(), prop::collection::vec(0_usize..4, 1..4)),
        (noise, step) in (any::<bool>(), prop_oneof![3 => 1_usize..5, 1 => 5_usize..500]),
        (bad, cuts, path) in (bad_samples(), cuts(), paths()),
    ) {
        let record = record(seed, length + more, &bad);
        let options = options(length, order, derivatives, noise, path);
        let (whole, cut) = (estimate(&options, &record, &[], step), estimate(&options, &record, &cuts, step));
        prop_assert!(whole.bits() == cut.bits());
    }

    #[test]
    fn of_local_polynomials_among_threads(
        (seed, length, more) in (any::<u64>(), lengths(), 30_000_usize..60_000),
        (order, noise, workers) in (orders(), any::<bool>(), 1_usize..6),
        (bad, path) in (bad_samples(), paths()),
    ) {
        let record = record(seed, length + more, &bad);
        let options = options(length, order, vec![0, 2], noise, path);
        let (whole, cut) = (estimate(&options, &record, &[], 1), estimate_in_parallel(&options, &record, workers));
        prop_assert!(whole.bits() == cut.bits());
    }

    #[test]
    fn of_records_side_by_side(
        (seed, length, more, count) in (any::<u64>(), lengths(), 0_usize..600, 1_usize..20),
        (order, derivatives) in (orders(), prop::collection::vec(0_usize..4, 1..4)),
        (noise, ends, workers) in (any::<bool>(), any::<bool>(), 1_usize..3),
        (step, bad, path) in (prop_oneof![3 => Just(1_usize), 1 => 2_usize..20], bad_samples(), paths()),
    ) {
        // Bad samples in some of them.
        let bad = |number: usize| &bad[..bad.len().min(number % 5)];
        let records: Vec<Vec<f64>> =
            (0..count).map(|number| record(seed ^ number as u64, length + more, bad(number))).collect();
        let options = options(length, order, derivatives, noise, path);
        let [together, alone] =
            [true, false].map(|together| estimate_records(&options, &records, (ends, step, workers), together));
        prop_assert!(together.bits() == alone.bits());
    }

    #[test]
    fn of_least_squares(
        (seed, length, more) in (any::<u64>(), lengths(), 0_usize..3000),
        (p, q) in (1_usize..=6, 1_usize..=2),
        (bad, cuts, path) in (bad_samples(), cuts(), paths()),
    ) {
        let (window, n) = (length + p, length + p + more);
        let columns = (0..p + q).map(|j| record(seed ^ j as u64, n, &bad[..bad.len().min(j)])).collect();
        let problem = Problem { columns, regressors: p, window };
        prop_assert!(solve(&problem, &[], path).bits() == solve(&problem, &cuts, path).bits());
    }
}
