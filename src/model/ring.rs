//! This ring keeps the newest elements of a series without a gap.

/// Keeps the last `N` elements.
#[derive(Debug, Clone)]
pub struct Ring<T, const N: usize> {
    places: [T; N],
    /// The place of the next element: in a full ring, that of the oldest one.
    next: usize,
    filled: usize,
}

impl<T: Copy, const N: usize> Ring<T, N> {
    /// Creates a ring without elements; its unused places hold `filling`.
    pub(super) const fn without_elements(filling: T) -> Self {
        Self { places: [filling; N], next: 0, filled: 0 }
    }

    /// Removes all elements, because a gap ends the series.
    pub fn clear(&mut self) {
        (self.next, self.filled) = (0, 0);
    }

    /// Adds the newest element; a full ring drops its oldest.
    pub fn add(&mut self, element: T) {
        if let Some(place) = self.places.get_mut(self.next) {
            *place = element;
        }
        self.next = (self.next + 1) % N;
        self.filled = (self.filled + 1).min(N);
    }

    /// Returns the number of elements.
    pub(super) const fn len(&self) -> usize {
        self.filled
    }

    /// Returns an element by its number, 0 for the oldest.
    pub(super) fn get(&self, number: usize) -> Option<&T> {
        // A ring that is not full begins at place 0.
        self.places.get(if self.filled == N { (self.next + number) % N } else { number })
    }

    /// Returns the elements, oldest first; `None` until the ring is full.
    #[must_use]
    pub fn snapshot(&self) -> Option<[T; N]> {
        (self.filled == N).then(|| core::array::from_fn(|number| self.places[(self.next + number) % N]))
    }
}
