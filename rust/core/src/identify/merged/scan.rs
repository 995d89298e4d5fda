//! Scanning the width of the test function of merged rows: where only constants are asked for, do equations of every scale agree?

use std::ops::Range;

use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::system::Multiplied;
use crate::identify::scanned::{Agreement, BLOCKS, Scan, Scans, wider};
use crate::inference::scales::AtScale;
use crate::regression::block_fit::{BlockFit, fit_in_blocks};
use crate::regression::model::Model;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};

/// The widest test function is such a part of the record.
const WIDEST: usize = 8;

impl MergedSession<'_, '_, '_> {
    /// Whether everything that is unknown is asked for as a constant, so that widths can be compared.
    pub(crate) fn asks_for_constants(&self) -> bool {
        self.merged.elements.iter().all(|one| one.known.is_some() || one.kind == Kind::Constant)
    }

    /// Whether an unknown multiplies the angle of its own equation, so that spectra tell how wide a test function should be.
    pub(crate) fn spectra_tell(&self) -> bool {
        let unknown = self.merged.elements.iter().filter(|one| one.known.is_none());
        let mut entries = unknown.flat_map(|one| &one.entries);
        entries.any(
            |entry| matches!(entry.of, Multiplied::Motion { channel, coefficient: 0 | 2 } if channel == entry.equation),
        )
    }

    /// Moves to the plateau where the test function that spectra suggest is off it, or they suggest none.
    pub(crate) fn onto_plateau(&mut self, suggested: Option<TestFunction>) -> Result<(), Error> {
        let before = (self.parameters.clone(), self.misfits.clone());
        let scans = self.scan()?;
        let half = suggested.map(|one| one.half_width());
        let moved = half.map_or_else(|| scans.best.inside(), |half| scans.accepted(half));
        let widest = scans.best.scales.last().map(|one| one.half_width);
        let half = moved.or(half).or(widest).ok_or(self.too_short())?;
        let exponent = suggested.map_or(self.exponent(), |one| one.exponent());
        self.build(TestFunction::new(half, exponent, self.options.delta)?)?;
        // The widest may have drawn to zero what no torque holds.
        (self.parameters, self.misfits) = before;
        self.pilot()?;
        self.scan = scans.best.clone();
        self.scan.moved = suggested.is_some_and(|one| one.half_width() != half);
        if scans.contradict(half) {
            self.scan.agreement = Agreement::Contradicted;
        }
        Ok(())
    }

    /// Estimates the constants with test functions of all widths, and looks for widths that agree.
    fn scan(&mut self) -> Result<Scans, Error> {
        let model = self.model();
        // Every angle's noise is part of the rows' kernels.
        let noises = [1.0, 0.0];
        let new = |noise: f64| Scan { unknowns: model.constant.clone(), corrected: noise > 0.0, ..Scan::default() };
        let mut scans = noises.map(new);
        let mut half = LEAST_HALF_WIDTH;
        while 2 * half < self.longest() / WIDEST {
            let function = TestFunction::new(half, self.exponent(), self.options.delta)?;
            self.build(function)?;
            self.pilot()?;
            for (scan, fit) in scans.iter_mut().zip(self.in_blocks(&model, &noises)) {
                scan.tried += 1;
                scan.scales.extend(fit.map(|fit| AtScale::new((half, function.band()), fit)));
            }
            half = wider(half);
        }
        scans.iter_mut().for_each(Scan::find_plateau);
        Ok(Scans::of(scans))
    }

    /// The constants and their covariance from blocks of the record, for every variance of the angles' noise over what it is.
    pub(crate) fn in_blocks(&self, model: &Model, noises: &[f64]) -> Vec<Option<BlockFit>> {
        let (group, times) = (self.all.group, self.all.rows.len() / self.all.group);
        let at = |block: usize| times * block / BLOCKS * group;
        let blocks: Vec<Range<usize>> = (0..BLOCKS).map(|block| at(block)..at(block + 1)).collect();
        let fits = fit_in_blocks(&self.all.rows, model, noises, &blocks, self.all.reach());
        fits.into_iter().map(Result::ok).collect()
    }
}
