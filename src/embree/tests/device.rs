use std::sync::Arc;

use super::*;
use crate::embree::{EmbreeError, ErrorCode, version};

#[test]
fn an_unreadable_configuration_is_an_error_that_names_it() {
    for config in ["threads=many", "threads=2\0"] {
        let options = DeviceOptions {
            config: config.to_string(),
            ..DeviceOptions::default()
        };
        let error = Device::new(&options).unwrap_err();
        assert!(matches!(error, EmbreeError::Library { .. }), "{error}");
        assert!(error.to_string().contains("configuration"), "{error}");
    }
}

#[test]
fn library_and_headers_are_of_one_major_version() {
    let major = |v: &str| v.split('.').next().map(str::to_string);
    assert_eq!(major(&device().version()), major(version()));
}

#[test]
fn memory_is_counted_while_held_and_returned_when_dropped() {
    let device = device();
    let scene = scene_of(&device, Balls::strewn(10_000));
    let held = device.memory();
    // A box and an id per primitive at the very least.
    assert!(held.current > 10_000 * 8, "{held:?}");
    assert!(held.peak >= held.current, "{held:?}");
    drop(scene);
    assert_eq!(device.memory().current, 0);
    assert_eq!(device.memory().peak, held.peak);
}

#[test]
fn a_memory_limit_fails_the_build_and_nothing_else() {
    let limit = 200_000;
    let device = Device::new(&DeviceOptions {
        memory_limit: Some(limit),
        ..DeviceOptions::default()
    })
    .unwrap();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    let many = UserGeometry::new(&device, Balls::strewn(100_000)).unwrap();
    builder.attach(many).unwrap();
    let error = builder.commit().err().unwrap();
    assert_eq!(error, EmbreeError::MemoryLimit { limit });

    let scene = scene_of(&device, Balls::unit());
    assert!(scene.intersect1(&axis_ray()).is_some());
    assert!(device.memory().current <= limit);
}

#[test]
fn geometry_of_another_device_is_refused() {
    let (ours, other) = (device(), device());
    let mut builder = SceneBuilder::new(&ours, SceneOptions::default()).unwrap();
    let stranger = UserGeometry::new(&other, Balls::unit()).unwrap();
    let error = builder.attach(stranger).unwrap_err();
    assert!(
        matches!(
            error,
            EmbreeError::Library {
                code: ErrorCode::InvalidArgument,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn a_test_lives_as_long_as_its_scene() {
    let device = device();
    let balls = Balls::unit();
    let watch = Arc::downgrade(&balls);
    let scene = scene_of(&device, balls);
    assert!(watch.upgrade().is_some());
    drop(scene);
    assert!(watch.upgrade().is_none());
}
