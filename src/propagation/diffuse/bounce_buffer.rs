//! Bounces of a rotation's rays and their selection weights.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::rays::packet::{HitPacket, PACKET_SIZE, PerRay, Vectors, vector};

/// Distance from the source in metres within which bounces are selected by energy alone: the listener's assumed distance.
const SELECTION_SPREAD_M: f32 = 20.0;

/// Late energy of a bounce.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bounce {
    pub(crate) point: Vec3,
    /// Unit normal on the side of the outgoing sound.
    pub(crate) normal: Vec3,
    pub(crate) surface: u32,
    /// Path length from the source.
    pub(crate) length_m: f32,
    /// Length of the next leg, if it is known.
    pub(crate) next_m: Option<f32>,
    pub(crate) energy: BounceEnergy,
}

/// Energies of a bounce, without air absorption.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BounceEnergy {
    /// Incident.
    pub(crate) incident: BandArray,
    /// Leaving, without what discrete paths carry.
    pub(crate) leaving: BandArray,
    /// The scattered part of it.
    pub(crate) scattered: BandArray,
}

/// One bounce of each ray of a packet.
#[derive(Debug, Clone, Default)]
pub(crate) struct BouncePacket {
    pub(crate) met: HitPacket,
    /// Bit mask of the rays with only specular reflections in panels up to this bounce.
    pub(crate) mirrored: u32,
    pub(crate) point: Vectors,
    /// Unit normals on the side of the outgoing sound.
    pub(crate) normal: Vectors,
    /// Path lengths from the source.
    pub(crate) length_m: PerRay<f32>,
    pub(crate) energy: PerRay<BounceEnergy>,
}

impl BouncePacket {
    /// Divisors of the selection weights, by the distance from the source.
    #[inline(always)]
    pub(crate) fn spread_factors(&self, source: Vec3) -> PerRay<f32> {
        let mut spread_factors = [0.0; PACKET_SIZE];
        let [x, y, z] = &self.point;
        for l in 0..PACKET_SIZE {
            let (x, y, z) = (x[l] - source.x, y[l] - source.y, z[l] - source.z);
            spread_factors[l] =
                ((x * x) + (y * y) + (z * z)) + SELECTION_SPREAD_M * SELECTION_SPREAD_M;
        }
        spread_factors
    }
}

/// Selection weight: the energy in all bands over the divisor of the distance.
#[inline(always)]
pub(crate) fn weight(e: &BandArray, spread: f32) -> f32 {
    let sum = ((e[0] + e[4]) + (e[2] + e[6])) + ((e[1] + e[5]) + (e[3] + e[7]));
    sum / spread
}

/// Bounces and their weights, with an entry for every ray and step.
#[derive(Debug, Clone, Default)]
pub(crate) struct BounceBuffer {
    /// Bounces per ray.
    steps: usize,
    /// Packets of [`PACKET_SIZE`] rays, `steps` of each in turn. Bounces of weight 0 are unspecified.
    packets: Vec<BouncePacket>,
    /// In the order of the rays, `steps` per ray.
    pub(crate) weights: Vec<f32>,
}

impl BounceBuffer {
    /// Clears all weights.
    pub(crate) fn renew(&mut self, rays: usize, steps: usize) {
        self.steps = steps;
        self.packets
            .resize_with(rays.div_ceil(PACKET_SIZE) * steps, BouncePacket::default);
        self.weights.clear();
        self.weights.resize(rays * steps, 0.0);
    }

    /// The blocks of the rays from `first` on, by steps, and the weights of these.
    #[inline(always)]
    pub(crate) fn packets_from(&mut self, first: usize) -> (&mut [BouncePacket], &mut [f32]) {
        let packet = first / PACKET_SIZE * self.steps;
        (
            &mut self.packets[packet..][..self.steps],
            &mut self.weights[first * self.steps..],
        )
    }

    /// The packets of a ray, by steps, and its lane in them.
    #[inline(always)]
    pub(crate) fn packets_of_ray(&self, ray: usize) -> (&[BouncePacket], usize) {
        let packet = ray / PACKET_SIZE * self.steps;
        (&self.packets[packet..][..self.steps], ray % PACKET_SIZE)
    }

    /// The bounce at an index of `weights`.
    pub(crate) fn bounce(&self, index: usize) -> Bounce {
        let (packets, lane) = self.packets_of_ray(index / self.steps);
        let step = index % self.steps;
        let packet = &packets[step];
        let next = packets
            .get(step + 1)
            .filter(|next| next.met.rays >> lane & 1 == 1);
        Bounce {
            point: vector(&packet.point, lane),
            normal: vector(&packet.normal, lane),
            surface: packet.met.surface[lane],
            length_m: packet.length_m[lane],
            next_m: next.map(|next| next.met.leg_m[lane]),
            energy: packet.energy[lane],
        }
    }
}

/// Scales all energies of a bounce, band by band.
#[inline(always)]
pub(crate) fn amplify_by(energy: &mut BounceEnergy, gain: &BandArray) {
    for part in [
        &mut energy.incident,
        &mut energy.leaving,
        &mut energy.scattered,
    ] {
        for b in 0..BANDS {
            part[b] *= gain[b];
        }
    }
}
