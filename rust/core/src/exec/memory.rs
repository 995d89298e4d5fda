//! Memory whose size a caller decides.
//!
//! Where memory runs out in the midst of work, Rust ends the process. So what grows with a record or a window is asked for before.

use crate::error::Error;

/// So little memory is not asked for.
const LITTLE: usize = 1 << 20;

/// So much is asked for at least. Glibc learns from what is given back, up to 32 MB: later columns of that size would not come from the
/// system, as zeros that cost nothing, but from its heap.
const LEAST: usize = 33 << 20;

/// Asks the system for memory and gives it back: work that follows will find it.
pub(crate) fn ask_for(bytes: usize) -> Result<(), Error> {
    if bytes < LITTLE {
        return Ok(());
    }
    let mut memory: Vec<u8> = Vec::new();
    let got = memory.try_reserve_exact(bytes.max(LEAST));
    // Or the compiler sees that nobody needs it.
    std::hint::black_box(&memory);
    got.map_err(|_| Error::Memory { bytes })
}

/// How many parts of so many bytes there is memory for side by side, of some that are wanted.
pub(crate) fn how_many(wanted: usize, bytes: usize) -> usize {
    let mut parts: Vec<Vec<u8>> = Vec::new();
    while parts.len() < wanted {
        let mut part = Vec::new();
        if part.try_reserve_exact(bytes).is_err() {
            break;
        }
        parts.push(std::hint::black_box(part));
    }
    parts.len()
}

/// Gives the memory that was freed back to the system, where the C library keeps it: glibc keeps columns of up to 32 MB for reuse, and beside
/// results of a long record what was needed on the way to them would still be there.
pub(crate) fn give_back() {
    // SAFETY: only memory that nobody uses is given back.
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    unsafe {
        libc::malloc_trim(0)
    };
}

/// Asks for memory for so many numbers, of 8 bytes each.
pub(crate) fn ask_for_numbers(count: usize) -> Result<(), Error> {
    ask_for(count.saturating_mul(size_of::<f64>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_there_is_can_be_had_and_nothing_else() {
        assert_eq!(ask_for(1 << 24), Ok(()));
        for bytes in [1 << 60, usize::MAX] {
            assert_eq!(ask_for(bytes), Err(Error::Memory { bytes }));
        }
        assert_eq!(ask_for_numbers(usize::MAX / 2), Err(Error::Memory { bytes: usize::MAX }));
        assert_eq!([0, 3].map(|wanted| how_many(wanted, 1 << 24)), [0, 3]);
        assert_eq!(how_many(3, 1 << 60), 0);
    }
}
