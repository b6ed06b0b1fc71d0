//! Verdicts on cells against all of the roots that Newton's method finds in them.

use glam::{DVec2, DVec3};

use super::bilinear;
use super::triangles::{Eye, Sight, Truth, leaves, leaves_of_large};
use crate::prism::block::cell::{Verdict, judged};
use crate::prism::block::leaf::Rows;
use crate::prism::simd::Portable;
use crate::ray::Ray;

/// A cell of S in f64, its heights beyond it too.
struct Piece<'a> {
    truth: &'a Truth<'a>,
    eye: &'a Eye,
    cell: DVec2,
    heights: [f64; 4],
    slopes: [[DVec3; 2]; 2],
}

impl Piece<'_> {
    /// S, dS/ds and dS/dt, sideways.
    fn seen(&self, at: DVec2) -> [DVec2; 3] {
        let [height, height_s, height_t] = bilinear(self.heights, at);
        let normal = self.truth.normal(self.cell + at);
        let (n, k) = (normal.normalize(), 1.0 / normal.length());
        let [[ps, pt], [ns, nt]] = self.slopes;
        let bent = |v: DVec3| k * (v - n * n.dot(v));
        let point = self.truth.raised(self.cell + at, height);
        [
            self.eye.sees(point).truncate(),
            self.eye
                .turn
                .rotate(self.eye.lateral(ps + height_s * n + height * bent(ns))),
            self.eye
                .turn
                .rotate(self.eye.lateral(pt + height_t * n + height * bent(nt))),
        ]
    }

    /// Where it is on the ray: by Newton's method from many places.
    fn roots(&self) -> Vec<DVec2> {
        let mut found: Vec<DVec2> = Vec::new();
        for k in 0..25 {
            let mut at = DVec2::new(f64::from(k % 5) / 4.0, f64::from(k / 5) / 4.0);
            let mut step = DVec2::ONE;
            for _ in 0..12 {
                let [miss, s, t] = self.seen(at);
                let inverse = -1.0 / s.perp_dot(t);
                step = DVec2::new(miss.perp_dot(t), s.perp_dot(miss)) * inverse;
                at += step.clamp_length_max(1.0);
                if step.length() < 1e-12 || at.is_nan() || at.abs().max_element() > 4.0 {
                    break;
                }
            }
            let is_inside = at.min_element() >= 0.0 && at.max_element() <= 1.0;
            let is_new = found.iter().all(|other| other.distance(at) > 1e-5);
            if step.length() < 1e-6 && is_inside && is_new {
                found.push(at);
            }
        }
        found
    }
}

/// What has been seen of verdicts.
#[derive(Debug, Default)]
struct Verdicts {
    unlooked: usize,
    missed: usize,
    hit: usize,
    inside: usize,
    folded: usize,
    once: usize,
    unknown: usize,
    /// Of cells missed or not looked at: with a root outside the triangle or the interval.
    beside: usize,
}

impl Verdicts {
    /// Holds a cell's verdict to S; `None` where it was not looked at.
    fn hold(
        &mut self,
        piece: &Piece<'_>,
        ray: &Ray,
        verdict: Option<Verdict>,
        what: &dyn Fn() -> String,
    ) {
        let roots = piece.roots();
        // Of those surely in the cell: in the triangle, and in the interval.
        let truth = piece.truth;
        let near = |at: DVec2| {
            let [u, v] = truth.uv(piece.cell + at);
            let height = bilinear(piece.heights, at)[0];
            let t = piece.eye.sees(truth.raised(piece.cell + at, height)).z as f32;
            (u.min(v).min(1.0 - u - v), t)
        };
        let verdict = match verdict {
            Some(Verdict::Folded(seen)) => {
                self.folded += 1;
                Some(seen.in_quarters())
            }
            verdict => verdict,
        };
        match verdict {
            None | Some(Verdict::Missed) => {
                for &at in &roots {
                    const HAIR: f64 = 1e-7;
                    let (least, t) = near(at);
                    let surely = at.min_element() > HAIR && at.max_element() < 1.0 - HAIR;
                    let there = least > HAIR && t > ray.tnear && t < ray.tfar;
                    assert!(!(surely && there), "{verdict:?} but {at} {t}: {}", what());
                    self.beside += usize::from(surely);
                }
                self.missed += usize::from(verdict.is_some());
                self.unlooked += usize::from(verdict.is_none());
            }
            Some(Verdict::Hit { at, is_inside }) => {
                assert_eq!(roots.len(), 1, "{at:?} {roots:?}: {}", what());
                let (least, t) = near(roots[0]);
                let is_there = least > 0.0 && t > ray.tnear && t < ray.tfar;
                assert!(!is_inside || is_there, "{least} {t}: {}", what());
                self.hit += 1;
                self.inside += usize::from(is_inside);
            }
            Some(Verdict::Once(once)) => {
                assert!(roots.len() <= 1, "{once:?} {roots:?}: {}", what());
                assert!(
                    roots.iter().all(|&at| once.holds(at)),
                    "{once:?} {roots:?}: {}",
                    what()
                );
                self.once += 1;
            }
            Some(Verdict::Unknown | Verdict::Folded(_)) => self.unknown += 1,
        }
    }
}

/// The verdicts of a leaf's cells.
fn look(verdicts: &mut Verdicts, sight: &Sight<'_>) {
    let [i, j] = sight.at;
    match sight.place.stored(i, j) {
        Some(rows) => look_at(verdicts, sight, &rows),
        None => look_at(verdicts, sight, &sight.place.continued(i, j)),
    }
}

fn look_at(verdicts: &mut Verdicts, sight: &Sight<'_>, rows: &impl Rows) {
    let Sight {
        case,
        truth,
        view,
        leaf,
        heights,
        ..
    } = sight;
    let there = sight.place.mask(sight.at[0], sight.at[1]);
    let cells = || (0..32).filter(|bit| there >> bit & 1 != 0);
    let corners = |bit: u32| rows.corners((bit & 7, bit >> 3));
    let of_all = || cells().flat_map(corners);
    let rise = of_all().fold(f32::NEG_INFINITY, f32::max) - of_all().fold(f32::INFINITY, f32::min);
    let looked = leaf.cells::<Portable>(view, heights, rise * heights.scale.abs(), rows);
    let unit = f64::from(case.surface.map().unit());
    let slopes = truth.slopes();
    for bit in cells() {
        let (i, j) = (bit & 7, bit >> 3);
        let stored @ [h00, h10, h01, h11] = corners(bit);
        let raised = |h: f32| truth.patch.scale * (f64::from(h) / unit - truth.patch.midlevel);
        let piece = Piece {
            truth,
            eye: &sight.eye,
            cell: sight.texel(DVec2::new(i.into(), j.into())),
            heights: stored.map(raised),
            slopes,
        };
        let verdict = (looked >> bit & 1 != 0)
            .then(|| judged(view, heights, leaf, (i, j), [h00, h10, h11, h01]));
        let what = || format!("{:?} {:?} {:?}", case.kind, piece.cell, sight.ray);
        verdicts.hold(&piece, &sight.ray, verdict, &what);
    }
}

/// No cell that is left out has a root, and every cell that is hit has one.
#[test]
fn verdicts_on_cells_are_true() {
    let mut verdicts = Verdicts::default();
    leaves(6, 1000, 10, |_, sight| look(&mut verdicts, sight));
    leaves_of_large(7, 50, 20, |_, sight| look(&mut verdicts, sight));
    println!("{verdicts:?}");
    assert!(verdicts.hit > 1000, "{verdicts:?}");
}
