//! How much of a graphics frame is worked out at a time.
//!
//! Audio side; a number. A graphics frame's work may be done in portions, so that the sound thread's blocks take alike
//! time: what a portion may take is counted, never timed, so that the same portions come of the same numbers.
//! How a frame is cut changes nothing of what it says.

/// Work in units of about a hundred nanoseconds of a desktop's core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkBudget {
    most: u32,
    spent: u32,
}

impl WorkBudget {
    /// Until this much is spent.
    pub const fn of(most: u32) -> Self {
        Self { most, spent: 0 }
    }

    /// Until the frame is done.
    pub const fn boundless() -> Self {
        Self::of(u32::MAX)
    }

    /// Counts work done.
    pub(crate) fn spend(&mut self, work: usize) {
        let work = u32::try_from(work).unwrap_or(u32::MAX);
        self.spent = self.spent.saturating_add(work);
    }

    /// What has been spent; the last piece of work may have gone beyond the bound.
    pub fn spent(&self) -> u32 {
        self.spent
    }

    /// What is left.
    pub fn left(&self) -> u32 {
        self.most.saturating_sub(self.spent)
    }

    /// Whether to stop here.
    pub fn is_spent(&self) -> bool {
        self.spent >= self.most
    }
}

/// What pieces of work cost, as measured with sixteen sources in the concert hall.
pub(crate) mod cost {
    /// A ray.
    pub(crate) const RAY: usize = 2;
    /// Where the points of a reflected path lie.
    pub(crate) const UNFOLDED: usize = 2;
    /// How such a path is heard.
    pub(crate) const REFLECTED: usize = 4;
    /// The way of a bent path.
    pub(crate) const BENT_WAY: usize = 15;
    /// The wave around one edge.
    pub(crate) const WAVE: usize = 22;
    /// A source's direct path, without rays and waves.
    pub(crate) const DIRECT: usize = 20;
    /// A path that is continued as it is, or taken over from an update.
    pub(crate) const CONTINUED: usize = 1;
    /// A candidate of which it is told what is heard.
    pub(crate) const HEARD: usize = 2;
    /// Paths put in order for one unit.
    pub(crate) const SORTED: usize = 4;
    /// The late field of a source.
    pub(crate) const LATE: usize = 10;
    /// A path of which generation works out what it asks of a voice.
    pub(crate) const PREPARED: usize = 2;
    /// A path that generation takes over.
    pub(crate) const TAKEN: usize = 2;
    /// A path that gets a voice.
    pub(crate) const STARTED: usize = 3;
}
