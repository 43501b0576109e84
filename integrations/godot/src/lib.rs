//! Foresound for Godot 4.3 and newer: nodes that make the game's own meshes heard.
//!
//! | class | is a | what |
//! |---|---|---|
//! | `ForesoundEngine` | `Node` | one a game; plays through one of Godot's buses |
//! | `ForesoundListener3D` | `Node3D` | the ears |
//! | `ForesoundSource3D` | `Node3D` | a sound with a position |
//! | `ForesoundGeometry` | `Node3D` | fixed walls: the meshes at and below it |
//! | `ForesoundInstance` | `Node3D` | a part that moves as one rigid body: the meshes at and below it |
//! | `ForesoundMaterial` | `Resource` | what walls are made of |
//!
//! What needs no running Godot is in [`coordinates`], [`clip`], [`material`] and [`mesh`], and has tests.

pub mod clip;
pub mod coordinates;
pub mod material;
pub mod mesh;

mod engine;
mod nodes;
mod playback;
mod scene;
mod sources;

use godot::prelude::*;

struct Foresound;

// SAFETY: gdext's entry point; nothing else in the library has its symbol.
#[gdextension]
unsafe impl ExtensionLibrary for Foresound {}
