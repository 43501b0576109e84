//! Playback under overload: the table beside the paper's Figure 8.

use serde::Serialize;

use super::html::{escaped, row, table};
use crate::playback::AHEAD;
use crate::si_snr::capped_text;

/// One schedule under one load.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverloadRow {
    /// Name of the scene.
    pub scene: String,
    /// Number of sources.
    pub sources: usize,
    /// Time of the median update, in graphics frame times.
    pub load: f64,
    /// Name of the schedule.
    pub schedule: String,
    /// Graphics frames that were due.
    pub frames: usize,
    /// Graphics frames that took longer than a frame time.
    pub late: usize,
    /// Graphics frames that were dropped.
    pub dropped: usize,
    /// Blocks that the device played again.
    pub repeated: usize,
    /// SI-SNR in dB against the synchronous rendering in time, not capped.
    pub si_snr_db: f64,
}

/// The section's content; empty without rows.
pub(super) fn overload(rows: &[OverloadRow]) -> String {
    let Some(first) = rows.first() else {
        return String::new();
    };
    let head = [
        "update, frame times",
        "schedule",
        "frames due",
        "made late",
        "dropped",
        "blocks repeated",
        "SI-SNR dB",
    ];
    let line = |r: &OverloadRow| {
        let counted = |count: usize| {
            let share = 100.0 * count as f64 / r.frames.max(1) as f64;
            format!("{count} ({share:.0} %)")
        };
        let cells = [
            r.load.to_string(),
            escaped(&r.schedule),
            r.frames.to_string(),
            counted(r.late),
            counted(r.dropped),
            counted(r.repeated),
            escaped(&capped_text(r.si_snr_db)),
        ];
        row("", &cells)
    };
    format!(
        "<p>{}, {} sources, walking listener, on a virtual clock. Cost model: each ray takes the same time, and the median \
         update takes the first column's share of a graphics frame; generation costs nothing. The synchronous loop casts \
         an update's rays within every frame; <code>best</code> casts at most its own few, and updates have another core. \
         The device holds {AHEAD} blocks; when none has arrived it repeats the last one, and a loop that is late drops \
         frames. The last pair is the paper's own ratio. The reference is the synchronous rendering of a machine that is \
         never late.</p>{}",
        escaped(&first.scene),
        first.sources,
        table(
            "names",
            "",
            &head,
            &rows.iter().map(line).collect::<String>()
        )
    )
}
