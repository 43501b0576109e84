//! Layouts of the output: levels, directions, and changes while sound runs.

use std::sync::Arc;

use foresound::extrapolation::{FramePath, FramePaths, LATE_GROUPS, LateGroup, LateSend, PathKind};
use foresound::generation::{Generator, GeneratorSettings, Hrtf, Layout};
use foresound::propagation::PathId;
use foresound::runtime::{EngineSchedule, EngineSettings, VirtualClock, VirtualEngine};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use foresound_tools::clicks::{ClickDetector, smooth_loop};
use glam::{Quat, Vec3};

const RATE_HZ: u32 = 44_100;
const BLOCK: usize = 512;

/// Directions of a spiral.
fn direction(n: usize, count: usize) -> Vec3 {
    let up = 1.0 - (2 * n + 1) as f32 / count as f32;
    let across = (1.0 - up * up).sqrt();
    let (sin, cos) = (2.399_963_2 * n as f32).sin_cos();
    Vec3::new(across * cos, up, across * sin)
}

/// Paths from all directions with delays apart, and isotropic late reverb; either alone by its gain.
fn everywhere(early: f32, late: f32) -> FramePaths {
    const PATHS: usize = 96;
    let path = |n: usize| FramePath {
        id: PathId(n as u64),
        source: SourceId::new(0, 0),
        order: 0,
        amplitude: [early; 8],
        // No two pairs of paths are equally far apart.
        delay_s: 0.01 + 0.003_1 * n as f64 + 1e-5 * (n * n) as f64,
        air_delay_s: 0.0,
        kind: PathKind::Reflected,
        arrival: direction(n, PATHS),
        departure: Vec3::ZERO,
    };
    FramePaths {
        paths: (0..PATHS).filter(|_| early > 0.0).map(path).collect(),
        late: vec![LateSend {
            source: SourceId::new(0, 0),
            group: 0,
            energy_per_s: [late; 8],
            start_s: 0.02,
        }],
        late_groups: [LateGroup::isotropic([0.8; 8]); LATE_GROUPS],
        ..FramePaths::default()
    }
}

fn settings(layout: Layout) -> GeneratorSettings {
    GeneratorSettings {
        rate_hz: RATE_HZ,
        max_sources: 1,
        max_voices: 128,
        fine_voices: 128,
        limiter: false,
        layout,
        ..GeneratorSettings::default()
    }
}

/// Noise, flat to 2 kHz and down by 6 dB an octave above, as much of speech and music is: paths whose delays differ by a
/// millisecond are incoherent, and their energies add up in every layout.
fn noise(count: usize) -> Vec<f32> {
    let (mut state, mut low) = (1u32, 0.0f32);
    let pole = (-std::f32::consts::TAU * 2000.0 / RATE_HZ as f32).exp();
    (0..count)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let white = (state >> 8) as f32 / (1 << 23) as f32 - 1.0;
            low += (1.0 - pole) * (0.2 * white - low);
            low
        })
        .collect()
}

/// Sound of a layout, interleaved.
fn heard(layout: Layout, frame: &FramePaths, seconds: f64) -> Vec<f32> {
    let hrtf = Arc::new(Hrtf::builtin(RATE_HZ).expect("built in"));
    let mut generator = Generator::new(settings(layout), hrtf).expect("settings");
    generator.set_frame(frame, BLOCK as u32);
    let input = noise((seconds * f64::from(RATE_HZ)) as usize);
    let mut sound = Vec::new();
    let mut output = vec![0.0; layout.channels() * BLOCK];
    for input in input.chunks_exact(BLOCK) {
        generator.render(&[input], &mut output);
        sound.extend_from_slice(&output);
    }
    sound
}

/// Energies of the channels.
fn energies(sound: &[f32], channels: usize) -> Vec<f64> {
    let mut energies = vec![0.0; channels];
    for frame in sound.chunks_exact(channels) {
        for (energy, sample) in energies.iter_mut().zip(frame) {
            *energy += f64::from(*sample).powi(2);
        }
    }
    energies
}

/// Total energy: of the omnidirectional channel in Ambisonics, of all channels otherwise.
fn total(layout: Layout, frame: &FramePaths) -> f64 {
    let energies = energies(&heard(layout, frame, 4.0), layout.channels());
    match layout.ambisonics_order() {
        Some(_) => energies[0],
        None => energies.iter().sum(),
    }
}

#[test]
fn all_layouts_have_the_same_total_energy() {
    for (what, frame) in [
        ("paths", everywhere(0.3, 0.0)),
        ("late reverb", everywhere(0.0, 0.5)),
        ("both", everywhere(0.3, 0.5)),
    ] {
        let levels: Vec<f64> = Layout::ALL
            .iter()
            .map(|layout| 10.0 * total(*layout, &frame).log10())
            .collect();
        println!("{what}: {levels:.2?}");
        let highest = levels.iter().copied().fold(f64::MIN, f64::max);
        let lowest = levels.iter().copied().fold(f64::MAX, f64::min);
        assert!(highest - lowest < 0.5, "{what}: {levels:.2?}");
    }
}

#[test]
fn late_reverb_keeps_its_directions() {
    // All late energy from the direction to the left.
    let mut frame = everywhere(0.0, 0.5);
    let vectors = foresound::paths::LATE_DIRECTION_VECTORS;
    let leftmost = vectors.iter().map(|vector| vector.x).fold(0.0, f32::min);
    for group in &mut frame.late_groups {
        for (share, vector) in group.directions.iter_mut().zip(vectors) {
            *share = [f32::from(u8::from(vector.x == leftmost)); 8];
        }
    }
    let of = |layout: Layout| energies(&heard(layout, &frame, 2.0), layout.channels());
    let stereo = of(Layout::Stereo);
    assert!(stereo[0] > 4.0 * stereo[1], "{stereo:?}");
    let surround = of(Layout::Surround71);
    let side = |channels: [usize; 3]| {
        channels
            .map(|channel| surround[channel])
            .iter()
            .sum::<f64>()
    };
    assert!(side([0, 4, 6]) > 6.0 * side([1, 5, 7]), "{surround:?}");
    let ambisonics = of(Layout::Ambisonics1);
    // Y of one wave from there has the square of the vector's part; the waves spread over some 30 degrees around it.
    let to_left = f64::from(leftmost).powi(2);
    let left = ambisonics[1] / ambisonics[0];
    assert!(
        (0.7 * to_left..1.1 * to_left).contains(&left),
        "{left} of {to_left}"
    );
}

/// A path's channels against the closed form, with a turned listener.
#[test]
fn ambisonics_channels_are_the_harmonics_of_the_direction() {
    let mut frame = everywhere(0.0, 0.0);
    frame.paths = vec![FramePath {
        id: PathId(1),
        source: SourceId::new(0, 0),
        order: 0,
        amplitude: [1.0; 8],
        delay_s: 0.01,
        air_delay_s: 0.0,
        kind: PathKind::Direct,
        // Ahead of a listener who faces +x.
        arrival: Vec3::X,
        departure: Vec3::ZERO,
    }];
    frame.orientation = Quat::from_rotation_y(-std::f32::consts::FRAC_PI_2);
    let energies = energies(&heard(Layout::Ambisonics3, &frame, 1.0), 16);
    let found = |channel: usize| (energies[channel] / energies[0]).sqrt();
    // x = 1: X, R = -1/2, U = √3/2, N = ... by [NACHBAR11] table 1 with SN3D; all else is zero.
    let root = f64::sqrt;
    for (channel, exact) in [
        (0, 1.0),
        (3, 1.0),
        (6, 0.5),
        (8, root(3.0) / 2.0),
        (13, root(6.0) / 4.0),
        (15, root(10.0) / 4.0),
    ] {
        assert!(
            (found(channel) - exact).abs() < 0.005,
            "{channel}: {}",
            found(channel)
        );
    }
    for channel in [1, 2, 4, 5, 7, 9, 10, 11, 12, 14] {
        assert!(found(channel) < 0.005, "{channel}: {}", found(channel));
    }
}

/// Layouts and HRTF sets change at random every few graphics frames while a listener walks among sources.
fn switching(channels: usize) -> (ClickDetector, u32) {
    let room = procedural::shoebox(Vec3::new(9.0, 3.0, 6.0), "plaster");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&room, &table, &SceneSettings::default()).expect("commits");
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 3;
    settings.generation.channels = Some(channels);
    settings.schedule = EngineSchedule::Asynchronous;
    let clock = VirtualClock::at_level(60.0, 3);
    let mut engine = VirtualEngine::new(settings, clock).expect("settings");
    let controller = engine.controller();
    controller.set_scene(Arc::new(scene)).expect("a scene");
    let clip: Arc<[f32]> = smooth_loop(RATE_HZ).into();
    let ids: Vec<SourceId> = (0..3)
        .map(|n| {
            let id = controller.add_source([2.0 + 2.0 * n as f32, 1.5, 2.0]);
            let id = id.expect("a slot");
            controller
                .play(id, Arc::clone(&clip), true)
                .expect("is there");
            id
        })
        .collect();
    let omni = Arc::new(Hrtf::omnidirectional(RATE_HZ).expect("an HRTF set"));
    let mut detector = ClickDetector::with_channels(RATE_HZ, channels);
    let fitting: Vec<Layout> = Layout::ALL
        .into_iter()
        .filter(|layout| layout.channels() <= channels)
        .collect();
    let (mut state, mut changes) = (7u32, 0);
    for frame in 0..400 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let controller = engine.controller();
        // From every frame to every sixth: changes meet fades in progress too.
        if (state >> 12).is_multiple_of(4) {
            let layout = fitting[(state >> 16) as usize % fitting.len()];
            controller.set_layout(layout).expect("fits");
            changes += 1;
        } else if (state >> 12).is_multiple_of(7) {
            let set = (state >> 20).is_multiple_of(2).then(|| Arc::clone(&omni));
            controller.set_hrtf(set).expect("of this rate");
            changes += 1;
        }
        let time_s = frame as f32 / 60.0;
        let position = Vec3::new(4.5 + time_s.sin(), 1.7, 4.0);
        let poses = [SourcePose::at(
            ids[0],
            Vec3::new(2.0, 1.5, 2.0 + 0.2 * time_s),
        )];
        let listener = ListenerPose::facing(position, 0.5 * time_s);
        engine
            .next_frame(listener, &poses, |block| detector.push(block))
            .expect("poses");
    }
    (detector, changes)
}

#[test]
fn changes_of_layout_and_head_do_not_click() {
    for channels in [2, 16] {
        let (detector, changes) = switching(channels);
        println!("{channels}: {changes} changes, worst {}", detector.worst());
        assert!(changes > 50 && detector.peak() > 0.01);
        assert_eq!(detector.clicks(), 0, "worst {}", detector.worst());
    }
}

/// Energy in the windows around a change stays between those of both layouts: sound cross-fades without a gap.
#[test]
fn a_change_leaves_no_gap() {
    let hrtf = Arc::new(Hrtf::builtin(RATE_HZ).expect("built in"));
    let room = procedural::shoebox(Vec3::new(9.0, 3.0, 6.0), "plaster");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&room, &table, &SceneSettings::default()).expect("commits");
    let mut offline = foresound::runtime::OfflineSettings::default();
    offline.generation = settings(Layout::Binaural);
    let mut renderer =
        foresound::runtime::OfflineRenderer::new(Arc::new(scene), Arc::clone(&hrtf), offline)
            .expect("settings");
    let mut poses = foresound::runtime::Poses::default();
    poses.listener.position = Vec3::new(4.5, 1.7, 4.0);
    let at = Vec3::new(3.0, 1.5, 2.0);
    poses.sources.push(SourcePose::at(SourceId::new(0, 0), at));
    let sound = noise(2 * RATE_HZ as usize);
    let mut signal = |_: usize, from: u64, samples: &mut [f32]| {
        samples.copy_from_slice(&sound[from as usize..][..samples.len()]);
    };
    let mut of_frame = Vec::new();
    for number in 0..90 {
        let layout = if number < 60 {
            Layout::Binaural
        } else {
            Layout::Stereo
        };
        if number == 60 {
            renderer.set_output(layout, &hrtf).expect("fits");
            assert!(renderer.set_output(layout, &hrtf).is_err(), "still fading");
        }
        let mut energy = 0.0;
        renderer
            .next_frame(&poses, &mut signal, &mut |block| {
                energy += energies(block, 2).iter().sum::<f64>();
                Ok(())
            })
            .expect("renders");
        of_frame.push(10.0 * energy.log10());
    }
    let around = &of_frame[40..80];
    let mean = around.iter().sum::<f64>() / around.len() as f64;
    let lowest = around.iter().copied().fold(f64::MAX, f64::min);
    println!("mean {mean:.1} dB, lowest {lowest:.1}");
    // Windows of noise vary by some decibels; both outputs at half amplitude and without coherence are down by 3 dB.
    assert!(lowest > mean - 7.0, "{around:.1?}");
}
