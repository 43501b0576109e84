//! Foresound for Bevy 0.19: the game's own meshes make the sound. Walls, corners, doors and rooms are heard on headphones.
//!
//! ```no_run
//! use bevy_app::prelude::*;
//! use bevy_asset::AssetServer;
//! use bevy_ecs::prelude::*;
//! use bevy_transform::components::Transform;
//! use foresound_bevy::{ForesoundListener, ForesoundPlugin, ForesoundSource};
//!
//! fn setup(mut commands: Commands, assets: Res<AssetServer>) {
//!     commands.spawn((ForesoundListener, Transform::from_xyz(0.0, 1.7, 0.0)));
//!     let voice = ForesoundSource::looped(assets.load("voice.wav"));
//!     commands.spawn((voice, Transform::from_xyz(2.0, 1.5, -3.0)));
//!     // And ForesoundGeometry on the root of the walls, ForesoundInstance on each door.
//! }
//!
//! App::new()
//!     .add_plugins((TaskPoolPlugin::default(), bevy_asset::AssetPlugin::default(), bevy_mesh::MeshPlugin))
//!     .add_plugins((bevy_transform::TransformPlugin, ForesoundPlugin::default()))
//!     .add_systems(Startup, setup)
//!     .run();
//! ```
//!
//! A game has those plugins in `DefaultPlugins`; add [`ForesoundPlugin`] after it.
//!
//! Coordinates need no conversion: both are right-handed, +y up, in metres ([`coordinates`]).

pub mod coordinates;
pub mod mesh;

mod assets;
mod components;
mod engine;
mod geometry;
mod output;
mod sources;

use bevy_app::{App, Plugin, PostUpdate};
use bevy_asset::{AssetApp, AssetEventSystems};
use bevy_ecs::prelude::*;
use bevy_transform::TransformSystems;
use foresound::{Engine, EngineSettings, SceneSettings};

pub use assets::{LoadError, MaterialFile, SoundClip};
pub use components::{
    ForesoundGeometry, ForesoundInstance, ForesoundListener, ForesoundMaterial, ForesoundSource,
};
pub use engine::{DrawnPath, Foresound};
pub use foresound;
pub use output::{AppRenderer, Output};

/// The engine and the systems that feed it. Add it after the plugins of assets, meshes and transforms.
///
/// Settings outside their ranges are logged, and the game goes on without sound: there is no resource [`Foresound`] then.
#[derive(Debug, Clone, Default)]
pub struct ForesoundPlugin {
    /// Sources, rays, budget, layout.
    pub settings: EngineSettings,
    /// Settings of every scene.
    pub scene: SceneSettings,
    /// Where the sound goes.
    pub output: Output,
}

/// The plugin's systems in `PostUpdate`: what the app writes before them is heard in the same frame.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ForesoundSystems;

impl Plugin for ForesoundPlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<MaterialFile>()
            .init_asset::<SoundClip>()
            .init_asset_loader::<assets::MaterialLoader>()
            .init_asset_loader::<assets::SoundLoader>()
            .insert_resource(geometry::Commit(self.scene));
        let started = Engine::new(self.settings.clone()).and_then(|(controller, renderer)| {
            output::start(app, self.output, renderer, &self.settings)?;
            Ok(controller)
        });
        match started {
            Ok(controller) => {
                app.insert_resource(Foresound::new(controller));
            }
            Err(error) => {
                log::error!("Foresound is silent: {error}");
                return;
            }
        }
        let systems = (
            geometry::watch,
            geometry::build,
            geometry::move_parts,
            geometry::reload_materials,
            sources::update,
            sources::tick,
        );
        app.add_systems(
            PostUpdate,
            systems
                .chain()
                .in_set(ForesoundSystems)
                .after(TransformSystems::Propagate)
                .after(AssetEventSystems),
        );
    }
}
