//! Oracle: sound of a line source around a rigid body of any plane outline, by boundary elements in `f64`.
//!
//! Kirchhoff and Helmholtz's integral over the outline ([COLTON83]), constant elements, collocation at their middles,
//! with points inside the body where the field must vanish against the integral's own resonances ([SCHENCK68]). Independent
//! of edges, rays and orders of diffraction. Time runs as e^(+jωt). Shares no code with the crate.

use std::f64::consts::PI;

use super::wedge::{Pair, over, times};

/// A point of the plane, in metres.
pub type Point = [f64; 2];

/// Nodes and weights of Gauss and Legendre's rule of order four on 0 to 1.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// One straight piece of the outline.
#[derive(Debug, Clone, Copy)]
struct Element {
    from: Point,
    to: Point,
}

impl Element {
    fn at(&self, share: f64) -> Point {
        [0, 1].map(|i| self.from[i] + share * (self.to[i] - self.from[i]))
    }

    /// ∫ ∂G/∂n over the element seen from a point, n out of the body.
    fn slope(&self, wavenumber: f64, seen_from: Point) -> Pair {
        let along = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let length = along[0].hypot(along[1]);
        // The outline runs counter-clockwise, so the outside is on the right.
        let normal = [along[1] / length, -along[0] / length];
        let mut sum = (0.0, 0.0);
        for (share, weight) in GAUSS {
            let y = self.at(share);
            let offset = [y[0] - seen_from[0], y[1] - seen_from[1]];
            let r = offset[0].hypot(offset[1]);
            let cosine = (offset[0] * normal[0] + offset[1] * normal[1]) / r;
            let h1 = hankel(1, wavenumber * r);
            // G = −j/4 H₀, its derivative jk/4 H₁.
            let scale = 0.25 * wavenumber * cosine * weight * length;
            sum = (sum.0 - scale * h1.1, sum.1 + scale * h1.0);
        }
        sum
    }
}

/// Level of a line source at a listener relative to the free field there, around a rigid body of this outline
/// (counter-clockwise). `inside` are some points within it.
pub fn gain(
    outline: &[Point],
    inside: &[Point],
    wavenumber: f64,
    source: Point,
    listener: Point,
) -> f64 {
    let longest = 2.0 * PI / wavenumber / 10.0;
    let mut elements = Vec::new();
    for (i, &from) in outline.iter().enumerate() {
        let side = Element {
            from,
            to: outline[(i + 1) % outline.len()],
        };
        let length = (side.to[0] - from[0]).hypot(side.to[1] - from[1]);
        let count = (length / longest).ceil().max(4.0) as usize;
        for k in 0..count {
            elements.push(Element {
                from: side.at(k as f64 / count as f64),
                to: side.at((k + 1) as f64 / count as f64),
            });
        }
    }
    let free = |to: Point| {
        let r = (to[0] - source[0]).hypot(to[1] - source[1]);
        let h0 = hankel(0, wavenumber * r);
        (0.25 * h0.1, -0.25 * h0.0)
    };
    let rows: Vec<(Point, Option<usize>)> = (elements.iter().map(|e| e.at(0.5)))
        .enumerate()
        .map(|(i, middle)| (middle, Some(i)))
        .chain(inside.iter().map(|&point| (point, None)))
        .collect();
    // ½ p − ∫ p ∂G/∂n = p of the source on the outline; −∫ p ∂G/∂n = the same inside.
    let matrix: Vec<Vec<Pair>> = rows
        .iter()
        .map(|&(point, own)| {
            let entry = |(k, element): (usize, &Element)| match own {
                Some(own) if own == k => (0.5, 0.0),
                _ => {
                    let slope = element.slope(wavenumber, point);
                    (-slope.0, -slope.1)
                }
            };
            elements.iter().enumerate().map(entry).collect()
        })
        .collect();
    let right: Vec<Pair> = rows.iter().map(|&(point, _)| free(point)).collect();
    let pressure = least_squares(&matrix, &right);
    let mut sum = free(listener);
    for (element, &p) in elements.iter().zip(&pressure) {
        let part = times(element.slope(wavenumber, listener), p);
        sum = (sum.0 + part.0, sum.1 + part.1);
    }
    let alone = free(listener);
    sum.0.hypot(sum.1) / alone.0.hypot(alone.1)
}

/// Solves A* A x = A* b by elimination.
fn least_squares(matrix: &[Vec<Pair>], right: &[Pair]) -> Vec<Pair> {
    let n = matrix[0].len();
    let mut system = vec![vec![(0.0, 0.0); n + 1]; n];
    for (row, b) in matrix.iter().zip(right) {
        for i in 0..n {
            let adjoint = (row[i].0, -row[i].1);
            for k in 0..=n {
                let value = times(adjoint, if k < n { row[k] } else { *b });
                let sum = &mut system[i][k];
                *sum = (sum.0 + value.0, sum.1 + value.1);
            }
        }
    }
    // Hermitian and positive definite: no pivoting.
    for i in 0..n {
        let (above, below) = system.split_at_mut(i + 1);
        let pivot = &above[i];
        for row in below {
            let factor = over(row[i], pivot[i]);
            for k in i..=n {
                let value = times(factor, pivot[k]);
                row[k] = (row[k].0 - value.0, row[k].1 - value.1);
            }
        }
    }
    let mut x = vec![(0.0, 0.0); n];
    for i in (0..n).rev() {
        let mut rest = system[i][n];
        for k in i + 1..n {
            let value = times(system[i][k], x[k]);
            rest = (rest.0 - value.0, rest.1 - value.1);
        }
        x[i] = over(rest, system[i][i]);
    }
    x
}

/// Hankel's function of the second kind, order 0 or 1: its power series, or its asymptotic one from 14 on
/// ([ABRAMOWITZ64] 9.1.10 to 9.1.13, 9.2.7 to 9.2.10).
pub fn hankel(order: usize, x: f64) -> Pair {
    let nu = order as f64;
    if x > 14.0 {
        let (mut term, mut sum) = ((1.0, 0.0), (1.0, 0.0));
        for k in 1..=20 {
            let odd = f64::from(2 * k - 1);
            let factor = (4.0 * nu * nu - odd * odd) / (8.0 * f64::from(k) * x);
            // Times −j.
            term = (term.1 * factor, -term.0 * factor);
            sum = (sum.0 + term.0, sum.1 + term.1);
        }
        let phase = -(x - 0.5 * nu * PI - 0.25 * PI);
        let size = (2.0 / (PI * x)).sqrt();
        return times((size * phase.cos(), size * phase.sin()), sum);
    }
    let q = 0.25 * x * x;
    let (mut j, mut y) = (0.0, 0.0);
    let mut term = if order == 0 { 1.0 } else { 0.5 * x };
    let mut harmonic = 0.0;
    const EULER: f64 = 0.577_215_664_901_532_9;
    for m in 0..60 {
        let m = f64::from(m);
        // ψ(m + 1) + ψ(m + 1 + order), each without −γ.
        let next = harmonic + nu / (m + 1.0);
        j += term;
        y -= term * (harmonic + next - 2.0 * EULER);
        harmonic += 1.0 / (m + 1.0);
        term *= -q / ((m + 1.0) * (m + 1.0 + nu));
    }
    y += 2.0 * (0.5 * x).ln() * j;
    if order == 1 {
        y -= 2.0 / x;
    }
    (j, -y / PI)
}
