use super::*;
use crate::surface::Texels;

fn ramp(wrap: Wrap) -> DisplacementMap {
    DisplacementMap::new(4, 2, Texels::U16((0..8).map(|i| i * 1000).collect()), wrap).unwrap()
}

#[test]
fn texel_centres_read_back_exactly() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let map = ramp(wrap);
        for j in 0..2 {
            for i in 0..4 {
                let st = Vec2::new((i as f32 + 0.5) / 4.0, (j as f32 + 0.5) / 2.0);
                assert_eq!(
                    map.height(st),
                    (1000 * (i + 4 * j)) as f32 / 65535.0,
                    "{wrap:?} {i} {j}"
                );
            }
        }
    }
}

#[test]
fn wrap_modes_continue_the_map() {
    let at = |wrap, s: f32| ramp(wrap).height(Vec2::new(s, 0.25)) * 65535.0 / 1000.0;
    let near = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a} {b}");
    near(at(Wrap::Repeat, 0.0), 1.5); // half-way between the last and the first texel
    near(at(Wrap::Repeat, 1.375), 1.0);
    near(at(Wrap::Repeat, -0.125), 3.0);
    near(at(Wrap::Clamp, -3.0), 0.0);
    near(at(Wrap::Clamp, 1.7), 3.0);
    near(at(Wrap::Mirror, -0.375), 1.0);
    near(at(Wrap::Mirror, 1.375), 2.0);
    near(at(Wrap::Mirror, 2.375), 1.0);
}

#[test]
fn the_gradient_is_the_difference_quotient() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let map = ramp(wrap);
        for k in -40..40 {
            let p = DVec2::new(0.371 * f64::from(k) + 0.0123, 0.233 * f64::from(k) + 0.0217);
            let e = 1e-5;
            let difference =
                |d: DVec2| (map.sample(p + d).height - map.sample(p - d).height) / (2.0 * e);
            let g = map.sample(p).gradient;
            assert!(
                (g.x - difference(DVec2::X * e)).abs() < 1e-9,
                "{wrap:?} {p}"
            );
            assert!(
                (g.y - difference(DVec2::Y * e)).abs() < 1e-9,
                "{wrap:?} {p}"
            );
        }
    }
}

#[test]
fn bad_maps_are_refused() {
    let new = |w, h, t| DisplacementMap::new(w, h, t, Wrap::Repeat).map(|_| ());
    assert_eq!(
        new(0, 3, Texels::U8(vec![])),
        Err(MapError::Empty {
            width: 0,
            height: 3
        })
    );
    assert!(matches!(
        new(2, 2, Texels::U8(vec![0; 3])),
        Err(MapError::WrongLength { found: 3, .. })
    ));
    assert!(matches!(
        new(40000, 1, Texels::U8(vec![0; 40000])),
        Err(MapError::TooLarge { .. })
    ));
    let nan = Texels::F32(vec![0.0, 0.0, 0.0, f32::NAN]);
    assert!(matches!(
        new(2, 2, nan),
        Err(MapError::NotFinite { x: 1, y: 1, .. })
    ));
}
