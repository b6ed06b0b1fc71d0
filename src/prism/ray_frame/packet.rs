//! The frames of a packet's rays, row by row, and the beam that they are in.

use super::{Anchor, RayFrame, RayLanes, before, behind, is_usual, slant, splat2};
use crate::prism::simd::{LANES, Lanes};
use crate::ray::RayPacket;

/// The lanes whose directions have these axes too.
#[inline(always)]
pub fn share_axes<L: Lanes>(direction: &[[f32; LANES]; 3], [x, y, z]: [usize; 3]) -> u32 {
    let main = L::from_array(direction[z]).abs();
    let lateral = L::from_array(direction[x])
        .abs()
        .max(L::from_array(direction[y]).abs());
    // Of two that are as long `axes` takes the later: those go alone.
    (lateral - main).sign_mask()
}

/// The rays of a packet that have the same axes, from points at one depth. Other lanes repeat one of these.
pub struct RayFrames {
    axes: [usize; 3],
    origin: [[f64; LANES]; 3],
    shear: [[f64; LANES]; 2],
    per_depth: [f64; LANES],
    /// Ray parameters at the anchors.
    pub times: [f64; LANES],
    anchored: AnchoredRows,
}

/// As [`Anchored`](super::Anchored), in rows.
struct AnchoredRows {
    depth: f32,
    near: [[f32; LANES]; 2],
    rest: [[f32; LANES]; 2],
    shear: [[f32; LANES]; 2],
    per_depth: [f32; LANES],
    interval: [[f32; LANES]; 2],
}

impl RayFrames {
    /// The frames of `lanes`, and of the first of them in all others. None where a ray is not
    /// [usual](super::Anchored::is_usual).
    #[inline(always)]
    pub fn new<L: Lanes>(
        rays: &RayPacket,
        lanes: u32,
        axes @ [x, y, z]: [usize; 3],
        depth: f32,
    ) -> Option<Self> {
        let origin = [
            filled::<L>(&rays.origin[x], lanes),
            filled::<L>(&rays.origin[y], lanes),
            filled::<L>(&rays.origin[z], lanes),
        ];
        let direction = [
            filled::<L>(&rays.direction[x], lanes),
            filled::<L>(&rays.direction[y], lanes),
            filled::<L>(&rays.direction[z], lanes),
        ];
        let tnear = filled::<L>(&rays.tnear, lanes);
        let tfar = filled::<L>(&rays.tfar, lanes);
        let (zero, zeros) = ([0.0; LANES], [0.0f32; LANES]);
        let mut all = Self {
            axes,
            origin: [zero; 3],
            shear: [zero; 2],
            per_depth: zero,
            times: zero,
            anchored: AnchoredRows {
                depth,
                near: [zeros; 2],
                rest: [zeros; 2],
                shear: [zeros; 2],
                per_depth: zeros,
                interval: [zeros; 2],
            },
        };
        let anchored = &mut all.anchored;
        let mut all_usual = true;
        // Rows, and no branches: the compiler makes registers of it.
        for l in 0..LANES {
            let from = [origin[0][l], origin[1][l], origin[2][l]].map(f64::from);
            let (shear, per_depth) = slant([direction[0][l], direction[1][l], direction[2][l]]);
            let anchor = Anchor::new(from, shear, per_depth, depth);
            all_usual &= is_usual(per_depth);
            for (axis, &shear) in shear.iter().enumerate() {
                all.shear[axis][l] = shear;
                anchored.shear[axis][l] = shear as f32;
                anchored.near[axis][l] = anchor.near[axis];
                anchored.rest[axis][l] = anchor.rest[axis];
            }
            for (row, &from) in all.origin.iter_mut().zip(&from) {
                row[l] = from;
            }
            all.per_depth[l] = per_depth;
            anchored.per_depth[l] = per_depth as f32;
            all.times[l] = anchor.time;
            anchored.interval[0][l] = before(tnear[l], anchor.time);
            anchored.interval[1][l] = behind(tfar[l], anchor.time);
        }
        all_usual.then_some(all)
    }

    /// Whether t grows with depth, in the first lane. Rays of a packet may go against one another.
    #[inline(always)]
    pub fn is_forward(&self) -> bool {
        self.per_depth[0] > 0.0
    }

    /// Lane by lane.
    #[inline(always)]
    pub fn each(&self) -> [RayFrame; LANES] {
        let ([ox, oy, oz], [sx, sy]) = (&self.origin, &self.shear);
        let mut frames = [RayFrame {
            axes: self.axes,
            origin: [0.0; 3],
            shear: [0.0; 2],
            per_depth: 0.0,
        }; LANES];
        for (lane, frame) in frames.iter_mut().enumerate() {
            frame.origin = [ox[lane], oy[lane], oz[lane]];
            frame.shear = [sx[lane], sy[lane]];
            frame.per_depth = self.per_depth[lane];
        }
        frames
    }

    /// What is behind ray parameter `tfar` is not wanted of a lane any more.
    #[inline(always)]
    pub fn end_at(&mut self, lane: usize, tfar: f32) {
        self.anchored.interval[1][lane] = behind(tfar, self.times[lane]);
    }

    #[inline(always)]
    pub fn lanes<L: Lanes>(&self) -> RayLanes<L> {
        let rows = &self.anchored;
        RayLanes {
            depth: L::splat(rows.depth),
            near: rows2(&rows.near),
            rest: rows2(&rows.rest),
            shear: rows2(&rows.shear),
            per_depth: L::from_array(rows.per_depth),
            interval: rows2(&rows.interval),
        }
    }

    /// What all rays are within.
    #[inline(always)]
    pub fn beam(&self) -> Beam {
        let rows = &self.anchored;
        let ([near_x, wide_x], [near_y, wide_y]) = (middle(&rows.near[0]), middle(&rows.near[1]));
        let ([shear_x, turn_x], [shear_y, turn_y]) =
            (middle(&rows.shear[0]), middle(&rows.shear[1]));
        Beam {
            depth: rows.depth,
            near: [near_x, near_y],
            near_spread: [wide_x, wide_y],
            shear: [shear_x, shear_y],
            shear_spread: [turn_x, turn_y],
            per_depth: rows.per_depth[0],
        }
    }
}

/// Rays along one axis, and how far others are from it.
pub struct Beam {
    depth: f32,
    near: [f32; 2],
    shear: [f32; 2],
    per_depth: f32,
    /// Lateral distance from the axis at the anchor, and its change per unit of depth.
    pub near_spread: [f32; 2],
    pub shear_spread: [f32; 2],
}

impl Beam {
    /// The axis, with no end.
    #[inline(always)]
    pub fn axis<L: Lanes>(&self) -> RayLanes<L> {
        RayLanes {
            depth: L::splat(self.depth),
            near: splat2(self.near),
            rest: splat2([0.0; 2]),
            shear: splat2(self.shear),
            per_depth: L::splat(self.per_depth),
            interval: splat2([f32::NEG_INFINITY, f32::INFINITY]),
        }
    }
}

/// A row, with the first of `lanes` in all others.
#[inline(always)]
fn filled<L: Lanes>(row: &[f32; LANES], lanes: u32) -> [f32; LANES] {
    let first = row[lanes.trailing_zeros() as usize % LANES];
    L::choose(lanes, L::from_array(*row), L::splat(first)).to_array()
}

/// The middle of some numbers, and how far any is from it.
#[inline(always)]
fn middle(row: &[f32; LANES]) -> [f32; 2] {
    let (mut low, mut high) = (row[0], row[0]);
    for &x in row {
        (low, high) = (low.min(x), high.max(x));
    }
    let middle = 0.5 * (low + high);
    let apart = (high - middle).max(middle - low);
    [
        middle,
        apart * 1.001 + 2.0 * f32::EPSILON * low.abs().max(high.abs()),
    ]
}

#[inline(always)]
fn rows2<L: Lanes>([a, b]: &[[f32; LANES]; 2]) -> [L; 2] {
    [L::from_array(*a), L::from_array(*b)]
}
