//! Base meshes from charts: grids of quads, each with its own rectangle of the map.
//!
//! A chart whose rectangle comes from [`Rect::atlas_cell`] has its border on texel centres. Two charts with
//! as many texels along a shared border then interpolate the same numbers there: no crack, not even by rounding.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use crate::surface::MeshBuilder;

/// A rectangle in texture space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Lower left corner.
    pub min: Vec2,
    /// Upper right corner.
    pub max: Vec2,
}

impl Rect {
    /// Cell `index` (row by row from the bottom) of a map cut into `per_side` x `per_side` cells, less
    /// `gutter` texels on every side; the border runs through the centres of the first texels kept.
    ///
    /// `map_size` is a multiple of `per_side`, and a cell is wider than two gutters.
    pub fn atlas_cell(index: usize, per_side: usize, map_size: usize, gutter: usize) -> Self {
        let cell = map_size / per_side;
        let corner = Vec2::new((index % per_side) as f32, (index / per_side) as f32) * cell as f32;
        let inset = gutter as f32 + 0.5;
        Self {
            min: (corner + inset) / map_size as f32,
            max: (corner + (cell as f32 - inset)) / map_size as f32,
        }
    }

    /// The whole map with its border on the outermost texels' centres.
    pub fn texel_centres(map_size: usize) -> Self {
        Self::atlas_cell(0, 1, map_size, 0)
    }

    /// From [0, 1]^2 to texture space.
    pub fn place(&self, uv: Vec2) -> Vec2 {
        self.min + uv * (self.max - self.min)
    }

    /// From texture space to [0, 1]^2, and beyond it outside.
    pub fn local(&self, st: Vec2) -> Vec2 {
        (st - self.min) / (self.max - self.min)
    }
}

/// A grid of quads within a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    /// Quads along u.
    pub nu: usize,
    /// Quads along v.
    pub nv: usize,
    /// Its place in the map.
    pub rect: Rect,
    first: usize,
    first_triangle: usize,
}

/// A point of the base surface.
#[derive(Clone, Copy, Debug)]
pub struct BasePoint {
    /// P(b), on the flat base triangle.
    pub position: Vec3,
    /// N'(b), unit.
    pub normal: Vec3,
}

/// Adds a grid of `nu` x `nv` quads, 2 triangles each, with `position` at (u, v) in [0, 1]^2.
///
/// Outside is where u x v points. Normals are left to [`smooth_normals`].
pub fn add_grid(
    mesh: &mut MeshBuilder,
    (nu, nv): (usize, usize),
    rect: Rect,
    position: impl Fn(Vec2) -> Vec3,
) -> Chart {
    let first = mesh.positions.len();
    for j in 0..=nv {
        for i in 0..=nu {
            let uv = Vec2::new(i as f32 / nu as f32, j as f32 / nv as f32);
            mesh.positions.push(position(uv));
            mesh.texcoords.push(rect.place(uv));
        }
    }
    let chart = Chart {
        nu,
        nv,
        rect,
        first,
        first_triangle: mesh.triangles.len(),
    };
    for j in 0..nv {
        for i in 0..nu {
            let [a, b, c, d] = chart.quad(i, j);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    chart
}

/// (right, up) across each point of a path, carried along by the smallest rotation; right x up is forward.
pub fn frames_along(path: &[Vec3]) -> Vec<(Vec3, Vec3)> {
    let last = path.len() - 1;
    let forward = |i: usize| (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
    let mut right = forward(0).any_orthonormal_vector();
    (0..=last)
        .map(|i| {
            let f = forward(i);
            right = right.reject_from_normalized(f).normalize();
            (right, f.cross(right))
        })
        .collect()
}

impl Chart {
    /// Index in the mesh of grid vertex (i, j).
    pub fn vertex(&self, i: usize, j: usize) -> usize {
        self.first + j * (self.nu + 1) + i
    }

    /// Corners of quad (i, j), counter-clockwise from the lower left.
    fn quad(&self, i: usize, j: usize) -> [u32; 4] {
        [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| self.vertex(i, j) as u32)
    }

    fn triangle(&self, i: usize, j: usize) -> usize {
        self.first_triangle + 2 * (j * self.nu + i)
    }

    /// Cuts quad (i, j) along the falling diagonal (lower right to upper left) instead of the rising one.
    pub fn cut_falling(&self, mesh: &mut MeshBuilder, i: usize, j: usize) {
        let [a, b, c, d] = self.quad(i, j);
        let first = self.triangle(i, j);
        mesh.triangles[first] = [a, b, d];
        mesh.triangles[first + 1] = [b, c, d];
    }

    /// P and N' at texture coordinates `st`: exactly the surface that is displaced there. Outside the
    /// chart the nearest triangle goes on in its plane, which is what gutters are filled with.
    pub fn base_point(&self, mesh: &MeshBuilder, st: Vec2) -> BasePoint {
        let uv = self.rect.local(st) * Vec2::new(self.nu as f32, self.nv as f32);
        let i = (uv.x.max(0.0) as usize).min(self.nu - 1);
        let j = (uv.y.max(0.0) as usize).min(self.nv - 1);
        let (x, y) = (uv.x - i as f32, uv.y - j as f32);
        let [a, b, c, d] = self.quad(i, j).map(|k| k as usize);
        let falling = mesh.triangles[self.triangle(i, j)][2] as usize == d;
        let (corners, weights) = match (falling, x >= y, x + y <= 1.0) {
            (false, true, _) => ([a, b, c], [1.0 - x, x - y, y]),
            (false, false, _) => ([a, c, d], [1.0 - y, x, y - x]),
            (true, _, true) => ([a, b, d], [1.0 - x - y, x, y]),
            (true, _, false) => ([b, c, d], [1.0 - y, x + y - 1.0, 1.0 - x]),
        };
        let blend =
            |of: &[Vec3]| (0..3).fold(Vec3::ZERO, |sum, k| sum + weights[k] * of[corners[k]]);
        BasePoint {
            position: blend(&mesh.positions),
            normal: blend(&mesh.normals).normalize_or(Vec3::Y),
        }
    }
}

/// Sets every normal to the angle-weighted mean of the faces around it. Vertices at the same position (bit
/// for bit, -0 being 0) share one normal, whichever chart they belong to.
pub fn smooth_normals(mesh: &mut MeshBuilder) {
    let mut sums: HashMap<[u32; 3], Vec3> = HashMap::new();
    for triangle in &mesh.triangles {
        let p = triangle.map(|i| mesh.positions[i as usize]);
        let face = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        for k in 0..3 {
            let angle = (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
            *sums.entry(position_key(p[k])).or_default() += angle * face;
        }
    }
    mesh.normals = mesh
        .positions
        .iter()
        .map(|&p| sums.get(&position_key(p)).copied().unwrap_or(Vec3::Y))
        .map(|n| n.normalize_or(Vec3::Y))
        .collect();
}

/// The bits of a position; adding zero turns -0 into 0.
pub fn position_key(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_stand_across_the_path_and_turn_little() {
        let path: Vec<Vec3> = (0..40)
            .map(|i| {
                let t = 0.1 * i as f32;
                Vec3::new(t.cos(), t, 1.5 * t.sin())
            })
            .collect();
        let frames = frames_along(&path);
        for i in 1..39 {
            let (right, up) = frames[i];
            let forward = (path[i + 1] - path[i - 1]).normalize();
            assert!(right.cross(up).distance(forward) < 1e-5);
            assert!(right.dot(frames[i - 1].0) > 0.95);
        }
    }

    #[test]
    fn normals_are_shared_over_a_seam_and_face_outward() {
        let mut mesh = MeshBuilder::default();
        let chart = add_grid(&mut mesh, (12, 8), Rect::texel_centres(64), |uv| {
            let side = (12.0 * uv.x).round() % 12.0;
            let around = Vec2::from_angle(std::f32::consts::TAU * side / 12.0);
            Vec3::new(around.x, uv.y, -around.y)
        });
        smooth_normals(&mut mesh);
        for j in 0..=8 {
            let (a, b) = (chart.vertex(0, j), chart.vertex(12, j));
            assert_eq!(mesh.positions[a], mesh.positions[b]);
            assert_eq!(mesh.normals[a], mesh.normals[b]);
            assert!(mesh.normals[a].distance(Vec3::X) < 0.05);
        }
    }

    #[test]
    fn base_points_lie_on_the_triangles() {
        let mut mesh = MeshBuilder::default();
        let rect = Rect::atlas_cell(5, 4, 256, 3);
        let chart = add_grid(&mut mesh, (3, 2), rect, |uv| {
            Vec3::new(uv.x, uv.y, (5.0 * uv.x * uv.y).sin())
        });
        chart.cut_falling(&mut mesh, 1, 1);
        smooth_normals(&mut mesh);
        for t in &mesh.triangles {
            let corner = t.map(|i| mesh.positions[i as usize]);
            let st = t.map(|i| mesh.texcoords[i as usize]);
            let b = [0.2, 0.5, 0.3];
            let expected = b[0] * corner[0] + b[1] * corner[1] + b[2] * corner[2];
            let asked = b[0] * st[0] + b[1] * st[1] + b[2] * st[2];
            let found = chart.base_point(&mesh, asked).position;
            assert!(found.distance(expected) < 1e-4);
        }
    }

    #[test]
    fn atlas_cells_have_their_border_on_texel_centres() {
        let rect = Rect::atlas_cell(9, 8, 512, 2);
        assert_eq!(512.0 * rect.min, Vec2::new(66.5, 66.5));
        assert_eq!(512.0 * rect.max, Vec2::new(125.5, 125.5));
    }
}
