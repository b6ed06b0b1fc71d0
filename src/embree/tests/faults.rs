use std::sync::Arc;

use super::*;
use crate::embree::EmbreeError;

/// The unit ball, but for what is overridden.
#[derive(Default)]
struct Bad {
    bounds: Option<Aabb>,
    bounds_panics: bool,
    intersect_panics: bool,
    t: Option<f32>,
}

impl HitTest for Bad {
    fn len(&self) -> usize {
        1
    }

    fn bounds(&self, prim: u32) -> Aabb {
        assert!(!self.bounds_panics, "no bounds today");
        self.bounds.unwrap_or_else(|| Balls::unit().bounds(prim))
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        assert!(!self.intersect_panics, "no hits today");
        let hit = Balls::unit().intersect(prim, ray)?;
        Some(PrismHit {
            t: self.t.unwrap_or(hit.t),
            ..hit
        })
    }
}

fn commit_error(bad: Bad) -> EmbreeError {
    let device = device();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    builder
        .attach(UserGeometry::new(&device, Arc::new(bad)).unwrap())
        .unwrap();
    builder.commit().err().unwrap()
}

#[test]
fn a_panic_in_a_hit_test_is_a_miss_and_is_told_once() {
    let device = device();
    let scene = scene_of(
        &device,
        Arc::new(Bad {
            intersect_panics: true,
            ..Bad::default()
        }),
    );
    for ask in [
        |scene: &Scene| scene.intersect1(&axis_ray()).is_some(),
        |scene: &Scene| scene.occluded1(&axis_ray()),
    ] {
        assert!(!ask(&scene));
        let message = "no hits today".to_string();
        assert_eq!(
            device.check(),
            Err(EmbreeError::HitTestPanicked { message })
        );
        assert_eq!(device.check(), Ok(()));
    }
}

#[test]
fn a_panic_in_bounds_fails_the_commit() {
    let error = commit_error(Bad {
        bounds_panics: true,
        ..Bad::default()
    });
    let message = "no bounds today".to_string();
    assert_eq!(error, EmbreeError::HitTestPanicked { message });
}

#[test]
fn boxes_that_embree_would_drop_fail_the_commit() {
    let boxes = [
        (Vec3::NAN, Vec3::ONE),
        (Vec3::ZERO, Vec3::splat(f32::INFINITY)),
        (Vec3::ZERO, Vec3::splat(3e18)),
        (Vec3::ONE, Vec3::ZERO),
    ];
    for (min, max) in boxes {
        let bounds = Some(Aabb { min, max });
        let error = commit_error(Bad {
            bounds,
            ..Bad::default()
        });
        assert!(
            matches!(error, EmbreeError::InvalidBounds { prim: 0, .. }),
            "{min} {max}: {error}"
        );
    }
}

#[test]
fn a_hit_outside_the_interval_is_a_miss() {
    for t in [f32::NAN, -1.0, 0.0, 100.0, f32::INFINITY] {
        let bad = Bad {
            t: Some(t),
            ..Bad::default()
        };
        let scene = scene_of(&device(), Arc::new(bad));
        let ray = Ray {
            tfar: 100.0,
            ..axis_ray()
        };
        assert_eq!(scene.intersect1(&ray), None, "{t}");
    }
}

#[test]
fn invalid_rays_hit_nothing() {
    let scene = scene_of(&device(), Balls::unit());
    let good = axis_ray();
    let bad = [
        Ray {
            direction: Vec3::ZERO,
            ..good
        },
        Ray {
            direction: Vec3::NAN,
            ..good
        },
        Ray {
            origin: Vec3::splat(f32::INFINITY),
            ..good
        },
        Ray {
            tnear: f32::NAN,
            ..good
        },
        Ray {
            tnear: 5.0,
            tfar: 4.0,
            ..good
        },
        Ray {
            tfar: f32::NEG_INFINITY,
            ..good
        },
    ];
    for ray in bad {
        assert_eq!(scene.intersect1(&ray), None, "{ray:?}");
        assert!(!scene.occluded1(&ray), "{ray:?}");
    }
}
