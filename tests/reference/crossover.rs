//! The band filter's tree in `f64`, from textbook biquads in direct form (Bristow-Johnson's cookbook) and none of the
//! library's code.

use foresound::acoustics::BANDS;
use foresound::acoustics::bands::EDGES_HZ;

/// A second-order section `(b0, b1, b2, a1, a2)`.
type Biquad = [f64; 5];

fn butterworth(edge: usize, rate_hz: f64, kind: Kind) -> Biquad {
    let w = std::f64::consts::TAU * EDGES_HZ[edge] / rate_hz;
    let alpha = w.sin() / std::f64::consts::SQRT_2;
    let b = match kind {
        Kind::Low => {
            let b = (1.0 - w.cos()) / 2.0;
            [b, 2.0 * b, b]
        }
        Kind::High => {
            let b = (1.0 + w.cos()) / 2.0;
            [b, -2.0 * b, b]
        }
        Kind::All => [1.0 - alpha, -2.0 * w.cos(), 1.0 + alpha],
    };
    let a0 = 1.0 + alpha;
    [
        b[0] / a0,
        b[1] / a0,
        b[2] / a0,
        -2.0 * w.cos() / a0,
        (1.0 - alpha) / a0,
    ]
}

#[derive(Clone, Copy)]
enum Kind {
    Low,
    High,
    All,
}

fn run(signal: &mut [f64], [b0, b1, b2, a1, a2]: Biquad) {
    let (mut s1, mut s2) = (0.0, 0.0);
    for x in signal {
        let y = b0 * *x + s1;
        s1 = b1 * *x - a1 * y + s2;
        s2 = b2 * *x - a2 * y;
        *x = y;
    }
}

/// Splits a signal into the bands: low half by crossover 3, quarters by 1 and 5, bands by 0, 2, 4 and 6, and the
/// allpasses of the three crossovers of the other half and the one of the other quarter.
pub fn split(signal: &[f64], rate_hz: f64) -> [Vec<f64>; BANDS] {
    std::array::from_fn(|band| {
        let mut out = signal.to_vec();
        let side = |high: bool| if high { Kind::High } else { Kind::Low };
        let quarter = band / 2;
        for (edge, kind) in [
            (3, side(band >= 4)),
            (if band < 4 { 1 } else { 5 }, side(quarter % 2 == 1)),
            (2 * quarter, side(band % 2 == 1)),
        ] {
            run(&mut out, butterworth(edge, rate_hz, kind));
            run(&mut out, butterworth(edge, rate_hz, kind));
        }
        let other_half = if band < 4 { 4..7 } else { 0..3 };
        for edge in other_half.chain([2 * (quarter ^ 1)]) {
            run(&mut out, butterworth(edge, rate_hz, Kind::All));
        }
        out
    })
}
