//! Polygons to triangles: a quad by its better diagonal, larger ones by ear clipping (crate `earcut`).
//!
//! A polygon is looked at along Newell's normal, its area vector. Convex ones are cut from their first corner. What has no triangulation
//! over its own corners (edges that cross, no area) is cut so too, and counted.
//!
//! Ear clipping takes n^2 steps on a large polygon, and n^3 on one whose edges touch all over. So a large one is first parted by diagonals:
//! 100 000 corners take less than a second, and the time for a file goes with its corners.

mod pieces;

use earcut::Earcut;
use glam::{DVec2, DVec3, Vec3};

/// Ears are clipped from pieces of at most so many corners.
const MOST_EARS: usize = 128;

/// The other diagonal of a convex quad is taken where it is shorter by more than this share: noise in the coordinates decides nothing.
const CLEARLY_SHORTER: f64 = 1e-3;

/// Cuts the polygons of one file.
pub(in crate::scene) struct Triangulator {
    earcut: Earcut<f64>,
    /// The corners as seen along the normal, counter-clockwise, repeated ones left out.
    flat: Vec<DVec2>,
    /// Their numbers in the polygon.
    numbers: Vec<u32>,
    clipped: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    given_up: usize,
    keeps_polygons: bool,
}

impl Triangulator {
    /// One that keeps polygons cuts each into a fan of n - 2 triangles around its first corner, whatever its shape.
    pub(in crate::scene) fn new(keeps_polygons: bool) -> Self {
        Self {
            keeps_polygons,
            earcut: Earcut::new(),
            flat: Vec::new(),
            numbers: Vec::new(),
            clipped: Vec::new(),
            triangles: Vec::new(),
            given_up: 0,
        }
    }

    /// Whether a file's polygons can be told from its triangles.
    pub(super) fn keeps_polygons(&self) -> bool {
        self.keeps_polygons
    }

    /// The triangles over the corners' numbers, as the polygon winds: n - 2, or fewer where corners coincide. None of fewer than three corners.
    pub(in crate::scene) fn cut(&mut self, corners: &[Vec3]) -> &[[u32; 3]] {
        self.triangles.clear();
        match *corners {
            [] | [_] | [_, _] => {}
            _ if self.keeps_polygons => self.fan(corners.len()),
            [_, _, _] => self.triangles.push([0, 1, 2]),
            [a, b, c, d] if a != b && b != c && c != d && d != a => self.cut_quad([a, b, c, d]),
            _ => self.cut_polygon(corners),
        }
        &self.triangles
    }

    /// What to tell the user, if anything.
    pub(super) fn warning(&self) -> Option<String> {
        match self.given_up {
            0 => None,
            1 => Some(
                "a polygon crosses itself or has no area; it was cut from its first corner".into(),
            ),
            n => Some(format!(
                "{n} polygons cross themselves or have no area; they were cut from their first corners"
            )),
        }
    }

    /// Both triangles must wind as the quad does; where both diagonals allow that, the shorter one is taken.
    fn cut_quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, c, d] = corners.map(Vec3::as_dvec3);
        let normal = (c - a).cross(d - b);
        let winds = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).dot(normal) > 0.0;
        let first = winds(a, b, c) && winds(a, c, d);
        let second = winds(a, b, d) && winds(b, c, d);
        let shorter =
            (d - b).length_squared() < (c - a).length_squared() * (1.0 - CLEARLY_SHORTER).powi(2);
        if second && (shorter || !first) {
            self.triangles.extend([[0, 1, 3], [1, 2, 3]]);
            return;
        }
        // NaN is the mesh builder's to name.
        if !first && normal.is_finite() {
            self.given_up += 1;
        }
        self.triangles.extend([[0, 1, 2], [0, 2, 3]]);
    }

    fn cut_polygon(&mut self, corners: &[Vec3]) {
        let normal = newell(corners);
        if !normal.is_finite() {
            self.fan(corners.len());
            return;
        }
        self.flatten(corners, normal);
        let n = self.flat.len();
        if normal == DVec3::ZERO || n < 3 {
            self.given_up += usize::from(n > 3);
            self.fan(corners.len());
        } else if is_convex(&self.flat) {
            self.fan(n);
            self.renumber();
        } else if self.cut_concave() {
            self.renumber();
        } else {
            self.given_up += 1;
            self.fan(n);
            self.renumber();
        }
    }

    /// Looks at the corners along the normal, onto the coordinate plane that it is nearest to; what lies in such a plane keeps its digits.
    fn flatten(&mut self, corners: &[Vec3], normal: DVec3) {
        let k = normal.abs().max_position();
        let (i, j) = match normal[k] > 0.0 {
            true => ((k + 1) % 3, (k + 2) % 3),
            false => ((k + 2) % 3, (k + 1) % 3),
        };
        let slope = normal / normal[k];
        self.flat.clear();
        self.numbers.clear();
        let mut last = corners[corners.len() - 1];
        for (number, &corner) in corners.iter().enumerate() {
            if corner != last {
                let p = corner.as_dvec3() - corners[0].as_dvec3();
                self.flat
                    .push(DVec2::new(p[i] - slope[i] * p[k], p[j] - slope[j] * p[k]));
                self.numbers.push(number as u32);
            }
            last = corner;
        }
    }

    /// Cuts what is not convex; false if the triangles do not make up the polygon's area.
    fn cut_concave(&mut self) -> bool {
        for piece in pieces::pieces(&self.flat, MOST_EARS).unwrap_or_default() {
            let points = piece.iter().map(|&i| self.flat[i as usize].to_array());
            self.earcut.earcut(points, &[], &mut self.clipped);
            let cut: &[[u32; 3]] = self.clipped.as_chunks().0;
            let number = |i: u32| piece[i as usize];
            self.triangles.extend(cut.iter().map(|t| t.map(number)));
        }
        let corner = |i: u32| self.flat[i as usize];
        let area = |t: &[u32; 3]| twice_area(&t.map(corner));
        let sum: f64 = self.triangles.iter().map(area).sum();
        let whole = twice_area(&self.flat);
        let covered = (sum - whole).abs() <= 1e-6 * whole;
        if !covered {
            self.triangles.clear();
        }
        covered
    }

    fn fan(&mut self, corners: usize) {
        self.triangles
            .extend((1..corners.max(3) as u32 - 1).map(|i| [0, i, i + 1]));
    }

    fn renumber(&mut self) {
        for i in self.triangles.as_flattened_mut() {
            *i = self.numbers[*i as usize];
        }
    }
}

/// Twice the area vector (M. Newell; Tampieri, Graphics Gems III, 1992), taken from the first corner so that it keeps its digits far from 0.
fn newell(corners: &[Vec3]) -> DVec3 {
    let from = |p: Vec3| p.as_dvec3() - corners[0].as_dvec3();
    corners
        .windows(2)
        .map(|pair| from(pair[0]).cross(from(pair[1])))
        .sum()
}

/// Twice the signed area.
fn twice_area(points: &[DVec2]) -> f64 {
    let from = |p: DVec2| p - points[0];
    points
        .windows(2)
        .map(|pair| from(pair[0]).perp_dot(from(pair[1])))
        .sum()
}

/// Strictly convex and once around: every turn is to the left, and the walk goes up once and down once.
fn is_convex(points: &[DVec2]) -> bool {
    let n = points.len();
    let edge = |i: usize| points[(i + 1) % n] - points[i % n];
    let upward = |i: usize| edge(i).y > 0.0 || (edge(i).y == 0.0 && edge(i).x > 0.0);
    let left = (0..n).all(|i| edge(i).perp_dot(edge(i + 1)) > 0.0);
    left && (0..n).filter(|&i| upward(i) != upward(i + 1)).count() == 2
}

#[cfg(test)]
mod tests;
