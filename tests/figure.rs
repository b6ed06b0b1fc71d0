//! The figure in docs/exact.md is what the program draws.

#[allow(dead_code)] // its `main`
#[path = "../examples/march_figure.rs"]
mod march_figure;

use glam::DVec2;
use prismarch::prism::{CellFate, Explanation, Fate, LeafTold};

fn told() -> Explanation {
    let told = march_figure::prisms().explain(0, &march_figure::ray());
    told.expect("a triangle with blocks")
}

fn holds([low, high]: [DVec2; 2], at: DVec2) -> bool {
    at.cmpge(low).all() && at.cmple(high).all()
}

#[test]
fn what_is_told_is_what_the_march_finds() {
    let (prisms, ray) = (march_figure::prisms(), march_figure::ray());
    let hits = (0..prisms.len() as u32).filter_map(|primitive| prisms.intersect(primitive, &ray));
    let found = hits.map(|hit| hit.t).fold(f32::INFINITY, f32::min);
    let hit = told().hit.unwrap();
    assert_eq!(hit.t as f32, found);
    let height = prisms.surface().map().sample(hit.texel).height;
    assert!((hit.height - height).abs() < 1e-6);
}

#[test]
fn the_cell_with_the_hit_is_told() {
    let told = told();
    let at = told.hit.unwrap().texel;
    let block = told
        .blocks
        .iter()
        .find(|block| holds(block.texels, at))
        .unwrap();
    assert_eq!(block.fate, Fate::Entered);
    let part = block
        .parts
        .iter()
        .find(|part| holds(part.texels, at))
        .unwrap();
    assert_eq!(part.fate, Fate::Entered);
    let is_here = |leaf: &&LeafTold| holds(leaf.part.texels, at);
    let leaf = block.leaves.iter().find(is_here).unwrap();
    assert_eq!((leaf.part.fate, leaf.vertices.len()), (Fate::Entered, 45));
    let from = (at - leaf.part.texels[0]).floor();
    let cell = [from.x as usize, from.y as usize];
    let cell = leaf.cells.iter().find(|told| told.cell == cell).unwrap();
    assert_ne!(cell.fate, CellFate::Missed);
}

#[test]
fn where_the_ray_is_near_the_surface_the_march_has_looked() {
    let told = told();
    let (prisms, hit) = (march_figure::prisms(), told.hit.unwrap());
    for point in told.path.iter().filter(|point| point.t < hit.t) {
        let leaves = told.blocks.iter().flat_map(|block| &block.leaves);
        let under = leaves.filter(|leaf| holds(leaf.part.texels, point.texel));
        for leaf in under.filter(|leaf| leaf.part.fate == Fate::Missed) {
            let [low, high] = leaf.part.heights;
            assert!(point.height < low || point.height > high, "{point:?}");
        }
        assert!(point.height > prisms.surface().map().sample(point.texel).height);
    }
}

#[test]
fn the_committed_figure_is_what_the_march_does_now() {
    let committed = std::fs::read_to_string(march_figure::PATH).unwrap();
    assert!(
        committed == march_figure::draw(),
        "docs/images/march.svg is out of date: cargo run --release --example march_figure"
    );
}
