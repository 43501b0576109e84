//! Law *reciprocity*: source and listener swapped, the same paths with the same amplitudes.

use glam::Vec3;

use super::Row;
use super::rooms::Probe;
use foresound::acoustics::BANDS;
use foresound::error::Result;
use foresound::propagation::diffraction::reflection_gain;
use foresound::propagation::endpoints::Endpoints;
use foresound::propagation::image_source::image_path::{is_clear, mirror_listener, unfold};
use foresound::propagation::image_source::sequence::Sequence;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::propagation::{PropagationSettings, ReflectionEdge, amplitude};
use foresound::scene::{MaterialTable, Scene, SceneSettings, SourcePose, procedural};
use std::sync::Arc;

/// Every path from source to listener is computed with both exchanged, in the scene with a door.
pub(super) fn rows() -> Result<Vec<Row>> {
    let doorway = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Arc::new(Scene::commit(
        &doorway.mesh,
        &table,
        &SceneSettings::default(),
    )?);
    let (mut missing, mut compared, mut worst) = (0u32, 0u32, 0f64);
    for pair in 0..16u64 {
        let jitter = |k: u64| unit(mix(pair << 4 | k)) - 0.5;
        let from = doorway.sources[pair as usize % doorway.sources.len()].1;
        let to = doorway.walk.standing + Vec3::new(jitter(0), 0.5 * jitter(1), jitter(2));
        let mut probe = Probe::new(&scene, from, PropagationSettings::default())?;
        probe.update(to);
        let (source, listener) = (scene.to_local(to), scene.to_local(from));
        for path in probe
            .set
            .paths
            .iter()
            .filter(|p| p.order > 0 && p.diffraction_order == 0)
        {
            compared += 1;
            let mut back: Vec<u32> = path.surfaces().to_vec();
            back.reverse();
            let sequence = Sequence::canonical(&scene, &back);
            let image = mirror_listener(&scene, &sequence, listener);
            let found = unfold(&scene, &sequence, source, listener, image)
                .filter(|p| is_clear(&scene, p, source, listener, &mut 0));
            let Some(found) = found else {
                missing += 1;
                continue;
            };
            let mut there = amplitude::reflected(&scene, &found, 0.3);
            if let [surface] = *path.surfaces() {
                let endpoints = Endpoints::of(&SourcePose::at(path.source, to), from, 0.3);
                let edges = probe.set.reflection_edges.iter();
                let reversed = edges.map(|(_, near)| ReflectionEdge {
                    surfaces: [near.surfaces[1], near.surfaces[0]],
                    ..*near
                });
                let gain = reflection_gain(&scene, &endpoints, surface, reversed);
                for (value, gain) in there.iter_mut().zip(gain.unwrap_or([1.0; BANDS])) {
                    *value *= gain;
                }
            }
            for b in 0..BANDS {
                let size = f64::from(path.amplitude[b].abs()).max(1e-6);
                worst = worst.max(f64::from((there[b] - path.amplitude[b]).abs()) / size);
            }
        }
    }
    let lost = 100.0 * f64::from(missing) / f64::from(compared.max(1));
    Ok(vec![
        Row::at_least(
            "reciprocity: paths compared",
            f64::from(compared),
            100.0,
            "paths",
        ),
        Row::at_most("reciprocity: paths missing in reverse", lost, 0.0, "%"),
        Row::at_most("reciprocity: amplitude", worst, 1e-5, "relative"),
    ])
}
