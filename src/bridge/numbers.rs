//! The numbers of a graphics frame: what a mixer of the app's own needs of each source.

use super::enumeration::PathKind;
use super::record::record;
use crate::acoustics::BANDS;
use crate::extrapolation::{self, FramePath};
use crate::runtime::engine;

// The arrays below have literal lengths, which cbindgen reads.
const _: () = assert!(BANDS == 8);

record! {
    /// A path of a source in a graphics frame. An element of an array, whose element size foresound_source_paths takes.
    pub struct SourcePath {
        /// Identity of the path across frames; in Java rounded to 53 bits.
        pub id: u64,
        /// Delay from the source to the listener in seconds.
        pub delay_s: f64,
        /// What the path does on its way.
        pub kind: PathKind,
        /// Number of reflections.
        pub reflections: u32,
        /// Unit vector in world coordinates from the listener to where the path arrives from.
        pub arrival: [f32; 3],
        /// Unit vector in world coordinates from the source along the path; zero for a path of no length.
        pub departure: [f32; 3],
        /// Signed amplitude relative to the free field at 1 m in each octave band, from the lowest.
        pub amplitude: [f32; 8],
    }
}

record! {
    /// What a graphics frame has of a source. Levels include the source's options and not its gain.
    pub struct SourceNumbers[size, zeros] {
        /// Number of its paths.
        pub path_count: u32,
        /// How much of the straight line is blocked, 0 to 1, times the strength of the source's occlusion.
        pub occlusion: f32,
        /// Delay from emission to the start of the late reverb in seconds; 0 without any.
        pub reverb_delay_s: f32,
        /// Amplitude factor of the walls on the straight line in each octave band: 1 where nothing blocks it.
        pub transmission: [f32; 8],
        /// Amplitude of the late reverb in each octave band: root of its whole energy, relative to the free field at 1 m.
        pub reverb_send: [f32; 8],
        /// Reverberation time T60 of the late reverb in seconds in each octave band; 0 without any.
        pub decay_time_s: [f32; 8],
    }
}

impl From<&FramePath> for SourcePath {
    fn from(from: &FramePath) -> Self {
        Self {
            id: from.id.0,
            delay_s: from.delay_s,
            kind: match from.kind {
                extrapolation::PathKind::Direct => PathKind::Direct,
                extrapolation::PathKind::Transmitted => PathKind::Transmitted,
                extrapolation::PathKind::Reflected => PathKind::Reflected,
                extrapolation::PathKind::Diffracted => PathKind::Diffracted,
            },
            reflections: from.order.into(),
            arrival: from.arrival.to_array(),
            departure: from.departure.to_array(),
            amplitude: from.amplitude,
        }
    }
}

impl SourceNumbers {
    pub(super) fn new(from: &engine::SourceNumbers, paths: usize) -> Self {
        Self {
            size: size_of::<Self>() as u32,
            path_count: paths as u32,
            occlusion: from.occlusion,
            reverb_delay_s: from.reverb_delay_s,
            transmission: from.transmission,
            reverb_send: from.reverb_send,
            decay_time_s: from.decay_time_s,
        }
    }
}
