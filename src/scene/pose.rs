//! Where sources and listener are.

use glam::{Quat, Vec3};

use super::source::{FRONT, SourceSettings};
use crate::acoustics::BandArray;

/// Handle of a sound source: a slot and a generation, so that a slot's next tenant is not taken for the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SourceId(u32);

impl SourceId {
    /// From a slot and its generation.
    pub const fn new(slot: u16, generation: u16) -> Self {
        Self((generation as u32) << 16 | slot as u32)
    }

    /// Index of the slot, from 0.
    pub const fn slot(self) -> usize {
        (self.0 & 0xffff) as usize
    }

    /// How often the slot has been given away before.
    pub const fn generation(self) -> u16 {
        (self.0 >> 16) as u16
    }

    /// Slot and generation as one number.
    pub const fn bits(self) -> u32 {
        self.0
    }
}

/// A source's place at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourcePose {
    /// Which source.
    pub id: SourceId,
    /// Position in metres.
    pub position: Vec3,
    /// Turns source coordinates (+x right, +y up, −z ahead) into world coordinates.
    pub orientation: Quat,
    /// Directivity, size and wanted effects.
    pub settings: SourceSettings,
}

impl SourcePose {
    /// An omnidirectional source of default settings at a position.
    pub fn at(id: SourceId, position: Vec3) -> Self {
        Self {
            id,
            position,
            ..Self::default()
        }
    }

    /// Pressure factor of the directivity towards a world direction of any length but zero, in which every factor is one.
    pub fn factor_towards(&self, direction: Vec3) -> BandArray {
        let cosine = direction
            .try_normalize()
            .map_or(1.0, |d| (self.orientation * FRONT).dot(d));
        self.settings.directivity.factor(cosine)
    }
}

impl Default for SourcePose {
    /// At the origin, facing −z.
    fn default() -> Self {
        Self {
            id: SourceId::default(),
            position: Vec3::ZERO,
            orientation: Quat::IDENTITY,
            settings: SourceSettings::default(),
        }
    }
}

/// The listener's place at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListenerPose {
    /// Centre of the head in metres.
    pub position: Vec3,
    /// Turns head coordinates (+x right, +y up, −z ahead) into world coordinates.
    pub orientation: Quat,
}

impl Default for ListenerPose {
    /// At the origin, looking along −z.
    fn default() -> Self {
        Self {
            position: Vec3::ZERO,
            orientation: Quat::IDENTITY,
        }
    }
}

impl ListenerPose {
    /// A listener at a position who looks along `yaw_rad`: 0 is −z, positive turns left (counter-clockwise from above).
    pub fn facing(position: Vec3, yaw_rad: f32) -> Self {
        Self {
            position,
            orientation: Quat::from_rotation_y(yaw_rad),
        }
    }

    /// A world direction in head coordinates.
    pub fn to_head(&self, world: Vec3) -> Vec3 {
        self.orientation.conjugate() * world
    }
}
