//! Settings of the geometric predictor.

/// The listener position for which an asynchronous update is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PredictionTarget {
    /// The position when propagation starts: no prediction.
    None,
    /// The predicted position when the result arrives.
    Arrival,
    /// The predicted position halfway through the interval in which the result is used.
    Middle,
    /// The predicted position when the result is replaced.
    #[default]
    End,
}

/// Smallest number of sources in the ray budget.
const MIN_BUDGET_SOURCES: usize = 4;

/// Settings of [`crate::extrapolation::PredictorKind::Geometric`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GeometricSettings {
    /// Visibility rays per graphics frame and source; the budget is that of at least four sources. With 0 only the updates determine visibility.
    pub rays_per_source: u32,
    /// Whether updates also list invalid paths that may be valid nearby; they are silent until a ray finds them visible.
    pub nearby: bool,
    /// The listener position for which updates are computed.
    pub prediction_target: PredictionTarget,
    /// Reflections, edge waves and paths around edges are evaluated in one of this many graphics frames, and extrapolated linearly
    /// in the others as long as source and listener move less than 0.1 m together. 0 counts as 1. Where a sound thread has little
    /// time, in one of up to twice as many. Delay and direction of the straight path are exact in every frame.
    pub exact_every: u32,
}

impl GeometricSettings {
    /// Best quality. A sound thread casts fewer rays where the work of a graphics frame would take too much time.
    pub const FULL: Self = Self {
        rays_per_source: 96,
        nearby: true,
        prediction_target: PredictionTarget::End,
        exact_every: 4,
    };

    /// Ray budget of a graphics frame of so many sources.
    pub(crate) fn rays(&self, sources: usize) -> u64 {
        u64::from(self.rays_per_source) * sources.max(MIN_BUDGET_SOURCES) as u64
    }
}

impl Default for GeometricSettings {
    fn default() -> Self {
        Self::FULL
    }
}
