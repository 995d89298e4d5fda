//! What tests have written by the core: columns of numbers, orders and flags, compared bit for bit.

use tvident::lanes::Elements;
use tvident::least_squares::Regressions;

/// Columns of numbers, orders and flags, element for element.
#[derive(Clone, Debug)]
pub(crate) struct Columns {
    pub(crate) numbers: Vec<Vec<f64>>,
    pub(crate) order: Vec<u8>,
    pub(crate) status: Vec<u16>,
}

impl Columns {
    pub(crate) fn new(kinds: usize, count: usize) -> Self {
        Self { numbers: vec![vec![0.0; count]; kinds], order: vec![0; count], status: vec![0; count] }
    }

    /// Every bit, so that NaN equals itself.
    pub(crate) fn bits(&self) -> (Vec<Vec<u64>>, &[u8], &[u16]) {
        let bits = |values: &Vec<f64>| values.iter().map(|value| value.to_bits()).collect();
        (self.numbers.iter().map(bits).collect(), &self.order, &self.status)
    }
}

/// How many columns a regression of `q` responses on `p` regressors has of each kind: parameters, errors, covariances of the first
/// parameter with the others, residuals, deviations, condition.
pub(crate) fn kinds_of_regression(p: usize, q: usize) -> [usize; 6] {
    [p * q, p * q, (p - 1) * q, q, q, 1]
}

/// Regressions that are written to columns of these kinds.
pub(crate) fn regressions<'a>(
    kinds: [usize; 6],
    numbers: Vec<&'a mut [f64]>,
    status: &'a mut [u16],
    elements: Elements,
) -> Regressions<'a> {
    let mut numbers = numbers.into_iter();
    let [parameters, errors, covariances, residuals, deviations, mut condition] =
        kinds.map(|count| numbers.by_ref().take(count).collect::<Vec<_>>());
    Regressions {
        elements,
        parameters,
        errors,
        covariances,
        residuals,
        deviations,
        condition: condition.pop().expect("there is one"),
        status,
        ..Regressions::default()
    }
}
