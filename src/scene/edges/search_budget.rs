//! Bounds of the search for pairs of edges, in counted work.
//!
//! A scene of many edges within reach of each other, or of triangles that overlap by thousands, shares a fixed amount of
//! work among its edges: commit takes no longer than a second for it. The benchmark scenes stay below it.

/// Comparisons of one edge with others, where edges are few.
const MOST_COMPARED: usize = 4096;

/// Comparisons of all edges: those of 2048 edges that compare as many as they may.
const MOST_COMPARED_IN_ALL: usize = 2048 * MOST_COMPARED;

/// Boxes that all sight lines intersect, by estimate.
const MOST_BOXES_IN_ALL: f64 = (1u64 << 28) as f64;

/// Sight lines of the pairs that an edge tests: six of a near pair and six of a pair across a wide face.
const LINES_A_PAIR: f64 = 12.0;

/// Work for each edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SearchBudget {
    /// Most edges that an edge is compared with.
    pub(super) compared: usize,
    /// Most of them that are tested by sight lines; none where a single test is too much work.
    pub(super) tested: usize,
}

/// Most pieces of each edge that are tested by so many rays each; none where a single one is too much work.
pub(super) fn pieces(edges: usize, rays: f64, crossed_boxes: f64) -> usize {
    let boxes = edges.max(1) as f64 * rays * crossed_boxes.max(1.0);
    (MOST_BOXES_IN_ALL / boxes) as usize
}

impl SearchBudget {
    /// For a number of edges, in a scene where a line intersects so many boxes.
    pub(super) fn new(edges: usize, crossed_boxes: f64) -> Self {
        let edges = edges.max(1);
        let boxes = edges as f64 * LINES_A_PAIR * crossed_boxes.max(1.0);
        let tested = (MOST_BOXES_IN_ALL / boxes) as usize;
        let compared = match tested {
            0 => 0,
            _ => MOST_COMPARED.min(MOST_COMPARED_IN_ALL / edges),
        };
        Self { compared, tested }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_edges_together_stay_within_the_budget() {
        for edges in [0, 1, 1516, 2048, 15_000, 32_768, 131_072] {
            for crossed_boxes in [0.0, 1.0, 30.0, 1000.0, 1e6] {
                let budget = SearchBudget::new(edges, crossed_boxes);
                assert!(budget.compared * edges <= MOST_COMPARED_IN_ALL);
                let lines = (budget.tested * edges) as f64 * LINES_A_PAIR;
                assert!(lines * crossed_boxes <= MOST_BOXES_IN_ALL);
                let rays = (pieces(edges, 8.0, crossed_boxes) * edges) as f64 * 8.0;
                assert!(rays * crossed_boxes <= MOST_BOXES_IN_ALL);
            }
        }
        // As many edges as the largest benchmark scene has are compared and tested as before.
        let budget = SearchBudget::new(1516, 200.0);
        assert!(budget.compared == MOST_COMPARED && budget.tested >= 48);
        assert!(pieces(1516, 8.0, 200.0) >= 32);
    }
}
