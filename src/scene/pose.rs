//! Positions and orientations of sources and listener.

use glam::{Quat, Vec3};

use super::source::{FRONT, SourceSettings};
use crate::acoustics::BandArray;

/// Handle of a sound source: a slot and a generation, which differs for each source that has the slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SourceId(u32);

/// Bits of a slot: as many as the 4,096 sources of an engine need. The others count generations.
const SLOT_BITS: u32 = 12;

impl SourceId {
    /// The last generation of a slot.
    pub const LAST_GENERATION: u32 = u32::MAX >> SLOT_BITS;

    /// A handle of a slot below 4,096 and a generation up to [`Self::LAST_GENERATION`]; larger numbers wrap around.
    pub const fn new(slot: u16, generation: u32) -> Self {
        Self(generation << SLOT_BITS | slot as u32 & ((1 << SLOT_BITS) - 1))
    }

    /// The handle of [`Self::bits`].
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// Index of the slot, from 0.
    pub const fn slot(self) -> usize {
        (self.0 & ((1 << SLOT_BITS) - 1)) as usize
    }

    /// Number of the slot's source; an engine's count from 1.
    pub const fn generation(self) -> u32 {
        self.0 >> SLOT_BITS
    }

    /// Slot and generation as one number.
    pub const fn bits(self) -> u32 {
        self.0
    }
}

/// A source at one instant.
///
/// # Examples
/// ```
/// use foresound::{Directivity, SourceId, SourcePose};
///
/// let mut voice = SourcePose::at(SourceId::new(0, 0), [2.0, 1.6, -3.0]);
/// voice.settings.directivity = Directivity::even(0.5, 1.0); // a cardioid
/// assert_eq!(voice.factor_towards(glam::Vec3::Z)[4], 0.0); // silent behind
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourcePose {
    /// The source's handle.
    pub id: SourceId,
    /// Position in metres.
    pub position: Vec3,
    /// Turns source coordinates (+x right, +y up, −z ahead) into world coordinates. [`Controller::tick`](crate::Controller::tick)
    /// and [`OfflineRenderer`](crate::offline::OfflineRenderer) normalise it; four zeros are the identity.
    pub orientation: Quat,
    /// Directivity, radius and effects.
    pub settings: SourceSettings,
}

impl SourcePose {
    /// An omnidirectional source of default settings at a position in metres, facing −z. In
    /// [`Controller::tick`](crate::Controller::tick) it replaces the orientation and the settings that the source had:
    /// [`Controller::move_source`](crate::Controller::move_source) moves it alone.
    pub fn at(id: SourceId, position: impl Into<Vec3>) -> Self {
        Self {
            id,
            position: position.into(),
            ..Self::default()
        }
    }

    /// The same pose with the orientation of a unit quaternion x, y, z, w.
    pub fn with_orientation(self, quaternion: [f32; 4]) -> Self {
        Self {
            orientation: Quat::from_array(quaternion),
            ..self
        }
    }

    /// The same pose with a normalised orientation, of four zeros the identity; `None` if it has no direction: not finite, or of
    /// no length.
    pub(crate) fn normalized(self) -> Option<Self> {
        let orientation = match self.orientation.to_array() == [0.0; 4] {
            true => Quat::IDENTITY,
            false => normalized(self.orientation)?,
        };
        Some(Self {
            orientation,
            ..self
        })
    }

    /// Pressure factor of the directivity in a world direction of any length; 1 for a direction of length 0.
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

/// A quaternion of length 1, unless it is not finite or shorter than a millionth.
fn normalized(quaternion: Quat) -> Option<Quat> {
    let length_squared = quaternion.length_squared();
    let has_direction = length_squared.is_finite() && length_squared > 1e-12;
    has_direction.then(|| quaternion.normalize())
}

/// The listener at one instant.
///
/// # Examples
/// ```
/// use foresound::ListenerPose;
///
/// // Ears at 1.7 m, looking along −x.
/// let listener = ListenerPose::facing([1.0, 1.7, 4.0], std::f32::consts::FRAC_PI_2);
/// assert!((listener.to_head(glam::Vec3::NEG_X) - glam::Vec3::NEG_Z).length() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListenerPose {
    /// Centre of the head in metres.
    pub position: Vec3,
    /// Turns head coordinates (+x right, +y up, −z ahead) into world coordinates. Normalised as a source's, but four zeros are
    /// refused.
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
    /// A listener at a position in metres with a yaw in radians: 0 looks along −z, positive turns left (counter-clockwise
    /// from above).
    pub fn facing(position: impl Into<Vec3>, yaw_rad: f32) -> Self {
        Self {
            position: position.into(),
            orientation: Quat::from_rotation_y(yaw_rad),
        }
    }

    /// The same pose with the orientation of a unit quaternion x, y, z, w.
    pub fn with_orientation(self, quaternion: [f32; 4]) -> Self {
        Self {
            orientation: Quat::from_array(quaternion),
            ..self
        }
    }

    /// The same pose with a normalised orientation; `None` if it has no direction: not finite, or of no length.
    pub(crate) fn normalized(self) -> Option<Self> {
        let orientation = normalized(self.orientation)?;
        Some(Self {
            orientation,
            ..self
        })
    }

    /// A world direction in head coordinates.
    pub fn to_head(&self, world: Vec3) -> Vec3 {
        self.orientation.conjugate() * world
    }
}
