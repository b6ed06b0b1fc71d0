//! Heights to displace by.

use prismarch::surface::{DisplacementMap, Texels, Wrap};

use super::common::numbers::Numbers;

/// 16-bit white noise: the roughest map there is.
pub fn white(width: usize, height: usize, wrap: Wrap) -> DisplacementMap {
    let mut numbers = Numbers::new((width * 1000 + height) as u64);
    let texels = (0..width * height).map(|_| numbers.bits() as u16).collect();
    DisplacementMap::new(width, height, Texels::U16(texels), wrap).unwrap()
}

/// 8-bit white noise.
pub fn white_8_bit(size: usize) -> DisplacementMap {
    let mut numbers = Numbers::new(8);
    let texels = (0..size * size).map(|_| numbers.bits() as u8).collect();
    DisplacementMap::new(size, size, Texels::U8(texels), Wrap::Repeat).unwrap()
}

/// Float noise from -3 to 5, now and then a far higher texel.
pub fn white_float(size: usize) -> DisplacementMap {
    let mut numbers = Numbers::new(9);
    let mut height = || match numbers.below(40) {
        0 => 15.0,
        _ => numbers.between(-3.0, 5.0),
    };
    let texels = (0..size * size).map(|_| height()).collect();
    DisplacementMap::new(size, size, Texels::F32(texels), Wrap::Mirror).unwrap()
}

/// Waves: neighbouring texels differ little.
pub fn waves(size: usize, wrap: Wrap) -> DisplacementMap {
    from_heights(size, wrap, |x, y| {
        let phase = |k: f32, x: f32| (std::f32::consts::TAU * k * x).sin();
        0.5 + 0.2 * phase(2.0, x) * phase(3.0, y) + 0.2 * phase(5.0, x + y) + 0.1 * phase(7.0, y)
    })
}

/// Every seventh texel is a spike on a flat ground.
pub fn comb(size: usize) -> DisplacementMap {
    let texel = |i: usize| match i % 7 + i / size % 5 {
        0 => u16::MAX,
        _ => 0,
    };
    let texels = (0..size * size).map(texel).collect();
    DisplacementMap::new(size, size, Texels::U16(texels), Wrap::Repeat).unwrap()
}

/// The same height everywhere.
pub fn constant(height: f32) -> DisplacementMap {
    DisplacementMap::new(3, 2, Texels::F32(vec![height; 6]), Wrap::Repeat).unwrap()
}

/// Rises linearly along both axes, to the borders.
pub fn ramp(size: usize) -> DisplacementMap {
    from_heights(size, Wrap::Clamp, |x, y| 0.3 * x + 0.6 * y)
}

fn from_heights(size: usize, wrap: Wrap, height: impl Fn(f32, f32) -> f32) -> DisplacementMap {
    let centre = |i: usize| (i as f32 + 0.5) / size as f32;
    let texels = (0..size * size)
        .map(|i| (height(centre(i % size), centre(i / size)) * 65535.0) as u16)
        .collect();
    DisplacementMap::new(size, size, Texels::U16(texels), wrap).unwrap()
}
