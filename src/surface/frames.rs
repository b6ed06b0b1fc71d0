//! Tangent frames that go on from face to face as vertex normals do: what smooth displaced normals are made in.
//!
//! Over one face P and N' are affine in texel coordinates (s, t), so dP/ds, dP/dt, dN'/ds and dN'/dt are constant there, and jump at its
//! sides. A vertex gets their means over the faces around it that go on from one another: those with the vertex's position, normal and
//! place in the map, unless they are mirror images in it. (Where a chart meets its mirror image D rises on both sides or falls on both:
//! the surface has a crease there, and a common frame would be flat across it.) Between vertices the means are interpolated, as normals are.
//!
//! A face counts by its angle at the vertex *in the map*. So frames are linear in positions and normals, and those of a mesh
//! that moves are those between its steps.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use super::DisplacedSurface;

/// How the base surface goes along the map's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Frame {
    /// dP/ds and dP/dt, world units per texel; 0 where the map has no area.
    along: [Vec3; 2],
    /// dN'/ds and dN'/dt, per texel.
    turn: [Vec3; 2],
}

/// The frames at a triangle's corners.
pub(crate) type CornerFrames = [Frame; 3];

/// The frames of a mesh's corners.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    /// Per triangle those of its corners.
    corners: Arc<[[u32; 3]]>,
    frames: Vec<Frame>,
}

/// A triangle that has less than this part of the area that its sides in the map could have is a line there.
const NO_AREA: f64 = 1e-9;

impl Frame {
    /// The weighted sum of three.
    pub fn between(frames: &CornerFrames, weights: [f64; 3]) -> [[DVec3; 2]; 2] {
        let sum = |get: &dyn Fn(&Frame) -> Vec3| {
            let parts = frames.iter().zip(weights);
            parts.map(|(f, w)| w * get(f).as_dvec3()).sum::<DVec3>()
        };
        [
            [0, 1].map(|k| sum(&|f| f.along[k])),
            [0, 1].map(|k| sum(&|f| f.turn[k])),
        ]
    }

    fn lerp(&self, other: &Self, part: f64) -> Self {
        let between = |a: Vec3, b: Vec3| a.as_dvec3().lerp(b.as_dvec3(), part).as_vec3();
        let both = |a: [Vec3; 2], b: [Vec3; 2]| [between(a[0], b[0]), between(a[1], b[1])];
        Self {
            along: both(self.along, other.along),
            turn: both(self.turn, other.turn),
        }
    }
}

impl Frames {
    /// Those of a surface.
    pub fn new(surface: &DisplacedSurface) -> Self {
        let mesh = surface.mesh();
        let wrap = surface.map().wrap();
        let mut places = HashMap::new();
        let corners = (0..mesh.triangles().len() as u32).map(|triangle| {
            let (points, normals) = (mesh.corners(triangle), mesh.corner_normals(triangle));
            let texcoords = surface.corner_texcoords(triangle);
            let [a, b, c] = texcoords.map(|st| st.as_dvec2());
            let is_mirrored = (b - a).perp_dot(c - a) < 0.0;
            [0, 1, 2].map(|k| {
                // Adding zero makes -0 and 0 one number.
                let bits = |v: Vec3| (v + Vec3::ZERO).to_array().map(f32::to_bits);
                let [s, t] = texcoords[k].as_dvec2().to_array();
                let in_map = [s, t].map(|x| (x - wrap.whole_periods(x) + 0.0).to_bits());
                let key = (bits(points[k]), bits(normals[k]), in_map, is_mirrored);
                let next = places.len() as u32;
                *places.entry(key).or_insert(next)
            })
        });
        let corners: Arc<[[u32; 3]]> = corners.collect();
        let frames = Self {
            corners,
            frames: vec![Frame::default(); places.len()],
        };
        frames.over(surface, mesh.positions(), mesh.normals())
    }

    /// Those of the same corners where the mesh's vertices are elsewhere.
    pub fn over(&self, surface: &DisplacedSurface, positions: &[Vec3], normals: &[Vec3]) -> Self {
        let mut sums = vec![([DVec3::ZERO; 4], 0.0); self.frames.len()];
        let triangles = surface.mesh().triangles();
        for (triangle, (indices, places)) in triangles.iter().zip(&*self.corners).enumerate() {
            let texels = surface
                .corner_texcoords(triangle as u32)
                .map(|st| surface.map().to_texel(st.as_dvec2()));
            let at = |all: &[Vec3]| indices.map(|i| all[i as usize].as_dvec3());
            let Some(along) = derivatives(texels, at(positions)) else {
                continue;
            };
            let turn = derivatives(texels, at(normals)).unwrap_or_default();
            for (k, &place) in places.iter().enumerate() {
                let (sum, weights) = &mut sums[place as usize];
                let weight = angle(texels, k);
                for (sum, x) in sum.iter_mut().zip(along.into_iter().chain(turn)) {
                    *sum += weight * x;
                }
                *weights += weight;
            }
        }
        let mean = |(sum, weight): ([DVec3; 4], f64)| {
            let [a, b, c, d] = sum.map(|x| (x / f64::max(weight, f64::MIN_POSITIVE)).as_vec3());
            Frame {
                along: [a, b],
                turn: [c, d],
            }
        };
        Self {
            corners: self.corners.clone(),
            frames: sums.into_iter().map(mean).collect(),
        }
    }

    /// Those `part` of the way to others of the same corners.
    pub fn lerp(&self, other: &Self, part: f64) -> Self {
        let pairs = self.frames.iter().zip(&other.frames);
        Self {
            corners: self.corners.clone(),
            frames: pairs.map(|(a, b)| a.lerp(b, part)).collect(),
        }
    }

    /// Those at the corners of a triangle.
    pub fn of(&self, triangle: u32) -> CornerFrames {
        self.corners[triangle as usize].map(|i| self.frames[i as usize])
    }

    /// The same `part` of the way to others.
    pub fn of_between(&self, other: &Self, part: f64, triangle: u32) -> CornerFrames {
        self.corners[triangle as usize].map(|i| {
            let i = i as usize;
            self.frames[i].lerp(&other.frames[i], part)
        })
    }
}

/// The derivatives along the map's axes of what is linear over a triangle; `None` where it is a line in the map.
fn derivatives(texels: [DVec2; 3], values: [DVec3; 3]) -> Option<[DVec3; 2]> {
    let [a, b] = [1, 2].map(|k| texels[k] - texels[0]);
    let [x, y] = [1, 2].map(|k| values[k] - values[0]);
    let area = a.perp_dot(b);
    let is_line = area.abs() <= NO_AREA * a.length() * b.length();
    (!is_line && area.is_finite()).then(|| [(b.y * x - a.y * y) / area, (a.x * y - b.x * x) / area])
}

/// The angle of a triangle in the map at corner `k`.
fn angle(texels: [DVec2; 3], k: usize) -> f64 {
    let [a, b] = [1, 2].map(|next| texels[(k + next) % 3] - texels[k]);
    a.perp_dot(b).abs().atan2(a.dot(b))
}

#[cfg(test)]
mod tests;
