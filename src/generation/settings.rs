//! Settings of a generator.

use crate::acoustics::bands::EDGES_HZ;
use crate::error::{Error, Result};
use crate::generation::panning::layout::Layout;

/// Most listeners.
pub(crate) const MAX_LISTENERS: usize = 4;

/// Longest block in audio frames whose sources are rendered apart.
pub(crate) const MAX_BLOCK: usize = 4096;

// Measured; `tools/tests/limits.rs` compares them with what is allocated.
/// Bytes of a voice: weights of two ears, histories, plan.
const VOICE_BYTES: usize = 2200;
/// Bytes of a slot besides its delay line's length: sends, filters, the line's ends.
const SLOT_BYTES: usize = 32_000;
/// Bytes of a slot's bus: filters, buses of both ears, and a longer delay line.
const BUS_BYTES: usize = 230_000;
/// Bytes of an HRTF set, the late reverb and scratch.
const FIXED_BYTES: usize = 3 << 20;

/// Settings of a generator; fixed at its construction.
///
/// ```
/// use foresound::GeneratorSettings;
///
/// let settings = GeneratorSettings { rate_hz: 48_000, ..GeneratorSettings::default() };
/// assert!(settings.check().is_ok());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct GeneratorSettings {
    /// Sample rate in Hz, that of the HRTF set; 16,000 to 192,000.
    pub rate_hz: u32,
    /// Source slots, 1 to 256. Each delay line takes 32 bytes × rate × seconds, of at most `max_delay_s`: an engine's lines begin
    /// with 0.15 s and grow with the paths. See [`Self::memory_bytes`].
    pub max_sources: usize,
    /// Most simultaneous paths, 1 to 16,384; the quietest beyond them are dropped and counted.
    pub max_voices: usize,
    /// Number of loudest paths that use every component of the HRTF set; the others use the first eight. With the
    /// built-in sets this raises a path's mean spectral error from 0.6 to 1.2 dB. At most [`Self::max_voices`] apply.
    /// In binaural sound, from 44.1 kHz on, all paths but the loudest (a quarter of this number, at least 16) reach each ear to the
    /// nearest audio frame, 11 us off at most; with [`Self::max_voices`] here all have exact delays.
    pub fine_voices: usize,
    /// Longest path delay in seconds, 0.01 to 10; longer paths are dropped and counted. 1.5 s are 515 m.
    pub max_delay_s: f64,
    /// Whether the late reverb runs.
    pub late: bool,
    /// Whether the output is limited. Off for impulse responses: the output is then linear, and 1.5 ms earlier.
    pub limiter: bool,
    /// Layout of the output at first.
    pub layout: Layout,
    /// Channels of the output, constant while the layout may change; `None` is the number that `layout` has. Channels
    /// beyond those of a layout are silent. To 16.
    pub channels: Option<usize>,
    /// Ceiling of the limiter in dB re full scale, −60 to 0.
    pub ceiling_db: f32,
    /// Whether sources can be rendered apart, each into a bus of its own. Takes 0.2 MB a slot, and in binaural sound the HRTF's
    /// filters once a source.
    pub source_buses: bool,
    /// Listeners, 1 to 4: for a split screen or spectators. Each has its own voices and late reverb; the sources' delay lines are
    /// common.
    pub listeners: usize,
}

impl Default for GeneratorSettings {
    /// 16 sources with 64 paths each at 44.1 kHz, 16 of them with all HRTF components.
    fn default() -> Self {
        Self {
            rate_hz: 44_100,
            max_sources: 16,
            max_voices: 1024,
            fine_voices: 256,
            max_delay_s: 1.5,
            late: true,
            limiter: true,
            layout: Layout::default(),
            channels: None,
            ceiling_db: -0.3,
            source_buses: false,
            listeners: 1,
        }
    }
}

impl GeneratorSettings {
    /// Longest block in audio frames that reads a delay line after it has been written.
    pub(crate) fn longest_block(&self) -> usize {
        if self.source_buses { MAX_BLOCK } else { 0 }
    }

    /// Bytes of a generator with the longest delay lines, stated to a quarter.
    pub fn memory_bytes(&self) -> usize {
        let line_bytes = 32.0 * self.max_delay_s * f64::from(self.rate_hz);
        let bus_bytes = match self.source_buses {
            true => BUS_BYTES,
            false => 0,
        };
        let slots = self
            .max_sources
            .saturating_mul(SLOT_BYTES + bus_bytes + line_bytes as usize);
        let voices = self.max_voices.saturating_mul(VOICE_BYTES);
        let own = voices.saturating_add(FIXED_BYTES);
        slots.saturating_add(own.saturating_mul(self.listeners))
    }

    /// Channels of the output.
    pub fn output_channels(&self) -> usize {
        self.channels.unwrap_or(self.layout.channels())
    }

    /// Checks every range.
    ///
    /// Errors: [`Error::Setting`] with the setting's name and advice.
    pub fn check(&self) -> Result<()> {
        // The highest crossover must be well below half the rate.
        let lowest_hz = (EDGES_HZ[EDGES_HZ.len() - 1] * 2.5) as u32;
        within("rate_hz", self.rate_hz, lowest_hz.max(16_000), 192_000)?;
        within("max_sources", self.max_sources, 1, 256)?;
        within("max_voices", self.max_voices, 1, 16_384)?;
        within("max_delay_s", self.max_delay_s, 0.01, 10.0)?;
        within("channels", self.output_channels(), 1, 16)?;
        self.layout.check_channels(self.output_channels())?;
        within("listeners", self.listeners, 1, MAX_LISTENERS)?;
        within("ceiling_db", self.ceiling_db, -60.0, 0.0)
    }
}

fn within<T: PartialOrd + std::fmt::Display>(name: &str, value: T, low: T, high: T) -> Result<()> {
    if value >= low && value <= high {
        Ok(())
    } else {
        Err(Error::setting(
            name,
            format!("{value} is out of range"),
            &format!("choose a value from {low} to {high}"),
        ))
    }
}
