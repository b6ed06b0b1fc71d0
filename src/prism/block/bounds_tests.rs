//! Every bound that f32 excludes or accepts by, against S in f64 at many points: none is broken. How near they come is printed.

mod triangles;
mod verdicts;

use glam::{DVec2, DVec3, Vec2, Vec4};

use super::cull::{Offsets, Parts, above, beyond};
use super::middle::{Heights, extent};
use super::place::{PART, PARTS, leaves_of};
use super::tests::Random;
use super::view::View;
use super::*;
use crate::prism::judge::Cells;
use crate::prism::simd::{LANES, Lanes, Portable};
use triangles::{Case, Kind, Sight, leaves, leaves_of_large, leaves_on};

/// The largest of some ratios of what is found to what is allowed.
struct Largest(f64, usize);

impl Largest {
    fn of(&mut self, found: f64, allowed: f64, what: impl FnOnce() -> String) {
        self.1 += 1;
        assert!(found <= allowed, "{found} of {allowed}: {}", what());
        if allowed > 0.0 {
            self.0 = self.0.max(found / allowed);
        }
    }
}

/// Bilinear in the unit square, from what is at (0,0), (1,0), (0,1) and (1,1): value and derivatives.
fn bilinear<T>([a, b, c, d]: [T; 4], DVec2 { x, y }: DVec2) -> [T; 3]
where
    T: Copy
        + std::ops::Add<Output = T>
        + std::ops::Sub<Output = T>
        + std::ops::Mul<f64, Output = T>,
{
    let (bottom, top) = (a + (b - a) * x, c + (d - c) * x);
    let (left, right) = (b - a, d - c);
    [
        bottom + (top - bottom) * y,
        left + (right - left) * y,
        top - bottom,
    ]
}

const CORNERS: [DVec2; 4] = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE];

/// A cell's piece of S is near the bilinear patch of its corners, and so are its derivatives.
#[test]
fn cells_are_nearly_bilinear() {
    let (mut places, mut slopes) = (Largest(0.0, 0), Largest(0.0, 0));
    leaves(1, 1200, 20, |random, sight| {
        let Sight {
            case, truth, leaf, ..
        } = sight;
        let [[ps, pt], [ns, nt]] = truth.slopes();
        let cell = sight.texel(DVec2::new(
            random.of(&[0.0, 3.0, 7.0]),
            random.of(&[0.0, 2.0, 3.0]),
        ));
        // The cell's own heights: at its far sides the map's are the next cell's, along a step of a wrapped map too.
        let heights = CORNERS.map(|corner| truth.height(cell + corner));
        let points = [0, 1, 2, 3].map(|k| truth.raised(cell + CORNERS[k], heights[k]));
        let (low, high) = heights
            .iter()
            .fold((f64::MAX, f64::MIN), |(a, b), &h| (a.min(h), b.max(h)));
        let beta: f64 = leaf
            .beta((high - low) as f32, low.abs().max(high.abs()) as f32)
            .into();
        let rounding = 1e-9 * f64::from(case.kind.size) * (1.0 + 1e-3 * f64::from(case.kind.away));
        for _ in 0..100 {
            let at = DVec2::new(random.next().into(), random.next().into());
            let [height, height_s, height_t] = bilinear(heights, at);
            let [p, p_s, p_t] = bilinear(points, at);
            let normal = truth.normal(cell + at);
            let (n, k) = (normal.normalize(), 1.0 / normal.length());
            let bent = |v: DVec3| k * (v - n * n.dot(v));
            let s = ps + height_s * n + height * bent(ns);
            let t = pt + height_t * n + height * bent(nt);
            let off = truth.raised(cell + at, height).distance(p);
            places.of(off, 0.5 * beta * 1.00001 + rounding, || {
                format!("{:?}", case.kind)
            });
            let off = s.distance(p_s).max(t.distance(p_t));
            slopes.of(off, 4.0 * beta * 1.00001 + rounding, || {
                format!("{:?}", case.kind)
            });
        }
    });
    println!(
        "{} points: {} of beta/2; derivatives {} of 4 beta",
        places.1, places.0, slopes.0
    );
    assert!(places.1 >= 1_000_000, "{}", places.1);
}

/// The series for 1/|N'|: to first order over a block, to second order over a leaf.
#[test]
fn inverse_lengths_are_near_their_series() {
    let (mut first, mut second) = (Largest(0.0, 0), Largest(0.0, 0));
    leaves(2, 2000, 20, |random, sight| {
        let Sight {
            case,
            truth,
            view,
            leaf,
            ..
        } = sight;
        let middle = view.middle;
        let corner = case.record.corner();
        for _ in 0..60 {
            let [s, t] = [0, 1].map(|k: usize| {
                let [from, to] = extent(&case.record, sight.block, k);
                0.5 * (to - from) * random.end(-1.0)
            });
            let at =
                |k: usize, d: f32| corner[k] as f64 + f64::from(middle.place[k]) + f64::from(d);
            let normal = truth.normal(DVec2::new(at(0, s), at(1, t)));
            let k = 1.0 / normal.length();
            let off = (k - f64::from(middle.k.at(s, t))).abs();
            first.of(off, middle.k_off.into(), || format!("{:?}", case.kind));

            let vertex = vertex(random);
            let [x, y] = vertex.as_vec2().to_array();
            let normal = truth.normal(sight.texel(vertex)).length();
            let k = leaf.k(Vec4::splat(x - 4.0), Vec4::splat(y - 2.0)).x;
            let off = f64::from(sight.heights.most) * (f64::from(k) * normal - 1.0).abs();
            let room = (leaf.off - view.noise) / view.shear;
            let noise = 0.05 * view.noise;
            second.of(off, f64::from(room) + f64::from(noise), || {
                format!("{:?}", case.kind)
            });
        }
    });
    println!(
        "{} points: {} over blocks; {} over leaves",
        first.1, first.0, second.0
    );
    assert!(first.1 >= 1_000_000, "{}", first.1);
}

/// A texel of a leaf, from its first.
fn vertex(random: &mut Random) -> DVec2 {
    let below = |n: f32, x: f32| f64::from((x * n).floor().min(n - 1.0));
    DVec2::new(below(9.0, random.next()), below(5.0, random.next()))
}

/// How far the texels of leaves, displaced and projected in f32, are from where they are; and f32 barycentrics.
struct Vertices {
    sideways: Largest,
    along: Largest,
    barycentrics: Largest,
}

impl Vertices {
    fn new() -> Self {
        let [sideways, along, barycentrics] = [(); 3].map(|()| Largest(0.0, 0));
        Self {
            sideways,
            along,
            barycentrics,
        }
    }

    fn look(&mut self, random: &mut Random, sight: &Sight<'_>) {
        let Sight {
            case,
            truth,
            view,
            leaf,
            heights,
            eye,
            ..
        } = sight;
        let map = case.surface.map();
        let ends = [view.interval, view.inner];
        assert!(!ends.as_flattened().iter().any(|end| end.is_nan()));
        let what = || format!("{:?} {:?}", case.kind, sight.block);
        for _ in 0..24 {
            let vertex = vertex(random);
            let texel = sight.texel(vertex);
            let stored = (map.sample(texel).height * f64::from(map.unit())) as f32;
            let [s, t] = (vertex.as_vec2() - Vec2::new(4.0, 2.0)).to_array();
            let k = leaf.k(Vec4::splat(s), Vec4::splat(t)).x;
            let (s, t) = (s + leaf.s, t + leaf.t);
            let w = (stored * heights.scale + heights.offset) * k;
            let [x, y, z] = [&view.x, &view.y, &view.z]
                .map(|axis| f64::from(axis.p.at(s, t) + w * axis.n.at(s, t)));
            let point = eye.sees(truth.point(texel));
            let off = DVec2::new(x, y).distance(point.truncate());
            self.sideways.of(off, leaf.off.into(), what);
            let off = (z + view.t0 - point.z).abs();
            self.along.of(off, leaf.depth_off.into(), what);
            // What is in the triangle is not taken for what is outside.
            const SLACK: f64 = 1e-3;
            let [u, v] = truth.uv(texel);
            let [b1, b2] = [0, 1].map(|k: usize| f64::from(view.middle.b[k].at(s, t)));
            let off = (b1 - u)
                .abs()
                .max((b2 - v).abs())
                .max((b1 + b2 - u - v).abs());
            if u.min(v).min(1.0 - u - v) >= -1.0 {
                self.barycentrics.of(off, SLACK, what);
            }
        }
    }

    fn print(&self) -> usize {
        let Self {
            sideways,
            along,
            barycentrics,
        } = self;
        println!(
            "{} vertices: {} sideways, {} along the ray; barycentrics {}",
            sideways.1, sideways.0, along.0, barycentrics.0
        );
        sideways.1
    }
}

#[test]
fn vertices_are_where_f32_sees_them() {
    let mut vertices = Vertices::new();
    leaves(3, 4000, 25, |random, sight| vertices.look(random, sight));
    assert!(vertices.print() >= 1_000_000);
}

#[test]
fn vertices_of_large_triangles_are_where_f32_sees_them() {
    let mut vertices = Vertices::new();
    leaves_of_large(4, 100, 100, |random, sight| vertices.look(random, sight));
    assert!(vertices.print() >= 50_000);
}

/// The judge decides where f32 has no digits left for products.
#[test]
fn what_is_tiny_is_not_for_f32() {
    let mut random = Random(8);
    for (size, is_seen) in [(1e-18, false), (1e-6, true)] {
        let kind = Kind {
            size,
            texels: [90.0, 90.0],
            lean: 0.1,
            away: 0.0,
            height: 0.05,
        };
        let case = Case::new(kind, &mut random).unwrap();
        let mut seen = false;
        leaves_on(&mut random, &case, 10, &mut |_, _| seen = true);
        assert_eq!(seen, is_seen);
    }
}

/// The interval of every part of a block, seen along a ray, holds S; so do boxes.
#[test]
fn parts_and_boxes_hold_the_surface() {
    let mut largest = [(); 3].map(|()| Largest(0.0, 0));
    let mut boxes = 0;
    leaves(5, 2400, 10, |random, sight| {
        let Sight {
            case,
            truth,
            place,
            view,
            eye,
            block,
            ..
        } = sight;
        let bounds = outline::<Portable>(&case.surface, &case.record, *block, None);
        let all = place.parts::<Portable>(view.middle);
        let two = random.of(&[[0, 1], [2, 3], [4, 5], [6, 7], [5, 0]]);
        let places = leaves_of(two);
        let some = place.leaves::<Portable>(two, view.middle);
        for (parts, places, size) in [(&all, &PARTS, PART), (&some, &places, LEAF)] {
            let there = place.there(places, size);
            let intervals = seen(view, &sight.heights, parts);
            let outside = above(beyond(parts, &view.middle.b));
            for lane in (0..LANES).filter(|lane| there >> lane & 1 != 0) {
                for _ in 0..15 {
                    let cell = [0, 1].map(|k: usize| {
                        let from = places[lane][k] * size[k];
                        let part = random.end(0.0);
                        (place.first[k] + i64::from(from)) as f64 + f64::from(part * size[k] as f32)
                    });
                    let texel = DVec2::from(cell);
                    let Cells { x, y } = place.all();
                    let is_there = texel.x <= (x[1] + 1) as f64 && texel.y <= (y[1] + 1) as f64;
                    if !is_there || !truth.is_inside(texel) {
                        continue;
                    }
                    assert!(outside >> lane & 1 == 0, "{:?} {block:?}", case.kind);
                    let point = truth.point(texel);
                    let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
                    let slack = 1e-7 * point.abs().max_element();
                    let off = (low - point).max(point - high).max_element();
                    assert!(off <= slack, "{:?} {block:?}: {off}", case.kind);
                    boxes += 1;
                    let point = eye.sees(point) - DVec3::new(0.0, 0.0, view.t0);
                    for ((at, [c, off]), largest) in point
                        .to_array()
                        .into_iter()
                        .zip(&intervals)
                        .zip(&mut largest)
                    {
                        let found = (at - f64::from(c[lane])).abs();
                        largest.of(found, off[lane].into(), || format!("{:?}", case.kind));
                    }
                }
            }
        }
    });
    let [x, y, z] = largest;
    println!("{boxes} points: {} {} {}", x.0, y.0, z.0);
    assert!(boxes >= 1_000_000, "{boxes}");
}

fn seen(view: &View<'_>, heights: &Heights, parts: &Parts<Portable>) -> [[[f32; LANES]; 2]; 3] {
    let offsets = Offsets::new(parts, heights, &view.middle.k, view.middle.k_off);
    [
        (&view.x, view.noise),
        (&view.y, view.noise),
        (&view.z, view.depth_noise),
    ]
    .map(|(axis, noise)| offsets.along(parts, axis, noise).map(Lanes::to_array))
}
