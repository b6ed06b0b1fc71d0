use super::*;
use crate::embree::{EmbreeError, Geometry, HitFilter};

fn filtered(device: &Device, filter: HitFilter) -> Scene {
    let balls = vec![(Vec3::ZERO, 1.0), (Vec3::new(0.0, 0.0, 10.0), 1.0)];
    let user = UserGeometry::new(device, Arc::new(Balls(balls))).unwrap();
    let mut builder = SceneBuilder::new(device, SceneOptions::default()).unwrap();
    builder
        .attach(Geometry::from(user).with_filter(filter))
        .unwrap();
    builder.commit().unwrap()
}

/// The crossings along the axis are at t = 4, 6, 14 and 16.
#[test]
fn a_rejected_hit_lets_the_ray_go_on_to_the_next_crossing() {
    for (accepted, expected) in [
        (3.0, Some(4.0)),
        (5.0, Some(6.0)),
        (7.0, Some(14.0)),
        (15.0, Some(16.0)),
        (17.0, None),
    ] {
        let scene = filtered(&device(), Box::new(move |_, hit| hit.t > accepted));
        assert_eq!(scene.intersect1(&axis_ray()).map(|h| h.t), expected);
        assert_eq!(scene.occluded1(&axis_ray()), expected.is_some());
    }
}

#[test]
fn a_filter_sees_the_candidate_and_the_ray() {
    let scene = filtered(
        &device(),
        Box::new(|ray, hit| {
            ray.key == 7 && ray.tfar == hit.t && hit.prim == 1 && hit.geom == 0 && hit.ng.z > 0.0
        }),
    );
    let ray = Ray {
        key: 7,
        ..axis_ray()
    };
    assert_eq!(scene.intersect1(&ray).map(|h| h.t), Some(16.0));
    assert!(scene.occluded1(&ray));
    assert!(!scene.occluded1(&axis_ray()));
}

#[test]
fn a_panic_in_a_filter_rejects_and_is_told() {
    let device = device();
    let scene = filtered(&device, Box::new(|_, _| panic!("no taste")));
    assert_eq!(scene.intersect1(&axis_ray()), None);
    let message = "no taste".to_string();
    assert_eq!(
        device.check(),
        Err(EmbreeError::HitTestPanicked { message })
    );
}
