use std::sync::Arc;

use glam::vec3;

use super::super::{Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, UvTransform};
use super::*;

/// A surface of triangles whose corners stand alone: (position, normal, texture coordinates).
fn closed(
    corners: &[(Vec3, Vec3, Vec2)],
    wrap: Wrap,
    scale: Vec2,
) -> (DisplacedSurface, Vec<Wall>) {
    let builder = MeshBuilder {
        positions: corners.iter().map(|c| c.0).collect(),
        normals: corners.iter().map(|c| c.1).collect(),
        texcoords: corners.iter().map(|c| c.2).collect(),
        triangles: (0..corners.len() as u32 / 3)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect(),
    };
    let (mesh, _) = builder.build(NormalMode::File).unwrap();
    let map = DisplacementMap::new(4, 4, Texels::U8((0..16).collect()), wrap).unwrap();
    let displacement = Displacement {
        uv: UvTransform {
            scale,
            ..UvTransform::default()
        },
        ..Displacement::new(1.0)
    };
    let surface = DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap();
    assert_eq!((surface.seams(), surface.walls()), (Seams::Open, &[][..]));
    let surface = surface.with_seams(Seams::Closed);
    let walls = surface.walls().to_vec();
    assert!(walls.is_sorted_by_key(|w| (w.triangle, w.side)));
    (surface, walls)
}

/// Two triangles over the quadrilateral a b c d.
fn quad<T: Copy>([a, b, c, d]: [T; 4]) -> [T; 6] {
    [a, b, c, a, c, d]
}

const UNIT: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

#[test]
fn a_square_has_walls_at_its_border_only() {
    let square = quad(UNIT.map(|c| (c.extend(0.0), Vec3::Z, c)));
    let (_, walls) = closed(&square, Wrap::Repeat, Vec2::ONE);
    let at: Vec<_> = walls.iter().map(|w| (w.triangle, w.side)).collect();
    // The diagonal is opposite corner 1 of the first and corner 2 of the second.
    assert_eq!(at, [(0, 0), (0, 2), (1, 0), (1, 1)]);
    assert!(walls.iter().all(|w| w.other.is_none()));
}

#[test]
fn both_faces_have_a_wall_at_a_hard_edge() {
    let mut corners = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut normal = Vec3::ZERO;
            normal[axis] = sign;
            let (mut s, mut t) = (Vec3::ZERO, Vec3::ZERO);
            s[(axis + 1) % 3] = sign;
            t[(axis + 2) % 3] = 1.0;
            corners.extend(quad(UNIT.map(|c| {
                let (x, y) = (2.0 * c.x - 1.0, 2.0 * c.y - 1.0);
                (normal + x * s + y * t, normal, c)
            })));
        }
    }
    let (_, walls) = closed(&corners, Wrap::Repeat, Vec2::ONE);
    assert_eq!(walls.len(), 24);
    assert!(walls.iter().all(|w| w.other.is_none()));
}

/// A tube of `n` quadrilaterals, u from 0 to 1 around it.
fn tube(n: u32) -> Vec<(Vec3, Vec3, Vec2)> {
    let corner = |k: u32, z: f32| {
        // The first and the last column are the same, bit for bit.
        let angle = (k % n) as f32 / n as f32 * std::f32::consts::TAU;
        let normal = vec3(angle.cos(), angle.sin(), 0.0);
        (
            normal + z * Vec3::Z,
            normal,
            Vec2::new(k as f32 / n as f32, z),
        )
    };
    (0..n)
        .flat_map(|k| {
            quad([
                corner(k, 0.0),
                corner(k + 1, 0.0),
                corner(k + 1, 1.0),
                corner(k, 1.0),
            ])
        })
        .collect()
}

#[test]
fn a_seam_is_walled_once_unless_whole_periods_lie_between() {
    let seams = |wrap, scale| {
        let (_, walls) = closed(&tube(8), wrap, Vec2::new(scale, 1.0));
        let (rims, seams): (Vec<_>, Vec<_>) = walls.into_iter().partition(|w| w.other.is_none());
        assert_eq!(rims.len(), 16);
        seams
    };
    assert!(seams(Wrap::Repeat, 1.0).is_empty());
    assert!(seams(Wrap::Repeat, 3.0).is_empty());
    assert!(seams(Wrap::Mirror, 2.0).is_empty());
    for (wrap, scale) in [(Wrap::Repeat, 1.5), (Wrap::Mirror, 1.0), (Wrap::Clamp, 1.0)] {
        let found = seams(wrap, scale);
        assert_eq!(found.len(), 1, "{wrap:?}");
        // The first column's triangle has it: its edge from the top corner down to the bottom one.
        let other = [Vec2::new(scale, 1.0), Vec2::new(scale, 0.0)];
        let wall = Wall {
            triangle: 1,
            side: 1,
            other: Some(other),
        };
        assert_eq!(found, [wall]);
    }
}

#[test]
fn an_edge_of_three_faces_is_a_border_of_each() {
    let spoke = |angle: f32| {
        let p = vec3(angle.cos(), angle.sin(), 0.0);
        [Vec3::ZERO, Vec3::Z, p].map(|p| (p, Vec3::X, p.truncate()))
    };
    let fan: Vec<_> = [0.0, 2.0, 4.0].into_iter().flat_map(spoke).collect();
    let (_, walls) = closed(&fan, Wrap::Repeat, Vec2::ONE);
    assert_eq!(walls.len(), 9);
    assert!(walls.iter().all(|w| w.other.is_none()));
}

#[test]
fn neighbours_that_are_wound_the_same_way_still_share_their_edge() {
    // As where a strip closes after half a turn.
    let normal = Vec3::Z;
    let [a, b] = [(Vec3::ZERO, normal, Vec2::ZERO), (Vec3::Y, normal, Vec2::Y)];
    let right = (Vec3::X, normal, Vec2::X);
    let left = (-Vec3::X, normal, -Vec2::X);
    let (_, walls) = closed(&[a, b, left, a, b, right], Wrap::Clamp, Vec2::ONE);
    assert_eq!(walls.len(), 4);
    let moved = |(p, n, st): (Vec3, Vec3, Vec2)| (p, n, st + Vec2::new(0.25, 0.5));
    let strip = [a, b, left, moved(a), moved(b), right];
    let (_, walls) = closed(&strip, Wrap::Clamp, Vec2::ONE);
    let seam = walls.iter().find(|w| w.other.is_some()).unwrap();
    assert_eq!((seam.triangle, seam.side), (0, 2));
    assert_eq!(seam.other, Some([moved(a).2, moved(b).2]));
}

#[test]
fn heights_and_edits_reach_the_other_edge() {
    let square = |at: Vec2| quad(UNIT.map(|c| (c.extend(0.0), Vec3::Z, at + 0.1 * c)));
    // Heights rise from 0 at the map's bottom row to 15/255 at its top.
    let (surface, _) = closed(&square(Vec2::new(0.6, 0.8)), Wrap::Clamp, Vec2::ONE);
    let [low, high] = surface.displacements(0);
    assert!(low <= 0.0 && (10.0 / 255.0..=15.1 / 255.0).contains(&high));
    let open = surface.clone().with_seams(Seams::Open);
    assert!(open.displacements(0)[0] > 8.9 / 255.0);

    let mut parted = square(Vec2::new(0.6, 0.8));
    for corner in &mut parted[3..] {
        corner.2 = Vec2::new(0.1, 0.1);
    }
    let (surface, walls) = closed(&parted, Wrap::Clamp, Vec2::ONE);
    let seam = walls.iter().find(|w| w.other.is_some()).unwrap();
    assert_eq!((seam.triangle, seam.side), (0, 1));
    let texel = TexelRect {
        x: 0,
        y: 0,
        width: 1,
        height: 1,
    };
    assert!(surface.overlaps(0, texel) && surface.overlaps(1, texel));
    assert!(!surface.clone().with_seams(Seams::Open).overlaps(0, texel));
}

#[test]
fn a_point_of_a_wall_is_between_its_heights() {
    let square = quad(UNIT.map(|c| (c.extend(0.0), Vec3::Z, c)));
    let (surface, walls) = closed(&square, Wrap::Clamp, Vec2::ONE);
    for (index, wall) in walls.iter().enumerate() {
        let [a, b] = wall
            .corners()
            .map(|k| surface.mesh().corners(wall.triangle)[k]);
        for l in [0.0, 0.3, 1.0] {
            let [bottom, top] = [0.0, 1.0].map(|v| surface.on_wall(index, l, v).point);
            assert_eq!(bottom.position, a.lerp(b, l));
            assert_eq!(bottom.base_position, top.base_position);
            assert!((top.position.z - top.displacement).abs() < 1e-7);
            assert!(top.displacement >= 0.0 && top.displacement < 0.06);
            // Outward: away from the middle of the square.
            let middle = vec3(0.5, 0.5, 0.0);
            assert!(top.geometric_normal.dot(a.lerp(b, 0.5) - middle) > 0.49);
            assert_eq!(top.geometric_normal.z, 0.0);
        }
    }
}
