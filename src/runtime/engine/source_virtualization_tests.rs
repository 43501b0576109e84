//! The seating on a virtual clock: sixty ticks a second.

use super::*;
use crate::propagation::rays::directions::{mix, unit};
use crate::runtime::engine::slot_release::MIN_RELEASE_S;

const TICK_S: f64 = 1.0 / 60.0;

struct Scenario {
    seating: SourceVirtualizer,
    guests: Vec<VirtualSource>,
    time_s: f64,
    sources: Vec<SourcePose>,
    feeds: Vec<SourceRoute>,
    moves: usize,
}

impl Scenario {
    fn new(guests: Vec<VirtualSource>, slots: usize) -> Self {
        Self {
            seating: SourceVirtualizer::new(guests.len(), slots, MIN_RELEASE_S),
            guests,
            time_s: 0.0,
            sources: Vec::new(),
            feeds: Vec::new(),
            moves: 0,
        }
    }

    fn tick(&mut self) {
        let before: Vec<(SourceId, u16)> = self.feeds.iter().map(|f| (f.id, f.slot)).collect();
        let guests = self.guests.iter().copied();
        // The renderer is a frame behind.
        let tick = (self.time_s / TICK_S).round() as u64 + 1;
        let heard = PlaybackProgress {
            tick,
            applied_tick: tick - 1,
            time_s: self.time_s,
        };
        self.seating.assign(
            guests,
            Vec3::ZERO,
            (self.time_s, heard),
            &mut self.sources,
            &mut self.feeds,
        );
        self.time_s += TICK_S;
        let kept = |id: SourceId, slot: u16| before.contains(&(id, slot));
        if !before.is_empty() {
            let moved = self.feeds.iter().filter(|f| !kept(f.id, f.slot));
            self.moves += moved.count();
        }
        self.check();
    }

    /// What always holds: as many sources as slots at most, each once; every feed in a slot that is there; nobody in
    /// another's own slot.
    fn check(&self) {
        assert!(self.sources.len() <= self.seating.slots.len());
        let mut seen = vec![false; self.seating.slots.len()];
        for source in &self.sources {
            assert!(!std::mem::replace(&mut seen[source.id.slot()], true));
        }
        let mut members = vec![0; seen.len()];
        for feed in self.feeds.iter().filter(|feed| feed.slot != NO_SLOT) {
            assert!(seen[usize::from(feed.slot)], "{feed:?} sits nowhere");
            assert!(feed.gain.is_finite() && feed.gain >= 0.0);
            members[usize::from(feed.slot)] += 1;
        }
        let own = &members[..self.seating.first_shared];
        assert!(own.iter().all(|&count| count <= 1), "{own:?}");
    }

    fn slot_of(&self, number: usize) -> u16 {
        self.feeds[number].slot
    }
}

fn guest(number: usize, position: Vec3) -> VirtualSource {
    VirtualSource {
        pose: SourcePose::at(SourceId::new(number as u16, 0), position),
        gain: 1.0,
        plays: true,
    }
}

fn around(number: usize, distance_m: f32) -> Vec3 {
    let dice = |k: u64| unit(mix((number as u64) << 8 | k)) - 0.5;
    distance_m * Vec3::new(dice(0), 0.2 * dice(1), dice(2)).normalize_or(Vec3::X)
}

#[test]
fn the_loudest_sit_alone_and_all_others_are_heard_from_about_where_they_are() {
    let mut guests: Vec<VirtualSource> = (0..256).map(|n| guest(n, around(n, 20.0))).collect();
    for (number, guest) in guests.iter_mut().enumerate().take(12) {
        guest.pose.position = around(number, 2.0);
    }
    let mut scenario = Scenario::new(guests, 16);
    for _ in 0..120 {
        scenario.tick();
    }
    assert_eq!(
        (scenario.sources.len(), scenario.seating.first_shared),
        (16, 12)
    );
    for number in 0..12 {
        assert!(scenario.slot_of(number) < 12, "{number} is loud");
    }
    for number in 12..256 {
        assert!((12..16).contains(&scenario.slot_of(number)));
        let slot = &scenario.seating.slots[usize::from(scenario.slot_of(number))];
        let others = &scenario.seating.slots[12..];
        let from = scenario.guests[number].pose.position;
        let way = |slot: &RenderSlot| perceptual_distance(from, slot.position, Vec3::ZERO);
        // Within the hysteresis of the nearest.
        let nearest = others.iter().map(way).fold(f32::MAX, f32::min);
        assert!(CLEARLY_NEARER * way(slot) <= nearest + 1e-6);
    }
    let moves = scenario.moves;
    for _ in 0..600 {
        scenario.tick();
    }
    assert_eq!(scenario.moves, moves, "nobody moves while nothing changes");
}

#[test]
fn few_sources_all_sit_alone() {
    let guests = (0..40).map(|n| guest(n, around(n, 5.0))).collect();
    let mut scenario = Scenario::new(guests, 16);
    for guest in &mut scenario.guests[10..] {
        guest.plays = false;
    }
    for _ in 0..10 {
        scenario.tick();
    }
    let slots: Vec<u16> = (0..10).map(|n| scenario.slot_of(n)).collect();
    assert!(slots.iter().all(|&slot| slot < 12), "{slots:?}");
    assert_eq!(scenario.sources.len(), 10);
    assert_eq!(scenario.seating.masked, 30);
}

#[test]
fn the_masked_take_no_slot_and_come_back() {
    let mut guests: Vec<VirtualSource> = (0..20).map(|n| guest(n, around(n, 3.0))).collect();
    guests[7].gain = 1e-4;
    let mut scenario = Scenario::new(guests, 16);
    scenario.tick();
    assert_eq!(scenario.slot_of(7), NO_SLOT);
    scenario.guests[7].gain = 0.1;
    scenario.tick();
    assert_ne!(scenario.slot_of(7), NO_SLOT);
}

#[test]
fn a_louder_source_gets_a_slot_of_its_own_after_a_rest() {
    let guests = (0..32).map(|n| guest(n, around(n, 10.0))).collect();
    let mut scenario = Scenario::new(guests, 16);
    for _ in 0..60 {
        scenario.tick();
    }
    let quiet = (0..32)
        .find(|&n| scenario.slot_of(n) >= 12)
        .expect("somebody shares");
    scenario.guests[quiet].pose.position = around(quiet, 2.0);
    let mut waited = 0;
    let generations: Vec<u16> = scenario
        .seating
        .slots
        .iter()
        .map(|s| s.generation)
        .collect();
    while scenario.slot_of(quiet) >= 12 {
        scenario.tick();
        waited += 1;
        assert!(waited < 60, "within a second");
    }
    // An owner leaves, its slot rests, then it is another's by another name.
    assert!(f64::from(waited) * TICK_S >= MIN_RELEASE_S);
    let slot = usize::from(scenario.slot_of(quiet));
    assert_ne!(scenario.seating.slots[slot].generation, generations[slot]);
}

#[test]
fn a_shared_slot_goes_at_once_where_all_its_members_are() {
    let guests = (0..64).map(|n| guest(n, around(n, 10.0))).collect();
    let mut scenario = Scenario::new(guests, 16);
    (0..60).for_each(|_| scenario.tick());
    let way = |scenario: &Scenario| {
        let shared = 12..16;
        let members =
            |slot: usize| (0..64).filter(move |&n| usize::from(scenario.slot_of(n)) == slot);
        let nearest = shared.map(|slot| {
            let at = scenario.seating.slots[slot].position;
            let way = |n: usize| perceptual_distance(scenario.guests[n].pose.position, at, Vec3::ZERO);
            members(slot).map(way).fold(f32::MAX, f32::min)
        });
        nearest.filter(|&way| way < f32::MAX).fold(0.0, f32::max)
    };
    assert!(way(&scenario) < 0.1);
    // All to another place, twenty times as far.
    for guest in &mut scenario.guests {
        guest.pose.position = Vec3::new(200.0, 0.0, 0.0) + 0.1 * guest.pose.position;
    }
    scenario.tick();
    assert!(way(&scenario) < 0.1, "{}", way(&scenario));
    // A step is followed smoothly.
    let before = scenario.seating.slots[15].position;
    for guest in &mut scenario.guests {
        guest.pose.position += Vec3::X;
    }
    scenario.tick();
    let went_m = before.distance(scenario.seating.slots[15].position);
    assert!(went_m < 0.5, "{went_m}");
}

#[test]
fn the_walking_change_places_seldom_and_slots_glide() {
    let guests = (0..256).map(|n| guest(n, around(n, 12.0))).collect();
    let mut scenario = Scenario::new(guests, 16);
    for frame in 0..1200 {
        for number in 0..256 {
            let turn = 0.1 * frame as f32 * TICK_S as f32 + number as f32;
            let circle = Vec3::new(turn.cos(), 0.0, turn.sin());
            scenario.guests[number].pose.position = around(number, 12.0) + 2.0 * circle;
        }
        scenario.tick();
    }
    // Twenty seconds of 256 sources: on average each changes no more than once in two seconds.
    assert!(scenario.moves < 2560, "{} moves", scenario.moves);
}

#[test]
fn the_removed_leave_and_their_successors_are_others() {
    let guests = (0..32).map(|n| guest(n, around(n, 10.0))).collect();
    let mut scenario = Scenario::new(guests, 16);
    for _ in 0..30 {
        scenario.tick();
    }
    for number in 0..32 {
        scenario.guests[number].pose.id = SourceId::new(number as u16, 1);
    }
    for _ in 0..30 {
        scenario.tick();
    }
    assert_eq!(scenario.feeds.len(), 32);
    let seated = (0..32).filter(|&n| scenario.slot_of(n) != NO_SLOT).count();
    assert_eq!(seated, 32);
    scenario.guests.clear();
    for _ in 0..30 {
        scenario.tick();
    }
    assert!(scenario.feeds.is_empty() && scenario.sources.is_empty());
}

#[test]
fn the_same_ticks_give_the_same_seats() {
    let run = || {
        let guests = (0..100).map(|n| guest(n, around(n, 12.0))).collect();
        let mut scenario = Scenario::new(guests, 16);
        for frame in 0..300 {
            for number in 0..100 {
                scenario.guests[number].pose.position += 0.01 * around(number + frame, 1.0);
            }
            scenario.tick();
        }
        let slots: Vec<u16> = scenario.feeds.iter().map(|feed| feed.slot).collect();
        let places: Vec<[u32; 3]> = scenario
            .sources
            .iter()
            .map(|pose| pose.position.to_array().map(f32::to_bits))
            .collect();
        (slots, places)
    };
    assert_eq!(run(), run());
}
