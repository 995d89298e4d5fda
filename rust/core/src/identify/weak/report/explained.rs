//! Whether the motion explains the torque of a record beyond chance, beside what does not depend on the motion.

use crate::error::Error;
use crate::identify::results::Constant;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::cross_validation::left_of_rows;
use crate::inference::explained::{Squares, inflation, is_no_chance};
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::residuals::{residuals, usual_variance};
use crate::regression::window_length::Scale;
use crate::weak_form::weak_rows::{TermSamples, WeakRows};

/// Squares of so many times the variance are outliers.
const MOST: f64 = 9.0;

/// A part of the rows that no normal noise makes outliers of: ten times what is expected.
const OUTLIERS: f64 = 0.03;

/// What is left of every row, and whether a fit says anything of it.
type Left = (Vec<f64>, Vec<bool>);

/// How much of the torque the motion explains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Explained {
    /// More than chance.
    Plainly,
    /// No more than chance, beside so large a torque in a few rows that it may have spoilt the rest.
    BesideOutliers,
    /// No more than chance.
    ByNothing,
    /// There is no torque to explain, but for rounding.
    NoTorque,
}

impl Session<'_, '_, '_> {
    /// Whether a fit, which leaves rows of some variance, explains the torque of the record better than chance.
    pub(crate) fn is_explained(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        fit: &Fit,
        variance: f64,
    ) -> Result<Explained, Error> {
        let rows = decided.rows(&weak.rows);
        let used = || rows.rhs.iter().zip(&rows.usable).filter(|(_, usable)| **usable).map(|(rhs, _)| rhs);
        let squares: f64 = used().map(|rhs| rhs * rhs).sum();
        let count = used().count() as f64;
        let still = self.still(&decided.model);
        if still == decided.model {
            // What moves is known: the torque that it takes is no unknown's to explain.
            return Ok(Explained::Plainly);
        }
        // A constant offset leaves no less of rows than there is about their mean.
        if still.windowed.is_empty() && decided.white.is_none() {
            // In rows that were multiplied by the root of their weight, an offset is the mean times that root.
            let roots = || (0..rows.len()).filter(|&row| rows.usable[row]).map(|row| rows.root(row));
            let mean = used().zip(roots()).map(|(rhs, root)| rhs * root).sum::<f64>()
                / roots().map(|root| root * root).sum::<f64>();
            let without = used().zip(roots()).map(|(rhs, root)| (rhs - mean * root).powi(2)).sum();
            let squares = Squares { torque: squares, without, left: variance * count };
            if squares.are_plainly_explained() {
                return Ok(Explained::Plainly);
            }
            if !still.constant.is_empty() && squares.are_rounding() {
                return Ok(Explained::NoTorque);
            }
        }
        let without = if still.layout().regressors() == 0 {
            Some((rows.rhs.clone(), rows.usable.clone()))
        } else {
            self.left_of_all(
                weak,
                &Decided { model: still, found: None, slow: Vec::new(), correlated: None, ..decided.clone() },
                fit,
            )?
        };
        // What varies slowly follows chance where it is taken from the rows that it is compared with. As constants it explains torque, too.
        let constant = Decided { model: decided.ordered(), found: None, slow: Vec::new(), ..decided.clone() };
        let (Some(without), Some(left)) = (without, self.left_of_all(weak, &constant, fit)?) else {
            return Ok(Explained::ByNothing);
        };
        let both: Vec<bool> = without.1.iter().zip(&left.1).map(|(one, other)| *one && *other).collect();
        let many = |rows: &[bool]| rows.iter().filter(|row| **row).count() as f64;
        let outliers = many(&both) - many(&without_outliers(&without.0, both.clone()));
        let spoilt = outliers > OUTLIERS * many(&both);
        let both = without_outliers(&left.0, both);
        let sum = |errors: &[f64]| -> f64 {
            errors.iter().zip(&both).filter(|(_, both)| **both).map(|(error, _)| error * error).sum()
        };
        let squares = Squares { torque: sum(&rows.rhs), without: sum(&without.0), left: sum(&left.0) };
        let farthest = (4 * weak.reach()).min(rows.len() / 8);
        let inflation = inflation(&without.0, &both, farthest);
        let count = many(&both);
        Ok(if squares.are_explained(count, inflation, unknowns(decided, fit, rows.len())) {
            Explained::Plainly
        } else if squares.are_rounding() {
            Explained::NoTorque
        } else if spoilt {
            Explained::BesideOutliers
        } else {
            Explained::ByNothing
        })
    }

    /// Whether a constant that belongs to the motion differs from zero beyond chance: rows that are far off, as touches are, have little weight
    /// in it, however much of the torque they are.
    pub(crate) fn is_moved_by(&self, constants: &[Constant]) -> bool {
        let moving = constants.iter().filter(|constant| !self.is_still(constant.unknown));
        moving.into_iter().any(|constant| is_no_chance(constant.value, constant.error))
    }

    /// Whether a regressor is the same whatever moves: that of an offset.
    pub(crate) fn is_still(&self, regressor: usize) -> bool {
        let term = regressor.checked_sub(3).and_then(|term| self.record.terms.get(term));
        matches!(term, Some(TermSamples::One))
    }

    /// The part of a model that holds without any motion.
    fn still(&self, model: &Model) -> Model {
        let kept = |regressors: &[usize]| regressors.iter().copied().filter(|&one| self.is_still(one)).collect();
        Model { windowed: kept(&model.windowed), constant: kept(&model.constant), ..model.clone() }
    }

    /// What a model leaves of the rows, each predicted from others where windows were compared by that, and which rows it predicts.
    fn left_of_all(&mut self, weak: &WeakRows, decided: &Decided, fit: &Fit) -> Result<Option<Left>, Error> {
        let (instructions, expected) = (self.options.instructions, decided.expected);
        let rows = decided.rows(&weak.rows);
        let problem = decided.problem(rows, self.noise[0]);
        let windowed = problem.layout.windowed > 0;
        let Some(scale) = fit.scale.filter(|_| windowed).map(|scale| longer(scale, weak, decided)) else {
            let whole = if windowed {
                fit.again(&problem, expected, instructions, &mut self.stages)?
            } else {
                Fit::new(&problem, None, expected, instructions, &mut self.stages)?
            };
            let Some(whole) = whole else { return Ok(None) };
            return residuals(&problem, &whole, &mut self.stages).map(Some);
        };
        // Between jumps there is no room for windows that are long because little changes: shorter ones tell as well what is chance.
        let usable = rows.usable.iter().filter(|usable| **usable).count();
        for &scale in decided.scales.iter().rev().filter(|one| one.span() <= scale.span()) {
            let fit = Fit::with_leave_gap_out(&problem, scale, expected, instructions, &mut self.stages)?;
            let Some(left) = fit.as_ref().and_then(|fit| left_of_rows(&problem, scale, fit)) else { continue };
            let left: Vec<Option<f64>> =
                rows.usable.iter().enumerate().map(|(row, &usable)| if usable { left(row) } else { None }).collect();
            if 2 * left.iter().flatten().count() >= usable {
                return Ok(Some(left.iter().map(|left| (left.unwrap_or(0.0), left.is_some())).unzip()));
            }
        }
        Ok(None)
    }
}

/// A length of windows, or the longest of all where it is so short that windows follow noise that is correlated over a test function.
fn longer(scale: Scale, weak: &WeakRows, decided: &Decided) -> Scale {
    decided.scales.last().copied().filter(|_| weak.follow_anything(scale.span())).unwrap_or(scale)
}

/// Unknowns that the fit of so many rows follows chance with: where windows are tested on what they do not hold, their own have none.
fn unknowns(decided: &Decided, fit: &Fit, rows: usize) -> usize {
    let layout = decided.model.layout();
    let windows = if fit.scale.is_some() { 1 } else { rows.div_ceil(fit.span.max(1)) };
    layout.constant + decided.slow.len() + windows * layout.local()
}

/// Which of some rows are not so far off that they would decide for all others, as a touch or a spike is.
fn without_outliers(left: &[f64], mut rows: Vec<bool>) -> Vec<bool> {
    let Some(variance) = usual_variance(left, &rows) else { return rows };
    let most = MOST * variance;
    rows.iter_mut().zip(left).for_each(|(row, left)| *row &= left * left <= most);
    rows
}
