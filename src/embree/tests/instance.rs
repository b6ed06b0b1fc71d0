use glam::{Affine3A, Mat3, Quat};

use super::*;
use crate::embree::{EmbreeError, Instance, Prototype};
use crate::trace::{Hit, TransformError};

fn instanced(transform: Affine3A, mask: u32) -> Result<Scene, EmbreeError> {
    let device = device();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default())?;
    let prototype = builder.add_prototype(scene_of(&device, Balls::unit()))?;
    for shift in [0.0, 100.0] {
        builder.attach_instance(&Instance {
            prototype,
            transform: Affine3A::from_translation(Vec3::X * shift) * transform,
            mask,
        })?;
    }
    builder.commit()
}

/// What an instance means: the ray in object space, its direction not renormalised.
fn expected(transform: Affine3A, ray: &Ray) -> Option<PrismHit> {
    let inverse = transform.inverse();
    let local = Ray {
        origin: inverse.transform_point3(ray.origin),
        direction: inverse.transform_vector3(ray.direction),
        ..*ray
    };
    Balls::unit().intersect(0, &local)
}

fn close(hit: &Hit, expected: &PrismHit) -> bool {
    (hit.t - expected.t).abs() < 1e-4 * expected.t.max(1.0) && hit.ng.distance(expected.ng) < 1e-3
}

#[test]
fn an_instance_is_its_prototype_under_the_transform() {
    let turned = Affine3A::from_scale_rotation_translation(
        Vec3::new(0.5, 2.0, 3.0),
        Quat::from_rotation_y(0.7),
        Vec3::new(1.0, -2.0, 3.0),
    );
    let sheared = Affine3A::from_mat3(Mat3::from_cols(Vec3::X, Vec3::new(0.5, 1.0, 0.0), Vec3::Z));
    for transform in [
        Affine3A::IDENTITY,
        Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0)),
        Affine3A::from_scale(Vec3::splat(2.5)),
        Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)),
        turned,
        sheared,
    ] {
        let scene = instanced(transform, u32::MAX).unwrap();
        let mut random = Random(5);
        let mut hits = 0;
        for _ in 0..1000 {
            let target = transform.transform_point3(1.6 * random.point());
            let origin = 20.0 * random.point();
            let ray = Ray::new(origin, (target - origin) * (0.1 + random.next()));
            let Some(expected) = expected(transform, &ray) else {
                continue;
            };
            let hit = scene.intersect1(&ray).unwrap();
            assert!(close(&hit, &expected), "{hit:?} {expected:?}");
            assert_eq!((hit.geom, hit.inst, hit.prim), (0, [0], 0));
            assert!(scene.occluded1(&ray));
            hits += 1;
        }
        assert!(hits > 300, "only {hits}");
    }
}

#[test]
fn ids_tell_instances_apart() {
    let scene = instanced(Affine3A::IDENTITY, u32::MAX).unwrap();
    let ray = Ray {
        origin: Vec3::new(100.0, 0.0, -5.0),
        ..axis_ray()
    };
    assert_eq!(scene.intersect1(&ray).map(|h| h.inst), Some([1]));
}

#[test]
fn the_mask_of_an_instance_hides_all_inside() {
    let scene = instanced(Affine3A::IDENTITY, 0b10).unwrap();
    for (mask, seen) in [(0b10, true), (0b01, false)] {
        let ray = Ray { mask, ..axis_ray() };
        assert_eq!(scene.intersect1(&ray).is_some(), seen);
        assert_eq!(scene.occluded1(&ray), seen);
    }
}

#[test]
fn transforms_without_an_inverse_are_refused() {
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let nan = Affine3A::from_translation(Vec3::NAN);
    for transform in [flat, nan] {
        let error = instanced(transform, 1).err().unwrap();
        assert!(
            matches!(
                error,
                EmbreeError::Transform(TransformError::Singular { .. })
            ),
            "{error}"
        );
    }
}

#[test]
fn only_one_level_of_instances_is_taken() {
    let mut builder = SceneBuilder::new(&device(), SceneOptions::default()).unwrap();
    let inner = instanced(Affine3A::IDENTITY, u32::MAX).unwrap();
    assert_eq!(
        builder.add_prototype(inner).err(),
        Some(EmbreeError::NestedInstances)
    );
}

#[test]
fn an_unknown_prototype_is_named() {
    let mut builder = SceneBuilder::new(&device(), SceneOptions::default()).unwrap();
    let instance = Instance {
        prototype: Prototype(3),
        transform: Affine3A::IDENTITY,
        mask: u32::MAX,
    };
    assert_eq!(
        builder.attach_instance(&instance),
        Err(EmbreeError::NotInScene {
            what: "prototype",
            id: 3
        })
    );
}
