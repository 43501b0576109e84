//! Shared filters: the few filters whose weighted sums come closest to all responses of a set.
//!
//! "Closest" is by the power of the difference, weighted by frequency (octaves count alike from 300 Hz on, instead of hertz),
//! by the solid angle of a direction, and by the inverse root of a response's energy: the ear in the shadow is up to 25 dB
//! quieter and has its share too. The best filters are then principal components, the eigenvectors of a matrix as large as
//! a filter is long.

use std::f64::consts::TAU;

/// Below it all frequencies have the same weight.
const FLAT_BELOW_HZ: f64 = 300.0;
/// Below it responses are made up, and matter less.
const INVENTED_BELOW_HZ: f64 = 150.0;
const INVENTED_WEIGHT: f64 = 0.1;
/// Least weight, at high frequencies.
const LEAST_WEIGHT: f64 = 0.02;
/// Frequencies at which the weight is summed up.
const WEIGHT_STEPS: usize = 2048;
/// Exponent of a response's energy in its weight.
const ENERGY_EXPONENT: f64 = -0.5;
/// Sweeps of the eigenvalue iteration, which converges quadratically; about eight are needed.
const MOST_SWEEPS: usize = 20;

/// Filters and the weights of all directions and ears.
pub(super) struct SharedFilters {
    basis: Vec<Vec<f64>>,
    /// Ordered by direction, then by ear, then by filter.
    weights: Vec<f64>,
}

impl SharedFilters {
    /// Responses of the left and the right ear by direction, and the directions' solid angles.
    pub(super) fn new(
        responses: &[Vec<Vec<f64>>; 2],
        areas: &[f64],
        components: usize,
        rate_hz: u32,
    ) -> Self {
        let taps = responses[0].first().map_or(0, Vec::len);
        let root = cholesky(&frequency_metric(taps, f64::from(rate_hz)));
        // Coordinates in which the weighted power is a sum of squares.
        let [left, right] = responses.each_ref().map(|ear| {
            let rows = ear.iter().map(|response| times(response, &root));
            rows.collect::<Vec<Vec<f64>>>()
        });
        let mut gram = vec![vec![0.0; taps]; taps];
        for (row, area) in left.iter().zip(areas).chain(right.iter().zip(areas)) {
            let energy: f64 = row.iter().map(|x| x * x).sum();
            let weight = area * energy.max(1e-12).powf(ENERGY_EXPONENT);
            for (sums, a) in gram.iter_mut().zip(row) {
                let scaled = weight * a;
                for (sum, b) in sums.iter_mut().zip(row) {
                    *sum += scaled * b;
                }
            }
        }
        let vectors = largest_eigenvectors(gram, components);
        // Back to samples; filters of unit energy, so that weights have the size of responses.
        let mut scales = Vec::with_capacity(vectors.len());
        let mut basis = Vec::with_capacity(vectors.len());
        for vector in &vectors {
            let filter = solve_transposed(&root, vector);
            let size = filter.iter().map(|x| x * x).sum::<f64>().sqrt();
            basis.push(filter.iter().map(|x| x / size).collect());
            scales.push(size);
        }
        let mut weights = Vec::with_capacity(2 * left.len() * components);
        for (left, right) in left.iter().zip(&right) {
            for row in [left, right] {
                for (vector, scale) in vectors.iter().zip(&scales) {
                    let product: f64 = row.iter().zip(vector).map(|(a, b)| a * b).sum();
                    weights.push(product * scale);
                }
            }
        }
        Self { basis, weights }
    }

    pub(super) fn basis(&self) -> &[Vec<f64>] {
        &self.basis
    }

    /// Weights of a direction's ear.
    pub(super) fn weights(&self, direction: usize, ear: usize) -> &[f64] {
        let components = self.basis.len();
        &self.weights[(2 * direction + ear) * components..][..components]
    }
}

/// The matrix M with which `xᵀ M x` is the weighted power of a response: the weight's autocorrelation.
fn frequency_metric(taps: usize, rate_hz: f64) -> Vec<Vec<f64>> {
    let weight = |hz: f64| {
        let weight = 1.0 / (1.0 + hz / FLAT_BELOW_HZ) + LEAST_WEIGHT;
        if hz < INVENTED_BELOW_HZ {
            INVENTED_WEIGHT * weight
        } else {
            weight
        }
    };
    let step_hz = 0.5 * rate_hz / WEIGHT_STEPS as f64;
    let lag = |lag: usize| -> f64 {
        let terms = (0..WEIGHT_STEPS).map(|n| {
            let hz = (n as f64 + 0.5) * step_hz;
            weight(hz) * (TAU * hz / rate_hz * lag as f64).cos()
        });
        terms.sum::<f64>() / WEIGHT_STEPS as f64
    };
    let lags: Vec<f64> = (0..taps).map(lag).collect();
    let row = |i: usize| (0..taps).map(|j| lags[i.abs_diff(j)]).collect();
    (0..taps).map(row).collect()
}

/// The lower triangle L of a positive matrix `L Lᵀ`.
fn cholesky(matrix: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let size = matrix.len();
    let mut root = vec![vec![0.0; size]; size];
    for i in 0..size {
        for j in 0..=i {
            let products = root[i][..j].iter().zip(&root[j][..j]);
            let left = matrix[i][j] - products.map(|(a, b)| a * b).sum::<f64>();
            root[i][j] = match i == j {
                true => left.max(1e-12).sqrt(),
                false => left / root[j][j],
            };
        }
    }
    root
}

/// `x L`.
fn times(x: &[f64], root: &[Vec<f64>]) -> Vec<f64> {
    let mut product = vec![0.0; x.len()];
    for (value, row) in x.iter().zip(root) {
        for (sum, entry) in product.iter_mut().zip(row) {
            *sum += value * entry;
        }
    }
    product
}

/// The y with `Lᵀ y = x`, so that `y · response` is `x` in weighted coordinates: `yᵀ = xᵀ L⁻¹`.
fn solve_transposed(root: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    let size = x.len();
    let mut y = vec![0.0; size];
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|j| root[j][i] * y[j]).sum();
        y[i] = (x[i] - known) / root[i][i];
    }
    y
}

/// Eigenvectors of a symmetric matrix for its largest eigenvalues, in their order, by Jacobi rotations. The largest entry of
/// each is positive.
fn largest_eigenvectors(mut matrix: Vec<Vec<f64>>, count: usize) -> Vec<Vec<f64>> {
    let size = matrix.len();
    // Rows are eigenvectors in the end.
    let mut vectors = vec![vec![0.0; size]; size];
    for (i, row) in vectors.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    let total: f64 = (0..size).map(|i| matrix[i][i].abs()).sum();
    for _ in 0..MOST_SWEEPS {
        let mut largest = 0.0_f64;
        for p in 0..size {
            for q in p + 1..size {
                largest = largest.max(matrix[p][q].abs());
                rotate(&mut matrix, &mut vectors, p, q);
            }
        }
        if largest <= 1e-15 * total {
            break;
        }
    }
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|a, b| matrix[*b][*b].total_cmp(&matrix[*a][*a]));
    let signed = |index: usize| {
        let vector = &vectors[index];
        let peak = vector
            .iter()
            .copied()
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        vector.iter().map(|x| x * peak.signum()).collect()
    };
    order.into_iter().take(count).map(signed).collect()
}

/// Turns rows and columns p and q so that entry (p, q) becomes zero.
fn rotate(matrix: &mut [Vec<f64>], vectors: &mut [Vec<f64>], p: usize, q: usize) {
    let entry = matrix[p][q];
    if entry == 0.0 {
        return;
    }
    let half = 0.5 * (matrix[q][q] - matrix[p][p]) / entry;
    let tangent = half.signum() / (half.abs() + half.hypot(1.0));
    let cosine = tangent.hypot(1.0).recip();
    let sine = tangent * cosine;
    turn_rows(matrix, p, q, cosine, sine);
    for row in matrix.iter_mut() {
        let (a, b) = (row[p], row[q]);
        row[p] = cosine * a - sine * b;
        row[q] = sine * a + cosine * b;
    }
    turn_rows(vectors, p, q, cosine, sine);
}

fn turn_rows(rows: &mut [Vec<f64>], p: usize, q: usize, cosine: f64, sine: f64) {
    let (before, from) = rows.split_at_mut(q);
    for (a, b) in before[p].iter_mut().zip(&mut from[0]) {
        (*a, *b) = (cosine * *a - sine * *b, sine * *a + cosine * *b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric matrix that is its own eigenvalues in another basis.
    #[test]
    fn eigenvectors_are_stretched_by_descending_values() {
        let size = 24;
        let entry = |i: usize, j: usize| {
            (std::f64::consts::PI * (i * j) as f64 / 7.0).cos()
                + if i == j { i as f64 } else { 0.0 }
        };
        let matrix: Vec<Vec<f64>> = (0..size)
            .map(|i| (0..size).map(|j| entry(i, j)).collect())
            .collect();
        let vectors = largest_eigenvectors(matrix.clone(), size);
        let mut last = f64::MAX;
        for vector in &vectors {
            let image: Vec<f64> = matrix
                .iter()
                .map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
                .collect();
            let value: f64 = image.iter().zip(vector).map(|(a, b)| a * b).sum();
            for (a, b) in image.iter().zip(vector) {
                assert!((a - value * b).abs() < 1e-9 * size as f64);
            }
            assert!(value <= last + 1e-9);
            last = value;
        }
    }

    /// As many filters as taps represent every response.
    #[test]
    fn all_filters_together_are_exact() {
        let taps = 12;
        let response = |n: usize| {
            (0..taps)
                .map(|t| ((n * 7 + t * t) as f64).sin())
                .collect::<Vec<f64>>()
        };
        let ears = [
            (0..40).map(response).collect::<Vec<_>>(),
            (40..80).map(response).collect(),
        ];
        let filters = SharedFilters::new(&ears, &[0.025; 40], taps, 48_000);
        for (ear, responses) in ears.iter().enumerate() {
            for (direction, response) in responses.iter().enumerate() {
                let weights = filters.weights(direction, ear);
                for (tap, value) in response.iter().enumerate() {
                    let sum: f64 = weights
                        .iter()
                        .zip(filters.basis())
                        .map(|(w, b)| w * b[tap])
                        .sum();
                    assert!((sum - value).abs() < 1e-6, "{sum} {value}");
                }
            }
        }
    }
}
