//! Law *joining*: discrete paths and late reverb together have the energy of the whole response, in each span of time.
//!
//! The exact response comes from image sources of all orders that arrive in time and, for scattered energy, from
//! particles: both in `f64` and independent of the library.

#[path = "oracles/particles.rs"]
#[expect(unreachable_pub, reason = "the oracle is a file of the tests")]
mod particles;

use glam::Vec3;

use super::shoebox::oracle as shoebox;
use super::{Row, rooms};
use foresound::acoustics::{BANDS, Material};
use foresound::error::Result;
use foresound::propagation::diffuse::late_segments;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{ListenerPose, SourceId, SourcePose};

/// Width of the windows that energy is counted in, in seconds.
pub const WINDOW_S: f64 = 0.04;

/// Number of windows; all of them are the total.
pub const WINDOWS: usize = 16;

/// Particles of the oracle: some 10,000 fly through the ball, 1 % of a window's energy.
const PARTICLES: u32 = 50_000;

/// Windows with a bound: 0 to 80 ms, 80 to 160 ms, 160 to 320 ms after emission.
const SPANS: [(usize, usize); 3] = [(0, 2), (2, 4), (4, 8)];

/// Level below the loudest window at which a window no longer belongs to the join, an energy ratio: 30 dB.
const JOIN_RANGE: f64 = 1e-3;

/// Energy in each window and band.
pub type Response = Vec<[f64; BANDS]>;

/// One room's response, ours and the exact one.
#[derive(Debug, Clone)]
pub struct Case {
    /// Size and scattering.
    pub name: String,
    /// Discrete paths.
    pub paths: Response,
    /// The late reverb.
    pub late: Response,
    /// The exact response, from the oracle.
    pub exact: Response,
    /// Bound of a window's level.
    bound_db: f64,
}

/// Rooms of two sizes, three scattering coefficients.
///
/// # Errors
/// Those of committing a scene.
pub fn cases() -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for size in [[8.0, 6.0, 3.5], [30.0, 20.0, 12.0]] {
        for scattering in [0.0, 0.3, 0.6] {
            cases.push(measure(size, scattering)?);
        }
    }
    Ok(cases)
}

/// Every bound of every room.
pub(super) fn rows() -> Result<Vec<Row>> {
    Ok(cases()?.iter().flat_map(Case::rows).collect())
}

/// Computes one room's response by propagation and by the oracle.
///
/// # Errors
/// Those of committing a scene.
pub fn measure(size: [f64; 3], scattering: f32) -> Result<Case> {
    let wall = Material {
        name: "wall".to_owned(),
        absorption: [0.05, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.35],
        scattering: [scattering; BANDS],
        transmission: [0.0; BANDS],
    };
    let scene = rooms::six_walls(
        Vec3::from(size.map(|s| s as f32)),
        std::array::from_fn(|w| Material {
            name: format!("wall{w}"),
            ..wall.clone()
        }),
    )?;
    let position = |share: [f64; 3]| std::array::from_fn::<f64, 3, _>(|a| share[a] * size[a]);
    let (source, listener) = (position([0.3, 0.4, 0.4]), position([0.68, 0.61, 0.55]));
    let narrow = |p: [f64; 3]| Vec3::from(p.map(|v| v as f32));
    let pose = SourcePose::at(SourceId::new(0, 0), narrow(source));
    let ear = ListenerPose::facing(narrow(listener), 0.0);
    let mut propagator = Propagator::new(scene.clone(), PropagationSettings::default())?;
    propagator.warm_up(&ear, &[pose]);
    let mut set = PathSet::default();
    propagator.update(&ear, &[pose], 0.0, &mut set);

    let speed_m_s = scene.speed_of_sound_m_s();
    let room = shoebox::Room {
        size,
        absorption: [wall.absorption.map(f64::from); 6],
        scattering: [wall.scattering.map(f64::from); 6],
        air_np_per_m: scene.air_np_per_m().map(f64::from),
    };
    let window_m = WINDOW_S * speed_m_s;
    let ball_m = 0.12 * (size[0] * size[1] * size[2]).cbrt();
    let mut exact = match scattering > 0.0 {
        true => particles::scattered(
            &room, source, listener, ball_m, window_m, WINDOWS, PARTICLES,
        ),
        false => vec![[0.0; BANDS]; WINDOWS],
    };
    for image in shoebox::images_within(&room, source, listener, window_m * WINDOWS as f64) {
        add(&mut exact, image.length_m / window_m, image.amplitude);
    }
    let mut paths = vec![[0.0; BANDS]; WINDOWS];
    for path in &set.paths {
        let amplitude = path.amplitude.map(f64::from);
        add(&mut paths, f64::from(path.length_m) / window_m, amplitude);
    }
    Ok(Case {
        name: format!(
            "{} x {} x {} m, scattering {scattering}",
            size[0], size[1], size[2]
        ),
        paths,
        late: late(&set),
        exact,
        // Without scattering a rectangular room's decay is not exponential.
        bound_db: if scattering > 0.0 { 2.0 } else { 3.0 },
    })
}

fn add(response: &mut [[f64; BANDS]], window: f64, amplitude: [f64; BANDS]) {
    if let Some(sum) = response.get_mut(window as usize) {
        for (sum, amplitude) in sum.iter_mut().zip(amplitude) {
            *sum += amplitude * amplitude;
        }
    }
}

/// Energy of the late reverb in each window.
fn late(set: &PathSet) -> Response {
    let mut response = vec![[0.0; BANDS]; WINDOWS];
    for field in &set.late {
        for segment in late_segments(field, &set.late_groups) {
            let decay_time_s = &set.late_groups[usize::from(segment.group)].decay_time_s;
            let start_s = f64::from(segment.start_s);
            for (window, sum) in response.iter_mut().enumerate() {
                let from_s = start_s.max(window as f64 * WINDOW_S);
                let to_s = start_s.max((window + 1) as f64 * WINDOW_S);
                for b in 0..BANDS {
                    let energy = f64::from(segment.energy_per_s[b]);
                    sum[b] += rooms::decayed(energy, decay_time_s[b], from_s, to_s);
                }
            }
        }
    }
    response
}

impl Case {
    /// Level of our energy over the exact one in a span of windows and a band, in dB.
    pub fn excess_db(&self, from: usize, to: usize, band: usize) -> f64 {
        let sum = |response: &Response| response[from..to].iter().map(|e| e[band]).sum::<f64>();
        let ours = sum(&self.paths) + sum(&self.late);
        10.0 * (ours / sum(&self.exact)).log10()
    }

    fn rows(&self) -> Vec<Row> {
        let worst = |from: usize, to: usize| {
            (0..BANDS)
                .map(|b| self.excess_db(from, to, b).abs())
                .fold(0.0, f64::max)
        };
        let mut case = super::Case::new(format!("joining: {}", self.name));
        case.at_most("total energy", worst(0, WINDOWS), 1.0, "dB");
        for (from, to) in SPANS {
            let ms = |window: usize| (1000.0 * window as f64 * WINDOW_S).round();
            let what = format!("{} to {} ms", ms(from), ms(to));
            case.at_most(&what, worst(from, to), self.bound_db, "dB");
        }
        let mut dip: f64 = 0.0;
        for b in 0..BANDS {
            let loudest = self.exact.iter().map(|e| e[b]).fold(0.0, f64::max);
            for window in 0..WINDOWS {
                if self.exact[window][b] > JOIN_RANGE * loudest {
                    dip = dip.max(-self.excess_db(window, window + 1, b));
                }
            }
        }
        case.at_most("deepest gap", dip, 3.0, "dB");
        case.rows
    }
}
