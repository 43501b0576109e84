//! Spatial hash: items by grid cell.
//!
//! Control side. Buckets do not store cells: visitors test distances and thereby exclude items of other cells.

/// End of a chain.
const NONE: u32 = u32::MAX;

/// Items with indices from 0 in buckets of a fixed table.
pub(super) struct SpatialHash {
    heads: Vec<u32>,
    next: Vec<u32>,
    shift: u32,
}

impl SpatialHash {
    /// For about `count` items.
    pub(super) fn new(count: usize) -> Self {
        let bits = (count.max(2) * 2).next_power_of_two().trailing_zeros();
        Self {
            heads: vec![NONE; 1 << bits],
            next: Vec::with_capacity(count),
            shift: 64 - bits,
        }
    }

    fn bucket<const N: usize>(&self, cell: [i64; N]) -> usize {
        let mut hash = 0u64;
        for value in cell {
            hash = (hash.rotate_left(26) ^ value as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        }
        (hash >> self.shift) as usize
    }

    /// Inserts the next item into a cell and returns its index.
    pub(super) fn insert<const N: usize>(&mut self, cell: [i64; N]) -> u32 {
        let bucket = self.bucket(cell);
        let index = self.next.len() as u32;
        self.next.push(self.heads[bucket]);
        self.heads[bucket] = index;
        index
    }

    /// Visits the items of all cells from `low` to `high`, some of them twice, and items of other cells, until
    /// `keep_going` returns `false`.
    pub(super) fn visit<const N: usize>(
        &self,
        low: [i64; N],
        high: [i64; N],
        mut keep_going: impl FnMut(u32) -> bool,
    ) {
        let mut cell = low;
        loop {
            let mut index = self.heads[self.bucket(cell)];
            while index != NONE {
                if !keep_going(index) {
                    return;
                }
                index = self.next[index as usize];
            }
            // The next cell in lexicographic order.
            let mut axis = 0;
            while axis < N && cell[axis] >= high[axis] {
                cell[axis] = low[axis];
                axis += 1;
            }
            if axis == N {
                return;
            }
            cell[axis] += 1;
        }
    }
}

/// Index of the cell of a given size that contains a value.
pub(super) fn cell_of(value: f64, size: f64) -> i64 {
    (value / size).floor() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_visits_every_cell_it_touches() {
        let mut index = SpatialHash::new(27);
        for x in -1..2 {
            for y in -1..2 {
                for z in -1..2 {
                    index.insert([x, y, z]);
                }
            }
        }
        let mut seen = [false; 27];
        index.visit([-1, 0, 0], [0, 1, 0], |index| {
            seen[index as usize] = true;
            true
        });
        for (index, x, y) in [(4, -1, 0), (7, -1, 1), (13, 0, 0), (16, 0, 1)] {
            assert!(seen[index], "{x} {y}");
        }
    }
}
