//! What a record says of its unknowns: over which length windows should reach, and what is constant.

use crate::constancy::{self, Test};
use crate::cross_validation::{Validated, validate};
use crate::equations::Rows;
use crate::error::Error;
use crate::model::{Fit, Model};
use crate::pooling::{Expected, misfits};
use crate::row_covariance::RowCovariance;
use crate::scale::Scale;
use crate::varying;
use crate::weak_form::WeakRows;
use crate::weak_identification::{Chosen, Kind, Session};

/// What was decided, and the fit it rests on.
pub(crate) struct Decided {
    /// What is windowed and what is constant.
    pub(crate) model: Model,
    /// Constants that turned out to change.
    pub(crate) slow: Vec<usize>,
    pub(crate) found: Option<varying::Found>,
    /// Nothing where the constants are not determined.
    pub(crate) fit: Option<Fit>,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub(crate) error: f64,
    pub(crate) tests: Vec<(usize, Test)>,
    /// Lengths that were tried, in samples, and the error of each.
    pub(crate) lengths: Vec<(usize, f64)>,
    pub(crate) scales: Vec<Scale>,
    pub(crate) covariance: RowCovariance,
    pub(crate) expected: Expected,
}

/// How many rows lie in so many samples.
pub(crate) fn rows_of(samples: usize, stride: usize) -> usize {
    ((samples + stride / 2) / stride).max(1)
}

impl Decided {
    /// The right-hand side without what changes slowly.
    pub(crate) fn side<'a>(&'a self, rows: &'a Rows) -> &'a [f64] {
        self.found.as_ref().map_or(&rows.side, |found| &found.side)
    }

    /// The model with what changes slowly before the other constants.
    pub(crate) fn ordered(&self) -> Model {
        let constant = self.slow.iter().chain(&self.model.constant).copied().collect();
        Model { constant, ..self.model.clone() }
    }
}

impl Session<'_, '_, '_> {
    /// Chooses the length of windows where it is not given, and tests what is constant.
    pub(crate) fn decide(&mut self, chosen: &Chosen, model: &Model) -> Result<Decided, Error> {
        let rows = &chosen.weak.rows;
        let (covariance, expected) = self.covariance(&chosen.weak, chosen.parameters);
        let mut decided = Decided {
            model: model.clone(),
            slow: Vec::new(),
            found: None,
            fit: None,
            error: 1.0,
            tests: Vec::new(),
            lengths: Vec::new(),
            scales: Vec::new(),
            covariance,
            expected,
        };
        if self.options.average {
            decided.scales = Scale::all(rows.len(), chosen.weak.reach());
        }
        self.fit_constants(&chosen.weak, &mut decided)?;
        if let Some(fit) = &decided.fit {
            (decided.covariance, decided.expected) = self.covariance(&chosen.weak, self.parameters(model, fit));
        }
        decided.slow = self.of_kind(Kind::Varying);
        loop {
            if !decided.slow.is_empty() {
                self.set_free(rows, model, &mut decided)?;
            }
            let Some(fit) = &decided.fit else { return Ok(decided) };
            let side = decided.side(rows);
            let problem = decided.model.problem(rows, side, self.noise[0], Some(&decided.covariance));
            let (expected, inflation) = (decided.expected, decided.error.max(1.0));
            let results =
                constancy::test(&problem, fit, expected, &decided.covariance, inflation, self.options.instructions);
            // Tests of what was set free before stand as they were.
            decided.tests.retain(|(one, _)| decided.slow.contains(one));
            let constants = decided.model.constant.iter().zip(results);
            decided.tests.extend(constants.filter_map(|(&one, test)| test.map(|test| (one, test))));
            // The most conspicuous first, then the others again.
            let tested = self.of_kind(Kind::Tested);
            let worst = decided
                .tests
                .iter()
                .filter(|(one, test)| {
                    tested.contains(one) && !decided.slow.contains(one) && test.probability < constancy::NO_CHANCE
                })
                .min_by(|a, b| a.1.probability.total_cmp(&b.1.probability))
                .map(|(one, _)| *one);
            match worst {
                Some(one) if fit.scale.is_some() => decided.slow.push(one),
                _ => return Ok(decided),
            }
        }
    }

    /// Regressors of the unknowns of a kind.
    fn of_kind(&self, kind: Kind) -> Vec<usize> {
        let unknowns = self.unknowns();
        unknowns.iter().zip(&self.options.kinds).filter(|(_, one)| **one == kind).map(|(index, _)| *index).collect()
    }

    /// Fits everything that is not windowed as constant, in windows of the length that predicts best.
    fn fit_constants(&mut self, weak: &WeakRows, decided: &mut Decided) -> Result<(), Error> {
        let (rows, stride) = (&weak.rows, weak.stride);
        let instructions = self.options.instructions;
        let (expected, model) = (decided.expected, &decided.model);
        let problem = model.problem(rows, &rows.side, self.noise[0], Some(&decided.covariance));
        if model.windowed.is_empty() {
            decided.fit = Fit::new(&problem, None, expected, instructions, &mut self.run)?;
            return Ok(());
        }
        let wanted = self.options.equations.map(|samples| rows_of(samples, stride));
        if !self.options.average {
            let window = wanted.unwrap_or(rows.len()).min(rows.len());
            decided.fit = Fit::in_rows(&problem, window, expected, instructions);
            decided.error = decided.fit.as_ref().map_or(1.0, |fit| {
                let misfits = misfits(&fit.full, &fit.pooled.values, expected);
                misfits.iter().sum::<f64>() / misfits.len().max(1) as f64
            });
            return Ok(());
        }
        let scales = &decided.scales;
        let tried = match wanted {
            Some(wanted) => scales[Scale::nearest(scales, wanted).ok_or(self.too_short())?..][..1].to_vec(),
            None => scales.clone(),
        };
        if tried.is_empty() {
            return Err(self.too_short());
        }
        let validated = validate(&problem, &tried, expected, instructions, &mut self.run)?;
        let length = |one: &Validated| one.fit.scale.map_or(0, Scale::span) * stride;
        decided.lengths = validated.iter().map(|one| (length(one), one.error)).collect();
        if let Some(best) = validated.into_iter().min_by(|a, b| a.error.total_cmp(&b.error)) {
            decided.error = best.error;
            decided.fit = Some(best.fit);
        }
        Ok(())
    }

    /// Finds what changes slowly, and the other constants beside it.
    fn set_free(&mut self, rows: &Rows, model: &Model, decided: &mut Decided) -> Result<(), Error> {
        let instructions = self.options.instructions;
        let Some(first) = decided.fit.as_ref().and_then(|fit| fit.scale) else { return Ok(()) };
        let rest = model.constant.iter().copied().filter(|one| !decided.slow.contains(one)).collect();
        decided.model = Model { constant: rest, ..model.clone() };
        let ordered = decided.ordered();
        let slow = decided.slow.len();
        decided.found = varying::find(
            rows,
            &ordered,
            slow,
            self.noise[0],
            decided.expected,
            &decided.scales,
            first,
            instructions,
            &mut self.run,
        )?;
        decided.fit = None;
        if let Some(found) = &decided.found {
            let problem = decided.model.problem(rows, &found.side, self.noise[0], Some(&decided.covariance));
            let (scale, expected) = (Some(found.scale), decided.expected);
            decided.error = found.error;
            decided.fit = Fit::new(&problem, scale, expected, instructions, &mut self.run)?;
        }
        Ok(())
    }
}
