//! Level of detail by the ray's cone: the surface as a footprint sees it.
//!
//! Hits are exact. What is seen there is the mean over the footprint, by the map's means
//! ([`DisplacementMap::averaged`](crate::surface::DisplacementMap::averaged)).

use std::sync::atomic::Ordering;

use glam::{DVec3, Vec3};

use super::{PrismHit, Prisms};
use crate::ray::Footprint;
use crate::surface::{HeightSample, Patch, ShadingNormals, SurfacePoint, smooth_normal};

/// Whether surfaces are seen as the ray's cone sees them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lod {
    /// As they are, texel by texel.
    #[default]
    Off,
    /// [`Prisms::seen_point`] has the normals of the mean surface over the cone's width. Hits are the same as without.
    ///
    /// Rays that leave such a point are to start half the cone's width further off the surface ([`Prisms::tolerance`]): from where they
    /// are not shaded by texels that the cone does not show.
    Cone,
}

impl Lod {
    /// `off` or `cone`, as in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Cone => "cone",
        }
    }
}

/// A unit normal on the side of the unit vector `to_ray`. A mean may lean away from a ray that meets the surface from that side: then it is
/// leant back by as little as shows.
fn turned(normal: Vec3, to_ray: Vec3) -> Vec3 {
    const LEAST: f32 = 0.02;
    let facing = normal.dot(to_ray);
    if facing >= LEAST {
        return normal;
    }
    (normal + (LEAST - facing) * to_ray).normalize_or(to_ray)
}

/// Footprints are no longer along the surface than this many times their width: surfaces seen at a smaller angle would be blurred
/// across, too, and that shows more than what may alias.
const LONGEST: f64 = 8.0;

impl Prisms {
    /// Whether surfaces are seen as the ray's cone sees them.
    pub fn lod(&self) -> Lod {
        self.lod
    }

    /// Growth of a cone from the eye per unit of length: radians, 0 until [`Self::set_spread`] is called.
    pub fn spread(&self) -> f32 {
        f32::from_bits(self.spread.load(Ordering::Relaxed))
    }

    /// Sets the spread of the cones of [`Lod::Cone`]: the angle of one pixel, 2 tan(fov / 2) / height. Does nothing where level of
    /// detail is off; with 0, or what is no positive number, surfaces are seen as they are. Takes effect at once: nothing is
    /// built anew when a camera zooms.
    pub fn set_spread(&self, spread: f32) {
        let sound = self.lod == Lod::Cone && spread > 0.0 && spread.is_finite();
        let spread = if sound { spread } else { 0.0 };
        self.spread.store(spread.to_bits(), Ordering::Relaxed);
    }

    /// Half the width of the cone at parameter `t` of a ray along `direction`, in units of both: [`SurfacePoint::tolerance`] of what is seen
    /// there.
    pub fn tolerance(&self, direction: Vec3, t: f32) -> f32 {
        0.5 * self.spread() * t * direction.length()
    }

    /// All a shader wants to know of a hit, as a footprint sees it: both normals are of the mean surface over it, the geometric one on the
    /// side of the hit's. All in the object's own space. [`Self::point`] where level of detail is off.
    pub fn seen_point(&self, hit: &PrismHit, footprint: &Footprint) -> SurfacePoint {
        let &PrismHit { prim, u, v, ng, .. } = hit;
        let point = self.point(prim, u, v);
        if self.spread() == 0.0 || prim as usize >= self.surface.mesh().triangles().len() {
            return point;
        }
        let patch = self.surface.patch(prim);
        let (u, v) = (f64::from(u), f64::from(v));
        let Some(sample) = self.seen(prim, &patch, [u, v], footprint) else {
            return SurfacePoint {
                geometric_normal: ng,
                ..point
            };
        };
        let tangents = patch.point_of(sample, u, v);
        let normal = tangents.du.cross(tangents.dv).as_vec3();
        let to_ray = footprint.direction * ng.dot(footprint.direction).signum();
        let geometric_normal = turned(normal.normalize_or(ng), to_ray.normalize());
        let shading_normal = match self.surface.shading_normals() {
            ShadingNormals::Geometric => geometric_normal,
            _ => {
                let frames = self.surface.corner_frames(prim);
                self.surface
                    .shading_normal(&patch, frames.as_ref(), [sample; 2], u, v)
            }
        };
        SurfacePoint {
            geometric_normal,
            shading_normal,
            ..point
        }
    }

    /// Height and gradient of the map over a footprint; `None` where it is no wider than a texel.
    fn seen(
        &self,
        prim: u32,
        patch: &Patch<'_>,
        [u, v]: [f64; 2],
        footprint: &Footprint,
    ) -> Option<HeightSample> {
        let charts = self.charts.as_ref()?;
        let direction = footprint.direction.as_dvec3().normalize();
        let normal = patch.normal(u, v).normalize_or_zero();
        let ([a, b, c], [to_u, to_v]) = (patch.texels, smooth_normal::dual_edges(patch));
        let texels =
            |along: DVec3| (to_u.dot(along) * (b - a) + to_v.dot(along) * (c - a)).length();
        // The footprint's axes on the surface: across the ray, and along it, where it is longer as the ray is flatter.
        let across = direction.cross(normal);
        let across = across
            .try_normalize()
            .unwrap_or_else(|| direction.any_orthonormal_vector());
        let along = normal.cross(across);
        let stretch = (1.0 / direction.dot(normal).abs()).min(LONGEST);
        let width = f64::from(footprint.width) * texels(across).max(stretch * texels(along));
        // A mean over some width is taken from no farther than 5/4 of it.
        let room = 0.8 * charts.distance(prim, patch.texels, [1.0 - u - v, u, v]);
        patch.map.averaged(patch.texel(u, v), width.min(room))
    }
}
