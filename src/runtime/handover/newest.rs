//! Newest values from one thread to another, whose memory travels back.
//!
//! Wait-free on both sides: one atomic exchange to send, one to take. Boxes go round: the sender fills one, the receiver
//! reads it for as long as it likes and gives it back for the sender to fill again or free. The receiver neither
//! allocates nor frees. Queues, where every value counts, are plain `rtrb` rings.
//!
//! Built on [`AtomicBox`]; the `triple_buffer` crate does as much, but under the MPL and without giving ownership away.

use std::sync::Arc;

use crate::runtime::handover::atomic_box::AtomicBox;

/// Boxes that a receiver may hold at a time without giving one back.
const MAX_HELD: usize = 4;

/// Places on the way back: for what the receiver holds, one in the slot and one in the sender's hand there is always
/// one, since the sender makes a box only when none is left in it.
const RETURN_CAPACITY: usize = 2 * (MAX_HELD + 2);

/// The sending end.
pub(crate) struct Sender<T> {
    slot: Arc<AtomicBox<T>>,
    returned: rtrb::Consumer<Box<T>>,
    spare: Option<Box<T>>,
}

/// The receiving end.
pub(crate) struct Receiver<T> {
    slot: Arc<AtomicBox<T>>,
    returns: rtrb::Producer<Box<T>>,
}

/// A slot that holds the newest value, empty at first.
pub(crate) fn newest<T: Send>() -> (Sender<T>, Receiver<T>) {
    let slot = Arc::new(AtomicBox::default());
    let (returns, returned) = rtrb::RingBuffer::new(RETURN_CAPACITY);
    let sender = Sender {
        slot: Arc::clone(&slot),
        returned,
        spare: None,
    };
    (sender, Receiver { slot, returns })
}

impl<T: Send> Sender<T> {
    /// A box to fill: one that came back, with its old content, or else a new one.
    pub(crate) fn take_blank(&mut self, make: impl FnOnce() -> T) -> Box<T> {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        self.returned.pop().unwrap_or_else(|_| Box::new(make()))
    }

    /// Takes back what was sent last, unless the receiver has it already.
    pub(crate) fn recall(&mut self) -> Option<Box<T>> {
        self.slot.take()
    }

    /// Makes a box the newest value. One that nobody took is kept to be filled again.
    pub(crate) fn send(&mut self, value: Box<T>) {
        let missed = self.slot.swap(Some(value));
        if missed.is_some() {
            self.spare = missed;
        }
    }

    /// Keeps a box to be filled again without sending it.
    pub(crate) fn keep(&mut self, value: Box<T>) {
        self.spare = Some(value);
    }
}

impl<T: Send> Receiver<T> {
    /// The newest value, if there is one that was not taken before.
    pub(crate) fn take(&mut self) -> Option<Box<T>> {
        self.slot.take()
    }

    /// Gives a box back.
    pub(crate) fn give_back(&mut self, value: Box<T>) {
        if let Err(rtrb::PushError::Full(value)) = self.returns.push(value) {
            // There are fewer boxes than places. Were it otherwise, memory lost is better than memory freed here.
            Box::leak(value);
        }
    }

    /// Whether the sender is gone.
    pub(crate) fn is_abandoned(&self) -> bool {
        self.returns.is_abandoned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_value_arrives_and_once() {
        let (mut sender, mut receiver) = newest::<u32>();
        assert!(receiver.take().is_none());
        for value in 1..=3 {
            let mut place = sender.take_blank(|| 0);
            *place = value;
            sender.send(place);
        }
        let taken = receiver.take().expect("sent");
        assert_eq!(*taken, 3);
        assert!(receiver.take().is_none());
        receiver.give_back(taken);
        assert!(!receiver.is_abandoned());
        drop(sender);
        assert!(receiver.is_abandoned());
    }

    #[test]
    fn a_recalled_value_does_not_arrive() {
        let (mut sender, mut receiver) = newest::<u32>();
        sender.send(Box::new(7));
        assert_eq!(sender.recall().as_deref(), Some(&7));
        assert!(receiver.take().is_none());
        assert!(sender.recall().is_none());
    }

    #[test]
    fn threads_hand_over_rising_values_in_few_boxes() {
        let (mut sender, mut receiver) = newest::<[u64; 8]>();
        let rounds = if cfg!(miri) { 200 } else { 200_000 };
        let reading = std::thread::spawn(move || {
            let (mut last, mut held) = (0, None);
            while last < rounds {
                let Some(value) = receiver.take() else {
                    std::hint::spin_loop();
                    continue;
                };
                assert!(value[0] > last && value.iter().all(|v| *v == value[0]));
                last = value[0];
                if let Some(old) = held.replace(value) {
                    receiver.give_back(old);
                }
            }
        });
        let mut made = 0;
        for round in 1..=rounds {
            let mut place = sender.take_blank(|| {
                made += 1;
                [0; 8]
            });
            place.fill(round);
            sender.send(place);
        }
        reading.join().expect("no assertion fails");
        assert!(made <= MAX_HELD + 2, "{made} boxes");
    }
}
