//! One obvhs tree over boxes: build, refit, traversal.

use std::ops::ControlFlow;

use glam::{UVec2, Vec3A};
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::{CwBvh, node::CwBvhNode};
use obvhs::ploc::PlocBuilder;
use obvhs::{BvhBuildParams, aabb::Aabb as ObvhsAabb};

use super::BvhError;
use super::quantise::Boxes;
use super::slabs::NodeRay;
use crate::ray::{Aabb, Ray};

/// obvhs's traversal stack holds this many levels and panics beyond.
const MAX_DEPTH: u32 = 31;

/// A tree over numbered boxes.
pub(super) struct Tree {
    bvh: CwBvh,
    boxes: Boxes,
}

impl Tree {
    /// A tree over finite `boxes` (none is fine) with at most `leaf_size` (1 .. 3) of them per leaf.
    pub(super) fn build(boxes: &[Aabb], leaf_size: u32) -> Result<Self, BvhError> {
        let params = BvhBuildParams::medium_build();
        // The builder squares and sums: far out that would overflow, and near 0 vanish.
        let reach = boxes.iter().map(Aabb::reach).fold(0.0, f32::max);
        let scale = if reach.is_normal() {
            reach.recip()
        } else {
            1.0
        };
        let leaves: Vec<ObvhsAabb> = (0u32..)
            .zip(boxes)
            .map(|(index, &Aabb { min, max })| {
                let scaled = Aabb {
                    min: min * scale,
                    max: max * scale,
                };
                scattered(scaled, index)
            })
            .collect();
        let mut bvh2 = PlocBuilder::with_capacity(leaves.len()).build(
            params.ploc_search_distance,
            &leaves,
            (0..leaves.len() as u32).collect(),
            params.sort_precision,
            params.search_depth_threshold,
        );
        ReinsertionOptimizer::default().run(&mut bvh2, params.reinsertion_batch_ratio, None);
        let mut bvh = bvh2_to_cwbvh(&bvh2, leaf_size, true, false);
        bvh.nodes.shrink_to_fit();
        let depth = depth(&bvh);
        if depth > MAX_DEPTH {
            return Err(BvhError::TooDeep {
                depth,
                max: MAX_DEPTH,
            });
        }
        let mut tree = Self {
            bvh,
            boxes: Boxes::default(),
        };
        tree.refit(boxes);
        Ok(tree)
    }

    /// Takes the same number of new boxes, and keeps the tree's shape.
    pub(super) fn refit(&mut self, boxes: &[Aabb]) {
        self.boxes.refit(&mut self.bvh, boxes);
    }

    /// The box over everything.
    pub(super) fn bounds(&self) -> Aabb {
        self.boxes.all()
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let tree = size_of_val(&self.bvh.nodes[..]) + size_of_val(&self.bvh.primitive_indices[..]);
        tree + self.boxes.bytes()
    }

    /// Visits the boxes that `ray` meets, roughly front to back. `visit` answers with the parameter
    /// beyond which it wants no more, or stops. Returns whether it stopped.
    #[inline]
    pub(super) fn traverse(
        &self,
        ray: &Ray,
        mut visit: impl FnMut(u32) -> ControlFlow<(), f32>,
    ) -> bool {
        let slabs = NodeRay::new(ray);
        let mut tfar = ray.tfar;
        let mut state = self.bvh.new_traversal(ray.direction.into());
        let mut node: &CwBvhNode;
        obvhs::traverse!(
            self.bvh,
            node,
            state,
            slabs.hits(node, state.oct_inv4, tfar),
            {
                match visit(self.bvh.primitive_indices[state.primitive_id as usize]) {
                    ControlFlow::Continue(limit) => tfar = limit,
                    ControlFlow::Break(()) => return true,
                }
            }
        );
        false
    }
}

/// Largest move by [`scattered`], of the box's diagonal.
const SCATTER: f32 = 1e-3;

/// The box, moved a little in a direction of its own.
///
/// obvhs's builder pairs neighbours. Among equal boxes it finds one pair per pass, so that n of them would take n passes
/// and make a chain; scattered ones pair at once. The tree gets its exact boxes afterwards, from `refit`.
fn scattered(bounds: Aabb, index: u32) -> ObvhsAabb {
    let mut bits = index;
    let shift = [0; 3].map(|_| {
        // The finaliser of MurmurHash3, whose bits look random.
        bits = (bits ^ 0x9e37_79b9).wrapping_mul(0x85eb_ca6b);
        bits = (bits ^ (bits >> 13)).wrapping_mul(0xc2b2_ae35);
        bits ^= bits >> 16;
        bits as f32 / u32::MAX as f32
    });
    let shift = Vec3A::from(shift) * SCATTER * bounds.diagonal();
    ObvhsAabb::new(
        Vec3A::from(bounds.min) + shift,
        Vec3A::from(bounds.max) + shift,
    )
}

/// Levels below the root.
fn depth(bvh: &CwBvh) -> u32 {
    let mut levels = vec![0; bvh.nodes.len()];
    for (index, node) in bvh.nodes.iter().enumerate() {
        for slot in 0..8 {
            if !node.is_child_empty(slot) && !node.is_leaf(slot) {
                levels[node.child_node_index(slot) as usize] = levels[index] + 1;
            }
        }
    }
    levels.into_iter().max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn cube(center: Vec3, half: f32) -> Aabb {
        Aabb {
            min: center - half,
            max: center + half,
        }
    }

    fn visited(tree: &Tree, ray: &Ray) -> Vec<u32> {
        let mut seen = Vec::new();
        tree.traverse(ray, |prim| {
            seen.push(prim);
            ControlFlow::Continue(ray.tfar)
        });
        seen.sort_unstable();
        seen
    }

    #[test]
    fn nothing_is_found_in_nothing() {
        let tree = Tree::build(&[], 3).unwrap();
        assert!(!tree.bounds().is_valid());
        assert!(visited(&tree, &Ray::new(Vec3::ZERO, Vec3::X)).is_empty());
    }

    #[test]
    fn a_row_is_visited_whole_and_follows_a_refit() {
        for leaf_size in 1..=3 {
            for count in [1u32, 2, 3, 9, 100] {
                let row = |y: f32| -> Vec<Aabb> {
                    (0..count)
                        .map(|i| cube(Vec3::new(2.0 * i as f32, y, 0.0), 0.5))
                        .collect()
                };
                let mut tree = Tree::build(&row(0.0), leaf_size).unwrap();
                let along = |y: f32| Ray::new(Vec3::new(-5.0, y, 0.0), Vec3::X);
                let all: Vec<u32> = (0..count).collect();
                assert_eq!(visited(&tree, &along(0.0)), all);
                assert!(visited(&tree, &along(10.0)).is_empty());
                tree.refit(&row(10.0));
                assert!(visited(&tree, &along(0.0)).is_empty());
                assert_eq!(visited(&tree, &along(10.0)), all);
                assert_eq!(tree.bounds().max.y, 10.5);
            }
        }
    }

    #[test]
    fn identical_boxes_neither_panic_nor_get_lost() {
        let tree = Tree::build(&[cube(Vec3::ONE, 0.5); 20_000], 1).unwrap();
        let ray = Ray::new(Vec3::ZERO, Vec3::ONE);
        assert_eq!(visited(&tree, &ray).len(), 20_000);
    }

    #[test]
    fn a_stop_stops() {
        let tree = Tree::build(&[cube(Vec3::ONE, 0.5); 20], 3).unwrap();
        let mut calls = 0;
        let stopped = tree.traverse(&Ray::new(Vec3::ZERO, Vec3::ONE), |_| {
            calls += 1;
            ControlFlow::Break(())
        });
        assert!(stopped && calls == 1);
    }
}
