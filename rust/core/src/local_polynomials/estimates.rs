//! The outputs of local polynomials.

use std::ops::Range;

use crate::lanes::output::{Elements, split_off};
use crate::status::Status;

/// Where estimates are written, of one record or of several end to end. An empty slice stands for what is not wanted.
#[derive(Debug)]
pub struct Estimates<'a> {
    /// Which samples the elements of every slice belong to, counted anew in every record.
    pub elements: Elements,
    /// One slice a derivative, in the order in which [`crate::local_polynomials::PolynomialOptions::derivatives`] names them.
    pub derivatives: Vec<&'a mut [f64]>,
    /// Order chosen. Near the ends of a record each derivative may take a lower one.
    pub order: &'a mut [u8],
    /// Bits of [`crate::Status`].
    pub status: &'a mut [u16],
    /// Standard deviation of the noise.
    pub sigma: &'a mut [f64],
}

impl Estimates<'_> {
    /// Writes the order, flags and noise of a window.
    pub(crate) fn diagnose(&mut self, element: usize, order: usize, status: Status, sigma: f64) {
        put(self.order, element, u8::try_from(order).unwrap_or(u8::MAX));
        put(self.status, element, status.bits());
        put(self.sigma, element, sigma);
    }

    /// Makes an element NaN.
    pub(crate) fn invalidate(&mut self, element: usize) {
        self.derivatives.iter_mut().for_each(|derivative| derivative[element] = f64::NAN);
        self.diagnose(element, 0, Status::INVALID, f64::NAN);
    }

    /// Makes an element NaN around which no full window lies.
    pub(crate) fn nothing(&mut self, element: usize) {
        self.invalidate(element);
        self.diagnose(element, 0, Status::EDGE | Status::INVALID, f64::NAN);
    }

    /// Cuts off what belongs to the samples of one record before `sample`.
    pub(crate) fn split_off_before(&mut self, sample: usize) -> Self {
        let count = self.elements.of(0..sample).len();
        let front = self.split_off(count);
        self.elements = self.elements.from(count);
        front
    }

    /// Cuts off so many elements: those of whole records.
    pub(crate) fn split_off(&mut self, count: usize) -> Self {
        Estimates {
            elements: self.elements,
            derivatives: self.derivatives.iter_mut().map(|values| split_off(values, count)).collect(),
            order: split_off(&mut self.order, count),
            status: split_off(&mut self.status, count),
            sigma: split_off(&mut self.sigma, count),
        }
    }

    /// Some elements: those of one of several records.
    pub(crate) fn part(&mut self, elements: Range<usize>) -> Estimates<'_> {
        fn part<'a, T>(values: &'a mut [T], elements: &Range<usize>) -> &'a mut [T] {
            values.get_mut(elements.clone()).unwrap_or_default()
        }
        Estimates {
            elements: self.elements,
            derivatives: self.derivatives.iter_mut().map(|values| part(values, &elements)).collect(),
            order: part(self.order, &elements),
            status: part(self.status, &elements),
            sigma: part(self.sigma, &elements),
        }
    }
}

/// Writes a value that may not be wanted.
fn put<T>(values: &mut [T], element: usize, value: T) {
    if let Some(place) = values.get_mut(element) {
        *place = value;
    }
}
