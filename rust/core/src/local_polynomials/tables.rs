//! Tables of windows, kept from call to call: those of a window of a thousand samples cost as much as what they are used for in a record of a
//! few thousand.

use std::convert::Infallible;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::error::Error;
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::coefficients::Coefficients;
use crate::simd::instructions::Instructions;

/// Samples of half a window, all tables of a kind together: some 128 bytes each.
const KEPT: usize = 1 << 16;

/// Tables of windows of one length.
#[derive(Debug)]
pub(crate) struct WindowTables {
    pub(crate) basis: Arc<Basis>,
    wanted: TablesWanted,
    coefficients: OnceLock<Coefficients>,
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

impl WindowTables {
    /// The plan of the coefficients, made when it is first asked for.
    pub(crate) fn coefficients(&self) -> &Coefficients {
        let TablesWanted { highest, first, step, instructions, .. } = self.wanted;
        self.coefficients.get_or_init(|| {
            let degrees: Vec<usize> = (first..=highest).step_by(step).collect();
            Coefficients::new(&self.basis, &degrees, false, instructions)
        })
    }
}

/// What was used last, the latest at the end.
pub(crate) struct Kept<K, V>(Mutex<Vec<(K, usize, V)>>);

impl<K: PartialEq, V: Clone> Kept<K, V> {
    pub(crate) const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// Makes a value of some size, or finds it where it was made before.
    pub(crate) fn get(&self, wanted: K, size: usize, make: impl FnOnce() -> V) -> V {
        let Ok(value) = self.try_get(wanted, size, || Ok::<_, Infallible>(make()));
        value
    }

    /// The same where it may fail.
    pub(crate) fn try_get<E>(&self, wanted: K, size: usize, make: impl FnOnce() -> Result<V, E>) -> Result<V, E> {
        let found = {
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            kept.iter().position(|(one, ..)| *one == wanted).map(|place| {
                let entry = kept.remove(place);
                let value = entry.2.clone();
                kept.push(entry);
                value
            })
        };
        if let Some(found) = found {
            return Ok(found);
        }
        let made = make()?;
        if size <= KEPT / 4 {
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            kept.push((wanted, size, made.clone()));
            let mut total = 0;
            let fits = kept.iter().rev().take_while(|(_, size, _)| {
                total += size;
                total <= KEPT
            });
            let old = kept.len() - fits.count();
            kept.drain(..old);
        }
        Ok(made)
    }
}

/// By length and number of polynomials, whatever coefficients are wanted.
static BASES: Kept<(usize, usize), Arc<Basis>> = Kept::new();
static TABLES: Kept<TablesWanted, Arc<WindowTables>> = Kept::new();

/// Makes a basis, or finds it where it was made before.
///
/// # Errors
/// If there is not the memory.
pub(crate) fn basis(length: usize, degrees: usize) -> Result<Arc<Basis>, Error> {
    BASES.try_get((length, degrees), length / 2, || Basis::new(length, degrees).map(Arc::new))
}

/// Makes tables, or finds them where they were made before.
///
/// # Errors
/// If there is not the memory.
pub(crate) fn tables(wanted: TablesWanted) -> Result<Arc<WindowTables>, Error> {
    let TablesWanted { half, highest, .. } = wanted;
    let make = || {
        let basis = basis(2 * half + 1, highest + 1)?;
        Ok(Arc::new(WindowTables { basis, wanted, coefficients: OnceLock::new() }))
    };
    TABLES.try_get(wanted, half, make)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_made_once_and_the_oldest_are_let_go() {
        let wanted = |half| TablesWanted { half, highest: 3, first: 0, step: 1, instructions: Instructions::current() };
        let tables = |wanted| tables(wanted).expect("little memory");
        let first = tables(wanted(1001));
        assert!(Arc::ptr_eq(&first, &tables(wanted(1001))));
        assert!(Arc::ptr_eq(&first.basis, &tables(TablesWanted { first: 1, step: 2, ..wanted(1001) }).basis));
        for half in 2000..2040 {
            let _ = tables(wanted(half));
        }
        let kept = TABLES.0.lock().expect("no test panics with the lock");
        assert!(kept.iter().map(|(_, size, _)| size).sum::<usize>() <= KEPT);
        assert!(!kept.iter().any(|(one, ..)| *one == wanted(1001)));
    }
}
