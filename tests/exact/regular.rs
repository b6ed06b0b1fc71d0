//! Meshes and maps as artists make them.

use std::f32::consts::FRAC_PI_3;
use std::sync::Arc;

use glam::Vec2;
use prismarch::surface::{DisplacedSurface, MeshBuilder, UvTransform, Wrap};

use super::common::scene;
use super::judge::{Case, judge, judge_plane};
use super::meshes::{bent, displaced, flat, leaning, remapped, torus, with_uv};
use super::{maps, rays};

fn sphere(subdivisions: u32) -> MeshBuilder {
    let mesh = scene::sphere(subdivisions);
    MeshBuilder {
        positions: mesh.positions().to_vec(),
        normals: mesh.normals().to_vec(),
        texcoords: mesh.texcoords().to_vec(),
        triangles: mesh.triangles().to_vec(),
    }
}

fn case(name: &'static str, surface: Arc<DisplacedSurface>) -> Case {
    let rays = rays::mixed(&surface, 1);
    Case::new(name, &surface, rays)
}

fn mixed(name: &'static str, surface: Arc<DisplacedSurface>) {
    judge([case(name, surface)]);
}

#[test]
fn sphere_of_waves() {
    let map = maps::waves(64, Wrap::Repeat);
    mixed("sphere of waves", displaced(sphere(2), map, 0.3, 0.0));
}

#[test]
fn sphere_of_noise_inward() {
    let map = maps::white(48, 24, Wrap::Repeat);
    mixed(
        "sphere of noise, inward",
        displaced(sphere(1), map, -0.15, 0.0),
    );
}

#[test]
fn torus_on_two_sides() {
    let map = maps::waves(40, Wrap::Repeat);
    mixed("torus, two-sided", displaced(torus(12), map, 0.3, 0.5));
}

#[test]
fn bent_sheet() {
    let map = maps::white(24, 24, Wrap::Clamp);
    mixed("bent sheet of noise", displaced(bent(4), map, 0.1, 0.0));
}

#[test]
fn leaning_normals() {
    let map = maps::waves(32, Wrap::Mirror);
    let mesh = leaning(sphere(1), 0.2, 3);
    mixed(
        "normals leaning to n.Ng 0.2",
        displaced(mesh, map, 0.15, 0.2),
    );
}

#[test]
fn folded_normals() {
    let map = maps::waves(24, Wrap::Repeat);
    let mesh = leaning(bent(4), -0.4, 4);
    mixed("some n.Ng below 0", displaced(mesh, map, 0.1, 0.3));
}

#[test]
fn comb_of_spikes() {
    mixed(
        "comb of spikes",
        displaced(bent(3), maps::comb(48), 0.12, 0.0),
    );
}

#[test]
fn white_noise_on_a_plane() {
    let map = maps::white(32, 32, Wrap::Clamp);
    mixed("white noise on a plane", displaced(flat(2), map, 0.2, 0.5));
}

#[test]
fn constant_on_a_sphere() {
    mixed(
        "constant on a sphere",
        displaced(sphere(2), maps::constant(1.0), 0.2, 0.0),
    );
}

#[test]
fn constant_on_a_plane() {
    let case = case(
        "constant on a plane",
        displaced(flat(3), maps::constant(0.75), 0.4, 0.25),
    );
    judge_plane(&case, 0.2);
    judge([case]);
}

#[test]
fn ramp_on_a_sheet() {
    mixed(
        "ramp on a bent sheet",
        displaced(bent(3), maps::ramp(16), 0.4, 0.0),
    );
}

#[test]
fn uv_transform() {
    let uv = UvTransform {
        scale: Vec2::new(1.5, -0.7),
        rotation: FRAC_PI_3,
        offset: Vec2::new(0.3, 17.2),
    };
    let map = maps::white(16, 20, Wrap::Mirror);
    mixed("turned texture", with_uv(bent(3), map, 0.1, 0.0, uv));
}

#[test]
fn many_repeats() {
    let modes = [
        ("9 repeats", Wrap::Repeat),
        ("9 repeats clamped", Wrap::Clamp),
        ("9 repeats mirrored", Wrap::Mirror),
    ];
    judge(modes.map(|(name, wrap)| {
        let mesh = remapped(bent(2), 9.0, 0.4);
        case(name, displaced(mesh, maps::white(4, 5, wrap), 0.06, 0.0))
    }));
}

#[test]
fn kinds_of_texels() {
    judge([
        case(
            "8-bit map",
            displaced(bent(3), maps::white_8_bit(20), 0.1, 0.0),
        ),
        case(
            "float map",
            displaced(bent(3), maps::white_float(20), 0.02, 1.0),
        ),
    ]);
}

#[test]
fn maps_of_one_row_or_column_or_texel() {
    let sizes = [("1xN map", 1, 30), ("Nx1 map", 30, 1), ("1x1 map", 1, 1)];
    for wrap in [Wrap::Repeat, Wrap::Mirror] {
        judge(sizes.map(|(name, width, height)| {
            let mesh = remapped(bent(2), 1.0, 0.2);
            let map = maps::white(width, height, wrap);
            case(name, displaced(mesh, map, 0.1, 0.0))
        }));
    }
}
