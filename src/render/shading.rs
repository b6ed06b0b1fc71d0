//! A surface point made ready for shading: sides, normals, material.
//!
//! Two normals meet here. The geometric normal says on which side of the surface a direction is: light from
//! behind it never passes an opaque surface, whatever the shading normal says. The shading normal says how bright it
//! is. Both are turned to the viewer, so surfaces are two-sided.
//!
//! Directions that the shading normal sees and the surface hides are no loss: diffuse light is raised by what they take
//! ([`super::terminator`]), and what other lobes send there is mirrored at the surface, to its twin above (the idea of the facet that closes a tilted
//! one in Schüssler et al., "Microfacet-based Normal Mapping for Robust Monte Carlo Path Tracing", SIGGRAPH Asia 2017).

use glam::{Vec2, Vec3};

use super::basis::Basis;
use super::bsdf::{Allowed, Bounce, Bsdf, Parameters, Scattering};
use super::light::Receiver;
use super::terminator::{gain, terminator};
use crate::surface::SurfacePoint;

/// A surface point seen from some direction.
#[derive(Clone, Copy, Debug)]
pub struct ShadedPoint {
    /// On the surface.
    pub position: Vec3,
    /// Unit geometric normal on the viewer's side.
    pub geometric_normal: Vec3,
    basis: Basis,
    /// Cosine between both normals.
    alignment: f32,
    /// The geometric normal in the shading basis.
    local_geometric: Vec3,
    /// Of diffuse light, for what the terminator takes.
    gain: f32,
    bsdf: Bsdf,
}

/// A direction to go on in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Continuation {
    /// Unit vector, world space.
    pub direction: Vec3,
    /// BSDF times cosine over density.
    pub weight: Vec3,
    /// Density per steradian; `None` for the only direction of a smooth interface.
    pub pdf: Option<f32>,
    /// What kind of bounce.
    pub bounce: Bounce,
}

impl ShadedPoint {
    /// `point` seen from the unit direction `to_viewer`, with the shading normal `normal` on its outer side.
    pub fn new(
        point: &SurfacePoint,
        normal: Vec3,
        to_viewer: Vec3,
        parameters: Parameters,
    ) -> Self {
        let side = if is_outside(point, to_viewer) {
            1.0
        } else {
            -1.0
        };
        let geometric = side * point.geometric_normal;
        let shading = facing(side * normal, geometric, to_viewer);
        let basis = Basis::around(shading);
        let alignment = shading.dot(geometric);
        let mut local = basis.to_local(to_viewer);
        // A viewer in the surface's plane is taken to be just above it.
        local.z = local.z.max(1e-4);
        Self {
            position: point.position,
            geometric_normal: geometric,
            basis,
            alignment,
            local_geometric: basis.to_local(geometric),
            gain: gain(alignment),
            bsdf: Bsdf::new(parameters, local.normalize()),
        }
    }

    /// Unit shading normal on the viewer's side.
    pub fn shading_normal(&self) -> Vec3 {
        self.basis.z
    }

    /// The point as lights see it.
    pub fn receiver(&self) -> Receiver {
        Receiver {
            position: self.position,
            normal: self.basis.z,
        }
    }

    /// The material there.
    pub fn bsdf(&self) -> &Bsdf {
        &self.bsdf
    }

    /// What is scattered to the viewer of light from the unit vector `to_light`; `None` for nothing.
    pub fn scattering(&self, to_light: Vec3, allowed: Allowed) -> Option<Scattering> {
        let above = self.geometric_normal.dot(to_light);
        let local = self.basis.to_local(to_light);
        if above * local.z <= 0.0 {
            return None;
        }
        let mut scattering = self.bsdf.evaluate(local, allowed);
        if above > 0.0 {
            scattering.diffuse *= self.gain * terminator(above, local.z, self.alignment);
        }
        // Of the same side for the shading normal, and not for the surface: what it would send there comes here.
        let twin = local - 2.0 * above * self.local_geometric;
        if twin.z * above > 0.0 {
            let hidden = self.bsdf.evaluate(twin, allowed);
            scattering.glossy += hidden.glossy;
            scattering.transmission += hidden.transmission;
            scattering.pdf += hidden.pdf;
        }
        Some(scattering)
    }

    /// A direction by the kinds of bounces that are `allowed`; `choice` and `u` are uniform in [0, 1). `None` where it
    /// would go nowhere.
    pub fn sample(&self, choice: f32, u: Vec2, allowed: Allowed) -> Option<Continuation> {
        let sample = self.bsdf.sample(choice, u, allowed)?;
        let mut direction = self.basis.to_world(sample.direction);
        let above = self.geometric_normal.dot(direction);
        if above * sample.direction.z <= 0.0 {
            direction -= 2.0 * above * self.geometric_normal;
        }
        let (weight, pdf) = match sample.mirror_weight {
            Some(weight) => (weight, None),
            None => {
                let found = self.scattering(direction, allowed)?;
                if found.pdf <= 0.0 {
                    return None;
                }
                (found.part(allowed) / found.pdf, Some(found.pdf))
            }
        };
        Some(Continuation {
            direction,
            weight,
            pdf,
            bounce: sample.bounce,
        })
    }
}

/// Whether the unit direction `to_viewer` leaves `point` on the outer side.
pub fn is_outside(point: &SurfacePoint, to_viewer: Vec3) -> bool {
    point.geometric_normal.dot(to_viewer) >= 0.0
}

/// The shading normal, bent as little as needed for the viewer's mirror direction to be above the surface, so
/// that no edge turns black: Keller et al., "The Iray Light Transport Simulation and Rendering System", 2017,
/// section A.3. All unit vectors; `to_viewer` is above the surface.
fn facing(shading: Vec3, geometric: Vec3, to_viewer: Vec3) -> Vec3 {
    let mirrored = 2.0 * shading.dot(to_viewer) * shading - to_viewer;
    let depth = geometric.dot(mirrored);
    if depth >= 0.0 && shading.dot(to_viewer) > 0.0 {
        return shading;
    }
    let along = shading.dot(geometric).max(1e-3);
    let lifted = (mirrored - shading * (depth.min(0.0) / along)).normalize_or(geometric);
    let bent = (to_viewer + lifted).normalize_or(geometric);
    // A shading normal that points into the surface bends to nothing sensible.
    if bent.dot(geometric) > 0.0 && bent.dot(to_viewer) > 0.0 {
        bent
    } else {
        geometric
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::material;
    use crate::scene::{Color, Material, Scalar};

    fn point(geometric: Vec3, shading: Vec3) -> SurfacePoint {
        SurfacePoint {
            position: Vec3::ZERO,
            base_position: Vec3::ZERO,
            base_normal: geometric,
            geometric_normal: geometric,
            shading_normal: shading.normalize(),
            texcoord: Vec2::ZERO,
            displacement: 0.0,
            tolerance: 0.0,
        }
    }

    fn seen(point: SurfacePoint, to_viewer: Vec3) -> ShadedPoint {
        let material = Material {
            base_color: Color::Constant(Vec3::ONE),
            roughness: Scalar::Constant(0.3),
            ..Material::default()
        };
        let white = material::parameters(&material, &point, 1.5, false);
        ShadedPoint::new(&point, point.shading_normal, to_viewer, white)
    }

    #[test]
    fn both_sides_look_the_same() {
        let shading = Vec3::new(0.2, 1.0, 0.1);
        let v = Vec3::new(0.3, 0.8, -0.2).normalize();
        let l = Vec3::new(-0.5, 0.6, 0.3).normalize();
        let front = seen(point(Vec3::Y, shading), v);
        let back = seen(point(Vec3::NEG_Y, -shading), v);
        let [front, back] = [front, back].map(|p| p.scattering(l, Allowed::ALL));
        assert_eq!(front, back);
        assert!(front.unwrap().diffuse.x > 0.0);
    }

    #[test]
    fn light_from_behind_the_surface_never_passes() {
        // The shading normal sees a light that the surface itself hides.
        let p = seen(point(Vec3::Y, Vec3::new(1.0, 1.0, 0.0)), Vec3::Y);
        let behind = Vec3::new(1.0, -0.1, 0.0).normalize();
        assert!(p.shading_normal().dot(behind) > 0.0);
        assert_eq!(p.scattering(behind, Allowed::ALL), None);
    }

    #[test]
    fn normals_always_face_the_viewer_and_mirror_above_the_surface() {
        for i in 1..60 {
            let elevation = i as f32 / 40.0;
            let v = Vec3::new(elevation.cos(), elevation.sin(), 0.0);
            if v.y <= 0.0 {
                continue;
            }
            for tilt in [-1.5, -0.8, -0.3, 0.0, 0.3, 0.8, 1.5_f32] {
                for turn in [0.0_f32, 0.9] {
                    let shading =
                        Vec3::new(tilt.sin() * turn.cos(), tilt.cos(), tilt.sin() * turn.sin());
                    let n = facing(shading, Vec3::Y, v);
                    assert!((n.length() - 1.0).abs() < 1e-4);
                    assert!(n.dot(v) > 0.0 && n.y > 0.0);
                    let mirrored = 2.0 * n.dot(v) * n - v;
                    assert!(mirrored.y > -1e-3, "{elevation} {tilt} {turn} {mirrored}");
                }
            }
        }
    }

    #[test]
    fn a_sound_normal_stays_as_it_is() {
        let n = Vec3::new(0.1, 1.0, 0.0).normalize();
        assert_eq!(facing(n, Vec3::Y, Vec3::new(0.0, 0.8, 0.6)), n);
    }
}
