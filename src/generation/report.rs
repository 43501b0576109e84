//! What one call of the audio side did. The audio side never fails: it reports.

/// Report of one rendered stretch; counts are those since the last report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockReport {
    /// Audio frames written.
    pub frames: u32,
    /// Voices that live or fade now.
    pub voices: u32,
    /// Paths that got no voice: beyond [`super::GeneratorSettings::max_voices`] (the quietest), of an unknown source,
    /// with a value that is not a number or out of range, or not in order of their identity.
    pub dropped_paths: u32,
    /// Paths longer than [`super::GeneratorSettings::max_delay_s`].
    pub dropped_delays: u32,
    /// Paths that start in a later graphics frame because too many voices still fade.
    pub late_starts: u32,
    /// Input samples that were not a number below 1e6 in magnitude, and output samples that were none; all set to zero.
    pub non_finite: u32,
    /// Smallest gain of the limiter, 1 if it had nothing to do or is off.
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
