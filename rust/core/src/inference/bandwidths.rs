//! Bandwidths of local polynomials in time, and in which order they are tried.

/// Bandwidths tried, as multiples of the neighbourhood that a prediction leaves out.
const REACHES: [f64; 10] = [1.6, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 23.0, 32.0];

/// So many bandwidths in a row that are no better end the search in one direction.
const NO_BETTER: usize = 2;

/// Bandwidths that fit into so many rows, where a prediction leaves out those within a hole on either side.
pub(crate) fn within(hole: f64, whole: f64) -> Vec<f64> {
    REACHES.iter().map(|multiple| multiple * hole).take_while(|reach| 2.0 * reach <= whole).collect()
}

/// Tries bandwidths in ascending order, or outward from the last round's in both directions until they get no better.
///
/// # Errors
/// Those of a try.
pub(crate) fn outward<E>(
    reaches: &[f64],
    last: Option<f64>,
    mut is_better: impl FnMut(f64) -> Result<bool, E>,
) -> Result<(), E> {
    let most = if last.is_some() { NO_BETTER } else { usize::MAX };
    let last = last.unwrap_or(f64::NEG_INFINITY);
    let (below, above) = reaches.split_at(reaches.partition_point(|&reach| reach < last));
    let mut walk = |reaches: &mut dyn Iterator<Item = &f64>| {
        let mut worse = 0;
        for &reach in reaches {
            worse = if is_better(reach)? { 0 } else { worse + 1 };
            if worse == most {
                break;
            }
        }
        Ok(())
    };
    walk(&mut above.iter())?;
    walk(&mut below.iter().rev())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_around_a_bandwidth_ends_where_it_gets_no_better() {
        let tried = |last: Option<f64>, best: f64| {
            let mut tried = Vec::new();
            let found: Result<(), ()> = outward(&REACHES, last, |reach| {
                tried.push(reach);
                Ok(reach == best)
            });
            found.map(|()| tried)
        };
        assert_eq!(tried(Some(5.0), 8.0).as_deref(), Ok(&[5.6, 8.0, 11.0, 16.0, 4.0, 2.8][..]));
        assert_eq!(tried(None, 0.0).as_deref(), Ok(&REACHES[..]));
        assert_eq!(outward(&REACHES, None, |reach| if reach > 2.5 { Err(reach) } else { Ok(false) }), Err(2.8));
    }

    #[test]
    fn bandwidths_fit_into_the_rows() {
        assert_eq!(within(10.0, 70.0), [16.0, 20.0, 28.0]);
        assert!(within(10.0, 30.0).is_empty());
    }
}
