//! Pictures of displaced surfaces are as bright as they should be: held to a path tracer in f64 over the surface cut into flat triangles.
// Shading knows nothing of Embree: one lane, that without it, holds it to the reference, in half a minute.
#![cfg(all(feature = "bvh", not(feature = "embree")))]

#[path = "light/reference.rs"]
mod reference;
#[path = "light/scenes.rs"]
mod scenes;

use glam::DVec3;
use prismarch::surface::ShadingNormals;
use reference::{Facets, Lamp, Matter};
use scenes::{Case, Look, case, demo, mean};

/// Paths of the reference; the 48x48 pixels of a picture have as many samples together, and a few more.
const PATHS: u32 = 70_000;
const SPP: u32 = 32;

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

/// So large that paths find it by themselves.
const CEILING: Lamp = Lamp::Rectangle {
    corner: DVec3::new(-9.0, 4.0, -9.0),
    edges: [DVec3::new(18.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 18.0)],
    radiance: 1.0,
};

const BEHIND: Lamp = Lamp::Rectangle {
    corner: DVec3::new(-9.0, -9.0, -5.0),
    edges: [DVec3::new(18.0, 0.0, 0.0), DVec3::new(0.0, 18.0, 0.0)],
    radiance: 1.0,
};

/// Holds the pictures of a case to the reference: the one by the surface's own normals within 1 %, the one by smooth normals
/// within `most`.
fn hold(name: &str, matter: Matter, lamp: Lamp, most: f64) {
    hold_lit(name, matter, (lamp, false), most);
}

/// The same; the lamp may be a mesh that shines.
fn hold_lit(name: &str, matter: Matter, (lamp, is_mesh): (Lamp, bool), most: f64) {
    let case @ Case { eye, fov, cuts, .. } = &case(name);
    let facets = Facets::new(&case.surface, *cuts);
    let [truth, error] = facets.mean(eye.as_dvec3(), f64::from(*fov), matter, lamp, PATHS);
    // Three standard deviations of the quotient: the picture's are no larger than the reference's.
    let noise = 3.0 * 2.0_f64.sqrt() * error / truth;
    let look = Look {
        matter,
        lamp,
        is_mesh,
        spp: SPP,
    };
    for (normals, most) in [
        (ShadingNormals::Geometric, 0.01),
        (ShadingNormals::Smooth, most),
    ] {
        let off = mean(case, &look, normals) / truth - 1.0;
        println!(
            "{name}, {}: {:+.2} % of {truth:.4} (noise {:.2} %)",
            normals.name(),
            100.0 * off,
            100.0 * noise / 3.0
        );
        assert!(
            off.abs() < most + noise,
            "{name}, {}: {off:+.4} of {truth}, allowed are {most}",
            normals.name()
        );
    }
}

#[test]
fn soft_maps_on_flat_bases() {
    hold("flat, soft", CHALK, Lamp::Sky, 0.01);
    hold("flat, soft", CHALK, aside(), 0.01);
}

#[test]
fn soft_maps_on_curved_bases() {
    hold("curved, soft", CHALK, Lamp::Sky, 0.01);
    hold("curved, soft", CHALK, in_front(), 0.01);
    hold("curved, soft", CHALK, aside(), 0.01);
}

#[test]
fn soft_maps_on_coarse_bases() {
    hold("coarse, soft", CHALK, Lamp::Sky, 0.01);
    // The light is another where a face of 36 degrees is taken for a part of a sphere; there is as much of it in all.
    hold("coarse, soft", CHALK, in_front(), 0.015);
    hold("coarse, soft", CHALK, aside(), 0.015);
}

#[test]
fn noise_of_the_size_of_texels() {
    hold("flat, noise", CHALK, Lamp::Sky, 0.03);
    hold("flat, noise", CHALK, aside(), 0.03);
    hold("curved, noise", CHALK, Lamp::Sky, 0.03);
    hold("curved, noise", CHALK, aside(), 0.03);
}

#[test]
fn the_same_noise_in_more_texels() {
    hold("flat, noise in 16x16 texels", CHALK, Lamp::Sky, 0.01);
    hold("flat, noise in 16x16 texels", CHALK, aside(), 0.01);
}

#[test]
fn lamps_of_every_kind() {
    hold("curved, soft", CHALK, POINT, 0.01);
    hold_lit("curved, soft", CHALK, (SQUARE, false), 0.01);
    hold_lit("curved, soft", CHALK, (SQUARE, true), 0.01);
}

#[test]
fn metals_and_glass() {
    let metal = |alpha| Matter::Metal {
        alpha,
        reflectance: 0.9,
    };
    hold("curved, soft", metal(0.16), Lamp::Sky, 0.01);
    hold("curved, soft", metal(0.5), Lamp::Sky, 0.01);
    hold("curved, soft", metal(0.16), CEILING, 0.01);
    hold("curved, soft", Matter::Glass { index: 1.5 }, BEHIND, 0.01);
}

/// Of as many texels as demos have no reference can be cut: smooth normals are held to the surface's own, which all else here holds.
/// Both pictures have the same random numbers, so most of the noise is the same.
#[test]
fn demos() {
    // Rings on a coarse cloth: what smoothing the cloth moves is more than elsewhere.
    for (name, most) in [("asteroid", 0.01), ("stump", 0.01), ("chainmail", 0.016)] {
        let case = demo(name);
        for (light, lamp) in [("sky", Lamp::Sky), ("sun in front", in_front())] {
            let look = Look {
                matter: CHALK,
                lamp,
                is_mesh: false,
                spp: SPP,
            };
            let [own, smooth] = [ShadingNormals::Geometric, ShadingNormals::Smooth]
                .map(|normals| mean(&case, &look, normals));
            let off = smooth / own - 1.0;
            println!("{name}, {light}: {:+.2} % of {own:.4}", 100.0 * off);
            assert!(off.abs() < most, "{name}, {light}: {smooth} for {own}");
        }
    }
}
