//! Which bodies a path is in: nested dielectrics.
//!
//! Source: Schmidt and Budge, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002.
//! Bodies may overlap; where they do, the one of the highest priority fills the space, and the boundaries of the
//! others are not there. So a drink is modelled a little larger than the inside of its glass, and the glass has the
//! higher priority. Among equals the one that was entered last wins.

use glam::Vec3;

use crate::scene::Material;

/// Most bodies at a time; further ones are not noticed.
const MOST: usize = 8;

/// The bodies around a point of a path, as indices of their materials, in the order they were entered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bodies {
    entered: [u32; MOST],
    count: usize,
}

/// What a dielectric boundary is to a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Index of refraction beyond over that before; `None` where the boundary is not there.
    pub eta: Option<f32>,
    /// The bodies beyond.
    pub beyond: Bodies,
}

impl Bodies {
    /// The boundary of the body of material `index`, met from its outside or from within.
    pub fn cross(&self, materials: &[Material], index: usize, from_outside: bool) -> Crossing {
        let beyond = if from_outside {
            self.with(index)
        } else {
            self.without(index)
        };
        let (before, after) = (self.filling(materials), beyond.filling(materials));
        let same = before == after;
        let ior = |body: Option<usize>| body.map_or(1.0, |i| materials[i].ior);
        let eta = ior(after) / ior(before);
        // The same index on both sides neither bends nor reflects.
        Crossing {
            eta: (!same && eta != 1.0).then_some(eta),
            beyond,
        }
    }

    /// What is left of light after a way of this length, world units: Beer and Lambert's law.
    pub fn transmittance(&self, materials: &[Material], length: f32) -> Vec3 {
        match self.filling(materials).map(|i| &materials[i]) {
            Some(m) if m.attenuation_distance.is_finite() && m.attenuation_color != Vec3::ONE => {
                let part = length / m.attenuation_distance;
                m.attenuation_color.powf(part)
            }
            _ => Vec3::ONE,
        }
    }

    /// The body that fills the space.
    fn filling(&self, materials: &[Material]) -> Option<usize> {
        let entered = self.entered[..self.count].iter().map(|&i| i as usize);
        // Of equals the last.
        entered.max_by_key(|&i| materials[i].priority)
    }

    fn with(mut self, index: usize) -> Self {
        if self.count < MOST {
            self.entered[self.count] = index as u32;
            self.count += 1;
        }
        self
    }

    /// One of several of the same material; nothing changes where a mesh is left that was never entered.
    fn without(mut self, index: usize) -> Self {
        let entered = &self.entered[..self.count];
        if let Some(at) = entered.iter().rposition(|&i| i as usize == index) {
            self.entered.copy_within(at + 1..self.count, at);
            self.count -= 1;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn materials() -> [Material; 3] {
        [(1.5, 1), (1.33, 0), (2.0, 1)].map(|(ior, priority)| Material {
            ior,
            priority,
            ..Material::default()
        })
    }

    const GLASS: usize = 0;
    const WATER: usize = 1;

    #[test]
    fn the_boundary_of_water_inside_glass_is_not_there() {
        let m = materials();
        let outside = Bodies::default();
        let glass = outside.cross(&m, GLASS, true);
        assert_eq!(glass.eta, Some(1.5));
        let overlap = glass.beyond.cross(&m, WATER, true);
        assert_eq!(overlap.eta, None);
        // Out of the glass is into the water.
        let water = overlap.beyond.cross(&m, GLASS, false);
        assert_eq!(water.eta, Some(1.33 / 1.5));
        let out = water.beyond.cross(&m, WATER, false);
        assert_eq!(out.eta, Some(1.0 / 1.33));
        assert_eq!(out.beyond.count, 0);
    }

    #[test]
    fn among_equals_the_last_entered_wins() {
        let m = materials();
        let glass = Bodies::default().cross(&m, GLASS, true).beyond;
        let other = glass.cross(&m, 2, true);
        assert_eq!(other.eta, Some(2.0 / 1.5));
        assert_eq!(other.beyond.cross(&m, 2, false).eta, Some(1.5 / 2.0));
        // The same body twice is one body.
        assert_eq!(glass.cross(&m, GLASS, true).eta, None);
    }

    #[test]
    fn absorption_is_exponential() {
        let mut m = materials();
        m[GLASS].attenuation_color = Vec3::new(0.5, 1.0, 0.25);
        m[GLASS].attenuation_distance = 2.0;
        let glass = Bodies::default().cross(&m, GLASS, true).beyond;
        let after = glass.transmittance(&m, 4.0);
        assert!(after.abs_diff_eq(Vec3::new(0.25, 1.0, 0.0625), 1e-6));
        assert_eq!(Bodies::default().transmittance(&m, 4.0), Vec3::ONE);
    }

    #[test]
    fn leaving_what_was_never_entered_does_no_harm() {
        let m = materials();
        let crossing = Bodies::default().cross(&m, GLASS, false);
        assert_eq!((crossing.eta, crossing.beyond), (None, Bodies::default()));
    }
}
