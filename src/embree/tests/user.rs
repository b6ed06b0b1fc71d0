use std::sync::Arc;

use super::*;
use crate::embree::Geometry;
use crate::trace::INVALID_ID;

#[test]
fn hits_are_those_of_asking_every_primitive() {
    let balls = Balls::strewn(500);
    let scene = scene_of(&device(), balls.clone());
    let mut random = Random(1);
    let mut hits = 0;
    for _ in 0..5000 {
        let ray = random.ray();
        let found = scene.intersect1(&ray);
        let expected = balls.first_hit(&ray);
        assert_eq!(
            found.map(|h| (h.prim, h.t, h.u, h.v, h.ng)),
            expected.map(|(prim, h)| (prim, h.t, h.u, h.v, h.ng))
        );
        assert_eq!(scene.occluded1(&ray), expected.is_some());
        if let Some(hit) = found {
            assert_eq!((hit.geom, hit.inst), (0, [INVALID_ID]));
            hits += 1;
        }
    }
    assert!(hits > 500, "only {hits} rays tested anything");
}

#[test]
fn the_interval_is_open_and_chooses_the_crossing() {
    let scene = scene_of(&device(), Balls::unit());
    let first_in = |tnear: f32, tfar: f32| {
        let ray = Ray {
            tnear,
            tfar,
            ..axis_ray()
        };
        let hit = scene.intersect1(&ray).map(|h| h.t);
        assert_eq!(scene.occluded1(&ray), hit.is_some(), "({tnear}, {tfar})");
        hit
    };
    assert_eq!(first_in(0.0, f32::INFINITY), Some(4.0));
    assert_eq!(first_in(4.0, f32::INFINITY), Some(6.0));
    assert_eq!(first_in(3.9, 4.1), Some(4.0));
    assert_eq!(first_in(0.0, 4.0), None);
    assert_eq!(first_in(4.5, 5.5), None);
    assert_eq!(first_in(6.0, f32::INFINITY), None);
}

#[test]
fn t_is_in_units_of_the_direction() {
    let scene = scene_of(&device(), Balls::unit());
    for speed in [0.125, 1.0, 8.0] {
        let ray = Ray {
            direction: Vec3::Z * speed,
            ..axis_ray()
        };
        assert_eq!(scene.intersect1(&ray).map(|h| h.t), Some(4.0 / speed));
    }
}

#[test]
fn a_ray_sees_what_its_mask_shares_a_bit_with() {
    let device = device();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    for (z, mask) in [(0.0, 0b01), (10.0, 0b10), (20.0, 0x8000_0000)] {
        let ball = Arc::new(Balls(vec![(Vec3::new(0.0, 0.0, z), 1.0)]));
        let geometry: Geometry = UserGeometry::new(&device, ball).unwrap().into();
        builder.attach(geometry.with_mask(mask)).unwrap();
    }
    let scene = builder.commit().unwrap();
    let cases = [
        (u32::MAX, Some(0)),
        (0b01, Some(0)),
        (0b10, Some(1)),
        (0b110, Some(1)),
        (0x8000_0000, Some(2)),
        (0b100, None),
        (0, None),
    ];
    for (mask, seen) in cases {
        let ray = Ray { mask, ..axis_ray() };
        assert_eq!(scene.intersect1(&ray).map(|h| h.geom), seen, "{mask:#b}");
        assert_eq!(scene.occluded1(&ray), seen.is_some(), "{mask:#b}");
    }
}

/// A ball that only rays of one key and mask see.
struct Picky(u32);

impl HitTest for Picky {
    fn len(&self) -> usize {
        1
    }

    fn bounds(&self, _: u32) -> Aabb {
        Balls::unit().bounds(0)
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        (ray.key == self.0).then(|| Balls::unit().intersect(prim, ray))?
    }
}

#[test]
fn the_key_of_a_ray_reaches_the_hit_test() {
    let scene = scene_of(&device(), Arc::new(Picky(0xdead_beef)));
    for (key, seen) in [(0xdead_beef, true), (0, false)] {
        let ray = Ray { key, ..axis_ray() };
        assert_eq!(scene.intersect1(&ray).is_some(), seen);
        assert_eq!(scene.occluded1(&ray), seen);
    }
}

#[test]
fn boxes_are_padded_outward() {
    let balls = Balls::strewn(20);
    let exact = (0..20).fold(Aabb::EMPTY, |b, prim| b.union(balls.bounds(prim)));
    let scene = scene_of(&device(), balls);
    assert!(scene.bounds().min.cmplt(exact.min).all());
    assert!(scene.bounds().max.cmpgt(exact.max).all());
    assert!((scene.bounds().diagonal() - exact.diagonal()).abs() < 1e-4);
}

#[test]
fn many_threads_see_the_same_scene() {
    let balls = Balls::strewn(300);
    let scene = scene_of(&device(), balls.clone());
    std::thread::scope(|scope| {
        for seed in 0..6 {
            let (scene, balls) = (&scene, &balls);
            scope.spawn(move || {
                let mut random = Random(seed);
                for _ in 0..1000 {
                    let ray = random.ray();
                    let expected = balls.first_hit(&ray).map(|(prim, h)| (prim, h.t));
                    assert_eq!(scene.intersect1(&ray).map(|h| (h.prim, h.t)), expected);
                }
            });
        }
    });
}

#[test]
fn a_scene_may_be_committed_from_a_rayon_pool() {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .unwrap();
    let scene = pool.install(|| scene_of(&device(), Balls::strewn(2000)));
    assert!(scene.bounds().is_valid());
}
