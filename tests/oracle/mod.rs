//! All intersections of a ray with S, in f64, by branch and prune: slow, and sharing nothing with the kernels but S's
//! definition ([`Patch`]).
//!
//! Seen along the ray S(b) - o is a map F from (u, v) to the plane, and a crossing is a root of F. A rectangle of
//! (u, v) is thrown away when bounds of F over it exclude 0; it is done with when Krawczyk's operator proves one and
//! only one root in it (R. Krawczyk, "Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken",
//! Computing 4, 1969); else it is halved. F is only piecewise smooth: over the lines between texel cells the bounds of
//! its Jacobian are the hull over all cells that the rectangle touches, which is what the mean value theorem and the
//! proof need. Nothing here steps along the ray, so grazing rays, rays along the normals and rays in the base plane
//! are all the same.
//!
//! What cannot be told apart at rectangles of [`SMALLEST`] (double roots: silhouettes, ridges) is reported as a
//! crossing that is not `sure`.

#![allow(dead_code)] // every program uses a part

mod heights;
mod interval;
mod rectangle;

use glam::{DVec2, DVec3};
use prismarch::ray::Ray;
use prismarch::surface::{DisplacedSurface, Patch};

use heights::Heights;
use rectangle::{Rectangle, Verdict, View};

/// Half the side of the rectangles, in barycentric coordinates, at which halving ends.
const SMALLEST: f64 = 1.0 / (1 << 21) as f64;

/// Rectangles looked at, and places left undecided, per ray and triangle; more are needed only where the ray runs
/// along inside the surface.
const MOST_RECTANGLES: usize = 40_000;
const MOST_BLURS: usize = 64;

/// Crossings this close to an edge, in barycentric coordinates, are not sure to be on this triangle.
pub const EDGE: f64 = 1e-9;

/// A ray in f64.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    pub origin: DVec3,
    pub direction: DVec3,
    /// Crossings outside this open interval of t are not its first.
    pub interval: [f64; 2],
}

impl From<&Ray> for Line {
    fn from(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_dvec3(),
            direction: ray.direction.as_dvec3(),
            interval: [ray.tnear, ray.tfar].map(f64::from),
        }
    }
}

/// A point where the ray crosses S.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Base triangle.
    pub prim: u32,
    /// Ray parameter.
    pub t: f64,
    pub u: f64,
    pub v: f64,
    /// Unit normal of S, along dS/du x dS/dv.
    pub ng: DVec3,
    /// |cos| of the angle between ray and normal.
    pub grazing: f64,
    /// False for a root that may be double or none, or on the triangle's edge.
    pub sure: bool,
    /// A single root, within [`EDGE`] of the triangle's edge.
    pub on_edge: bool,
}

impl Crossing {
    fn new(patch: &Patch<'_>, line: &Line, prim: u32, b: DVec2, sure: bool) -> Self {
        let Line {
            origin, direction, ..
        } = *line;
        let point = patch.point(b.x, b.y);
        let ng = point.du.cross(point.dv).normalize_or_zero();
        Self {
            prim,
            t: (point.position - origin).dot(direction) / direction.length_squared(),
            u: b.x,
            v: b.y,
            ng,
            grazing: ng.dot(direction.normalize()).abs(),
            sure: sure && least_weight(b) > EDGE,
            on_edge: sure && least_weight(b) <= EDGE,
        }
    }
}

/// What a ray meets.
#[derive(Clone, Debug, Default)]
pub struct Crossings {
    /// By t.
    pub all: Vec<Crossing>,
    /// The search was given up: there may be more crossings.
    pub incomplete: bool,
}

impl Crossings {
    /// A crossing on an edge is sure after all where the triangles on both sides have it.
    fn confirm_edges(&mut self) {
        for k in 1..self.all.len() {
            let [a, b] = [self.all[k - 1], self.all[k]];
            let same = b.t - a.t <= 1e-11 * b.t.abs() && a.prim != b.prim;
            if same && a.on_edge && b.on_edge {
                self.all[k - 1].sure = true;
                self.all[k].sure = true;
            }
        }
    }

    /// The crossings that the line's interval holds, up to the first that is sure.
    pub fn first(&self, line: &Line) -> &[Crossing] {
        let [near, far] = line.interval;
        let from = self.all.partition_point(|crossing| crossing.t <= near);
        let to = self.all.partition_point(|crossing| crossing.t < far);
        let within = &self.all[from..to.max(from)];
        let sure = within.iter().position(|crossing| crossing.sure);
        &within[..sure.map_or(within.len(), |k| k + 1)]
    }
}

/// The oracle of one surface.
pub struct Oracle<'s> {
    surface: &'s DisplacedSurface,
    heights: Heights,
    /// Per triangle: middle and radius of a ball around S.
    balls: Vec<(DVec3, f64)>,
}

impl<'s> Oracle<'s> {
    pub fn new(surface: &'s DisplacedSurface) -> Self {
        let heights = Heights::new(surface);
        let reach = heights.range().magnitude();
        let ball = |prim| {
            let vertices = surface.patch(prim).vertices;
            let middle = (vertices[0] + vertices[1] + vertices[2]) / 3.0;
            let radius = vertices.map(|v| v.distance(middle));
            let radius = radius.into_iter().fold(0.0, f64::max);
            (middle, 1.0001 * radius + reach)
        };
        let count = surface.mesh().triangles().len() as u32;
        Self {
            surface,
            heights,
            balls: (0..count).map(ball).collect(),
        }
    }

    /// All crossings of the whole line with S over triangle `prim` grown by `margin` (barycentric).
    pub fn crossings(&self, prim: u32, line: &Line, margin: f64) -> Crossings {
        let patch = self.surface.patch(prim);
        let view = View::new(&patch, &self.heights, line);
        let mut found = Crossings::default();
        let mut roots: Vec<DVec2> = Vec::new();
        let mut blurs: Vec<DVec2> = Vec::new();
        let mut rest = vec![Rectangle {
            middle: DVec2::splat(0.5),
            radius: DVec2::splat(0.5 + margin),
        }];
        let mut count = 0;
        while let Some(rectangle) = rest.pop() {
            count += 1;
            if count > MOST_RECTANGLES || blurs.len() > MOST_BLURS {
                found.incomplete = true;
                break;
            }
            let low = rectangle.middle - rectangle.radius;
            if low.element_sum() > 1.0 + margin {
                continue;
            }
            match view.judge(&rectangle) {
                Verdict::Nothing => {}
                Verdict::One(root) => {
                    // Rectangles overlap, so neighbours may prove the same root.
                    let known = roots
                        .iter()
                        .any(|r| (*r - root).abs().max_element() < 1e-10);
                    if !known && least_weight(root) >= -margin {
                        roots.push(root);
                    }
                }
                Verdict::Less(smaller) => rest.push(smaller),
                Verdict::Unknown if rectangle.radius.max_element() > SMALLEST => {
                    rest.extend(view.halves(&rectangle));
                }
                Verdict::Unknown => {
                    let middle = rectangle.middle;
                    let near = |r: &DVec2| (*r - middle).abs().max_element() < 16.0 * SMALLEST;
                    if !blurs.iter().any(near) {
                        blurs.push(middle);
                    }
                }
            }
        }
        for (list, sure) in [(roots, true), (blurs, false)] {
            let crossing = |b: DVec2| Crossing::new(&patch, line, prim, b, sure);
            found.all.extend(list.into_iter().map(crossing));
        }
        found.all.sort_by(|a, b| a.t.total_cmp(&b.t));
        found
    }

    /// All crossings with the whole surface, each triangle grown by `margin`: at least [`EDGE`], lest a line through a
    /// shared edge slip through by rounding.
    pub fn trace(&self, line: &Line, margin: f64) -> Crossings {
        let (origin, direction) = (line.origin, line.direction.normalize());
        let mut found = Crossings::default();
        for (prim, (middle, radius)) in (0u32..).zip(&self.balls) {
            if (*middle - origin).cross(direction).length() > radius * (1.0 + 4.0 * margin) {
                continue;
            }
            let here = self.crossings(prim, line, margin);
            found.incomplete |= here.incomplete;
            found.all.extend(here.all);
        }
        found.all.sort_by(|a, b| a.t.total_cmp(&b.t));
        found.confirm_edges();
        found
    }

    /// Whether two crossings, not counting those on both sides of an edge, or a touch lie so close together that
    /// single precision has no t to tell them apart.
    pub fn is_tied(&self, ray: &Ray) -> bool {
        let found = self.trace(&Line::from(ray), EDGE);
        let tied = |pair: &[Crossing]| {
            let gap = pair[1].t - pair[0].t;
            let one = gap < 1e-12 && pair[0].prim != pair[1].prim;
            !one && gap <= 4.0 * f64::from(f32::EPSILON) * pair[1].t.abs()
        };
        let undecided = |c: &Crossing| !c.sure && !c.on_edge;
        found.incomplete || found.all.windows(2).any(tied) || found.all.iter().any(undecided)
    }
}

/// The smallest barycentric weight: negative outside.
fn least_weight(b: DVec2) -> f64 {
    b.min_element().min(1.0 - b.x - b.y)
}
