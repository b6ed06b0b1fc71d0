//! The hit at a crossing that f32 is certain of, in f64 on S itself.
//!
//! Most hits are in the middle of a cell and of a prism, where signs that f32 vouches for leave nothing to decide: what is asked
//! is where the hit is. Seen along the ray, S(u, v) has two lateral coordinates, and both are 0 at the hit: Newton's method in (u, v)
//! from a guess that is a hundredth of a texel off or less. On the way only these two are looked at ([`Seen`]), of one ray or of four that
//! meet the same prism; where no step is left worth taking, S in space confirms it, and gives depth and normal. What does not land in
//! a few steps, and between the ray parameters where the crossing was seen, is searched by its signs.

use glam::{DVec2, DVec3};

use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Quad, Real};
use crate::surface::{DisplacementMap, Patch};

use super::Found;

/// A crossing as f32 sees it.
#[derive(Clone, Copy)]
pub struct Guess {
    /// Barycentric coordinates of vertices 1 and 2.
    pub uv: [f64; 2],
    /// Ray parameters that it is between.
    pub t: [f64; 2],
    /// Whether the ray comes from above.
    pub above: bool,
}

/// Steps of Newton's method before the last.
const MOST_STEPS: usize = 5;

/// The hit near a guess, with its normal.
#[inline(always)]
pub fn land(patch: &Patch<'_>, frame: &RayFrame, guess: &Guess) -> Option<Found> {
    let RayFrame { origin, shear, .. } = *frame;
    let seen = Seen::new(patch, frame.axes, origin, shear);
    let mut way = Way::new(patch, guess.uv);
    for _ in 0..MOST_STEPS {
        way.go(seen.step(way.uv));
        if way.is_there {
            return way.confirmed(patch, frame, guess);
        }
    }
    None
}

/// The hits of up to four rays with the same axes near their guesses, each as if it were alone.
#[inline(always)]
pub fn land_four<Q: Quad>(
    patch: &Patch<'_>,
    frames: &[RayFrame; 4],
    guesses: &[Option<Guess>; 4],
) -> [Option<Found>; 4] {
    let mut found = [None; 4];
    let Some(some) = guesses.iter().find_map(|guess| *guess) else {
        return found;
    };
    let [f0, f1, f2, f3] = frames;
    let [[x0, y0, z0], [x1, y1, z1]] = [f0.origin, f1.origin];
    let [[x2, y2, z2], [x3, y3, z3]] = [f2.origin, f3.origin];
    let origin = [
        Q::from_array([x0, x1, x2, x3]),
        Q::from_array([y0, y1, y2, y3]),
        Q::from_array([z0, z1, z2, z3]),
    ];
    let [[s0, t0], [s1, t1], [s2, t2], [s3, t3]] = [f0.shear, f1.shear, f2.shear, f3.shear];
    let shear = [
        Q::from_array([s0, s1, s2, s3]),
        Q::from_array([t0, t1, t2, t3]),
    ];
    let seen = Seen::new(patch, f0.axes, origin, shear);
    let mut ways = [Way::new(patch, some.uv); 4];
    let mut going = 0u32;
    for k in 0..4 {
        if let Some(guess) = guesses[k] {
            ways[k].uv = guess.uv;
            going |= 1 << k;
        }
    }
    for _ in 0..MOST_STEPS {
        let [w0, w1, w2, w3] = &ways;
        let [step_u, step_v] = seen.step([
            Q::from_array([w0.uv[0], w1.uv[0], w2.uv[0], w3.uv[0]]),
            Q::from_array([w0.uv[1], w1.uv[1], w2.uv[1], w3.uv[1]]),
        ]);
        let (step_u, step_v) = (step_u.to_array(), step_v.to_array());
        for k in 0..4 {
            if going >> k & 1 != 0 {
                ways[k].go([step_u[k], step_v[k]]);
                going &= !(u32::from(ways[k].is_there) << k);
            }
        }
        if going == 0 {
            break;
        }
    }
    for k in 0..4 {
        if let Some(guess) = &guesses[k]
            && ways[k].is_there
        {
            found[k] = ways[k].confirmed(patch, &frames[k], guess);
        }
    }
    found
}

/// One ray's way to its hit.
#[derive(Clone, Copy)]
struct Way {
    uv: [f64; 2],
    last_step: f64,
    /// What may be left of the way where it ends, barycentrics.
    fine: f64,
    is_there: bool,
}

impl Way {
    #[inline(always)]
    fn new(patch: &Patch<'_>, uv: [f64; 2]) -> Self {
        // Barycentrics, and texels: where the normal is taken.
        const FINE: f64 = 1e-11;
        const FINE_TEXELS: f64 = 1e-10;
        let [a, b, c] = patch.texels;
        let texels = ((b - a).abs() + (c - a).abs()).max_element();
        Self {
            uv,
            last_step: 0.0,
            fine: FINE.min(FINE_TEXELS / texels),
            is_there: false,
        }
    }

    #[inline(always)]
    fn go(&mut self, [u, v]: [f64; 2]) {
        self.uv = [self.uv[0] + u, self.uv[1] + v];
        let step = u.abs().max(v.abs());
        // What is left is to this step's square as this step is to the square of the last.
        let ratio = step / self.last_step;
        let left = step * (4.0 * ratio * ratio).min(1.0);
        (self.last_step, self.is_there) = (step, left <= self.fine);
    }

    /// The hit, if S in space is there too: a line between texels may lie between the last two steps.
    #[inline(always)]
    fn confirmed(&self, patch: &Patch<'_>, frame: &RayFrame, guess: &Guess) -> Option<Found> {
        // What the last step may find missing: Newton's error is about the square of its step, so that nothing that
        // single precision sees depends on the guess.
        const BEYOND: f64 = 100.0;
        let ([x, y, z], [shear_x, shear_y]) = (frame.axes, frame.shear);
        let [u, v] = self.uv;
        let point = patch.point(u, v);
        let (du, dv) = (point.du, point.dv);
        let depth = point.position[z] - frame.origin[2];
        let miss_x = frame.origin[0] + depth * shear_x - point.position[x];
        let miss_y = frame.origin[1] + depth * shear_y - point.position[y];
        let [step_u, step_v] = newton(
            [miss_x, miss_y],
            [du[x] - shear_x * du[z], du[y] - shear_y * du[z]],
            [dv[x] - shear_x * dv[z], dv[y] - shear_y * dv[z]],
        );
        let t = (depth + step_u * du[z] + step_v * dv[z]) * frame.per_depth;
        let is_there = step_u.abs().max(step_v.abs()) <= BEYOND * self.fine;
        (is_there && t >= guess.t[0] && t <= guess.t[1]).then_some(Found {
            t,
            u: u + step_u,
            v: v + step_v,
            above: guess.above,
            ng: Some(point.ng),
        })
    }
}

/// A prism seen along rays, one lane each: where S(u, v) is beside them.
///
/// Lateral coordinates of P + D N'/|N'| are linear in those of the corners' vertices and normals, with k = D/|N'| alone to be found for
/// every (u, v); |N'|^2 is a quadratic.
struct Seen<'m, R> {
    map: &'m DisplacementMap,
    scale: R,
    midlevel: R,
    /// At vertex 0, and what u and v add: texel coordinates, lateral coordinates of the vertices and of their normals.
    texels: [[R; 2]; 3],
    vertices: [[R; 2]; 3],
    normals: [[R; 2]; 3],
    /// The products of n_0, n_1 - n_0 and n_2 - n_0: 00, 01, 02, 11, 12, 22.
    products: [R; 6],
}

impl<'m, R: Real> Seen<'m, R> {
    #[inline(always)]
    fn new(patch: &Patch<'m>, axes: [usize; 3], origin: [R; 3], shear: [R; 2]) -> Self {
        let ([v0, v1, v2], [n0, n1, n2]) = (patch.vertices, patch.normals);
        let [t0, t1, t2] = patch.texels;
        let (m1, m2) = (n1 - n0, n2 - n0);
        let [x, y, z] = along::<R>(v0, axes);
        Self {
            map: patch.map,
            scale: R::splat(patch.scale),
            midlevel: R::splat(patch.midlevel),
            texels: [splat2(t0), splat2(t1 - t0), splat2(t2 - t0)],
            vertices: [
                lateral([x - origin[0], y - origin[1], z - origin[2]], shear),
                lateral(along(v1 - v0, axes), shear),
                lateral(along(v2 - v0, axes), shear),
            ],
            normals: [
                lateral(along(n0, axes), shear),
                lateral(along(m1, axes), shear),
                lateral(along(m2, axes), shear),
            ],
            products: [
                R::splat(n0.dot(n0)),
                R::splat(n0.dot(m1)),
                R::splat(n0.dot(m2)),
                R::splat(m1.dot(m1)),
                R::splat(m1.dot(m2)),
                R::splat(m2.dot(m2)),
            ],
        }
    }

    /// Newton's step to where S is on the ray.
    #[inline(always)]
    fn step(&self, uv: [R; 2]) -> [R; 2] {
        let [height, gradient_x, gradient_y] = R::sampled(self.map, both(&self.texels, uv));
        let [c00, c01, c02, c11, c12, c22] = self.products;
        // N' . dN'/du, N' . dN'/dv, |N'|^2.
        let (turn_u, turn_v) = (linear([c01, c11, c12], uv), linear([c02, c12, c22], uv));
        let squared = linear([linear([c00, c01, c02], uv), turn_u, turn_v], uv);
        let per_squared = R::splat(1.0) / squared;
        let per_length = per_squared.sqrt();
        let [_, [x1, y1], [x2, y2]] = self.texels;
        let per_height = self.scale * per_length;
        let k = (height - self.midlevel) * per_height;
        let turned = k * per_squared;
        let k_u = (gradient_x * x1 + gradient_y * y1) * per_height - turned * turn_u;
        let k_v = (gradient_x * x2 + gradient_y * y2) * per_height - turned * turn_v;
        let ([px, py], [nx, ny]) = (both(&self.vertices, uv), both(&self.normals, uv));
        let [_, [vux, vuy], [vvx, vvy]] = self.vertices;
        let [_, [nux, nuy], [nvx, nvy]] = self.normals;
        let zero = R::splat(0.0);
        newton(
            [zero - (px + k * nx), zero - (py + k * ny)],
            [vux + k * nux + k_u * nx, vuy + k * nuy + k_u * ny],
            [vvx + k * nvx + k_v * nx, vvy + k * nvy + k_v * ny],
        )
    }
}

/// c0 + c1 u + c2 v.
#[inline(always)]
fn linear<R: Real>([c0, c1, c2]: [R; 3], [u, v]: [R; 2]) -> R {
    c0 + u * c1 + v * c2
}

#[inline(always)]
fn both<R: Real>([c0, c1, c2]: &[[R; 2]; 3], uv: [R; 2]) -> [R; 2] {
    [
        linear([c0[0], c1[0], c2[0]], uv),
        linear([c0[1], c1[1], c2[1]], uv),
    ]
}

/// What of a vector is beside a ray.
#[inline(always)]
fn lateral<R: Real>([x, y, z]: [R; 3], shear: [R; 2]) -> [R; 2] {
    [x - z * shear[0], y - z * shear[1]]
}

#[inline(always)]
fn along<R: Real>(p: DVec3, [x, y, z]: [usize; 3]) -> [R; 3] {
    [R::splat(p[x]), R::splat(p[y]), R::splat(p[z])]
}

#[inline(always)]
fn splat2<R: Real>(p: DVec2) -> [R; 2] {
    [R::splat(p.x), R::splat(p.y)]
}

/// The step (u, v) whose parts along `du` and `dv` make `miss`.
#[inline(always)]
fn newton<R: Real>(miss: [R; 2], du: [R; 2], dv: [R; 2]) -> [R; 2] {
    let inverse = R::splat(1.0) / (du[0] * dv[1] - dv[0] * du[1]);
    [
        (miss[0] * dv[1] - miss[1] * dv[0]) * inverse,
        (miss[1] * du[0] - miss[0] * du[1]) * inverse,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prism::ray_frame::axes;
    use crate::prism::simd::{Lanes, Portable};
    use crate::ray::Ray;
    use crate::surface::{Texels, Wrap};

    fn bumps() -> DisplacementMap {
        let heights = (0..64u32 * 64).map(|i| (i.wrapping_mul(2654435761) >> 24) as u8);
        DisplacementMap::new(64, 64, Texels::U8(heights.collect()), Wrap::Repeat).unwrap()
    }

    fn patch(map: &DisplacementMap) -> Patch<'_> {
        let tip = |x: f64, y: f64| DVec3::new(x, y, 3.0).normalize();
        Patch {
            vertices: [
                DVec3::ZERO,
                DVec3::new(1.0, 0.1, 0.0),
                DVec3::new(0.2, 0.9, 0.1),
            ],
            normals: [tip(-1.0, -0.5), tip(1.0, 0.0), tip(0.0, 1.0)],
            texels: [
                DVec2::new(3.0, 5.0),
                DVec2::new(40.0, 9.0),
                DVec2::new(8.0, 50.0),
            ],
            map,
            scale: 0.01,
            midlevel: 0.5,
        }
    }

    /// A ray from above to the point (u, v) of S, and a guess that is a hundredth of a texel off.
    fn aimed(patch: &Patch<'_>, u: f64, v: f64) -> (RayFrame, Guess) {
        let to = patch.point(u, v).position;
        let from = DVec3::new(0.7, -0.4, 2.0).as_vec3();
        let ray = Ray::new(from, (to - from.as_dvec3()).as_vec3());
        let guess = Guess {
            uv: [u + 2e-4, v - 1e-4],
            t: [0.5, 1.5],
            above: true,
        };
        (RayFrame::new(&ray, axes(&ray)), guess)
    }

    fn four_land_as_each_alone<L: Lanes>() {
        let map = bumps();
        let patch = patch(&map);
        let mut landed = 0;
        for k in 0..200u32 {
            let along = |salt: u32| f64::from((4 * k + salt).wrapping_mul(40503) % 4096) / 8192.0;
            let aims = [0, 1, 2, 3].map(|lane| aimed(&patch, along(lane), along(lane + 9)));
            let mut guesses = aims.map(|(_, guess)| Some(guess));
            guesses[k as usize % 4] = None;
            let frames = aims.map(|(frame, _)| frame);
            let found = land_four::<L::Quad>(&patch, &frames, &guesses);
            for lane in 0..4 {
                let alone = guesses[lane].and_then(|guess| land(&patch, &frames[lane], &guess));
                let bits = |found: Option<Found>| {
                    found.map(|found| [found.t, found.u, found.v].map(f64::to_bits))
                };
                assert_eq!(bits(found[lane]), bits(alone), "{k} {lane}");
                let Some(found) = alone else { continue };
                landed += 1;
                assert!((found.t - 1.0).abs() < 1e-6 && found.ng.is_some());
            }
        }
        // A few cross a line between texels.
        assert!(landed > 500, "{landed} of 600");
    }

    #[test]
    fn baseline() {
        four_land_as_each_alone::<Portable>();
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn avx2() {
        if crate::prism::simd::SimdLevel::Avx2.is_supported() {
            four_land_as_each_alone::<crate::prism::simd::Avx2>();
        }
    }
}
