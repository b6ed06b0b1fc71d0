//! A surface point made ready for shading: sides, normals, material.
//!
//! Two normals meet here. The geometric normal says on which side of the surface a direction is: light from
//! behind it never passes, whatever the shading normal says. The shading normal says how bright it is. Both are
//! turned to the viewer, so surfaces are two-sided.

use glam::Vec3;

use super::basis::Basis;
use super::material::{Bsdf, Scattering, SpecularSample};
use crate::surface::SurfacePoint;

/// A surface point seen from some direction.
#[derive(Clone, Copy, Debug)]
pub struct ShadedPoint {
    /// On the surface.
    pub position: Vec3,
    /// Unit geometric normal on the viewer's side.
    pub geometric_normal: Vec3,
    /// See [`SurfacePoint::tolerance`].
    pub tolerance: f32,
    basis: Basis,
    /// Cosine between both normals.
    alignment: f32,
    /// To the viewer, in `basis`.
    to_viewer: Vec3,
    bsdf: Bsdf,
}

impl ShadedPoint {
    /// `point` seen from the unit direction `to_viewer`.
    pub fn new(point: &SurfacePoint, to_viewer: Vec3, bsdf: Bsdf) -> Self {
        let side = if point.geometric_normal.dot(to_viewer) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let geometric = side * point.geometric_normal;
        let shading = facing(side * point.shading_normal, geometric, to_viewer);
        let basis = Basis::around(shading);
        Self {
            position: point.position,
            geometric_normal: geometric,
            tolerance: point.tolerance,
            basis,
            alignment: shading.dot(geometric),
            to_viewer: basis.to_local(to_viewer),
            bsdf,
        }
    }

    /// Unit shading normal on the viewer's side.
    pub fn shading_normal(&self) -> Vec3 {
        self.basis.z
    }

    /// Whether a reflection ray could change the picture.
    pub fn reflects(&self) -> bool {
        self.to_viewer.z > 0.0 && self.bsdf.reflects(self.to_viewer)
    }

    /// What is scattered to the viewer of light from the unit vector `to_light`; `None` for nothing.
    pub fn scattering(&self, to_light: Vec3) -> Option<Scattering> {
        let above = self.geometric_normal.dot(to_light);
        let local = self.basis.to_local(to_light);
        if above <= 0.0 || local.z <= 0.0 {
            return None;
        }
        let mut scattering = self.bsdf.evaluate(self.to_viewer, local);
        scattering.diffuse *= terminator(above, local.z, self.alignment);
        Some(scattering)
    }

    /// A direction of the specular lobe, in world space; `None` where it would go below the surface.
    pub fn sample_specular(&self, u: glam::Vec2) -> Option<SpecularSample> {
        let sample = self.bsdf.sample_specular(self.to_viewer, u)?;
        let direction = self.basis.to_world(sample.direction);
        (self.geometric_normal.dot(direction) > 0.0).then_some(SpecularSample {
            direction,
            ..sample
        })
    }
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

/// Darkens diffuse light smoothly towards the geometric horizon, where it would end at a hard facetted line:
/// Chiang, Li, Burley, "Taming the Shadow Terminator", SIGGRAPH 2019 talks.
fn terminator(above_geometric: f32, above_shading: f32, alignment: f32) -> f32 {
    let g = (above_geometric / (above_shading * alignment.max(1e-3))).min(1.0);
    ((1.0 - g) * g + 1.0) * g
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::scene::{Color, Material};

    fn point(geometric: Vec3, shading: Vec3) -> SurfacePoint {
        SurfacePoint {
            position: Vec3::ZERO,
            base_position: Vec3::ZERO,
            geometric_normal: geometric,
            shading_normal: shading.normalize(),
            texcoord: Vec2::ZERO,
            displacement: 0.0,
            tolerance: 0.0,
        }
    }

    fn white() -> Bsdf {
        let material = Material {
            name: "white".into(),
            base_color: Color::Constant(Vec3::ONE),
            metallic: 0.0,
            roughness: 0.3,
            specular: 0.5,
        };
        Bsdf::new(&material, Vec2::ZERO)
    }

    #[test]
    fn both_sides_look_the_same() {
        let shading = Vec3::new(0.2, 1.0, 0.1);
        let v = Vec3::new(0.3, 0.8, -0.2).normalize();
        let l = Vec3::new(-0.5, 0.6, 0.3).normalize();
        let front = ShadedPoint::new(&point(Vec3::Y, shading), v, white());
        let back = ShadedPoint::new(&point(Vec3::NEG_Y, -shading), v, white());
        assert_eq!(front.scattering(l), back.scattering(l));
        assert!(front.scattering(l).unwrap().diffuse.x > 0.0);
    }

    #[test]
    fn light_from_behind_the_surface_never_passes() {
        // The shading normal sees a light that the surface itself hides.
        let p = ShadedPoint::new(&point(Vec3::Y, Vec3::new(1.0, 1.0, 0.0)), Vec3::Y, white());
        let behind = Vec3::new(1.0, -0.1, 0.0).normalize();
        assert!(p.shading_normal().dot(behind) > 0.0);
        assert_eq!(p.scattering(behind), None);
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

    #[test]
    fn the_terminator_is_smooth_and_leaves_flat_surfaces_alone() {
        assert_eq!(terminator(0.4, 0.4, 1.0), 1.0);
        assert_eq!(terminator(0.0, 0.4, 0.9), 0.0);
        let mut last = 0.0;
        for i in 0..100 {
            let g = terminator(i as f32 / 200.0, 0.5, 0.9);
            assert!(g >= last && g - last < 0.05);
            last = g;
        }
    }
}
