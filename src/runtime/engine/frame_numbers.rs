//! The numbers of a graphics frame, for a mixer of the app's own: each source's paths, what blocks it, and its late reverb.
//!
//! The audio side copies a frame when it commits it ([`FrameSender::send`]: wait-free, without allocation, and only once the
//! app has asked for numbers); the control side sorts it by source. Own.

use std::ops::Range;

use crate::acoustics::{BANDS, BandArray};
use crate::extrapolation::{
    FramePath, FramePaths, LATE_DIRECTIONS, LATE_GROUPS, LATE_SEGMENTS, LateGroup, LateSend,
    Obstruction,
};
use crate::runtime::engine::messages::{BED, SourceRoute};
use crate::runtime::handover::newest::{Receiver, Sender, newest};
use crate::scene::SourceId;

/// Boxes under way: one each that is filled, waits, is read, and was missed.
const BOXES: usize = 4;

/// Nepers of energy in 60 dB.
const NEPERS_OF_60_DB: f32 = 13.815_511;

/// What a graphics frame has of one source, for a panner and a reverb of the app's own. Levels include the source's mix and not
/// its gain, which belongs to its samples.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SourceNumbers {
    /// The source.
    pub source: SourceId,
    /// How much of the straight line is blocked, 0 to 1, times the strength of the source's occlusion.
    pub occlusion: f32,
    /// Amplitude factor of the walls on the straight line per band, before the source's mix: 1 where nothing blocks it.
    pub transmission: BandArray,
    /// Amplitude of the late reverb per band: root of its whole energy, relative to the free field at 1 m.
    pub reverb_send: BandArray,
    /// Delay from emission to the start of the late reverb in seconds; 0 without any.
    pub reverb_delay_s: f32,
    /// Reverberation time T60 of the late reverb in seconds per band, the mean by energy of its decays; 0 without any.
    pub decay_time_s: BandArray,
    paths: Range<usize>,
}

/// One graphics frame as the audio side took it.
#[derive(Debug, Default)]
struct FrameMessage {
    tick: u64,
    paths: Vec<FramePath>,
    obstructions: Vec<Obstruction>,
    late: Vec<LateSend>,
    late_groups: [LateGroup; LATE_GROUPS],
    routes: Vec<SourceRoute>,
}

/// The numbers of one graphics frame, by source.
///
/// ```
/// # fn main() -> foresound::Result<()> {
/// # let (mut controller, mut renderer) = foresound::Engine::new(Default::default())?;
/// # let source = controller.add_source([0.0, 1.5, -2.0])?;
/// // The first call begins the copying of frames.
/// controller.frame_numbers();
/// controller.tick(Default::default(), &[])?;
/// renderer.render(&mut [0.0; 2 * 1024]);
/// let numbers = controller.frame_numbers();
/// for path in numbers.paths(source) {
///     println!("{:?} after {} s from {}", path.kind, path.delay_s, path.arrival);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Default)]
pub struct FrameNumbers {
    message: Box<FrameMessage>,
    sources: Vec<SourceNumbers>,
}

impl FrameNumbers {
    /// Number of the tick that sent the frame; 0 before the first.
    pub fn tick(&self) -> u64 {
        self.message.tick
    }

    /// The sources of the frame that have a slot.
    pub fn sources(&self) -> &[SourceNumbers] {
        &self.sources
    }

    /// One source, unless it has no slot or did not exist yet.
    pub fn source(&self, source: SourceId) -> Option<&SourceNumbers> {
        self.sources.iter().find(|own| own.source == source)
    }

    /// The paths of a source by identity; with shared slots those of its slot, whose handle [`FramePath::source`] is.
    pub fn paths(&self, source: SourceId) -> &[FramePath] {
        self.source(source)
            .map_or(&[], |own| &self.message.paths[own.paths.clone()])
    }

    /// Energy of the late reverb of all sources by where it arrives from, one of
    /// [`LATE_DIRECTION_VECTORS`](crate::paths::LATE_DIRECTION_VECTORS) in world coordinates a row, per band, relative to the free
    /// field at 1 m. The sum of the rows is that of the squares of [`SourceNumbers::reverb_send`].
    pub fn reverb_energy_by_direction(&self) -> [BandArray; LATE_DIRECTIONS] {
        let mut energies = [[0.0; BANDS]; LATE_DIRECTIONS];
        for send in &self.message.late {
            let Some(group) = self.message.late_groups.get(usize::from(send.group)) else {
                continue;
            };
            let energy = energy_of(send, group);
            for (sum, shares) in energies.iter_mut().zip(&group.directions) {
                for b in 0..BANDS {
                    sum[b] += energy[b] * shares[b];
                }
            }
        }
        energies
    }

    /// Sorts the message by source.
    fn sort(&mut self) {
        let message = &mut *self.message;
        message
            .paths
            .sort_unstable_by_key(|path| (path.source.slot(), path.id));
        self.sources.clear();
        for route in message.routes.iter().filter(|route| route.slot < BED) {
            let slot = usize::from(route.slot);
            let first = message
                .paths
                .partition_point(|path| path.source.slot() < slot);
            let last = message
                .paths
                .partition_point(|path| path.source.slot() <= slot);
            let found = message.obstructions.iter();
            let Some(obstruction) = found.clone().find(|own| own.source.slot() == slot) else {
                continue;
            };
            let mut numbers = SourceNumbers {
                source: route.id,
                occlusion: obstruction.occlusion,
                transmission: obstruction.transmission,
                reverb_send: [0.0; BANDS],
                reverb_delay_s: 0.0,
                decay_time_s: [0.0; BANDS],
                paths: first..last,
            };
            let sends = message.late.iter();
            numbers.add_reverb(
                sends.filter(|send| send.source.slot() == slot),
                &message.late_groups,
            );
            self.sources.push(numbers);
        }
    }
}

impl SourceNumbers {
    fn add_reverb<'a>(
        &mut self,
        sends: impl Iterator<Item = &'a LateSend>,
        groups: &[LateGroup; LATE_GROUPS],
    ) {
        let (mut energy, mut weighted_s) = ([0.0; BANDS], [0.0; BANDS]);
        let mut start_s = f32::INFINITY;
        for send in sends {
            let Some(group) = groups.get(usize::from(send.group)) else {
                continue;
            };
            start_s = start_s.min(send.start_s);
            let own = energy_of(send, group);
            for b in 0..BANDS {
                energy[b] += own[b];
                weighted_s[b] += own[b] * group.decay_time_s[b];
            }
        }
        for b in (0..BANDS).filter(|b| energy[*b] > 0.0) {
            self.reverb_send[b] = energy[b].sqrt();
            self.decay_time_s[b] = weighted_s[b] / energy[b];
        }
        if start_s.is_finite() {
            self.reverb_delay_s = start_s;
        }
    }
}

/// The whole energy of a decay from its start on, per band.
fn energy_of(send: &LateSend, group: &LateGroup) -> BandArray {
    std::array::from_fn(|b| {
        let decay_s = group.decay_time_s[b];
        if decay_s <= 0.0 {
            return 0.0;
        }
        let rate = NEPERS_OF_60_DB / decay_s;
        send.energy_per_s[b] * (-rate * send.start_s).exp() / rate
    })
}

/// The audio side's end.
pub(super) struct FrameSender(Sender<FrameMessage>);

impl FrameSender {
    /// Copies a frame, if there is a box for it. Real-time.
    pub(super) fn send(&mut self, tick: u64, frame: &FramePaths, routes: &[SourceRoute]) {
        let Some(mut message) = self.0.take_returned() else {
            return;
        };
        message.tick = tick;
        copy(&mut message.paths, &frame.paths);
        copy(&mut message.obstructions, &frame.obstructions);
        copy(&mut message.late, &frame.late);
        copy(&mut message.routes, routes);
        message.late_groups = frame.late_groups;
        self.0.send(message);
    }
}

/// Copies as many elements as there is room for.
fn copy<T: Copy>(to: &mut Vec<T>, from: &[T]) {
    to.clear();
    let count = from.len().min(to.capacity());
    to.extend_from_slice(&from[..count]);
}

/// The control side's end.
pub(super) struct FrameReceiver {
    receiver: Receiver<FrameMessage>,
    numbers: FrameNumbers,
    has_begun: bool,
}

impl FrameReceiver {
    /// The frame taken last.
    pub(super) fn last(&self) -> &FrameNumbers {
        &self.numbers
    }

    /// The newest frame. The first call makes the boxes for at most these paths, slots and sources.
    pub(super) fn take(&mut self, paths: usize, slots: usize, sources: usize) -> &FrameNumbers {
        if !std::mem::replace(&mut self.has_begun, true) {
            for _ in 0..BOXES {
                self.receiver.give_back(Box::new(FrameMessage {
                    paths: Vec::with_capacity(paths),
                    obstructions: Vec::with_capacity(slots),
                    late: Vec::with_capacity(slots * LATE_SEGMENTS * LATE_GROUPS),
                    routes: Vec::with_capacity(sources),
                    ..FrameMessage::default()
                }));
            }
        }
        if let Some(message) = self.receiver.take() {
            let old = std::mem::replace(&mut self.numbers.message, message);
            // The first one has no room.
            if old.paths.capacity() > 0 {
                self.receiver.give_back(old);
            }
            self.numbers.sort();
        }
        &self.numbers
    }
}

/// Both ends.
pub(super) fn frame_numbers() -> (FrameSender, FrameReceiver) {
    let (sender, receiver) = newest();
    let receiver = FrameReceiver {
        receiver,
        numbers: FrameNumbers::default(),
        has_begun: false,
    };
    (FrameSender(sender), receiver)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reverb_is_the_energy_of_its_decays() {
        let groups = [1.0, 2.0, 0.0].map(|time_s| LateGroup::isotropic([time_s; BANDS]));
        // A decay of one second that starts with energy 0.5 after 0.1 s, and one of two seconds with 0.25.
        let send = |group: u8, energy: f32, start_s: f32| {
            let rate = NEPERS_OF_60_DB / groups[usize::from(group)].decay_time_s[0];
            LateSend {
                source: SourceId::default(),
                group,
                energy_per_s: [energy * rate * (rate * start_s).exp(); BANDS],
                start_s,
            }
        };
        let mut numbers = SourceNumbers {
            source: SourceId::default(),
            occlusion: 0.0,
            transmission: [1.0; BANDS],
            reverb_send: [0.0; BANDS],
            reverb_delay_s: 0.0,
            decay_time_s: [0.0; BANDS],
            paths: 0..0,
        };
        numbers.add_reverb([send(0, 0.5, 0.1), send(1, 0.25, 0.3)].iter(), &groups);
        for b in 0..BANDS {
            assert!((numbers.reverb_send[b] - 0.75f32.sqrt()).abs() < 1e-5);
            assert!((numbers.decay_time_s[b] - 4.0 / 3.0).abs() < 1e-5);
        }
        assert_eq!(numbers.reverb_delay_s, 0.1);
    }
}
