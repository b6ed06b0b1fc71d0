//! Numbers that are too large, through the program: each is refused with its place, and alike on both backends.

mod program;

use prismarch::image::{ExrChannel, write_exr};
use program::{Folder, INPUT, QUAD, refused, with, with_scene};

/// Those that are built in.
const BACKENDS: &[&str] = if cfg!(feature = "embree") {
    &["embree", "bvh"]
} else {
    &["bvh"]
};

/// Whatever is beyond what backends take is refused before them, with its place, and alike.
#[test]
fn numbers_beyond_what_is_traced_are_refused() {
    let mesh = "file = \"quad.obj\"";
    let scenes: [(&str, &str, &[&str]); 14] = [
        (
            "[film]",
            "[camera]\nposition = [0, 0, 1e19]\n[film]",
            &["scene.toml:2:12", "camera.position", "within +-1.8e18"],
        ),
        (
            "[film]",
            "[camera]\ntarget = [0, -2e30, 0]\n[film]",
            &["scene.toml:2:10", "camera.target", "within +-1.8e18"],
        ),
        (
            "[film]",
            "[camera]\ntype = \"orthographic\"\nheight = 1e30\n[film]",
            &["camera.height", "up to 1.8e18"],
        ),
        (
            "[film]",
            "[camera]\naperture = 1e30\n[film]",
            &["camera.aperture", "up to 1.8e18"],
        ),
        (
            "[film]",
            "[[light]]\ntype = \"point\"\nposition = [1e19, 0, 0]\n[film]",
            &["light[0].position", "within +-1.8e18"],
        ),
        (
            "[film]",
            "[[light]]\ntype = \"sphere\"\nposition = [1, 0, 0]\nradius = 1e20\n[film]",
            &["light[0].radius", "up to 1.8e18"],
        ),
        (
            mesh,
            "file = \"quad.obj\"\ntransform = { translate = [0, 1e19, 0] }",
            &["translate", "within +-1.8e18"],
        ),
        (
            mesh,
            "file = \"quad.obj\"\ninstances = [{ translate = [0, 1e19, 0] }]",
            &["translate", "within +-1.8e18"],
        ),
        (
            mesh,
            "file = \"quad.obj\"\ninstances = [{ scale = 1e30 }]",
            &["scale", "1e-9 to 1e9"],
        ),
        (
            mesh,
            "file = \"quad.obj\"\ntransform = { scale = [0, 1, 1] }",
            &["scale", "none of them 0"],
        ),
        (
            "scale = 0.2",
            "scale = 1e30",
            &[
                "scene.toml:10:7",
                "flat.png",
                "texel (0, 0)",
                "scale 1e30",
                "within +-1.8e18",
            ],
        ),
        (
            "scale = 0.2",
            "scale = 1\nmidlevel = 1e38",
            &["flat.png", "texel (0, 0)", "midlevel 1e38"],
        ),
        (
            "scale = 0.2",
            "scale = 1\nuv = { scale = [1e30, 1] }",
            &["quad", "triangle 0", "texels"],
        ),
        (
            mesh,
            "file = \"quad.obj\"\ninstances = [{ scale = 1e-9, translate = [1e10, 0, 0] }]",
            &["quad: instance 0", "expected"],
        ),
    ];
    for (from, to, words) in scenes {
        for backend in BACKENDS {
            let folder = with_scene(from, to);
            refused(
                &folder,
                &["render", "scene.toml", "--backend", backend],
                INPUT,
                words,
            );
        }
    }
    // Within the limit each, but not in the space of the instance; there the camera's place is told, and the ray's.
    let small = "file = \"quad.obj\"\ninstances = [{ scale = 1e-3 }]";
    let folder = with_scene(mesh, small);
    folder.put("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,1e17,0,0,-1\n");
    let query = [
        "query",
        "scene.toml",
        "--rays",
        "rays.csv",
        "-o",
        "hits.csv",
    ];
    refused(
        &folder,
        &query,
        INPUT,
        &[
            "rays.csv:2",
            "oz: found 1e17",
            "expected a number within +-1",
        ],
    );
    folder.put(
        "scene.toml",
        format!(
            "[camera]\nposition = [0, 0, 1e17]\n{}",
            folder.text("scene.toml")
        ),
    );
    refused(
        &folder,
        &["render", "scene.toml"],
        INPUT,
        &["scene.toml", "the camera is at", "within +-1"],
    );

    let far = QUAD.replace("v -1 -1 0", "v -1e30 -1 0");
    let words = ["quad.obj", "quad", "vertex 0", "-1e30", "within +-1.8e18"];
    refused(
        &with("quad.obj", far),
        &["render", "scene.toml"],
        INPUT,
        &words,
    );
}

/// Heights that are numbers, and too large to be displaced by.
#[test]
fn heights_beyond_what_is_traced_name_file_and_texel() {
    let folder = Folder::with_quad();
    let mut heights = [0.5; 64];
    heights[8 * 2 + 3] = -9e17;
    let channel = ExrChannel::floats("Y", heights.to_vec());
    write_exr(&folder.path("deep.exr"), 8, 8, vec![channel], &[]).unwrap();
    folder.put("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,2,0,0,-1\n");
    let query = [
        "query", "--mesh", "quad.obj", "--map", "deep.exr", "--scale", "10", "--rays", "rays.csv",
    ];
    let words = ["deep.exr: texel (3, 2)", "-9e17", "within +-1.8e18"];
    refused(&folder, &query, INPUT, &words);
}
