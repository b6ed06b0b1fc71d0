//! What primitives there are, and that their boxes hold what they are of the surface.

use std::sync::Arc;

use glam::{Vec2, vec3};

use super::*;
use crate::prism::March;
use crate::prism::kernel::outline;
use crate::prism::simd::Portable;
use crate::surface::{Displacement, MeshBuilder, NormalMode, Seams, Texels, UvTransform, Wrap};

/// Numbers in [0, 1).
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let x = (self.0 >> ((self.0 >> 28) + 4) ^ self.0).wrapping_mul(277_803_737);
        ((x >> 22 ^ x) >> 8) as f32 / (1 << 24) as f32
    }

    fn signed(&mut self) -> f32 {
        2.0 * self.next() - 1.0
    }
}

/// 4 x 4 squares of two triangles, bent, over a map of noise that is repeated `repeats` times; the last triangle has
/// texture coordinates without an area.
fn sheet(wrap: Wrap, repeats: f32) -> DisplacedSurface {
    const SIDE: usize = 4;
    let mut random = Random(7);
    let mut builder = MeshBuilder::default();
    let mut corner = |i: usize, j: usize| {
        let st = Vec2::new(i as f32, j as f32) / SIDE as f32;
        let bent = 0.4 * st - 0.2;
        builder.positions.push(vec3(st.x, st.y, 0.2 * st.x * st.y));
        builder.normals.push(vec3(bent.x, bent.y, 1.0).normalize());
        builder.texcoords.push(repeats * st - 0.13);
    };
    for j in 0..SIDE {
        for i in 0..SIDE {
            for (a, b) in [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)] {
                corner(i + a, j + b);
            }
        }
    }
    let last = builder.texcoords.len() - 1;
    builder.texcoords[last] = builder.texcoords[last - 1];
    builder.triangles = (0..2 * (SIDE * SIDE) as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    let (mesh, _) = builder.build(NormalMode::File).unwrap();
    let (width, height) = (75, 50);
    let texels = (0..width * height).map(|_| (random.next() * 65535.0) as u16);
    let map = DisplacementMap::new(width, height, Texels::U16(texels.collect()), wrap).unwrap();
    let displacement = Displacement {
        scale: 0.1,
        midlevel: 0.3,
        uv: UvTransform::default(),
    };
    DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap()
}

fn exact(prisms: &Prisms) -> &ExactPrisms {
    let Parts::Exact(exact) = &prisms.parts else {
        panic!("the exact march has exact prisms");
    };
    exact
}

fn sheets() -> impl Iterator<Item = (DisplacedSurface, Seams)> {
    let wraps = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
    wraps.into_iter().flat_map(|wrap| {
        [(0.3, Seams::Open), (1.7, Seams::Closed), (6.0, Seams::Open)]
            .map(|(repeats, seams)| (sheet(wrap, repeats).with_seams(seams), seams))
    })
}

#[test]
fn primitives_of_a_triangle_are_all_that_name_it() {
    for (surface, seams) in sheets() {
        let triangles = surface.mesh().triangles().len() as u32;
        let prisms = Prisms::new(Arc::new(surface), March::Exact).unwrap();
        let exact = exact(&prisms);
        assert_eq!(prisms.len(), exact.len());
        let mut seen = vec![false; prisms.len()];
        for triangle in 0..triangles {
            let of = |p: &u32| exact.primitive(*p).triangle() == triangle;
            let all: Vec<u32> = (0..prisms.len() as u32).filter(of).collect();
            let found: Vec<u32> = exact.primitives_of(triangle).collect();
            assert_eq!(found, all, "{triangle}");
            found.iter().for_each(|&p| seen[p as usize] = true);
            let kinds = found.iter().map(|&p| exact.primitive(p));
            let (mut blocks, mut wholes, mut walls) = (0, 0, 0);
            for kind in kinds {
                match kind {
                    Primitive::Block(_) => blocks += 1,
                    Primitive::Whole(_) => wholes += 1,
                    Primitive::Walls(_) => walls += 1,
                }
            }
            // Blocks, or itself; the last has no area of texels.
            assert!((blocks > 0) != (wholes == 1), "{triangle}");
            assert!(wholes == 0 || triangle == triangles - 1, "{triangle}");
            let has_walls = !prisms.surface().walls_of(triangle).is_empty();
            assert_eq!(walls, u32::from(has_walls));
            assert!(!has_walls || seams == Seams::Closed);
        }
        assert!(seen.iter().all(|&seen| seen));
    }
}

/// A random point of the triangle, near its sides now and then.
fn place(random: &mut Random) -> [f64; 2] {
    let (a, b) = (random.next(), random.next() * random.next());
    let (u, v) = if a + b > 1.0 {
        (1.0 - a, 1.0 - b)
    } else {
        (a, b)
    };
    [u, v].map(f64::from)
}

#[test]
fn boxes_hold_what_the_primitive_is_of_the_surface_and_together_all_of_it() {
    for (surface, _) in sheets() {
        let prisms = Prisms::new(Arc::new(surface), March::Exact).unwrap();
        let (exact, surface) = (exact(&prisms), prisms.surface());
        let mut random = Random(3);
        for triangle in 0..surface.mesh().triangles().len() as u32 {
            let patch = surface.patch(triangle);
            for _ in 0..2000 {
                let [u, v] = place(&mut random);
                let (at, texel) = (patch.point(u, v).position, patch.texel(u, v));
                let mut held = 0;
                for primitive in exact.primitives_of(triangle) {
                    let (_, part) = exact.part(surface.map(), primitive);
                    if texel.cmpge(part.low).all() && texel.cmple(part.high).all() {
                        held += 1;
                        let bounds = prisms.bounds(primitive);
                        let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
                        let is_held = at.cmpge(low).all() && at.cmple(high).all();
                        assert!(is_held, "{at} outside {bounds:?} of {primitive}");
                    }
                }
                assert!(held > 0, "no primitive has {texel} of {triangle}");
            }
        }
    }
}

#[test]
fn boxes_of_walls_hold_them() {
    let surface = sheet(Wrap::Repeat, 1.7).with_seams(Seams::Closed);
    let prisms = Prisms::new(Arc::new(surface), March::Exact).unwrap();
    let exact = exact(&prisms);
    let (surface, mut random) = (prisms.surface(), Random(5));
    let triangles = surface.mesh().triangles().len() as u32;
    for (index, wall) in (0u32..).zip(surface.walls()) {
        let walls = exact
            .primitives_of(wall.triangle)
            .find(|&p| matches!(exact.primitive(p), Primitive::Walls(_)));
        let bounds = prisms.bounds(walls.expect("a primitive for the walls"));
        for _ in 0..200 {
            let point = prisms.point(triangles + index, random.next(), random.next());
            let at = point.position;
            let is_held = at.cmpge(bounds.min).all() && at.cmple(bounds.max).all();
            assert!(is_held, "{at} outside {bounds:?} of {wall:?}");
        }
    }
}

#[test]
fn a_triangle_of_normals_that_turn_by_much_is_one_primitive() {
    let builder = MeshBuilder {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z, vec3(1.0, 0.0, -0.2).normalize(), Vec3::Y],
        texcoords: vec![Vec2::ZERO, 0.2 * Vec2::X, 0.2 * Vec2::Y],
        triangles: vec![[0, 1, 2]],
    };
    let (mesh, _) = builder.build(NormalMode::File).unwrap();
    let map = sheet(Wrap::Repeat, 1.0).map().clone();
    let surface = DisplacedSurface::new(Arc::new(mesh), map, Displacement::new(0.05)).unwrap();
    let prisms = Prisms::new(Arc::new(surface), March::Exact).unwrap();
    assert_eq!(prisms.len(), 1);
    assert_eq!(exact(&prisms).primitive(0), Primitive::Whole(0));
    let mut random = Random(1);
    let patch = prisms.surface().patch(0);
    let bounds = prisms.bounds(0);
    for _ in 0..1000 {
        let [u, v] = place(&mut random);
        let at = patch.point(u, v).position.as_vec3();
        assert!(at.cmpge(bounds.min).all() && at.cmple(bounds.max).all());
        let off = vec3(random.signed(), random.signed(), random.signed());
        let ray = Ray::new(at - 2.0 * off, off);
        let hit = prisms.intersect(0, &ray).map(|hit| hit.t);
        // Rounding may move a ray past the triangle's rim.
        let is_on_rim = u.min(v).min(1.0 - u - v) < 1e-3;
        assert!(
            is_on_rim || hit.is_some_and(|t| t < 2.0 + 1e-4),
            "{ray:?} {hit:?}"
        );
    }
}

/// Normals of an icosahedron's corners: few texels are one primitive, more are blocks in which N' changes by up to [`Cutter`]'s limit.
#[test]
fn triangles_of_normals_that_turn_by_less_are_blocks() {
    let mut random = Random(5);
    let mut least = f32::INFINITY;
    for texels in [40.0, 60.0, 80.0, 100.0, 130.0, 250.0] {
        let builder = MeshBuilder {
            positions: vec![Vec3::ZERO, Vec3::X, vec3(0.5, 0.8, 0.0)],
            normals: vec![
                vec3(-0.52, -0.3, 0.8).normalize(),
                vec3(0.52, -0.3, 0.8).normalize(),
                vec3(0.0, 0.6, 0.8).normalize(),
            ],
            texcoords: vec![
                Vec2::ZERO,
                texels / 256.0 * Vec2::X,
                texels / 256.0 * vec3(0.4, 0.9, 0.0).truncate(),
            ],
            triangles: vec![[0, 1, 2]],
        };
        let (mesh, _) = builder.build(NormalMode::File).unwrap();
        let heights = (0..256 * 256).map(|_| (random.next() * 65535.0) as u16);
        let map = DisplacementMap::new(256, 256, Texels::U16(heights.collect()), Wrap::Repeat);
        let surface = DisplacedSurface::new(
            Arc::new(mesh),
            Arc::new(map.unwrap()),
            Displacement::new(0.05),
        );
        let prisms = Prisms::new(Arc::new(surface.unwrap()), March::Exact).unwrap();
        let all = 0..prisms.len() as u32;
        if exact(&prisms).primitive(0) != Primitive::Whole(0) {
            least = least.min(texels);
        }
        let patch = prisms.surface().patch(0);
        let mut hits = 0;
        for _ in 0..400 {
            let [u, v] = place(&mut random);
            let at = patch.point(u, v).position.as_vec3();
            let off = vec3(random.signed(), random.signed(), random.next() + 0.2);
            let ray = Ray::new(at + 2.0 * off, -off);
            let frame = RayFrame::new(&ray, axes(&ray));
            let question = Question {
                patch: &patch,
                range: [0.0, 0.1],
                frame: &frame,
                interval: [ray.tnear, ray.tfar],
                any: false,
            };
            let truth = within::<Portable>(&question, &Cells::ALL).map(|found| found.t as f32);
            let found = all.clone().filter_map(|p| prisms.intersect(p, &ray));
            let nearest = found.map(|hit| hit.t).min_by(f32::total_cmp);
            hits += usize::from(truth.is_some());
            let is_same = match (truth, nearest) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-6,
                (a, b) => a.is_some() == b.is_some(),
            };
            assert!(is_same, "{texels} {ray:?}: {truth:?} {nearest:?}");
        }
        assert!(hits > 300, "{hits}");
    }
    assert!((60.0..=130.0).contains(&least), "{least}");
}

/// A triangle, 3000 texels across, over maps of a few texels.
#[test]
fn small_maps_that_repeat_without_end_take_no_memory() {
    for (width, height) in [(1, 1), (2, 3), (1, 64), (33, 1)] {
        let repeats = Vec2::new(3000.0 / width as f32, 3000.0 / height as f32);
        let builder = MeshBuilder {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            texcoords: vec![Vec2::ZERO, repeats * Vec2::X, repeats * Vec2::Y],
            triangles: vec![[0, 1, 2]],
        };
        let (mesh, _) = builder.build(NormalMode::File).unwrap();
        let texels = Texels::U8((0..width * height).map(|k| k as u8).collect());
        let map = DisplacementMap::new(width, height, texels, Wrap::Repeat).unwrap();
        let surface = DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(0.1));
        let prisms = Prisms::new(Arc::new(surface.unwrap()), March::Exact).unwrap();
        assert!(prisms.len() <= 65_536, "{width} {height}: {}", prisms.len());
        let ray = Ray::new(vec3(0.3, 0.3, 1.0), Vec3::NEG_Z);
        let all = 0..prisms.len() as u32;
        assert!(
            all.map(|p| prisms.intersect(p, &ray))
                .any(|hit| hit.is_some())
        );
    }
}

#[test]
fn more_primitives_than_can_be_numbered_are_an_error() {
    let surface = sheet(Wrap::Repeat, 1.7);
    let made = |max| ExactPrisms::limited(&surface, EditBounds::Tight, outline(), max);
    let count = ExactPrisms::new(&surface, EditBounds::Tight, outline())
        .unwrap()
        .len();
    assert_eq!(made(count).map(|made| made.len()), Ok(count));
    for max in [0, 1, count - 1] {
        assert_eq!(made(max).err(), Some(MarchError::TooManyPrimitives { max }));
    }
}
