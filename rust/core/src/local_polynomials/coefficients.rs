//! The coefficients of every window, for selections of the order that look at more than one window.

use std::ops::Range;

use crate::lanes::output::Elements;
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::engine::{self, Walk, engine};
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::evaluate::Finish;
use crate::local_polynomials::mirrored_kernels::{LONGEST, MirroredKernel, MirroredKernels, MirroredScratch};
use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;

/// Plan of a walk that gives coefficients.
#[derive(Debug)]
pub(crate) struct Coefficients {
    engine: Box<dyn Walk>,
    /// The same for windows by themselves, where they are short and no residual is followed.
    mirrored: Option<MirroredKernels>,
    /// Degrees of the basis less one: the order whose residual is followed.
    top: usize,
    length: usize,
    wanted: usize,
    residual: bool,
}

/// Memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct CoefficientScratch {
    /// Made when windows are stepped through first.
    engine: Option<engine::EngineScratch>,
    pub(crate) mirrored: MirroredScratch,
}

impl CoefficientScratch {
    /// Makes ready for windows of another plan.
    pub(crate) fn forget_plan(&mut self) {
        self.engine = None;
    }
}

/// The results of some windows, one row per number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Projected {
    /// The reference that was subtracted from the samples; NaN if the window holds an unusable value.
    pub(crate) level: Vec<f64>,
    /// The coefficients wanted, by degree.
    pub(crate) coefficients: Vec<Vec<f64>>,
    /// Residual sum of squares of the highest order; empty where it is not followed.
    pub(crate) residual: Vec<f64>,
}

impl Coefficients {
    /// Gives the coefficients of the degrees wanted of a basis, and the residual of its highest order.
    pub(crate) fn new(basis: &Basis, wanted: &[usize], residual: bool, instructions: Instructions) -> Self {
        let top = basis.degrees() - 1;
        let options = PolynomialOptions {
            window_length: basis.length(),
            order: Order::Fixed(top.min(crate::simd::vectors::TABLE - 1)),
            selection: Selection::Window,
            derivatives: Vec::new(),
            delta: 1.0,
            noise: residual,
            quantisation: 0.0,
            instructions,
        };
        let finish = Finish::new(&options, basis).bare(wanted);
        let engine = engine(basis, finish, residual, instructions, &mut |_, _| true).expect("nobody cancels");
        let length = basis.length();
        let short = !residual && length % 2 == 1 && length / 2 <= LONGEST;
        let kernel = |&degree: &usize| MirroredKernel {
            odd: degree % 2 == 1,
            constant: 0.0,
            outwards: basis.rows().skip(1).map(|row| row[degree]).collect(),
        };
        let kernels = || wanted.iter().map(kernel).collect::<Vec<_>>();
        let mirrored = short.then(|| MirroredKernels::new(length / 2, &kernels(), instructions));
        Self { engine, mirrored, top, length, wanted: wanted.len(), residual }
    }

    /// Windows that are worked on together.
    pub(crate) fn run(&self) -> usize {
        self.engine.stride(1)
    }

    /// Projects windows, known by their first samples: all of them, or every `step`-th from the first on.
    pub(crate) fn project(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        step: usize,
        projected: &mut Projected,
        scratch: &mut CoefficientScratch,
    ) {
        let count = windows.len().div_ceil(step);
        let Projected { level, coefficients, residual } = projected;
        coefficients.resize_with(self.wanted, Vec::new);
        level.resize(count, 0.0);
        for row in coefficients.iter_mut() {
            row.resize(count, 0.0);
        }
        residual.resize(if self.residual { count } else { 0 }, 0.0);
        if count == 0 {
            return;
        }
        if let Some(mirrored) = self.mirrored.as_ref().filter(|mirrored| mirrored.serve(step, self.top + 1)) {
            let mut rows: Vec<&mut [f64]> = coefficients.iter_mut().map(Vec::as_mut_slice).collect();
            mirrored.apply(record, windows, step, (level, &mut rows), &mut scratch.mirrored);
            return;
        }
        let mut fields: Vec<&mut [f64]> = vec![level];
        fields.extend(coefficients.iter_mut().map(Vec::as_mut_slice));
        let mut estimates = Estimates {
            elements: Elements { first: windows.start + (self.length - 1) / 2, step },
            derivatives: fields,
            order: &mut [],
            status: &mut [],
            sigma: residual,
        };
        let scratch = scratch.engine.get_or_insert_with(|| self.engine.scratch());
        self.engine.walk(record, windows, &mut estimates, scratch);
        // What the engine gives is the noise.
        let freedom = (self.length - self.top - 1) as f64;
        for value in residual {
            *value = *value * *value * freedom;
        }
    }
}
