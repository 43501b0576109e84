//! What `best` may spend, and its ingredients one by one: each can be left out to see what it is worth.

/// Whose place propagation is computed for when its result is late.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PredictionTarget {
    /// The place where the listener is when propagation starts.
    None,
    /// The place where the listener will be when the result arrives.
    Arrival,
    /// Halfway through the time in which the result is used.
    Middle,
    /// The place where the listener will be when the result is replaced.
    #[default]
    End,
}

/// Sources that rays are counted for at least.
const LEAST_SOURCES: usize = 4;

/// Settings of [`crate::extrapolation::PredictorKind::Geometric`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GeometricSettings {
    /// Rays that may be cast in one graphics frame to see what blocks reflected paths, times the number of sources, four at
    /// least: few sources leave time for more. 0 leaves visibility to the updates.
    pub rays_per_source: u32,
    /// Updates for which a path is kept that was valid not long ago, so that it can be opened again; 0 keeps none.
    pub remembered_updates: u32,
    /// Whether delay, level and direction are computed anew in every graphics frame.
    pub exact_geometry: bool,
    /// Whether a path is dropped as soon as one of its points has left its surface.
    pub drop_outside: bool,
    /// Whether updates also name paths that are not there but may be for a listener nearby, closed until a ray finds them
    /// open.
    pub nearby: bool,
    /// Where updates are to be computed for.
    pub lead: PredictionTarget,
    /// Graphics frames of which one works a path out; the others continue it along a line. 1 works everything out in
    /// every frame; 0 counts as 1.
    pub exact_every: u32,
}

impl GeometricSettings {
    /// Everything on.
    pub const FULL: Self = Self {
        rays_per_source: 96,
        remembered_updates: 8,
        exact_geometry: true,
        drop_outside: true,
        nearby: true,
        lead: PredictionTarget::End,
        exact_every: 1,
    };

    /// The same at less than half the cost, for a sound thread: a path is worked out in one frame of three, and asked for
    /// by half as many rays, since updates come often.
    pub(crate) fn thrifty(self) -> Self {
        Self {
            rays_per_source: self.rays_per_source.div_ceil(2),
            exact_every: self.exact_every.max(3),
            ..self
        }
    }

    /// Rays of a graphics frame with so many sources.
    pub(crate) fn rays(&self, sources: usize) -> u64 {
        u64::from(self.rays_per_source) * sources.max(LEAST_SOURCES) as u64
    }
}

impl Default for GeometricSettings {
    fn default() -> Self {
        Self::FULL
    }
}
