//! The march of one ray through one prism, told: the same functions, with what they find kept.

use super::{Arcs, Problem, Signs, Walker, pieces};
use crate::prism::curve::{Curve, Cut, View};
use crate::prism::ray_frame::RayFrame;
use crate::prism::simd::{Lanes, Quad};
use crate::prism::{CurvePoint, Explanation};

/// Points on the curve that are given.
const POINTS: usize = 512;

/// `None` where the ray is not inside the prism once and not nearly edge-on: then the march takes more than one curve.
pub fn explain<L: Lanes>(problem: &Problem<'_>, frame: &RayFrame) -> Option<Explanation> {
    let range = problem.cluster.offsets(problem.lane).map(f64::from);
    let reach = range[0].abs().max(range[1].abs());
    let corners = problem.cluster.corners::<L::Quad>(problem.lane, frame.axes);
    let view = View::new(&corners, frame, reach);
    let Cut::One(stretch) = view.cut(range) else {
        return None;
    };
    let patch = problem.patch();
    let curve = Curve::new(&view, &patch.texels, &stretch, frame);
    if !pieces::is_even(&curve) {
        return None;
    }
    let mut signs = Signs::new(problem, frame);
    signs.set_curve(curve);
    let start = curve.ends()[0];
    let arcs = Arcs::of_curve::<L>(problem, &curve, &view, start);
    let walker = Walker::new(problem, &arcs, 0, curve.texel_base, start);
    let children = walker.record::<L>(&mut signs);
    let point = |k: usize| {
        let s = k as f64 / POINTS as f64;
        let ([x, y, ..], [t, u, v]) = (curve.at(s).0.to_array(), curve.seen(s));
        let height = curve.w(s) * patch.normal(u, v).length() / patch.scale + patch.midlevel;
        CurvePoint {
            t,
            texel: glam::DVec2::from(curve.texel_base) + glam::DVec2::new(x, y),
            height,
        }
    };
    Some(Explanation {
        curve: (0..=POINTS).map(point).collect(),
        children,
        hit: signs.nearest().map(|found| found.t),
    })
}
