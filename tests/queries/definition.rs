//! S from its definition alone, in f64: stored texels, wrap modes, bilinear heights, normals; nothing of the library's own samplers.

use glam::{DVec2, DVec3};
use prismarch::surface::{DisplacedSurface, Wrap};

pub struct Definition<'s> {
    surface: &'s DisplacedSurface,
    heights: Vec<f64>,
}

impl<'s> Definition<'s> {
    pub fn new(surface: &'s DisplacedSurface) -> Self {
        let (width, height) = surface.map().size();
        let centre = |i: usize| DVec2::new((i % width) as f64, (i / width) as f64);
        let stored = |i: usize| surface.map().sample(centre(i)).height;
        Self {
            surface,
            heights: (0..width * height).map(stored).collect(),
        }
    }

    fn height(&self, i: i64, j: i64) -> f64 {
        let (width, height) = self.surface.map().size();
        let fold = |i: i64, n: usize| {
            let n = n as i64;
            match self.surface.map().wrap() {
                Wrap::Repeat => i.rem_euclid(n),
                Wrap::Clamp => i.clamp(0, n - 1),
                Wrap::Mirror if i.rem_euclid(2 * n) < n => i.rem_euclid(n),
                Wrap::Mirror => n - 1 - i.rem_euclid(n),
            }
        };
        self.heights[(fold(j, height) * width as i64 + fold(i, width)) as usize]
    }

    /// Texel coordinates of a place over a triangle.
    pub fn texel(&self, prim: u32, u: f64, v: f64) -> DVec2 {
        let [a, b, c] = self.surface.corner_texcoords(prim).map(|st| st.as_dvec2());
        let (width, height) = self.surface.map().size();
        let st = (1.0 - u - v) * a + u * b + v * c;
        st * DVec2::new(width as f64, height as f64) - 0.5
    }

    pub fn displacement(&self, prim: u32, u: f64, v: f64) -> f64 {
        let x = self.texel(prim, u, v);
        let cell = x.floor();
        let f = x - cell;
        let (i, j) = (cell.x as i64, cell.y as i64);
        let row = |j| (1.0 - f.x) * self.height(i, j) + f.x * self.height(i + 1, j);
        let height = (1.0 - f.y) * row(j) + f.y * row(j + 1);
        let displacement = self.surface.displacement();
        f64::from(displacement.scale) * (height - f64::from(displacement.midlevel))
    }

    /// P.
    pub fn base(&self, prim: u32, u: f64, v: f64) -> DVec3 {
        let [a, b, c] = self.surface.mesh().corners(prim).map(|p| p.as_dvec3());
        (1.0 - u - v) * a + u * b + v * c
    }

    /// N'/|N'|.
    pub fn normal(&self, prim: u32, u: f64, v: f64) -> DVec3 {
        let mesh = self.surface.mesh();
        let [a, b, c] = mesh.corner_normals(prim).map(|n| n.as_dvec3());
        ((1.0 - u - v) * a + u * b + v * c).normalize()
    }

    /// S.
    pub fn position(&self, prim: u32, u: f64, v: f64) -> DVec3 {
        self.base(prim, u, v) + self.displacement(prim, u, v) * self.normal(prim, u, v)
    }
}
