//! Sequences of all ray rotations in a third of their memory.
//!
//! Propagation thread. A sequence is written as 16-bit words, one or three a surface: a source's sixteen rotations have some
//! 3,400 sequences in a concert hall, 18 KB instead of 67. Own.

use crate::propagation::diffuse::by_rotation::ByRotation;
use crate::propagation::image_source::sequence::Sequence;

/// Bit of a word with a sequence's last surface.
const LAST: u16 = 1 << 15;

/// Bits of a surface's index in one word; with all of them set the index is in the next two words, the lower half first.
const INDEX: u16 = LAST - 1;

/// The sequences of each rotation, in their order.
#[derive(Debug, Clone, Default)]
pub(crate) struct PackedSequences {
    words: ByRotation<u16>,
}

impl PackedSequences {
    /// Replaces the sequences of a rotation, none of them empty; `words` is scratch memory. Allocates if all together are longer than the
    /// memory.
    pub(crate) fn replace(&mut self, rotation: usize, list: &[Sequence], words: &mut Vec<u16>) {
        words.clear();
        for sequence in list {
            let mut last = 0;
            for &surface in sequence.surfaces() {
                last = words.len();
                match u16::try_from(surface) {
                    Ok(index) if index < INDEX => words.push(index),
                    _ => words.extend([INDEX, surface as u16, (surface >> 16) as u16]),
                }
            }
            if let Some(word) = words.get_mut(last) {
                *word |= LAST;
            }
        }
        self.words.replace(rotation, words);
    }

    /// The sequences of a rotation with up to `most` surfaces.
    pub(crate) fn of(&self, rotation: usize, most: usize) -> impl Iterator<Item = Sequence> {
        let mut words = self.words.of(rotation).iter().copied();
        std::iter::from_fn(move || {
            let (mut sequence, mut is_short) = (Sequence::EMPTY, true);
            loop {
                let word = words.next()?;
                let surface = match word & INDEX {
                    INDEX => u32::from(words.next()?) | u32::from(words.next()?) << 16,
                    index => index.into(),
                };
                if sequence.len() < most {
                    sequence.push(surface);
                } else {
                    is_short = false;
                }
                if word & LAST != 0 {
                    if is_short {
                        return Some(sequence);
                    }
                    (sequence, is_short) = (Sequence::EMPTY, true);
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::path::MAX_ORDER;
    use crate::propagation::rays::directions::mix;

    #[test]
    fn sequences_are_those_that_were_stored() {
        let sequence = |seed: u64| {
            let mut sequence = Sequence::EMPTY;
            for place in 0..1 + mix(seed) % MAX_ORDER as u64 {
                let bits = mix(seed + 1000 * place);
                // Indices of the fixed scene, of instances, and those around the limit of a word.
                sequence.push(match bits % 4 {
                    0 => (bits >> 40) as u32 % 5000,
                    1 => u32::from(INDEX) - 1 + (bits >> 40) as u32 % 3,
                    2 => u32::from(u16::MAX) - 1 + (bits >> 40) as u32 % 3,
                    _ => 1 << 31 | (bits >> 32) as u32,
                });
            }
            sequence
        };
        let mut packed = PackedSequences::default();
        let mut expected = vec![Vec::new(); 16];
        for round in 0..100 {
            let rotation = mix(round) as usize % 16;
            let count = mix(round + 7) % 40;
            expected[rotation] = (0..count).map(|n| sequence(100 * round + n)).collect();
            packed.replace(rotation, &expected[rotation], &mut Vec::new());
            for (rotation, list) in expected.iter().enumerate() {
                for most in 1..=MAX_ORDER {
                    let short = list.iter().filter(|sequence| sequence.len() <= most);
                    assert!(
                        packed.of(rotation, most).eq(short.copied()),
                        "round {round}"
                    );
                }
            }
        }
    }
}
