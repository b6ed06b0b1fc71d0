//! Random numbers that are a pure function of (pixel, sample, dimension, seed).
//!
//! No state is carried from one number to the next, so any order of pixels, any tiling and any number of
//! threads give the same bits. Over the samples of a pixel each dimension pair is an Owen-scrambled,
//! shuffled 2D Sobol sequence: every power-of-two run of samples is stratified. Pairs of different
//! dimensions are padded, i.e. independent of each other.
//!
//! Sources: Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020 (scheme); Vegdahl, "Building a
//! Better LK Hash", 2021 (permutation constants); Ahmed, "An Implementation Algorithm of 2D Sobol Sequence
//! Fast, Elegant, and Compact", EGSR 2024 (Pascal matrix in five steps); Wellons, "Prospecting for Hash
//! Functions", 2018 (integer hash).

use glam::{UVec2, Vec2};

/// What a random pair is for. Pairs with different purposes are independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Where on the pixel's filter the camera ray starts.
    Film,
    /// Direction of the next ray.
    Bounce,
    /// Which lobe of the material it is drawn from, and whether the path ends instead.
    Lobe,
    /// Whether a ray slips through a hole.
    Opacity,
    /// Where on the lens the camera ray starts.
    Lens,
    /// Point on the light of this index, or which of them and where on it.
    Light(u32),
}

/// A dimension pair of the sample space: a purpose at a path depth (0: seen by the camera).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension {
    /// Number of bounces so far.
    pub depth: u32,
    /// What for.
    pub purpose: Purpose,
}

impl Dimension {
    /// The pair for `purpose` at `depth`.
    pub const fn new(depth: u32, purpose: Purpose) -> Self {
        Self { depth, purpose }
    }

    fn hash(self) -> u32 {
        let purpose = match self.purpose {
            Purpose::Film => 0,
            Purpose::Bounce => 1,
            Purpose::Lobe => u32::MAX,
            Purpose::Opacity => u32::MAX - 2,
            Purpose::Lens => u32::MAX - 3,
            Purpose::Light(index) => index.wrapping_add(2),
        };
        hash(hash(self.depth) ^ purpose)
    }
}

/// All randomness of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    pixel: u32,
    sample: u32,
}

impl Sampler {
    /// The randomness of sample number `sample` at `pixel` (from the top left) under `seed`.
    pub fn new(pixel: UVec2, sample: u32, seed: u32) -> Self {
        Self {
            pixel: hash(pixel.x ^ hash(pixel.y ^ hash(seed))),
            sample,
        }
    }

    /// A point in [0, 1)^2.
    pub fn point(&self, dimension: Dimension) -> Vec2 {
        let seed = hash(self.pixel ^ dimension.hash());
        let index = owen_scramble(self.sample, seed);
        let [x, y] = sobol_2d(index);
        Vec2::new(
            unit(owen_scramble(x, hash(seed ^ 0x5f35_6495))),
            unit(owen_scramble(y, hash(seed ^ 0xb3c4_89a7))),
        )
    }

    /// The key of the ray traced for `dimension`: differs from sample to sample.
    pub fn ray_key(&self, dimension: Dimension) -> u32 {
        hash(self.sample ^ hash(self.pixel ^ dimension.hash()))
    }
}

/// Wellons' lowbias32: a bijection of 32 bits with near-ideal avalanche, after an offset that moves its
/// fixed point away from 0.
fn hash(x: u32) -> u32 {
    let mut x = x.wrapping_add(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Nested uniform scrambling in base 2: each bit is flipped by a hash of the bits above it.
fn owen_scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// The first two Sobol dimensions as 32-bit fractions: van der Corput, and the Pascal matrix mod 2, whose
/// product with `index` factors into one masked shift per level of Sierpinski's triangle.
fn sobol_2d(index: u32) -> [u32; 2] {
    let mut y = index;
    y ^= (y >> 1) & 0x5555_5555;
    y ^= (y >> 2) & 0x3333_3333;
    y ^= (y >> 4) & 0x0f0f_0f0f;
    y ^= (y >> 8) & 0x00ff_00ff;
    y ^= (y >> 16) & 0x0000_ffff;
    [index.reverse_bits(), y.reverse_bits()]
}

/// The upper 24 bits as a number in [0, 1): every value is exact in f32.
fn unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILM: Dimension = Dimension::new(0, Purpose::Film);

    #[test]
    fn second_sobol_dimension_matches_its_direction_numbers() {
        // v_1 = 1/2, v_{k+1} = v_k xor v_k / 2: the primitive polynomial x + 1.
        for index in (0..5000).chain([u32::MAX, 0x8000_0001]) {
            let (mut expected, mut v) = (0, 1_u32 << 31);
            for bit in 0..32 {
                if index >> bit & 1 == 1 {
                    expected ^= v;
                }
                v ^= v >> 1;
            }
            assert_eq!(sobol_2d(index)[1], expected, "index {index}");
        }
    }

    #[test]
    fn every_elementary_interval_of_a_power_of_two_holds_one_sample() {
        for pixel in [UVec2::ZERO, UVec2::new(17, 4000)] {
            let points: Vec<Vec2> = (0..64)
                .map(|s| Sampler::new(pixel, s, 7).point(FILM))
                .collect();
            for log_columns in 0..=6 {
                let (columns, rows) = (1 << log_columns, 64 >> log_columns);
                let mut seen = [false; 64];
                for p in &points {
                    let cell =
                        (p.x * columns as f32) as usize + columns * (p.y * rows as f32) as usize;
                    assert!(!seen[cell], "two samples in a {columns}x{rows} cell");
                    seen[cell] = true;
                }
            }
        }
    }

    #[test]
    fn different_dimensions_pixels_and_seeds_are_uncorrelated() {
        let n = 4096;
        let mean_product = |a: &dyn Fn(u32) -> f32, b: &dyn Fn(u32) -> f32| {
            (0..n).map(|s| (a(s) - 0.5) * (b(s) - 0.5)).sum::<f32>() / n as f32
        };
        let at = |pixel: u32, depth: u32, purpose: Purpose, seed: u32| {
            move |s: u32| {
                Sampler::new(UVec2::new(pixel, 3), s, seed)
                    .point(Dimension::new(depth, purpose))
                    .x
            }
        };
        let base = at(5, 0, Purpose::Film, 1);
        let others = [
            at(5, 0, Purpose::Bounce, 1),
            at(5, 0, Purpose::Light(0), 1),
            at(5, 0, Purpose::Light(1), 1),
            at(5, 1, Purpose::Film, 1),
            at(6, 0, Purpose::Film, 1),
            at(5, 0, Purpose::Film, 2),
        ];
        for other in &others {
            // The product of two independent uniforms has a standard deviation of 1/12.
            let bound = 5.0 / 12.0 / (n as f32).sqrt();
            assert!(mean_product(&base, other).abs() < bound);
        }
        assert!((mean_product(&base, &base) - 1.0 / 12.0).abs() < 1e-3);
    }

    #[test]
    fn ray_keys_differ_by_sample_pixel_and_dimension() {
        let key = |x, sample, depth| {
            Sampler::new(UVec2::new(x, 0), sample, 0).ray_key(Dimension::new(depth, Purpose::Film))
        };
        let keys: std::collections::HashSet<u32> = (0..10)
            .flat_map(|x| (0..10).flat_map(move |s| (0..10).map(move |d| key(x, s, d))))
            .collect();
        assert_eq!(keys.len(), 1000);
    }
}
