//! Law *edge*: sound behind edges against an exact solution and a measured chart, and with source and listener exchanged.

use std::f64::consts::PI;

use super::{Row, wedge as oracle};
use foresound::acoustics::BANDS;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;
use foresound::propagation::diffraction::complex::Complex;
use foresound::propagation::diffraction::utd::wedge_field;
use foresound::propagation::diffraction::wedge_geometry::{Spread, WedgeAngles};

/// Speed of sound in m/s of the kernel's cases; its value does not matter.
const SPEED_M_S: f64 = 343.4;

/// All figures of the law.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = kernel_rows();
    rows.extend(chart_rows());
    rows.extend(super::edge_scene::rows()?);
    Ok(rows)
}

/// Total field by the kernel, geometrical parts added, for a source whose free field is e^(−jkr)/r.
pub(crate) fn kernel_total(wedge: &oracle::Wedge, wavenumber: f64) -> Complex {
    let [incoming, outgoing] = wedge.angles;
    let angles = WedgeAngles {
        n: wedge.n,
        incoming,
        outgoing,
    };
    let diffracted_m = wedge.path_m();
    // s s' sin²β₀ / (s + s') with s = r / sin β₀.
    let spread = Spread {
        distance_m: wedge.radii_m[0] * wedge.radii_m[1] / diffracted_m,
        length_m: diffracted_m,
    };
    let kl = [wavenumber * spread.distance_m; BANDS];
    let diffracted = wedge_field(&angles, &spread, &kl)[0].rigid();
    let mut sum = diffracted * Complex::cis(-wavenumber * diffracted_m) * (1.0 / diffracted_m);
    // The oracle adds the same geometrical part to its diffracted field.
    let (re, im) = wedge.geometrical(wavenumber);
    sum += Complex::new(re, im);
    sum
}

/// Distances of source and listener from the edge in metres.
const NEAR_M: [[f64; 2]; 1] = [[1.0, 1.0]];
const WIDE_M: [[f64; 2]; 4] = [[1.0, 5.0], [2.0, 2.0], [5.0, 5.0], [3.0, 20.0]];

/// A row's name, its wedges in units of π, and its distances.
type KernelCase<'a> = (&'a str, &'a [f64], &'a [[f64; 2]]);

/// Worst deviation of the kernel from the exact field in each band, in dB.
fn kernel_rows() -> Vec<Row> {
    let strict = [0.5, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2];
    let solid = [1.5, 1.25, 1.75];
    let cases: [KernelCase<'_>; 4] = [
        ("half-plane, 1 m", &[2.0], &NEAR_M),
        ("half-plane, farther", &[2.0], &WIDE_M),
        ("solid wedges, 1 m", &solid, &NEAR_M),
        ("solid wedges, farther", &solid, &WIDE_M),
    ];
    let rows =
        cases.map(|(name, wedges, distances)| deviation_rows(name, wedges, distances, strict));
    rows.into_iter().flatten().collect()
}

fn deviation_rows(
    name: &str,
    wedges: &[f64],
    distances_m: &[[f64; 2]],
    bounds_db: [f64; BANDS],
) -> Vec<Row> {
    let mut worst = [0f64; BANDS];
    for &n in wedges {
        for &radii_m in distances_m {
            for along_m in [0.0, 2.0] {
                for wedge in listeners(n, radii_m, along_m) {
                    let wavenumbers = CENTRES_HZ.map(|hz| 2.0 * PI * hz / SPEED_M_S);
                    let exact = wedge.total(wavenumbers).map(oracle::size);
                    for b in 0..BANDS {
                        let ours = kernel_total(&wedge, wavenumbers[b]).abs();
                        worst[b] = worst[b].max((20.0 * (ours / exact[b]).log10()).abs());
                    }
                }
            }
        }
    }
    let law = |b: usize| format!("edge: {name}, {:.0} Hz", CENTRES_HZ[b]);
    (0..BANDS)
        .map(|b| Row::at_most(law(b), worst[b], bounds_db[b], "dB"))
        .collect()
}

/// Listeners from 5° before the shadow boundary to the far face.
fn listeners(n: f64, radii_m: [f64; 2], along_m: f64) -> Vec<oracle::Wedge> {
    let mut wedges = Vec::new();
    for incoming in [0.25, 0.5 * PI / 2.0, 1.2] {
        for step in 0..20 {
            let outgoing = incoming + PI + (-5.0f64 + 5.0 * f64::from(step) + 0.3).to_radians();
            if outgoing < n * PI - 0.1 {
                wedges.push(oracle::Wedge {
                    n,
                    radii_m,
                    angles: [incoming, outgoing],
                    along_m,
                });
            }
        }
    }
    wedges
}

/// The kernel behind a sheet, 10° and more in its shadow, against the formula of \[KURZE71\] for a thin screen. Nearer to
/// the boundary the formula itself is up to 3 dB off the exact solution.
fn chart_rows() -> Vec<Row> {
    let mut worst = 0f64;
    for depth_deg in [10.0, 20.0, 30.0, 45.0] {
        for radii_m in [[5.0, 5.0], [2.0, 10.0]] {
            let incoming = 0.5 * PI;
            let wedge = oracle::Wedge {
                n: 2.0,
                radii_m,
                angles: [incoming, incoming + PI + f64::to_radians(depth_deg)],
                along_m: 0.0,
            };
            for hz in CENTRES_HZ {
                let k = 2.0 * PI * hz / SPEED_M_S;
                let fresnel = k / PI * (wedge.path_m() - wedge.direct_m());
                if fresnel > 0.1 {
                    let root = (2.0 * PI * fresnel).sqrt();
                    let chart_db = 5.0 + 20.0 * (root / root.tanh()).log10();
                    let loss_db =
                        -20.0 * (kernel_total(&wedge, k).abs() * wedge.direct_m()).log10();
                    worst = worst.max((loss_db - chart_db).abs());
                }
            }
        }
    }
    vec![Row::at_most(
        "edge: thin screen, Kurze and Anderson",
        worst,
        3.0,
        "dB",
    )]
}
