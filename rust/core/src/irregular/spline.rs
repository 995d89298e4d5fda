//! A spline of odd order through samples at any increasing times.
//!
//! A sum of B-splines `Σ c_j B_j(t)` of order `k` (degree, odd) whose knots are the samples' own times, without the `(k-1)/2` times next to each end
//! (*not a knot*), passes through every sample where `B c = y`, `B_ij = B_j(t_i)`. The matrix has at most `2k-1` diagonals and is totally positive, so
//! elimination without exchanging rows is stable (de Boor and Pinkus 1977).

/// The highest order, and one number more than it.
pub(crate) const HIGHEST_ORDER: usize = 7;
const MOST: usize = HIGHEST_ORDER + 1;

/// The factors of the equations of a spline through samples at some times.
pub(crate) struct Spline<'a> {
    times: &'a [f64],
    order: usize,
    knots: Vec<f64>,
    /// Row by row the `2k - 1` diagonals: on the left of the diagonal the multipliers of elimination.
    band: Vec<f64>,
}

impl<'a> Spline<'a> {
    /// The spline of the highest order up to `order` that so many times allow. Times must increase, and there must be one at least.
    pub(crate) fn new(times: &'a [f64], order: usize) -> Self {
        let order = match times.len() {
            1 => 0,
            few if few <= order => (few - 2) / 2 * 2 + 1,
            _ => order,
        };
        let (first, last) = (times[0], times[times.len() - 1]);
        let mut knots = vec![first; order + 1];
        if times.len() > order + 1 {
            knots.extend_from_slice(&times[order.div_ceil(2)..times.len() - order.div_ceil(2)]);
        }
        knots.extend(vec![last; order + 1]);
        let mut spline = Self { times, order, knots, band: Vec::new() };
        match order {
            7 => spline.factor::<7>(),
            5 => spline.factor::<5>(),
            3 => spline.factor::<3>(),
            _ => {}
        }
        spline
    }

    /// Diagonals on each side.
    fn reach(&self) -> usize {
        self.order - 1
    }

    /// Factors the equations of a spline of a known order, so that its loops have a known length.
    fn factor<const ORDER: usize>(&mut self) {
        let (reach, count) = (ORDER - 1, self.times.len());
        let width = 2 * reach + 1;
        self.band = vec![0.0; count * width];
        let mut left = ORDER;
        for (row, &time) in self.times.iter().enumerate() {
            left = self.interval(time, left);
            for (place, value) in self.basis::<ORDER>(left, time)[..=ORDER].iter().enumerate() {
                let column = left - ORDER + place;
                // What falls outside of the band is zero: a B-spline at its end.
                if column + reach >= row && column <= row + reach {
                    self.band[row * width + column + reach - row] = *value;
                }
            }
        }
        for pivot in 0..count {
            let (above, below) = self.band.split_at_mut((pivot + 1) * width);
            let pivots = &above[pivot * width + reach..][..=reach];
            for (step, row) in below.chunks_exact_mut(width).take(reach).enumerate() {
                let place = reach - step - 1;
                let factor = row[place] / pivots[0];
                row[place] = factor;
                if factor != 0.0 {
                    for (value, above) in row[place + 1..][..reach].iter_mut().zip(&pivots[1..]) {
                        *value -= factor * above;
                    }
                }
            }
        }
    }

    /// The coefficients of the spline through some values.
    pub(crate) fn coefficients(&self, values: &[f64]) -> Vec<f64> {
        let mut solved = values.to_vec();
        if self.order <= 1 {
            return solved;
        }
        let (reach, count) = (self.reach(), solved.len());
        let width = 2 * reach + 1;
        for row in 1..count {
            let from = row.saturating_sub(reach);
            let factors = &self.band[row * width + reach + from - row..row * width + reach];
            let sum: f64 = factors.iter().zip(&solved[from..row]).map(|(a, b)| a * b).sum();
            solved[row] -= sum;
        }
        for row in (0..count).rev() {
            let to = count.min(row + reach + 1);
            let factors = &self.band[row * width + reach..row * width + reach + to - row];
            let sum: f64 = factors[1..].iter().zip(&solved[row + 1..to]).map(|(a, b)| a * b).sum();
            solved[row] = (solved[row] - sum) / factors[0];
        }
        solved
    }

    /// By how much each sample counts in the integral of the spline.
    pub(crate) fn weights(&self) -> Vec<f64> {
        // The integral is `gᵀ c` with `g_j = ∫ B_j`, so the weights solve `Bᵀ w = g`.
        let (order, count) = (self.order, self.times.len());
        let integral = |place: usize| (self.knots[place + order + 1] - self.knots[place]) / (order + 1) as f64;
        let mut solved: Vec<f64> = (0..count).map(integral).collect();
        if order <= 1 {
            return solved;
        }
        let reach = self.reach();
        let width = 2 * reach + 1;
        for row in 0..count {
            let factors = &self.band[row * width + reach..(row + 1) * width];
            solved[row] /= factors[0];
            let value = solved[row];
            solved[row + 1..].iter_mut().zip(&factors[1..]).for_each(|(later, factor)| *later -= factor * value);
        }
        for row in (1..count).rev() {
            let from = row.saturating_sub(reach);
            let factors = &self.band[row * width + reach + from - row..row * width + reach];
            let value = solved[row];
            solved[from..row].iter_mut().zip(factors).for_each(|(earlier, factor)| *earlier -= factor * value);
        }
        solved
    }

    /// Values at increasing times within the samples', of splines of which coefficients are given: one after the other for each time.
    pub(crate) fn values(
        &self,
        coefficients: &[Vec<f64>],
        at: impl Iterator<Item = f64>,
        take: impl FnMut(usize, usize, f64),
    ) {
        match self.order {
            7 => self.values_of::<7>(coefficients, at, take),
            5 => self.values_of::<5>(coefficients, at, take),
            3 => self.values_of::<3>(coefficients, at, take),
            1 => self.values_of::<1>(coefficients, at, take),
            _ => self.values_of::<0>(coefficients, at, take),
        }
    }

    /// The same of a known order.
    fn values_of<const ORDER: usize>(
        &self,
        coefficients: &[Vec<f64>],
        at: impl Iterator<Item = f64>,
        mut take: impl FnMut(usize, usize, f64),
    ) {
        let mut left = ORDER;
        for (place, time) in at.enumerate() {
            left = self.interval(time, left);
            let basis = self.basis::<ORDER>(left, time);
            for (channel, coefficients) in coefficients.iter().enumerate() {
                let near = &coefficients[left - ORDER..=left];
                take(channel, place, near.iter().zip(&basis[..=ORDER]).map(|(a, b)| a * b).sum());
            }
        }
    }

    /// The knot on the left of a time, from an earlier one on.
    fn interval(&self, time: f64, mut left: usize) -> usize {
        while left + 1 < self.times.len() && time >= self.knots[left + 1] {
            left += 1;
        }
        left
    }

    /// The B-splines that are not zero right of a knot.
    fn basis<const ORDER: usize>(&self, left: usize, time: f64) -> [f64; MOST] {
        let mut basis = [0.0; MOST];
        basis[0] = 1.0;
        let near = &self.knots[left + 1 - ORDER..][..2 * ORDER];
        for order in 1..=ORDER {
            let mut saved = 0.0;
            for (place, value) in basis[..order].iter_mut().enumerate() {
                let (before, after) = (near[ORDER + place - order], near[ORDER + place]);
                let share = *value / (after - before);
                *value = saved + (after - time) * share;
                saved = (time - before) * share;
            }
            basis[order] = saved;
        }
        basis
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times with steps between a third and five thirds.
    fn times(count: i32) -> Vec<f64> {
        (0..count).map(|place| f64::from(place) + 0.33 * (1.7 * f64::from(place)).sin()).collect()
    }

    fn through(times: &[f64], order: usize, function: impl Fn(f64) -> f64, at: &[f64]) -> Vec<f64> {
        let spline = Spline::new(times, order);
        let values: Vec<f64> = times.iter().map(|&time| function(time)).collect();
        let mut found = Vec::new();
        spline.values(&[spline.coefficients(&values)], at.iter().copied(), |_, _, value| found.push(value));
        found
    }

    #[test]
    fn a_polynomial_of_the_order_is_its_own_spline() {
        let times = times(40);
        let at: Vec<f64> = (1..380).map(|place| f64::from(place) / 10.0).collect();
        for order in [1, 3, 5, 7] {
            let power = i32::try_from(order).unwrap();
            let polynomial = |time: f64| (time / 20.0 - 1.0).powi(power) + 0.5 * time;
            for (found, time) in through(&times, order, polynomial, &at).iter().zip(&at) {
                assert!((found - polynomial(*time)).abs() < 1e-12, "order {order} at {time}: {found}");
            }
        }
    }

    #[test]
    fn few_samples_lower_the_order_and_a_spline_passes_through_all() {
        for count in 1..12 {
            let times = times(count);
            for order in [1, 3, 5, 7] {
                let wave = |time: f64| (0.7 * time).cos();
                for (found, time) in through(&times, order, wave, &times).iter().zip(&times) {
                    assert!((found - wave(*time)).abs() < 1e-13, "order {order} of {count} samples: {found}");
                }
            }
        }
    }

    #[test]
    fn weights_give_the_integral_of_a_polynomial() {
        let times = times(30);
        let length = times[29] - times[0];
        for order in [1, 3, 5, 7] {
            let power = i32::try_from(order).unwrap();
            let sum: f64 = Spline::new(&times, order)
                .weights()
                .iter()
                .zip(&times)
                .map(|(weight, time)| weight * ((time - times[0]) / length).powi(power))
                .sum();
            let expected = length / f64::from(power + 1);
            assert!((sum / expected - 1.0).abs() < 1e-12, "order {order}: {sum} {expected}");
        }
    }
}
