//! Samples that the app writes continuously, through a ring.
//!
//! [`Stream::fill`] runs on the audio side and is wait-free; made and freed on the control side. At an underrun the
//! last sample fades out and later samples fade in; after silence they start unchanged. Own.

use super::smooth_gain::CrossFade;

/// Audio frames of each fade.
const FADE_FRAMES: usize = 256;

/// The audio side's end of a stream.
pub(super) struct Stream {
    ring: rtrb::Consumer<f32>,
    /// The last sample returned.
    last: f32,
    /// The last sample before an underrun, and frames since.
    held: f32,
    held_for: usize,
    /// Frames received since the underrun, up to [`FADE_FRAMES`].
    risen: usize,
    is_late: bool,
}

impl Stream {
    fn new(ring: rtrb::Consumer<f32>) -> Self {
        Self {
            ring,
            last: 0.0,
            held: 0.0,
            held_for: FADE_FRAMES,
            risen: FADE_FRAMES,
            is_late: false,
        }
    }

    /// Fills a block with the next samples; returns the number of missing samples, 0 if the writer was dropped.
    pub(super) fn fill(&mut self, block: &mut [f32]) -> u32 {
        let count = self.ring.slots().min(block.len());
        let (come, late) = block.split_at_mut(count);
        if let Ok(chunk) = self.ring.read_chunk(count) {
            let (first, second) = chunk.as_slices();
            come[..first.len()].copy_from_slice(first);
            come[first.len()..].copy_from_slice(second);
            chunk.commit_all();
        }
        if !come.is_empty() {
            self.is_late = false;
            self.fade_in(come);
        }
        if !late.is_empty() {
            self.fade_out(late);
        }
        self.underrun(late.len())
    }

    /// Discards samples; returns the number of missing ones.
    pub(super) fn skip(&mut self, frames: usize) -> u32 {
        let count = self.ring.slots().min(frames);
        if let Ok(chunk) = self.ring.read_chunk(count) {
            chunk.commit_all();
        }
        (self.last, self.held_for, self.risen) = (0.0, FADE_FRAMES, FADE_FRAMES);
        self.underrun(frames - count)
    }

    fn underrun(&self, late: usize) -> u32 {
        if self.ring.is_abandoned() {
            0
        } else {
            late as u32
        }
    }

    /// Fades in samples after an underrun, while the held sample fades out.
    fn fade_in(&mut self, come: &mut [f32]) {
        for sample in &mut *come {
            if self.risen == FADE_FRAMES && self.held_for == FADE_FRAMES {
                break;
            }
            *sample *= fade_gain(self.risen);
            self.risen = (self.risen + 1).min(FADE_FRAMES);
            *sample += self.next_held();
        }
        self.last = come.last().copied().unwrap_or(self.last);
    }

    fn fade_out(&mut self, late: &mut [f32]) {
        if !std::mem::replace(&mut self.is_late, true) && self.last != 0.0 {
            (self.held, self.held_for, self.risen) = (self.last, 0, 0);
        }
        for sample in &mut *late {
            *sample = self.next_held();
        }
        self.last = late.last().copied().unwrap_or(self.last);
    }

    /// The held sample, faded by one more frame.
    fn next_held(&mut self) -> f32 {
        self.held_for = (self.held_for + 1).min(FADE_FRAMES);
        self.held * fade_gain(FADE_FRAMES - self.held_for)
    }
}

fn fade_gain(frames: usize) -> f32 {
    let slope = 1.0 / FADE_FRAMES as f32;
    CrossFade {
        position: 0.0,
        slope,
    }
    .gain(frames)
}

/// The app's end of a stream: a ring of mono samples at the engine's rate, 1 being full scale at 1 m. Usable on any one thread;
/// wait-free.
pub struct StreamWriter {
    ring: rtrb::Producer<f32>,
}

impl StreamWriter {
    /// A ring for `capacity` samples, and its reading end.
    pub(super) fn new(capacity: usize) -> (Self, Stream) {
        let (ring, reader) = rtrb::RingBuffer::new(capacity);
        (Self { ring }, Stream::new(reader))
    }

    /// Free capacity in samples: so many can be written now. Wait-free, any thread.
    pub fn free(&self) -> usize {
        self.ring.slots()
    }

    /// Appends as many samples as fit; returns their number.
    pub fn write(&mut self, samples: &[f32]) -> usize {
        let count = self.ring.slots().min(samples.len());
        match self.ring.write_chunk_uninit(count) {
            Ok(chunk) => chunk.fill_from_iter(samples.iter().copied()),
            Err(_) => 0,
        }
    }

    /// Whether the stream was replaced, stopped, or its source removed.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_underrun_counts_missing_samples() {
        let (mut writer, mut stream) = StreamWriter::new(4);
        assert_eq!(writer.write(&[1.0, 2.0, 3.0, 4.0, 5.0]), 4);
        let mut block = [9.0; 3];
        assert_eq!(stream.fill(&mut block), 0);
        assert_eq!((block, writer.free()), ([1.0, 2.0, 3.0], 3));
        assert_eq!(stream.fill(&mut block), 2);
        assert_eq!(block[0], 4.0);
        drop(writer);
        assert_eq!(stream.fill(&mut block), 0);
        let mut block = [9.0; FADE_FRAMES];
        assert_eq!((stream.fill(&mut block), block[FADE_FRAMES - 1]), (0, 0.0));
        let (mut writer, mut stream) = StreamWriter::new(4);
        writer.write(&[1.0, 2.0, 3.0]);
        assert_eq!((stream.skip(2), stream.skip(2)), (0, 1));
    }

    #[test]
    fn an_underrun_has_no_step_at_either_end() {
        // Underruns shorter and longer than a fade, and one during a fade in.
        for gap in [3, 100, 700] {
            let (mut writer, mut stream) = StreamWriter::new(4096);
            let wave: Vec<f32> = (0..4096).map(|n| (0.02 * n as f32).cos()).collect();
            let mut heard = Vec::new();
            let mut written = 0;
            for length in [500, 60, 1500] {
                writer.write(&wave[written..written + length]);
                written += length;
                let mut block = vec![9.0; length + gap];
                assert_eq!(stream.fill(&mut block), gap as u32);
                heard.extend(block);
            }
            assert_eq!(heard[..500], wave[..500]);
            let steps = heard.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            let steepest = steps.fold(0.0, f32::max);
            // The wave's own slope and those of a rise and a fall.
            assert!(steepest < 0.02 + 3.0 / FADE_FRAMES as f32, "{steepest}");
            let whole = heard.len() - gap - 1000;
            assert_eq!(heard[whole..][..1000], wave[1060..2060]);
        }
    }

    #[test]
    fn a_start_after_silence_has_no_fade() {
        let (mut writer, mut stream) = StreamWriter::new(64);
        let mut block = [9.0; 16];
        assert_eq!(stream.fill(&mut block), 16);
        assert_eq!(block, [0.0; 16]);
        writer.write(&[0.5; 16]);
        assert_eq!(stream.fill(&mut block), 0);
        assert_eq!(block, [0.5; 16]);
    }
}
