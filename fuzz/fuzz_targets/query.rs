//! Any mesh, any map, any ray: what the builders accept is traced without a panic, in bounded time, and every hit is a hit.
//! The map is edited in between. With FUZZ_SHOW in the environment everything is printed first.
#![no_main]

mod input;

use std::sync::Arc;

use input::Input;
use libfuzzer_sys::fuzz_target;
use prismarch::bvh::BvhTracer;
use prismarch::prism::{PrismHit, Prisms, SimdLevel};
use prismarch::ray::{Aabb, Ray, RayPacket};
use prismarch::surface::{DisplacedSurface, DisplacementMap, NormalMode};
use prismarch::trace::{Object, Shape, Tracer, World};

fuzz_target!(|bytes: &[u8]| {
    let mut input = Input(bytes);
    let _ = run(&mut input);
});

/// Prints what a crash was made from.
fn show(what: &dyn std::fmt::Debug) {
    if std::env::var_os("FUZZ_SHOW").is_some() {
        eprintln!("{what:?}");
    }
}

/// `None` where a builder refuses.
fn run(input: &mut Input) -> Option<()> {
    let mode = match input.byte() % 3 {
        0 => NormalMode::Smooth {
            crease_angle: input.number(),
        },
        _ => NormalMode::File,
    };
    let mesh = input.mesh();
    show(&(mode, &mesh));
    let (mesh, _) = mesh.build(mode).ok()?;
    let (width, height, wrap) = (input.side(), input.side(), input.wrap());
    let kind = input.byte();
    let texels = input.texels(kind, width * height);
    show(&(width, height, wrap, &texels));
    let map = Arc::new(DisplacementMap::new(width, height, texels, wrap).ok()?);
    let displacement = input.displacement();
    let surface = DisplacedSurface::new(Arc::new(mesh), map.clone(), displacement).ok()?;
    let surface = Arc::new(surface);
    let (options, spread) = (input.options(), input.spread());
    show(&(displacement, options, spread));

    let mut both = Vec::new();
    for level in [SimdLevel::Baseline, SimdLevel::Avx2] {
        let prisms = Prisms::new(surface.clone(), options).ok()?;
        prisms.set_spread(spread);
        both.extend(prisms.with_simd(level).map(Arc::new));
    }
    let placement = input.placement();
    show(&placement);
    let world = World::new(vec![Object {
        shape: Shape::Displaced(both[0].clone()),
        placement,
        mask: u32::MAX,
    }]);
    let mut tracer = BvhTracer::new(&world).ok();
    for _ in 0..3 {
        for k in 0..4 {
            let ray = input.ray();
            show(&ray);
            both.iter().for_each(|prisms| ask(prisms, &ray));
            if k == 0 {
                let beam = input.beam(&ray);
                show(&beam);
                both.iter().for_each(|prisms| ask_together(prisms, &beam));
            }
            if let Some(tracer) = &tracer {
                let hit = tracer.intersect(&ray);
                assert_eq!(tracer.occluded(&ray), hit.is_some(), "{ray:?} {hit:?}");
                if let Some(hit) = hit {
                    check(&both[0], &ray, hit.prim, [hit.t, hit.u, hit.v], hit.ng);
                    let point = world.surface_point(&hit);
                    assert!(!point.position.is_nan(), "{ray:?} {hit:?} {point:?}");
                }
            }
        }
        if input.is_empty() {
            return Some(());
        }
        let rect = input.rect(width, height);
        let texels = input.texels(kind, rect.width * rect.height);
        show(&(rect, &texels));
        if map.update(rect, &texels).is_ok() {
            for prisms in &both {
                prisms.map_edited(rect);
                assert_hold(prisms, &surface);
            }
            tracer = tracer.and_then(|mut tracer| {
                let edited = tracer.map_edited(&world, &map, rect);
                edited.is_ok().then_some(tracer)
            });
        }
    }
    Some(())
}

/// Asks every primitive about a ray.
fn ask(prisms: &Prisms, ray: &Ray) {
    if !ray.is_valid() {
        return;
    }
    for primitive in 0..prisms.len() as u32 {
        let hit = prisms.intersect(primitive, ray);
        let occluded = prisms.occluded(primitive, ray);
        assert_eq!(occluded, hit.is_some(), "{ray:?} {hit:?}");
        if let Some(PrismHit { prim, t, u, v, ng }) = hit {
            check(prisms, ray, prim, [t, u, v], ng);
        }
    }
}

/// Asks every primitive about eight rays at once: what they say of each is what they say of it alone.
fn ask_together(prisms: &Prisms, rays: &[Ray; RayPacket::LANES]) {
    let packet = RayPacket::from_rays(rays);
    let valid = (0..).zip(rays).fold(0, |valid, (lane, ray)| {
        valid | u8::from(ray.is_valid()) << lane
    });
    if valid == 0 {
        return;
    }
    for primitive in 0..prisms.len() as u32 {
        let hits = prisms.intersect8(primitive, &packet, valid);
        let occluded = prisms.occluded8(primitive, &packet, valid);
        for (lane, (hit, ray)) in hits.iter().zip(rays).enumerate() {
            if valid >> lane & 1 == 0 {
                continue;
            }
            assert_eq!(occluded >> lane & 1 != 0, hit.is_some(), "{ray:?} {hit:?}");
            let alone = prisms.intersect(primitive, ray);
            match (hit, alone) {
                (&Some(PrismHit { prim, t, u, v, ng }), Some(alone)) => {
                    check(prisms, ray, prim, [t, u, v], ng);
                    let apart = (t - alone.t).abs();
                    assert!(apart <= 1e-5 * t.abs(), "{ray:?} {hit:?} {alone:?}");
                }
                (hit, alone) => assert_eq!(*hit, alone, "{ray:?}"),
            }
        }
    }
}

fn check(prisms: &Prisms, ray: &Ray, prim: u32, [t, u, v]: [f32; 3], ng: glam::Vec3) {
    let hit = (ray, prim, t, u, v, ng);
    assert!(ray.tnear < t && t < ray.tfar && t.is_finite(), "{hit:?}");
    assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.000_001, "{hit:?}");
    assert!((ng.length() - 1.0).abs() < 1e-4, "{hit:?}");
    let triangles = prisms.surface().mesh().triangles().len();
    assert!((prim as usize) < triangles, "{hit:?}");
}

/// After an edit the boxes hold the surface. (They may be smaller than those of new prisms: on a tiny map a triangle that
/// reads few texels is given all.)
fn assert_hold(prisms: &Prisms, surface: &DisplacedSurface) {
    let boxes = (0..prisms.len() as u32).map(|primitive| prisms.bounds(primitive));
    let boxes: Vec<_> = boxes.filter(Aabb::is_valid).collect();
    for prim in 0..surface.mesh().triangles().len() as u32 {
        let patch = surface.patch(prim);
        for (u, v) in [(0.3, 0.3), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.5, 0.5)] {
            let position = patch.point(u, v).position.as_vec3();
            // Where normals cancel, the surface is cut off.
            if patch.normal(u, v).length() < 0.01 || !position.is_finite() || boxes.is_empty() {
                continue;
            }
            let holds = |bounds: &Aabb| {
                let slack = 1e-5 * (bounds.max - bounds.min).max_element();
                let (low, high) = (bounds.min - slack, bounds.max + slack);
                (low.cmple(position) & high.cmpge(position)).all()
            };
            assert!(boxes.iter().any(holds), "{prim} {u} {v}: {position}");
        }
    }
}
