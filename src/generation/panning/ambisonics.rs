//! Real spherical harmonics to order 3 in the order ACN with SN3D normalisation (\[NACHBAR11\], table 1).
//!
//! Arithmetic; control side.

use glam::Vec3;

/// Channels of order 3.
pub(crate) const MAX_CHANNELS: usize = 16;

/// The harmonics of a unit vector in head coordinates (+x right, +y up, −z ahead).
pub(crate) fn harmonics(direction: Vec3) -> [f32; MAX_CHANNELS] {
    // AmbiX: x ahead, y to the left, z up.
    let [x, y, z] = [-direction.z, -direction.x, direction.y].map(f64::from);
    let (root3, root15) = (3f64.sqrt(), 15f64.sqrt());
    let (root6, root10) = (6f64.sqrt(), 10f64.sqrt());
    [
        1.0,
        y,
        z,
        x,
        root3 * x * y,
        root3 * y * z,
        0.5 * (3.0 * z * z - 1.0),
        root3 * x * z,
        0.5 * root3 * (x * x - y * y),
        0.25 * root10 * y * (3.0 * x * x - y * y),
        root15 * x * y * z,
        0.25 * root6 * y * (5.0 * z * z - 1.0),
        0.5 * z * (5.0 * z * z - 3.0),
        0.25 * root6 * x * (5.0 * z * z - 1.0),
        0.5 * root15 * z * (x * x - y * y),
        0.25 * root10 * x * (x * x - 3.0 * y * y),
    ]
    .map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_order_has_unit_energy_in_every_direction() {
        // The addition theorem: the squares of order n sum to 1 in SN3D.
        for n in 0..200 {
            let turn = n as f32 * 0.37;
            let up = (n as f32 * 0.73).sin();
            let across = (1.0 - up * up).sqrt();
            let found = harmonics(Vec3::new(across * turn.sin(), up, across * turn.cos()));
            for order in 0..4 {
                let sum: f32 = found[order * order..(order + 1) * (order + 1)]
                    .iter()
                    .map(|value| value * value)
                    .sum();
                assert!((sum - 1.0).abs() < 1e-5, "{n}, order {order}: {sum}");
            }
        }
    }

    #[test]
    fn first_order_points_left_up_and_ahead() {
        for (direction, channel) in [(Vec3::NEG_X, 1), (Vec3::Y, 2), (Vec3::NEG_Z, 3)] {
            let found = harmonics(direction);
            assert_eq!((found[0], found[channel]), (1.0, 1.0), "{direction}");
        }
    }

    #[test]
    fn harmonics_are_orthogonal() {
        // Means of products over 4,000 points of a spiral; the quadrature's error falls with their number.
        let points = 4000;
        let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
        let mut sums = [[0.0f64; MAX_CHANNELS]; MAX_CHANNELS];
        for n in 0..points {
            let up = 1.0 - (2 * n + 1) as f32 / points as f32;
            let (sin, cos) = (golden * n as f32).sin_cos();
            let across = (1.0 - up * up).sqrt();
            let found = harmonics(Vec3::new(across * sin, up, across * cos));
            for (row, a) in sums.iter_mut().zip(found) {
                for (sum, b) in row.iter_mut().zip(found) {
                    *sum += f64::from(a * b) / f64::from(points);
                }
            }
        }
        for (a, row) in sums.iter().enumerate() {
            let order = (0..4).find(|order| a < (order + 1) * (order + 1)).unwrap();
            for (b, sum) in row.iter().enumerate() {
                let expected = if a == b {
                    1.0 / (2 * order + 1) as f64
                } else {
                    0.0
                };
                assert!((sum - expected).abs() < 2e-3, "{a} {b}: {sum}");
            }
        }
    }
}
