//! A restless engine on the virtual clock, whose blocks a counter of instructions can tell apart.
//!
//! `count_blocks SOURCES BLOCKS` walks through two scenes that take turns at random, while up to `SOURCES` sources move, come and
//! go. One byte written to the null device begins a block, two end it: `benches/icount.c` counts what is in between. No clock, no
//! threads: counts repeat exactly.

use std::fs::OpenOptions;
use std::io::Write;
use std::sync::Arc;

use foresound::glam::Vec3;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::{EngineSettings, VirtualClock, VirtualEngine};
use foresound::scene::procedural::{self, BenchmarkScene};
use foresound::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose};

/// Scenes that take turns.
const SCENES: [&str; 2] = ["concert_hall", "doorway"];
/// Graphics frames a second, and the extrapolation level.
const CLOCK: (f64, u32) = (60.0, 12);
/// Chances of a scene swap, of another source and of one source less, in a graphics frame.
const CHANCES: [f32; 3] = [0.005, 0.3, 0.1];
/// Blocks that are not counted: the first ones have new paths only.
const LEAD_IN_BLOCKS: usize = 200;
const WALK_M_S: f64 = 1.4;

/// Seeded random numbers, 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = mix(self.0);
        unit(self.0)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [most, blocks] = arguments.as_slice() else {
        return Err("arguments: SOURCES BLOCKS".into());
    };
    let (most, blocks): (usize, usize) = (most.parse()?, blocks.parse()?);
    let scenes = SCENES.iter().map(|name| committed(name));
    let scenes: Vec<(BenchmarkScene, Arc<Scene>)> = scenes.collect::<Result<_, _>>()?;
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = most;
    let clip = hum(settings.generation.rate_hz);
    let mut engine = VirtualEngine::new(settings, VirtualClock::at_level(CLOCK.0, CLOCK.1))?;
    engine.controller().set_scene(Arc::clone(&scenes[0].1))?;
    let mut random = Random(27);
    let mut sources: Vec<SourceId> = Vec::new();
    let (mut at, mut done) = (0, 0);
    let (mut swaps, mut births, mut deaths) = (0, 0, 0);
    let mut mark = OpenOptions::new().write(true).open("/dev/null")?;
    while done < LEAD_IN_BLOCKS + blocks {
        if random.next() < CHANCES[0] {
            at = (at + 1) % scenes.len();
            engine.controller().set_scene(Arc::clone(&scenes[at].1))?;
            swaps += 1;
        }
        let time_s = engine.time_s();
        let scene = &scenes[at].0;
        if random.next() < CHANCES[1] && sources.len() < most {
            let place = position(scene, sources.len(), time_s);
            let id = engine.controller().add_source(place)?;
            engine.controller().play(id, Arc::clone(&clip), true)?;
            sources.push(id);
            births += 1;
        }
        if random.next() < CHANCES[2] && sources.len() > most / 2 {
            let which = (random.next() * sources.len() as f32) as usize;
            let id = sources.swap_remove(which.min(sources.len() - 1));
            engine.controller().remove_source(id)?;
            deaths += 1;
        }
        let poses = sources.iter().enumerate();
        let poses = poses.map(|(n, id)| SourcePose::at(*id, position(scene, n, time_s)));
        let poses: Vec<SourcePose> = poses.collect();
        engine.tick(listener(scene, time_s), &poses)?;
        loop {
            let is_counted = done >= LEAD_IN_BLOCKS;
            if is_counted {
                mark.write_all(&[0])?;
            }
            let is_over = engine.next_block().is_none();
            if is_over {
                break;
            }
            if is_counted {
                mark.write_all(&[0; 2])?;
            }
            done += 1;
        }
    }
    eprintln!("{blocks} blocks, {swaps} scene swaps, {births} births, {deaths} deaths");
    Ok(())
}

fn committed(name: &str) -> Result<(BenchmarkScene, Arc<Scene>), Box<dyn std::error::Error>> {
    let benchmark = procedural::by_name(name).ok_or("no such scene")?;
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
    Ok((benchmark, Arc::new(scene)))
}

/// A second of a hum with many harmonics.
fn hum(rate_hz: u32) -> Arc<[f32]> {
    let sample = |n: u32| {
        let phase = n as f32 / rate_hz as f32 * std::f32::consts::TAU;
        let harmonics = (1..20u16).map(|k| (110.0 * f32::from(k) * phase).sin() / f32::from(k));
        0.1 * harmonics.sum::<f32>()
    };
    (0..rate_hz).map(sample).collect()
}

/// A position on a circle around one of the scene's sources.
fn position(scene: &BenchmarkScene, number: usize, time_s: f64) -> Vec3 {
    let base = scene.sources[number % scene.sources.len()].1;
    let turn = (time_s + number as f64) as f32;
    base + 0.5 * Vec3::new(turn.sin(), 0.0, turn.cos())
}

/// A listener who walks to and fro and turns.
fn listener(scene: &BenchmarkScene, time_s: f64) -> ListenerPose {
    let [from, to] = [scene.walk.from, scene.walk.to];
    let length_m = f64::from(from.distance(to));
    let along = (WALK_M_S * time_s) % (2.0 * length_m);
    let share = (along.min(2.0 * length_m - along) / length_m) as f32;
    ListenerPose::facing(from.lerp(to, share), time_s as f32)
}
