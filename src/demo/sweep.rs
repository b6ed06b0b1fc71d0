//! Meshes made of closed rings: lathed bodies, swept tubes, spikes.
//!
//! A ring is a closed loop of points, counter-clockwise about the direction of travel, so that faces look outward.
//! Its first point is stored twice, at both ends of its range of u: a height that is periodic over that range
//! then agrees from both sides of the seam. Rings of different counts are stitched.

use glam::{Vec2, Vec3};

use super::shape::smooth_normals;
use crate::surface::MeshBuilder;

/// A ring already in a [`Sweep`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    start: u32,
    count: u32,
}

/// Where a tube lies in texture space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart {
    /// u at the seam, left and right.
    pub u: [f32; 2],
    /// v at the first and the last ring.
    pub v: [f32; 2],
}

/// A mesh under construction.
#[derive(Default)]
pub(super) struct Sweep {
    positions: Vec<Vec3>,
    texcoords: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

impl Sweep {
    /// Triangles so far.
    pub fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// Adds a ring through `points` (the first is not repeated), with u running over `u` at height `v`.
    pub fn ring(&mut self, points: &[Vec3], u: [f32; 2], v: f32) -> Ring {
        let start = self.positions.len() as u32;
        let count = points.len();
        for j in 0..=count {
            self.positions.push(points[j % count]);
            let s = j as f32 / count as f32;
            self.texcoords
                .push(Vec2::new(u[0] * (1.0 - s) + u[1] * s, v));
        }
        Ring {
            start,
            count: count as u32,
        }
    }

    /// Joins two rings by `a.count + b.count` triangles; `b` lies ahead of `a`.
    pub fn strip(&mut self, a: Ring, b: Ring) {
        let (mut i, mut j) = (0, 0);
        while i < a.count || j < b.count {
            // Advance on the ring whose next corner comes first around; integers, so that ties are exact.
            if j == b.count || (i < a.count && (i + 1) * b.count <= (j + 1) * a.count) {
                self.triangles
                    .push([a.start + i, a.start + i + 1, b.start + j]);
                i += 1;
            } else {
                self.triangles
                    .push([a.start + i, b.start + j + 1, b.start + j]);
                j += 1;
            }
        }
    }

    /// Closes a ring with a fan of `count` triangles to `apex` at height `v`. Every triangle has its own
    /// apex vertex, in the middle of its range of u: heights inside the fan may depend on v only.
    pub fn cap(&mut self, ring: Ring, apex: Vec3, v: f32, ahead: bool) {
        for j in 0..ring.count {
            let [a, b] = [ring.start + j, ring.start + j + 1];
            let tip = self.positions.len() as u32;
            let u = 0.5 * (self.texcoords[a as usize].x + self.texcoords[b as usize].x);
            self.positions.push(apex);
            self.texcoords.push(Vec2::new(u, v));
            self.triangles
                .push(if ahead { [a, b, tip] } else { [tip, b, a] });
        }
    }

    /// A tube through `rings`, closed at both ends by fans to `start` and `end`; v is spread by
    /// the distance between the rings' centres. Adds twice as many triangles as the rings have points.
    pub fn closed_tube(&mut self, start: Vec3, rings: &[Vec<Vec3>], end: Vec3, chart: Chart) {
        let centers: Vec<Vec3> = std::iter::once(start)
            .chain(rings.iter().map(|r| center(r)))
            .chain(std::iter::once(end))
            .collect();
        let v = spread(&centers, chart.v);
        let added: Vec<Ring> = rings
            .iter()
            .zip(&v[1..])
            .map(|(points, &v)| self.ring(points, chart.u, v))
            .collect();
        for pair in added.windows(2) {
            self.strip(pair[0], pair[1]);
        }
        if let (Some(&first), Some(&last)) = (added.first(), added.last()) {
            self.cap(first, start, chart.v[0], false);
            self.cap(last, end, chart.v[1], true);
        }
    }

    /// The mesh, with angle-weighted normals that are the same wherever positions are.
    pub fn finish(self) -> MeshBuilder {
        let mut mesh = MeshBuilder {
            positions: self.positions,
            normals: Vec::new(),
            texcoords: self.texcoords,
            triangles: self.triangles,
        };
        smooth_normals(&mut mesh);
        mesh
    }
}

/// The mean of a ring's points.
pub(super) fn center(points: &[Vec3]) -> Vec3 {
    points.iter().sum::<Vec3>() / points.len() as f32
}

/// Values from `range[0]` to `range[1]`, spread by the distances between consecutive points.
fn spread(points: &[Vec3], range: [f32; 2]) -> Vec<f32> {
    let mut length = 0.0;
    let mut at = vec![0.0];
    for pair in points.windows(2) {
        length += pair[0].distance(pair[1]);
        at.push(length);
    }
    at.iter()
        .map(|s| range[0] + (range[1] - range[0]) * s / length)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(count: usize, y: f32) -> Vec<Vec3> {
        (0..count)
            .map(|i| std::f32::consts::TAU * i as f32 / count as f32)
            .map(|a| Vec3::new(a.sin(), y, a.cos()))
            .collect()
    }

    #[test]
    fn a_tube_of_unequal_rings_is_closed_and_faces_outward() {
        let rings = [circle(12, 0.0), circle(7, 1.0), circle(9, 2.0)];
        let mut sweep = Sweep::default();
        let chart = Chart {
            u: [0.25, 0.5],
            v: [0.5, 0.75],
        };
        sweep.closed_tube(-Vec3::Y, &rings, 3.0 * Vec3::Y, chart);
        let mesh = sweep.finish();
        assert_eq!(mesh.triangles.len(), 2 * (12 + 7 + 9));
        // The divergence theorem: closed and outward means a volume between those of the inner and outer prisms.
        let volume: f32 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| mesh.positions[i as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        assert!((5.0..8.5).contains(&volume), "{volume}");
        assert!(mesh.texcoords.iter().all(|st| (0.25..=0.5).contains(&st.x)));
    }

    #[test]
    fn v_follows_the_distance() {
        let points = [0.0, 1.0, 4.0].map(|y| Vec3::new(0.0, y, 0.0));
        assert_eq!(spread(&points, [1.0, 3.0]), vec![1.0, 1.5, 3.0]);
    }
}
