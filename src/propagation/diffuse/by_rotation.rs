//! Lists of all ray rotations in one piece of memory.
//!
//! Propagation thread. The lists of sixteen rotations together vary less than each of them: memory for the sum and a little more
//! is enough, where sixteen lists of their own would each need the most that one can have.

use std::ops::Range;

use crate::propagation::rays::directions::ROTATIONS;

const LISTS: usize = ROTATIONS as usize;

/// Memory beyond what is needed when a list outgrows it: an eighth.
const SPARE: usize = 8;

/// A list for each rotation.
#[derive(Debug, Clone)]
pub(crate) struct ByRotation<T> {
    /// The lists, one after the other.
    items: Vec<T>,
    ends: [u32; LISTS],
    /// Which rotations have had a list, one a bit.
    filled: u16,
}

impl<T> Default for ByRotation<T> {
    fn default() -> Self {
        Self {
            items: Vec::new(),
            ends: [0; LISTS],
            filled: 0,
        }
    }
}

impl<T: Copy> ByRotation<T> {
    fn range(&self, rotation: usize) -> Range<usize> {
        let start = rotation.checked_sub(1).map_or(0, |last| self.ends[last]);
        start as usize..self.ends[rotation] as usize
    }

    /// The list of a rotation.
    pub(crate) fn of(&self, rotation: usize) -> &[T] {
        &self.items[self.range(rotation)]
    }

    /// The items of all rotations, those of the first one first.
    pub(crate) fn all_mut(&mut self) -> &mut [T] {
        &mut self.items
    }

    /// Index of a rotation's first item among all.
    pub(crate) fn start(&self, rotation: usize) -> usize {
        self.range(rotation).start
    }

    /// Replaces the list of a rotation. Allocates if all lists together are longer than the memory.
    pub(crate) fn replace(&mut self, rotation: usize, list: &[T]) {
        let range = self.resize(rotation, list.len(), list.first());
        self.items[range].copy_from_slice(list);
    }

    /// Replaces the list of a rotation by `count` times one item, as [`Self::replace`].
    pub(crate) fn replace_by(&mut self, rotation: usize, count: usize, item: T) {
        let range = self.resize(rotation, count, Some(&item));
        self.items[range].fill(item);
    }

    /// Gives the list of a rotation another length; its items are arbitrary. Returns where they are.
    fn resize(&mut self, rotation: usize, count: usize, filler: Option<&T>) -> Range<usize> {
        let old = self.range(rotation);
        let (whole, end) = (self.items.len(), old.start + count);
        let wanted = whole - old.len() + count;
        self.filled |= 1 << rotation;
        if wanted > self.items.capacity() {
            // Other rotations' lists will be about as long.
            let expected = wanted * LISTS / self.filled.count_ones() as usize;
            self.items
                .reserve_exact(expected + expected / SPARE - whole);
        }
        if let (Some(&filler), true) = (filler, wanted > whole) {
            self.items.resize(wanted, filler);
        }
        self.items.copy_within(old.end..whole, end);
        self.items.truncate(wanted);
        for last in &mut self.ends[rotation..] {
            *last = (*last as usize - old.len() + count) as u32;
        }
        old.start..end
    }

    /// Removes what is not `kept` from the list of a rotation.
    pub(crate) fn retain(&mut self, rotation: usize, kept: impl Fn(&T) -> bool) {
        let old = self.range(rotation);
        let mut end = old.start;
        for index in old.clone() {
            if kept(&self.items[index]) {
                self.items[end] = self.items[index];
                end += 1;
            }
        }
        let removed = old.end - end;
        self.items.copy_within(old.end.., end);
        self.items.truncate(self.items.len() - removed);
        for last in &mut self.ends[rotation..] {
            *last -= removed as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::mix;

    #[test]
    fn lists_are_those_given_last() {
        let mut lists = ByRotation::default();
        let mut expected = vec![Vec::new(); LISTS];
        for round in 0..500 {
            let bits = mix(round);
            let (rotation, count) = ((bits % 16) as usize, (bits >> 8) % 40);
            expected[rotation] = (0..count).map(|item| bits ^ item).collect();
            lists.replace(rotation, &expected[rotation]);
            if bits >> 40 & 3 == 0 {
                lists.retain(rotation, |item| item & 1 == 0);
                expected[rotation].retain(|item| item & 1 == 0);
            }
            for (rotation, list) in expected.iter().enumerate() {
                assert_eq!(lists.of(rotation), list, "round {round}");
            }
        }
    }

    #[test]
    fn lists_that_vary_by_a_tenth_need_memory_once() {
        let mut lists = ByRotation::default();
        for round in 0..20 * LISTS {
            let list = vec![7; 95 + (mix(round as u64) % 10) as usize];
            let before = lists.items.capacity();
            lists.replace(round % LISTS, &list);
            let is_same = lists.items.capacity() == before;
            assert!(is_same || before == 0, "round {round}");
        }
        assert!(lists.items.capacity() < LISTS * 125);
    }
}
