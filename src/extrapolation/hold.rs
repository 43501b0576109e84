//! Zero-order hold, the paper's comparison (section IV-D-5).

use super::frame::FramePath;
use super::predictor::{FrameContext, Predictor, TrackedPath};

/// Holds amplitude, delay and direction of the newest update.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hold;

impl Predictor for Hold {
    fn predict(&mut self, path: &TrackedPath<'_>, at: &FrameContext<'_>) -> FramePath {
        FramePath::of(path.current, path.source, path.listener, at.scene)
    }
}
