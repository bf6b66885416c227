//! The system's allocator with counters a thread: what the second-frame check asks, and the bound of memory.
//!
//! A program that runs the check declares `#[global_allocator] static ALLOCATOR: CountingAllocator =
//! CountingAllocator;`. Counters are a thread's own, so that a progress bar or another test does not count, and a
//! technique that runs in a pool of one thread is counted as a whole. The cost is one addition an allocation, and
//! techniques do not allocate in frames that are timed.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// The system's allocator, counted.
#[derive(Debug, Clone, Copy, Default)]
pub struct CountingAllocator;

/// Set by the first allocation that goes through the counting allocator.
static INSTALLED: AtomicBool = AtomicBool::new(false);

thread_local! {
    // Constant and without a destructor: reading it allocates nothing and works while a thread ends.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static BYTES: Cell<u64> = const { Cell::new(0) };
}

/// Allocations and reallocations of this thread so far; `None` if the program has another allocator.
pub fn allocations_of_this_thread() -> Option<u64> {
    INSTALLED.load(Ordering::Relaxed).then(|| ALLOCATIONS.with(Cell::get))
}

/// Bytes that this thread has asked for so far, given back or not; `None` if the program has another allocator.
pub fn bytes_of_this_thread() -> Option<u64> {
    INSTALLED.load(Ordering::Relaxed).then(|| BYTES.with(Cell::get))
}

fn count(bytes: usize) {
    if !INSTALLED.load(Ordering::Relaxed) {
        INSTALLED.store(true, Ordering::Relaxed);
    }
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
    let _ = BYTES.try_with(|count| count.set(count.get() + bytes as u64));
}

// SAFETY: every call is handed to the system's allocator as it is.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.dealloc(pointer, layout) }
    }
}
