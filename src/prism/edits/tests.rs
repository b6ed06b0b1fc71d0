use super::*;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::prism::{March, PrismOptions, Step};
use crate::surface::{
    DisplacedSurface, Displacement, MeshBuilder, NormalMode, Texels, UvTransform, Wrap,
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

/// Every box of `prisms` holds what its primitive is of the surface.
fn assert_holds(prisms: &Prisms) {
    const SIDE: usize = 12;
    let surface = prisms.surface();
    let mut held = 0;
    for primitive in 0..prisms.len() as u32 {
        let (triangle, texels) = prisms.part(primitive);
        let (patch, bounds) = (surface.patch(triangle), prisms.bounds(primitive));
        for k in 0..SIDE * SIDE {
            let (i, j) = (k % SIDE, k / SIDE);
            let [u, v] = [i, j].map(|i| i as f64 / (SIDE - 1) as f64);
            let texel = patch.texel(u, v);
            if i + j >= SIDE || texel.cmplt(texels.low).any() || texel.cmpgt(texels.high).any() {
                continue;
            }
            let at = patch.point(u, v).position.as_vec3();
            let holds = at.cmpge(bounds.min).all() && at.cmple(bounds.max).all();
            assert!(holds, "{at} outside {bounds:?} of primitive {primitive}");
            held += 1;
        }
    }
    // Each place is in one primitive at least.
    assert!(held >= surface.mesh().triangles().len() * SIDE * (SIDE + 1) / 2);
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
