//! From a mesh's texture coordinates to a place in the map: the UV transform, and the wrap mode.

use glam::{Affine2, Vec2};

/// What happens outside [0, 1] in texture space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Wrap {
    /// The map repeats.
    #[default]
    Repeat,
    /// The border texel goes on.
    Clamp,
    /// The map repeats, every second one mirrored.
    Mirror,
}

impl Wrap {
    /// Folds texel coordinate `x` (texel centres at the integers) of a side of `n` texels into the stored map:
    /// [0, n) for repeat, [0, n-1] else; and the derivative of the folded coordinate, 1, -1 or 0.
    #[inline(always)]
    pub fn fold(self, x: f64, n: f64) -> (f64, f64) {
        match self {
            Self::Repeat => ((x - n * (x / n).floor()).clamp(0.0, n), 1.0),
            Self::Clamp => clamp_to_centres(x, 1.0, n),
            Self::Mirror => {
                let from_edge = x + 0.5;
                let signed = from_edge - 2.0 * n * (from_edge / (2.0 * n)).round();
                clamp_to_centres(signed.abs() - 0.5, if signed < 0.0 { -1.0 } else { 1.0 }, n)
            }
        }
    }

    /// Folds texel `i` of a side of `n` texels into the stored map, [0, n).
    pub fn texel(self, i: i64, n: usize) -> usize {
        let n = n as i64;
        let folded = match self {
            Self::Repeat => i.rem_euclid(n),
            Self::Clamp => i.clamp(0, n - 1),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n);
                i.min(2 * n - 1 - i)
            }
        };
        folded as usize
    }

    /// The largest multiple of the map's period in whole maps at or below `s`: what may be subtracted from a
    /// texture coordinate without changing what is sampled.
    pub fn whole_periods(self, s: f64) -> f64 {
        match self {
            Self::Repeat => s.floor(),
            Self::Clamp => 0.0,
            Self::Mirror => 2.0 * (0.5 * s).floor(),
        }
    }
}

#[inline(always)]
fn clamp_to_centres(x: f64, slope: f64, n: f64) -> (f64, f64) {
    let clamped = x.clamp(0.0, n - 1.0);
    (clamped, if clamped == x { slope } else { 0.0 })
}

/// Applied to texture coordinates before the map is sampled: st' = rotate(rotation) * (scale * st) + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// Repeats of the map across and up.
    pub scale: Vec2,
    /// Radians, counter-clockwise in texture space.
    pub rotation: f32,
    /// Added last, in map widths and heights.
    pub offset: Vec2,
}

impl Default for UvTransform {
    fn default() -> Self {
        Self {
            scale: Vec2::ONE,
            rotation: 0.0,
            offset: Vec2::ZERO,
        }
    }
}

impl UvTransform {
    /// As a matrix, for many coordinates.
    pub fn to_affine(&self) -> Affine2 {
        Affine2::from_scale_angle_translation(self.scale, self.rotation, self.offset)
    }

    /// The transformed texture coordinates.
    pub fn apply(&self, st: Vec2) -> Vec2 {
        self.to_affine().transform_point2(st)
    }
}
