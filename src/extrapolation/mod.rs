//! EPS: the extrapolation stage. For every graphics frame it says how loud, how late and from where each path is now.

pub mod frame;

pub use frame::{FramePath, FramePaths, LateSend};
