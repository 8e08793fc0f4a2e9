//! A queue of a fixed number of places, for what waits in a controller: copied and written down as a whole, without a
//! panic path.

/// At most `D` items, first in, first out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ring<T: Copy, const D: usize> {
    #[cfg_attr(
        feature = "serde",
        serde(
            with = "crate::arrays",
            bound(serialize = "T: serde::Serialize", deserialize = "T: serde::Deserialize<'de>")
        )
    )]
    places: [T; D],
    /// Place of the first.
    head: u32,
    length: u32,
}

impl<T: Copy + Default, const D: usize> Default for Ring<T, D> {
    fn default() -> Self {
        Self { places: [T::default(); D], head: 0, length: 0 }
    }
}

impl<T: Copy, const D: usize> Ring<T, D> {
    /// How many wait.
    #[inline]
    pub const fn len(&self) -> usize {
        self.length as usize
    }

    /// Whether none waits.
    #[inline]
    pub const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// How many more there is room for.
    #[inline]
    pub const fn room(&self) -> usize {
        D.saturating_sub(self.len())
    }

    fn place(&self, number: usize) -> usize {
        let place = (self.head as usize).wrapping_add(number);
        // Neither is beyond the end: less than two rounds.
        if place < D { place } else { place.wrapping_sub(D) }
    }

    /// One of them, the first is number 0.
    #[inline]
    pub fn get(&self, number: usize) -> Option<&T> {
        if number < self.len() { self.places.get(self.place(number)) } else { None }
    }

    /// The same, to change it.
    #[inline]
    pub fn get_mut(&mut self, number: usize) -> Option<&mut T> {
        let place = self.place(number);
        if number < self.len() { self.places.get_mut(place) } else { None }
    }

    /// The one that came last.
    pub fn last(&self) -> Option<&T> {
        self.get(self.len().wrapping_sub(1))
    }

    /// The same, to change it.
    pub fn last_mut(&mut self) -> Option<&mut T> {
        self.get_mut(self.len().wrapping_sub(1))
    }

    /// All of them in their order.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &T> {
        (0..self.len()).filter_map(|number| self.get(number))
    }

    /// Puts one behind the others; false if there is no room.
    pub fn push(&mut self, item: T) -> bool {
        if self.room() == 0 {
            return false;
        }
        let place = self.place(self.len());
        if let Some(free) = self.places.get_mut(place) {
            *free = item;
        }
        self.length = self.length.wrapping_add(1);
        true
    }

    /// Takes the first.
    pub fn pop(&mut self) -> Option<T> {
        let first = self.get(0).copied()?;
        self.head = self.place(1) as u32;
        self.length = self.length.wrapping_sub(1);
        Some(first)
    }

    /// Keeps so many of them, the first.
    pub fn truncate(&mut self, length: usize) {
        self.length = self.length.min(u32::try_from(length).unwrap_or(u32::MAX));
    }

    /// None is left.
    pub fn clear(&mut self) {
        self.length = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::Ring;
    use proptest::prelude::*;
    use std::collections::VecDeque;

    proptest! {
        #[test]
        fn is_a_queue(steps in prop::collection::vec((0u8..8, any::<u16>()), 1..200)) {
            let mut ring = Ring::<u16, 5>::default();
            let mut queue = VecDeque::new();
            for (step, number) in steps {
                match step {
                    0..4 => {
                        let fits = queue.len() < 5;
                        if fits {
                            queue.push_back(number);
                        }
                        prop_assert_eq!(ring.push(number), fits);
                    }
                    4..7 => prop_assert_eq!(ring.pop(), queue.pop_front()),
                    _ => {
                        let length = usize::from(number % 6);
                        queue.truncate(length);
                        ring.truncate(length);
                    }
                }
                prop_assert!(ring.iter().eq(queue.iter()));
                prop_assert_eq!((ring.last(), ring.room()), (queue.back(), 5 - queue.len()));
                prop_assert_eq!(ring.get(queue.len()), None);
            }
        }
    }
}
