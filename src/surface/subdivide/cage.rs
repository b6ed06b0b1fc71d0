//! A cage's level 0: one point for equal positions, what is sharp, and the same faces over texture coordinates.

use std::collections::HashMap;

use glam::{DVec3, Vec2};

use super::Cage;
use super::level::{Level, around};
use crate::surface::normals::weld;

/// Sharpness from which on it never ends.
const INFINITELY_SHARP: f32 = 10.0;

impl Cage {
    /// Level 0: equal positions are one point, and corners that repeat the one before are left out.
    pub(super) fn surface(&self) -> Surface {
        let same = weld(&self.positions);
        let mut points = Vec::new();
        let mut point_of = vec![u32::MAX; self.positions.len()];
        let (mut starts, mut corners) = (vec![0], Vec::new());
        let (mut origins, mut texcoords) = (Vec::new(), Vec::new());
        let mut from = 0;
        let mut kept: Vec<u32> = Vec::new();
        for (face, &size) in (0..).zip(&self.sizes) {
            let vertices = &self.corners[from..from + size as usize];
            from += size as usize;
            let place = |v: u32| same[v as usize];
            kept.clear();
            for &vertex in vertices {
                if kept.last().is_none_or(|&last| place(last) != place(vertex)) {
                    kept.push(vertex);
                }
            }
            while kept.len() > 1 && place(kept[0]) == place(kept[kept.len() - 1]) {
                kept.pop();
            }
            if kept.len() < 3 {
                continue;
            }
            for &vertex in &kept {
                let point = &mut point_of[place(vertex) as usize];
                if *point == u32::MAX {
                    *point = points.len() as u32;
                    points.push(self.positions[vertex as usize].as_dvec3());
                }
                corners.push(*point);
                texcoords.extend(self.texcoords.get(vertex as usize));
            }
            starts.push(corners.len() as u32);
            origins.push(face);
        }
        let points_of_vertices = same.iter().map(|&s| point_of[s as usize]);
        Surface {
            points_of_vertices: points_of_vertices.collect(),
            left_out: self.sizes.len() - origins.len(),
            shape: Level::new(starts, corners, points),
            chart: (!self.texcoords.is_empty()).then_some(texcoords),
            origins,
        }
    }
}

/// A cage at level 0.
pub(super) struct Surface {
    pub shape: Level,
    /// Of each corner.
    pub chart: Option<Vec<Vec2>>,
    /// Of each face, that of the cage.
    pub origins: Vec<u32>,
    pub left_out: usize,
    /// `u32::MAX` for those of no face.
    points_of_vertices: Vec<u32>,
}

impl Surface {
    pub fn crease(&mut self, cage: &Cage, crease_angle: f32) {
        let sharpness = |s: f32| match s {
            INFINITELY_SHARP.. => f64::INFINITY,
            _ => f64::from(s.max(0.0)),
        };
        let shape = &mut self.shape;
        if crease_angle < std::f32::consts::PI {
            shape.crease_by_angle(crease_angle.into());
        }
        if !cage.creases.is_empty() {
            let edges = (0..).zip(&shape.edges);
            let known: HashMap<[u32; 2], usize> = edges
                .map(|(i, &[a, b])| ([a.min(b), a.max(b)], i))
                .collect();
            for &(ends, s) in &cage.creases {
                let [a, b] = ends.map(|v| self.points_of_vertices[v as usize]);
                if let Some(&edge) = known.get(&[a.min(b), a.max(b)]) {
                    let old = &mut shape.edge_sharpness[edge];
                    *old = old.max(sharpness(s));
                }
            }
        }
        for &(vertex, s) in &cage.sharp_vertices {
            let point = self.points_of_vertices[vertex as usize];
            if let Some(old) = shape.vertex_sharpness.get_mut(point as usize) {
                *old = old.max(sharpness(s));
            }
        }
    }
}

impl Level {
    /// Makes edges of two faces whose normals are farther apart infinitely sharp. Faces without area turn from none.
    fn crease_by_angle(&mut self, angle: f64) {
        /// Faces this close to coplanar are never parted, as where smooth normals are computed.
        const COPLANAR: f64 = 1e-4;
        let mut first = vec![None; self.edges.len()];
        for face in 0..self.faces() {
            let origin = self.point(self.starts[face] as usize);
            let sides = around(self.corners_of(face));
            let area = sides.map(|(a, b)| (self.point(a) - origin).cross(self.point(b) - origin));
            let normal = area.sum::<DVec3>().normalize_or_zero();
            for corner in self.corners_of(face) {
                let edge = self.sides[corner] as usize;
                let Some(other) = first[edge].replace(normal) else {
                    continue;
                };
                let turn = DVec3::cross(other, normal)
                    .length()
                    .atan2(other.dot(normal));
                if turn > angle + COPLANAR {
                    self.edge_sharpness[edge] = f64::INFINITY;
                }
            }
        }
    }

    /// The same faces over texture coordinates, given by corner. Along a chart's border, and where charts meet, all is pinned.
    pub(super) fn chart(&self, texcoords: &[Vec2]) -> Self {
        let bits = |st: Vec2| (st + Vec2::ZERO).to_array().map(f32::to_bits);
        let mut known: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
        let mut points = Vec::new();
        let mut owners = Vec::new();
        let corners: Vec<u32> = (self.corners.iter().zip(texcoords))
            .map(|(&vertex, &st)| {
                *known.entry((vertex, bits(st))).or_insert_with(|| {
                    points.push(st.as_dvec2().extend(0.0));
                    owners.push(vertex);
                    points.len() as u32 - 1
                })
            })
            .collect();
        let mut chart = Self::new(self.starts.clone(), corners, points);
        // What is sharp on the surface is sharp in the chart, as far as it goes.
        for (&edge, &of_shape) in chart.sides.iter().zip(&self.sides) {
            let sharpness = &mut chart.edge_sharpness[edge as usize];
            *sharpness = sharpness.max(self.edge_sharpness[of_shape as usize]);
        }
        for (sharpness, &owner) in chart.vertex_sharpness.iter_mut().zip(&owners) {
            *sharpness = sharpness.max(self.vertex_sharpness[owner as usize]);
        }
        // A chart's border: one face there, whatever the surface has.
        let mut faces = vec![0_u32; chart.edges.len()];
        for &edge in &chart.sides {
            faces[edge as usize] += 1;
        }
        for (edge, _) in faces.iter().enumerate().filter(|(_, n)| **n != 2) {
            for vertex in chart.edges[edge] {
                chart.vertex_sharpness[vertex as usize] = f64::INFINITY;
            }
        }
        chart
    }
}
