//! Arcs in f32 against the same curves in f64: nothing is farther off than its bound, and nothing that is inside is cut off.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3};
use proptest::prelude::*;

use super::*;
use crate::prism::cluster::Cluster;
use crate::prism::ray_frame::{RayFrame, axes};
use crate::prism::simd::Portable;
#[cfg(target_arch = "x86_64")]
use crate::prism::simd::{Avx2, SimdLevel};
use crate::ray::Ray;
use crate::surface::{Displacement, DisplacementMap, MeshBuilder, NormalMode, Patch, Texels, Wrap};

/// One prism over a map of 100 x 80 texels.
fn surface(p: [[f32; 3]; 3], n: [[f32; 3]; 3], st: [[f32; 2]; 3]) -> Option<DisplacedSurface> {
    let mut normals = [Vec3::ZERO; 3];
    for (normal, n) in normals.iter_mut().zip(n) {
        *normal = (Vec3::from(n) * 0.7 + Vec3::Z).try_normalize()?;
    }
    let builder = MeshBuilder {
        positions: p.map(Vec3::from).to_vec(),
        normals: normals.to_vec(),
        texcoords: st.map(Vec2::from).to_vec(),
        triangles: vec![[0, 1, 2]],
    };
    let (mesh, _) = builder.build(NormalMode::File).ok()?;
    let texels = (0..8000).map(|i: usize| (i.wrapping_mul(40503) >> 4) as u16);
    let map = DisplacementMap::new(100, 80, Texels::U16(texels.collect()), Wrap::Repeat).unwrap();
    let displacement = Displacement::new(0.2);
    DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).ok()
}

/// Where a ray is in a prism at one w, exactly: barycentrics, ray parameter.
struct Place {
    b: [f64; 3],
    t: f64,
}

impl Place {
    fn new(patch: &Patch<'_>, frame: &RayFrame, w: f64) -> Self {
        let [x, y, z] = frame.axes;
        let corners = [0, 1, 2].map(|k| patch.vertices[k] + w * patch.normals[k]);
        let depth = corners.map(|p: DVec3| p[z] - frame.origin[2]);
        let seen = [0, 1, 2].map(|k: usize| {
            DVec2::new(
                corners[k][x] - frame.origin[0] - depth[k] * frame.shear[0],
                corners[k][y] - frame.origin[1] - depth[k] * frame.shear[1],
            )
        });
        let areas = [0, 1, 2].map(|k| seen[(k + 1) % 3].perp_dot(seen[(k + 2) % 3]));
        let b = areas.map(|q| q / areas.iter().sum::<f64>());
        let t = (0..3).map(|k| b[k] * depth[k]).sum::<f64>() * frame.per_depth;
        Self { b, t }
    }

    fn texel(&self, patch: &Patch<'_>) -> DVec2 {
        let [a, b, c] = patch.texels;
        self.b[1] * (b - a) + self.b[2] * (c - a)
    }
}

fn check<L: Lanes>(surface: &DisplacedSurface, ray: &Ray) -> Result<(), TestCaseError> {
    let patch = surface.patch(0);
    let offsets = patch.offsets_of(patch.displacements((0.0, 1.0)));
    let cluster = Cluster::new(surface, &[0], |_| offsets);
    let frame = RayFrame::new(ray, axes(ray));
    let anchored = frame.anchored(cluster.anchor(frame.axes[2]), ray);
    let prisms = cluster.lanes::<L>(frame.axes);
    let rays = anchored.splat();
    let (sight, met) = Sight::new(&prisms, &rays);
    let units = Units::new(surface);
    let cut = Cut::new(&sight, &prisms, &units, &rays);
    let arcs = cut.bounded(&units);
    let found = cut.found(&arcs, met, &rays);
    if found.others & 1 != 0 || !cluster.is_ordered(0) {
        return Ok(());
    }
    let is_arc = found.arcs & 1 != 0;
    let [w0, w1] = [0, 1].map(|k| f64::from(arcs.w[k][0]));
    let reach = f64::from(offsets[0].abs().max(offsets[1].abs()));
    // Inside is an arc, from one end to the other. At the ends w is rounded.
    let rounded = 2.0 * reach * f64::from(f32::EPSILON);
    for k in 0..=200 {
        let [low, high] = offsets.map(f64::from);
        let w = low + (high - low) * f64::from(k) / 200.0;
        let place = Place::new(&patch, &frame, w);
        if place.b.iter().all(|&b| b > 1e-12) && place.t > f64::from(ray.tnear) + 1e-6 {
            let held = is_arc && w >= w0.min(w1) - rounded && w <= w0.max(w1) + rounded;
            prop_assert!(held, "{w} {:?} is not on {w0} {w1} {is_arc}", place.b);
        }
    }
    if !is_arc {
        return Ok(());
    }
    let time = |s: f64| {
        let [c0, c1, c2, c3] = arcs.time.map(|row| f64::from(row[0]));
        let [a0, a1, a2] = arcs.area.map(|row| f64::from(row[0]));
        (c0 + s * (c1 + s * (c2 + s * c3))) / (a0 + s * (a1 + s * a2))
    };
    let per_world = f64::from(units.per_world);
    for k in 0..=16u8 {
        let s = f32::from(k) / 16.0;
        let zero = L::splat(0.0);
        let [x, y, h] = (arcs.places::<L>().at(L::splat(s), [zero; 3])).map(|q| q.to_array()[0]);
        let w = w0 + (w1 - w0) * f64::from(s);
        // That w is rounded is part of what heights and times may be off.
        let around = [w - rounded, w, w + rounded].map(|w| Place::new(&patch, &frame, w));
        let within = |found: f64, of: &dyn Fn(&Place) -> f64, off: f32, what: &str| {
            let exact = around.each_ref().map(of);
            let low = exact.iter().copied().fold(f64::INFINITY, f64::min);
            let high = exact.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let off = f64::from(off);
            prop_assert!(
                found >= low - off && found <= high + off,
                "{what} at {s}: {found} is not within {off} of {low} .. {high}"
            );
            Ok(())
        };
        within(
            x.into(),
            &|place| place.texel(&patch).x,
            arcs.rounding[0],
            "x",
        )?;
        within(
            y.into(),
            &|place| place.texel(&patch).y,
            arcs.rounding[0],
            "y",
        )?;
        let height = |place: &Place| {
            let [a, b, c] = patch.normals;
            w * per_world * (place.b[0] * a + place.b[1] * b + place.b[2] * c).length()
        };
        within(h.into(), &height, arcs.height_rounding[0], "h")?;
        let start = |place: &Place| place.t - anchored.time;
        within(time(s.into()), &start, arcs.time_off[0], "t")?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn nothing_is_farther_off_than_its_bound(
        p in prop::array::uniform3(prop::array::uniform3(-1.0f32..1.0)),
        n in prop::array::uniform3(prop::array::uniform3(-1.0f32..1.0)),
        st in prop::array::uniform3(prop::array::uniform2(0.0f32..1.0)),
        b in prop::array::uniform2(0.0f32..0.5), height in 0.0f32..0.2,
        d in prop::array::uniform3(-1.0f32..1.0), flat in 0.0f32..1.0, far in 0.1f32..4.0,
        place in prop::array::uniform3(-1.0f32..1.0), size in -3.0f32..3.0,
    ) {
        // Flat triangles and rays along them, near and far, of all sizes and beside the origin.
        let size = 10f32.powf(size);
        let p = p.map(|[x, y, z]| [x, y, 0.3 * z]);
        let Some(plain) = surface(p, n, st) else { return Ok(()) };
        let point = plain.mesh().corners(0);
        let target = point[0] + b[0] * (point[1] - point[0]) + b[1] * (point[2] - point[0]);
        let target = target + height * Vec3::Z;
        let Some(direction) = Vec3::new(d[0], d[1], d[2] * flat * flat).try_normalize() else {
            return Ok(());
        };
        let origin = target - 10f32.powf(far) * 0.1 * direction;
        let moved = |p: Vec3| size * (p + 100.0 * f32::from(far < 1.0) * Vec3::from(place));
        let corners = point.map(|p| moved(p).to_array());
        let Some(surface) = surface(corners, n, st) else { return Ok(()) };
        let ray = Ray::new(moved(origin), direction);
        check::<Portable>(&surface, &ray)?;
        #[cfg(target_arch = "x86_64")]
        if SimdLevel::Avx2.is_supported() {
            check::<Avx2>(&surface, &ray)?;
        }
    }
}
