use super::*;
use crate::embree::BuildQuality;

#[test]
fn an_empty_scene_is_committed_and_empty() {
    let builder = SceneBuilder::new(&device(), SceneOptions::default()).unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(scene.bounds(), Aabb::EMPTY);
    assert_eq!(scene.intersect1(&axis_ray()), None);
    assert!(!scene.occluded1(&axis_ray()));
}

#[test]
fn a_geometry_without_primitives_is_as_good_as_none() {
    let scene = scene_of(&device(), Arc::new(Balls(Vec::new())));
    assert_eq!(scene.bounds(), Aabb::EMPTY);
    assert_eq!(scene.intersect1(&axis_ray()), None);
}

#[test]
fn every_quality_and_flag_finds_the_same_hits() {
    let device = device();
    let balls = Balls::strewn(400);
    for quality in [BuildQuality::Low, BuildQuality::Medium, BuildQuality::High] {
        for flags in 0..8 {
            let options = SceneOptions {
                quality,
                dynamic: flags & 1 != 0,
                compact: flags & 2 != 0,
                robust: flags & 4 != 0,
            };
            let mut builder = SceneBuilder::new(&device, options).unwrap();
            builder
                .attach(UserGeometry::new(&device, balls.clone()).unwrap())
                .unwrap();
            let scene = builder.commit().unwrap();
            let mut random = Random(3);
            for _ in 0..300 {
                let ray = random.ray();
                let expected = balls.first_hit(&ray).map(|(prim, h)| (prim, h.t));
                let found = scene.intersect1(&ray).map(|h| (h.prim, h.t));
                assert_eq!(found, expected, "{options:?}");
            }
        }
    }
}
