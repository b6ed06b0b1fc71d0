//! The pixel filter, by filter importance sampling: instead of weighting samples, they are placed with the
//! filter's density, so that a sample belongs to one pixel alone and tiles need no borders.
//!
//! Source: Ernst, Stamminger, Greiner, "Filter Importance Sampling", IEEE Symposium on Interactive Ray
//! Tracing, 2006. A filter with negative lobes is the difference of two densities: samples of the second count -1.
//! Which samples these are goes by their number alone, evenly spread, so that n samples always sum up to the same
//! weight and a picture of one colour has no noise.

use std::f64::consts::PI;

use glam::Vec2;

use crate::scene::{Filter, FilterShape};

/// Intervals of a tabulated inverse distribution; enough that a filter's thin ends stay thin.
const INTERVALS: usize = 1024;
/// Intervals by which a filter is integrated, from 0 to the radius.
const STEPS: usize = 1 << 13;

/// Where a sample goes, and how it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// From the pixel's centre, in pixels.
    pub offset: Vec2,
    /// 1, or -1 on a negative lobe.
    pub sign: i32,
}

/// Places samples with the density of a filter.
#[derive(Clone, Debug)]
pub struct PixelFilter {
    positive: Lobe,
    /// The negative parts of the filter's profile, and their share of the integral of its absolute value.
    negative: Option<(Lobe, f64)>,
}

/// Distances from the centre, in pixels, at cumulative probability i / `INTERVALS`. Of both sides at once: on one a part of a filter has no
/// gap that a table would bridge.
type Lobe = Box<[f32; INTERVALS + 1]>;

impl PixelFilter {
    /// Tabulates `filter`.
    pub fn new(filter: Filter) -> Self {
        let positive = Profile::new(filter, |y| y.max(0.0));
        let negative = Profile::new(filter, |y| (-y).max(0.0));
        let share = negative.total / (positive.total + negative.total);
        Self {
            negative: (share > 0.0).then(|| (negative.inverse(), share)),
            positive: positive.inverse(),
        }
    }

    /// Sample number `index` of a pixel, for a uniform point `u` in [0, 1)^2.
    pub fn place(&self, index: u32, u: Vec2) -> Placement {
        let Some((negative, share)) = &self.negative else {
            return place([&self.positive; 2], u, 1);
        };
        // Van der Corput's sequence: every run of 2^k numbers is spread evenly over [0, 1).
        let class = f64::from(index.reverse_bits()) / 2f64.powi(32);
        let (one, both) = (share * (1.0 - share), share * share);
        match 1.0 - class {
            x if x <= one => place([negative, &self.positive], u, -1),
            x if x <= 2.0 * one => place([&self.positive, negative], u, -1),
            x if x <= 2.0 * one + both => place([negative, negative], u, 1),
            _ => place([&self.positive; 2], u, 1),
        }
    }
}

fn place([across, down]: [&Lobe; 2], u: Vec2, sign: i32) -> Placement {
    Placement {
        offset: Vec2::new(offset(across, u.x), offset(down, u.y)),
        sign,
    }
}

fn offset(lobe: &Lobe, u: f32) -> f32 {
    let from_centre = 2.0 * u - 1.0;
    let at = from_centre.abs() * INTERVALS as f32;
    let i = (at as usize).min(INTERVALS - 1);
    let fraction = at - i as f32;
    (lobe[i] + fraction * (lobe[i + 1] - lobe[i])).copysign(from_centre)
}

/// A part of one side of a filter's profile, integrated.
struct Profile {
    radius: f64,
    /// The integral up to the end of each of `STEPS` intervals.
    cumulative: Vec<f64>,
    total: f64,
}

impl Profile {
    fn new(filter: Filter, part: impl Fn(f64) -> f64) -> Self {
        let mut total = 0.0;
        let cumulative = (0..STEPS)
            .map(|i| {
                let x = (i as f64 + 0.5) / STEPS as f64;
                total += part(profile(filter.shape, x));
                total
            })
            .collect();
        Self {
            radius: filter.radius.into(),
            cumulative,
            total,
        }
    }

    fn inverse(&self) -> Lobe {
        let mut lobe = Box::new([0.0; INTERVALS + 1]);
        for (i, offset) in lobe.iter_mut().enumerate() {
            let wanted = self.total * i as f64 / INTERVALS as f64;
            // Not in what the part begins or ends without.
            let is_before = |c: &f64| *c < wanted || *c == 0.0;
            let step = self.cumulative.partition_point(is_before).min(STEPS - 1);
            let before = step.checked_sub(1).map_or(0.0, |s| self.cumulative[s]);
            let inside =
                (wanted - before) / (self.cumulative[step] - before).max(f64::MIN_POSITIVE);
            let x = (step as f64 + inside.clamp(0.0, 1.0)) / STEPS as f64;
            *offset = (self.radius * x) as f32;
        }
        lobe
    }
}

/// The filter's value at `x` radii from its centre, up to a factor.
fn profile(shape: FilterShape, x: f64) -> f64 {
    match shape {
        FilterShape::Box => 1.0,
        FilterShape::Triangle => 1.0 - x,
        FilterShape::Gaussian => {
            const SPREAD: f64 = 4.5; // three standard deviations
            (-SPREAD * x * x).exp() - (-SPREAD).exp()
        }
        FilterShape::Mitchell => mitchell(2.0 * x),
        FilterShape::BlackmanHarris => {
            // Harris, Proc. IEEE 66(1), 1978, around its middle.
            let harmonic = |k: f64| (PI * k * x).cos();
            0.35875 + 0.48829 * harmonic(1.0) + 0.14128 * harmonic(2.0) + 0.01168 * harmonic(3.0)
        }
    }
}

/// Mitchell and Netravali, "Reconstruction Filters in Computer Graphics", SIGGRAPH 1988, B = C = 1/3; 0 from 2 on.
fn mitchell(x: f64) -> f64 {
    const B: f64 = 1.0 / 3.0;
    const C: f64 = 1.0 / 3.0;
    let cubic = |a: f64, b: f64, c: f64, d: f64| ((a * x + b) * x + c) * x + d;
    if x < 1.0 {
        let quadratic = -18.0 + 12.0 * B + 6.0 * C;
        cubic(12.0 - 9.0 * B - 6.0 * C, quadratic, 0.0, 6.0 - 2.0 * B)
    } else {
        let constant = 8.0 * B + 24.0 * C;
        cubic(
            -B - 6.0 * C,
            6.0 * B + 30.0 * C,
            -12.0 * B - 48.0 * C,
            constant,
        )
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::super::super::sampler::{Dimension, Purpose, Sampler};
    use super::*;
    use crate::render::testing::{Fineness, assert_samples_follow};

    const SHAPES: [FilterShape; 5] = [
        FilterShape::Box,
        FilterShape::Triangle,
        FilterShape::Gaussian,
        FilterShape::Mitchell,
        FilterShape::BlackmanHarris,
    ];

    /// The mean of `g` over `count` samples as they count.
    fn mean(shape: FilterShape, count: u32, g: impl Fn(Vec2) -> f64) -> f64 {
        let filter = PixelFilter::new(Filter::of(shape));
        let (mut sum, mut weight) = (0.0, 0);
        for index in 0..count {
            let sampler = Sampler::new(UVec2::new(3, 8), index, 0);
            let u = sampler.point(Dimension::new(0, Purpose::Film));
            let Placement { offset, sign } = filter.place(index, u);
            assert!(offset.abs().max_element() <= shape.usual_radius());
            sum += f64::from(sign) * g(offset);
            weight += sign;
        }
        sum / f64::from(weight)
    }

    /// The integral of x^2 f(x) over that of f, numerically.
    fn second_moment(shape: FilterShape) -> f64 {
        let radius = f64::from(shape.usual_radius());
        let (mut sum, mut total) = (0.0, 0.0);
        for i in 0..100_000 {
            let x = (f64::from(i) + 0.5) / 100_000.0;
            total += profile(shape, x);
            sum += (radius * x).powi(2) * profile(shape, x);
        }
        sum / total
    }

    #[test]
    fn known_second_moments() {
        // A box of width 1 and a triangle of radius 1.
        assert!((second_moment(FilterShape::Box) - 1.0 / 12.0).abs() < 1e-6);
        assert!((second_moment(FilterShape::Triangle) - 1.0 / 6.0).abs() < 1e-6);
        // Harris' window: 1/12 + sum c_k (-1)^k / (2 pi^2 k^2), c = (0.48829, 0.14128, 0.01168) / 0.35875, times its width squared.
        let c = [0.48829, 0.14128, 0.01168].map(|a: f64| a / 0.35875);
        let variance = 1.0 / 12.0 + (-c[0] + c[1] / 4.0 - c[2] / 9.0) / (2.0 * PI * PI);
        let expected = 9.0 * variance;
        assert!((second_moment(FilterShape::BlackmanHarris) - expected).abs() < 1e-5);
    }

    #[test]
    fn samples_have_the_moments_of_their_filter() {
        for shape in SHAPES {
            let expected = second_moment(shape);
            for measured in [
                mean(shape, 1 << 14, |p| f64::from(p.x).powi(2)),
                mean(shape, 1 << 14, |p| f64::from(p.y).powi(2)),
            ] {
                assert!(
                    (measured - expected).abs() < 5e-3,
                    "{shape:?} {measured} {expected}"
                );
            }
            for odd in [
                mean(shape, 1 << 14, |p| p.x.into()),
                mean(shape, 1 << 14, |p| (p.x * p.y).into()),
            ] {
                assert!(odd.abs() < 5e-3, "{shape:?} {odd}");
            }
        }
    }

    #[test]
    fn every_filter_leaves_one_colour_as_it_is_for_any_number_of_samples() {
        for shape in SHAPES {
            for count in [1, 2, 3, 7, 16, 17, 64, 1000] {
                assert_eq!(mean(shape, count, |_| 1.0), 1.0, "{shape:?} {count}");
            }
        }
    }

    #[test]
    fn the_weight_of_negative_lobes_is_spread_evenly() {
        let filter = PixelFilter::new(Filter::of(FilterShape::Mitchell));
        let share = filter.negative.as_ref().unwrap().1;
        let expected = 1.0 - 4.0 * share * (1.0 - share);
        let mut weight = 0;
        for index in 0..4096 {
            weight += filter.place(index, Vec2::ZERO).sign;
            assert!(weight > 0, "after {index}");
            let off = f64::from(weight) - expected * f64::from(index + 1);
            assert!(off.abs() < 8.0, "{index} {off}");
        }
    }

    #[test]
    fn samples_are_placed_with_the_density_of_their_filter_by_chi_square() {
        let fineness = Fineness {
            samples: 100_000,
            cells: [20, 20],
            points: 8,
        };
        for shape in SHAPES {
            for radius in [shape.usual_radius(), 0.7] {
                let filter = PixelFilter::new(Filter { shape, radius });
                let along = |x: f32| profile(shape, f64::from(2.0 * x - 1.0).abs());
                // The integral of |f| over the unit interval.
                let fine = (0..10_000).map(|i| along((i as f32 + 0.5) / 1e4).abs());
                let total = fine.sum::<f64>() / 1e4;
                let mut index = 0;
                assert_samples_follow(
                    &format!("{shape:?} {radius}"),
                    fineness,
                    |random| {
                        let Placement { offset, sign } = filter.place(index, random.point());
                        index += 1;
                        let at = 0.5 * (offset / radius + 1.0);
                        let value = along(at.x) * along(at.y);
                        // On the border of two lobes tables may be off by a little.
                        assert!(value * f64::from(sign) > -1e-3, "{shape:?} {offset}");
                        Some(at)
                    },
                    |at| ((along(at.x) * along(at.y)).abs() / (total * total)) as f32,
                );
            }
        }
    }
}
