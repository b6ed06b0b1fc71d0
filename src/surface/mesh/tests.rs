use super::*;
use glam::{Quat, vec2, vec3};

fn quad() -> MeshBuilder {
    MeshBuilder {
        positions: vec![
            vec3(0.0, 0.0, 0.0),
            vec3(1.0, 0.0, 0.0),
            vec3(1.0, 1.0, 0.0),
            vec3(0.0, 1.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..MeshBuilder::default()
    }
}

fn refused(change: impl FnOnce(&mut MeshBuilder)) -> MeshError {
    let mut builder = quad();
    change(&mut builder);
    builder.build(NormalMode::File).expect_err("refused")
}

#[test]
fn an_index_out_of_range_names_triangle_index_and_count() {
    assert_eq!(
        refused(|m| m.triangles[1][2] = 4),
        MeshError::IndexOutOfRange {
            triangle: 1,
            index: 4,
            vertices: 4
        }
    );
}

#[test]
fn numbers_that_are_not_finite_name_what_and_where() {
    assert!(matches!(
        refused(|m| m.positions[2].y = f32::NAN),
        MeshError::NotFinite { what: "position", vertex: 2, value } if value.is_nan()
    ));
    let infinite = MeshError::NotFinite {
        what: "normal",
        vertex: 3,
        value: f32::NEG_INFINITY,
    };
    let normals = vec![Vec3::Z, Vec3::Z, Vec3::Z, Vec3::NEG_INFINITY];
    assert_eq!(refused(|m| m.normals = normals), infinite);
    assert!(matches!(
        refused(|m| m.texcoords = vec![vec2(0.0, f32::NAN); 4]),
        MeshError::NotFinite {
            what: "texture coordinate",
            vertex: 0,
            ..
        }
    ));
}

#[test]
fn arrays_of_the_wrong_length_are_refused() {
    assert_eq!(
        refused(|m| m.normals = vec![Vec3::Z; 3]),
        MeshError::WrongLength {
            what: "normals",
            found: 3,
            vertices: 4
        }
    );
    assert!(matches!(
        refused(|m| m.texcoords = vec![Vec2::ZERO; 5]),
        MeshError::WrongLength { found: 5, .. }
    ));
}

#[test]
fn a_mesh_without_area_is_refused() {
    assert_eq!(
        refused(|m| m.triangles.clear()),
        MeshError::NoTriangles { faces: 0 }
    );
    assert_eq!(
        refused(|m| m.triangles = vec![[0, 1, 1], [2, 2, 2]]),
        MeshError::NoTriangles { faces: 2 }
    );
}

#[test]
fn zero_area_faces_go_with_their_vertices_and_the_rest_keeps_its_order() {
    let mut builder = quad();
    builder.texcoords = builder.positions.iter().map(|p| p.truncate()).collect();
    builder.positions.insert(0, vec3(9.0, 9.0, 9.0));
    builder.texcoords.insert(0, vec2(9.0, 9.0));
    builder.triangles = vec![[1, 2, 3], [0, 1, 1], [1, 3, 4]];
    let (mesh, report) = builder.build(NormalMode::File).unwrap();
    assert_eq!(report.degenerate_dropped, 1);
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.positions(), quad().positions);
    assert_eq!(mesh.corner_texcoords(1)[2], vec2(0.0, 1.0));
    assert_eq!(mesh.bounds().max, vec3(1.0, 1.0, 0.0));
}

#[test]
fn area_is_judged_by_shape_not_by_size() {
    for exponent in [-30, 0, 18] {
        let mut builder = quad();
        for p in &mut builder.positions {
            *p *= 10_f32.powi(exponent);
        }
        let (_, report) = builder.build(NormalMode::File).unwrap();
        assert_eq!(report.degenerate_dropped, 0, "size 1e{exponent}");
    }
}

#[test]
fn file_normals_are_normalised_and_kept_even_against_the_face() {
    let mut builder = quad();
    builder.normals = vec![
        vec3(0.0, 0.0, -3.0),
        Vec3::X * 1e-30,
        Vec3::Y * 1e30,
        Vec3::Z,
    ];
    let (mesh, report) = builder.build(NormalMode::File).unwrap();
    assert!(!report.normals_computed);
    assert_eq!(mesh.normals(), [-Vec3::Z, Vec3::X, Vec3::Y, Vec3::Z]);
}

#[test]
fn a_zero_normal_is_computed_and_the_others_stay() {
    let mut builder = quad();
    builder.normals = vec![Vec3::X, Vec3::ZERO, Vec3::X, Vec3::X];
    let (mesh, report) = builder.build(NormalMode::File).unwrap();
    assert!(report.normals_computed);
    assert_eq!(mesh.normals(), [Vec3::X, Vec3::Z, Vec3::X, Vec3::X]);
}

#[test]
fn a_bad_crease_angle_is_refused() {
    for bad in [-0.1, f32::NAN, f32::INFINITY] {
        let mode = NormalMode::Smooth { crease_angle: bad };
        assert!(matches!(
            quad().build(mode),
            Err(MeshError::BadCreaseAngle { .. })
        ));
    }
}

/// A tilted plane, its normal not along any axis of the transforms.
fn tilted() -> MeshBuilder {
    let mut builder = quad().transformed(&Affine3A::from_quat(Quat::from_rotation_x(0.7)));
    builder.normals = vec![Quat::from_rotation_x(0.7) * Vec3::Z; 4];
    builder
}

#[test]
fn normals_stay_normal_to_the_face_under_any_transform() {
    for scale in [
        vec3(2.0, 0.5, 3.0),
        vec3(-2.0, 0.5, 3.0),
        vec3(-1.0, -1.0, -1.0),
    ] {
        let transform = Affine3A::from_scale_rotation_translation(
            scale,
            Quat::from_rotation_z(0.3),
            vec3(1.0, 2.0, 3.0),
        );
        let (mesh, _) = tilted()
            .transformed(&transform)
            .build(NormalMode::File)
            .unwrap();
        let [a, b, c] = mesh.corners(0);
        let face = (b - a).cross(c - a).normalize();
        for n in mesh.normals() {
            assert!((*n - face).length() < 1e-6, "{scale}: {n} against {face}");
        }
    }
}

#[test]
fn a_singular_transform_leaves_nothing() {
    let flat = Affine3A::from_scale(vec3(0.0, 1.0, 1.0));
    let result = quad().transformed(&flat).build(NormalMode::File);
    assert_eq!(result.unwrap_err(), MeshError::NoTriangles { faces: 2 });
}

#[test]
fn appending_fills_missing_normals_and_drops_lonely_texture_coordinates() {
    let mut whole = quad();
    whole.texcoords = vec![Vec2::ZERO; 4];
    let mut other = quad();
    other.normals = vec![Vec3::X; 4];
    whole.append(other);
    assert_eq!(whole.triangles[3], [4, 6, 7]);
    assert_eq!(whole.normals[3..5], [Vec3::ZERO, Vec3::X]);
    assert!(whole.texcoords.is_empty());
    let (mesh, _) = whole.build(NormalMode::File).unwrap();
    assert_eq!(mesh.normals()[0], Vec3::Z);
}
