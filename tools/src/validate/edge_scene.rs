//! The law *edge* on whole scenes with a thin screen and a corner: a listener moves through the shadow boundary, source
//! and listener are exchanged.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{Row, rooms, wedge as oracle};
use foresound::acoustics::BANDS;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;
use foresound::propagation::diffraction::complex::Complex;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{ListenerPose, Scene, SourceId, SourcePose, TriangleMesh};

/// Half the length of the edges in metres; their ends and other edges are too far to matter.
const HALF_LENGTH_M: f32 = 60.0;

/// Distances of source and listener from the edge in metres, and the source's angle from the shadowing face.
const RADIUS_M: f64 = 5.0;

/// Tones of an octave.
const TONES: usize = 12;

/// A scene around the z axis, and its parameters for the exact solution.
pub(crate) struct EdgeScene {
    pub(crate) scene: Arc<Scene>,
    pub(crate) n: f64,
    /// Angle of the source from the first face, in radians.
    incoming: f64,
    propagator: Propagator,
    set: PathSet,
}

impl EdgeScene {
    /// A screen downwards from the axis (n = 2), or a right-angled corner of rock at x > 0, y < 0 (n = 1.5).
    pub(crate) fn new(n: f64, incoming: f64) -> Result<Self> {
        let mut mesh = TriangleMesh::default();
        let material = mesh.material("rigid");
        let mut face = |tangent: Vec3| {
            let first = mesh.vertices.len() as u32;
            let along = Vec3::Z * HALF_LENGTH_M;
            let across = tangent * HALF_LENGTH_M;
            mesh.vertices
                .extend([-along, along, along + across, across - along]);
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.triangles.push([first, first + 2, first + 3]);
            mesh.triangle_materials.extend([material; 2]);
        };
        face(Vec3::X);
        if n < 2.0 {
            let angle = n * PI;
            face(Vec3::new(angle.cos() as f32, angle.sin() as f32, 0.0));
        }
        let scene = rooms::commit(&mesh, vec![rooms::even("rigid", 0.0, 0.0)])?;
        let settings = PropagationSettings {
            guide_rays: 256,
            source_rays: 8,
            depth: 1,
            ..PropagationSettings::default()
        };
        Ok(Self {
            propagator: Propagator::new(Arc::clone(&scene), settings)?,
            scene,
            n,
            incoming,
            set: PathSet::default(),
        })
    }

    fn position(angle: f64) -> Vec3 {
        (DVec3::new(angle.cos(), angle.sin(), 0.0) * RADIUS_M).as_vec3()
    }

    /// The exact solution's wedge for a listener at an angle in radians.
    pub(crate) fn wedge(&self, outgoing: f64) -> oracle::Wedge {
        oracle::Wedge {
            n: self.n,
            radii_m: [RADIUS_M; 2],
            angles: [self.incoming, outgoing],
            along_m: 0.0,
        }
    }

    /// Wavenumber of a band's centre in rad/m.
    pub(crate) fn wavenumber(&self, band: usize) -> f64 {
        2.0 * PI * CENTRES_HZ[band] / self.scene.speed_of_sound_m_s()
    }

    /// Amplitude of a steady tone at the centre of each band: the sum of all paths to a listener at an angle, without air.
    pub(crate) fn level(&mut self, outgoing: f64, swapped: bool) -> [f64; BANDS] {
        self.listen(outgoing, swapped);
        std::array::from_fn(|b| self.tone(b, self.wavenumber(b)))
    }

    /// Computes the paths to a listener at an angle.
    fn listen(&mut self, outgoing: f64, swapped: bool) {
        let mut ends = [Self::position(self.incoming), Self::position(outgoing)];
        if swapped {
            ends.reverse();
        }
        let pose = SourcePose::at(SourceId::default(), ends[0]);
        let ear = ListenerPose::facing(ends[1], 0.0);
        self.propagator.update(&ear, &[pose], 0.0, &mut self.set);
    }

    /// Amplitude of the sum of all paths at a wavenumber, with the amplitudes of a band, without air.
    fn tone(&self, band: usize, wavenumber: f64) -> f64 {
        let mut sum = Complex::ZERO;
        for path in &self.set.paths {
            let length_m = f64::from(path.length_m);
            let dry = (f64::from(self.scene.air_np_per_m()[band]) * length_m).exp();
            let amplitude = f64::from(path.amplitude[band]) * dry;
            sum += Complex::cis(-wavenumber * length_m) * amplitude;
        }
        sum.abs()
    }

    /// The exact level in each band: direct, reflected and diffracted waves.
    pub(crate) fn exact(&self, outgoing: f64) -> [f64; BANDS] {
        let wavenumbers = std::array::from_fn(|band| self.wavenumber(band));
        let wedge = self.wedge(outgoing);
        wedge.total::<BANDS>(wavenumbers).map(oracle::size)
    }
}

pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let degree = f64::to_radians(1.0);
    for (name, n, incoming) in [("screen", 2.0, 0.5 * PI), ("corner", 1.5, 0.25 * PI)] {
        let mut scene = EdgeScene::new(n, incoming)?;
        let boundary = incoming + PI;
        // Steps of 0.01° through the boundary; none is on it, where visibility is undefined.
        let (mut off_db, mut jump_db) = (0f64, 0f64);
        let mut before: Option<[f64; BANDS]> = None;
        for step in -50..=50 {
            let outgoing = boundary + (0.01 * f64::from(step) + 0.003) * degree;
            let (level, exact) = (scene.level(outgoing, false), scene.exact(outgoing));
            let ratio: [f64; BANDS] = std::array::from_fn(|b| level[b] / exact[b]);
            for b in 0..BANDS {
                off_db = off_db.max(decibels(ratio[b]));
                if let Some(before) = before {
                    jump_db = jump_db.max(decibels(ratio[b] / before[b]));
                }
            }
            before = Some(ratio);
        }
        let lit_db = lit_side_db(&mut scene, boundary);
        let mut case = super::Case::new(format!("edge: {name}"));
        case.at_most("octaves, 2 to 60° before the boundary", lit_db, 0.5, "dB");
        case.at_most("within 0.5° of the boundary", off_db, 0.3, "dB");
        case.at_most("step through the boundary", jump_db, 0.3, "dB");
        // Deep in the shadow, and with source and listener exchanged.
        let (mut deep, mut deep_low, mut swap_db) = (0f64, 0f64, 0f64);
        for depth in 1..=11 {
            let outgoing = boundary + 4.0 * f64::from(depth) * degree - 0.02;
            if outgoing > n * PI {
                break;
            }
            let (level, back) = (scene.level(outgoing, false), scene.level(outgoing, true));
            let exact = scene.exact(outgoing);
            for b in 0..BANDS {
                let error = decibels(level[b] / exact[b]);
                if b == 0 {
                    deep_low = deep_low.max(error);
                } else {
                    deep = deep.max(error);
                }
                swap_db = swap_db.max(decibels(level[b] / back[b]));
            }
        }
        case.at_most("in the shadow, from 125 Hz", deep, 0.2, "dB");
        case.at_most("in the shadow, 63 Hz", deep_low, 0.5, "dB");
        case.at_most("source and listener exchanged", swap_db, 1e-4, "dB");
        rows.extend(case.rows);
    }
    Ok(rows)
}

/// Worst deviation in an octave's energy on the lit side, where direct and diffracted wave differ in length, and real
/// amplitudes cannot show the diffracted wave's phase.
fn lit_side_db(scene: &mut EdgeScene, boundary: f64) -> f64 {
    let mut off_db = 0f64;
    for before_deg in (2..=60).step_by(2) {
        let outgoing = boundary - f64::from(before_deg).to_radians();
        scene.listen(outgoing, false);
        for band in 0..BANDS {
            let wavenumbers: [f64; TONES] = std::array::from_fn(|tone| {
                let octaves = (tone as f64 + 0.5) / TONES as f64 - 0.5;
                scene.wavenumber(band) * octaves.exp2()
            });
            let ours = wavenumbers.map(|wavenumber| scene.tone(band, wavenumber));
            let exact = scene.wedge(outgoing).total(wavenumbers).map(oracle::size);
            let energy = |tones: [f64; TONES]| tones.iter().map(|tone| tone * tone).sum::<f64>();
            off_db = off_db.max(0.5 * decibels(energy(ours) / energy(exact)));
        }
    }
    off_db
}

fn decibels(ratio: f64) -> f64 {
    (20.0 * ratio.log10()).abs()
}
