//! Reflection factors of finite panels: lower at low frequencies for small panels, and lower near edges.
//!
//! Source: \[RINDEL86\]. With `l` the length of a side as projected along the ray, a panel reflects all energy above the limit
//! frequency `c a* / (2 l²)` with `a* = 2 a₁ a₂ / (a₁ + a₂)`, and energy in proportion to frequency below it. The product of
//! both sides makes the amplitude of a small panel proportional to frequency, that of a long strip to its root. Own: towards
//! a free edge the amplitude falls smoothly to zero, and a path fades where the geometry would end it. An edge is free on the
//! side on which no other surface continues the wave.
//! A single reflection in a large wall is continued over the wall's edges by diffracted waves ([`crate::propagation::diffraction`]); of
//! reflections of second order and higher there are too many for that: they fade too, over at most the same distance and
//! within the first Fresnel zone. A diffracted wave leaves out the part of a reflection that fades.

use crate::acoustics::bands::CENTRES_HZ;
use crate::acoustics::{BANDS, BandArray, smoothstep};
use crate::propagation::image_source::image_path::ImagePath;
use crate::scene::Scene;

/// Width of the fade at a free edge: a fraction of the shorter side, and its limit in metres.
const FADE: (f64, f64) = (0.2, 0.3);

/// Least width of the fade at a large wall's edge in metres.
const LEAST_FADE_M: f64 = 0.02;

/// Amplitude factor of the finite panels of a path, 0 to 1 by band; `None` means 1.
pub fn factor(scene: &Scene, path: &ImagePath) -> Option<BandArray> {
    let has_panels = scene.has_finite_panels();
    let fades = path.order > 1 && scene.has_edges();
    if path.order == 0 || !(has_panels || fades) {
        return None;
    }
    let mut product: Option<BandArray> = None;
    // Distance along the path from the source to each point, from the last one back.
    let mut before_m = path.image.distance(path.points[path.order - 1]);
    for step in (0..path.order).rev() {
        let point = path.points[step];
        if step + 1 < path.order {
            before_m -= point.distance(path.points[step + 1]);
        }
        let after_m = (path.length_m - before_m).max(0.0);
        let apart_m = 2.0 * before_m.max(0.0) * after_m / path.length_m.max(1e-6);
        let surface = path.surfaces[step];
        let in_front = reflects_in_front(scene, path, step);
        let panel = match has_panels {
            true => scene.finite_panel_at(surface, point, in_front),
            false => None,
        };
        if let Some(panel) = panel {
            // A side's projected length is the same for the incident and the reflected ray.
            let ray = match step {
                _ if step + 1 < path.order => path.points[step + 1] - point,
                _ => point - path.image,
            };
            let ray = ray.normalize_or_zero();
            let limits_hz = panel.sides.map(|side| {
                let side = side.as_dvec3();
                let projected = side.length_squared() - side.dot(ray).powi(2);
                scene.speed_of_sound_m_s() * apart_m / (2.0 * projected.max(1e-9))
            });
            let shorter_m = f64::from(panel.sides[0].length().min(panel.sides[1].length()));
            let fade_m = (FADE.0 * shorter_m).min(FADE.1);
            let edge = smoothstep(panel.to_edge_m / fade_m);
            let factor = product.get_or_insert([1.0; BANDS]);
            for (value, hz) in factor.iter_mut().zip(CENTRES_HZ) {
                let energy = limits_hz.map(|limit_hz| (hz / limit_hz.max(1e-6)).min(1.0));
                *value *= (edge * (energy[0] * energy[1]).sqrt()) as f32;
            }
        } else if fades
            && let Some(to_edge_m) = scene.edge_distance_m(surface, point, in_front, FADE.1)
        {
            let cosine = path.cosines[step].max(1e-3);
            let factor = product.get_or_insert([1.0; BANDS]);
            for (value, hz) in factor.iter_mut().zip(CENTRES_HZ) {
                // Fresnel's parameter is 1 where the squared distance, projected along the path, is ¼ λ a*.
                let zone_m = (0.25 * apart_m * scene.speed_of_sound_m_s() / hz).sqrt() / cosine;
                *value *= smoothstep(to_edge_m / zone_m.clamp(LEAST_FADE_M, FADE.1)) as f32;
            }
        }
    }
    product
}

/// Whether reflection number `step` of a path is on the side of its surface's normal. Both legs are on one side.
fn reflects_in_front(scene: &Scene, path: &ImagePath, step: usize) -> bool {
    let plane = scene.surface(path.surfaces[step]);
    match step {
        // The image source of a first reflection is on the other side.
        0 if path.order == 1 => plane.distance_m(path.image) < 0.0,
        0 => plane.distance_m(path.points[1]) > 0.0,
        _ => plane.distance_m(path.points[step - 1]) > 0.0,
    }
}
