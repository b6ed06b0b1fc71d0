use super::*;
use crate::surface::{BaseMesh, NormalMode};
use glam::{vec2, vec3};

const ALL: [Projection; 4] = [
    Projection::Box,
    Projection::Spherical,
    Projection::Cylindrical,
    Projection::Planar,
];

/// Longitudes and latitudes of the test sphere.
const AROUND: u32 = 12;
const UP: u32 = 6;

/// A unit sphere with one vertex at each pole and no seam, wound outward.
fn sphere() -> MeshBuilder {
    let mut mesh = MeshBuilder {
        positions: vec![-Vec3::Y],
        ..MeshBuilder::default()
    };
    for (j, i) in (1..UP).flat_map(|j| (0..AROUND).map(move |i| (j, i))) {
        let (latitude, longitude) = (
            (j as f32 / UP as f32 - 0.5) * std::f32::consts::PI,
            // Off the grid, so that the seam runs through the middle of triangles.
            (i as f32 + 0.3) / AROUND as f32 * std::f32::consts::TAU,
        );
        let (sin, cos) = longitude.sin_cos();
        mesh.positions.push(vec3(
            latitude.cos() * sin,
            latitude.sin(),
            latitude.cos() * cos,
        ));
    }
    mesh.positions.push(Vec3::Y);
    let top = mesh.positions.len() as u32 - 1;
    let at = |j: u32, i: u32| 1 + (j - 1) * AROUND + i % AROUND;
    for i in 0..AROUND {
        mesh.triangles.push([0, at(1, i + 1), at(1, i)]);
        mesh.triangles.push([top, at(UP - 1, i), at(UP - 1, i + 1)]);
        for j in 1..UP - 1 {
            let [a, b, c, d] = [at(j, i), at(j, i + 1), at(j + 1, i + 1), at(j + 1, i)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn bounds(mesh: &MeshBuilder) -> Aabb {
    let positions = mesh.positions.iter();
    positions.fold(Aabb::EMPTY, |b, &p| b.including(p))
}

fn projected(mut mesh: MeshBuilder, projection: Projection) -> MeshBuilder {
    let bounds = bounds(&mesh);
    mesh.project(projection, bounds);
    mesh
}

fn built(mesh: MeshBuilder, mode: NormalMode) -> BaseMesh {
    mesh.build(mode).unwrap().0
}

#[test]
fn the_shape_stays_and_every_vertex_has_coordinates() {
    for projection in ALL {
        let before = sphere();
        let after = projected(sphere(), projection);
        assert_eq!(after.texcoords.len(), after.positions.len());
        for (old, new) in before.triangles.iter().zip(&after.triangles) {
            let old = old.map(|i| before.positions[i as usize]);
            assert_eq!(old, new.map(|i| after.positions[i as usize]));
        }
    }
}

#[test]
fn normals_are_the_same_bit_for_bit_on_both_sides_of_a_seam() {
    let mut with_normals = sphere();
    with_normals.normals = sphere().positions.iter().map(|&p| p + 0.1).collect();
    let smooth = NormalMode::Smooth {
        crease_angle: std::f32::consts::PI,
    };
    for projection in ALL {
        for (mesh, mode) in [(sphere(), smooth), (with_normals.clone(), NormalMode::File)] {
            let mesh = built(projected(mesh, projection), mode);
            let mut seen = HashMap::new();
            for (p, n) in mesh.positions().iter().zip(mesh.normals()) {
                let [p, n] = [p, n].map(|v| v.to_array().map(f32::to_bits));
                assert_eq!(*seen.entry(p).or_insert(n), n, "{projection:?}");
            }
        }
    }
}

#[test]
fn no_triangle_runs_back_through_the_map_nor_is_mirrored() {
    for projection in [
        Projection::Box,
        Projection::Spherical,
        Projection::Cylindrical,
    ] {
        let mesh = built(projected(sphere(), projection), NormalMode::File);
        for t in 0..mesh.triangles().len() as u32 {
            let st = mesh.corner_texcoords(t);
            let us = st.map(|st| st.x);
            let span =
                us.into_iter().fold(f32::MIN, f32::max) - us.into_iter().fold(f32::MAX, f32::min);
            assert!(span < 0.5, "{projection:?} {t}: {st:?}");
            let area = (st[1] - st[0]).perp_dot(st[2] - st[0]);
            assert!(area > 0.0, "{projection:?} {t}: {st:?}");
        }
    }
}

#[test]
fn the_sphere_covers_its_map_once() {
    let mesh = built(projected(sphere(), Projection::Spherical), NormalMode::File);
    let area: f32 = (0..mesh.triangles().len() as u32)
        .map(|t| mesh.corner_texcoords(t))
        .map(|st| 0.5 * (st[1] - st[0]).perp_dot(st[2] - st[0]))
        .sum();
    // All but half of the rows at the poles, where the map's edge is drawn together to a point.
    let whole = 1.0 - 1.0 / UP as f32;
    assert!((area - whole).abs() < 1e-5, "{area}");
}

/// A triangle of these corners in a box from -1 to 1 in x and z, and from -2 to 2 in y.
fn corners(projection: Projection, positions: [Vec3; 3]) -> [Vec2; 3] {
    let mut mesh = MeshBuilder {
        positions: positions.into(),
        triangles: vec![[0, 1, 2]],
        ..MeshBuilder::default()
    };
    let bounds = Aabb {
        min: vec3(-1.0, -2.0, -1.0),
        max: vec3(1.0, 2.0, 1.0),
    };
    mesh.project(projection, bounds);
    [0, 1, 2].map(|i| mesh.texcoords[i])
}

#[test]
fn round_maps_face_plus_z_and_turn_towards_plus_x() {
    let positions = [
        vec3(0.0, -2.0, 1.0),
        vec3(1.0, 0.0, 0.0),
        vec3(0.0, 2.0, 1.0),
    ];
    let cylinder = [vec2(0.5, 0.0), vec2(0.75, 0.5), vec2(0.5, 1.0)];
    assert_eq!(corners(Projection::Cylindrical, positions), cylinder);
    let positions = [
        vec3(0.0, -1.0, 1.0),
        vec3(1.0, 0.0, 0.0),
        vec3(0.0, 2.0, 0.0),
    ];
    let sphere = [vec2(0.5, 0.25), vec2(0.75, 0.5), vec2(0.625, 1.0)];
    assert_eq!(corners(Projection::Spherical, positions), sphere);
}

#[test]
fn behind_the_mesh_u_goes_on_beyond_the_edge() {
    let positions = [
        vec3(1.0, 0.0, -1.0),
        vec3(-1.0, 0.0, -1.0),
        vec3(1.0, 2.0, -1.0),
    ];
    let us = corners(Projection::Cylindrical, positions).map(|st| st.x);
    assert_eq!(us, [0.875, 1.125, 0.875]);
}

#[test]
fn a_box_side_shows_the_map_upright_with_one_size_for_all() {
    // Lower left, lower right and upper left corner of each side as seen from outside.
    let [x, y, z] = [
        vec3(1.0, 0.0, 0.0),
        vec3(0.0, 2.0, 0.0),
        vec3(0.0, 0.0, 1.0),
    ];
    let upright = [vec2(0.0, 0.0), vec2(0.5, 0.0), vec2(0.0, 1.0)];
    for (out, right) in [(z, x), (x, -z), (-z, -x), (-x, z)] {
        let side = [out - right - y, out + right - y, out - right + y];
        assert_eq!(corners(Projection::Box, side), upright, "{out}");
    }
    for (out, up) in [(y, -z), (-y, z)] {
        let lid = [out - x - up, out + x - up, out - x + up];
        let square = [vec2(0.0, 0.0), vec2(0.5, 0.0), vec2(0.0, 0.5)];
        assert_eq!(corners(Projection::Box, lid), square, "{out}");
    }
}

#[test]
fn a_plane_lies_across_the_shortest_side() {
    let grid = |place: fn(f32, f32) -> Vec3| {
        let mut mesh = MeshBuilder {
            positions: vec![place(0.0, 0.0), place(4.0, 0.0), place(0.0, 2.0)],
            triangles: vec![[0, 1, 2]],
            ..MeshBuilder::default()
        };
        let bounds = bounds(&mesh);
        mesh.project(Projection::Planar, bounds);
        mesh.texcoords
    };
    let expected = [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.0, 0.5)];
    assert_eq!(grid(|u, v| vec3(u, 7.0, -v)), expected);
    assert_eq!(grid(|u, v| vec3(u, v, 7.0)), expected);
    assert_eq!(grid(|u, v| vec3(7.0, v, -u)), expected);
}

#[test]
fn meshes_without_size_or_sense_do_no_harm() {
    for projection in ALL {
        let mut point = MeshBuilder {
            positions: vec![Vec3::ONE; 3],
            triangles: vec![[0, 1, 2]],
            ..MeshBuilder::default()
        };
        point = projected(point, projection);
        assert!(point.texcoords.iter().all(|st| st.is_finite()));
        point.triangles.push([0, 1, 9]);
        point.texcoords.clear();
        point = projected(point, projection);
        assert!(point.texcoords.is_empty());
    }
}
