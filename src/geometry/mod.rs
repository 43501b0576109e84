//! Rays, triangles and the trees over them. Pure geometry without acoustics.
//!
//! Queries take `&self`, may come from any thread at once, and neither allocate nor block. Lengths are metres in one
//! coordinate system, which the caller chooses.

pub mod aabb;
pub mod aabb_tree;
pub(crate) mod angle;
pub mod bvh;
mod intersect;
pub mod ray;
mod stack;
pub mod triangle;

pub use aabb::Aabb;
pub use aabb_tree::AabbTree;
pub use bvh::Bvh;
pub use ray::{Hit, Ray};
