//! Whether constants that an instrument finds stay the same: parts of the record, each solved on its own, are compared, and cosines over the record.

use crate::identify::instrumented::two_stage_rows::{TwoStageRows, WEAK_INSTRUMENT};
use crate::identify::instrumented::waves;
use crate::inference::constancy::{Test, compare};
use crate::regression::tapered_sums::TAPERS;
use crate::regression::two_stage::TwoStage;

/// Parts that a record is cut into, one number after the other: few tell best what drifts, many what comes and goes.
const PARTS: [usize; 4] = [2, 4, 8, 16];

/// Tapers of a part at least. Those of shorter parts have a wider band, and the noise of the equations is no longer the same within it: it is
/// least at the resonance.
const FEWEST_TAPERS: usize = 8;

/// Rows of a part at least, in units of those over which neighbours are correlated: errors of fewer are not known.
const REACHES: usize = 16;

/// The least likely comparison of each unknown, with a probability that knows how many were made; `None` where parts know too little.
pub(crate) fn tests(columns: &TwoStageRows, reach: usize) -> Vec<Option<Test>> {
    let mut found: Vec<Vec<Test>> = vec![Vec::new(); columns.unknowns()];
    let mut made = 0;
    for parts in PARTS {
        if columns.len() / parts < REACHES * reach.max(1) {
            break;
        }
        let tapers = (TAPERS / parts).max(FEWEST_TAPERS);
        let border = |part: usize| part * columns.len() / parts;
        let solved = (0..parts).filter_map(|part| columns.solve(border(part)..border(part + 1), (reach, tapers)));
        let known: Vec<_> = solved.filter(|part| part.strength >= WEAK_INSTRUMENT).collect();
        // Parts in which little is known say little of all: half of them have to know something.
        if 2 * known.len() < parts || known.len() < 2 {
            break;
        }
        made += 1;
        for (one, found) in found.iter_mut().enumerate() {
            let of = |part: &TwoStage| (part.values[one], part.covariance[one * (columns.unknowns() + 1)]);
            found.extend(compare(&as_normal(&known.iter().map(of).collect::<Vec<_>>(), known[0].contrast.2)));
        }
    }
    let least: Vec<Option<Test>> = found.into_iter().map(|found| Test::least_likely(found, made)).collect();
    // What cannot be halved is too short for a curve, too.
    if columns.len() / PARTS[0] < REACHES * reach.max(1) {
        return least;
    }
    let both = least.into_iter().zip(waves::tests(columns, reach));
    both.map(|(parts, waves)| Test::least_likely(parts.into_iter().chain(waves), 2)).collect()
}

/// Estimates whose differences are as likely beside normal errors as they are beside those that are estimated with so many degrees of freedom,
/// which Student's distribution describes (Wallace 1959).
fn as_normal(parts: &[(f64, f64)], freedom: f64) -> Vec<(f64, f64)> {
    // Variances are those of Student's distribution: larger than the squares that it scales.
    let square = |variance: f64| variance * (freedom - 2.0).max(1.0) / freedom;
    let total: f64 = parts.iter().map(|(_, variance)| 1.0 / variance).sum();
    let mean = parts.iter().map(|(value, variance)| value / variance).sum::<f64>() / total;
    let nearer = (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
    let normal = |&(value, variance): &(f64, f64)| {
        let squares = (value - mean).powi(2) / square(variance);
        let deviation = nearer * (freedom * (squares / freedom).ln_1p()).sqrt();
        (mean + (deviation * square(variance).sqrt()).copysign(value - mean), square(variance))
    };
    parts.iter().map(normal).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of Student's distribution of 29 degrees of freedom and normal ones, of the same probability (from tables).
    #[test]
    fn students_quantiles_become_normal_ones() {
        let freedom = 29.0;
        for (student, normal) in [(2.045, 1.960), (2.756, 2.576), (3.659, 3.291)] {
            let variance = freedom / (freedom - 2.0);
            let [(low, square), (high, _)] = as_normal(&[(-student, variance), (student, variance)], freedom)[..]
            else {
                panic!("two parts");
            };
            assert!((square - 1.0).abs() < 1e-12, "{square}");
            assert!((high - normal).abs() < 2e-3 && (low + normal).abs() < 2e-3, "{low} {high}");
        }
    }
}
