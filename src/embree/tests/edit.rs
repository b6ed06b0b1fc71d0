use std::sync::atomic::{AtomicU32, Ordering};

use glam::Affine3A;

use super::*;
use crate::embree::{BuildQuality, EmbreeError, Instance};

const LOW: SceneOptions = SceneOptions {
    quality: BuildQuality::Low,
    dynamic: true,
    compact: false,
    robust: false,
};

/// The unit ball lifted along z, at a height that changes behind the reference.
struct Lift(AtomicU32);

impl Lift {
    fn set(&self, z: f32) {
        self.0.store(z.to_bits(), Ordering::Relaxed);
    }

    fn ball(&self) -> Balls {
        let z = f32::from_bits(self.0.load(Ordering::Relaxed));
        Balls(vec![(Vec3::new(0.0, 0.0, z), 1.0)])
    }
}

impl HitTest for Lift {
    fn len(&self) -> usize {
        1
    }

    fn bounds(&self, prim: u32) -> Aabb {
        self.ball().bounds(prim)
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        self.ball().intersect(prim, ray)
    }
}

fn t_of(scene: &Scene) -> Option<f32> {
    scene.intersect1(&axis_ray()).map(|h| h.t)
}

fn with<T: HitTest + 'static>(options: SceneOptions, test: Arc<T>) -> Scene {
    let device = device();
    let mut builder = SceneBuilder::new(&device, options).unwrap();
    builder
        .attach(UserGeometry::new(&device, test).unwrap())
        .unwrap();
    builder.commit().unwrap()
}

#[test]
fn changed_bounds_are_followed() {
    for options in [LOW, SceneOptions::default()] {
        let lift = Arc::new(Lift(AtomicU32::new(0)));
        let mut scene = with(options, lift.clone());
        for z in [0.0, 50.0, -3.0, 1000.0] {
            let mut builder = scene.reopen();
            lift.set(z);
            builder.changed(0).unwrap();
            scene = builder.commit().unwrap();
            assert_eq!(t_of(&scene), (z > -4.0).then_some(z + 4.0));
        }
    }
}

#[test]
fn a_test_is_replaced_also_by_one_of_another_size() {
    for options in [LOW, SceneOptions::default()] {
        let mut builder = with(options, Balls::unit()).reopen();
        let balls = vec![
            (Vec3::new(0.0, 0.0, 9.0), 1.0),
            (Vec3::new(0.0, 0.0, 3.0), 1.0),
        ];
        builder.replace(0, Arc::new(Balls(balls))).unwrap();
        assert_eq!(t_of(&builder.commit().unwrap()), Some(7.0));
    }
}

#[test]
fn instances_follow_their_edited_prototype() {
    let device = device();
    let mut builder = SceneBuilder::new(&device, LOW).unwrap();
    let prototype = builder.add_prototype(with_device(&device)).unwrap();
    builder
        .attach_instance(&Instance {
            prototype,
            transform: Affine3A::from_translation(Vec3::Z * 10.0),
            mask: u32::MAX,
        })
        .unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(t_of(&scene), Some(14.0));

    let mut builder = scene.reopen();
    let moved = Arc::new(Balls(vec![(Vec3::new(0.0, 0.0, 100.0), 1.0)]));
    builder
        .prototype_mut(prototype)
        .unwrap()
        .replace(0, moved)
        .unwrap();
    assert_eq!(t_of(&builder.commit().unwrap()), Some(114.0));
}

fn with_device(device: &Device) -> Scene {
    let mut builder = SceneBuilder::new(device, LOW).unwrap();
    builder
        .attach(UserGeometry::new(device, Balls::unit()).unwrap())
        .unwrap();
    builder.commit().unwrap()
}

#[test]
fn what_is_not_there_cannot_be_edited() {
    let mut builder = with(LOW, Balls::unit()).reopen();
    let missing = EmbreeError::NotInScene {
        what: "user geometry",
        id: 1,
    };
    assert_eq!(builder.changed(1), Err(missing.clone()));
    assert_eq!(builder.replace(1, Balls::unit()), Err(missing));
}
