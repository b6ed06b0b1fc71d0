use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::*;
use crate::prism::judge::{Cells, Question, within};
use crate::prism::ray_frame::{RayFrame, axes};
use crate::prism::simd::Portable;
use crate::ray::Ray;
use crate::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, Wrap,
};

/// Numbers in [0, 1).
pub(super) struct Random(pub u32);

impl Random {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let x = self.0 ^ (self.0 >> 16);
        (x.wrapping_mul(0x9e37_79b9) >> 8) as f32 / (1 << 24) as f32
    }

    pub fn signed(&mut self) -> f32 {
        2.0 * self.next() - 1.0
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// A triangle of some size in texels, with leaning normals, over a rough map of this height.
fn surface(
    random: &mut Random,
    texels: f32,
    lean: f32,
    wrap: Wrap,
    scale: f32,
) -> DisplacedSurface {
    let corner = |random: &mut Random| (Vec3::Z + lean * random.vector()).normalize();
    let (width, height) = (
        40 + (random.next() * 60.0) as usize,
        40 + (random.next() * 60.0) as usize,
    );
    let st = Vec2::new(random.next(), random.next()) * 2.0 - 0.5;
    let across = Vec2::new(texels / width as f32, texels / height as f32);
    let builder = MeshBuilder {
        positions: vec![
            Vec3::ZERO,
            Vec3::new(1.0, 0.1, 0.0),
            Vec3::new(0.2, 0.9, 0.1),
        ],
        normals: vec![corner(random), corner(random), corner(random)],
        texcoords: vec![
            st,
            st + across * Vec2::new(1.0, 0.3 * random.signed()),
            st + across * Vec2::new(0.3 * random.signed(), 1.0),
        ],
        triangles: vec![[0, 1, 2]],
    };
    let mesh = builder.build(NormalMode::File).unwrap().0;
    let heights = (0..width * height).map(|_| (random.next() * 65535.0) as u16);
    let map = DisplacementMap::new(width, height, Texels::U16(heights.collect()), wrap).unwrap();
    let displacement = Displacement {
        midlevel: 0.4,
        ..Displacement::new(scale)
    };
    DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap()
}

#[test]
fn blocks_have_what_the_judge_has() {
    let mut random = Random(1);
    let (mut hits, mut faults) = (0, 0);
    for k in 0..300 {
        let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][k % 3];
        let texels = [6.0, 30.0, 90.0][k / 3 % 3];
        let lean = [0.0, 0.1, 0.5][k / 9 % 3];
        // Now and then so high that more cells are folded than the judge is asked about one by one.
        let scale = if k % 10 == 9 {
            5.0
        } else {
            0.1 * random.next()
        };
        let surface = surface(&mut random, texels, lean, wrap, scale);
        let patch = surface.patch(0);
        let offsets = patch.offsets_of(surface.displacements(0));
        let mut blocks = Vec::new();
        let Ok(record) = Cutter::new(surface.map()).cut(0, &patch, offsets, |b| blocks.push(b))
        else {
            continue;
        };
        for _ in 0..50 {
            let (u, v) = (random.next(), random.next());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            let to = patch.point(u.into(), v.into()).position.as_vec3();
            let direction = (random.vector() + Vec3::new(0.0, 0.0, -0.3)).normalize();
            let ray = Ray::new(to - 2.0 * direction, direction);
            let frame = RayFrame::new(&ray, axes(&ray));
            let question = Question {
                patch: &patch,
                range: offsets.map(f64::from),
                frame: &frame,
                interval: [0.0, f32::INFINITY],
                any: false,
            };
            let truth = within::<Portable>(&question, &Cells::ALL);
            hits += usize::from(truth.is_some());
            let mut best = f64::INFINITY;
            for &block in &blocks {
                let ask = Ask {
                    surface: &surface,
                    heights: Heights::new(&surface),
                    record: &record,
                    block,
                    corners: None,
                    any: false,
                };
                if let Some(found) = nearest::<Portable>(&ask, &ray) {
                    best = best.min(found.at.t);
                }
            }
            let t = truth.map_or(f64::INFINITY, |found| found.t);
            if (t - best).abs() > 1e-6 || t.is_finite() != best.is_finite() {
                faults += 1;
                if faults < 12 {
                    let texel = truth.map(|f| patch.texel(f.u, f.v));
                    println!(
                        "{k} {wrap:?} {texels} {lean}: {t} {best} at {texel:?} of {:?} {:?} {:?}",
                        surface.map().size(),
                        patch.texels,
                        blocks
                    );
                }
            }
            if let Some(found) = truth {
                let point = ray.origin.as_dvec3() + found.t * ray.direction.as_dvec3();
                let texel = patch.texel(found.u, found.v);
                for &block in &blocks {
                    let texels = block.texels(surface.map(), &record);
                    if texels.low.cmple(texel).all() && texels.high.cmpge(texel).all() {
                        let bounds = outline::<Portable>(&surface, &record, block, None);
                        let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
                        let off = (low - point).max(point - high).max(DVec3::ZERO);
                        assert!(off.max_element() < 1e-6, "{k} {block:?}: {off}");
                    }
                }
            }
        }
    }
    assert!(hits > 3000 && faults == 0, "{faults} of {hits}");
}
