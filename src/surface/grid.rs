//! Numbers on a texel grid, and bilinear samples of them: what a map is, each level of its means, and a picture of one channel.

use glam::DVec2;

use super::texels::{StoredTexels, Texel, repeated};
use super::{TexelRect, Texels, Wrap};

/// A bilinear sample in texel coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightSample {
    /// Height.
    pub height: f64,
    /// Its derivatives by the texel coordinates, within the cell.
    pub gradient: DVec2,
}

/// Stored heights, of one precision, continued by a wrap mode along each axis.
#[derive(Debug)]
pub(crate) struct HeightGrid {
    pub width: usize,
    pub height: usize,
    pub wrap: [Wrap; 2],
    pub texels: StoredTexels,
}

impl HeightGrid {
    /// Of width * height texels.
    pub fn new(width: usize, height: usize, texels: Texels, wrap: [Wrap; 2]) -> Self {
        Self {
            width,
            height,
            wrap,
            texels: StoredTexels::new(texels, width, height, wrap),
        }
    }

    /// Stored texels per row.
    pub fn stride(&self) -> usize {
        self.width + 1
    }

    /// Height and in-cell gradient at texel coordinates.
    #[inline(always)]
    pub fn sample(&self, p: DVec2) -> HeightSample {
        let (i, fx, sx) = cell(p.x, self.width, self.wrap[0]);
        let (j, fy, sy) = cell(p.y, self.height, self.wrap[1]);
        let stride = self.stride();
        let [h00, h10, h01, h11] = self.texels.cell(j * stride + i, stride);
        let (h00, h10) = (f64::from(h00), f64::from(h10));
        let (h01, h11) = (f64::from(h01), f64::from(h11));
        let (bottom, top) = (h00 + fx * (h10 - h00), h01 + fx * (h11 - h01));
        let dx = (h10 - h00) + fy * ((h11 - h01) - (h10 - h00));
        let unit = 1.0 / f64::from(self.texels.kind().unit());
        HeightSample {
            height: unit * (bottom + fy * (top - bottom)),
            gradient: unit * DVec2::new(sx * dx, sy * (top - bottom)),
        }
    }

    /// Stores `from`, of the grid's own kind, in `rect`, which is inside.
    pub fn write(&self, from: &Texels, rect: TexelRect) {
        match (&self.texels, from) {
            (StoredTexels::U8(to), Texels::U8(from)) => self.write_rows(to, from, rect),
            (StoredTexels::U16(to), Texels::U16(from)) => self.write_rows(to, from, rect),
            (StoredTexels::F32(to), Texels::F32(from)) => self.write_rows(to, from, rect),
            _ => unreachable!("the kinds were found equal"),
        }
    }

    /// The same, and where `rect` is at an edge that is stored twice, its copies.
    fn write_rows<T: Texel>(&self, to: &[T::Atomic], from: &[T], rect: TexelRect) {
        let copied_column = repeated(self.wrap[0], self.width).checked_sub(rect.x);
        let copied_row = repeated(self.wrap[1], self.height);
        let write_row = |j: usize, from: &[T]| {
            let row = &to[j * self.stride()..(j + 1) * self.stride()];
            for (&h, to) in from.iter().zip(&row[rect.x..]) {
                h.store(to);
            }
            if let Some(&h) = copied_column.and_then(|i| from.get(i)) {
                h.store(&row[self.width]);
            }
        };
        for (j, from) in (rect.y..).zip(from.chunks_exact(rect.width)) {
            write_row(j, from);
            if j == copied_row {
                write_row(self.height, from);
            }
        }
    }

    /// Central differences around `p` over `width` texels along each axis, and the mean height of the four points that they are taken from.
    ///
    /// The gradient has no jumps at cell borders: along its own axis it is the mean of the cells' slopes over `width`, across it the
    /// bilinear slope has none.
    pub fn smooth(&self, p: DVec2, width: f64) -> HeightSample {
        let reach = 0.5 * width;
        let height = |dx: f64, dy: f64| self.sample(p + DVec2::new(dx, dy)).height;
        let (right, left) = (height(reach, 0.0), height(-reach, 0.0));
        let (above, below) = (height(0.0, reach), height(0.0, -reach));
        HeightSample {
            height: 0.25 * ((right + left) + (above + below)),
            gradient: DVec2::new(right - left, above - below) / width,
        }
    }

    /// Texture coordinates in [0, 1] to texel coordinates.
    pub fn to_texel(&self, st: DVec2) -> DVec2 {
        st * DVec2::new(self.width as f64, self.height as f64) - 0.5
    }
}

/// The cell of coordinate `x` along a side of `n` texels, the position in it, and how fast it moves with x.
#[inline(always)]
fn cell(x: f64, n: usize, wrap: Wrap) -> (usize, f64, f64) {
    if x >= 0.0 && x < n as f64 - 1.0 {
        let cell = x.floor();
        return (whole(cell), x - cell, 1.0);
    }
    let (folded, slope) = wrap.fold(x, n as f64);
    let i = whole(folded.floor()).min(n - 1);
    (i, folded - i as f64, slope)
}

/// A whole number from 0 to 2^32 - 1: the low bits of its sum with 2^52, without the checks of `as`.
#[inline(always)]
fn whole(x: f64) -> usize {
    const TWO_TO_52: f64 = 4_503_599_627_370_496.0;
    (x + TWO_TO_52).to_bits() as u32 as usize
}
