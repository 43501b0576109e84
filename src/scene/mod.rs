//! Input of the simulation: meshes, materials, sources, a listener. A committed scene is fixed except for the poses of
//! its instances.
//!
//! Control side. Coordinates are metres, right-handed, +y up.

mod closed_parts;
pub mod commit;
pub mod committed;
pub mod directivity;
pub mod edges;
mod flatten;
#[cfg(feature = "files")]
pub mod io;
pub mod layout;
pub mod materials;
pub mod mesh;
pub mod pose;
pub mod procedural;
pub mod source;
pub mod source_mix;
mod spatial_hash;
pub mod surface;
pub mod weld;

pub use commit::{CommittedMesh, RoughnessSettings, commit_mesh, commit_rough_mesh};
pub use committed::{Scene, SceneSettings, instances};
pub use directivity::{Directivity, DirectivityTable};
pub use edges::{Edge, EdgeSet};
pub use instances::{InstanceId, InstancePose};
#[cfg(feature = "files")]
pub use io::formats::load_mesh;
#[cfg(feature = "files")]
pub use io::mesh_file::{MeshFile, MeshOptions, UpAxis};
pub use layout::{NamedSource, SceneLayout, Walk};
pub use materials::MaterialTable;
pub use mesh::TriangleMesh;
pub use pose::{ListenerPose, SourceId, SourcePose};
pub use source::{DEFAULT_PRIORITY, Effects, MAX_EXTENT_POINTS, SourceExtent, SourceSettings};
pub use source_mix::{DistanceCurve, DistanceTable, MAX_DISTANCE_POINTS, SourceMix};
pub use surface::{Surface, SurfaceSet};
pub use weld::{IntakeReport, clean};
