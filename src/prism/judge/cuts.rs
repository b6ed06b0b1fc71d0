//! Where a curve crosses texel lines: the surface has its crests on them, and cells end there.
//!
//! A line's crossings depend on the curve and on the line alone: cells on both sides of it have the same digits.

use crate::prism::curve::Curve;
use crate::prism::simd::Quad;

/// Lines of one axis that are looked at together.
pub const MOST_LINES: usize = 5;

/// Of both axes, each met twice at most; and the curve's ends.
const MOST_CUTS: usize = 2 * 2 * MOST_LINES + 2;

/// Texel lines, by axis, the first and the last, as the curve counts them: from its texel base.
pub type Lines = [[f64; 2]; 2];

/// The crossings of some lines, in order, between the ends of the curve.
pub struct Cuts {
    all: [f64; MOST_CUTS],
    count: usize,
}

impl Cuts {
    /// Of the lines the first [`MOST_LINES`] along each axis.
    #[inline(always)]
    pub fn new<Q: Quad>(curve: &Curve<Q>, lines: &Lines) -> Self {
        let mut cuts = Self {
            all: [1.0; MOST_CUTS],
            count: 2,
        };
        cuts.all[0] = 0.0;
        let [p0, p1, p2] = [
            curve.place[0].to_array(),
            curve.place[1].to_array(),
            curve.place[2].to_array(),
        ];
        let [a0, a1, a2] = curve.area();
        for (axis, &[first, last]) in lines.iter().enumerate() {
            let (c0, c1, c2) = (p0[axis], p1[axis], p2[axis]);
            for k in 0..MOST_LINES {
                let line = first + k as f64;
                if line <= last {
                    // X = line A.
                    cuts.cut([c0 - line * a0, c1 - line * a1, c2 - line * a2]);
                }
            }
        }
        cuts
    }

    /// Takes in the roots of a quadratic that are within the curve.
    #[inline(always)]
    fn cut(&mut self, [c0, c1, c2]: [f64; 3]) {
        let discriminant = c1 * c1 - 4.0 * c0 * c2;
        // The root of a negative one is no number, and is not taken in.
        let q = -0.5 * (c1 + discriminant.sqrt().copysign(c1));
        for root in [q / c2, c0 / q] {
            if !(root > 0.0 && root < 1.0) {
                continue;
            }
            let mut k = self.count - 1;
            self.all[self.count] = 1.0;
            self.count += 1;
            while self.all[k - 1] > root {
                self.all[k] = self.all[k - 1];
                k -= 1;
            }
            self.all[k] = root;
        }
    }

    /// From 0 to 1.
    #[inline(always)]
    pub fn as_slice(&self) -> &[f64] {
        &self.all[..self.count]
    }
}
