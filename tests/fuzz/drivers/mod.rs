//! What each fuzz target does with bytes, and what must hold then. Shared by the targets of `cargo fuzz` and by the twin
//! that every test run has (`tests/fuzz_twin.rs`), so that an input found by one is a test of the other.

pub(crate) mod bytes;
pub(crate) mod c_calls;
pub(crate) mod files;
pub(crate) mod matching;
pub(crate) mod meshes;

/// A target: its name, and what it does with bytes.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const TARGETS: [Target; 8] = [
    ("obj", files::obj),
    ("materials", files::materials),
    ("layout", files::layout),
    ("listener", files::listener),
    ("wav", files::wav),
    ("c_calls", c_calls::c_calls),
    ("commit", meshes::commit),
    ("matching", matching::matching),
];
