//! Eight rays side by side.

use std::array;

use glam::Vec3;

use super::{MAX_COORDINATE, Ray, time_within};

/// Eight rays, one per lane, in arrays that a vector register loads whole.
///
/// A lane whose ray is not [valid](Ray::is_valid) is empty: it hits nothing. Rays of a packet may be answered faster
/// than each alone when they go the same way from about the same place; the answers are the same, but for the last bit of a number in some twenty
/// of a million hits on displaced surfaces.
// Word for word Embree's RTCRay8, so that packets pass through it as they are; `time` is private, for Embree takes no NaN, and `flags` its own.
#[repr(C, align(32))]
#[derive(Clone, Debug)]
pub struct RayPacket {
    /// Start points: x, y and z of all lanes.
    pub origin: [[f32; Self::LANES]; 3],
    /// Starts of the open intervals.
    pub tnear: [f32; Self::LANES],
    /// Directions: x, y and z of all lanes.
    pub direction: [[f32; Self::LANES]; 3],
    time: [f32; Self::LANES],
    /// Ends of the open intervals.
    pub tfar: [f32; Self::LANES],
    /// [`Ray::mask`] of every lane.
    pub mask: [u32; Self::LANES],
    /// [`Ray::key`] of every lane.
    pub key: [u32; Self::LANES],
    flags: [u32; Self::LANES],
}

impl RayPacket {
    /// Rays in a packet.
    pub const LANES: usize = 8;

    /// Eight empty lanes.
    pub const EMPTY: Self = Self {
        origin: [[0.0; Self::LANES]; 3],
        tnear: [0.0; Self::LANES],
        direction: [[0.0; Self::LANES]; 3],
        time: [0.0; Self::LANES],
        tfar: [f32::NEG_INFINITY; Self::LANES],
        mask: [0; Self::LANES],
        key: [0; Self::LANES],
        flags: [0; Self::LANES],
    };

    /// The first eight of `rays` in order; lanes beyond the last ray are empty.
    pub fn from_rays<'r>(rays: impl IntoIterator<Item = &'r Ray>) -> Self {
        let mut packet = Self::EMPTY;
        for (lane, ray) in rays.into_iter().take(Self::LANES).enumerate() {
            packet.set(lane, ray);
        }
        packet
    }

    /// Puts `ray` into a lane.
    ///
    /// # Panics
    ///
    /// When there is no such lane.
    #[inline]
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
        }
        self.tnear[lane] = ray.tnear;
        self.tfar[lane] = ray.tfar;
        self.time[lane] = time_within(ray.time);
        self.mask[lane] = ray.mask;
        self.key[lane] = ray.key;
    }

    /// The ray of a lane.
    ///
    /// # Panics
    ///
    /// When there is no such lane.
    #[inline]
    pub fn ray(&self, lane: usize) -> Ray {
        let vector = |words: &[[f32; Self::LANES]; 3]| {
            Vec3::new(words[0][lane], words[1][lane], words[2][lane])
        };
        Ray {
            origin: vector(&self.origin),
            direction: vector(&self.direction),
            tnear: self.tnear[lane],
            tfar: self.tfar[lane],
            time: self.time[lane],
            mask: self.mask[lane],
            key: self.key[lane],
        }
    }

    /// Bit i tells whether the ray of lane i is [valid](Ray::is_valid).
    #[inline]
    pub fn valid(&self) -> u8 {
        self.valid_from(MAX_COORDINATE)
    }

    /// [`valid`](Self::valid) with another largest coordinate of origins, of at most [`MAX_COORDINATE`].
    #[inline]
    pub(crate) fn valid_from(&self, reach: f32) -> u8 {
        // In lanes, as the compiler sees it: `Ray::is_valid` would be eight times its branches.
        let mut valid = [true; Self::LANES];
        let mut moves = [false; Self::LANES];
        for axis in 0..3 {
            for lane in 0..Self::LANES {
                let (o, d) = (self.origin[axis][lane], self.direction[axis][lane]);
                valid[lane] &= (o.abs() <= reach) & (d.abs() <= MAX_COORDINATE);
                moves[lane] |= d != 0.0;
            }
        }
        let in_order: [bool; Self::LANES] = array::from_fn(|lane| {
            (self.tnear[lane] >= 0.0) & (self.tfar[lane] >= self.tnear[lane])
        });
        (0..Self::LANES).fold(0, |bits, lane| {
            bits | u8::from(valid[lane] & moves[lane] & in_order[lane]) << lane
        })
    }
}

/// The numbers of the bits that are set, from the lowest.
#[inline]
pub fn lanes_of(mut bits: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < RayPacket::LANES).then_some(lane)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f32 = f32::NAN;
    const INF: f32 = f32::INFINITY;

    #[test]
    fn a_packet_gives_back_its_rays() {
        let ray = |i: u32| {
            let x = i as f32;
            Ray {
                origin: Vec3::new(x, 1.0 + x, 2.0 + x),
                direction: Vec3::new(3.0 + x, 4.0 + x, 5.0 + x),
                tnear: 6.0 + x,
                tfar: 7.0 + x,
                time: x / 8.0,
                mask: 8 + i,
                key: 9 + i,
            }
        };
        let rays: Vec<Ray> = (0..9).map(ray).collect();
        let packet = RayPacket::from_rays(&rays);
        for (lane, ray) in rays[..8].iter().enumerate() {
            assert_eq!(packet.ray(lane), *ray);
        }
        assert_eq!(packet.valid(), 0xff);
        assert_eq!(RayPacket::from_rays(&rays[..3]).valid(), 0b111);
        assert_eq!(RayPacket::EMPTY.valid(), 0);
    }

    #[test]
    fn lanes_are_valid_as_their_rays_are() {
        let sound = Ray::new(Vec3::ONE, Vec3::new(0.0, -0.0, 1e-40));
        let mut rays = vec![sound];
        for x in [
            NAN,
            INF,
            -INF,
            f32::MAX,
            MAX_COORDINATE,
            -MAX_COORDINATE.next_up(),
            0.0,
            -0.0,
            -1.0,
            1.0,
        ] {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                // NaN only where the axis is: NaN * 0 is NaN.
                let at = |v: Vec3| Vec3::select(axis.cmpgt(Vec3::ZERO), Vec3::splat(x), v);
                let (origin, direction) = (at(sound.origin), at(sound.direction));
                rays.push(Ray { origin, ..sound });
                rays.push(Ray { direction, ..sound });
            }
            rays.push(Ray { tnear: x, ..sound });
            rays.push(Ray { tfar: x, ..sound });
        }
        for eight in rays.chunks(8) {
            let valid = RayPacket::from_rays(eight).valid();
            for (lane, ray) in eight.iter().enumerate() {
                assert_eq!(valid >> lane & 1 == 1, ray.is_valid(), "{ray:?}");
            }
        }
    }

    #[test]
    fn lanes_count_the_bits() {
        for bits in 0..=u8::MAX {
            let lanes: Vec<usize> = lanes_of(bits).collect();
            let expected: Vec<usize> = (0..8).filter(|i| bits >> i & 1 == 1).collect();
            assert_eq!(lanes, expected);
        }
    }
}
