//! A lock-free ring buffer from one task to another.
//!
//! Each count is advanced by one task only, so neither task masks interrupts: a value is written before the count
//! that releases it, and read before the count that frees its place. The counts run on without a reset; the length is
//! a power of two, so their low bits are the index. On one processor the tasks need no barriers, only compiler
//! fences. Hardware may replace the task at either end.
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
        assert!(N.is_power_of_two(), "the index is the low bits of a count");
        N - 1
    };

    /// Creates an empty ring.
    ///
    /// # Safety
    /// Only one task calls the methods for the writing task, such as [`Ring::push`], and only one those for the
    /// reading task, such as [`Ring::pop`].
    pub const unsafe fn new() -> Self {
        Self {
            places: [const { UnsafeCell::new(MaybeUninit::uninit()) }; N],
            written: AtomicUsize::new(0),
            read: AtomicUsize::new(0),
        }
    }

    #[inline(always)]
    fn place(&self, count: usize) -> *mut T {
        // The low bits are always in range; the compiler sees that, too.
        self.places.get(count & Self::MASK).map_or(core::ptr::null_mut(), |place| place.get().cast())
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        let len = self.written.load(Ordering::Relaxed).wrapping_sub(self.read.load(Ordering::Relaxed));
        compiler_fence(Ordering::Acquire);
        len
    }

    /// Appends a value; returns whether there was room. For the writing task.
    #[inline(always)]
    pub fn push(&self, value: T) -> bool {
        self.push_with(|| value)
    }

    /// Calls `make` and appends its value, if there is room; returns whether there was. For the writing task.
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

    /// Appends as many of the values as there is room for; returns their number. For the writing task.
    pub fn extend(&self, values: &[T]) -> usize
    where
        T: Copy,
    {
        let count = values.len().min(N.saturating_sub(self.len()));
        let written = self.written.load(Ordering::Relaxed);
        let to_end = count.min(N - (written & Self::MASK));
        // SAFETY: `count` values and places, of which the first `to_end` are in a row and the rest begin the buffer; the
        // places are free, and this task alone writes.
        unsafe {
            self.place(written).copy_from_nonoverlapping(values.as_ptr(), to_end);
            if count > to_end {
                self.place(0).copy_from_nonoverlapping(values.as_ptr().add(to_end), count - to_end);
            }
        }
        self.advance_write(count);
        count
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

    /// Returns the address of the buffer, for hardware that writes or reads it in place of a task.
    pub fn as_mut_ptr(&self) -> *mut T {
        self.place(0)
    }

    /// Counts values that hardware has appended, even over unread values. Replaces [`Ring::push`].
    #[inline(always)]
    pub fn advance_write(&self, count: usize) {
        compiler_fence(Ordering::Release);
        let written = self.written.load(Ordering::Relaxed);
        self.written.store(written.wrapping_add(count), Ordering::Relaxed);
    }

    /// Returns the oldest values, up to the end of the buffer, so that they can be read in place.
    pub fn oldest(&self) -> &[T] {
        let first = self.read.load(Ordering::Relaxed) & Self::MASK;
        let len = self.len().min(N - first);
        // SAFETY: the places are inside the ring and have been written; the writing task leaves them alone until they
        // are dropped.
        unsafe { core::slice::from_raw_parts(self.place(first), len) }
    }

    /// Drops values that have been read in place, or must not be read. For the reading task.
    #[inline(always)]
    pub fn drop_oldest(&self, count: usize) {
        compiler_fence(Ordering::Release);
        let read = self.read.load(Ordering::Relaxed);
        self.read.store(read.wrapping_add(count), Ordering::Relaxed);
    }

    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.len() >= N
    }
}
