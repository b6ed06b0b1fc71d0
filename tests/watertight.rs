//! Closed displaced surfaces have no holes, no double walls and no insides turned out: the laws are in
//! `benches/common/closed.rs`; `cargo bench --bench watertight` shoots many more rays.
#![cfg(any(feature = "embree", feature = "bvh"))]

#[path = "../benches/common/mod.rs"]
mod common;
mod oracle;

use std::collections::HashSet;
use std::sync::Arc;

use common::closed::{self, Closed};
use common::numbers::Numbers;
use glam::{Vec3, vec3};
use oracle::{EDGE, Line, Oracle};
use prismarch::ray::Ray;
use prismarch::surface::{DisplacedSurface, MeshBuilder, NormalMode};
use prismarch::trace::{Object, Placement, Shape, Tracer, World};

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
