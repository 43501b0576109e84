//! Work budget for graphics frames that are computed in parts.
//!
//! Audio side; arithmetic. The sound thread computes a part of a graphics frame in each block, which evens out the block
//! times. Work is counted, not timed: equal budgets produce equal parts. The frame is bit-identical for all budgets.

/// Work in units of some 600 instructions, 70 to 120 ns on a desktop core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkBudget {
    limit: u32,
    spent: u32,
}

/// The result of one part of a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Progress {
    /// Rays cast.
    pub rays: u64,
    /// Whether the frame is complete.
    pub is_done: bool,
}

impl WorkBudget {
    /// A budget of `limit` units.
    pub const fn of(limit: u32) -> Self {
        Self { limit, spent: 0 }
    }

    /// An unlimited budget.
    pub const fn boundless() -> Self {
        Self::of(u32::MAX)
    }

    /// Adds units of work.
    pub(crate) fn spend(&mut self, work: usize) {
        let work = u32::try_from(work).unwrap_or(u32::MAX);
        self.spent = self.spent.saturating_add(work);
    }

    /// Units spent; the last piece of work may exceed the limit.
    pub fn spent(&self) -> u32 {
        self.spent
    }

    /// Units left.
    pub fn left(&self) -> u32 {
        self.limit.saturating_sub(self.spent)
    }

    /// Whether the budget is spent.
    pub fn is_spent(&self) -> bool {
        self.spent >= self.limit
    }
}

/// Costs in units, after counts of instructions with sixteen sources in the concert hall (`examples/count_blocks.rs`).
pub(crate) mod cost {
    /// A ray.
    pub(crate) const RAY: usize = 1;
    /// The points of a reflected path.
    pub(crate) const UNFOLDED: usize = 2;
    /// Amplitude and direction of a reflected path.
    pub(crate) const REFLECTED: usize = 4;
    /// A path over a curved surface. One of unknown geometry, which is rare, counts as much.
    pub(crate) const CURVED: usize = 18;
    /// The points of a diffracted path.
    pub(crate) const DIFFRACTED: usize = 15;
    /// The diffracted wave of one edge, with what is looked for along its faces.
    pub(crate) const WAVE: usize = 27;
    /// On which sides of its boundaries the wave of an edge is: a thousand instructions, as many as a ray takes, about.
    pub(crate) const SIDES: usize = 1;
    /// The same of an extrapolated path around edges, with its points.
    pub(crate) const EXTRAPOLATED: usize = 2;
    /// A source's direct path, without rays and waves.
    pub(crate) const DIRECT: usize = 20;
    /// A held or extrapolated path.
    pub(crate) const CONTINUED: usize = 1;
    /// Emission of one audible candidate.
    pub(crate) const EMITTED: usize = 1;
    /// The mean level of a path over the points of a wide source.
    pub(crate) const WIDENED: usize = 1;
    /// The time of emission of a path whose source moves.
    pub(crate) const EMISSION: usize = 1;
    /// Paths of an update merged per unit.
    pub(crate) const MERGED: usize = 2;
    /// Paths sorted per unit.
    pub(crate) const SORTED: usize = 4;
    /// Candidates queued for a test per unit.
    pub(crate) const QUEUED: usize = 16;
    /// The late energy of a source, and its part of the reverb's filters.
    pub(crate) const LATE: usize = 40;
    /// Preparation of a path by generation.
    pub(crate) const PREPARED: usize = 2;
    /// Application of a prepared path by generation.
    pub(crate) const TAKEN: usize = 1;
    /// Start of a voice.
    pub(crate) const STARTED: usize = 3;
}
