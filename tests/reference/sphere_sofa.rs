//! SOFA files of spheres, with and without mistakes.

use hdf5_pure::{AttrValue, FileBuilder};

/// A SOFA file of a sphere's onset: impulses at both ears.
#[derive(Clone, Copy)]
pub struct Sphere {
    pub convention: &'static str,
    pub rate_hz: f64,
    pub ears: u64,
    /// Lowest height of a direction.
    pub least: f64,
    pub view: [f64; 3],
    pub peak: f64,
    /// Radius over speed of sound, in seconds.
    pub radius_s: f64,
}

/// One that is read.
pub const GOOD: Sphere = Sphere {
    convention: "SimpleFreeFieldHRIR",
    rate_hz: 48_000.0,
    ears: 2,
    least: -1.0,
    view: [1.0, 0.0, 0.0],
    peak: 1.0,
    radius_s: RADIUS_S,
};

/// Radius over speed of sound, in seconds.
pub const RADIUS_S: f64 = 0.000_25;

impl Sphere {
    /// Its content.
    pub fn bytes(&self) -> Vec<u8> {
        let text = |text: &str| AttrValue::AsciiString(text.into());
        let (count, taps) = (300, 128);
        let (mut positions, mut impulses) = (Vec::new(), Vec::new());
        for n in 0..count {
            let z = 1.0 - (2 * n + 1) as f64 / count as f64;
            if z < self.least {
                continue;
            }
            let azimuth = 2.4 * f64::from(n);
            positions.extend([
                azimuth.to_degrees().rem_euclid(360.0),
                z.asin().to_degrees(),
                1.4,
            ]);
            let lateral = (z.asin().cos() * azimuth.sin()).asin();
            let delay = 0.5 * self.radius_s * (lateral + lateral.sin()) * self.rate_hz;
            for ear in 0..self.ears {
                let at = 50.0 + [-delay, delay, 0.0][ear as usize];
                // A Gaussian of two samples: its delay need not be whole.
                let sample = |n: i32| self.peak * (-0.125 * (f64::from(n) - at).powi(2)).exp();
                impulses.extend((0..taps).map(sample));
            }
        }
        let count = positions.len() as u64 / 3;
        let mut file = FileBuilder::new();
        file.set_attr("Conventions", text("SOFA"));
        file.set_attr("SOFAConventions", text(self.convention));
        let spherical = |name: &str, values: &[f64], shape: &[u64], file: &mut FileBuilder| {
            let data = file
                .create_dataset(name)
                .with_f64_data(values)
                .with_shape(shape);
            data.set_attr("Type", text("spherical"));
            data.set_attr("Units", text("degree, degree, metre"));
        };
        spherical("SourcePosition", &positions, &[count, 3], &mut file);
        let view = file
            .create_dataset("ListenerView")
            .with_f64_data(&self.view)
            .with_shape(&[1, 3]);
        view.set_attr("Type", text("cartesian"));
        let data = file.create_dataset("Data.IR").with_f64_data(&impulses);
        data.with_shape(&[count, self.ears, taps as u64]);
        file.create_dataset("Data.SamplingRate")
            .with_f64_data(&[self.rate_hz])
            .with_shape(&[1]);
        file.create_dataset("Data.Delay")
            .with_f64_data(&[0.0; 2])
            .with_shape(&[1, 2]);
        file.finish().expect("a file in memory")
    }
}
