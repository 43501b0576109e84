//! Oracle: the wave equation in three dimensions by finite differences in time, around boxes and sheets along the axes.
//!
//! Pressure in the middles of cubes, velocity in the middles of their faces, leapfrog in time ([BOTTELDOOREN95]); the
//! region ends in convolutional perfectly matched layers ([RODEN00]). Independent of edges, rays and orders of
//! diffraction. Along an axis a wave of n cells is slower by 1.1/n² (1.1 % at 10 cells). Fields are `f32`. Shares no code
//! with the crate.

use std::f64::consts::PI;

/// A point, in metres.
pub type Point = [f64; 3];

/// Speed of sound in m/s.
pub const SPEED_M_S: f64 = 343.4;

/// Courant number: 1/√3 is the limit of stability.
const COURANT: f64 = 0.577;

/// Cells of the matched layer at each end of the region.
const LAYER: usize = 14;

/// Reflection of the layer at normal incidence, a pressure ratio, in the limit of fine cells.
const LAYER_REFLECTION: f64 = 1e-5;

/// An obstacle: a box along the axes; where it has no thickness, a sheet.
#[derive(Debug, Clone, Copy)]
pub struct Obstacle {
    /// Corners, in metres; infinite where it goes through the region's ends.
    pub low: Point,
    /// The opposite ones.
    pub high: Point,
    /// Specific impedance of its faces; infinite for a rigid one.
    pub impedance: f64,
}

/// A region, its obstacles, a source and listeners.
#[derive(Debug, Clone)]
pub struct Region {
    /// Edge of a cell, in metres.
    pub cell_m: f64,
    /// Corners of the region without its layers.
    pub low: Point,
    /// The opposite ones.
    pub high: Point,
    /// What stands in it.
    pub obstacles: Vec<Obstacle>,
    /// The source.
    pub source: Point,
    /// The listeners.
    pub listeners: Vec<Point>,
    /// Simulated time in seconds.
    pub duration_s: f64,
}

impl Region {
    /// The middle of the cell of a point.
    pub fn on_grid(&self, point: Point) -> Point {
        let cell = self.cell_of(point);
        [0, 1, 2].map(|a| self.low[a] + (cell[a] as f64 - LAYER as f64 + 0.5) * self.cell_m)
    }

    /// Time between two steps in seconds.
    pub fn step_s(&self) -> f64 {
        COURANT * self.cell_m / SPEED_M_S
    }

    fn cell_of(&self, point: Point) -> [usize; 3] {
        [0, 1, 2].map(|a| {
            (((point[a] - self.low[a]) / self.cell_m + 1e-6).floor() + LAYER as f64) as usize
        })
    }

    fn cells(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| ((self.high[a] - self.low[a]) / self.cell_m).round() as usize + 2 * LAYER)
    }

    /// Cells from `low` to `high` of an obstacle along an axis, those of the layers included.
    fn span(&self, low: f64, high: f64, axis: usize) -> [usize; 2] {
        let most = self.cells()[axis];
        [low, high].map(|at| {
            let cell = (at - self.low[axis]) / self.cell_m + LAYER as f64;
            cell.round().clamp(0.0, most as f64) as usize
        })
    }

    /// Pressure at each listener in each step.
    pub fn pressures(&self) -> Vec<Vec<f32>> {
        Field::new(self).run(self)
    }
}

/// Mean over `tones` in an octave around a frequency of the energy of a response relative to that of another.
pub fn octave_ratio(of: &[f32], over: &[f32], step_s: f64, centre_hz: f64, tones: usize) -> f64 {
    let ratio = |tone: usize| {
        let octaves = (tone as f64 + 0.5) / tones as f64 - 0.5;
        let turn = -2.0 * PI * centre_hz * octaves.exp2() * step_s;
        energy(of, turn) / energy(over, turn)
    };
    (0..tones).map(ratio).sum::<f64>() / tones as f64
}

/// Energy of a signal at a frequency, in radians a step.
fn energy(signal: &[f32], turn: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (i, &value) in signal.iter().enumerate() {
        let (sin, cos) = (turn * i as f64).sin_cos();
        re += f64::from(value) * cos;
        im += f64::from(value) * sin;
    }
    re * re + im * im
}

/// Memory of the matched layers along one axis: of one field, all cells of both layers.
struct Memory {
    /// e^(−σ Δt) at each depth, cell by cell from the low end and from the high one.
    decay: Vec<f32>,
    values: Vec<f32>,
}

struct Field {
    size: [usize; 3],
    stride: [usize; 3],
    pressure: Vec<f32>,
    velocity: [Vec<f32>; 3],
    closed: [Vec<usize>; 3],
    /// Cells at absorbing faces, and for each Σ ½ λ/ζ.
    absorbing: Vec<(usize, f32)>,
    of_pressure: [Memory; 3],
    of_velocity: [Memory; 3],
}

impl Field {
    fn new(region: &Region) -> Self {
        let size = region.cells();
        let stride = [size[1] * size[2], size[2], 1];
        let count = size[0] * stride[0];
        let memory = |axis: usize, offset: f64| {
            let depth = |cell: usize| {
                let at = cell as f64 + offset;
                (LAYER as f64 - at).max(at - (size[axis] - LAYER) as f64) / LAYER as f64
            };
            // ∫σ = ½ ln(1/reflection) c over the layer.
            let most = 2.0 * (1.0 / LAYER_REFLECTION).ln() / LAYER as f64;
            let decay = (0..LAYER)
                .chain(size[axis] - LAYER..size[axis])
                .map(|cell| {
                    let sigma = most * depth(cell).clamp(0.0, 1.0).powi(3);
                    (-sigma * COURANT).exp() as f32
                });
            Memory {
                decay: decay.collect(),
                values: vec![0.0; 2 * LAYER * count / size[axis]],
            }
        };
        let mut field = Self {
            size,
            stride,
            pressure: vec![0.0; count],
            velocity: std::array::from_fn(|_| vec![0.0; count]),
            closed: Default::default(),
            absorbing: Vec::new(),
            of_pressure: std::array::from_fn(|axis| memory(axis, 0.0)),
            of_velocity: std::array::from_fn(|axis| memory(axis, 0.5)),
        };
        let mut softness = std::collections::BTreeMap::new();
        for obstacle in &region.obstacles {
            field.close(region, obstacle, &mut softness);
        }
        for closed in &mut field.closed {
            closed.sort_unstable();
            closed.dedup();
        }
        field.absorbing = softness.into_iter().collect();
        field
    }

    /// Closes the faces of an obstacle.
    fn close(
        &mut self,
        region: &Region,
        obstacle: &Obstacle,
        softness: &mut std::collections::BTreeMap<usize, f32>,
    ) {
        let span = [0, 1, 2].map(|a| region.span(obstacle.low[a], obstacle.high[a], a));
        let soft = (0.5 * COURANT / obstacle.impedance) as f32;
        for axis in 0..3 {
            let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
            let mut sides = span[axis].to_vec();
            sides.dedup();
            let sheet = sides.len() == 1;
            for (which, face) in sides.into_iter().enumerate() {
                if face == 0 || face == self.size[axis] {
                    continue;
                }
                for i in span[b][0]..span[b][1] {
                    for j in span[c][0]..span[c][1] {
                        let cell =
                            face * self.stride[axis] + i * self.stride[b] + j * self.stride[c];
                        self.closed[axis].push(cell);
                        if soft > 0.0 {
                            if sheet || which == 0 {
                                *softness.entry(cell - self.stride[axis]).or_default() += soft;
                            }
                            if sheet || which == 1 {
                                *softness.entry(cell).or_default() += soft;
                            }
                        }
                    }
                }
            }
        }
    }

    fn run(mut self, region: &Region) -> Vec<Vec<f32>> {
        let index = |point: Point| {
            let cell = region.cell_of(point);
            (0..3).map(|a| cell[a] * self.stride[a]).sum::<usize>()
        };
        let source = index(region.source);
        let ears: Vec<usize> = region.listeners.iter().map(|&point| index(point)).collect();
        let steps = (region.duration_s / region.step_s()) as usize;
        let mut heard = vec![Vec::with_capacity(steps); ears.len()];
        for step in 0..steps {
            for axis in 0..3 {
                self.step_velocity(axis);
            }
            let before: Vec<f32> = (self.absorbing.iter())
                .map(|&(cell, _)| self.pressure[cell])
                .collect();
            self.step_pressure();
            for (&(cell, soft), before) in self.absorbing.iter().zip(before) {
                // v of a face is the mean pressure over ζ: solved for the new pressure.
                let now = &mut self.pressure[cell];
                *now = (*now - soft * before) / (1.0 + soft);
            }
            self.pressure[source] += pulse(step as f64 * region.step_s());
            for (signal, &ear) in heard.iter_mut().zip(&ears) {
                signal.push(self.pressure[ear]);
            }
        }
        heard
    }

    fn step_velocity(&mut self, axis: usize) {
        let (stride, count) = (self.stride[axis], self.pressure.len());
        let courant = COURANT as f32;
        let (pressure, velocity) = (&self.pressure, &mut self.velocity[axis]);
        for ((v, p), q) in (velocity[stride..].iter_mut())
            .zip(&pressure[stride..])
            .zip(&pressure[..count - stride])
        {
            *v -= courant * (p - q);
        }
        let memory = &mut self.of_pressure[axis];
        for_layers(self.size, self.stride, axis, |depth, cell, place| {
            if cell >= stride {
                let slope = pressure[cell] - pressure[cell - stride];
                let value = memory.update(depth, place, slope);
                velocity[cell] -= courant * value;
            }
        });
        for &cell in &self.closed[axis] {
            velocity[cell] = 0.0;
        }
        // The region's first faces, which the long loop crosses at the ends of lines.
        if axis > 0 {
            let lines = count / self.size[axis];
            for line in 0..lines {
                let cell = match axis {
                    1 => (line / self.size[2]) * self.stride[0] + line % self.size[2],
                    _ => line * self.size[2],
                };
                velocity[cell] = 0.0;
            }
        }
    }

    fn step_pressure(&mut self) {
        let count = self.pressure.len();
        let courant = COURANT as f32;
        let [sx, sy, _] = self.stride;
        let [vx, vy, vz] = &self.velocity;
        // The last cells lie in the layers; without their outer faces they are rigid there.
        let inner = count - sx;
        let rows = (self.pressure[..inner].iter_mut())
            .zip(&vx[..inner])
            .zip(&vx[sx..])
            .zip(vy[..inner].iter().zip(&vy[sy..inner + sy]))
            .zip(vz[..inner].iter().zip(&vz[1..=inner]));
        for ((((p, x0), x1), (y0, y1)), (z0, z1)) in rows {
            *p -= courant * ((x1 - x0) + (y1 - y0) + (z1 - z0));
        }
        for axis in 0..3 {
            let stride = self.stride[axis];
            let (pressure, velocity) = (&mut self.pressure, &self.velocity[axis]);
            let memory = &mut self.of_velocity[axis];
            for_layers(self.size, self.stride, axis, |depth, cell, place| {
                if cell < inner {
                    let slope = velocity[cell + stride] - velocity[cell];
                    let value = memory.update(depth, place, slope);
                    pressure[cell] -= courant * value;
                }
            });
        }
    }
}

impl Memory {
    #[inline]
    fn update(&mut self, depth: usize, place: usize, slope: f32) -> f32 {
        let decay = self.decay[depth];
        let value = &mut self.values[place];
        *value = decay * *value + (decay - 1.0) * slope;
        *value
    }
}

/// Calls with the depth, the cell and its place in the memory, for each cell of the layers along an axis.
#[inline]
fn for_layers(
    size: [usize; 3],
    stride: [usize; 3],
    axis: usize,
    mut visit: impl FnMut(usize, usize, usize),
) {
    let layers = |a: usize| match a == axis {
        true => 2 * LAYER,
        false => size[a],
    };
    let cell = |a: usize, i: usize| match a == axis && i >= LAYER {
        true => i + size[a] - 2 * LAYER,
        false => i,
    };
    let mut place = 0;
    for i in 0..layers(0) {
        for j in 0..layers(1) {
            let line = cell(0, i) * stride[0] + cell(1, j) * stride[1];
            for k in 0..layers(2) {
                let depth = [i, j, k][axis];
                visit(depth, line + cell(2, k), place);
                place += 1;
            }
        }
    }
}

/// The source's pulse, a difference of two bells: flat within 10 dB from 150 to 1,500 Hz, without mean.
fn pulse(time_s: f64) -> f32 {
    const WIDTH_S: f64 = 2.5e-4;
    let t = (time_s - 4.0 * WIDTH_S) / WIDTH_S;
    (-t * (-t * t).exp()) as f32
}
