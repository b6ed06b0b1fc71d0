//! The dragon's head: skull, lower jaw, teeth, eyes, horns, mane, whiskers, beard.

use glam::{Vec2, Vec3};

use super::atlas::{Band, Trim, chart, trim_chart};
use super::body::{Frame, Spike, add_ball, catmull_rom};
use crate::demo::noise::smoothstep;
use crate::demo::sweep::Sweep;

/// One station of a lengthwise profile: distance along, half width, and reach upward and downward.
type Station = [f32; 4];

const SKULL: [Station; 12] = [
    [-0.20, 0.10, 0.10, 0.09],
    [-0.08, 0.17, 0.17, 0.13],
    [0.06, 0.225, 0.21, 0.15],
    [0.20, 0.25, 0.245, 0.13],
    [0.33, 0.225, 0.235, 0.105],
    [0.45, 0.175, 0.165, 0.09],
    [0.58, 0.145, 0.125, 0.08],
    [0.70, 0.145, 0.125, 0.078],
    [0.81, 0.165, 0.150, 0.08],
    [0.90, 0.160, 0.150, 0.078],
    [0.97, 0.120, 0.105, 0.06],
    [1.00, 0.060, 0.050, 0.035],
];

const JAW: [Station; 8] = [
    [-0.04, 0.06, 0.03, 0.03],
    [0.04, 0.13, 0.045, 0.06],
    [0.18, 0.155, 0.045, 0.075],
    [0.34, 0.125, 0.04, 0.065],
    [0.50, 0.105, 0.038, 0.06],
    [0.64, 0.105, 0.042, 0.065],
    [0.73, 0.085, 0.045, 0.06],
    [0.78, 0.04, 0.025, 0.03],
];

/// Where the lower jaw hangs, and how far it is open (radians).
const HINGE: Vec3 = Vec3::new(0.0, -0.09, 0.10);
const GAPE: f32 = 0.46;

/// The head at `frame` (origin at the nape, `forward` to the snout), `size` world units long.
pub(super) fn add_head(sweep: &mut Sweep, frame: &Frame, size: f32) {
    let head = Head { frame, size };
    head.skull(sweep);
    head.jaw(sweep);
    for hand in [-1.0, 1.0] {
        head.eye(sweep, hand);
        head.horn(sweep, hand);
        head.teeth(sweep, hand);
        head.whisker(sweep, hand);
    }
    head.mane(sweep);
    head.beard(sweep);
    head.tongue(sweep);
}

/// The station at `z`, smoothly between the given ones.
fn station(profile: &[Station], z: f32) -> [f32; 3] {
    let last = profile.len() - 1;
    let i = profile.partition_point(|s| s[0] <= z).clamp(1, last);
    let x = (z - profile[i - 1][0]) / (profile[i][0] - profile[i - 1][0]);
    let at = |k: usize| Vec3::new(profile[k][1], profile[k][2], profile[k][3]);
    catmull_rom(
        [at(i.max(2) - 2), at(i - 1), at(i), at((i + 1).min(last))],
        x,
    )
    .to_array()
}

/// A bump of height 1 around 0.
fn bump(x: f32, width: f32) -> f32 {
    (-(x / width).powi(2)).exp()
}

struct Head<'a> {
    frame: &'a Frame,
    size: f32,
}

impl Head<'_> {
    fn point(&self, local: Vec3) -> Vec3 {
        self.frame.point(self.size * local)
    }

    /// A frame at `local`, looking along `forward`, all in head coordinates (side, up, forward).
    fn at(&self, local: Vec3, forward: Vec3, up: Vec3) -> Frame {
        Frame::new(
            self.point(local),
            self.frame.vector(forward),
            self.frame.vector(up),
        )
    }

    /// A ring across the head from below, counter-clockwise about forward.
    fn ring(
        &self,
        profile: &[Station],
        z: f32,
        around: usize,
        place: impl Fn(Vec3) -> Vec3,
    ) -> Vec<Vec3> {
        let [width, above, below] = station(profile, z);
        (0..around)
            .map(|i| {
                let angle = std::f32::consts::TAU * i as f32 / around as f32;
                let (sin, cos) = angle.sin_cos();
                // A little squarer than an ellipse.
                let square = |x: f32| x.signum() * x.abs().powf(0.8);
                let tall = if cos > 0.0 { below } else { above };
                place(Vec3::new(-width * square(sin), -tall * square(cos), z))
            })
            .map(|p| self.point(p))
            .collect()
    }

    fn skull(&self, sweep: &mut Sweep) {
        const RINGS: usize = 25;
        let carve = |p: Vec3| {
            let side = p.x.abs();
            let upper = smoothstep(0.02, 0.10, p.y);
            let brow = 0.075 * bump(p.z - 0.36, 0.07) * bump(side - 0.15, 0.06) * upper;
            let socket = 0.05 * bump(p.z - 0.43, 0.05) * bump(p.y - 0.08, 0.06);
            let nostril = 0.045 * bump(p.z - 0.90, 0.05) * bump(side - 0.085, 0.045) * upper;
            let bridge = 0.03 * bump(side, 0.05) * smoothstep(0.4, 0.6, p.z) * upper;
            let cheek = 0.05 * bump(p.z - 0.16, 0.09) * bump(p.y + 0.03, 0.07);
            let out = p.x.signum() * (cheek - socket + 0.4 * brow + 0.3 * nostril);
            Vec3::new(
                p.x + if side > 0.01 { out } else { 0.0 },
                p.y + brow + nostril + bridge,
                p.z,
            )
        };
        let rings: Vec<Vec<Vec3>> = (0..RINGS)
            .map(|k| {
                let x = k as f32 / (RINGS - 1) as f32;
                // Rings crowd at the snout, which turns quickly.
                let z = -0.20 + 1.20 * (1.0 - (1.0 - x).powf(1.25));
                self.ring(&SKULL, z, 28, carve)
            })
            .collect();
        let back = self.point(Vec3::new(0.0, 0.0, -0.24));
        let front = self.point(Vec3::new(0.0, 0.005, 1.015));
        sweep.closed_tube(back, &rings, front, chart(Band::Skull));
    }

    /// From jaw coordinates (origin at the hinge) to head coordinates.
    fn hang(p: Vec3) -> Vec3 {
        let (sin, cos) = GAPE.sin_cos();
        HINGE + Vec3::new(p.x, p.y * cos - p.z * sin, p.y * sin + p.z * cos)
    }

    fn jaw(&self, sweep: &mut Sweep) {
        const RINGS: usize = 14;
        let rings: Vec<Vec<Vec3>> = (0..RINGS)
            .map(|k| {
                let x = k as f32 / (RINGS - 1) as f32;
                self.ring(&JAW, -0.04 + 0.82 * x, 18, Self::hang)
            })
            .collect();
        let back = self.point(Self::hang(Vec3::new(0.0, 0.0, -0.06)));
        let front = self.point(Self::hang(Vec3::new(0.0, 0.0, 0.79)));
        sweep.closed_tube(back, &rings, front, chart(Band::Jaw));
    }

    fn eye(&self, sweep: &mut Sweep, hand: f32) {
        let center = self.point(Vec3::new(0.165 * hand, 0.105, 0.415));
        let gaze = self.frame.vector(Vec3::new(hand, 0.25, 0.55).normalize());
        add_ball(sweep, center, 0.058 * self.size, gaze, 160, Trim::Eye);
    }

    fn horn(&self, sweep: &mut Sweep, hand: f32) {
        let up = Vec3::new(0.0, 1.0, 0.4);
        let mut spike = |at: Vec3, forward: Vec3, bend: Vec3, length: f32, thick: f32, rings| {
            Spike {
                root: self.at(at, forward, up),
                length: length * self.size,
                half: Vec2::splat(thick * self.size),
                bend: self.frame.vector(bend),
                around: 9,
                rings,
                trim: Trim::Horn,
            }
            .add(sweep);
        };
        let root = Vec3::new(0.12 * hand, 0.20, 0.12);
        let forward = Vec3::new(0.32 * hand, 0.62, -0.75);
        spike(
            root,
            forward,
            Vec3::new(0.05 * hand, 0.35, -0.05),
            0.78,
            0.052,
            10,
        );
        let fork = root + 0.33 * forward.normalize() + Vec3::new(0.0, 0.05, 0.0);
        spike(
            fork,
            Vec3::new(0.25 * hand, 1.0, -0.05),
            Vec3::new(0.0, 0.0, -0.3),
            0.30,
            0.034,
            6,
        );
    }

    fn teeth(&self, sweep: &mut Sweep, hand: f32) {
        let mut tooth = |at: Vec3, down: Vec3, length: f32| {
            Spike {
                root: self.at(at, down, Vec3::Z),
                length: length * self.size,
                half: Vec2::splat(0.24 * length * self.size),
                bend: self.frame.vector(Vec3::new(0.0, 0.0, -0.25)),
                around: 5,
                rings: 3,
                trim: Trim::Tooth,
            }
            .add(sweep);
        };
        for (z, length) in [
            (0.46, 0.06),
            (0.56, 0.065),
            (0.66, 0.07),
            (0.76, 0.085),
            (0.86, 0.135),
            (0.94, 0.08),
        ] {
            let [width, _, below] = station(&SKULL, z);
            tooth(
                Vec3::new(0.78 * width * hand, -0.6 * below, z),
                Vec3::new(0.08 * hand, -1.0, 0.1),
                length,
            );
        }
        for (z, length) in [
            (0.36, 0.055),
            (0.46, 0.06),
            (0.56, 0.065),
            (0.66, 0.12),
            (0.73, 0.07),
        ] {
            let [width, above, _] = station(&JAW, z);
            let at = Self::hang(Vec3::new(0.78 * width * hand, 0.4 * above, z));
            tooth(at, Vec3::new(0.05 * hand, 1.0, 0.45), length);
        }
    }

    /// A long thread from beside the nostril.
    fn whisker(&self, sweep: &mut Sweep, hand: f32) {
        let knots = [
            Vec3::new(0.12, 0.03, 0.88),
            Vec3::new(0.24, 0.06, 0.98),
            Vec3::new(0.42, 0.00, 1.00),
            Vec3::new(0.58, -0.16, 0.84),
            Vec3::new(0.66, -0.34, 0.58),
            Vec3::new(0.74, -0.40, 0.30),
            Vec3::new(0.86, -0.30, 0.08),
            Vec3::new(0.98, -0.18, 0.00),
        ]
        .map(|p| Vec3::new(hand * p.x, p.y, p.z));
        self.thread(sweep, &knots, 0.020, Trim::Whisker);
    }

    /// A thin round tube through `knots`, tapering.
    fn thread(&self, sweep: &mut Sweep, knots: &[Vec3], thick: f32, trim: Trim) {
        const PER_KNOT: usize = 3;
        let last = knots.len() - 1;
        let at = |x: f32| {
            let i = (x as usize).min(last - 1);
            let p = [i.max(1) - 1, i, i + 1, (i + 2).min(last)].map(|k| knots[k]);
            self.point(catmull_rom(p, x - i as f32))
        };
        let count = PER_KNOT * last;
        let frame = |k: usize| {
            let x = k as f32 / PER_KNOT as f32;
            let end = last as f32;
            let forward = at((x + 0.1).min(end)) - at((x - 0.1).max(0.0));
            Frame::new(at(x), forward, self.frame.vector(Vec3::new(0.3, 1.0, 0.2)))
        };
        let rings: Vec<Vec<Vec3>> = (0..=count)
            .map(|k| {
                let taper = 1.0 - 0.75 * k as f32 / count as f32;
                frame(k).ellipse(6, Vec2::splat(thick * taper * self.size))
            })
            .collect();
        let (first, end) = (frame(0), frame(count));
        sweep.closed_tube(
            first.origin - 0.5 * thick * self.size * first.forward,
            &rings,
            end.origin + 0.2 * thick * self.size * end.forward,
            trim_chart(trim),
        );
    }

    /// Two wreaths of flat spikes behind the cheeks and over the nape.
    fn mane(&self, sweep: &mut Sweep) {
        for (row, (z, length, lift)) in [(0.06, 0.40, 0.75), (-0.10, 0.46, 0.55)].iter().enumerate()
        {
            let count = 9 - row;
            for k in 0..count {
                let spread = 2.0 * (k as f32 + 0.5) / count as f32 - 1.0;
                let angle = 2.25 * spread;
                let out = Vec3::new(angle.sin(), angle.cos(), 0.0);
                let [width, above, below] = station(&SKULL, *z);
                let tall = if out.y > 0.0 { above } else { below };
                let at = 0.8 * out * Vec3::new(width, tall, 0.0) + *z * Vec3::Z;
                let long = length * (1.0 + 0.25 * spread.abs());
                Spike {
                    root: self.at(at, *lift * out - 0.8 * Vec3::Z, out),
                    length: long * self.size,
                    half: Vec2::new(0.058, 0.026) * self.size,
                    bend: self.frame.vector(0.28 * out + Vec3::new(0.0, 0.10, 0.0)),
                    around: 6,
                    rings: 4,
                    trim: Trim::Spine,
                }
                .add(sweep);
            }
        }
    }

    fn beard(&self, sweep: &mut Sweep) {
        for (x, z, length) in [
            (0.0, 0.68, 0.30),
            (-0.05, 0.58, 0.24),
            (0.05, 0.58, 0.24),
            (-0.06, 0.45, 0.18),
            (0.06, 0.45, 0.18),
        ] {
            let at = Self::hang(Vec3::new(x, -0.03, z));
            Spike {
                root: self.at(at, Vec3::new(1.5 * x, -0.9, -0.1), Vec3::Z),
                length: length * self.size,
                half: Vec2::splat(0.026 * self.size),
                bend: self.frame.vector(Vec3::new(0.0, 0.0, -0.45)),
                around: 6,
                rings: 5,
                trim: Trim::Spine,
            }
            .add(sweep);
        }
    }

    fn tongue(&self, sweep: &mut Sweep) {
        let knots = [
            Vec3::new(0.0, 0.02, 0.10),
            Vec3::new(0.0, 0.05, 0.32),
            Vec3::new(0.0, 0.055, 0.54),
            Vec3::new(0.01, 0.07, 0.74),
            Vec3::new(0.03, 0.13, 0.90),
        ]
        .map(Self::hang);
        self.thread(sweep, &knots, 0.045, Trim::Tongue);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stations_are_met_and_stay_positive() {
        for profile in [&SKULL[..], &JAW[..]] {
            for s in profile {
                let found = station(profile, s[0]);
                for k in 0..3 {
                    assert!((found[k] - s[k + 1]).abs() < 1e-5);
                }
            }
            let (low, high) = (profile[0][0], profile[profile.len() - 1][0]);
            for i in 0..=100 {
                let z = low + (high - low) * i as f32 / 100.0;
                assert!(station(profile, z).iter().all(|&x| x > 0.0));
            }
        }
    }
}
