//! What a graphics frame leaves out where the sound thread has little time for it.
//!
//! Audio side; constants. Own, measured in the concert hall with 16 sources and a walking listener: three quarters of the rays, or half
//! as many evaluations of amplitudes, cost 0.1 dB against the synchronous schedule; half of the rays 0.6 dB; extrapolation over twice
//! the distance 1.5 dB.

/// Share of visibility rays, and how seldom waves at edges and amplitudes are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameEffort {
    /// Eighths of [`crate::extrapolation::GeometricSettings::rays_per_source`].
    rays_eighths: u32,
    /// Factor on [`crate::extrapolation::GeometricSettings::exact_every`].
    pub(crate) every: u32,
    /// Factor on the distance over which paths are extrapolated.
    pub(crate) reach: u32,
}

/// Efforts, the whole one first. What costs least fidelity is left out first.
const EFFORTS: [FrameEffort; 7] = [
    FrameEffort::new(8, 1, 1),
    FrameEffort::new(6, 2, 1),
    FrameEffort::new(4, 2, 1),
    FrameEffort::new(4, 2, 2),
    FrameEffort::new(3, 2, 3),
    FrameEffort::new(2, 2, 4),
    FrameEffort::new(1, 2, 8),
];

impl FrameEffort {
    /// Nothing is left out.
    pub const WHOLE: Self = EFFORTS[0];

    /// Steps from the whole effort to the least.
    pub const MOST_STEPS: u32 = EFFORTS.len() as u32 - 1;

    const fn new(rays_eighths: u32, every: u32, reach: u32) -> Self {
        Self {
            rays_eighths,
            every,
            reach,
        }
    }

    /// The effort so many steps below the whole one; the least one after [`Self::MOST_STEPS`].
    pub fn reduced(steps: u32) -> Self {
        EFFORTS[steps.min(Self::MOST_STEPS) as usize]
    }

    /// The part of a number of rays that is cast.
    pub(crate) fn rays(self, whole: u64) -> u64 {
        whole * u64::from(self.rays_eighths) / 8
    }
}
