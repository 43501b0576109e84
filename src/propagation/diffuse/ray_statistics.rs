//! Legs and specular prefixes of one rotation. Rays are traced in packets; lists that depend on an order are made
//! afterwards, ray by ray.

use crate::geometry::Ray;
use crate::propagation::diffuse::bounce_buffer::BouncePacket;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::MAX_ORDER;
use crate::propagation::rays::packet::PACKET_SIZE;
use crate::propagation::rays::prefix_set::{EMPTY_PREFIX, PrefixSet};
use crate::scene::Scene;

/// Statistics of one rotation's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct RayStatistics {
    /// Prefixes so far.
    prefixes: PrefixSet,
    /// Recorded legs, and how many of them end at an instance.
    pub(crate) legs: Vec<Ray>,
    pub(crate) legs_to_instances: usize,
}

impl RayStatistics {
    /// Clears the statistics, for `count` rays of `depth` bounces.
    pub(crate) fn renew(&mut self, count: usize, depth: usize) {
        self.prefixes.reset(count * depth);
        self.legs.clear();
        self.legs_to_instances = 0;
    }

    /// Records a leg.
    pub(crate) fn record_leg(&mut self, leg: Ray, ends_at_instance: bool) {
        self.legs.push(leg);
        self.legs_to_instances += usize::from(ends_at_instance);
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
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::propagation::rays::directions::mix;
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    const DEPTH: usize = 3;

    fn room() -> Scene {
        let mesh = procedural::shoebox(Vec3::new(4.0, 2.5, 3.0), "concrete");
        Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
            .expect("commits")
    }

    #[test]
    fn sequences_come_in_the_order_of_the_rays() {
        let scene = room();
        let mut statistics = RayStatistics::default();
        statistics.renew(2 * PACKET_SIZE, DEPTH);
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
