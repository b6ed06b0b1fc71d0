//! Blocks of random triangles, maps and rectangles, against all of the triangle and against samples of S.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec2, Vec3};

use super::*;
use crate::ray::Aabb;
use crate::surface::{
    ClosestPoint, DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, MovingSurface,
    NormalMode, PointQuery, Texels, TimeStep, Wrap,
};

struct Numbers(u64);

impl Numbers {
    /// From 0 to 1.
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(99);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.number()
    }

    fn below(&mut self, n: usize) -> usize {
        (self.number() * n as f64) as usize
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::from_array([(); 3].map(|()| self.between(-1.0, 1.0) as f32))
    }

    /// (u, v).
    fn place(&mut self) -> DVec2 {
        let [a, b] = [self.number(), self.number()];
        if a + b > 1.0 {
            DVec2::new(1.0 - a, 1.0 - b)
        } else {
            DVec2::new(a, b)
        }
    }
}

/// Normals about z that lean by `lean`, up to the opposite ones.
fn normals(numbers: &mut Numbers, lean: f32) -> Vec<Vec3> {
    let leaning = |_| (Vec3::Z + lean * numbers.vector()).normalize_or(Vec3::Z);
    (0..3).map(leaning).collect()
}

/// One triangle, with normals that lean by `lean` and about `texels` texels across.
fn surface(numbers: &mut Numbers, lean: f32, texels: f32) -> Arc<DisplacedSurface> {
    let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][numbers.below(3)];
    let (width, height) = (1 + numbers.below(40), 1 + numbers.below(40));
    let heights = (0..width * height).map(|_| (numbers.number() * 65535.0) as u16);
    let map = DisplacementMap::new(width, height, Texels::U16(heights.collect()), wrap).unwrap();
    // Now and then a sliver, in the world or in the map.
    let [thin, narrow] = [(); 2].map(|()| if numbers.below(5) == 0 { 1e-4 } else { 1.0 });
    let side = |numbers: &mut Numbers| numbers.between(0.3, 1.0) as f32;
    let (a, b) = (side(numbers), thin * side(numbers));
    let along = Vec2::new(side(numbers), numbers.between(-1.0, 1.0) as f32);
    let aside = narrow * along.perp() + side(numbers) * along;
    let corner = 3.0 * numbers.vector().truncate();
    let per_texel = texels / Vec2::new(width as f32, height as f32);
    let mesh = MeshBuilder {
        positions: vec![
            Vec3::ZERO,
            Vec3::new(a, 0.0, 0.1),
            Vec3::new(0.5 * a, b, 0.0),
        ],
        normals: normals(numbers, lean),
        texcoords: vec![
            corner,
            corner + along * per_texel,
            corner + aside * per_texel,
        ],
        triangles: vec![[0, 1, 2]],
    };
    let (mesh, _) = mesh.build(NormalMode::File).unwrap();
    let displacement = Displacement {
        midlevel: numbers.number() as f32,
        ..Displacement::new(numbers.between(-0.4, 0.4) as f32)
    };
    Arc::new(DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap())
}

/// Rectangles that hold all texel coordinates of a triangle between them, cut anywhere and at texels.
fn blocks(numbers: &mut Numbers, patch: &Patch<'_>) -> Vec<TexelBox> {
    let [low, high] = Polygon::of(patch, &TexelBox::EVERYWHERE).texels();
    let cuts = [0, 1].map(|axis| {
        let mut cuts = vec![f64::NEG_INFINITY];
        for _ in 0..numbers.below(4) {
            let cut = numbers.between(low[axis], high[axis]);
            cuts.push(if numbers.below(2) == 0 {
                cut.round()
            } else {
                cut
            });
        }
        cuts.push(f64::INFINITY);
        cuts.sort_by(f64::total_cmp);
        cuts
    });
    let side = |axis: usize| cuts[axis].windows(2).map(|pair| [pair[0], pair[1]]);
    let columns = side(0).flat_map(|x| side(1).map(move |y| (x, y)));
    let rectangle = |([left, right], [bottom, top]): ([f64; 2], [f64; 2])| TexelBox {
        low: DVec2::new(left, bottom),
        high: DVec2::new(right, top),
    };
    columns.map(rectangle).collect()
}

/// Places of a block's part of a triangle.
fn samples(numbers: &mut Numbers, patch: &Patch<'_>, block: &TexelBox, count: usize) -> Vec<DVec2> {
    let polygon = Polygon::of(patch, block);
    let mut places: Vec<_> = polygon.places().collect();
    let triangles: Vec<_> = polygon.triangles().collect();
    for _ in 0..if triangles.is_empty() { 0 } else { count } {
        let [a, b, c] = triangles[numbers.below(triangles.len())];
        let place = numbers.place();
        places.push(a + place.x * (b - a) + place.y * (c - a));
    }
    places
}

fn position(patch: &Patch<'_>, b: DVec2) -> DVec3 {
    patch.point(b.x, b.y).position
}

/// Whether two answers are the same up to what the search leaves open.
fn agree(a: Option<ClosestPoint>, b: Option<ClosestPoint>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => (a.distance - b.distance).abs() <= 3e-6 * a.distance + 2e-6,
        (a, b) => a.is_none() && b.is_none(),
    }
}

#[test]
fn the_nearest_of_blocks_is_the_triangles() {
    let mut numbers = Numbers(1);
    for _ in 0..400 {
        let (lean, texels) = (numbers.between(0.0, 2.0), numbers.between(0.1, 40.0));
        let surface = surface(&mut numbers, lean as f32, texels as f32);
        let patch = surface.patch(0);
        let blocks = blocks(&mut numbers, &patch);
        for _ in 0..4 {
            let query = PointQuery::new(numbers.vector(), f32::INFINITY);
            let whole = surface.closest([0], &query);
            let mut best: Option<ClosestPoint> = None;
            for block in &blocks {
                let found = surface.closest_in([(0, *block)], &query);
                let polygon = Polygon::of(&patch, block);
                assert_eq!(found.is_none(), polygon.triangles().next().is_none());
                let Some(found) = found else { continue };
                let texel = patch.texel(found.u.into(), found.v.into());
                // (u, v) are of single precision.
                let off = 1e-6 * (1.0 + texels);
                let held =
                    texel.cmpge(block.low - off).all() && texel.cmple(block.high + off).all();
                assert!(held, "{texel} of {block:?}");
                for b in samples(&mut numbers, &patch, block, 60) {
                    let distance = position(&patch, b).distance(query.point.as_dvec3());
                    let least = f64::from(found.distance) * (1.0 - 2e-6) - 1e-6;
                    assert!(distance >= least, "{distance} at {b}, but {found:?}");
                }
                if best.is_none_or(|best| found.distance < best.distance) {
                    best = Some(found);
                }
            }
            assert!(agree(whole, best), "{whole:?} {best:?}");
            let at_once = surface.closest_in(blocks.iter().map(|&block| (0, block)), &query);
            assert!(agree(whole, at_once), "{whole:?} {at_once:?}");
        }
    }
}

#[test]
fn nothing_is_near_in_a_block_beside_the_triangle() {
    let surface = surface(&mut Numbers(7), 0.3, 8.0);
    let [low, high] = Polygon::of(&surface.patch(0), &TexelBox::EVERYWHERE).texels();
    let beside = TexelBox {
        low: high + 1.0,
        high: high + (high - low),
    };
    let query = PointQuery::new(Vec3::ZERO, f32::INFINITY);
    assert_eq!(surface.closest_in([(0, beside)], &query), None);
    let moving = moving(&mut Numbers(8), &surface, [0.5, 0.1]);
    for step in 0..moving.time_steps() {
        assert_eq!(moving.block_bounds(0, &beside, [0.0, 1.0], step), None);
    }
}

/// Later steps of a triangle: turned by about `turn`, its normals shaken by `shake`.
fn moving(
    numbers: &mut Numbers,
    surface: &Arc<DisplacedSurface>,
    [turn, shake]: [f32; 2],
) -> MovingSurface {
    let mesh = surface.mesh();
    let later = (1..=numbers.below(4)).map(|k| {
        let turned = Quat::from_scaled_axis(turn * k as f32 * numbers.vector());
        let moved = numbers.vector();
        let positions = mesh.positions().iter();
        let mut shaken = |n: &Vec3| turned * (*n + shake * numbers.vector());
        TimeStep {
            normals: mesh.normals().iter().map(&mut shaken).collect(),
            positions: positions.map(|&p| turned * p + moved).collect(),
        }
    });
    MovingSurface::new(surface.clone(), later.collect()).unwrap()
}

#[test]
fn the_nearest_of_blocks_that_move_is_the_triangles() {
    let mut numbers = Numbers(2);
    for _ in 0..100 {
        let surface = surface(&mut numbers, 0.5, 12.0);
        let moving = moving(&mut numbers, &surface, [0.5, 0.1]);
        let blocks = blocks(&mut numbers, &surface.patch(0));
        let query = PointQuery {
            time: numbers.number() as f32,
            ..PointQuery::new(numbers.vector(), f32::INFINITY)
        };
        let whole = moving.closest([0], &query);
        let found = moving.closest_in(blocks.iter().map(|&block| (0, block)), &query);
        assert!(agree(whole, found), "{whole:?} {found:?}");
        let standing = moving.at(query.time).closest([0], &query);
        assert!(agree(whole, standing), "{whole:?} {standing:?}");
    }
}

/// How much longer the boxes' diagonals are than those around samples, in the mean.
#[derive(Default)]
struct Excess {
    boxes: f64,
    samples: f64,
}

impl Excess {
    fn add(&mut self, bounds: &Aabb, around: &Aabb) {
        self.boxes += f64::from(bounds.diagonal());
        self.samples += f64::from(around.diagonal());
    }
}

fn mixed(a: &Aabb, b: &Aabb, f: f64) -> [DVec3; 2] {
    let mix = |a: Vec3, b: Vec3| a.as_dvec3().lerp(b.as_dvec3(), f);
    [mix(a.min, b.min), mix(a.max, b.max)]
}

/// Checks the boxes of a block at all steps by samples of S between them.
fn check(numbers: &mut Numbers, moving: &MovingSurface, block: &TexelBox, excess: &mut Excess) {
    let patch = moving.patch(0, 0.0);
    let [low, high] = Polygon::of(&patch, block).texels();
    let places = samples(numbers, &patch, block, 40);
    if places.is_empty() {
        return;
    }
    let range = patch.displacements(patch.map.range_in_box(low, high));
    let last = moving.time_steps() - 1;
    let boxes = (0..=last).map(|step| moving.block_bounds(0, block, range, step).unwrap());
    let boxes: Vec<_> = boxes.collect();
    for k in 0..12 {
        let time = if k < 3 {
            0.5 * k as f32
        } else {
            numbers.number() as f32
        };
        let at = f64::from(time) * last as f64;
        let (a, b) = (at.floor() as usize, at.ceil() as usize);
        let [min, max] = mixed(&boxes[a], &boxes[b], at.fract());
        let patch = moving.patch(0, time);
        let mut around = Aabb::EMPTY;
        for &b in &places {
            let p = position(&patch, b);
            let held = p.cmpge(min - 1e-12).all() && p.cmple(max + 1e-12).all();
            assert!(held, "{p} at {b}, {time}, outside of {min} {max}");
            around = around.including(p.as_vec3());
        }
        let bounds = Aabb {
            min: min.as_vec3(),
            max: max.as_vec3(),
        };
        excess.add(&bounds, &around);
    }
}

/// The mean excess over random triangles and blocks of `cells` texels.
fn excess(seed: u64, [lean, turn, shake]: [f32; 3], texels: f32, cells: f64) -> f64 {
    let mut numbers = Numbers(seed);
    let mut excess = Excess::default();
    for _ in 0..150 {
        let surface = surface(&mut numbers, lean, texels);
        let moving = moving(&mut numbers, &surface, [turn, shake]);
        for _ in 0..8 {
            let b = numbers.place();
            let corner = surface.patch(0).texel(b.x, b.y).floor();
            let block = TexelBox {
                low: corner,
                high: corner + cells,
            };
            check(&mut numbers, &moving, &block, &mut excess);
        }
    }
    excess.boxes / excess.samples
}

#[test]
fn boxes_hold_what_moves_between_them() {
    let all = f64::INFINITY;
    // Lean of the normals, turn and shake of a step; texels across, cells of a block; the excess that was found, and a little.
    let cases = [
        ([0.0, 0.0, 0.0], 60.0, 8.0, 1.25),
        ([0.3, 0.0, 0.0], 60.0, 8.0, 1.25),
        ([0.3, 0.1, 0.0], 60.0, 8.0, 1.3),
        ([0.3, 0.5, 0.1], 60.0, 8.0, 1.4),
        ([0.3, 0.1, 0.0], 3000.0, 32.0, 1.45),
        ([0.3, 0.1, 0.0], 60.0, all, 1.15),
        ([1.0, 1.0, 0.5], 60.0, 8.0, 1.95),
        ([3.0, 3.0, 3.0], 60.0, 8.0, 2.4),
        ([3.0, 3.0, 3.0], 60.0, all, 1.9),
    ];
    for (seed, (case, texels, cells, most)) in (1..).zip(cases) {
        let found = excess(seed, case, texels, cells);
        println!("{case:?}, {cells} of {texels} texels: {found:.3}");
        assert!(found < most);
    }
}

#[test]
fn normals_that_turn_over_stay_in_their_boxes() {
    let mut numbers = Numbers(4);
    for k in 0..200 {
        let surface = surface(&mut numbers, if k % 2 == 0 { 0.0 } else { 1.0 }, 20.0);
        let mesh = surface.mesh();
        let opposite = TimeStep {
            positions: mesh.positions().to_vec(),
            normals: mesh.normals().iter().map(|&n| -n).collect(),
        };
        let moving = MovingSurface::new(surface.clone(), vec![opposite]).unwrap();
        for block in blocks(&mut numbers, &surface.patch(0)) {
            check(&mut numbers, &moving, &block, &mut Excess::default());
        }
    }
}
