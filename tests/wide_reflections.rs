//! Reflections and late sound of sources with a size, against the sum of many point sources that are computed one by one.

use std::collections::BTreeMap;
use std::sync::Arc;

use foresound::BANDS;
use foresound::extrapolation::{Extrapolator, FramePath, FramePaths, PathKind, PredictorKind};
use foresound::propagation::{PathId, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceExtent, SourceId, SourcePose,
    procedural,
};
use glam::{Quat, Vec3};

/// Point sources that stand for a wide one.
const MANY: usize = 32;

/// A band in which air absorbs little.
const BAND: usize = 3;

fn room(size: Vec3, material: &str) -> Arc<Scene> {
    let mesh = procedural::shoebox(size, material);
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
    Arc::new(scene.expect("commits"))
}

fn source(position: Vec3, orientation: Quat, extent: SourceExtent) -> SourcePose {
    let mut source = SourcePose::at(SourceId::new(0, 1), position);
    source.orientation = orientation;
    source.settings.extent = extent;
    source
}

/// Point sources evenly spread over the wide one's ellipsoid, by heights and turns that fill a sphere of their own accord.
fn spread(wide: &SourcePose) -> Vec<SourcePose> {
    let points = (0..MANY).map(|index| {
        let fraction = |step: f64| ((index as f64 + 0.5) * step).fract();
        // Roberts' additive recurrence in two dimensions.
        let up = 2.0 * fraction(0.754_877_666_246_692_8) - 1.0;
        let turn = std::f64::consts::TAU * fraction(0.569_840_290_998_053_3);
        let across = (1.0 - up * up).sqrt();
        let unit = glam::DVec3::new(across * turn.cos(), up, across * turn.sin()).as_vec3();
        let offset = wide.orientation * (unit * wide.settings.extent.semi_axes_m);
        source(
            wide.position + offset,
            wide.orientation,
            SourceExtent::POINT,
        )
    });
    points.collect()
}

fn propagator(scene: &Arc<Scene>) -> Propagator {
    let settings = PropagationSettings {
        guide_rays: 256,
        depth: 2,
        diffraction_order: 0,
        ..PropagationSettings::default()
    };
    Propagator::new(Arc::clone(scene), settings).expect("settings")
}

/// A propagator that has the scene's late field: others share it.
fn with_field(scene: &Arc<Scene>, source: &SourcePose, ear: &ListenerPose) -> Propagator {
    let mut propagator = propagator(scene);
    propagator.update(ear, &[*source], 0.0, &mut PathSet::default());
    propagator
}

/// The last of so many updates for a source and a listener at rest.
fn update(first: &Propagator, source: &SourcePose, ear: &ListenerPose, updates: usize) -> PathSet {
    let mut propagator = propagator(first.scene());
    propagator.share_field(first);
    let mut set = PathSet::default();
    for number in 0..updates {
        propagator.update(ear, &[*source], 0.02 * number as f64, &mut set);
    }
    set
}

fn frame(
    first: &Propagator,
    source: &SourcePose,
    ear: &ListenerPose,
    predictor: PredictorKind,
) -> FramePaths {
    let mut extrapolator = Extrapolator::new(Arc::clone(first.scene()), predictor, 0.3);
    extrapolator.store_update(update(first, source, ear, 1), 4);
    let mut frame = FramePaths::default();
    extrapolator.frame(ear, &[*source], &mut frame);
    frame
}

fn reflections(frame: &FramePaths) -> impl Iterator<Item = &FramePath> {
    let is_reflected = |path: &&FramePath| path.kind == PathKind::Reflected && path.order <= 2;
    frame.paths.iter().filter(is_reflected)
}

fn db(ratio: f32) -> f32 {
    10.0 * ratio.log10()
}

/// Mean of directions by their shares, and the root mean square of their angles to it in degrees.
fn image(directions: &[(Vec3, f32)]) -> (Vec3, f32) {
    let total: f32 = directions.iter().map(|(_, share)| share).sum();
    let sum: Vec3 = directions
        .iter()
        .map(|(direction, share)| *direction * *share)
        .sum();
    let mean = sum.normalize();
    let square = |(direction, share): &(Vec3, f32)| share * mean.angle_between(*direction).powi(2);
    let squares: f32 = directions.iter().map(square).sum();
    (mean, (squares / total).sqrt().to_degrees())
}

/// A turned ellipsoid along a hall: the reflections to order 2 have the mean energy of many points, and those that are nearest
/// come from where the points' reflections come from.
#[test]
fn reflections_have_the_level_and_the_image_of_many_points() {
    let size = Vec3::new(36.0, 5.0, 14.0);
    let scene = room(size, "plaster");
    let middle = 0.5 * size;
    let extent = SourceExtent {
        semi_axes_m: Vec3::new(11.0, 0.3, 1.0),
        points: 16,
    };
    let at = middle + Vec3::new(1.0, -0.5, -1.5);
    let wide = source(at, Quat::from_rotation_y(0.2), extent);
    let ear = ListenerPose::facing(middle + Vec3::new(0.0, -1.0, 2.5), 0.0);
    let first = with_field(&scene, &wide, &ear);
    let mut all: BTreeMap<PathId, Vec<(Vec3, f32)>> = BTreeMap::new();
    for point in spread(&wide) {
        for path in reflections(&frame(&first, &point, &ear, PredictorKind::Hold)) {
            let energy = path.amplitude[BAND].powi(2);
            all.entry(path.id).or_default().push((path.arrival, energy));
        }
    }
    let of_centre = source(at, wide.orientation, SourceExtent::POINT);
    for predictor in PredictorKind::ALL {
        let wide = frame(&first, &wide, &ear, predictor);
        let centre = frame(&first, &of_centre, &ear, predictor);
        let (mut compared, mut images, mut without) = (0, 0, 0f32);
        for path in reflections(&wide) {
            let points = all.get(&path.id).filter(|points| points.len() == MANY);
            let Some(points) = points else {
                continue;
            };
            let mean = points.iter().map(|(_, energy)| energy).sum::<f32>() / MANY as f32;
            let error = db(path.amplitude[BAND].powi(2) / mean);
            let (name, order) = (predictor.name(), path.order);
            assert!(error.abs() < 0.5, "{name}, order {order}: {error:.2} dB");
            let same = centre.paths.iter().find(|own| own.id == path.id);
            let same = same.expect("the centre has it");
            without = without.max(db(same.amplitude[BAND].powi(2) / mean).abs());
            compared += 1;
            let Some(arrival) = wide.wide.iter().find(|wide| wide.id == path.id) else {
                continue;
            };
            let (exact, exact_width) = image(points);
            let (mean, width) = image(&arrival.iter().collect::<Vec<_>>());
            let apart = mean.angle_between(exact).to_degrees();
            println!(
                "{name}, order {order}: {error:.2} dB, {apart:.1}°, {width:.1}° of {exact_width:.1}°"
            );
            assert!(apart < 3.0, "{name}: {apart:.1}°");
            assert!(
                (width / exact_width - 1.0).abs() < 0.1,
                "{name}: {width:.1}° of {exact_width:.1}°"
            );
            assert!(exact_width > 5.0, "{name}: {exact_width:.1}°");
            images += 1;
        }
        println!("{compared} compared, {images} images, the centre's are {without:.2} dB off");
        assert!(compared >= 12 && images >= 3, "{compared} and {images}");
        // Otherwise the room would not tell a wide source from a point.
        assert!(without > 1.0, "{without:.2} dB");
    }
}

/// A source along a hall of absorbing walls: late energy falls along it, so the mean over points is far from the middle's.
#[test]
fn late_sound_has_the_level_of_many_points() {
    let size = Vec3::new(60.0, 8.0, 8.0);
    let scene = room(size, "carpet");
    let middle = 0.5 * size;
    let extent = SourceExtent {
        semi_axes_m: Vec3::new(26.0, 0.0, 0.0),
        points: 16,
    };
    let wide = source(middle, Quat::IDENTITY, extent);
    let ear = ListenerPose::facing(middle + Vec3::new(26.0, -1.3, 2.7), 0.0);
    let first = with_field(&scene, &wide, &ear);
    let late = |source: &SourcePose| update(&first, source, &ear, 20).late[0].total();
    let mut mean = [0.0; BANDS];
    for point in spread(&wide) {
        for (sum, energy) in mean.iter_mut().zip(late(&point)) {
            *sum += energy / MANY as f32;
        }
    }
    let of_wide = late(&wide);
    let of_centre = late(&source(middle, Quat::IDENTITY, SourceExtent::POINT));
    let errors =
        |late: [f32; BANDS]| -> [f32; BANDS] { std::array::from_fn(|b| db(late[b] / mean[b])) };
    let (wide, centre) = (errors(of_wide), errors(of_centre));
    println!("{wide:.2?} dB, the centre's {centre:.2?} dB");
    assert!(wide.iter().all(|error| error.abs() < 1.0), "{wide:.2?} dB");
    // Otherwise the hall would not tell a wide source from a point: in the treble walls absorb most.
    assert!(
        centre.iter().any(|error| error.abs() > 2.0),
        "{centre:.2?} dB"
    );
}
