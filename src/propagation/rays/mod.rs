//! Rays of the propagation stage: their directions, packets of them, and guide rays.

pub mod directions;
pub mod guide_rays;
pub(crate) mod packet;
pub(crate) mod prefix_set;
