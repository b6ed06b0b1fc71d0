//! A blanket of riveted chain mail, draped over a ball.
//!
//! The sheet is 23 x 30 quads and a last row that goes from 23 segments to 20: 1380 + 43 = 1423 triangles. The rings
//! are "four in one": each passes through the four around it, which in heights means that leaning rings cross
//! over on one side and under on the other.

use glam::{Vec2, Vec3};

use super::drape::{self, Ball, Sheet};
use super::noise::{Octaves, fbm2, gradient2, hash, mix, next, smoothstep, unit};
use super::shape::{self, Rect};
use super::{Demo, DemoFiles, paint};
use crate::surface::MeshBuilder;

/// The demo.
pub const DEMO: Demo = Demo {
    name: "chainmail",
    title: "a draped blanket of interlinked steel rings",
    triangles: 1423,
    map_size: 4096,
    make,
};

const QUADS: (usize, usize) = (23, 30);
/// Segments of the hem.
const HEM: usize = 20;
/// Width of a quad, world units.
const SPACING: f32 = 0.1;
/// Rings side by side over the width of the sheet.
const RINGS: f32 = 46.0;

/// Of a ring, in units of the distance between rings in a row.
mod ring {
    /// Middle of the ring to the middle of the wire.
    pub const RADIUS: f32 = 0.515;
    /// Half the wire's thickness.
    pub const WIRE: f32 = 0.098;
    /// Rise over run of the ring's plane. Two leaning rings differ by about 0.54 LEAN where they cross, which must be
    /// more than two wire radii.
    pub const LEAN: f32 = 0.40;
    /// From row to row.
    pub const ROW: f32 = 0.5;
}

fn make(map_size: usize) -> DemoFiles {
    let mesh = base_mesh(map_size);
    let unit_length = sheet_size().x / RINGS;
    let heights = paint::heights(map_size, |st| {
        unit_length * height(st * sheet_size() / unit_length)
    });
    let color_size = map_size / 2;
    let colors = paint::colors(color_size, |st| color(st * sheet_size() / unit_length));
    let scene = scene(heights.scale(), heights.midlevel());
    DemoFiles {
        mesh,
        heights: heights.texels,
        map_size,
        colors,
        color_size,
        parts: Vec::new(),
        scene,
    }
}

fn sheet_size() -> Vec2 {
    SPACING * Vec2::new(QUADS.0 as f32, (QUADS.1 + 1) as f32)
}

fn base_mesh(map_size: usize) -> MeshBuilder {
    let sheet = fallen_sheet();
    let at = |i: usize, j: usize| sheet.points[j * sheet.columns + i];
    let full = Rect::texel_centres(map_size);
    let rows = QUADS.1 as f32 / (QUADS.1 + 1) as f32;
    let body = Rect {
        min: full.min,
        max: full.place(Vec2::new(1.0, rows)),
    };
    let mut mesh = MeshBuilder::default();
    let chart = shape::add_grid(&mut mesh, QUADS, body, |uv| {
        let i = (uv.x * QUADS.0 as f32).round() as usize;
        at(i, (uv.y * QUADS.1 as f32).round() as usize)
    });
    let hem = mesh.positions.len();
    for k in 0..=HEM {
        let u = k as f32 / HEM as f32;
        let x = u * QUADS.0 as f32;
        let i = (x as usize).min(QUADS.0 - 1);
        let (a, b) = (at(i, QUADS.1 + 1), at(i + 1, QUADS.1 + 1));
        mesh.positions.push(a.lerp(b, x - i as f32));
        mesh.texcoords.push(full.place(Vec2::new(u, 1.0)));
    }
    let below = |i: usize| chart.vertex(i, QUADS.1) as u32;
    zip(&mut mesh, below, QUADS.0, |k| (hem + k) as u32, HEM);
    shape::smooth_normals(&mut mesh);
    mesh
}

/// Joins two rows of `n` and `m` segments with n + m triangles, always advancing the row that is behind.
fn zip(
    mesh: &mut MeshBuilder,
    below: impl Fn(usize) -> u32,
    n: usize,
    above: impl Fn(usize) -> u32,
    m: usize,
) {
    let (mut i, mut k) = (0, 0);
    while i < n || k < m {
        if k == m || (i < n && (2 * i + 1) * m <= (2 * k + 1) * n) {
            mesh.triangles.push([below(i), below(i + 1), above(k)]);
            i += 1;
        } else {
            mesh.triangles.push([below(i), above(k + 1), above(k)]);
            k += 1;
        }
    }
}

fn fallen_sheet() -> Sheet {
    let ball = Ball {
        radius: 0.50,
        skin: 0.03,
    };
    let start = Vec3::new(0.0, 1.06, 0.0);
    let sheet = drape::level_sheet(QUADS.0 + 1, QUADS.1 + 2, SPACING, start, 0.5);
    drape::drape(sheet, ball, 900)
}

/// The topmost thing at a point of the sheet.
enum Top {
    Padding,
    Wire(Wire),
}

/// The top of a ring's wire. Lengths in distances between rings.
struct Wire {
    height: f32,
    /// Random bits of the ring.
    id: u32,
    /// Along and across the wire.
    place: Vec2,
    brass: bool,
}

/// `p` in distances between rings, from the sheet's corner. The padding is below all wires.
fn top(p: Vec2) -> Top {
    let mut best = Top::Padding;
    let mut highest = f32::NEG_INFINITY;
    let row = (p.y / ring::ROW).round() as i32;
    for j in row - 1..=row + 1 {
        let shift = if j & 1 == 0 { 0.0 } else { 0.5 };
        let column = (p.x - shift).round() as i32;
        for i in column - 1..=column + 1 {
            let centre = Vec2::new(i as f32 + shift, j as f32 * ring::ROW);
            if is_whole(centre)
                && let Some(found) = wire(p, centre, j, hash(3, i, j, 0))
                && found.height > highest
            {
                highest = found.height;
                best = Top::Wire(found);
            }
        }
    }
    best
}

fn height(p: Vec2) -> f32 {
    match top(p) {
        Top::Padding => -0.30 + 0.012 * threads(p) + 0.02 * wear(p),
        Top::Wire(wire) => wire.height,
    }
}

/// Linear.
fn color(p: Vec2) -> Vec3 {
    match top(p) {
        Top::Padding => {
            let brown = Vec3::new(0.060, 0.036, 0.020);
            brown * (0.55 + 0.45 * threads(p)) * (1.0 + 0.5 * wear(p))
        }
        Top::Wire(wire) => metal(p, &wire),
    }
}

/// Rings that would stick out of the sheet are left away.
fn is_whole(centre: Vec2) -> bool {
    let size = sheet_size() * RINGS / sheet_size().x;
    let reach = ring::RADIUS + ring::WIRE + 0.06;
    centre.cmpge(Vec2::splat(reach)).all() && centre.cmple(size - reach).all()
}

/// The woven linen behind the rings: 0 between threads, 1 on top of one.
fn threads(p: Vec2) -> f32 {
    let (a, b) = (14.0 * std::f32::consts::PI * p)
        .to_array()
        .map(f32::sin)
        .into();
    if a * b > 0.0 { a.abs() } else { b.abs() }
}

fn wear(p: Vec2) -> f32 {
    fbm2(8, 0.8 * p, Octaves::new(3))
}

/// The top of one ring's wire above `p`, if it is there.
fn wire(p: Vec2, centre: Vec2, row: i32, id: u32) -> Option<Wire> {
    let random = |k: i32| unit(hash(id, k, 0, 0)) - 0.5;
    // No ring hangs quite like the next, and none is quite round.
    let centre = centre + 0.035 * Vec2::new(random(1), random(2));
    let lean = (if row & 1 == 0 {
        ring::LEAN
    } else {
        -ring::LEAN
    }) * (1.0 + 0.12 * random(3));
    let tilt = 0.10 * random(4);
    let d = p - centre;
    let cosine = 1.0 / (1.0 + lean * lean).sqrt();
    let e = Vec2::new(d.x / cosine, d.y);
    // Half the widest wire and the largest departure from a circle.
    if (e.length() - ring::RADIUS).abs() > (1.28 * ring::WIRE + 0.03 * ring::RADIUS) / cosine {
        return None;
    }
    let angle = e.to_angle();
    let radius = ring::RADIUS * (1.0 + 0.03 * (2.0 * angle + 6.0 * random(5)).cos());
    // The ring closes at a flattened, riveted lap.
    let lap = (0.5 * (angle - std::f32::consts::TAU * (0.12 * random(6) + 0.25)))
        .sin()
        .abs();
    let flat = smoothstep(0.20, 0.08, lap);
    let half = ring::WIRE * mix(1.0, 1.28, flat);
    let across = (e.length() - radius) * mix(cosine, 1.0, (e.y / e.length().max(1e-3)).abs());
    let q = across / half;
    if q.abs() >= 1.0 {
        return None;
    }
    let round = (1.0 - q * q).sqrt();
    let section = mix(
        ring::WIRE * round,
        0.72 * ring::WIRE * (1.0 - q.powi(4)).powf(0.25),
        flat,
    );
    let along = Vec2::new(angle * radius, across);
    let rivet_at = Vec2::new(2.0 * lap * radius, across).length() / (0.62 * half);
    let rivet = 0.045 * (1.0 - rivet_at * rivet_at).max(0.0).sqrt();
    let dents = 0.006 * gradient2(id, 9.0 * along) + 0.0022 * gradient2(next(id), 40.0 * along);
    let height = lean * d.x + tilt * d.y + section + rivet + dents;
    Some(Wire {
        height,
        id,
        place: along,
        brass: is_brass(centre),
    })
}

/// Three outer rows of rings are of brass, as a border.
fn is_brass(centre: Vec2) -> bool {
    let size = sheet_size() * RINGS / sheet_size().x;
    let edge = centre.min(size - centre).min_element();
    edge < 2.6
}

fn metal(p: Vec2, wire: &Wire) -> Vec3 {
    let Wire {
        height, id, brass, ..
    } = *wire;
    let depth = smoothstep(-0.25, 0.15, height);
    let steel = Vec3::new(0.56, 0.57, 0.58);
    let gold = Vec3::new(0.80, 0.56, 0.24);
    let base = if brass { gold } else { steel };
    let scratches = gradient2(id, wire.place * Vec2::new(6.0, 45.0));
    let rust = smoothstep(0.15, 0.6, fbm2(17, 0.22 * p, Octaves::new(6)))
        * smoothstep(0.2, -0.3, gradient2(18, 5.0 * p));
    let shade = mix(0.45, 1.0, depth) * (1.0 + 0.15 * (unit(id) - 0.5) + 0.10 * scratches);
    let rusty = Vec3::new(0.22, 0.10, 0.045);
    (base * shade).lerp(rusty * shade, if brass { 0.0 } else { 0.6 * rust })
}

fn scene(scale: f32, midlevel: f32) -> String {
    format!(
        r#"# Chain mail of 1423 triangles, draped over a ball.
[camera]
position = [0.8, 1.75, 3.3]
target = [0.0, 0.34, 0.08]
fov = 37.0

[film]
width = 640
height = 480
spp = 32

[[mesh]]
name = "chainmail"
file = "chainmail.obj"
material = "rings"

[mesh.displacement]
map = "chainmail_height.png"
scale = {scale}
midlevel = {midlevel}
wrap = "clamp"

[[mesh]]
name = "floor"
shape = "plane"
transform = {{ scale = 50 }}
material = "floor"

[[material]]
name = "rings"
base_color = {{ file = "chainmail_color.png", color_space = "srgb", wrap = "clamp" }}
metallic = 1.0
roughness = 0.38

[[material]]
name = "floor"
base_color = [0.20, 0.16, 0.13]
roughness = 0.25

[[light]]
type = "sun"
elevation = 42.0
azimuth = 60.0

[[light]]
type = "sky"
turbidity = 3.0
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::laws;

    #[test]
    fn obeys_the_laws() {
        laws::check(&DEMO, 256);
    }

    /// Two neighbours in adjacent rows cross twice; one is above at one crossing and below at the other.
    #[test]
    fn rings_are_linked() {
        let (a, b) = (Vec2::ZERO, Vec2::new(0.5, ring::ROW));
        let across = (b - a).perp().normalize();
        let half = (ring::RADIUS.powi(2) - 0.25 * (b - a).length_squared()).sqrt();
        let gap = |p: Vec2| ring::LEAN * (p - a).x + ring::LEAN * (p - b).x;
        let crossings = [0.5 * (a + b) + half * across, 0.5 * (a + b) - half * across];
        let [first, second] = crossings.map(gap);
        assert!(first * second < 0.0);
        assert!(first.abs().min(second.abs()) > 2.0 * ring::WIRE);
    }
}
