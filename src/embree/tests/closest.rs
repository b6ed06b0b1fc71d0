use std::sync::Arc;

use glam::{Affine3A, Mat3A, Quat, Vec2};

use super::*;
use crate::embree::Instance;
use crate::prism::{March, Prisms};
use crate::surface::{
    ClosestPoint, DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode,
    PointQuery, Texels, Wrap,
};
use crate::trace::INVALID_ID;

/// A hilly square of 2 x `n` x `n` triangles.
pub fn hills(n: u32) -> Arc<Prisms> {
    let mut mesh = MeshBuilder::default();
    for j in 0..=n {
        for i in 0..=n {
            let st = Vec2::new(i as f32, j as f32) / n as f32;
            mesh.positions.push((st - 0.5).extend(0.0));
            mesh.texcoords.push(st);
        }
    }
    for j in 0..n {
        for i in 0..n {
            let [a, b] = [j * (n + 1) + i, (j + 1) * (n + 1) + i];
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    let (mesh, _) = mesh.build(NormalMode::File).unwrap();
    let texels = Texels::U8((0..256).map(|i: u32| ((i * i * 31) >> 3) as u8).collect());
    let map = DisplacementMap::new(16, 16, texels, Wrap::Repeat).unwrap();
    let surface =
        DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(0.2)).unwrap();
    Arc::new(Prisms::new(Arc::new(surface), March::Exact).unwrap())
}

/// Every primitive asked.
fn nearest(prisms: &Prisms, query: &PointQuery) -> Option<ClosestPoint> {
    (0..prisms.len() as u32)
        .filter_map(|primitive| prisms.closest(primitive, query))
        .min_by(|a, b| a.distance.total_cmp(&b.distance))
}

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= 3e-6 * a.abs().max(1.0)
}

#[test]
fn nearest_points_are_those_of_asking_every_primitive() {
    let prisms = hills(6);
    let scene = scene_of(&device(), prisms.clone());
    let mut random = Random(3);
    let (mut near, mut none) = (0, 0);
    for _ in 0..300 {
        let query = PointQuery::new(3.0 * random.point(), 0.2 + random.next());
        let (found, wanted) = (
            scene.closest(query.point, query.radius),
            nearest(&prisms, &query),
        );
        assert_eq!(found.is_some(), wanted.is_some());
        let (Some(found), Some(wanted)) = (found, wanted) else {
            none += 1;
            continue;
        };
        near += 1;
        assert!(
            close(found.distance, wanted.distance),
            "{found:?} {wanted:?}"
        );
        assert_eq!((found.geom, found.inst), (0, [INVALID_ID]));
        let at = prisms.point(found.prim, found.u, found.v).position;
        assert!(at.distance(found.point) < 1e-5);
        assert!(close(at.distance(query.point), found.distance) || found.distance < 1e-5);
    }
    assert!(near > 50 && none > 50, "{near} near, {none} none");
    for point in [Vec3::NAN, Vec3::INFINITY] {
        assert_eq!(scene.closest(point, f32::INFINITY), None);
    }
    assert_eq!(scene.closest(Vec3::ZERO, f32::NAN), None);
    assert!(scene.closest(Vec3::splat(1e4), f32::INFINITY).is_some());
}

#[test]
fn instances_are_near_where_they_stand() {
    let device = device();
    let prisms = hills(3);
    let turn = Quat::from_rotation_x(1.0);
    let mut sheared = Mat3A::from_quat(turn) * Mat3A::from_diagonal(Vec3::new(2.0, 0.5, -1.0));
    sheared.x_axis += 0.5 * sheared.y_axis;
    let transforms = [
        Affine3A::from_scale_rotation_translation(Vec3::splat(1.7), turn, Vec3::X),
        Affine3A::from_mat3_translation(sheared.into(), -Vec3::X),
    ];
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    let prototype = builder
        .add_prototype(scene_of(&device, prisms.clone()))
        .unwrap();
    builder
        .attach(UserGeometry::new(&device, prisms.clone()).unwrap())
        .unwrap();
    for transform in transforms {
        let instance = Instance {
            prototype,
            transform,
            mask: u32::MAX,
        };
        builder.attach_instance(&instance).unwrap();
    }
    let scene = builder.commit().unwrap();
    let mut random = Random(4);
    let mut met = [0; 3];
    for _ in 0..300 {
        let query = PointQuery::new(4.0 * random.point(), f32::INFINITY);
        let places = [Affine3A::IDENTITY, transforms[0], transforms[1]];
        let distances = places.map(|to_world| {
            nearest(&prisms, &PointQuery { to_world, ..query }).map_or(f32::NAN, |at| at.distance)
        });
        let found = scene.closest(query.point, query.radius).unwrap();
        let wanted = distances.into_iter().fold(f32::INFINITY, f32::min);
        assert!(close(found.distance, wanted), "{found:?} {distances:?}");
        let place = if found.inst[0] == INVALID_ID {
            0
        } else {
            found.inst[0] as usize
        };
        assert!(close(distances[place], wanted), "{found:?} {distances:?}");
        let at = prisms.point(found.prim, found.u, found.v).position;
        assert!(places[place].transform_point3(at).distance(found.point) < 2e-5);
        met[place] += 1;
    }
    assert!(met.iter().all(|&n| n > 20), "{met:?}");
}

/// Balls know no nearest points; another test panics.
struct Falling;

impl HitTest for Falling {
    fn len(&self) -> usize {
        1
    }

    fn bounds(&self, prim: u32) -> Aabb {
        Balls::unit().bounds(prim)
    }

    fn intersect(&self, _: u32, _: &Ray) -> Option<PrismHit> {
        None
    }

    fn closest(&self, _: u32, _: &PointQuery) -> Option<ClosestPoint> {
        panic!("of no ball")
    }
}

#[test]
fn tests_without_nearest_points_and_those_that_panic_have_none() {
    let device = device();
    let scene = scene_of(&device, Balls::unit());
    assert_eq!(scene.closest(Vec3::ZERO, 10.0), None);
    device.check().unwrap();
    let scene = scene_of(&device, Arc::new(Falling));
    assert_eq!(scene.closest(Vec3::ZERO, 10.0), None);
    assert!(
        device
            .check()
            .unwrap_err()
            .to_string()
            .contains("of no ball")
    );
}
