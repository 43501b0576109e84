//! The hall of `assets/scenes` as meshes of Bevy, one a material.

use std::path::Path;

use bevy::asset::RenderAssetUsages;
use bevy::mesh::PrimitiveTopology;
use bevy::prelude::*;
use foresound_bevy::foresound::TriangleMesh;
use foresound_bevy::foresound::mesh::{MeshOptions, load_mesh};
use foresound_bevy::{ForesoundGeometry, ForesoundMaterial, ForesoundSource};

use crate::ASSETS;

/// The triangles of the file.
#[derive(Resource)]
pub(crate) struct Hall(pub(crate) TriangleMesh);

/// What sounds: a file of `assets/speech`, and where it is (`concert_hall.toml` has the same places).
const VOICES: [(&str, [f32; 3]); 3] = [
    ("voice01.wav", [5.2, 2.5, 10.0]),
    ("voice02.wav", [2.7, 2.6, 12.0]),
    ("voice03.wav", [12.0, 1.5, 0.9]),
];

/// Reads the file.
pub(crate) fn load() -> Result<TriangleMesh, String> {
    let path = format!("{ASSETS}/scenes/concert_hall.obj");
    let file = load_mesh(Path::new(&path), &MeshOptions::default());
    file.map(|file| file.mesh)
        .map_err(|error| error.to_string())
}

/// Walls, chairs and voices.
pub(crate) fn build(
    hall: Res<Hall>,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut colours: ResMut<Assets<StandardMaterial>>,
    mut commands: Commands,
) {
    let root = (
        ForesoundGeometry,
        Transform::default(),
        Visibility::default(),
    );
    let root = commands.spawn(root).id();
    for (number, name) in hall.0.material_names.iter().enumerate() {
        let colour = StandardMaterial {
            base_color: colour(name),
            perceptual_roughness: 0.9,
            reflectance: 0.1,
            // Some walls of the file are sheets.
            cull_mode: None,
            double_sided: true,
            ..default()
        };
        commands.spawn((
            ChildOf(root),
            ForesoundMaterial::named(name.clone()),
            Mesh3d(meshes.add(mesh(&hall.0, number))),
            MeshMaterial3d(colours.add(colour)),
        ));
    }
    for (file, place) in VOICES {
        let voice = ForesoundSource::looped(assets.load(file));
        commands.spawn((voice, Transform::from_translation(place.into())));
    }
}

/// The triangles of one material, each with its own corners: flat walls have flat light.
fn mesh(hall: &TriangleMesh, material: usize) -> Mesh {
    let triangles = hall.triangles.iter().zip(&hall.triangle_materials);
    let own = triangles.filter(|(_, of)| **of as usize == material);
    let corners = own.flat_map(|(triangle, _)| triangle.map(|at| hall.vertices[at as usize]));
    let corners: Vec<[f32; 3]> = corners.map(|corner| corner.to_array()).collect();
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners)
    .with_computed_flat_normals()
}

/// As the file's own colours (`concert_hall.mtl`), darker: lines are drawn before them.
fn colour(name: &str) -> Color {
    match name {
        "parquet_on_concrete" | "wood_floor" => Color::srgb(0.36, 0.25, 0.15),
        "wood_panel" | "door_wood" => Color::srgb(0.40, 0.28, 0.17),
        "upholstered_seat" | "curtain" => Color::srgb(0.32, 0.07, 0.09),
        "steel" => Color::srgb(0.30, 0.32, 0.35),
        _ => Color::srgb(0.45, 0.44, 0.41),
    }
}
