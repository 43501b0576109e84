//! Oracle: all images of a source in a rectangular room, in closed form and `f64`.
//!
//! Written from \[ALLEN79\] and the material model's definition alone; shares no code with the crate, so that both can
//! only agree by being right. Room from (0, 0, 0) to `size`; walls in the order x = 0, x = L, y = 0, y = L, z = 0, z = L.

/// Eight bands.
pub type Bands = [f64; 8];

/// One image and its path.
#[derive(Debug, Clone)]
pub struct Image {
    /// Position of the mirrored source.
    pub position: [f64; 3],
    /// How often each wall reflects.
    pub wall_counts: [u32; 6],
    /// Number of reflections.
    pub order: u32,
    /// Length of the path in metres.
    pub length_m: f64,
    /// Signed amplitude re free field at 1 m.
    pub amplitude: Bands,
}

/// A room.
#[derive(Debug, Clone)]
pub struct Room {
    /// Size in metres.
    pub size: [f64; 3],
    /// Random-incidence absorption of each wall in each band.
    pub absorption: [Bands; 6],
    /// Scattering of each wall in each band.
    pub scattering: [Bands; 6],
    /// Air in Np/m, in each band.
    pub air_np_per_m: Bands,
}

/// All images to `max_order`, 129 for order 4.
pub fn images(room: &Room, source: [f64; 3], listener: [f64; 3], max_order: u32) -> Vec<Image> {
    let n = max_order as i32;
    let walls = impedances(room);
    let mut result = Vec::new();
    for i in -n..=n {
        for j in -n..=n {
            for k in -n..=n {
                let order = i.unsigned_abs() + j.unsigned_abs() + k.unsigned_abs();
                if order <= max_order {
                    result.push(image(room, &walls, source, listener, [i, j, k]));
                }
            }
        }
    }
    result
}

/// All images, of any order, with a path shorter than `radius_m`.
pub fn images_within(
    room: &Room,
    source: [f64; 3],
    listener: [f64; 3],
    radius_m: f64,
) -> Vec<Image> {
    let walls = impedances(room);
    let most = [0, 1, 2].map(|a| (radius_m / room.size[a]).ceil() as i32 + 1);
    let mut result = Vec::new();
    for i in -most[0]..=most[0] {
        for j in -most[1]..=most[1] {
            for k in -most[2]..=most[2] {
                // The nearest that an image of this cell can be.
                let cells = [i, j, k].map(|n: i32| f64::from((n.abs() - 1).max(0)));
                let square: f64 = (0..3).map(|a| (cells[a] * room.size[a]).powi(2)).sum();
                if square < radius_m * radius_m {
                    let image = image(room, &walls, source, listener, [i, j, k]);
                    if image.length_m < radius_m {
                        result.push(image);
                    }
                }
            }
        }
    }
    result
}

/// Specific impedance of each wall in each band.
pub fn impedances(room: &Room) -> [Bands; 6] {
    room.absorption.map(|wall| wall.map(impedance))
}

fn image(
    room: &Room,
    walls: &[Bands; 6],
    source: [f64; 3],
    listener: [f64; 3],
    cell: [i32; 3],
) -> Image {
    let mut position = [0.0; 3];
    let mut wall_counts = [0; 6];
    for axis in 0..3 {
        let n = cell[axis];
        let length = room.size[axis];
        // Every other cell is mirrored.
        let inside = if n.rem_euclid(2) == 0 {
            source[axis]
        } else {
            length - source[axis]
        };
        position[axis] = f64::from(n) * length + inside;
        // The straight line crosses |n| walls, which alternate; the far one comes first in the positive direction.
        let (first, second) = (n.unsigned_abs().div_ceil(2), n.unsigned_abs() / 2);
        let (low, high) = if n > 0 {
            (second, first)
        } else {
            (first, second)
        };
        wall_counts[2 * axis] = low;
        wall_counts[2 * axis + 1] = high;
    }
    let delta: Vec<f64> = (0..3).map(|a| position[a] - listener[a]).collect();
    let length_m = delta.iter().map(|d| d * d).sum::<f64>().sqrt();
    let mut amplitude = [0.0; 8];
    for (band, value) in amplitude.iter_mut().enumerate() {
        *value = (-room.air_np_per_m[band] * length_m).exp() / length_m;
        for wall in 0..6 {
            let cosine = delta[wall / 2].abs() / length_m;
            let factor =
                reflection(walls[wall][band], cosine) * (1.0 - room.scattering[wall][band]).sqrt();
            *value *= factor.powi(wall_counts[wall] as i32);
        }
    }
    Image {
        position,
        wall_counts,
        order: cell.iter().map(|c| c.unsigned_abs()).sum(),
        length_m,
        amplitude,
    }
}

/// Pressure reflection factor of a locally reacting wall of a specific impedance.
pub fn reflection(impedance: f64, cosine: f64) -> f64 {
    let z = impedance * cosine;
    (z - 1.0) / (z + 1.0)
}

/// Root of Paris' formula above its maximum, by bisection in log ζ.
fn impedance(absorption: f64) -> f64 {
    let paris = |z: f64| 8.0 / (z * z) * (1.0 + z - 1.0 / (1.0 + z) - 2.0 * (1.0 + z).ln());
    let (mut low, mut high) = (1.6f64.ln(), 1e6f64.ln());
    for _ in 0..200 {
        let middle = (low + high) / 2.0;
        if paris(middle.exp()) > absorption {
            low = middle;
        } else {
            high = middle;
        }
    }
    low.exp()
}
