//! `MovingSurface` and `MovingPrisms` against the definition of S over vertices interpolated here, and against prisms that stand still.

use std::sync::Arc;

use glam::{Affine3A, DVec3, Quat, Vec3};
use prismarch::prism::{Lod, March, MarchError, MovingPrisms, PrismOptions, Prisms, Step};
use prismarch::ray::{Aabb, Ray};
use prismarch::surface::{
    DisplacedSurface, MotionError, MovingSurface, PointQuery, Seams, TimeStep, Wrap,
};

use super::common::numbers::Numbers;
use super::definition::Definition;
use super::maps;
use super::meshes::{bent, displaced, flat, leaning, torus};
use super::surfaces::surfaces;

/// `count` later steps of a surface's mesh: turned, moved and shaken.
fn steps(surface: &DisplacedSurface, count: usize, turn: f32) -> Vec<TimeStep> {
    let mesh = surface.mesh();
    let mut numbers = Numbers::new(9);
    let step = |k: usize| {
        let turned = Quat::from_rotation_y(turn * (k + 1) as f32);
        let place = Affine3A::from_rotation_translation(turned, 0.4 * numbers.direction());
        let mut shaken = |n: &Vec3| turned * (*n + 0.2 * numbers.direction());
        TimeStep {
            normals: mesh.normals().iter().map(&mut shaken).collect(),
            positions: mesh
                .positions()
                .iter()
                .map(|&p| place.transform_point3(p))
                .collect(),
        }
    };
    (0..count).map(step).collect()
}

fn moving(surface: &Arc<DisplacedSurface>, count: usize) -> Arc<MovingSurface> {
    let steps = steps(surface, count, 0.7);
    Arc::new(MovingSurface::new(surface.clone(), steps).unwrap())
}

fn rays(numbers: &mut Numbers, count: usize) -> Vec<Ray> {
    let mut ray = || {
        let direction = numbers.direction();
        let target = Vec3::new(numbers.number(), numbers.number(), 0.0) + 0.4 * numbers.direction();
        Ray {
            time: numbers.number(),
            ..Ray::new(target - 3.0 * direction, direction)
        }
    };
    (0..count).map(|_| ray()).collect()
}

/// S at a time by its definition, from the steps themselves.
fn position(
    moving: &MovingSurface,
    steps: &[TimeStep],
    place: (u32, f64, f64),
    time: f64,
) -> DVec3 {
    let (prim, u, v) = place;
    let mesh = moving.surface().mesh();
    let mut all = vec![(mesh.positions(), mesh.normals())];
    all.extend(steps.iter().map(|s| (&s.positions[..], &s.normals[..])));
    let at = time * (all.len() - 1) as f64;
    let k = (at.floor() as usize).min(all.len() - 2);
    let f = at - k as f64;
    let weights = [1.0 - u - v, u, v];
    let (mut p, mut n) = (DVec3::ZERO, DVec3::ZERO);
    for (i, b) in mesh.triangles()[prim as usize].into_iter().zip(weights) {
        let [before, after] = [k, k + 1].map(|k| {
            let (positions, normals) = all[k];
            let normal = normals[i as usize].as_dvec3().normalize();
            (positions[i as usize].as_dvec3(), normal)
        });
        p += b * before.0.lerp(after.0, f);
        n += b * before.1.lerp(after.1, f).normalize();
    }
    p + Definition::new(moving.surface()).displacement(prim, u, v) * n.normalize()
}

#[test]
fn the_surface_moves_as_it_is_defined() {
    for (name, surface) in surfaces() {
        let steps = steps(&surface, 3, 0.7);
        let moving = MovingSurface::new(surface.clone(), steps.clone()).unwrap();
        let mut numbers = Numbers::new(10);
        for _ in 0..60 {
            let prim = numbers.below(surface.mesh().triangles().len()) as u32;
            let (u, v) = numbers.barycentric();
            for time in [0.0, 1.0, numbers.number()] {
                let place = (prim, f64::from(u), f64::from(v));
                let wanted = position(&moving, &steps, place, time.into());
                let found = moving.interpolate(prim, u, v, time).unwrap();
                let off = found.point.position.as_dvec3().distance(wanted);
                assert!(off < 2e-6, "{name}, time {time}: {off}");
                // The copy that stands still is the same surface.
                let standing = moving.at(time).interpolate(prim, u, v).unwrap();
                assert_eq!(standing, found, "{name}, time {time}");
            }
        }
        // Times beyond the ends are the ends.
        for (beyond, end) in [
            (-3.0, 0.0),
            (7.0, 1.0),
            (f32::INFINITY, 1.0),
            (f32::NAN, 0.0),
        ] {
            let at = |time| moving.interpolate(0, 0.2, 0.3, time).unwrap();
            assert_eq!(at(beyond), at(end));
        }
    }
}

/// Rays at a time meet what stands there at that time.
#[test]
fn hits_are_those_on_the_mesh_as_it_stands() {
    for (name, surface) in surfaces() {
        let moving = moving(&surface, 2);
        let prisms = MovingPrisms::new(moving.clone(), March::Exact).unwrap();
        let mut numbers = Numbers::new(11);
        let (mut hits, mut differ) = (0, 0);
        for time in [0.0, 0.5, 1.0, 0.123, 0.77] {
            let standing = Arc::new(moving.at(time));
            let still = Prisms::new(standing.clone(), March::Exact).unwrap();
            for ray in rays(&mut numbers, 150) {
                let ray = Ray { time, ..ray };
                // Primitives are those of time 0, which may be others than the standing mesh's: all of them have the first hit.
                let first = |hits: &mut dyn Iterator<Item = prismarch::prism::PrismHit>| {
                    hits.min_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)))
                };
                let all = 0..prisms.len() as u32;
                let found = first(&mut all.clone().filter_map(|k| prisms.intersect(k, &ray)));
                let wanted = 0..still.len() as u32;
                let wanted = first(&mut wanted.filter_map(|k| still.intersect(k, &ray)));
                let occluded = all.clone().any(|k| prisms.occluded(k, &ray));
                assert_eq!(occluded, found.is_some(), "{name}");
                match (found, wanted) {
                    (None, None) => {}
                    (Some(found), Some(wanted)) if (found.t - wanted.t).abs() < 1e-5 => {
                        hits += 1;
                        let at = standing.point(found.prim, found.u, found.v).position;
                        let slope = standing.interpolate(found.prim, found.u, found.v).unwrap();
                        let slope = slope.du.length().max(slope.dv.length());
                        assert!(
                            at.distance(ray.at(found.t)) < 4e-6 * (1.0 + slope),
                            "{name}"
                        );
                    }
                    _ => differ += 1,
                }
            }
        }
        assert!(hits > 60, "{name}: {hits} hits");
        assert_eq!(differ, 0, "{name}: of {hits}");
    }
}

#[test]
fn boxes_hold_the_surface_at_all_times() {
    let mut all = surfaces();
    // Normals far apart, within a triangle and over time.
    all.push((
        "wild",
        displaced(
            leaning(bent(2), -0.9, 4),
            maps::white(8, 8, Wrap::Repeat),
            2.0,
            0.5,
        ),
    ));
    for (name, surface) in all {
        for (count, turn) in [(1, 2.5), (2, 0.7), (4, 1.3)] {
            let steps = steps(&surface, count, turn);
            let moving = Arc::new(MovingSurface::new(surface.clone(), steps).unwrap());
            let prisms = MovingPrisms::new(moving.clone(), March::Exact).unwrap();
            let all: Vec<_> = (0..prisms.len() as u32)
                .map(|k| {
                    (0..=count)
                        .map(|step| prisms.bounds(k, step))
                        .collect::<Vec<_>>()
                })
                .collect();
            // Which primitive a triangle is in: the one whose ray hits say so is not asked; any box that holds the point will do only
            // if it is the triangle's, so each triangle is looked for by its nearest points.
            let holder = |prim: u32| {
                (0..prisms.len() as u32).find(|&k| {
                    let point = moving.surface().point(prim, 0.3, 0.3).position;
                    let near = prisms.closest(k, &PointQuery::new(point, 1e-3));
                    near.is_some_and(|near| near.prim == prim)
                })
            };
            let mut numbers = Numbers::new(12);
            let mut tested = 0;
            for _ in 0..40 {
                let prim = numbers.below(surface.mesh().triangles().len()) as u32;
                let Some(primitive) = holder(prim) else {
                    continue;
                };
                for _ in 0..60 {
                    let (u, v) = numbers.barycentric();
                    let time = numbers.number();
                    let point = moving.interpolate(prim, u, v, time).unwrap().point.position;
                    let at = time * count as f32;
                    let step = (at as usize).min(count - 1);
                    let [a, b] = [step, step + 1].map(|step| all[primitive as usize][step]);
                    let f = at - step as f32;
                    let (low, high) = (a.min.lerp(b.min, f), a.max.lerp(b.max, f));
                    let held = point.cmpge(low).all() && point.cmple(high).all();
                    assert!(held, "{name}: {point} at {time} outside {low} .. {high}");
                    tested += 1;
                }
            }
            assert!(tested > 1000, "{name}: {tested}");
        }
    }
}

#[test]
fn boxes_are_not_much_too_wide() {
    // Displaced upward alone, moved sideways: boxes that grow by |D| all around would be ten times as high.
    let surface = displaced(flat(2), maps::constant(1.0), 0.5, 0.0);
    let moved = |p: &Vec3| *p + Vec3::X;
    let step = TimeStep {
        positions: surface.mesh().positions().iter().map(moved).collect(),
        normals: surface.mesh().normals().to_vec(),
    };
    let moving = MovingSurface::new(surface, vec![step]).unwrap();
    let prisms = MovingPrisms::new(Arc::new(moving), March::Exact).unwrap();
    // Ranges of heights are kept to eight bits.
    let slack = Vec3::new(1e-3, 1e-3, 0.5 / 127.0);
    for step in 0..2 {
        let all = (0..prisms.len() as u32).map(|primitive| prisms.bounds(primitive, step));
        let bounds = all.reduce(Aabb::union).unwrap();
        let x = step as f32;
        let (low, high) = (Vec3::new(x, 0.0, 0.5), Vec3::new(x + 1.0, 1.0, 0.5));
        let is_near = |a: Vec3, b: Vec3| (a - b).abs().cmple(slack).all();
        assert!(is_near(bounds.min, low), "{bounds:?}");
        assert!(is_near(bounds.max, high), "{bounds:?}");
    }
}

#[test]
fn one_step_stands_still() {
    let (_, surface) = surfaces().swap_remove(0);
    let still = Prisms::new(surface.clone(), March::Exact).unwrap();
    let moving = Arc::new(MovingSurface::new(surface, Vec::new()).unwrap());
    let prisms = MovingPrisms::new(moving, March::Exact).unwrap();
    assert_eq!((prisms.time_steps(), prisms.len()), (1, still.len()));
    for primitive in 0..prisms.len() as u32 {
        assert_eq!(prisms.bounds(primitive, 0), still.bounds(primitive));
        for ray in rays(&mut Numbers::new(13), 200) {
            assert_eq!(
                prisms.intersect(primitive, &ray),
                still.intersect(primitive, &ray)
            );
            assert_eq!(
                prisms.occluded(primitive, &ray),
                still.occluded(primitive, &ray)
            );
        }
    }
}

#[test]
fn nearest_points_are_those_of_the_time() {
    let surface = displaced(torus(5), maps::white(16, 16, Wrap::Repeat), 0.2, 0.5);
    let moving = moving(&surface, 2);
    let prisms = MovingPrisms::new(moving.clone(), March::Exact).unwrap();
    let mut numbers = Numbers::new(14);
    for _ in 0..20 {
        let time = numbers.number();
        let query = PointQuery {
            time,
            ..PointQuery::new(2.0 * numbers.direction(), f32::INFINITY)
        };
        let nearest = (0..prisms.len() as u32).filter_map(|k| prisms.closest(k, &query));
        let nearest = nearest
            .map(|near| near.distance)
            .fold(f32::INFINITY, f32::min);
        let triangles = 0..surface.mesh().triangles().len() as u32;
        let wanted = moving.at(time).closest(triangles, &query).unwrap().distance;
        assert!((nearest - wanted).abs() < 4e-6, "{nearest} {wanted}");
    }
}

/// Faces that vanish for a moment, and normals that cancel: no panic, no NaN.
#[test]
fn faces_may_turn_over() {
    let surface = displaced(flat(3), maps::white(8, 8, Wrap::Repeat), 0.3, 0.5);
    let mirrored = TimeStep {
        positions: surface
            .mesh()
            .positions()
            .iter()
            .map(|p| Vec3::new(1.0 - p.x, p.y, p.z))
            .collect(),
        normals: surface.mesh().normals().iter().map(|n| -*n).collect(),
    };
    let moving = Arc::new(MovingSurface::new(surface, vec![mirrored]).unwrap());
    let prisms = MovingPrisms::new(moving, March::Exact).unwrap();
    for ray in rays(&mut Numbers::new(15), 300) {
        for time in [0.5, ray.time] {
            let ray = Ray { time, ..ray };
            for primitive in 0..prisms.len() as u32 {
                let hit = prisms.intersect(primitive, &ray);
                assert!(hit.is_none_or(|hit| hit.ng.is_finite() && hit.t.is_finite()));
                prisms.occluded(primitive, &ray);
                prisms.closest(
                    primitive,
                    &PointQuery {
                        time,
                        ..PointQuery::new(ray.origin, 9.0)
                    },
                );
            }
        }
    }
}

#[test]
fn bad_motions_are_errors() {
    let surface = displaced(flat(2), maps::ramp(4), 0.3, 0.0);
    let good = steps(&surface, 1, 0.5).swap_remove(0);
    let refused = |step: &TimeStep| {
        MovingSurface::new(surface.clone(), vec![good.clone(), step.clone()]).unwrap_err()
    };
    let mut step = good.clone();
    step.positions.pop();
    let told = MotionError::WrongLength {
        step: 2,
        what: "positions",
        found: 8,
        vertices: 9,
    };
    assert_eq!(refused(&step), told);
    assert_eq!(
        told.to_string(),
        "time step 2 has 8 positions for 9 vertices; expected one per vertex"
    );
    step = good.clone();
    step.normals.push(Vec3::Z);
    assert!(matches!(
        refused(&step),
        MotionError::WrongLength {
            what: "normals",
            found: 10,
            ..
        }
    ));
    for bad in [f32::NAN, f32::INFINITY] {
        step = good.clone();
        step.positions[4].y = bad;
        let told = refused(&step);
        assert!(matches!(
            told,
            MotionError::BadVector {
                what: "position",
                vertex: 4,
                ..
            }
        ));
        step = good.clone();
        step.normals[3].x = bad;
        assert!(matches!(
            refused(&step),
            MotionError::BadVector {
                what: "normal",
                vertex: 3,
                ..
            }
        ));
    }
    step = good.clone();
    step.normals[5] = Vec3::ZERO;
    assert!(matches!(
        refused(&step),
        MotionError::BadVector {
            step: 2,
            vertex: 5,
            ..
        }
    ));
    step = good.clone();
    step.positions[0] = step.positions[1];
    assert_eq!(
        refused(&step),
        MotionError::NoArea {
            step: 2,
            triangle: 0
        }
    );
    let many = MovingSurface::new(surface.clone(), vec![good.clone(); 129]);
    assert_eq!(
        many.unwrap_err(),
        MotionError::TooManySteps {
            found: 130,
            max: 129
        }
    );
    let closed = Arc::new((*surface).clone().with_seams(Seams::Closed));
    let closed = MovingSurface::new(closed, vec![good.clone()]);
    assert_eq!(closed.unwrap_err(), MotionError::ClosedSeams);

    // Normals that are not given are the smooth ones.
    let bare = TimeStep {
        normals: Vec::new(),
        positions: surface.mesh().positions().to_vec(),
    };
    let moving = Arc::new(MovingSurface::new(surface.clone(), vec![bare]).unwrap());
    assert!(
        moving
            .at(1.0)
            .mesh()
            .normals()
            .iter()
            .all(|n| n.distance(Vec3::Z) < 1e-6)
    );

    let march = March::Uniform {
        step: Step::Texels(1.0),
        jitter: false,
    };
    let uniform = MovingPrisms::new(moving.clone(), march);
    assert_eq!(uniform.err(), Some(MarchError::MotionNeedsExact));
    let lod = PrismOptions {
        lod: Lod::Cone,
        ..PrismOptions::default()
    };
    assert_eq!(
        MovingPrisms::new(moving, lod).err(),
        Some(MarchError::MotionHasNoLod)
    );
}
