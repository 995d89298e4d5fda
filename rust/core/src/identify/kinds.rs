//! The kind of each unknown: windowed, slowly varying or constant, and which kinds a form offers.

/// How an unknown comes about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One value in every window.
    Windowed,
    /// One value over the record.
    Constant,
    /// Constant unless the record says otherwise; a stiffness is windowed.
    Automatic,
    /// Varies more slowly than the windowed coefficients.
    Varying,
}

/// Regressors of coefficients that multiply derivatives of the angle, inertia and damping, and of the stiffness.
const STIFFNESS: usize = 2;

/// What weak form makes of the kinds that were asked for; `regressors` says which unknown each belongs to. With windows of all lengths
/// averaged, windows are short enough for the stiffness, and inertia and damping cannot be told from it there: they are followed more slowly.
pub(crate) fn in_weak_form(asked: &[Kind], regressors: &[usize], averaging: bool) -> Vec<Kind> {
    let settled = |(&kind, &unknown): (&Kind, &usize)| match kind {
        Kind::Automatic if unknown == STIFFNESS => (Kind::Windowed, unknown),
        kind => (kind, unknown),
    };
    let all = || asked.iter().zip(regressors).map(settled);
    let beside_windowed = averaging && all().any(|(kind, unknown)| kind == Kind::Windowed && unknown >= STIFFNESS);
    let kind = |(kind, unknown): (Kind, usize)| match kind {
        Kind::Windowed if beside_windowed && unknown < STIFFNESS => Kind::Varying,
        Kind::Varying if !beside_windowed => Kind::Windowed,
        other => other,
    };
    all().map(kind).collect()
}

/// What strong form makes of them: it tests nothing, and follows nothing slowly.
pub(crate) fn in_strong_form(asked: &[Kind], regressors: &[usize]) -> Vec<Kind> {
    let kind = |(&kind, &unknown): (&Kind, &usize)| match kind {
        Kind::Automatic if unknown == STIFFNESS => Kind::Windowed,
        Kind::Automatic => Kind::Constant,
        Kind::Varying => Kind::Windowed,
        other => other,
    };
    asked.iter().zip(regressors).map(kind).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use Kind::{Automatic, Constant, Varying, Windowed};

    #[test]
    fn a_stiffness_is_windowed_unless_given_otherwise() {
        for averaging in [false, true] {
            let found = in_weak_form(&[Automatic, Automatic, Automatic, Constant], &[0, 1, 2, 3], averaging);
            assert_eq!(found, [Automatic, Automatic, Windowed, Constant]);
        }
        assert_eq!(in_strong_form(&[Automatic, Automatic, Automatic], &[0, 1, 2]), [Constant, Constant, Windowed]);
        assert_eq!(in_strong_form(&[Automatic, Constant], &[0, 2]), [Constant, Constant]);
    }

    #[test]
    fn what_is_windowed_beside_a_windowed_stiffness_varies_slowly() {
        assert_eq!(in_weak_form(&[Windowed, Constant, Windowed], &[0, 1, 2], true), [Varying, Constant, Windowed]);
        assert_eq!(in_weak_form(&[Windowed, Constant, Automatic], &[0, 1, 2], true), [Varying, Constant, Windowed]);
        assert_eq!(in_weak_form(&[Windowed, Windowed], &[0, 3], true), [Varying, Windowed]);
        assert_eq!(in_weak_form(&[Windowed, Constant, Windowed], &[0, 1, 2], false), [Windowed, Constant, Windowed]);
    }

    #[test]
    fn nothing_varies_slowly_beside_what_is_constant() {
        assert_eq!(in_weak_form(&[Varying, Constant], &[0, 2], true), [Windowed, Constant]);
        assert_eq!(in_weak_form(&[Varying, Windowed], &[0, 2], false), [Windowed, Windowed]);
        assert_eq!(in_strong_form(&[Varying, Constant], &[0, 2]), [Windowed, Constant]);
    }
}
