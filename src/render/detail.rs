//! Detail finer than the displacement: normal and bump maps turn the smooth displaced normal.

use glam::{Vec2, Vec3};

use crate::scene::{Detail, ScalarTexture};
use crate::surface::SurfacePoint;

/// The shading normal at `point` with its detail, unit, on the outer side. `tangents` are dP/ds and dP/dt of the
/// undisplaced surface; without them there is no detail.
///
/// The tangents are laid into the plane of the displaced normal first, so that detail follows the displacement.
pub fn normal(detail: &Detail, point: &SurfacePoint, tangents: Option<[Vec3; 2]>) -> Vec3 {
    let n = point.shading_normal;
    let Some([along_s, along_t]) = tangents else {
        return n;
    };
    let in_plane = |v: Vec3| v - n * n.dot(v);
    let (along_s, along_t) = (in_plane(along_s), in_plane(along_t));
    let turned = match detail {
        Detail::NormalMap { texture, strength } => {
            let m = 2.0 * texture.sample(point) - 1.0;
            let tilt = *strength * Vec2::new(m.x, m.y);
            let (s, t) = (along_s.normalize_or_zero(), along_t.normalize_or_zero());
            tilt.x * s + tilt.y * t + m.z.max(1e-3) * n
        }
        Detail::Bump(heights) => {
            // Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010, equation 4: n - the surface gradient,
            // here by the dual basis of the tangents.
            let slope = slope(heights, point.texcoord);
            let determinant = along_s.cross(along_t).dot(n);
            if determinant == 0.0 {
                return n;
            }
            let gradient = (slope.x * along_t.cross(n) + slope.y * n.cross(along_s)) / determinant;
            n - gradient
        }
    };
    turned.normalize_or(n)
}

/// dh/ds and dh/dt along the mesh's texture coordinates, world units.
fn slope(heights: &ScalarTexture, texcoord: Vec2) -> Vec2 {
    let uv = heights.uv.to_affine();
    let gradient = heights.image.smooth_gradient(uv.transform_point2(texcoord));
    heights.factor * (uv.matrix2.transpose() * gradient)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::image::{ColorImage, ColorPixels, ScalarImage};
    use crate::scene::{Coordinates, Texture};
    use crate::surface::{Texels, UvTransform, Wrap};

    fn point() -> SurfacePoint {
        SurfacePoint {
            position: Vec3::ZERO,
            base_position: Vec3::ZERO,
            base_normal: Vec3::Z,
            geometric_normal: Vec3::Z,
            shading_normal: Vec3::Z,
            texcoord: Vec2::new(0.4, 0.6),
            tolerance: 0.0,
            displacement: 0.0,
        }
    }

    /// Texture coordinates run twice as fast along y as along x.
    const TANGENTS: Option<[Vec3; 2]> = Some([Vec3::X, Vec3::new(0.0, 0.5, 0.0)]);

    #[test]
    fn a_bump_ramp_tilts_by_its_slope() {
        let ramp = Texels::F32((0..64 * 8).map(|i| (i % 64) as f32 / 64.0).collect());
        let image = Arc::new(ScalarImage::new(64, 8, ramp, [Wrap::Clamp; 2]).unwrap());
        let slope = |uv: UvTransform| {
            let bump = ScalarTexture {
                image: image.clone(),
                uv,
                factor: 0.3,
            };
            let n = normal(&Detail::Bump(bump), &point(), TANGENTS);
            Vec2::new(-n.x / n.z, -n.y / n.z)
        };
        assert!(slope(UvTransform::default()).abs_diff_eq(Vec2::new(0.3, 0.0), 1e-5));
        let turned = UvTransform {
            rotation: std::f32::consts::FRAC_PI_2,
            ..UvTransform::default()
        };
        // Turned by 90 degrees the ramp runs along -t, of which a unit is half as long.
        let offset = UvTransform {
            offset: Vec2::new(1.1, 0.0),
            ..turned
        };
        assert!(
            slope(offset).abs_diff_eq(Vec2::new(0.0, -0.6), 1e-5),
            "{}",
            slope(offset)
        );
    }

    #[test]
    fn a_normal_map_leans_along_its_tangents() {
        let texture = |rgb: [f32; 3]| Texture {
            image: Arc::new(ColorImage {
                width: 1,
                height: 1,
                pixels: ColorPixels::Linear(vec![rgb]),
            }),
            wrap: [Wrap::Repeat; 2],
            uv: UvTransform::default(),
            coordinates: Coordinates::Uv,
        };
        let lean = |rgb, tangents| {
            let texture = texture(rgb);
            let map = Detail::NormalMap {
                texture,
                strength: 1.0,
            };
            normal(&map, &point(), tangents)
        };
        assert_eq!(lean([0.5, 0.5, 1.0], TANGENTS), Vec3::Z);
        assert!(lean([0.8, 0.5, 0.9], TANGENTS).abs_diff_eq(Vec3::new(0.6, 0.0, 0.8), 1e-6));
        assert!(lean([0.5, 0.8, 0.9], TANGENTS).abs_diff_eq(Vec3::new(0.0, 0.6, 0.8), 1e-6));
        assert_eq!(lean([0.8, 0.5, 0.9], None), Vec3::Z);
    }
}
