//! The stump: furrowed bark on flaring roots, and a felled top with growth rings, saw marks and a torn hinge.
//!
//! One lathe: u runs once around, v from below the ground up the side and then over the rim to the pith. All
//! noise is taken on a cylinder whose circumference is u, so that u = 0 and u = 1 agree; in the innermost
//! fan, around the pith, the height depends on v alone.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::cavity::Cavity;
use super::noise::{Octaves, fbm2, fbm3, gradient3, hash, mix, next, smoothstep, unit};
use super::paint::{self, Heights};
use super::sweep::{Ring, Sweep};
use super::{Demo, DemoFiles};
use crate::surface::MeshBuilder;

/// The stump.
pub const DEMO: Demo = Demo {
    name: "stump",
    title: "a tree stump: furrowed bark, roots, growth rings",
    triangles: 7710,
    map_size: 4096,
    make,
};

const AROUND: usize = 96;
const SIDE_STRIPS: usize = 36;
/// Points of each ring on the cut, from the rim inward: 36 * 192 + 192 + 2 * 255 + 96 = 7710 triangles.
const CUT_RINGS: [(usize, f32); 7] = [
    (96, 0.955),
    (72, 0.86),
    (60, 0.74),
    (48, 0.60),
    (36, 0.44),
    (24, 0.27),
    (15, PITH),
];
/// Fraction of the radius within which the cut is a function of v alone.
const PITH: f32 = 0.085;

const HEIGHT: f32 = 0.95;
const BELOW_GROUND: f32 = 0.04;
/// v of the rim: the side below, the cut above.
const RIM: f32 = 0.72;
/// v of the pith: short of 1, lest a lookup there reads the bottom row, which repeats above it.
const TOP: f32 = 0.995;
const COLOR_SIZE: usize = 2048;

fn make(map_size: usize) -> DemoFiles {
    on_stage(DEMO.name, STAGE, map_size)
}

/// The stump in a demo called `name`; `stage` is the rest of its scene file: camera, film, floor and whatever stands
/// around.
pub(super) fn on_stage(name: &str, stage: &str, map_size: usize) -> DemoFiles {
    let trunk = Trunk::new();
    let heights = paint::heights(map_size, |st| trunk.height(st));
    let cavity = Cavity::new(&heights.texels, map_size, COLOR_SIZE, 0.004);
    let colors = paint::colors(COLOR_SIZE, |st| trunk.color(st, &cavity));
    DemoFiles {
        mesh: trunk.mesh(),
        scene: scene(name, stage, &heights),
        heights: heights.texels,
        map_size,
        colors,
        color_size: COLOR_SIZE,
        parts: Vec::new(),
    }
}

/// One root: a ridge that leaves the trunk and sinks into the ground.
struct Root {
    angle: f32,
    /// How far it reaches beyond the trunk at ground level.
    reach: f32,
    /// Height over which it falls to 1/e of that.
    fall: f32,
    /// Half width, radians.
    width: f32,
}

/// The base shape, and where its columns stand.
struct Trunk {
    roots: Vec<Root>,
    /// Angle at each of equally spaced u in [0, 1]; its last is its first plus a turn.
    angles: Vec<f32>,
}

/// A point of the map as the painters see it.
enum Place {
    /// On the bark: the cylinder point (u as a circle of circumference 1), and the height in [0, 1].
    Side { around: Vec2, t: f32 },
    /// On the cut: angle, and fraction of the radius from 0 (pith) to 1 (rim).
    Cut { around: Vec2, angle: f32, r: f32 },
}

impl Trunk {
    fn new() -> Self {
        let roots = (0..7)
            .map(|i| {
                let h = hash(41, i, 0, 0);
                let (a, b, c) = (unit(h), unit(next(h)), unit(next(next(h))));
                Root {
                    angle: TAU * (i as f32 + 0.55 * (a - 0.5)) / 7.0 + 0.5,
                    reach: mix(0.38, 0.95, b),
                    fall: mix(0.13, 0.24, c),
                    width: mix(0.18, 0.25, unit(hash(42, i, 0, 0))),
                }
            })
            .collect();
        let mut trunk = Self {
            roots,
            angles: Vec::new(),
        };
        trunk.angles = trunk.columns();
        trunk
    }

    /// Angles that share out the outline near the ground, so that the roots' long flanks get their columns.
    fn columns(&self) -> Vec<f32> {
        const FINE: usize = 4096;
        const OUTLINE: f32 = 0.10;
        let at = |i: usize| {
            let angle = TAU * i as f32 / FINE as f32;
            self.radius(angle, OUTLINE) * Vec2::from_angle(angle)
        };
        let lengths: Vec<f32> = (0..FINE).map(|i| at(i).distance(at(i + 1))).collect();
        let total: f32 = lengths.iter().sum();
        let mut angles = vec![0.0];
        let (mut passed, mut column) = (0.0, 1);
        for (i, length) in lengths.iter().enumerate() {
            let share = 0.65 * length / total + 0.35 / FINE as f32;
            while column < FINE && passed + share >= column as f32 / FINE as f32 {
                let part = (column as f32 / FINE as f32 - passed) / share;
                angles.push(TAU * (i as f32 + part) / FINE as f32);
                column += 1;
            }
            passed += share;
        }
        angles.resize(FINE, TAU);
        angles.push(TAU);
        angles
    }

    fn angle(&self, u: f32) -> f32 {
        let x = u * (self.angles.len() - 1) as f32;
        let i = (x as usize).min(self.angles.len() - 2);
        mix(self.angles[i], self.angles[i + 1], x - i as f32)
    }

    /// Radius of the outline at height `y`.
    fn radius(&self, angle: f32, y: f32) -> f32 {
        let up = (y / HEIGHT).clamp(0.0, 1.0);
        let lobes = 0.05 * (2.0 * angle + 1.0).sin()
            + 0.035 * (3.0 * angle + 2.2).sin()
            + 0.025 * (5.0 * angle + 0.4).sin();
        let trunk = 0.54 * (1.0 + lobes * mix(1.4, 1.0, up) + 0.10 * (1.0 - up).powi(2));
        let root = |r: &Root| {
            let off = (angle - r.angle + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
            let x = off / r.width;
            r.reach * (-y.max(-BELOW_GROUND) / r.fall).exp() / (1.0 + x * x).powi(2)
        };
        trunk + self.roots.iter().map(root).sum::<f32>()
    }

    /// The base surface at height `y` of column `u`, `part` of the radius from the axis.
    fn point(&self, u: f32, y: f32, part: f32) -> Vec3 {
        let angle = self.angle(u.rem_euclid(1.0));
        let r = part * self.radius(angle, y);
        // Roots wander sideways as they run out.
        let bend = 0.2 * (3.0 * angle + 0.7).sin() * (r - 0.6).max(0.0).powi(2);
        let (sin, cos) = (angle + bend).sin_cos();
        // The tree leaned a little, and so does the cut.
        let tilt = 0.07 * (y / HEIGHT).max(0.0).powi(3) * r * (angle - 2.6).cos();
        Vec3::new(r * sin + 0.05 * (y / HEIGHT).max(0.0), y - tilt, r * cos)
    }

    fn mesh(&self) -> MeshBuilder {
        let mut sweep = Sweep::default();
        let mut ring = |count: usize, y: f32, part: f32, v: f32| -> Ring {
            let points: Vec<Vec3> = (0..count)
                .map(|i| self.point(i as f32 / count as f32, y, part))
                .collect();
            sweep.ring(&points, [0.0, 1.0], v)
        };
        let mut rings: Vec<Ring> = (0..=SIDE_STRIPS)
            .map(|row| {
                let t = side_row(row);
                ring(AROUND, side_height(t), 1.0, RIM * t)
            })
            .collect();
        rings.extend(
            CUT_RINGS
                .iter()
                .map(|&(count, part)| ring(count, HEIGHT, part, cut_v(part))),
        );
        for pair in rings.windows(2) {
            sweep.strip(pair[0], pair[1]);
        }
        if let Some(&last) = rings.last() {
            sweep.cap(last, self.point(0.0, HEIGHT, 0.0), TOP, true);
        }
        sweep.finish()
    }

    fn place(&self, st: Vec2) -> Place {
        let around = Vec2::from_angle(TAU * st.x) / TAU;
        if st.y < RIM {
            return Place::Side {
                around,
                t: st.y / RIM,
            };
        }
        Place::Cut {
            around,
            angle: self.angle(st.x),
            r: (TOP - st.y) / (TOP - RIM),
        }
    }

    /// World units above the base surface.
    fn height(&self, st: Vec2) -> f32 {
        match self.place(st) {
            Place::Side { around, t } => bark(around, t),
            Place::Cut { around, angle, r } => {
                let wood = cut(angle, r);
                if r < BARK_INSIDE {
                    return wood;
                }
                let rind = bark(around, 1.0);
                let x = smoothstep(BARK_INSIDE, 1.0, r + 0.02 * ripple(around));
                let crack = 0.02 * (1.0 - ((r - 0.915) / 0.012).powi(2)).max(0.0);
                mix(wood, rind, x) - crack * smoothstep(-0.2, 0.2, ripple(around))
            }
        }
    }

    fn color(&self, st: Vec2, cavity: &Cavity) -> Vec3 {
        let relief = cavity.relief(st);
        match self.place(st) {
            Place::Side { around, t } => bark_color(around, t, relief),
            Place::Cut { around, angle, r } => {
                let rind = bark_color(around, 1.0, relief).lerp(INNER_BARK, 0.6);
                let edge = 0.925 + 0.012 * ripple(around);
                cut_color(angle, r, relief).lerp(rind, smoothstep(edge, edge + 0.012, r))
            }
        }
    }
}

/// Fraction of the radius where the wood ends and the bark begins.
const BARK_INSIDE: f32 = 0.89;
const INNER_BARK: Vec3 = Vec3::new(0.16, 0.075, 0.035);

/// Position of a row of the side in [0, 1]; the last but one is close to the rim, to make it an edge.
fn side_row(row: usize) -> f32 {
    if row == SIDE_STRIPS {
        1.0
    } else {
        0.982 * row as f32 / (SIDE_STRIPS - 1) as f32
    }
}

/// Height above ground of the side at `t` in [0, 1]: rows crowd near the ground, where roots run flat.
fn side_height(t: f32) -> f32 {
    (HEIGHT + BELOW_GROUND) * t.powf(1.3) - BELOW_GROUND
}

fn cut_v(part: f32) -> f32 {
    TOP - (TOP - RIM) * part
}

/// A slow wave around the trunk.
fn ripple(around: Vec2) -> f32 {
    gradient3(5, (24.0 * around).extend(0.0))
}

/// Bark: long plates parted by furrows that meet and part, cross-cracked, fibrous.
fn bark(around: Vec2, t: f32) -> f32 {
    let q = around.extend(0.21 * t);
    let bent = q + 0.012
        * Vec3::new(
            fbm3(31, 14.0 * q, Octaves::new(2)),
            fbm3(32, 14.0 * q, Octaves::new(2)),
            0.0,
        );
    // Furrows are the zeros of noise drawn out along the trunk.
    let furrow = |seed: u32, scale: Vec3| gradient3(seed, bent * scale).abs();
    let wide = smoothstep(0.01, 0.20, furrow(33, Vec3::new(34.0, 34.0, 11.0)));
    let fine = smoothstep(0.0, 0.20, furrow(34, Vec3::new(62.0, 62.0, 19.0)));
    let across = smoothstep(0.0, 0.13, furrow(35, Vec3::new(52.0, 52.0, 95.0)));
    let plate = wide.powf(0.8) * mix(0.45, 1.0, fine) * mix(0.78, 1.0, across);
    let fibre = fbm3(36, q * Vec3::new(230.0, 230.0, 70.0), Octaves::new(3));
    let flakes = 4.5 * fbm3(37, q * Vec3::new(85.0, 85.0, 75.0), Octaves::new(3));
    let steps = flakes.floor() + smoothstep(0.3, 0.7, flakes.rem_euclid(1.0));
    let swell = gradient3(38, 9.0 * q);
    // The saw left no bark standing above the cut.
    let sawn = mix(1.0, 0.62, smoothstep(0.965, 1.0, t));
    let bark = sawn * (0.078 * plate + 0.0055 * plate * steps) + 0.010 * fibre + 0.014 * swell;
    bark + 0.016 * moss(q, t) * (1.0 + 0.8 * gradient3(39, 150.0 * q)) + knot(around, t)
}

/// How mossy the bark is, 0 to 1: patches near the ground.
fn moss(q: Vec3, t: f32) -> f32 {
    let patches = fbm3(63, 13.0 * q, Octaves::new(4)) + 0.5 * (0.40 - t);
    smoothstep(0.04, 0.20, patches)
}

/// The scar of a lost branch: a swollen collar around a rotten hole.
fn knot(around: Vec2, t: f32) -> f32 {
    const U: f32 = 0.83;
    let at = Vec2::from_angle(TAU * U) / TAU;
    let d = around.distance(at).hypot(0.19 * (t - 0.74)) / 0.026;
    if d > 2.2 {
        return 0.0;
    }
    let collar = 0.034 * (-((d - 1.0) / 0.42).powi(2)).exp();
    let rings = 0.006 * (11.0 * d).cos() * smoothstep(1.7, 0.9, d);
    collar + rings - 0.05 * smoothstep(0.8, 0.35, d)
}

/// A point on the cut as seen from above, about [-1, 1].
fn on_cut(angle: f32, r: f32) -> Vec2 {
    r * Vec2::new(angle.sin(), angle.cos())
}

/// Years outward from the pith at a point of the cut: not quite round, closer together near the bark.
fn years(angle: f32, r: f32) -> f32 {
    let p = on_cut(angle, r);
    let bumps = 0.05 * fbm2(51, 3.0 * p, Octaves::new(2)) + 0.05 * (angle - 1.0).cos() * (1.0 - r);
    let calm = smoothstep(PITH, 2.5 * PITH, r);
    30.0 * (r + r * calm * bumps).max(0.0).powf(0.85)
}

/// How far `p` lies behind the hinge, the chord where the fibres tore; the back cut is at negative distances.
fn behind_hinge(p: Vec2) -> f32 {
    let along = p.dot(Vec2::new(0.82, -0.57));
    p.dot(Vec2::new(0.57, 0.82)) + 0.22 + 0.03 * gradient3(52, Vec3::new(6.0 * along, 0.0, 0.5))
}

/// The felled surface.
fn cut(angle: f32, r: f32) -> f32 {
    const LEVEL: f32 = 0.06;
    let ring = years(angle, r).rem_euclid(1.0);
    let worn = 0.0045 * smoothstep(0.0, 0.75, ring) * smoothstep(1.0, 0.85, ring);
    let p = on_cut(angle, r);
    let free = smoothstep(PITH, 1.3 * PITH, r);
    if free == 0.0 {
        return LEVEL + worn - 0.012 * smoothstep(0.4 * PITH, 0.15 * PITH, r);
    }
    let hinge = behind_hinge(p);
    let across = p.dot(Vec2::new(0.57, 0.82));
    let along = p.dot(Vec2::new(0.82, -0.57));
    let saw = 0.0035
        * fbm2(
            53,
            Vec2::new(75.0 * across + 4.0 * along * along, 5.0 * along),
            Octaves::new(2),
        );
    let step = -0.022 * smoothstep(0.02, -0.02, hinge);
    let rough = 0.003 * fbm2(54, 60.0 * p, Octaves::new(2));
    LEVEL
        + worn
        + free * (saw + step + rough + splinters(hinge, along) - 0.035 * splits(angle, r, p))
}

/// Torn fibres standing along the hinge.
fn splinters(hinge: f32, along: f32) -> f32 {
    if hinge.abs() > 0.12 {
        return 0.0;
    }
    let fibre = |seed, scale: f32| {
        gradient3(seed, Vec3::new(scale * along, 9.0 * hinge, 0.5)).max(-0.2) + 0.2
    };
    let tall = fibre(55, 26.0) * (0.4 + fibre(56, 70.0));
    let bed = (1.0 - (hinge / 0.075).powi(2)).max(0.0);
    0.115 * bed.powf(0.7) * tall + 0.010 * bed
}

/// Drying cracks that open towards the bark, 1 in their depth.
fn splits(angle: f32, r: f32, p: Vec2) -> f32 {
    let wander = 0.16 * fbm2(57, 4.0 * p, Octaves::new(3));
    [
        (0.4, 0.25, 0.05),
        (1.9, 0.5, 0.03),
        (2.7, 0.12, 0.055),
        (4.1, 0.4, 0.035),
        (5.4, 0.2, 0.045),
    ]
    .iter()
    .map(|&(at, from, width): &(f32, f32, f32)| {
        let off = (angle + wander - at + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        let open = width * ((r - from) / (1.0 - from)).max(0.0).powf(0.6);
        smoothstep(open + 0.004, 0.3 * open, off.abs()) * smoothstep(from, from + 0.08, r)
    })
    .fold(0.0, f32::max)
}

fn bark_color(around: Vec2, t: f32, relief: f32) -> Vec3 {
    let q = around.extend(0.21 * t);
    let mottle = fbm3(61, 30.0 * q, Octaves::new(4));
    let furrow = Vec3::new(0.035, 0.020, 0.013);
    let plate = Vec3::new(0.27, 0.20, 0.145)
        .lerp(Vec3::new(0.40, 0.345, 0.285), smoothstep(-0.3, 0.4, mottle));
    let mut color = furrow.lerp(plate, smoothstep(-0.13, 0.10, relief));
    let lichen = fbm3(62, 55.0 * q, Octaves::new(3));
    color = color.lerp(
        Vec3::new(0.42, 0.44, 0.34),
        0.7 * smoothstep(0.28, 0.42, lichen) * smoothstep(-0.02, 0.06, relief),
    );
    let green = Vec3::new(0.045, 0.075, 0.014).lerp(
        Vec3::new(0.15, 0.19, 0.035),
        smoothstep(-0.4, 0.5, lichen + 3.0 * relief),
    );
    color.lerp(green, 0.92 * moss(q, t))
}

fn cut_color(angle: f32, r: f32, relief: f32) -> Vec3 {
    let year = years(angle, r);
    let ring = year.rem_euclid(1.0);
    let p = on_cut(angle, r);
    let late = smoothstep(0.35, 0.9, ring) * smoothstep(1.0, 0.93, ring);
    let strength = mix(0.45, 1.0, unit(hash(64, year as i32, 0, 0)));
    let heart = smoothstep(0.72, 0.55, r + 0.06 * fbm2(65, 3.0 * p, Octaves::new(2)));
    let pale = Vec3::new(0.62, 0.43, 0.24).lerp(Vec3::new(0.47, 0.26, 0.12), heart);
    let dark = Vec3::new(0.28, 0.13, 0.05);
    let mut color = pale.lerp(dark, 0.75 * late * strength);
    let grime = fbm2(66, 5.0 * p, Octaves::new(4));
    color = color.lerp(
        Vec3::new(0.30, 0.27, 0.23),
        0.55 * smoothstep(0.0, 0.4, grime),
    );
    color *= mix(
        0.85,
        1.1,
        smoothstep(
            -0.4,
            0.4,
            fbm2(67, Vec2::new(90.0 * p.x, 90.0 * p.y), Octaves::new(2)),
        ),
    );
    let pith = smoothstep(0.02, 0.012, r);
    let hollow = smoothstep(-0.02, -0.12, relief);
    color.lerp(Vec3::new(0.04, 0.025, 0.015), hollow.max(0.8 * pith))
}

const STAGE: &str = r#"[camera]
position = [0.6, 2.15, 3.7]
target = [0.0, 0.42, 0.0]
fov = 32.0

[film]
spp = 16
exposure = 0.6

[[mesh]]
name = "floor"
shape = "plane"
transform = { scale = 50 }
material = "earth"

[[material]]
name = "earth"
base_color = [0.17, 0.15, 0.10]
roughness = 0.7
specular = 0.2
"#;

fn scene(name: &str, stage: &str, heights: &Heights) -> String {
    let (scale, midlevel) = (heights.scale(), heights.midlevel());
    format!(
        r#"{stage}
[[mesh]]
file = "{name}.obj"
material = "wood"

[mesh.displacement]
map = "{name}_height.png"
scale = {scale}
midlevel = {midlevel}

[[material]]
name = "wood"
base_color = {{ file = "{name}_color.png" }}
roughness = 0.85
specular = 0.3

[[light]]
type = "sun"
elevation = 36.0
azimuth = 40.0

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

    #[test]
    fn columns_go_once_around_in_order() {
        let trunk = Trunk::new();
        assert_eq!((trunk.angle(0.0), trunk.angle(1.0)), (0.0, TAU));
        assert!(trunk.angles.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
