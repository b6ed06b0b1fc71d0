//! The displaced surface as vertices, one per texel.

use glam::DVec2;
use prismarch::embree::Grid;
use prismarch::surface::{DisplacedSurface, Patch};
use rayon::prelude::*;

/// Texels that were edited.
#[derive(Clone, Copy, Debug)]
pub struct Rect {
    /// Column and row of the first.
    pub start: (usize, usize),
    /// Along both sides.
    pub side: usize,
}

/// How a base triangle is cut. Every base triangle has vertices of its own, so that it can be cut by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// A barycentric grid: n^2 triangles, n the mean length of the base triangle's edges in texels. That is about
    /// two triangles per texel of its footprint.
    Barycentric,
    /// Three grids that meet at the centroid, each spanned by a corner, the middles of its two edges and the centroid.
    /// Cells count as two triangles, of which there are as many as in the other pattern.
    Grids,
}

impl Pattern {
    /// Pieces per edge of the base triangle, or cells per side of one of its grids.
    fn cuts(self, patch: &Patch) -> u32 {
        let [a, b, c] = patch.texels;
        let mean = (a.distance(b) + b.distance(c) + c.distance(a)) / 3.0;
        let cuts = match self {
            Self::Barycentric => mean,
            // 3 * 2 m^2 = n^2
            Self::Grids => mean / 6f64.sqrt(),
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

/// Where the vertices of one base triangle lie.
#[derive(Clone, Copy)]
pub struct Piece {
    /// Index of the first.
    pub first: u32,
    cuts: u32,
}

/// How a surface is cut.
pub struct Tessellation {
    pattern: Pattern,
    /// By base triangle.
    pub pieces: Vec<Piece>,
    vertices: u32,
}

impl Tessellation {
    /// Decides how `surface` is cut.
    pub fn new(pattern: Pattern, surface: &DisplacedSurface) -> Self {
        let mut first = 0;
        let mut pieces = Vec::new();
        for prim in 0..surface.mesh().triangles().len() as u32 {
            let cuts = pattern.cuts(&surface.patch(prim));
            pieces.push(Piece { first, cuts });
            first += pattern.vertices(cuts);
        }
        Self {
            pattern,
            pieces,
            vertices: first,
        }
    }

    /// Triangles in all; a cell of a grid is two.
    pub fn triangle_count(&self) -> usize {
        let triangles = |piece: &Piece| self.pattern.triangles(piece.cuts) as usize;
        self.pieces.iter().map(triangles).sum()
    }

    /// Bytes of all vertices.
    pub fn bytes_of_vertices(&self) -> usize {
        self.vertices as usize * size_of::<[f32; 3]>()
    }

    /// All vertices, piece by piece.
    pub fn positions(&self, surface: &DisplacedSurface) -> Vec<[f32; 3]> {
        let mut positions = vec![[0.0; 3]; self.vertices as usize];
        let mut rest = &mut positions[..];
        let mut parts = Vec::new();
        for (prim, piece) in (0..).zip(&self.pieces) {
            let (part, others) = rest.split_at_mut(self.pattern.vertices(piece.cuts) as usize);
            parts.push((prim, part));
            rest = others;
        }
        parts
            .into_par_iter()
            .with_max_len(8)
            .for_each(|(prim, part)| self.displace(surface, prim, part));
        positions
    }

    /// The vertices of one piece.
    pub fn displace(&self, surface: &DisplacedSurface, prim: u32, out: &mut [[f32; 3]]) {
        let patch = surface.patch(prim);
        let sites = self.pattern.sites(self.pieces[prim as usize].cuts);
        for (out, b) in out.iter_mut().zip(sites) {
            let normal = patch.normal(b.x, b.y).normalize();
            let position = patch.base(b.x, b.y) + patch.displacement(b.x, b.y) * normal;
            *out = position.as_vec3().to_array();
        }
    }

    /// Range of the vertices of one piece.
    pub fn range(&self, prim: u32) -> std::ops::Range<usize> {
        let piece = self.pieces[prim as usize];
        let first = piece.first as usize;
        first..first + self.pattern.vertices(piece.cuts) as usize
    }

    /// The triangles of a piece of the barycentric pattern whose first vertex is `first`.
    pub fn triangles_of(&self, prim: u32, first: u32) -> impl Iterator<Item = [u32; 3]> {
        let n = self.pieces[prim as usize].cuts;
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
        let grids = |piece: &Piece| {
            let side = piece.cuts + 1;
            let first = piece.first;
            [0, 1, 2].map(|k| Grid {
                first: first + k * side * side,
                stride: side,
                width: side as u16,
                height: side as u16,
            })
        };
        self.pieces.iter().flat_map(grids).collect()
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
