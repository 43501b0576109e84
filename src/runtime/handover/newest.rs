//! A channel that keeps the newest value only, and returns memory to the sender.
//!
//! Wait-free on both sides: one atomic exchange to send, one to take. The sender fills a box, the receiver owns it and
//! returns it for reuse; the receiver neither allocates nor frees. Queues in which every value counts are `rtrb` rings.
//! The `triple_buffer` crate is similar, but does not transfer ownership.

use std::sync::Arc;

use crate::runtime::handover::atomic_box::AtomicBox;

/// Boxes that a receiver may hold at a time.
const MAX_HELD: usize = 4;

/// Capacity of the return ring, never exceeded: the sender allocates only when the ring is empty, so at most
/// [`MAX_HELD`] + 2 boxes exist.
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

/// A channel, empty at first.
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
    /// A box to fill: a returned one with its old content, or a new one.
    pub(crate) fn take_blank(&mut self, make: impl FnOnce() -> T) -> Box<T> {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        self.returned.pop().unwrap_or_else(|_| Box::new(make()))
    }

    /// A returned box with its old content, if there is one. Does not allocate.
    pub(crate) fn take_returned(&mut self) -> Option<Box<T>> {
        self.spare.take().or_else(|| self.returned.pop().ok())
    }

    /// A box that the receiver has returned, with its old content.
    pub(crate) fn returned(&mut self) -> Option<Box<T>> {
        self.returned.pop().ok()
    }

    /// Takes back the last value sent, unless the receiver has taken it.
    pub(crate) fn recall(&mut self) -> Option<Box<T>> {
        self.slot.take()
    }

    /// Sends a value; an older one that was not taken is kept for reuse.
    pub(crate) fn send(&mut self, value: Box<T>) {
        let missed = self.slot.swap(Some(value));
        if missed.is_some() {
            self.spare = missed;
        }
    }

    /// Keeps a box for reuse without sending it.
    pub(crate) fn keep(&mut self, value: Box<T>) {
        self.spare = Some(value);
    }
}

impl<T: Send> Receiver<T> {
    /// The newest value, once.
    pub(crate) fn take(&mut self) -> Option<Box<T>> {
        self.slot.take()
    }

    /// Returns a box to the sender.
    pub(crate) fn give_back(&mut self, value: Box<T>) {
        if let Err(rtrb::PushError::Full(value)) = self.returns.push(value) {
            // Unreachable, as the ring has room for all boxes. A leak would be better than freeing memory here.
            Box::leak(value);
        }
    }

    /// Whether the sender was dropped.
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
            let mut boxed = sender.take_blank(|| 0);
            *boxed = value;
            sender.send(boxed);
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
            let mut boxed = sender.take_blank(|| {
                made += 1;
                [0; 8]
            });
            boxed.fill(round);
            sender.send(boxed);
        }
        reading.join().expect("no assertion fails");
        assert!(made <= MAX_HELD + 2, "{made} boxes");
    }
}
