//! Texture coordinates for meshes that have none: the map is projected onto the mesh from a simple shape around it.
//!
//! All shapes stand in the mesh's own space, around a box, with +y up, and show the map unmirrored from outside.
//! Lengths are exact in the limit of single precision: coordinates are computed in double and rounded once.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::MeshBuilder;
use crate::ray::Aabb;

/// The shape that a map is projected from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// Six sides; each face takes the one that its normal is nearest to. The longest side of the box is one map
    /// width and one map height, so the map has the same size on all sides. The map jumps where sides meet.
    Box,
    /// Longitude and latitude around the middle of the box: once around, once from the lower to the upper pole.
    /// The middle of the map faces +z, its left and right edges meet at -z.
    Spherical,
    /// Longitude around the box's vertical axis, as for `Spherical`; the map's height is the box's.
    Cylindrical,
    /// Along the shortest side of the box (of equal ones y, then z, then x): along y, u is x and v is -z; along z,
    /// u is x and v is y; along x, u is -z and v is y. The longest side of the box is one map width and height.
    Planar,
}

impl MeshBuilder {
    /// Replaces the texture coordinates by those of a projection from around the box `bounds`.
    ///
    /// A vertex whose faces lie at different places of the map (sides of a box, the seam behind a sphere, a pole)
    /// is split; its copies have its very position and normal and stand after all others. Triangles keep their
    /// order. Where a triangle crosses the seam, u goes on beyond 0 or 1, so that no triangle runs back through
    /// the whole map: a repeating map closes there if it is repeated a whole number of times.
    ///
    /// A mesh that [`MeshBuilder::build`] refuses stays as it is.
    pub fn project(&mut self, projection: Projection, bounds: Aabb) {
        if self.validate().is_err() {
            return;
        }
        let space = Space::new(bounds);
        let corners: Vec<[Vec2; 3]> = self
            .triangles
            .iter()
            .map(|t| space.corners(projection, t.map(|i| self.positions[i as usize])))
            .collect();
        self.lay(&corners);
    }

    /// Gives each triangle's corners these texture coordinates, splitting the vertices that need several.
    fn lay(&mut self, corners: &[[Vec2; 3]]) {
        let bits = |st: Vec2| st.to_array().map(f32::to_bits);
        let mut owner: Vec<Option<Vec2>> = vec![None; self.positions.len()];
        let mut copies = HashMap::new();
        self.texcoords = vec![Vec2::ZERO; self.positions.len()];
        let all = self.triangles.as_flattened_mut().iter_mut();
        for (index, &st) in all.zip(corners.as_flattened()) {
            let vertex = *index as usize;
            let first = *owner[vertex].get_or_insert(st);
            if bits(first) == bits(st) {
                self.texcoords[vertex] = st;
                continue;
            }
            *index = *copies.entry((vertex, bits(st))).or_insert_with(|| {
                self.positions.push(self.positions[vertex]);
                if !self.normals.is_empty() {
                    self.normals.push(self.normals[vertex]);
                }
                self.texcoords.push(st);
                (self.positions.len() - 1) as u32
            });
        }
    }
}

/// The box that projections stand around.
struct Space {
    min: DVec3,
    max: DVec3,
    /// Length of the longest side, or 1 for a box without size.
    longest: f64,
}

impl Space {
    fn new(bounds: Aabb) -> Self {
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let longest = (max - min).max_element();
        Self {
            min,
            max,
            longest: if longest > 0.0 { longest } else { 1.0 },
        }
    }

    /// The texture coordinates of a triangle.
    fn corners(&self, projection: Projection, triangle: [Vec3; 3]) -> [Vec2; 3] {
        let p = triangle.map(|p| p.as_dvec3());
        let st = match projection {
            Projection::Box => {
                let normal = (p[1] - p[0]).cross(p[2] - p[0]);
                p.map(|p| self.flat(p, Side::facing(normal)))
            }
            Projection::Planar => p.map(|p| self.flat(p, self.broad_side())),
            Projection::Spherical => self.around(p, |d| {
                let latitude = d.y.atan2(d.x.hypot(d.z));
                0.5 + latitude / PI
            }),
            Projection::Cylindrical => {
                let height = self.max.y - self.min.y;
                let per_unit = if height > 0.0 { 1.0 / height } else { 0.0 };
                self.around(p, |d| 0.5 + d.y * per_unit)
            }
        };
        st.map(|st| st.as_vec2())
    }

    /// On one side of the box, from its lower left corner as seen from outside.
    fn flat(&self, p: DVec3, side: Side) -> DVec2 {
        let (from_min, from_max) = (p - self.min, self.max - p);
        let (u, v) = match (side.axis, side.negative) {
            (Axis::X, false) => (from_max.z, from_min.y),
            (Axis::X, true) => (from_min.z, from_min.y),
            (Axis::Y, false) => (from_min.x, from_max.z),
            (Axis::Y, true) => (from_min.x, from_min.z),
            (Axis::Z, false) => (from_min.x, from_min.y),
            (Axis::Z, true) => (from_max.x, from_min.y),
        };
        DVec2::new(u, v) / self.longest
    }

    /// The side across the box's shortest extent.
    fn broad_side(&self) -> Side {
        let size = self.max - self.min;
        let axis = if size.y <= size.x.min(size.z) {
            Axis::Y
        } else if size.z <= size.x {
            Axis::Z
        } else {
            Axis::X
        };
        Side {
            axis,
            negative: false,
        }
    }

    /// u by longitude around the vertical axis, v by `height` of the place relative to the box's middle.
    fn around(&self, triangle: [DVec3; 3], height: impl Fn(DVec3) -> f64) -> [DVec2; 3] {
        let middle = 0.5 * (self.min + self.max);
        let d = triangle.map(|p| p - middle);
        let us = unwound(d.map(|d| turns(d, self.longest)));
        [0, 1, 2].map(|i| DVec2::new(us[i], height(d[i])))
    }
}

/// Longitude as a part of the map's width; none on the axis, where every longitude meets.
fn turns(d: DVec3, size: f64) -> Option<f64> {
    /// What rounding the positions to single precision may move a vertex off the axis, in sizes of the box.
    const ON_AXIS: f64 = 1e-6;
    (d.x.hypot(d.z) > ON_AXIS * size).then(|| 0.5 + d.x.atan2(d.z) / TAU)
}

/// The u of a triangle's corners, by whole turns as near to one another as can be; a corner on the axis gets
/// the mean of the others.
fn unwound(turns: [Option<f64>; 3]) -> [f64; 3] {
    let Some(first) = turns.into_iter().flatten().next() else {
        return [0.5; 3];
    };
    let near = turns.map(|u| u.map(|u| u - (u - first).round()));
    let known = near.iter().flatten();
    let mean = known.clone().sum::<f64>() / known.count() as f64;
    near.map(|u| u.unwrap_or(mean))
}

#[derive(Clone, Copy)]
enum Axis {
    X,
    Y,
    Z,
}

/// One side of a box.
#[derive(Clone, Copy)]
struct Side {
    axis: Axis,
    negative: bool,
}

impl Side {
    /// The side that a face with this normal looks at; where two are as near, z goes before x and x before y.
    fn facing(normal: DVec3) -> Self {
        let size = normal.abs();
        let (axis, along) = if size.z >= size.x.max(size.y) {
            (Axis::Z, normal.z)
        } else if size.x >= size.y {
            (Axis::X, normal.x)
        } else {
            (Axis::Y, normal.y)
        };
        Self {
            axis,
            negative: along < 0.0,
        }
    }
}

#[cfg(test)]
mod tests;
