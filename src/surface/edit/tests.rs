use glam::DVec2;

use super::*;
use crate::surface::{TexelKind, Wrap};

fn rect(x: usize, y: usize, width: usize, height: usize) -> TexelRect {
    TexelRect {
        x,
        y,
        width,
        height,
    }
}

fn map(wrap: Wrap) -> DisplacementMap {
    let ramp = (0..20).map(|i| i * 1000).collect();
    DisplacementMap::new(5, 4, Texels::U16(ramp), wrap).unwrap()
}

#[test]
fn what_was_read_undoes_an_edit() {
    let (map, place) = (map(Wrap::Repeat), rect(1, 2, 3, 2));
    let before = map.read(place).unwrap();
    let expected = vec![11000, 12000, 13000, 16000, 17000, 18000];
    assert_eq!(before, Texels::U16(expected));
    let new = Texels::U16(vec![65535, 1, 2, 3, 4, 5]);
    let update = map.update(place, &new).unwrap();
    assert_eq!(update.range_before, (0.0, 19000.0 / 65535.0));
    assert_eq!(update.range_after, (0.0, 1.0));
    assert_eq!(map.read(place).unwrap(), new);
    assert_eq!(map.sample(DVec2::new(1.0, 2.0)).height, 1.0);
    let back = map.update(place, &before).unwrap();
    assert_eq!(back.range_after, update.range_before);
    let whole = Texels::U16((0..20).map(|i| i * 1000).collect());
    assert_eq!(map.read(rect(0, 0, 5, 4)).unwrap(), whole);
}

#[test]
fn the_wrap_continues_edited_edges() {
    let corner = |wrap, x: usize, y: usize| {
        let map = map(wrap);
        map.update(rect(x, y, 1, 1), &Texels::U16(vec![65535]))
            .unwrap();
        map.sample(DVec2::new(5.0, 4.0)).height
    };
    assert_eq!(corner(Wrap::Repeat, 0, 0), 1.0);
    assert_eq!(corner(Wrap::Clamp, 4, 3), 1.0);
    assert_eq!(corner(Wrap::Mirror, 4, 3), 1.0);
}

#[test]
fn bad_edits_are_refused_and_change_nothing() {
    let map = map(Wrap::Clamp);
    let fives = |n| Texels::U16(vec![5; n]);
    let refuse = |rect, texels: &Texels| map.update(rect, texels).unwrap_err();
    for empty in [rect(0, 0, 0, 1), rect(2, 2, 1, 0)] {
        assert_eq!(refuse(empty, &fives(0)), MapError::EmptyRect(empty));
        assert_eq!(map.read(empty), Err(MapError::EmptyRect(empty)));
    }
    for outside in [
        rect(5, 0, 1, 1),
        rect(3, 0, 3, 1),
        rect(0, 4, 1, 1),
        rect(0, 1, 1, 4),
        rect(usize::MAX, 0, 2, 1),
        rect(1, 0, usize::MAX, 1),
    ] {
        let expected = MapError::RectOutside {
            rect: outside,
            width: 5,
            height: 4,
        };
        assert_eq!(refuse(outside, &fives(1)), expected);
        assert_eq!(map.read(outside), Err(expected));
    }
    let place = rect(1, 1, 2, 2);
    assert_eq!(
        refuse(place, &fives(3)),
        MapError::WrongRectLength {
            rect: place,
            found: 3
        }
    );
    assert_eq!(
        refuse(place, &Texels::U8(vec![5; 4])),
        MapError::WrongKind {
            found: TexelKind::U8,
            expected: TexelKind::U16
        }
    );
    assert_eq!(
        map.read(place).unwrap(),
        Texels::U16(vec![6000, 7000, 11000, 12000])
    );
}

#[test]
fn a_height_that_is_no_number_is_named_by_its_place_in_the_map() {
    let map = DisplacementMap::new(3, 3, Texels::F32(vec![0.0; 9]), Wrap::Repeat).unwrap();
    let texels = Texels::F32(vec![1.0, 2.0, f32::INFINITY, 3.0]);
    assert_eq!(
        map.update(rect(1, 1, 2, 2), &texels),
        Err(MapError::NotFinite {
            x: 1,
            y: 2,
            value: f32::INFINITY
        })
    );
    assert_eq!(map.range(), (0.0, 0.0));
}

#[test]
fn a_shared_map_is_edited_while_it_is_read() {
    let size = 64;
    let zeros = Texels::U8(vec![0; size * size]);
    let map = DisplacementMap::new(size, size, zeros, Wrap::Repeat).unwrap();
    std::thread::scope(|scope| {
        for half in 0..2 {
            let map = &map;
            scope.spawn(move || {
                let place = rect(32 * half, 0, 32, size);
                for value in 0..100 {
                    map.update(place, &Texels::U8(vec![value; 32 * size]))
                        .unwrap();
                }
            });
        }
        scope.spawn(|| {
            for _ in 0..1000 {
                let height = map.sample(DVec2::new(5.0, 6.0)).height * 255.0;
                assert!((height - height.round()).abs() < 1e-9 && height < 99.5);
            }
        });
    });
    // Neither edit has lost the other's part of an entry.
    assert_eq!(map.range(), (99.0 / 255.0, 99.0 / 255.0));
    assert_eq!(map.pyramid().levels()[0].get(7, 3), (99.0, 99.0));
}
