//! Laws of the wrapper, held against hit tests with known answers.

mod closest;
mod device;
mod edit;
mod faults;
mod filter;
mod instance;
mod motion;
mod packet;
mod scene;
mod tracer;
mod triangles;
mod user;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{Device, DeviceOptions, HitTest, Scene, SceneBuilder, SceneOptions, UserGeometry};
use crate::prism::PrismHit;
use crate::ray::{Aabb, Ray};

/// Balls as (centre, radius), solved in f64.
pub struct Balls(pub Vec<(Vec3, f32)>);

impl Balls {
    pub fn unit() -> Arc<Self> {
        Arc::new(Self(vec![(Vec3::ZERO, 1.0)]))
    }

    /// `n` small balls strewn over a cube of side 10.
    pub fn strewn(n: usize) -> Arc<Self> {
        let mut random = Random(7);
        let ball = |_| (10.0 * random.point(), 0.05 + 0.2 * random.next());
        Arc::new(Self((0..n).map(ball).collect()))
    }

    /// The answer without any tree: every ball asked.
    pub fn first_hit(&self, ray: &Ray) -> Option<(u32, PrismHit)> {
        (0..self.0.len() as u32)
            .filter_map(|prim| Some((prim, self.intersect(prim, ray)?)))
            .min_by(|a, b| a.1.t.total_cmp(&b.1.t))
    }
}

impl HitTest for Balls {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        let (centre, radius) = self.0[prim as usize];
        Aabb {
            min: centre - radius,
            max: centre + radius,
        }
    }

    fn intersect(&self, prim: u32, ray: &Ray) -> Option<PrismHit> {
        let (centre, radius) = self.0[prim as usize];
        let o: DVec3 = (ray.origin - centre).into();
        let d: DVec3 = ray.direction.into();
        let (a, b) = (d.dot(d), o.dot(d));
        let root = (b * b - a * (o.dot(o) - f64::from(radius * radius))).sqrt();
        let t = [(-b - root) / a, (-b + root) / a]
            .map(|t| t as f32)
            .into_iter()
            .find(|&t| t > ray.tnear && t < ray.tfar)?;
        let ng = (o + f64::from(t) * d).normalize().as_vec3();
        Some(PrismHit {
            prim,
            t,
            u: 0.25,
            v: 0.5,
            ng,
        })
    }
}

/// A small generator: what matters is that every run asks the same rays.
pub struct Random(pub u64);

impl Random {
    /// In [0, 1).
    pub fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In the cube of side 1 around the origin.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) - 0.5
    }

    /// From anywhere within 12 units to anywhere, at any speed.
    pub fn ray(&mut self) -> Ray {
        Ray::new(
            12.0 * self.point(),
            self.point() * (0.01 + 10.0 * self.next()),
        )
    }
}

pub fn device() -> Device {
    Device::new(&DeviceOptions::default()).unwrap()
}

/// A committed scene of one user geometry.
pub fn scene_of<T: HitTest + 'static>(device: &Device, test: Arc<T>) -> Scene {
    let mut builder = SceneBuilder::new(device, SceneOptions::default()).unwrap();
    builder
        .attach(UserGeometry::new(device, test).unwrap())
        .unwrap();
    builder.commit().unwrap()
}

/// Along +z from z = -5: meets the unit ball at t = 4 and t = 6.
pub fn axis_ray() -> Ray {
    Ray::new(Vec3::new(0.0, 0.0, -5.0), Vec3::Z)
}
