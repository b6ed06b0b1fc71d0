//! Seams: where displaced sheets part, and the walls that close them.
//!
//! Two triangles may share an edge and still part when they are displaced: their texture coordinates differ along it (a
//! UV seam), so D does; or their normals do (a hard edge), so the sheets go different ways; or there is no neighbour at
//! all (a border). Where a solid has to stay a solid, for refraction above all, a wall is put there.
//!
//! **A wall** stands on side k of a triangle, over the edge from corner k+1 to corner k+2. The side is the ruled surface
//!
//! ```text
//! V(l) + w N'(l),   V(l) = v_k+1 + l (v_k+2 - v_k+1),   N'(l) = n_k+1 + l (n_k+2 - n_k+1),   l in [0, 1]
//! ```
//!
//! and the wall is the part of it between the triangle's own height, w |N'| = D(l), and another height:
//!
//! - At a UV seam, where the neighbour has the edge's positions and normals bit for bit, the neighbour's D(l). The wall
//!   joins the two sheets; it is there once, and the lower triangle has it.
//! - Else 0, the base edge. At a hard edge each sheet comes down to the base on its own; so it does at a border, and where
//!   three or more triangles meet in an edge.
//!
//! So the sheets of a closed mesh and its walls bound a solid: a line that misses all edges crosses them an even number
//! of times. An edge on which both triangles provably sample the same heights has no wall: texture coordinates that are
//! the same bit for bit, or whole periods of the wrap mode apart. Coordinates that differ by a rounding make a wall of
//! next to no height.

mod charts;

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::normals::weld;
pub(crate) use charts::ChartEdges;

use super::{BaseMesh, DisplacedSurface, Interpolated, Patch, SurfacePoint, TexelRect, Wrap};

/// What happens where displaced sheets part: at UV seams, hard edges and borders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Seams {
    /// They part.
    #[default]
    Open,
    /// Walls join them, or close them down to the base mesh: solids stay solid.
    Closed,
}

/// A wall on a side of a base triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// The base triangle that has it.
    pub triangle: u32,
    /// The corner opposite its side, 0 to 2; its edge goes from corner `side` + 1 to `side` + 2.
    pub side: u8,
    /// The neighbour's texture coordinates, after the UV transform, at the edge's two ends; `None` for a wall down to the
    /// base edge.
    pub other: Option<[Vec2; 2]>,
}

const _: () = assert!(size_of::<Wall>() == 28);

impl Wall {
    /// Its edge's corners of the triangle, in the triangle's order.
    #[inline]
    pub fn corners(&self) -> [usize; 2] {
        let side = usize::from(self.side);
        [(side + 1) % 3, (side + 2) % 3]
    }
}

/// One side of one triangle.
#[derive(Clone, Copy)]
struct Side {
    triangle: u32,
    side: u8,
    /// Whether the triangle goes from the edge's higher welded position to the lower.
    turned: bool,
}

impl Side {
    /// The edge's values of the triangle's three, at the lower and the higher position.
    fn of<T: Copy>(&self, corners: [T; 3]) -> [T; 2] {
        let side = usize::from(self.side);
        self.in_order([corners[(side + 1) % 3], corners[(side + 2) % 3]])
    }

    /// From the triangle's order to the edge's, or back.
    fn in_order<T>(&self, [a, b]: [T; 2]) -> [T; 2] {
        if self.turned { [b, a] } else { [a, b] }
    }

    fn wall(&self, other: Option<[Vec2; 2]>) -> Wall {
        Wall {
            triangle: self.triangle,
            side: self.side,
            other: other.map(|st| self.in_order(st)),
        }
    }
}

/// The walls that close a mesh, by triangle and side; `texcoords` gives a triangle's after the UV transform.
pub(super) fn walls(
    mesh: &BaseMesh,
    texcoords: impl Fn(u32) -> [Vec2; 3],
    wrap: Wrap,
) -> Vec<Wall> {
    let mut walls = Vec::new();
    for sides in edges(mesh).values() {
        match sides[..] {
            [a, b]
                if bits(&a.of(mesh.corner_normals(a.triangle)))
                    == bits(&b.of(mesh.corner_normals(b.triangle))) =>
            {
                // Sides come by rising triangle: a's is the lower.
                let own = a.of(texcoords(a.triangle));
                let other = b.of(texcoords(b.triangle));
                if !sample_the_same(own, other, wrap) {
                    walls.push(a.wall(Some(other)));
                }
            }
            _ => walls.extend(sides.iter().map(|side| side.wall(None))),
        }
    }
    walls.sort_unstable_by_key(|wall| (wall.triangle, wall.side));
    walls
}

/// The sides at each edge, by rising triangle. Positions count as the same bit for bit, whatever their index.
fn edges(mesh: &BaseMesh) -> HashMap<[u32; 2], Vec<Side>> {
    let points = weld(mesh.positions());
    let mut edges: HashMap<[u32; 2], Vec<Side>> = HashMap::new();
    for (triangle, corners) in mesh.triangles().iter().enumerate() {
        let corners = corners.map(|i| points[i as usize]);
        for side in 0..3 {
            let [a, b] = [corners[(side + 1) % 3], corners[(side + 2) % 3]];
            let edge = [a.min(b), a.max(b)];
            edges.entry(edge).or_default().push(Side {
                triangle: triangle as u32,
                side: side as u8,
                turned: a > b,
            });
        }
    }
    edges
}

/// Adding 0 makes -0 and 0 one.
fn bits(vectors: &[Vec3; 2]) -> [[u32; 3]; 2] {
    vectors.map(|v| (v + Vec3::ZERO).to_array().map(f32::to_bits))
}

/// Whether D is the same all along an edge: one number of whole periods lies between both ends' coordinates.
fn sample_the_same(a: [Vec2; 2], b: [Vec2; 2], wrap: Wrap) -> bool {
    let apart = |end: usize| b[end].as_dvec2() - a[end].as_dvec2(); // exact
    let (first, last) = (apart(0), apart(1));
    let whole = |d: f64| wrap.whole_periods(d) == d;
    first == last && whole(first.x) && whole(first.y)
}

/// The ruled surface that a wall stands in, in f64.
pub(crate) struct Ruled<'m> {
    patch: Patch<'m>,
    corners: [usize; 2],
    /// The neighbour's texel coordinates.
    other: Option<[DVec2; 2]>,
}

impl<'m> Ruled<'m> {
    /// The side of `patch`, its triangle's, on which `wall` stands.
    pub fn new(patch: Patch<'m>, wall: &Wall) -> Self {
        let texel = |st: Vec2| patch.map.to_texel(st.as_dvec2());
        Self {
            corners: wall.corners(),
            other: wall.other.map(|st| st.map(texel)),
            patch,
        }
    }

    /// (u, v) of the triangle at l on the edge.
    fn barycentrics(&self, l: f64) -> (f64, f64) {
        let [a, b] = self.corners;
        let mut of = [0.0; 3];
        (of[a], of[b]) = (1.0 - l, l);
        (of[1], of[2])
    }

    /// l of a point of the side with these barycentric coordinates: what is left of the third one is rounding.
    #[inline]
    pub fn place(&self, u: f64, v: f64) -> f64 {
        let b = [1.0 - u - v, u, v];
        let [first, last] = self.corners.map(|k| b[k]);
        (last / (first + last)).clamp(0.0, 1.0)
    }

    /// N'(l).
    #[inline]
    pub fn normal(&self, l: f64) -> DVec3 {
        let [a, b] = self.corners.map(|k| self.patch.normals[k]);
        a + l * (b - a)
    }

    /// The other height and the triangle's own, world units along the unit normal.
    #[inline]
    pub fn heights(&self, l: f64) -> [f64; 2] {
        let (u, v) = self.barycentrics(l);
        let other = self.other.map_or(0.0, |[a, b]| {
            let height = self.patch.map.sample(a + l * (b - a)).height;
            self.patch.scale * (height - self.patch.midlevel)
        });
        [other, self.patch.displacement(u, v)]
    }

    /// d/dl of both heights; on a line between texels as the map's gradient has it.
    fn slopes(&self, l: f64) -> [f64; 2] {
        let Patch {
            texels, map, scale, ..
        } = &self.patch;
        let slope = |[a, b]: [DVec2; 2]| {
            let along = b - a;
            scale * map.sample(a + l * along).gradient.dot(along)
        };
        [
            self.other.map_or(0.0, slope),
            slope(self.corners.map(|k| texels[k])),
        ]
    }

    /// dV/dl and dN'/dl.
    fn along(&self) -> [DVec3; 2] {
        let Patch {
            vertices, normals, ..
        } = &self.patch;
        let [a, b] = self.corners;
        [vertices[b] - vertices[a], normals[b] - normals[a]]
    }

    /// The unit normal of the ruled surface at w, on the solid's outer side: away from the triangle where its own sheet
    /// is the upper one, else toward it.
    pub fn outward(&self, l: f64, w: f64, own_is_higher: bool) -> DVec3 {
        let Patch {
            vertices: v,
            normals: n,
            ..
        } = &self.patch;
        let [a, b] = self.corners;
        let at = |k: usize| v[k] + w * n[k];
        let along = at(b) - at(a);
        let normal = along.cross(self.normal(l)).normalize_or_zero();
        let inside = at(3 - a - b) - at(a);
        let away = normal.dot(inside) <= 0.0;
        if away == own_is_higher {
            normal
        } else {
            -normal
        }
    }
}

impl DisplacedSurface {
    /// The walls of closed seams, by triangle and side; none where seams are open.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// A triangle's walls, and the index of the first.
    fn walls_from(&self, triangle: u32) -> (usize, &[Wall]) {
        let first = self.walls.partition_point(|wall| wall.triangle < triangle);
        let rest = &self.walls[first..];
        let count = rest.iter().take_while(|w| w.triangle == triangle).count();
        (first, &rest[..count])
    }

    /// A triangle's walls: at most three.
    pub fn walls_of(&self, triangle: u32) -> &[Wall] {
        self.walls_from(triangle).1
    }

    /// The wall on a side, with its index.
    pub(crate) fn wall_on(&self, triangle: u32, side: u8) -> Option<(u32, &Wall)> {
        let (first, walls) = self.walls_from(triangle);
        let k = walls.iter().position(|wall| wall.side == side)?;
        Some(((first + k) as u32, &walls[k]))
    }

    /// Smallest and largest D over a triangle and its walls, conservative.
    pub fn displacements(&self, triangle: u32) -> [f64; 2] {
        let patch = self.patch(triangle);
        let walls = self.walls_of(triangle).iter();
        walls.fold(patch.range(), |[low, high], wall| {
            let [a, b] = match self.other_texels(wall) {
                None => [0.0; 2],
                Some(texels) => Patch { texels, ..patch }.range(),
            };
            [low.min(a), high.max(b)]
        })
    }

    /// Whether an edit of `rect` of the map can change the surface over a triangle, its walls, or [`Self::displacements`].
    pub fn overlaps(&self, triangle: u32, rect: TexelRect) -> bool {
        let mut walls = self.walls_of(triangle).iter();
        self.map.overlaps(self.patch(triangle).texels, rect)
            || walls.any(|wall| {
                let other = self.other_texels(wall);
                other.is_some_and(|texels| self.map.overlaps(texels, rect))
            })
    }

    /// The neighbour's edge in texels, as a triangle without area.
    pub(crate) fn other_texels(&self, wall: &Wall) -> Option<[DVec2; 3]> {
        let [a, b] = wall.other?.map(|st| self.map.to_texel(st.as_dvec2()));
        Some([a, b, b])
    }

    /// A wall at `l` along its edge (0 at the edge's first corner in the triangle's order) and `v` of the way from the other height
    /// to the triangle's own.
    ///
    /// # Panics
    ///
    /// Where there is no such wall.
    pub(super) fn on_wall(&self, wall: usize, l: f32, v: f32) -> Interpolated {
        let wall = &self.walls[wall];
        let ruled = Ruled::new(self.patch(wall.triangle), wall);
        let (l, v) = (f64::from(l), f64::from(v));
        let [other, own] = ruled.heights(l);
        let height = other + v * (own - other);
        let normal = ruled.normal(l);
        let stretch = 1.0 / normal.length().max(Patch::LEAST_NORMAL);
        let [slope_of_other, slope_of_own] = ruled.slopes(l);
        let rise = slope_of_other + v * (slope_of_own - slope_of_other);
        let [along, turn] = ruled.along();
        let (b1, b2) = ruled.barycentrics(l);
        let base = ruled.patch.base(b1, b2);
        let outward = ruled.outward(l, height * stretch, own >= other).as_vec3();
        let unit = stretch * normal;
        let [st0, st1, st2] = self.mesh.corner_texcoords(wall.triangle);
        Interpolated {
            point: SurfacePoint {
                position: (base + height * unit).as_vec3(),
                base_position: base.as_vec3(),
                base_normal: normal.normalize_or(ruled.patch.face_normal()).as_vec3(),
                geometric_normal: outward,
                shading_normal: outward,
                texcoord: st0 + b1 as f32 * (st1 - st0) + b2 as f32 * (st2 - st0),
                displacement: height as f32,
                tolerance: 0.0,
            },
            du: (along + rise * unit + height * stretch * (turn - unit * unit.dot(turn))).as_vec3(),
            dv: ((own - other) * unit).as_vec3(),
        }
    }
}

#[cfg(test)]
mod tests;
