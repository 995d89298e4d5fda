//! Work cut into pieces, done by several threads. The only user of rayon.
//!
//! The calling thread never joins the pool: it watches, so that it can show progress and be interrupted. The pool belongs to this
//! process; a process that was forked makes its own, since threads do not survive a fork.

use std::cell::{Cell, RefCell};
use std::io;
use std::mem;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use rayon::{ThreadBuilder, ThreadPool, ThreadPoolBuilder};

use crate::error::Error;
use crate::exec::memory;

/// The calling thread calls the watch at least this often.
const WATCH: Duration = Duration::from_millis(20);

/// Called on the calling thread, at least every 20 ms and at the end, with the work done so far and all of it. Returning `false`
/// cancels what is left.
pub type Watch<'a> = dyn FnMut(usize, usize) -> bool + 'a;

/// The watch of a part of the work: what it is told of its own is told as this part of the whole.
pub fn part_of<'a>(
    watch: &'a mut Watch<'_>,
    part: Range<usize>,
    whole: usize,
) -> impl FnMut(usize, usize) -> bool + 'a {
    move |done, total| {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the length of the part")]
        let share = (part.len() as f64 * (done as f64 / total.max(1) as f64)) as usize;
        watch(part.start + share, whole)
    }
}

/// Which part of all work each piece is, one after the other, and all of it.
pub(crate) fn parts(lengths: impl Iterator<Item = usize>) -> (Vec<Range<usize>>, usize) {
    let mut whole = 0;
    let part = |length| {
        let start = whole;
        whole += length;
        start..whole
    };
    let parts = lengths.map(part).collect();
    (parts, whole)
}

/// How many threads a request means: itself, or all processors that this process may use.
#[must_use]
pub fn workers(request: Option<NonZeroUsize>) -> NonZeroUsize {
    request.unwrap_or_else(|| thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))
}

/// Rows in a piece of work.
pub(crate) const ROWS: usize = 8192;

/// A piece of work and how much of the whole it is.
#[derive(Debug)]
pub(crate) struct Piece<P> {
    pub(crate) size: usize,
    pub(crate) content: P,
}

/// Called repeatedly by long pieces of work: whether to go on. After `false` the results of a piece are discarded.
pub(crate) type GoOn<'a> = dyn Fn() -> bool + 'a;

/// Does every piece once, each thread with its own scratch. With one worker, or one piece, no other thread is bothered.
pub(crate) fn run<P: Send, S>(
    pieces: Vec<Piece<P>>,
    workers: NonZeroUsize,
    scratch: impl Fn() -> S + Sync,
    work: impl Fn(P, &mut S) + Sync,
    watch: &mut Watch<'_>,
) -> Result<(), Error> {
    run_long(pieces, workers, scratch, |piece, scratch, _| work(piece, scratch), watch)
}

/// The same for pieces that may take longer than 20 ms and therefore ask whether to go on.
pub(crate) fn run_long<P: Send, S>(
    pieces: Vec<Piece<P>>,
    workers: NonZeroUsize,
    scratch: impl Fn() -> S + Sync,
    work: impl Fn(P, &mut S, &GoOn<'_>) + Sync,
    watch: &mut Watch<'_>,
) -> Result<(), Error> {
    let total = pieces.iter().map(|piece| piece.size).sum();
    let workers = workers.get().min(pieces.len());
    let queue = Mutex::new(pieces.into_iter());
    let worker = |account: &dyn Fn(usize), go_on: &GoOn<'_>| {
        let mut scratch = scratch();
        while go_on() {
            let Some(piece) = queue.lock().unwrap_or_else(PoisonError::into_inner).next() else { break };
            work(piece.content, &mut scratch, go_on);
            account(piece.size);
        }
    };
    // What is the same for every kind of work is compiled once.
    let finished =
        if workers <= 1 { run_here(&worker, total, watch) } else { run_in_pool(&worker, total, workers, watch)? };
    if finished && watch(total, total) { Ok(()) } else { Err(Error::Cancelled) }
}

/// Takes piece after piece while the second function says so, and tells the first the size of each that is done.
type Worker<'a> = dyn Fn(&dyn Fn(usize), &GoOn<'_>) + Sync + 'a;

/// Ranges of rows, as pieces of work.
pub(crate) fn ranges(rows: usize) -> Vec<Piece<Range<usize>>> {
    let ranges = (0..rows).step_by(ROWS).map(|first| first..rows.min(first + ROWS));
    ranges.map(|range| Piece { size: range.len(), content: range }).collect()
}

/// Does every piece once and returns what each gave, in their order.
pub(crate) fn map<P: Send, S, R: Send>(
    pieces: Vec<Piece<P>>,
    workers: NonZeroUsize,
    scratch: impl Fn() -> S + Sync,
    work: impl Fn(P, &mut S) -> R + Sync,
    watch: &mut Watch<'_>,
) -> Result<Vec<R>, Error> {
    let results: Vec<Mutex<Option<R>>> = pieces.iter().map(|_| Mutex::new(None)).collect();
    let numbered = pieces.into_iter().enumerate();
    let pieces = numbered.map(|(number, Piece { size, content })| Piece { size, content: (number, content) }).collect();
    let store = |(number, content): (usize, P), scratch: &mut S| {
        let result = work(content, scratch);
        *results[number].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
    };
    run(pieces, workers, scratch, store, watch)?;
    Ok(results.into_iter().filter_map(|result| result.into_inner().unwrap_or_else(PoisonError::into_inner)).collect())
}

fn run_here(worker: &Worker<'_>, total: usize, watch: &mut Watch<'_>) -> bool {
    let watch = RefCell::new(watch);
    let (done, last, going) = (Cell::new(0), Cell::new(Instant::now()), Cell::new(true));
    let go_on = || {
        if going.get() && last.get().elapsed() >= WATCH {
            going.set((*watch.borrow_mut())(done.get(), total));
            last.set(Instant::now());
        }
        going.get()
    };
    worker(&|size| done.set(done.get() + size), &go_on);
    going.get()
}

fn run_in_pool(worker: &Worker<'_>, total: usize, workers: usize, watch: &mut Watch<'_>) -> Result<bool, Error> {
    let done = AtomicUsize::new(0);
    let cancelled = AtomicBool::new(false);
    let active = Active { count: Mutex::new(workers), none_left: Condvar::new() };
    let account = |size| {
        done.fetch_add(size, Ordering::Relaxed);
    };
    let go_on = || !cancelled.load(Ordering::Relaxed);
    pool(workers)?.in_place_scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|_| {
                let _leaving = Leaving(&active);
                worker(&account, &go_on);
            });
        }
        while active.wait() {
            if !watch(done.load(Ordering::Relaxed), total) {
                cancelled.store(true, Ordering::Relaxed);
            }
        }
    });
    Ok(!cancelled.into_inner())
}

/// Threads that still work on a call.
struct Active {
    count: Mutex<usize>,
    none_left: Condvar,
}

impl Active {
    /// Waits until no thread is left or it is time to look up, and returns whether one is left.
    fn wait(&self) -> bool {
        let count = self.count.lock().unwrap_or_else(PoisonError::into_inner);
        let (count, _) =
            self.none_left.wait_timeout_while(count, WATCH, |count| *count > 0).unwrap_or_else(PoisonError::into_inner);
        *count > 0
    }
}

/// Counts a thread out when it is done, also when it panics.
struct Leaving<'a>(&'a Active);

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        let mut count = self.0.count.lock().unwrap_or_else(PoisonError::into_inner);
        *count -= 1;
        if *count == 0 {
            self.0.none_left.notify_one();
        }
    }
}

/// A pool and the process that made it.
struct Owned {
    process: u32,
    pool: Arc<ThreadPool>,
}

impl Owned {
    /// Whether the pool's threads live in a process and are as many as wanted.
    fn serves(&self, process: u32, threads: usize) -> bool {
        self.process == process && self.pool.current_num_threads() >= threads
    }
}

/// The newest pool.
static POOL: Mutex<Option<Owned>> = Mutex::new(None);

/// Bytes that a thread needs to begin: its stack, and a little beside it.
const THREAD: usize = 9 << 18;

/// Addresses that the C library reserves for a thread's allocations, if there are so many.
const ARENA: usize = 1 << 27;

/// Where there is no memory for so many threads, the lack of memory is why there are none.
const SOME: usize = 16;

/// How often the lock of the newest pool is tried. It is held for the copy of a pointer.
const TRIES: usize = 100;

/// The newest pool, or `None` where its lock cannot be had: a fork may leave it locked by a thread that the child does not have.
fn newest() -> Option<MutexGuard<'static, Option<Owned>>> {
    for _ in 0..TRIES {
        match POOL.try_lock() {
            Ok(newest) => return Some(newest),
            Err(TryLockError::Poisoned(newest)) => return Some(newest.into_inner()),
            Err(TryLockError::WouldBlock) => thread::yield_now(),
        }
    }
    None
}

thread_local! {
    /// Something that is dropped when its thread ends, as the pool's own are.
    static DROPPED: Vec<u8> = const { Vec::new() };
}

/// Begins one thread of a pool, and waits until it has what it needs: for what is dropped at its end a thread asks the C library for memory,
/// which ends the process where there is none. Threads that began side by side would take it from each other, since each may take addresses for
/// allocations of its own. A thread that has none of its own cannot use what is free among those of others, so less must not do.
fn begin(thread: ThreadBuilder) -> io::Result<()> {
    memory::ask_for(THREAD + ARENA).map_err(|error| io::Error::new(io::ErrorKind::OutOfMemory, error.to_string()))?;
    let (begun, wait) = mpsc::channel();
    let builder = match thread.name() {
        Some(name) => thread::Builder::new().name(name.to_owned()),
        None => thread::Builder::new(),
    };
    builder.spawn(move || {
        DROPPED.with(|_| ());
        // Nobody waits any more only where the caller has ended.
        let _ = begun.send(());
        drop(begun);
        thread.run();
    })?;
    // A thread that ended at once has nothing to wait for.
    let _ = wait.recv();
    Ok(())
}

/// A pool of so many threads, or of as many as there is memory for.
fn with_at_most(threads: usize) -> Result<ThreadPool, Error> {
    memory::ask_for(threads.saturating_mul(THREAD))?;
    let threads = memory::how_many(threads, THREAD + ARENA);
    if threads == 0 {
        return Err(Error::Memory { bytes: THREAD + ARENA });
    }
    let builder = ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("tvident-{index}"));
    builder.spawn_handler(begin).build().map_err(|error| match memory::ask_for(threads.min(SOME) * (THREAD + ARENA)) {
        Ok(()) => Error::Threads { threads, cause: error.to_string() },
        Err(error) => error,
    })
}

/// The pool of this process, with at least so many threads if there is memory for them.
///
/// The threads of a pool that is outgrown end with the last call that uses it.
fn pool(threads: usize) -> Result<Arc<ThreadPool>, Error> {
    let process = std::process::id();
    if let Some(newest) = newest()
        && let Some(owned) = newest.as_ref().filter(|owned| owned.serves(process, threads))
    {
        return Ok(Arc::clone(&owned.pool));
    }
    let pool = with_at_most(threads)?;
    // Threads that begin when memory has run out end the process.
    pool.broadcast(|_| ());
    let pool = Arc::new(pool);
    let fresh = Owned { process, pool: Arc::clone(&pool) };
    // A call that was faster may have stored a larger pool; then this one ends with its call.
    let outgrown = newest().and_then(|mut newest| {
        let is_outgrown = newest.as_ref().is_none_or(|owned| !owned.serves(process, fresh.pool.current_num_threads()));
        if is_outgrown { newest.replace(fresh) } else { None }
    });
    if let Some(outgrown) = outgrown.filter(|owned| owned.process != process) {
        // Ending threads takes locks, which threads that did not survive the fork may hold.
        mem::forget(outgrown);
    }
    Ok(pool)
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    fn pieces(count: usize) -> Vec<Piece<usize>> {
        (0..count).map(|content| Piece { size: 1, content }).collect()
    }

    fn threads(count: usize) -> NonZeroUsize {
        NonZeroUsize::new(count).expect("not zero")
    }

    #[test]
    fn every_piece_is_done_once_by_any_number_of_workers() {
        for workers in [1, 2, 3, 40] {
            let sum = AtomicUsize::new(0);
            let work = |content: usize, (): &mut ()| {
                sum.fetch_add(content, Ordering::Relaxed);
            };
            let mut last = (0, 0);
            let result = run(pieces(1000), threads(workers), || (), work, &mut |done, total| {
                last = (done, total);
                true
            });
            assert_eq!(result, Ok(()));
            assert_eq!(sum.into_inner(), 999 * 1000 / 2);
            assert_eq!(last, (1000, 1000));
        }
    }

    #[test]
    fn parts_follow_one_another() {
        assert_eq!(parts([3, 0, 4].into_iter()), (vec![0..3, 3..3, 3..7], 7));
        assert_eq!(parts([].into_iter()), (Vec::new(), 0));
    }

    #[test]
    fn a_watch_that_says_no_cancels_within_a_few_pieces() {
        for workers in [1, 2] {
            let count = AtomicUsize::new(0);
            let work = |_, (): &mut ()| {
                count.fetch_add(1, Ordering::Relaxed);
                thread::sleep(Duration::from_millis(5));
            };
            let result = run(pieces(1000), threads(workers), || (), work, &mut |_, _| false);
            assert_eq!(result, Err(Error::Cancelled));
            assert!(count.into_inner() < 100);
        }
    }

    #[test]
    fn a_pool_is_kept_and_calls_go_on_without_it() {
        // No other test wants as many threads.
        let kept = [pool(64), pool(64)].map(|pool| pool.expect("threads"));
        assert!(Arc::ptr_eq(&kept[0], &kept[1]));
        let names = kept[0].broadcast(|own| (own.index(), thread::current().name().map(str::to_owned)));
        assert!(names.into_iter().all(|(index, name)| name == Some(format!("tvident-{index}"))));
        // As a fork may leave it.
        let locked = POOL.lock().expect("no thread panics with the lock");
        let result = run(pieces(10), threads(2), || (), |_, (): &mut ()| (), &mut |_, _| true);
        drop(locked);
        assert_eq!(result, Ok(()));
    }

    #[test]
    fn a_panic_reaches_the_caller() {
        for workers in [1, 2] {
            let work = |content: usize, (): &mut ()| assert!(content < 5, "piece {content}");
            let call = || run(pieces(10), threads(workers), || (), work, &mut |_, _| true);
            let panic = catch_unwind(AssertUnwindSafe(call)).expect_err("a piece panics");
            assert!(panic.downcast_ref::<String>().is_some_and(|message| message.starts_with("piece")));
        }
    }
}
