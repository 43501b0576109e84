//! What an app puts on its entities.

use bevy_asset::Handle;
use bevy_ecs::prelude::*;
use bevy_transform::components::Transform;
use foresound::SourceSettings;

use crate::assets::{MaterialFile, SoundClip};

/// The ears, at the entity's transform; −z is ahead. One entity has it: a camera, or a head below one.
#[derive(Component, Debug, Clone, Copy, Default)]
#[require(Transform)]
pub struct ForesoundListener;

/// Something that sounds, at the entity's transform.
///
/// Every field may change at any time. A new clip starts from its beginning as soon as it is loaded.
#[derive(Component, Debug, Clone)]
#[require(Transform)]
pub struct ForesoundSource {
    /// The sound; the default handle is silence.
    pub clip: Handle<SoundClip>,
    /// Whether the clip repeats.
    pub is_looped: bool,
    /// Whether the clip is paused.
    pub is_paused: bool,
    /// Linear gain, 0 to 1000.
    pub gain: f32,
    /// Speed of the clip, 0.125 to 4: 2 is an octave up. A clip of another sample rate than the engine's takes part of the range.
    pub pitch: f32,
    /// Directivity, radius, effects, mix, whether it has a position.
    pub settings: SourceSettings,
}

impl ForesoundSource {
    /// A clip that plays once.
    pub fn once(clip: Handle<SoundClip>) -> Self {
        Self {
            clip,
            ..Self::default()
        }
    }

    /// A clip that repeats.
    pub fn looped(clip: Handle<SoundClip>) -> Self {
        Self {
            is_looped: true,
            ..Self::once(clip)
        }
    }
}

impl Default for ForesoundSource {
    fn default() -> Self {
        Self {
            clip: Handle::default(),
            is_looped: false,
            is_paused: false,
            gain: 1.0,
            pitch: 1.0,
            settings: SourceSettings::default(),
        }
    }
}

/// Fixed walls: the `Mesh3d` of the entity and of all entities below it, as they stand when their meshes are loaded.
///
/// All geometry of a world is one scene. It is built anew, on another thread, when a mesh or a material below such an entity
/// comes, changes or goes; [`Foresound::rebuild`](crate::Foresound::rebuild) builds it after transforms changed. A mesh belongs to
/// the nearest `ForesoundGeometry` or [`ForesoundInstance`] at or above it.
#[derive(Component, Debug, Clone, Copy, Default)]
#[require(Transform)]
pub struct ForesoundGeometry;

/// A part that moves as one rigid body, such as a door: the meshes at and below the entity. It follows the entity's transform;
/// its scale is that of the moment when its meshes were loaded.
#[derive(Component, Debug, Clone, Copy, Default)]
#[require(Transform)]
pub struct ForesoundInstance;

/// The acoustic material of the meshes at and below the entity, by its name: one of the library's, or one of a file.
/// Without any the material is `generic`.
#[derive(Component, Debug, Clone, PartialEq)]
pub struct ForesoundMaterial {
    /// Name in the file, else in the library's table.
    pub name: String,
    /// A file with materials. The geometry waits until it is loaded.
    pub file: Option<Handle<MaterialFile>>,
}

impl ForesoundMaterial {
    /// One of the library's materials, such as `concrete`.
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            file: None,
        }
    }

    /// A material of a file.
    pub fn of(file: Handle<MaterialFile>, name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            file: Some(file),
        }
    }
}
