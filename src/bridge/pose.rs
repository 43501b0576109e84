//! Poses: 32 bytes each, the same for C and Java.

use glam::{Quat, Vec3};

use crate::scene::{InstanceId, InstancePose, ListenerPose, SourceId, SourcePose, SourceSettings};

/// Bytes of a pose.
pub const POSE_BYTES: usize = 32;

/// Position and orientation of a listener, a source or an instance.
///
/// An element of an array, whose element size the functions take: a newer pose is longer.
///
/// Metres, right-handed, +y up. The orientation rotates local coordinates (+x right, +y up, -z ahead) into the world's: a
/// quaternion x, y, z, w of length 1. A listener's and a source's are normalised; four zeros of a source are (0, 0, 0, 1).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Id of the source; ignored for listeners and instances.
    pub source: u32,
    /// Position in metres.
    pub position_m: [f32; 3],
    /// Quaternion x, y, z, w; (0, 0, 0, 1) faces -z.
    pub orientation: [f32; 4],
}

impl Default for Pose {
    /// At the origin, facing -z.
    fn default() -> Self {
        Self {
            source: 0,
            position_m: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
        }
    }
}

impl Pose {
    /// As a listener's pose.
    pub fn listener(&self) -> ListenerPose {
        ListenerPose {
            position: Vec3::from_array(self.position_m),
            orientation: Quat::from_array(self.orientation),
        }
    }

    /// As a source's pose.
    pub fn source(&self, settings: SourceSettings) -> SourcePose {
        SourcePose {
            id: source_id(self.source),
            position: Vec3::from_array(self.position_m),
            orientation: Quat::from_array(self.orientation),
            settings,
        }
    }

    /// As the pose of an instance.
    pub fn instance(&self, instance: u32) -> InstancePose {
        InstancePose {
            id: instance_id(instance),
            position: Vec3::from_array(self.position_m).as_dvec3(),
            rotation: Quat::from_array(self.orientation),
        }
    }

    /// From position and orientation, in the order of the fields.
    pub fn from_floats([x, y, z, qx, qy, qz, qw]: [f32; 7]) -> Self {
        Self {
            source: 0,
            position_m: [x, y, z],
            orientation: [qx, qy, qz, qw],
        }
    }

    /// From 32 bytes in native order: the id, then seven floats.
    pub fn from_bytes(bytes: &[u8; POSE_BYTES]) -> Self {
        let (words, _) = bytes.as_chunks::<4>();
        let source = u32::from_ne_bytes(words[0]);
        let floats = std::array::from_fn(|i| f32::from_ne_bytes(words[i + 1]));
        Self {
            source,
            ..Self::from_floats(floats)
        }
    }
}

/// The engine's id of a source.
pub(super) fn source_id(bits: u32) -> SourceId {
    SourceId::from_bits(bits)
}

/// The engine's id of an instance.
pub(super) fn instance_id(bits: u32) -> InstanceId {
    InstanceId::new(bits as u16, (bits >> 16) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_fields_agree() {
        assert_eq!(size_of::<Pose>(), POSE_BYTES);
        let mut bytes = [0; POSE_BYTES];
        bytes[..4].copy_from_slice(&SourceId::new(1, 2).bits().to_ne_bytes());
        for i in 1..8 {
            bytes[4 * i..4 * i + 4].copy_from_slice(&(i as f32).to_ne_bytes());
        }
        let pose = Pose::from_bytes(&bytes);
        assert_eq!(pose.position_m, [1.0, 2.0, 3.0]);
        assert_eq!(pose.orientation, [4.0, 5.0, 6.0, 7.0]);
        let source = pose.source(SourceSettings::default());
        assert_eq!((source.id.slot(), source.id.generation()), (1, 2));
        assert_eq!(source.id.bits(), pose.source);
    }
}
