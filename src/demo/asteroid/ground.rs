//! The asteroid's surface as a function of direction: radius and colour.

use glam::Vec3;

use crate::demo::noise::{Octaves, fbm3, gradient3, mix, next, ridged3, smoothstep, unit};
use crate::demo::scatter::{Disc, Scatter, power_law};

/// Where a crater's blanket of ejecta ends, in crater radii, and the same with room for bent circles.
const EJECTA_END: f32 = 1.75;
const EJECTA_REACH: f32 = 2.0;

/// The body: craters, boulders and what lies between.
pub struct Ground {
    craters: Scatter,
    boulders: Scatter,
}

/// Features of one direction that both height and colour depend on.
struct Features {
    /// Craters and their blankets so far, world units.
    craters: f32,
    /// The part of it from coarser classes of sizes.
    larger: f32,
    /// The present class of sizes, see `size_class`.
    class: usize,
    /// 0 bare rock, 1 deep dust.
    dust: f32,
    /// Brightness of fresh ejecta, 0..1.
    fresh: f32,
    /// 0 outside, 1 in the depth of a crater.
    hollow: f32,
    /// The tallest boulder here, world units, and its random bits.
    boulder: (f32, u32),
}

impl Ground {
    /// Always the same body.
    pub fn new() -> Self {
        Self {
            craters: Scatter::new(craters(), 24, EJECTA_REACH),
            boulders: Scatter::new(boulders(), 48, 1.3),
        }
    }

    /// The body before any crater: a lumpy ellipsoid.
    pub fn smooth_radius(&self, d: Vec3) -> f32 {
        let axes = Vec3::new(1.32, 0.98, 1.08);
        let lumps = 0.13 * gradient3(5, 1.3 * d + 0.7) + 0.05 * gradient3(6, 2.9 * d);
        (1.0 + lumps) / (d / axes).length()
    }

    /// The distance of the surface from the centre in unit direction `d`.
    pub fn radius(&self, d: Vec3) -> f32 {
        let f = self.features(d);
        let hills = 0.014 * gradient3(11, 3.1 * d);
        let crags = 0.018 * (ridged3(12, 5.0 * d, Octaves::new(3)) - 0.5);
        let gravel = Octaves {
            count: 4,
            gain: 0.6,
        };
        let grain = 0.006 * fbm3(13, 40.0 * d, gravel);
        let rough = mix(1.0, 0.3, f.dust);
        self.smooth_radius(d) + hills + rough * (crags + grain) + f.craters + f.boulder.0
    }

    /// Linear albedo in unit direction `d`.
    pub fn color(&self, d: Vec3) -> Vec3 {
        let f = self.features(d);
        let mottle = fbm3(21, 4.0 * d, Octaves::new(5));
        let speckle = fbm3(22, 90.0 * d, Octaves::new(2));
        let warm = Vec3::new(0.30, 0.25, 0.205);
        let cool = Vec3::new(0.21, 0.21, 0.215);
        let mut c = warm.lerp(cool, smoothstep(-0.35, 0.35, mottle));
        c *= 1.0 + 0.35 * speckle + 0.25 * mottle;
        c = c.lerp(Vec3::new(0.20, 0.17, 0.145), 0.55 * f.hollow);
        c = c.lerp(Vec3::new(0.50, 0.46, 0.41), 0.55 * f.fresh);
        let crest = ridged3(12, 5.0 * d, Octaves::new(3));
        c *= mix(0.8, 1.2, smoothstep(0.3, 0.8, crest));
        if f.boulder.0 > 0.0 {
            let tint = mix(0.75, 1.35, unit(next(f.boulder.1)));
            c = c.lerp(tint * Vec3::new(0.30, 0.265, 0.23), 0.7);
        }
        c
    }

    fn features(&self, d: Vec3) -> Features {
        let mut f = Features {
            craters: 0.0,
            larger: 0.0,
            class: 0,
            dust: smoothstep(-0.1, 0.5, gradient3(31, 2.2 * d)),
            fresh: 0.0,
            hollow: 0.0,
            boulder: (0.0, 0),
        };
        // No circle is perfect.
        let bend = 0.2 * fbm3(32, 6.0 * d, Octaves::new(2));
        for (disc, q) in self.craters.around(d) {
            add_crater(&mut f, disc, q * (1.0 + bend), d);
        }
        for (disc, _) in self.boulders.around(d) {
            let height = boulder_height(disc, d);
            if height > f.boulder.0 {
                f.boulder = (height, disc.id);
            }
        }
        f
    }
}

/// Lays one crater over the older and larger ones: what was there before is worn away inside it.
fn add_crater(f: &mut Features, disc: &Disc, q: f32, d: Vec3) {
    let fade = smoothstep(EJECTA_END, 1.1, q);
    if fade == 0.0 {
        return;
    }
    // A small crater wears away its like, not the slope of the great one that it lies in.
    let class = size_class(disc.radius);
    if class > f.class {
        f.class = class;
        f.larger = f.craters;
    }
    let age = unit(next(disc.id));
    // Small craters are deep for their size; old ones have been filled and their rims worn down.
    let size = smoothstep(0.02, 0.5, disc.radius);
    let depth = disc.radius * mix(0.52, 0.40, size) * mix(1.0, 0.55, age);
    let rim = 0.26 * depth * mix(1.2, 0.5, age);
    if q < 1.0 {
        add_bowl(f, disc, q, age, [depth, rim]);
    } else {
        let streaks = rays(disc, d, q);
        let blanket = 1.0 / (q * q * q.sqrt());
        f.craters += rim * fade * (blanket + 0.35 * streaks * smoothstep(1.0, 1.25, q));
        let young = smoothstep(0.35, 0.1, age);
        f.fresh = f.fresh.max(young * fade * mix(0.35, 1.0, streaks));
    }
    let on_rim = smoothstep(0.25, 0.0, (q - 0.95).abs());
    f.dust = mix(f.dust, 0.15, on_rim * (1.0 - age));
}

/// Within the rim.
fn add_bowl(f: &mut Features, disc: &Disc, q: f32, age: f32, [depth, rim]: [f32; 2]) {
    let inside = smoothstep(1.0, 0.75, q);
    // A flat floor of fallen rock in large ones.
    let floor = mix(-1.2, -0.86, smoothstep(0.08, 0.3, disc.radius));
    let wall = mix(-1.0, rim / depth, q * q * mix(0.75, 1.0, q));
    f.craters = mix(f.craters, mix(f.larger, f.craters, 0.25), inside);
    f.craters += depth * (wall.max(floor) + 0.02 * (wall - floor).min(0.0));
    let bottom = inside * smoothstep(0.9, 0.4, q);
    f.dust = mix(f.dust, mix(0.95, 0.35, age), bottom);
    f.hollow = f.hollow.max(smoothstep(0.8, 0.2, q) * mix(1.0, 0.5, age));
}

/// 0 for the largest craters, 1 more whenever the radius falls by a factor of 2.5. Absolute, so that a crater that only
/// just reaches a point changes nothing there.
fn size_class(radius: f32) -> usize {
    [0.4, 0.16, 0.064, 0.0256].partition_point(|&least| least > radius)
}

/// Radial streaks of thrown-out matter around a crater, 0..1.
fn rays(disc: &Disc, d: Vec3, q: f32) -> f32 {
    let out = (d - disc.centre).normalize_or_zero();
    let spokes = gradient3(disc.id, 4.5 * out + 0.3 * q * Vec3::ONE);
    smoothstep(0.0, 0.5, spokes)
}

/// Craters of all sizes; the law's few largest would be the body's shape.
fn craters() -> Vec<Disc> {
    let mut discs = power_law(77, 1600, 0.95, 1.9);
    discs.retain(|c| c.radius < 0.46);
    discs
}

/// Boulders everywhere, most of them small.
fn boulders() -> Vec<Disc> {
    let mut discs = power_law(91, 3600, 0.26, 1.9);
    // The few giants of the law would be hills.
    discs.retain(|b| b.radius < 0.042);
    discs
}

/// The top of an angular rock: a few planes cut from a dome.
fn boulder_height(disc: &Disc, d: Vec3) -> f32 {
    let out = (d - disc.centre) / disc.radius;
    let mut bits = disc.id;
    let mut nearest = 0.0f32;
    let mut top = 1.0f32;
    for _ in 0..5 {
        bits = next(bits);
        let h = next(bits);
        let facet = Vec3::new(unit(bits), unit(h), unit(next(h))) - 0.5;
        let side = facet.reject_from(disc.centre).normalize_or_zero().dot(out);
        nearest = nearest.max(side / mix(0.55, 0.95, unit(h)));
        top = top.min(1.15 - mix(0.2, 0.7, unit(next(bits))) * side);
    }
    let round = out.length();
    let q = nearest.max(round * 0.95);
    if q >= 1.0 {
        return 0.0;
    }
    let dome = (1.0 - q * q * q).sqrt();
    let chips = 0.12 * gradient3(disc.id, 5.0 * out);
    disc.radius * 0.95 * dome.min(top * 0.85) * (1.0 + chips)
}
