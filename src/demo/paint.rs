//! Filling height and colour maps, rows in parallel.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// A painted height map, and what its numbers mean.
pub struct Heights {
    /// `size` x `size`, bottom row first; 0 is `low`, 65535 is `high`, both occur.
    pub texels: Vec<u16>,
    /// Smallest height painted, world units.
    pub low: f32,
    /// Largest height painted, world units.
    pub high: f32,
}

impl Heights {
    /// `scale` of the displacement: world units from texel 0 to texel 65535.
    pub fn scale(&self) -> f32 {
        self.high - self.low
    }

    /// `midlevel` of the displacement: the map's height that stands for 0 world units.
    pub fn midlevel(&self) -> f32 {
        -self.low / self.scale()
    }
}

/// Texture coordinates of a texel's centre.
fn centre(column: usize, row: usize, size: usize) -> Vec2 {
    (Vec2::new(column as f32, row as f32) + 0.5) / size as f32
}

/// Evaluates `height` (world units, finite) at every texel's centre and spreads its range over 16 bits.
pub fn heights(size: usize, height: impl Fn(Vec2) -> f32 + Sync) -> Heights {
    let mut values = vec![0.0f32; size * size];
    let (low, high) = values
        .par_chunks_mut(size)
        .enumerate()
        .map(|(row, texels)| {
            let mut range = (f32::INFINITY, f32::NEG_INFINITY);
            for (column, texel) in texels.iter_mut().enumerate() {
                *texel = height(centre(column, row, size));
                range = (range.0.min(*texel), range.1.max(*texel));
            }
            range
        })
        .reduce(
            || (f32::INFINITY, f32::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
    let to_texel = 65535.0 / (high - low).max(f32::MIN_POSITIVE);
    let texels = values
        .par_iter()
        .map(|h| ((h - low) * to_texel).round() as u16)
        .collect();
    Heights { texels, low, high }
}

/// Evaluates `color` (linear RGB, clamped to [0, 1]) at every texel's centre, stored as 8-bit sRGB.
pub fn colors(size: usize, color: impl Fn(Vec2) -> Vec3 + Sync) -> Vec<[u8; 3]> {
    let mut texels = vec![[0u8; 3]; size * size];
    texels
        .par_chunks_mut(size)
        .enumerate()
        .for_each(|(row, texels)| {
            for (column, texel) in texels.iter_mut().enumerate() {
                let rgb = color(centre(column, row, size));
                *texel = rgb.to_array().map(encode_srgb);
            }
        });
    texels
}

/// The sRGB transfer curve (IEC 61966-2-1), 8 bits.
fn encode_srgb(linear: f32) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * encoded).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_uses_every_bit_and_keeps_its_units() {
        let h = heights(64, |st| 3.0 * st.y - 1.0);
        assert_eq!((h.texels[0], h.texels[64 * 64 - 1]), (0, 65535));
        assert!((h.scale() - 3.0 * 63.0 / 64.0).abs() < 1e-5);
        let middle = f32::from(h.texels[20 * 64]) / 65535.0;
        let world = h.scale() * (middle - h.midlevel());
        assert!((world - (3.0 * 20.5 / 64.0 - 1.0)).abs() < 1e-4);
    }

    #[test]
    fn colours_are_encoded() {
        let c = colors(2, |_| Vec3::new(0.0, 0.214_041_14, 7.0));
        assert_eq!(c, vec![[0, 128, 255]; 4]);
    }
}
