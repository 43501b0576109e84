//! Playback with overlong graphics frames: the paper's Figure 8, on a virtual clock.
//!
//! Own model, without randomness. A graphics frame makes one block of sound, one frame time long. The device takes one
//! block a frame time from a queue; when the queue is empty it repeats the last block, as drivers do. A late loop continues
//! with the frame that is due, and drops those between. The blocks are those of a machine that is never late.

/// Blocks in the queue before playback starts.
pub const AHEAD: usize = 2;

/// The sequence of played blocks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Playback {
    /// For each block time the block that was played; `None` for the silence before the first.
    pub played: Vec<Option<usize>>,
    /// Graphics frames that took longer than a frame time.
    pub late: usize,
    /// Graphics frames that were made.
    pub made: usize,
    /// Blocks that were repeated because the queue was empty.
    pub repeated: usize,
    /// Graphics frames that were dropped, their blocks never made.
    pub dropped: usize,
}

/// Plays as many frame times as there are costs: `cost[k]` is what frame `k` takes, in frame times.
pub fn play(cost: &[f64]) -> Playback {
    let mut playback = Playback::default();
    let mut arrivals = Vec::new();
    let (mut frame, mut now) = (0, 0.0f64);
    while let Some(cost) = cost.get(frame) {
        now = now.max(frame as f64) + cost.max(0.0);
        arrivals.push((now, frame));
        playback.made += 1;
        playback.late += usize::from(*cost > 1.0);
        // The frame due when this one is done; no frame is made twice.
        frame = (frame + 1).max(now as usize);
    }
    playback.dropped = cost.len() - playback.made;
    let mut waiting = arrivals.into_iter().peekable();
    let mut last = None;
    for tick in 0..cost.len() {
        let due = (tick + AHEAD) as f64;
        match waiting.next_if(|(arrival, _)| *arrival <= due) {
            Some((_, frame)) => last = Some(frame),
            None => playback.repeated += usize::from(last.is_some()),
        }
        playback.played.push(last);
    }
    playback
}

impl Playback {
    /// One channel as the device played it. `starts` are the first samples of the blocks and the end of the last one.
    pub fn sound(&self, channel: &[f32], starts: &[usize]) -> Vec<f32> {
        let mut sound = Vec::with_capacity(channel.len());
        for (tick, block) in self.played.iter().enumerate() {
            let (Some(&from), Some(&to)) = (starts.get(tick), starts.get(tick + 1)) else {
                break;
            };
            for n in 0..to - from {
                let at = block.and_then(|block| {
                    let (start, end) = (*starts.get(block)?, *starts.get(block + 1)?);
                    // Blocks differ by a sample in length; the shorter one's end is held.
                    channel.get((start + n).min(end - 1))
                });
                sound.push(at.copied().unwrap_or(0.0));
            }
        }
        sound
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the device's blocks that were played again.
    fn repeated_share(playback: &Playback) -> f64 {
        playback.repeated as f64 / playback.played.len().max(1) as f64
    }

    #[test]
    fn punctual_frames_are_played_once() {
        let playback = play(&[0.9; 50]);
        let all: Vec<_> = (0..50).map(Some).collect();
        assert_eq!(playback.played, all);
        assert_eq!(
            (playback.late, playback.repeated, playback.dropped),
            (0, 0, 0)
        );
    }

    #[test]
    fn the_queue_hides_one_long_frame() {
        let mut cost = [0.5; 20];
        cost[7] = 1.4;
        let playback = play(&cost);
        assert_eq!(playback.repeated, 0);
        assert_eq!((playback.late, playback.dropped), (1, 0));
    }

    #[test]
    fn overload_repeats_and_drops_its_share() {
        // 1.25 frame times a frame: four are made in five frame times.
        let playback = play(&[1.25; 1000]);
        assert_eq!(
            (playback.made, playback.dropped, playback.late),
            (800, 200, 800)
        );
        assert!(
            (repeated_share(&playback) - 0.2).abs() < 0.01,
            "{playback:?}"
        );
        // Sound does not fall behind.
        let last = playback.played.last().copied().flatten();
        assert!(last.is_some_and(|frame| frame >= 990), "{last:?}");
        // The paper's own ratio leaves one block in eight.
        assert!((repeated_share(&play(&[7.69; 1000])) - (1.0 - 1.0 / 7.69)).abs() < 0.02);
    }

    #[test]
    fn sound_is_cut_at_block_boundaries() {
        let channel: Vec<f32> = (0..10).map(|n| n as f32).collect();
        let playback = Playback {
            played: vec![None, Some(0), Some(0), Some(2)],
            ..Playback::default()
        };
        let sound = playback.sound(&channel, &[0, 2, 5, 7, 10]);
        assert_eq!(sound, [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 5.0, 6.0, 6.0]);
    }
}
