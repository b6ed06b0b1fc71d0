//! An orthonormal basis around a direction.

use glam::Vec3;

/// Three orthonormal axes; `z` is the direction it was built around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// The direction itself.
    pub z: Vec3,
}

impl Basis {
    /// A basis around the unit vector `z`, without branches or poles: Duff et al., "Building an Orthonormal
    /// Basis, Revisited", JCGT 6(1), 2017.
    pub fn around(z: Vec3) -> Self {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// World to basis.
    pub fn to_local(self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// Basis to world.
    pub fn to_world(self, v: Vec3) -> Vec3 {
        v.x * self.x + v.y * self.y + v.z * self.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_orthonormal_and_right_handed_everywhere() {
        let near_pole = Vec3::new(1e-5, -1e-5, -1.0).normalize();
        for z in [Vec3::X, Vec3::NEG_Z, Vec3::Z, Vec3::NEG_Y, near_pole] {
            let basis = Basis::around(z);
            assert!(basis.x.cross(basis.y).abs_diff_eq(z, 1e-6), "{basis:?}");
            let v = Vec3::new(0.3, -0.5, 0.7);
            assert!(basis.to_world(basis.to_local(v)).abs_diff_eq(v, 1e-6));
        }
    }
}
