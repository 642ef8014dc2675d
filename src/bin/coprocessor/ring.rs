//! A ring of values from one task to another, without locks.
//!
//! Each end is moved by one task alone, so neither masks interrupts: a value is written before the end
//! that releases it, and read before the end that frees its place. The ends count on and on; the
//! length is a power of two, so a place is their low bits. One processor needs no barrier between its tasks:
//! what the compiler must not reorder is fenced. Hardware may stand in for a task at either end.
#![allow(
    unsafe_code,
    reason = "places that are written and read by address; each block says why it is sound"
)]

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicUsize, Ordering, compiler_fence};

/// Holds up to `N` values; `N` is a power of two.
pub struct Ring<T, const N: usize> {
    places: [UnsafeCell<MaybeUninit<T>>; N],
    written: AtomicUsize,
    read: AtomicUsize,
}

// SAFETY: `new` leaves one task at each end, and a place belongs to one end at a time.
unsafe impl<T: Send, const N: usize> Sync for Ring<T, N> {}

impl<T, const N: usize> Ring<T, N> {
    const MASK: usize = {
        assert!(N.is_power_of_two(), "a place is the low bits of a count");
        N - 1
    };

    /// Makes an empty ring.
    ///
    /// # Safety
    /// One task alone calls [`Ring::push`], and one alone [`Ring::front`] and [`Ring::pop`].
    pub const unsafe fn new() -> Self {
        Self {
            places: [const { UnsafeCell::new(MaybeUninit::uninit()) }; N],
            written: AtomicUsize::new(0),
            read: AtomicUsize::new(0),
        }
    }

    #[inline(always)]
    fn place(&self, count: usize) -> *mut T {
        // The low bits are always inside; the compiler sees that, too.
        self.places.get(count & Self::MASK).map_or(core::ptr::null_mut(), |place| place.get().cast())
    }

    /// Returns how many values wait.
    #[inline(always)]
    pub fn len(&self) -> usize {
        let len = self.written.load(Ordering::Relaxed).wrapping_sub(self.read.load(Ordering::Relaxed));
        compiler_fence(Ordering::Acquire);
        len
    }

    /// Puts a value at the end; whether there was room. For the writing task.
    #[inline(always)]
    pub fn push(&self, value: T) -> bool {
        self.push_with(|| value)
    }

    /// Makes a value and puts it at the end, where there is room; whether there was. For the writing task.
    #[inline(always)]
    pub fn push_with(&self, make: impl FnOnce() -> T) -> bool {
        if self.len() >= N {
            return false;
        }
        let written = self.written.load(Ordering::Relaxed);
        // SAFETY: the place is inside the ring and free, and this task alone writes.
        unsafe { self.place(written).write(make()) };
        compiler_fence(Ordering::Release);
        self.written.store(written.wrapping_add(1), Ordering::Relaxed);
        true
    }

    /// Takes the oldest value. For the reading task.
    #[inline(always)]
    pub fn pop(&self) -> Option<T> {
        if self.is_empty() {
            return None;
        }
        let read = self.read.load(Ordering::Relaxed);
        // SAFETY: the place has been written, and is read once before it is freed.
        let value = unsafe { self.place(read).read() };
        compiler_fence(Ordering::Release);
        self.read.store(read.wrapping_add(1), Ordering::Relaxed);
        Some(value)
    }

    /// Returns where the values lie, for hardware that writes or reads them in place of a task.
    pub fn places(&self) -> *mut T {
        self.place(0)
    }

    /// Counts values that hardware has written at the end, also over values that were not read. In place of
    /// [`Ring::push`].
    #[inline(always)]
    pub fn written(&self, count: usize) {
        compiler_fence(Ordering::Release);
        let written = self.written.load(Ordering::Relaxed);
        self.written.store(written.wrapping_add(count), Ordering::Relaxed);
    }

    /// Returns the oldest values as far as they lie behind each other, for hardware that reads them.
    pub fn oldest(&self) -> &[T] {
        let first = self.read.load(Ordering::Relaxed) & Self::MASK;
        let len = self.len().min(N - first);
        // SAFETY: the places are inside the ring and have been written; the writing task leaves them alone until they
        // are dropped.
        unsafe { core::slice::from_raw_parts(self.place(first), len) }
    }

    /// Drops values that have been read elsewhere, or must not be. For the reading task.
    #[inline(always)]
    pub fn drop_oldest(&self, count: usize) {
        compiler_fence(Ordering::Release);
        let read = self.read.load(Ordering::Relaxed);
        self.read.store(read.wrapping_add(count), Ordering::Relaxed);
    }

    /// Returns whether nothing waits.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns whether there is no room.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.len() >= N
    }
}
