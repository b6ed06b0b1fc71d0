//! The displaced surface as vertices, one per texel.

use glam::DVec2;
use prismarch::embree::Grid;
use prismarch::surface::{DisplacedSurface, TexelRect};
use rayon::prelude::*;

/// Texels that were edited.
#[derive(Clone, Copy, Debug)]
pub struct Rect {
    /// Column and row of the first.
    pub start: (usize, usize),
    /// Along both sides.
    pub side: usize,
}

impl Rect {
    /// As the map has it.
    pub fn texels(self) -> TexelRect {
        let (x, y) = self.start;
        TexelRect {
            x,
            y,
            width: self.side,
            height: self.side,
        }
    }
}

/// How base triangles are cut: all into the same number of pieces, so that neighbours have the same vertices on their
/// shared edge, but each has vertices of its own, so that it can be displaced by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// A barycentric grid: n^2 triangles.
    Barycentric,
    /// Three grids that meet at the centroid, each spanned by a corner, the middles of its two edges and the centroid.
    /// A cell counts as two triangles, of which there are as many as in the other pattern.
    Grids,
}

impl Pattern {
    /// Pieces per edge of a base triangle, or cells per side of one of its grids: one vertex, that is two triangles,
    /// per texel of the smallest footprint that a base triangle has on the map. Larger ones are undersampled, in the
    /// tessellations' favour: on a sphere of longitude and latitude those are the ones around the poles.
    fn cuts(self, surface: &DisplacedSurface) -> u32 {
        let footprint = |prim| {
            let [a, b, c] = surface.patch(prim).texels;
            0.5 * (b - a).perp_dot(c - a).abs()
        };
        let prims = 0..surface.mesh().triangles().len() as u32;
        let triangles = 2.0 * prims.map(footprint).fold(f64::INFINITY, f64::min);
        let cuts = match self {
            Self::Barycentric => triangles.sqrt(),
            Self::Grids => (triangles / 6.0).sqrt(),
        };
        (cuts.round() as u32).max(1)
    }

    fn vertices(self, cuts: u32) -> u32 {
        match self {
            Self::Barycentric => (cuts + 1) * (cuts + 2) / 2,
            Self::Grids => 3 * (cuts + 1) * (cuts + 1),
        }
    }

    fn triangles(self, cuts: u32) -> u32 {
        match self {
            Self::Barycentric => cuts * cuts,
            Self::Grids => 6 * cuts * cuts,
        }
    }

    /// (u, v) of every vertex.
    fn sites(self, cuts: u32) -> Vec<DVec2> {
        let n = f64::from(cuts);
        let steps = move |last: u32| (0..=last).map(move |i| f64::from(i) / n);
        match self {
            Self::Barycentric => (0..=cuts)
                .flat_map(|j| steps(cuts - j).map(move |u| DVec2::new(u, f64::from(j) / n)))
                .collect(),
            Self::Grids => {
                let corners = [DVec2::ZERO, DVec2::X, DVec2::Y];
                let centroid = DVec2::splat(1.0 / 3.0);
                (0..3)
                    .flat_map(|k| {
                        let corner = corners[k];
                        let [next, previous] =
                            [1, 2].map(|i| 0.5 * (corner + corners[(k + i) % 3]));
                        steps(cuts).flat_map(move |t| {
                            let (from, to) = (corner.lerp(previous, t), next.lerp(centroid, t));
                            steps(cuts).map(move |s| from.lerp(to, s))
                        })
                    })
                    .collect()
            }
        }
    }
}

/// How a surface is cut.
pub struct Tessellation {
    pattern: Pattern,
    cuts: u32,
    /// Base triangles.
    pub pieces: u32,
}

impl Tessellation {
    /// Decides how `surface` is cut.
    pub fn new(pattern: Pattern, surface: &DisplacedSurface) -> Self {
        Self {
            pattern,
            cuts: pattern.cuts(surface),
            pieces: surface.mesh().triangles().len() as u32,
        }
    }

    /// Triangles in all; a cell of a grid is two.
    pub fn triangle_count(&self) -> usize {
        (self.pieces * self.pattern.triangles(self.cuts)) as usize
    }

    fn vertex_count(&self) -> usize {
        (self.pieces * self.pattern.vertices(self.cuts)) as usize
    }

    /// Bytes of all vertices.
    pub fn bytes_of_vertices(&self) -> usize {
        self.vertex_count() * size_of::<[f32; 3]>()
    }

    /// All vertices, piece by piece.
    pub fn positions(&self, surface: &DisplacedSurface) -> Vec<[f32; 3]> {
        let mut positions = vec![[0.0; 3]; self.vertex_count()];
        positions
            .par_chunks_exact_mut(self.pattern.vertices(self.cuts) as usize)
            .with_max_len(8)
            .zip(0..self.pieces)
            .for_each(|(part, prim)| self.displace(surface, prim, part));
        positions
    }

    /// The vertices of one piece.
    pub fn displace(&self, surface: &DisplacedSurface, prim: u32, out: &mut [[f32; 3]]) {
        let patch = surface.patch(prim);
        let sites = self.pattern.sites(self.cuts);
        for (out, b) in out.iter_mut().zip(sites) {
            let normal = patch.normal(b.x, b.y).normalize();
            let position = patch.base(b.x, b.y) + patch.displacement(b.x, b.y) * normal;
            *out = position.as_vec3().to_array();
        }
    }

    /// Range of the vertices of one piece.
    pub fn range(&self, prim: u32) -> std::ops::Range<usize> {
        let each = self.pattern.vertices(self.cuts) as usize;
        each * prim as usize..each * (prim as usize + 1)
    }

    /// The triangles of a piece of the barycentric pattern whose first vertex is `first`.
    pub fn triangles_from(&self, first: u32) -> impl Iterator<Item = [u32; 3]> {
        let n = self.cuts;
        let row = move |j: u32| first + j * (n + 1) - j * j.saturating_sub(1) / 2;
        (0..n).flat_map(move |j| {
            let (a, b) = (row(j), row(j + 1));
            (0..n - j).flat_map(move |i| {
                let up = [a + i, a + i + 1, b + i];
                let down = [a + i + 1, b + i + 1, b + i];
                std::iter::once(up).chain((i + j + 1 < n).then_some(down))
            })
        })
    }

    /// All grids of the pattern of grids.
    pub fn grids(&self) -> Vec<Grid> {
        let side = self.cuts + 1;
        let grid = |k| Grid {
            first: k * side * side,
            stride: side,
            width: side as u16,
            height: side as u16,
        };
        (0..3 * self.pieces).map(grid).collect()
    }
}

/// The base triangles whose footprint on the map may touch `rect`.
pub fn touched(surface: &DisplacedSurface, rect: Rect) -> Vec<u32> {
    let (width, height) = surface.map().size();
    let period = DVec2::new(width as f64, height as f64);
    let low = DVec2::new(rect.start.0 as f64, rect.start.1 as f64) - 1.0;
    let high = low + rect.side as f64 + 1.0;
    let overlaps = |prim: &u32| {
        let [a, b, c] = surface.patch(*prim).texels;
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let shifts = [-1.0, 0.0, 1.0];
        shifts.iter().any(|&i| {
            shifts.iter().any(|&j| {
                let shift = period * DVec2::new(i, j);
                (min + shift).cmple(high).all() && (max + shift).cmpge(low).all()
            })
        })
    };
    (0..surface.mesh().triangles().len() as u32)
        .filter(overlaps)
        .collect()
}
