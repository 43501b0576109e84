//! Source virtualisation on a virtual clock of sixty ticks a second.

use super::*;
use crate::propagation::rays::directions::{mix, unit};
use crate::runtime::engine::slot_release::MIN_RELEASE_S;

const TICK_S: f64 = 1.0 / 60.0;

struct Scenario {
    virtualizer: SourceVirtualizer,
    sources: Vec<VirtualSource>,
    time_s: f64,
    slot_poses: Vec<SourcePose>,
    routes: Vec<SourceRoute>,
    moves: usize,
}

impl Scenario {
    fn new(sources: Vec<VirtualSource>, slots: usize) -> Self {
        Self {
            virtualizer: SourceVirtualizer::new(sources.len(), slots, MIN_RELEASE_S),
            sources,
            time_s: 0.0,
            slot_poses: Vec::new(),
            routes: Vec::new(),
            moves: 0,
        }
    }

    fn tick(&mut self) {
        let before: Vec<(SourceId, u16)> = self.routes.iter().map(|f| (f.id, f.slot)).collect();
        let sources = self.sources.iter().copied();
        // The renderer is a frame behind.
        let tick = (self.time_s / TICK_S).round() as u64 + 1;
        let progress = PlaybackProgress {
            tick,
            applied_tick: tick - 1,
            time_s: self.time_s,
        };
        self.virtualizer.assign(
            sources,
            &[Vec3::ZERO],
            (self.time_s, progress),
            &mut self.slot_poses,
            &mut self.routes,
        );
        self.time_s += TICK_S;
        let kept = |id: SourceId, slot: u16| before.contains(&(id, slot));
        if !before.is_empty() {
            let moved = self.routes.iter().filter(|f| !kept(f.id, f.slot));
            self.moves += moved.count();
        }
        self.check();
    }

    /// Invariants: each slot once; every route in a used slot; one member per own slot.
    fn check(&self) {
        assert!(self.slot_poses.len() <= self.virtualizer.slots.len());
        let mut seen = vec![false; self.virtualizer.slots.len()];
        for source in &self.slot_poses {
            assert!(!std::mem::replace(&mut seen[source.id.slot()], true));
        }
        let mut members = vec![0; seen.len()];
        for feed in self.routes.iter().filter(|feed| feed.slot < BED) {
            assert!(seen[usize::from(feed.slot)], "{feed:?} has no slot");
            assert!(feed.gain.is_finite() && feed.gain >= 0.0);
            members[usize::from(feed.slot)] += 1;
        }
        let own = &members[..self.virtualizer.first_shared];
        assert!(own.iter().all(|&count| count <= 1), "{own:?}");
    }

    fn slot_of(&self, index: usize) -> u16 {
        self.routes[index].slot
    }
}

fn source(index: usize, position: Vec3) -> VirtualSource {
    VirtualSource {
        pose: SourcePose::at(SourceId::new(index as u16, 0), position),
        gain: 1.0,
        ramp_s: 0.0,
        plays: true,
        play: PlayState::default(),
    }
}

fn position_around(index: usize, distance_m: f32) -> Vec3 {
    let dice = |k: u64| unit(mix((index as u64) << 8 | k)) - 0.5;
    distance_m * Vec3::new(dice(0), 0.2 * dice(1), dice(2)).normalize_or(Vec3::X)
}

#[test]
fn the_loudest_have_own_slots_and_others_are_near_theirs() {
    let mut sources: Vec<VirtualSource> = (0..256)
        .map(|n| source(n, position_around(n, 20.0)))
        .collect();
    for (index, source) in sources.iter_mut().enumerate().take(12) {
        source.pose.position = position_around(index, 2.0);
    }
    let mut scenario = Scenario::new(sources, 16);
    for _ in 0..120 {
        scenario.tick();
    }
    assert_eq!(
        (scenario.slot_poses.len(), scenario.virtualizer.first_shared),
        (16, 12)
    );
    for index in 0..12 {
        assert!(scenario.slot_of(index) < 12, "{index} is loud");
    }
    for index in 12..256 {
        assert!((12..16).contains(&scenario.slot_of(index)));
        let slot = &scenario.virtualizer.slots[usize::from(scenario.slot_of(index))];
        let others = &scenario.virtualizer.slots[12..];
        let from = scenario.sources[index].pose.position;
        let distance = |slot: &RenderSlot| perceptual_distance(from, slot.position, &[Vec3::ZERO]);
        // Within the hysteresis of the nearest.
        let nearest = others.iter().map(distance).fold(f32::MAX, f32::min);
        assert!(CLEARLY_NEARER * distance(slot) <= nearest + 1e-6);
    }
    let moves = scenario.moves;
    for _ in 0..600 {
        scenario.tick();
    }
    assert_eq!(scenario.moves, moves, "moves without a change");
}

#[test]
fn priority_counts_before_loudness_and_2d_needs_no_slot() {
    let mut sources: Vec<VirtualSource> = (0..40)
        .map(|n| source(n, position_around(n, 3.0)))
        .collect();
    // Faint, but audible.
    sources[30].gain = 0.05;
    sources[31].pose.settings.is_2d = true;
    let mut scenario = Scenario::new(sources, 16);
    for _ in 0..60 {
        scenario.tick();
    }
    assert!(scenario.slot_of(30) >= 12);
    assert_eq!(scenario.slot_of(31), BED);
    assert_eq!(scenario.virtualizer.masked, 0);
    scenario.sources[30].pose.settings.priority = 129;
    for _ in 0..60 {
        scenario.tick();
    }
    assert!(scenario.slot_of(30) < 12, "displaces a louder source");
    for source in &mut scenario.sources[..20] {
        source.gain = 4.0;
    }
    for _ in 0..60 {
        scenario.tick();
    }
    assert!(scenario.slot_of(30) < 12, "stays");
}

#[test]
fn few_sources_all_have_own_slots() {
    let sources = (0..40)
        .map(|n| source(n, position_around(n, 5.0)))
        .collect();
    let mut scenario = Scenario::new(sources, 16);
    for source in &mut scenario.sources[10..] {
        source.plays = false;
    }
    for _ in 0..10 {
        scenario.tick();
    }
    let slots: Vec<u16> = (0..10).map(|n| scenario.slot_of(n)).collect();
    assert!(slots.iter().all(|&slot| slot < 12), "{slots:?}");
    assert_eq!(scenario.slot_poses.len(), 10);
    assert_eq!(scenario.virtualizer.masked, 30);
}

#[test]
fn masked_sources_have_no_slot_until_audible() {
    let mut sources: Vec<VirtualSource> = (0..20)
        .map(|n| source(n, position_around(n, 3.0)))
        .collect();
    sources[7].gain = 1e-4;
    let mut scenario = Scenario::new(sources, 16);
    scenario.tick();
    assert_eq!(scenario.slot_of(7), NO_SLOT);
    scenario.sources[7].gain = 0.1;
    scenario.tick();
    assert_ne!(scenario.slot_of(7), NO_SLOT);
}

#[test]
fn a_louder_source_gets_an_own_slot_after_a_release() {
    let sources = (0..32)
        .map(|n| source(n, position_around(n, 10.0)))
        .collect();
    let mut scenario = Scenario::new(sources, 16);
    for _ in 0..60 {
        scenario.tick();
    }
    let quiet = (0..32)
        .find(|&n| scenario.slot_of(n) >= 12)
        .expect("a shared slot");
    scenario.sources[quiet].pose.position = position_around(quiet, 2.0);
    let mut waited = 0;
    let generations: Vec<u32> = scenario
        .virtualizer
        .slots
        .iter()
        .map(|s| s.generation)
        .collect();
    while scenario.slot_of(quiet) >= 12 {
        scenario.tick();
        waited += 1;
        assert!(waited < 60, "within a second");
    }
    // An owner is displaced, and its slot is released and reused under a new generation.
    assert!(f64::from(waited) * TICK_S >= MIN_RELEASE_S);
    let slot = usize::from(scenario.slot_of(quiet));
    assert_ne!(
        scenario.virtualizer.slots[slot].generation,
        generations[slot]
    );
}

#[test]
fn a_shared_slot_jumps_when_all_its_members_jump() {
    let sources = (0..64)
        .map(|n| source(n, position_around(n, 10.0)))
        .collect();
    let mut scenario = Scenario::new(sources, 16);
    (0..60).for_each(|_| scenario.tick());
    let distance = |scenario: &Scenario| {
        let shared = 12..16;
        let members =
            |slot: usize| (0..64).filter(move |&n| usize::from(scenario.slot_of(n)) == slot);
        let nearest = shared.map(|slot| {
            let at = scenario.virtualizer.slots[slot].position;
            let distance = |n: usize| {
                perceptual_distance(scenario.sources[n].pose.position, at, &[Vec3::ZERO])
            };
            members(slot).map(distance).fold(f32::MAX, f32::min)
        });
        nearest
            .filter(|&distance| distance < f32::MAX)
            .fold(0.0, f32::max)
    };
    assert!(distance(&scenario) < 0.1);
    // All move to another position, twenty times as far.
    for source in &mut scenario.sources {
        source.pose.position = Vec3::new(200.0, 0.0, 0.0) + 0.1 * source.pose.position;
    }
    scenario.tick();
    assert!(distance(&scenario) < 0.1, "{}", distance(&scenario));
    // A step is followed smoothly.
    let before = scenario.virtualizer.slots[15].position;
    for source in &mut scenario.sources {
        source.pose.position += Vec3::X;
    }
    scenario.tick();
    let went_m = before.distance(scenario.virtualizer.slots[15].position);
    assert!(went_m < 0.5, "{went_m}");
}

#[test]
fn walking_sources_seldom_change_slots_and_slots_move_smoothly() {
    let sources = (0..256)
        .map(|n| source(n, position_around(n, 12.0)))
        .collect();
    let mut scenario = Scenario::new(sources, 16);
    for frame in 0..1200 {
        for index in 0..256 {
            let turn = 0.1 * frame as f32 * TICK_S as f32 + index as f32;
            let circle = Vec3::new(turn.cos(), 0.0, turn.sin());
            scenario.sources[index].pose.position = position_around(index, 12.0) + 2.0 * circle;
        }
        scenario.tick();
    }
    // Twenty seconds of 256 sources: on average each changes slots at most once in two seconds.
    assert!(scenario.moves < 2560, "{} moves", scenario.moves);
}

#[test]
fn removed_sources_are_replaced_under_new_handles() {
    let sources = (0..32)
        .map(|n| source(n, position_around(n, 10.0)))
        .collect();
    let mut scenario = Scenario::new(sources, 16);
    for _ in 0..30 {
        scenario.tick();
    }
    for index in 0..32 {
        scenario.sources[index].pose.id = SourceId::new(index as u16, 1);
    }
    for _ in 0..30 {
        scenario.tick();
    }
    assert_eq!(scenario.routes.len(), 32);
    let assigned = (0..32).filter(|&n| scenario.slot_of(n) != NO_SLOT).count();
    assert_eq!(assigned, 32);
    scenario.sources.clear();
    for _ in 0..30 {
        scenario.tick();
    }
    assert!(scenario.routes.is_empty() && scenario.slot_poses.is_empty());
}

#[test]
fn equal_ticks_have_equal_assignments() {
    let run = || {
        let sources = (0..100)
            .map(|n| source(n, position_around(n, 12.0)))
            .collect();
        let mut scenario = Scenario::new(sources, 16);
        for frame in 0..300 {
            for index in 0..100 {
                scenario.sources[index].pose.position += 0.01 * position_around(index + frame, 1.0);
            }
            scenario.tick();
        }
        let slots: Vec<u16> = scenario.routes.iter().map(|feed| feed.slot).collect();
        let positions: Vec<[u32; 3]> = scenario
            .slot_poses
            .iter()
            .map(|pose| pose.position.to_array().map(f32::to_bits))
            .collect();
        (slots, positions)
    };
    assert_eq!(run(), run());
}
