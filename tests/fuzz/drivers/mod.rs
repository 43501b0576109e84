//! Each fuzz target's use of the bytes and its invariants. Shared by `cargo fuzz` and by `tests/fuzz_twin.rs`, which every
//! test run includes: an input found by one is a test of the other.

pub(crate) mod bytes;
pub(crate) mod c_calls;
mod c_playback;
pub(crate) mod files;
pub(crate) mod matching;
pub(crate) mod meshes;
pub(crate) mod saved;

/// A target: its name and its function of the bytes.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const TARGETS: [Target; 13] = [
    ("obj", files::obj),
    ("materials", files::materials),
    ("layout", files::layout),
    ("listener", files::listener),
    ("wav", files::wav),
    ("c_calls", c_calls::c_calls),
    ("commit", meshes::commit),
    ("matching", matching::matching),
    ("ply", files::mesh_file),
    ("gltf", files::mesh_file),
    ("saved", saved::saved),
    ("sofa", files::sofa),
    ("compressed", files::compressed),
];
