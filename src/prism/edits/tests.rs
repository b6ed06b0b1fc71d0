use super::*;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::prism::{EditBounds, March, MovingPrisms, PrismOptions, Step};
use crate::ray::Aabb;
use crate::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, MovingSurface, NormalMode, Seams,
    TexelBox, Texels, TimeStep, UvTransform, Wrap,
};

const MARCHES: [March; 2] = [
    March::Exact,
    March::Uniform {
        step: Step::Texels(1.0),
        jitter: false,
    },
];

/// 16 x 16 squares of two triangles over the unit square, a map of 64 x 64 once over all of it.
fn sheet(texels: Texels, wrap: Wrap) -> Arc<DisplacedSurface> {
    const SIDE: u32 = 16;
    let mut builder = MeshBuilder::default();
    for j in 0..=SIDE {
        for i in 0..=SIDE {
            let st = Vec2::new(i as f32, j as f32) / SIDE as f32;
            builder.positions.push(st.extend(0.0));
            builder.normals.push(Vec3::Z);
            builder.texcoords.push(st);
        }
    }
    for j in 0..SIDE {
        for i in 0..SIDE {
            let a = j * (SIDE + 1) + i;
            let (b, c, d) = (a + 1, a + SIDE + 1, a + SIDE + 2);
            builder.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    let mesh = builder.build(NormalMode::File).unwrap().0;
    let map = DisplacementMap::new(64, 64, texels, wrap).unwrap();
    let displacement = Displacement {
        scale: -0.3,
        midlevel: 0.25,
        uv: UvTransform::default(),
    };
    Arc::new(DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap())
}

/// Over a map of 150 x 90: two triangles of several periods, one across an edge that many texels are between, one of less than a
/// texel, and one that meets none of them.
fn patchwork(wrap: Wrap, seams: Seams) -> Arc<DisplacedSurface> {
    let corners = |x: f32, y: f32, size: f32| {
        [[0.0, 0.0], [size, 0.0], [0.0, size]].map(|[dx, dy]| Vec2::new(x + dx, y + dy))
    };
    let texcoords = [
        corners(-1.3, -0.6, 2.7),
        [
            Vec2::new(1.4, -0.6),
            Vec2::new(1.4, 2.1),
            Vec2::new(-1.3, 2.1),
        ],
        corners(0.93, 0.9, 0.2),
        corners(0.5, 0.5, 0.005),
        corners(0.1, 0.1, 0.3),
    ];
    let places = [
        corners(0.0, 0.0, 1.0),
        [Vec2::X, Vec2::ONE, Vec2::Y],
        corners(2.0, 0.0, 1.0),
        corners(4.0, 0.0, 1.0),
        corners(6.0, 0.0, 1.0),
    ];
    let vertices = places.as_flattened().len() as u32;
    let builder = MeshBuilder {
        positions: places
            .as_flattened()
            .iter()
            .map(|p| p.extend(0.0))
            .collect(),
        normals: vec![Vec3::Z; vertices as usize],
        texcoords: texcoords.as_flattened().to_vec(),
        triangles: (0..vertices / 3)
            .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect(),
    };
    let mesh = builder.build(NormalMode::File).unwrap().0;
    let map = DisplacementMap::new(150, 90, Texels::U16(vec![20_000; 150 * 90]), wrap).unwrap();
    let surface =
        DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(0.3)).unwrap();
    Arc::new(surface.with_seams(seams))
}

/// Ever wilder rectangles, over edges of the map too; low in the first half, then high.
fn wild_edits() -> impl Iterator<Item = (TexelRect, u16)> {
    let mut random = random_numbers(7);
    let mut below = move |n: usize| (random() * n as f32) as usize;
    (0..60u16).map(move |k| {
        let (x, y) = (below(150), below(90));
        let rect = TexelRect {
            x: if k % 5 == 0 { 0 } else { x },
            y: if k % 7 == 0 { 89 } else { y },
            width: 1 + below(8),
            height: 1 + below(8),
        };
        let rect = TexelRect {
            width: rect.width.min(150 - rect.x),
            height: rect.height.min(90 - rect.y),
            ..rect
        };
        (
            rect,
            if k < 30 {
                20_000 - 500 * k
            } else {
                20_000 + 700 * k
            },
        )
    })
}

fn set(map: &DisplacementMap, rect: TexelRect, height: u16) {
    let texels = Texels::U16(vec![height; rect.width * rect.height]);
    map.update(rect, &texels).unwrap();
}

const RECT: TexelRect = TexelRect {
    x: 21,
    y: 34,
    width: 3,
    height: 2,
};

fn edit(prisms: &Prisms, texels: Texels) -> BoundsChange {
    prisms.surface().map().update(RECT, &texels).unwrap();
    prisms.map_edited(RECT)
}

fn made(surface: &Arc<DisplacedSurface>, march: March, edit_bounds: EditBounds) -> Prisms {
    let options = PrismOptions {
        march,
        edit_bounds,
        ..PrismOptions::default()
    };
    Prisms::new(surface.clone(), options).unwrap()
}

/// Every primitive's box holds what it has of the surface. (Boxes made anew may be larger: they are of whole leaves of the map, also
/// where the triangle is in a part of one alone.)
fn assert_holds(prisms: &Prisms) {
    holds_surface(prisms, |primitive| prisms.bounds(primitive));
}

fn holds_surface(prisms: &Prisms, bounds: impl Fn(u32) -> Aabb) {
    let surface = prisms.surface();
    let triangles = surface.mesh().triangles().len() as u32;
    let mut random = random_numbers(3);
    for triangle in 0..triangles {
        let texels = surface.patch(triangle).texels;
        let primitives = prisms.primitives_of(triangle);
        for _ in 0..4096 / triangles.min(1024) {
            let [u, v] = [random(), random()];
            let [u, v] = if u + v > 1.0 {
                [1.0 - u, 1.0 - v]
            } else {
                [u, v]
            };
            let (p, q) = (f64::from(u), f64::from(v));
            let texel = texels[0] * (1.0 - p - q) + texels[1] * p + texels[2] * q;
            let point = surface.point(triangle, u, v).position;
            for &primitive in &primitives {
                let TexelBox { low, high } = prisms.part(primitive).1;
                if texel.cmpge(low).all() && texel.cmple(high).all() {
                    let bounds = bounds(primitive);
                    let off = (bounds.min - point).max(point - bounds.max).max_element();
                    assert!(off < 1e-6, "{off} at {u}, {v} of {triangle}: {primitive}");
                }
            }
        }
    }
}

/// From 0 to 1.
fn random_numbers(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let x = (state ^ (state >> 16)).wrapping_mul(0x9e37_79b9);
        (x >> 8) as f32 / (1 << 24) as f32
    }
}

#[test]
fn tight_bounds_grow_where_they_must_and_only_there() {
    for march in MARCHES {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let surface = sheet(Texels::U8(vec![100; 64 * 64]), wrap);
            let prisms = made(&surface, march, EditBounds::Tight);
            let before: Vec<_> = (0..prisms.len() as u32).map(|p| prisms.bounds(p)).collect();

            let change = edit(&prisms, Texels::U8(vec![200; 6]));
            assert!((1..=12).contains(&change.touched), "{change:?}");
            assert!(change.any() && prisms.growths() == 1);
            for (primitive, before) in (0u32..).zip(&before) {
                let grown = change.primitives.contains(&primitive);
                assert_eq!(prisms.bounds(primitive) != *before, grown, "{primitive}");
            }
            assert_holds(&prisms);

            // Back, and anything between: there is room.
            for height in [100, 150, 200] {
                let change = edit(&prisms, Texels::U8(vec![height; 6]));
                assert!(!change.any() && change.touched > 0, "{change:?}");
            }
            assert!(edit(&prisms, Texels::U8(vec![99; 6])).any());
            assert_eq!(prisms.growths(), 2);
            assert_holds(&prisms);
        }
    }
}

#[test]
fn with_the_whole_range_integer_maps_never_make_bounds_grow() {
    for march in MARCHES {
        let surface = sheet(Texels::U16(vec![30_000; 64 * 64]), Wrap::Repeat);
        let prisms = made(&surface, march, EditBounds::Range);
        for height in [0, 65_535, 3] {
            let change = edit(&prisms, Texels::U16(vec![height; 6]));
            assert_eq!(change, BoundsChange::default());
            assert_holds(&prisms);
        }
        assert_eq!(prisms.growths(), 0);
    }
}

#[test]
fn with_the_whole_range_float_maps_make_bounds_grow_beyond_it() {
    for march in MARCHES {
        let mut heights = vec![0.0; 64 * 64];
        heights[5] = 1.0;
        let surface = sheet(Texels::F32(heights), Wrap::Repeat);
        let prisms = made(&surface, march, EditBounds::Range);
        assert!(!edit(&prisms, Texels::F32(vec![1.0; 6])).any());
        let change = edit(&prisms, Texels::F32(vec![2.0; 6]));
        assert!(change.any() && change.touched > 0);
        assert_holds(&prisms);
        assert!(!edit(&prisms, Texels::F32(vec![1.5; 6])).any());
        assert!(edit(&prisms, Texels::F32(vec![-7.0; 6])).any());
        assert_holds(&prisms);
    }
}

#[test]
fn blocks_grow_through_every_wrap_and_only_where_they_are_edited() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for seams in [Seams::Open, Seams::Closed] {
            let surface = patchwork(wrap, seams);
            let prisms = made(&surface, March::Exact, EditBounds::Tight);
            let boxes = || (0..prisms.len() as u32).map(|p| prisms.bounds(p));
            assert!(prisms.len() > 60, "{}", prisms.len());
            let (mut grown, mut edits) = (0, 0);
            for (rect, height) in wild_edits() {
                let before: Vec<_> = boxes().collect();
                set(surface.map(), rect, height);
                let change = prisms.map_edited(rect);
                let pairs = boxes().zip(&before).zip(0u32..);
                let changed = pairs.filter(|((now, before), _)| now != *before);
                let changed: Vec<u32> = changed.map(|(_, primitive)| primitive).collect();
                assert_eq!(change.primitives, changed, "{wrap:?} {seams:?} {rect}");
                assert_holds(&prisms);
                grown += changed.len();
                edits += 1;
            }
            // Each texel is in some nine blocks of the large triangles.
            assert!(grown > edits && grown < 30 * edits, "{wrap:?} {grown}");
        }
    }
}

/// Their boxes are made of a triangle's whole range: so all of a triangle's grow where that does.
#[test]
fn boxes_of_moving_prisms_that_grow_are_all_named() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let surface = patchwork(wrap, Seams::Open);
        let mesh = surface.mesh();
        let raised = TimeStep {
            positions: mesh
                .positions()
                .iter()
                .map(|p| *p + 0.5 * Vec3::Z)
                .collect(),
            normals: mesh.normals().to_vec(),
        };
        let moving = Arc::new(MovingSurface::new(surface.clone(), vec![raised]).unwrap());
        let prisms = MovingPrisms::new(moving.clone(), March::Exact).unwrap();
        let boxes = |prisms: &MovingPrisms| -> Vec<_> {
            let steps = |p| [prisms.bounds(p, 0), prisms.bounds(p, 1)];
            (0..prisms.len() as u32).map(steps).collect()
        };
        let mut all_of_one = 0;
        for (rect, height) in wild_edits() {
            let before = boxes(&prisms);
            set(surface.map(), rect, height);
            let change = prisms.map_edited(rect);
            let now = boxes(&prisms);
            let changed = (0..prisms.len()).filter(|&p| now[p] != before[p]);
            let changed: Vec<u32> = changed.map(|p| p as u32).collect();
            assert_eq!(change.primitives, changed, "{wrap:?} {rect}");
            all_of_one = all_of_one.max(changed.len());
            holds_surface(prisms.at_start(), |primitive| prisms.bounds(primitive, 0));
        }
        assert!(all_of_one > 30, "{all_of_one}");
    }
}

/// An edit on a mesh of very many triangles looks at few of them.
#[test]
fn a_large_mesh_is_not_searched() {
    const SIDE: u32 = 400;
    let mut builder = MeshBuilder::default();
    for j in 0..=SIDE {
        for i in 0..=SIDE {
            let st = Vec2::new(i as f32, j as f32) / SIDE as f32;
            builder.positions.push(st.extend(0.0));
            builder.normals.push(Vec3::Z);
            builder.texcoords.push(st);
        }
    }
    for j in 0..SIDE {
        for i in 0..SIDE {
            let a = j * (SIDE + 1) + i;
            let (b, c, d) = (a + 1, a + SIDE + 1, a + SIDE + 2);
            builder.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    let mesh = builder.build(NormalMode::File).unwrap().0;
    let map = DisplacementMap::new(64, 64, Texels::U8(vec![9; 64 * 64]), Wrap::Repeat).unwrap();
    let surface = DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(0.1));
    let surface = Arc::new(surface.unwrap());
    for march in MARCHES {
        let prisms = made(&surface, march, EditBounds::Tight);
        let touch = Touch::new(surface.map(), RECT);
        let candidates = match &prisms.parts {
            Parts::Exact(exact) => exact.index.candidates(&touch).count(),
            Parts::Uniform(uniform) => uniform.index.candidates(&touch).count(),
        };
        assert!(candidates < 20_000, "{candidates} of {}", prisms.len());
        // Six texels by five of a triangle's 0.16.
        let touched = edit(&prisms, Texels::U8(vec![200; 6])).touched;
        assert!((900..2000).contains(&touched), "{touched}");
    }
}

/// What edits have widened becomes what new prisms have, and holds what edits do afterwards.
#[test]
fn tightened_bounds_are_those_of_new_prisms() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let surface = patchwork(wrap, Seams::Open);
        let map = surface.map().clone();
        let new = || Prisms::new(surface.clone(), March::Exact).unwrap();
        let all = |prisms: &Prisms| -> Vec<Aabb> {
            (0..prisms.len() as u32).map(|p| prisms.bounds(p)).collect()
        };
        let prisms = new();
        let mut were_loose = 0;
        for (k, (rect, texel)) in wild_edits().enumerate() {
            // Back and forth.
            let texel = if k % 3 == 0 { 20_000 } else { texel };
            let texels = Texels::U16(vec![texel; rect.width * rect.height]);
            map.update(rect, &texels).unwrap();
            prisms.map_edited(rect);
            if k % 4 == 3 {
                let blocks = all(&new());
                were_loose += usize::from(all(&prisms) != blocks);
                prisms.tighten();
                let others = not_blocks(&prisms);
                for (primitive, (is, new)) in (0u32..).zip(all(&prisms).iter().zip(&blocks)) {
                    // Roundings are a part of the map's largest height, at the time.
                    let off = (new.min - is.min).max(is.max - new.max);
                    let most = off.max_element();
                    assert!(off.min_element() > -1e-6, "{wrap:?} {k} {primitive}: {off}");
                    // A triangle's range of heights is not taken back.
                    let is_block = !others.contains(&primitive);
                    assert!(!is_block || most < 1e-4, "{wrap:?} {k} {primitive}: {most}");
                }
            }
        }
        assert!(were_loose > 5, "{were_loose}");
    }
}

/// Texels that nobody has been told of: what they make grow is told when they are, and not swallowed by who takes bounds anew.
#[test]
fn tightening_tells_of_nothing() {
    let surface = patchwork(Wrap::Repeat, Seams::Open);
    let map = surface.map().clone();
    let prisms = Prisms::new(surface.clone(), March::Exact).unwrap();
    let rect = TexelRect {
        x: 40,
        y: 30,
        width: 3,
        height: 3,
    };
    let set = |texel: u16| map.update(rect, &Texels::U16(vec![texel; 9])).unwrap();
    set(30_000);
    let first = prisms.map_edited(rect);
    for texel in [40_000, 50_000] {
        set(texel);
        prisms.tighten();
        assert_eq!(prisms.map_edited(rect).primitives, first.primitives);
        assert_holds(&prisms);
    }
    assert!(first.any());
    prisms.tighten();
    assert!(!prisms.map_edited(rect).any());
}

/// The primitives that are no blocks.
fn not_blocks(prisms: &Prisms) -> Vec<u32> {
    let Parts::Exact(exact) = &prisms.parts else {
        panic!("the exact march's");
    };
    let all = 0..prisms.len() as u32;
    let is_block = |p: &u32| matches!(exact.primitive(*p), Primitive::Block(_));
    all.filter(|p| !is_block(p)).collect()
}
