//! What was decided of merged rows, and the fit it rests on.

use std::sync::Arc;

use crate::inference::constancy::{self, Test};
use crate::inference::jumps::jump::Jump;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::problem::Correlated;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::window_length::Scale;

/// What was decided, and the fit it rests on.
#[derive(Clone)]
pub(crate) struct MergedFit {
    pub(crate) model: Model,
    pub(crate) fit: Fit,
    pub(crate) covariance: RowCovariance,
    pub(crate) correlated: Arc<Correlated>,
    pub(crate) expected: Expected,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub(crate) error: f64,
    /// The largest misfit of an equation without a torque; 1 where all are explained.
    pub(crate) misfit: f64,
    pub(crate) scales: Vec<Scale>,
    /// Windows over fewer times that were tried, too.
    pub(crate) across: Vec<Scale>,
    /// Lengths that were tried, in samples, and the error of each.
    pub(crate) lengths: Vec<(usize, f64)>,
    pub(crate) tests: Vec<(usize, Test)>,
    /// Whether a constant that differs between parts of the record stayed one.
    pub(crate) contradicted: bool,
    /// Those that a search in what is left found, and whether there was one.
    pub(crate) jumps: Vec<Jump>,
    pub(crate) searched: bool,
}

impl MergedFit {
    /// Whether its windows are the shortest of those that were tried.
    pub(crate) fn has_shortest_windows(&self) -> bool {
        let shortest = self.across.first().or(self.scales.first()).copied();
        self.scales.len() > 1 && shortest.is_some() && shortest == self.fit.scale
    }

    /// The same decisions with the values of another fit of the model.
    pub(crate) fn with_values_of(self, other: MergedFit) -> Self {
        let Self { tests, contradicted, jumps, searched, .. } = self;
        Self { tests, contradicted, jumps, searched, ..other }
    }

    /// Takes tests of its constants; those of what is windowed stand as they were.
    pub(crate) fn take_tests(&mut self, found: Vec<(usize, Test)>) {
        self.contradicted = found.iter().any(|(_, test)| test.probability < constancy::NO_CHANCE);
        self.tests.retain(|(one, _)| self.model.windowed.contains(one));
        self.tests.extend(found);
    }

    /// Says of a constant that rows are predicted far better where windows follow it, as another fit does, unless its parts said so or chance may do as
    /// much among so many `independent` rows.
    pub(crate) fn contradict(&mut self, one: usize, followed: &MergedFit, independent: f64) {
        let is_said = |(tested, test): &(usize, Test)| *tested == one && test.probability < constancy::NO_CHANCE;
        let place = followed.model.windowed.iter().position(|&other| other == one);
        let Some(place) = place.filter(|_| !self.tests.iter().any(is_said)) else { return };
        let test = Test::of_prediction(self.error / followed.error, independent, &followed.fit.values(place));
        if test.probability < constancy::NO_CHANCE {
            self.contradict_by(one, test);
        }
    }

    /// Contradicts a constant by a test.
    pub(crate) fn contradict_by(&mut self, one: usize, test: Test) {
        self.contradicted = true;
        self.tests.retain(|(tested, _)| *tested != one);
        self.tests.push((one, test));
    }
}
