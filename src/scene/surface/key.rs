//! Keys of surfaces, stable across commits.
//!
//! A key is a hash of a surface's quantised plane, its least corner in the file's coordinates, and its material's name.
//! Own.

use std::collections::HashSet;

use glam::DVec3;

/// Step of a normal's components: an edge of 10 m keeps its key when its end moves by less than 1 mm.
const NORMAL_STEP: f64 = 1e-4;

/// Step of offset and corner in metres.
const LENGTH_STEP_M: f64 = 1e-3;

/// Shift of the quantiser in steps. Models are on decimal grids; with step boundaries off every such grid, rounding does
/// not change a key.
const OFF_GRID: f64 = 0.137;

/// Key of a surface from its plane, its least corner and its material's name.
pub(crate) fn key(normal: DVec3, offset_m: f64, corner: DVec3, material: &str) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    for component in normal.to_array() {
        hash = mixed(hash ^ step(component, NORMAL_STEP));
    }
    hash = mixed(hash ^ step(offset_m, LENGTH_STEP_M));
    for component in corner.to_array() {
        hash = mixed(hash ^ step(component, LENGTH_STEP_M));
    }
    for byte in material.bytes() {
        hash = mixed(hash ^ u64::from(byte));
    }
    hash
}

/// Key of an edge from its faces' keys, in either order, and its ends in the file's coordinates.
pub(crate) fn edge_key(faces: [u64; 2], ends: [DVec3; 2]) -> u64 {
    let mut hash = mixed(faces[0].min(faces[1])) ^ faces[0].max(faces[1]);
    for component in ends.iter().flat_map(DVec3::to_array) {
        hash = mixed(hash ^ step(component, LENGTH_STEP_M));
    }
    hash
}

/// Key of a part's surface or edge in one of its instances, whatever its pose.
pub(crate) fn instance_key(key: u64, instance: u32) -> u64 {
    mixed(key ^ mixed(u64::from(instance)))
}

fn step(value: f64, size: f64) -> u64 {
    (value / size + 0.5 + OFF_GRID).floor() as i64 as u64
}

/// The finaliser of SplitMix64 (\[STEELE14\]) after its increment: every input bit reaches every output bit.
fn mixed(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}

/// Unique keys: the first of equal keys stays, later ones are rehashed until unique. The result depends on the order of the
/// list, which must not depend on a file.
pub(crate) fn distinct(keys: &[u64]) -> Vec<u64> {
    let mut taken: HashSet<u64> = HashSet::with_capacity(keys.len());
    let repeated: Vec<bool> = keys.iter().map(|&key| !taken.insert(key)).collect();
    keys.iter()
        .zip(repeated)
        .map(|(&key, repeated)| {
            let mut key = key;
            while repeated && !taken.insert(key) {
                key = mixed(key);
            }
            key
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_keys_are_rehashed_and_first_ones_stay() {
        let keys = [7, 7, mixed(7), 9, 7, 9];
        let result = distinct(&keys);
        assert_eq!((result[0], result[2], result[3]), (7, mixed(7), 9));
        let different: HashSet<u64> = result.iter().copied().collect();
        assert_eq!(different.len(), keys.len());
        assert_eq!(distinct(&keys), result);
    }

    #[test]
    fn last_bits_on_a_decimal_grid_do_not_change_a_key() {
        for millimetres in [0.0, 0.5, 12.5, 1000.0, -2.5] {
            let offset_m = millimetres / 1000.0;
            let of = |o: f64| key(DVec3::Y, o, DVec3::splat(o), "a");
            assert_eq!(of(offset_m), of(offset_m + 1e-9));
            assert_eq!(of(offset_m), of(offset_m - 1e-9));
        }
    }
}
