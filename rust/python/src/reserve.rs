//! Memory in reserve, for the little that a call still needs when there is no more: Rust would end the process.
//!
//! The core asks for what is large before it needs it. What is small is allocated in too many places to ask in each: where the system has
//! no more, the reserve is given up, and the watch of the call sees to it that the call ends with a `MemoryError`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint;
use std::ptr;
use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering};
use std::thread;

/// Bytes of a part of the reserve. They are never touched, so they are addresses only, and no memory. More than the core asks for at
/// least (`exec/memory.rs`), and less than the 64 MiB that glibc takes as a heap of its own for a thread that allocates for the first
/// time: where it found room in place of a part, there would be none for others.
const BYTES: usize = 40 << 20;

/// Parts of the reserve, given up one after the other.
const PARTS: usize = 3;

/// Bytes of the stack that calls need, at most: 140 kB were seen, and what Python needs is beside them.
const STACK: usize = 1 << 18;

/// How often memory is tried again, since another thread may just be giving up a part.
const TRIES: usize = 100;

static RESERVE: [AtomicPtr<u8>; PARTS] = [const { AtomicPtr::new(ptr::null_mut()) }; PARTS];

/// What could not be had since the reserve was last filled, in bytes.
static MISSED: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: WithReserve = WithReserve;

/// Fills the reserve where it was given up. Returns the bytes that there are not, if so.
pub(crate) fn fill() -> Result<(), usize> {
    let empty = RESERVE.iter().filter(|part| part.load(Ordering::Acquire).is_null());
    let mut was_full = true;
    for part in empty {
        was_full = false;
        // SAFETY: the layout has a size.
        let fresh = unsafe { System.alloc(layout()) };
        if fresh.is_null() {
            return Err(BYTES);
        }
        if part.compare_exchange(ptr::null_mut(), fresh, Ordering::AcqRel, Ordering::Relaxed).is_err() {
            // SAFETY: another thread was faster, and nobody else knows of this memory.
            unsafe { System.dealloc(fresh, layout()) };
        }
    }
    if !was_full {
        MISSED.store(0, Ordering::Release);
    }
    Ok(())
}

/// Makes the calling thread's stack as long as calls need it. The stack of a process's first thread grows as it is used, and the process ends where there
/// is no memory for that.
#[inline(never)]
#[allow(clippy::large_stack_arrays, reason = "the stack is what it is for")]
pub(crate) fn grow_stack() {
    hint::black_box(&mut [0_u8; STACK]);
}

/// Bytes that could not be had since the reserve was last filled.
pub(crate) fn missed() -> Option<usize> {
    Some(MISSED.load(Ordering::Acquire)).filter(|&bytes| bytes > 0)
}

fn layout() -> Layout {
    Layout::new::<[u64; BYTES / 8]>()
}

/// The system's allocator, and the reserve where that has no more.
struct WithReserve;

// SAFETY: all memory comes from the system's allocator and goes back to it with the layout that it came with. Nothing here panics.
unsafe impl GlobalAlloc for WithReserve {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: what the caller promises.
        or_again(layout.size(), || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: what the caller promises.
        or_again(layout.size(), || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: what the caller promises; where there is no memory the old one stays as it is.
        or_again(size, || unsafe { System.realloc(place, layout, size) })
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: what the caller promises.
        unsafe { System.dealloc(place, layout) };
    }
}

#[inline]
fn or_again(bytes: usize, ask: impl Fn() -> *mut u8) -> *mut u8 {
    let place = ask();
    if place.is_null() { again(bytes, &ask) } else { place }
}

#[cold]
fn again(bytes: usize, ask: &dyn Fn() -> *mut u8) -> *mut u8 {
    if bytes >= BYTES {
        // The reserve is no help.
        return ptr::null_mut();
    }
    for turn in 0..TRIES {
        let part = RESERVE[turn % PARTS].swap(ptr::null_mut(), Ordering::AcqRel);
        if !part.is_null() {
            MISSED.fetch_max(bytes, Ordering::AcqRel);
            // SAFETY: whoever takes a part out of its place is the only one to have it.
            unsafe { System.dealloc(part, layout()) };
        }
        let place = ask();
        if !place.is_null() {
            return place;
        }
        thread::yield_now();
    }
    ptr::null_mut()
}
