//! Poses as they cross the bridge: 32 bytes each, the same for C and Java.

use glam::{Quat, Vec3};

use crate::scene::{InstanceId, InstancePose, ListenerPose, SourceId, SourcePose, SourceSettings};

/// Bytes of a pose.
pub const POSE_BYTES: usize = 32;

/// Where something is, and which way it faces.
///
/// Metres, right-handed, +y up. The orientation turns the thing's own coordinates (+x right, +y up, -z ahead) into the
/// world's: a quaternion as x, y, z, w of about length 1.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Which source; not looked at for the listener and for instances.
    pub source: u32,
    /// Position in metres.
    pub position_m: [f32; 3],
    /// Quaternion x, y, z, w; (0, 0, 0, 1) faces -z.
    pub orientation: [f32; 4],
}

impl Pose {
    /// A listener's.
    pub fn listener(&self) -> ListenerPose {
        ListenerPose {
            position: Vec3::from_array(self.position_m),
            orientation: Quat::from_array(self.orientation),
        }
    }

    /// A source's.
    pub fn source(&self, settings: SourceSettings) -> SourcePose {
        SourcePose {
            id: source_id(self.source),
            position: Vec3::from_array(self.position_m),
            orientation: Quat::from_array(self.orientation),
            settings,
        }
    }

    /// An instance's, by its number.
    pub fn instance(&self, instance: u32) -> InstancePose {
        InstancePose {
            id: instance_id(instance),
            position: Vec3::from_array(self.position_m).as_dvec3(),
            rotation: Quat::from_array(self.orientation),
        }
    }

    /// From 32 bytes in the machine's order: the number, then seven floats in the order of the fields.
    pub fn from_bytes(bytes: &[u8; POSE_BYTES]) -> Self {
        let word = |i: usize| -> [u8; 4] {
            let mut word = [0; 4];
            word.copy_from_slice(&bytes[4 * i..4 * i + 4]);
            word
        };
        let float = |i| f32::from_ne_bytes(word(i));
        Self {
            source: u32::from_ne_bytes(word(0)),
            position_m: [float(1), float(2), float(3)],
            orientation: [float(4), float(5), float(6), float(7)],
        }
    }
}

/// The engine's name of a source.
pub(super) fn source_id(bits: u32) -> SourceId {
    SourceId::new(bits as u16, (bits >> 16) as u16)
}

/// The engine's name of an instance.
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
        bytes[..4].copy_from_slice(&0x0002_0001u32.to_ne_bytes());
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
