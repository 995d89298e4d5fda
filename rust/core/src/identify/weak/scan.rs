//! Scanning the width of the test function: do equations of every scale agree, and which widths are accepted?

use std::ops::Range;

use crate::error::Error;
use crate::identify::options::WidthFrom;
use crate::identify::scanned::{Scan, Scans, wider};
use crate::identify::weak::choice::{Chosen, EXPONENT};
use crate::identify::weak::decide::{BADLY, BETTER};
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::identify::widths::{MOST_SAMPLES, OfWidth, STRETCHES, Widths};
use crate::inference::jumps::jump::{Jump, row_from};
use crate::inference::jumps::search::rows_over;
use crate::regression::model::Model;
use crate::regression::subsample::{cut, place_among, places_of, stretches_of_blocks};
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};
use crate::weak_form::test_function_choice::spectrum_length;
use crate::weak_form::weak_rows::WeakRows;

/// Half-widths that the spectra of a long record suggest which the widest test functions of a scan are long, at least.
const WIDER: usize = 8;

/// Reaches of a test function in a piece between jumps whose blocks count: two blocks as short as there may be.
const LEAST_REACHES: usize = 4;

impl Session<'_, '_, '_> {
    /// Scans the widths unless that was done, moves to the plateau where the test function that the spectra suggest is off it, and on to wider ones where
    /// windows follow noise. What was chosen and fitted `last`, with the same noise, tells what its test function is.
    pub(crate) fn onto_plateau(
        &mut self,
        chosen: Chosen,
        model: &Model,
        scans: &mut Option<Scans>,
        last: Option<&Chosen>,
    ) -> Result<Chosen, Error> {
        let given = self.options.half_width.is_some();
        self.suggested = None;
        // Without a coefficient of the motion among the unknowns there is nothing that widths could tell apart.
        let moves = self.unknowns().iter().any(|&unknown| unknown < 3);
        if given && !self.options.diagnose || !moves {
            return Ok(chosen);
        }
        let scans = match scans {
            Some(scans) => scans,
            None => scans.insert(self.scan(model, chosen.weak.function.half_width(), &[])?),
        };
        let before = chosen.weak.function.half_width();
        let moved = if given {
            None
        } else if model.windowed.is_empty() {
            scans.accepted(before)
        } else {
            scans.accepted_beside_windows(before)
        };
        let half_width = moved.unwrap_or(before);
        self.scan = scans.best.clone();
        let mut chosen = if half_width == before { chosen } else { self.chosen_with(half_width, model)? };
        if !given && self.options.averaging {
            chosen = self.without_shortest_windows(chosen, model, last)?;
        }
        let used = chosen.weak.function.half_width();
        self.suggested = Some(before).filter(|_| used < before);
        self.scan = scans.with(used);
        self.scan.moved = used != before || self.options.width_from == Some(WidthFrom::Plateau);
        Ok(chosen)
    }

    /// Rows of a half-width.
    pub(crate) fn chosen_with(&mut self, half_width: usize, model: &Model) -> Result<Chosen, Error> {
        let exponent = self.options.exponent.unwrap_or(EXPONENT);
        let weak = self.rows(TestFunction::new(half_width, exponent, self.options.delta)?)?;
        let parameters = self.pilot(&weak, model)?;
        Ok(Chosen { weak, parameters, at_end: false, fitted: None, fitted_before: None })
    }

    /// The first test function, of one and wider ones of the plateau, whose best windows are not the shortest there are; the widest where all
    /// are.
    ///
    /// Noise that was low-passed, held or rounded is correlated over many samples: in narrow test functions short windows follow it as if it
    /// were motion. In wider ones, whose band ends below the noise's corner, it is as good as white.
    fn without_shortest_windows(
        &mut self,
        first: Chosen,
        model: &Model,
        before: Option<&Chosen>,
    ) -> Result<Chosen, Error> {
        let mut width = first.weak.function.half_width();
        let widest = self.scan.widest().unwrap_or(0);
        let mut tried = first;
        loop {
            let before = before.filter(|before| before.weak.function == tried.weak.function);
            let shortest = if let Some(fitted) = before.and_then(|before| before.fitted.as_ref()) {
                fitted.has_shortest_windows()
            } else {
                let fitted = self.sketch_first(&tried, model)?;
                let shortest = fitted.has_shortest_windows();
                tried.fitted = Some(fitted);
                shortest
            };
            width *= 2;
            if !shortest || self.scan.has_no_plateau() || width > widest {
                return self.without_hidden_jumps(tried, widest, model);
            }
            tried = self.chosen_with(width, model)?;
        }
    }

    /// The same test function, or the first wider one of the plateau that predicts much better, where windows are hardly longer than it and predict
    /// badly: while nothing is known of jumps yet, such windows may lose least of all at them, and hide them. Where the torque has a lag, whatever the windows
    /// are, and on to wider ones as long as each predicts much better: what else a filter does is least in slow motion, and while it is more than noise nothing
    /// is found of jumps.
    fn without_hidden_jumps(&mut self, tried: Chosen, widest: usize, model: &Model) -> Result<Chosen, Error> {
        let is_late = self.finds_lag() || self.options.lag.is_some_and(|lag| lag != 0.0);
        let hides =
            |fitted: &&Decided| fitted.error > BADLY && (is_late || fitted.has_windows_of_a_function(&tried.weak));
        let Some(mut error) = tried.fitted.as_ref().filter(hides).map(|fitted| fitted.error) else { return Ok(tried) };
        let mut width = 2 * tried.weak.function.half_width();
        let (mut best, mut is_wider) = (tried, false);
        while error > BADLY && !self.scan.has_no_plateau() && width <= widest {
            let mut wider = self.chosen_with(width, model)?;
            let fitted = self.sketch_first(&wider, model)?;
            if fitted.error < BETTER * error {
                (error, wider.fitted) = (fitted.error, Some(fitted));
                (best, is_wider) = (wider, true);
                if !is_late {
                    break;
                }
            } else if is_wider {
                break;
            }
            width *= 2;
        }
        Ok(best)
    }

    /// Decides with the wider test function that the spectra suggest where a narrower one, which widths that were compared as if nothing jumped led to,
    /// finds jumps and other constants than theirs. The wider one stands if, between the jumps that it finds, widths agree with it and with its constants.
    pub(crate) fn between_jumps_of_suggested(
        &mut self,
        chosen: Chosen,
        decided: Decided,
        model: &Model,
    ) -> Result<(Chosen, Decided), Error> {
        let constants = constants_between_jumps(&decided).filter(|constants| self.scan.is_in_doubt(constants));
        let Some(suggested) = self.suggested.filter(|_| constants.is_some()) else { return Ok((chosen, decided)) };
        let mut wider = self.chosen_with(suggested, model)?;
        let found = self.decide(&mut wider, model)?;
        let Some(constants) = constants_between_jumps(&found) else { return Ok((chosen, decided)) };
        let scans = self.scan(model, suggested, &found.jumps)?;
        let agrees = scans.accepted_beside_windows(suggested).is_none() && scans.best.confirms(&constants);
        if !agrees {
            return Ok((chosen, decided));
        }
        self.scan = scans.with(suggested);
        Ok((wider, found))
    }

    /// Compares widths once more where windowed unknowns jump and widths were compared as if they did not: in a block that holds a jump a line follows it,
    /// which moves constants with every width alike. The second comparison stands if it confirms the constants.
    pub(crate) fn scan_between_jumps(&mut self, chosen: &Chosen, decided: &Decided) -> Result<(), Error> {
        let constants = constants_between_jumps(decided).filter(|_| self.scan.tried > 0);
        let Some(constants) = constants.filter(|constants| self.scan.is_in_doubt(constants)) else { return Ok(()) };
        let used = chosen.weak.function.half_width();
        let again = self.scan(&self.model(), used, &decided.jumps)?.with(used);
        if again.confirms(&constants) {
            self.scan = Scan { moved: self.scan.moved, ..again };
        }
        Ok(())
    }

    /// Estimates what is constant with test functions of all widths, and looks for widths that agree, in blocks that hold none of some jumps. Of a long
    /// record those are tried that the samples that are scanned have room for, and some that are wider than what the spectra suggest.
    fn scan(&mut self, model: &Model, suggested: usize, jumps: &[Jump]) -> Result<Scans, Error> {
        let samples = self.record.angle.len();
        let noise = self.noise[0];
        let mut widths = Widths::new(model, noise, || Ok(self.evidence(spectrum_length(samples, 200))?.period()))?;
        let widest = widths.widest(samples.min(MOST_SAMPLES)).max(WIDER * suggested).min(widths.widest(samples));
        let mut half = LEAST_HALF_WIDTH;
        while 2 * half < widest {
            let function = TestFunction::new(half, self.options.exponent.unwrap_or(EXPONENT), self.options.delta)?;
            let (weak, stretches) = self.rows_to_scan(function, jumps)?;
            let one = OfWidth {
                rows: &weak.rows,
                stretches: &stretches,
                stride: weak.stride,
                reach: weak.reach(),
                scale: (half, function.band()),
            };
            widths.add(&one, &mut self.stages)?;
            half = wider(half);
        }
        Ok(widths.plateaus_or_alike())
    }

    /// Rows of all of a record, or of stretches of a long one, without those over jumps, and where stretches begin and end among them: at jumps, too.
    fn rows_to_scan(&mut self, function: TestFunction, jumps: &[Jump]) -> Result<(WeakRows, Vec<Range<usize>>), Error> {
        let samples = self.record.angle.len();
        let count = WeakRows::count(function, samples);
        let stretches = if samples <= 2 * MOST_SAMPLES {
            None
        } else {
            Some(stretches_of_blocks(count, MOST_SAMPLES / function.stride(), STRETCHES))
        };
        let (record, delta, workers) = (&self.record, self.options.delta, self.stages.workers);
        let mut weak = self
            .stages
            .stage(|watch| WeakRows::build(record, function, delta, stretches.as_deref(), workers, watch))?;
        let stretches = stretches.unwrap_or_else(|| std::iter::once(0..count).collect());
        let mut places = places_of(&stretches);
        if !jumps.is_empty() {
            let (times, among) = ((weak.first, weak.stride, 1), |row: usize| place_among(&stretches, row));
            let over = rows_over(jumps, &weak.kernels.values[2], times, count);
            weak.rows.exclude(over.filter_map(among));
            places = cut(&places, jumps.iter().filter_map(|jump| among(row_from(jump.sample, times))));
            // What is too short for blocks of its own says nothing, and against nothing.
            places.retain(|place| place.len() >= LEAST_REACHES * weak.reach());
        }
        Ok((weak, places))
    }
}

/// The constants that were found where windowed unknowns jump and nothing else does.
fn constants_between_jumps(decided: &Decided) -> Option<Vec<(usize, f64)>> {
    let values = decided.fit.as_ref()?.pooled.values.iter().copied();
    let jump = !decided.jumps.is_empty() && decided.jumps.iter().all(|jump| !jump.of_constants);
    jump.then(|| decided.model.constant.iter().copied().zip(values).collect())
}
