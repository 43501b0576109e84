//! Where the thing that fills blocks waits between two streams.
//!
//! A stream's callback owns a [`Loan`]; when the stream is dropped, on whichever thread, the thing is back in its berth.
//! Wait-free both ways: one atomic exchange.

use std::sync::Arc;

use crate::runtime::slot::Slot;

/// Fills a block of interleaved stereo.
pub type Fill = Box<dyn FnMut(&mut [f32]) + Send>;

type Place = Arc<Slot<Fill>>;

/// The place where it waits. Control side.
pub struct Berth(Place);

/// The thing, lent to a stream.
pub struct Loan {
    fill: Option<Box<Fill>>,
    place: Place,
}

impl Berth {
    /// With something to lend.
    pub fn new(fill: impl FnMut(&mut [f32]) + Send + 'static) -> Self {
        let fill: Fill = Box::new(fill);
        Self(Arc::new(Slot::new(Some(Box::new(fill)))))
    }

    /// Lends it; `None` while a stream has it.
    pub fn lend(&self) -> Option<Loan> {
        let fill = self.0.take()?;
        Some(Loan {
            fill: Some(fill),
            place: Arc::clone(&self.0),
        })
    }
}

impl Loan {
    /// Fills a block. Audio side, as far as what was lent is.
    pub fn fill(&mut self, block: &mut [f32]) {
        match &mut self.fill {
            Some(fill) => fill(block),
            None => block.fill(0.0),
        }
    }
}

impl Drop for Loan {
    fn drop(&mut self) {
        drop(self.place.swap(self.fill.take()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_stream_has_it_at_a_time_and_gives_it_back() {
        let mut count = 0.0;
        let berth = Berth::new(move |block: &mut [f32]| {
            count += 1.0;
            block.fill(count);
        });
        let mut loan = berth.lend().expect("is there");
        assert!(berth.lend().is_none());
        let mut block = [0.0; 2];
        loan.fill(&mut block);
        std::thread::spawn(move || drop(loan)).join().expect("ends");
        berth.lend().expect("is back").fill(&mut block);
        assert_eq!(block, [2.0; 2]);
    }
}
