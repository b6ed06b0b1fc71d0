//! The stump again, as the paper shows displaced surfaces to secondary rays: seen through a ball of glass that is
//! displaced itself, and mirrored in a wet floor.

use glam::{Vec2, Vec3};

use super::noise::{Octaves, fbm2, gradient3, smoothstep};
use super::orb;
use super::paint;
use super::shape::{self, Rect};
use super::stump;
use super::{Demo, DemoFiles, Part};
use crate::surface::MeshBuilder;

/// The stump behind a ball of glass.
pub const GLASS: Demo = Demo {
    name: "glass",
    title: "the stump behind a displaced ball of glass",
    triangles: 7710 + 3968,
    map_size: 4096,
    make: behind_glass,
};

/// The stump on a wet floor.
pub const WET: Demo = Demo {
    name: "wet",
    title: "the stump on displaced ground, mirrored in puddles",
    triangles: 7710 + 2 * GROUND_QUADS * GROUND_QUADS,
    map_size: 4096,
    make: on_wet_ground,
};

/// How both are rendered.
const FILM: &str = r#"[integrator]
type = "path"

[film]
spp = 64
clamp = 8.0
exposure = 0.6

"#;

fn behind_glass(map_size: usize) -> DemoFiles {
    let map_size_of_ball = map_size / 4;
    let ball = paint::heights(map_size_of_ball, swell);
    let (scale, midlevel) = (ball.scale(), ball.midlevel());
    let stage = format!(
        r#"[camera]
position = [0.5, 1.0, 5.8]
target = [0.15, 0.5, 0.0]
fov = 26.0

{FILM}[[mesh]]
name = "floor"
shape = "plane"
transform = {{ scale = 50 }}
material = "earth"

[[mesh]]
file = "ball.obj"
material = "glass"
transform = {{ scale = {BALL_RADIUS}, translate = [0.45, 0.43, 2.5] }}

[mesh.displacement]
map = "ball_height.png"
scale = {scale}
midlevel = {midlevel}

[[material]]
name = "earth"
base_color = [0.17, 0.15, 0.10]
roughness = 0.7
specular = 0.2

[[material]]
name = "glass"
base_color = [1.0, 1.0, 1.0]
roughness = 0.0
transmission = 1.0
attenuation_color = [0.80, 0.95, 0.88]
attenuation_distance = 1.0
"#
    );
    let part = Part {
        name: "ball",
        mesh: orb::mesh(),
        heights: ball.texels,
        map_size: map_size_of_ball,
    };
    DemoFiles {
        parts: vec![part],
        ..stump::on_stage(GLASS.name, &stage, map_size)
    }
}

const BALL_RADIUS: f32 = 0.42;

/// World units by which the ball of glass swells: a twist of shallow lobes that run out at the poles.
fn swell(st: Vec2) -> f32 {
    let p = orb::direction(st);
    let free = smoothstep(0.995, 0.6, p.y.abs());
    let lobes = (std::f32::consts::TAU * (9.0 * st.x + 1.5 * st.y)).cos();
    free * (0.004 * lobes + 0.0025 * gradient3(71, 3.0 * p))
}

/// Half the side of the ground, around the origin.
const GROUND: f32 = 14.0;
const GROUND_QUADS: usize = 16;
/// Height of the water in the puddles.
const WATER: f32 = 0.0;

fn on_wet_ground(map_size: usize) -> DemoFiles {
    let ground = paint::heights(map_size, |st| mud(GROUND * (2.0 * st - 1.0)));
    let (scale, midlevel) = (ground.scale(), ground.midlevel());
    let stage = format!(
        r#"[camera]
position = [0.7, 0.85, 5.2]
target = [0.0, 0.36, 0.0]
fov = 27.0

{FILM}[[mesh]]
file = "ground.obj"
material = "wet earth"

[mesh.displacement]
map = "ground_height.png"
scale = {scale}
midlevel = {midlevel}

[[material]]
name = "wet earth"
base_color = [0.05, 0.04, 0.028]
roughness = 0.6
coat = 1.0
coat_roughness = 0.02
"#
    );
    let part = Part {
        name: "ground",
        mesh: ground_mesh(map_size),
        heights: ground.texels,
        map_size,
    };
    DemoFiles {
        parts: vec![part],
        ..stump::on_stage(WET.name, &stage, map_size)
    }
}

fn ground_mesh(map_size: usize) -> MeshBuilder {
    let mut mesh = MeshBuilder::default();
    let rect = Rect::texel_centres(map_size);
    shape::add_grid(&mut mesh, (GROUND_QUADS, GROUND_QUADS), rect, |uv| {
        let at = GROUND * (2.0 * uv - 1.0);
        Vec3::new(at.x, 0.0, -at.y)
    });
    shape::smooth_normals(&mut mesh);
    mesh
}

/// Height of the ground: low waves of mud, under water where it is low.
fn mud(at: Vec2) -> f32 {
    let hollows = 0.05 * fbm2(72, 0.8 * at, Octaves::new(3));
    let clods = 0.012 * fbm2(73, 7.0 * at, Octaves::new(4));
    let dry = smoothstep(-0.02, 0.03, hollows);
    (hollows + dry * clods).max(WATER)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::laws;

    #[test]
    fn glass_obeys_the_laws_of_demos() {
        laws::check(&GLASS, 1024);
    }

    #[test]
    fn wet_ground_obeys_the_laws_of_demos() {
        laws::check(&WET, 1024);
    }
}
