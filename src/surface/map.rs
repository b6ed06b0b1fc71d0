//! The displacement map: heights on a texel grid, sampled bilinearly.
//!
//! Texel i's centre is at (i + 0.5) / width. v points up: row 0 is the bottom row of the picture.
//! Integer maps read as h = texel / max in [0, 1]; float maps as stored. Nothing goes through 8 bits.
//!
//! Inside the program positions are *texel coordinates*: x = s * width - 0.5, so that texel centres are the
//! integers and cell (i, j) is the square between the centres of texels i, i+1 and j, j+1.

use glam::{DVec2, Vec2};
use thiserror::Error;

use super::Wrap;

/// Why a map was refused. The loader that met it adds the file's name.
#[derive(Debug, Error, PartialEq)]
pub enum MapError {
    /// Zero width or height.
    #[error("the map is {width}x{height} texels; at least 1x1 is needed")]
    Empty {
        /// Texels across.
        width: usize,
        /// Texels up.
        height: usize,
    },
    /// More texels across or up than [`DisplacementMap::MAX_SIDE`].
    #[error("the map is {width}x{height} texels; at most {max}x{max} is supported")]
    TooLarge {
        /// Texels across.
        width: usize,
        /// Texels up.
        height: usize,
        /// Largest side.
        max: usize,
    },
    /// The number of texels is not width * height.
    #[error("the map is {width}x{height} texels, but {found} were given")]
    WrongLength {
        /// Texels across.
        width: usize,
        /// Texels up.
        height: usize,
        /// Texels given.
        found: usize,
    },
    /// A NaN or infinite height.
    #[error(
        "texel ({x}, {y}) of the map (from the bottom left) is {value}; heights must be finite"
    )]
    NotFinite {
        /// Column from the left.
        x: usize,
        /// Row from the bottom.
        y: usize,
        /// What was found.
        value: f32,
    },
}

/// Heights in the precision they came in, bottom row first.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// h = texel / 255.
    U8(Vec<u8>),
    /// h = texel / 65535.
    U16(Vec<u16>),
    /// h as stored (half-float maps are widened).
    F32(Vec<f32>),
}

impl Texels {
    /// Number of texels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(t) => t.len(),
            Self::U16(t) => t.len(),
            Self::F32(t) => t.len(),
        }
    }

    /// True for no texels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes per texel.
    pub fn texel_bytes(&self) -> usize {
        match self {
            Self::U8(_) => 1,
            Self::U16(_) => 2,
            Self::F32(_) => 4,
        }
    }

    /// The stored value that means height 1.
    pub fn unit(&self) -> f32 {
        match self {
            Self::U8(_) => 255.0,
            Self::U16(_) => 65535.0,
            Self::F32(_) => 1.0,
        }
    }

    /// Texel `index` as stored.
    #[inline(always)]
    fn raw(&self, index: usize) -> f32 {
        match self {
            Self::U8(t) => f32::from(t[index]),
            Self::U16(t) => f32::from(t[index]),
            Self::F32(t) => t[index],
        }
    }
}

/// A bilinear sample in texel coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightSample {
    /// Height.
    pub height: f64,
    /// Its derivatives by the texel coordinates, within the cell.
    pub gradient: DVec2,
}

/// A displacement map, ready to be sampled.
#[derive(Clone, Debug)]
pub struct DisplacementMap {
    width: usize,
    height: usize,
    wrap: Wrap,
    /// (width + 1) x (height + 1): one more column and row, as the wrap mode continues them, so that the four
    /// corners of every cell lie at fixed offsets; then `TAIL` more, so that a 32-bit gather of the last 8-bit
    /// texel stays inside.
    texels: Texels,
    range: (f32, f32),
}

const TAIL: usize = 4;

impl DisplacementMap {
    /// Largest width and height: texel indices fit 32 bits and an f32 texel coordinate still resolves 1/256.
    pub const MAX_SIDE: usize = 32768;

    /// A map of `width` x `height` texels, bottom row first.
    pub fn new(width: usize, height: usize, texels: Texels, wrap: Wrap) -> Result<Self, MapError> {
        if width == 0 || height == 0 {
            return Err(MapError::Empty { width, height });
        }
        if width.max(height) > Self::MAX_SIDE {
            return Err(MapError::TooLarge {
                width,
                height,
                max: Self::MAX_SIDE,
            });
        }
        if texels.len() != width * height {
            return Err(MapError::WrongLength {
                width,
                height,
                found: texels.len(),
            });
        }
        if let Texels::F32(t) = &texels
            && let Some(i) = t.iter().position(|h| !h.is_finite())
        {
            return Err(MapError::NotFinite {
                x: i % width,
                y: i / width,
                value: t[i],
            });
        }
        let range = range(&texels);
        let texels = match texels {
            Texels::U8(t) => Texels::U8(padded(&t, width, height, wrap)),
            Texels::U16(t) => Texels::U16(padded(&t, width, height, wrap)),
            Texels::F32(t) => Texels::F32(padded(&t, width, height, wrap)),
        };
        Ok(Self {
            width,
            height,
            wrap,
            texels,
            range,
        })
    }

    /// Texels across and up.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The wrap mode.
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Smallest and largest height.
    pub fn range(&self) -> (f32, f32) {
        self.range
    }

    /// The texels as stored, in rows of [`Self::stride`].
    pub fn texels(&self) -> &Texels {
        &self.texels
    }

    /// Stored texels per row.
    pub fn stride(&self) -> usize {
        self.width + 1
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.texels.len() * self.texels.texel_bytes()
    }

    /// Height at texture coordinates `st`, bilinear.
    pub fn height(&self, st: Vec2) -> f32 {
        self.sample(self.to_texel(st.as_dvec2())).height as f32
    }

    /// Texture coordinates in [0, 1] to texel coordinates.
    pub fn to_texel(&self, st: DVec2) -> DVec2 {
        st * DVec2::new(self.width as f64, self.height as f64) - 0.5
    }

    /// Height and in-cell gradient at texel coordinates.
    #[inline(always)]
    pub fn sample(&self, p: DVec2) -> HeightSample {
        let (i, fx, sx) = self.cell(p.x, self.width);
        let (j, fy, sy) = self.cell(p.y, self.height);
        let corner = |di: usize, dj: usize| f64::from(self.raw(i + di, j + dj));
        let (h00, h10, h01, h11) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
        let (bottom, top) = (h00 + fx * (h10 - h00), h01 + fx * (h11 - h01));
        let dx = (h10 - h00) + fy * ((h11 - h01) - (h10 - h00));
        let unit = 1.0 / f64::from(self.texels.unit());
        HeightSample {
            height: unit * (bottom + fy * (top - bottom)),
            gradient: unit * DVec2::new(sx * dx, sy * (top - bottom)),
        }
    }

    /// A gradient without jumps at cell borders: central differences at the four texels around `p`, bilinear
    /// between them. Per texel, like [`HeightSample::gradient`].
    pub fn smooth_gradient(&self, p: DVec2) -> DVec2 {
        let height = |dx: f64, dy: f64| self.sample(p + DVec2::new(dx, dy)).height;
        // The bilinear interpolant of central differences is the central difference of the bilinear interpolant.
        0.5 * DVec2::new(
            height(1.0, 0.0) - height(-1.0, 0.0),
            height(0.0, 1.0) - height(0.0, -1.0),
        )
    }

    /// Stored texel of column `i` in 0..=width and row `j` in 0..=height.
    #[inline(always)]
    fn raw(&self, i: usize, j: usize) -> f32 {
        self.texels.raw(j * self.stride() + i)
    }

    /// The cell of coordinate `x` along a side of `n` texels, the position in it, and how fast it moves with x.
    #[inline(always)]
    fn cell(&self, x: f64, n: usize) -> (usize, f64, f64) {
        let (folded, slope) = self.wrap.fold(x, n as f64);
        let i = (folded.floor() as usize).min(n - 1);
        (i, folded - i as f64, slope)
    }
}

fn range(texels: &Texels) -> (f32, f32) {
    fn integer<T: Copy + Ord + Into<f32>>(t: &[T], unit: f32) -> (f32, f32) {
        let (min, max) = t
            .iter()
            .fold((t[0], t[0]), |(a, b), &h| (a.min(h), b.max(h)));
        (min.into() / unit, max.into() / unit)
    }
    match texels {
        Texels::U8(t) => integer(t, texels.unit()),
        Texels::U16(t) => integer(t, texels.unit()),
        Texels::F32(t) => t
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &h| {
                (a.min(h), b.max(h))
            }),
    }
}

fn padded<T: Copy + Default>(t: &[T], width: usize, height: usize, wrap: Wrap) -> Vec<T> {
    let beyond = |n: usize| if wrap == Wrap::Repeat { 0 } else { n - 1 };
    let mut out = Vec::with_capacity((width + 1) * (height + 1) + TAIL);
    for j in (0..height).chain([beyond(height)]) {
        let row = &t[j * width..(j + 1) * width];
        out.extend_from_slice(row);
        out.push(row[beyond(width)]);
    }
    out.resize(out.len() + TAIL, T::default());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
