//! Oracle: sound around an infinite rigid wedge, exactly, by numerical integration in `f64`.
//!
//! The impulse response of \[BIOT57\] in Medwin's notation (\[MEDWIN81\]), Fourier-transformed along the path of steepest
//! descent as in \[HADDEN81\]: with R the length of the path and cosh y = (R² − r² − r'² − z²)/(2 r r'),
//! p = −1/(2 n π) ∫ Σ β_i(y) e^(−jkR)/R dy, β_i = sin(φ_i/n)/(cosh(y/n) − cos(φ_i/n)), φ_i = π ± φ ± φ',
//! taken along R = R₀ − j t²: no oscillation is left, only e^(−k t²). Shares no code with the crate.

use std::f64::consts::PI;

/// A complex number as a pair.
pub type Pair = (f64, f64);

/// A source and a listener around a wedge. Lengths in metres, angles in radians from the first face.
#[derive(Debug, Clone, Copy)]
pub struct Wedge {
    /// Exterior angle in units of π.
    pub n: f64,
    /// Distances of source and listener from the edge's line.
    pub radii_m: [f64; 2],
    /// Angles of source and listener.
    pub angles: [f64; 2],
    /// Distance between them along the edge.
    pub along_m: f64,
}

impl Wedge {
    /// Length of the shortest path over the edge.
    pub fn path_m(&self) -> f64 {
        (self.radii_m[0] + self.radii_m[1]).hypot(self.along_m)
    }

    /// Straight distance for a difference or sum of angles.
    fn straight_m(&self, angle: f64) -> f64 {
        let [a, b] = self.radii_m;
        (a * a + b * b - 2.0 * a * b * angle.cos() + self.along_m.powi(2)).sqrt()
    }

    /// Straight distance between source and listener, occluded or not.
    pub fn direct_m(&self) -> f64 {
        self.straight_m(self.angles[1] - self.angles[0])
    }

    /// The diffracted field at wavenumbers in rad/m, for a source whose free field is e^(−jkr)/r: one integral, in which only
    /// e^(−k t²) differs between them.
    pub fn diffracted<const N: usize>(&self, wavenumbers: [f64; N]) -> [Pair; N] {
        let [phi0, phi] = self.angles;
        let [r0, r] = self.radii_m;
        let far = self.path_m();
        // Steps even in ln t: a pole close to zero is resolved at every distance.
        let lowest = wavenumbers.iter().copied().fold(f64::INFINITY, f64::min);
        let (low, high) = (1e-9f64.ln(), (45.0 / lowest).sqrt().ln());
        let steps = 3000;
        let width = (high - low) / f64::from(steps);
        let mut sums = [(0.0, 0.0); N];
        for i in 0..=steps {
            let t = (low + width * f64::from(i)).exp();
            let weight = match i {
                0 => 1.0,
                i if i == steps => 1.0,
                i => f64::from(2 + 2 * (i % 2)),
            };
            // w − 1 and w + 1 of w = cosh y; R² − R₀² = −2j R₀ t² − t⁴.
            let less = (-t.powi(4) / (2.0 * r * r0), -far * t * t / (r * r0));
            let more = (less.0 + 2.0, less.1);
            let sinh = root(times(less, more));
            let sinh = if sinh.0 < 0.0 {
                (-sinh.0, -sinh.1)
            } else {
                sinh
            };
            let y = ln((1.0 + less.0 + sinh.0, less.1 + sinh.1));
            let mut beta = (0.0, 0.0);
            for angle in [
                PI + phi + phi0,
                PI + phi - phi0,
                PI - phi + phi0,
                PI - phi - phi0,
            ] {
                // cosh a − cos b = 2 sinh((a + jb)/2) sinh((a − jb)/2), without cancellation.
                let (a, b) = ((y.0 / self.n, y.1 / self.n), angle / self.n);
                let half = |sign: f64| sinh_of((0.5 * a.0, 0.5 * (a.1 + sign * b)));
                let below = times(half(1.0), half(-1.0));
                let below = (2.0 * below.0, 2.0 * below.1);
                let term = over((b.sin(), 0.0), below);
                beta = (beta.0 + term.0, beta.1 + term.1);
            }
            // dR = −2j t dt, dy/R = dR/(r r' sinh y), dt = t d(ln t).
            let measure = over(
                (0.0, -2.0 * t * t * weight),
                (sinh.0 * r * r0, sinh.1 * r * r0),
            );
            let value = times(beta, measure);
            for (sum, wavenumber) in sums.iter_mut().zip(wavenumbers) {
                let fading = (-wavenumber * t * t).exp();
                *sum = (sum.0 + fading * value.0, sum.1 + fading * value.1);
            }
        }
        let scale = -width / 3.0 / (2.0 * self.n * PI);
        std::array::from_fn(|i| {
            let sum = (sums[i].0 * scale, sums[i].1 * scale);
            times(sum, turn(-wavenumbers[i] * far))
        })
    }

    /// The total field of an edge that goes from `ends_m[0]` to `ends_m[1]` along its line, in metres from the source's
    /// foot: the line integral along the edge of \[SVENSSON99\].
    #[allow(
        dead_code,
        reason = "not every program that includes this file uses it"
    )]
    pub fn total_of_section(&self, wavenumber: f64, ends_m: [f64; 2]) -> Pair {
        let [phi0, phi] = self.angles;
        let [r0, r] = self.radii_m;
        let nu = 1.0 / self.n;
        let apex_m = self.along_m * r0 / (r0 + r);
        // Steps even in the inverse hyperbolic sine: fine at the apex, where the integrand peaks.
        let fine_m = 1e-3;
        let [from, to] = ends_m.map(|end_m| ((end_m - apex_m) / fine_m).asinh());
        let steps = 20_000;
        let step = (to - from) / f64::from(steps);
        let mut sum = (0.0, 0.0);
        for i in 0..steps {
            let u = from + step * (f64::from(i) + 0.5);
            let along_m = apex_m + fine_m * u.sinh();
            let (before_m, after_m) = (r0.hypot(along_m), r.hypot(along_m - self.along_m));
            let product = before_m * after_m;
            let cosh = ((product + along_m * (along_m - self.along_m)) / (r0 * r)).max(1.0);
            let slow = (nu * cosh.acosh()).cosh();
            let beta = |turn: f64| (nu * (PI + turn)).sin() / (slow - (nu * (PI + turn)).cos());
            let all = beta(phi + phi0) + beta(phi - phi0) + beta(phi0 - phi) + beta(-phi - phi0);
            let size = -nu / (4.0 * PI) * all / product * fine_m * u.cosh() * step;
            let (sin, cos) = (wavenumber * (before_m + after_m)).sin_cos();
            sum = (sum.0 + size * cos, sum.1 - size * sin);
        }
        if phi - phi0 < PI {
            let direct_m = self.direct_m();
            let (sin, cos) = (wavenumber * direct_m).sin_cos();
            sum = (sum.0 + cos / direct_m, sum.1 - sin / direct_m);
        }
        sum
    }

    /// Diffracted, direct and reflected fields together.
    pub fn total<const N: usize>(&self, wavenumbers: [f64; N]) -> [Pair; N] {
        let diffracted = self.diffracted(wavenumbers);
        std::array::from_fn(|i| {
            let geometrical = self.geometrical(wavenumbers[i]);
            (
                diffracted[i].0 + geometrical.0,
                diffracted[i].1 + geometrical.1,
            )
        })
    }

    /// Direct and reflected fields together, where the listener has them.
    pub fn geometrical(&self, wavenumber: f64) -> Pair {
        let mut sum = (0.0, 0.0);
        let [phi0, phi] = self.angles;
        let seen = [
            (phi - phi0, (phi - phi0).abs() < PI),
            (phi + phi0, phi + phi0 < PI),
            (
                2.0 * self.n * PI - phi - phi0,
                2.0 * self.n * PI - phi - phi0 < PI,
            ),
        ];
        for (angle, visible) in seen {
            if visible {
                let distance = self.straight_m(angle);
                let wave = turn(-wavenumber * distance);
                sum = (sum.0 + wave.0 / distance, sum.1 + wave.1 / distance);
            }
        }
        sum
    }
}

/// Size of a pair.
pub fn size(a: Pair) -> f64 {
    a.0.hypot(a.1)
}

/// A number of size one.
pub fn turn(phase: f64) -> Pair {
    (phase.cos(), phase.sin())
}

/// Product.
pub fn times(a: Pair, b: Pair) -> Pair {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

/// Quotient.
pub fn over(a: Pair, b: Pair) -> Pair {
    let d = b.0 * b.0 + b.1 * b.1;
    ((a.0 * b.0 + a.1 * b.1) / d, (a.1 * b.0 - a.0 * b.1) / d)
}

fn root(a: Pair) -> Pair {
    let (length, angle) = (size(a).sqrt(), 0.5 * a.1.atan2(a.0));
    (length * angle.cos(), length * angle.sin())
}

fn ln(a: Pair) -> Pair {
    (size(a).ln(), a.1.atan2(a.0))
}

fn sinh_of(a: Pair) -> Pair {
    (a.0.sinh() * a.1.cos(), a.0.cosh() * a.1.sin())
}
