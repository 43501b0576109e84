//! What the far rays of one rotation carried, and sums over all rays. Rays are followed side by side; sums and lists that depend
//! on an order are made afterwards, ray after ray.

use crate::acoustics::BandArray;
use crate::geometry::Ray;
use crate::propagation::diffuse::bounce_buffer::{Block, Weighed};
use crate::propagation::diffuse::decay_fit::DecayCurve;
use crate::propagation::diffuse::source_rays::FAR_BOUNCES;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::MAX_ORDER;
use crate::propagation::rays::packet::PACKET_SIZE;
use crate::propagation::rays::prefix_set::{EMPTY_PREFIX, PrefixSet};
use crate::scene::Scene;

/// What a far ray brought to a bounce, and when it was there.
#[derive(Debug, Clone, Copy, Default)]
struct Carried {
    share: BandArray,
    at_s: f64,
}

/// See the module.
#[derive(Debug, Clone, Default)]
pub(crate) struct RayLog {
    /// The far rays' numbers among all.
    far: Vec<usize>,
    /// [`FAR_BOUNCES`] a far ray.
    carried: Vec<Carried>,
    /// What each far ray still had at its end; nothing if it escaped.
    left: Vec<Option<Carried>>,
    /// What rays at hand began with.
    beginnings: PrefixSet,
    /// Legs that were to be kept, and how many of them ended at an instance.
    kept: Vec<Ray>,
    kept_to_instances: usize,
}

impl RayLog {
    /// Makes room for `count` rays of `depth` bounces, `far` of them far ones, of which nothing is known.
    pub(crate) fn renew(&mut self, count: usize, depth: usize, far: usize) {
        self.far.clear();
        self.far.reserve(far);
        self.carried.resize(far * FAR_BOUNCES, Carried::default());
        self.left.clear();
        self.left.resize(far, None);
        self.beginnings.reset(count * depth);
        self.kept.clear();
        self.kept_to_instances = 0;
    }

    /// Room for legs to keep.
    pub(crate) fn reserve_legs(&mut self, most: usize) {
        self.kept.reserve(most);
    }

    /// Keeps a leg as it is.
    pub(crate) fn keep(&mut self, leg: Ray, ends_at_instance: bool) {
        self.kept.push(leg);
        self.kept_to_instances += usize::from(ends_at_instance);
    }

    /// Legs that were kept.
    pub(crate) fn legs(&self) -> &[Ray] {
        &self.kept
    }

    /// How many of those ended at an instance.
    pub(crate) fn legs_to_instances(&self) -> usize {
        self.kept_to_instances
    }

    /// Ray `index` is the next far ray; gives its number among these. Rays come in their order.
    #[inline(always)]
    pub(crate) fn begin_far(&mut self, index: usize) -> usize {
        self.far.push(index);
        self.far.len() - 1
    }

    /// How many far rays there are so far.
    #[inline(always)]
    pub(crate) fn far_count(&self) -> usize {
        self.far.len()
    }

    /// A far ray carried `share` to bounce number `step`.
    #[inline(always)]
    pub(crate) fn carry(&mut self, far: usize, step: usize, share: &BandArray, at_s: f64) {
        self.carried[far * FAR_BOUNCES + step] = Carried {
            share: *share,
            at_s,
        };
    }

    /// A far ray is followed no further.
    #[inline(always)]
    pub(crate) fn leave(&mut self, far: usize, share: &BandArray, at_s: f64) {
        self.left[far] = Some(Carried {
            share: *share,
            at_s,
        });
    }

    /// Gives the specular beginnings of rays that were followed side by side, in the order of the rays.
    #[inline(always)]
    pub(crate) fn give_sequences(
        &mut self,
        scene: &Scene,
        blocks: &[Block],
        found: &mut SequenceSet,
    ) {
        let depth = blocks.len().min(MAX_ORDER);
        let blocks = &blocks[..depth];
        for lane in 0..PACKET_SIZE {
            let mut list = EMPTY_PREFIX;
            let mut sequence = Sequence::EMPTY;
            for (step, block) in blocks.iter().enumerate() {
                if block.mirrored >> lane & 1 == 0 {
                    break;
                }
                let is_new;
                (list, is_new) = self.beginnings.extend(list, block.met.surface[lane]);
                if is_new {
                    for block in &blocks[sequence.len()..=step] {
                        sequence.push_canonical(scene, block.met.surface[lane]);
                    }
                    found.insert(sequence);
                }
            }
        }
    }

    /// Sums up `count` rays in their order.
    pub(crate) fn tell(&self, count: usize, near: &Weighed, far: &Weighed, curve: &mut DecayCurve) {
        let mut next_far = 0;
        let mut legs = curve.legs();
        for index in 0..count {
            let (blocks, lane) = near.of_ray(index);
            let mut met = 0;
            for block in blocks {
                if block.met.rays >> lane & 1 == 0 {
                    break;
                }
                legs.add(met == 0, block.met.leg_m[lane]);
                met += 1;
            }
            if self.far.get(next_far) != Some(&index) {
                continue;
            }
            let number = next_far;
            next_far += 1;
            curve.begin();
            if met == blocks.len() {
                let (blocks, lane) = far.of_ray(number);
                for block in blocks {
                    if block.met.rays >> lane & 1 == 0 {
                        break;
                    }
                    legs.add(false, block.met.leg_m[lane]);
                    met += 1;
                }
            }
            let mut moment = 0;
            for carried in &self.carried[number * FAR_BOUNCES..][..met] {
                moment = curve.carry(&carried.share, moment, carried.at_s);
            }
            if let Some(left) = &self.left[number] {
                curve.leave(&left.share, left.at_s);
            }
        }
        curve.set_legs(legs);
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

    /// Rays that end at some bounce, the far ones beyond the first ones, too. Gives their legs.
    fn courses(near: &mut Weighed, far: &mut Weighed, far_rays: &[usize]) -> Vec<Vec<f32>> {
        let mut all = Vec::new();
        for ray in 0..RAYS {
            let far_number = far_rays.iter().position(|far| *far == ray);
            let most = if far_number.is_some() { 9 } else { DEPTH };
            let count = mix(ray as u64) as usize % (most + 1);
            let legs: Vec<f32> = (0..count).map(|step| (1 + ray + step) as f32).collect();
            for (step, leg_m) in legs.iter().enumerate() {
                let (blocks, lane) = match step < DEPTH {
                    true => (
                        near.together_from(ray / PACKET_SIZE * PACKET_SIZE).0,
                        ray % PACKET_SIZE,
                    ),
                    false => (far.together_from(0).0, far_number.unwrap_or_default()),
                };
                let block = &mut blocks[if step < DEPTH { step } else { step - DEPTH }];
                block.met.rays |= 1 << lane;
                block.met.leg_m[lane] = *leg_m;
            }
            all.push(legs);
        }
        all
    }

    #[test]
    fn legs_are_those_that_met_something() {
        let scene = room();
        let far_rays = [0, 5, 20, 36];
        let (mut near, mut far) = (Weighed::default(), Weighed::default());
        near.renew(RAYS, DEPTH);
        far.renew(far_rays.len(), FAR_BOUNCES - DEPTH);
        let legs = courses(&mut near, &mut far, &far_rays);
        let mut log = RayLog::default();
        log.renew(RAYS, DEPTH, far_rays.len());
        for (number, ray) in far_rays.into_iter().enumerate() {
            assert_eq!(log.begin_far(ray), number);
        }
        let mut curve = DecayCurve::default();
        log.tell(RAYS, &near, &far, &mut curve);
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
        let mut log = RayLog::default();
        log.renew(2 * PACKET_SIZE, DEPTH, 0);
        let mut found = SequenceSet::with_capacity(2 * PACKET_SIZE * DEPTH);
        let mut expected = SequenceSet::with_capacity(2 * PACKET_SIZE * DEPTH);
        for round in 0..2 {
            let mut blocks = std::array::from_fn::<_, DEPTH, _>(|_| Block::default());
            for lane in 0..PACKET_SIZE {
                let bits = mix((round * PACKET_SIZE + lane) as u64);
                let surfaces = [0, 1, 2].map(|step| (bits >> (8 * step)) as u32 % 6);
                for step in 0..bits as usize % (DEPTH + 1) {
                    blocks[step].mirrored |= 1 << lane;
                    blocks[step].met.surface[lane] = surfaces[step];
                    expected.insert(Sequence::canonical(&scene, &surfaces[..=step]));
                }
            }
            log.give_sequences(&scene, &blocks, &mut found);
        }
        assert!(found.entries().len() > PACKET_SIZE);
        assert!(found.entries() == expected.entries());
    }
}
