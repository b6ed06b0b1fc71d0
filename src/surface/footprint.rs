//! The range of heights under one triangle: every texel that a bilinear sample inside it can read.

use glam::DVec2;

use super::{DisplacementMap, Texels, Wrap};

/// Texels of slack around the triangle, against rounding of whoever samples.
const SLACK: f64 = 0.05;

impl DisplacementMap {
    /// Smallest and largest height that samples in a triangle of texel coordinates can have; the whole map's where the
    /// triangle covers about as much.
    pub fn range_over(&self, corners: [DVec2; 3]) -> (f32, f32) {
        let (low, high) = corners
            .iter()
            .fold((corners[0], corners[0]), |(a, b), &p| (a.min(p), b.max(p)));
        let (width, height) = self.size();
        if (high - low + 2.0).element_product() > (width * height) as f64 {
            return self.range();
        }
        match self.texels() {
            Texels::U8(t) => self.scan(t, corners, [low.y, high.y]),
            Texels::U16(t) => self.scan(t, corners, [low.y, high.y]),
            Texels::F32(t) => self.scan(t, corners, [low.y, high.y]),
        }
    }

    fn scan<T: Copy + PartialOrd + Into<f32>>(
        &self,
        texels: &[T],
        corners: [DVec2; 3],
        [low, high]: [f64; 2],
    ) -> (f32, f32) {
        let (width, height) = self.size();
        let mut range: Option<(T, T)> = None;
        // Row j of texels is read by samples in the rows of cells below and above it.
        for j in (low - SLACK).floor() as i64..=(high + SLACK).floor() as i64 + 1 {
            let Some([from, to]) = extent(corners, j as f64 - 1.0 - SLACK, j as f64 + 1.0 + SLACK)
            else {
                continue;
            };
            let (first, last) = (
                (from - SLACK).floor() as i64,
                (to + SLACK).floor() as i64 + 1,
            );
            let row = self.wrap().texel(j, height) * self.stride();
            for_runs(self.wrap(), first, last, width, |a, b| {
                for &h in &texels[row + a..=row + b] {
                    let (low, high) = range.unwrap_or((h, h));
                    range = Some((
                        if h < low { h } else { low },
                        if h > high { h } else { high },
                    ));
                }
            });
        }
        let unit = self.texels().unit();
        range.map_or_else(
            || self.range(),
            |(low, high)| (low.into() / unit, high.into() / unit),
        )
    }
}

/// The triangle's extent in x between two heights y.
fn extent(corners: [DVec2; 3], low: f64, high: f64) -> Option<[f64; 2]> {
    let mut extent: Option<[f64; 2]> = None;
    let mut include = |x: f64| extent = Some(extent.map_or([x, x], |[a, b]| [a.min(x), b.max(x)]));
    for (p, q) in [
        (corners[0], corners[1]),
        (corners[1], corners[2]),
        (corners[2], corners[0]),
    ] {
        if p.y >= low && p.y <= high {
            include(p.x);
        }
        for y in [low, high] {
            let part = (y - p.y) / (q.y - p.y);
            if (0.0..=1.0).contains(&part) {
                include(p.x + part * (q.x - p.x));
            }
        }
    }
    extent
}

/// Texels `first..=last` of a row of `n` as runs of stored texels.
fn for_runs(wrap: Wrap, first: i64, last: i64, n: usize, mut run: impl FnMut(usize, usize)) {
    if wrap == Wrap::Clamp {
        return run(wrap.texel(first, n), wrap.texel(last, n));
    }
    if last - first >= n as i64 {
        return run(0, n - 1);
    }
    let mut from = first;
    while from <= last {
        // Up to the next edge of the map: folding keeps such a stretch in one piece, maybe backwards.
        let to = last.min((from.div_euclid(n as i64) + 1) * n as i64 - 1);
        let (a, b) = (wrap.texel(from, n), wrap.texel(to, n));
        run(a.min(b), a.max(b));
        from = to + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_sample_inside_is_outside_the_range(
            corners in prop::array::uniform6(-20.0f64..20.0), b in prop::array::uniform2(0.0f64..1.0), mode in 0..3,
        ) {
            let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][mode as usize];
            let heights = (0..30 * 41).map(|i: u32| (i.wrapping_mul(2_654_435_761) >> 9) as u16).collect();
            let map = DisplacementMap::new(30, 41, Texels::U16(heights), wrap).unwrap();
            let at = |i: usize| DVec2::new(corners[2 * i], corners[2 * i + 1]);
            let (u, v) = if b[0] + b[1] > 1.0 { (1.0 - b[0], 1.0 - b[1]) } else { (b[0], b[1]) };
            let p = at(0) + u * (at(1) - at(0)) + v * (at(2) - at(0));
            let (low, high) = map.range_over([at(0), at(1), at(2)]);
            let height = map.sample(p).height as f32;
            prop_assert!(height >= low - 1e-6 && height <= high + 1e-6, "{height} outside {low} .. {high}");
        }
    }

    #[test]
    fn the_range_is_tight() {
        let mut heights = vec![0; 100 * 100];
        heights[50 * 100 + 50] = 65535;
        let map = DisplacementMap::new(100, 100, Texels::U16(heights), Wrap::Repeat).unwrap();
        let triangle = |x: f64, y: f64| {
            [
                DVec2::new(x, y),
                DVec2::new(x + 9.0, y),
                DVec2::new(x, y + 9.0),
            ]
        };
        assert_eq!(map.range_over(triangle(45.0, 45.0)), (0.0, 1.0));
        assert_eq!(map.range_over(triangle(445.0, -55.0)), (0.0, 1.0));
        assert_eq!(map.range_over(triangle(52.0, 45.0)), (0.0, 0.0));
        assert_eq!(map.range_over(triangle(41.0, 51.5)), (0.0, 0.0));
    }
}
