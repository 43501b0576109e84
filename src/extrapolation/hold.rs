//! Zero-order hold, the paper's comparison (section IV-D-5).

use super::frame::FramePath;
use super::predictor::{FrameContext, Predictor, TrackedPath, as_of_update};

/// Keeps amplitude, delay and direction as the newest update has them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hold;

impl Predictor for Hold {
    fn predict(&mut self, path: &TrackedPath<'_>, at: &FrameContext<'_>) -> FramePath {
        as_of_update(path.current, path.listener, at.scene)
    }
}
