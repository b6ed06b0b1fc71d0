//! One pixel: sums over its samples, in f64, that can be put down and taken up again at any sample.

use super::sample::{CameraSample, FirstHit};
use super::slot::{ALL, COST, DEVIATIONS, Kind, MEANS, SLOTS};

/// Objects that a pixel can hold: two per Cryptomatte layer.
pub const OBJECTS: usize = 6;

/// `prim` of a pixel that nothing was hit in.
pub const NO_PRIM: u32 = u32::MAX;

/// How many samples a pixel has had.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Samples in the sums.
    pub samples: u32,
    /// Those of them that hit anything.
    pub hits: u32,
    /// The sum of their signs, see [`super::filter::Placement`].
    pub weight: i32,
    /// Samples that were NaN or infinite and left out.
    pub dropped: u32,
}

impl Counts {
    /// Samples taken, whatever came of them.
    pub fn taken(&self) -> u32 {
        self.samples + self.dropped
    }

    /// The value of sum `slot`, where it is `sum`; 0 where there is nothing to divide by.
    pub fn value(&self, slot: usize, sum: f64) -> f32 {
        let divisor = self.divisor(slot);
        if divisor == 0.0 {
            return 0.0;
        }
        (sum / divisor) as f32
    }

    fn divisor(&self, slot: usize) -> f64 {
        match ALL[slot].kind {
            Kind::Filtered => self.weight.into(),
            Kind::OfHits => self.hits.into(),
            Kind::Mean => 1.0,
            Kind::Deviations => self.samples.saturating_sub(1).into(),
        }
    }
}

/// An object in a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Hash of its name.
    pub object: u32,
    /// Samples that hit it; 0 for none.
    pub hits: u32,
}

/// A pixel's sums.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixel {
    /// In the order of [`ALL`].
    pub sums: [f64; SLOTS],
    /// What they are sums of.
    pub counts: Counts,
    /// Objects in the order they were met; those that come when all places are taken are left out.
    pub objects: [Share; OBJECTS],
    /// Base triangle of the first sample that hit anything.
    pub prim: u32,
}

impl Default for Pixel {
    fn default() -> Self {
        Self {
            sums: [0.0; SLOTS],
            counts: Counts::default(),
            objects: [Share::default(); OBJECTS],
            prim: NO_PRIM,
        }
    }
}

impl Pixel {
    /// Adds a sample that counts `sign`. `depth` is that of its first hit, `object` the hash of its name.
    pub fn add(&mut self, sample: &CameraSample, sign: i32, depth: f32, object: u32) {
        if !sample.radiance.is_finite() {
            self.counts.dropped += 1;
            return;
        }
        self.counts.samples += 1;
        self.counts.weight += sign;
        let radiance = sample.radiance.as_dvec3().to_array();
        let sign = f64::from(sign);
        for (sum, x) in self.sums.iter_mut().zip(radiance) {
            *sum += sign * x;
        }
        self.sums[COST] += sign * f64::from(sample.cost);
        self.deviate(radiance);
        if let Some(hit) = &sample.first {
            self.add_hit(hit, sign, depth, object);
        }
    }

    /// Welford, "Note on a Method for Calculating Corrected Sums of Squares and Products", Technometrics 4(3), 1962.
    fn deviate(&mut self, radiance: [f64; 3]) {
        let count = f64::from(self.counts.samples);
        for (channel, x) in radiance.into_iter().enumerate() {
            let before = x - self.sums[MEANS + channel];
            self.sums[MEANS + channel] += before / count;
            self.sums[DEVIATIONS + channel] += before * (x - self.sums[MEANS + channel]);
        }
    }

    fn add_hit(&mut self, hit: &FirstHit, sign: f64, depth: f32, object: u32) {
        self.counts.hits += 1;
        if self.prim == NO_PRIM {
            self.prim = hit.prim;
        }
        self.share(Share { object, hits: 1 });
        let [r, g, b] = hit.albedo.to_array();
        let [nx, ny, nz] = hit.normal.to_array();
        let [x, y, z] = hit.position.to_array();
        let [u, v] = hit.texcoord.to_array();
        let values = [
            1.0,
            r,
            g,
            b,
            nx,
            ny,
            nz,
            x,
            y,
            z,
            depth,
            u,
            v,
            hit.displacement,
        ];
        const ALPHA: usize = 3;
        for ((sum, slot), value) in self.sums.iter_mut().zip(ALL).skip(ALPHA).zip(values) {
            let value = if value.is_finite() {
                f64::from(value)
            } else {
                0.0
            };
            *sum += match slot.kind {
                Kind::Filtered => sign * value,
                _ => value,
            };
        }
    }

    fn share(&mut self, more: Share) {
        let place = self
            .objects
            .iter_mut()
            .find(|share| share.hits == 0 || share.object == more.object);
        if let Some(share) = place {
            share.object = more.object;
            share.hits += more.hits;
        }
    }

    /// The same with its objects by coverage, the largest first; of equal ones the one with the lower hash.
    pub fn ranked(mut self) -> Self {
        self.objects
            .sort_unstable_by_key(|share| (std::cmp::Reverse(share.hits), share.object));
        self
    }

    /// Adds the samples of another, which come after those of this one.
    pub fn merge(&mut self, other: &Self) {
        if self.counts == Counts::default() {
            *self = other.clone();
            return;
        }
        let [n, m] = [self.counts, other.counts].map(|c| f64::from(c.samples));
        if m > 0.0 {
            // Chan, Golub, LeVeque, "Updating Formulae and a Pairwise Algorithm for Computing Sample Variances", 1979.
            for channel in 0..3 {
                let apart = other.sums[MEANS + channel] - self.sums[MEANS + channel];
                self.sums[MEANS + channel] += apart * m / (n + m);
                self.sums[DEVIATIONS + channel] +=
                    other.sums[DEVIATIONS + channel] + apart * apart * n * m / (n + m);
            }
        }
        for (sum, more) in self.sums.iter_mut().zip(other.sums).take(MEANS) {
            *sum += more;
        }
        self.counts.samples += other.counts.samples;
        self.counts.hits += other.counts.hits;
        self.counts.weight += other.counts.weight;
        self.counts.dropped += other.counts.dropped;
        for share in other.objects.iter().filter(|share| share.hits > 0) {
            self.share(*share);
        }
        if self.prim == NO_PRIM {
            self.prim = other.prim;
        }
    }

    /// The value of sum `slot`; 0 where there is nothing to divide by.
    pub fn value(&self, slot: usize) -> f32 {
        self.counts.value(slot, self.sums[slot])
    }

    /// Sets sum `slot` so that its value is `value` again, to the bit: the product of 24 and at most 21 bits is
    /// exact in f64, and so is what dividing it gives back. The counts are set before.
    pub fn set_value(&mut self, slot: usize, value: f32) {
        self.sums[slot] = f64::from(value) * self.counts.divisor(slot);
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    fn sample(i: u32) -> CameraSample {
        let x = (i.wrapping_mul(0x9e37_79b9) >> 8) as f32 / (1 << 24) as f32;
        CameraSample {
            radiance: Vec3::new(x, 3.0 * x * x, 1.0 - x),
            cost: i,
            first: (!i.is_multiple_of(3)).then_some(FirstHit {
                albedo: Vec3::splat(x),
                normal: Vec3::Y,
                position: Vec3::new(x, -x, 100.0),
                texcoord: Vec2::new(x, 0.5),
                displacement: -x,
                object: 0,
                prim: i,
            }),
        }
    }

    fn of(range: std::ops::Range<u32>) -> Pixel {
        let mut pixel = Pixel::default();
        for i in range {
            pixel.add(&sample(i), if i % 16 == 15 { -1 } else { 1 }, 2.0, i % 4);
        }
        pixel
    }

    #[test]
    fn parts_merged_are_the_whole() {
        let whole = of(0..100);
        for cuts in [vec![50], vec![1], vec![15, 16, 17], vec![30, 60, 90]] {
            let mut merged = Pixel::default();
            let mut start = 0;
            for end in cuts.into_iter().chain([100]) {
                merged.merge(&of(start..end));
                start = end;
            }
            assert_eq!(merged.counts, whole.counts);
            assert_eq!((merged.objects, merged.prim), (whole.objects, whole.prim));
            for (slot, (a, b)) in ALL.iter().zip(merged.sums.into_iter().zip(whole.sums)) {
                assert!((a - b).abs() <= 1e-12 * b.abs(), "{} {a} {b}", slot.name);
            }
        }
    }

    #[test]
    fn a_value_becomes_a_sum_and_the_same_value_again() {
        for count in [1, 2, 3, 77, 1000, (1 << 20) - 1] {
            let counts = Counts {
                samples: count,
                hits: count,
                weight: count as i32 - 2,
                dropped: 0,
            };
            let mut pixel = Pixel {
                counts,
                ..Pixel::default()
            };
            for value in [0.1_f32, -1e-20, 3.4e38, 1.0 / 3.0, f32::MIN_POSITIVE / 3.0] {
                for slot in (0..SLOTS).filter(|_| count > 2) {
                    pixel.set_value(slot, value);
                    assert_eq!(pixel.value(slot), value, "{count}");
                }
            }
        }
    }

    #[test]
    fn the_variance_is_that_of_the_samples() {
        let pixel = of(0..64);
        let x: Vec<f64> = (0..64).map(|i| sample(i).radiance.x.into()).collect();
        let mean = x.iter().sum::<f64>() / 64.0;
        let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 63.0;
        assert!((f64::from(pixel.value(DEVIATIONS)) / variance - 1.0).abs() < 1e-6);
        assert_eq!(of(0..1).value(DEVIATIONS), 0.0);
        assert_eq!(Pixel::default().value(0), 0.0);
    }

    #[test]
    fn a_broken_sample_is_counted_and_spreads_nowhere() {
        let mut pixel = of(0..10);
        let before = pixel.sums;
        for radiance in [Vec3::NAN, Vec3::new(1.0, f32::INFINITY, 1.0)] {
            pixel.add(&CameraSample::background(radiance), 1, 0.0, 0);
        }
        assert_eq!((pixel.sums, pixel.counts.dropped), (before, 2));
        let mut odd = sample(1);
        odd.first.as_mut().unwrap().normal = Vec3::NAN;
        pixel.add(&odd, 1, f32::INFINITY, 0);
        assert!(pixel.sums.iter().all(|sum| sum.is_finite()));
        assert_eq!(pixel.counts.samples, 11);
    }
}
