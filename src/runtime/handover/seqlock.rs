//! A sequence lock: one thread writes a small value, others read it whole.
//!
//! Writing is wait-free: the words of the value are stored between two increments of a sequence number. A reader that
//! finds an odd or changed number retries, so only control threads read. `crossbeam_utils`' `AtomicCell` shares one
//! lock among many cells, on which the sound thread would wait, and has a data race by ThreadSanitizer. Own, after
//! \[BOEHM12\].

use std::marker::PhantomData;
use std::sync::atomic::{AtomicU64, Ordering, fence};
use std::thread;

/// A value that converts to words and back.
pub(crate) trait Words<const N: usize>: Copy {
    fn to_words(self) -> [u64; N];

    fn from_words(words: [u64; N]) -> Self;
}

/// A value behind a sequence lock.
pub(crate) struct Seqlock<T, const N: usize> {
    /// Odd during a write.
    sequence: AtomicU64,
    words: [AtomicU64; N],
    value: PhantomData<fn(T) -> T>,
}

impl<T: Words<N>, const N: usize> Seqlock<T, N> {
    pub(crate) fn new(value: T) -> Self {
        Self {
            sequence: AtomicU64::new(0),
            words: value.to_words().map(AtomicU64::new),
            value: PhantomData,
        }
    }

    /// Stores a value. Wait-free; one thread at a time, or readers may see a mixture.
    pub(crate) fn store(&self, value: T) {
        let sequence = self.sequence.load(Ordering::Relaxed);
        self.sequence
            .store(sequence.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (word, new) in self.words.iter().zip(value.to_words()) {
            word.store(new, Ordering::Relaxed);
        }
        self.sequence
            .store(sequence.wrapping_add(2), Ordering::Release);
    }

    /// The newest value. Not on the audio side: waits for a write to end.
    pub(crate) fn load(&self) -> T {
        loop {
            let before = self.sequence.load(Ordering::Acquire);
            let words = std::array::from_fn(|at| self.words[at].load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if before.is_multiple_of(2) && self.sequence.load(Ordering::Relaxed) == before {
                return T::from_words(words);
            }
            thread::yield_now();
        }
    }
}

impl<T: Words<N> + Default, const N: usize> Default for Seqlock<T, N> {
    fn default() -> Self {
        Self::new(T::default())
    }
}

/// Two numbers in one word.
pub(crate) fn pair(high: u32, low: u32) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

/// The two numbers of a word.
pub(crate) fn halves(word: u64) -> [u32; 2] {
    [(word >> 32) as u32, word as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three equal numbers.
    #[derive(Clone, Copy, Default)]
    struct Same([u64; 3]);

    impl Words<3> for Same {
        fn to_words(self) -> [u64; 3] {
            self.0
        }

        fn from_words(words: [u64; 3]) -> Self {
            Self(words)
        }
    }

    #[test]
    fn readers_find_whole_values_that_rise() {
        let most = if cfg!(miri) { 100 } else { 100_000 };
        let seqlock = Seqlock::<Same, 3>::default();
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    let mut last = 0;
                    while last < most {
                        let Same([a, b, c]) = seqlock.load();
                        assert!(a == b && b == c && a >= last, "{a} {b} {c} after {last}");
                        last = a;
                    }
                });
            }
            (1..=most).for_each(|n| seqlock.store(Same([n; 3])));
        });
    }

    #[test]
    fn halves_are_those_of_the_pair() {
        assert_eq!(halves(pair(7, u32::MAX)), [7, u32::MAX]);
    }
}
