//! The oracle against what can be seen without it: S cut into many flat triangles.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use prismarch::ray::Ray;
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, UvTransform,
    Wrap,
};

use super::common::numbers::Numbers;
use super::oracle::{Crossing, EDGE, Line, Oracle};

/// Small triangles along an edge of the patch.
const FINE: usize = 160;

fn patches() -> Vec<DisplacedSurface> {
    let mut numbers = Numbers::new(5);
    let mut patches = Vec::new();
    for (tilt, scale, midlevel) in [(0.3, 0.2, 0.0), (0.3, -0.3, 0.4), (1.5, 0.25, 0.5)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let mut corner = |x: f32, y: f32| {
                let lean = |n: &mut Numbers| n.between(-tilt, tilt);
                let normal = Vec3::new(lean(&mut numbers), lean(&mut numbers), 1.0);
                (Vec3::new(x, y, 0.2 * lean(&mut numbers)), normal)
            };
            let corners = [corner(0.0, 0.0), corner(1.0, 0.1), corner(0.2, 0.9)];
            let builder = MeshBuilder {
                positions: corners.map(|(p, _)| p).to_vec(),
                normals: corners.map(|(_, n)| n).to_vec(),
                texcoords: vec![
                    Vec2::new(-0.1, 0.1),
                    Vec2::new(1.3, 0.0),
                    Vec2::new(0.2, 1.1),
                ],
                triangles: vec![[0, 1, 2]],
            };
            let mesh = builder.build(NormalMode::File).unwrap().0;
            let texels = (0..5 * 6).map(|_| numbers.bits() as u16).collect();
            let map = DisplacementMap::new(5, 6, Texels::U16(texels), wrap).unwrap();
            let uv = UvTransform {
                rotation: 0.2,
                ..UvTransform::default()
            };
            let displacement = Displacement {
                scale,
                midlevel,
                uv,
            };
            patches
                .push(DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap());
        }
    }
    patches
}

/// (u, v, t) where `line` meets the flat triangles.
fn tessellated(points: &[Vec<DVec3>], line: &Line) -> Vec<DVec3> {
    let mut found = Vec::new();
    for i in 0..FINE {
        for j in 0..FINE - i {
            let corners = [points[i][j], points[i + 1][j], points[i][j + 1]];
            found.extend(meet(corners, line).map(|x| (x, i as f64 + x.x, j as f64 + x.y)));
            if i + j + 2 <= FINE {
                let corners = [points[i + 1][j + 1], points[i][j + 1], points[i + 1][j]];
                let place = |x: DVec3| (x, i as f64 + 1.0 - x.x, j as f64 + 1.0 - x.y);
                found.extend(meet(corners, line).map(place));
            }
        }
    }
    let fine = FINE as f64;
    let place = |(x, i, j): (DVec3, f64, f64)| DVec3::new(i / fine, j / fine, x.z);
    found.into_iter().map(place).collect()
}

fn meet([a, b, c]: [DVec3; 3], line: &Line) -> Option<DVec3> {
    let (e1, e2, s) = (b - a, c - a, line.origin - a);
    let p = line.direction.cross(e2);
    let q = s.cross(e1);
    let x = DVec3::new(s.dot(p), line.direction.dot(q), e2.dot(q)) / e1.dot(p);
    (x.x >= 0.0 && x.y >= 0.0 && x.x + x.y <= 1.0).then_some(x)
}

/// Every crossing is on the ray and on S; the tessellation has none that the oracle lacks and, but for grazes and the
/// rim, the oracle none that the tessellation lacks.
#[test]
fn the_oracle_sees_what_a_fine_tessellation_shows() {
    let mut numbers = Numbers::new(6);
    let (mut seen, mut compared) = (0, 0);
    for surface in patches() {
        let patch = surface.patch(0);
        let part = |k: usize| k as f64 / FINE as f64;
        let row = |i: usize| (0..=FINE - i).map(move |j| (part(i), part(j)));
        let points: Vec<Vec<DVec3>> = (0..=FINE)
            .map(|i| row(i).map(|(u, v)| patch.point(u, v).position).collect())
            .collect();
        let oracle = Oracle::new(&surface);
        for _ in 0..40 {
            let (u, v) = numbers.barycentric();
            let target = patch.point(u.into(), v.into()).position.as_vec3();
            let mut direction = numbers.direction();
            direction.z *= numbers.number();
            let line = Line::from(&Ray::new(target - 2.0 * direction, direction));
            let exact = oracle.crossings(0, &line, EDGE);
            assert!(!exact.incomplete);
            let coarse = tessellated(&points, &line);
            let near = |c: &Crossing, x: &DVec3| {
                (DVec3::new(c.u, c.v, c.t) - *x).abs().max_element() < 0.03
            };
            for c in exact.all.iter().filter(|c| c.sure) {
                let miss = patch.point(c.u, c.v).position - line.origin - c.t * line.direction;
                assert!(miss.length() < 1e-13, "{line:?} {c:?} {}", miss.length());
                let inside = c.u.min(c.v).min(1.0 - c.u - c.v) > 0.02;
                // Two crossings about a ridge may both fall between the small triangles.
                let close = |other: &&Crossing| (other.t - c.t).abs() < 0.05;
                let alone = exact.all.iter().filter(close).count() == 1;
                if inside && alone && c.grazing > 0.25 {
                    assert!(coarse.iter().any(|x| near(c, x)), "{line:?} {c:?}");
                    compared += 1;
                }
            }
            for x in &coarse {
                assert!(exact.all.iter().any(|c| near(c, x)), "{line:?} {x}");
                seen += 1;
            }
        }
    }
    assert!(seen > 500 && compared > 300, "{seen} {compared}");
}

/// The ray was aimed at a known point of S, head on: that point is among the crossings.
#[test]
fn the_oracle_finds_the_point_that_was_aimed_at() {
    let mut numbers = Numbers::new(7);
    for surface in patches() {
        let (patch, oracle) = (surface.patch(0), Oracle::new(&surface));
        for _ in 0..200 {
            let (u, v) = numbers.barycentric();
            let (u, v) = (f64::from(u), f64::from(v));
            let target = patch.point(u, v).position;
            let line = Line {
                origin: target - 3.0 * numbers.direction().as_dvec3(),
                direction: DVec3::ZERO,
                interval: [0.0, f64::INFINITY],
            };
            let direction = target - line.origin;
            let found = oracle.crossings(0, &Line { direction, ..line }, 1e-9);
            let hit = |c: &Crossing| (c.t - 1.0).abs() < 1e-9 && (c.u - u).abs() < 1e-7;
            // A silhouette may blur: then the crossing is there, but not as exactly.
            let blurred = |c: &Crossing| !c.sure && (c.t - 1.0).abs() < 1e-4;
            assert!(
                found.all.iter().any(|c| hit(c) || blurred(c)),
                "{u} {v} {line:?} {found:?}"
            );
        }
    }
}
