//! Lambert's law for surfaces that stand for more than a point.
//!
//! Own. A bounce or a sample represents a piece of surface around it. Close to it the law for a point is unbounded, and a bound on the
//! distance alone takes energy away: 13 % (a cube) to 25 % (a flat room) of all that a room hears. Height and distance from a
//! point further below keep the sum.

/// Energy in 1/m² by Lambert's law for a unit that leaves a surface, heard at a squared distance in square metres and a height above its
/// plane in metres, both as from a point that lies lower by the square root of `lifted_m2`: half of the squared radius of a disc of the
/// surface's area. Such surfaces side by side are heard alike at any height, as by the law itself.
#[inline(always)]
pub(crate) fn lifted_kernel(square_m2: f32, height_m: f32, lifted_m2: f32) -> f32 {
    let reach_m2 = square_m2 + lifted_m2;
    let height_m = (height_m * height_m + lifted_m2).sqrt();
    height_m / (std::f32::consts::PI * reach_m2 * reach_m2.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sum over an infinite plane is 2 by the law, for a unit that leaves each square metre.
    #[test]
    fn a_plane_is_heard_alike_at_any_height() {
        for height_m in [0.02, 0.2, 1.0, 3.0] {
            let (mut sum, mut ring_m) = (0.0, 0.005f32);
            while ring_m < 500.0 {
                let width_m = 0.01 * ring_m.max(0.5);
                let area_m2 = std::f32::consts::TAU * ring_m * width_m;
                let square_m2 = ring_m * ring_m + height_m * height_m;
                sum += area_m2 * lifted_kernel(square_m2, height_m, 0.25);
                ring_m += width_m;
            }
            assert!((sum - 2.0).abs() < 0.04, "{height_m} m: {sum}");
        }
    }
}
