//! Set of the sequence prefixes hit by rays: most rays share prefixes, and only new ones are brought into canonical order.

use crate::propagation::rays::directions::GOLDEN_RATIO_64;

/// Identifier of the empty prefix.
pub(crate) const EMPTY_PREFIX: u32 = 0;

/// A free slot. No key has this value, since no surface has the highest index.
const FREE: u64 = u64::MAX;

/// Slots for `count` prefixes, at least half of them free.
fn slots(count: usize) -> usize {
    (2 * count.max(1)).next_power_of_two()
}

/// A tree of prefixes, each identified by its parent and its last surface. Allocates only when it is reset for more prefixes
/// than ever before.
#[derive(Debug, Clone, Default)]
pub(crate) struct PrefixSet {
    /// Parent and surface; a power of two of slots. A prefix's identifier is its slot plus one.
    keys: Vec<u64>,
}

impl PrefixSet {
    /// Memory for `count` prefixes.
    pub(crate) fn with_capacity(count: usize) -> Self {
        Self {
            keys: Vec::with_capacity(slots(count)),
        }
    }

    /// Removes all prefixes and makes room for `count`.
    pub(crate) fn reset(&mut self, count: usize) {
        self.keys.clear();
        self.keys.resize(slots(count), FREE);
    }

    /// The identifier of a prefix extended by a surface, and whether it is new.
    #[inline(always)]
    pub(crate) fn extend(&mut self, prefix: u32, surface: u32) -> (u32, bool) {
        let key = u64::from(prefix) << 32 | u64::from(surface);
        let mask = self.keys.len() - 1;
        let mut slot = (key.wrapping_mul(GOLDEN_RATIO_64) >> 40) as usize & mask;
        loop {
            let found = &mut self.keys[slot];
            if *found == key {
                return (slot as u32 + 1, false);
            }
            if *found == FREE {
                *found = key;
                return (slot as u32 + 1, true);
            }
            slot = (slot + 1) & mask;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::mix;

    /// Compares with a list: sequences of up to three of nine surfaces, most of them repeated.
    #[test]
    fn a_prefix_is_new_once() {
        let mut prefixes = PrefixSet::default();
        for round in 0..3 {
            prefixes.reset(1000);
            let mut known: Vec<Vec<u32>> = Vec::new();
            let mut numbers: Vec<u32> = Vec::new();
            for ray in 0..400 {
                let mut list = Vec::new();
                let mut number = EMPTY_PREFIX;
                for step in 0..3 {
                    let surface = mix(1000 * round + 3 * ray + step) % 9;
                    list.push(surface as u32);
                    let (next, is_new) = prefixes.extend(number, surface as u32);
                    number = next;
                    let index = known.iter().position(|other| *other == list);
                    assert_eq!(is_new, index.is_none(), "{list:?}");
                    match index {
                        Some(index) => assert_eq!(numbers[index], number, "{list:?}"),
                        None => {
                            assert!(!numbers.contains(&number), "{list:?}");
                            known.push(list.clone());
                            numbers.push(number);
                        }
                    }
                }
            }
        }
    }
}
