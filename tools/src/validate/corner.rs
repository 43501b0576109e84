//! Law *corner*: a walk past a corner that stands on the ground, from 30° before its shadow boundary to 30° behind it,
//! against the exact field of the wedge for the source and for its image in the ground.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{Case, Row, rooms, wedge as oracle};
use foresound::acoustics::BANDS;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;
use foresound::propagation::diffraction::complex::Complex;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{ListenerPose, Scene, SourceId, SourcePose, TriangleMesh};

/// Half the width of the ground, and length and height of the walls, in metres: other edges are too far to matter.
const EXTENT_M: f32 = 60.0;

/// Horizontal distance of source and listener from the corner, and their heights, in metres.
const RADIUS_M: f64 = 5.0;
const HEIGHTS_M: [f64; 2] = [1.5, 1.7];

/// Tones of an octave.
const TONES: usize = 12;

/// Positions of the walk: half the angle it covers, and the angles between two, in degrees, for steps and for the
/// comparison with the exact solution. One position is exactly on the shadow boundary.
const HALF_WALK_DEG: f64 = 30.0;
const STEP_DEG: f64 = 0.02;
const COMPARED_EVERY: i32 = 125;

/// Angles in degrees around the boundary that are compared besides.
const CLOSE_DEG: [f64; 9] = [-0.1, -0.02, -0.004, -1e-4, 0.0, 1e-4, 0.004, 0.02, 0.1];

/// A corner on the ground. Its edge is the y axis.
struct Corner {
    scene: Arc<Scene>,
    propagator: Propagator,
    set: PathSet,
    /// Exterior angle of the corner in units of π.
    n: f64,
    /// Angle of the source from the first wall, in radians.
    incoming: f64,
}

impl Corner {
    fn new(n: f64, incoming: f64) -> Result<Self> {
        let mut mesh = TriangleMesh::default();
        let material = mesh.material("rigid");
        let mut rectangle = |corner: Vec3, a: Vec3, b: Vec3| {
            let first = mesh.vertices.len() as u32;
            mesh.vertices
                .extend([corner, corner + a, corner + a + b, corner + b]);
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.triangles.push([first, first + 2, first + 3]);
            mesh.triangle_materials.extend([material; 2]);
        };
        let (foot, up) = (Vec3::ZERO, EXTENT_M * Vec3::Y);
        let wide = 2.0 * EXTENT_M;
        rectangle(
            Vec3::new(-EXTENT_M, 0.0, -EXTENT_M),
            wide * Vec3::Z,
            wide * Vec3::X,
        );
        rectangle(foot, up, EXTENT_M * Vec3::X);
        if n < 2.0 {
            rectangle(foot, up, EXTENT_M * direction(n * PI));
        }
        let scene = rooms::commit(&mesh, vec![rooms::even("rigid", 0.0, 0.0)])?;
        let settings = PropagationSettings {
            guide_rays: 256,
            source_rays: 8,
            depth: 2,
            ..PropagationSettings::default()
        };
        Ok(Self {
            propagator: Propagator::new(Arc::clone(&scene), settings)?,
            scene,
            set: PathSet::default(),
            n,
            incoming,
        })
    }

    fn position(angle: f64, height_m: f64) -> Vec3 {
        let (sin, cos) = angle.sin_cos();
        (DVec3::new(cos, 0.0, sin) * RADIUS_M + DVec3::Y * height_m).as_vec3()
    }

    /// Level in dB of each octave for a listener at an angle in radians.
    fn levels_db(&mut self, outgoing: f64) -> [f64; BANDS] {
        let [from, to] = HEIGHTS_M;
        let pose = SourcePose::at(SourceId::default(), Self::position(self.incoming, from));
        let ear = ListenerPose::facing(Self::position(outgoing, to), 0.0);
        self.propagator.update(&ear, &[pose], 0.0, &mut self.set);
        std::array::from_fn(|band| {
            level_db(self.tones(band).map(|wavenumber| {
                let mut sum = Complex::ZERO;
                for path in &self.set.paths {
                    let length_m = f64::from(path.length_m);
                    let dry = (f64::from(self.scene.air_np_per_m()[band]) * length_m).exp();
                    let amplitude = f64::from(path.amplitude[band]) * dry;
                    sum += Complex::cis(-wavenumber * length_m) * amplitude;
                }
                sum.abs()
            }))
        })
    }

    /// The exact level in dB of an octave.
    fn exact_db(&self, band: usize, outgoing: f64) -> f64 {
        let [from, to] = HEIGHTS_M;
        // The integral has a pole on the boundary itself.
        let beside = (outgoing - self.incoming - PI).abs() < 1e-7;
        let outgoing = outgoing + if beside { 1e-6 } else { 0.0 };
        let wedge = |along_m| oracle::Wedge {
            n: self.n,
            radii_m: [RADIUS_M; 2],
            angles: [self.incoming, outgoing],
            along_m,
        };
        let [source, image] =
            [to - from, to + from].map(|along_m| wedge(along_m).total(self.tones(band)));
        level_db(std::array::from_fn(|tone| {
            let (a, b) = (source[tone], image[tone]);
            oracle::size((a.0 + b.0, a.1 + b.1))
        }))
    }

    /// Wavenumbers of an octave's tones.
    fn tones(&self, band: usize) -> [f64; TONES] {
        let centre = 2.0 * PI * CENTRES_HZ[band] / self.scene.speed_of_sound_m_s();
        std::array::from_fn(|tone| {
            let octaves = (tone as f64 + 0.5) / TONES as f64 - 0.5;
            centre * octaves.exp2()
        })
    }
}

/// Mean energy of an octave's tones, in dB.
fn level_db(amplitudes: [f64; TONES]) -> f64 {
    let energy = amplitudes
        .iter()
        .map(|amplitude| amplitude.powi(2))
        .sum::<f64>();
    10.0 * (energy / TONES as f64).log10()
}

/// The horizontal direction at an angle from the first wall.
fn direction(angle: f64) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    Vec3::new(cos as f32, 0.0, sin as f32)
}

pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (name, n, incoming_deg) in [
        ("screen, source at 45°", 2.0, 45.0),
        ("screen, source at 90°", 2.0, 90.0),
        ("house, source at 50°", 1.5, 50.0f64),
    ] {
        rows.extend(case_rows(name, n, incoming_deg.to_radians())?);
    }
    Ok(rows)
}

fn case_rows(name: &str, n: f64, incoming: f64) -> Result<Vec<Row>> {
    let mut corner = Corner::new(n, incoming)?;
    let boundary = incoming + PI;
    let steps = (HALF_WALK_DEG / STEP_DEG).round() as i32;
    let (mut squares, mut compared, mut worst) = (0.0, 0u32, 0f64);
    let mut compare = |levels: [f64; BANDS], corner: &Corner, outgoing: f64| {
        for (band, level) in levels.iter().enumerate() {
            let off_db = level - corner.exact_db(band, outgoing);
            squares += off_db * off_db;
            compared += 1;
            worst = worst.max(off_db.abs());
        }
    };
    let mut step_db = 0f64;
    let mut before: Option<[f64; BANDS]> = None;
    for step in -steps..=steps {
        let outgoing = boundary + (STEP_DEG * f64::from(step)).to_radians();
        let levels = corner.levels_db(outgoing);
        for (now, past) in levels.iter().zip(before.iter().flatten()) {
            step_db = step_db.max((now - past).abs());
        }
        before = Some(levels);
        if step % COMPARED_EVERY == 0 {
            compare(levels, &corner, outgoing);
        }
    }
    for degrees in CLOSE_DEG {
        let outgoing = boundary + degrees.to_radians();
        let levels = corner.levels_db(outgoing);
        compare(levels, &corner, outgoing);
    }
    let rms_db = (squares / f64::from(compared)).sqrt();
    let mut case = Case::new(format!("corner: {name}"));
    case.at_most("from the exact field, rms", rms_db, 0.6, "dB");
    case.at_most("from the exact field, worst", worst, 1.5, "dB");
    case.at_most("largest step", step_db, 0.1, "dB");
    Ok(case.rows)
}
