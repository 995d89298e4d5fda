//! Tables of windows, kept from call to call: those of a window of a thousand samples cost as much as what they are used for in a record of a
//! few thousand.

use std::sync::{Arc, Mutex, PoisonError};

use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::coefficients::Coefficients;
use crate::simd::instructions::Instructions;

/// Samples of half a window, all tables together: 256 bytes each.
const KEPT: usize = 1 << 15;

/// Tables of windows of one length.
#[derive(Debug)]
pub(crate) struct WindowTables {
    pub(crate) basis: Basis,
    pub(crate) coefficients: Coefficients,
}

/// What tables depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TablesWanted {
    pub(crate) half: usize,
    /// The degree of the basis, and the degrees of the coefficients: from the first on, every `step`-th.
    pub(crate) highest: usize,
    pub(crate) first: usize,
    pub(crate) step: usize,
    pub(crate) instructions: Instructions,
}

/// The tables used last, the latest at the end.
static TABLES: Mutex<Vec<(TablesWanted, Arc<WindowTables>)>> = Mutex::new(Vec::new());

/// Makes tables, or finds them where they were made before.
pub(crate) fn tables(wanted: TablesWanted) -> Arc<WindowTables> {
    let found = {
        let mut kept = TABLES.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().position(|(one, _)| *one == wanted).map(|place| {
            let entry = kept.remove(place);
            let tables = Arc::clone(&entry.1);
            kept.push(entry);
            tables
        })
    };
    if let Some(found) = found {
        return found;
    }
    let TablesWanted { half, highest, first, step, instructions } = wanted;
    let basis = Basis::new(2 * half + 1, highest + 1);
    let degrees: Vec<usize> = (first..=highest).step_by(step).collect();
    let coefficients = Coefficients::new(&basis, &degrees, false, instructions);
    let made = Arc::new(WindowTables { basis, coefficients });
    if half <= KEPT / 4 {
        let mut kept = TABLES.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push((wanted, Arc::clone(&made)));
        let mut total = 0;
        let fits = kept.iter().rev().take_while(|(one, _)| {
            total += one.half;
            total <= KEPT
        });
        let fits = fits.count();
        let old = kept.len() - fits;
        kept.drain(..old);
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_made_once_and_the_oldest_are_let_go() {
        let wanted = |half| TablesWanted { half, highest: 3, first: 0, step: 1, instructions: Instructions::current() };
        let first = tables(wanted(1001));
        assert!(Arc::ptr_eq(&first, &tables(wanted(1001))));
        for half in 2000..2040 {
            let _ = tables(wanted(half));
        }
        let kept = TABLES.lock().expect("no test panics with the lock");
        assert!(kept.iter().map(|(one, _)| one.half).sum::<usize>() <= KEPT);
        assert!(!kept.iter().any(|(one, _)| *one == wanted(1001)));
    }
}
