//! The motion that an instrument explains: the angle's regression on the instrument's past.
//!
//! It stands for the angle in the instruments of two-stage least squares. Any function of the instrument would do; the closer to the motion, the smaller are
//! the errors. Neither noise of the angle nor of the torque is in it, but for what the regression took of it: one part in the number of samples for each
//! of some 30 coefficients.

use crate::least_squares::stacked_qr::Summary;
use crate::record::samples::{Samples, is_usable};

/// Samples of the instrument's past that the angle is explained by.
const TAPS: usize = 32;

/// Samples that the regression is made of, and fewer to try how far apart the taps are.
const MOST: usize = 1 << 15;
const TRIED: usize = 1 << 12;

/// The past that taps span at most, as a part of the record.
const LONGEST: usize = 8;

/// What coefficients are held back by, of the instrument's mean square: an instrument of a few sines leaves most of them open.
const RIDGE: f64 = 1e-8;

/// The motion that an instrument explains: NaN where the instrument's past is not known, or `None` if it explains nothing.
pub(crate) fn explained(angle: &dyn Samples, instrument: &dyn Samples) -> Option<Vec<f64>> {
    let samples = angle.len();
    let (mut recorded, mut past) = (vec![0.0; samples], vec![0.0; samples]);
    angle.read(0, &mut recorded);
    instrument.read(0, &mut past);
    let mean = mean(&past)?;
    for value in &mut past {
        *value -= mean;
    }
    let mut best: Option<(f64, usize)> = None;
    for spacing in (0..usize::BITS).map(|power| 1 << power) {
        if TAPS * spacing > samples / LONGEST {
            break;
        }
        let Some((left, _)) = regression(&recorded, &past, spacing, TRIED) else { continue };
        if best.is_none_or(|(least, _)| left < least) {
            best = Some((left, spacing));
        }
    }
    let (_, spacing) = best?;
    let (_, coefficients) = regression(&recorded, &past, spacing, MOST)?;
    let reach = (TAPS - 1) * spacing;
    let mut motion = vec![f64::NAN; samples];
    for sample in reach..samples {
        let taps = coefficients[1..].iter().enumerate();
        motion[sample] = coefficients[0] + taps.map(|(tap, factor)| factor * past[sample - tap * spacing]).sum::<f64>();
    }
    Some(motion)
}

/// What is left of the angle's squares, and the coefficients: a constant, then one a tap.
fn regression(recorded: &[f64], past: &[f64], spacing: usize, most: usize) -> Option<(f64, Vec<f64>)> {
    let reach = (TAPS - 1) * spacing;
    let places = reach..recorded.len();
    let usable =
        |sample: &usize| is_usable(recorded[*sample]) && (0..TAPS).all(|tap| is_usable(past[sample - tap * spacing]));
    let rows: Vec<usize> = places.clone().step_by((places.len() / most).max(1)).filter(usable).collect();
    if rows.len() < 4 * TAPS {
        return None;
    }
    let power = rows.iter().map(|&row| past[row] * past[row]).sum::<f64>();
    let ridge = (RIDGE * power).sqrt();
    let columns = TAPS + 2;
    let entry = |row: usize, column: usize| match (rows.get(row), column) {
        (Some(_), 0) => 1.0,
        (Some(&sample), tap) if tap <= TAPS => past[sample - (tap - 1) * spacing],
        (Some(&sample), _) => recorded[sample],
        (None, column) => {
            if column == row - rows.len() + 1 {
                ridge
            } else {
                0.0
            }
        }
    };
    let solved = Summary::from_rows(rows.len() + TAPS, columns, entry).solve()?;
    Some((solved.residual, solved.values))
}

fn mean(values: &[f64]) -> Option<f64> {
    let (sum, count) = values
        .iter()
        .filter(|value| is_usable(**value))
        .fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    let mean = sum / count;
    values.iter().any(|value| is_usable(*value) && *value != mean).then_some(mean)
}
