//! What a graphics frame leaves out where the sound thread has little time for it.
//!
//! Audio side; constants. Own, measured with 16 sources and a walking listener against the synchronous schedule: in the concert hall
//! three quarters of the rays cost nothing, half of them 0.1 dB, half as many evaluations 0.5 dB; in bootcamp rays cost nothing and
//! half as many evaluations 4 dB.

/// Share of visibility rays, and how seldom and how far apart paths are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameEffort {
    /// Eighths of [`crate::extrapolation::GeometricSettings::rays_per_source`].
    rays_eighths: u32,
    /// Quarters of [`crate::extrapolation::GeometricSettings::exact_every`] in graphics frames, at least four.
    every_quarters: u32,
    /// Factor on the distance over which paths are extrapolated.
    pub(crate) reach: u32,
}

/// Efforts, the whole one first. What costs least fidelity is left out first.
const EFFORTS: [FrameEffort; 10] = [
    FrameEffort::new(8, 4, 1),
    FrameEffort::new(6, 4, 1),
    FrameEffort::new(4, 4, 1),
    FrameEffort::new(4, 5, 1),
    FrameEffort::new(4, 6, 1),
    FrameEffort::new(4, 8, 1),
    FrameEffort::new(4, 8, 2),
    FrameEffort::new(3, 8, 3),
    FrameEffort::new(2, 8, 4),
    FrameEffort::new(1, 8, 8),
];

impl FrameEffort {
    /// Nothing is left out.
    pub const WHOLE: Self = EFFORTS[0];

    /// Steps from the whole effort to the least.
    pub const MOST_STEPS: u32 = EFFORTS.len() as u32 - 1;

    const fn new(rays_eighths: u32, every_quarters: u32, reach: u32) -> Self {
        Self {
            rays_eighths,
            every_quarters,
            reach,
        }
    }

    /// The effort so many steps below the whole one; the least one after [`Self::MOST_STEPS`].
    pub fn reduced(steps: u32) -> Self {
        EFFORTS[steps.min(Self::MOST_STEPS) as usize]
    }

    /// Whether paths are extrapolated farther than with the whole effort. Of a reflection this is its amplitude only: the line
    /// is then no measure of its length.
    pub(crate) fn is_far(self) -> bool {
        self.reach > 1
    }

    /// Graphics frames between two evaluations of a path, of so many with the whole effort.
    pub(crate) fn every(self, whole: u32) -> u32 {
        whole.saturating_mul(self.every_quarters) / 4
    }

    /// The part of a number of rays that is cast.
    pub(crate) fn rays(self, whole: u64) -> u64 {
        whole * u64::from(self.rays_eighths) / 8
    }
}
