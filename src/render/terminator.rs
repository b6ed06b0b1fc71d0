//! Where diffuse light ends, when the shading normal is not the surface's own: smoothly, and without a loss.
//!
//! Light from below the surface's horizon never comes, whatever the shading normal says. Left alone, that cuts shaded light off at a hard line
//! on every facet, so it fades out towards the horizon as in Chiang, Li and Burley, "Taming the Shadow Terminator", SIGGRAPH 2019
//! talks, but over a third of their range: over all of it the fading shows whole facets of a coarse mesh, and darkens far more than it smooths. What
//! fades, and what is hidden, is given back to the directions that are left: white surfaces in a white world stay white.

use std::f32::consts::TAU;
use std::sync::LazyLock;

use glam::Vec3;

/// Light has its full part from where it is this much nearer to the surface's horizon than to the shading normal's.
const STEEPNESS: f32 = 3.0;

/// Steps of the table, and of its integrals along each axis.
const STEPS: usize = 32;
const POINTS: usize = 80;

/// The part of diffuse light that comes from a direction; its cosines with the geometric and with the shading normal are above 0,
/// `alignment` is that between the normals, at most 1 and above 0.
pub fn terminator(above_geometric: f32, above_shading: f32, alignment: f32) -> f32 {
    let g = STEEPNESS * above_geometric / (above_shading * alignment.max(1e-3));
    let g = g.min(1.0);
    ((1.0 - g) * g + 1.0) * g
}

/// One over the part of cosine-weighted light from all around that [`terminator`] leaves.
pub fn gain(alignment: f32) -> f32 {
    static GAINS: LazyLock<Vec<f32>> = LazyLock::new(|| {
        let alignments = (0..=STEPS).map(|i| i as f32 / STEPS as f32);
        alignments.map(|a| 1.0 / left(a.max(1e-3))).collect()
    });
    let x = alignment.clamp(0.0, 1.0) * STEPS as f32;
    let i = (x as usize).min(STEPS - 1);
    let [low, high] = [GAINS[i], GAINS[i + 1]];
    low + (x - i as f32) * (high - low)
}

/// The mean of [`terminator`] over directions by their cosine with the shading normal.
fn left(alignment: f32) -> f32 {
    let geometric = Vec3::new((1.0 - alignment * alignment).sqrt(), 0.0, alignment);
    let middle = |i: usize| (i as f32 + 0.5) / POINTS as f32;
    let parts = (0..POINTS * POINTS).map(|i| {
        let (u, turn) = (middle(i / POINTS), TAU * middle(i % POINTS));
        let radius = u.sqrt();
        let light = Vec3::new(radius * turn.cos(), radius * turn.sin(), (1.0 - u).sqrt());
        let above = geometric.dot(light);
        if above > 0.0 {
            terminator(above, light.z, alignment)
        } else {
            0.0
        }
    });
    parts.sum::<f32>() / (POINTS * POINTS) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_terminator_is_smooth_and_leaves_flat_surfaces_alone() {
        assert_eq!(terminator(0.4, 0.4, 1.0), 1.0);
        assert_eq!(terminator(0.0, 0.4, 0.9), 0.0);
        let mut last = 0.0;
        for i in 0..300 {
            let g = terminator(i as f32 / 600.0, 0.5, 0.9);
            assert!(g >= last && g - last < 0.05);
            last = g;
        }
        assert_eq!(last, 1.0);
    }

    #[test]
    fn what_fades_is_given_back() {
        assert_eq!(gain(1.0), 1.0);
        // Without fading (1 + cos) / 2 would be left: less is, and not by much.
        for degrees in [5.0_f32, 20.0, 40.0, 60.0, 85.0] {
            let alignment = degrees.to_radians().cos();
            let hard = 0.5 * (1.0 + alignment);
            let exact = left(alignment);
            assert!(
                exact < 1.002 * hard && exact > 0.88 * hard,
                "{degrees}: {exact} {hard}"
            );
            assert!((gain(alignment) * exact - 1.0).abs() < 4e-3, "{degrees}");
        }
    }
}
