//! First sound in Bevy: a room, a voice in it, a door that turns, and a listener. Without a window it plays for ten seconds.

use std::time::{Duration, Instant};

use bevy_app::{App, Startup, TaskPoolPlugin, Update};
use bevy_asset::{AssetPlugin, AssetServer, Assets};
use bevy_ecs::prelude::*;
use bevy_math::primitives::Cuboid;
use bevy_mesh::{Mesh, Mesh3d, MeshPlugin};
use bevy_transform::TransformPlugin;
use bevy_transform::components::Transform;
use foresound_bevy::{
    ForesoundGeometry, ForesoundInstance, ForesoundListener, ForesoundMaterial, ForesoundPlugin,
    ForesoundSource,
};

#[derive(Component)]
struct Door;

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, assets: Res<AssetServer>) {
    // The walls: all meshes at and below the entity.
    let room = Mesh3d(meshes.add(Mesh::from(Cuboid::new(8.0, 3.0, 6.0))));
    let concrete = ForesoundMaterial::named("concrete");
    commands.spawn((ForesoundGeometry, concrete, room));
    // A part that moves.
    let leaf = Mesh3d(meshes.add(Mesh::from(Cuboid::new(0.05, 2.0, 0.9))));
    let wood = ForesoundMaterial::named("door_wood");
    let hinge = Transform::from_xyz(0.5, -0.5, 0.0);
    commands.spawn((Door, ForesoundInstance, wood, leaf, hinge));
    // What sounds, and who listens. With a window the listener is the camera.
    let voice = ForesoundSource::looped(assets.load("voice01.wav"));
    commands.spawn((voice, Transform::from_xyz(2.0, 0.0, -1.0)));
    commands.spawn((ForesoundListener, Transform::from_xyz(-2.0, 0.2, 1.0)));
}

fn turn(mut doors: Query<&mut Transform, With<Door>>) {
    for mut door in &mut doors {
        door.rotate_y(0.01);
    }
}

fn main() {
    let mut app = App::new();
    // A game has `DefaultPlugins` in place of these four.
    let file_path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/speech").to_owned();
    let assets = AssetPlugin {
        file_path,
        ..AssetPlugin::default()
    };
    app.add_plugins((
        TaskPoolPlugin::default(),
        assets,
        MeshPlugin,
        TransformPlugin,
    ));
    app.add_plugins(ForesoundPlugin::default());
    app.add_systems(Startup, setup).add_systems(Update, turn);
    app.finish();
    app.cleanup();
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(10) {
        app.update();
        std::thread::sleep(Duration::from_millis(16));
    }
}
