//! A packet is eight rays: whatever holds for each alone holds in its lane.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, Quat};

use super::triangles::strip;
use super::*;
use crate::embree::{Coherence, EmbreeError, Geometry, Instance, TriangleGeometry};
use crate::ray::RayPacket;
use crate::trace::{Hit, Tracer};

const COHERENCES: [Coherence; 2] = [Coherence::Coherent, Coherence::Incoherent];

/// Eight rays a little apart, towards the middle.
fn bundle(random: &mut Random, spread: f32) -> [Ray; 8] {
    let origin = 12.0 * random.point();
    let target = 4.0 * random.point();
    std::array::from_fn(|_| {
        let speed = 0.01 + random.next();
        let target = target + spread * random.point();
        Ray::new(origin, (target - origin) * speed)
    })
}

/// The rays whose bits are set; the others are empty lanes.
fn packet(rays: &[Ray; 8], bits: u8) -> RayPacket {
    let mut packet = RayPacket::EMPTY;
    for (lane, ray) in rays.iter().enumerate() {
        if bits >> lane & 1 == 1 {
            packet.set(lane, ray);
        }
    }
    packet
}

/// Holds every lane to its ray by `same`; returns the number of hits.
fn check(scene: &Scene, rays: &RayPacket, same: fn(&Hit, &Hit) -> bool) -> usize {
    let single: Vec<Option<Hit>> = (0..8).map(|i| scene.intersect1(&rays.ray(i))).collect();
    for coherence in COHERENCES {
        let hits = scene.intersect8(rays, coherence);
        let occluded = scene.occluded8(rays, coherence);
        for (lane, (found, expected)) in hits.iter().zip(&single).enumerate() {
            let agree = match (found, expected) {
                (Some(found), Some(expected)) => same(found, expected),
                (found, expected) => found.is_none() && expected.is_none(),
            };
            assert!(agree, "lane {lane}: {found:?}, alone {expected:?}");
            assert_eq!(occluded >> lane & 1 == 1, expected.is_some(), "lane {lane}");
        }
    }
    single.iter().flatten().count()
}

fn identical(a: &Hit, b: &Hit) -> bool {
    a == b
}

fn alike(a: &Hit, b: &Hit) -> bool {
    (a.prim, a.geom, a.inst) == (b.prim, b.geom, b.inst)
        && (a.t - b.t).abs() < 1e-5 * b.t.max(1.0)
        && (a.u - b.u).abs().max((a.v - b.v).abs()) < 1e-4
        && a.ng.distance(b.ng) < 1e-5
}

#[test]
fn lanes_hit_what_their_rays_hit() {
    let scene = scene_of(&device(), Balls::strewn(500));
    let mut random = Random(3);
    let mut hits = 0;
    for spread in [0.0, 0.1, 1.0, 20.0] {
        for _ in 0..300 {
            let rays = bundle(&mut random, spread);
            hits += check(&scene, &packet(&rays, u8::MAX), identical);
        }
    }
    assert!(hits > 1000, "only {hits} rays tested anything");
}

#[test]
fn every_mask_of_lanes_is_kept() {
    let scene = scene_of(&device(), Balls::strewn(500));
    let mut random = Random(4);
    for bits in 0..=u8::MAX {
        check(&scene, &packet(&bundle(&mut random, 1.0), bits), identical);
    }
}

#[test]
fn rays_that_are_not_valid_hit_nothing_and_harm_no_other() {
    let scene = scene_of(&device(), Balls::unit());
    let bad = [
        Ray::new(Vec3::NAN, Vec3::Z),
        Ray::new(Vec3::ZERO, Vec3::ZERO),
        Ray::new(Vec3::ZERO, Vec3::INFINITY),
        Ray::new(Vec3::INFINITY, Vec3::Z),
        Ray {
            tnear: f32::NAN,
            ..axis_ray()
        },
        Ray {
            tnear: -1.0,
            ..axis_ray()
        },
        Ray {
            tfar: f32::NAN,
            ..axis_ray()
        },
        Ray {
            tnear: 2.0,
            tfar: 1.0,
            ..axis_ray()
        },
    ];
    for bits in 0..=u8::MAX {
        let rays: [Ray; 8] = std::array::from_fn(|lane| {
            if bits >> lane & 1 == 1 {
                bad[lane]
            } else {
                axis_ray()
            }
        });
        let rays = packet(&rays, u8::MAX);
        assert_eq!(rays.valid(), !bits);
        for coherence in COHERENCES {
            let hits = scene
                .intersect8(&rays, coherence)
                .map(|hit| hit.map(|h| h.t));
            for (lane, t) in hits.iter().enumerate() {
                let expected = (bits >> lane & 1 == 0).then_some(4.0);
                assert_eq!(*t, expected, "{bits:#b} lane {lane}");
            }
            assert_eq!(scene.occluded8(&rays, coherence), !bits);
        }
    }
}

#[test]
fn lanes_have_intervals_masks_and_keys_of_their_own() {
    let device = device();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    for (z, mask) in [(0.0, 0b01), (10.0, 0b10), (20.0, 0x8000_0000)] {
        let ball = Arc::new(Balls(vec![(Vec3::new(0.0, 0.0, z), 1.0)]));
        let geometry: Geometry = UserGeometry::new(&device, ball).unwrap().into();
        builder.attach(geometry.with_mask(mask)).unwrap();
    }
    let scene = builder.commit().unwrap();
    let lane = |mask: u32, tnear: f32, tfar: f32| Ray {
        mask,
        tnear,
        tfar,
        ..axis_ray()
    };
    let rays = [
        lane(u32::MAX, 0.0, f32::INFINITY),
        lane(0b10, 0.0, f32::INFINITY),
        lane(0b110, 0.0, 15.0),
        lane(0x8000_0000, 0.0, f32::INFINITY),
        lane(0b100, 0.0, f32::INFINITY),
        lane(0, 0.0, f32::INFINITY),
        lane(u32::MAX, 4.0, f32::INFINITY),
        lane(u32::MAX, 0.0, 4.0),
    ];
    for bits in 0..=u8::MAX {
        check(&scene, &packet(&rays, bits), identical);
    }
}

#[test]
fn instances_are_met_by_packets_as_by_single_rays() {
    let device = device();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    let prototype = builder
        .add_prototype(scene_of(&device, Balls::strewn(100)))
        .unwrap();
    for x in [-5.0, 0.0, 5.0] {
        builder
            .attach_instance(&Instance {
                prototype,
                transform: Affine3A::from_scale_rotation_translation(
                    Vec3::new(0.5, 1.0, 2.0),
                    Quat::from_rotation_y(0.7 + x),
                    Vec3::X * x,
                ),
                mask: 0b1,
            })
            .unwrap();
    }
    let scene = builder.commit().unwrap();
    let mut random = Random(5);
    let mut hits = 0;
    for _ in 0..1000 {
        hits += check(
            &scene,
            &packet(&bundle(&mut random, 1.0), u8::MAX),
            identical,
        );
    }
    assert!(hits > 200, "only {hits} rays tested anything");
}

#[test]
fn filters_decide_in_every_lane() {
    let device = device();
    let user = UserGeometry::new(&device, Balls::strewn(500)).unwrap();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    let leaving = |ray: &Ray, hit: &Hit| hit.ng.dot(ray.direction) > 0.0;
    builder
        .attach(Geometry::from(user).with_filter(Box::new(leaving)))
        .unwrap();
    let scene = builder.commit().unwrap();
    let mut random = Random(6);
    let mut hits = 0;
    for bits in 0..=u8::MAX {
        hits += check(&scene, &packet(&bundle(&mut random, 0.5), bits), identical);
    }
    assert!(hits > 100, "only {hits} rays tested anything");
}

#[test]
fn triangles_agree_up_to_rounding() {
    let device = device();
    let mut builder = SceneBuilder::new(&device, SceneOptions::default()).unwrap();
    let mesh = strip();
    builder
        .attach(TriangleGeometry::new(&device, mesh.clone()).unwrap())
        .unwrap();
    let scene = builder.commit().unwrap();
    let mut hits = 0;
    for prim in 0..mesh.triangles().len() as u32 {
        let [v0, v1, v2] = mesh.corners(prim);
        let ng = (v1 - v0).cross(v2 - v0).normalize();
        let rays: [Ray; 8] = std::array::from_fn(|lane| {
            let u = 0.1 + 0.08 * lane as f32;
            let target = v0 + u * (v1 - v0) + 0.2 * (v2 - v0);
            Ray::new(target + 3.0 * ng, -0.5 * ng)
        });
        hits += check(&scene, &packet(&rays, u8::MAX), alike);
    }
    assert_eq!(hits, 8 * mesh.triangles().len());
}

/// The unit ball with a hit test for packets of its own.
struct Lanes {
    calls: AtomicUsize,
    panics: bool,
}

impl Lanes {
    fn new(panics: bool) -> Arc<Self> {
        let calls = AtomicUsize::new(0);
        Arc::new(Self { calls, panics })
    }
}

impl HitTest for Lanes {
    fn len(&self) -> usize {
        1
    }

    fn bounds(&self, prim: u32) -> Aabb {
        Balls::unit().bounds(prim)
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        Balls::unit().intersect(prim, ray)
    }

    /// Answers lanes that were not asked too: nobody may look.
    fn intersect8(&self, prim: u32, rays: &RayPacket, valid: u8) -> [Option<PrismHit>; 8] {
        self.calls.fetch_add(1, Ordering::Relaxed);
        assert!(!self.panics, "no packets today");
        assert_ne!(valid, 0);
        std::array::from_fn(|lane| self.intersect(prim, &rays.ray(lane)))
    }

    fn occluded8(&self, prim: u32, rays: &RayPacket, valid: u8) -> u8 {
        let hits = self.intersect8(prim, rays, valid);
        (0..8).fold(0, |bits, i| bits | u8::from(hits[i].is_some()) << i) | !valid
    }
}

#[test]
fn packets_reach_the_hit_test_as_packets() {
    let test = Lanes::new(false);
    let scene = scene_of(&device(), test.clone());
    let rays = [axis_ray(); 8];
    for bits in 1..=u8::MAX {
        let before = test.calls.load(Ordering::Relaxed);
        check(&scene, &packet(&rays, bits), identical);
        let calls = test.calls.load(Ordering::Relaxed) - before;
        // Embree may hand a lane that is alone in a packet to its single-ray path.
        assert!(
            calls <= 4 && (calls == 4 || bits.count_ones() < 4),
            "{calls}"
        );
    }
}

#[test]
fn a_panic_in_a_packet_hit_test_is_a_miss_and_is_told_once() {
    let device = device();
    let scene = scene_of(&device, Lanes::new(true));
    let rays = packet(&[axis_ray(); 8], u8::MAX);
    let told = Err(EmbreeError::HitTestPanicked {
        message: "no packets today".to_string(),
    });
    for coherence in COHERENCES {
        assert_eq!(scene.intersect8(&rays, coherence), [None; 8]);
        assert_eq!(device.check(), told);
        assert_eq!(scene.occluded8(&rays, coherence), 0);
        assert_eq!(device.check(), told);
        assert_eq!(device.check(), Ok(()));
    }
    assert!(scene.intersect1(&axis_ray()).is_some());
}

/// A tracer that only knows single rays.
struct Single<'s>(&'s Scene);

impl Tracer for Single<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.0.intersect1(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded1(ray)
    }

    fn bounds(&self) -> Aabb {
        self.0.bounds()
    }

    fn bvh_bytes(&self) -> usize {
        0
    }

    fn name(&self) -> String {
        "single rays".into()
    }
}

#[test]
fn a_tracer_without_packets_answers_them_ray_by_ray() {
    let scene = scene_of(&device(), Balls::strewn(500));
    let mut random = Random(8);
    for bits in 0..=u8::MAX {
        let rays = packet(&bundle(&mut random, 1.0), bits);
        let tracer = Single(&scene);
        assert_eq!(
            tracer.intersect8(&rays),
            scene.intersect8(&rays, Coherence::Coherent)
        );
        assert_eq!(
            tracer.occluded8(&rays),
            scene.occluded8(&rays, Coherence::Coherent)
        );
    }
}
