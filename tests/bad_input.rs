//! Bad input ends in one clear error, the right exit code, and nothing half-written.

mod program;

use prismarch::image::{ExrChannel, write_exr, write_png_gray16};
use program::{Folder, INPUT, OUTPUT, QUAD, USAGE, refused, stderr, with, with_scene};

/// Renders `scene.toml`.
const RENDER: &[&str] = &["render", "scene.toml"];

#[test]
fn missing_files_are_named() {
    refused(
        &Folder::empty(),
        RENDER,
        INPUT,
        &["scene.toml", "No such file"],
    );
    for file in ["quad.obj", "flat.png"] {
        let folder = Folder::with_quad();
        std::fs::remove_file(folder.path(file)).unwrap();
        refused(
            &folder,
            RENDER,
            INPUT,
            &["scene.toml:", file, "No such file"],
        );
    }
    let query = [
        "query",
        "scene.toml",
        "--rays",
        "rays.csv",
        "-o",
        "hits.csv",
    ];
    refused(
        &Folder::with_quad(),
        &query,
        INPUT,
        &["rays.csv", "No such file"],
    );
}

#[test]
fn empty_files_are_refused() {
    refused(
        &with("scene.toml", ""),
        RENDER,
        INPUT,
        &["scene.toml:1:1", "[[mesh]]"],
    );
    refused(&with("quad.obj", ""), RENDER, INPUT, &["quad.obj", "empty"]);
    refused(&with("flat.png", ""), RENDER, INPUT, &["flat.png", "empty"]);
}

#[test]
fn truncated_files_are_refused() {
    let folder = Folder::with_quad();
    let noise: Vec<u16> = (0..64 * 64)
        .map(|i: u32| (i.wrapping_mul(40_503) >> 3) as u16)
        .collect();
    write_png_gray16(&folder.path("flat.png"), 64, 64, &noise).unwrap();
    let whole = std::fs::read(folder.path("flat.png")).unwrap();
    folder.put("flat.png", &whole[..whole.len() / 2]);
    refused(&folder, RENDER, INPUT, &["flat.png", "PNG"]);

    let folder = with_scene("flat.png", "flat.exr");
    let heights: Vec<f32> = noise.iter().map(|&h| f32::from(h)).collect();
    exr(&folder, &heights);
    let whole = std::fs::read(folder.path("flat.exr")).unwrap();
    folder.put("flat.exr", &whole[..whole.len() / 2]);
    refused(&folder, RENDER, INPUT, &["flat.exr", "EXR"]);

    let cut = QUAD.len() - " 4/4/1\n".len();
    refused(
        &with("quad.obj", &QUAD[..cut]),
        RENDER,
        INPUT,
        &["quad.obj", "line"],
    );
}

/// Writes `flat.exr` of one channel and 64 columns.
fn exr(folder: &Folder, heights: &[f32]) {
    let channel = ExrChannel::floats("Y", heights.to_vec());
    write_exr(
        &folder.path("flat.exr"),
        64,
        heights.len() / 64,
        vec![channel],
        &[],
    )
    .unwrap();
}

#[test]
fn a_map_without_pixels_is_refused() {
    let folder = Folder::with_quad();
    let mut png = std::fs::read(folder.path("flat.png")).unwrap();
    png[16..24].fill(0); // width and height of the header
    folder.put("flat.png", png);
    refused(&folder, RENDER, INPUT, &["flat.png"]);
}

#[test]
fn numbers_that_are_none_are_refused() {
    for bad in ["nan", "inf"] {
        let quad = QUAD.replace("v 1 1 0", &format!("v 1 {bad} 0"));
        refused(&with("quad.obj", quad), RENDER, INPUT, &["quad.obj"]);
    }
    for bad in [f32::NAN, f32::INFINITY] {
        let folder = with_scene("flat.png", "flat.exr");
        let mut heights = vec![0.5; 64 * 4];
        heights[65] = bad;
        exr(&folder, &heights);
        refused(&folder, RENDER, INPUT, &["flat.exr", "(1, 1)", "finite"]);
    }
}

#[test]
fn meshes_that_cannot_be_displaced_are_refused() {
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    refused(
        &with("quad.obj", plain),
        RENDER,
        INPUT,
        &["quad", "texture coordinates", "unwrap"],
    );
    let beyond = QUAD.replace("4/4/1", "5/4/1");
    refused(
        &with("quad.obj", beyond),
        RENDER,
        INPUT,
        &["quad.obj", "5", "out of range"],
    );
    refused(
        &with("quad.obj", "v 0 0 0\n"),
        RENDER,
        INPUT,
        &["quad.obj", "no faces"],
    );
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    refused(
        &with("quad.obj", flat),
        RENDER,
        INPUT,
        &["quad.obj", "area"],
    );
    refused(
        &with_scene("quad.obj", "quad.stl"),
        RENDER,
        INPUT,
        &["stl", ".obj"],
    );
}

#[test]
fn a_scale_must_be_a_number_and_not_zero() {
    for bad in ["nan", "0", "0.0", "inf", "\"big\""] {
        let folder = with_scene("scale = 0.2", &format!("scale = {bad}"));
        let words = [
            "scene.toml:11:9",
            "mesh[0].displacement.scale",
            "found",
            "expected",
        ];
        refused(&folder, RENDER, INPUT, &words);
    }
    for bad in ["nan", "0", "inf", "big"] {
        let folder = Folder::with_quad();
        folder.put("rays.csv", "ox,oy,oz,dx,dy,dz\n");
        let query = [
            "query", "--mesh", "quad.obj", "--map", "flat.png", "--scale", bad, "--rays",
            "rays.csv",
        ];
        refused(&folder, &query, USAGE, &["--scale", bad, "other than 0"]);
    }
}

#[test]
fn scene_files_are_held_to_their_keys() {
    let cases = [
        (
            "width = 16",
            "widht = 16",
            ["scene.toml:2:1", "film.widht", "\"width\""],
        ),
        (
            "width = 16",
            "width = 100000000",
            ["scene.toml:2:9", "film.width", "65536"],
        ),
        (
            "width = 16",
            "width = 0",
            ["scene.toml:2:9", "film.width", "1 to 65536"],
        ),
        (
            "width = 16",
            "width = 16.5",
            ["film.width", "found 16.5", "whole number"],
        ),
        (
            "width = 16\nheight = 12",
            "width = 65536\nheight = 65536",
            ["film.height", "pixels", "at most"],
        ),
        (
            "spp = 1",
            "spp = 0",
            ["scene.toml:4:7", "film.spp", "found 0"],
        ),
        ("spp = 1", "spp = ", ["scene.toml:4:", "spp =", "^"]),
        (
            "[film]",
            "[camera]\nfov = 180\n[film]",
            ["camera.fov", "found 180", "degrees"],
        ),
        (
            "scale = 0.2",
            "scale = 0.2\ndt = 1\ndt_world = 1",
            ["dt_world", "dt and dt_world", "only one"],
        ),
        (
            "scale = 0.2",
            "scale = 0.2\nmarch = \"exact\"\ndt = 1",
            ["displacement.dt", "march = \"exact\"", "no step"],
        ),
        (
            "scale = 0.2",
            "scale = 0.2\njitter = true\nmarch = \"exact\"",
            ["displacement.jitter", "march = \"exact\"", "no step"],
        ),
        (
            "scale = 0.2",
            "scale = 0.2\nmarch = \"best\"",
            ["displacement.march", "\"best\"", "\"uniform\""],
        ),
        (
            "scale = 0.2",
            "scale = 0.2\nedit_bounds = \"loose\"",
            ["edit_bounds", "\"loose\"", "\"range\""],
        ),
        (
            "scale = 0.2",
            "midlevel = 0.2",
            ["mesh[0].displacement", "no scale", "scale ="],
        ),
        (
            "map = \"flat.png\"",
            "",
            ["mesh[0].displacement", "no map", "map ="],
        ),
        (
            "file = \"quad.obj\"",
            "",
            ["mesh[0].file", "nothing", "mesh file"],
        ),
        (
            "file =",
            "material = \"gold\"\nfile =",
            ["mesh[0].material", "\"gold\"", "has none"],
        ),
        (
            "file =",
            "transform = { scale = 0 }\nfile =",
            ["mesh[0].transform.scale", "found 0", "none of them 0"],
        ),
        (
            "file =",
            "instances = []\nfile =",
            ["mesh[0].instances", "empty", "at least one"],
        ),
        (
            "[film]",
            "[[light]]\ntype = \"lamp\"\n[film]",
            ["light[0].type", "\"lamp\"", "\"sun\""],
        ),
        (
            "[film]",
            "[[light]]\ntype = \"sun\"\nturbidity = 3\n[film]",
            ["light[0].turbidity", "unknown", "azimuth"],
        ),
    ];
    for (from, to, words) in cases {
        refused(&with_scene(from, to), RENDER, INPUT, &words);
    }
}

#[test]
fn sizes_on_the_command_line_are_limited() {
    for size in ["100000000x10", "10x100000000", "0x10", "65536x65536", "640"] {
        let folder = Folder::with_quad();
        refused(
            &folder,
            &["render", "scene.toml", "--size", size],
            USAGE,
            &["--size", size],
        );
    }
    let folder = Folder::with_quad();
    for option in ["--spp", "--threads"] {
        refused(
            &folder,
            &["render", "scene.toml", option, "0"],
            USAGE,
            &[option, "0"],
        );
    }
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_work() {
    // The scene is missing, too: that the output is named shows what was looked at first.
    let folder = Folder::empty();
    let render = |output| ["render", "scene.toml", "-o", output];
    refused(
        &folder,
        &render("no/such/a.png"),
        OUTPUT,
        &["no/such", "no folder"],
    );
    refused(&folder, &render("a.jpg"), USAGE, &["a.jpg", ".png or .exr"]);
    let query = [
        "query",
        "scene.toml",
        "--rays",
        "rays.csv",
        "-o",
        "no/such/hits.csv",
    ];
    refused(&folder, &query, OUTPUT, &["no/such", "no folder"]);
    let stats = ["render", "scene.toml", "--stats", "no/such/stats.json"];
    refused(&folder, &stats, OUTPUT, &["no/such", "no folder"]);
    #[cfg(target_os = "linux")] // where nobody can make a file, not even root
    refused(
        &folder,
        &render("/sys/a.png"),
        OUTPUT,
        &["/sys", "not writable"],
    );
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_nothing_behind() {
    let folder = Folder::with_quad();
    folder.put(
        "rays.csv",
        format!("ox,oy,oz,dx,dy,dz\n{}", "0,0,2,0,0,-1\n".repeat(100)),
    );
    let before = folder.names();
    let jobs: [&[&str]; 3] = [
        &["render", "scene.toml", "-o", "a.exr"],
        &[
            "render",
            "scene.toml",
            "-o",
            "a.exr",
            "--stats",
            "a.json",
            "--size",
            "1x1",
        ],
        &[
            "query",
            "scene.toml",
            "--rays",
            "rays.csv",
            "-o",
            "hits.csv",
        ],
    ];
    for arguments in jobs {
        let output = folder.run_on_full_disk(arguments);
        let message = stderr(&output);
        assert_eq!(
            output.status.code(),
            Some(OUTPUT),
            "{arguments:?}: {message}"
        );
        assert!(
            message.contains("prismarch: error: cannot write"),
            "{message}"
        );
        let left: Vec<_> = folder
            .names()
            .into_iter()
            .filter(|n| !before.contains(n))
            .collect();
        // A picture that was complete may stand; half a file may not.
        assert!(
            left.iter().all(|name| name == "a.exr") && left.len() <= 1,
            "{left:?}"
        );
        let _ = std::fs::remove_file(folder.path("a.exr"));
    }
}

#[test]
fn rays_are_held_to_their_columns() {
    let cases = [
        ("0,0,2,0,0,0", ["rays.csv:3", "dx,dy,dz", "not zero"]),
        ("0,0,2,0,nan,-1", ["rays.csv:3", "dy: found nan", "finite"]),
        ("0,0,2,0,0,inf", ["rays.csv:3", "dz: found inf", "finite"]),
        ("0,0,two,0,0,-1", ["rays.csv:3", "oz: found two", "finite"]),
        ("0,0,2,0,0", ["rays.csv:3", "5 fields", "6"]),
        (
            "0,0,1.9e18,0,0,-1",
            ["rays.csv:3", "oz: found 1.9e18", "within +-1.8e18"],
        ),
        (
            "0,0,2,0,-1e30,-1",
            ["rays.csv:3", "dy: found -1e30", "within +-1.8e18"],
        ),
    ];
    let query = [
        "query",
        "scene.toml",
        "--rays",
        "rays.csv",
        "-o",
        "hits.csv",
    ];
    for (row, words) in cases {
        let table = format!("ox,oy,oz,dx,dy,dz\n0,0,2,0,0,-1\n{row}\n");
        let folder = with("rays.csv", table);
        refused(&folder, &query, INPUT, &words);
    }
    let folder = with("rays.csv", "ox,oy,oz,dx,dy\n0,0,2,0,0\n");
    refused(
        &folder,
        &query,
        INPUT,
        &["rays.csv:1", "no column dz", "ox,oy,oz"],
    );
}
