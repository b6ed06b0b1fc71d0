//! Numbers up to what a float holds: every world is traced or refused, no ray ends the program, and both backends say the same.
#![cfg(all(feature = "embree", feature = "bvh"))]

use std::sync::Arc;

use glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};
use prismarch::bvh::{BvhError, BvhTracer};
use prismarch::embree::{EmbreeError, EmbreeOptions, EmbreeTracer};
use prismarch::prism::{March, Prisms};
use prismarch::ray::{MAX_COORDINATE, Ray, RayPacket};
use prismarch::surface::{
    BaseMesh, DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, MeshError, NormalMode,
    SurfaceError, Texels, Wrap,
};
use prismarch::trace::{Object, Placement, Shape, Tracer, World, WorldError};
use proptest::prelude::*;

/// A square around the origin in the plane z = 0, `size` from the middle to a side.
fn square(size: f32) -> MeshBuilder {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from);
    MeshBuilder {
        positions: corners.iter().map(|c| size * c.extend(0.0)).collect(),
        texcoords: corners.iter().map(|c| 0.5 + 0.5 * c).collect(),
        normals: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

fn mesh(size: f32) -> Result<Arc<BaseMesh>, MeshError> {
    let (mesh, _) = square(size).build(NormalMode::File)?;
    Ok(Arc::new(mesh))
}

fn surface(
    size: f32,
    heights: [f32; 4],
    scale: f32,
) -> Result<Arc<DisplacedSurface>, SurfaceError> {
    let map = DisplacementMap::new(2, 2, Texels::F32(heights.to_vec()), Wrap::Clamp).unwrap();
    let mesh = mesh(size).unwrap();
    DisplacedSurface::new(mesh, Arc::new(map), Displacement::new(scale)).map(Arc::new)
}

fn prisms(size: f32, scale: f32) -> Shape {
    let surface = surface(size, [0.0, 1.0, 0.5, 0.25], scale).unwrap();
    Shape::Displaced(Arc::new(Prisms::new(surface, March::Exact).unwrap()))
}

fn object(shape: Shape, placement: Placement) -> Object {
    Object {
        shape,
        placement,
        mask: u32::MAX,
    }
}

/// Both backends, or the same error from both.
fn both(world: &World) -> Result<(EmbreeTracer, BvhTracer), WorldError> {
    let embree = EmbreeTracer::new(world, &EmbreeOptions::default());
    match (embree, BvhTracer::new(world)) {
        (Ok(embree), Ok(bvh)) => Ok((embree, bvh)),
        (Err(EmbreeError::World { source: one }), Err(BvhError::World { source: other })) => {
            // In words: NaN is not itself.
            assert_eq!(one.to_string(), other.to_string());
            Err(one)
        }
        (embree, bvh) => panic!("{:?} {:?}", embree.err(), bvh.err()),
    }
}

/// Asks both about a ray, alone and in a packet; whether Embree hits.
fn ask((embree, bvh): &(EmbreeTracer, BvhTracer), ray: &Ray) -> bool {
    let hit = embree.intersect(ray);
    for tracer in [embree as &dyn Tracer, bvh] {
        let hit = tracer.intersect(ray);
        assert_eq!(tracer.occluded(ray), hit.is_some(), "{ray:?} {hit:?}");
        if let Some(hit) = hit {
            // Embree's own triangles take the ends of the interval, too.
            assert!(ray.tnear <= hit.t && hit.t <= ray.tfar, "{ray:?} {hit:?}");
        }
        // An untraceable lane is an empty one, and changes nothing of the others.
        let level = Ray::new(Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z);
        let beyond = Ray::new(Vec3::splat(1e19), Vec3::X);
        let rays = [&level, ray, &beyond, &level, ray, &level, ray];
        let packet = RayPacket::from_rays(rays);
        let (hits, bits) = (tracer.intersect8(&packet), tracer.occluded8(&packet));
        for (lane, ray) in rays.into_iter().enumerate() {
            let alone = tracer.intersect(ray).is_some();
            assert_eq!(hits[lane].is_some(), alone, "{ray:?}");
            assert_eq!(bits >> lane & 1 == 1, alone, "{ray:?}");
        }
    }
    hit.is_some()
}

/// The same where both backends must agree: on prisms, whose hit test is the same, and on triangles that are not seen edge-on or
/// from where they are smaller than a rounding.
fn agree(tracers: &(EmbreeTracer, BvhTracer), ray: &Ray) -> bool {
    let hit = tracers.0.intersect(ray);
    let other = tracers.1.intersect(ray);
    assert_eq!(hit.is_some(), other.is_some(), "{ray:?} {hit:?} {other:?}");
    if let (Some(hit), Some(other)) = (hit, other) {
        let apart = (hit.t - other.t).abs();
        assert!(apart <= 1e-5 * hit.t, "{ray:?} {hit:?} {other:?}");
    }
    ask(tracers, ray)
}

/// A number of any size, and odd ones.
fn any_number() -> impl Strategy<Value = f32> {
    let sized = (-45f32..39.0, any::<bool>()).prop_map(|(e, minus)| {
        let x = 10f32.powf(e);
        if minus { -x } else { x }
    });
    let odd = prop::sample::select(vec![
        0.0,
        -0.0,
        1.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        MAX_COORDINATE,
        -MAX_COORDINATE,
        1.844e18,
        1.9e18,
        f32::from_bits(1),
    ]);
    prop_oneof![4 => sized, 1 => odd]
}

fn any_vec3() -> impl Strategy<Value = Vec3> {
    [any_number(), any_number(), any_number()].prop_map(Vec3::from)
}

/// A ray from anywhere; half of them aimed near the origin.
fn any_ray() -> impl Strategy<Value = Ray> {
    let interval = prop_oneof![
        3 => Just((0.0, f32::INFINITY)),
        1 => (any_number(), any_number()),
    ];
    let aimed = prop::option::of(-45f32..20.0);
    (any_vec3(), any_vec3(), aimed, interval).prop_map(|(origin, direction, aimed, interval)| {
        let direction = match aimed {
            Some(length) => -origin.normalize_or(Vec3::Z) * 10f32.powf(length),
            None => direction,
        };
        let (tnear, tfar) = interval;
        Ray {
            tnear,
            tfar,
            ..Ray::new(origin, direction)
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { max_shrink_iters: 60, failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    #[test]
    fn no_ray_is_too_much(rays in prop::collection::vec(any_ray(), 32)) {
        let one = |shape| both(&World::new(vec![object(shape, Placement::World)])).unwrap();
        let displaced = one(prisms(1.0, 0.3));
        let plain = one(Shape::Triangles(mesh(1.0).unwrap()));
        for ray in &rays {
            let hits = [agree(&displaced, ray), ask(&plain, ray)];
            prop_assert!(ray.is_valid() || hits == [false; 2]);
        }
    }

    #[test]
    fn no_instance_is_too_much(
        scale in any_vec3(), uniform in any::<bool>(), turn in [0f32..6.0, 0f32..6.0, 0f32..6.0],
        translation in any_vec3(), moved in any::<bool>(), rays in prop::collection::vec(any_ray(), 32),
    ) {
        let scale = if uniform { Vec3::splat(scale.x) } else { scale };
        let translation = if moved { translation } else { Vec3::ZERO };
        let turn = Quat::from_euler(EulerRot::XYZ, turn[0], turn[1], turn[2]);
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, translation);
        let worlds = [prisms(1.0, 0.3), Shape::Triangles(mesh(1.0).unwrap())].map(|shape| {
            let instances = Placement::Instances(vec![Affine3A::IDENTITY, transform]);
            World::new(vec![object(shape, instances)])
        });
        for world in worlds {
            let Ok(tracers) = both(&world) else { continue };
            let reach = world.ray_reach().unwrap();
            for ray in &rays {
                prop_assert!(!ask(&tracers, ray) || reach.admits(ray));
                // From around, where there is something to be hit.
                let origin = translation + 3.0 * scale.abs().max_element() * ray.origin.normalize_or(Vec3::Z);
                ask(&tracers, &Ray::new(origin, translation - origin));
            }
        }
    }

    #[test]
    fn no_mesh_is_too_much(size in any_number(), scale in any_number(), rays in prop::collection::vec(any_ray(), 16)) {
        let Ok(mesh) = mesh(size) else { return Ok(()) };
        let map = DisplacementMap::new(2, 2, Texels::U8(vec![0, 255, 128, 64]), Wrap::Clamp).unwrap();
        let displaced = DisplacedSurface::new(mesh.clone(), Arc::new(map), Displacement::new(scale));
        let Ok(displaced) = displaced else { return Ok(()) };
        let prisms = Prisms::new(Arc::new(displaced), March::Exact).unwrap();
        let world = World::new(vec![
            object(Shape::Displaced(Arc::new(prisms)), Placement::World),
            object(Shape::Triangles(mesh), Placement::World),
        ]);
        let Ok(tracers) = both(&world) else { return Ok(()) };
        for ray in &rays {
            ask(&tracers, ray);
            let origin = 2.0 * size.abs().max(scale.abs()) * ray.origin.normalize_or(Vec3::Z);
            ask(&tracers, &Ray::new(origin, -origin));
        }
    }
}

/// Directions of any length meet what those of length 1 meet.
#[test]
fn only_the_line_counts() {
    let world = World::new(vec![object(prisms(1.0, 0.3), Placement::World)]);
    let tracers = both(&world).unwrap();
    let down = Vec3::new(0.1, 0.05, -1.0);
    for exponent in -45..=18 {
        let ray = Ray::new(Vec3::new(0.0, 0.0, 1e-3 + 0.5), down * 10f32.powi(exponent));
        // Beyond 3.4e38 there is no t.
        assert_eq!(agree(&tracers, &ray), exponent >= -38, "1e{exponent}");
    }
    let far = |z: f32| Ray::new(Vec3::new(0.1, 0.2, z), Vec3::NEG_Z);
    assert!(agree(&tracers, &far(1.7e18)) && agree(&tracers, &far(MAX_COORDINATE)));
    assert!(!ask(&tracers, &far(1.9e18)) && !ask(&tracers, &far(1e19)));
}

/// The search for the nearest point ends wherever it starts, and finds what is there from as far as rays come.
#[test]
fn no_point_is_too_far() {
    let world = |placement| World::new(vec![object(prisms(1.0, 0.3), placement)]);
    let instances = [1e-3, 1.0, 1e9].map(|x| Affine3A::from_scale(Vec3::splat(x)));
    for placement in [Placement::World, Placement::Instances(instances.to_vec())] {
        let (embree, _) = both(&world(placement)).unwrap();
        for exponent in -45..=38 {
            let point = Vec3::new(0.3, -1.0, 2.0) * 10f32.powi(exponent);
            for radius in [f32::INFINITY, f32::MAX, 10f32.powi(exponent), 0.0] {
                let found = embree.scene().closest(point, radius);
                assert!(found.is_none_or(|found| found.distance <= radius));
                if exponent <= 17 && radius >= f32::MAX {
                    assert!(found.is_some(), "1e{exponent} {radius}");
                }
            }
        }
        for odd in [f32::NAN, f32::INFINITY] {
            assert_eq!(embree.scene().closest(Vec3::splat(odd), f32::MAX), None);
        }
    }
}

/// A scene of any size is the same scene. Embree's own triangles are held to sizes whose cubes are numbers.
#[test]
fn only_the_shape_counts() {
    let of_size = |plain: bool, size: f32| match plain {
        true => Shape::Triangles(mesh(size).unwrap()),
        false => prisms(size, 0.3 * size),
    };
    let plain = (-9..=11).map(|exponent| (true, exponent));
    let displaced = (-36..=17).map(|exponent| (false, exponent));
    for (plain, exponent) in plain.chain(displaced) {
        let size = 10f32.powi(exponent);
        let shape = of_size(plain, size);
        let tracers = both(&World::new(vec![object(shape, Placement::World)])).unwrap();
        for k in 0..100 {
            let at = Vec2::new((k % 10) as f32 / 5.0 - 0.87, (k / 10) as f32 / 5.0 - 0.9);
            let origin = size * Vec3::new(0.3, -0.2, 2.0);
            let ray = Ray::new(origin, size * at.extend(0.0) - origin);
            assert!(agree(&tracers, &ray), "{plain} 1e{exponent} {at}");
        }
    }
}

#[test]
fn worlds_beyond_the_limit_are_refused_with_their_object() {
    let inside = || object(prisms(1.0, 0.3), Placement::World);
    let instanced = |transform| {
        let transforms = vec![Affine3A::IDENTITY, transform];
        World::new(vec![
            inside(),
            object(prisms(1.0, 0.3), Placement::Instances(transforms)),
        ])
    };
    let scaled = |x: f32| both(&instanced(Affine3A::from_scale(Vec3::splat(x)))).err();
    for x in [1e-30, 1e-19, 1e-13, 1e13, 1e30] {
        let refused = scaled(x).unwrap();
        let transform = matches!(
            refused,
            WorldError::Transform {
                object: 1,
                instance: 1,
                ..
            }
        );
        assert!(transform, "{x}: {refused}");
    }
    let far = both(&instanced(Affine3A::from_translation(Vec3::X * 1e19))).err();
    assert_eq!(far.map(|e| e.object()), Some(1));
    // Small things are fine among themselves, not beside what is out of their own space.
    assert_eq!(scaled(1e-11), None);
    let large = object(prisms(1e7, 1.0), Placement::World);
    let small = Placement::Instances(vec![Affine3A::from_scale(Vec3::splat(1e-11))]);
    let mixed = World::new(vec![large, object(prisms(1.0, 0.3), small)]);
    assert!(matches!(
        both(&mixed),
        Err(WorldError::Surroundings {
            object: 1,
            instance: Some(0),
            ..
        })
    ));
    for exponent in [13, 17] {
        let plain = Shape::Triangles(mesh(10f32.powi(exponent)).unwrap());
        assert!(matches!(
            both(&World::new(vec![inside(), object(plain, Placement::World)])),
            Err(WorldError::Surroundings {
                object: 1,
                instance: None,
                ..
            })
        ));
    }
    // Neither the mesh nor the heights are too much, but both together are.
    let high = World::new(vec![
        inside(),
        object(prisms(1.5e18, 1.5e18), Placement::World),
    ]);
    let tracers = both(&high);
    assert!(tracers.is_ok(), "{:?}", tracers.err());
    let long = prisms(1e18, 1.0);
    let stretched = Placement::Instances(vec![Affine3A::from_scale(Vec3::splat(4.0))]);
    assert!(matches!(
        both(&World::new(vec![object(long, stretched)])),
        Err(WorldError::Placed {
            object: 0,
            instance: 0,
            ..
        })
    ));
}

#[test]
fn heights_beyond_the_limit_name_their_texel() {
    let refused = surface(1.0, [0.0, 1.0, -3.402_823_5e38, 0.0], 1.0).unwrap_err();
    assert!(
        matches!(refused, SurfaceError::TooHigh { x: 0, y: 1, height, .. } if height == f32::MIN),
        "{refused}"
    );
    let refused = surface(1.0, [0.0, 0.5, 0.0, 0.0], 1e19).unwrap_err();
    assert!(matches!(refused, SurfaceError::TooHigh { x: 1, y: 0, .. }));
    assert!(surface(1.0, [0.0, 1.7e18, 0.0, 0.0], 1.0).is_ok());
    assert!(matches!(
        mesh(1e30),
        Err(MeshError::TooFar { vertex: 0, .. })
    ));
}
