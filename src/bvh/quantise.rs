//! Boxes into a CWBVH node's bytes, rounded outward in every case, and refit of a whole tree.
//!
//! A node holds its children's boxes as bytes on a grid: plane = p + q e, p the corner of the node's
//! box, e a power of two per axis (Ylitie, Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs
//! Through Compressed Wide BVHs", HPG 2017). obvhs computes q in f32, where p's subtraction can round
//! a plane inward by half an ulp of the scene; here it is done in f64 with a margin.

use glam::Vec3;
use obvhs::cwbvh::{CwBvh, node::CwBvhNode};

use crate::ray::Aabb;

/// More than the relative error of the f64 arithmetic below, far less than a step of the grid.
const MARGIN: f64 = 1e-12;

/// Largest byte on the grid.
const LAST: f64 = 255.0;

/// Boxes of what a tree is over, and of its nodes.
#[derive(Default)]
pub(super) struct Boxes {
    primitives: Vec<Aabb>,
    nodes: Vec<Aabb>,
}

impl Boxes {
    /// The box over everything.
    pub(super) fn all(&self) -> Aabb {
        self.nodes.first().copied().unwrap_or(Aabb::EMPTY)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.primitives[..]) + size_of_val(&self.nodes[..])
    }

    /// Takes new boxes, of as many primitives as before, or the first ones: recomputes the boxes, bottom-up, of every node that has
    /// another one below it.
    ///
    /// The tree's shape stays, so after large changes it is correct but slower than a new one.
    pub(super) fn refit(&mut self, bvh: &mut CwBvh, boxes: &[Aabb]) {
        let is_new = |prim: usize| self.primitives.get(prim) != Some(&boxes[prim]);
        self.nodes.resize(bvh.nodes.len(), Aabb::EMPTY);
        let mut changed = vec![false; bvh.nodes.len()];
        // A child is stored after its parent, so that backwards is bottom-up.
        for index in (0..bvh.nodes.len()).rev() {
            let node = &mut bvh.nodes[index];
            let mut children = [Aabb::EMPTY; 8];
            for (slot, child) in children.iter_mut().enumerate() {
                if node.is_child_empty(slot) {
                    continue;
                }
                if node.is_leaf(slot) {
                    let (first, count) = node.child_primitives(slot);
                    for &prim in &bvh.primitive_indices[first as usize..(first + count) as usize] {
                        changed[index] |= is_new(prim as usize);
                        *child = child.union(boxes[prim as usize]);
                    }
                } else {
                    let below = node.child_node_index(slot) as usize;
                    changed[index] |= changed[below];
                    *child = self.nodes[below];
                }
            }
            if changed[index] {
                let total = children.into_iter().fold(Aabb::EMPTY, Aabb::union);
                quantise(node, &children, total);
                self.nodes[index] = total;
            }
        }
        self.primitives.clear();
        self.primitives.extend_from_slice(boxes);
    }
}

/// Writes the boxes of a node's children; those of empty slots are ignored. `total` encloses them all.
pub(super) fn quantise(node: &mut CwBvhNode, children: &[Aabb; 8], total: Aabb) {
    node.p = total.min;
    for axis in 0..3 {
        let corner = f64::from(total.min[axis]);
        let exponent = grid_exponent(f64::from(total.max[axis]) - corner);
        node.e[axis] = exponent;
        let step = f64::from(f32::from_bits(u32::from(exponent) << 23));
        let (low, high) = match axis {
            0 => (&mut node.child_min_x, &mut node.child_max_x),
            1 => (&mut node.child_min_y, &mut node.child_max_y),
            _ => (&mut node.child_min_z, &mut node.child_max_z),
        };
        let on_grid = |plane: Vec3| (f64::from(plane[axis]) - corner) / step;
        for (slot, child) in children.iter().enumerate() {
            if child.is_valid() {
                // A float to integer cast saturates, and 255 is enough by the choice of the exponent.
                low[slot] = (on_grid(child.min) * (1.0 - MARGIN)).floor() as u8;
                high[slot] = (on_grid(child.max) * (1.0 + MARGIN)).ceil() as u8;
            }
        }
    }
}

/// The biased f32 exponent of the smallest power of two of which 255 cover `extent`; at least the
/// smallest normal number.
fn grid_exponent(extent: f64) -> u8 {
    let step = extent * (1.0 + MARGIN) / LAST;
    let power = step.max(f64::from(f32::MIN_POSITIVE)).log2();
    // log2 may round a number just above a power of two down to it.
    let mut power = power.ceil() as i32;
    if step > 2f64.powi(power) {
        power += 1;
    }
    // Boxes are far smaller than 2^127, see [`Aabb::is_traceable`].
    (power + 127).clamp(1, 254) as u8
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The plane that a byte stands for, exact in f64 but for its last bits.
    fn plane(node: &CwBvhNode, axis: usize, byte: u8) -> f64 {
        let step = f64::from(f32::from_bits(u32::from(node.e[axis]) << 23));
        f64::from(node.p[axis]) + f64::from(byte) * step
    }

    fn coordinate() -> impl Strategy<Value = f32> {
        (-1.0f32..1.0, -8.0f32..8.0).prop_map(|(m, e)| m * 10f32.powf(e))
    }

    fn boxed() -> impl Strategy<Value = Aabb> {
        [
            [coordinate(), coordinate(), coordinate()],
            [coordinate(), coordinate(), coordinate()],
        ]
        .prop_map(|[a, b]| Aabb::EMPTY.including(a.into()).including(b.into()))
    }

    proptest! {
        #[test]
        fn bytes_enclose_the_boxes(a in boxed(), b in boxed()) {
            let mut children = [Aabb::EMPTY; 8];
            children[2] = a;
            children[7] = b;
            let mut node = CwBvhNode::default();
            quantise(&mut node, &children, a.union(b));
            for slot in [2, 7] {
                let low = [node.child_min_x, node.child_min_y, node.child_min_z].map(|q| q[slot]);
                let high = [node.child_max_x, node.child_max_y, node.child_max_z].map(|q| q[slot]);
                for axis in 0..3 {
                    prop_assert!(plane(&node, axis, low[axis]) <= f64::from(children[slot].min[axis]));
                    prop_assert!(plane(&node, axis, high[axis]) >= f64::from(children[slot].max[axis]));
                }
            }
        }

        #[test]
        fn the_grid_is_the_finest_that_covers(extent in 1e-30f64..4e18) {
            let step = 2f64.powi(i32::from(grid_exponent(extent)) - 127);
            prop_assert!(LAST * step >= extent);
            prop_assert!(LAST * step / 2.0 <= extent * (1.0 + 2.0 * MARGIN));
        }
    }
}
