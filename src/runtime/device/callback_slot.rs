//! The render callback, owned by one stream at a time.
//!
//! A stream owns a [`LeasedCallback`]; dropping it, on any thread, returns the callback to its [`CallbackSlot`].
//! Wait-free: one atomic exchange in each direction.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::runtime::handover::atomic_box::AtomicBox;

/// Fills a block of interleaved stereo.
pub type RenderCallback = Box<dyn FnMut(&mut [f32]) + Send>;

struct SharedCallback {
    slot: AtomicBox<RenderCallback>,
    blocks: AtomicU64,
}

/// Holds the callback while no stream has it. Control side.
pub struct CallbackSlot(Arc<SharedCallback>);

/// The callback, leased to a stream.
pub struct LeasedCallback {
    callback: Option<Box<RenderCallback>>,
    shared: Arc<SharedCallback>,
}

impl CallbackSlot {
    /// With a callback that fills blocks of interleaved stereo.
    pub fn new(fill: impl FnMut(&mut [f32]) + Send + 'static) -> Self {
        let fill: RenderCallback = Box::new(fill);
        Self(Arc::new(SharedCallback {
            slot: AtomicBox::new(Some(Box::new(fill))),
            blocks: AtomicU64::new(0),
        }))
    }

    /// Leases the callback; `None` while a stream has it.
    pub fn lease(&self) -> Option<LeasedCallback> {
        let fill = self.0.slot.take()?;
        Some(LeasedCallback {
            callback: Some(fill),
            shared: Arc::clone(&self.0),
        })
    }

    /// Blocks filled so far, by all streams.
    pub fn blocks(&self) -> u64 {
        self.0.blocks.load(Ordering::Relaxed)
    }
}

impl LeasedCallback {
    /// Fills a block of interleaved stereo. Audio side; wait-free if the callback is.
    pub fn fill(&mut self, block: &mut [f32]) {
        self.shared.blocks.fetch_add(1, Ordering::Relaxed);
        match &mut self.callback {
            Some(fill) => fill(block),
            None => block.fill(0.0),
        }
    }
}

impl Drop for LeasedCallback {
    fn drop(&mut self) {
        drop(self.shared.slot.swap(self.callback.take()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_stream_leases_the_callback_at_a_time() {
        let mut count = 0.0;
        let slot = CallbackSlot::new(move |block: &mut [f32]| {
            count += 1.0;
            block.fill(count);
        });
        let mut leased = slot.lease().expect("is there");
        assert!(slot.lease().is_none());
        let mut block = [0.0; 2];
        leased.fill(&mut block);
        std::thread::spawn(move || drop(leased))
            .join()
            .expect("ends");
        slot.lease().expect("is back").fill(&mut block);
        assert_eq!(block, [2.0; 2]);
        assert_eq!(slot.blocks(), 2);
    }
}
