//! Result of one render call. The audio side never fails: it reports counts.

/// Report of one render call; counts are those since the last report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockReport {
    /// Audio frames written.
    pub frames: u32,
    /// Active and fading voices.
    pub voices: u32,
    /// Paths without a voice: beyond [`super::GeneratorSettings::max_voices`] (the quietest), of an unknown source,
    /// with a value out of range or NaN, or not in order of their identity.
    pub dropped_paths: u32,
    /// Paths longer than [`super::GeneratorSettings::max_delay_s`].
    pub dropped_delays: u32,
    /// Paths that start in a later graphics frame because too many voices still fade.
    pub late_starts: u32,
    /// Input samples that are NaN or at least 1e6 in magnitude, and non-finite output samples; all set to zero.
    pub non_finite: u32,
    /// Smallest linear gain of the limiter; 1 without limiting.
    pub limiter_gain_min: f32,
}

impl Default for BlockReport {
    fn default() -> Self {
        Self {
            frames: 0,
            voices: 0,
            dropped_paths: 0,
            dropped_delays: 0,
            late_starts: 0,
            non_finite: 0,
            limiter_gain_min: 1.0,
        }
    }
}
