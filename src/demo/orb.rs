//! The orb: a sphere carved all over with plaited bands, rosettes, leaves, lobes and studs.
//!
//! Base mesh: 64 x 32 quads of longitude and latitude. The map is the plate carree: u the longitude, v the
//! latitude. Ornaments are laid out in degrees; every one repeats a whole number of times around, and within
//! the last row of quads at the poles the height depends on the latitude alone.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Vec2, Vec3};

use super::cavity::Cavity;
use super::noise::{Octaves, cellular3, fbm3, gradient3, mix, smooth_max, smoothstep};
use super::paint;
use super::sweep::{Chart, Sweep};
use super::{Demo, DemoFiles};
use crate::surface::MeshBuilder;

/// The orb.
pub const DEMO: Demo = Demo {
    name: "orb",
    title: "a sphere carved with plaited bands, rosettes and studs",
    triangles: 3968,
    map_size: 8192,
    make,
};

const AROUND: usize = 64;
const UP: usize = 32;
const COLOR_SIZE: usize = 2048;

/// World units of the deepest carving, on a sphere of radius 1.
const DEPTH: f32 = 0.085;

fn make(map_size: usize) -> DemoFiles {
    let heights = paint::heights(map_size, |st| DEPTH * carving(st));
    let cavity = Cavity::new(&heights.texels, map_size, COLOR_SIZE, 0.006);
    let colors = paint::colors(COLOR_SIZE, |st| gilding(st, &cavity));
    DemoFiles {
        mesh: mesh(),
        scene: scene(heights.scale(), heights.midlevel()),
        heights: heights.texels,
        map_size,
        colors,
        color_size: COLOR_SIZE,
        parts: Vec::new(),
    }
}

/// The point of the unit sphere at texture coordinates `st`.
pub(super) fn direction(st: Vec2) -> Vec3 {
    let (longitude, latitude) = (TAU * st.x, PI * st.y - FRAC_PI_2);
    Vec3::new(
        longitude.sin() * latitude.cos(),
        latitude.sin(),
        longitude.cos() * latitude.cos(),
    )
}

/// The unit sphere.
pub(super) fn mesh() -> MeshBuilder {
    let rings: Vec<Vec<Vec3>> = (1..UP)
        .map(|j| {
            let v = j as f32 / UP as f32;
            (0..AROUND)
                .map(|i| direction(Vec2::new(i as f32 / AROUND as f32, v)))
                .collect()
        })
        .collect();
    let mut sweep = Sweep::default();
    let chart = Chart {
        u: [0.0, 1.0],
        v: [0.0, 1.0],
    };
    sweep.closed_tube(-Vec3::Y, &rings, Vec3::Y, chart);
    let mut mesh = sweep.finish();
    mesh.normals = mesh.positions.iter().map(|p| p.normalize()).collect();
    mesh
}

/// Height of the carving, about [0, 1].
fn carving(st: Vec2) -> f32 {
    let p = direction(st);
    let longitude = 360.0 * st.x;
    let latitude = 180.0 * st.y - 90.0;
    let ornament = ornament(longitude, latitude, p);
    // Nothing but latitude at the poles: see the module's comment.
    let free = smoothstep(84.2, 83.2, latitude.abs());
    if free == 0.0 {
        return ornament;
    }
    ornament + free * wear(p, ornament)
}

/// What hands and time did: an uneven surface, a rough grain, and a ground matted with a round punch.
fn wear(p: Vec3, height: f32) -> f32 {
    let uneven = 0.025 * fbm3(11, 5.0 * p, Octaves::new(2));
    let grain = 0.014 * fbm3(12, 60.0 * p, Octaves::new(3));
    let dents = 0.05 * smoothstep(0.52, 0.75, gradient3(14, 21.0 * p));
    if height > 0.36 {
        return uneven + grain - dents;
    }
    let punch = smoothstep(0.5, 0.2, cellular3(13, 46.0 * p).f1);
    uneven + grain - dents - smoothstep(0.36, 0.22, height) * 0.05 * punch
}

const GROUND: f32 = 0.22;

/// The designed relief, before wear; symmetric about the equator but for the turn of the ropes.
fn ornament(longitude: f32, latitude: f32, p: Vec3) -> f32 {
    let above = latitude.abs();
    let mut h = GROUND;
    let mut raise = |x: f32| h = h.max(x);
    match above {
        a if a < 13.2 => raise(plait(longitude, latitude)),
        a if a < 18.2 => {}
        a if a < 49.6 => raise(medallions(longitude, p)),
        a if a < 55.0 => raise(rope(longitude, above, 52.3, 2.1, 96.0)),
        a if a < 74.0 => raise(lobes(longitude, above)),
        _ => raise(crown(longitude, above)),
    }
    for (center, half_width, height) in FILLETS {
        raise(GROUND + height * flat(above - center, half_width, 0.22));
    }
    for (center, radius, count) in BEADS {
        raise(beads(longitude, above, center, radius, count));
    }
    h
}

/// Plain mouldings: latitude, half width (degrees), height.
const FILLETS: [(f32, f32, f32); 7] = [
    (13.1, 0.55, 0.38),
    (17.7, 0.55, 0.38),
    (49.3, 0.5, 0.36),
    (55.3, 0.5, 0.36),
    (73.8, 0.5, 0.34),
    (78.6, 0.5, 0.34),
    (83.9, 0.6, 0.40),
];

/// Rows of studs: latitude, radius (degrees), how many around.
const BEADS: [(f32, f32, f32); 2] = [(15.4, 1.35, 120.0), (76.2, 1.6, 24.0)];

/// 1 within `half_width` of 0, falling to 0 over `edge`.
fn flat(d: f32, half_width: f32, edge: f32) -> f32 {
    smoothstep(half_width + edge, half_width - edge, d.abs())
}

/// A half-round: 1 at 0, 0 beyond `half_width`.
fn round(d: f32, half_width: f32) -> f32 {
    let t = d / half_width;
    (1.0 - t * t).max(0.0).sqrt()
}

/// `x` folded into [-period / 2, period / 2].
fn fold(x: f32, period: f32) -> f32 {
    x - period * (x / period).round()
}

/// A plait of five strands around the equator, passing over and under each other in turn.
///
/// Strand k follows A sin(x + 2 pi k / 5). Two strands cross where x = pi/2 - pi k / 5, one rising, one
/// falling; the sign of the slope times cos(5 (x - pi/2)) is opposite for the two and alternates
/// along each.
fn plait(longitude: f32, latitude: f32) -> f32 {
    const STRANDS: usize = 5;
    const REPEATS: f32 = 6.0;
    const SWING: f32 = 9.6;
    const HALF_WIDTH: f32 = 1.95;
    let mut h = 0.0f32;
    for k in 0..STRANDS {
        let x = (REPEATS * longitude).to_radians() + TAU * k as f32 / STRANDS as f32;
        let slope = SWING * REPEATS.to_radians() * x.cos();
        let off = (latitude - SWING * x.sin()) / (1.0 + slope * slope).sqrt();
        if off.abs() >= HALF_WIDTH {
            continue;
        }
        let over = (STRANDS as f32 * (x - FRAC_PI_2)).cos() * (3.0 * x.cos()).clamp(-1.0, 1.0);
        let body = round(off, HALF_WIDTH);
        // Two grooves make a band of three cords.
        let grooves = 0.10 * (round(off.abs() - 0.72, 0.26));
        h = h.max(GROUND - 0.1 + (0.42 + 0.16 * over) * body - grooves * body);
    }
    h
}

/// A row of studs on a flat ground.
fn beads(longitude: f32, latitude: f32, center: f32, radius: f32, count: f32) -> f32 {
    let pitch = 360.0 / count;
    let x = fold(longitude - 0.5 * pitch, pitch) * center.to_radians().cos();
    GROUND - 0.04 + 0.48 * round(x.hypot(latitude - center), radius)
}

/// A twisted moulding of `count` turns.
fn rope(longitude: f32, latitude: f32, center: f32, half_width: f32, count: f32) -> f32 {
    let off = latitude - center;
    let turn = (longitude * count / 360.0 + off / (2.6 * half_width)).rem_euclid(1.0) - 0.5;
    let cord = round(turn, 0.56);
    GROUND - 0.08 + round(off, half_width) * (0.22 + 0.4 * cord)
}

/// Long tongues rising to the crown, each with a raised border and a hollow that holds a smaller one.
fn lobes(longitude: f32, latitude: f32) -> f32 {
    const COUNT: f32 = 24.0;
    let pitch = 360.0 / COUNT;
    let along = (latitude - 56.0) / 17.0;
    let x = fold(longitude, pitch) / (0.5 * pitch);
    let outline = leaf_outline(along, 0.86);
    let d = x.abs() / outline.max(1e-3);
    if along < 0.0 || d >= 1.0 {
        let between = fold(longitude - 0.5 * pitch, pitch) * latitude.to_radians().cos();
        let dart = round(between, 0.5) * smoothstep(66.5, 68.0, latitude);
        let stud = round(between.hypot(latitude - 70.6), 1.15);
        return GROUND + (0.25 * dart).max(0.5 * stud);
    }
    let border = smoothstep(1.0, 0.9, d) * 0.42;
    let hollow = smoothstep(0.78, 0.62, d) * 0.26;
    let core = round(d, 0.56) * smoothstep(0.02, 0.2, along) * 0.40;
    let vein = 0.09 * round(x, 0.07);
    GROUND + border - hollow + core - vein
}

/// Half width of a tongue-shaped leaf at `along` in [0, 1], at most `widest`; 0 at the tip.
fn leaf_outline(along: f32, widest: f32) -> f32 {
    if !(0.0..1.0).contains(&along) {
        return 0.0;
    }
    let taper = (1.0 - along.powf(3.2)).max(0.0).sqrt();
    widest * mix(0.8, 1.0, (PI * along).sin()) * taper
}

/// Around each pole: a star of petals, then a boss of nested rings.
fn crown(longitude: f32, latitude: f32) -> f32 {
    if latitude > 82.5 {
        let from_pole = 90.0 - latitude;
        let boss = GROUND + 0.7 * round(from_pole, 3.6);
        let ring = GROUND + 0.45 * round(from_pole - 4.7, 0.8);
        return smooth_max(boss, ring, 0.05);
    }
    const COUNT: f32 = 16.0;
    let x = fold(longitude, 360.0 / COUNT) * latitude.to_radians().cos();
    let along = (latitude - 79.0) / 4.5;
    let width = 1.9 * (1.0 - along.clamp(0.0, 1.0).powi(2)).sqrt();
    GROUND + 0.42 * round(x, width.max(0.1)) - 0.1 * round(x, 0.25)
}

/// Ten medallions on each side of the equator, two designs in turn, palmettes in the gaps.
fn medallions(longitude: f32, p: Vec3) -> f32 {
    const COUNT: f32 = 10.0;
    const MIDDLE: f32 = 33.5;
    const RADIUS: f32 = 13.4;
    let pitch = 360.0 / COUNT;
    let index = (longitude / pitch).round();
    let local = tangent(pitch * index, MIDDLE, p);
    let from_center = local.length();
    if from_center < RADIUS {
        let rim = GROUND + 0.46 * round(from_center - (RADIUS - 1.0), 1.0);
        let inner = GROUND + 0.2 * flat(from_center - (RADIUS - 2.45), 0.3, 0.2);
        let dish = GROUND - 0.14 * smoothstep(RADIUS - 1.5, RADIUS - 4.0, from_center);
        let design = if index.rem_euclid(2.0) == 0.0 {
            rosette(local)
        } else {
            knot(local)
        };
        return dish.max(rim).max(inner).max(design);
    }
    let gap = pitch * ((longitude / pitch).floor() + 0.5);
    let low = palmette(tangent(gap, 18.9, p), 9.6);
    let high = palmette(tangent(gap, 48.5, p) * Vec2::new(1.0, -1.0), 7.6);
    let stud = GROUND + 0.5 * round(tangent(gap, MIDDLE - 0.4, p).length(), 1.25);
    low.max(high).max(stud)
}

/// Degrees east and north of (`longitude`, `latitude`), on the tangent plane; both hemispheres
/// are read as the northern one.
fn tangent(longitude: f32, latitude: f32, p: Vec3) -> Vec2 {
    let north_p = Vec3::new(p.x, p.y.abs(), p.z);
    let (sin_lon, cos_lon) = longitude.to_radians().sin_cos();
    let (sin_lat, cos_lat) = latitude.to_radians().sin_cos();
    let east = Vec3::new(cos_lon, 0.0, -sin_lon);
    let north = Vec3::new(-sin_lon * sin_lat, cos_lat, -cos_lon * sin_lat);
    Vec2::new(north_p.dot(east), north_p.dot(north)).map(f32::to_degrees)
}

/// Two whorls of eight petals around a button.
fn rosette(q: Vec2) -> f32 {
    let r = q.length();
    let angle = q.y.atan2(q.x);
    let ring = |shift: f32, inner: f32, tip: f32, half_width: f32, level: f32| {
        let a = fold(angle + shift, TAU / 8.0);
        let (along, across) = ((r * a.cos() - inner) / (tip - inner), r * a.sin());
        petal(along, across / half_width, level)
    };
    let outer = ring(0.0, 1.0, 10.4, 3.3, 0.34);
    let inner = ring(PI / 8.0, 0.6, 6.6, 2.1, 0.56);
    let button = GROUND + 0.78 * round(r, 2.3) - 0.12 * round(r - 1.25, 0.3);
    outer.max(inner).max(button)
}

/// A cupped petal with a midrib: `along` and `across` in [0, 1] and [-1, 1] on it.
fn petal(along: f32, across: f32, level: f32) -> f32 {
    if !(0.0..1.0).contains(&along) {
        return 0.0;
    }
    let outline = (PI * along.powf(1.5)).sin().max(0.0).powf(0.6);
    let d = across.abs() / outline.max(1e-3);
    if d >= 1.0 {
        return 0.0;
    }
    let edge = smoothstep(1.0, 0.82, d);
    let cup = 0.13 * smoothstep(0.25, 0.9, d) + 0.12 * along;
    let ribs = 0.035 * (13.0 * d - 3.0 * along).cos() * smoothstep(0.15, 0.4, d);
    let midrib = 0.10 * round(across, 0.13);
    GROUND - 0.14 + edge * (level + 0.14 + cup + ribs + midrib - 0.1)
}

/// A ring of three strands plaited, around an eight-lobed button.
fn knot(q: Vec2) -> f32 {
    const STRANDS: usize = 3;
    const REPEATS: f32 = 4.0;
    const SWING: f32 = 2.35;
    const MIDDLE: f32 = 7.3;
    const HALF_WIDTH: f32 = 1.05;
    let r = q.length();
    let angle = q.y.atan2(q.x);
    let mut h = 0.0f32;
    for k in 0..STRANDS {
        let x = REPEATS * angle + TAU * k as f32 / STRANDS as f32;
        let slope = SWING * REPEATS / r.max(1.0) * x.cos();
        let off = (r - MIDDLE - SWING * x.sin()) / (1.0 + slope * slope).sqrt();
        let over = (STRANDS as f32 * (x - FRAC_PI_2)).cos() * (3.0 * x.cos()).clamp(-1.0, 1.0);
        let body = round(off, HALF_WIDTH);
        let groove = 0.09 * round(off, 0.3);
        h = h.max(GROUND - 0.2 + (0.48 + 0.18 * over) * body - groove);
    }
    let lobes = 2.9 + 0.45 * (8.0 * angle).cos();
    let button = GROUND + 0.4 * round(r, lobes) + 0.26 * round(r, 1.2);
    h.max(button)
}

/// A fan of five leaves growing north out of the origin, the middle one `length` degrees long.
fn palmette(q: Vec2, length: f32) -> f32 {
    let mut h = 0.0f32;
    for (turn, part) in [(0.0, 1.0), (0.55, 0.8), (1.1, 0.62)] {
        let (sin, cos) = f32::sin_cos(turn);
        let side = Vec2::new(q.x.abs(), q.y);
        let along = (side.x * sin + side.y * cos) / (length * part);
        let across = (side.x * cos - side.y * sin) / (1.45 * part);
        h = h.max(petal(along, across, 0.42 + 0.08 * part));
    }
    let root = GROUND + 0.5 * round(q.length(), 1.5);
    h.max(root)
}

/// Old gilding: bright on what stands out, worn to red bole here and there, verdigris in the hollows.
fn gilding(st: Vec2, cavity: &Cavity) -> Vec3 {
    let p = direction(st);
    let gold = Vec3::new(0.72, 0.44, 0.13);
    let dark = Vec3::new(0.10, 0.055, 0.025);
    let patina = Vec3::new(0.10, 0.25, 0.20);
    let bole = Vec3::new(0.34, 0.10, 0.05);
    let uneven = fbm3(21, 7.0 * p, Octaves::new(4));
    let relief = cavity.relief(st) + 0.03 * uneven;
    let height = cavity.height(st);
    let shade = mix(
        0.85,
        1.15,
        smoothstep(-0.4, 0.5, fbm3(22, 30.0 * p, Octaves::new(3))),
    );
    let mut color = gold * shade;
    let hollow = smoothstep(0.02, -0.14, relief).max(smoothstep(0.3, 0.14, height));
    color = color.lerp(dark, 0.85 * hollow);
    color = color.lerp(patina, 0.75 * hollow * smoothstep(-0.1, 0.35, uneven));
    color.lerp(
        bole,
        0.7 * smoothstep(0.33, 0.5, uneven) * smoothstep(0.0, 0.08, relief),
    )
}

fn scene(scale: f32, midlevel: f32) -> String {
    format!(
        r#"[camera]
position = [0.0, 1.75, 4.6]
target = [0.0, 1.0, 0.0]
fov = 33.0

[film]
spp = 16
exposure = 0.3

[[mesh]]
file = "orb.obj"
material = "gilding"
transform = {{ rotate = [24.0, 0.0, -9.0], translate = [0.0, 1.06, 0.0] }}

[mesh.displacement]
map = "orb_height.png"
scale = {scale}
midlevel = {midlevel}

[[mesh]]
name = "floor"
shape = "plane"
transform = {{ scale = 50 }}
material = "floor"

[[material]]
name = "gilding"
base_color = {{ file = "orb_color.png" }}
roughness = 0.35
specular = 0.9

[[material]]
name = "floor"
base_color = [0.20, 0.17, 0.15]
roughness = 0.25

[[light]]
type = "sun"
elevation = 38.0
azimuth = 28.0

[[light]]
type = "sky"
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::laws;

    #[test]
    fn obeys_the_laws_of_demos() {
        laws::check(&DEMO, 1024);
    }
}
