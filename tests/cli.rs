//! The program as its users meet it: help, the round trip of a query, reports, pictures.

mod program;

use prismarch::image::write_png_gray16;
use program::{FLAT, Folder, SCENE, stderr, stdout};

/// Runs the program, which must succeed, and gives its standard output.
#[track_caller]
fn done(folder: &Folder, arguments: &[&str]) -> String {
    let output = folder.run(arguments);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        stderr(&output)
    );
    stdout(&output)
}

/// The numbers of each row of a table of hits.
fn rows(table: &str) -> Vec<Vec<f64>> {
    let number = |field: &str| field.parse().unwrap();
    let row = |line: &str| line.split(',').map(number).collect();
    table.lines().skip(1).map(row).collect()
}

fn near(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len()
        && found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-6)
}

const BACKENDS: &[&str] = &[
    #[cfg(feature = "embree")]
    "embree",
    #[cfg(feature = "bvh")]
    "bvh",
];

#[test]
fn help_names_verbs_options_and_examples() {
    let folder = Folder::empty();
    let help = done(&folder, &["--help"]);
    for word in [
        "render",
        "query",
        "info",
        "demo",
        "Examples:",
        "Exit codes:",
    ] {
        assert!(help.contains(word), "{word}");
    }
    let options: [(&str, &[&str]); 4] = [
        (
            "render",
            &[
                "--output",
                "--size",
                "--spp",
                "--threads",
                "--seed",
                "--backend",
                "--stats",
                "--quiet",
                "--march",
                "--dt",
                "--dt-world",
                "--lod",
                "--spread",
            ],
        ),
        (
            "query",
            &[
                "--mesh",
                "--map",
                "--scale",
                "--channel",
                "--midlevel",
                "--wrap",
                "--march",
                "--dt",
                "--dt-world",
                "--jitter",
                "--lod",
                "--spread",
                "--rays",
                "--output",
            ],
        ),
        ("info", &["--json"]),
        ("demo", &["--out", "--list", "--no-render"]),
    ];
    for (verb, options) in options {
        let help = done(&folder, &[verb, "--help"]);
        assert!(help.contains("Examples:"), "{verb}");
        for option in options {
            assert!(help.contains(option), "{verb} {option}");
        }
    }
    let version = done(&folder, &["--version"]);
    assert_eq!(
        version.trim(),
        concat!("prismarch ", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn unknown_words_are_usage_errors() {
    for arguments in [
        &["rendre"][..],
        &["render"],
        &["render", "a.toml", "--fast"],
        &["query"],
        &[],
    ] {
        let output = Folder::empty().run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
    let output = Folder::empty().run(&["demo", "teapot"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("teapot") && stderr(&output).contains("asteroid"));
}

#[test]
fn a_lifted_plane_is_hit_where_it_is() {
    let rays = "\
ox,oy,oz,dx,dy,dz,tnear,tfar
0.3,0.2,2,0,0,-1,0,inf
0.3,0.2,2,0,0,-4,0,
5,5,2,0,0,-1,0,inf
0.3,0.2,2,0,0,-1,0,1.5
-0.5,0.25,-1,0,0,0.5,0,inf
";
    let plane = |t: f64, x: f64, y: f64| vec![t, x, y, FLAT, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, FLAT];
    let expected = [
        Some(plane(2.0 - FLAT, 0.3, 0.2)),
        Some(plane((2.0 - FLAT) / 4.0, 0.3, 0.2)),
        None,
        None,
        Some(plane((1.0 + FLAT) / 0.5, -0.5, 0.25)),
    ];
    let surface = ["--mesh", "quad.obj", "--map", "flat.png", "--scale", "0.2"];
    let table = ["--rays", "rays.csv", "-o", "hits.csv"];
    for backend in BACKENDS {
        for source in [&surface[..], &["scene.toml"]] {
            let folder = Folder::with_quad();
            folder.put("rays.csv", rays);
            let query = [&["query", "--backend", *backend], source, &table].concat();
            assert_eq!(done(&folder, &query), "");
            let hits = folder.text("hits.csv");
            let header = "hit,t,mesh,prim,u,v,px,py,pz,ngx,ngy,ngz,nsx,nsy,nsz,displacement";
            assert_eq!(hits.lines().next(), Some(header));
            let hits = rows(&hits);
            assert_eq!(hits.len(), expected.len());
            for (hit, expected) in hits.iter().zip(&expected) {
                let Some(expected) = expected else {
                    assert_eq!(hit, &[0.0; 16]);
                    continue;
                };
                assert_eq!(hit[0], 1.0);
                let numbers = [&hit[1..2], &hit[6..]].concat();
                assert!(near(&numbers, expected), "{hit:?} {expected:?}");
            }
        }
    }
}

/// A TIFF of signed 16-bit heights, 2x1, that declares -9999 to mean no data.
fn elevations(heights: [i16; 2]) -> Vec<u8> {
    let text = b"-9999\0";
    let entries: [(u16, u16, u32, u32); 9] = [
        (256, 3, 1, 2),
        (257, 3, 1, 1),
        (258, 3, 1, 16),
        (262, 3, 1, 1),
        (273, 4, 1, 8),
        (277, 3, 1, 1),
        (279, 4, 1, 4),
        (339, 3, 1, 2),
        (42113, 2, text.len() as u32, 12),
    ];
    let mut file = b"II*\0\x12\0\0\0".to_vec();
    file.extend(heights.map(i16::to_le_bytes).concat());
    file.extend(text);
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        file.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        file.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
    }
    file.extend([0; 4]);
    file
}

#[test]
fn elevations_are_metres_and_gaps_in_them_are_filled_or_named() {
    let folder = Folder::with_quad();
    folder.put("dem.tif", elevations([1200, -9999]));
    let scene = SCENE.replace("flat.png", "dem.tif").replace("0.2", "0.001");
    folder.put("gaps.toml", &scene);
    folder.put("filled.toml", format!("{scene}nodata = -300\n"));
    folder.put(
        "rays.csv",
        "ox,oy,oz,dx,dy,dz\n-0.5,0,5,0,0,-1\n0.5,0,5,0,0,-1\n",
    );
    let surface = [
        "query", "--mesh", "quad.obj", "--map", "dem.tif", "--scale", "0.001",
    ];
    let table = ["--rays", "rays.csv"];
    let fill = ["--nodata", "-300"];
    for gaps in [&surface[..], &["query", "gaps.toml"]] {
        let output = folder.run(&[gaps, &table].concat());
        assert_eq!(output.status.code(), Some(3));
        let message = stderr(&output);
        let words = ["dem.tif", "texel (1, 0)", "-9999", "nodata"];
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
    for filled in [
        &[&surface[..], &fill].concat(),
        &["query", "filled.toml"][..],
    ] {
        let output = folder.run(&[filled, &table].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let hits = rows(&String::from_utf8(output.stdout).unwrap());
        assert!(near(&[hits[0][8], hits[1][8]], &[1.2, -0.3]), "{hits:?}");
    }
}

#[test]
fn instances_are_hit_in_world_space() {
    let folder = Folder::with_quad();
    // Turned by a quarter about y, +z becomes +x; doubled, so is the displacement.
    let instances = "instances = [ { translate = [10, 0, 0] }, { translate = [0, 0, 9], rotate = [0, 90, 0], scale = 2 } ]\nfile =";
    folder.put("scene.toml", SCENE.replace("file =", instances));
    let rays = "ox,oy,oz,dx,dy,dz\n10,0.5,3,0,0,-1\n4,0.5,9.5,-1,0,0\n0,0.5,3,0,0,-1\n";
    for backend in BACKENDS {
        let query = ["query", "scene.toml", "--backend", backend, "--rays", "-"];
        let output = folder.run_with_input(&query, rays);
        assert!(output.status.success(), "{}", stderr(&output));
        let hits = rows(&stdout(&output));
        let place = |hit: &[f64]| [&hit[1..2], &hit[6..12]].concat();
        assert!(
            near(
                &place(&hits[0]),
                &[3.0 - FLAT, 10.0, 0.5, FLAT, 0.0, 0.0, 1.0]
            ),
            "{hits:?}"
        );
        let turned = 2.0 * FLAT;
        assert!(
            near(
                &place(&hits[1]),
                &[4.0 - turned, turned, 0.5, 9.5, 1.0, 0.0, 0.0]
            ),
            "{hits:?}"
        );
        assert_eq!(hits[2], [0.0; 16]);
    }
}

#[test]
fn rows_keep_their_order_over_many_chunks() {
    let folder = Folder::with_quad();
    let count = 150_000;
    let x = |i: usize| -0.9 + 1.8 * i as f64 / count as f64;
    let rays: String = (0..count)
        .map(|i| format!("{},0.1,2,0,0,-1\n", x(i)))
        .collect();
    folder.put("rays.csv", format!("ox,oy,oz,dx,dy,dz\n{rays}"));
    done(
        &folder,
        &[
            "query",
            "scene.toml",
            "--rays",
            "rays.csv",
            "-o",
            "hits.csv",
        ],
    );
    let hits = rows(&folder.text("hits.csv"));
    assert_eq!(hits.len(), count);
    for (i, hit) in hits.iter().enumerate() {
        assert!((hit[6] - x(i)).abs() < 1e-5, "row {i}: {hit:?}");
    }
}

#[test]
fn the_same_seed_jitters_the_same_way() {
    let folder = Folder::with_quad();
    let query = |seed| {
        [
            "query",
            "scene.toml",
            "--jitter",
            seed,
            "--dt",
            "2",
            "--rays",
            "-",
        ]
    };
    let rays = "ox,oy,oz,dx,dy,dz\n0.1,0.1,2,0.1,0,-1\n";
    let run = |seed| stdout(&folder.run_with_input(&query(seed), rays));
    assert_eq!(run("7"), run("7"));
    assert!(run("8").lines().count() == 2);
}

/// What the marches of a scene are, as `info` has it.
fn march_of(folder: &Folder, keys: &str) -> (serde_json::Value, serde_json::Value) {
    folder.put(
        "scene.toml",
        SCENE.replace("scale = 0.2", &format!("scale = 0.2\n{keys}")),
    );
    let info = done(folder, &["info", "scene.toml", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&info).unwrap();
    let object = &info["objects"][0];
    (object["march"].clone(), object["edit_bounds"].clone())
}

#[test]
fn info_names_march_and_bounds() {
    let folder = Folder::with_quad();
    let of = |keys| march_of(&folder, keys);
    assert_eq!(of(""), ("exact".into(), "tight".into()));
    let uniform = "uniform, dt 1 texels";
    assert_eq!(of("march = \"uniform\"").0, uniform);
    assert_eq!(
        of("dt_world = 0.5\njitter = true").0,
        "uniform, dt 0.5 world units, jitter"
    );
    assert_eq!(of("edit_bounds = \"range\"").1, "range");
    let text = done(&folder, &["info", "scene.toml"]);
    assert!(text.contains("march exact; edit bounds range"), "{text}");
}

#[test]
fn info_tells_what_a_subdivided_mesh_becomes() {
    let folder = Folder::with_quad();
    let keys = "subdivide = 3\nsubdivision = \"catmull-clark\"\n[mesh.displacement]";
    folder.put("scene.toml", SCENE.replace("[mesh.displacement]", keys));
    let text = done(&folder, &["info", "scene.toml"]);
    assert!(
        text.contains("Catmull-Clark, 3 levels of 2 faces"),
        "{text}"
    );
    let info = done(&folder, &["info", "scene.toml", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&info).unwrap();
    let object = &info["objects"][0];
    assert_eq!(object["triangles"], 192);
    assert_eq!(object["subdivision"]["levels"], 3);
    done(&folder, &["render", "scene.toml", "-o", "picture.png"]);
}

#[test]
fn the_command_line_wins_over_the_scenes_march() {
    let folder = Folder::with_quad();
    let noise = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 16) as u16;
    let heights: Vec<u16> = (0..64 * 64).map(noise).collect();
    write_png_gray16(&folder.path("flat.png"), 64, 64, &heights).unwrap();
    let _ = march_of(&folder, "dt = 1000000");
    let picture = |options: &[&str]| {
        let mut args = vec!["render", "scene.toml", "-o", "a.exr", "--quiet"];
        args.extend(options);
        done(&folder, &args);
        // Not the file's bytes: its attributes come in any order.
        let picture = prismarch::image::read_exr(&folder.path("a.exr")).unwrap();
        picture.channels
    };
    // Steps that long see nothing of the surface but where they start.
    let steps = picture(&[]);
    let exact = picture(&["--march", "exact"]);
    assert_ne!(steps, exact);
    assert_eq!(picture(&["--march", "uniform"]), steps);
    assert_ne!(picture(&["--dt", "0.25"]), steps);
    // Level of detail: off is exact, and needs the exact march.
    let exact = ["--march", "exact"];
    let lod = |options: &[&str]| picture(&[&exact, options].concat());
    assert_eq!(lod(&["--lod", "off"]), picture(&exact));
    assert_eq!(lod(&["--lod", "cone", "--spread", "0"]), picture(&exact));
    assert_ne!(lod(&["--lod", "cone"]), picture(&exact));
    let refused = folder.run(&["render", "scene.toml", "--lod", "cone", "-o", "a.exr"]);
    assert!(
        stderr(&refused).contains("level of detail"),
        "{}",
        stderr(&refused)
    );
}

#[test]
fn level_of_detail_of_a_scene_needs_the_exact_march() {
    let folder = Folder::with_quad();
    let picture = |keys: &str| {
        folder.put(
            "scene.toml",
            SCENE.replace("scale = 0.2", &format!("scale = 0.2\n{keys}")),
        );
        folder.run(&["render", "scene.toml", "-o", "a.png", "--quiet"])
    };
    for keys in ["lod = \"cone\"", "lod = \"off\"\ndt = 1"] {
        assert!(picture(keys).status.success(), "{keys}");
    }
    let refused = picture("lod = \"cone\"\ndt = 1");
    assert!(!refused.status.success());
    let message = stderr(&refused);
    assert!(
        message.contains("scene.toml:12") && message.contains("lod"),
        "{message}"
    );
}

/// Bytes of the quad: 108 for each of its two base triangles; 8 and a box for each of their blocks, of which the edges of the map's
/// period make four a triangle.
const PRISMS: u64 = 2 * 108 + 2 * 4 * (8 + 24) + 2 * 32;

#[test]
fn info_counts_triangles_and_bytes() {
    let folder = Folder::with_quad();
    let plain = "\n[[mesh]]\nname = \"floor\"\nfile = \"quad.obj\"\ninstances = [ {}, { translate = [0, 0, -1] } ]\n";
    folder.put("scene.toml", format!("{SCENE}{plain}"));
    let info: serde_json::Value =
        serde_json::from_str(&done(&folder, &["info", "scene.toml", "--json"])).unwrap();
    assert_eq!(info["triangles"], 4);
    assert_eq!(info["displaced_triangles"], 2);
    assert_eq!(info["objects"][0]["name"], "quad");
    assert_eq!(info["objects"][1]["name"], "floor");
    assert_eq!(info["objects"][1]["instances"], 2);
    let map = &info["maps"][0];
    assert_eq!((&map["width"], &map["height"]), (&8.into(), &8.into()));
    assert_eq!(map["format"], "16-bit");
    let bytes = |value: &serde_json::Value| value.as_u64().unwrap();
    assert!(bytes(&map["bytes"]) >= 128);
    // Finest blocks of 8x4 texels, then one of 16x8; pairs of 16 bits.
    assert!(bytes(&map["pyramid_bytes"]) >= 4 * (2 + 1));
    let memory = &info["memory"];
    let prisms = bytes(&memory["overhead"]["prisms"]);
    assert_eq!(prisms, PRISMS);
    let common = &memory["common"];
    let common = bytes(&common["maps"]) + bytes(&common["meshes"]) + bytes(&common["bvh"]);
    let pyramids = bytes(&memory["overhead"]["pyramids"]);
    assert_eq!(pyramids, bytes(&map["pyramid_bytes"]));
    assert_eq!(bytes(&memory["total"]), common + prisms + pyramids);
    let text = done(&folder, &["info", "scene.toml"]);
    let prisms = format!("{prisms} B");
    for word in ["floor", "8x8", "16-bit", "overhead", &prisms] {
        assert!(text.contains(word), "no {word} in {text}");
    }
}

#[test]
fn a_render_writes_a_picture_and_its_statistics() {
    for backend in BACKENDS {
        let folder = Folder::with_quad();
        let options = [
            "--backend",
            backend,
            "--stats",
            "stats.json",
            "--threads",
            "2",
            "--seed",
            "5",
        ];
        let output = folder.run(&[&["render", "scene.toml"], &options[..]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let line = stdout(&output);
        assert!(
            line.starts_with("scene.png: 16x12, 1 spp, ") && line.ends_with(" Mrays/s\n"),
            "{line}"
        );
        assert!(stderr(&output).contains("100 %"));
        let picture = prismarch::image::load_color(
            &folder.path("scene.png"),
            prismarch::image::ColorSpace::Srgb,
        );
        let picture = picture.unwrap();
        assert_eq!((picture.width, picture.height), (16, 12));
        let stats: serde_json::Value = serde_json::from_str(&folder.text("stats.json")).unwrap();
        assert_eq!(stats["rays"]["camera"], 16 * 12);
        assert_eq!(stats["threads"], 2);
        assert_eq!(stats["seed"], 5);
        assert_eq!(stats["version"], env!("CARGO_PKG_VERSION"));
        for phase in ["load", "build", "render", "write", "total"] {
            assert!(stats["seconds"][phase].as_f64().unwrap() >= 0.0, "{phase}");
        }
        assert!(stats["mrays_per_second"].as_f64().unwrap() > 0.0);
        assert!(stats["backend"].as_str().unwrap().len() > 3 && stats["simd"].is_string());
        assert_eq!(stats["memory"]["overhead"]["prisms"], PRISMS);
    }
}

#[test]
fn options_win_over_the_scene_and_quiet_is_quiet() {
    let folder = Folder::with_quad();
    let output = folder.run(&[
        "render",
        "scene.toml",
        "-o",
        "a.exr",
        "--size",
        "20x10",
        "--spp",
        "2",
        "--quiet",
    ]);
    assert!(output.status.success());
    assert_eq!(
        (stdout(&output), stderr(&output)),
        (String::new(), String::new())
    );
    let picture =
        prismarch::image::load_color(&folder.path("a.exr"), prismarch::image::ColorSpace::Linear);
    let picture = picture.unwrap();
    assert_eq!((picture.width, picture.height), (20, 10));
}

#[test]
fn a_picture_is_the_same_for_any_number_of_threads() {
    let folder = Folder::with_quad();
    for (threads, picture) in [("1", "a.exr"), ("3", "b.exr")] {
        done(
            &folder,
            &["render", "scene.toml", "-o", picture, "--threads", threads],
        );
    }
    let pixels = |name: &str| {
        let image =
            prismarch::image::load_color(&folder.path(name), prismarch::image::ColorSpace::Linear);
        let image = image.unwrap();
        (0..16 * 12)
            .map(|i| image.pixel(i % 16, i / 16))
            .collect::<Vec<_>>()
    };
    assert_eq!(pixels("a.exr"), pixels("b.exr"));
}

#[test]
fn a_demo_can_be_written_and_rendered_again() {
    let folder = Folder::empty();
    assert!(done(&folder, &["demo", "--list"]).contains("asteroid"));
    let small = ["--map-size", "256", "--size", "16x12", "--spp", "1"];
    let line = done(&folder, &[&["demo", "--out", "rock"], &small[..]].concat());
    assert!(line.starts_with("rock/asteroid.png: 16x12"), "{line}");
    done(
        &folder,
        &[
            "render",
            "rock/asteroid.toml",
            "--size",
            "8x6",
            "--spp",
            "1",
        ],
    );
    assert!(folder.path("asteroid.png").exists());
    let info = done(&folder, &["info", "rock/asteroid.toml", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&info).unwrap();
    assert_eq!(info["displaced_triangles"], 480);
    let scene = done(
        &folder,
        &["demo", "asteroid", "--map-size", "256", "--no-render"],
    );
    assert_eq!(scene, "asteroid/asteroid.toml\n");
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_ends_the_query_quietly() {
    use std::process::{Command, Stdio};
    let folder = Folder::with_quad();
    let rays = "0,0,2,0,0,-1\n".repeat(200_000);
    folder.put("rays.csv", format!("ox,oy,oz,dx,dy,dz\n{rays}"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_prismarch"))
        .args(["query", "scene.toml", "--rays", "rays.csv"])
        .current_dir(folder.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(stderr(&output), "");
    assert!(output.status.success());
}
