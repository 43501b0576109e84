//! Surfaces: coplanar triangles of one material, with one mirror plane for image sources.
//!
//! Control side to build; queries are wait-free. The floors of two rooms are one surface: a path keeps its identity while
//! the listener walks through a door. Own; the tolerances are [`SAME_PLANE_ANGLE_DEG`] and [`SAME_PLANE_DISTANCE_M`].

mod border;
pub mod curved;
pub mod finite_panel;
mod grid;
mod group;
pub(super) mod key;
pub(super) mod panel;

use glam::{DVec3, Vec3};

use super::mesh::TriangleMesh;
use super::weld::sorted_edges;
use crate::binary::{are_below, stored};
pub(in crate::scene) use border::BorderPieces;
use curved::CurvedSurfaces;
use grid::Grids;
pub use grid::INSIDE_TOLERANCE_M;
pub use group::{SAME_PLANE_ANGLE_DEG, SAME_PLANE_DISTANCE_M};
pub(super) use group::{canonical, is_parallel};

/// A plane figure of one material, not necessarily connected. Lengths in metres, in the coordinates of
/// [`super::commit::CommittedMesh::vertices`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Name across commits: a hash of plane, position and material name, unique in its set. It does not depend on the order
    /// of triangles, vertices or materials, nor on other objects unless another surface has the same hash.
    pub key: u64,
    /// Unit normal of the area-weighted mean plane. Its first component of y, x, z beyond 1e-6 is positive.
    pub normal: DVec3,
    /// Distance of the plane from the origin along the normal: `normal · p = offset_m` for points of the plane.
    pub offset_m: f64,
    /// Index into the scene's materials.
    pub material: u32,
    /// Area in m²; overlapping parts count twice.
    pub area_m2: f64,
    /// Least coordinates of the corners.
    pub bounds_min: Vec3,
    /// Greatest coordinates of the corners.
    pub bounds_max: Vec3,
    /// Index of its first triangle in [`SurfaceSet::triangles`].
    pub first_triangle: u32,
    /// Number of its triangles.
    pub triangle_count: u32,
    /// Number of them, the first ones, in panels: connected pieces large enough for specular reflection.
    pub panel_triangle_count: u32,
}

impl Surface {
    /// Signed distance of a point from the plane in metres, positive on the normal's side.
    #[inline]
    pub fn distance_m(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset_m
    }

    /// A point mirrored in the plane.
    #[inline]
    pub fn mirror(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.distance_m(point) * self.normal
    }
}

/// All surfaces of a mesh, sorted by [`Surface::key`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceSet {
    /// The surfaces.
    pub surfaces: Vec<Surface>,
    /// The surface of each triangle of the mesh.
    pub triangle_surface: Vec<u32>,
    /// Triangles by surface, each from [`Surface::first_triangle`].
    pub triangles: Vec<u32>,
    /// Whether each triangle of the mesh belongs to a panel.
    triangle_in_panel: Vec<bool>,
    /// Regions of facets that reflect as a smooth surface; they belong to no panel.
    pub(in crate::scene) curved: CurvedSurfaces,
    border: BorderPieces,
    grids: Grids,
}

impl SurfaceSet {
    /// Surfaces of a mesh after [`super::weld::clean`]. `centre` is the origin of `vertices`, the mesh's vertices
    /// in the coordinates of the result. A connected piece of at least `min_panel_m2` is a panel.
    pub(super) fn build(
        mesh: &TriangleMesh,
        centre: DVec3,
        vertices: &[Vec3],
        min_panel_m2: f64,
    ) -> Self {
        let groups = group::group(mesh, centre);
        let mut surfaces: Vec<Surface> = groups
            .surfaces
            .iter()
            .map(|found| Surface {
                key: found.key(&mesh.material_names[found.material as usize]),
                normal: found.normal,
                offset_m: found.offset_m - found.normal.dot(centre),
                material: found.material,
                area_m2: found.area_m2,
                bounds_min: Vec3::INFINITY,
                bounds_max: Vec3::NEG_INFINITY,
                first_triangle: 0,
                triangle_count: 0,
                panel_triangle_count: 0,
            })
            .collect();
        let keys: Vec<u64> = surfaces.iter().map(|surface| surface.key).collect();
        for (surface, key) in surfaces.iter_mut().zip(key::distinct(&keys)) {
            surface.key = key;
        }
        let mut order: Vec<u32> = (0..surfaces.len() as u32).collect();
        order.sort_unstable_by_key(|&index| surfaces[index as usize].key);
        let mut new_index = vec![0u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            new_index[old as usize] = new as u32;
        }
        surfaces.sort_unstable_by_key(|surface| surface.key);

        let triangle_surface: Vec<u32> = groups
            .triangle_surface
            .iter()
            .map(|&old| new_index[old as usize])
            .collect();
        for (triangle, &index) in mesh.triangles.iter().zip(&triangle_surface) {
            let surface = &mut surfaces[index as usize];
            surface.triangle_count += 1;
            for &i in triangle {
                surface.bounds_min = surface.bounds_min.min(vertices[i as usize]);
                surface.bounds_max = surface.bounds_max.max(vertices[i as usize]);
            }
        }
        let mut first = 0;
        let mut next: Vec<u32> = Vec::with_capacity(surfaces.len());
        for surface in &mut surfaces {
            surface.first_triangle = first;
            next.push(first);
            first += surface.triangle_count;
        }
        let curved = CurvedSurfaces::find(mesh, centre, vertices, min_panel_m2);
        let sides = sorted_edges(&mesh.triangles);
        let roots = panel::roots(&sides, &triangle_surface);
        let mut triangle_in_panel = panel::large_enough(mesh, &roots, min_panel_m2);
        for (triangle, in_panel) in (0..).zip(&mut triangle_in_panel) {
            *in_panel &= curved.of_triangle(triangle).is_none();
        }
        let mut triangles = vec![0u32; mesh.triangles.len()];
        // Those of panels first.
        for panels in [true, false] {
            for (index, &surface) in triangle_surface.iter().enumerate() {
                if triangle_in_panel[index] != panels {
                    continue;
                }
                let slot = &mut next[surface as usize];
                triangles[*slot as usize] = index as u32;
                *slot += 1;
                surfaces[surface as usize].panel_triangle_count += u32::from(panels);
            }
        }
        let grids = Grids::build(&surfaces, &triangles, &mesh.triangles, vertices);
        let mut set = Self {
            surfaces,
            triangle_surface,
            triangles,
            triangle_in_panel,
            curved,
            border: BorderPieces::default(),
            grids,
        };
        let pieces = (&*sides, &*roots);
        set.border = BorderPieces::build(vertices, &mesh.triangles, &set, pieces, min_panel_m2);
        set
    }

    /// Pieces that may be panels together with those of other parts.
    pub(in crate::scene) fn border(&self) -> &BorderPieces {
        &self.border
    }

    /// [`Self::reflects_at`] for a border piece.
    pub(in crate::scene) fn border_piece_holds(&self, piece: u32, point: DVec3) -> bool {
        let surface = self.border.as_slice()[piece as usize].surface;
        let normal = self.surfaces[surface as usize].normal;
        let mut slots = self.border.slots_of(piece).iter();
        slots.any(|&slot| self.grids.triangle_holds(slot, normal, point))
    }

    /// The triangles of a surface.
    ///
    /// # Panics
    /// If there is no such surface.
    pub fn triangles_of(&self, surface: u32) -> &[u32] {
        let surface = &self.surfaces[surface as usize];
        let first = surface.first_triangle as usize;
        &self.triangles[first..first + surface.triangle_count as usize]
    }

    /// Whether a triangle belongs to a panel.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn is_panel(&self, triangle: u32) -> bool {
        self.triangle_in_panel[triangle as usize]
    }

    /// Whether a point of a surface's plane lies inside a triangle of one of its panels, or closer to one than
    /// [`INSIDE_TOLERANCE_M`], which closes gaps along inner edges. The point is projected along the normal's largest
    /// component; its distance from the plane is not tested.
    ///
    /// # Panics
    /// If there is no such surface.
    ///
    /// # Real-time
    /// Allocates nothing; one grid cell's triangles are tested.
    #[inline]
    pub fn reflects_at(&self, surface: u32, point: DVec3) -> bool {
        self.grids
            .contains(surface, &self.surfaces[surface as usize], point)
    }

    /// Memory that the set occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.surfaces.as_slice())
            + size_of_val(self.triangle_surface.as_slice())
            + size_of_val(self.triangles.as_slice())
            + self.triangle_in_panel.len()
            + self.curved.memory_bytes()
            + self.border.memory_bytes()
            + self.grids.memory_bytes()
    }

    /// Index of a surface by its key.
    pub fn find(&self, key: u64) -> Option<u32> {
        self.surfaces
            .binary_search_by_key(&key, |surface| surface.key)
            .ok()
            .map(|index| index as u32)
    }
}

stored!(Surface {
    key: u64,
    normal: DVec3,
    offset_m: f64,
    material: u32,
    area_m2: f64,
    bounds_min: Vec3,
    bounds_max: Vec3,
    first_triangle: u32,
    triangle_count: u32,
    panel_triangle_count: u32,
});

stored!(SurfaceSet {
    surfaces: Vec<Surface>,
    triangle_surface: Vec<u32>,
    triangles: Vec<u32>,
    triangle_in_panel: Vec<bool>,
    curved: CurvedSurfaces,
    border: BorderPieces,
    grids: Grids,
});

impl SurfaceSet {
    /// Whether a set that was loaded has all that its queries rely on, for a mesh of `triangles` and a list of `materials`.
    pub(super) fn is_consistent(&self, triangles: usize, materials: usize) -> bool {
        let mut end = 0;
        let is_in_order = |surface: &Surface| {
            let starts = u64::from(surface.first_triangle) == end;
            end += u64::from(surface.triangle_count);
            starts
                && surface.panel_triangle_count <= surface.triangle_count
                && (surface.material as usize) < materials
        };
        let lists = [&self.triangle_surface, &self.triangles].map(Vec::len);
        let mut surfaces = self.surfaces.iter();
        lists == [triangles; 2]
            && self.triangle_in_panel.len() == triangles
            && self.curved.is_consistent(triangles)
            && self.border.is_consistent(self.surfaces.len(), triangles)
            && surfaces.all(is_in_order)
            && end == triangles as u64
            && are_below(&self.triangle_surface, self.surfaces.len())
            && are_below(&self.triangles, triangles)
            && self.grids.is_consistent(&self.surfaces, triangles)
    }
}
