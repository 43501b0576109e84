//! Law *decay*: reverberation time in each band against Eyring in rooms whose field is diffuse.

use glam::Vec3;

use super::{Row, rooms};
use crate::acoustics::bands::CENTRES_HZ;
use crate::error::Result;
use crate::propagation::{PathSet, PropagationSettings, Propagator};
use crate::scene::{ListenerPose, SourceId, SourcePose};

/// Proportionate rooms with scattering of a half, after sixteen updates.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (size, absorption) in [([8.0, 6.0, 3.5], 0.1), ([30.0, 20.0, 12.0], 0.3)] {
        let [x, y, z] = size;
        let scene = rooms::uniform(Vec3::new(x, y, z), absorption, 0.5)?;
        let mut propagator = Propagator::new(scene.clone(), PropagationSettings::default())?;
        let pose = SourcePose {
            id: SourceId::new(0, 0),
            position: Vec3::new(0.3 * x, 0.4 * y, 0.4 * z),
        };
        let ear = ListenerPose::facing(Vec3::new(0.7 * x, 0.6 * y, 0.5 * z), 0.0);
        let mut set = PathSet::default();
        for _ in 0..16 {
            propagator.update(&ear, &[pose], 0.0, &mut set);
        }
        let (volume, surface) = (
            f64::from(x * y * z),
            f64::from(2.0 * (x * y + y * z + z * x)),
        );
        for b in 0..8 {
            let air = 8.0 * f64::from(scene.air_np_per_m()[b]) * volume;
            let sabines = -surface * f64::from(1.0 - absorption).ln() + air;
            let eyring_s =
                24.0 * std::f64::consts::LN_10 / scene.speed_of_sound_m_s() * volume / sabines;
            let told_s = f64::from(set.late[0].decay_time_s[b]);
            let law = format!("decay: {x} x {y} x {z} m at {:.0} Hz", CENTRES_HZ[b]);
            rows.push(Row::at_most(
                law,
                100.0 * (told_s / eyring_s - 1.0).abs(),
                10.0,
                "%",
            ));
        }
    }
    Ok(rows)
}
