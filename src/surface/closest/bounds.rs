//! Parts of a triangle's piece of S: how near they may come, and how they are cut.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::PointQuery;
use crate::surface::Patch;
use crate::surface::block::{Polygon, TexelBox};

/// A part of the barycentric triangle.
#[derive(Clone, Copy)]
pub struct Part {
    /// (u, v).
    corners: [DVec2; 3],
    /// The texel cell that it is in; else it is coarse.
    cell: Option<Cell>,
}

/// D in a texel cell: d[0] + d[1] x + d[2] y + d[3] x y from its lower left corner.
#[derive(Clone, Copy)]
struct Cell {
    corner: DVec2,
    d: [f64; 4],
}

impl Cell {
    fn displacement(&self, texel: DVec2) -> f64 {
        let (f, [a, b, c, d]) = (texel - self.corner, self.d);
        a + b * f.x + c * f.y + d * f.x * f.y
    }

    /// |dD/dx| and |dD/dy|.
    fn slopes(&self, texel: DVec2) -> DVec2 {
        let (f, [_, b, c, d]) = (texel - self.corner, self.d);
        DVec2::new(b + d * f.y, c + d * f.x).abs()
    }
}

/// Of the bound of |N''|.
const TWO_OVER_ROOT_THREE: f64 = 1.154_700_6;

impl Part {
    /// A triangle of (u, v), of any number of texels.
    pub fn coarse(corners: [DVec2; 3]) -> Self {
        let cell = None;
        Self { corners, cell }
    }
}

/// How near S may come over a part.
pub struct Bound {
    /// No point is nearer.
    pub below: f64,
    /// A place of the part that may be the nearest.
    pub place: DVec2,
}

/// One triangle's piece of S as it stands, the point that is asked about at the origin.
pub struct Placed<'m> {
    pub prim: u32,
    patch: Patch<'m>,
    /// v_i and n_i, placed.
    vertices: [DVec3; 3],
    normals: [DVec3; 3],
    /// The transform makes no vector longer by more.
    stretch: f64,
    /// The longest edge of the triangle and the largest |D| of what is looked at.
    pub size: f64,
}

/// At (u, v) of what is linear over the triangle.
fn weighted(x: &[DVec3; 3], b: DVec2) -> DVec3 {
    x[0] + b.x * (x[1] - x[0]) + b.y * (x[2] - x[0])
}

/// The largest of what `f` says of the three edges.
fn over_edges<T: Copy>(x: [T; 3], f: impl Fn(T, T) -> f64) -> f64 {
    f(x[0], x[1]).max(f(x[1], x[2])).max(f(x[2], x[0]))
}

fn largest(x: [f64; 3]) -> f64 {
    x[0].max(x[1]).max(x[2])
}

impl<'m> Placed<'m> {
    /// With what of it is looked at. `None` where the texture coordinates are no finite numbers.
    pub fn new(patch: Patch<'m>, prim: u32, polygon: &Polygon, query: &PointQuery) -> Option<Self> {
        let to_world = DAffine3 {
            matrix3: DMat3::from_cols_array(&query.to_world.matrix3.to_cols_array().map(f64::from)),
            translation: query.to_world.translation.as_dvec3() - query.point.as_dvec3(),
        };
        let vertices = patch.vertices.map(|v| to_world.transform_point3(v));
        let normals = patch.normals.map(|n| to_world.transform_vector3(n));
        // The norm is the root of the largest eigenvalue of M^T M, which is no larger than its largest row.
        let square = to_world.matrix3.transpose() * to_world.matrix3;
        let rows = [square.x_axis, square.y_axis, square.z_axis].map(|row| row.abs().element_sum());
        let stretch = largest(rows).sqrt();
        let [first, last] = polygon.texels();
        let [low, high] = patch.displacements(patch.map.range_in_box(first, last));
        let size = over_edges(vertices, DVec3::distance) + stretch * low.abs().max(high.abs());
        let texels = patch.texels.iter().all(|texel| texel.is_finite());
        (texels && size.is_finite()).then_some(Self {
            prim,
            patch,
            vertices,
            normals,
            stretch,
            size,
        })
    }

    /// S, from the point that is asked about.
    pub fn position(&self, b: DVec2) -> DVec3 {
        let w = self.patch.displacement(b.x, b.y) / self.patch.normal(b.x, b.y).length();
        weighted(&self.vertices, b) + w * weighted(&self.normals, b)
    }

    /// Over a part: N' at its corners, and |N'| from below, anywhere in it.
    fn raw_normals(&self, part: &Part) -> ([DVec3; 3], f64) {
        let raw = part.corners.map(|b| self.patch.normal(b.x, b.y));
        // N' is linear, so its component along any direction is least at a corner.
        let middle = (raw[0] + raw[1] + raw[2]).normalize_or_zero();
        let [a, b, c] = raw.map(|n| n.dot(middle));
        (raw, a.min(b).min(c).max(Patch::LEAST_NORMAL))
    }

    /// How near S may come over a part.
    pub fn bound(&self, part: &Part) -> Bound {
        let (flat, off, least) = match &part.cell {
            None => self.coarse(part),
            Some(cell) => self.fine(part, cell),
        };
        let (distance, [p, q, r]) = nearest_on_triangle(flat);
        let [a, b, c] = part.corners;
        let place = (p * a + q * b + r * c).max(DVec2::ZERO);
        Bound {
            below: (distance - off).max(least),
            place: place / (place.x + place.y).max(1.0),
        }
    }

    fn texels(&self, part: &Part) -> [DVec2; 3] {
        part.corners.map(|b| self.patch.texel(b.x, b.y))
    }

    /// The triangle at the middle of the range of D, how far S is from it at most, and another bound of how near S may come.
    fn coarse(&self, part: &Part) -> ([DVec3; 3], f64, f64) {
        let (raw, least) = self.raw_normals(part);
        let [a, b, c] = self.texels(part);
        let heights = self
            .patch
            .map
            .range_in_box(a.min(b).min(c), a.max(b).max(c));
        let [low, high] = self.patch.displacements(heights);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let flat = self.at_corners(part, raw, [middle; 3]);
        let turn = over_edges(raw, DVec3::distance) / least;
        let off = self.stretch * TWO_OVER_ROOT_THREE * middle.abs() * turn * turn / 6.0;

        // From the flat triangle S goes `half` along some N at most, and by `off` anywhere. Across the mean direction of N the
        // first is little: high and narrow parts are no nearer than seen along it.
        let normals = part.corners.map(|b| weighted(&self.normals, b));
        let axis = (normals[0] + normals[1] + normals[2]).normalize_or_zero();
        let across = |v: DVec3| v - axis * axis.dot(v);
        let lean = largest(normals.map(|n| across(n).length())) / least;
        let (aside, _) = nearest_on_triangle(flat.map(across));
        let aside = (aside - half * lean - off).max(0.0);
        let heights = flat.map(|v| v.dot(axis));
        let (low, high) = (-largest(heights.map(|h| -h)), largest(heights));
        let reach = self.stretch * half + off;
        let above = (low - reach).max(-high - reach).max(0.0);
        (flat, reach, aside.hypot(above))
    }

    /// The same of the triangle through S at the corners, without the other bound.
    fn fine(&self, part: &Part, cell: &Cell) -> ([DVec3; 3], f64, f64) {
        let (raw, least) = self.raw_normals(part);
        let texels = self.texels(part);
        let displacements = texels.map(|texel| cell.displacement(texel));
        let across = over_edges(texels, |a, b| (a.x - b.x).abs());
        let up = over_edges(texels, |a, b| (a.y - b.y).abs());
        let twist = (cell.d[3] * across * up).abs();
        let [a, b, c] = texels.map(|texel| cell.slopes(texel));
        let rise = a.max(b).max(c).dot(DVec2::new(across, up));
        let turn = over_edges(raw, DVec3::distance) / least;
        let reach = largest(displacements.map(f64::abs)) + twist;
        let second = 2.0 * twist + 2.0 * rise * turn + TWO_OVER_ROOT_THREE * reach * turn * turn;
        let flat = self.at_corners(part, raw, displacements);
        (flat, self.stretch * second / 6.0, 0.0)
    }

    /// P + D N at the corners of a part, where N' is `raw`.
    fn at_corners(&self, part: &Part, raw: [DVec3; 3], displacements: [f64; 3]) -> [DVec3; 3] {
        [0, 1, 2].map(|k| {
            let w = displacements[k] / raw[k].length().max(Patch::LEAST_NORMAL);
            let b = part.corners[k];
            weighted(&self.vertices, b) + w * weighted(&self.normals, b)
        })
    }

    /// Parts that make up a part.
    pub fn cut(&self, part: &Part, pieces: &mut Vec<Part>) {
        let texels = self.texels(part);
        let low = texels[0].min(texels[1]).min(texels[2]);
        let high = texels[0].max(texels[1]).max(texels[2]);
        if part.cell.is_some() || (high - low).max_element() > 1.0 {
            pieces.extend(halved(part));
        } else {
            self.cut_into_cells(part, texels, [low.floor(), high.floor()], pieces);
        }
    }

    /// The parts of a small part in each of the texel cells from `low` to `high`.
    fn cut_into_cells(
        &self,
        part: &Part,
        texels: [DVec2; 3],
        [low, high]: [DVec2; 2],
        pieces: &mut Vec<Part>,
    ) {
        for j in 0..=(high.y - low.y) as usize {
            for i in 0..=(high.x - low.x) as usize {
                let corner = low + DVec2::new(i as f64, j as f64);
                let square = TexelBox {
                    low: corner,
                    high: corner + 1.0,
                };
                let polygon = Polygon::new(part.corners, texels, &square);
                if polygon.is_empty() {
                    continue;
                }
                let cell = Some(self.cell(corner));
                let triangles = polygon.triangles();
                pieces.extend(triangles.map(|corners| Part { corners, cell }));
            }
        }
    }

    fn cell(&self, corner: DVec2) -> Cell {
        let at = |x: f64, y: f64| {
            let height = self.patch.map.sample(corner + DVec2::new(x, y)).height;
            self.patch.scale * (height - self.patch.midlevel)
        };
        let (a, b, c) = (at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0));
        let d = [a, b - a, c - a, at(1.0, 1.0) - b - c + a];
        Cell { corner, d }
    }
}

/// Four parts between corners and middles of edges.
fn halved(part: &Part) -> [Part; 4] {
    let [a, b, c] = part.corners;
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|corners| Part { corners, ..*part })
}

/// The distance of the origin from a triangle, and the weights of the nearest point.
fn nearest_on_triangle(v: [DVec3; 3]) -> (f64, [f64; 3]) {
    let mut best = (f64::INFINITY, [1.0, 0.0, 0.0]);
    let mut consider = |weights: [f64; 3]| {
        let [p, q, r] = weights;
        let distance = (p * v[0] + q * v[1] + r * v[2]).length();
        if distance < best.0 {
            best = (distance, weights);
        }
    };
    let normal = (v[1] - v[0]).cross(v[2] - v[0]);
    let areas = [1, 2, 0].map(|k: usize| normal.dot(v[k].cross(v[(k + 1) % 3])));
    let all = areas[0] + areas[1] + areas[2];
    if all > 0.0 && areas.iter().all(|&a| a >= 0.0) {
        consider(areas.map(|a| a / all));
    }
    // Also where the foot is inside: a sliver's areas are no better than its edges.
    for k in 0..3 {
        let next = (k + 1) % 3;
        let edge = v[next] - v[k];
        let f = (-v[k].dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        let mut weights = [0.0; 3];
        // NaN for an edge without length.
        weights[next] = if f >= 0.0 { f } else { 0.0 };
        weights[k] = 1.0 - weights[next];
        consider(weights);
    }
    best
}
