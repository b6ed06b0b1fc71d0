//! Closed displaced surfaces have no holes, no double walls and no insides turned out: the laws are in
//! `benches/common/closed.rs`; `cargo bench --bench watertight` shoots many more rays.
#![cfg(any(feature = "embree", feature = "bvh"))]

#[path = "../benches/common/mod.rs"]
mod common;
mod oracle;

use std::collections::HashSet;
use std::f32::consts::PI;
use std::sync::Arc;

use common::closed::{self, Closed};
use common::numbers::Numbers;
use glam::{Affine3A, DVec2, Mat3, Quat, Vec2, Vec3, vec3};
use oracle::{EDGE, Line, Oracle};
use prismarch::ray::{Aabb, Ray, RayPacket};
use prismarch::surface::{DisplacedSurface, MeshBuilder, NormalMode};
use prismarch::trace::{Hit, Object, Placement, Shape, Tracer, World};

/// Lines per mesh, and as many rays from inside.
const COUNT: usize = if cfg!(debug_assertions) {
    2_000
} else {
    16_000
};

fn world(closed: &Closed) -> World {
    World::new(vec![Object {
        shape: Shape::Displaced(Arc::new(closed.prisms())),
        placement: Placement::World,
        mask: u32::MAX,
    }])
}

#[track_caller]
fn hold(tracer: impl Fn(&World) -> Box<dyn Tracer>) {
    let mut broken = Vec::new();
    for closed in closed::all() {
        let faults = closed::faults(&closed, &*tracer(&world(&closed)), COUNT, 1);
        let oracle = Oracle::new(&closed.surface);
        // Two crossings at one single-precision t are one to who restarts the ray there.
        let odd = faults.odd.iter().filter(|line| !oracle.is_tied(line));
        let odd: Vec<_> = odd.collect();
        println!(
            "{:<24} of {COUNT}: odd {} escaped {}",
            closed.name,
            odd.len(),
            faults.escaped.len()
        );
        broken.extend(odd.first().map(|line| format!("{}: {line:?}", closed.name)));
        let escaped = faults.escaped.first();
        broken.extend(escaped.map(|ray| format!("{}: {ray:?}", closed.name)));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The oracle that judges the others keeps the laws itself.
#[test]
fn the_oracle_sees_no_holes() {
    const LINES: usize = if cfg!(debug_assertions) { 20 } else { 300 };
    for closed in closed::all() {
        let oracle = Oracle::new(&closed.surface);
        let mut numbers = Numbers::new(31);
        for _ in 0..LINES {
            let ray = closed::line(&mut numbers);
            if oracle.is_tied(&ray) {
                continue;
            }
            let found = oracle.trace(&Line::from(&ray), EDGE);
            let mut depth = 0;
            let mut last = f64::NEG_INFINITY;
            for c in &found.all {
                // On an edge it is found from both sides.
                if c.t - last > 1e-12 {
                    depth += if c.ng.dot(ray.direction.as_dvec3()) < 0.0 {
                        1
                    } else {
                        -1
                    };
                    let alternates = !closed.embedded || (0..=1).contains(&depth);
                    assert!(alternates, "{}: {ray:?} {found:?}", closed.name);
                }
                last = c.t;
            }
            assert_eq!(depth, 0, "{}: {ray:?} {found:?}", closed.name);
        }
    }
}

/// A ray that starts behind a pair of close crossings meets the next as one from afar does. From there the march begins
/// less than the width of a rounding before a texel line, behind which the surface is crossed twice.
#[test]
fn a_restart_before_a_texel_line_misses_nothing() {
    let closed = &closed::all()[0];
    let prisms = closed.prisms();
    let mut ray = Ray::new(
        vec3(-1.491_691, -0.987_052_3, -1.746_592_5),
        vec3(0.828_222_5, 0.420_310_5, 0.370_657_03),
    );
    let oracle = Oracle::new(&closed.surface);
    let line = Line::from(&ray);
    let all = oracle.trace(&line, EDGE).all;
    assert!(all.len() > 10 && all.len().is_multiple_of(2) && all.iter().all(|c| c.sure));
    for crossing in &all {
        let hit = (0..prisms.len() as u32)
            .filter_map(|cluster| prisms.intersect(cluster, &ray))
            .min_by(|a, b| a.t.total_cmp(&b.t))
            .expect("one more crossing");
        assert_eq!(hit.prim, crossing.prim, "{hit:?} {crossing:?}");
        let off = (f64::from(hit.t) - crossing.t).abs();
        assert!(off < 3e-7, "{hit:?} {crossing:?}");
        ray.tnear = hit.t;
    }
}

/// The same surface from triangles that stand alone, every number of every corner rounded up or down to six digits by chance.
fn written_corner_by_corner(closed: &Closed) -> MeshBuilder {
    let mut numbers = Numbers::new(77);
    let mut rounded = |x: f32| {
        let unit = 10f64.powf(f64::from(x.abs()).log10().floor() - 5.0);
        let whole = (f64::from(x) / unit + f64::from(numbers.number())).floor();
        if x == 0.0 { x } else { (whole * unit) as f32 }
    };
    let mesh = closed.surface.mesh();
    let mut soup = MeshBuilder::default();
    for &i in mesh.triangles().as_flattened() {
        let i = i as usize;
        let [p, n, st] = [
            mesh.positions()[i],
            mesh.normals()[i],
            mesh.texcoords()[i].extend(0.0),
        ]
        .map(|v| Vec3::from(v.to_array().map(&mut rounded)));
        soup.positions.push(p);
        soup.normals.push(n);
        soup.texcoords.push(st.truncate());
    }
    soup.triangles = (0..soup.positions.len() as u32 / 3)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    soup
}

/// Joined, a mesh whose corners differ by rounding is as tight as the one that it was, and as smooth.
#[cfg(feature = "bvh")]
#[test]
fn corners_that_differ_by_rounding_leave_no_holes() {
    for (closed, has_normals) in closed::all()
        .into_iter()
        .zip([true, false].into_iter().cycle())
    {
        let exact = closed.surface.mesh();
        let mut soup = written_corner_by_corner(&closed);
        if !has_normals {
            soup.normals.clear();
        }
        let joined = soup.join(soup.rounding()).unwrap();
        assert!(joined.positions > 0 && joined.farthest <= soup.rounding());
        let (mesh, _) = soup.build(NormalMode::File).unwrap();
        assert_eq!(mesh.triangles().len(), exact.triangles().len());
        let distinct: HashSet<_> = mesh
            .positions()
            .iter()
            .map(|p| p.to_array().map(f32::to_bits))
            .collect();
        assert_eq!(distinct.len(), exact.positions().len());
        let of_exact = exact.triangles().as_flattened();
        for (&i, &j) in mesh.triangles().as_flattened().iter().zip(of_exact) {
            let (i, j) = (i as usize, j as usize);
            assert!(mesh.positions()[i].distance(exact.positions()[j]) < 3e-5);
            // Computed ones are those of the sphere only about.
            let most = if has_normals { 3e-5 } else { 0.6 };
            assert!(mesh.normals()[i].distance(exact.normals()[j]) < most);
        }
        let surface = DisplacedSurface::new(
            Arc::new(mesh),
            closed.surface.map().clone(),
            *closed.surface.displacement(),
        );
        let joined = Closed {
            surface: Arc::new(surface.unwrap()),
            ..closed
        };
        let tracer = prismarch::bvh::BvhTracer::new(&world(&joined)).unwrap();
        let faults = closed::faults(&joined, &tracer, COUNT / 2, 5);
        assert!(faults.escaped.is_empty(), "{}: {faults:?}", joined.name);
        let oracle = Oracle::new(&joined.surface);
        let odd: Vec<_> = faults
            .odd
            .iter()
            .filter(|line| !oracle.is_tied(line))
            .collect();
        assert!(odd.is_empty(), "{}: {odd:?}", joined.name);
    }
}

#[cfg(feature = "embree")]
#[test]
fn embree_sees_no_holes() {
    use prismarch::embree::{EmbreeOptions, EmbreeTracer};
    hold(|world| Box::new(EmbreeTracer::new(world, &EmbreeOptions::default()).unwrap()));
}

#[cfg(feature = "bvh")]
#[test]
fn obvhs_sees_no_holes() {
    hold(|world| Box::new(prismarch::bvh::BvhTracer::new(world).unwrap()));
}

/// Asks a tracer otherwise than by single rays: what the laws are to hold of too.
struct Otherwise<'a, F> {
    tracer: &'a dyn Tracer,
    ask: F,
}

impl<F: Fn(&Ray) -> Option<Hit> + Sync> Tracer for Otherwise<'_, F> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        (self.ask)(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.tracer.occluded(ray)
    }

    fn bounds(&self) -> Aabb {
        self.tracer.bounds()
    }

    fn bvh_bytes(&self) -> usize {
        self.tracer.bvh_bytes()
    }

    fn name(&self) -> String {
        self.tracer.name()
    }
}

/// Turned, stretched, mirrored and sheared.
fn transforms() -> [Affine3A; 4] {
    let turn = Quat::from_scaled_axis(vec3(0.3, -1.1, 0.7));
    let at = vec3(7.0, -3.0, 20.0);
    let sheared = Mat3::from_cols(
        vec3(1.0, 0.2, 0.0),
        vec3(-0.7, 1.0, 0.4),
        vec3(0.5, 0.0, 1.3),
    );
    [
        Affine3A::from_rotation_translation(turn, at),
        Affine3A::from_scale_rotation_translation(vec3(30.0, 0.4, 3.0), turn, at),
        Affine3A::from_scale_rotation_translation(vec3(-1.0, 1.0, 1.0), turn, -at),
        Affine3A::from_mat3_translation(0.01 * sheared, Vec3::ZERO),
    ]
}

#[track_caller]
fn hold_otherwise(closed: &Closed, tracer: &dyn Tracer, what: &str) {
    let faults = closed::faults(closed, tracer, COUNT / 4, 5);
    let oracle = Oracle::new(&closed.surface);
    let odd = faults.odd.iter().find(|line| !oracle.is_tied(line));
    assert_eq!(odd, None, "{} {what}", closed.name);
    assert_eq!(faults.escaped.first(), None, "{} {what}", closed.name);
}

fn tracers(world: &World) -> Vec<Box<dyn Tracer>> {
    vec![
        #[cfg(feature = "embree")]
        Box::new(embree(world)),
        #[cfg(feature = "bvh")]
        Box::new(prismarch::bvh::BvhTracer::new(world).unwrap()),
    ]
}

#[cfg(feature = "embree")]
fn embree(world: &World) -> prismarch::embree::EmbreeTracer {
    use prismarch::embree::{EmbreeOptions, EmbreeTracer};
    EmbreeTracer::new(world, &EmbreeOptions::default()).unwrap()
}

#[test]
fn instances_have_no_holes() {
    for closed in closed::all() {
        for transform in transforms() {
            let placed = World::new(vec![Object {
                shape: Shape::Displaced(Arc::new(closed.prisms())),
                placement: Placement::Instances(vec![transform]),
                mask: u32::MAX,
            }]);
            for tracer in tracers(&placed) {
                let ask = |ray: &Ray| {
                    tracer.intersect(&Ray {
                        origin: transform.transform_point3(ray.origin),
                        direction: transform.transform_vector3(ray.direction),
                        ..*ray
                    })
                };
                let tracer = &*tracer;
                let name = tracer.name();
                hold_otherwise(
                    &closed,
                    &Otherwise { tracer, ask },
                    &format!("{name} {transform}"),
                );
            }
        }
    }
}

/// Rays beside one: about as far apart as those of neighbouring pixels.
fn packet(ray: &Ray) -> RayPacket {
    let rays: Vec<Ray> = (0..RayPacket::LANES)
        .map(|lane| {
            let off = [0.0, 1.0, -2.0, 0.0, 3.0, -1.0, 2.0, -3.0][lane];
            let origin = ray.origin + 2e-3 * off * vec3(1.0, -0.5, 0.3);
            Ray { origin, ..*ray }
        })
        .collect();
    RayPacket::from_rays(&rays)
}

/// What the packet's two rays that are one meet.
fn first([a, _, _, b, ..]: [Option<Hit>; RayPacket::LANES]) -> Option<Hit> {
    assert_eq!(a, b);
    a
}

#[test]
fn packets_see_no_holes() {
    for closed in closed::all() {
        let placed = world(&closed);
        for tracer in tracers(&placed) {
            let tracer = &*tracer;
            let ask = |ray: &Ray| first(tracer.intersect8(&packet(ray)));
            hold_otherwise(&closed, &Otherwise { tracer, ask }, &tracer.name());
        }
        #[cfg(feature = "embree")]
        for coherence in [
            prismarch::embree::Coherence::Coherent,
            prismarch::embree::Coherence::Incoherent,
        ] {
            let embree = embree(&placed);
            let ask = |ray: &Ray| first(embree.scene().intersect8(&packet(ray), coherence));
            let tracer = &embree;
            hold_otherwise(
                &closed,
                &Otherwise { tracer, ask },
                &format!("{coherence:?}"),
            );
        }
    }
}

/// Base barycentrics of a vertex, a point of a side, a texel's corner, and a point of a texel line.
fn special(numbers: &mut Numbers, texels: [DVec2; 3], kind: usize) -> Vec2 {
    let (u, v) = (numbers.number(), numbers.number());
    let (u, v) = if u + v > 1.0 {
        (1.0 - u, 1.0 - v)
    } else {
        (u, v)
    };
    match kind {
        0 => [Vec2::ZERO, Vec2::X, Vec2::Y][(3.0 * numbers.number()) as usize % 3],
        1 => [Vec2::new(u, 0.0), Vec2::new(0.0, v), Vec2::new(u, 1.0 - u)]
            [(3.0 * numbers.number()) as usize % 3],
        _ => {
            let (a, b) = (texels[1] - texels[0], texels[2] - texels[0]);
            let at = texels[0] + f64::from(u) * a + f64::from(v) * b;
            let on_line = DVec2::new(at.x.round(), if kind == 2 { at.y.round() } else { at.y });
            let from = on_line - texels[0];
            let area = a.perp_dot(b);
            let uv = DVec2::new(from.perp_dot(b) / area, a.perp_dot(from) / area);
            let is_inside = uv.min_element() >= 0.0 && uv.x + uv.y <= 1.0;
            if is_inside {
                uv.as_vec2()
            } else {
                Vec2::new(u, v)
            }
        }
    }
}

/// Lines through what primitives and cells have in common, from everywhere.
#[test]
fn nothing_falls_between() {
    for closed in closed::all() {
        let placed = world(&closed);
        let tracers = tracers(&placed);
        let oracle = Oracle::new(&closed.surface);
        let mesh = closed.surface.mesh();
        let (width, height) = closed.surface.map().size();
        let size = DVec2::new(width as f64, height as f64);
        let mut numbers = Numbers::new(51);
        for k in 0..COUNT / 2 {
            let count = mesh.triangles().len() as f32;
            let prim = ((numbers.number() * count) as u32).min(count as u32 - 1);
            let texels = closed
                .surface
                .corner_texcoords(prim)
                .map(|st| st.as_dvec2() * size - 0.5);
            let uv = special(&mut numbers, texels, k % 4);
            let point = closed.surface.point(prim, uv.x, uv.y).position;
            let direction = numbers.direction();
            let line = Ray::new(
                point - (1.0 + 4.0 * numbers.number()) * PI * direction,
                direction,
            );
            for tracer in &tracers {
                if !closed::is_crossed_evenly(&**tracer, &line, closed.embedded) {
                    assert!(
                        oracle.is_tied(&line),
                        "{} {}: {line:?}",
                        closed.name,
                        tracer.name()
                    );
                }
            }
        }
    }
}
