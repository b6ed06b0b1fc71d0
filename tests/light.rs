//! Pictures of displaced surfaces are as bright as they should be: held to a path tracer in f64 over the surface cut into flat triangles.
#![cfg(feature = "bvh")]

#[path = "light/reference.rs"]
mod reference;
#[path = "light/scenes.rs"]
mod scenes;

use glam::DVec3;
use prismarch::surface::ShadingNormals;
use reference::{Facets, Lamp, Matter};
use scenes::{Case, Look, case, mean};

const CHALK: Matter = Matter::Chalk(0.8);

fn sun(to: DVec3) -> Lamp {
    Lamp::Sun {
        to: to.normalize(),
        irradiance: 3.0,
    }
}

fn in_front() -> Lamp {
    sun(DVec3::new(0.6, 0.7, 0.4))
}

fn aside() -> Lamp {
    sun(DVec3::new(-0.8, 0.4, 0.3))
}

const POINT: Lamp = Lamp::Point {
    at: DVec3::new(1.5, 2.0, 1.0),
    intensity: 5.0,
};

const SQUARE: Lamp = Lamp::Rectangle {
    corner: DVec3::new(-2.0, 3.0, -1.0),
    edges: [DVec3::new(3.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 3.0)],
    radiance: 2.0,
};

/// What normals of each kind make of a picture, over the reference, less 1; the surface's own and the smooth ones.
fn off(name: &str, matter: Matter, lamp: Lamp, is_mesh: bool) -> [f64; 2] {
    let case @ Case { eye, fov, cuts, .. } = &case(name);
    let facets = Facets::new(&case.surface, *cuts);
    let paths = 150_000;
    let truth = facets.mean(eye.as_dvec3(), f64::from(*fov), matter, lamp, paths);
    let look = Look {
        matter,
        lamp,
        is_mesh,
        spp: 64,
    };
    let kinds = [
        ShadingNormals::Geometric,
        ShadingNormals::Smooth,
        ShadingNormals::Paper,
    ];
    let off = kinds.map(|normals| mean(case, &look, normals) / truth - 1.0);
    println!(
        "{name} {truth:.4} {:+.2} {:+.2} {:+.2}",
        100.0 * off[0],
        100.0 * off[1],
        100.0 * off[2]
    );
    [off[0], off[1]]
}
#[test]
fn a() {
    for n in [
        "flat, noise",
        "flat, noise in 16x16 texels",
        "flat, soft",
        "curved, noise",
        "curved, soft",
        "coarse, soft",
    ] {
        off(n, CHALK, Lamp::Sky, false);
        off(n, CHALK, in_front(), false);
        off(n, CHALK, aside(), false);
    }
}
#[test]
fn b() {
    let n = "curved, soft";
    println!("b");
    off(n, CHALK, POINT, false);
    off(n, CHALK, SQUARE, false);
    off(n, CHALK, SQUARE, true);
    println!("metal");
    off(
        n,
        Matter::Metal {
            alpha: 0.16,
            reflectance: 0.9,
        },
        SQUARE,
        false,
    );
    off(
        n,
        Matter::Metal {
            alpha: 0.16,
            reflectance: 0.9,
        },
        Lamp::Sky,
        false,
    );
    println!("glass");
    off(n, Matter::Glass { index: 1.5 }, SQUARE, false);
    off(n, Matter::Glass { index: 1.5 }, Lamp::Sky, false);
}
