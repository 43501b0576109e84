//! Which lists of surfaces rays have begun with, as they met them: most rays begin as others did, and what a list is in
//! canonical order is asked of new ones only.

/// The list without a surface.
pub(crate) const NONE_YET: u32 = 0;

/// A slot that is free. No key is like it, since no surface has the highest number.
const FREE: u64 = u64::MAX;

/// Slots for so many lists: half of them are free at least.
fn slots(most: usize) -> usize {
    (2 * most.max(1)).next_power_of_two()
}

/// A tree of lists, by what each goes on from and its last surface. Memory grows only when it is
/// renewed for more.
#[derive(Debug, Clone, Default)]
pub(crate) struct Beginnings {
    /// A power of two; a list's number is its slot's plus one.
    keys: Vec<u64>,
}

impl Beginnings {
    /// None, and memory for so many.
    pub(crate) fn with_capacity(most: usize) -> Self {
        Self {
            keys: Vec::with_capacity(slots(most)),
        }
    }

    /// Forgets all, and makes room for `most` lists.
    pub(crate) fn renew(&mut self, most: usize) {
        self.keys.clear();
        self.keys.resize(slots(most), FREE);
    }

    /// The number of the list that goes on from another one with a surface, and whether it is new.
    #[inline(always)]
    pub(crate) fn go_on(&mut self, list: u32, surface: u32) -> (u32, bool) {
        let key = u64::from(list) << 32 | u64::from(surface);
        let mask = self.keys.len() - 1;
        let mut slot = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as usize & mask;
        loop {
            let there = &mut self.keys[slot];
            if *there == key {
                return (slot as u32 + 1, false);
            }
            if *there == FREE {
                *there = key;
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

    /// Lists of up to three surfaces out of nine, most of them again and again: new is what was not there.
    #[test]
    fn a_list_is_new_once() {
        let mut beginnings = Beginnings::default();
        for round in 0..3 {
            beginnings.renew(1000);
            let mut known: Vec<Vec<u32>> = Vec::new();
            let mut numbers: Vec<u32> = Vec::new();
            for ray in 0..400 {
                let mut list = Vec::new();
                let mut number = NONE_YET;
                for step in 0..3 {
                    let surface = mix(1000 * round + 3 * ray + step) % 9;
                    list.push(surface as u32);
                    let (next, is_new) = beginnings.go_on(number, surface as u32);
                    number = next;
                    let place = known.iter().position(|other| *other == list);
                    assert_eq!(is_new, place.is_none(), "{list:?}");
                    match place {
                        Some(place) => assert_eq!(numbers[place], number, "{list:?}"),
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
