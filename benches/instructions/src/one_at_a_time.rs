//! What one sample costs that comes alone: the mean over some thousand, and what one in a hundred takes at least.

use std::sync::Arc;
use std::time::Instant;

use tvident::Error;
use tvident::lanes::Elements;
use tvident::least_squares::{HALF_OF_THE_DIGITS, Regressions, RollingLeastSquares};
use tvident::local_polynomials::Estimates;
use tvident::record::Samples;
use tvident::simd::Instructions;
use tvident::stream::{
    NextSamples, Parameters, PolynomialStream, RollingStream, StreamedMotion, StreamedSamples, WindowedState,
    WindowedStream,
};

use crate::workloads::{Repeated, choice_of_201};

/// Samples before the first that is timed: windows are full then.
const BEFORE: usize = 1000;

/// Samples that are timed together. Many are: what most of them put off is done for half a window at once.
const BLOCK: usize = 5000;

/// Samples that are timed.
const TIMED: usize = 12 * BLOCK;

/// Samples that are given at once at most: no more than a window, where the first is full.
const ROOM: usize = 201;

/// The bar, nanoseconds on average.
const MOST: f64 = 3000.0;

/// What the samples of one kind of stream took.
struct Taken {
    name: &'static str,
    /// Of the fastest block: other work of the machine makes none faster.
    mean: f64,
    /// One in a hundred takes longer.
    p99: f64,
}

/// Times one stream of every kind, says what was found, and returns whether all are below the bar.
pub(crate) fn measure() -> Result<bool, Error> {
    let taken = [parameters()?, polynomials()?, regressions()?];
    for Taken { name, mean, p99 } in &taken {
        println!("{name:34}{mean:8.0} ns on average, p99 {p99:8.0} ns, at most {MOST} ns on average");
    }
    Ok(taken.iter().all(|taken| taken.mean <= MOST))
}

/// Times single calls with the numbers of samples that follow one another.
fn timed(name: &'static str, mut call: impl FnMut(usize)) -> Taken {
    (0..BEFORE).for_each(&mut call);
    let mut each: Vec<f64> = Vec::with_capacity(TIMED);
    for sample in BEFORE..BEFORE + TIMED {
        let begin = Instant::now();
        call(sample);
        each.push(begin.elapsed().as_secs_f64() * 1e9);
    }
    let means = each.chunks_exact(BLOCK).map(|block| block.iter().sum::<f64>() / BLOCK as f64);
    let mean = means.fold(f64::INFINITY, f64::min);
    each.sort_by(f64::total_cmp);
    Taken { name, mean, p99: each[TIMED - TIMED / 100] }
}

/// A channel, sample by sample.
fn channel(number: u32) -> Vec<f64> {
    let mut samples = vec![0.0; BEFORE + TIMED];
    Repeated::new(number, samples.len()).read(0, &mut samples);
    samples
}

/// Inertia, damping and stiffness by the paper's method.
fn parameters() -> Result<Taken, Error> {
    let derivatives = Arc::new(choice_of_201(false)?);
    let asked = (StreamedMotion::default(), StreamedSamples::default());
    let mut stream = WindowedStream::resume(derivatives, 200, asked, 1, None, WindowedState::default())?;
    let (angle, torque) = (channel(0), channel(1));
    let mut numbers = [[0.0; ROOM]; 9];
    let (mut status, mut order) = ([0; ROOM], [0; ROOM]);
    Ok(timed("parameters (window 201, 200 rows)", |sample| {
        let ready = stream.upcoming(1);
        let [i, c, k, of_i, of_c, of_k, residuals, deviations, condition] = &mut numbers;
        let regressions = Regressions {
            elements: Elements { first: ready.start, step: 1 },
            parameters: vec![&mut i[..ready.len()], &mut c[..ready.len()], &mut k[..ready.len()]],
            errors: vec![&mut of_i[..ready.len()], &mut of_c[..ready.len()], &mut of_k[..ready.len()]],
            residuals: vec![&mut residuals[..ready.len()]],
            deviations: vec![&mut deviations[..ready.len()]],
            condition: &mut condition[..ready.len()],
            status: &mut status[..ready.len()],
            ..Regressions::default()
        };
        let next = sample..=sample;
        let channels = NextSamples { angle: &angle[next.clone()], torque: &torque[next], weights: None };
        stream.push(channels, &mut Parameters { regressions, order: &mut order[..ready.len()] });
    }))
}

/// Value and two derivatives with the order chosen.
fn polynomials() -> Result<Taken, Error> {
    let plan = Arc::new(choice_of_201(true)?);
    let mut stream = PolynomialStream::new(plan, 1, false)?;
    let y = channel(0);
    let mut numbers = [[0.0; ROOM]; 4];
    let (mut status, mut order) = ([0; ROOM], [0; ROOM]);
    Ok(timed("local polynomials (window 201)", |sample| {
        let ready = stream.upcoming(1);
        let [value, first, second, sigma] = &mut numbers;
        let mut estimates = Estimates {
            elements: Elements { first: ready.start, step: 1 },
            derivatives: [value, first, second].into_iter().map(|one| &mut one[..ready.len()]).collect(),
            order: &mut order[..ready.len()],
            status: &mut status[..ready.len()],
            sigma: &mut sigma[..ready.len()],
        };
        stream.push(&&y[sample..=sample], &mut estimates, &mut []);
    }))
}

/// Three regressors in windows of 201 rows.
fn regressions() -> Result<Taken, Error> {
    let plan = RollingLeastSquares::new(201, 3, 1, Vec::new(), HALF_OF_THE_DIGITS, Instructions::current())?;
    let mut stream = RollingStream::new(plan, 1)?;
    let columns: Vec<Vec<f64>> = (0..4).map(channel).collect();
    let mut numbers = [[0.0; ROOM]; 8];
    let mut status = [0; ROOM];
    Ok(timed("rolling regression (201 rows, three)", |sample| {
        let ready = stream.upcoming(1);
        let (parameters, rest) = numbers.split_at_mut(3);
        let (errors, rest) = rest.split_at_mut(3);
        let [residuals, condition] = rest else { return };
        let mut regressions = Regressions {
            elements: Elements { first: ready.start, step: 1 },
            parameters: parameters.iter_mut().map(|one| &mut one[..ready.len()]).collect(),
            errors: errors.iter_mut().map(|one| &mut one[..ready.len()]).collect(),
            residuals: vec![&mut residuals[..ready.len()]],
            condition: &mut condition[..ready.len()],
            status: &mut status[..ready.len()],
            ..Regressions::default()
        };
        let row: Vec<&[f64]> = columns.iter().map(|column| &column[sample..=sample]).collect();
        let row: Vec<&dyn Samples> = row.iter().map(|column| column as &dyn Samples).collect();
        stream.push(&row, &mut regressions);
    }))
}
