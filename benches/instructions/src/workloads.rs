//! What is counted: the works of the table in `benches/README.md`, from the core's side.

use std::num::NonZeroUsize;

use tvident::Error;
use tvident::equation::{Coefficient, Measured, Motion};
use tvident::identify::{Kind, Method, Options, StrongForm, Task, identify_all};
use tvident::lanes::Elements;
use tvident::least_squares::HALF_OF_THE_DIGITS;
use tvident::least_squares::{Equations, Regressions, RollingLeastSquares};
use tvident::local_polynomials::{Criterion, Estimates, LocalPolynomials, Order, PolynomialOptions, Selection};
use tvident::record::Samples;
use tvident::simd::Instructions;

/// Runs on a record of one or two lengths and returns the number of windows.
pub(crate) type Workload = fn(usize) -> Result<usize, Error>;

/// Everything that is counted.
pub(crate) const ALL: [(&str, Workload); 7] = [
    ("choice-51", |lengths| polynomials(51, CHOICE, &[0, 1, 2], lengths)),
    ("choice-201", |lengths| polynomials(201, CHOICE, &[0, 1, 2], lengths)),
    ("choice-2001", |lengths| polynomials(2001, CHOICE, &[0, 1, 2], lengths)),
    ("filter-201", |lengths| polynomials(201, Order::Fixed(5), &[0], lengths)),
    ("filter-11", |lengths| polynomials(11, Order::Fixed(3), &[0], lengths)),
    ("least-squares", least_squares),
    ("identify", identify),
];

const CHOICE: Order = Order::Chosen { criterion: Criterion::Aicc, highest: 15 };

/// Windows of one length of a record, about.
const WINDOWS: usize = 1 << 15;

/// A stretch of samples that goes on and on.
pub(crate) struct Repeated {
    stretch: Vec<f64>,
    len: usize,
}

impl Repeated {
    /// Two waves and noise, different for every channel.
    pub(crate) fn new(channel: u32, len: usize) -> Self {
        let mut state = 0x9E37_79B9_u32.wrapping_mul(channel + 1);
        let mut noise = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            f64::from(state) / f64::from(u32::MAX) - 0.5
        };
        let turn = std::f64::consts::TAU / 4096.0;
        let wave = |k: f64| (7.0 * turn * k).sin() + 0.3 * (19.0 * turn * k + f64::from(channel)).cos();
        Self { stretch: (0..4096).map(|k| wave(f64::from(k)) + 1e-3 * noise()).collect(), len }
    }
}

impl Samples for Repeated {
    fn len(&self) -> usize {
        self.len
    }

    fn read(&self, first: usize, mut into: &mut [f64]) {
        let mut place = first % self.stretch.len();
        while !into.is_empty() {
            let count = into.len().min(self.stretch.len() - place);
            let (now, later) = into.split_at_mut(count);
            now.copy_from_slice(&self.stretch[place..place + count]);
            (into, place) = (later, 0);
        }
    }
}

fn polynomials(window_length: usize, order: Order, derivatives: &[usize], lengths: usize) -> Result<usize, Error> {
    let choice = matches!(order, Order::Chosen { .. });
    let plan = LocalPolynomials::new(PolynomialOptions {
        window_length,
        order,
        selection: Selection::Window,
        derivatives: derivatives.to_vec(),
        delta: 1e-3,
        noise: choice,
        quantisation: 0.0,
        instructions: Instructions::current(),
    })?;
    let windows = lengths * WINDOWS.next_multiple_of(plan.stride());
    let record = Repeated::new(0, windows + window_length - 1);
    let diagnostics = if choice { windows } else { 0 };
    let mut values = vec![vec![0.0; windows]; derivatives.len()];
    let (mut orders, mut status, mut sigma) = (vec![0; diagnostics], vec![0; diagnostics], vec![0.0; diagnostics]);
    let estimates = Estimates {
        elements: Elements { first: plan.before_centre(), step: 1 },
        derivatives: values.iter_mut().map(Vec::as_mut_slice).collect(),
        order: &mut orders,
        status: &mut status,
        sigma: &mut sigma,
    };
    plan.run(&[&record], estimates, false, NonZeroUsize::MIN, &mut |_, _| true)?;
    Ok(windows)
}

/// Where windows of least squares are written.
struct Solutions {
    parameters: Vec<Vec<f64>>,
    errors: Vec<Vec<f64>>,
    covariances: Vec<Vec<f64>>,
    residuals: Vec<f64>,
    condition: Vec<f64>,
    status: Vec<u16>,
}

impl Solutions {
    fn new(windows: usize, regressors: usize, covariances: usize) -> Self {
        Self {
            parameters: vec![vec![0.0; windows]; regressors],
            errors: vec![vec![0.0; windows]; regressors],
            covariances: vec![vec![0.0; windows]; covariances],
            residuals: vec![0.0; windows],
            condition: vec![0.0; windows],
            status: vec![0; windows],
        }
    }

    fn regressions(&mut self) -> Regressions<'_> {
        fn all(values: &mut [Vec<f64>]) -> Vec<&mut [f64]> {
            values.iter_mut().map(Vec::as_mut_slice).collect()
        }
        Regressions {
            elements: Elements { first: 0, step: 1 },
            parameters: all(&mut self.parameters),
            errors: all(&mut self.errors),
            covariances: all(&mut self.covariances),
            residuals: vec![&mut self.residuals],
            deviations: Vec::new(),
            condition: &mut self.condition,
            status: &mut self.status,
            ..Regressions::default()
        }
    }
}

fn least_squares(lengths: usize) -> Result<usize, Error> {
    let instructions = Instructions::current();
    let plan = RollingLeastSquares::new(201, 3, 1, Vec::new(), HALF_OF_THE_DIGITS, instructions)?;
    let windows = lengths * WINDOWS.next_multiple_of(plan.stride());
    let columns: Vec<Repeated> = (0..4).map(|channel| Repeated::new(channel, windows)).collect();
    let equations =
        Equations { columns: columns.iter().map(|one| one as &dyn Samples).collect(), weights: None, rows: 0..windows };
    let mut solutions = Solutions::new(windows, 3, 0);
    plan.run(&equations, solutions.regressions(), NonZeroUsize::MIN, &mut |_, _| true)?;
    Ok(windows)
}

/// Value and two derivatives in windows of 201 samples, with the order chosen, and the noise if it is wanted.
pub(crate) fn choice_of_201(noise: bool) -> Result<LocalPolynomials, Error> {
    LocalPolynomials::new(PolynomialOptions {
        window_length: 201,
        order: CHOICE,
        selection: Selection::Window,
        derivatives: vec![0, 1, 2],
        delta: 1e-3,
        noise,
        quantisation: 0.0,
        instructions: Instructions::current(),
    })
}

fn identify(lengths: usize) -> Result<usize, Error> {
    let instructions = Instructions::current();
    let derivatives = choice_of_201(true)?;
    let windows = lengths * WINDOWS.next_multiple_of(derivatives.stride());
    let (angle, torque) = (Repeated::new(0, windows), Repeated::new(1, windows));
    let motion = Motion {
        angle: &angle,
        measured: Measured::default(),
        torque: &torque,
        coefficients: [Coefficient::Unknown, Coefficient::Unknown, Coefficient::Unknown],
        terms: Vec::new(),
    };
    let method = Method::Strong(StrongForm {
        derivatives: &derivatives,
        regression_window: 200,
        filter_torque: false,
        linear: false,
    });
    let task = Task { motion, mask: None, weights: None, method, lag: Some(0.0), angle_zero: None };
    let options = Options {
        delta: 1e-3,
        kinds: vec![Kind::Windowed; 3],
        quantisation: None,
        propagate: false,
        step: 1,
        wanted: None,
        diagnose: false,
        instructions,
    };
    identify_all(&[task], &options, NonZeroUsize::MIN, &mut |_, _| true)?;
    Ok(windows)
}
