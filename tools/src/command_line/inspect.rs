//! `inspect`: triangles, surfaces, area, materials, edges and bounds of a mesh.

use std::collections::HashSet;
use std::path::PathBuf;

use foresound::Result;
use glam::Vec3;
use serde_json::json;

use crate::inputs::{SceneArguments, bytes_text, load_scene, print_notes};
use crate::surfaces_file;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// OBJ, PLY, glTF or GLB file, or the name of a benchmark scene.
    file: PathBuf,
    #[command(flatten)]
    scene: SceneArguments,
    /// Write the surfaces and diffracting edges to a GLB file, a colour a surface.
    #[arg(long, value_name = "FILE.glb")]
    surfaces: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Coordinates rounded to a part of a metre; never −0.
fn rounded(position: Vec3, parts: f64) -> [f64; 3] {
    let round = |n: f64| (n * parts).round() / parts + 0.0;
    position.as_dvec3().to_array().map(round)
}

/// Metres to three decimals.
fn millimetres(position: Vec3) -> String {
    let [x, y, z] = rounded(position, 1e3);
    format!("[{x}, {y}, {z}]")
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let loaded = load_scene(&arguments.file, &arguments.scene)?;
    print_notes(&loaded.notes);
    let scene = &loaded.scene;
    if let Some(path) = &arguments.surfaces {
        surfaces_file::write(scene, path)?;
    }
    let report = scene.report();
    let mut names: Vec<&str> = scene.materials().iter().map(|m| m.name.as_str()).collect();
    // Rough surfaces have a material of their own under the same name.
    let mut known = HashSet::new();
    names.retain(|name| known.insert(*name));
    let area_m2: f64 = scene.surfaces().iter().map(|s| s.area_m2).sum();
    let (min, max) = (report.bounds_min, report.bounds_max);
    if arguments.json {
        let value = json!({
            "triangles": report.triangles,
            "surfaces": scene.surfaces().len(),
            "curved_surfaces": scene.curved_surfaces().len(),
            "acoustic_tolerance_m": scene.acoustic_tolerance_m(),
            "flattened_regions": scene.flattened_regions(),
            "area_m2": area_m2,
            "materials": names,
            "defaulted_materials": scene.defaulted_materials(),
            "edges": report.edges,
            "open_edges": report.boundary_edges,
            "non_manifold_edges": report.non_manifold_edges,
            "closed": report.watertight,
            "diffracting_edges": scene.edges().len(),
            "triangles_in": report.triangles_in,
            "dropped_non_finite": report.dropped_non_finite,
            "dropped_degenerate": report.dropped_degenerate,
            "dropped_duplicate": report.dropped_duplicate,
            "vertices_welded": report.vertices_welded,
            "bounds_min_m": rounded(min, 1e6),
            "bounds_max_m": rounded(max, 1e6),
            "memory_bytes": scene.memory_bytes(),
        });
        outln!("{value}");
        return Ok(());
    }
    outln!("{}", arguments.file.display());
    outln!(
        "  triangles   {} of {}",
        report.triangles,
        report.triangles_in
    );
    outln!("  surfaces    {}", scene.surfaces().len());
    if !scene.curved_surfaces().is_empty() {
        outln!(
            "  curved      {} of spheres and cylinders",
            scene.curved_surfaces().len()
        );
    }
    if scene.flattened_regions() > 0 {
        outln!(
            "  flattened   {} rough regions, within {:.0} mm",
            scene.flattened_regions(),
            1e3 * scene.acoustic_tolerance_m()
        );
    }
    outln!("  area        {area_m2:.3} m²");
    outln!("  materials   {}", names.join(", "));
    let watertight = if report.watertight {
        "watertight"
    } else {
        "not watertight"
    };
    outln!(
        "  edges       {}: {} at a boundary, {} shared by more than two; {watertight}",
        report.edges,
        report.boundary_edges,
        report.non_manifold_edges
    );
    outln!("  diffracting {} edges", scene.edges().len());
    outln!("  welded      {} vertices", report.vertices_welded);
    let [low, high, size] = [min, max, max - min].map(millimetres);
    outln!("  bounds      {low} to {high} m, size {size}");
    outln!("  memory      {}", bytes_text(scene.memory_bytes()));
    Ok(())
}
