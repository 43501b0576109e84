//! Surfaces and diffracting edges of a scene as a GLB file, to look at: a colour a surface, edges as lines.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use foresound::Result;
use foresound::output::whole_file::WholeFile;
use foresound::scene::Scene;
use glam::Vec3;
use serde_json::{Value, json};

/// Component types, drawing modes and targets of glTF.
const FLOAT: u32 = 5126;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

/// The file so far: JSON lists and the binary chunk.
#[derive(Default)]
struct Glb {
    binary: Vec<u8>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    materials: Vec<Value>,
}

/// Writes the surfaces and edges of a scene's fixed part, in world coordinates.
pub(crate) fn write(scene: &Scene, path: &Path) -> Result<()> {
    let mut of_surface: HashMap<u32, Vec<Vec3>> = HashMap::new();
    for (triangle, corners) in (0..).zip(scene.triangles()) {
        let surface = scene.surface_of(triangle);
        of_surface.entry(surface).or_default().extend(corners);
    }
    let mut glb = Glb::default();
    for (index, surface) in (0..).zip(scene.surfaces()) {
        let corners = of_surface.remove(&index).unwrap_or_default();
        let material = &scene.material_of(surface);
        let extras = json!({
            "acoustic_material": material.name,
            "scattering": material.scattering,
            "area_m2": surface.area_m2,
        });
        let name = format!("{:016x} {}", surface.key, material.name);
        glb.add(&name, &corners, TRIANGLES, colour(surface.key), &extras);
    }
    let ends = scene.edges().as_slice().iter();
    let ends = ends.flat_map(|edge| [edge.at(0.0), edge.at(edge.length_m)]);
    let ends: Vec<Vec3> = ends.map(|end| scene.to_world(end)).collect();
    glb.add("edges", &ends, LINES, [0.0, 0.0, 0.0], &json!({}));
    WholeFile::write(path, |file| file.write_all(&glb.bytes()))
}

/// A light colour that depends on the key alone.
fn colour(key: u64) -> [f64; 3] {
    [0, 8, 16].map(|shift| 0.35 + 0.6 * f64::from((key >> shift & 0xff) as u32) / 255.0)
}

impl Glb {
    /// Adds a node of points; nothing for none.
    fn add(&mut self, name: &str, points: &[Vec3], mode: u32, colour: [f64; 3], extras: &Value) {
        let (Some(low), Some(high)) = (
            points.iter().copied().reduce(Vec3::min),
            points.iter().copied().reduce(Vec3::max),
        ) else {
            return;
        };
        let offset = self.binary.len();
        for value in points.iter().flat_map(|point| point.to_array()) {
            self.binary.extend(value.to_le_bytes());
        }
        self.views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": self.binary.len() - offset,
        }));
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": FLOAT, "count": points.len(),
            "type": "VEC3", "min": low.to_array(), "max": high.to_array(),
        }));
        let [red, green, blue] = colour;
        self.materials.push(json!({
            "name": name, "doubleSided": true, "extras": extras,
            "pbrMetallicRoughness": {
                "baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.0,
            },
        }));
        self.meshes.push(json!({
            "name": name,
            "primitives": [{
                "attributes": {"POSITION": self.accessors.len() - 1},
                "material": self.materials.len() - 1, "mode": mode,
            }],
        }));
        self.nodes
            .push(json!({"name": name, "mesh": self.meshes.len() - 1}));
    }

    fn bytes(&self) -> Vec<u8> {
        let root = json!({
            "asset": {"version": "2.0", "generator": "foresound inspect --surfaces"},
            "scene": 0,
            "scenes": [{"nodes": (0..self.nodes.len()).collect::<Vec<_>>()}],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials,
            "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{"byteLength": self.binary.len()}],
        });
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let whole = 12 + 8 + text.len() + 8 + self.binary.len();
        let mut bytes = Vec::with_capacity(whole);
        bytes.extend(b"glTF\x02\0\0\0");
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.binary)] {
            if kind == b"JSON" {
                bytes.extend((whole as u32).to_le_bytes());
            }
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }
}
