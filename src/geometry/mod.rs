//! Rays and triangles. Deaf: knows nothing of sound.
//!
//! Pure data and `&self` queries, usable from any thread at once; nothing here allocates after a tree is built.

pub mod box_tree;
pub mod bvh;
pub mod ray;
pub mod triangle;

pub use box_tree::{Bounds, BoxTree};
pub use bvh::Bvh;
pub use ray::{Hit, Ray};
