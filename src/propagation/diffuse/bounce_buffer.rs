//! Bounces of a rotation's rays, and what they weigh.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::ray_statistics::RayLog;
use crate::propagation::diffuse::static_hit_cache::FixedWay;
use crate::propagation::rays::packet::{HitPacket, PACKET_SIZE, PerRay, Vectors, vector};

/// Metres from the source within which bounces are chosen by their energy alone: a listener is taken to be thereabouts.
const CHOICE_SPREAD_M: f32 = 20.0;

/// Energy that a bounce has for the tail.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bounce {
    pub(crate) point: Vec3,
    /// Unit normal on the side that sound leaves to.
    pub(crate) normal: Vec3,
    pub(crate) surface: u32,
    /// Way from the source.
    pub(crate) length_m: f32,
    /// Energy leaving, without air.
    pub(crate) energy: BandArray,
}

/// The bounces of one step of rays that are followed side by side.
#[derive(Debug, Clone, Default)]
pub(crate) struct Block {
    pub(crate) met: HitPacket,
    /// The rays whose bounces so far were mirror reflections by panels, up to this one's, one a bit.
    pub(crate) mirrored: u32,
    pub(crate) point: Vectors,
    /// Unit normals on the side that sound leaves to.
    pub(crate) normal: Vectors,
    /// Ways from the source.
    pub(crate) length_m: PerRay<f32>,
    /// Energy leaving, without air.
    pub(crate) energy: PerRay<BandArray>,
}

impl Block {
    /// By what bounces weigh less the farther they are from the source.
    #[inline(always)]
    pub(crate) fn spreads(&self, source: Vec3) -> PerRay<f32> {
        let mut spreads = [0.0; PACKET_SIZE];
        let [x, y, z] = &self.point;
        for l in 0..PACKET_SIZE {
            let (x, y, z) = (x[l] - source.x, y[l] - source.y, z[l] - source.z);
            spreads[l] = ((x * x) + (y * y) + (z * z)) + CHOICE_SPREAD_M * CHOICE_SPREAD_M;
        }
        spreads
    }
}

/// What a bounce may send to a listener, over all bands.
#[inline(always)]
pub(crate) fn weight(e: &BandArray, spread: f32) -> f32 {
    let sum = ((e[0] + e[4]) + (e[2] + e[6])) + ((e[1] + e[5]) + (e[3] + e[7]));
    sum / spread
}

/// Bounces and their weights: a place for each that there may be.
#[derive(Debug, Clone, Default)]
pub(crate) struct Weighed {
    /// Bounces of a ray.
    steps: usize,
    /// In blocks of [`PACKET_SIZE`] rays, `steps` of each one after the other. Bounces of no weight are anything.
    blocks: Vec<Block>,
    /// In the order of the rays, `steps` a ray.
    pub(crate) weights: Vec<f32>,
}

impl Weighed {
    /// Places without a bounce, which weigh nothing.
    pub(crate) fn renew(&mut self, rays: usize, steps: usize) {
        self.steps = steps;
        self.blocks
            .resize_with(rays.div_ceil(PACKET_SIZE) * steps, Block::default);
        self.weights.clear();
        self.weights.resize(rays * steps, 0.0);
    }

    /// The blocks of the rays from `first` on, by steps, and the weights of these.
    #[inline(always)]
    pub(crate) fn together_from(&mut self, first: usize) -> (&mut [Block], &mut [f32]) {
        let block = first / PACKET_SIZE * self.steps;
        (
            &mut self.blocks[block..][..self.steps],
            &mut self.weights[first * self.steps..],
        )
    }

    /// The bounces of a ray, one a block in the lane that is given too.
    #[inline(always)]
    pub(crate) fn of_ray(&self, ray: usize) -> (&[Block], usize) {
        let block = ray / PACKET_SIZE * self.steps;
        (&self.blocks[block..][..self.steps], ray % PACKET_SIZE)
    }

    /// The bounce at a place of the list of weights.
    pub(crate) fn bounce(&self, place: usize) -> Bounce {
        let (blocks, lane) = self.of_ray(place / self.steps);
        let block = &blocks[place % self.steps];
        Bounce {
            point: vector(&block.point, lane),
            normal: vector(&block.normal, lane),
            surface: block.met.surface[lane],
            length_m: block.length_m[lane],
            energy: block.energy[lane],
        }
    }
}

/// All bounces of one rotation's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bounces {
    /// Within the depth of discrete paths.
    pub(crate) near: Weighed,
    /// Beyond, of far rays.
    pub(crate) far: Weighed,
    /// Sums of weights up to each bounce, while some are chosen.
    pub(crate) sums: Vec<f64>,
    /// What else the rays met.
    pub(crate) log: RayLog,
    /// The ways of the rays at hand through the fixed scene, while they are followed among instances.
    pub(crate) way: FixedWay,
}

/// A gain on all bands.
#[inline(always)]
pub(crate) fn amplify(energy: &mut BandArray, gain: f32) {
    for b in 0..BANDS {
        energy[b] *= gain;
    }
}
