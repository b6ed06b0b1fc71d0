//! The nearest point of S to a point, by branch and bound over the barycentric triangle.
//!
//! A part of the triangle is a triangle of (u, v) with corners b^k. How near S can come over it is bounded from below by a flat
//! triangle and by how far S is from that at most ([`Placed`]):
//!
//! - **Coarse**, many texels: the map's min/max pyramid has the range of D. The flat triangle is that of P + D N at the corners for the D
//!   at the middle of the range; S is within half the range of it along some N, and by what P + D N of one D bends, as below. Parts
//!   that are higher than wide are also bounded beside and above.
//! - **In one texel cell**, where D is bilinear and S smooth: the flat triangle is that of S at the corners. For a function f with
//!   |f''| <= q(d) along any step d within the triangle, q a quadratic form, Taylor's formula from a point b to the three corners gives
//!   |f(b) - sum beta_k f(b^k)| <= 1/2 sum beta_k q(b^k - b) = 1/2 sum_{j<k} beta_j beta_k q(b^k - b^j) <= max q(edge) / 6.
//!   Here f = D N with N = m/|m|, m = N'(b) linear: |N| = 1, |N'| <= nu and |N''| <= 2/sqrt(3) nu^2 with nu = |m'|/|m|, so
//!   |f''| <= 2 |D_xy dx dy| + 2 |D'| nu + 2/sqrt(3) |D| nu^2 (products ab are below (lambda a^2 + b^2/lambda)/2, a form again).
//!
//! The part that may be nearest is looked at first: cut in four, or where it is about a texel into the cells it covers. Each flat
//! triangle's nearest point gives a place on S to try, which inside a cell is a step of Gauss and Newton's method. The
//! bounds in a cell shrink by four with every cut, so that few parts stay in the race; it ends when none can win by more than
//! [`RELATIVE`] of the distance and [`OF_SIZE`] of the triangle's size.

mod bounds;

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{Affine3A, DVec2, Vec3};

use super::block::Polygon;
use super::{DisplacedSurface, Patch, TexelBox};
use bounds::{Part, Placed};

/// The nearest point of a displaced surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// From the point that was asked about, world units.
    pub distance: f32,
    /// On the surface, world units.
    pub point: Vec3,
    /// Base triangle.
    pub prim: u32,
    /// Barycentric coordinate of vertex 1.
    pub u: f32,
    /// Barycentric coordinate of vertex 2.
    pub v: f32,
}

/// A point whose nearest neighbour on surfaces is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointQuery {
    /// World units.
    pub point: Vec3,
    /// Nothing further than this is of interest; world units, may be infinite.
    pub radius: f32,
    /// 0 to 1, for what moves; other surfaces do not look at it.
    pub time: f32,
    /// Where the surface stands: any finite transform. Distances are those in the world, also under one that stretches.
    pub to_world: Affine3A,
}

impl PointQuery {
    /// At time 0, about a surface that stands in the world as it is.
    pub fn new(point: Vec3, radius: f32) -> Self {
        Self {
            point,
            radius,
            time: 0.0,
            to_world: Affine3A::IDENTITY,
        }
    }

    /// False for a NaN or infinite point or transform and a radius that is NaN or negative: nothing is near such a point.
    pub fn is_valid(&self) -> bool {
        self.point.is_finite() && self.radius >= 0.0 && self.to_world.is_finite()
    }
}

/// What a part must win by, of the distance.
const RELATIVE: f64 = 1e-6;

/// The same, of the triangle's size.
const OF_SIZE: f64 = 1e-7;

/// Cuts after which a part is one place: beyond, f64 does not tell texels apart.
const DEEPEST: u32 = 40;

/// Parts after which the best place so far has to do: far more than any map takes that is not repeated millions of times over a
/// triangle, until its surface fills the prism.
const MOST_PARTS: usize = 1 << 18;

/// A part with the least distance that S can have over it.
struct Candidate {
    below: f64,
    /// Cuts that it took: of parts with the same bound, zero above all, the smallest goes first, down to places that are near.
    depth: u32,
    placed: usize,
    part: Part,
}

impl Ord for Candidate {
    /// The nearest is the greatest: a heap's first.
    fn cmp(&self, other: &Self) -> Ordering {
        let by_bound = other.below.total_cmp(&self.below);
        by_bound.then(self.depth.cmp(&other.depth))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

struct Search<'s> {
    placed: Vec<Placed<'s>>,
    heap: BinaryHeap<Candidate>,
    /// Of the best place so far; the radius while there is none.
    distance: f64,
    /// Index into `placed`, and (u, v).
    best: Option<(usize, DVec2)>,
}

impl<'s> Search<'s> {
    /// Starts with what of a triangle's piece of S is in a block.
    fn start(&mut self, prim: u32, patch: Patch<'s>, block: &TexelBox, query: &PointQuery) {
        let polygon = Polygon::of(&patch, block);
        if polygon.is_empty() {
            return;
        }
        let Some(placed) = Placed::new(patch, prim, &polygon, query) else {
            return;
        };
        self.placed.push(placed);
        for corners in polygon.triangles() {
            self.add(self.placed.len() - 1, Part::coarse(corners), 0.0, 0);
        }
    }

    /// Whether nothing of a triangle that is not nearer than this is of interest.
    fn is_lost(&self, placed: usize, below: f64) -> bool {
        below >= self.distance * (1.0 - RELATIVE) - OF_SIZE * self.placed[placed].size
    }

    /// Tries a place, and keeps the part if it may hold a better one.
    fn add(&mut self, placed: usize, part: Part, least: f64, depth: u32) {
        let at = &self.placed[placed];
        let bound = at.bound(&part);
        let below = bound.below.max(least);
        if self.is_lost(placed, below) {
            return;
        }
        let distance = at.position(bound.place).length();
        if distance < self.distance || distance == self.distance && self.best.is_none() {
            self.distance = distance;
            self.best = Some((placed, bound.place));
        }
        self.heap.push(Candidate {
            below,
            depth,
            placed,
            part,
        });
    }

    fn run(&mut self) {
        let mut pieces = Vec::new();
        for _ in 0..MOST_PARTS {
            let Some(Candidate {
                below,
                depth,
                placed,
                part,
            }) = self.heap.pop()
            else {
                return;
            };
            if depth < DEEPEST && !self.is_lost(placed, below) {
                self.placed[placed].cut(&part, &mut pieces);
                for piece in pieces.drain(..) {
                    self.add(placed, piece, below, depth + 1);
                }
            }
        }
    }
}

impl DisplacedSurface {
    /// The nearest point of the displaced surface over these base triangles, no further than the query's radius: none where there is none,
    /// where the query is not [valid](PointQuery::is_valid), or where nothing is nearer than the radius by a millionth of it and a ten
    /// millionth of the triangle's size. The distance is the true one up to the same.
    ///
    /// Where a map is repeated more than some hundred thousand times over one triangle the search is given up in time, and the place found so
    /// far may not be the nearest.
    ///
    /// Walls of closed [`Seams`](super::Seams) are not looked at, nor are places where vertex normals cancel to less than
    /// [`Patch::LEAST_NORMAL`](super::Patch::LEAST_NORMAL). Of several places at the same distance any may be found.
    ///
    /// # Panics
    ///
    /// For a triangle that is not there.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use glam::{Vec2, Vec3};
    /// use prismarch::surface::*;
    ///
    /// // A triangle in the plane z = 0, displaced to z = 1/2.
    /// let mesh = MeshBuilder {
    ///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
    ///     normals: vec![Vec3::Z; 3],
    ///     texcoords: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
    ///     triangles: vec![[0, 1, 2]],
    /// };
    /// let (mesh, _) = mesh.build(NormalMode::File)?;
    /// let map = DisplacementMap::new(1, 1, Texels::F32(vec![0.5]), Wrap::Repeat)?;
    /// let surface = DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(1.0))?;
    ///
    /// let query = PointQuery::new(Vec3::new(0.25, 0.25, 3.5), f32::INFINITY);
    /// let found = surface.closest([0], &query).expect("the radius is infinite");
    /// assert!((found.distance - 3.0).abs() < 1e-5);
    /// assert!(found.point.distance(Vec3::new(0.25, 0.25, 0.5)) < 1e-3);
    /// assert!(surface.closest([0], &PointQuery { radius: 2.9, ..query }).is_none());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn closest(
        &self,
        prims: impl IntoIterator<Item = u32>,
        query: &PointQuery,
    ) -> Option<ClosestPoint> {
        let prims = prims.into_iter();
        self.closest_in(prims.map(|prim| (prim, TexelBox::EVERYWHERE)), query)
    }

    /// The same over blocks: what of each of these base triangles is in its rectangle of texel coordinates.
    pub(crate) fn closest_in(
        &self,
        blocks: impl IntoIterator<Item = (u32, TexelBox)>,
        query: &PointQuery,
    ) -> Option<ClosestPoint> {
        closest(blocks, |prim| self.patch(prim), query)
    }
}

/// The same for given pieces of S by triangle.
pub(super) fn closest<'m>(
    blocks: impl IntoIterator<Item = (u32, TexelBox)>,
    patch: impl Fn(u32) -> Patch<'m>,
    query: &PointQuery,
) -> Option<ClosestPoint> {
    if !query.is_valid() {
        return None;
    }
    let mut search = Search {
        placed: Vec::new(),
        heap: BinaryHeap::new(),
        distance: query.radius.into(),
        best: None,
    };
    for (prim, block) in blocks {
        search.start(prim, patch(prim), &block, query);
    }
    search.run();
    let (placed, place) = search.best?;
    let placed = &search.placed[placed];
    let offset = placed.position(place);
    Some(ClosestPoint {
        distance: search.distance as f32,
        point: (query.point.as_dvec3() + offset).as_vec3(),
        prim: placed.prim,
        u: place.x as f32,
        v: place.y as f32,
    })
}
