//! After a warm-up an update neither allocates nor frees, on one thread or two.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use foresound::propagation::{PathSet, PropagationSettings, Propagator, Serial, Workers};
use foresound::runtime::Threads;
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, procedural,
};
use glam::{Quat, Vec3};

struct Counting;

static COUNTS: AtomicBool = AtomicBool::new(false);
static CALLS: AtomicU64 = AtomicU64::new(0);

fn count() {
    if COUNTS.load(Ordering::Relaxed) {
        CALLS.fetch_add(1, Ordering::Relaxed);
    }
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps the allocator's contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn walk(workers: &impl Workers, updates: u32) -> u64 {
    let hall = procedural::concert_hall();
    let settings = SceneSettings::default();
    let scene = Scene::commit(&hall.mesh, &MaterialTable::built_in(), &settings).expect("commits");
    let settings = PropagationSettings::default();
    let mut propagator = Propagator::new(Arc::new(scene), settings).expect("settings");
    let positions = hall.sources.iter().take(8).enumerate();
    let sources: Vec<SourcePose> = positions
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot as u16, 0), *position))
        .collect();
    let part = procedural::shoebox(Vec3::new(0.9, 2.1, 0.05), "wood_panel");
    let part = Scene::commit(&part, &MaterialTable::built_in(), &SceneSettings::default());
    let part = Arc::new(part.expect("commits"));
    let door = |id, step: u32| InstancePose {
        id,
        position: hall.walk.from.lerp(hall.walk.to, 0.5).as_dvec3(),
        rotation: Quat::from_rotation_y(0.1 * step as f32),
    };
    let doors = [1, 7, 14].map(|step| {
        let pose = door(InstanceId::default(), step);
        let added = propagator
            .scene_mut()
            .add_instance(Arc::clone(&part), &pose);
        added.expect("one more")
    });
    let mut set = PathSet::default();
    let mut run = |step: u32| {
        let ear = ListenerPose {
            position: hall.walk.from.lerp(hall.walk.to, 0.4 + 0.002 * step as f32),
            ..ListenerPose::default()
        };
        let moved = doors.map(|id| door(id, step + id.slot() as u32));
        assert_eq!(propagator.scene_mut().set_instance_poses(&moved), 3);
        propagator.update_with(workers, &ear, &sources, 0.0, &mut set);
    };
    (0..20).for_each(&mut run);
    CALLS.store(0, Ordering::SeqCst);
    COUNTS.store(true, Ordering::SeqCst);
    (20..20 + updates).for_each(&mut run);
    COUNTS.store(false, Ordering::SeqCst);
    CALLS.load(Ordering::SeqCst)
}

// One test, since the count is the process's.
#[test]
fn an_update_does_not_allocate_after_warm_up() {
    assert_eq!(walk(&Serial, 20), 0, "one thread");
    let threads = Threads::start(2).expect("a thread starts");
    assert_eq!(walk(&threads, 20), 0, "two threads");
}
