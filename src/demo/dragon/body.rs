//! The dragon's body: a path through space, segments along it, spines on its back, legs.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Vec2, Vec3};

use super::atlas::{Band, Trim, chart, trim_chart};
use crate::demo::noise::{mix, smoothstep};
use crate::demo::shape::frames_along;
use crate::demo::sweep::{Ring, Sweep};

/// Place and orientation on a path; `side` = `forward` x `up`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// A point of the path.
    pub origin: Vec3,
    /// Along the path, unit.
    pub forward: Vec3,
    /// Unit, across `forward`.
    pub up: Vec3,
    /// Unit, to the right of someone looking forward.
    pub side: Vec3,
}

impl Frame {
    /// A frame whose `up` is as near to the given one as it can be.
    pub fn new(origin: Vec3, forward: Vec3, up: Vec3) -> Self {
        let forward = forward.normalize();
        let side = forward.cross(up).normalize();
        Self {
            origin,
            forward,
            up: side.cross(forward),
            side,
        }
    }

    /// From local coordinates (side, up, forward).
    pub fn point(&self, local: Vec3) -> Vec3 {
        self.origin + self.vector(local)
    }

    /// As [`Frame::point`], for directions.
    pub fn vector(&self, local: Vec3) -> Vec3 {
        local.x * self.side + local.y * self.up + local.z * self.forward
    }

    /// `count` points of the ellipse across the path, from below counter-clockwise about `forward`.
    pub fn ellipse(&self, count: usize, half: Vec2) -> Vec<Vec3> {
        (0..count)
            .map(|i| {
                let (sin, cos) = (TAU * i as f32 / count as f32).sin_cos();
                // forward x (-up) = -side.
                self.origin - half.x * sin * self.side - half.y * cos * self.up
            })
            .collect()
    }
}

/// The body's axis from the tip of the tail (0) to the neck (1), by length.
pub(super) struct Spine {
    points: Vec<(Vec3, Vec3)>,
    lengths: Vec<f32>,
}

impl Spine {
    /// Two turns around a slanting axis, the back outward; the tail flicks out, the neck rises in an S.
    pub fn new() -> Self {
        const TURNS: f32 = 1.9;
        const STEPS: usize = 26;
        let mut knots: Vec<(Vec3, Vec3)> = vec![
            (Vec3::new(2.85, 1.75, 0.55), Vec3::Y),
            (Vec3::new(2.85, 1.35, 0.10), Vec3::new(1.0, 1.0, 0.0)),
            (Vec3::new(2.50, 1.20, -0.42), Vec3::new(0.8, 1.0, -0.6)),
            (Vec3::new(2.02, 1.42, -0.62), Vec3::new(0.3, 0.8, -0.9)),
        ];
        for k in 0..=STEPS {
            let part = k as f32 / STEPS as f32;
            // From behind over the top towards the viewer, and round.
            let angle = FRAC_PI_2 + 0.75 - TAU * TURNS * part;
            let radius = mix(0.72, 0.98, smoothstep(0.0, 0.4, part));
            let out = Vec3::new(0.0, angle.sin(), angle.cos());
            let axis = Vec3::new(mix(1.62, -1.02, part), mix(1.28, 1.52, part), -0.1);
            knots.push((axis + radius * out, out));
        }
        // The neck comes over the top and swings out to the left, where it carries the head.
        knots.extend([
            (Vec3::new(-1.10, 2.20, -0.88), Vec3::new(0.0, 0.65, -0.75)),
            (Vec3::new(-1.16, 2.46, -0.50), Vec3::new(0.0, 0.95, -0.3)),
            (Vec3::new(-1.22, 2.50, -0.05), Vec3::Y),
            (Vec3::new(-1.30, 2.36, 0.38), Vec3::new(0.0, 1.0, 0.25)),
            (Vec3::new(-1.44, 2.17, 0.76), Vec3::new(0.0, 1.0, 0.25)),
            (Vec3::new(-1.66, 2.08, 1.12), Vec3::Y),
        ]);
        Self::through(&knots)
    }

    fn through(knots: &[(Vec3, Vec3)]) -> Self {
        const FINE: usize = 24;
        let at = |i: isize| knots[i.clamp(0, knots.len() as isize - 1) as usize];
        let mut points = Vec::new();
        for i in 0..knots.len() as isize - 1 {
            for s in 0..FINE {
                let x = s as f32 / FINE as f32;
                let p = [at(i - 1), at(i), at(i + 1), at(i + 2)];
                points.push((
                    catmull_rom(p.map(|k| k.0), x),
                    catmull_rom(p.map(|k| k.1), x),
                ));
            }
        }
        points.push(at(knots.len() as isize - 1));
        let mut lengths = vec![0.0];
        for pair in points.windows(2) {
            lengths.push(lengths[lengths.len() - 1] + pair[0].0.distance(pair[1].0));
        }
        Self { points, lengths }
    }

    /// Total length.
    pub fn length(&self) -> f32 {
        self.lengths[self.lengths.len() - 1]
    }

    /// Frame at fraction `s` of the length.
    pub fn frame(&self, s: f32) -> Frame {
        let at = |s: f32| {
            let length = s.clamp(0.0, 1.0) * self.length();
            let i = self
                .lengths
                .partition_point(|&l| l <= length)
                .clamp(1, self.lengths.len() - 1);
            let x = (length - self.lengths[i - 1]) / (self.lengths[i] - self.lengths[i - 1]);
            let (a, b) = (self.points[i - 1], self.points[i]);
            (a.0.lerp(b.0, x), a.1.lerp(b.1, x))
        };
        const NEAR: f32 = 0.004;
        let (position, up) = at(s);
        Frame::new(position, at(s + NEAR).0 - at(s - NEAR).0, up)
    }
}

/// The cubic through `p[1]` (x = 0) and `p[2]` (x = 1).
pub(super) fn catmull_rom(p: [Vec3; 4], x: f32) -> Vec3 {
    let (a, b) = (0.5 * (p[2] - p[0]), 0.5 * (p[3] - p[1]));
    let c = 3.0 * (p[2] - p[1]) - 2.0 * a - b;
    let d = 2.0 * (p[1] - p[2]) + a + b;
    p[1] + x * (a + x * (c + x * d))
}

/// Radius of the body at fraction `s` of its length.
pub(super) fn radius(s: f32) -> f32 {
    let grown = 0.018 + 0.215 * smoothstep(-0.12, 0.55, s).powf(1.25);
    grown * mix(1.0, 0.74, smoothstep(0.72, 0.97, s))
}

const AROUND: usize = 24;
const SEGMENTS: usize = 34;
/// Rings of a segment: where in it, and how much wider than the body; the ends swell like nodes of bamboo.
const RINGS: [(f32, f32); 9] = [
    (0.0, 1.12),
    (0.06, 1.10),
    (0.13, 1.02),
    (0.30, 0.97),
    (0.50, 0.96),
    (0.70, 0.98),
    (0.87, 1.04),
    (0.94, 1.10),
    (1.0, 1.12),
];

/// Fractions of the length where segments meet: their lengths follow the body's radius.
fn nodes() -> Vec<f32> {
    let mut nodes = vec![0.0];
    let mut sum = 0.0;
    for k in 0..SEGMENTS {
        sum += 0.05 + radius((k as f32 + 0.5) / SEGMENTS as f32);
        nodes.push(sum);
    }
    nodes.iter().map(|n| n / sum).collect()
}

/// Adds all segments, each a closed turn of its band.
pub(super) fn add_body(sweep: &mut Sweep, spine: &Spine) {
    let nodes = nodes();
    for k in 0..SEGMENTS {
        let chart = chart(segment_band(k));
        let rings: Vec<Ring> = RINGS
            .iter()
            .enumerate()
            .map(|(i, &(t, wide))| {
                // Both segments compute the ring they share from the same numbers.
                let s = match i {
                    0 => nodes[k],
                    8 => nodes[k + 1],
                    _ => mix(nodes[k], nodes[k + 1], t),
                };
                let r = wide * radius(s);
                let points = spine.frame(s).ellipse(AROUND, Vec2::new(r, r));
                sweep.ring(&points, chart.u, mix(chart.v[0], chart.v[1], t))
            })
            .collect();
        for pair in rings.windows(2) {
            sweep.strip(pair[0], pair[1]);
        }
        // The gutter beyond the chart holds the constant that a fan needs.
        if k == 0 {
            let frame = spine.frame(0.0);
            let tip = frame.origin - 0.8 * radius(0.0) * frame.forward;
            sweep.cap(rings[0], tip, chart.v[0] - 0.0015, false);
        }
        if k == SEGMENTS - 1 {
            let frame = spine.frame(1.0);
            let end = frame.origin + 0.3 * radius(1.0) * frame.forward;
            sweep.cap(rings[8], end, chart.v[1] + 0.0015, true);
        }
    }
}

fn segment_band(k: usize) -> Band {
    match k {
        0..4 => Band::Tail(1),
        4..9 => Band::Tail(0),
        _ => Band::Body((k % 3) as u32),
    }
}

/// A tapered, bent spike.
pub(super) struct Spike {
    /// Its root; `forward` points along the spike, `side` is its flat side's normal.
    pub root: Frame,
    /// From root to tip.
    pub length: f32,
    /// Half sizes at the root, along `side` and `up`.
    pub half: Vec2,
    /// Sideways offset of the tip, in lengths.
    pub bend: Vec3,
    /// Points around and rings along.
    pub around: usize,
    /// At least 2.
    pub rings: usize,
    /// What it is made of.
    pub trim: Trim,
}

impl Spike {
    /// Adds 2 * `around` * `rings` triangles. The tip is blunt, as a vertex normal must not stray from its faces.
    pub fn add(&self, sweep: &mut Sweep) {
        let axis =
            |x: f32| self.root.origin + self.length * (x * self.root.forward + x * x * self.bend);
        let rings: Vec<Vec<Vec3>> = (0..self.rings)
            .map(|k| {
                let x = 0.97 * k as f32 / (self.rings - 1) as f32;
                let forward = self.root.forward + 2.0 * x * self.bend;
                let frame = Frame::new(axis(x), forward, self.root.up);
                frame.ellipse(self.around, self.half * (1.0 - 0.88 * x.powf(1.15)))
            })
            .collect();
        let thin = self.half.min_element();
        let back = self.root.origin - 0.5 * thin * self.root.forward;
        let frame = Frame::new(
            axis(0.97),
            self.root.forward + 1.94 * self.bend,
            self.root.up,
        );
        let tip = frame.origin + (0.11 * thin).max(0.03 * self.length) * frame.forward;
        sweep.closed_tube(back, &rings, tip, trim_chart(self.trim));
    }
}

/// Two spines on the back of every segment, leaning towards the tail.
pub(super) fn add_spines(sweep: &mut Sweep, spine: &Spine) {
    let nodes = nodes();
    for k in 1..SEGMENTS {
        for part in [0.32, 0.72] {
            let s = mix(nodes[k], nodes[k + 1], part);
            let (frame, r) = (spine.frame(s), radius(s));
            let root = frame.origin + 0.9 * r * frame.up;
            let tall = mix(1.0, 0.72, (part - 0.32) / 0.4);
            Spike {
                root: Frame::new(root, frame.up - 0.35 * frame.forward, frame.forward),
                length: tall * (0.10 + 1.05 * r),
                half: Vec2::new(0.15 * r + 0.006, 0.52 * r + 0.006),
                bend: -0.55 * frame.forward,
                around: 5,
                rings: 3,
                trim: Trim::Spine,
            }
            .add(sweep);
        }
    }
}

/// A flame of spikes at the end of the tail.
pub(super) fn add_tuft(sweep: &mut Sweep, spine: &Spine) {
    let tail = spine.frame(0.0);
    for (side, up, length) in [
        (0.0, 0.0, 0.62),
        (0.30, 0.30, 0.46),
        (-0.30, 0.30, 0.46),
        (0.25, -0.35, 0.40),
        (-0.25, -0.35, 0.40),
    ] {
        let out = tail.vector(Vec3::new(side, up, 0.0));
        Spike {
            root: Frame::new(tail.origin, out - tail.forward, tail.up),
            length,
            half: Vec2::splat(0.034),
            bend: 0.35 * tail.up - 0.5 * out,
            around: 6,
            rings: 5,
            trim: Trim::Spine,
        }
        .add(sweep);
    }
}

/// Four legs: two behind the neck, two before the tail.
pub(super) fn add_legs(sweep: &mut Sweep, spine: &Spine) {
    for (s, size) in [(0.455, 0.95), (0.80, 1.0)] {
        for hand in [-1.0, 1.0] {
            add_leg(sweep, &spine.frame(s), radius(s), size, hand);
        }
    }
}

fn add_leg(sweep: &mut Sweep, body: &Frame, r: f32, size: f32, hand: f32) {
    // (side, up, forward) in multiples of `size`, and the leg's radius there.
    let joints = [
        (Vec3::new(0.35 * r / size, -0.05, 0.02), 0.075),
        (Vec3::new(r / size, -0.10, -0.03), 0.115),
        (Vec3::new(r / size + 0.12, -0.20, -0.10), 0.095),
        (Vec3::new(r / size + 0.17, -0.32, -0.10), 0.07),
        (Vec3::new(r / size + 0.15, -0.40, 0.02), 0.055),
        (Vec3::new(r / size + 0.13, -0.46, 0.12), 0.05),
        (Vec3::new(r / size + 0.12, -0.50, 0.20), 0.06),
    ];
    let place = |p: Vec3| body.point(size * Vec3::new(hand * p.x, p.y, p.z));
    let points: Vec<Vec3> = joints.iter().map(|&(p, _)| place(p)).collect();
    let last = points.len() - 1;
    let along = |i: usize| points[(i + 1).min(last)] - points[i.saturating_sub(1)];
    let rings: Vec<Vec<Vec3>> = frames_along(&points)
        .iter()
        .enumerate()
        .map(|(i, &(_, up))| {
            let half = Vec2::splat(size * joints[i].1);
            Frame::new(points[i], along(i), up).ellipse(12, half)
        })
        .collect();
    let foot = Frame::new(points[last], along(last), body.up);
    let start = points[0] - 0.03 * size * along(0).normalize();
    sweep.closed_tube(
        start,
        &rings,
        foot.point(Vec3::new(0.0, 0.0, 0.03 * size)),
        chart(Band::Tail(0)),
    );
    for toe in [-0.9f32, -0.3, 0.3, 0.9] {
        let forward = foot.vector(Vec3::new(toe.sin(), 0.15, toe.cos()));
        Spike {
            root: Frame::new(foot.origin, forward, foot.up),
            length: 0.22 * size,
            half: Vec2::splat(0.03 * size),
            bend: -0.45 * foot.up,
            around: 5,
            rings: 3,
            trim: Trim::Claw,
        }
        .add(sweep);
    }
}

/// Adds a ball of exactly `triangles` triangles (even, at least 60); its axis is `axis`.
pub(super) fn add_ball(
    sweep: &mut Sweep,
    center: Vec3,
    radius: f32,
    axis: Vec3,
    triangles: usize,
    trim: Trim,
) {
    let points = triangles / 2;
    let count = ((points as f32 / 2.0).sqrt() as usize).max(3);
    let latitude = |k: usize| PI * (k as f32 + 1.0) / (count as f32 + 1.0);
    let total: f32 = (0..count).map(|k| latitude(k).sin()).sum();
    let (mut given, mut wanted) = (0, 0.0);
    let rings: Vec<Vec<Vec3>> = (0..count)
        .map(|k| {
            wanted += points as f32 * latitude(k).sin() / total;
            let around = if k + 1 == count {
                points - given
            } else {
                (wanted.round() as usize - given).max(3)
            };
            given += around;
            let frame = Frame::new(
                center - radius * latitude(k).cos() * axis,
                axis,
                axis.any_orthogonal_vector(),
            );
            frame.ellipse(around, Vec2::splat(radius * latitude(k).sin()))
        })
        .collect();
    sweep.closed_tube(
        center - radius * axis,
        &rings,
        center + radius * axis,
        trim_chart(trim),
    );
}
