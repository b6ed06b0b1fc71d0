//! A deep-buttoned leather bench: tufts and pleats on top, piping, stitches and nails around.
//!
//! One sheet of 62 x 32 quads = 3968 triangles is pulled over the bench: the inner 50 x 20 quads are its top, the six
//! rings of quads around them the rounded edge and the sides down to the floor, their corners fanned out.

mod upholstery;

use glam::{Vec2, Vec3};

use super::shape::{self, Rect};
use super::{Demo, DemoFiles, paint};
use crate::surface::MeshBuilder;
use upholstery::{Place, Upholstery};

/// The demo.
pub const DEMO: Demo = Demo {
    name: "leather",
    title: "a buttoned and stitched leather bench",
    triangles: 3968,
    map_size: 4096,
    make,
};

const QUADS: (usize, usize) = (62, 32);
/// Half width and depth of the level part of the top.
const TOP: Vec2 = Vec2::new(1.25, 0.5);

/// From the floor to the level part of the top, one entry per ring of quads: distance out from the top's
/// rectangle, and height above the floor.
const PROFILE: [Vec2; RINGS + 1] = [
    Vec2::new(0.170, 0.03),
    Vec2::new(0.180, 0.15),
    Vec2::new(0.184, 0.27),
    Vec2::new(0.176, 0.375),
    Vec2::new(0.142, 0.445),
    Vec2::new(0.080, 0.485),
    Vec2::new(0.0, 0.5),
];
const RINGS: usize = 6;

fn make(map_size: usize) -> DemoFiles {
    let (mesh, chart) = base_mesh(map_size);
    let upholstery = Upholstery::new(TOP);
    let look = |st: Vec2| {
        let position = chart.base_point(&mesh, st).position;
        upholstery.at(&place(chart.rect.local(st), position))
    };
    let heights = paint::heights(map_size, |st| look(st).height);
    let color_size = map_size / 2;
    let colors = paint::colors(color_size, |st| look(st).color);
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

fn base_mesh(map_size: usize) -> (MeshBuilder, shape::Chart) {
    let mut mesh = MeshBuilder::default();
    let rect = Rect::texel_centres(map_size);
    let chart = shape::add_grid(&mut mesh, QUADS, rect, |uv| {
        let i = (uv.x * QUADS.0 as f32).round() as usize;
        let j = (uv.y * QUADS.1 as f32).round() as usize;
        bench_vertex(i, j)
    });
    // At all four corners the diagonal runs from ring to ring; the other one would make level triangles.
    for k in 0..RINGS {
        chart.cut_falling(&mut mesh, QUADS.0 - 1 - k, k);
        chart.cut_falling(&mut mesh, k, QUADS.1 - 1 - k);
    }
    shape::smooth_normals(&mut mesh);
    (mesh, chart)
}

/// Grid vertex (i, j) on the bench; j runs from the front (+z) to the back.
fn bench_vertex(i: usize, j: usize) -> Vec3 {
    let (x, out_x) = along_side(i, QUADS.0, TOP.x);
    let (z, out_z) = along_side(j, QUADS.1, TOP.y);
    let rings_out = out_x.abs().max(out_z.abs());
    let profile = PROFILE[RINGS - rings_out.unsigned_abs() as usize];
    // At a corner both are out: the nearer to the diagonal, the nearer to 45 degrees.
    let toward = |out: i32, other: i32| {
        let angle =
            std::f32::consts::FRAC_PI_4 * out.min(other) as f32 / out.max(other).max(1) as f32;
        if out >= other {
            angle.cos()
        } else {
            angle.sin()
        }
    };
    let (ax, az) = (out_x.abs(), out_z.abs());
    let dx = toward(ax, az) * out_x.signum() as f32;
    let dz = toward(az, ax) * out_z.signum() as f32;
    Vec3::new(x + profile.x * dx, profile.y, -(z + profile.x * dz))
}

/// One coordinate of a vertex on the top's rectangle, and how many quads it is out beyond it, signed.
fn along_side(i: usize, quads: usize, half: f32) -> (f32, i32) {
    let inner = (quads - 2 * RINGS) as f32;
    let from_edge = i as f32 - RINGS as f32;
    let x = half * (2.0 * from_edge.clamp(0.0, inner) / inner - 1.0);
    let out = from_edge - from_edge.clamp(0.0, inner);
    (x, out as i32)
}

/// Where a point of the sheet is on the bench.
fn place(uv: Vec2, position: Vec3) -> Place {
    let quads = Vec2::new(QUADS.0 as f32, QUADS.1 as f32);
    let from_border = (uv * quads).min((Vec2::ONE - uv) * quads).min_element();
    let ring = from_border.clamp(0.0, RINGS as f32);
    let step = (ring as usize).min(RINGS - 1);
    let below: f32 = PROFILE[step..]
        .windows(2)
        .map(|w| w[0].distance(w[1]))
        .sum();
    let within = (ring - step as f32) * PROFILE[step].distance(PROFILE[step + 1]);
    let ground = Vec2::new(position.x, position.z);
    Place {
        ground,
        down: below - within,
        around: around(ground),
    }
}

/// Arc length around the bench, along the rounded rectangle of the side panels.
fn around(p: Vec2) -> f32 {
    let corner_radius = PROFILE[2].x;
    let quarter = std::f32::consts::FRAC_PI_2 * corner_radius;
    let out = p - p.clamp(-TOP, TOP);
    let (dx, dz) = (2.0 * TOP.x, 2.0 * TOP.y);
    // Starting at the front left, counter-clockwise seen from below: front, right, back, left.
    let turn = |a: f32, b: f32| corner_radius * b.atan2(a);
    match (out.x, out.y) {
        (x, z) if x == 0.0 && z >= 0.0 => p.x + TOP.x,
        (x, z) if x > 0.0 && z > 0.0 => dx + turn(z, x),
        (x, z) if x > 0.0 && z == 0.0 => dx + quarter + TOP.y - p.y,
        (x, z) if x > 0.0 => dx + quarter + dz + turn(x, -z),
        (0.0, _) => dx + 2.0 * quarter + dz + TOP.x - p.x,
        (_, z) if z < 0.0 => 2.0 * (dx + quarter) + dz + turn(-z, -out.x),
        (_, 0.0) => 2.0 * dx + 3.0 * quarter + dz + p.y + TOP.y,
        (x, z) => 2.0 * (dx + dz) + 3.0 * quarter + turn(-x, z),
    }
}

fn scene(scale: f32, midlevel: f32) -> String {
    format!(
        r#"# A leather bench of 3968 triangles.
[camera]
position = [1.7, 1.75, 3.1]
target = [0.0, 0.25, 0.0]
fov = 38.0

[film]
width = 640
height = 480
spp = 32

[[mesh]]
name = "leather"
file = "leather.obj"
material = "leather"

[mesh.displacement]
map = "leather_height.png"
scale = {scale}
midlevel = {midlevel}
wrap = "clamp"

[[mesh]]
name = "floor"
shape = "plane"
transform = {{ scale = 50 }}
material = "floor"

[[material]]
name = "leather"
base_color = {{ file = "leather_color.png", color_space = "srgb", wrap = "clamp" }}
roughness = 0.42
specular = 0.5

[[material]]
name = "floor"
base_color = [0.34, 0.31, 0.27]
roughness = 0.3

[[light]]
type = "sun"
elevation = 36.0
azimuth = 70.0

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

    #[test]
    fn arc_length_around_the_bench_grows_evenly() {
        let corner = PROFILE[2].x;
        let whole = 4.0 * (TOP.x + TOP.y) + std::f32::consts::TAU * corner;
        // Walk the outline in small steps; each adds its own length, but for the jump home.
        let outline = |turn: f32| {
            let d = Vec2::from_angle(turn);
            let mut t = 3.0;
            for _ in 0..60 {
                let p = t * d;
                t -= p.distance(p.clamp(-TOP, TOP)) - corner;
            }
            t * d
        };
        let mut total = 0.0;
        for k in 0..2000 {
            let angle = |k: usize| std::f32::consts::TAU * (k as f32 + 0.5) / 2000.0;
            let (p, q) = (outline(angle(k)), outline(angle(k + 1)));
            let step = (around(q) - around(p)).abs();
            if step < 0.5 * whole {
                assert!((step - p.distance(q)).abs() < 2e-3, "{p} {q} {step}");
                total += step;
            }
        }
        assert!((total - whole).abs() < 0.02 * whole);
    }
}
