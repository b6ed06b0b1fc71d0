//! The figure in docs/exact.md is what the program draws.

#[allow(dead_code)] // its `main`
#[path = "../examples/march_figure.rs"]
mod march_figure;

use prismarch::prism::Fate;

#[test]
fn what_is_told_is_what_the_march_finds() {
    let (prisms, ray) = (march_figure::prisms(), march_figure::ray());
    let told = prisms.explain(0, &ray).unwrap();
    // The only base triangle is the first lane of the only primitive.
    let found = prisms.intersect(0, &ray).unwrap();
    let t = told.hit.unwrap();
    assert!((t - f64::from(found.t)).abs() < 1e-6 * t);
    // No part of the curve is left out before the hit, at whatever depth it was decided.
    let decided = |fate: Fate| matches!(fate, Fate::Skipped | Fate::Walked);
    let mut parts: Vec<[f64; 2]> = told
        .children
        .iter()
        .filter(|c| decided(c.fate))
        .map(|c| c.t)
        .collect();
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut reached = told.curve[0].t;
    for [from, to] in parts.into_iter().filter(|[from, _]| *from <= t) {
        assert!((from - reached).abs() < 1e-5, "a gap at {reached}");
        reached = to;
    }
    assert!(reached >= t);
}

#[test]
fn the_committed_figure_is_what_the_march_does_now() {
    let committed = std::fs::read_to_string(march_figure::PATH).unwrap();
    assert!(
        committed == march_figure::draw(),
        "docs/images/march.svg is out of date: cargo run --release --example march_figure"
    );
}
