//! A renderer of single paths, for the laws that listen.

use std::sync::Arc;

use foresound::error::Result;
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::offline::{OfflineRenderer, OfflineSettings};
use foresound::propagation::PropagationSettings;
use foresound::scene::Scene;

/// Graphics frames per second.
pub(super) const GRAPHICS_HZ: f64 = 60.0;

/// A renderer for one source, with reflections up to this order and without late reverb.
pub(super) fn renderer(scene: &Arc<Scene>, rate_hz: u32, depth: usize) -> Result<OfflineRenderer> {
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = GRAPHICS_HZ;
    settings.propagation = PropagationSettings {
        guide_rays: 1,
        source_rays: 1,
        depth,
        ..PropagationSettings::default()
    };
    settings.generation = GeneratorSettings {
        rate_hz,
        late: false,
        limiter: false,
        ..GeneratorSettings::default()
    };
    let hrtf = Arc::new(Hrtf::omnidirectional(rate_hz)?);
    OfflineRenderer::new(Arc::clone(scene), hrtf, settings)
}
