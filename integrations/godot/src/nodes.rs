//! The nodes of a scene. They only hold values and say that they are there, by groups; `ForesoundEngine` reads them once a frame.

use godot::classes::{AudioStreamWav, INode3D, Node3D, Resource};
use godot::prelude::*;

/// Groups by which the engine finds nodes.
pub(crate) const LISTENERS: &str = "foresound_listeners";
pub(crate) const SOURCES: &str = "foresound_sources";
pub(crate) const GEOMETRY: &str = "foresound_geometry";
pub(crate) const INSTANCES: &str = "foresound_instances";

/// The ears, at the node's transform; -z is ahead. Put it below the camera.
#[derive(GodotClass)]
#[class(base = Node3D, init)]
pub(crate) struct ForesoundListener3D {
    base: Base<Node3D>,
}

#[godot_api]
impl INode3D for ForesoundListener3D {
    fn enter_tree(&mut self) {
        self.base_mut().add_to_group(LISTENERS);
    }
}

/// Something that sounds, at the node's transform. All values may change at any time.
#[derive(GodotClass)]
#[class(base = Node3D, init)]
pub(crate) struct ForesoundSource3D {
    /// The sound, imported with the compress mode PCM.
    #[export]
    pub(crate) stream: Option<Gd<AudioStreamWav>>,
    /// Whether it starts by itself.
    #[export]
    #[init(val = true)]
    pub(crate) autoplay: bool,
    /// Whether it repeats.
    #[export]
    pub(crate) looped: bool,
    /// Whether it is paused.
    #[export]
    pub(crate) paused: bool,
    /// Linear gain, 0 to 1000.
    #[export]
    #[init(val = 1.0)]
    pub(crate) gain: f32,
    /// Speed, 0.125 to 4: 2 is an octave up.
    #[export]
    #[init(val = 1.0)]
    pub(crate) pitch: f32,
    /// Whether it is heard without a position, such as music.
    #[export]
    pub(crate) without_position: bool,
    /// Number of the newest start; 0 before the first.
    pub(crate) starts: u32,
    /// Whether it is to sound.
    pub(crate) sounds: bool,
    base: Base<Node3D>,
}

#[godot_api]
impl ForesoundSource3D {
    /// Starts the sound from its beginning.
    #[func]
    fn play(&mut self) {
        self.starts += 1;
        self.sounds = true;
    }

    /// Stops it.
    #[func]
    fn stop(&mut self) {
        self.sounds = false;
    }
}

#[godot_api]
impl INode3D for ForesoundSource3D {
    fn enter_tree(&mut self) {
        self.base_mut().add_to_group(SOURCES);
        if self.autoplay {
            self.play();
        }
    }
}

/// Fixed walls: the meshes at and below the node, of one material. A mesh belongs to the nearest `ForesoundGeometry` or
/// `ForesoundInstance` at or above it.
#[derive(GodotClass)]
#[class(base = Node3D, init)]
pub(crate) struct ForesoundGeometry {
    /// What they are made of; `generic` without one.
    #[export]
    pub(crate) material: Option<Gd<ForesoundMaterial>>,
    base: Base<Node3D>,
}

#[godot_api]
impl INode3D for ForesoundGeometry {
    fn enter_tree(&mut self) {
        self.base_mut().add_to_group(GEOMETRY);
    }
}

/// A part that moves as one rigid body, such as a door: the meshes at and below the node. It follows the node's transform; its
/// scale is that of the moment when it enters the tree.
#[derive(GodotClass)]
#[class(base = Node3D, init)]
pub(crate) struct ForesoundInstance {
    /// What it is made of; `generic` without one.
    #[export]
    pub(crate) material: Option<Gd<ForesoundMaterial>>,
    base: Base<Node3D>,
}

#[godot_api]
impl INode3D for ForesoundInstance {
    fn enter_tree(&mut self) {
        self.base_mut().add_to_group(INSTANCES);
    }
}

/// What walls are made of: a material of the library by its name, or own values in the octave bands from 63 Hz to 8 kHz.
#[derive(GodotClass)]
#[class(base = Resource, init)]
pub(crate) struct ForesoundMaterial {
    /// Name of one of the library's materials, such as `concrete`; empty for own values.
    #[export]
    pub(crate) library_name: GString,
    /// Share of the energy that is not reflected, 0 to 1: one value, or eight.
    #[export]
    #[init(val = PackedFloat32Array::from(&[0.1]))]
    pub(crate) absorption: PackedFloat32Array,
    /// Share of the reflected energy outside the mirror direction, 0 to 1: one value, or eight.
    #[export]
    #[init(val = PackedFloat32Array::from(&[0.1]))]
    pub(crate) scattering: PackedFloat32Array,
    /// Share of the energy behind the wall, 0 to 1: one value, or eight.
    #[export]
    #[init(val = PackedFloat32Array::from(&[0.0]))]
    pub(crate) transmission: PackedFloat32Array,
    base: Base<Resource>,
}
