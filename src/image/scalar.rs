//! One channel of a picture, in the precision of the file: what numbers of a material and bumps are read from.

use std::fmt;

use glam::Vec2;

use super::channel::Channel;
use super::heights::read_texels;
use super::source::Source;
use super::{ImageError, fingerprint};
use crate::surface::{DisplacementMap, HeightGrid, MapError, Texels, Wrap};

/// A channel of a picture, bottom row first: 0 .. 1 for integer pictures, as stored for float ones.
pub struct ScalarImage {
    grid: HeightGrid,
    fingerprint: String,
}

/// Size and fingerprint, not every number.
impl fmt::Debug for ScalarImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let HeightGrid {
            width,
            height,
            wrap: [across, up],
            texels,
        } = &self.grid;
        let kind = texels.kind();
        write!(
            f,
            "ScalarImage({width}x{height} {kind} {across:?} {up:?} {})",
            self.fingerprint
        )
    }
}

impl ScalarImage {
    /// A channel of `width` x `height` numbers, bottom row first, that goes on by these wrap modes across and up.
    ///
    /// # Errors
    ///
    /// What a [`DisplacementMap`] refuses, too: no texels, too many, or numbers that are not finite.
    pub fn new(
        width: usize,
        height: usize,
        texels: Texels,
        wrap: [Wrap; 2],
    ) -> Result<Self, MapError> {
        DisplacementMap::check_texels(width, height, &texels)?;
        let bytes: &[u8] = match &texels {
            Texels::U8(t) => t,
            Texels::U16(t) => bytemuck::cast_slice(t),
            Texels::F32(t) => bytemuck::cast_slice(t),
        };
        Ok(Self {
            fingerprint: fingerprint(bytes),
            grid: HeightGrid::new(width, height, texels, wrap),
        })
    }

    /// Pixels across and up.
    pub fn size(&self) -> (usize, usize) {
        (self.grid.width, self.grid.height)
    }

    /// The number at texture coordinates `st`, bilinear; pixel centres at (i + 0.5) / width, v up.
    pub fn sample(&self, st: Vec2) -> f32 {
        self.grid.sample(self.grid.to_texel(st.as_dvec2())).height as f32
    }

    /// Its derivatives by the texture coordinates, without jumps at pixels' borders: central differences over two pixels.
    pub fn smooth_gradient(&self, st: Vec2) -> Vec2 {
        let by_pixel = self
            .grid
            .smooth(self.grid.to_texel(st.as_dvec2()), 2.0)
            .gradient;
        by_pixel.as_vec2() * Vec2::new(self.grid.width as f32, self.grid.height as f32)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.grid.texels.bytes()
    }
}

/// Reads one channel of a picture, as [`load_heights`](super::load_heights) does.
pub fn load_scalar<'a>(
    picture: impl Into<Source<'a>>,
    channel: &Channel,
    wrap: [Wrap; 2],
) -> Result<ScalarImage, ImageError> {
    let picture = picture.into();
    let (width, height, texels) = read_texels(picture, channel, None)?;
    ScalarImage::new(width, height, texels, wrap).map_err(|source| ImageError::Map {
        path: picture.path().to_owned(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wrapped by hand, one axis after the other.
    #[test]
    fn each_axis_goes_on_by_its_own_mode() {
        let (width, height) = (4, 3);
        let texels: Vec<u8> = (0..12).map(|i| i * i).collect();
        let modes = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
        for (across, up) in modes.into_iter().flat_map(|a| modes.map(|b| (a, b))) {
            let image =
                ScalarImage::new(width, height, Texels::U8(texels.clone()), [across, up]).unwrap();
            for (i, j) in (-9..9).flat_map(|j| (-9..9).map(move |i| (i, j))) {
                let centre = (Vec2::new(i as f32, j as f32) + 0.5) / Vec2::new(4.0, 3.0);
                let texel = texels[up.texel(j, height) * width + across.texel(i, width)];
                let found = image.sample(centre);
                assert!(
                    (found - f32::from(texel) / 255.0).abs() < 1e-5,
                    "{across:?} {up:?} ({i}, {j}): {found}"
                );
            }
        }
    }

    #[test]
    fn the_same_modes_are_sampled_as_a_map_is() {
        let texels = Texels::U16((0..35_u16).map(|i| i.wrapping_mul(40_503)).collect());
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let image = ScalarImage::new(7, 5, texels.clone(), [wrap; 2]).unwrap();
            let map = DisplacementMap::new(7, 5, texels.clone(), wrap).unwrap();
            for k in 0..200 {
                let st = Vec2::new(0.37 * k as f32 - 30.0, 0.11 * k as f32 - 11.0);
                assert_eq!(image.sample(st).to_bits(), map.height(st).to_bits());
            }
        }
    }
}
