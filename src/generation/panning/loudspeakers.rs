//! Amplitude panning: gains of loudspeakers for a direction.
//!
//! Arithmetic; control side.
//!
//! Layouts of loudspeakers around the listener: vector base amplitude panning (\[PULKKI97\]) over the triangles of their convex
//! hull. Where a hull has faces of more than three loudspeakers, all triangles that hold the direction count alike: gains
//! stay symmetric and continuous. Directions without a loudspeaker, above and below, have an imaginary one (\[ZOTTER12\]),
//! whose energy all loudspeakers next to it share equally: height is folded where it is missing.
//!
//! Stereo for loudspeakers in front of the listener: energy by the sine of the angle to the side (own law), so that front,
//! back and height fold into the pair without a step.

use std::f32::consts::FRAC_PI_2;

use glam::{Mat3, Vec3};

use crate::generation::panning::layout::Layout;

/// Most loudspeakers, imaginary ones included.
const MAX_CORNERS: usize = 14;

/// Least share of a loudspeaker of a triangle that still holds a direction: rounding.
const LEAST_SHARE: f32 = -1e-4;

/// Left and right gains with squares that sum to one.
pub(crate) fn stereo(direction: Vec3) -> [f32; 2] {
    let right = direction.x.clamp(-1.0, 1.0);
    let (sin, cos) = (0.5 * FRAC_PI_2 * (1.0 + (FRAC_PI_2 * right).sin())).sin_cos();
    [cos, sin]
}

/// The loudspeakers of a layout and their triangles.
#[derive(Debug)]
pub(crate) struct Loudspeakers {
    /// Real loudspeakers first.
    corners: Vec<Corner>,
    triangles: Vec<Triangle>,
}

#[derive(Debug)]
struct Corner {
    direction: Vec3,
    /// The channel, or none of an imaginary loudspeaker.
    channel: Option<usize>,
}

#[derive(Debug)]
struct Triangle {
    corners: [usize; 3],
    /// From a direction to the shares of the corners.
    shares: Mat3,
}

impl Loudspeakers {
    /// The loudspeakers of a layout around the listener; none of others.
    pub(crate) fn of(layout: Layout) -> Option<Self> {
        // Azimuth to the left and elevation in degrees, and channel.
        let front = [(30.0, 0.0, 0), (-30.0, 0.0, 1), (0.0, 0.0, 2)];
        let sides: &[(f32, f32, usize)] = match layout {
            Layout::Surround51 => &[(110.0, 0.0, 4), (-110.0, 0.0, 5)],
            Layout::Surround71 | Layout::Surround714 => &[
                (135.0, 0.0, 4),
                (-135.0, 0.0, 5),
                (90.0, 0.0, 6),
                (-90.0, 0.0, 7),
            ],
            _ => return None,
        };
        let top: &[(f32, f32, usize)] = match layout {
            Layout::Surround714 => &[
                (45.0, 30.0, 8),
                (-45.0, 30.0, 9),
                (135.0, 30.0, 10),
                (-135.0, 30.0, 11),
            ],
            _ => &[],
        };
        let real = front.iter().chain(sides).chain(top);
        let mut corners: Vec<Corner> = real
            .map(|&(azimuth, elevation, channel)| Corner {
                direction: towards(azimuth, elevation),
                channel: Some(channel),
            })
            .collect();
        for direction in [Vec3::Y, Vec3::NEG_Y] {
            corners.push(Corner {
                direction,
                channel: None,
            });
        }
        let triangles = hull(&corners);
        Some(Self { corners, triangles })
    }

    /// Adds the gains of a unit vector to the channels; their squares sum to one.
    pub(crate) fn pan(&self, direction: Vec3, gains: &mut [f32]) {
        let mut energies = [0.0f32; MAX_CORNERS];
        for triangle in &self.triangles {
            let shares = triangle.shares * direction;
            if shares.min_element() < LEAST_SHARE {
                continue;
            }
            let shares = shares.max(Vec3::ZERO).normalize_or_zero();
            for (corner, share) in triangle.corners.into_iter().zip(shares.to_array()) {
                energies[corner] += share * share;
            }
        }
        let imaginary = self
            .corners
            .iter()
            .enumerate()
            .filter(|(_, corner)| corner.channel.is_none());
        for (index, _) in imaginary {
            let neighbours = self.neighbours(index);
            let share = energies[index] / neighbours.len().max(1) as f32;
            for neighbour in neighbours {
                energies[neighbour] += share;
            }
            energies[index] = 0.0;
        }
        let sum: f32 = energies.iter().sum();
        for (corner, energy) in self.corners.iter().zip(energies) {
            if let Some(gain) = corner.channel.and_then(|channel| gains.get_mut(channel)) {
                *gain += (energy / sum.max(f32::MIN_POSITIVE)).sqrt();
            }
        }
    }

    /// Real loudspeakers that share a triangle with a corner.
    fn neighbours(&self, corner: usize) -> Vec<usize> {
        let near = self
            .triangles
            .iter()
            .filter(|t| t.corners.contains(&corner));
        let mut all: Vec<usize> = near.flat_map(|triangle| triangle.corners).collect();
        all.sort_unstable();
        all.dedup();
        all.retain(|&other| self.corners[other].channel.is_some());
        all
    }
}

/// A unit vector in head coordinates from degrees to the left and up.
fn towards(azimuth: f32, elevation: f32) -> Vec3 {
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    let across = elevation.cos();
    Vec3::new(
        -across * azimuth.sin(),
        elevation.sin(),
        -across * azimuth.cos(),
    )
}

/// Triangles with all corners on one side of their planes or in them.
fn hull(corners: &[Corner]) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    let count = corners.len();
    for a in 0..count {
        for b in a + 1..count {
            for c in b + 1..count {
                let [p, q, r] = [a, b, c].map(|index| corners[index].direction);
                let normal = (q - p).cross(r - p);
                let base = Mat3::from_cols(p, q, r);
                // Triangles in a plane with the listener hold no directions.
                if normal.length() < 1e-4 || base.determinant().abs() < 1e-3 {
                    continue;
                }
                let height = |corner: &Corner| normal.normalize().dot(corner.direction - p);
                let above = corners.iter().any(|corner| height(corner) > 1e-4);
                let below = corners.iter().any(|corner| height(corner) < -1e-4);
                if above && below {
                    continue;
                }
                triangles.push(Triangle {
                    corners: [a, b, c],
                    shares: base.inverse(),
                });
            }
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUTS: [Layout; 3] = [Layout::Surround51, Layout::Surround71, Layout::Surround714];

    fn gains(layout: Layout, direction: Vec3) -> [f32; 12] {
        let mut gains = [0.0; 12];
        Loudspeakers::of(layout).unwrap().pan(direction, &mut gains);
        gains
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..1000).map(|n| {
            let up = 1.0 - (2 * n + 1) as f32 / 1000.0;
            let across = (1.0 - up * up).sqrt();
            let (sin, cos) = (2.399_963_2 * n as f32).sin_cos();
            Vec3::new(across * cos, up, across * sin)
        })
    }

    #[test]
    fn energy_is_one_in_every_direction_and_the_lfe_is_silent() {
        for layout in LAYOUTS {
            for direction in directions() {
                let gains = gains(layout, direction);
                let sum: f32 = gains.iter().map(|gain| gain * gain).sum();
                assert!((sum - 1.0).abs() < 1e-4, "{layout} {direction}: {sum}");
                assert_eq!(gains[3], 0.0);
                let below = &gains[layout.channels().min(12)..];
                assert!(below.iter().all(|&gain| gain == 0.0));
            }
        }
        for direction in directions() {
            let [left, right] = stereo(direction);
            assert!((left * left + right * right - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn a_source_at_a_loudspeaker_sounds_from_it_alone() {
        for layout in LAYOUTS {
            let loudspeakers = Loudspeakers::of(layout).unwrap();
            for corner in &loudspeakers.corners {
                let Some(channel) = corner.channel else {
                    continue;
                };
                let gains = gains(layout, corner.direction);
                assert!(gains[channel] > 0.9999, "{layout} {channel}: {gains:?}");
            }
        }
        assert!(stereo(Vec3::NEG_X)[0] > 0.9999);
    }

    #[test]
    fn mirrored_directions_have_mirrored_gains() {
        let mirrored = [1, 0, 2, 3, 5, 4, 7, 6, 9, 8, 11, 10];
        for layout in LAYOUTS {
            for direction in directions() {
                let left = gains(layout, direction);
                let right = gains(layout, direction * Vec3::new(-1.0, 1.0, 1.0));
                for (channel, other) in mirrored.into_iter().enumerate() {
                    assert!(
                        (left[channel] - right[other]).abs() < 2e-3,
                        "{layout} {direction}"
                    );
                }
            }
        }
    }

    /// The vector of energies points to the source wherever real loudspeakers surround it (\[PULKKI97\]: within some degrees).
    #[test]
    fn the_energy_vector_points_at_sources_between_loudspeakers() {
        for layout in LAYOUTS {
            let loudspeakers = Loudspeakers::of(layout).unwrap();
            for turn in 0..72 {
                let direction = towards(5.0 * turn as f32, 0.0);
                let gains = gains(layout, direction);
                let real = loudspeakers.corners.iter();
                let vector: Vec3 = real
                    .filter_map(|c| Some(gains[c.channel?].powi(2) * c.direction))
                    .sum();
                // Gains by the tangents t of direction over half the gap give a vector at 2 t / (1 + t²): in the widest gap,
                // 140 degrees behind 5.1, it is off by at most 17.4 degrees.
                let off = vector.angle_between(direction).to_degrees();
                assert!(off < 18.0, "{layout} {turn}: {off}");
            }
        }
    }

    #[test]
    fn gains_are_continuous() {
        for layout in LAYOUTS {
            let loudspeakers = Loudspeakers::of(layout).unwrap();
            for tilt in [-80, -30, 0, 15, 30, 60, 89] {
                let mut last: Option<[f32; 12]> = None;
                for step in 0..=3600 {
                    let mut gains = [0.0; 12];
                    let direction = towards(0.1 * step as f32, tilt as f32);
                    loudspeakers.pan(direction, &mut gains);
                    if let Some(last) = last {
                        for (now, before) in gains.iter().zip(last) {
                            // Gains rise from zero like a line of the angle; folded energies like its root.
                            assert!((now - before).abs() < 0.08, "{layout} {tilt} {step}");
                        }
                    }
                    last = Some(gains);
                }
            }
        }
    }
}
