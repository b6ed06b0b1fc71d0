//! A ray's own frame: its main axis, and the two lateral axes sheared along the ray.
//!
//! The main axis is the coordinate axis along which the direction is largest (Woop, Benthin, Wald, "Watertight
//! Ray/Triangle Intersection", JCGT 2(1), 2013). Moved by minus the shear times its depth, every point of the ray has
//! lateral coordinates 0; so a point's projection depends on the point and the ray alone, and two prisms see
//! the same digits of a vertex that they share.

use crate::ray::Ray;

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
        let (tnear, tfar) = (
            (f64::from(ray.tnear) - time) as f32,
            (f64::from(ray.tfar) - time) as f32,
        );
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
                [
                    tnear - tnear.abs() * f32::EPSILON,
                    tfar + tfar.abs() * f32::EPSILON,
                ]
            } else {
                [f32::NEG_INFINITY, f32::INFINITY]
            },
            is_usual,
        }
    }
}
