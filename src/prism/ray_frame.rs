//! A ray's own frame: its main axis, and the two lateral axes sheared along the ray.
//!
//! The main axis is the coordinate axis along which the direction is largest (Woop, Benthin, Wald, "Watertight
//! Ray/Triangle Intersection", JCGT 2(1), 2013). Moved by minus the shear times its depth, every point of the ray has
//! lateral coordinates 0; so a point's projection depends on the point and the ray alone, and two prisms see
//! the same digits of a vertex that they share.

use super::simd::{LANES, Lanes};
use crate::ray::{Ray, RayPacket};

/// The main axis of a ray, last, and the two others: a cyclic permutation of x, y, z.
#[inline(always)]
pub fn axes(ray: &Ray) -> [usize; 3] {
    let [x, y, z] = ray.direction.abs().to_array();
    if z >= x && z >= y {
        [0, 1, 2]
    } else if y >= x {
        [2, 0, 1]
    } else {
        [1, 2, 0]
    }
}

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

/// What the set-up needs of a ray, in f64.
#[derive(Clone, Copy, Debug)]
pub struct RayFrame {
    /// Lateral axes, then the main axis.
    pub axes: [usize; 3],
    /// Origin along these axes.
    pub origin: [f64; 3],
    /// Movement along the lateral axes per unit along the main axis, within [-1, 1].
    pub shear: [f64; 2],
    /// Ray parameter per unit along the main axis.
    pub per_depth: f64,
}

impl RayFrame {
    /// `ray` must be [valid](Ray::is_valid), `axes` its.
    #[inline(always)]
    pub fn new(ray: &Ray, axes @ [x, y, z]: [usize; 3]) -> Self {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let per_depth = 1.0 / f64::from(direction[z]);
        Self {
            axes,
            origin: [origin[x].into(), origin[y].into(), origin[z].into()],
            shear: [
                f64::from(direction[x]) * per_depth,
                f64::from(direction[y]) * per_depth,
            ],
            per_depth,
        }
    }
}

/// The same in f32, from a point of the ray near what is looked at, so that no digits go to the way there.
pub struct Anchored {
    /// Lateral axes, then the main axis.
    pub axes: [usize; 3],
    /// The anchor along the main axis.
    pub depth: f32,
    /// The anchor along the lateral axes: rounded, and what rounding left.
    pub near: [f32; 2],
    pub rest: [f32; 2],
    /// Movement along the lateral axes per unit along the main axis.
    pub shear: [f32; 2],
    /// Ray parameter per unit along the main axis.
    pub per_depth: f32,
    /// Ray parameter at the anchor.
    pub time: f64,
    /// tnear and tfar from there, not narrower.
    pub interval: [f32; 2],
    /// Whether ray parameters are within f32's range; where not, `interval` is all of space.
    pub is_usual: bool,
}

/// The same in lanes: one ray in all of them, or each its own. All have the same axes.
pub struct RayLanes<L> {
    pub depth: L,
    pub near: [L; 2],
    pub rest: [L; 2],
    pub shear: [L; 2],
    pub per_depth: L,
    pub interval: [L; 2],
}

impl Anchored {
    /// In all lanes.
    #[inline(always)]
    pub fn splat<L: Lanes>(&self) -> RayLanes<L> {
        RayLanes {
            depth: L::splat(self.depth),
            near: splat2(self.near),
            rest: splat2(self.rest),
            shear: splat2(self.shear),
            per_depth: L::splat(self.per_depth),
            interval: splat2(self.interval),
        }
    }
}

#[inline(always)]
fn splat2<L: Lanes>([a, b]: [f32; 2]) -> [L; 2] {
    [L::splat(a), L::splat(b)]
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

/// As [`Anchored`], in rows.
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
    /// [usual](Anchored::is_usual).
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
        let mut is_usual = true;
        // Row by row and lane by lane, as the compiler makes registers of it.
        for l in 0..LANES {
            let per_depth = 1.0 / f64::from(direction[2][l]);
            let length = per_depth.abs();
            is_usual &= (length < LONGEST) & (length > 1.0 / LONGEST);
            all.per_depth[l] = per_depth;
            anchored.per_depth[l] = per_depth as f32;
            all.origin[2][l] = origin[2][l].into();
            all.times[l] = (f64::from(depth) - f64::from(origin[2][l])) * per_depth;
        }
        for axis in 0..2 {
            for l in 0..LANES {
                let from = f64::from(origin[axis][l]);
                let shear = f64::from(direction[axis][l]) * all.per_depth[l];
                let at = from + (f64::from(depth) - f64::from(origin[2][l])) * shear;
                all.origin[axis][l] = from;
                all.shear[axis][l] = shear;
                anchored.shear[axis][l] = shear as f32;
                anchored.near[axis][l] = at as f32;
                anchored.rest[axis][l] = (at - f64::from(at as f32)) as f32;
            }
        }
        for (l, &time) in all.times.iter().enumerate() {
            anchored.interval[0][l] = before(tnear[l], time);
            anchored.interval[1][l] = behind(tfar[l], time);
        }
        is_usual.then_some(all)
    }

    /// Whether t grows with depth, in all lanes.
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

/// Directions beyond this and its inverse would overflow ray parameters in f32.
const LONGEST: f64 = 1e12;

impl RayFrame {
    /// The frame from the ray's point at `depth` along the main axis.
    #[inline(always)]
    pub fn anchored(&self, depth: f32, ray: &Ray) -> Anchored {
        let beyond = f64::from(depth) - self.origin[2];
        let (x, y) = (
            self.origin[0] + beyond * self.shear[0],
            self.origin[1] + beyond * self.shear[1],
        );
        let near = [x as f32, y as f32];
        let length = self.per_depth.abs();
        let is_usual = length < LONGEST && length > 1.0 / LONGEST;
        let time = beyond * self.per_depth;
        Anchored {
            axes: self.axes,
            depth,
            near,
            rest: [
                (x - f64::from(near[0])) as f32,
                (y - f64::from(near[1])) as f32,
            ],
            shear: [self.shear[0] as f32, self.shear[1] as f32],
            per_depth: if is_usual { self.per_depth as f32 } else { 1.0 },
            time,
            interval: if is_usual {
                [before(ray.tnear, time), behind(ray.tfar, time)]
            } else {
                [f32::NEG_INFINITY, f32::INFINITY]
            },
            is_usual,
        }
    }
}

/// A ray parameter from another, not farther.
#[inline(always)]
fn before(t: f32, time: f64) -> f32 {
    let t = (f64::from(t) - time) as f32;
    t - t.abs() * f32::EPSILON
}

/// The same, not nearer.
#[inline(always)]
fn behind(t: f32, time: f64) -> f32 {
    let t = (f64::from(t) - time) as f32;
    t + t.abs() * f32::EPSILON
}
