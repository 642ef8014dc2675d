//! Queues between tasks of different priorities.
//!
//! A push or a pop is a few instructions with interrupts off. heapless' queues without locks
//! forget their length in their two ends, and then divide by it: a division that can panic.

use core::cell::RefCell;
use cortex_m::interrupt::{Mutex, free};
use heapless::Deque;

/// At most `N` values.
pub struct Queue<T, const N: usize>(Mutex<RefCell<Deque<T, N>>>);

impl<T, const N: usize> Queue<T, N> {
    /// Empty.
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Deque::new())))
    }

    fn with<R>(&self, default: R, f: impl FnOnce(&mut Deque<T, N>) -> R) -> R {
        // Nobody else holds it: everybody does so with interrupts off.
        free(|cs| match self.0.borrow(cs).try_borrow_mut() {
            Ok(mut queue) => f(&mut queue),
            Err(_) => default,
        })
    }

    /// Puts a value at the end; whether there was room.
    #[inline]
    pub fn push(&self, value: T) -> bool {
        self.with(false, |queue| queue.push_back(value).is_ok())
    }

    /// Takes the oldest value.
    #[inline]
    pub fn pop(&self) -> Option<T> {
        self.with(None, Deque::pop_front)
    }

    /// Whether nothing waits.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.with(true, |queue| queue.is_empty())
    }

    /// Whether there is no room.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.with(true, |queue| queue.is_full())
    }
}

impl<T: Copy, const N: usize> Queue<T, N> {
    /// The oldest value, which stays.
    pub fn peek(&self) -> Option<T> {
        self.with(None, |queue| queue.front().copied())
    }
}
