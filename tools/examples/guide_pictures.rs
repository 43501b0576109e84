//! The pictures of the guide: `cargo run --release -p foresound-tools --example guide_pictures [FOLDER]`, docs/src/images
//! unless a folder is named. A path around a door frame, a door that closes, and what a hall answers to one click.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use plotters::prelude::*;

use foresound::glam::Quat;
use foresound::paths::{MAX_ORDER, PathSet, Propagator};
use foresound::propagation::diffuse::envelope::LATE_SEGMENT_STARTS;
use foresound::scene::procedural;
use foresound::{
    BANDS, InstanceId, InstancePose, ListenerPose, MaterialTable, PropagationSettings, Result,
    Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
};
use foresound_tools::chart::{
    AXIS, Area, Axes, DrawError, Picture, Ticked, draw_title, legend, px,
};
use foresound_tools::top_view::{TopView, path_lines};

/// A voice and ears in different rooms of the scene `doorway`, out of each other's sight.
const VOICE: [f32; 3] = [4.0, 1.5, 1.2];
const EARS: [f32; 3] = [11.0, 1.65, 1.8];
/// The door leaf in its own coordinates, hinge at the origin: 1 cm from the wall that it covers and from the floor. Metres.
const LEAF: [[f32; 3]; 2] = [[-0.02, 0.01, 0.0], [0.02, 2.12, 1.01]];
const HINGE: [f64; 3] = [7.97, 0.0, 3.06];
/// Updates until the late energy's mean is steady: one turn of the fixed ray rotations.
const UPDATES: usize = 16;

const COLOURS: [RGBColor; 5] = [
    RGBColor(208, 26, 48),
    RGBColor(232, 120, 16),
    RGBColor(20, 142, 96),
    RGBColor(36, 104, 196),
    RGBColor(128, 72, 172),
];

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("docs/src/images"), PathBuf::from);
    path(&folder.join("path.png"))?;
    door(&folder.join("door.png"))?;
    room(&folder.join("room.png"))
}

/// A benchmark scene, without the open door leaf that `doorway` has.
fn commit(name: &str) -> Result<Scene> {
    let mut scene = procedural::by_name(name).expect("a benchmark scene");
    if let Some(door) = scene.parts.iter().find(|part| part.name == "door") {
        scene.mesh.triangles.drain(door.triangles.clone());
        scene.mesh.triangle_materials.drain(door.triangles.clone());
    }
    Scene::commit(
        &scene.mesh,
        &MaterialTable::built_in(),
        &SceneSettings::default(),
    )
}

/// What the last of [`UPDATES`] finds.
fn update(scene: Scene, voice: [f32; 3], ears: [f32; 3]) -> Result<PathSet> {
    let mut propagator = Propagator::new(Arc::new(scene), PropagationSettings::default())?;
    let voice = SourcePose::at(SourceId::new(0, 0), voice);
    let ears = ListenerPose::facing(ears, std::f32::consts::FRAC_PI_2);
    let mut set = PathSet::default();
    for number in 0..UPDATES {
        propagator.update(&ears, &[voice], number as f64 / 60.0, &mut set);
    }
    Ok(set)
}

/// The plan of both rooms with what is heard through the open door.
fn path(file: &Path) -> Result<()> {
    let scene = commit("doorway")?;
    let triangles: Vec<_> = scene.triangles().collect();
    let set = update(scene, VOICE, EARS)?;
    let mut lines = path_lines(&set);
    lines.retain(|line| line.order + line.diffraction_order <= 2);
    TopView {
        title: "Around the door frame",
        caption: "The voice is out of sight. It is heard from the edges of the opening, by mirroring walls and, faintly, through the wall",
        triangles: &triangles,
        sources: &[(VOICE.into(), "voice".to_owned())],
        listener: Some(set.listener),
        paths: &lines,
        ..TopView::default()
    }
    .draw()?
    .save_png(file)
}

/// A box as a part: its corners and twelve triangles.
fn leaf() -> Result<Scene> {
    let corners: Vec<[f32; 3]> = (0..8)
        .map(|corner| std::array::from_fn(|axis| LEAF[(corner >> axis) & 1][axis]))
        .collect();
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let indices: Vec<u32> = faces
        .iter()
        .flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]])
        .collect();
    let mesh = TriangleMesh::from_slices(&corners, &indices, &["door_wood"], &[0; 12])?;
    Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
}

/// Energy of everything that arrives, by band.
fn energy(set: &PathSet) -> [f64; BANDS] {
    std::array::from_fn(|band| {
        let early = set
            .paths
            .iter()
            .map(|path| f64::from(path.amplitude[band]).powi(2));
        let late = set
            .late
            .iter()
            .flat_map(|late| late.energy.iter().flatten());
        early.sum::<f64>() + late.map(|segment| f64::from(segment[band])).sum::<f64>()
    })
}

/// Level in the next room over the angle of the door.
fn door(file: &Path) -> Result<()> {
    let part = Arc::new(leaf()?);
    let angles: Vec<f64> = [0.0, 1.0, 2.0]
        .into_iter()
        .chain((1..=30).map(|step| 3.0 * f64::from(step)))
        .collect();
    let mut energies = Vec::new();
    for angle in &angles {
        let mut scene = commit("doorway")?;
        let mut pose = InstancePose::at(InstanceId::default(), HINGE);
        pose.rotation = Quat::from_rotation_y(-angle.to_radians() as f32);
        scene.add_instance(part.clone(), &pose)?;
        energies.push(energy(&update(scene, VOICE, EARS)?));
    }
    let open = *energies.last().expect("angles");
    let bands = [1, 3, 5, 7];
    Picture::draw(1200, 620, |area| {
        draw_title(
            area,
            px(76.0),
            "A door that closes",
            "Everything that arrives from the next room, re the open door; a wooden leaf, 1 cm from the wall",
        )?;
        let names = ["125 Hz", "500 Hz", "2 kHz", "8 kHz"].map(str::to_owned);
        let names: Vec<_> = names.into_iter().zip(COLOURS).collect();
        legend(area, (px(76.0), px(84.0)), &names)?;
        let (_, below) = area.split_vertically(px(104.0));
        let ticks = (0..=6).map(|k| (f64::from(15 * k), format!("{}", 15 * k)));
        let mut chart = Axes {
            title: "",
            x: Ticked { range: 0.0..90.0, ticks: ticks.collect() },
            y: -60.0..3.0,
            y_text: &|db| format!("{db:.0}"),
            names: ["angle of the door in degrees: 0 is shut", "dB re open"],
        }
        .draw(&below)?;
        for (band, colour) in bands.iter().zip(COLOURS) {
            let points = angles.iter().zip(&energies).map(|(angle, e)| (*angle, 10.0 * (e[*band] / open[*band]).log10()));
            chart.draw_series(LineSeries::new(points, colour.stroke_width(px(3.0) as u32)))?;
        }
        Ok(())
    })?
    .save_png(file)
}

/// Arrivals of one click in the hall: a bar a path, and the late reverb's decay behind.
fn room(file: &Path) -> Result<()> {
    let hall = procedural::by_name("concert_hall").expect("a benchmark scene");
    let (voice, ears) = (hall.sources[0].1, hall.walk.standing);
    let scene = commit("concert_hall")?;
    let speed_m_s = scene.speed_of_sound_m_s();
    let set = update(scene, voice.into(), ears.into())?;
    let caption = format!(
        "{} discrete paths, each with its own direction, delay and colour; then the late reverb of the hall's own decay",
        set.paths.len()
    );
    Picture::draw(1200, 620, |area| {
        draw_title(area, px(76.0), "A hall answers one click", &caption)?;
        let names = (0..=MAX_ORDER).map(|order| match order {
            0 => "direct and diffracted".to_owned(),
            1 => "one reflection".to_owned(),
            n => format!("{n}"),
        });
        let names: Vec<_> = names.zip(COLOURS).collect();
        legend(area, (px(76.0), px(84.0)), &names)?;
        let (_, below) = area.split_vertically(px(104.0));
        draw_arrivals(&below, &set, speed_m_s)
    })?
    .save_png(file)
}

/// Index of 1 kHz.
const BAND: usize = 4;

/// Late energy that arrives per second at 1 kHz, `time_s` after the click.
fn late_energy_per_s(set: &PathSet, time_s: f64) -> f64 {
    let mut sum = 0.0;
    for late in &set.late {
        let groups = set.late_groups.iter().zip(LATE_SEGMENT_STARTS);
        for ((group, starts), segments) in groups.zip(&late.energy) {
            // Nepers of energy a second.
            let decay = 6.0 * 10f64.ln() / f64::from(group.decay_time_s[BAND]);
            for (energy, start) in segments.iter().zip(starts) {
                let start_s = f64::from(late.start_s) + start * f64::from(late.mean_free_time_s);
                if time_s >= start_s && decay.is_finite() {
                    let passed = (-decay * (time_s - start_s)).exp();
                    sum += f64::from(energy[BAND]) * decay * passed;
                }
            }
        }
    }
    sum
}

/// Bars of the paths at 1 kHz over their delays, and the late reverb's energy in windows of 5 ms.
fn draw_arrivals(
    area: &Area<'_>,
    set: &PathSet,
    speed_m_s: f64,
) -> std::result::Result<(), DrawError> {
    const WINDOW_S: f64 = 0.005;
    const FLOOR_DB: f64 = -60.0;
    const END_MS: f64 = 400.0;
    let ticks = (0..=8).map(|k| (f64::from(50 * k), format!("{}", 50 * k)));
    let mut chart = Axes {
        title: "",
        x: Ticked {
            range: 0.0..END_MS,
            ticks: ticks.collect(),
        },
        y: FLOOR_DB..0.0,
        y_text: &|db| format!("{db:.0}"),
        names: [
            "milliseconds after the click; grey: late reverb in windows of 5 ms",
            "dB at 1 kHz, re 1 m from the voice",
        ],
    }
    .draw(area)?;
    let level = |ms: f64| {
        let window = late_energy_per_s(set, 0.001 * ms) * WINDOW_S;
        (ms, (10.0 * window.log10()).max(FLOOR_DB))
    };
    let points = (0..).map(f64::from).take_while(|ms| *ms < END_MS);
    let mut outline = vec![(0.0, FLOOR_DB)];
    outline.extend(points.map(level));
    outline.push((END_MS, FLOOR_DB));
    chart.draw_series(std::iter::once(Polygon::new(
        outline,
        AXIS.mix(0.35).filled(),
    )))?;
    // The highest orders first: the loud ones stay visible.
    let mut paths: Vec<_> = set.paths.iter().collect();
    paths.sort_by_key(|path| std::cmp::Reverse(path.order));
    for path in paths {
        let ms = 1000.0 * f64::from(path.length_m) / speed_m_s;
        let db = 20.0 * f64::from(path.amplitude[BAND]).abs().max(1e-9).log10();
        if db > FLOOR_DB && ms < END_MS {
            let style = COLOURS[usize::from(path.order)].stroke_width(px(2.0) as u32);
            chart.draw_series(std::iter::once(PathElement::new(
                vec![(ms, FLOOR_DB), (ms, db)],
                style,
            )))?;
        }
    }
    Ok(())
}
