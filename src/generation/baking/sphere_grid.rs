//! Interpolation from measured directions to the grid of a set, as weights of measurements.
//!
//! Where measurements lie around a grid point, by a thin-plate spline through the nearest ones in the tangent plane \[DUCHON77\]:
//! exact at measurements, smooth in between. Where they leave a gap, such as below the listener, the gap is first filled with
//! means whose width grows with the distance to the nearest measurement: below the middle of a ring its mean.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::error::{Error, Result};
use crate::generation::binaural::baked_set::Directions;

/// Measurements nearer to each other than this are one, in radians: 3 degrees, the grid has 5.
const SAME: f64 = 0.052;
/// Distance to the nearest measurement from which a gap is filled: 12 degrees.
const GAP: f64 = 0.21;
/// Largest distance to the nearest measurement: 75 degrees. Many sets have none below −30.
const WIDEST_GAP: f64 = 1.31;
/// Points that are tried for gaps, evenly over the sphere, 8 degrees apart.
const FILLING_POINTS: usize = 600;
/// Measurements of a spline.
const NEIGHBOURS: usize = 24;
/// Weights of means below this share of the largest are left out.
const LEAST_WEIGHT: f64 = 1e-3;

/// A weighted sum of measurements.
type Sum = Vec<(usize, f64)>;

/// The grid of a set and its interpolation.
pub(super) struct SphereGrid {
    /// Unit vectors (+x right, +y up, −z ahead), by elevation, then by azimuth.
    pub(super) points: Vec<DVec3>,
    /// Shares of the sphere; their sum is 1.
    pub(super) areas: Vec<f64>,
    sums: Vec<Sum>,
}

impl SphereGrid {
    /// Errors: [`Error::Format`] with `name` if directions leave too large a gap.
    pub(super) fn new(directions: &[DVec3], grid: Directions, name: &str) -> Result<Self> {
        let (points, areas) = grid_points(grid);
        let mut known: Vec<(DVec3, Sum)> = directions
            .iter()
            .enumerate()
            .map(|(index, direction)| (*direction, vec![(index, 1.0)]))
            .collect();
        let measured = known.len();
        for point in evenly_spread(FILLING_POINTS) {
            let (_, distance) = nearest(directions, point);
            if distance > WIDEST_GAP {
                return Err(gap_error(point, distance, name));
            }
            if distance > GAP {
                known.push((point, mean_around(&known[..measured], point, distance)));
            }
        }
        let sums = points.iter().map(|point| spline(&known, *point)).collect();
        Ok(Self {
            points,
            areas,
            sums,
        })
    }

    /// Values of the grid from values of the measurements.
    pub(super) fn interpolate(&self, values: &[f64]) -> Vec<f64> {
        let sum = |sum: &Sum| {
            sum.iter()
                .map(|(index, weight)| weight * values[*index])
                .sum()
        };
        self.sums.iter().map(sum).collect()
    }

    /// Rows of the grid from rows of the measurements.
    pub(super) fn interpolate_rows(&self, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let sum = |sum: &Sum| {
            let mut row = vec![0.0; rows[0].len()];
            for (index, weight) in sum {
                for (value, of_one) in row.iter_mut().zip(&rows[*index]) {
                    *value += weight * of_one;
                }
            }
            row
        };
        self.sums.iter().map(sum).collect()
    }

    /// Values of the grid, averaged with a Gaussian kernel of a standard deviation in radians.
    pub(super) fn smooth(&self, values: &[f64], deviation: f64) -> Vec<f64> {
        let around = |centre: &DVec3| {
            let mut sums = [0.0; 2];
            for ((point, area), value) in self.points.iter().zip(&self.areas).zip(values) {
                let closeness = (centre.dot(*point) - 1.0) / (deviation * deviation);
                if closeness > -20.0 {
                    let weight = area * closeness.exp();
                    sums[0] += weight * value;
                    sums[1] += weight;
                }
            }
            sums[0] / sums[1]
        };
        self.points.iter().map(around).collect()
    }
}

/// Indices of directions that are at least [`SAME`] apart.
pub(super) fn apart(directions: &[DVec3]) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    let limit = SAME.cos();
    for (index, direction) in directions.iter().enumerate() {
        if kept
            .iter()
            .all(|other| directions[*other].dot(*direction) < limit)
        {
            kept.push(index);
        }
    }
    kept
}

/// Shares of the sphere for which directions are the nearest; their sum is 1.
pub(super) fn shares(directions: &[DVec3], grid: Directions) -> Vec<f64> {
    let (points, areas) = grid_points(grid);
    let mut shares = vec![0.0; directions.len()];
    for (point, area) in points.iter().zip(areas) {
        shares[nearest(directions, *point).0] += area;
    }
    shares
}

fn grid_points(grid: Directions) -> (Vec<DVec3>, Vec<f64>) {
    let mut points = Vec::with_capacity(grid.azimuths * grid.elevations);
    let mut areas = Vec::with_capacity(points.capacity());
    let step = PI / (grid.elevations - 1) as f64;
    for row in 0..grid.elevations {
        let rise = row as f64 * step - 0.5 * PI;
        let [low, high] =
            [rise - 0.5 * step, rise + 0.5 * step].map(|edge| edge.clamp(-0.5 * PI, 0.5 * PI));
        let area = 0.5 * (high.sin() - low.sin()) / grid.azimuths as f64;
        // At the poles all azimuths are one direction.
        let across = if row == 0 || row + 1 == grid.elevations {
            0.0
        } else {
            rise.cos()
        };
        for column in 0..grid.azimuths {
            let (sin, cos) = (TAU * column as f64 / grid.azimuths as f64).sin_cos();
            points.push(DVec3::new(-across * sin, rise.sin(), -across * cos));
            areas.push(area);
        }
    }
    (points, areas)
}

/// Points of a spiral.
fn evenly_spread(count: usize) -> impl Iterator<Item = DVec3> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |n| {
        let y = 1.0 - (2 * n + 1) as f64 / count as f64;
        let across = (1.0 - y * y).sqrt();
        let (sin, cos) = (golden * n as f64).sin_cos();
        DVec3::new(across * cos, y, across * sin)
    })
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    a.dot(b).clamp(-1.0, 1.0).acos()
}

/// The nearest direction and its angle.
fn nearest(directions: &[DVec3], point: DVec3) -> (usize, f64) {
    let mut best = (0, f64::MIN);
    for (index, direction) in directions.iter().enumerate() {
        let cosine = direction.dot(point);
        if cosine > best.1 {
            best = (index, cosine);
        }
    }
    (best.0, best.1.clamp(-1.0, 1.0).acos())
}

fn gap_error(point: DVec3, distance: f64, name: &str) -> Error {
    let elevation = point.y.asin().to_degrees();
    let azimuth = (-point.x).atan2(-point.z).to_degrees();
    let problem = format!(
        "no response within {:.0} degrees of azimuth {azimuth:.0}, elevation {elevation:.0}",
        distance.to_degrees()
    );
    Error::format(
        name,
        None,
        problem,
        "give a set measured all around the head",
    )
}

/// The mean around a point of a gap: as wide as half of the distance to the nearest measurement.
fn mean_around(known: &[(DVec3, Sum)], point: DVec3, distance: f64) -> Sum {
    let width = 0.5 * distance;
    let weight = |direction: DVec3| {
        let away = angle(direction, point);
        (-(away * away - distance * distance) / (2.0 * width * width)).exp()
    };
    let mut sum: Sum = known
        .iter()
        .enumerate()
        .map(|(index, (direction, _))| (index, weight(*direction)))
        .filter(|(_, weight)| *weight > LEAST_WEIGHT)
        .collect();
    let total: f64 = sum.iter().map(|(_, weight)| weight).sum();
    for (_, weight) in &mut sum {
        *weight /= total;
    }
    sum
}

/// The value of the spline through the nearest known points at a point.
fn spline(known: &[(DVec3, Sum)], point: DVec3) -> Sum {
    let mut near: Vec<(usize, f64)> = known
        .iter()
        .enumerate()
        .map(|(index, (direction, _))| (index, direction.dot(point)))
        .collect();
    let by_distance = |a: &(usize, f64), b: &(usize, f64)| match b.1.total_cmp(&a.1) {
        Ordering::Equal => a.0.cmp(&b.0),
        order => order,
    };
    let count = NEIGHBOURS.min(near.len());
    if count < near.len() {
        near.select_nth_unstable_by(count - 1, by_distance);
        near.truncate(count);
    }
    near.sort_by(by_distance);
    let flat: Vec<DVec2> = near
        .iter()
        .map(|(index, _)| tangent(point, known[*index].0))
        .collect();
    let weights = spline_weights(&flat);
    let mut total: Sum = Vec::new();
    for ((index, _), weight) in near.iter().zip(weights) {
        for (measurement, share) in &known[*index].1 {
            match total.iter_mut().find(|(other, _)| other == measurement) {
                Some((_, sum)) => *sum += weight * share,
                None => total.push((*measurement, weight * share)),
            }
        }
    }
    total
}

/// A direction in the tangent plane of a point: its angle and its bearing.
fn tangent(point: DVec3, direction: DVec3) -> DVec2 {
    let (across, along) = point.any_orthonormal_pair();
    let bearing = DVec2::new(direction.dot(across), direction.dot(along));
    bearing.normalize_or_zero() * angle(point, direction)
}

/// Weights of the values at points for the value at the origin.
fn spline_weights(points: &[DVec2]) -> Vec<f64> {
    let count = points.len();
    let reach = points.iter().map(|p| p.length()).fold(1e-6, f64::max);
    let kernel = |distance: f64| match distance > 0.0 {
        true => distance * distance * distance.ln(),
        false => 0.0,
    };
    let mut rows = vec![vec![0.0; count + 4]; count + 3];
    for (i, p) in points.iter().enumerate() {
        let p = *p / reach;
        for (j, q) in points.iter().enumerate() {
            rows[i][j] = kernel((p - *q / reach).length());
        }
        for (j, value) in [1.0, p.x, p.y].into_iter().enumerate() {
            rows[i][count + j] = value;
            rows[count + j][i] = value;
        }
        rows[i][count + 3] = kernel(p.length());
    }
    rows[count][count + 3] = 1.0;
    match solve(rows) {
        Some(mut weights) => {
            weights.truncate(count);
            weights
        }
        // All on a line: means by distance.
        None => {
            let weights = points.iter().map(|p| 1.0 / (1e-4 + p.length_squared()));
            let weights: Vec<f64> = weights.collect();
            let total: f64 = weights.iter().sum();
            weights.iter().map(|weight| weight / total).collect()
        }
    }
}

/// Solves linear equations, a row each with its right-hand side last; `None` if they are singular.
fn solve(mut rows: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let size = rows.len();
    for column in 0..size {
        let pivot = (column..size)
            .max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        if rows[pivot][column].abs() < 1e-10 {
            return None;
        }
        rows.swap(column, pivot);
        let (done, rest) = rows.split_at_mut(column + 1);
        let pivot = &done[column];
        for row in rest {
            let factor = row[column] / pivot[column];
            for (value, above) in row[column..].iter_mut().zip(&pivot[column..]) {
                *value -= factor * above;
            }
        }
    }
    let mut solution = vec![0.0; size];
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|j| rows[i][j] * solution[j]).sum();
        solution[i] = (rows[i][size] - known) / rows[i][i];
    }
    Some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Directions = Directions {
        azimuths: 24,
        elevations: 13,
    };

    /// A smooth function of direction, at 600 points, from 2,000 measurements.
    #[test]
    fn smooth_functions_are_interpolated() {
        let directions: Vec<DVec3> = evenly_spread(2000).collect();
        let value = |d: &DVec3| d.x + d.y * d.z + d.x * d.y * d.z;
        let grid = SphereGrid::new(&directions, GRID, "test").unwrap();
        let values: Vec<f64> = directions.iter().map(value).collect();
        for (point, found) in grid.points.iter().zip(grid.interpolate(&values)) {
            assert!((found - value(point)).abs() < 1e-3, "{point} {found}");
        }
        assert!((grid.areas.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_gap_is_filled_with_means_and_a_wide_one_is_refused() {
        let above = |least: f64| {
            evenly_spread(2000)
                .filter(move |d| d.y > least)
                .collect::<Vec<_>>()
        };
        let directions = above(-0.5);
        let values: Vec<f64> = directions.iter().map(|d| d.x).collect();
        let grid = SphereGrid::new(&directions, GRID, "test").unwrap();
        let filled = grid.interpolate(&values);
        // The nadir has the mean of the lowest ring; nothing leaves the range of the measurements.
        assert!(filled[0].abs() < 0.05, "{}", filled[0]);
        assert!(filled.iter().all(|value| value.abs() < 1.05));
        let refused = SphereGrid::new(&above(0.5), GRID, "half.sofa");
        let text = refused.err().unwrap().to_string();
        assert!(text.starts_with("half.sofa: no response within"), "{text}");
    }
}
