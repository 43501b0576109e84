//! Saved scenes: bytes of any content end in a scene that can be used or in an error of one line.

use std::sync::{Arc, OnceLock};

use foresound::propagation::{PathSet, Propagator};
use foresound::scene::committed::saved::{HEADER_BYTES, sealed};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use glam::{DAffine3, DVec3, Vec3};

use super::meshes::SETTINGS;

/// Words that are difficult for lists, indices and numbers.
const WORDS: [u32; 8] = [
    0,
    1,
    2,
    255,
    0x3f80_0000,
    0x7f7f_ffff,
    0x8000_0000,
    u32::MAX,
];

/// The content of a saved scene: a room with a box and a floor of many triangles.
fn content() -> &'static [u8] {
    static CONTENT: OnceLock<Vec<u8>> = OnceLock::new();
    CONTENT.get_or_init(|| {
        let mut mesh = procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "concrete");
        let part = procedural::shoebox(Vec3::new(1.0, 0.5, 1.0), "wood_panel");
        for x in 0..5 {
            // Boxes in a row: their tops are one surface of ten triangles, which has a grid.
            let at = DAffine3::from_translation(DVec3::new(0.4 + f64::from(x), 0.7, 2.0));
            mesh.append(&part, &at).expect("a part of a room");
        }
        let table = MaterialTable::built_in();
        let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a room");
        scene.to_bytes().expect("no instances")[HEADER_BYTES..].to_vec()
    })
}

/// Bytes as they are, and a good content with changes: each four bytes are a position and what comes there.
pub(crate) fn saved(data: &[u8]) {
    if let Err(error) = Scene::from_bytes(data) {
        assert_eq!(error.to_string().lines().count(), 1);
    }
    let mut content = content().to_vec();
    for change in data.as_chunks::<4>().0 {
        let [high, middle, low, value] = *change;
        let at = u32::from_be_bytes([0, high, middle, low]) as usize % content.len();
        match WORDS.get(usize::from(value)) {
            Some(word) => {
                let bytes = word.to_le_bytes();
                let end = content.len().min(at + bytes.len());
                content[at..end].copy_from_slice(&bytes[..end - at]);
            }
            None if value == 8 => content.truncate(at.max(1)),
            None => content[at] = value,
        }
    }
    let scene = match Scene::from_bytes(&sealed(&content)) {
        Ok(scene) => scene,
        Err(error) => return assert_eq!(error.to_string().lines().count(), 1),
    };
    let mut propagator = Propagator::new(Arc::new(scene), SETTINGS).expect("settings");
    let source = SourcePose::at(SourceId::new(0, 0), [1.0, 1.5, 1.0]);
    let listener = ListenerPose::facing([4.0, 1.7, 3.5], 0.0);
    propagator.update(&listener, &[source], 0.0, &mut PathSet::default());
}
