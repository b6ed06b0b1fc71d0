use std::sync::Arc;

use glam::Quat;

use super::closest::hills;
use super::*;
use crate::embree::{Coherence, EmbreeError};
use crate::prism::{March, MovingPrisms};
use crate::ray::RayPacket;
use crate::surface::{MovingSurface, TimeStep};

/// Hills that turn and rise over `steps` time steps.
fn moving(steps: usize) -> Arc<MovingPrisms> {
    let surface = hills(5).surface().clone();
    let later = (1..steps).map(|k| {
        let turned = Quat::from_rotation_x(0.9 * k as f32);
        let mesh = surface.mesh();
        TimeStep {
            positions: mesh
                .positions()
                .iter()
                .map(|&p| turned * p + 0.3 * k as f32 * Vec3::Y)
                .collect(),
            normals: mesh.normals().iter().map(|&n| turned * n).collect(),
        }
    });
    let moving = MovingSurface::new(surface.clone(), later.collect()).unwrap();
    Arc::new(MovingPrisms::new(Arc::new(moving), March::Exact).unwrap())
}

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    let mut ray = || {
        let direction = random.point();
        let target = random.point() + 0.3 * random.next() * Vec3::Y;
        Ray {
            time: random.next(),
            ..Ray::new(target - 4.0 * direction, direction)
        }
    };
    (0..count).map(|_| ray()).collect()
}

#[test]
fn rays_meet_what_moves_where_it_is_then() {
    for steps in [1, 2, 4] {
        let prisms = moving(steps);
        let scene = scene_of(&device(), prisms.clone());
        let mut random = Random(6);
        let mut hits = 0;
        for ray in rays(&mut random, 2000) {
            let wanted = (0..prisms.len() as u32)
                .filter_map(|k| prisms.intersect(k, &ray))
                .min_by(|a, b| a.t.total_cmp(&b.t));
            let found = scene.intersect1(&ray);
            assert_eq!(found.map(|hit| hit.t), wanted.map(|hit| hit.t), "{ray:?}");
            assert_eq!(scene.occluded1(&ray), wanted.is_some());
            hits += usize::from(found.is_some());
        }
        assert!(hits > 300, "{steps} steps: {hits}");
        for eight in rays(&mut random, 800).chunks(8) {
            let packet = RayPacket::from_rays(eight);
            for coherence in [Coherence::Coherent, Coherence::Incoherent] {
                let found = scene.intersect8(&packet, coherence);
                let occluded = scene.occluded8(&packet, coherence);
                for (lane, ray) in eight.iter().enumerate() {
                    let wanted = scene.intersect1(ray).map(|hit| hit.t);
                    assert_eq!(found[lane].map(|hit| hit.t), wanted);
                    assert_eq!(occluded >> lane & 1 == 1, wanted.is_some());
                }
            }
        }
    }
}

#[test]
fn times_beyond_the_ends_are_the_ends() {
    let scene = scene_of(&device(), moving(3));
    let mut hits = 0;
    for ray in rays(&mut Random(8), 500) {
        let at = |time| scene.intersect1(&Ray { time, ..ray });
        for (beyond, end) in [
            (-1.0, 0.0),
            (f32::NAN, 0.0),
            (5.0, 1.0),
            (f32::INFINITY, 1.0),
        ] {
            assert_eq!(at(beyond), at(end));
            let packet = RayPacket::from_rays(&[Ray {
                time: beyond,
                ..ray
            }]);
            assert_eq!(scene.intersect8(&packet, Coherence::Incoherent)[0], at(end));
            hits += usize::from(at(end).is_some());
        }
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn nearest_points_are_those_of_the_time() {
    let prisms = moving(3);
    let scene = scene_of(&device(), prisms.clone());
    let mut random = Random(9);
    for _ in 0..60 {
        let (point, time) = (2.0 * random.point(), random.next());
        let found = scene.closest_at(point, f32::INFINITY, time).unwrap();
        let surface = prisms.surface().at(time);
        let triangles = 0..surface.mesh().triangles().len() as u32;
        let query = crate::surface::PointQuery::new(point, f32::INFINITY);
        let wanted = surface.closest(triangles, &query).unwrap();
        assert!(
            (found.distance - wanted.distance).abs() < 4e-6,
            "{found:?} {wanted:?}"
        );
    }
}

/// As many time steps as it says, and no surface.
struct Steps(usize);

impl HitTest for Steps {
    fn len(&self) -> usize {
        1
    }

    fn bounds(&self, _: u32) -> Aabb {
        Balls::unit().bounds(0)
    }

    fn time_steps(&self) -> usize {
        self.0
    }

    fn intersect(&self, _: u32, _: &Ray) -> Option<PrismHit> {
        None
    }
}

#[test]
fn step_counts_that_embree_does_not_know_are_refused() {
    let device = device();
    for (steps, wanted) in [
        (0, EmbreeError::NoTimeSteps),
        (
            130,
            EmbreeError::TooMany {
                what: "time steps",
                found: 130,
                max: 129,
            },
        ),
    ] {
        let found = UserGeometry::new(&device, Arc::new(Steps(steps))).err();
        assert_eq!(found, Some(wanted));
    }
    scene_of(&device, Arc::new(Steps(129)));
}
