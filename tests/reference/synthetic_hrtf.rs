//! A spherical head in the baked format: Woodworth's delay ([WOODWORTH54]) and Brown and Duda's head shadow ([BROWN98]),
//! no pinna.

/// Radius of the head over the speed of sound, in seconds: 87.5 mm and 343.4 m/s.
const RADIUS_S: f64 = 0.0875 / 343.4;
const TAPS: usize = 128;
const COMPONENTS: usize = 16;
const AZIMUTHS: usize = 72;
const ELEVATIONS: usize = 37;

/// A baked file for one sample rate. Component 0 is a unit impulse, component 1 a one-pole low-pass, the rest silent.
#[allow(unreachable_pub, reason = "shared by tests, bench and unit tests")]
pub fn bytes(rate_hz: u32) -> Vec<u8> {
    let mut file = b"FSHRTF1\0".to_vec();
    for value in [
        rate_hz,
        TAPS as u32,
        COMPONENTS as u32,
        AZIMUTHS as u32,
        ELEVATIONS as u32,
    ] {
        file.extend(value.to_le_bytes());
    }
    // Corner of the head shadow: c / r in rad/s, doubled as Brown and Duda have it.
    let pole = (-2.0 / (RADIUS_S * f64::from(rate_hz))).exp();
    for component in 0..COMPONENTS {
        for tap in 0..TAPS {
            let value = match component {
                0 => f64::from(u8::from(tap == 0)),
                1 => (1.0 - pole) * pole.powi(tap as i32),
                _ => 0.0,
            };
            file.extend((value as f32).to_le_bytes());
        }
    }
    for e in 0..ELEVATIONS {
        let elevation = (5.0 * e as f64 - 90.0).to_radians();
        for a in 0..AZIMUTHS {
            let azimuth = (5.0 * a as f64).to_radians();
            // Head coordinates: left is −x.
            let left = elevation.cos() * azimuth.sin();
            for ear in [1.0, -1.0] {
                let angle = (left * ear).clamp(-1.0, 1.0).acos();
                let delay_s = RADIUS_S
                    * (1.0
                        + if angle < std::f64::consts::FRAC_PI_2 {
                            -angle.cos()
                        } else {
                            angle - std::f64::consts::FRAC_PI_2
                        });
                let shadow = 1.05 + 0.95 * (angle * 180.0 / 150.0).cos();
                file.extend((delay_s as f32).to_le_bytes());
                for component in 0..COMPONENTS {
                    let weight = match component {
                        0 => shadow,
                        1 => 1.0 - shadow,
                        _ => 0.0,
                    };
                    file.extend((weight as f32).to_le_bytes());
                }
            }
        }
    }
    file
}
