//! The dragon: a long scaled body of bamboo-like segments that coils through the air, after a pearl.

mod atlas;
mod body;
mod head;
mod skin;

use glam::Vec3;

use super::cavity::Cavity;
use super::sweep::Sweep;
use super::{Demo, DemoFiles, paint};
use crate::surface::MeshBuilder;
use atlas::Trim;

/// The dragon.
pub const DEMO: Demo = Demo {
    name: "dragon",
    title: "a long scaled body of bamboo-like segments, coiling through space",
    triangles: 22_308,
    map_size: 4096,
    make,
};

const COLOR_SIZE: usize = 2048;
const PEARL_RADIUS: f32 = 0.17;

fn make(map_size: usize) -> DemoFiles {
    let heights = paint::heights(map_size, skin::height);
    let cavity = Cavity::new(&heights.texels, map_size, COLOR_SIZE, 0.003);
    let colors = paint::colors(COLOR_SIZE, |st| skin::color(st, &cavity));
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

fn mesh() -> MeshBuilder {
    let mut sweep = Sweep::default();
    let spine = body::Spine::new();
    body::add_body(&mut sweep, &spine);
    body::add_spines(&mut sweep, &spine);
    body::add_legs(&mut sweep, &spine);
    body::add_tuft(&mut sweep, &spine);
    let neck = spine.frame(1.0);
    let head = body::Frame::new(
        neck.origin,
        Vec3::new(-0.62, -0.12, 0.78),
        Vec3::new(-0.1, 1.0, 0.0),
    );
    head::add_head(&mut sweep, &head, 0.92);
    // The pearl takes the triangles that are left.
    let left = DEMO.triangles - sweep.triangles();
    let pearl = head.point(Vec3::new(0.22, -0.62, 1.0));
    body::add_ball(&mut sweep, pearl, PEARL_RADIUS, Vec3::Y, left, Trim::Pearl);
    sweep.finish()
}

fn scene(scale: f32, midlevel: f32) -> String {
    format!(
        r#"[camera]
position = [-1.5, 1.95, 8.0]
target = [0.08, 1.56, 0.0]
fov = 32.0

[film]
spp = 16
exposure = 0.4

[[mesh]]
file = "dragon.obj"
material = "scales"
transform = {{ translate = [0.0, 0.22, 0.0] }}

[mesh.displacement]
map = "dragon_height.png"
scale = {scale}
midlevel = {midlevel}

[[mesh]]
name = "floor"
shape = "plane"
transform = {{ scale = 50 }}
material = "floor"

[[material]]
name = "scales"
base_color = {{ file = "dragon_color.png" }}
roughness = 0.35
specular = 0.6

[[material]]
name = "floor"
base_color = [0.30, 0.26, 0.22]
roughness = 0.3

[[light]]
type = "sun"
elevation = 42.0
azimuth = 325.0

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
