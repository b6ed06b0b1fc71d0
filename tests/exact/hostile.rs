//! Slivers, scales, distances and rays that make formulas lose their digits.

use std::sync::Arc;

use glam::{Affine3A, Quat, Vec3};
use prismarch::surface::{DisplacedSurface, MeshBuilder, Wrap};

use super::judge::{Case, judge};
use super::meshes::{bent, displaced, flat, leaning, moved, texture_degenerate, torus};
use super::{maps, rays};

fn mixed(name: &'static str, surface: Arc<DisplacedSurface>) -> Case {
    let rays = rays::mixed(&surface, 11);
    Case::new(name, &surface, rays)
}

/// Ten thousand times as long as wide, the map stretched with them.
#[test]
fn slivers() {
    let stretch = |mesh: MeshBuilder| moved(mesh, Affine3A::from_scale(Vec3::new(1.0, 1e-4, 1.0)));
    let map = || maps::waves(24, Wrap::Clamp);
    let flat = displaced(stretch(flat(2)), map(), 0.1, 0.0);
    let bent = displaced(stretch(bent(4)), map(), 0.05, 0.2);
    let cases = [mixed("flat slivers", flat), mixed("bent slivers", bent)];
    // Several crossings lie within the strip's width of 1e-4.
    judge(cases.map(|case| Case { same: 1e-5, ..case }));
}

#[test]
fn degenerate_texture_coordinates() {
    let mesh = texture_degenerate(&bent(4));
    let map = maps::white(24, 24, Wrap::Repeat);
    let surface = displaced(mesh, map, 0.1, 0.0);
    judge([mixed("degenerate texture coordinates", surface)]);
}

#[test]
fn scales() {
    judge(
        [("scale 1e-4", 1e-4), ("scale 1e4", 1e4)].map(|(name, scale)| {
            let mesh = moved(torus(8), Affine3A::from_scale(Vec3::splat(scale)));
            let map = maps::waves(32, Wrap::Repeat);
            mixed(name, displaced(mesh, map, 0.2 * scale, 0.3))
        }),
    );
}

#[test]
fn far_from_the_origin() {
    let place = Affine3A::from_rotation_translation(
        Quat::from_rotation_x(0.5),
        1e4 * Vec3::new(1.0, -0.8, 0.6),
    );
    let surface = displaced(
        moved(bent(4), place),
        maps::waves(24, Wrap::Clamp),
        0.15,
        0.3,
    );
    let mesh = leaning(moved(bent(2), place), 0.4, 5);
    let leaning = displaced(mesh, maps::white(12, 12, Wrap::Clamp), 0.1, 0.0);
    judge([
        mixed("10^4 sizes away", surface),
        mixed("10^4 sizes away, leaning", leaning),
    ]);
}

/// No offset triangle ever crosses such a ray's path: all of them are parallel to it.
#[test]
fn rays_in_the_base_plane() {
    let surface = displaced(flat(3), maps::white(24, 24, Wrap::Clamp), 0.3, 0.5);
    let rays = rays::in_plane(&surface, [-0.16, 0.16], 12);
    let upright = Case::new("rays in the base plane", &surface, rays);
    let mut mesh = flat(3);
    mesh.normals.fill(Vec3::new(0.3, -0.4, 0.9));
    let surface = displaced(mesh, maps::waves(24, Wrap::Clamp), 0.3, 0.5);
    let rays = rays::in_plane(&surface, [-0.1, 0.1], 13);
    judge([
        upright,
        Case::new("the same, slanted normals", &surface, rays),
    ]);
}

#[test]
fn rays_along_normals() {
    let meshes = [
        ("along normals, flat", flat(3)),
        ("along normals, bent", bent(3)),
        ("along normals, leaning", leaning(bent(3), 0.3, 6)),
    ];
    judge(meshes.map(|(name, mesh)| {
        let surface = displaced(mesh, maps::white(20, 20, Wrap::Mirror), 0.1, 0.3);
        let rays = rays::along_normals(&surface, 14);
        Case::new(name, &surface, rays)
    }));
}

#[test]
fn rays_through_vertices_and_edges() {
    let meshes = [
        ("through edges, flat", flat(4)),
        ("through edges, torus", torus(8)),
        ("through edges, leaning", leaning(bent(4), 0.3, 7)),
    ];
    judge(meshes.map(|(name, mesh)| {
        let surface = displaced(mesh, maps::waves(24, Wrap::Repeat), 0.1, 0.3);
        let rays = rays::through_edges(&surface, 15);
        Case::new(name, &surface, rays)
    }));
}
