//! Sequences of all ray rotations in a third of their memory.
//!
//! Propagation thread. A sequence is written as 16-bit words, one or three a surface: a source's sixteen rotations have some
//! 3,400 sequences in a concert hall, 18 KB instead of 67. A number is kept with each for who tries them, 7 KB. Own.

use crate::propagation::diffuse::by_rotation::ByRotation;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::path::MAX_ORDER;

/// Bit of a word with a sequence's last surface.
const LAST: u16 = 1 << 15;

/// Bits of a surface's index in one word; with all of them set the index is in the next two words, the lower half first.
const INDEX: u16 = LAST - 1;

/// Of four words in one number: the bits [`LAST`], and the number that carries an index of all bits into it.
const LASTS: u64 = 0x8000_8000_8000_8000;
const ONES: u64 = 0x0001_0001_0001_0001;

/// The sequences of each rotation, in their order.
#[derive(Debug, Clone, Default)]
pub(crate) struct PackedSequences {
    words: ByRotation<u16>,
    /// See [`Self::mark`].
    marks: ByRotation<u16>,
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
        self.marks.replace_by(rotation, list.len(), 0);
    }

    /// The sequences of a rotation with up to `most` surfaces.
    #[inline(always)]
    pub(crate) fn of(&self, rotation: usize, most: usize) -> Unpacked<'_> {
        Unpacked {
            words: self.words.of(rotation),
            most,
        }
    }

    /// Number of a rotation's sequences.
    pub(crate) fn count(&self, rotation: usize) -> usize {
        self.marks.of(rotation).len()
    }

    /// Those of a rotation's sequences whose mark is `mark` or less, with their indices for [`Self::mark`]; each has up to `most`
    /// surfaces.
    #[inline(always)]
    pub(crate) fn marked(
        &self,
        rotation: usize,
        most: usize,
        mark: u16,
    ) -> impl Iterator<Item = (u32, Sequence)> {
        let mut unpacked = self.of(rotation, most);
        let mut marks = (self.marks.start(rotation) as u32..).zip(self.marks.of(rotation));
        std::iter::from_fn(move || {
            loop {
                let (sequence, is_short) = unpacked.next_of_all()?;
                let (index, of) = marks.next()?;
                if is_short && *of <= mark {
                    return Some((index, sequence));
                }
            }
        })
    }

    /// Marks a sequence, by its index among those of all rotations, until its rotation is replaced. The first mark is 0.
    pub(crate) fn mark(&mut self, index: u32, mark: u16) {
        if let Some(of) = self.marks.all_mut().get_mut(index as usize) {
            *of = mark;
        }
    }

    /// Gives all sequences the mark 0.
    pub(crate) fn clear_marks(&mut self) {
        self.marks.all_mut().fill(0);
    }
}

/// The sequences in words, in their order, with up to `most` surfaces.
#[derive(Debug, Clone)]
pub(crate) struct Unpacked<'a> {
    words: &'a [u16],
    most: usize,
}

impl Unpacked<'_> {
    /// The next sequence and whether it has up to `most` surfaces; longer ones may be cut off.
    #[inline(always)]
    fn next_of_all(&mut self) -> Option<(Sequence, bool)> {
        match self.next_of_four() {
            Some(sequence) => Some((sequence, sequence.len() <= self.most)),
            None => self.next_of_any(),
        }
    }

    /// The next sequence, where the next four words have all of it, a word for each surface. Nearly all sequences are so.
    #[inline(always)]
    fn next_of_four(&mut self) -> Option<Sequence> {
        let [a, b, c, d] = *self.words.first_chunk::<MAX_ORDER>()?;
        let words = [u64::from(a), u64::from(b), u64::from(c), u64::from(d)];
        let words = words[0] | words[1] << 16 | words[2] << 32 | words[3] << 48;
        let (ends, indices) = (words & LASTS, words & !LASTS);
        let is_wide = (indices + ONES) & LASTS != 0;
        if is_wide || ends == 0 {
            return None;
        }
        let end = ends.trailing_zeros() as usize + 1;
        let indices = indices & (u64::MAX >> (u64::BITS as usize - end));
        let count = end / 16;
        self.words = self.words.get(count..).unwrap_or_default();
        let index = |at: usize| (indices >> (16 * at)) as u16;
        let [a, b, c, d] = [index(0), index(1), index(2), index(3)];
        let surfaces = [a.into(), b.into(), c.into(), d.into()];
        Some(Sequence::of_first(surfaces, count))
    }

    /// The next sequence of any words, cut off after `most` surfaces.
    #[cold]
    fn next_of_any(&mut self) -> Option<(Sequence, bool)> {
        let (mut sequence, mut is_short) = (Sequence::EMPTY, true);
        let mut words = self.words.iter();
        loop {
            let word = *words.next()?;
            let surface = match word & INDEX {
                INDEX => u32::from(*words.next()?) | u32::from(*words.next()?) << 16,
                index => index.into(),
            };
            if sequence.len() < self.most {
                sequence.push(surface);
            } else {
                is_short = false;
            }
            if word & LAST != 0 {
                self.words = words.as_slice();
                return Some((sequence, is_short));
            }
        }
    }
}

impl Iterator for Unpacked<'_> {
    type Item = Sequence;

    #[inline(always)]
    fn next(&mut self) -> Option<Sequence> {
        loop {
            let (sequence, is_short) = self.next_of_all()?;
            if is_short {
                return Some(sequence);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let mut marks = vec![Vec::new(); 16];
        for round in 0..100 {
            let rotation = mix(round) as usize % 16;
            let count = mix(round + 7) % 40;
            expected[rotation] = (0..count).map(|n| sequence(100 * round + n)).collect();
            packed.replace(rotation, &expected[rotation], &mut Vec::new());
            marks[rotation] = vec![0; expected[rotation].len()];
            let all: Vec<u32> = (0..16)
                .flat_map(|rotation| packed.marked(rotation, MAX_ORDER, u16::MAX))
                .map(|(index, _)| index)
                .collect();
            for (index, mark) in all.iter().zip(marks.iter_mut().flatten()) {
                if mix(round + u64::from(*index)).is_multiple_of(3) {
                    *mark = (round % 4) as u16;
                    packed.mark(*index, *mark);
                }
            }
            for (rotation, list) in expected.iter().enumerate() {
                assert_eq!(packed.count(rotation), list.len(), "round {round}");
                for most in 1..=MAX_ORDER {
                    let marked = list.iter().zip(&marks[rotation]);
                    let marked = marked.filter(|(one, mark)| one.len() <= most && **mark <= 1);
                    let found = packed.marked(rotation, most, 1).map(|(_, one)| one);
                    assert!(found.eq(marked.map(|(one, _)| *one)), "round {round}");
                }
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
