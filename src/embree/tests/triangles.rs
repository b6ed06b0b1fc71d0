use super::*;
use crate::embree::{EmbreeError, Geometry, Grid, GridGeometry, TriangleGeometry};
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

/// `n` x `n` vertices over the square (0, 0) .. (1, 1) at z = 0, row by row.
fn lattice(n: u16) -> Vec<[f32; 3]> {
    let at = |i: u16| f32::from(i) / f32::from(n - 1);
    (0..n)
        .flat_map(|y| (0..n).map(move |x| [at(x), at(y), 0.0]))
        .collect()
}

#[test]
fn grids_and_triangles_of_the_same_vertices_are_the_same_surface() {
    let device = device();
    let n = 6u16;
    let cells = (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| u32::from(y * n + x)));
    let side = u32::from(n);
    let triangles = cells
        .flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]])
        .collect();
    let grid = Grid {
        first: 0,
        stride: side,
        width: n,
        height: n,
    };
    let geometries: [Geometry; 2] = [
        TriangleGeometry::from_buffers(&device, lattice(n), triangles)
            .unwrap()
            .into(),
        GridGeometry::from_buffers(&device, lattice(n), &[grid])
            .unwrap()
            .into(),
    ];
    for geometry in geometries {
        let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
        builder.attach(geometry).unwrap();
        let scene = builder.commit().unwrap();
        let t = |scene: &Scene, x: f32, y: f32| {
            let hit = scene.intersect1(&Ray::new(Vec3::new(x, y, 2.0), -Vec3::Z));
            hit.map(|hit| hit.t)
        };
        for (x, y) in [(0.01, 0.02), (0.5, 0.52), (0.97, 0.3)] {
            assert_eq!(t(&scene, x, y), Some(2.0));
        }
        assert_eq!(t(&scene, 1.01, 0.5), None);

        let mut builder = scene.reopen();
        let lift = |vertices: &mut [[f32; 3]]| vertices.iter_mut().for_each(|v| v[2] += 0.5);
        builder.move_vertices(0, lift).unwrap();
        assert!(builder.move_vertices(1, lift).is_err());
        assert_eq!(t(&builder.commit().unwrap(), 0.5, 0.52), Some(1.5));
    }
}

#[test]
fn indices_beyond_the_vertices_are_refused() {
    let device = device();
    let error = TriangleGeometry::from_buffers(&device, lattice(2), vec![[0, 1, 2], [1, 4, 2]]);
    let told = |what, index| EmbreeError::BadElement {
        what,
        index,
        vertices: 4,
    };
    assert_eq!(error.err(), Some(told("triangle", 1)));
    let sound = Grid {
        first: 0,
        stride: 2,
        width: 2,
        height: 2,
    };
    for bad in [
        Grid { first: 1, ..sound },
        Grid { stride: 3, ..sound },
        Grid { width: 1, ..sound },
        Grid { height: 3, ..sound },
        Grid {
            stride: 0,
            height: u16::MAX,
            ..sound
        },
    ] {
        let error = GridGeometry::from_buffers(&device, lattice(2), &[sound, bad]);
        assert_eq!(error.err(), Some(told("grid", 1)), "{bad:?}");
    }
}
