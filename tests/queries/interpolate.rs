//! `DisplacedSurface::interpolate` against difference quotients of S, and against hits of rays.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use prismarch::prism::{March, Prisms};
use prismarch::ray::Ray;
use prismarch::surface::{InterpolateError, Interpolated, Seams, Wrap};

use super::common::numbers::Numbers;
use super::definition::Definition;
use super::maps;
use super::meshes::{displaced, flat, torus};
use super::surfaces::surfaces;

const STEP: f64 = 1e-6;

/// Central differences of S, where no texel line is near.
fn quotients(s: &Definition<'_>, prim: u32, u: f64, v: f64) -> Option<[DVec3; 2]> {
    let cell = |u: f64, v: f64| s.texel(prim, u, v).floor();
    let around = [(STEP, 0.0), (-STEP, 0.0), (0.0, STEP), (0.0, -STEP)];
    let one_cell = around
        .iter()
        .all(|&(du, dv)| cell(u + 2.0 * du, v + 2.0 * dv) == cell(u, v));
    let at = |du: f64, dv: f64| s.position(prim, u + du, v + dv);
    one_cell.then(|| {
        [
            (at(STEP, 0.0) - at(-STEP, 0.0)) / (2.0 * STEP),
            (at(0.0, STEP) - at(0.0, -STEP)) / (2.0 * STEP),
        ]
    })
}

#[test]
fn derivatives_are_difference_quotients_of_the_surface() {
    for (name, surface) in surfaces() {
        let s = Definition::new(&surface);
        let mut numbers = Numbers::new(1);
        let mut told = 0;
        for _ in 0..3000 {
            let prim = numbers.below(surface.mesh().triangles().len()) as u32;
            let (u, v) = numbers.barycentric();
            let at = surface.interpolate(prim, u, v).unwrap();
            let (du, dv) = (f64::from(u), f64::from(v));
            let near = |found: Vec3, wanted: DVec3, size: f64| {
                found.as_dvec3().distance(wanted) <= 1e-6 * size.max(1.0)
            };
            assert!(
                near(at.point.position, s.position(prim, du, dv), 1.0),
                "{name}"
            );
            assert!(
                near(at.point.base_position, s.base(prim, du, dv), 1.0),
                "{name}"
            );
            assert!(
                near(at.point.base_normal, s.normal(prim, du, dv), 1.0),
                "{name}"
            );
            let d = f64::from(at.point.displacement) - s.displacement(prim, du, dv);
            assert!(d.abs() < 1e-6, "{name}: D is off by {d}");
            assert_eq!(at.point, surface.point(prim, u, v));
            let Some([wanted_u, wanted_v]) = quotients(&s, prim, du, dv) else {
                continue;
            };
            told += 1;
            let size = wanted_u.length().max(wanted_v.length());
            assert!(near(at.du, wanted_u, size), "{name}: {} {wanted_u}", at.du);
            assert!(near(at.dv, wanted_v, size), "{name}: {} {wanted_v}", at.dv);
            let cross = wanted_u.cross(wanted_v);
            if cross.length() > 1e-3 * size * size {
                let along = cross.normalize().dot(at.point.geometric_normal.as_dvec3());
                assert!(along > 1.0 - 1e-6, "{name}: normal off, {along}");
            }
        }
        assert!(told > 2500, "{name}: {told} points tell of derivatives");
    }
}

/// On a texel line the derivative is that of the side with the larger texel coordinate.
#[test]
fn a_crease_has_the_derivative_of_one_side() {
    let map = maps::white(8, 8, Wrap::Repeat);
    let surface = displaced(flat(1), map, 0.5, 0.0);
    let s = Definition::new(&surface);
    let (u, v) = (0.3125, 0.125); // s is u + v here: texel column 3
    let at = surface.interpolate(0, u as f32, v as f32).unwrap();
    let beside = |e: f64| {
        let position = |u| s.position(0, u, v);
        (position(u + e) - position(u)) / e
    };
    assert!(at.du.as_dvec3().distance(beside(1e-5)) < 1e-3, "{}", at.du);
    assert!(at.du.as_dvec3().distance(beside(-1e-5)) > 0.1, "no crease");
}

#[test]
fn hits_of_rays_are_interpolated_where_they_are() {
    for (name, surface) in surfaces() {
        let surface = Arc::new((*surface).clone().with_seams(Seams::Closed));
        let prisms = Prisms::new(surface.clone(), March::Exact).unwrap();
        let mut numbers = Numbers::new(2);
        let (mut hits, mut on_walls) = (0, 0);
        for _ in 0..300 {
            let direction = numbers.direction();
            let target = Vec3::new(numbers.number(), numbers.number(), 0.3 * numbers.number());
            let ray = Ray::new(target - 3.0 * direction, direction);
            for primitive in 0..prisms.len() as u32 {
                let Some(hit) = prisms.intersect(primitive, &ray) else {
                    continue;
                };
                let at = surface.interpolate(hit.prim, hit.u, hit.v).unwrap();
                let off = at.point.position.distance(ray.at(hit.t));
                // On a spike's flank (u, v) in single precision tell the place to less.
                let slope = at.du.length().max(at.dv.length());
                assert!(off < 4e-6 * (1.0 + slope), "{name}: {off} off, {hit:?}");
                let cross = at.du.cross(at.dv);
                let size = at.du.length() * at.dv.length();
                if cross.length() > 1e-2 * size {
                    let along = cross.normalize().dot(at.point.geometric_normal);
                    assert!(along.abs() > 0.9999, "{name}: {along}");
                }
                hits += 1;
                on_walls += usize::from(hit.prim as usize >= surface.mesh().triangles().len());
            }
        }
        assert!(
            hits > 100 && on_walls > 0,
            "{name}: {hits} hits, {on_walls} on walls"
        );
    }
}

/// The derivatives of a wall against difference quotients of its own positions.
#[test]
fn walls_have_derivatives() {
    let surface = displaced(torus(5), maps::waves(16, Wrap::Clamp), 0.3, 0.2);
    let surface = (*surface).clone().with_seams(Seams::Closed);
    let first = surface.mesh().triangles().len();
    let mut numbers = Numbers::new(3);
    let mut told = 0;
    for _ in 0..400 {
        let prim = (first + numbers.below(surface.walls().len())) as u32;
        let (l, v) = (numbers.between(0.1, 0.9), numbers.between(0.1, 0.9));
        let at = surface.interpolate(prim, l, v).unwrap();
        let e = 1.0 / 1024.0; // exact beside l and v
        let position = |l: f32, v: f32| surface.point(prim, l, v).position.as_dvec3();
        let gap = f64::from(2.0 * e);
        let along = (position(l + e, v) - position(l - e, v)) / gap;
        let up = (position(l, v + e) - position(l, v - e)) / gap;
        assert!(at.dv.as_dvec3().distance(up) < 3e-4, "{} {up}", at.dv);
        // Across a texel line only one side's.
        told += usize::from(at.du.as_dvec3().distance(along) < 2e-3);
    }
    assert!(told > 360, "{told} of 400");
}

#[test]
fn many_points_are_those_of_one_at_a_time() {
    let (_, surface) = surfaces().swap_remove(0);
    let prims = [0, 5, u32::MAX, 3];
    let (u, v) = ([0.25, 0.5, f32::NAN, 0.0], [0.25, 0.125, 0.0, 1.0]);
    let valid = [true, false, false, true];
    let mut out = [Interpolated::default(); 4];
    surface
        .interpolate_n(Some(&valid), &prims, &u, &v, &mut out)
        .unwrap();
    assert_eq!(out[0], surface.interpolate(0, 0.25, 0.25).unwrap());
    assert_eq!(out[3], surface.interpolate(3, 0.0, 1.0).unwrap());
    assert_eq!(out[1..3], [Interpolated::default(); 2]);
    let failed = surface.interpolate_n(None, &prims, &u, &v, &mut out);
    assert!(matches!(
        failed,
        Err(InterpolateError::BadPrimitive { entry: 2, .. })
    ));
    assert_eq!(out[1], surface.interpolate(5, 0.5, 0.125).unwrap());
    let wrong = surface.interpolate_n(None, &prims, &u[..3], &v, &mut out);
    let told = InterpolateError::WrongLength {
        what: "u",
        found: 3,
        expected: 4,
    };
    assert_eq!(wrong, Err(told));
    let wrong = surface.interpolate_n(Some(&valid[1..]), &prims, &u, &v, &mut out);
    assert!(matches!(
        wrong,
        Err(InterpolateError::WrongLength { what: "valid", .. })
    ));
}

#[test]
fn what_is_not_there_is_an_error() {
    let (_, surface) = surfaces().swap_remove(0);
    let primitives = surface.primitives();
    for prim in [primitives as u32, u32::MAX] {
        let told = InterpolateError::BadPrimitive {
            entry: 0,
            prim,
            primitives,
        };
        assert_eq!(surface.interpolate(prim, 0.2, 0.2), Err(told));
    }
    for (u, v) in [
        (f32::NAN, 0.1),
        (0.1, f32::INFINITY),
        (f32::NEG_INFINITY, f32::NAN),
    ] {
        let found = surface.interpolate(0, u, v);
        assert!(matches!(
            found,
            Err(InterpolateError::BadCoordinates { .. })
        ));
    }
    // A place far outside is no error, or has no point; never a panic.
    for u in [-1e-7, 2.0, -1e6, 1e30, f32::MAX] {
        let _ = surface.interpolate(1, u, -u);
    }
    // Normals that cancel.
    let mut mesh = flat(1);
    mesh.normals[1] = -Vec3::Z;
    let surface = displaced(mesh, maps::ramp(4), 0.5, 0.0);
    let found = surface.interpolate(0, 0.5, 0.0);
    assert!(
        matches!(found, Err(InterpolateError::NoPoint { .. })),
        "{found:?}"
    );
    let told = "entry 0: the surface has no point at (u, v) = (0.5, 0) of primitive 0";
    assert_eq!(found.unwrap_err().to_string(), told);
}
