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
pub(crate) fn outward(reaches: &[f64], last: Option<f64>, mut is_better: impl FnMut(f64) -> bool) {
    let most = if last.is_some() { NO_BETTER } else { usize::MAX };
    let last = last.unwrap_or(f64::NEG_INFINITY);
    let (below, above) = reaches.split_at(reaches.partition_point(|&reach| reach < last));
    let mut walk = |reaches: &mut dyn Iterator<Item = &f64>| {
        let mut worse = 0;
        for &reach in reaches {
            worse = if is_better(reach) { 0 } else { worse + 1 };
            if worse == most {
                return;
            }
        }
    };
    walk(&mut above.iter());
    walk(&mut below.iter().rev());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_around_a_bandwidth_ends_where_it_gets_no_better() {
        let mut tried = Vec::new();
        outward(&REACHES, Some(5.0), |reach| {
            tried.push(reach);
            reach == 8.0
        });
        assert_eq!(tried, [5.6, 8.0, 11.0, 16.0, 4.0, 2.8]);
        tried.clear();
        outward(&REACHES, None, |reach| {
            tried.push(reach);
            false
        });
        assert_eq!(tried, REACHES);
    }

    #[test]
    fn bandwidths_fit_into_the_rows() {
        assert_eq!(within(10.0, 70.0), [16.0, 20.0, 28.0]);
        assert!(within(10.0, 30.0).is_empty());
    }
}
