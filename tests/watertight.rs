//! Closed displaced surfaces have no holes, no double walls and no insides turned out: the laws are in
//! `benches/common/closed.rs`; `cargo bench --bench watertight` shoots many more rays.
#![cfg(any(feature = "embree", feature = "bvh"))]

#[path = "../benches/common/mod.rs"]
mod common;
mod oracle;

use std::sync::Arc;

use common::closed::{self, Closed};
use common::numbers::Numbers;
use glam::vec3;
use oracle::{EDGE, Line, Oracle};
use prismarch::ray::Ray;
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
