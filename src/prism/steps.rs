//! Steps of a march, counted. Only kernels of their own do ([`Prisms::counting_steps`]): the usual ones have no counter in them.

use std::cell::Cell;

use super::Prisms;
use super::kernel::Kernel;

thread_local! {
    static STEPS: Cell<u64> = const { Cell::new(0) };
}

/// One step on this thread.
#[inline(always)]
pub fn count() {
    STEPS.set(STEPS.get() + 1);
}

/// What `call` returns, and how many steps the marches of [counting](Prisms::counting_steps) prisms took in it, on the calling
/// thread.
///
/// A step is one look into the displacement map. Of the exact march: at the smallest and largest heights of eight parts of a block
/// (16x8 texels each; then, of those that the ray may meet, of 8x4), or at all texels of one part of 8x4. Of the uniform march: at
/// eight of its samples. Blocks count where the ray meets their boxes, whatever a backend's tree asks about. What is decided in f64 is not counted, nor are base triangles that the exact march does not cut into blocks, and the uniform
/// march's bent prisms, which take another route.
///
/// ```
/// use prismarch::prism::count_steps;
/// use prismarch::ray::Ray;
/// use prismarch::trace::Tracer;
///
/// /// Steps from the ray's origin to its hit, through a world of counting prisms.
/// fn cost(tracer: &dyn Tracer, ray: &Ray) -> u64 {
///     let tfar = tracer.intersect(ray).map_or(ray.tfar, |hit| hit.t);
///     // Nothing is hit before the hit, so all that lies before it is marched.
///     let (_, steps) = count_steps(|| tracer.intersect(&Ray { tfar, ..*ray }));
///     steps
/// }
/// ```
pub fn count_steps<R>(call: impl FnOnce() -> R) -> (R, u64) {
    let before = STEPS.get();
    let returned = call();
    (returned, STEPS.get() - before)
}

impl Prisms {
    /// The same prisms with kernels that count their steps, for [`count_steps`]. They run at the baseline SIMD level, so that all machines
    /// count the same.
    pub fn counting_steps(mut self) -> Self {
        self.kernel = Kernel::counting(self.march);
        self
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Vec2, Vec3};

    use super::*;
    use crate::prism::{March, Step};
    use crate::ray::Ray;
    use crate::surface::{
        DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, Wrap,
    };

    /// A flat triangle under a map of 64x64 texels that is 0 but for one texel of height 1 in a corner, displaced by 0.2 at most.
    fn prisms(march: March) -> Prisms {
        let builder = MeshBuilder {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            texcoords: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
            triangles: vec![[0, 1, 2]],
        };
        let mesh = builder.build(NormalMode::File).unwrap().0;
        let mut heights = vec![0; 64 * 64];
        heights[64 * 60 + 2] = u16::MAX;
        let map = DisplacementMap::new(64, 64, Texels::U16(heights), Wrap::Clamp).unwrap();
        let (mesh, map) = (Arc::new(mesh), Arc::new(map));
        let surface = DisplacedSurface::new(mesh, map, Displacement::new(0.2)).unwrap();
        Prisms::new(Arc::new(surface), march).unwrap()
    }

    fn texels(step: f32) -> March {
        March::Uniform {
            step: Step::Texels(step),
            jitter: false,
        }
    }

    /// Half way up, over 48 texels.
    fn over() -> Ray {
        Ray::new(Vec3::new(-1.0, 0.25, 0.1), Vec3::X)
    }

    fn steps(prisms: &Prisms, primitive: u32, ray: &Ray) -> u64 {
        count_steps(|| prisms.intersect(primitive, ray)).1
    }

    #[test]
    fn the_uniform_march_takes_as_many_as_its_step_asks_for() {
        for (step, samples) in [(1.0, 49_u64), (0.5, 97), (0.1, 481), (100.0, 2)] {
            let prisms = prisms(texels(step)).counting_steps();
            let found = steps(&prisms, 0, &over());
            // The number of texels is rounded up.
            let expected = samples.div_ceil(8)..=(samples + 1).div_ceil(8);
            assert!(expected.contains(&found), "{step}: {found}");
        }
    }

    #[test]
    fn the_exact_march_skips_what_is_flat_and_looks_closer_where_it_hits() {
        let prisms = prisms(March::Exact).counting_steps();
        let all = || 0..prisms.len() as u32;
        let beside = Ray::new(Vec3::new(2.0, 2.0, 1.0), Vec3::NEG_Z);
        for ray in [over(), beside] {
            // Eight parts at most, all missed.
            assert!(all().all(|primitive| steps(&prisms, primitive, &ray) <= 1));
        }
        let down = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
        let grazing = Ray::new(Vec3::new(-0.5, 0.25, 0.05), Vec3::new(1.0, 0.0, -0.06));
        for ray in [down, grazing] {
            let hit = all().find(|&primitive| prisms.intersect(primitive, &ray).is_some());
            let found = steps(&prisms, hit.expect("a hit"), &ray);
            // Eight parts, those of up to two of them, and the texels of the leaf that is hit.
            assert!((3..=6).contains(&found), "{ray:?}: {found}");
        }
    }

    #[test]
    fn maps_continued_by_their_wrap_mode_take_the_same_steps() {
        // Of three columns of blocks the first is before the map's first texel.
        let prisms = prisms(March::Exact).counting_steps();
        let at = |x: f32| Ray::new(Vec3::new(x, 0.3, 1.0), Vec3::NEG_Z);
        let most = |ray: Ray| {
            let all = 0..prisms.len() as u32;
            all.map(|primitive| steps(&prisms, primitive, &ray)).max()
        };
        assert_eq!(most(at(0.004)), most(at(0.2)));
    }

    #[test]
    fn hits_are_the_same_and_other_kernels_count_nothing() {
        for march in [March::Exact, texels(1.0)] {
            let usual = prisms(march).with_simd(crate::prism::SimdLevel::Baseline);
            let (usual, counting) = (usual.unwrap(), prisms(march).counting_steps());
            for k in 0..20 {
                let ray = Ray::new(
                    Vec3::new(0.02 * k as f32, -0.5, 0.4),
                    Vec3::new(0.1, 0.6, -0.3),
                );
                for primitive in 0..usual.len() as u32 {
                    let (hit, none) = count_steps(|| usual.intersect(primitive, &ray));
                    let (same, some) = count_steps(|| counting.intersect(primitive, &ray));
                    assert_eq!((hit, none), (same, 0));
                    assert!(hit.is_none() || some > 0);
                    let (occluded, some) = count_steps(|| counting.occluded(primitive, &ray));
                    assert!(occluded == hit.is_some() && (!occluded || some > 0));
                }
            }
        }
    }
}
