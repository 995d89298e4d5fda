//! Memory for results of a whole record.

use crate::error::Error;
use crate::exec::memory::ask_for;

/// Bytes of a huge page, and of a small one.
#[cfg(target_os = "linux")]
const HUGE: usize = 1 << 21;
#[cfg(target_os = "linux")]
const PAGE: usize = 1 << 12;

/// A column of zeros. For a long one the system is asked for huge pages, as NumPy asks for its arrays: a page that is touched first costs
/// about as much as writing it, and an hour of results has 7000 small ones a column.
///
/// # Errors
/// If there is not so much memory.
pub(crate) fn zeros<T: Copy + Default>(count: usize) -> Result<Vec<T>, Error> {
    ask_for(count.saturating_mul(size_of::<T>()))?;
    let column = vec![T::default(); count];
    #[cfg(target_os = "linux")]
    if count * size_of::<T>() >= 2 * HUGE {
        let before = column.as_ptr().align_offset(PAGE);
        let first = column[before.min(count)..].as_ptr();
        // SAFETY: the range begins with a page of the column and ends within it, or with the page of its last number; advice changes no
        // contents. Refused advice is no error.
        unsafe { libc::madvise(first.cast_mut().cast(), (count - before) * size_of::<T>(), libc::MADV_HUGEPAGE) };
    }
    Ok(column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_zeros_however_many() {
        for count in [0, 1, 1000, 1 << 19, (1 << 20) + 3] {
            let numbers = zeros::<f64>(count).expect("a few megabytes");
            assert!(numbers.len() == count && numbers.iter().all(|&value| value == 0.0));
            assert_eq!(zeros::<u8>(count).map(|column| column.len()), Ok(count));
        }
    }
}
