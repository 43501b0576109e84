//! The plugin without a window: rooms of Bevy's meshes, walks, doors, and what comes and goes.

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use bevy_app::{App, TaskPoolPlugin};
use bevy_asset::{AssetPlugin, AssetServer, Assets, Handle};
use bevy_ecs::prelude::*;
use bevy_math::primitives::Cuboid;
use bevy_mesh::{Mesh, Mesh3d, MeshPlugin};
use bevy_transform::TransformPlugin;
use bevy_transform::components::Transform;
use foresound_bevy::foresound::paths::{PathSet, Propagator};
use foresound_bevy::foresound::{
    AffinityPolicy, BANDS, Clip, EngineSchedule, EngineSettings, FrameTime, ListenerPose, Material,
    MaterialTable, PropagationSettings, Scene, SceneSettings, SourceId, SourcePose, shoebox,
};
use foresound_bevy::{
    AppRenderer, Foresound, ForesoundGeometry, ForesoundInstance, ForesoundListener,
    ForesoundMaterial, ForesoundPlugin, ForesoundSource, MaterialFile, Output, SoundClip,
};

/// Audio frames of a graphics frame at 44.1 kHz and 60 Hz.
const BLOCK: usize = 735;
/// Most frames until geometry and files are there.
const PATIENCE: usize = 20_000;

fn app(assets: &str) -> App {
    let mut settings = EngineSettings::default();
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    settings.affinity = AffinityPolicy::System;
    settings.tracing_threads = 1;
    settings.max_snapshot_paths = 1024;
    let mut app = App::new();
    app.add_plugins((
        TaskPoolPlugin::default(),
        AssetPlugin {
            file_path: assets.into(),
            ..AssetPlugin::default()
        },
        MeshPlugin,
        TransformPlugin,
        ForesoundPlugin {
            settings,
            output: Output::App,
            ..ForesoundPlugin::default()
        },
    ));
    app.finish();
    app.cleanup();
    app
}

fn update_until(app: &mut App, is_so: impl Fn(&mut World) -> bool) {
    for _ in 0..PATIENCE {
        app.update();
        if is_so(app.world_mut()) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let problems: Vec<String> = engine(app).problems().map(str::to_owned).collect();
    panic!("nothing happens: {problems:?}");
}

fn until_ready(app: &mut App) {
    update_until(app, |world| world.resource_mut::<Foresound>().is_ready());
    // The scene that is ready is in the next update.
    app.update();
}

fn engine(app: &mut App) -> Mut<'_, Foresound> {
    app.world_mut().resource_mut::<Foresound>()
}

fn problems(app: &mut App) -> Vec<String> {
    engine(app).problems().map(str::to_owned).collect()
}

/// Energy of some frames of sound.
fn listen(app: &mut App, frames: usize) -> f32 {
    let mut block = [0.0; 2 * BLOCK];
    let mut energy = 0.0;
    for _ in 0..frames {
        app.update();
        let mut renderer = app.world_mut().non_send_mut::<AppRenderer>();
        let renderer = renderer.0.as_mut().expect("nobody took it");
        renderer.render(&mut block);
        assert!(block.iter().all(|sample| sample.is_finite()));
        energy += block.iter().map(|sample| sample * sample).sum::<f32>();
    }
    energy
}

/// A box of Bevy, of unit size and scaled.
fn cuboid(app: &mut App, centre: [f32; 3], size: [f32; 3]) -> (Mesh3d, Transform) {
    let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
    let mesh = meshes.add(Mesh::from(Cuboid::new(1.0, 1.0, 1.0)));
    let place = Transform::from_translation(centre.into()).with_scale(size.into());
    (Mesh3d(mesh), place)
}

fn noise(app: &mut App) -> Handle<SoundClip> {
    let mut state = 1u32;
    let samples: Vec<f32> = (0..44_100)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            0.2 * (f32::from((state >> 16) as u16) / 32_768.0 - 1.0)
        })
        .collect();
    let mut clips = app.world_mut().resource_mut::<Assets<SoundClip>>();
    clips.add(SoundClip {
        clip: Clip::mono(samples),
        rate_hz: 44_100,
    })
}

/// Order and level of each path, sorted.
fn levels(app: &mut App) -> Vec<(u8, f32)> {
    let mut engine = engine(app);
    let mut levels: Vec<(u8, f32)> = engine
        .paths()
        .map(|path| (path.path().order, path.path().level_db))
        .collect();
    levels.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    levels
}

#[test]
fn a_room_of_a_scaled_mesh_has_the_paths_of_the_library() {
    let mut app = app(".");
    let room = cuboid(&mut app, [4.0, 1.5, 3.0], [8.0, 3.0, 6.0]);
    let walls = (
        ForesoundGeometry,
        ForesoundMaterial::named("concrete"),
        Transform::from_xyz(10.0, 0.0, -5.0),
        children![room],
    );
    app.world_mut().spawn(walls);
    let clip = noise(&mut app);
    let voice = (
        ForesoundSource::looped(clip),
        Transform::from_xyz(12.0, 1.5, -4.0),
    );
    app.world_mut().spawn(voice);
    let ears = (ForesoundListener, Transform::from_xyz(15.0, 1.7, -2.0));
    app.world_mut().spawn(ears);
    until_ready(&mut app);
    listen(&mut app, 4);
    let found = levels(&mut app);

    let mesh = shoebox([8.0, 3.0, 6.0], "concrete");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
        .expect("a room");
    let mut propagator =
        Propagator::new(Arc::new(scene), PropagationSettings::default()).expect("good settings");
    let mut paths = PathSet::default();
    let listener = ListenerPose::facing([5.0, 1.7, 3.0], 0.0);
    let source = SourcePose::at(SourceId::new(0, 0), [2.0, 1.5, 1.0]);
    propagator.update(&listener, &[source], 0.0, &mut paths);
    let mut expected: Vec<(u8, f32)> = paths
        .paths
        .iter()
        .map(|path| {
            let energy: f32 = path.amplitude.iter().map(|a| a * a).sum();
            (path.order, 10.0 * (energy / BANDS as f32).log10())
        })
        .collect();
    expected.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    // Every image source to order 4 of a rectangular room.
    assert_eq!(expected.len(), 129);
    assert_eq!(found.len(), expected.len(), "{:?}", problems(&mut app));
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found.0, expected.0);
        // Coordinates of 15 m in single precision are right to 1e-6 m.
        assert!(
            (found.1 - expected.1).abs() < 1e-3,
            "{found:?} {expected:?}"
        );
    }
    assert!(problems(&mut app).is_empty(), "{:?}", problems(&mut app));
}

/// Two rooms of 5 m x 4 m that share a wall with a doorway at x = 5 m. Returns the walls and the door, which is closed.
fn two_rooms(app: &mut App) -> (Entity, Entity) {
    let boxes = [
        ([5.0, -0.1, 2.0], [10.4, 0.2, 4.4]),
        ([5.0, 3.1, 2.0], [10.4, 0.2, 4.4]),
        ([5.0, 1.5, -0.1], [10.4, 3.0, 0.2]),
        ([5.0, 1.5, 4.1], [10.4, 3.0, 0.2]),
        ([-0.1, 1.5, 2.0], [0.2, 3.0, 4.0]),
        ([10.1, 1.5, 2.0], [0.2, 3.0, 4.0]),
        ([5.0, 1.5, 0.75], [0.1, 3.0, 1.5]),
        ([5.0, 1.5, 3.25], [0.1, 3.0, 1.5]),
        ([5.0, 2.55, 2.0], [0.1, 0.9, 1.0]),
    ];
    let boxes = boxes.map(|(centre, size)| cuboid(app, centre, size));
    let plaster = ForesoundMaterial::named("plaster");
    let walls = app
        .world_mut()
        .spawn((ForesoundGeometry, plaster, Transform::default()))
        .id();
    for part in boxes {
        app.world_mut().spawn((part, ChildOf(walls)));
    }
    let leaf = cuboid(app, [0.0, 1.02, 0.47], [0.05, 2.04, 0.94]);
    let door = (
        ForesoundInstance,
        ForesoundMaterial::named("door_wood"),
        Transform::from_xyz(5.0, 0.02, 1.53),
        children![leaf],
    );
    (walls, app.world_mut().spawn(door).id())
}

fn turn(app: &mut App, door: Entity, angle: f32) {
    let mut door = app.world_mut().entity_mut(door);
    let mut transform = door.get_mut::<Transform>().expect("a transform");
    transform.rotation = Transform::default().rotation;
    transform.rotate_y(angle);
}

/// How much of the straight line from a source to the listener is blocked.
fn occlusion(app: &mut App, voice: Entity) -> f32 {
    let mut engine = engine(app);
    let id = engine.source(voice).expect("a source");
    let numbers = engine.controller().frame_numbers();
    numbers.source(id).expect("numbers").occlusion
}

#[test]
fn a_door_opens_a_listener_walks_through_and_both_are_heard() {
    let mut app = app(".");
    let (_, door) = two_rooms(&mut app);
    let clip = noise(&mut app);
    let voice = (
        ForesoundSource::looped(clip),
        Transform::from_xyz(8.0, 1.5, 2.0),
    );
    let voice = app.world_mut().spawn(voice).id();
    let ears = (ForesoundListener, Transform::from_xyz(2.5, 1.65, 2.0));
    let ears = app.world_mut().spawn(ears).id();
    until_ready(&mut app);
    assert_eq!(engine(&mut app).controller().instances().len(), 1);
    listen(&mut app, 60);
    // The first call asks for numbers.
    engine(&mut app).controller().frame_numbers();
    let closed = listen(&mut app, 30);
    assert!(closed > 0.0, "{:?}", problems(&mut app));
    assert_eq!(occlusion(&mut app, voice), 1.0);
    for step in 0..=30 {
        turn(&mut app, door, -FRAC_PI_2 * step as f32 / 30.0);
        listen(&mut app, 1);
    }
    listen(&mut app, 30);
    let open = listen(&mut app, 30);
    // What a door takes away comes back when it opens, and the straight line is free.
    assert!(open > closed, "{open} {closed}");
    assert_eq!(occlusion(&mut app, voice), 0.0);
    for step in 0..=60 {
        let mut ears = app.world_mut().entity_mut(ears);
        let mut transform = ears.get_mut::<Transform>().expect("a transform");
        transform.translation.x = 2.5 + 4.5 * step as f32 / 60.0;
        listen(&mut app, 1);
    }
    let near = listen(&mut app, 30);
    // From 5.5 m to 1 m.
    assert!(near > 2.0 * open, "{near} {open}");
    println!("energy of half a second: closed {closed:.3}, open {open:.3}, in the room {near:.3}");
    assert!(problems(&mut app).is_empty(), "{:?}", problems(&mut app));
}

#[test]
fn what_is_despawned_is_no_longer_heard() {
    let mut app = app(".");
    let (walls, door) = two_rooms(&mut app);
    let clip = noise(&mut app);
    let voice = (
        ForesoundSource::looped(clip),
        Transform::from_xyz(7.5, 1.5, 2.0),
    );
    let voice = app.world_mut().spawn(voice).id();
    app.world_mut()
        .spawn((ForesoundListener, Transform::from_xyz(2.5, 1.65, 2.0)));
    until_ready(&mut app);
    listen(&mut app, 4);
    assert!(engine(&mut app).source(voice).is_some());
    assert!(levels(&mut app).len() > 1);

    app.world_mut().entity_mut(door).despawn();
    app.update();
    assert!(engine(&mut app).controller().instances().is_empty());
    app.world_mut().entity_mut(walls).despawn();
    until_ready(&mut app);
    listen(&mut app, 4);
    // Open air: the direct path is left.
    let left = levels(&mut app);
    assert_eq!(left.len(), 1, "{left:?}");
    assert_eq!(left[0].0, 0);
    app.world_mut().entity_mut(voice).despawn();
    app.update();
    assert_eq!(engine(&mut app).controller().source_count(), 0);
    assert!(engine(&mut app).source(voice).is_none());
    // Slots are free again: more sources come and go than the engine has.
    for _ in 0..64 {
        let clip = noise(&mut app);
        let voice = app.world_mut().spawn(ForesoundSource::looped(clip)).id();
        listen(&mut app, 1);
        app.world_mut().entity_mut(voice).despawn();
        listen(&mut app, 12);
    }
    assert!(problems(&mut app).is_empty(), "{:?}", problems(&mut app));
}

#[test]
fn materials_come_from_files_and_change_while_sound_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "[materials.felt]\nabsorption = 0.5\nscattering = 0.0\n";
    std::fs::write(folder.path().join("hall.materials.toml"), text).expect("a file");
    let mut app = app(folder.path().to_str().expect("a name"));
    let file: Handle<MaterialFile> = app
        .world()
        .resource::<AssetServer>()
        .load("hall.materials.toml");
    let room = cuboid(&mut app, [0.0, 0.0, 0.0], [8.0, 3.0, 6.0]);
    let felt = ForesoundMaterial::of(file.clone(), "felt");
    app.world_mut().spawn((ForesoundGeometry, felt, room));
    let clip = noise(&mut app);
    app.world_mut().spawn((
        ForesoundSource::looped(clip),
        Transform::from_xyz(2.0, 0.0, 1.0),
    ));
    app.world_mut()
        .spawn((ForesoundListener, Transform::from_xyz(-1.0, 0.2, 0.0)));
    update_until(&mut app, |world| {
        let mut engine = world.resource_mut::<Foresound>();
        engine.is_ready() && engine.paths().count() > 1
    });
    assert!(problems(&mut app).is_empty(), "{:?}", problems(&mut app));
    let first = |app: &mut App| {
        listen(app, 4);
        let orders = levels(app);
        let reflected = orders.into_iter().filter(|(order, _)| *order == 1);
        reflected.map(|(_, level)| level).fold(f32::MIN, f32::max)
    };
    let before = first(&mut app);
    let mut files = app.world_mut().resource_mut::<Assets<MaterialFile>>();
    let mut file = files.get_mut(&file).expect("loaded");
    file.0 = MaterialTable::from_materials(vec![Material {
        name: "felt".into(),
        absorption: [0.9; BANDS],
        scattering: [0.0; BANDS],
        transmission: [0.0; BANDS],
    }]);
    drop(file);
    listen(&mut app, 8);
    let after = first(&mut app);
    assert!(after < before - 3.0, "{before} dB, {after} dB");
}

#[test]
fn mistakes_are_reported_once_and_the_game_goes_on() {
    let mut app = app(".");
    let room = cuboid(&mut app, [0.0, 0.0, 0.0], [8.0, 3.0, 6.0]);
    app.world_mut().spawn((
        ForesoundGeometry,
        ForesoundMaterial::named("unobtainium"),
        room,
    ));
    app.world_mut().spawn(ForesoundSource {
        gain: -1.0,
        ..ForesoundSource::default()
    });
    until_ready(&mut app);
    listen(&mut app, 10);
    let problems = problems(&mut app);
    let has = |text: &str| {
        problems
            .iter()
            .filter(|problem| problem.contains(text))
            .count()
    };
    assert_eq!(has("unobtainium"), 1, "{problems:?}");
    assert_eq!(has("ForesoundListener"), 1, "{problems:?}");
    assert_eq!(has("gain"), 1, "{problems:?}");
    assert_eq!(problems.len(), 3, "{problems:?}");
}

#[test]
fn bad_settings_leave_the_game_silent() {
    let mut settings = EngineSettings::default();
    settings.block_frames = 3;
    let mut app = App::new();
    let plugin = ForesoundPlugin {
        settings,
        output: Output::App,
        ..ForesoundPlugin::default()
    };
    app.add_plugins((
        TaskPoolPlugin::default(),
        AssetPlugin::default(),
        MeshPlugin,
        TransformPlugin,
        plugin,
    ));
    app.world_mut().spawn(ForesoundSource::default());
    app.update();
    assert!(app.world().get_resource::<Foresound>().is_none());
}
