//! What a scan of the test function's width found, and what it says of a result.

use crate::identify::results::Constant;
use crate::inference::scales::{AGREE, ALIKE, AtScale, LEAST_PLATEAU, Plateau, plateau};
use crate::status::Status;

/// From one half-width to the next.
const STEP: f64 = 1.25;
/// Blocks of a record, or of a stretch, without windowed unknowns.
pub(crate) const BLOCKS: usize = 40;
/// The estimate of the test function that was chosen contradicts the plateau beyond so many standard errors, the smaller of the two.
const CONTRADICTS: f64 = 3.0;
/// Fewer widths than this show no plateau.
pub const FEWEST_WIDTHS: usize = 4;
/// A plateau counts as longer than another from this factor on.
pub(crate) const LONGER: f64 = 1.05;
/// How much wider than its narrowest a test function on the plateau is, or narrower than its widest, at most.
const MARGIN: f64 = 1.5;
/// A constant is another one than the plateau's beyond so many standard errors of both.
pub const OTHER_CONSTANT: f64 = 4.0;
/// The same beyond which another look is worth it.
const IN_DOUBT: f64 = 2.0;
/// An inertia is next to nothing below this part of what wider test functions know of it, to so many standard errors.
const DRAWN_TO_ZERO: f64 = 0.1;
const KNOWN: f64 = 5.0;
/// Wider test functions that know of an inertia span at least this factor.
const FEW_ALIKE: f64 = 1.5;
/// From so many widths on there has to be a plateau.
const ENOUGH_WIDTHS: usize = 6;

/// How widths of the test function agree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Agreement {
    /// Within their errors.
    #[default]
    WithinErrors,
    /// But for what matters to nobody, and beyond their errors.
    Alike,
    /// The one that is used does not.
    Contradicted,
}

/// Estimates by the width of the test function.
#[derive(Clone, Debug, Default)]
pub struct Scan {
    /// The unknowns that were compared: 0 inertia, 1 damping, 2 stiffness, then terms.
    pub unknowns: Vec<usize>,
    /// How many widths were tried; at some the rows may not determine the constants.
    pub tried: usize,
    /// From the narrowest to the widest test function.
    pub scales: Vec<AtScale>,
    /// Whether estimates are corrected for the angle's noise.
    pub corrected: bool,
    /// The widths that agree; `None` where too few could be compared.
    pub plateau: Option<Plateau>,
    /// How widths agree, and the test function that is used with them.
    pub agreement: Agreement,
    /// Whether the test function was moved to the plateau.
    pub moved: bool,
}

/// The half-width that is tried after one.
pub(crate) fn wider(half: usize) -> usize {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the record's length")]
    let next = (half as f64 * STEP).round() as usize;
    next.max(half + 1)
}

impl Scan {
    /// Looks for widths that agree, among enough of them.
    pub(crate) fn find_plateau(&mut self) {
        self.plateau = plateau(&self.scales, 0.0).filter(|_| self.scales.len() >= FEWEST_WIDTHS);
        if let Some(wider) = self.beyond_noise() {
            self.plateau = Some(wider);
        }
    }

    /// The plateau of wider test functions, where narrower ones agree that next to nothing is left of an inertia that these know.
    ///
    /// Noise in a regressor draws its coefficient to zero. Where the noise is not white, as an encoder's ripple, no correction takes that back, and
    /// the narrower the test functions, the more surely they agree on nothing.
    fn beyond_noise(&self) -> Option<Plateau> {
        let (narrow, inertia) = (self.plateau?, self.place(0)?);
        let is_known = |one: &AtScale| one.values[inertia] > KNOWN * one.errors[inertia];
        let beyond = narrow.last + 1;
        let first = beyond + self.scales[beyond..].iter().position(is_known)?;
        let alone = |one: &AtScale| AtScale {
            values: vec![one.values[inertia]],
            errors: vec![one.errors[inertia]],
            ..one.clone()
        };
        let inertias: Vec<AtScale> = self.scales[first..].iter().map(alone).collect();
        let known = plateau(&inertias, 0.0).filter(|known| known.factor(&inertias) >= FEW_ALIKE)?;
        let least = inertias[known.first].values[0] * DRAWN_TO_ZERO;
        if self.scales[narrow.first..=narrow.last].iter().any(|one| one.values[inertia].abs() >= least) {
            return None;
        }
        // Narrow ones are believed no more where wide ones contradict them, though other constants of these may differ.
        let wide = plateau(&self.scales[first..], 0.0)?;
        Some(Plateau { first: first + wide.first, last: first + wide.last })
    }

    /// The part of them that estimates which agree may differ by, beside their errors.
    fn part(&self) -> f64 {
        if self.agreement == Agreement::Alike { ALIKE } else { 0.0 }
    }

    /// Looks for widths that agree but for what matters to nobody.
    pub(crate) fn find_widths_alike(&mut self) {
        let found = Self { plateau: plateau(&self.scales, ALIKE), agreement: Agreement::Alike, ..self.clone() };
        let is_believed = found.factor() >= LEAST_PLATEAU && found.beyond_noise().is_none();
        if self.scales.len() >= FEWEST_WIDTHS && is_believed {
            *self = found;
        }
    }

    /// By what factor widths that agree differ.
    pub(crate) fn factor(&self) -> f64 {
        self.plateau.map_or(1.0, |plateau| plateau.factor(&self.scales))
    }

    /// Whether another scan has other constants where its plateau begins, if this one is accepted.
    pub(crate) fn contradicts(&self, other: &Self) -> bool {
        let (true, Some(one)) = (self.factor() >= LEAST_PLATEAU, other.narrowest()) else { return false };
        let same = self.scales.iter().find(|scale| scale.half_width == one.half_width);
        same.is_some_and(|same| !same.agrees(one, AGREE, self.part()))
    }

    /// The narrowest scale of the plateau.
    pub(crate) fn narrowest(&self) -> Option<&AtScale> {
        self.plateau.map(|plateau| &self.scales[plateau.first])
    }

    /// The half-width of the widest test function of the plateau.
    pub(crate) fn widest(&self) -> Option<usize> {
        self.plateau.map(|plateau| self.scales[plateau.last].half_width)
    }

    /// Whether there were widths enough to show a plateau, and they do not.
    pub(crate) fn has_no_plateau(&self) -> bool {
        self.tried >= ENOUGH_WIDTHS && self.factor() < LEAST_PLATEAU
    }

    /// The plateau, if it is wide enough to be accepted or widths were too few for that.
    pub(crate) fn accepted_plateau(&self) -> Option<Plateau> {
        self.plateau.filter(|_| !self.has_no_plateau())
    }

    /// The half-width that is wider than the plateau's narrowest by a margin.
    pub(crate) fn inside(&self) -> Option<usize> {
        self.nearest_on_plateau(self.narrowest()?.half_width as f64 * self.margin())
    }

    /// The half-width that is narrower than the plateau's widest by a margin.
    fn inside_widest(&self) -> Option<usize> {
        self.nearest_on_plateau(self.widest()? as f64 / self.margin())
    }

    fn margin(&self) -> f64 {
        MARGIN.min(self.factor().sqrt())
    }

    fn nearest_on_plateau(&self, wanted: f64) -> Option<usize> {
        let plateau = self.plateau?;
        let on = &self.scales[plateau.first..=plateau.last];
        on.iter().map(|one| one.half_width).min_by(|a, b| {
            let off = |half_width: usize| (half_width as f64 / wanted).ln().abs();
            off(*a).total_cmp(&off(*b))
        })
    }

    /// What the scan says of the whole record and of the constants that were found in it, where their errors hold what widths that are alike differ by.
    pub(crate) fn status(&self, constants: &[Constant]) -> Status {
        self.status_but_for(constants, ALIKE)
    }

    /// What it says where the errors of the constants hold a part of them.
    pub(crate) fn status_but_for(&self, constants: &[Constant], part: f64) -> Status {
        let is_contradicted = self.agreement == Agreement::Contradicted;
        let disagree = self.has_no_plateau() || is_contradicted || self.differs(constants, part);
        if disagree { Status::SCALES_DISAGREE } else { Status::GOOD }
    }

    /// What the constants, those that change slowly and come first left alone, may be wrong by where other widths find them alike but not within errors:
    /// the difference from the one of the plateau that differs most. Nothing where they are contradicted.
    pub(crate) fn apart(&self, constants: &[Constant], slow: usize) -> Option<Vec<f64>> {
        let is_apart = self.agreement == Agreement::Alike || self.differs(constants, 0.0);
        let plateau = self.plateau.filter(|_| is_apart && self.status(constants) == Status::GOOD)?;
        let from = |scale: &AtScale| -> Vec<f64> {
            let off = |one: &Constant| self.place(one.unknown).map_or(0.0, |place| scale.values[place] - one.value);
            constants.iter().map(off).collect()
        };
        let beyond = |off: &Vec<f64>| -> f64 {
            off.iter().zip(constants).map(|(off, one)| (off / one.error).powi(2)).filter(|one| one.is_finite()).sum()
        };
        let differences = self.scales[plateau.first..=plateau.last].iter().map(from);
        let most = differences.max_by(|one, other| beyond(one).total_cmp(&beyond(other)))?;
        Some(std::iter::repeat_n(0.0, slow).chain(most).collect())
    }

    /// Where an unknown is among those that were compared.
    fn place(&self, unknown: usize) -> Option<usize> {
        self.unknowns.iter().position(|&one| one == unknown)
    }

    /// Whether constants of some unknowns may contradict widths that agree, any of them, or widths disagree: another look is worth it.
    pub(crate) fn is_in_doubt(&self, constants: &[(usize, f64)]) -> bool {
        let Some(plateau) = self.within_errors() else { return true };
        let agreed = &self.scales[plateau.first..=plateau.last];
        agreed.iter().any(|scale| self.is_beside(scale, constants, IN_DOUBT))
    }

    /// Whether widths agree, and on these constants.
    pub(crate) fn confirms(&self, constants: &[(usize, f64)]) -> bool {
        let Some(plateau) = self.within_errors() else { return false };
        !self.is_beside(&self.scales[plateau.first], constants, OTHER_CONSTANT)
    }

    /// The plateau, if widths agree within their errors.
    fn within_errors(&self) -> Option<Plateau> {
        self.accepted_plateau().filter(|_| self.agreement == Agreement::WithinErrors)
    }

    /// Whether the constant of an unknown is not that of one width, beyond so many of its errors.
    fn is_beside(&self, scale: &AtScale, constants: &[(usize, f64)], errors: f64) -> bool {
        let off = |&(unknown, value): &(usize, f64)| {
            let place = self.place(unknown);
            place.is_some_and(|place| (scale.values[place] - value).abs() > errors * scale.errors[place])
        };
        constants.iter().any(off)
    }

    /// Whether a constant is not what the plateau says, by more than chance and a part of it.
    fn differs(&self, constants: &[Constant], part: f64) -> bool {
        self.narrowest().is_some_and(|one| constants.iter().any(|found| self.differs_at(one, found, part)))
    }

    fn differs_at(&self, scale: &AtScale, constant: &Constant, part: f64) -> bool {
        let Some(place) = self.place(constant.unknown) else { return false };
        let error = scale.errors[place].hypot(constant.error);
        let most = (OTHER_CONSTANT * error).max(part * constant.value.abs());
        (scale.values[place] - constant.value).abs() > most
    }

    pub(crate) fn nearest(&self, half_width: usize) -> Option<(usize, &AtScale)> {
        self.scales.iter().enumerate().min_by_key(|(_, one)| one.half_width.abs_diff(half_width))
    }
}

/// What a scan found with the correction for noise and without.
pub(crate) struct Scans {
    pub(crate) best: Scan,
    /// With the correction that the chosen test function is used with.
    pub(crate) corrected: Scan,
}

impl Scans {
    /// Of scans with the correction for noise and without, the longer plateau; that with the correction where they are as long.
    pub(crate) fn of([corrected, plain]: [Scan; 2]) -> Self {
        let best = if plain.factor() > LONGER * corrected.factor() { plain } else { corrected.clone() };
        Self { best, corrected }
    }

    /// The half-width to accept where another one lies off the plateau: a little wider than its narrowest, which is the first that its
    /// errors cannot tell from the others. A wider one that agrees may stay.
    pub(crate) fn accepted(&self, half_width: usize) -> Option<usize> {
        self.best.accepted_plateau()?;
        let (place, chosen) = self.corrected.nearest(half_width)?;
        let on_its_own = self.corrected.accepted_plateau().is_some_and(|own| own.holds(place));
        if on_its_own || self.is_wider(chosen) && !self.contradict(half_width) {
            return None;
        }
        self.best.inside()
    }

    /// The same beside windowed unknowns: where one is wider than the whole plateau, a little narrower than its widest. So little noise as asks
    /// for wide ones says nothing for narrow ones, beside which windows are so short that the noise of the regressors spoils what is constant.
    pub(crate) fn accepted_beside_windows(&self, half_width: usize) -> Option<usize> {
        let accepted = self.accepted(half_width)?;
        let (place, chosen) = self.corrected.nearest(half_width)?;
        if self.is_wider(chosen) {
            return self.best.inside_widest();
        }
        // Wider than those that agree with the correction, and on the plateau without it.
        let is_wider = self.corrected.accepted_plateau().is_some_and(|own| place > own.last) && half_width > accepted;
        Some(accepted).filter(|_| !is_wider || self.contradict(half_width))
    }

    /// Whether one is wider than the whole plateau. Both scans need not have the same widths.
    fn is_wider(&self, one: &AtScale) -> bool {
        self.best.widest().is_some_and(|widest| one.half_width > widest)
    }

    /// The best scan where a half-width is used, with what it says of that.
    pub(crate) fn with(&self, half_width: usize) -> Scan {
        let agreement = if self.differ(half_width, ALIKE) {
            Agreement::Contradicted
        } else if self.contradict(half_width) {
            Agreement::Alike
        } else {
            self.best.agreement
        };
        Scan { agreement, ..self.best.clone() }
    }

    /// Whether a half-width, corrected for noise, contradicts the plateau.
    pub(crate) fn contradict(&self, half_width: usize) -> bool {
        self.differ(half_width, 0.0)
    }

    /// The same by more than a part of what it finds.
    fn differ(&self, half_width: usize, part: f64) -> bool {
        let (Some(accepted), Some((place, chosen))) = (self.best.narrowest(), self.corrected.nearest(half_width))
        else {
            return false;
        };
        let on_its_own = self.corrected.accepted_plateau().is_some_and(|own| own.holds(place));
        !on_its_own && !accepted.agrees(chosen, CONTRADICTS, part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Widths that all agree about one constant.
    fn scan(value: f64, error: f64, widths: usize) -> Scan {
        let at = |place: usize| AtScale {
            half_width: 4 << place,
            band: 100.0 / f64::from(1 << place),
            values: vec![value],
            errors: vec![error],
        };
        let mut scan = Scan { tried: widths, scales: (0..widths).map(at).collect(), ..Scan::default() };
        scan.find_plateau();
        scan
    }

    /// Half-widths of 4, 8, 16 … 4096, of which some ranges agree.
    fn with_plateau(holds: std::ops::RangeInclusive<usize>) -> Scan {
        let mut scan = scan(1.0, 0.01, 11);
        for (place, scale) in scan.scales.iter_mut().enumerate().filter(|(place, _)| !holds.contains(place)) {
            scale.values[0] = 2.0 + place as f64;
        }
        scan.find_plateau();
        scan
    }

    #[test]
    fn a_width_off_the_plateau_gives_way_to_its_narrow_end_and_beside_windows_to_the_nearer_one() {
        let scans = Scans { best: with_plateau(3..=7), corrected: with_plateau(3..=7) };
        assert_eq!([64, 8, 2048].map(|half| scans.accepted(half)), [None, Some(64), Some(64)]);
        assert_eq!([64, 8, 2048].map(|half| scans.accepted_beside_windows(half)), [None, Some(64), Some(256)]);
    }

    #[test]
    fn narrow_widths_that_noise_draws_to_nothing_give_way_to_wide_ones_that_know_the_inertia() {
        let found = |narrow: f64, widths: usize, error: f64, unknown: usize| {
            let mut scan = scan(1.0, error, 10);
            for one in &mut scan.scales[..widths] {
                (one.values[0], one.errors[0]) = (narrow, 1e-4);
            }
            scan.unknowns = vec![unknown];
            scan.find_plateau();
            scan.plateau.unwrap().first
        };
        assert_eq!(found(1e-3, 7, 0.05, 0), 7);
        // An inertia that is smaller by less, one that is hardly known, one width, another constant.
        assert_eq!([found(0.2, 7, 0.05, 0), found(1e-3, 7, 0.3, 0), found(1e-3, 9, 0.05, 0)], [0; 3]);
        assert_eq!(found(1e-3, 7, 0.05, 1), 0);
    }

    #[test]
    fn widths_are_compared_whatever_others_each_scan_has() {
        let mut scans = Scans { best: with_plateau(3..=7), corrected: with_plateau(3..=7) };
        scans.corrected.scales.drain(..3);
        scans.corrected.find_plateau();
        assert_eq!([64, 2048].map(|half| scans.accepted_beside_windows(half)), [None, Some(256)]);
    }

    #[test]
    fn beside_windows_a_width_that_agrees_stays_where_it_is_wider_than_the_plateau_with_the_correction() {
        let mut scans = Scans { best: with_plateau(1..=9), corrected: with_plateau(1..=6) };
        assert!(scans.contradict(1024));
        assert_eq!(scans.accepted_beside_windows(1024), Some(16));
        scans.corrected.scales[8].values[0] = 1.025;
        assert_eq!(scans.accepted_beside_windows(1024), None);
        assert_eq!(scans.accepted(1024), Some(16));
        // Not at the narrow end of the other.
        scans.best = with_plateau(6..=10);
        assert_eq!(scans.accepted_beside_windows(1024), None);
        scans.best = with_plateau(8..=10);
        assert_eq!(scans.accepted_beside_windows(1024), Some(2048));
    }

    #[test]
    fn only_a_plateau_contradicts_another_that_differs_beyond_its_errors() {
        let shorter = scan(1.0, 0.01, 6);
        assert!(shorter.contradicts(&scan(0.95, 0.01, 6)));
        assert!(!shorter.contradicts(&scan(0.985, 0.01, 6)));
        // Errors are the smaller of the two.
        assert!(shorter.contradicts(&scan(0.95, 0.1, 6)));
        // Too few widths are no plateau.
        assert!(!scan(1.0, 0.01, 2).contradicts(&scan(0.95, 0.01, 6)));
        assert!(!shorter.contradicts(&scan(0.95, 0.01, 2)));
    }

    #[test]
    fn constants_are_in_doubt_that_one_of_the_widths_contradicts() {
        let mut scan = scan(1.0, 0.1, 8);
        scan.unknowns = vec![0];
        scan.scales[4].errors[0] = 0.01;
        let constants = |value: f64| [(0, value)];
        assert!(!scan.is_in_doubt(&constants(1.015)) && scan.is_in_doubt(&constants(1.025)));
        assert!(scan.confirms(&constants(1.3)) && !scan.confirms(&constants(1.5)));
        // Of another unknown widths say nothing.
        assert!(!scan.is_in_doubt(&[(1, 9.0)]));
        scan.agreement = Agreement::Alike;
        assert!(scan.is_in_doubt(&constants(1.0)) && !scan.confirms(&constants(1.0)));
    }

    #[test]
    fn widths_that_differ_by_next_to_nothing_are_no_contradiction_and_errors_hold_it() {
        let mut scan = scan(1.0, 1e-6, 8);
        for (place, scale) in scan.scales.iter_mut().enumerate() {
            scale.values[0] += 1e-4 * place as f64;
        }
        scan.unknowns = vec![0];
        scan.find_plateau();
        assert!(scan.has_no_plateau());
        scan.find_widths_alike();
        assert_eq!((scan.agreement, scan.has_no_plateau()), (Agreement::Alike, false));
        let constant = |value: f64| [Constant { unknown: 0, value, error: 1e-6, test: None }];
        assert_eq!(scan.status(&constant(1.0005)), Status::GOOD);
        assert_eq!(scan.status_but_for(&constant(1.0005), 0.0), Status::SCALES_DISAGREE);
        assert_eq!(scan.status(&constant(1.002)), Status::SCALES_DISAGREE);
        // Another that changes slowly comes first.
        let apart = scan.apart(&constant(1.0001), 1).expect("widths that are alike");
        assert_eq!(apart[0], 0.0);
        assert!((apart[1] - 6e-4).abs() < 1e-12, "{apart:?}");
        assert_eq!(scan.apart(&constant(1.002), 1), None);
    }
}
