//! Where the map does not go on as the surface does: what filters the map must not reach across.

use std::collections::HashSet;

use glam::{DVec2, Vec2};

use super::{DisplacedSurface, edges, sample_the_same, weld};

/// For each triangle, where its part of the map is cut off from its neighbours'.
#[derive(Debug)]
pub(crate) struct ChartEdges(Box<[u8]>);

impl ChartEdges {
    /// Bytes held: one per triangle.
    pub fn bytes(&self) -> usize {
        self.0.len()
    }

    /// How far a place of a triangle is from the nearest UV seam among its sides and corners, in texels; infinite if there is none.
    pub fn distance(&self, triangle: u32, texels: [DVec2; 3], [b0, b1, b2]: [f64; 3]) -> f64 {
        let bits = self.0[triangle as usize];
        if bits == 0 {
            return f64::INFINITY;
        }
        let [t0, t1, t2] = texels;
        let area = (t1 - t0).perp_dot(t2 - t0).abs();
        let place = b0 * t0 + b1 * t1 + b2 * t2;
        let mut nearest = f64::INFINITY;
        for (k, part) in [b0, b1, b2].into_iter().enumerate() {
            if bits >> k & 1 != 0 {
                let side = texels[(k + 1) % 3].distance(texels[(k + 2) % 3]);
                nearest = nearest.min(part * area / side);
            }
            if bits >> (3 + k) & 1 != 0 {
                nearest = nearest.min(place.distance(texels[k]));
            }
        }
        nearest
    }
}

impl DisplacedSurface {
    /// Finds the UV seams: edges whose two triangles sample different places of the map. Mesh borders are none.
    pub(crate) fn chart_edges(&self) -> ChartEdges {
        let points = weld(self.mesh.positions());
        let mut bits = vec![0u8; self.mesh.triangles().len()];
        let bits_of = |st: Vec2| st.to_array().map(f32::to_bits);
        // Corners by place on the mesh and in the map: those of one chart.
        let corners = |triangle: u32| {
            let points = self.mesh.triangles()[triangle as usize].map(|i| points[i as usize]);
            let places = self.corner_texcoords(triangle).map(bits_of);
            [0, 1, 2].map(|k| (points[k], places[k]))
        };
        let mut on_seam = HashSet::new();
        for sides in edges(&self.mesh).values() {
            let [a, b] = sides[..] else { continue };
            let [own, other] = [a, b].map(|side| side.of(self.corner_texcoords(side.triangle)));
            if sample_the_same(own, other, self.map.wrap()) {
                continue;
            }
            for side in [a, b] {
                bits[side.triangle as usize] |= 1 << side.side;
                on_seam.extend(side.of(corners(side.triangle)));
            }
        }
        if !on_seam.is_empty() {
            for (triangle, bits) in (0u32..).zip(&mut bits) {
                for (k, corner) in corners(triangle).iter().enumerate() {
                    *bits |= u8::from(on_seam.contains(corner)) << (3 + k);
                }
            }
        }
        ChartEdges(bits.into_boxed_slice())
    }
}
