//! Seeded noise by hashing lattice points: no tables, no state, the same value on every run.
//!
//! Gradient noise after Perlin ("Improving Noise", SIGGRAPH 2002: quintic fade), cellular noise after
//! Worley ("A Cellular Texture Basis Function", SIGGRAPH 1996).

use glam::{Vec2, Vec3};

/// A well mixed hash of a seed and a lattice point.
pub fn hash(seed: u32, x: i32, y: i32, z: i32) -> u32 {
    stir(spread_seed(seed) ^ spread_x(x) ^ spread_y(y) ^ spread_z(z))
}

fn spread_seed(seed: u32) -> u32 {
    seed.wrapping_mul(0x9e37_79b1)
}

fn spread_x(x: i32) -> u32 {
    (x as u32).wrapping_mul(0x85eb_ca77)
}

fn spread_y(y: i32) -> u32 {
    (y as u32).wrapping_mul(0xc2b2_ae3d).rotate_left(11)
}

fn spread_z(z: i32) -> u32 {
    (z as u32).wrapping_mul(0x27d4_eb2f).rotate_left(22)
}

fn stir(mut h: u32) -> u32 {
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^ (h >> 15)
}

/// The hash as a number in [0, 1).
pub fn unit(hash: u32) -> f32 {
    (hash >> 8) as f32 / (1 << 24) as f32
}

/// A further, independent hash from one: for several random numbers of one thing.
pub fn next(h: u32) -> u32 {
    hash(h, 1, 0, 0)
}

/// 0 below `a`, 1 above `b`, cubic between; `a` may be greater than `b`.
pub fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// `a` at 0, `b` at 1.
pub fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// The larger of both, rounded over a width `k` where they are close.
pub fn smooth_max(a: f32, b: f32, k: f32) -> f32 {
    let d = (k - (a - b).abs()).max(0.0) / k;
    a.max(b) + 0.25 * k * d * d
}

fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// The 12 edge directions of a cube, 4 of them twice. Looked up, because a branch on a hash is a coin toss.
const EDGES: [Vec3; 16] = [
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(-1.0, 1.0, 0.0),
    Vec3::new(1.0, -1.0, 0.0),
    Vec3::new(-1.0, -1.0, 0.0),
    Vec3::new(1.0, 0.0, 1.0),
    Vec3::new(-1.0, 0.0, 1.0),
    Vec3::new(1.0, 0.0, -1.0),
    Vec3::new(-1.0, 0.0, -1.0),
    Vec3::new(0.0, 1.0, 1.0),
    Vec3::new(0.0, -1.0, 1.0),
    Vec3::new(0.0, 1.0, -1.0),
    Vec3::new(0.0, -1.0, -1.0),
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(0.0, -1.0, 1.0),
    Vec3::new(-1.0, 1.0, 0.0),
    Vec3::new(0.0, -1.0, -1.0),
];

/// The lattice cell of a coordinate below 2^31, and the place in it. Cheaper than `floor` where the baseline
/// instruction set has none.
fn split(x: f32) -> (i32, f32) {
    let truncated = x as i32;
    let cell = truncated - i32::from((truncated as f32) > x);
    (cell, x - cell as f32)
}

/// Gradient noise in the plane, about [-1, 1], zero at lattice points.
pub fn gradient2(seed: u32, p: Vec2) -> f32 {
    let ((x, fx), (y, fy)) = (split(p.x), split(p.y));
    let corner = |i: i32, j: i32| {
        let h = hash(seed, x + i, y + j, 0);
        let (dx, dy) = (fx - i as f32, fy - j as f32);
        // Eight directions: (+-1, +-1/2) and (+-1/2, +-1).
        let (a, b) = if h >> 31 == 0 { (dx, dy) } else { (dy, dx) };
        let a = if h & 1 == 0 { a } else { -a };
        let b = if h & 2 == 0 { b } else { -b };
        a + 0.5 * b
    };
    let u = fade(fx);
    let edge = |j| mix(corner(0, j), corner(1, j), u);
    mix(edge(0), edge(1), fade(fy))
}

/// Gradient noise in space, about [-1, 1], zero at lattice points.
pub fn gradient3(seed: u32, p: Vec3) -> f32 {
    let ((x, fx), (y, fy), (z, fz)) = (split(p.x), split(p.y), split(p.z));
    // The eight corners share what each axis puts into their hashes.
    let seed = spread_seed(seed);
    let xs = [seed ^ spread_x(x), seed ^ spread_x(x + 1)];
    let ys = [spread_y(y), spread_y(y + 1)];
    let zs = [spread_z(z), spread_z(z + 1)];
    let (dx, dy, dz) = ([fx, fx - 1.0], [fy, fy - 1.0], [fz, fz - 1.0]);
    let corner = |i: usize, j: usize, k: usize| {
        let h = stir(xs[i] ^ ys[j] ^ zs[k]);
        EDGES[(h >> 28) as usize].dot(Vec3::new(dx[i], dy[j], dz[k]))
    };
    let (u, v, w) = (fade(fx), fade(fy), fade(fz));
    let edge = |j, k| mix(corner(0, j, k), corner(1, j, k), u);
    let face = |k| mix(edge(0, k), edge(1, k), v);
    mix(face(0), face(1), w)
}

/// Octaves of a noise: each next one at twice the frequency and `gain` times the amplitude.
#[derive(Clone, Copy, Debug)]
pub struct Octaves {
    /// How many, at least 1.
    pub count: u32,
    /// Amplitude ratio of one octave to the one before, in (0, 1].
    pub gain: f32,
}

impl Octaves {
    /// `count` octaves, each of half the amplitude of the one before.
    pub fn new(count: u32) -> Self {
        Self { count, gain: 0.5 }
    }

    /// Sum of the octaves over the sum of their amplitudes; `octave` is given the octave's index and frequency.
    fn sum(self, octave: impl Fn(u32, f32) -> f32) -> f32 {
        let (mut total, mut norm, mut amplitude, mut frequency) = (0.0, 0.0, 1.0, 1.0);
        for index in 0..self.count {
            total += amplitude * octave(index, frequency);
            norm += amplitude;
            amplitude *= self.gain;
            frequency *= 2.0;
        }
        total / norm
    }
}

/// Keeps the zeros of the octaves' lattices apart.
const SHIFT: f32 = 0.37;

/// Crests where the noise changes its sign.
fn crest(n: f32) -> f32 {
    (1.0 - n.abs()).max(0.0).powi(2)
}

/// Fractal gradient noise in space, about [-1, 1].
pub fn fbm3(seed: u32, p: Vec3, octaves: Octaves) -> f32 {
    octaves.sum(|i, f| gradient3(seed.wrapping_add(i), f * p + SHIFT * i as f32))
}

/// Fractal gradient noise in the plane, about [-1, 1].
pub fn fbm2(seed: u32, p: Vec2, octaves: Octaves) -> f32 {
    octaves.sum(|i, f| gradient2(seed.wrapping_add(i), f * p + SHIFT * i as f32))
}

/// Ridged fractal noise in space, [0, 1]: sharp crests at 1, round valleys.
pub fn ridged3(seed: u32, p: Vec3, octaves: Octaves) -> f32 {
    octaves.sum(|i, f| crest(gradient3(seed.wrapping_add(i), f * p + SHIFT * i as f32)))
}

/// What cellular noise knows of a point. Feature points are jittered, one in each unit cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cellular<V> {
    /// Distance to the nearest feature point.
    pub f1: f32,
    /// Distance to the second nearest; f2 - f1 is 0 on the borders between cells.
    pub f2: f32,
    /// Hash of the nearest feature point, the same all over its cell.
    pub id: u32,
    /// From the nearest feature point to the point asked for.
    pub offset: V,
}

/// Cellular noise in space.
pub fn cellular3(seed: u32, p: Vec3) -> Cellular<Vec3> {
    let ((x, fx), (y, fy), (z, fz)) = (split(p.x), split(p.y), split(p.z));
    let within = Vec3::new(fx, fy, fz);
    let mut found = Nearest::default();
    for k in -1..=1 {
        for j in -1..=1 {
            for i in -1..=1 {
                let id = hash(seed, x + i, y + j, z + k);
                let cell = Vec3::new(i as f32, j as f32, k as f32);
                let offset = within - cell - pieces(id);
                found.consider(offset.length_squared(), id, offset);
            }
        }
    }
    found.finish()
}

/// Cellular noise in the plane.
pub fn cellular2(seed: u32, p: Vec2) -> Cellular<Vec2> {
    let ((x, fx), (y, fy)) = (split(p.x), split(p.y));
    let within = Vec2::new(fx, fy);
    let mut found = Nearest::default();
    for j in -1..=1 {
        for i in -1..=1 {
            let id = hash(seed, x + i, y + j, 0);
            let cell = Vec2::new(i as f32, j as f32);
            let offset = within - cell - pieces(id).truncate();
            found.consider(offset.length_squared(), id, offset);
        }
    }
    found.finish()
}

/// Three ten-bit pieces of a hash as numbers in [0, 1).
fn pieces(h: u32) -> Vec3 {
    Vec3::new(
        (h & 1023) as f32,
        ((h >> 10) & 1023) as f32,
        ((h >> 20) & 1023) as f32,
    ) / 1024.0
}

/// The two smallest squared distances so far, and whose the smallest is.
struct Nearest<V> {
    first: f32,
    second: f32,
    id: u32,
    offset: V,
}

impl<V: Default> Default for Nearest<V> {
    fn default() -> Self {
        Self {
            first: f32::INFINITY,
            second: f32::INFINITY,
            id: 0,
            offset: V::default(),
        }
    }
}

impl<V> Nearest<V> {
    fn consider(&mut self, distance_squared: f32, id: u32, offset: V) {
        if distance_squared < self.first {
            self.second = self.first;
            self.first = distance_squared;
            self.id = id;
            self.offset = offset;
        } else if distance_squared < self.second {
            self.second = distance_squared;
        }
    }

    fn finish(self) -> Cellular<V> {
        Cellular {
            f1: self.first.sqrt(),
            f2: self.second.sqrt(),
            id: self.id,
            offset: self.offset,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(n: usize) -> impl Iterator<Item = Vec3> {
        (0..n).map(|i| {
            let h = hash(9, i as i32, 0, 0);
            40.0 * Vec3::new(unit(h), unit(next(h)), unit(next(next(h)))) - 20.0
        })
    }

    #[test]
    fn hash_is_uniform() {
        let mut bins = [0u32; 16];
        for i in 0..16_000 {
            bins[(unit(hash(3, i % 40 - 20, i / 40, 5)) * 16.0) as usize] += 1;
        }
        assert!(bins.iter().all(|b| (850..1150).contains(b)), "{bins:?}");
    }

    #[test]
    fn gradient_noise_is_zero_on_the_lattice_and_bounded() {
        for p in walk(2000) {
            assert_eq!(gradient3(1, p.round()), 0.0);
            assert!(gradient3(1, p).abs() <= 1.1);
            assert!((0.0..=1.0).contains(&ridged3(1, p, Octaves::new(4))));
        }
    }

    #[test]
    fn noise_is_continuous() {
        let step = Vec3::splat(1e-4);
        for p in walk(2000) {
            let q = p + step;
            assert!((gradient3(7, p) - gradient3(7, q)).abs() < 2e-3);
            assert!((cellular3(7, p).f1 - cellular3(7, q).f1).abs() < 1e-3);
        }
    }

    #[test]
    fn seeds_are_independent() {
        let product: f32 = walk(4000)
            .map(|p| gradient3(1, p) * gradient3(2, p))
            .sum::<f32>();
        let power: f32 = walk(4000).map(|p| gradient3(1, p).powi(2)).sum::<f32>();
        assert!(product.abs() < 0.1 * power);
    }

    #[test]
    fn nearest_feature_point_is_where_the_offset_says() {
        for p in walk(500) {
            let c = cellular3(5, p);
            assert!(c.f1 <= c.f2);
            assert!((c.offset.length() - c.f1).abs() < 1e-5);
            let at_point = cellular3(5, p - c.offset);
            assert!(at_point.f1 < 1e-3 && at_point.id == c.id);
        }
    }
}
