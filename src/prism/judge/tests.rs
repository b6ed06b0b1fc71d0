//! The judge against itself cell by cell, and against points of rays taken one by one.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3, vec3};

use super::*;
use crate::prism::ray_frame::axes;
use crate::prism::simd::{Portable, SimdLevel};
use crate::prism::{March, Parts, Prisms};
use crate::ray::Ray;
use crate::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Ruled, Seams, Texels,
    Wrap,
};

struct Random(u64);

impl Random {
    /// In [0, 1).
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.next() * n as f32) as usize).min(n - 1)
    }

    fn signed(&mut self) -> Vec3 {
        vec3(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    fn map(&mut self) -> DisplacementMap {
        let (width, height) = (1 + self.below(24), 1 + self.below(24));
        let count = width * height;
        let texels = match self.below(3) {
            0 => Texels::U8((0..count).map(|_| (self.next() * 255.0) as u8).collect()),
            1 => Texels::U16((0..count).map(|_| (self.next() * 65535.0) as u16).collect()),
            _ => Texels::F32((0..count).map(|_| self.between(-0.5, 1.5)).collect()),
        };
        let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][self.below(3)];
        DisplacementMap::new(width, height, texels, wrap).unwrap()
    }

    /// One triangle: bent, folded, flat, a sliver; with a fraction of a map to a few.
    fn surface(&mut self) -> Arc<DisplacedSurface> {
        let tilt = [0.0, 0.05, 0.3, 1.0, 3.0][self.below(5)];
        let width = [1.0, 1.0, 0.3, 1e-3][self.below(4)];
        let positions = [
            Vec3::ZERO,
            vec3(1.0, 0.0, 0.0),
            vec3(self.between(-0.2, 1.2), width, 0.0),
        ];
        let normals = [(); 3].map(|()| (Vec3::Z + tilt * self.signed()).normalize());
        let mut repeats = [0.1, 1.0, 3.0][self.below(3)];
        let mut texcoord = |p: Vec3| p.truncate() * repeats;
        let texcoords = if self.below(3) == 0 {
            [(); 3].map(|()| repeats * Vec2::new(self.next() * 4.0 - 2.0, self.next()))
        } else {
            positions.map(&mut texcoord)
        };
        repeats = self.between(0.02, 0.5) * if tilt > 2.0 { 4.0 } else { 1.0 };
        let scale = if self.below(4) == 0 {
            -repeats
        } else {
            repeats
        };
        let builder = MeshBuilder {
            positions: positions.to_vec(),
            normals: normals.to_vec(),
            texcoords: texcoords.to_vec(),
            triangles: vec![[0, 1, 2]],
        };
        let (mesh, _) = builder.build(NormalMode::File).unwrap();
        let displacement = Displacement {
            midlevel: self.between(0.0, 1.0) * self.below(2) as f32,
            ..Displacement::new(scale)
        };
        let map = self.map();
        Arc::new(DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap())
    }

    /// From anywhere; through a vertex, along a texel line, in the plane of an offset triangle.
    fn ray(&mut self, surface: &DisplacedSurface) -> Ray {
        let patch = surface.patch(0);
        let at = |b: Vec3, w: f32| {
            let [u, v, w] = [b.y, b.z, w].map(f64::from);
            (patch.base(u, v) + w * patch.normal(u, v)).as_vec3()
        };
        let mut inside = || {
            let (a, b) = (self.next(), self.next());
            let (u, v) = if a + b > 1.0 {
                (1.0 - a, 1.0 - b)
            } else {
                (a, b)
            };
            vec3(1.0 - u - v, u, v)
        };
        let (b, c) = (inside(), inside());
        let [low, high] = patch.range().map(|d| d as f32);
        let w = self.between(low, high);
        let (to, direction) = match self.below(6) {
            0 => (
                at([Vec3::X, Vec3::Y, Vec3::Z][self.below(3)], w),
                self.signed(),
            ),
            1 => (at(b, w), at(c, w) - at(b, w)),
            2 => (at(b, w), Vec3::X),
            3 => {
                // From a point on a texel line to another.
                let [p, q] = [b, c].map(|b| patch.texel(b.y.into(), b.z.into()));
                let p = DVec2::new(p.x.round(), p.y);
                let q = DVec2::new(p.x, q.y);
                let [p, q] = [p, q].map(|p| barycentric(&patch.texels, p));
                let up = self.between(-0.1, 0.1) * self.below(2) as f32;
                (at(p, w), at(q, w + up) - at(p, w))
            }
            4 => (at(b, w), vec3(0.0, 0.0, -1.0)),
            _ => (at(b, w), self.signed()),
        };
        let direction = if direction.length() > 1e-6 && direction.is_finite() {
            direction
        } else {
            Vec3::Y
        };
        let from = to - self.between(0.0, 4.0) * direction;
        let from = if from.is_finite() { from } else { Vec3::ZERO };
        let mut ray = Ray::new(from, direction);
        if self.below(3) == 0 {
            ray.tnear = self.between(0.0, 4.0);
            ray.tfar = ray.tnear + self.between(0.0, 2.0);
        }
        ray
    }
}

/// (b0, b1, b2) of a point among three.
fn barycentric([a, b, c]: &[DVec2; 3], p: DVec2) -> Vec3 {
    let area = (b - a).perp_dot(c - a);
    let (u, v) = (
        (p - a).perp_dot(c - a) / area,
        (b - a).perp_dot(p - a) / area,
    );
    DVec3::new(1.0 - u - v, u, v).as_vec3()
}

/// A surface of one triangle, with its primitives.
struct Case {
    prisms: Prisms,
}

impl Case {
    fn new(surface: Arc<DisplacedSurface>) -> Self {
        Self {
            prisms: Prisms::new(surface, March::Exact).unwrap(),
        }
    }

    fn ask<T>(&self, ray: &Ray, answer: impl FnOnce(&Question<'_>) -> T) -> T {
        let Parts::Exact(parts) = &self.prisms.parts else {
            panic!("another march");
        };
        let patch = self.prisms.surface.patch(0);
        let frame = RayFrame::new(ray, axes(ray));
        answer(&Question {
            patch: &patch,
            range: parts.record(0).offsets().map(f64::from),
            frame: &frame,
            interval: [ray.tnear, ray.tfar],
            any: false,
        })
    }
}

/// All cells of a triangle, each alone.
fn cells(patch: &Patch<'_>) -> Vec<Cells> {
    let [a, b, c] = patch.texels;
    let (low, high) = (a.min(b).min(c).floor() - 1.0, a.max(b).max(c).floor() + 1.0);
    let (low, high) = (low.as_i64vec2(), high.as_i64vec2());
    (low.y..=high.y)
        .flat_map(|j| {
            (low.x..=high.x).map(move |i| Cells {
                x: [i; 2],
                y: [j; 2],
            })
        })
        .collect()
}

fn nearest(found: impl Iterator<Item = Found>) -> Option<Found> {
    found.min_by(|a, b| a.t.total_cmp(&b.t))
}

#[test]
fn all_cells_together_are_the_triangle() {
    let mut random = Random(1);
    let mut hits = 0;
    for _ in 0..300 {
        let case = Case::new(random.surface());
        for _ in 0..30 {
            let ray = random.ray(&case.prisms.surface);
            case.ask(&ray, |question| {
                let whole = within::<Portable>(question, &Cells::ALL);
                let all = cells(question.patch);
                let each: Vec<Found> = all
                    .iter()
                    .filter_map(|c| within::<Portable>(question, c))
                    .collect();
                assert_eq!(nearest(each.iter().copied()), whole, "{ray:?}");
                hits += usize::from(whole.is_some());
                // In strips of rectangles the same.
                let [low, high] = [all[0], all[all.len() - 1]];
                let strips = (low.x[0]..=high.x[0]).step_by(7).map(|i| Cells {
                    x: [i, i + 6],
                    y: [low.y[0], high.y[0]],
                });
                let strips = strips.filter_map(|c| within::<Portable>(question, &c));
                assert_eq!(nearest(strips), whole, "{ray:?}");
                let any = Question {
                    any: true,
                    ..*question
                };
                let any = within::<Portable>(&any, &Cells::ALL);
                assert_eq!(any.is_some(), whole.is_some(), "{ray:?}");
            });
        }
    }
    assert!(hits > 2000, "{hits}");
}

/// How far a crossing is from S, world units.
fn beside(patch: &Patch<'_>, ray: &Ray, found: &Found) -> f64 {
    let at = ray.origin.as_dvec3() + found.t * ray.direction.as_dvec3();
    patch.point(found.u, found.v).position.distance(at)
}

/// A point of a ray's curve, by the triangle at height w in units of N'.
struct Seen {
    w: f64,
    t: f64,
    b: DVec3,
    /// w |N'| - D; it is 0 on S.
    above: f64,
}

impl Seen {
    fn new(patch: &Patch<'_>, ray: &Ray, w: f64) -> Self {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let [p, q, r] = [0, 1, 2].map(|k| patch.vertices[k] + w * patch.normals[k] - origin);
        let areas = DVec3::new(
            direction.dot(q.cross(r)),
            direction.dot(r.cross(p)),
            direction.dot(p.cross(q)),
        );
        let b = areas / areas.element_sum();
        let at = b.x * p + b.y * q + b.z * r;
        Self {
            w,
            t: at.dot(direction) / direction.length_squared(),
            b,
            above: w * patch.normal(b.y, b.z).length() - patch.displacement(b.y, b.z),
        }
    }

    /// Whether it is well inside the triangle, and not where rounding makes all points alike.
    fn is_inside(&self) -> bool {
        self.b.min_element() > 1e-4 && self.b.max_element() < 1.0 && self.above.abs() > 1e-9
    }
}

/// Heights that a triangle's curves are looked at.
fn heights([low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    const SAMPLES: usize = 500;
    (0..=SAMPLES).map(move |k| low + (high - low) * k as f64 / SAMPLES as f64)
}

/// Of triangles of all kinds, folded ones and slivers too.
#[test]
fn points_of_the_curve_are_on_the_side_that_crossings_say() {
    /// World units: what f64 leaves of places where the ray is edge-on.
    const NEAR: f64 = 1e-5;
    let mut random = Random(2);
    let (mut hits, mut changes) = (0, 0);
    for _ in 0..600 {
        let case = Case::new(random.surface());
        let patch = case.prisms.surface.patch(0);
        // Where normals cancel, S jumps.
        if patch.shortest_normal() < 0.1 {
            continue;
        }
        for _ in 0..20 {
            let ray = random.ray(&case.prisms.surface);
            let found = case.ask(&ray, |q| within::<Portable>(q, &Cells::ALL));
            if let Some(found) = &found {
                hits += 1;
                let off = beside(&patch, &ray, found);
                assert!(off < NEAR, "{off} {found:?} {ray:?}");
            }
            let near = NEAR / f64::from(ray.direction.length());
            let range = case.ask(&ray, |q| q.range);
            let mut before: Option<Seen> = None;
            for w in heights(range) {
                let now = Seen::new(&patch, &ray, w);
                if let Some(before) = &before
                    && before.is_inside()
                    && now.is_inside()
                    && (before.above > 0.0) != (now.above > 0.0)
                {
                    let [first, last] = [before.t.min(now.t), before.t.max(now.t)];
                    // The curve may turn back between the two.
                    let is_plain = (now.b - before.b).abs().max_element() < 0.1;
                    if is_plain && first > ray.tnear.into() && last < ray.tfar.into() {
                        changes += 1;
                        let is_found = found.is_some_and(|found| found.t <= last + near);
                        assert!(is_found, "{found:?} {first} {last} at {} of {ray:?}", now.w);
                    }
                }
                before = Some(now);
            }
        }
    }
    assert!(hits > 3000 && changes > 2000, "{hits} {changes}");
}

/// Where a ray passes a side, by bisection along its curve, and whether it certainly meets the wall there.
#[test]
fn walls_are_where_the_curve_passes_a_side_between_both_heights() {
    let mut random = Random(9);
    let (mut hits, mut passed) = (0, 0);
    for _ in 0..300 {
        let open = DisplacedSurface::clone(&random.surface());
        let case = Case::new(Arc::new(open.with_seams(Seams::Closed)));
        let surface = &case.prisms.surface;
        let patch = surface.patch(0);
        for _ in 0..20 {
            let ray = random.ray(surface);
            let found = case.ask(&ray, |q| walls::<Portable>(q, surface, 0, 0b111));
            if let Some(hit) = &found {
                hits += 1;
                let point = surface.point(hit.prim, hit.u, hit.v);
                let off = point.position.distance(ray.at(hit.t));
                assert!(off < 2e-5 * (1.0 + hit.t), "{off} {hit:?} {ray:?}");
            }
            let range = case.ask(&ray, |q| q.range);
            for side in 0..3u8 {
                for t in passages(surface, &patch, &ray, range, side) {
                    if t > f64::from(ray.tnear) + 1e-5 && t < f64::from(ray.tfar) - 1e-5 {
                        passed += 1;
                        let is_found = found.is_some_and(|hit| f64::from(hit.t) <= t + 1e-5);
                        assert!(is_found, "{found:?} {t} on side {side} of {ray:?}");
                    }
                }
            }
        }
    }
    assert!(hits > 1000 && passed > 1000, "{hits} {passed}");
}

/// Ray parameters at which the wall on a side is certainly met.
fn passages(
    surface: &DisplacedSurface,
    patch: &Patch<'_>,
    ray: &Ray,
    range: [f64; 2],
    side: u8,
) -> Vec<f64> {
    let Some((_, wall)) = surface.wall_on(0, side) else {
        return Vec::new();
    };
    let ruled = Ruled::new(*patch, wall);
    let outside = |w: f64| Seen::new(patch, ray, w).b[side.into()];
    let all: Vec<f64> = heights(range).collect();
    let mut met = Vec::new();
    for pair in all.windows(2) {
        let [mut low, mut high] = [pair[0], pair[1]];
        let is_out = outside(low) < 0.0;
        if is_out == (outside(high) < 0.0) {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (outside(middle) < 0.0) == is_out {
                low = middle;
            } else {
                high = middle;
            }
        }
        let at = Seen::new(patch, ray, low);
        // Not where the triangle turns over, nor at a corner.
        let others = [1, 2].map(|k| at.b[(usize::from(side) + k) % 3]);
        if at.b[side.into()].abs() > 1e-9 || others[0].min(others[1]) < 1e-4 {
            continue;
        }
        let place = ruled.place(at.b.y, at.b.z);
        let height = low * ruled.normal(place).length();
        let [a, b] = ruled.heights(place);
        if height > a.min(b) + 1e-6 && height < a.max(b) - 1e-6 {
            met.push(at.t);
        }
    }
    met
}

/// The height above S at points of the ray, by the exact inverse.
#[test]
fn points_of_the_ray_are_on_the_side_that_crossings_say() {
    const SAMPLES: usize = 400;
    let mut random = Random(3);
    let (mut hits, mut changes) = (0, 0);
    for _ in 0..150 {
        let case = Case::new(random.surface());
        let patch = case.prisms.surface.patch(0);
        let sliver = patch.vertices[2].y < 0.1;
        if patch.shortest_normal() < 0.9 || sliver || patch.range()[1] > 0.3 {
            continue;
        }
        for _ in 0..20 {
            let ray = random.ray(&case.prisms.surface);
            let found = case.ask(&ray, |q| within::<Portable>(q, &Cells::ALL));
            if let Some(found) = &found {
                hits += 1;
                let off = beside(&patch, &ray, found);
                assert!(off < 1e-7, "{off} {found:?} {ray:?}");
            }
            let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let [near, far] = [ray.tnear, ray.tfar.min(8.0)].map(f64::from);
            let above = |k: usize| {
                let t = near + (far - near) * k as f64 / SAMPLES as f64;
                let at = patch.project(origin + t * direction, 1.0 / 3.0, 1.0 / 3.0)?;
                let [u, v, w] = at.to_array();
                const RIM: f64 = 1e-4;
                let inside = u > RIM && v > RIM && u + v < 1.0 - RIM;
                let height = w * patch.normal(u, v).length();
                inside.then_some((t, height - patch.displacement(u, v)))
            };
            let mut before = above(0);
            for k in 1..=SAMPLES {
                let now = above(k);
                if let (Some((_, f)), Some((t, g))) = (before, now)
                    && (f > 0.0) != (g > 0.0)
                    && f.abs().min(g.abs()) > 1e-9
                {
                    changes += 1;
                    assert!(
                        found.is_some_and(|found| found.t < t),
                        "{found:?} {t} {ray:?}"
                    );
                }
                before = now;
            }
        }
    }
    assert!(hits > 300 && changes > 300, "{hits} {changes}");
}

#[test]
fn each_crossing_is_of_one_cell() {
    let mut random = Random(4);
    let mut crossings = 0;
    for _ in 0..100 {
        let case = Case::new(random.surface());
        for _ in 0..10 {
            let ray = random.ray(&case.prisms.surface);
            let all = case.ask(&ray, |q| cells(q.patch));
            // All that there are, one after the other, and who has them.
            let mut rest = ray;
            while let Some(found) = case.ask(&rest, |q| within::<Portable>(q, &Cells::ALL)) {
                let who = |c: &&Cells| case.ask(&rest, |q| within::<Portable>(q, c)) == Some(found);
                assert_eq!(all.iter().filter(who).count(), 1, "{found:?} {rest:?}");
                crossings += 1;
                let t = found.t as f32;
                rest.tnear = t.max(rest.tnear.next_up());
            }
        }
    }
    assert!(crossings > 500, "{crossings}");
}

#[cfg(target_arch = "x86_64")]
#[test]
fn all_levels_give_the_same_bits() {
    use crate::prism::simd::Avx2;
    if !SimdLevel::Avx2.is_supported() {
        return;
    }
    let mut random = Random(5);
    for _ in 0..300 {
        let case = Case::new(random.surface());
        for _ in 0..20 {
            let ray = random.ray(&case.prisms.surface);
            case.ask(&ray, |question| {
                let bits = |found: Option<Found>| {
                    found.map(|found| [found.t, found.u, found.v].map(f64::to_bits))
                };
                let portable = bits(within::<Portable>(question, &Cells::ALL));
                assert_eq!(bits(within::<Avx2>(question, &Cells::ALL)), portable);
            });
        }
    }
}

#[test]
fn hostile_numbers_end() {
    let mut random = Random(6);
    let map = random.map();
    const ODD: [f64; 9] = [
        0.0,
        1.0,
        -1.0,
        1e-300,
        1e20,
        -1e38,
        f64::MAX,
        f64::INFINITY,
        f64::NAN,
    ];
    for k in 0..400 {
        let mut number = || match random.below(3) {
            0 => ODD[random.below(ODD.len())],
            _ => f64::from(random.between(-2.0, 2.0)),
        };
        let mut vector = || DVec3::new(number(), number(), number());
        let patch = Patch {
            vertices: [vector(), vector(), vector()],
            normals: [vector(), vector(), vector()],
            texels: [vector(), vector(), vector()].map(DVec3::truncate),
            map: &map,
            scale: number(),
            midlevel: number(),
        };
        let ray = Ray::new(Vec3::new(0.1, 0.2, 3.0), Vec3::new(0.1, 0.0, -1.0));
        let frame = RayFrame::new(&ray, axes(&ray));
        let question = Question {
            patch: &patch,
            range: [number(), number()],
            frame: &frame,
            interval: [ray.tnear, ray.tfar],
            any: k % 2 == 0,
        };
        let cell = Cells {
            x: [0; 2],
            y: [0; 2],
        };
        for cells in [Cells::ALL, cell] {
            let found = within::<Portable>(&question, &cells);
            assert!(found.is_none_or(|found| question.accepts(found.t)));
        }
    }
}

/// Texture coordinates that repeat a map a million times.
#[test]
fn no_ray_hangs() {
    let mut random = Random(7);
    let map = random.map();
    let patch = Patch {
        vertices: [DVec3::ZERO, DVec3::X, DVec3::Y],
        normals: [DVec3::Z; 3],
        texels: [DVec2::ZERO, DVec2::new(1e7, 2.0), DVec2::new(3.0, 1e7)],
        map: &map,
        scale: 0.01,
        midlevel: 0.0,
    };
    let ray = Ray::new(vec3(-0.1, 0.1, 0.005), Vec3::X);
    let frame = RayFrame::new(&ray, axes(&ray));
    let question = Question {
        patch: &patch,
        range: patch.range(),
        frame: &frame,
        interval: [ray.tnear, ray.tfar],
        any: false,
    };
    let start = std::time::Instant::now();
    within::<Portable>(&question, &Cells::ALL);
    assert!(start.elapsed().as_secs_f64() < 10.0);
}
