//! Lights with an area: sphere, disk, rectangle. They shine and hide nothing.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::color::luminance;
use super::{LightSample, LocalLight};
use crate::render::basis::Basis;

/// A ball that shines outward.
#[derive(Clone, Copy, Debug)]
pub struct SphereLight {
    /// Middle.
    pub center: Vec3,
    /// Above 0.
    pub radius: f32,
    /// Linear RGB.
    pub radiance: Vec3,
}

impl SphereLight {
    /// 1 - cos of the angular radius seen from `position`; `None` from inside, where it does not shine.
    fn cap(&self, position: Vec3) -> Option<f32> {
        let sin2 = self.radius * self.radius / self.center.distance_squared(position);
        // 1 - sqrt(1 - s) without losing the digits of a small s.
        (sin2 < 1.0).then(|| sin2 / (1.0 + (1.0 - sin2).sqrt()))
    }

    fn distance(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let to_center = self.center - origin;
        let along = to_center.dot(direction);
        let beside = (to_center - along * direction).length_squared();
        let half_chord = self.radius * self.radius - beside;
        let from_outside = to_center.length_squared() > self.radius * self.radius;
        (half_chord >= 0.0 && from_outside && along > 0.0).then(|| along - half_chord.sqrt())
    }
}

impl LocalLight for SphereLight {
    /// Uniform over the cone of directions to it.
    fn sample(&self, position: Vec3, u: Vec2) -> LightSample {
        let Some(cap) = self.cap(position) else {
            return LightSample::NONE;
        };
        let drop = u.y * cap;
        let radius = (drop * (2.0 - drop)).max(0.0).sqrt();
        let (sin, cos) = (TAU * u.x).sin_cos();
        let axis = Basis::around((self.center - position).normalize());
        let direction = axis.to_world(Vec3::new(radius * cos, radius * sin, 1.0 - drop));
        // At the rim rounding may miss the sphere: its middle's distance is right there.
        let rim = self.center.distance(position);
        LightSample {
            direction,
            distance: self.distance(position, direction).unwrap_or(rim),
            radiance: self.radiance,
            pdf: 1.0 / (TAU * cap),
            is_delta: false,
        }
    }

    fn pdf(&self, position: Vec3, direction: Vec3) -> f32 {
        match (self.cap(position), self.distance(position, direction)) {
            (Some(cap), Some(_)) => 1.0 / (TAU * cap),
            _ => 0.0,
        }
    }

    fn meet(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        Some((self.distance(origin, direction)?, self.radiance))
    }

    fn power(&self) -> f32 {
        4.0 * PI * PI * self.radius * self.radius * luminance(self.radiance)
    }
}

/// A flat light: a disk or a parallelogram, that shines on one side.
#[derive(Clone, Copy, Debug)]
pub struct FlatLight {
    corner: Vec3,
    edges: [Vec3; 2],
    /// Unit normal, to the bright side.
    normal: Vec3,
    area: f32,
    round: bool,
    radiance: Vec3,
}

impl FlatLight {
    /// A parallelogram, bright where `edges[0] x edges[1]` points to.
    pub fn rectangle(corner: Vec3, edges: [Vec3; 2], radiance: Vec3) -> Self {
        let span = edges[0].cross(edges[1]);
        Self {
            corner,
            edges,
            normal: span.normalize(),
            area: span.length(),
            round: false,
            radiance,
        }
    }

    /// A disk, bright where the unit `normal` points to.
    pub fn disk(center: Vec3, normal: Vec3, radius: f32, radiance: Vec3) -> Self {
        let basis = Basis::around(normal);
        Self {
            corner: center,
            edges: [radius * basis.x, radius * basis.y],
            normal,
            area: PI * radius * radius,
            round: true,
            radiance,
        }
    }

    /// Where a ray from the bright side meets it.
    fn distance(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let facing = -direction.dot(self.normal);
        if facing <= 0.0 {
            return None;
        }
        let t = (origin - self.corner).dot(self.normal) / facing;
        let at = origin + t * direction - self.corner;
        let [a, b] = self.edges;
        let dual = |e: Vec3, other: Vec3| {
            at.dot(other.cross(self.normal)) / e.dot(other.cross(self.normal))
        };
        let st = Vec2::new(dual(a, b), dual(b, a));
        let inside = if self.round {
            st.length_squared() <= 1.0
        } else {
            st.cmpge(Vec2::ZERO).all() && st.cmple(Vec2::ONE).all()
        };
        (t > 0.0 && inside).then_some(t)
    }

    /// Density per steradian of a point at this distance, seen in `direction`.
    fn density(&self, direction: Vec3, distance: f32) -> f32 {
        distance * distance / (self.area * -direction.dot(self.normal))
    }
}

impl LocalLight for FlatLight {
    /// Uniform over the area.
    fn sample(&self, position: Vec3, u: Vec2) -> LightSample {
        let st = if self.round {
            u.y.sqrt() * Vec2::from_angle(TAU * u.x)
        } else {
            u
        };
        let to = self.corner + st.x * self.edges[0] + st.y * self.edges[1] - position;
        let distance = to.length();
        let direction = to / distance;
        if distance == 0.0 || direction.dot(self.normal) >= 0.0 {
            return LightSample::NONE;
        }
        LightSample {
            direction,
            distance,
            radiance: self.radiance,
            pdf: self.density(direction, distance),
            is_delta: false,
        }
    }

    fn pdf(&self, position: Vec3, direction: Vec3) -> f32 {
        self.distance(position, direction)
            .map_or(0.0, |t| self.density(direction, t))
    }

    fn meet(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        Some((self.distance(origin, direction)?, self.radiance))
    }

    fn power(&self) -> f32 {
        PI * self.area * luminance(self.radiance)
    }
}
