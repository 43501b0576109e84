//! Delay line of one source in eight bands.
//!
//! Audio side; wait-free; allocates at construction only. Input: band samples in order; output: any past stretch.
//!
//! Positions are audio frames since the generator's start. The line consists of tiles of eight frames: band after band, one
//! frame per lane. A reader that mixes the bands accesses memory sequentially, without shuffles. Tiles lie in segments, which
//! take turns: a line becomes longer by more segments behind its oldest sound, and what it has stays where it is.
//!
//! Samples have sixteen bits ([`F16x8`]): nearly all of all lines is read in every block, more than a second-level cache
//! holds. The error is 66 dB below the band's own sound or more, and at most 3e-8 where that is below 6.1e-5. Samples beyond
//! 65,504 are clipped.

use crate::acoustics::BANDS;
use crate::simd::f16x8::{decoded, encoded};
use crate::simd::{F16x8, F32x8, LaneSet, kernel, prefetch};

use crate::generation::CHUNK;

/// Frames of a tile: the lanes.
pub(crate) const TILE: usize = 8;

/// Frames of the fade-in at the oldest end of the sound of a line that becomes longer: no reader of the shorter one is there.
const FADE_FRAMES: usize = CHUNK;

/// Frames of a segment. No stretch that is read is longer, so it lies in two segments at most.
pub(crate) const SEGMENT: usize = 512;
const SEGMENT_TILES: usize = SEGMENT / TILE;

// The late reverb reads chunks, from a tile's start on.
const _: () = assert!(CHUNK + TILE <= SEGMENT && SEGMENT.is_multiple_of(TILE));

/// Gain of a frame of that fade: cubic, with zero slope at both ends.
fn fade_in(frame: usize) -> f32 {
    let share = frame as f32 / FADE_FRAMES as f32;
    share * share * (3.0 - 2.0 * share)
}

/// Eight frames of eight bands, each at its [`band_index`].
pub(crate) type Tile = [F16x8; BANDS];

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
                a.to_halves(),
                e.to_halves(),
                b.to_halves(),
                f.to_halves(),
                c.to_halves(),
                g.to_halves(),
                d.to_halves(),
                h.to_halves(),
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
    /// Prefetches the next quarter; four calls, none of which waits for memory.
    #[inline]
    pub(crate) fn fetch_quarter(&mut self) {
        let mut remaining = self.quarter;
        for part in &mut self.parts {
            let (now, later) = part.split_at(remaining.min(part.len()));
            for tile in now {
                // Four bands per cache line.
                for band in (0..BANDS).step_by(4) {
                    prefetch(&tile[band]);
                }
            }
            remaining -= now.len();
            *part = later;
        }
    }
}

/// [`SEGMENT`] frames.
pub(crate) type Segment = Box<[Tile]>;

/// A silent segment.
fn segment() -> Segment {
    // Written, not allocated as zeros: the pages are touched here, not in the first blocks.
    let mut tiles = Vec::with_capacity(SEGMENT_TILES);
    tiles.resize(SEGMENT_TILES, [F16x8::ZERO; BANDS]);
    tiles.into_boxed_slice()
}

/// So many silent segments. Control side; allocates.
pub(crate) fn segments(count: usize) -> Vec<Segment> {
    (0..count).map(|_| segment()).collect()
}

/// Segments of a line that keeps at least `history` frames besides the chunk being written.
pub(crate) fn segments_for(history: usize) -> usize {
    (history + 2 * CHUNK).div_ceil(SEGMENT)
}

/// A ring of segments.
#[derive(Debug)]
pub(crate) struct DelayLine {
    set: LaneSet,
    segments: Vec<Segment>,
    /// Index of the segment of position 0, before it is reduced to the number of segments.
    first: i64,
    /// Position after the last frame that is not silent.
    sound_end: i64,
}

impl DelayLine {
    /// A silent line that keeps at least `history` frames besides the chunk being written, and can become as long as for `longest`
    /// frames.
    pub(crate) fn new(history: usize, longest: usize) -> Self {
        let count = segments_for(history);
        let mut segments = Vec::with_capacity(segments_for(longest.max(history)));
        segments.resize_with(count, segment);
        Self {
            set: LaneSet::best(),
            segments,
            first: 0,
            sound_end: i64::MIN / 2,
        }
    }

    /// Frames of all segments.
    fn frames(&self) -> i64 {
        (self.segments.len() * SEGMENT) as i64
    }

    /// Makes the line longer by silent segments, as of the position `now` that is written next. Takes as many as there is room for. The
    /// oldest sound fades in: later readers come from the silence before it. Copies one segment at most.
    pub(crate) fn lengthen(&mut self, more: &mut Vec<Segment>, now: i64) {
        let (slot, written) = self.place(now);
        let oldest = now - self.frames();
        let had_sound = !self.is_empty(now);
        let count = more
            .len()
            .min(self.segments.capacity() - self.segments.len());
        for segment in more.drain(..count) {
            self.segments.insert(slot + 1, segment);
        }
        // The segment that is written keeps its place.
        self.first = slot as i64 - segment_number(now);
        if count == 0 || !had_sound {
            return;
        }
        // What it has not overwritten yet is the oldest sound, before all other segments.
        let (new, old) = self.segments.split_at_mut(slot + count);
        if let (Some(new), Some(old)) = (new.get_mut(slot), old.first_mut()) {
            let tile = written / TILE;
            old[tile..].copy_from_slice(&new[tile..]);
            for frame in tile * TILE..written {
                set_frame(old, frame, &F32x8::ZERO);
            }
            for frame in written..SEGMENT {
                set_frame(new, frame, &F32x8::ZERO);
            }
        }
        for age in 0..FADE_FRAMES {
            let (slot, frame) = self.place(oldest + age as i64);
            for band in &mut self.segments[slot][frame / TILE] {
                let value = &mut band.0[frame % TILE];
                *value = encoded(decoded(*value) * fade_in(age));
            }
        }
    }

    /// Whether the line is silent.
    pub(crate) fn is_empty(&self, now: i64) -> bool {
        now - self.sound_end > self.frames() + CHUNK as i64
    }

    /// Whether everything from `position` on is silent.
    pub(crate) fn is_silent_from(&self, position: i64) -> bool {
        position >= self.sound_end
    }

    /// Appends a chunk of at most [`CHUNK`] frames at position `now`, one band per lane.
    pub(crate) fn write(&mut self, now: i64, frames: &[F32x8]) {
        let (mut slot, mut frame) = self.place(now);
        let mut rest = frames;
        while let [first, others @ ..] = rest {
            let whole = (rest.len() / TILE).min(SEGMENT_TILES - frame / TILE);
            if frame.is_multiple_of(TILE) && whole > 0 {
                let tiles = &mut self.segments[slot][frame / TILE..][..whole];
                write_tiles(self.set, rest, tiles);
                rest = &rest[whole * TILE..];
                frame += whole * TILE;
            } else {
                set_frame(&mut self.segments[slot], frame, first);
                rest = others;
                frame += 1;
            }
            if frame == SEGMENT {
                (slot, frame) = (self.next(slot), 0);
            }
        }
        self.sound_end = now + frames.len() as i64;
    }

    /// Appends a chunk of silence at position `now`; not needed for an empty line.
    pub(crate) fn write_silence(&mut self, now: i64, frames: usize) {
        let (mut slot, mut frame) = self.place(now);
        for _ in 0..frames {
            set_frame(&mut self.segments[slot], frame, &F32x8::ZERO);
            frame += 1;
            if frame == SEGMENT {
                (slot, frame) = (self.next(slot), 0);
            }
        }
    }

    /// The tiles with `frames` frames from `position` on, at most a segment from their first tile on, in two parts at a segment's end, and
    /// the first frame's lane in the first tile.
    #[inline]
    pub(crate) fn tiles(&self, position: i64, frames: usize) -> (usize, [&[Tile]; 2]) {
        let (slot, frame) = self.place(position);
        let (first, lane) = (frame / TILE, frame % TILE);
        let count = (lane + frames).div_ceil(TILE);
        let to_end = count.min(SEGMENT_TILES - first);
        let parts = [
            &self.segments[slot][first..first + to_end],
            &self.segments[self.next(slot)][..count - to_end],
        ];
        (lane, parts)
    }

    /// The same tiles, for prefetching.
    pub(crate) fn prefetch_window(&self, position: i64, frames: usize) -> PrefetchWindow<'_> {
        let (_, parts) = self.tiles(position, frames);
        let quarter = (parts[0].len() + parts[1].len()).div_ceil(4);
        PrefetchWindow { parts, quarter }
    }

    /// Index of a position's segment, and its frame there.
    #[inline]
    fn place(&self, position: i64) -> (usize, usize) {
        let number = segment_number(position) + self.first;
        let slot = number.rem_euclid(self.segments.len() as i64) as usize;
        (slot, position as usize % SEGMENT)
    }

    /// Index of the segment after another.
    #[inline(always)]
    fn next(&self, slot: usize) -> usize {
        if slot + 1 == self.segments.len() {
            0
        } else {
            slot + 1
        }
    }
}

/// Number of a position's segment, from position 0 on.
#[inline]
fn segment_number(position: i64) -> i64 {
    position.div_euclid(SEGMENT as i64)
}

/// Sets a frame of a segment, one band per lane.
#[inline]
fn set_frame(tiles: &mut [Tile], frame: usize, bands: &F32x8) {
    let tile = &mut tiles[frame / TILE];
    for (band, &value) in bands.0.iter().enumerate() {
        tile[band_index(band)].0[frame % TILE] = encoded(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positive numbers that sixteen bits hold exactly.
    fn sample(number: i64) -> f32 {
        1.0 + number.rem_euclid(2039) as f32
    }

    #[test]
    fn every_stretch_of_the_past_can_be_read() {
        let mut line = DelayLine::new(1000, 1000);
        let mut now = 0i64;
        for round in 0..60 {
            let frames = 1 + (round * 37) % CHUNK;
            let bands: Vec<F32x8> = (0..frames)
                .map(|i| {
                    let sample = |b| sample(8 * (now + i as i64) + b as i64);
                    F32x8(std::array::from_fn(sample))
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
                            decoded(tiles[index / TILE][band_index(band)].0[index % TILE]),
                            sample(8 * (position + i as i64) + band as i64)
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_line_is_empty_after_its_length() {
        let mut line = DelayLine::new(300, 300);
        assert!(line.is_empty(0));
        line.write(0, &[F32x8::splat(1.0); CHUNK]);
        let mut now = CHUNK as i64;
        while !line.is_empty(now) {
            line.write_silence(now, 100);
            now += 100;
        }
        let mut tiles = line.segments.iter().flatten();
        assert!(tiles.all(|tile| *tile == [F16x8::ZERO; BANDS]));
    }

    /// The lowest band but two of a position.
    fn value(line: &DelayLine, position: i64) -> f32 {
        let (lane, parts) = line.tiles(position, 1);
        let tile = parts.into_iter().flatten().next().expect("one");
        decoded(tile[band_index(2)].0[lane])
    }

    #[test]
    fn a_line_that_becomes_longer_goes_on_with_its_sound() {
        let frames = |from: i64, count: usize| -> Vec<F32x8> {
            (from..)
                .take(count)
                .map(|n| F32x8::splat(sample(n)))
                .collect()
        };
        let cases = [(-7, 300, [900, 1300]), (1000, 2900, [2901, 2902])];
        for (start, history, longer) in cases.into_iter().chain([(4003, 300, [5000, 9000])]) {
            for chunks in 1..60 {
                let mut line = DelayLine::new(history, 9000);
                let mut now: i64 = start;
                for _ in 0..chunks {
                    line.write(now, &frames(now, 101));
                    now += 101;
                }
                // Twice, the second time before the first new segments have sound. Sound from `first` on is whole.
                let mut first = start;
                for (history, count) in longer.into_iter().zip([50, 3000]) {
                    let kept = line.frames() - (2 * CHUNK) as i64;
                    let missing = segments_for(history) - line.segments.len();
                    line.lengthen(&mut segments(missing), now);
                    assert_eq!(line.segments.len(), segments_for(history));
                    first = first.max(now - kept);
                    for position in first..now {
                        assert_eq!(value(&line, position), sample(position), "of {now}");
                    }
                    // Older sound is its own, faded, or silence: never that of another time.
                    for position in now - line.frames() + 1..first {
                        let value = value(&line, position);
                        assert!((0.0..=sample(position)).contains(&value));
                    }
                    for chunk in frames(now, count).chunks(101) {
                        line.write(now, chunk);
                        now += chunk.len() as i64;
                    }
                    assert!(!line.is_silent_from(now - 1) && line.is_silent_from(now));
                }
                for position in first.max(now - longer[1] as i64)..now {
                    assert_eq!(value(&line, position), sample(position), "of {now}");
                }
            }
        }
    }

    #[test]
    fn the_sound_of_a_line_that_becomes_longer_begins_without_a_step() {
        for last in 0..8 {
            let mut line = DelayLine::new(900, 5000);
            let mut now = 0;
            for count in [100; 40].into_iter().chain([last]) {
                line.write(now, &[F32x8::splat(1.0); 100][..count]);
                now += count as i64;
            }
            let first = now - line.frames();
            line.lengthen(&mut segments(3), now);
            assert_eq!((value(&line, first - 1), value(&line, now - 1)), (0.0, 1.0));
            // The slope of the cubic is at most 3/2; both values are rounded by at most half of 2⁻¹¹.
            let step = 1.5 / FADE_FRAMES as f32 + 0.5f32.powi(11);
            let is_smooth = |at| (value(&line, at + 1) - value(&line, at)).abs() < step;
            assert!((now - line.frames()..now - 1).all(is_smooth));
        }
    }

    #[test]
    fn a_line_takes_no_more_segments_than_it_has_room_for() {
        let mut line = DelayLine::new(900, 3000);
        let mut more = segments(5);
        line.lengthen(&mut more, 12_345);
        assert_eq!(line.segments.len(), segments_for(3000));
        assert_eq!(more.len() + line.segments.len(), 5 + segments_for(900));
    }

    #[test]
    fn every_instruction_set_transposes_frames_into_tiles() {
        let frames: Vec<F32x8> = (0..3 * TILE)
            .map(|frame| F32x8(std::array::from_fn(|band| (10 * frame + band) as f32)))
            .collect();
        let mut sets = LaneSet::vector_units();
        sets.extend([LaneSet::Fused, LaneSet::Portable]);
        for set in sets {
            let mut tiles = vec![[F16x8::ZERO; BANDS]; 3];
            write_tiles(set, &frames, &mut tiles);
            for (frame, lanes) in frames.iter().enumerate() {
                for band in 0..BANDS {
                    let found = tiles[frame / TILE][band_index(band)].0[frame % TILE];
                    assert_eq!(decoded(found), lanes.0[band]);
                }
            }
        }
    }

    #[test]
    fn the_prefetch_window_covers_the_tiles_that_are_read() {
        let line = DelayLine::new(1000, 1000);
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
