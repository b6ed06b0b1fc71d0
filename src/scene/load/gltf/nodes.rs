//! The forest of nodes: where each stands. Walked without recursion, since files may nest as deep as they like.

use glam::{Affine3A, Mat4, Quat, Vec3};

use super::document::{Document, Node};
use super::{LoadMeshErrorKind, malformed};

/// Every node's transform to the world, by its index.
///
/// # Errors
///
/// A node with two parents, among its own ancestors, or with a transform that is not finite; a root that has a parent.
pub(super) fn world_transforms(document: &Document) -> Result<Vec<Affine3A>, LoadMeshErrorKind> {
    let nodes = &document.nodes;
    let mut has_parent = vec![false; nodes.len()];
    for child in nodes.iter().flat_map(|node| &node.children) {
        if std::mem::replace(&mut has_parent[*child as usize], true) {
            return Err(malformed(&name(*child as usize), "it has two parents"));
        }
    }
    for (scene, root) in document.all_roots() {
        if has_parent[root] {
            let problem = format!("scene {scene} has it as a root, but it has a parent");
            return Err(malformed(&name(root), problem));
        }
    }
    let mut worlds = vec![Affine3A::IDENTITY; nodes.len()];
    let mut reached = vec![false; nodes.len()];
    let mut pending = Vec::new();
    for top in (0..nodes.len()).filter(|&i| !has_parent[i]) {
        pending.push((top, Affine3A::IDENTITY));
        while let Some((index, parent)) = pending.pop() {
            let world = parent * local(&nodes[index], index)?;
            (worlds[index], reached[index]) = (world, true);
            let children = nodes[index].children.iter();
            pending.extend(children.map(|&child| (child as usize, world)));
        }
    }
    // With one parent at most, what no top leads to goes round in a circle.
    match reached.iter().position(|reached| !reached) {
        Some(index) => Err(malformed(&name(index), "it is its own ancestor")),
        None => Ok(worlds),
    }
}

/// The visible nodes of the scene, in the order of the file: each before its children.
pub(super) fn visible(
    document: &Document,
    roots: &[usize],
) -> Result<Vec<usize>, LoadMeshErrorKind> {
    let mut seen = vec![false; document.nodes.len()];
    // The last in is taken first: reversed, nodes come in file order.
    let mut pending: Vec<usize> = roots.iter().rev().copied().collect();
    let mut order = Vec::new();
    while let Some(index) = pending.pop() {
        if std::mem::replace(&mut seen[index], true) {
            return Err(malformed(&name(index), "the scene has it as a root twice"));
        }
        let node = &document.nodes[index];
        if node.is_visible() {
            order.push(index);
            pending.extend(node.children.iter().rev().map(|&child| child as usize));
        }
    }
    Ok(order)
}

fn name(node: usize) -> String {
    format!("node {node}")
}

fn local(node: &Node, index: usize) -> Result<Affine3A, LoadMeshErrorKind> {
    let local = match &node.matrix {
        Some(matrix) => Affine3A::from_mat4(Mat4::from_cols_array(matrix)),
        None => {
            let vec3 = |v: &Option<Box<[f32; 3]>>, default| {
                v.as_ref().map_or(default, |v| Vec3::from_array(**v))
            };
            Affine3A::from_scale_rotation_translation(
                vec3(&node.scale, Vec3::ONE),
                node.rotation.as_ref().map_or(Quat::IDENTITY, |q| unit(**q)),
                vec3(&node.translation, Vec3::ZERO),
            )
        }
    };
    if local.is_finite() {
        Ok(local)
    } else {
        Err(malformed(&name(index), "its transform is not finite"))
    }
}

/// The unit quaternion that is meant: files round its numbers. One without a direction turns nothing.
pub(super) fn unit(q: [f32; 4]) -> Quat {
    let q = Quat::from_array(q);
    let length = q.length();
    if length > 0.0 && length.is_finite() {
        q / length
    } else {
        Quat::IDENTITY
    }
}
