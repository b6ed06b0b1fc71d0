//! What lanes do, at every level.

use glam::DVec2;

use super::*;
use crate::surface::{DisplacementMap, Texels, Wrap};

fn maps() -> Vec<DisplacementMap> {
    let height = |i: usize| (i * 2654435761) >> 7;
    let (w, h) = (7, 5);
    let mut maps = Vec::new();
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for texels in [
            Texels::U8((0..w * h).map(|i| height(i) as u8).collect()),
            Texels::U16((0..w * h).map(|i| height(i) as u16).collect()),
            Texels::F32(
                (0..w * h)
                    .map(|i| height(i) as u16 as f32 / 7.0 - 3.0)
                    .collect(),
            ),
        ] {
            maps.push(DisplacementMap::new(w, h, texels, wrap).unwrap());
        }
    }
    maps
}

fn samples_like_the_map<L: Lanes>() {
    for map in maps() {
        let grid = Grid::new(&map);
        for k in 0..200 {
            let x: [f32; LANES] = std::array::from_fn(|l| (k * 8 + l as i32 - 800) as f32 * 0.0371);
            let y: [f32; LANES] =
                std::array::from_fn(|l| (k * 3 + l as i32 * 5 - 300) as f32 * 0.0673);
            let got = grid.sample(L::from_array(x), L::from_array(y)).to_array();
            for l in 0..LANES {
                let want = map.sample(DVec2::new(x[l].into(), y[l].into())).height as f32;
                let unit = map.unit();
                assert!(
                    (got[l] / unit - want).abs() < 1e-4 * want.abs().max(1.0),
                    "{:?} {}",
                    map.wrap(),
                    x[l]
                );
            }
        }
    }
}

fn survives_any_coordinate<L: Lanes>() {
    for map in maps() {
        let grid = Grid::new(&map);
        let odd = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            1e30,
            -1e30,
            f32::MIN_POSITIVE,
            7.0,
            -0.0,
        ];
        for shift in 0..LANES {
            let y = std::array::from_fn(|l| odd[(l + shift) % LANES]);
            let (x, y) = (L::from_array(odd), L::from_array(y));
            grid.sample(x, y);
        }
    }
}

fn moves_lanes<L: Lanes>() {
    let x = L::from_array([1.0, -2.0, 3.0, 9.0, -5.0, 6.0, 7.0, 8.0]);
    assert_eq!(
        x.next().to_array(),
        [-2.0, 3.0, 9.0, -5.0, 6.0, 7.0, 8.0, 8.0]
    );
    assert_eq!(x.max_lane(), 9.0);
    assert_eq!(x.next().next().next().next().max_lane(), 8.0);
    assert_eq!(x.sign_mask(), 0b0001_0010);
    let two = L::splat(2.0);
    let doubled = x.to_array().map(|x| 1.0 - 2.0 * x);
    assert_eq!(x.neg_mul_add(two, L::splat(1.0)).to_array(), doubled);
    assert_eq!(x.abs().to_array(), x.to_array().map(f32::abs));
}

/// Operations of [`results`].
const ROWS: usize = 12;

/// The bits of all that lanes do with any numbers but NaN.
fn results<L: Lanes>() -> Vec<[u32; LANES]> {
    let odd = [
        0.0,
        -0.0,
        1.0,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MIN_POSITIVE,
        -1e-45,
        3e38,
    ];
    let mut state = 9u64;
    let mut number = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(5);
        let bits = (state >> 32) as u32;
        match bits % 4 {
            0 => odd[(bits >> 8) as usize % odd.len()],
            1 => (bits >> 20) as f32 - 2048.0,
            _ => f32::from_bits(bits & !(1 << 30) | (bits & 1) << 25),
        }
    };
    let mut all = Vec::new();
    for _ in 0..2000 {
        let [a, b, c]: [L; 3] =
            std::array::from_fn(|_| L::from_array(std::array::from_fn(|_| number())));
        let rows: [L; ROWS] = [
            a + b,
            a - b,
            a * b,
            a / b,
            a.mul_add(b, c),
            a.neg_mul_add(b, c),
            a.min(b),
            a.max(b),
            a.floor(),
            a.abs().sqrt(),
            a.next(),
            L::splat(a.max_lane()),
        ];
        let bits = |x: f32| if x.is_nan() { u32::MAX } else { x.to_bits() };
        all.extend(rows.map(|row| row.to_array().map(bits)));
    }
    all
}

#[cfg(target_arch = "x86_64")]
#[test]
fn levels_agree_to_the_bit() {
    if SimdLevel::Avx2.is_supported() {
        let (baseline, avx2) = (results::<Portable>(), results::<Avx2>());
        for (k, (a, b)) in baseline.iter().zip(&avx2).enumerate() {
            assert_eq!(a, b, "operation {}", k % ROWS);
        }
    }
}

#[test]
fn baseline_samples_the_map() {
    moves_lanes::<Portable>();
    samples_like_the_map::<Portable>();
    survives_any_coordinate::<Portable>();
}

#[cfg(target_arch = "x86_64")]
#[test]
fn avx2_samples_the_map() {
    if SimdLevel::Avx2.is_supported() {
        moves_lanes::<Avx2>();
        samples_like_the_map::<Avx2>();
        survives_any_coordinate::<Avx2>();
    }
}
