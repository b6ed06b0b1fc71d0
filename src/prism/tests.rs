//! The kernels against an f64 oracle that shares nothing with them but S's definition.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;

use super::*;
use crate::surface::{
    BaseMesh, Displacement, DisplacementMap, MeshBuilder, NormalMode, Patch, Texels, UvTransform,
    Wrap,
};

/// Where `ray` first meets S over one triangle: the height above S by the exact inverse at `SAMPLES` points of the
/// ray, sign changes bisected.
fn oracle(patch: &Patch<'_>, ray: &Ray, bounds: Aabb) -> Option<f64> {
    const SAMPLES: usize = 3000;
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (a, b) = (
        (bounds.min.as_dvec3() - origin) / direction,
        (bounds.max.as_dvec3() - origin) / direction,
    );
    let (from, to) = (
        a.min(b).max_element().max(ray.tnear.into()),
        a.max(b).min_element().min(ray.tfar.into()),
    );
    if from >= to {
        return None;
    }
    // S goes on past the triangle's edges, so that a crossing next to one still lies between two samples.
    let above = |t: f64| {
        let p = patch.project(origin + t * direction, 1.0 / 3.0, 1.0 / 3.0)?;
        Some(p.z * patch.normal(p.x, p.y).length() - patch.displacement(p.x, p.y))
    };
    let inside = |t: f64| {
        patch
            .project(origin + t * direction, 1.0 / 3.0, 1.0 / 3.0)
            .is_some_and(|p| p.x >= 0.0 && p.y >= 0.0 && p.x + p.y <= 1.0)
    };
    let at = |k: usize| from + (to - from) * k as f64 / SAMPLES as f64;
    let mut before = above(at(0));
    for k in 1..=SAMPLES {
        let now = above(at(k));
        if let (Some(f0), Some(f1)) = (before, now)
            && (f0 < 0.0) != (f1 < 0.0)
        {
            let (mut low, mut high) = (at(k - 1), at(k));
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if above(middle).is_some_and(|f| (f < 0.0) == (f0 < 0.0)) {
                    low = middle
                } else {
                    high = middle
                }
            }
            let t = 0.5 * (low + high);
            if inside(t) {
                return Some(t);
            }
        }
        before = now;
    }
    None
}

fn noise_map(size: usize, wrap: Wrap) -> DisplacementMap {
    let hash = |i: usize| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 37) as u16;
    DisplacementMap::new(
        size,
        size,
        Texels::U16((0..size * size).map(hash).collect()),
        wrap,
    )
    .unwrap()
}

fn triangle(positions: [Vec3; 3], normals: [Vec3; 3], texcoords: [Vec2; 3]) -> BaseMesh {
    let builder = MeshBuilder {
        positions: positions.to_vec(),
        normals: normals.map(Vec3::normalize).to_vec(),
        texcoords: texcoords.to_vec(),
        triangles: vec![[0, 1, 2]],
    };
    builder.build(NormalMode::File).unwrap().0
}

fn surface(
    mesh: BaseMesh,
    map: DisplacementMap,
    displacement: Displacement,
) -> Arc<DisplacedSurface> {
    Arc::new(DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap())
}

/// A triangle of about unit size with normals tilted up to `tilt` from its own.
fn tilted(tilt: f32) -> impl Strategy<Value = BaseMesh> {
    let coordinate = || -0.2f32..0.2;
    let slope = move || -tilt..tilt;
    (
        prop::array::uniform9(coordinate()),
        prop::array::uniform6(slope()),
    )
        .prop_map(|(p, s)| {
            let positions = [
                Vec3::new(p[0], p[1], p[2]),
                Vec3::new(1.0 + p[3], p[4], p[5]),
                Vec3::new(p[6], 1.0 + p[7], p[8]),
            ];
            let normals = [0, 1, 2].map(|i| Vec3::new(s[2 * i], s[2 * i + 1], 1.0));
            triangle(
                positions,
                normals,
                [
                    Vec2::new(0.1, 0.1),
                    Vec2::new(0.9, 0.2),
                    Vec2::new(0.2, 0.8),
                ],
            )
        })
}

fn any_ray() -> impl Strategy<Value = Ray> {
    (
        prop::array::uniform3(-0.3f32..0.3),
        prop::array::uniform3(-1.0f32..1.0),
        0.5f32..3.0,
    )
        .prop_filter_map("direction", |(target, d, length)| {
            let direction = Vec3::from(d).try_normalize()? * length;
            Some(Ray::new(
                Vec3::new(0.4, 0.4, 0.0) + Vec3::from(target) - 2.0 * direction,
                direction,
            ))
        })
}

/// In or out, by enough to be seen.
fn any_scale() -> impl Strategy<Value = f32> {
    prop_oneof![-0.3f32..-0.01, 0.01f32..0.3]
}

fn agree(prisms: &Prisms, ray: &Ray) -> Result<(), TestCaseError> {
    let patch = prisms.surface().patch(0);
    let want = oracle(&patch, ray, prisms.bounds(0));
    let got = prisms.intersect(0, ray);
    prop_assert_eq!(prisms.occluded(0, ray), got.is_some());
    if let Some(hit) = got {
        let on_surface = patch.point(hit.u.into(), hit.v.into());
        let miss = (ray.at(hit.t).as_dvec3() - on_surface.position).length();
        prop_assert!(miss < 3e-6, "the hit is {miss} off the surface");
        let ng = on_surface.du.cross(on_surface.dv).normalize();
        prop_assert!(ng.distance(hit.ng.as_dvec3()) < 1e-4, "normal");
    }
    let got = got.map(|hit| f64::from(hit.t));
    prop_assert!(
        same_or_excused(prisms, ray, want, got),
        "oracle {want:?}, kernel {got:?}"
    );
    Ok(())
}

/// Equal, or different where a march may differ: two crossings closer than its step (a sliver, a grazing ray), or a
/// hit on the triangle's very edge.
fn same_or_excused(prisms: &Prisms, ray: &Ray, a: Option<f64>, b: Option<f64>) -> bool {
    let t = match (a, b) {
        (None, None) => return true,
        (Some(a), Some(b)) if (a - b).abs() < 1e-5 => return true,
        (Some(a), Some(b)) => a.min(b),
        (a, b) => a.or(b).unwrap_or_default(),
    };
    let patch = prisms.surface().patch(0);
    let direction = ray.direction.as_dvec3();
    let Some(p) = patch.project(ray.origin.as_dvec3() + t * direction, 0.3, 0.3) else {
        return true;
    };
    let on_edge = p.x.min(p.y).min(1.0 - p.x - p.y) < 1e-4;
    let point = patch.point(p.x, p.y);
    let grazing = point
        .du
        .cross(point.dv)
        .normalize()
        .dot(direction.normalize())
        .abs()
        < 0.05;
    let beyond = Ray {
        tnear: (t + 1e-6) as f32,
        ..*ray
    };
    let next = oracle(&patch, &beyond, prisms.bounds(0)).unwrap_or(f64::INFINITY);
    on_edge || grazing || (next - t) * direction.length() < 0.005
}

const FINE: March = March::Uniform {
    step: Step::Texels(0.02),
    jitter: false,
};

fn levels(surface: &Arc<DisplacedSurface>, march: March) -> impl Iterator<Item = Prisms> {
    [SimdLevel::Baseline, SimdLevel::Avx2]
        .into_iter()
        .filter_map(move |level| {
            Prisms::new(surface.clone(), march)
                .unwrap()
                .with_simd(level)
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn regular_prisms_agree_with_the_oracle(
        mesh in tilted(0.4), ray in any_ray(), scale in any_scale(), midlevel in 0.0f32..1.0, size in 4usize..12,
    ) {
        let displacement = Displacement { scale, midlevel, uv: UvTransform::default() };
        let surface = surface(mesh, noise_map(size, Wrap::Repeat), displacement);
        for prisms in levels(&surface, FINE) {
            agree(&prisms, &ray)?;
        }
    }

    #[test]
    fn bent_prisms_agree_with_the_oracle(mesh in tilted(0.4), ray in any_ray(), scale in 0.02f32..0.2) {
        let surface = surface(mesh, noise_map(8, Wrap::Repeat), Displacement::new(scale));
        let prisms = Prisms::new(surface.clone(), FINE).unwrap();
        let patch = surface.patch(0);
        let bent = march::bent::intersect(&patch, &ray, [-0.001, 1.5 * scale], Step::Texels(0.02));
        let bent = bent.map(|root| root.t);
        let straight = prisms.intersect(0, &ray).map(|hit| f64::from(hit.t));
        prop_assert!(same_or_excused(&prisms, &ray, bent, straight), "{bent:?} {straight:?}");
    }

    #[test]
    fn bounds_hold_the_surface(
        mesh in tilted(3.0), scale in -0.5f32..0.5, midlevel in -1.0f32..2.0, u in 0.0f32..1.0, v in 0.0f32..1.0,
    ) {
        prop_assume!(scale != 0.0);
        let displacement = Displacement { scale, midlevel, uv: UvTransform::default() };
        let prisms = Prisms::new(surface(mesh, noise_map(9, Wrap::Mirror), displacement), FINE).unwrap();
        let bounds = prisms.bounds(0);
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let p = prisms.surface().patch(0).point(u.into(), v.into()).position.as_vec3();
        prop_assert!(p.cmpge(bounds.min).all() && p.cmple(bounds.max).all(), "{p} outside {bounds:?}");
    }
}

/// A flat square of two triangles in the z = 0 plane over the whole map.
fn square(map: DisplacementMap, displacement: Displacement) -> Arc<DisplacedSurface> {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let builder = MeshBuilder {
        positions: corners.map(|c| c.extend(0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        texcoords: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    surface(
        builder.build(NormalMode::File).unwrap().0,
        map,
        displacement,
    )
}

fn first(prisms: &Prisms, ray: &Ray) -> Option<PrismHit> {
    (0..prisms.len() as u32)
        .filter_map(|p| prisms.intersect(p, ray))
        .min_by(|a, b| a.t.total_cmp(&b.t))
}

#[test]
fn a_prism_is_108_bytes() {
    let prisms = Prisms::new(
        square(noise_map(4, Wrap::Clamp), Displacement::new(0.1)),
        FINE,
    )
    .unwrap();
    // And the box of a group of primitives, and that of a group of such.
    assert_eq!(prisms.bytes(), 2 * 108 + 2 * 32);
}

#[test]
fn a_constant_map_is_an_offset_plane_from_both_sides_and_from_inside() {
    let map = DisplacementMap::new(2, 2, Texels::F32(vec![1.0; 4]), Wrap::Repeat).unwrap();
    let prisms = Prisms::new(square(map, Displacement::new(0.25)), March::default()).unwrap();
    for k in 0..100 {
        let at = Vec2::new((k % 10) as f32 / 9.7 + 0.01, (k / 10) as f32 / 9.7 + 0.01);
        for (z, direction, t) in [
            (2.0, -1.0, 1.75),
            (-1.0, 2.0, 0.625),
            (0.1, 1.0, 0.15),
            (0.3, -1.0, 0.05),
        ] {
            let hit = first(&prisms, &Ray::new(at.extend(z), Vec3::Z * direction)).expect("a hit");
            assert!((hit.t - t).abs() < 1e-6, "{hit:?}");
            assert!(hit.ng.distance(Vec3::Z) < 1e-6);
        }
    }
}

#[test]
fn the_interval_of_the_ray_is_respected() {
    let prisms = Prisms::new(
        square(noise_map(8, Wrap::Clamp), Displacement::new(0.3)),
        FINE,
    )
    .unwrap();
    let ray = Ray::new(Vec3::new(-0.2, 0.41, 0.12), Vec3::new(1.0, 0.05, 0.01));
    let mut crossings = Vec::new();
    let mut rest = ray;
    while let Some(hit) = first(&prisms, &rest) {
        crossings.push(hit.t);
        rest.tnear = hit.t * (1.0 + 1e-5);
    }
    assert!(
        crossings.len() >= 2,
        "the ray runs through the bumps: {crossings:?}"
    );
    let between = Ray {
        tnear: crossings[0] + 1e-4,
        tfar: crossings[1] - 1e-4,
        ..ray
    };
    assert_eq!(first(&prisms, &between), None);
    let up_to = Ray {
        tfar: crossings[0] - 1e-4,
        ..ray
    };
    assert_eq!(first(&prisms, &up_to), None);
}

#[test]
fn jitter_is_keyed_by_the_ray_and_sees_what_the_step_misses() {
    // One texel spikes over a long way, looked at with steps of four texels.
    let size = 64;
    let texels = (0..size * size)
        .map(|i| if i % size == 31 { 65535 } else { 0 })
        .collect();
    let map = DisplacementMap::new(size, size, Texels::U16(texels), Wrap::Clamp).unwrap();
    let march = |jitter| March::Uniform {
        step: Step::Texels(4.0),
        jitter,
    };
    let surface = square(map, Displacement::new(0.2));
    let ray = |key| Ray {
        key,
        ..Ray::new(Vec3::new(-0.5, 0.3, 0.16), Vec3::X)
    };
    let jittered = Prisms::new(surface, march(true)).unwrap();
    let hits: Vec<bool> = (0..200)
        .map(|key| first(&jittered, &ray(key)).is_some())
        .collect();
    let share = hits.iter().filter(|h| **h).count();
    assert!(
        (20..180).contains(&share),
        "{share} of 200 rays see the spike"
    );
    let again: Vec<bool> = (0..200)
        .map(|key| first(&jittered, &ray(key)).is_some())
        .collect();
    assert_eq!(hits, again);
}

#[test]
fn bad_steps_are_refused_and_tiny_steps_end() {
    let surface = square(noise_map(4, Wrap::Repeat), Displacement::new(0.1));
    for found in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(
            Prisms::new(
                surface.clone(),
                March::Uniform {
                    step: Step::Texels(found),
                    jitter: false
                }
            )
            .is_err()
        );
    }
    let tiny = March::Uniform {
        step: Step::World(1e-30),
        jitter: false,
    };
    let prisms = Prisms::new(surface, tiny).unwrap();
    assert!(first(&prisms, &Ray::new(Vec3::new(0.3, 0.3, 2.0), -Vec3::Z)).is_some());
}

#[test]
fn folded_normals_are_found_too() {
    // Vertex normals that point below the face: no parallel prism exists, the surface does.
    let normals = [
        Vec3::new(1.0, 0.0, -0.1),
        Vec3::new(-0.3, 0.2, 1.0),
        Vec3::new(0.1, -0.4, 1.0),
    ];
    let mesh = triangle(
        [Vec3::ZERO, Vec3::X, Vec3::Y],
        normals,
        [
            Vec2::new(0.1, 0.1),
            Vec2::new(0.9, 0.2),
            Vec2::new(0.2, 0.8),
        ],
    );
    let prisms = Prisms::new(
        surface(mesh, noise_map(6, Wrap::Repeat), Displacement::new(0.2)),
        FINE,
    )
    .unwrap();
    let patch = prisms.surface().patch(0);
    for k in 0..400 {
        let (u, v) = ((k % 20) as f64 / 21.0 + 0.01, (k / 20) as f64 / 21.0 + 0.01);
        if u + v < 0.98 {
            let target = patch.point(u, v).position;
            let direction = DVec3::new(0.3, -0.2, -1.0);
            let ray = Ray::new((target - 2.0 * direction).as_vec3(), direction.as_vec3());
            let hit = prisms
                .intersect(0, &ray)
                .expect("every point of the surface can be hit");
            assert!(hit.t <= 2.0 + 1e-5, "{hit:?}");
            let found = patch.point(hit.u.into(), hit.v.into()).position.as_vec3();
            assert!(found.distance(ray.at(hit.t)) < 1e-5);
        }
    }
}

/// Where S has no normal a hit has the base triangle's, or where that has no area, as for a moment when it moves, a vertex's.
#[test]
fn hits_without_a_normal_have_one() {
    use super::block::Crossing;
    use super::exact::hit;
    use super::judge::Found;

    let tip = Vec3::new(0.6, 0.0, 0.8);
    let corners = |last: Vec3| ([Vec3::ZERO, Vec3::X, last], [tip, Vec3::Z, Vec3::Z]);
    let (positions, normals) = corners(Vec3::Y);
    let mesh = triangle(positions, normals, [Vec2::ZERO, Vec2::X, Vec2::Y]);
    let surface = surface(mesh, noise_map(4, Wrap::Repeat), Displacement::new(0.1));
    for (last, expected) in [(Vec3::Y, Vec3::Z), (2.0 * Vec3::X, tip)] {
        let patch = surface.patch_over(0, corners(last));
        for ng in [DVec3::ZERO, DVec3::NAN] {
            let (t, u, v) = (0.5, 0.25, 0.25);
            let at = Found { t, u, v };
            let hit = hit(&patch, 0, &Crossing { at, ng: Some(ng) });
            assert!(hit.ng.distance(expected) < 1e-6, "{hit:?}");
        }
    }
}
