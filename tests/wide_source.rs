//! Sources with a size: the level is the mean over their points, also past an edge; the image is wide at the same level.

use std::f64::consts::PI;
use std::sync::Arc;

use foresound::BANDS;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::extrapolation::{Extrapolator, FramePaths, PredictorKind, WideArrival};
use foresound::generation::{Generator, GeneratorSettings, Hrtf, Layout};
use foresound::propagation::{PathId, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MAX_EXTENT_POINTS, MaterialTable, Scene, SceneSettings, SourceExtent, SourceId,
    SourcePose, TriangleMesh,
};
use glam::Vec3;

mod reference;
use reference::generators;

/// A thin screen at z = 0 beyond x = 0, 40 m high and wide, alone in the open.
fn screen() -> Arc<Scene> {
    let corners = [
        [0.0, -20.0, 0.0],
        [40.0, -20.0, 0.0],
        [40.0, 20.0, 0.0],
        [0.0, 20.0, 0.0],
    ];
    let sheet = TriangleMesh::from_slices(&corners, &[0, 1, 2, 0, 2, 3], &["concrete"], &[0, 0]);
    let mesh = sheet.expect("is a mesh");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits");
    Arc::new(scene)
}

fn source(position: Vec3, extent: SourceExtent) -> SourcePose {
    let mut source = SourcePose::at(SourceId::new(0, 1), position);
    source.settings.extent = extent;
    source.settings.effects.reflections = false;
    source.settings.effects.late = false;
    source
}

/// The frame of a source for a listener at rest.
fn frame(scene: &Arc<Scene>, source: &SourcePose, ear: Vec3) -> FramePaths {
    let ear = ListenerPose::facing(ear, 0.0);
    let settings = PropagationSettings::default();
    let mut propagator = Propagator::new(Arc::clone(scene), settings).expect("settings");
    let mut update = PathSet::default();
    propagator.update(&ear, &[*source], 0.0, &mut update);
    let mut extrapolator = Extrapolator::new(Arc::clone(scene), PredictorKind::Hold, 0.3);
    extrapolator.store_update(update, 4);
    let mut frame = FramePaths::default();
    extrapolator.frame(&ear, &[*source], &mut frame);
    frame
}

/// Mean energy in a band, over frequencies of its octave, of paths that are one signal.
fn energy(frame: &FramePaths, band: usize) -> f64 {
    const TONES: usize = 24;
    let tone = |n: usize| {
        let hz = CENTRES_HZ[band] * ((n as f64 + 0.5) / TONES as f64 - 0.5).exp2();
        let (mut re, mut im) = (0.0, 0.0);
        for path in &frame.paths {
            let (sin, cos) = (2.0 * PI * hz * path.delay_s).sin_cos();
            re += f64::from(path.amplitude[band]) * cos;
            im += f64::from(path.amplitude[band]) * sin;
        }
        re * re + im * im
    };
    (0..TONES).map(tone).sum::<f64>() / TONES as f64
}

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// Even points on a sphere, computed anew.
fn on_sphere(index: usize, count: usize) -> Vec3 {
    let up = 1.0 - (2 * index + 1) as f64 / count as f64;
    let turn = PI * (3.0 - 5f64.sqrt()) * index as f64;
    let across = (1.0 - up * up).sqrt();
    Vec3::new(
        (across * turn.cos()) as f32,
        up as f32,
        (across * turn.sin()) as f32,
    )
}

#[test]
fn far_away_a_wide_source_is_as_loud_as_a_point() {
    let scene = screen();
    let at = Vec3::new(-10.0, 0.0, -6.0);
    let ear = at + Vec3::new(-8.0, 0.0, 0.0);
    for extent in [
        SourceExtent::sphere(2.0),
        SourceExtent {
            semi_axes_m: Vec3::new(0.0, 0.5, 2.0),
            points: 32,
        },
    ] {
        let [wide, point] =
            [extent, SourceExtent::POINT].map(|extent| frame(&scene, &source(at, extent), ear));
        assert!(point.wide.is_empty());
        assert_eq!(wide.wide.len(), 1);
        assert_eq!(wide.obstructions[0].occlusion, 0.0);
        for b in 0..BANDS {
            let change = db(energy(&wide, b) / energy(&point, b));
            // On a sphere the mean of 1/d² is 1/d² · ln((d + r) / (d − r)) · d / 2r: 0.28 dB more at d = 4 r.
            assert!(change.abs() < 0.5, "{extent:?}, band {b}: {change:.2} dB");
        }
    }
}

/// On a walk from the light into the shadow the level is that of the points, each computed as a source of its own, and the
/// share of hidden points rises from 0 to 1 without large steps.
#[test]
fn a_wide_source_fades_past_an_edge_like_its_points() {
    let scene = screen();
    let (at, radius_m, points) = (Vec3::new(-0.3, 0.0, -3.0), 0.5, 16);
    let extent = SourceExtent {
        semi_axes_m: Vec3::splat(radius_m),
        points,
    };
    let steps = 60;
    let (mut worst, mut mean_error, mut largest_step) =
        ([0f64; BANDS], [0f64; BANDS], [0f64; BANDS]);
    let mut before: Option<([f64; BANDS], f32)> = None;
    let mut partly = 0;
    for step in 0..=steps {
        let ear = Vec3::new(-2.0 + 4.0 * step as f32 / steps as f32, 0.1, 3.0);
        let wide = frame(&scene, &source(at, extent), ear);
        let mut exact = [0.0; BANDS];
        for index in 0..points {
            let position = at + radius_m * on_sphere(index, points);
            let point = frame(&scene, &source(position, SourceExtent::POINT), ear);
            for b in 0..BANDS {
                exact[b] += energy(&point, b) / points as f64;
            }
        }
        let occlusion = wide.obstructions[0].occlusion;
        let levels: [f64; BANDS] = std::array::from_fn(|b| db(energy(&wide, b)));
        for b in 0..BANDS {
            let error = levels[b] - db(exact[b]);
            worst[b] = worst[b].max(error.abs());
            mean_error[b] += error / f64::from(steps + 1);
            if let Some((before, _)) = before {
                largest_step[b] = largest_step[b].max((levels[b] - before[b]).abs());
            }
        }
        if let Some((_, before)) = before {
            assert!(
                occlusion >= before - 1e-6,
                "step {step}: {before} to {occlusion}"
            );
            assert!(occlusion - before <= 4.0 / points as f32, "step {step}");
        }
        partly += u32::from(occlusion > 0.0 && occlusion < 1.0);
        before = Some((levels, occlusion));
    }
    println!("worst {worst:.2?} dB, mean {mean_error:.2?} dB, steps {largest_step:.2?} dB");
    assert_eq!(before.map(|(_, occlusion)| occlusion), Some(1.0));
    // The lines through the middle of the sphere's two sides meet the walk about a metre apart.
    assert!(partly >= 10, "{partly} steps");
    for b in 0..BANDS {
        // Counted twice, edge waves would raise the level by some 3 dB at the boundary.
        assert!(worst[b] < 1.5 && mean_error[b].abs() < 0.5, "band {b}");
        // A point source falls by 6 dB within a few centimetres at 8 kHz. Here 7 cm are a step.
        assert!(largest_step[b] < 1.5, "band {b}");
    }
}

#[test]
fn points_behind_a_wall_beside_the_source_are_pulled_in() {
    let scene = screen();
    // A metre in front of the screen, with half of the sphere behind it.
    let at = Vec3::new(10.0, 0.0, -1.0);
    let wide = frame(
        &scene,
        &source(at, SourceExtent::sphere(3.0)),
        at + Vec3::NEG_Z * 9.0,
    );
    assert_eq!(wide.obstructions[0].occlusion, 0.0);
}

/// Noise, flat to 2 kHz and down by 6 dB an octave above, as much of speech and music is.
fn noise(count: usize) -> Vec<f32> {
    let pole = (-2.0 * std::f32::consts::PI * 2000.0 / 44_100.0).exp();
    let mut low = 0.0;
    let white = generators::noise(count);
    let smooth = white.into_iter().map(|sample| {
        low += (1.0 - pole) * (sample - low);
        low
    });
    smooth.collect()
}

/// Noise through a generator of this layout, from one path with the given directions.
fn rendered_energy(layout: Layout, wide: &WideArrival, hrtf: &Arc<Hrtf>) -> f64 {
    let settings = GeneratorSettings {
        layout,
        max_sources: 1,
        limiter: false,
        late: false,
        ..GeneratorSettings::default()
    };
    let mut generator = Generator::new(settings, Arc::clone(hrtf)).expect("settings");
    let mut frame = generators::frame(vec![generators::path(1, 1.0, 0.01, Vec3::NEG_Z)]);
    frame.wide.push(*wide);
    let channels = generator.channels();
    let input = noise(44_100);
    let mut output = vec![0.0; channels * input.len()];
    generator.set_frame(&frame, 1);
    generator.render(&[&input], &mut output);
    // The omnidirectional channel of Ambisonics stands for all.
    let counted = layout.ambisonics_order().map_or(channels, |_| 1);
    let frames = output.chunks_exact(channels);
    frames
        .flat_map(|frame| &frame[..counted])
        .map(|s| f64::from(*s).powi(2))
        .sum()
}

fn arrival(directions: &[Vec3]) -> WideArrival {
    let mut wide = WideArrival {
        id: PathId(1),
        directions: [Vec3::NEG_Z; MAX_EXTENT_POINTS],
        shares: [0.0; MAX_EXTENT_POINTS],
        count: directions.len(),
    };
    wide.directions[..directions.len()].copy_from_slice(directions);
    wide.shares[..directions.len()].fill(1.0 / directions.len() as f32);
    wide
}

#[test]
fn an_image_of_any_width_has_the_energy_of_its_directions_in_every_layout() {
    let hrtf = Arc::new(Hrtf::builtin(44_100).expect("is built in"));
    for name in [
        "binaural", "stereo", "mono", "5.1", "7.1", "7.1.4", "ambix1", "ambix3",
    ] {
        let layout: Layout = name.parse().expect("is a layout");
        let mut widest = 0f64;
        for ahead in [Vec3::NEG_Z, Vec3::X, Vec3::new(0.5, 0.6, 0.7).normalize()] {
            for radius in [0.1, 0.3, 0.7, 0.99, 5.0] {
                let directions: Vec<Vec3> = (0..16)
                    .map(|n| (ahead + radius * on_sphere(n, 16)).normalize())
                    .collect();
                let each = directions.iter().map(|direction| {
                    rendered_energy(layout, &arrival(&[*direction]), &hrtf) / 16.0
                });
                let change =
                    db(rendered_energy(layout, &arrival(&directions), &hrtf) / each.sum::<f64>());
                widest = if change.abs() > widest.abs() {
                    change
                } else {
                    widest
                };
            }
        }
        println!("{name}: {widest:.2} dB");
        assert!(widest.abs() < 0.5, "{name}: {widest:.2} dB");
    }
}
