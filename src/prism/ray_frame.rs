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
        let (shear, per_depth) = slant([direction[x], direction[y], direction[z]]);
        Self {
            axes,
            origin: [origin[x].into(), origin[y].into(), origin[z].into()],
            shear,
            per_depth,
        }
    }
}

/// The shear of a direction, main axis last, and its ray parameter per unit along that.
#[inline(always)]
fn slant([x, y, z]: [f32; 3]) -> ([f64; 2], f64) {
    let per_depth = 1.0 / f64::from(z);
    (
        [f64::from(x) * per_depth, f64::from(y) * per_depth],
        per_depth,
    )
}
