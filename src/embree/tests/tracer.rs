use glam::{Affine3A, Vec2};

use super::*;
use crate::embree::{EmbreeError, EmbreeOptions, EmbreeTracer};
use crate::prism::{March, Prisms, Step};
use crate::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, UvTransform,
    Wrap,
};
use crate::trace::{INVALID_ID, Object, Placement, Shape, Tracer, World};

/// The square (0, 0) .. (1, 1) at z = 0, facing up.
fn square() -> MeshBuilder {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    MeshBuilder {
        positions: corners.map(|c| c.extend(0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        texcoords: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// The square, lifted by half a unit everywhere.
fn lifted() -> Shape {
    let mesh = Arc::new(square().build(NormalMode::File).unwrap().0);
    let map = DisplacementMap::new(2, 2, Texels::U8(vec![255; 4]), Wrap::Repeat).unwrap();
    let displacement = Displacement {
        scale: 0.5,
        midlevel: 0.0,
        uv: UvTransform::default(),
    };
    let surface = DisplacedSurface::new(mesh, Arc::new(map), displacement).unwrap();
    let march = March::Uniform {
        step: Step::Texels(0.25),
        jitter: false,
    };
    Shape::Displaced(Arc::new(Prisms::new(Arc::new(surface), march).unwrap()))
}

fn flat() -> Shape {
    Shape::Triangles(Arc::new(square().build(NormalMode::File).unwrap().0))
}

fn shifted(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::X * x)
}

/// Top-level ids 0 .. 4 stand at x = 0, 2, 4, 6, 8.
fn world() -> World {
    let object = |shape, placement, mask| Object {
        shape,
        placement,
        mask,
    };
    let far = MeshBuilder {
        positions: square()
            .positions
            .iter()
            .map(|p| *p + 8.0 * Vec3::X)
            .collect(),
        ..square()
    };
    let far = Shape::Triangles(Arc::new(far.build(NormalMode::File).unwrap().0));
    let instances = |xs: [f32; 2]| Placement::Instances(xs.map(shifted).to_vec());
    World::new(vec![
        object(lifted(), Placement::World, 0b1),
        object(flat(), Placement::Instances(Vec::new()), u32::MAX),
        object(lifted(), instances([2.0, 4.0]), 0b10),
        object(flat(), Placement::Instances(vec![shifted(6.0)]), 0b100),
        object(far, Placement::World, u32::MAX),
    ])
}

/// Straight down from z = 2 onto the middle of what stands at `x`, off the diagonal.
fn down(x: f32) -> Ray {
    Ray::new(Vec3::new(x + 0.6, 0.3, 2.0), -Vec3::Z)
}

#[test]
fn ids_follow_the_world_and_resolve() {
    let world = world();
    let tracer = EmbreeTracer::new(&world, &EmbreeOptions::default()).unwrap();
    // (x, t, geom, inst, object)
    let expected = [
        (0.0, 1.5, 0, INVALID_ID, 0),
        (2.0, 1.5, 0, 1, 2),
        (4.0, 1.5, 0, 2, 2),
        (6.0, 2.0, 0, 3, 3),
        (8.0, 2.0, 4, INVALID_ID, 4),
    ];
    for (x, t, geom, inst, object) in expected {
        let hit = tracer.intersect(&down(x)).unwrap();
        assert!((hit.t - t).abs() < 1e-5, "{hit:?}");
        assert_eq!((hit.geom, hit.inst, hit.prim), (geom, [inst], 0), "at {x}");
        assert!(hit.ng.distance(Vec3::Z) < 1e-5);
        assert!(tracer.occluded(&down(x)));
        let resolved = world.resolve(&hit);
        assert_eq!(resolved.object, object);
        assert_eq!(
            resolved.transform.copied(),
            (inst != INVALID_ID).then(|| shifted(x))
        );
    }
    assert_eq!(tracer.check(), Ok(()));
}

#[test]
fn masks_of_objects_hold_for_all_their_placements() {
    let tracer = EmbreeTracer::new(&world(), &EmbreeOptions::default()).unwrap();
    for (x, bit) in [(0.0, 0b1), (2.0, 0b10), (4.0, 0b10), (6.0, 0b100)] {
        for mask in [0b1, 0b10, 0b100] {
            let ray = Ray { mask, ..down(x) };
            assert_eq!(tracer.intersect(&ray).is_some(), mask == bit, "{x} {mask}");
            assert_eq!(tracer.occluded(&ray), mask == bit, "{x} {mask}");
        }
    }
}

#[test]
fn it_tells_its_name_bounds_and_bytes() {
    let options = EmbreeOptions {
        threads: 1,
        ..EmbreeOptions::default()
    };
    let tracer = EmbreeTracer::new(&world(), &options).unwrap();
    assert!(tracer.name().starts_with("embree "), "{}", tracer.name());
    assert!(tracer.bvh_bytes() > 0);
    let bounds = tracer.bounds();
    assert!(bounds.min.distance(Vec3::ZERO) < 1e-3, "{bounds:?}");
    assert!(
        bounds.max.distance(Vec3::new(9.0, 1.0, 0.5)) < 1e-3,
        "{bounds:?}"
    );
}

#[test]
fn an_empty_world_is_traced() {
    let tracer = EmbreeTracer::new(&World::default(), &EmbreeOptions::default()).unwrap();
    assert_eq!(tracer.intersect(&down(0.0)), None);
    assert_eq!(tracer.bounds(), Aabb::EMPTY);
}

#[test]
fn a_world_that_does_not_fit_is_refused() {
    let options = EmbreeOptions {
        memory_limit: Some(100),
        ..EmbreeOptions::default()
    };
    let error = EmbreeTracer::new(&world(), &options).err().unwrap();
    assert_eq!(error, EmbreeError::MemoryLimit { limit: 100 });
}
