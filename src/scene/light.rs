//! Sources of light.

use std::sync::Arc;

use glam::Vec3;

use crate::image::EnvironmentImage;

/// A source of light. Shapes (sphere, disk, rectangle) shine and hide nothing: rays go through them.
#[derive(Clone, Debug)]
pub enum Light {
    /// A distant disk of the sun's size.
    Sun {
        /// Unit vector towards the sun.
        direction: Vec3,
        /// 1 is a clear day's sun in the sky model's units.
        strength: f32,
    },
    /// A clear daylight sky.
    Sky {
        /// Unit vector towards the sun.
        sun_direction: Vec3,
        /// 2 (very clear) .. 10 (hazy).
        turbidity: f32,
        /// Multiplier.
        strength: f32,
    },
    /// An equirectangular picture around the scene, +Y up.
    Environment {
        /// The picture.
        image: Arc<EnvironmentImage>,
        /// Radians about +Y.
        rotation: f32,
        /// Multiplier.
        strength: f32,
    },
    /// A ball that shines outward.
    Sphere {
        /// Middle.
        center: Vec3,
        /// Above 0.
        radius: f32,
        /// Linear RGB.
        radiance: Vec3,
    },
    /// A disk that shines on the side its normal points to.
    Disk {
        /// Middle.
        center: Vec3,
        /// Unit vector.
        normal: Vec3,
        /// Above 0.
        radius: f32,
        /// Linear RGB.
        radiance: Vec3,
    },
    /// A parallelogram that shines on the side `edges[0] x edges[1]` points to.
    Rectangle {
        /// A corner.
        corner: Vec3,
        /// From it along both sides; not parallel.
        edges: [Vec3; 2],
        /// Linear RGB.
        radiance: Vec3,
    },
    /// A point that shines into all directions.
    Point {
        /// Where.
        position: Vec3,
        /// Radiant intensity, linear RGB.
        intensity: Vec3,
        /// Where it has faded out, above 0; infinite for light as it is.
        range: f32,
    },
    /// A point that shines into a cone.
    Spot {
        /// Where.
        position: Vec3,
        /// Unit vector along the cone's axis, away from the light.
        direction: Vec3,
        /// Cosine of the angle to the axis where the light is gone.
        cos_outer: f32,
        /// Cosine of the angle within which it is full; above `cos_outer`.
        cos_inner: f32,
        /// Radiant intensity on the axis, linear RGB.
        intensity: Vec3,
        /// Where it has faded out, above 0; infinite for light as it is.
        range: f32,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit vector towards the light.
        direction: Vec3,
        /// Irradiance of a surface that faces it, linear RGB.
        irradiance: Vec3,
    },
}

impl Light {
    /// The cosines of a spot's cone, outer and inner, for half angles in radians, `inner` at most `outer`. A hard edge still has the width that
    /// keeps the fall-off a number.
    pub fn cone(outer: f32, inner: f32) -> [f32; 2] {
        let cos_outer = outer.cos();
        let cos_inner = inner.min(outer * (1.0 - 1e-3)).cos();
        [cos_outer, cos_inner.max(cos_outer.next_up())]
    }

    /// Whether it comes from outside of the scene, so that what is closed keeps it out.
    pub fn is_distant(&self) -> bool {
        matches!(
            self,
            Self::Sun { .. }
                | Self::Sky { .. }
                | Self::Environment { .. }
                | Self::Directional { .. }
        )
    }
}
