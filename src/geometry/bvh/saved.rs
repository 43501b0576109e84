//! Trees that are saved with a scene: what is below what, for every width of node, without boxes.
//!
//! Control side. Boxes and corners are computed again from the mesh, so a saved tree holds for every instruction set and can
//! be wrong only in what is below what, which is checked: every node and every triangle is reached exactly once.

use glam::Vec3;

use super::build::{Item, Measures, items_of, leaf_blocks, wide};
use super::node::{NO_TRIANGLE, Node};
use super::split::{binary_tree, crossed};
use super::traverse::STACK;
use super::{Bvh, InstructionSet, Nodes};
use crate::binary::stored;
use crate::geometry::aabb::Aabb;

/// Link of an unused lane.
const UNUSED: u32 = u32::MAX;

/// A tree of nodes of at most `W` children.
struct Topology<const W: usize> {
    /// Links of each node: indices of nodes, all greater than its own, followed by those of leaves.
    links: Vec<[u32; W]>,
    /// Triangles of each leaf; [`NO_TRIANGLE`] in unused lanes.
    leaves: Vec<[u32; 4]>,
}

stored!(Topology<8> { links: Vec<[u32; 8]>, leaves: Vec<[u32; 4]> });
stored!(Topology<4> { links: Vec<[u32; 4]>, leaves: Vec<[u32; 4]> });

/// The trees of all instruction sets.
pub(crate) struct SavedTree {
    eight: Topology<8>,
    four: Topology<4>,
    crossed_boxes: f64,
}

stored!(SavedTree {
    eight: Topology<8>,
    four: Topology<4>,
    crossed_boxes: f64,
});

impl SavedTree {
    /// The trees that [`Bvh::build`] builds of a mesh, on any machine.
    pub(crate) fn build(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let items = items_of(vertices, triangles, &vec![0; triangles.len()]);
        let boxes = Measures::of(&items).boxes(&items);
        let tree = binary_tree(&boxes);
        Self {
            eight: Topology::of(wide(&tree, &boxes, 0.0)),
            four: Topology::of(wide(&tree, &boxes, 0.0)),
            crossed_boxes: crossed(&tree),
        }
    }

    /// The tree of this machine's instruction set over the mesh that it was saved with; none if it does not fit.
    pub(crate) fn restore(
        &self,
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        groups: &[u32],
    ) -> Option<Bvh> {
        let items = items_of(vertices, triangles, groups);
        if items.is_empty() || items.len() != triangles.len() {
            return None;
        }
        let measures = Measures::of(&items);
        let (nodes, leaves) = match InstructionSet::best() {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 if let Some(avx2) = crate::simd::x86::Avx2::detect() => {
                let nodes = self.eight.boxed(&items, &measures)?;
                (Nodes::Avx2(nodes, avx2), &self.eight.leaves)
            }
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => {
                let nodes = self.four.boxed(&items, &measures)?;
                (Nodes::neon(nodes), &self.four.leaves)
            }
            _ => {
                let nodes = self.four.boxed(&items, &measures)?;
                (Nodes::Scalar(nodes), &self.four.leaves)
            }
        };
        let leaves = leaves.iter().map(used);
        let blocks = leaf_blocks(&items, leaves);
        Some(measures.tree(nodes, blocks, items.len(), self.crossed_boxes))
    }
}

/// The triangles of a leaf.
fn used(leaf: &[u32; 4]) -> &[u32] {
    let count = leaf.iter().position(|&t| t == NO_TRIANGLE);
    &leaf[..count.unwrap_or(leaf.len())]
}

impl<const W: usize> Topology<W> {
    fn of((nodes, leaves): (Vec<Node<W>>, Vec<Vec<u32>>)) -> Self {
        let links = |node: &Node<W>| {
            // Unused lanes have empty boxes.
            std::array::from_fn(|lane| match node.planes[0][lane] <= node.planes[1][lane] {
                true => node.links[lane],
                false => UNUSED,
            })
        };
        let filled = |leaf: &Vec<u32>| {
            std::array::from_fn(|lane| leaf.get(lane).copied().unwrap_or(NO_TRIANGLE))
        };
        Self {
            links: nodes.iter().map(links).collect(),
            leaves: leaves.iter().map(filled).collect(),
        }
    }

    /// The nodes with their boxes; none if a node or a triangle is not reached exactly once, or the tree is too deep.
    fn boxed(&self, items: &[Item], measures: &Measures) -> Option<Vec<Node<W>>> {
        let count = self.links.len();
        let mut is_reached = vec![false; items.len()];
        let leaf_bounds: Option<Vec<Aabb>> = self
            .leaves
            .iter()
            .map(|leaf| {
                let used = used(leaf);
                used.iter().try_fold(Aabb::default(), |bounds, &triangle| {
                    let item = items.get(triangle as usize)?;
                    let is_first = !std::mem::replace(&mut is_reached[triangle as usize], true);
                    is_first.then(|| bounds.union(&measures.bounds(item)))
                })
            })
            .collect();
        // Bounds of nodes, then of leaves, by link.
        let mut bounds = vec![Aabb::default(); count];
        bounds.extend(leaf_bounds?);
        let mut is_linked = vec![false; bounds.len()];
        let mut nodes = vec![Node::EMPTY; count];
        // Children have greater indices than their parents.
        for index in (0..count).rev() {
            let mut all = Aabb::default();
            for (lane, &link) in self.links[index].iter().enumerate() {
                if link == UNUSED {
                    continue;
                }
                let target = link as usize;
                let is_linked = is_linked.get_mut(target)?;
                if target <= index || std::mem::replace(is_linked, true) {
                    return None;
                }
                nodes[index].set(lane, &bounds[target], measures.slack(), link);
                all = all.union(&bounds[target]);
            }
            bounds[index] = all;
        }
        let is_whole = is_linked.iter().skip(1).all(|&is_linked| is_linked);
        let is_tree = count > 0 && is_whole && is_reached.iter().all(|&is_reached| is_reached);
        (is_tree && self.stack()? <= STACK).then_some(nodes)
    }

    /// Stack entries that a traversal may need; none for a node without children.
    fn stack(&self) -> Option<usize> {
        let mut above = vec![0; self.links.len()];
        let mut most = 0;
        for (index, links) in self.links.iter().enumerate() {
            let children = links.iter().filter(|&&link| link != UNUSED);
            let pending = above[index] + children.clone().count().checked_sub(1)?;
            most = most.max(pending.max(above[index] + 1));
            for &child in children {
                if let Some(above) = above.get_mut(child as usize) {
                    *above = pending;
                }
            }
        }
        Some(most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::binary::{Reader, Stored, Writer};

    fn mesh() -> (Vec<Vec3>, Vec<[u32; 3]>, Vec<u32>) {
        let random = |n: u32| (n.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        let vertex = |n: u32| 30.0 * Vec3::new(random(n), random(n + 7000), random(n + 9000));
        let vertices = (0..900).map(vertex).collect();
        let triangles: Vec<[u32; 3]> = (0..300).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        let groups = (0..300).map(|n| n / 3).collect();
        (vertices, triangles, groups)
    }

    #[test]
    fn a_restored_tree_is_the_built_one() {
        let (vertices, triangles, groups) = mesh();
        let saved = SavedTree::build(&vertices, &triangles);
        let restored = saved.restore(&vertices, &triangles, &groups).unwrap();
        let built = Bvh::build(&vertices, &triangles, &groups);
        assert_eq!(format!("{restored:?}"), format!("{built:?}"));
        // The other width is a tree of the same triangles too.
        let items = items_of(&vertices, &triangles, &groups);
        let measures = Measures::of(&items);
        assert!(saved.four.boxed(&items, &measures).is_some());
        assert!(saved.eight.boxed(&items, &measures).is_some());
    }

    #[test]
    fn a_tree_that_is_none_is_refused() {
        let (vertices, triangles, groups) = mesh();
        let damage = |change: &dyn Fn(&mut Topology<8>, &mut Topology<4>)| {
            let mut saved = SavedTree::build(&vertices, &triangles);
            change(&mut saved.eight, &mut saved.four);
            let mut writer = Writer::default();
            saved.store(&mut writer);
            let bytes = writer.into_bytes();
            let mut reader = Reader::new(&bytes);
            let saved = SavedTree::load(&mut reader);
            assert!(reader.is_sound());
            saved.restore(&vertices, &triangles, &groups).is_some()
        };
        assert!(damage(&|_, _| {}));
        // Its own child, a leaf twice, a leaf that is none, a triangle twice, one that is missing, an empty node.
        assert!(!damage(&|a, b| (a.links[1][0], b.links[1][0]) = (1, 1)));
        assert!(!damage(
            &|a, b| (a.links[0][1], b.links[0][1]) = (a.links[0][0], b.links[0][0])
        ));
        assert!(!damage(
            &|a, b| (a.links[0][0], b.links[0][0]) = (99_999, 99_999)
        ));
        assert!(!damage(
            &|a, b| (a.leaves[0][0], b.leaves[0][0]) = (a.leaves[1][0], b.leaves[1][0])
        ));
        assert!(!damage(
            &|a, b| (a.leaves[0][0], b.leaves[0][0]) = (NO_TRIANGLE, NO_TRIANGLE)
        ));
        assert!(!damage(&|a, b| {
            a.links.push([UNUSED; 8]);
            b.links.push([UNUSED; 4]);
        }));
        let mut saved = SavedTree::build(&vertices, &triangles);
        saved.eight.leaves.clear();
        saved.four.leaves.clear();
        assert!(saved.restore(&vertices, &triangles, &groups).is_none());
    }
}
