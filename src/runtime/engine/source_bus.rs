//! What becomes of a source's block where the app mixes sources itself.

use crate::scene::SourceId;

/// Result of a call that renders sources apart ([`super::Renderer::render_source`]). Any but the first three is a mistake of the
/// caller: its output is silent, and sound goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BusStatus {
    /// The output holds the source's paths.
    Own,
    /// The source has no bus of its own: with more sources than slots it shares a slot, or it has no position. Its sound is in
    /// [`super::Renderer::render_reverb`]'s output. What it left in a slot of its own still fades out in its output.
    Shared,
    /// The source is not heard: masked by others, or the engine is paused. The block is discarded. What it left in a slot of its
    /// own still fades out in its output.
    Silent,
    /// No source of the graphics frame in use: never added, not in a frame yet, or removed. What a removed one played fades out in [`super::Renderer::render_reverb`]'s output.
    UnknownSource,
    /// A buffer has another length than the block, or the block has no frames or more than the engine's.
    WrongSize,
    /// No block has begun, or the source was rendered in this block already.
    WrongOrder,
    /// The engine was made without [`crate::GeneratorSettings::source_buses`].
    Off,
}

/// Where the mixer put a block of a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct MixedSource {
    pub(super) status: BusStatus,
    /// Slots of the source alone.
    pub(super) slots: [Option<usize>; 2],
}

impl From<BusStatus> for MixedSource {
    fn from(status: BusStatus) -> Self {
        Self {
            status,
            slots: [None; 2],
        }
    }
}

/// The app's last block of a source, for its fade-out: slots and their gains.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LastDry {
    pub(super) id: Option<SourceId>,
    pub(super) slots: [(u16, f32); 2],
}
