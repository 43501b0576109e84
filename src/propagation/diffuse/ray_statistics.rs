//! Energies of one rotation's far rays, and legs and specular prefixes of all rays. Rays are traced in packets; sums and
//! lists that depend on an order are made afterwards, ray by ray.

use crate::acoustics::BandArray;
use crate::geometry::Ray;
use crate::propagation::diffuse::bounce_buffer::{BounceBuffer, BouncePacket};
use crate::propagation::diffuse::decay_fit::DecayCurve;
use crate::propagation::diffuse::source_rays::FAR_BOUNCES;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::MAX_ORDER;
use crate::propagation::rays::packet::PACKET_SIZE;
use crate::propagation::rays::prefix_set::{EMPTY_PREFIX, PrefixSet};
use crate::scene::Scene;

/// Energy and time of a far ray at a bounce.
#[derive(Debug, Clone, Copy, Default)]
struct FarRayEnergy {
    share: BandArray,
    at_s: f64,
}

/// Statistics of one rotation's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct RayStatistics {
    /// Indices of the far rays among all.
    far: Vec<usize>,
    /// [`FAR_BOUNCES`] per far ray.
    at_bounces: Vec<FarRayEnergy>,
    /// At the last bounce of each far ray; `None` if it escaped.
    at_end: Vec<Option<FarRayEnergy>>,
    /// Prefixes so far.
    prefixes: PrefixSet,
    /// Recorded legs, and how many of them end at an instance.
    pub(crate) legs: Vec<Ray>,
    pub(crate) legs_to_instances: usize,
}

impl RayStatistics {
    /// Clears the statistics, for `count` rays of `depth` bounces, `far` of them far ones.
    pub(crate) fn renew(&mut self, count: usize, depth: usize, far: usize) {
        self.far.clear();
        self.far.reserve(far);
        self.at_bounces
            .resize(far * FAR_BOUNCES, FarRayEnergy::default());
        self.at_end.clear();
        self.at_end.resize(far, None);
        self.prefixes.reset(count * depth);
        self.legs.clear();
        self.legs_to_instances = 0;
    }

    /// Records a leg.
    pub(crate) fn record_leg(&mut self, leg: Ray, ends_at_instance: bool) {
        self.legs.push(leg);
        self.legs_to_instances += usize::from(ends_at_instance);
    }

    /// Adds ray `index` as a far ray and returns its index among these. Rays are added in order.
    #[inline(always)]
    pub(crate) fn begin_far_ray(&mut self, index: usize) -> usize {
        self.far.push(index);
        self.far.len() - 1
    }

    /// Number of far rays.
    #[inline(always)]
    pub(crate) fn far_count(&self) -> usize {
        self.far.len()
    }

    /// Records a far ray's share of energy and time in seconds at bounce `step`.
    #[inline(always)]
    pub(crate) fn record_bounce(&mut self, far: usize, step: usize, share: &BandArray, at_s: f64) {
        self.at_bounces[far * FAR_BOUNCES + step] = FarRayEnergy {
            share: *share,
            at_s,
        };
    }

    /// Records a far ray's share and time at its last bounce.
    #[inline(always)]
    pub(crate) fn record_end(&mut self, far: usize, share: &BandArray, at_s: f64) {
        self.at_end[far] = Some(FarRayEnergy {
            share: *share,
            at_s,
        });
    }

    /// Inserts the specular prefixes of a packet's rays, in the order of the rays.
    #[inline(always)]
    pub(crate) fn emit_sequences(
        &mut self,
        scene: &Scene,
        packets: &[BouncePacket],
        found: &mut SequenceSet,
    ) {
        let depth = packets.len().min(MAX_ORDER);
        let packets = &packets[..depth];
        for lane in 0..PACKET_SIZE {
            let mut list = EMPTY_PREFIX;
            let mut sequence = Sequence::EMPTY;
            for (step, packet) in packets.iter().enumerate() {
                if packet.mirrored >> lane & 1 == 0 {
                    break;
                }
                let is_new;
                (list, is_new) = self.prefixes.extend(list, packet.met.surface[lane]);
                if is_new {
                    for packet in &packets[sequence.len()..=step] {
                        sequence.push_canonical(scene, packet.met.surface[lane]);
                    }
                    found.insert(sequence);
                }
            }
        }
    }

    /// Accumulates `count` rays in their order into a decay curve.
    pub(crate) fn accumulate(
        &self,
        count: usize,
        near: &BounceBuffer,
        far: &BounceBuffer,
        curve: &mut DecayCurve,
    ) {
        let mut next_far = 0;
        let mut sums = curve.legs;
        for index in 0..count {
            let (packets, lane) = near.packets_of_ray(index);
            let mut bounces = 0;
            for packet in packets {
                if packet.met.rays >> lane & 1 == 0 {
                    break;
                }
                sums.add(bounces == 0, packet.met.leg_m[lane]);
                bounces += 1;
            }
            if self.far.get(next_far) != Some(&index) {
                continue;
            }
            let far_index = next_far;
            next_far += 1;
            curve.begin();
            if bounces == packets.len() {
                let (packets, lane) = far.packets_of_ray(far_index);
                for packet in packets {
                    if packet.met.rays >> lane & 1 == 0 {
                        break;
                    }
                    sums.add(false, packet.met.leg_m[lane]);
                    bounces += 1;
                }
            }
            let mut time_step = 0;
            for at_bounce in &self.at_bounces[far_index * FAR_BOUNCES..][..bounces] {
                time_step = curve.accumulate(&at_bounce.share, time_step, at_bounce.at_s);
            }
            if let Some(at_end) = &self.at_end[far_index] {
                curve.extrapolate(&at_end.share, at_end.at_s);
            }
        }
        curve.legs = sums;
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::propagation::rays::directions::mix;
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    const RAYS: usize = 37;
    const DEPTH: usize = 3;

    fn room() -> Scene {
        let mesh = procedural::shoebox(Vec3::new(4.0, 2.5, 3.0), "concrete");
        Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
            .expect("commits")
    }

    /// Legs of rays that end at some bounce, of far ones also beyond the discrete depth.
    fn record_rays(
        near: &mut BounceBuffer,
        far: &mut BounceBuffer,
        far_rays: &[usize],
    ) -> Vec<Vec<f32>> {
        let mut all = Vec::new();
        for ray in 0..RAYS {
            let far_index = far_rays.iter().position(|far| *far == ray);
            let most = if far_index.is_some() { 9 } else { DEPTH };
            let count = mix(ray as u64) as usize % (most + 1);
            let legs: Vec<f32> = (0..count).map(|step| (1 + ray + step) as f32).collect();
            for (step, leg_m) in legs.iter().enumerate() {
                let (packets, lane) = match step < DEPTH {
                    true => (
                        near.packets_from(ray / PACKET_SIZE * PACKET_SIZE).0,
                        ray % PACKET_SIZE,
                    ),
                    false => (far.packets_from(0).0, far_index.unwrap_or_default()),
                };
                let packet = &mut packets[if step < DEPTH { step } else { step - DEPTH }];
                packet.met.rays |= 1 << lane;
                packet.met.leg_m[lane] = *leg_m;
            }
            all.push(legs);
        }
        all
    }

    #[test]
    fn legs_are_those_with_a_hit() {
        let scene = room();
        let far_rays = [0, 5, 20, 36];
        let (mut near, mut far) = (BounceBuffer::default(), BounceBuffer::default());
        near.renew(RAYS, DEPTH);
        far.renew(far_rays.len(), FAR_BOUNCES - DEPTH);
        let legs = record_rays(&mut near, &mut far, &far_rays);
        let mut statistics = RayStatistics::default();
        statistics.renew(RAYS, DEPTH, far_rays.len());
        for (number, ray) in far_rays.into_iter().enumerate() {
            assert_eq!(statistics.begin_far_ray(ray), number);
        }
        let mut curve = DecayCurve::default();
        statistics.accumulate(RAYS, &near, &far, &mut curve);
        let later: Vec<f64> = legs
            .iter()
            .flat_map(|legs| legs.iter().skip(1))
            .map(|leg| f64::from(*leg))
            .collect();
        assert!(legs.iter().any(|legs| legs.len() > DEPTH + 1));
        let expected_s =
            later.iter().sum::<f64>() / later.len() as f64 / scene.speed_of_sound_m_s();
        let decay = curve.decay(&scene).expect("rays met something");
        assert_eq!(decay.mean_free_time_s, expected_s);
    }

    #[test]
    fn sequences_come_in_the_order_of_the_rays() {
        let scene = room();
        let mut statistics = RayStatistics::default();
        statistics.renew(2 * PACKET_SIZE, DEPTH, 0);
        let mut found = SequenceSet::with_capacity(2 * PACKET_SIZE * DEPTH);
        let mut expected = SequenceSet::with_capacity(2 * PACKET_SIZE * DEPTH);
        for round in 0..2 {
            let mut packets = std::array::from_fn::<_, DEPTH, _>(|_| BouncePacket::default());
            for lane in 0..PACKET_SIZE {
                let bits = mix((round * PACKET_SIZE + lane) as u64);
                let surfaces = [0, 1, 2].map(|step| (bits >> (8 * step)) as u32 % 6);
                for step in 0..bits as usize % (DEPTH + 1) {
                    packets[step].mirrored |= 1 << lane;
                    packets[step].met.surface[lane] = surfaces[step];
                    expected.insert(Sequence::canonical(&scene, &surfaces[..=step]));
                }
            }
            statistics.emit_sequences(&scene, &packets, &mut found);
        }
        assert!(found.entries().len() > PACKET_SIZE);
        assert!(found.entries() == expected.entries());
    }
}
