//! A walk through the concert hall: voices on the stage and in the audience, and the paths by which they reach the listener, drawn.
//!
//! The listener walks by itself until an arrow key is pressed: up and down walk, left and right turn. A line is a path from a source
//! to the listener: white is direct, yellow, orange and red have one, two and more reflections, blue goes around an edge; faint is
//! quiet. Without a sound device it is silent, and draws the same. `--screenshot FILE.png SECONDS` walks for some seconds, waits
//! until Bevy has compiled its shaders, saves the window and ends.

mod hall;
mod picture;
mod walk;

use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use foresound_bevy::foresound::EngineSettings;
use foresound_bevy::{Foresound, ForesoundPlugin, ForesoundSource};
use picture::Picture;

/// Files of the hall and of the voices.
const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../assets");
/// Drawn at most, the loudest of the newest update.
const DRAWN_PATHS: usize = 48;
/// A path of this level is as faint as lines get; 0 dB, the free field at 1 m, is opaque.
const FAINTEST_DB: f32 = -42.0;

fn paths(
    mut engine: ResMut<Foresound>,
    mut gizmos: Gizmos,
    sources: Query<&Transform, With<ForesoundSource>>,
    mut window: Single<&mut Window>,
) {
    for path in engine.paths() {
        let own = path.path();
        let colour = match (own.diffraction_order, own.order) {
            (0, 0) => Color::srgb(1.0, 1.0, 1.0),
            (0, 1) => Color::srgb(1.0, 0.85, 0.2),
            (0, 2) => Color::srgb(1.0, 0.55, 0.1),
            (0, _) => Color::srgb(0.95, 0.25, 0.15),
            _ => Color::srgb(0.3, 0.65, 1.0),
        };
        let opacity = (1.0 - own.level_db / FAINTEST_DB).clamp(0.15, 1.0);
        gizmos.linestrip(path.corners().map(Vec3::from), colour.with_alpha(opacity));
    }
    for source in &sources {
        gizmos.sphere(source.translation, 0.25, Color::srgb(0.4, 1.0, 0.5));
    }
    let statistics = engine.controller().statistics();
    let update_ms = 1e3 * statistics.propagation_s;
    window.title = format!(
        "Foresound: {} paths, an update took {update_ms:.1} ms",
        statistics.paths
    );
}

/// The picture that is asked for, or what is wrong.
fn arguments() -> Result<Option<Picture>, String> {
    const USAGE: &str = "usage: foresound-bevy-hall [--screenshot FILE.png SECONDS]";
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.as_slice() {
        [] => Ok(None),
        [flag, file, seconds] if flag == "--screenshot" => {
            let after_s = seconds.parse().map_err(|_| USAGE)?;
            Ok(Some(Picture::new(file.clone(), after_s)))
        }
        _ => Err(USAGE.into()),
    }
}

fn main() -> Result<(), String> {
    let picture = arguments()?;
    let mesh = hall::load()?;
    let assets = AssetPlugin {
        file_path: format!("{ASSETS}/speech"),
        ..default()
    };
    let window = WindowPlugin {
        primary_window: Some(Window {
            resolution: (960, 540).into(),
            ..default()
        }),
        ..default()
    };
    let mut settings = EngineSettings::default();
    settings.max_snapshot_paths = DRAWN_PATHS;
    let mut app = App::new();
    app.add_plugins(DefaultPlugins.set(assets).set(window));
    app.add_plugins(ForesoundPlugin {
        settings,
        ..default()
    });
    if let Some(picture) = picture {
        app.insert_resource(picture).add_plugins(picture::plugin);
    }
    let exit = app
        .insert_resource(hall::Hall(mesh))
        .insert_resource(ClearColor(picture::BACKGROUND))
        .insert_resource(GlobalAmbientLight {
            brightness: 350.0,
            ..default()
        })
        .add_systems(Startup, (hall::build, walk::enter, camera))
        .add_systems(
            Update,
            (walk::walk, paths.run_if(resource_exists::<Foresound>)).chain(),
        )
        .run();
    match exit {
        AppExit::Success => Ok(()),
        AppExit::Error(_) => Err("ended without a picture".into()),
    }
}

/// Looks at the stage from the middle of the audience, and lines lie before walls.
fn camera(mut commands: Commands, mut gizmos: ResMut<GizmoConfigStore>) {
    let at = Transform::from_xyz(20.5, 6.2, 10.0).looking_at(Vec3::new(4.0, 2.2, 10.0), Vec3::Y);
    commands.spawn((Camera3d::default(), Tonemapping::None, at));
    let light = Transform::from_xyz(24.0, 9.0, 4.0).looking_at(Vec3::new(6.0, 0.0, 11.0), Vec3::Y);
    let sun = DirectionalLight {
        illuminance: 2_500.0,
        ..default()
    };
    commands.spawn((sun, light));
    let (lines, _) = gizmos.config_mut::<DefaultGizmoConfigGroup>();
    lines.depth_bias = -1.0;
}
