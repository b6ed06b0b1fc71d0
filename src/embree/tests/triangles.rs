use super::*;
use crate::embree::{Geometry, TriangleGeometry};
use crate::surface::{BaseMesh, MeshBuilder, NormalMode};

/// A strip of thin, tilted triangles, with vertices in no special order.
pub fn strip() -> Arc<BaseMesh> {
    let mut mesh = MeshBuilder::default();
    for i in 0..40 {
        let x = i as f32 * 0.25;
        mesh.positions.push(Vec3::new(x, -1.0, 0.3 * x));
        mesh.positions.push(Vec3::new(x + 0.1, 1.0, -0.2 * x));
    }
    for i in 0..39 {
        let k = 2 * i;
        mesh.triangles.push([k, k + 2, k + 1]);
        mesh.triangles.push([k + 3, k + 1, k + 2]);
    }
    Arc::new(mesh.build(NormalMode::File).unwrap().0)
}

fn scene(mesh: &Arc<BaseMesh>, change: impl FnOnce(Geometry) -> Geometry) -> Scene {
    let device = device();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    let geometry = TriangleGeometry::new(&device, mesh.clone()).unwrap();
    builder.attach(change(geometry.into())).unwrap();
    builder.commit().unwrap()
}

#[test]
fn each_triangle_is_hit_where_its_barycentric_coordinates_say() {
    let mesh = strip();
    let scene = scene(&mesh, |g| g);
    for prim in 0..mesh.triangles().len() as u32 {
        let [v0, v1, v2] = mesh.corners(prim);
        let ng = (v1 - v0).cross(v2 - v0).normalize();
        let (u, v) = (0.2, 0.3);
        let target = v0 + u * (v1 - v0) + v * (v2 - v0);
        let ray = Ray::new(target + 3.0 * ng, -0.5 * ng);
        let hit = scene.intersect1(&ray).unwrap();
        assert_eq!((hit.prim, hit.geom), (prim, 0));
        assert!((hit.t - 6.0).abs() < 1e-4, "{hit:?}");
        assert!((hit.u - u).abs() < 1e-4 && (hit.v - v).abs() < 1e-4);
        assert!(hit.ng.distance(ng) < 1e-5, "{} {ng}", hit.ng);
        assert!(hit.ng.is_normalized());
        assert!(scene.occluded1(&ray));
    }
    assert!((scene.bounds().diagonal() - mesh.bounds().diagonal()).abs() < 1e-4);
}

#[test]
fn triangles_have_masks_and_filters_too() {
    let mesh = strip();
    let [v0, v1, v2] = mesh.corners(5);
    let ray = Ray {
        mask: 0b10,
        ..Ray::new((v0 + v1 + v2) / 3.0 - Vec3::Z * 20.0, Vec3::Z)
    };
    type Change = fn(Geometry) -> Geometry;
    let cases: [(Change, bool); 4] = [
        (|g| g.with_mask(0b10), true),
        (|g| g.with_mask(0b01), false),
        (|g| g.with_filter(Box::new(|_, hit| hit.prim == 5)), true),
        (|g| g.with_filter(Box::new(|_, hit| hit.prim != 5)), false),
    ];
    for (change, seen) in cases {
        let scene = scene(&mesh, change);
        assert_eq!(scene.intersect1(&ray).is_some(), seen);
        assert_eq!(scene.occluded1(&ray), seen);
    }
}
