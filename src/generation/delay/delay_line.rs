//! Delay line of one source in eight bands.
//!
//! Audio side; wait-free; allocates at construction only. Input: band samples in order; output: any past stretch.
//!
//! Positions are audio frames since the generator's start. The ring consists of tiles of eight frames: band after band, one
//! frame per lane. A reader that mixes the bands accesses memory sequentially, without shuffles.

use crate::acoustics::BANDS;
use crate::simd::{F32x8, LaneSet, kernel, prefetch};

use crate::generation::CHUNK;

/// Frames of a tile: the lanes.
pub(crate) const TILE: usize = 8;

/// Frames of the fade-in at the oldest end of a line's sound that a longer one takes over: no reader of the shorter one is there.
const FADE_FRAMES: usize = CHUNK;

/// Gain of a frame of that fade: cubic, with zero slope at both ends.
fn fade_in(frame: usize) -> f32 {
    let share = frame as f32 / FADE_FRAMES as f32;
    share * share * (3.0 - 2.0 * share)
}

/// Eight frames of eight bands, each at its [`band_index`].
pub(crate) type Tile = [F32x8; BANDS];

/// Index of a band in a tile: adjacent to the band four higher. Sixteen lanes then sum the lower and the upper four bands
/// separately, in the order of the bands.
pub(crate) const fn band_index(band: usize) -> usize {
    const HALF: usize = BANDS / 2;
    2 * (band % HALF) + band / HALF
}

kernel! {
    /// Transposes frames with one band per lane into tiles, as many as fit.
    fn write_tiles<L>(frames: &[F32x8], tiles: &mut [Tile]) {
        for (tile, frames) in tiles.iter_mut().zip(frames.chunks_exact(TILE)) {
            let [a, b, c, d] = [frames[0], frames[1], frames[2], frames[3]];
            let [e, f, g, h] = [frames[4], frames[5], frames[6], frames[7]];
            let [a, b, c, d, e, f, g, h] = L::transpose([
                L::from_array(a),
                L::from_array(b),
                L::from_array(c),
                L::from_array(d),
                L::from_array(e),
                L::from_array(f),
                L::from_array(g),
                L::from_array(h),
            ]);
            *tile = [
                a.to_array(),
                e.to_array(),
                b.to_array(),
                f.to_array(),
                c.to_array(),
                g.to_array(),
                d.to_array(),
                h.to_array(),
            ];
        }
    }
}

/// A stretch of a delay line to prefetch. The lines exceed the second-level cache, and a path's stretch is too short for
/// the hardware prefetcher.
#[derive(Debug, Default)]
pub(crate) struct PrefetchWindow<'a> {
    parts: [&'a [Tile]; 2],
    quarter: usize,
}

impl PrefetchWindow<'_> {
    /// Prefetches all of it.
    pub(crate) fn fetch(&mut self) {
        (0..4).for_each(|_| self.fetch_quarter());
    }

    /// Prefetches the next quarter; four calls, none of which waits for memory.
    #[inline]
    pub(crate) fn fetch_quarter(&mut self) {
        let mut remaining = self.quarter;
        for part in &mut self.parts {
            let (now, later) = part.split_at(remaining.min(part.len()));
            for tile in now {
                // Two bands per cache line.
                for band in (0..BANDS).step_by(2) {
                    prefetch(&tile[band]);
                }
            }
            remaining -= now.len();
            *part = later;
        }
    }
}

/// A ring of tiles.
#[derive(Debug)]
pub(crate) struct DelayLine {
    set: LaneSet,
    tiles: Vec<Tile>,
    /// Position after the last frame that is not silent.
    sound_end: i64,
}

impl DelayLine {
    /// A silent line that keeps at least `history` frames besides the chunk being written.
    pub(crate) fn new(history: usize) -> Self {
        let length = (history + 2 * CHUNK).div_ceil(TILE);
        // Written, not allocated as zeros: the pages are touched here, not in the first blocks.
        let mut tiles = Vec::with_capacity(length);
        tiles.resize(length, [F32x8::ZERO; BANDS]);
        Self {
            set: LaneSet::best(),
            tiles,
            sound_end: i64::MIN / 2,
        }
    }

    /// Takes the sound of a line that is not longer, as of the position `now` that is written next. What is older than the line's
    /// history fades in: later readers come from the silence before it.
    pub(crate) fn continue_from(&mut self, before: &Self, now: i64) {
        self.sound_end = before.sound_end;
        if before.is_empty(now) {
            return;
        }
        let next = now.div_euclid(TILE as i64);
        let first = next + 1 - before.tiles.len() as i64;
        for number in first..=next {
            let [from, to] =
                [before, &*self].map(|line| number.rem_euclid(line.tiles.len() as i64));
            let mut tile = before.tiles[from as usize];
            let age = (number - first) as usize * TILE;
            if age < FADE_FRAMES {
                let gains = F32x8(std::array::from_fn(|lane| fade_in(age + lane)));
                tile = tile.map(|band| band * gains);
            }
            self.tiles[to as usize] = tile;
        }
    }

    /// Whether this line is longer than another.
    pub(crate) fn is_longer_than(&self, other: &Self) -> bool {
        self.tiles.len() > other.tiles.len()
    }

    /// Whether the line is silent.
    pub(crate) fn is_empty(&self, now: i64) -> bool {
        now - self.sound_end > (self.tiles.len() * TILE + CHUNK) as i64
    }

    /// Whether everything from `position` on is silent.
    pub(crate) fn is_silent_from(&self, position: i64) -> bool {
        position >= self.sound_end
    }

    /// Appends a chunk of at most [`CHUNK`] frames at position `now`, one band per lane.
    pub(crate) fn write(&mut self, now: i64, frames: &[F32x8]) {
        let mut index = self.index(now);
        let mut rest = frames;
        while let [first, others @ ..] = rest {
            let whole = (rest.len() / TILE).min(self.tiles.len() - index / TILE);
            if index.is_multiple_of(TILE) && whole > 0 {
                let tiles = &mut self.tiles[index / TILE..][..whole];
                write_tiles(self.set, rest, tiles);
                rest = &rest[whole * TILE..];
                index = (index + whole * TILE) % (self.tiles.len() * TILE);
                continue;
            }
            let tile = &mut self.tiles[index / TILE];
            for (band, &value) in first.0.iter().enumerate() {
                tile[band_index(band)].0[index % TILE] = value;
            }
            rest = others;
            index = self.next(index);
        }
        self.sound_end = now + frames.len() as i64;
    }

    /// Appends a chunk of silence at position `now`; not needed for an empty line.
    pub(crate) fn write_silence(&mut self, now: i64, frames: usize) {
        let mut index = self.index(now);
        for _ in 0..frames {
            for band in &mut self.tiles[index / TILE] {
                band.0[index % TILE] = 0.0;
            }
            index = self.next(index);
        }
    }

    /// The tiles with `frames` frames from `position` on, in two parts at the ring's end, and the first frame's lane in the
    /// first tile.
    #[inline]
    pub(crate) fn tiles(&self, position: i64, frames: usize) -> (usize, [&[Tile]; 2]) {
        let index = self.index(position);
        let (first, lane) = (index / TILE, index % TILE);
        let count = (lane + frames).div_ceil(TILE);
        let to_end = count.min(self.tiles.len() - first);
        let parts = [
            &self.tiles[first..first + to_end],
            &self.tiles[..count - to_end],
        ];
        (lane, parts)
    }

    /// The same tiles, for prefetching.
    pub(crate) fn prefetch_window(&self, position: i64, frames: usize) -> PrefetchWindow<'_> {
        let (_, parts) = self.tiles(position, frames);
        let quarter = (parts[0].len() + parts[1].len()).div_ceil(4);
        PrefetchWindow { parts, quarter }
    }

    fn index(&self, position: i64) -> usize {
        position.rem_euclid((self.tiles.len() * TILE) as i64) as usize
    }

    #[inline(always)]
    fn next(&self, index: usize) -> usize {
        if index + 1 == self.tiles.len() * TILE {
            0
        } else {
            index + 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stretch_of_the_past_can_be_read() {
        let mut line = DelayLine::new(1000);
        let mut now = 0i64;
        for round in 0..60 {
            let frames = 1 + (round * 37) % CHUNK;
            let bands: Vec<F32x8> = (0..frames)
                .map(|i| {
                    F32x8(std::array::from_fn(|b| {
                        (8 * (now + i as i64)) as f32 + b as f32
                    }))
                })
                .collect();
            line.write(now, &bands);
            now += frames as i64;
            for back in (1..1000).step_by(13) {
                let position = now - back;
                if position < 0 {
                    continue;
                }
                let frames = CHUNK.min(back as usize);
                let (lane, parts) = line.tiles(position, frames);
                let tiles: Vec<&Tile> = parts.into_iter().flatten().collect();
                for i in 0..frames {
                    let index = lane + i;
                    for band in [3, 5] {
                        assert_eq!(
                            tiles[index / TILE][band_index(band)].0[index % TILE],
                            (8 * (position + i as i64) + band as i64) as f32
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_line_is_empty_after_its_length() {
        let mut line = DelayLine::new(300);
        assert!(line.is_empty(0));
        line.write(0, &[F32x8::splat(1.0); CHUNK]);
        let mut now = CHUNK as i64;
        while !line.is_empty(now) {
            line.write_silence(now, 100);
            now += 100;
        }
        assert!(line.tiles.iter().all(|tile| *tile == [F32x8::ZERO; BANDS]));
    }

    #[test]
    fn a_longer_line_goes_on_with_the_sound_of_a_shorter_one() {
        let frames = |from: i64, count: usize| -> Vec<F32x8> {
            (from..)
                .take(count)
                .map(|n| F32x8::splat(n as f32))
                .collect()
        };
        for (first, before, after) in [(-7, 300, 900), (1000, 900, 901), (4003, 300, 5000)] {
            let mut shorter = DelayLine::new(before);
            let mut now: i64 = first;
            for _ in 0..20 {
                shorter.write(now, &frames(now, 101));
                now += 101;
            }
            let mut line = DelayLine::new(after);
            line.continue_from(&shorter, now);
            line.write(now, &frames(now, 50));
            for back in 1..before as i64 {
                let (lane, parts) = line.tiles(now - back, 1);
                let tile = parts.into_iter().flatten().next().expect("one");
                assert_eq!(tile[band_index(2)].0[lane], (now - back) as f32);
            }
            assert!(!line.is_silent_from(now + 49) && line.is_silent_from(now + 50));
        }
    }

    #[test]
    fn the_sound_that_a_longer_line_takes_over_begins_without_a_step() {
        let mut shorter = DelayLine::new(900);
        for chunk in 0..20 {
            shorter.write(chunk * 100, &[F32x8::splat(1.0); 100]);
        }
        let mut line = DelayLine::new(5000);
        line.continue_from(&shorter, 2000);
        let value = |position: i64| {
            let (lane, parts) = line.tiles(position, 1);
            let tile = parts.into_iter().flatten().next().expect("one");
            tile[band_index(5)].0[lane]
        };
        assert_eq!((value(0), value(1999)), (0.0, 1.0));
        // The slope of the cubic is at most 3/2.
        let step = 1.5 / FADE_FRAMES as f32 + f32::EPSILON;
        assert!((0..1999).all(|at| (value(at + 1) - value(at)).abs() < step));
    }

    #[test]
    fn every_instruction_set_transposes_frames_into_tiles() {
        let frames: Vec<F32x8> = (0..3 * TILE)
            .map(|frame| F32x8(std::array::from_fn(|band| (10 * frame + band) as f32)))
            .collect();
        let mut sets = LaneSet::vector_units();
        sets.extend([LaneSet::Fused, LaneSet::Portable]);
        for set in sets {
            let mut tiles = vec![[F32x8::ZERO; BANDS]; 3];
            write_tiles(set, &frames, &mut tiles);
            for (frame, lanes) in frames.iter().enumerate() {
                for band in 0..BANDS {
                    let found = tiles[frame / TILE][band_index(band)].0[frame % TILE];
                    assert_eq!(found, lanes.0[band]);
                }
            }
        }
    }

    #[test]
    fn the_prefetch_window_covers_the_tiles_that_are_read() {
        let line = DelayLine::new(1000);
        for (position, frames) in [(0, 1), (5, 260), (1200, 256), (-300, 40)] {
            let (_, parts) = line.tiles(position, frames);
            let mut prefetch_window = line.prefetch_window(position, frames);
            assert_eq!(
                prefetch_window.parts.map(<[Tile]>::len),
                parts.map(<[Tile]>::len)
            );
            for _ in 0..4 {
                prefetch_window.fetch_quarter();
            }
            assert!(prefetch_window.parts.iter().all(|part| part.is_empty()));
        }
    }
}
