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
    /// Visibility rays per graphics frame and source if every frame evaluates every path; the budget is that of at least four
    /// sources. With 0 only the updates determine visibility.
    pub rays_per_source: u32,
    /// Whether updates also list invalid paths that may be valid nearby; they are silent until a ray finds them visible.
    pub nearby: bool,
    /// The listener position for which updates are computed.
    pub prediction_target: PredictionTarget,
    /// Each path is evaluated in one of this many graphics frames, or fewer, and extrapolated linearly in the others. 0 counts
    /// as 1.
    pub exact_every: u32,
}

impl GeometricSettings {
    /// Best quality. A sound thread evaluates paths less often where the work of a graphics frame would take too much time.
    pub const FULL: Self = Self {
        rays_per_source: 96,
        nearby: true,
        prediction_target: PredictionTarget::End,
        exact_every: 1,
    };

    /// Ray budget of a graphics frame in which one path of `exact_every` is evaluated: less often evaluated, less often
    /// tested.
    pub(crate) fn rays(&self, sources: usize, exact_every: u32) -> u64 {
        let rays = u64::from(self.rays_per_source) * sources.max(MIN_BUDGET_SOURCES) as u64;
        rays / u64::from(exact_every).max(1)
    }
}

impl Default for GeometricSettings {
    fn default() -> Self {
        Self::FULL
    }
}
