//! Voice requests of a graphics frame, independent of the voices' state.
//!
//! Audio side; wait-free, bounded by the number of paths; allocates at construction only. Ranks, HRTF weights and band
//! gains depend only on the frame: they are computed in parts before the frame is applied. The parts do not affect them.

use glam::Vec3;

use crate::extrapolation::FramePath;
use crate::simd::F32x8;

use crate::generation::bands::air_filter::PathTaps;
use crate::generation::panning::direction_table::{Corners, DirectionTable, FIND_BATCH};
use crate::generation::render_context::{Dropped, RenderContext};
use crate::generation::voices::ranking;
use crate::generation::voices::ranking::Ranking;

/// Exact ear delays have the loudest voices: this part of those in full detail, but not fewer than so many. The others have whole
/// frames, which at 44.1 kHz are off by 11 us an ear at most. Alone, 10 us between the ears are heard \[KLUMPP56\]; after a louder
/// sound it takes markedly more \[ZUREK80\].
const EXACT_PART: usize = 4;
const MIN_EXACT: usize = 16;

/// Sample rate in Hz from which on frames are short enough for it.
const MIN_WHOLE_RATE_HZ: f64 = 44_100.0;

/// A path with a voice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VoiceRequest {
    pub(crate) id: u64,
    /// Slot of the source.
    pub(crate) slot: usize,
    pub(crate) rank: u64,
    /// Path delay in frames.
    pub(crate) delay: f64,
    /// Band gains.
    pub(crate) gain: F32x8,
    /// Taps of the filter of the air above the bands.
    pub(crate) air: Option<PathTaps>,
    /// Ear delays in frames, without the path delay.
    pub(crate) ears: [f32; 2],
    /// Ear delays in whole frames, of all but the loudest paths in binaural sound.
    pub(crate) whole_ears: Option<[u32; 2]>,
    /// Groups of buses.
    pub(crate) groups: usize,
}

/// The paths of a frame with a voice, and their requests.
#[derive(Debug)]
pub(crate) struct FramePlan {
    max_voices: usize,
    max_fine: usize,
    /// Groups of buses a reading, those of quiet paths, and groups of all readings.
    groups: usize,
    coarse_groups: usize,
    width: usize,
    /// Scratch memory.
    pub(crate) ranking: Ranking,
    /// Least ranks of a voice, of one in full detail, and of one with exact ear delays.
    keep: u64,
    fine: u64,
    exact: u64,
    /// The next path.
    next: usize,
    last_id: Option<u64>,
    requests: Vec<VoiceRequest>,
    /// Weights of each request for all readings.
    weights: Vec<F32x8>,
    /// Scratch memory: the weights of one direction of a wide source.
    of_direction: Vec<F32x8>,
    dropped: Dropped,
}

impl FramePlan {
    /// Control side; allocates.
    pub(crate) fn new(max_voices: usize, max_fine: usize, table: &DirectionTable) -> Self {
        Self {
            max_voices,
            max_fine,
            groups: table.groups(),
            coarse_groups: table.coarse_groups(),
            width: table.width(),
            ranking: Ranking::new(max_voices.max(max_fine)),
            keep: 0,
            fine: 0,
            exact: 0,
            next: 0,
            last_id: None,
            requests: Vec::with_capacity(max_voices),
            weights: vec![F32x8::ZERO; max_voices * table.width()],
            of_direction: vec![F32x8::ZERO; table.width()],
            dropped: Dropped::default(),
        }
    }

    /// Discards the frame.
    pub(crate) fn clear(&mut self) {
        self.next = 0;
        self.last_id = None;
        self.requests.clear();
        self.dropped = Dropped::default();
    }

    /// Plans up to `most` further paths of a frame; returns whether all are planned. `paths` must stay the same until then.
    pub(crate) fn resume(
        &mut self,
        paths: &[FramePath],
        context: &RenderContext,
        most: usize,
    ) -> bool {
        let end = self.next.saturating_add(most).min(paths.len());
        let longest_s = context.longest_s;
        if self.next == 0 && end > 0 {
            let ranking = &mut self.ranking;
            let exact = (self.max_fine / EXACT_PART).max(MIN_EXACT);
            let exact = exact.min(self.max_voices);
            self.keep = ranking.threshold(paths, longest_s, self.max_voices);
            [self.fine, self.exact] = match self.max_fine >= self.max_voices {
                true => [self.keep; 2],
                false => ranking.thresholds(paths, longest_s, [self.max_fine, exact]),
            };
        }
        let first = self.next;
        let to_plan = paths.get(first..end).unwrap_or_default();
        let mut corners = [Corners::default(); FIND_BATCH];
        for (number, path) in to_plan.iter().enumerate() {
            let (index, in_batch) = (first + number, number % FIND_BATCH);
            self.next = index + 1;
            if in_batch == 0 {
                let batch = &to_plan[number..];
                let mut directions = [Vec3::NEG_Z; FIND_BATCH];
                for (direction, path) in directions.iter_mut().zip(batch) {
                    *direction = context.to_head * path.arrival;
                }
                context.table.find_batch(&directions, &mut corners);
                context.table.prefetch(&corners[0]);
            }
            if let Some(next) = corners.get(in_batch + 1) {
                context.table.prefetch(next);
            }
            let corners = &corners[in_batch];
            let id = path.id.0;
            if !ranking::is_valid(path, longest_s.len())
                || self.last_id.is_some_and(|last| id <= last)
            {
                self.dropped.paths += 1;
                continue;
            }
            self.last_id = Some(id);
            if !ranking::fits(path, longest_s) {
                self.dropped.delays += 1;
                continue;
            }
            let rank = ranking::rank(path, index);
            if rank < self.keep || self.requests.len() == self.max_voices {
                self.dropped.paths += 1;
                continue;
            }
            self.add(path, rank, corners, context);
        }
        self.next == paths.len()
    }

    fn add(&mut self, path: &FramePath, rank: u64, corners: &Corners, context: &RenderContext) {
        let is_fine = rank >= self.fine;
        let groups = if is_fine {
            self.groups
        } else {
            self.coarse_groups
        };
        let width = self.width;
        let weights = &mut self.weights[self.requests.len() * width..][..width];
        let wide = context.wide;
        let ears = match wide.binary_search_by_key(&path.id, |wide| wide.id) {
            Ok(found) => {
                let directions = wide[found].iter();
                let to_head = |(direction, share)| (context.to_head * direction, share);
                let scratch = &mut self.of_direction;
                let table = context.table;
                table.blend_wide(directions.map(to_head), groups, weights, scratch)
            }
            Err(_) => context.table.blend(corners, groups, weights),
        };
        let delay = path.delay_s * context.rate_hz;
        let mut amplitude = path.amplitude;
        let mut air = None;
        if is_fine {
            // The middle between the ears.
            let read = delay + 0.5 * f64::from(ears[0] + ears[1]);
            let fraction = (read - read.floor()) as f32;
            air = context
                .air
                .of(&context.air_np_per_s, path.air_delay_s, fraction);
        }
        if let Some(air) = &air {
            for (value, response) in amplitude.iter_mut().zip(air.response) {
                *value /= response;
            }
        }
        let has_whole_ears = context.table.ears() == 2 && context.rate_hz >= MIN_WHOLE_RATE_HZ;
        self.requests.push(VoiceRequest {
            id: path.id.0,
            slot: path.source.slot(),
            rank,
            delay,
            gain: context.correction.gains(&amplitude),
            air: air.map(|air| air.taps),
            ears,
            whole_ears: (has_whole_ears && rank < self.exact)
                .then(|| ears.map(|ear| (ear + 0.5) as u32)),
            groups,
        });
    }

    /// Number of requests.
    pub(crate) fn len(&self) -> usize {
        self.requests.len()
    }

    /// A request and its weights: groups of the left ear, then of the right, or of the only reading.
    pub(crate) fn get(&self, number: usize) -> (VoiceRequest, &[F32x8]) {
        let width = self.width;
        (
            self.requests[number],
            &self.weights[number * width..][..width],
        )
    }

    /// Counts of the paths without a voice.
    pub(crate) fn dropped(&self) -> Dropped {
        self.dropped
    }
}
