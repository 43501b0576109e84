//! What the visitor brings: meshes, materials, sources, a listener. Once committed a scene does not change but for its
//! instances, which move.
//!
//! Control side. Coordinates are metres, right-handed, +y up.

mod cells;
pub mod commit;
pub mod committed;
pub mod directivity;
pub mod edges;
pub mod instances;
#[cfg(feature = "files")]
pub mod io;
pub mod layout;
pub mod materials;
pub mod mesh;
pub mod pose;
pub mod procedural;
pub mod source;
pub mod surface;
pub mod weld;

pub use commit::{CommittedMesh, commit_mesh};
pub use committed::{Scene, SceneSettings};
pub use directivity::{Directivity, DirectivityTable};
pub use edges::{Edge, EdgeSet};
pub use instances::{InstanceId, InstancePose};
#[cfg(feature = "files")]
pub use io::obj::{ObjFile, ObjOptions, UpAxis, load_obj};
pub use layout::{NamedSource, SceneLayout, Walk};
pub use materials::MaterialTable;
pub use mesh::TriangleMesh;
pub use pose::{ListenerPose, SourceId, SourcePose};
pub use source::{Effects, SourceSettings};
pub use surface::{Surface, SurfaceSet};
pub use weld::{IntakeReport, clean};
