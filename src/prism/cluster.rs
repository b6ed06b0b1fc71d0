//! Eight prisms side by side: what a backend traces as one primitive.
//!
//! A ray is tested against all eight in one set of lanes ([`sight`](super::sight)), so that a backend's tree has an eighth of the leaves
//! and makes a fraction of the calls. 27 floats hold a prism: corners (9), vertex normals (9), texture coordinates after
//! the UV transform (6), the range of w = D/|N'| (2), and the base triangle's number with its flags (1): 108 bytes per base
//! triangle. A flag for each side tells of a wall there, where seams are closed; the walls are the surface's.
//!
//! Corners, normals and texture coordinates are the mesh's own digits: what two prisms share, they share bit for bit.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DVec2, DVec3};

use super::curve::Corners;
use super::simd::{LANES, Lanes, Quad};
use crate::surface::{Corners as TriangleCorners, DisplacedSurface, DisplacementMap, Patch};

/// Up to eight prisms; lanes that are not used repeat the first.
#[repr(C, align(32))]
pub struct Cluster {
    /// By corner and axis.
    vertices: [[[f32; LANES]; 3]; 3],
    normals: [[[f32; LANES]; 3]; 3],
    texcoords: [[[f32; LANES]; 2]; 3],
    /// Bits of the smallest and the largest w: an edit of the map changes them in place.
    offsets: [[AtomicU32; LANES]; 2],
    /// Base triangles, with flags: an edit may set [`FOLDED`].
    prims: [AtomicU32; LANES],
}

const _: () = assert!(size_of::<Cluster>() == 108 * LANES);

/// In [`Cluster::prims`]: t is not monotone in w.
const FOLDED: u32 = 1 << 31;

/// In [`Cluster::prims`]: side k has a wall, for bit k of three from this one on.
const WALLS: u32 = 27;

/// Base triangles that can be numbered.
pub const MOST_PRISMS: usize = 1 << WALLS;

/// Base triangles whose texels reach further than this are [`LONG`].
const LONG_TEXELS: f64 = 4096.0;

/// In [`Cluster::prims`]: f32 does not tell the texels along a ray apart well.
const LONG: u32 = 1 << 30;

/// Prisms in lanes: corners, normals and texture coordinates by corner and axis, and the range of w.
pub struct PrismLanes<L> {
    pub vertices: [[L; 3]; 3],
    pub normals: [[L; 3]; 3],
    pub texcoords: [[L; 2]; 3],
    pub offsets: [L; 2],
}

impl Cluster {
    /// The prisms over these base triangles (one to eight); `offsets` gives the range of w of each.
    pub fn new(
        surface: &DisplacedSurface,
        prims: &[u32],
        offsets: impl Fn(u32) -> [f32; 2],
    ) -> Self {
        debug_assert!((1..=LANES).contains(&prims.len()));
        let of_lane = |l: usize| prims.get(l).copied().unwrap_or(prims[0]);
        let mesh = surface.mesh();
        let mut cluster = Self {
            vertices: [[[0.0; LANES]; 3]; 3],
            normals: [[[0.0; LANES]; 3]; 3],
            texcoords: [[[0.0; LANES]; 2]; 3],
            offsets: Default::default(),
            prims: std::array::from_fn(|l| AtomicU32::new(of_lane(l))),
        };
        for l in 0..LANES {
            let prim = of_lane(l);
            let (v, n) = (mesh.corners(prim), mesh.corner_normals(prim));
            let st = surface.corner_texcoords(prim);
            for (texcoords, st) in cluster.texcoords.iter_mut().zip(st) {
                (texcoords[0][l], texcoords[1][l]) = (st.x, st.y);
            }
            let patch = surface.patch(prim);
            cluster.place(l, (v, n), &patch, offsets(prim));
            let [a, b, c] = patch.texels;
            if (b - a).abs().max((c - a).abs()).max_element() > LONG_TEXELS {
                *cluster.prims[l].get_mut() |= LONG;
            }
            for wall in surface.walls_of(prim) {
                *cluster.prims[l].get_mut() |= 1 << (WALLS + u32::from(wall.side));
            }
        }
        cluster
    }

    /// Puts corners and the range of w into a lane; `patch` is over the same corners.
    fn place(
        &mut self,
        lane: usize,
        (v, n): TriangleCorners,
        patch: &Patch<'_>,
        offsets: [f32; 2],
    ) {
        for k in 0..3 {
            for axis in 0..3 {
                self.vertices[k][axis][lane] = v[k][axis];
                self.normals[k][axis][lane] = n[k][axis];
            }
        }
        for (end, w) in offsets.into_iter().enumerate() {
            *self.offsets[end][lane].get_mut() = w.to_bits();
        }
        let prim = self.prims[lane].get_mut();
        *prim &= !FOLDED;
        if is_folded(patch, offsets.map(f64::from)) {
            *prim |= FOLDED;
        }
    }

    /// The prisms of some lanes (one to eight) over other corners of their triangles.
    pub fn moved(
        &self,
        surface: &DisplacedSurface,
        lanes: &[usize],
        corners: impl Fn(u32) -> TriangleCorners,
    ) -> Self {
        let of_lane = |l: usize| lanes.get(l).copied().unwrap_or(lanes[0]);
        let of_lanes =
            |row: &[f32; LANES]| -> [f32; LANES] { std::array::from_fn(|l| row[of_lane(l)]) };
        let mut moved = Self {
            texcoords: self
                .texcoords
                .each_ref()
                .map(|st| st.each_ref().map(of_lanes)),
            offsets: Default::default(),
            prims: std::array::from_fn(|l| AtomicU32::new(self.flagged(of_lane(l)))),
            ..*self
        };
        for (to, &from) in lanes.iter().enumerate() {
            let prim = self.prim(from);
            let corners = corners(prim);
            let patch = surface.patch_over(prim, corners);
            let displacements = surface.patch(prim).displacements_of(self.offsets(from));
            moved.place(to, corners, &patch, patch.offsets_of(displacements));
        }
        // Lanes beyond these are not met: they keep the corners they had, and an empty range of w.
        moved
    }

    /// A lane's base triangle with its flags.
    #[inline(always)]
    fn flagged(&self, lane: usize) -> u32 {
        self.prims[lane].load(Ordering::Relaxed)
    }

    /// Makes room for this range of w on a lane whose prism is over `patch`.
    pub fn widen(&self, lane: usize, patch: &Patch<'_>, offsets: [f32; 2]) {
        let [low, high] = self.offsets(lane);
        let both = [low.min(offsets[0]), high.max(offsets[1])];
        // First of all, so that no ray goes by the wider range in the wrong order for longer than it must.
        if self.is_ordered(lane) && is_folded(patch, both.map(f64::from)) {
            self.prims[lane].fetch_or(FOLDED, Ordering::Relaxed);
        }
        super::edits::widen([&self.offsets[0][lane], &self.offsets[1][lane]], offsets);
    }

    /// The box around the texture coordinates of all lanes: [low, high] across and up. `None` if one is no finite number.
    pub fn texcoord_bounds(&self) -> Option<[[f32; 2]; 2]> {
        // NaN where a coordinate is no finite number. By lanes: a sum of one lane would wait for itself.
        let mut zero = [0.0; LANES];
        let bounds = [0, 1].map(|axis| {
            let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
            for corner in &self.texcoords {
                for (l, &s) in corner[axis].iter().enumerate() {
                    low[l] = if s < low[l] { s } else { low[l] };
                    high[l] = if s > high[l] { s } else { high[l] };
                    zero[l] += 0.0 * s;
                }
            }
            let least = |a: f32, b: f32| if b < a { b } else { a };
            let most = |a: f32, b: f32| if b > a { b } else { a };
            [
                low.into_iter().fold(f32::INFINITY, least),
                high.into_iter().fold(f32::NEG_INFINITY, most),
            ]
        });
        (zero == [0.0; LANES]).then_some(bounds)
    }

    /// The same for one lane.
    pub fn lane_texcoord_bounds(&self, lane: usize) -> [[f32; 2]; 2] {
        [0, 1].map(|axis| {
            let [a, b, c] = [0, 1, 2].map(|k: usize| self.texcoords[k][axis][lane]);
            [a.min(b).min(c), a.max(b).max(c)]
        })
    }

    /// Base triangle of a lane.
    #[inline(always)]
    pub fn prim(&self, lane: usize) -> u32 {
        self.flagged(lane) & (MOST_PRISMS as u32 - 1)
    }

    /// The sides of a lane with walls: bit k for side k.
    #[inline(always)]
    pub fn walls(&self, lane: usize) -> u32 {
        self.flagged(lane) >> WALLS & 0b111
    }

    /// Whether any lane has a wall.
    #[inline(always)]
    pub fn has_walls(&self) -> bool {
        (0..LANES).any(|lane| self.walls(lane) != 0)
    }

    /// The range of w of a lane.
    #[inline(always)]
    pub fn offsets(&self, lane: usize) -> [f32; 2] {
        let [low, high] = &self.offsets;
        [
            f32::from_bits(low[lane].load(Ordering::Relaxed)),
            f32::from_bits(high[lane].load(Ordering::Relaxed)),
        ]
    }

    /// All prisms, with axes in the order of `axes`.
    #[inline(always)]
    pub fn lanes<L: Lanes>(&self, axes: [usize; 3]) -> PrismLanes<L> {
        let ([v0, v1, v2], [n0, n1, n2]) = (&self.vertices, &self.normals);
        let [s0, s1, s2] = &self.texcoords;
        PrismLanes {
            vertices: [by_axes(v0, axes), by_axes(v1, axes), by_axes(v2, axes)],
            normals: [by_axes(n0, axes), by_axes(n1, axes), by_axes(n2, axes)],
            texcoords: [by_rows(s0), by_rows(s1), by_rows(s2)],
            offsets: [
                L::from_bits(&self.offsets[0]),
                L::from_bits(&self.offsets[1]),
            ],
        }
    }

    /// One prism in all lanes.
    #[inline(always)]
    pub fn splat<L: Lanes>(&self, lane: usize, axes: [usize; 3]) -> PrismLanes<L> {
        let ([v0, v1, v2], [n0, n1, n2]) = (&self.vertices, &self.normals);
        let [s0, s1, s2] = &self.texcoords;
        let [low, high] = self.offsets(lane);
        PrismLanes {
            vertices: [
                of_lane(v0, axes, lane),
                of_lane(v1, axes, lane),
                of_lane(v2, axes, lane),
            ],
            normals: [
                of_lane(n0, axes, lane),
                of_lane(n1, axes, lane),
                of_lane(n2, axes, lane),
            ],
            texcoords: [pair(s0, lane), pair(s1, lane), pair(s2, lane)],
            offsets: [L::splat(low), L::splat(high)],
        }
    }

    /// Whether t is monotone in w on all rays through a lane's prism.
    #[inline(always)]
    pub fn is_ordered(&self, lane: usize) -> bool {
        self.flagged(lane) & FOLDED == 0
    }

    /// Whether f32 tells the texels along any ray through a lane's prism apart.
    #[inline(always)]
    pub fn is_short(&self, lane: usize) -> bool {
        self.flagged(lane) & LONG == 0
    }

    /// One prism's corners in the order of `axes`.
    #[inline(always)]
    pub fn corners<Q: Quad>(&self, lane: usize, [x, y, z]: [usize; 3]) -> Corners<Q> {
        let ([v0, v1, v2], [n0, n1, n2]) = (&self.vertices, &self.normals);
        Corners {
            vertices: [
                Q::from_three([v0[x][lane], v1[x][lane], v2[x][lane]]),
                Q::from_three([v0[y][lane], v1[y][lane], v2[y][lane]]),
                Q::from_three([v0[z][lane], v1[z][lane], v2[z][lane]]),
            ],
            normals: [
                Q::from_three([n0[x][lane], n1[x][lane], n2[x][lane]]),
                Q::from_three([n0[y][lane], n1[y][lane], n2[y][lane]]),
                Q::from_three([n0[z][lane], n1[z][lane], n2[z][lane]]),
            ],
        }
    }

    /// Texel coordinates of one prism's corners. They are not moved by periods of the map: neighbours have the same.
    #[inline(always)]
    pub fn texels(&self, lane: usize, map: &DisplacementMap) -> [DVec2; 3] {
        let [s0, s1, s2] = &self.texcoords;
        let texel =
            |s: &[[f32; LANES]; 2]| map.to_texel(DVec2::new(s[0][lane].into(), s[1][lane].into()));
        [texel(s0), texel(s1), texel(s2)]
    }

    /// The first of these.
    #[inline(always)]
    pub fn first_texel(&self, lane: usize, map: &DisplacementMap) -> DVec2 {
        let [s, t] = &self.texcoords[0];
        map.to_texel(DVec2::new(s[lane].into(), t[lane].into()))
    }

    /// A depth along an axis that no prism is far from.
    #[inline(always)]
    pub fn anchor(&self, axis: usize) -> f32 {
        self.vertices[0][axis][0]
    }

    /// The lanes in which t is not monotone in w.
    #[inline(always)]
    pub fn folded<L: Lanes>(&self) -> u32 {
        L::from_bits(&self.prims).sign_mask()
    }

    /// One prism in f64.
    #[inline(always)]
    pub fn patch<'m>(&self, lane: usize, surface: &'m DisplacedSurface) -> Patch<'m> {
        let vector = |rows: &[[f32; LANES]; 3]| {
            DVec3::new(
                rows[0][lane].into(),
                rows[1][lane].into(),
                rows[2][lane].into(),
            )
        };
        let [v0, v1, v2] = &self.vertices;
        let [n0, n1, n2] = &self.normals;
        let displacement = surface.displacement();
        Patch {
            vertices: [vector(v0), vector(v1), vector(v2)],
            normals: [vector(n0), vector(n1), vector(n2)],
            texels: self.texels(lane, surface.map()),
            map: surface.map(),
            scale: displacement.scale.into(),
            midlevel: displacement.midlevel.into(),
        }
    }
}

#[inline(always)]
fn by_axes<L: Lanes>(rows: &[[f32; LANES]; 3], [x, y, z]: [usize; 3]) -> [L; 3] {
    [
        L::from_array(rows[x]),
        L::from_array(rows[y]),
        L::from_array(rows[z]),
    ]
}

#[inline(always)]
fn by_rows<L: Lanes>([s, t]: &[[f32; LANES]; 2]) -> [L; 2] {
    [L::from_array(*s), L::from_array(*t)]
}

/// One lane's numbers in all lanes.
#[inline(always)]
fn of_lane<L: Lanes>(rows: &[[f32; LANES]; 3], [x, y, z]: [usize; 3], lane: usize) -> [L; 3] {
    [
        L::splat(rows[x][lane]),
        L::splat(rows[y][lane]),
        L::splat(rows[z][lane]),
    ]
}

#[inline(always)]
fn pair<L: Lanes>([s, t]: &[[f32; LANES]; 2], lane: usize) -> [L; 2] {
    [L::splat(s[lane]), L::splat(t[lane])]
}

/// Whether t is monotone in w on every ray through the prism: N'(b) . m(w) > 0, m the area normal of the triangle at w. It
/// is linear in b, so the corners decide; each is a quadratic in w, whose Bernstein coefficients bound it from below.
fn is_folded(patch: &Patch<'_>, [low, high]: [f64; 2]) -> bool {
    let [v0, v1, v2] = patch.vertices;
    let [n0, n1, n2] = patch.normals;
    let edges = |w: f64| (v1 - v0 + w * (n1 - n0), v2 - v0 + w * (n2 - n0));
    let ((a0, b0), (a1, b1)) = (edges(low), edges(high));
    let (first, last) = (a0.cross(b0), a1.cross(b1));
    let middle = 0.5 * (a0.cross(b1) + a1.cross(b0));
    let least = patch
        .normals
        .iter()
        .flat_map(|n| [first, middle, last].map(|m| n.dot(m)))
        .fold(f64::INFINITY, f64::min);
    let most = first.length().max(last.length());
    const MARGIN: f64 = 1e-9;
    least <= MARGIN * most
}

/// The base triangles in groups of [`LANES`] that lie near one another; only the last group may be smaller.
///
/// Median cuts at multiples of the group's size, along the axis that leaves the two halves the smallest boxes.
pub fn groups(centroids: &[DVec3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..centroids.len() as u32).collect();
    let mut waiting = vec![(0, order.len())];
    while let Some((start, end)) = waiting.pop() {
        let part = &mut order[start..end];
        if part.len() <= LANES {
            part.sort_unstable();
            continue;
        }
        let half = part.len().div_ceil(2).next_multiple_of(LANES);
        let mut cut = |axis: usize| {
            let key = |prim: u32| (centroids[prim as usize][axis], prim);
            part.select_nth_unstable_by(half, |&a, &b| {
                let ((x, i), (y, j)) = (key(a), key(b));
                x.total_cmp(&y).then(i.cmp(&j))
            });
            half_area(&part[..half], centroids) + half_area(&part[half..], centroids)
        };
        let costs = [cut(0), cut(1), cut(2)];
        let axis = DVec3::from(costs).min_position();
        if axis != 2 {
            cut(axis);
        }
        waiting.push((start, start + half));
        waiting.push((start + half, end));
    }
    order
}

/// Half the surface of the box around some centroids.
fn half_area(prims: &[u32], centroids: &[DVec3]) -> f64 {
    let (low, high) = prims.iter().fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(low, high), &prim| {
            let p = centroids[prim as usize];
            (low.min(p), high.max(p))
        },
    );
    let size = high - low;
    size.dot(DVec3::new(size.y, size.z, size.x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_full_compact_and_hold_every_triangle_once() {
        for count in [1, 7, 8, 9, 16, 17, 100, 1280] {
            let centroids: Vec<DVec3> = (0..count)
                .map(|i| {
                    DVec3::new(
                        f64::from(i % 10),
                        f64::from(i / 10 % 10),
                        f64::from(i / 100),
                    )
                })
                .collect();
            let order = groups(&centroids);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.iter().copied().eq(0..count as u32));
        }
    }
}
