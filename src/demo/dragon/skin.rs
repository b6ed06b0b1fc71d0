//! Heights and colours of the dragon: scales, belly plates, collars, horn.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::atlas::{Band, Trim, locate, trim_at};
use crate::demo::cavity::Cavity;
use crate::demo::noise::{Octaves, fbm3, gradient3, hash, mix, next, smoothstep, unit};

/// World units of the highest scales and collars.
const RELIEF: f32 = 0.058;

/// World units above the base surface.
pub(super) fn height(st: Vec2) -> f32 {
    let (band, t) = locate(st);
    match band {
        Band::Body(variant) => RELIEF * segment(st.x, t, variant).0,
        Band::Tail(variant) => {
            let depth = [0.55, 0.3][variant as usize];
            RELIEF * mix(NODE, segment(st.x, t, 3 + variant).0, depth)
        }
        Band::Skull => RELIEF * skull(st.x, t),
        Band::Jaw => RELIEF * jaw(st.x, t),
        Band::Trim => RELIEF * trim(trim_at(st.x), t),
    }
}

/// The circle of circumference 1 that u runs around, and a third coordinate: where noise is taken.
fn ring_point(u: f32, along: f32) -> Vec3 {
    (Vec2::from_angle(TAU * u) / TAU).extend(along)
}

/// Distance in u from the belly, in [0, 0.5].
fn from_belly(u: f32) -> f32 {
    (u - u.round()).abs()
}

/// Half-round profile: 1 at 0, 0 beyond `half_width`.
fn round(d: f32, half_width: f32) -> f32 {
    let x = d / half_width;
    (1.0 - x * x).max(0.0).sqrt()
}

/// What the scales are like at a point.
struct Scale {
    height: f32,
    /// 0 in the middle, 1 at the outline.
    edge: f32,
    id: u32,
}

/// Imbricate scales on a lattice of unit cells, rows shifted by half a cell, free edges towards -y. `around` is
/// the number of columns after which x repeats.
fn scales(x: f32, y: f32, around: i32, seed: u32) -> Scale {
    let mut top = Scale {
        height: 0.0,
        edge: 1.0,
        id: 0,
    };
    let row = y.floor() as i32;
    for j in row - 1..=row + 1 {
        let shift = 0.5 * (j & 1) as f32;
        let column = (x - shift).round();
        for i in [column - 1.0, column, column + 1.0] {
            let id = hash(seed, (i as i32).rem_euclid(around), j, 7);
            let (dx, dy) = (x - shift - i, y - j as f32);
            let free = 0.5 - 0.5 * dy;
            // Broad at the root, drawn to a blunt point at the free edge.
            let half_width = 0.60 - 0.10 * free * free;
            let edge = (dx / half_width).hypot(dy / 0.96);
            if edge >= 1.0 {
                continue;
            }
            let rim = smoothstep(1.0, 0.84, edge);
            let lift = 0.30 + 0.44 * free + 0.08 * (unit(id) - 0.5);
            let dome = 0.16 * (1.0 - edge * edge);
            let keel = 0.10 * round(dx, 0.13) * smoothstep(0.95, 0.5, edge);
            let growth = 0.022 * (26.0 * edge).cos() * smoothstep(0.2, 0.5, edge);
            let height = rim * (lift + dome + keel + growth);
            if height > top.height {
                top = Scale { height, edge, id };
            }
        }
    }
    top
}

const SCALES_AROUND: i32 = 24;
const SCALE_ROWS: f32 = 7.0;
/// Half width of the belly, in u.
const BELLY: f32 = 0.13;
/// Height of the groove where two segments meet, whatever the depth of their patterns.
const NODE: f32 = 0.12;
/// Length of the collars at both ends of a segment, in t.
const COLLAR: f32 = 0.12;

/// Height of one segment in [0, 1], and the scale under the point. At t = 0 and 1 it is the collar's groove.
fn segment(u: f32, t: f32, seed: u32) -> (f32, Scale) {
    let scale = scales(
        u * SCALES_AROUND as f32,
        t * SCALE_ROWS,
        SCALES_AROUND,
        seed,
    );
    let off = from_belly(u);
    let plates = belly_plate(off, t);
    let x = smoothstep(BELLY + 0.012, BELLY - 0.012, off);
    let seam = 0.75 * round(off - BELLY, 0.018);
    let q = ring_point(u, 0.3 * t);
    let rough =
        0.035 * fbm3(seed + 71, 150.0 * q, Octaves::new(3)) + 0.06 * gradient3(seed + 72, 13.0 * q);
    let skin = mix(scale.height, plates, x).max(seam) + rough;
    (
        collar(u, t).max(skin * smoothstep(0.05, 0.11, t.min(1.0 - t))),
        scale,
    )
}

/// Broad plates across the belly, overlapping towards the tail.
fn belly_plate(off: f32, t: f32) -> f32 {
    const PLATES: f32 = 4.0;
    let sag = 0.25 * (off / BELLY).powi(2);
    let y = (t * PLATES + sag).rem_euclid(1.0);
    let free = smoothstep(0.0, 0.10, y) * (1.0 - y);
    0.25 + 0.42 * free + 0.05 * (9.0 * TAU * off).cos() * free
}

/// The ring between two segments, like a node of bamboo: two cords and a row of studs.
fn collar(u: f32, t: f32) -> f32 {
    let d = t.min(1.0 - t);
    if d > COLLAR {
        return 0.0;
    }
    let outer = NODE + (1.0 - NODE) * round(d - 0.035, 0.022);
    let inner = 0.2 + 0.55 * round(d - 0.098, 0.014);
    let x = (u * 40.0).rem_euclid(1.0) - 0.5;
    let stud = 0.55 * round(x.hypot((d - 0.072) * 22.0), 0.36);
    let bed = 0.42 * smoothstep(COLLAR, COLLAR - 0.01, d);
    let inside = (bed + stud).max(inner * smoothstep(COLLAR, 0.11, d));
    (outer * smoothstep(0.062, 0.056, d)).max(inside * smoothstep(0.050, 0.060, d))
}

/// The upper head: scales that shrink to wrinkles on the snout, brows, nostrils, a lip.
fn skull(u: f32, t: f32) -> f32 {
    let q = ring_point(u, 0.8 * t);
    let crown = scales(u * 26.0, t * 15.0, 26, 91).height;
    let snout = smoothstep(0.42, 0.62, t);
    let folds = 0.5 + 0.42 * (TAU * (9.0 * t + 0.6 * gradient3(92, 9.0 * q))).sin();
    let pebbles = 0.5 + 0.5 * gradient3(93, 75.0 * q);
    let wrinkled = 0.35 * folds + 0.35 * pebbles;
    let mut h = mix(crown, wrinkled, snout);
    let off = from_belly(u);
    let lip = round(off - 0.21, 0.022) * smoothstep(0.25, 0.4, t);
    h = h.max(0.75 * lip);
    // Inside the mouth: a ribbed palate.
    let palate = 0.25 + 0.08 * (TAU * 24.0 * t).sin();
    h = mix(palate, h, smoothstep(0.17, 0.20, off));
    let nostril = ((off - 0.395) / 0.05).hypot((t - 0.93) / 0.022);
    h = h * smoothstep(0.75, 1.25, nostril) + 0.35 * round(nostril - 1.5, 0.45);
    let fine = 0.05 * fbm3(94, 130.0 * q, Octaves::new(3));
    mix(0.3, h + fine, ends(t))
}

/// The lower jaw: scales below, a smooth floor of the mouth, a lip.
fn jaw(u: f32, t: f32) -> f32 {
    let q = ring_point(u, 0.5 * t);
    let below = scales(u * 18.0, t * 11.0, 18, 95).height;
    let off = from_belly(u);
    let floor = 0.3 + 0.1 * fbm3(96, 25.0 * q, Octaves::new(3));
    let lip = 0.75 * round(off - 0.30, 0.03);
    let skin = mix(below, floor, smoothstep(0.28, 0.33, off)).max(lip);
    mix(
        0.3,
        skin + 0.05 * fbm3(97, 110.0 * q, Octaves::new(3)),
        ends(t),
    )
}

/// 0 at both ends of a closed tube, where heights may depend on t alone.
fn ends(t: f32) -> f32 {
    smoothstep(0.04, 0.07, t) * smoothstep(0.985, 0.965, t)
}

/// Trims are turned on a lathe: heights depend on t alone.
fn trim(trim: Trim, t: f32) -> f32 {
    match trim {
        Trim::Horn => 0.12 + 0.07 * (TAU * 13.0 * t).sin() * smoothstep(0.95, 0.6, t),
        Trim::Spine => 0.08 + 0.05 * (TAU * 7.0 * t).cos() * smoothstep(0.9, 0.5, t),
        Trim::Whisker => 0.05 + 0.03 * (TAU * 24.0 * t).sin(),
        Trim::Eye => 0.1 + 0.22 * round(t - 1.0, 0.42),
        Trim::Tongue => 0.08 + 0.03 * (TAU * 9.0 * t).sin(),
        Trim::Pearl | Trim::Tooth => 0.05,
        Trim::Claw => 0.06 + 0.03 * (TAU * 5.0 * t).sin() * smoothstep(0.7, 0.3, t),
    }
}

const GOLD: Vec3 = Vec3::new(0.62, 0.36, 0.07);
const JADE: Vec3 = Vec3::new(0.035, 0.21, 0.12);
const DEEP: Vec3 = Vec3::new(0.008, 0.05, 0.045);
const CREAM: Vec3 = Vec3::new(0.66, 0.50, 0.26);
const CRIMSON: Vec3 = Vec3::new(0.45, 0.035, 0.02);

/// Linear colour.
pub(super) fn color(st: Vec2, cavity: &Cavity) -> Vec3 {
    let (band, t) = locate(st);
    let relief = cavity.relief(st);
    match band {
        Band::Body(variant) => segment_color(st.x, t, variant, relief),
        Band::Tail(variant) => segment_color(st.x, t, 3 + variant, 1.6 * relief),
        Band::Skull => {
            let off = from_belly(st.x);
            let crown = scales(st.x * 26.0, t * 15.0, 26, 91);
            let back = scale_color(&crown, 0.5, relief);
            let snout = JADE.lerp(GOLD, 0.35 * smoothstep(0.5, 0.9, t));
            let skin = back.lerp(shaded(snout, relief), smoothstep(0.42, 0.62, t));
            let lip = round(off - 0.21, 0.03) * smoothstep(0.25, 0.4, t);
            let skin = skin.lerp(shaded(GOLD, relief), 0.8 * lip);
            shaded(CRIMSON * 0.6, relief).lerp(skin, smoothstep(0.165, 0.19, off))
        }
        Band::Jaw => {
            let off = from_belly(st.x);
            let below = scale_color(&scales(st.x * 18.0, t * 11.0, 18, 95), 0.25, relief);
            let skin = below.lerp(shaded(GOLD, relief), round(off - 0.30, 0.035));
            skin.lerp(CRIMSON * 0.6, smoothstep(0.31, 0.335, off))
        }
        Band::Trim => trim_color(trim_at(st.x), t),
    }
}

/// Darkened in hollows.
fn shaded(color: Vec3, relief: f32) -> Vec3 {
    color * mix(0.35, 1.1, smoothstep(-0.2, 0.08, relief))
}

/// Jade on the back, paling towards the belly (`off` = 0), gilded at each scale's free edge.
fn scale_color(scale: &Scale, off: f32, relief: f32) -> Vec3 {
    let tint = unit(next(scale.id));
    let side = smoothstep(0.42, 0.14, off);
    let base = DEEP
        .lerp(JADE, 0.55 + 0.45 * tint)
        .lerp(Vec3::new(0.12, 0.30, 0.10), 0.6 * side);
    let rim = smoothstep(0.62, 0.9, scale.edge);
    let gilded = base.lerp(GOLD, 0.65 * rim * smoothstep(-0.02, 0.06, relief));
    gilded * mix(0.3, 1.1, smoothstep(-0.2, 0.06, relief))
}

fn segment_color(u: f32, t: f32, seed: u32, relief: f32) -> Vec3 {
    let off = from_belly(u);
    let (_, scale) = segment(u, t, seed);
    let back = scale_color(&scale, off, relief);
    let belly = shaded(CREAM, relief);
    let skin = back.lerp(belly, smoothstep(BELLY + 0.012, BELLY - 0.006, off));
    let seam = round(off - BELLY, 0.02);
    let skin = skin.lerp(shaded(GOLD, relief), seam);
    let d = t.min(1.0 - t);
    skin.lerp(shaded(GOLD, relief), smoothstep(COLLAR, COLLAR - 0.006, d))
}

fn trim_color(trim: Trim, t: f32) -> Vec3 {
    match trim {
        Trim::Horn => {
            let rings = 0.5 + 0.5 * (TAU * 13.0 * t).sin();
            let root = Vec3::new(0.28, 0.17, 0.08);
            root.lerp(Vec3::new(0.72, 0.62, 0.45), smoothstep(0.0, 0.7, t)) * mix(0.6, 1.0, rings)
        }
        Trim::Spine => CRIMSON.lerp(Vec3::new(0.80, 0.33, 0.05), smoothstep(0.3, 1.0, t)),
        Trim::Tooth => Vec3::new(0.78, 0.72, 0.58),
        Trim::Whisker => GOLD,
        Trim::Eye => {
            let iris = Vec3::new(0.85, 0.42, 0.03);
            let ball = Vec3::new(0.75, 0.68, 0.5).lerp(iris, smoothstep(0.58, 0.62, t));
            ball.lerp(Vec3::splat(0.005), smoothstep(0.80, 0.83, t))
        }
        Trim::Tongue => Vec3::new(0.55, 0.06, 0.05),
        Trim::Pearl => Vec3::new(0.80, 0.72, 0.66),
        Trim::Claw => Vec3::new(0.09, 0.06, 0.04),
    }
}
