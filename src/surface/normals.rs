//! Smooth vertex normals with creases.
//!
//! The normal of a corner is the average of the unit normals of the faces around it, each weighted by its
//! angle there (Thuermer and Wuethrich, "Computing Vertex Normals from Polygonal Facets", 1998): the
//! triangulation of a flat polygon does not show. Faces count as neighbours by position, bit for bit, not
//! by vertex index, so seams of the texture coordinates stay smooth.
//!
//! Around one position the corners fall into clusters, joined across every edge that is not a crease; a
//! cluster has one normal, and a vertex whose corners lie in several clusters is split. An edge with more
//! than two faces joins those that follow one another in the file.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

/// Faces this close to coplanar (radians) are never parted: rounded coordinates tilt them by as much.
const COPLANAR: f64 = 1e-4;

/// A sum of weighted unit normals shorter than this part of the weights has no direction to speak of.
const CANCELLED: f64 = 1e-6;

/// What `smooth` found.
pub(super) struct Smooth {
    /// Per vertex, the copies last.
    pub normals: Vec<Vec3>,
    /// For each vertex that was added, the one it copies.
    pub copies: Vec<u32>,
    /// The triangles, in order, over the old vertices and the copies.
    pub triangles: Vec<[u32; 3]>,
}

/// The unit vector along `v`, rounded once; zero for zero.
pub(super) fn unit(v: DVec3) -> Vec3 {
    v.normalize_or_zero().as_vec3()
}

/// Computes unit normals. Every triangle must have an area and every vertex a triangle.
///
/// `crease_angle` in radians; at pi or more no edge is a crease, and all faces at a position are averaged
/// even where they share no edge. Faces that cancel each other out (the two sides of a sheet) are parted.
pub(super) fn smooth(positions: &[Vec3], triangles: &[[u32; 3]], crease_angle: f32) -> Smooth {
    let points = weld(positions);
    let welded: Vec<[u32; 3]> = triangles
        .iter()
        .map(|t| t.map(|i| points[i as usize]))
        .collect();
    let faces: Vec<DVec3> = triangles
        .iter()
        .map(|t| face_normal(t.map(|i| positions[i as usize])))
        .collect();
    let mut clusters = Clusters::new(3 * triangles.len());
    if crease_angle >= std::f32::consts::PI {
        join_at_points(&welded, &mut clusters);
    } else {
        let limit = f64::from(crease_angle) + COPLANAR;
        join_across_edges(&welded, &faces, limit, &mut clusters);
    }
    let corner_normals = cluster_normals(positions, triangles, &faces, &mut clusters);
    split(positions.len(), triangles, &corner_normals, &mut clusters)
}

/// For each vertex the first one at the same position.
pub(super) fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len());
    positions
        .iter()
        .enumerate()
        // Adding zero makes -0 and 0 one number.
        .map(|(i, &p)| {
            *first
                .entry((p + Vec3::ZERO).to_array().map(f32::to_bits))
                .or_insert(i as u32)
        })
        .collect()
}

fn face_normal([a, b, c]: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}

/// In [0, pi], exact to rounding also near both ends.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

fn join_at_points(welded: &[[u32; 3]], clusters: &mut Clusters) {
    let mut first = HashMap::new();
    for (corner, &point) in welded.as_flattened().iter().enumerate() {
        clusters.join(*first.entry(point).or_insert(corner), corner);
    }
}

fn join_across_edges(welded: &[[u32; 3]], faces: &[DVec3], limit: f64, clusters: &mut Clusters) {
    // Per edge the last face seen there: its index and its corners at the lower and the higher point.
    let mut last: HashMap<[u32; 2], (usize, [usize; 2])> = HashMap::new();
    for (face, points) in welded.iter().enumerate() {
        for side in 0..3 {
            let mut ends = [side, (side + 1) % 3];
            if points[ends[0]] > points[ends[1]] {
                ends.swap(0, 1);
            }
            let edge = ends.map(|e| points[e]);
            let corners = ends.map(|e| 3 * face + e);
            if let Some((other, others)) = last.insert(edge, (face, corners))
                && angle(faces[face], faces[other]) <= limit
            {
                clusters.join(others[0], corners[0]);
                clusters.join(others[1], corners[1]);
            }
        }
    }
}

/// The unit normal of each corner: its cluster's, or its face's where the cluster's faces cancel out (such
/// corners leave the cluster).
fn cluster_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    faces: &[DVec3],
    clusters: &mut Clusters,
) -> Vec<Vec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); 3 * triangles.len()];
    for (face, corners) in triangles.iter().enumerate() {
        let p = corners.map(|i| positions[i as usize].as_dvec3());
        for k in 0..3 {
            let weight = angle(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            let sum = &mut sums[clusters.root(3 * face + k)];
            sum.0 += weight * faces[face];
            sum.1 += weight;
        }
    }
    let roots: Vec<usize> = (0..sums.len())
        .map(|corner| clusters.root(corner))
        .collect();
    let mut normals = Vec::with_capacity(roots.len());
    for (corner, &root) in roots.iter().enumerate() {
        let (sum, weights) = sums[root];
        if sum.length() > CANCELLED * weights {
            normals.push(unit(sum));
        } else {
            // Every corner of the cluster comes here, so none is left pointing at another.
            clusters.parent[corner] = corner;
            normals.push(unit(faces[corner / 3]));
        }
    }
    normals
}

/// Gives each (vertex, cluster) pair a vertex of its own; the first cluster keeps the old index.
fn split(
    vertices: usize,
    triangles: &[[u32; 3]],
    corner_normals: &[Vec3],
    clusters: &mut Clusters,
) -> Smooth {
    let mut result = Smooth {
        normals: vec![Vec3::ZERO; vertices],
        copies: Vec::new(),
        triangles: triangles.to_vec(),
    };
    let mut owner = vec![None; vertices];
    let mut copies = HashMap::new();
    for (corner, index) in result.triangles.as_flattened_mut().iter_mut().enumerate() {
        let vertex = *index;
        let cluster = clusters.root(corner);
        let first = *owner[vertex as usize].get_or_insert(cluster);
        if first == cluster {
            result.normals[vertex as usize] = corner_normals[corner];
            continue;
        }
        *index = *copies.entry((vertex, cluster)).or_insert_with(|| {
            result.copies.push(vertex);
            result.normals.push(corner_normals[corner]);
            (result.normals.len() - 1) as u32
        });
    }
    result
}

/// Disjoint sets of corners.
struct Clusters {
    parent: Vec<usize>,
}

impl Clusters {
    fn new(corners: usize) -> Self {
        Self {
            parent: (0..corners).collect(),
        }
    }

    fn root(&mut self, mut corner: usize) -> usize {
        while self.parent[corner] != corner {
            self.parent[corner] = self.parent[self.parent[corner]];
            corner = self.parent[corner];
        }
        corner
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use std::f32::consts::{FRAC_PI_2, PI};

    /// Corners by the bits of their index (x, y, z), centred; two triangles a side, wound outward.
    fn cube() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let coordinate = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let positions = (0..8)
            .map(|i| vec3(coordinate(i, 0), coordinate(i, 1), coordinate(i, 2)))
            .collect();
        let sides = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = sides
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        (positions, triangles)
    }

    #[test]
    fn cube_corners_point_along_the_diagonals() {
        let (positions, triangles) = cube();
        let smooth = smooth(&positions, &triangles, PI);
        assert!(smooth.copies.is_empty());
        for (n, p) in smooth.normals.iter().zip(&positions) {
            // Exact: an unweighted average would lean to the side with two triangles at the corner.
            assert_eq!(*n, *p * (1.0 / 3.0_f64.sqrt()) as f32);
        }
    }

    #[test]
    fn a_seam_has_the_same_normal_on_both_sides() {
        let (mut positions, mut triangles) = cube();
        // Every corner its own vertex.
        positions = triangles
            .as_flattened()
            .iter()
            .map(|&i| positions[i as usize])
            .collect();
        for (i, corner) in triangles.as_flattened_mut().iter_mut().enumerate() {
            *corner = i as u32;
        }
        let smooth = smooth(&positions, &triangles, PI);
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        for (i, p) in positions.iter().enumerate() {
            for (j, q) in positions.iter().enumerate() {
                if p == q {
                    assert_eq!(bits(smooth.normals[i]), bits(smooth.normals[j]));
                }
            }
        }
    }

    #[test]
    fn a_cube_creases_below_ninety_degrees_and_not_above() {
        let (positions, triangles) = cube();
        assert!(
            smooth(&positions, &triangles, FRAC_PI_2 + 0.01)
                .copies
                .is_empty()
        );
        for crease_angle in [FRAC_PI_2 - 0.01, 0.0] {
            let sharp = smooth(&positions, &triangles, crease_angle);
            // Three sides meet at each corner; the two triangles of a side share their vertices.
            assert_eq!(sharp.copies.len(), 16);
            let all: Vec<Vec3> = positions
                .iter()
                .copied()
                .chain(sharp.copies.iter().map(|&i| positions[i as usize]))
                .collect();
            for (new, old) in sharp.triangles.iter().zip(&triangles) {
                let face = face_normal(old.map(|i| positions[i as usize])).as_vec3();
                assert_eq!(new.map(|i| sharp.normals[i as usize]), [face; 3]);
                let moved = new.map(|i| all[i as usize]);
                assert_eq!(moved, old.map(|i| positions[i as usize]));
            }
        }
    }

    #[test]
    fn both_sides_of_a_sheet_keep_their_own_normals() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let sheet = smooth(&positions, &[[0, 1, 2], [0, 2, 1]], PI);
        assert_eq!(sheet.copies.len(), 3);
        let normals = |t: usize| sheet.triangles[t].map(|i| sheet.normals[i as usize]);
        assert_eq!(normals(0), [Vec3::Z; 3]);
        assert_eq!(normals(1), [-Vec3::Z; 3]);
    }

    #[test]
    fn minus_zero_and_zero_are_one_position() {
        let positions = [vec3(0.0, 1.0, 0.0), vec3(-0.0, 1.0, 0.0)];
        assert_eq!(weld(&positions), [0, 0]);
    }
}
