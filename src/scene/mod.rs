//! What the visitor brings: meshes, materials, sources, a listener. Once committed a scene does not change.
//!
//! Control side. Coordinates are metres, right-handed, +y up.

pub mod mesh;
pub mod pose;
pub mod procedural;

pub use mesh::TriangleMesh;
pub use pose::{ListenerPose, SourceId, SourcePose};
