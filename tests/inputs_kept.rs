//! What the user owns is never lost: no run writes over what it reads, two outputs are two files, and a demo replaces its own
//! files only.

mod program;

use std::fs::{self, File, OpenOptions};
use std::process::{Command, Output, Stdio};

use prismarch::image::{ExrChannel, write_exr, write_png_gray16, write_png_rgb8};
use program::{Folder, QUAD, SCENE, done, is_refusal, line_refused, stderr, stdout};

const USAGE: i32 = 2;
const OUTPUT: i32 = 4;

/// All kinds of files that a scene reads.
const INPUTS: [&str; 7] = [
    "scene.toml",
    "quad.obj",
    "by_mtl.png",
    "flat.png",
    "paint.png",
    "rough.png",
    "sky.exr",
];

/// A folder with a scene that reads [`INPUTS`], rays, and two parts of a picture.
fn folder() -> Folder {
    let folder = Folder::with_quad();
    fs::create_dir(folder.path("inner")).unwrap();
    folder.put("quad.obj", format!("mtllib quad.mtl\nusemtl wall\n{QUAD}"));
    folder.put("quad.mtl", "newmtl wall\nmap_Kd by_mtl.png\n");
    for name in ["by_mtl.png", "paint.png"] {
        write_png_rgb8(&folder.path(name), 2, 2, &[[200; 3]; 4], &[]).unwrap();
    }
    write_png_gray16(&folder.path("rough.png"), 2, 2, &[30_000; 4]).unwrap();
    let sky = ["R", "G", "B"].map(|name| ExrChannel::floats(name, vec![1.0; 8]));
    write_exr(&folder.path("sky.exr"), 4, 2, sky.into(), &[]).unwrap();
    folder.put(
        "scene.toml",
        format!(
            "{SCENE}
[[mesh]]
file = \"quad.obj\"
material = \"paint\"
instances = [ {{ translate = [3, 0, 0] }} ]

[[material]]
name = \"paint\"
base_color = {{ file = \"paint.png\" }}
roughness = {{ file = \"rough.png\" }}

[[light]]
type = \"environment\"
file = \"sky.exr\"
"
        ),
    );
    folder.put("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,2,0,0,-1\n");
    folder
}

#[test]
fn no_file_of_the_scene_is_written_over_under_any_name() {
    let folder = folder();
    done(&folder, "render scene.toml -o free.png --stats free.json");
    for input in INPUTS {
        for name in [input, &format!("./{input}"), &format!("inner/../{input}")] {
            for run in [
                "render scene.toml -o free.png --stats",
                "query scene.toml --rays rays.csv -o",
            ] {
                line_refused(&folder, &format!("{run} {name}"), USAGE, &[name, input]);
            }
        }
    }
}

#[cfg(unix)]
#[test]
fn links_of_either_kind_lead_to_the_files_of_the_scene() {
    use std::os::unix::fs::symlink;
    let folder = folder();
    symlink(".", folder.path("here")).unwrap();
    for input in INPUTS {
        fs::hard_link(folder.path(input), folder.path("hard.exr")).unwrap();
        symlink(input, folder.path("soft.exr")).unwrap();
        symlink("../soft.exr", folder.path("inner/softer.png")).unwrap();
        for output in ["hard.exr", "soft.exr", "inner/softer.png", "here/soft.exr"] {
            let run = format!("render scene.toml -o {output}");
            line_refused(&folder, &run, USAGE, &[output, input]);
        }
        for link in ["hard.exr", "soft.exr", "inner/softer.png"] {
            fs::remove_file(folder.path(link)).unwrap();
        }
    }
    // The scene may be read by a link, too, and the picture that is gone on with may be none of its own.
    symlink("scene.toml", folder.path("by_link.toml")).unwrap();
    let stats = "render by_link.toml -o a.png --stats scene.toml";
    line_refused(&folder, stats, USAGE, &["scene.toml", "by_link.toml"]);
    let resume = "render scene.toml -o sky.exr --resume";
    line_refused(&folder, resume, USAGE, &["sky.exr"]);
}

#[test]
fn a_query_keeps_its_rays_mesh_and_map() {
    let folder = folder();
    let query = "query --mesh quad.obj --map flat.png --scale 0.2 --rays rays.csv -o";
    for input in ["rays.csv", "quad.obj", "flat.png"] {
        line_refused(&folder, &format!("{query} {input}"), USAGE, &[input]);
    }
    done(&folder, &format!("{query} hits.csv"));
}

#[test]
fn files_that_a_mesh_file_names_are_kept() {
    let folder = folder();
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    folder.put("corners.bin", corners.map(f32::to_le_bytes).as_flattened());
    folder.put(
        "corners.gltf",
        r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "corners.bin", "byteLength": 36}]}"#,
    );
    let rest = "--map flat.png --scale 0.2 --rays rays.csv -o";
    for (mesh, input) in [
        ("quad.obj", "quad.mtl"),
        ("corners.gltf --texcoords planar", "corners.bin"),
    ] {
        let query = format!("query --mesh {mesh} {rest}");
        line_refused(&folder, &format!("{query} {input}"), USAGE, &[input]);
        done(&folder, &format!("{query} hits.csv"));
    }
    let stats = "render scene.toml -o a.png --stats quad.mtl";
    line_refused(&folder, stats, USAGE, &["quad.mtl"]);
}

#[test]
fn a_merge_keeps_its_parts() {
    let folder = folder();
    let part = "render scene.toml --aovs none --crop";
    done(&folder, &format!("{part} 0,0,8,12 -o a.exr"));
    done(&folder, &format!("{part} 8,0,16,12 -o b.exr"));
    fs::hard_link(folder.path("b.exr"), folder.path("c.exr")).unwrap();
    for (output, input) in [
        ("a.exr", "a.exr"),
        ("inner/../b.exr", "b.exr"),
        ("c.exr", "b.exr"),
    ] {
        let run = format!("merge a.exr b.exr -o {output}");
        line_refused(&folder, &run, USAGE, &[output, input]);
    }
    done(&folder, "merge a.exr b.exr -o whole.exr");
}

/// The program with the file `name` as one of its streams, opened as a shell does for `>>` and `<`.
#[cfg(unix)]
fn run_with_streams(folder: &Folder, arguments: &str, stdin: Option<&str>, stdout: &str) -> Output {
    let append = OpenOptions::new().append(true).open(folder.path(stdout));
    let stdin = stdin.map(|name| File::open(folder.path(name)).unwrap());
    Command::new(env!("CARGO_BIN_EXE_prismarch"))
        .args(arguments.split(' '))
        .current_dir(folder.path(""))
        .stdin(stdin.map_or(Stdio::null(), Stdio::from))
        .stdout(append.unwrap())
        .stderr(Stdio::piped())
        .spawn()
        .and_then(|child| child.wait_with_output())
        .unwrap()
}

#[cfg(unix)]
#[test]
fn standard_streams_are_files_like_others() {
    let folder = folder();
    folder.put("log", "");
    let before = folder.contents();
    let query = "query scene.toml --rays";
    for (arguments, stdin, stdout, words) in [
        (
            "render scene.toml -o a.png",
            None,
            "scene.toml",
            ["standard output", "scene.toml"],
        ),
        (
            "render scene.toml -o a.png",
            None,
            "sky.exr",
            ["standard output", "sky.exr"],
        ),
        (
            "info scene.toml --json",
            None,
            "scene.toml",
            ["standard output", "scene.toml"],
        ),
        (
            "info scene.toml --json",
            None,
            "flat.png",
            ["standard output", "flat.png"],
        ),
        (
            &format!("{query} rays.csv"),
            None,
            "rays.csv",
            ["standard output", "rays.csv"],
        ),
        (
            &format!("{query} -"),
            Some("rays.csv"),
            "rays.csv",
            ["standard output", "standard input"],
        ),
        (
            &format!("{query} - -o rays.csv"),
            Some("rays.csv"),
            "log",
            ["rays.csv", "standard input"],
        ),
        (
            "render scene.toml -o a.png --stats log",
            None,
            "log",
            ["log", "standard output"],
        ),
    ] {
        let output = run_with_streams(&folder, arguments, stdin, stdout);
        is_refusal(&output, USAGE, &words);
        assert!(folder.contents() == before, "{arguments}: files changed");
    }
    let output = run_with_streams(&folder, &format!("{query} -"), Some("rays.csv"), "log");
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(folder.text("log").lines().count(), 2);
}

#[test]
fn two_outputs_are_two_files() {
    let folder = folder();
    let render = "render scene.toml -o";
    for there in [false, true] {
        if there {
            folder.put("a.exr", "old");
        }
        for stats in ["a.exr", "./a.exr", "inner/../a.exr"] {
            let run = format!("{render} a.exr --stats {stats}");
            line_refused(&folder, &run, USAGE, &["a.exr", stats, "one file"]);
        }
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        fs::hard_link(folder.path("a.exr"), folder.path("hard")).unwrap();
        symlink("a.exr", folder.path("soft")).unwrap();
        symlink("b.exr", folder.path("dangling")).unwrap();
        for (output, stats) in [("a.exr", "hard"), ("a.exr", "soft"), ("b.exr", "dangling")] {
            let run = format!("{render} {output} --stats {stats}");
            line_refused(&folder, &run, USAGE, &[output, stats, "one file"]);
        }
    }
}

#[test]
fn a_picture_without_a_name_takes_one_that_is_free() {
    let folder = folder();
    folder.put(
        "flat.toml",
        folder.text("scene.toml").replace("spp = 1", "spp = 2"),
    );
    let before = folder.contents();
    let output = done(&folder, "render flat.toml");
    assert!(stdout(&output).starts_with("flat.render.png: 16x12"));
    assert!(stderr(&output).contains("warning: the picture is flat.render.png"));
    let mut after = folder.contents();
    assert!(after.remove("flat.render.png").is_some());
    assert!(after == before);
    // The name that is free is taken again, and not where it is read or written itself.
    done(&folder, "render flat.toml --quiet --stats flat.render2.png");
    assert_eq!(folder.contents().len(), before.len() + 2);
    folder.put(
        "flat.toml",
        folder
            .text("flat.toml")
            .replace("paint.png", "flat.render.png"),
    );
    let before = folder.contents();
    let output = done(&folder, "render flat.toml --stats flat.render2.png");
    assert!(stdout(&output).starts_with("flat.render3.png: "));
    for (name, bytes) in before {
        let same = folder.contents()[&name] == bytes;
        assert!(same || name == "flat.render2.png", "{name}");
    }
    // The scene itself may be called like a picture.
    fs::copy(folder.path("scene.toml"), folder.path("odd.png")).unwrap();
    let output = done(&folder, "render odd.png");
    assert!(stdout(&output).starts_with("odd.render.png: "));
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_first_ray() {
    let folder = folder();
    done(&folder, "render scene.toml -o part.exr --aovs none");
    folder.put("file", "");
    folder.put("locked.exr", "old");
    let mut locked = fs::metadata(folder.path("locked.exr"))
        .unwrap()
        .permissions();
    locked.set_readonly(true);
    fs::set_permissions(folder.path("locked.exr"), locked).unwrap();
    fs::create_dir(folder.path("folder.exr")).unwrap();
    let long = format!("{}.exr", "x".repeat(252));
    let mut names = vec![
        "new.exr/",
        "new.exr/.",
        "part.exr/",
        "folder.exr",
        "inner/",
        "no/such.exr",
        "file/inner.exr",
        "locked.exr",
        &long,
    ];
    if cfg!(unix) {
        names.extend(["/dev/full", "/dev/null", "/dev/stderr"]);
    }
    if cfg!(target_os = "linux") {
        names.push("/proc/self/new.exr");
    }
    for name in names {
        let mut runs = vec![
            format!("render scene.toml -o free.png --stats {name}"),
            format!("query scene.toml --rays rays.csv -o {name}"),
        ];
        if name.contains(".exr") {
            runs.push(format!("render scene.toml -o {name}"));
            runs.push(format!("merge part.exr -o {name}"));
        }
        for run in runs {
            line_refused(&folder, &run, OUTPUT, &["cannot write"]);
        }
    }
}

#[cfg(unix)]
#[test]
fn inputs_that_are_no_files_are_refused_at_once() {
    let folder = folder();
    let made = Command::new("mkfifo").arg(folder.path("pipe")).status();
    assert!(made.unwrap().success());
    for name in ["pipe.obj", "pipe.png", "pipe.toml"] {
        fs::rename(folder.path("pipe"), folder.path(name)).unwrap();
        let verbs = match name {
            "pipe.obj" => vec![
                "query --mesh pipe.obj --map flat.png --scale 1 --rays rays.csv",
                "render scene.toml -o a.png --set mesh.0.file=\"pipe.obj\"",
            ],
            "pipe.png" => vec![
                "query --mesh quad.obj --map pipe.png --scale 1 --rays rays.csv",
                "query scene.toml --rays pipe.png",
                "merge pipe.png -o a.png",
            ],
            _ => vec![
                "render pipe.toml -o a.png",
                "info pipe.toml",
                "query pipe.toml --rays rays.csv",
            ],
        };
        for run in verbs {
            let words: Vec<&str> = run.split(' ').collect();
            let output = folder.run(&words);
            let message = stderr(&output);
            assert!(
                matches!(output.status.code(), Some(2 | 3)),
                "{run}: {message}"
            );
            assert!(message.contains("it is a pipe"), "{run}: {message}");
        }
        fs::rename(folder.path(name), folder.path("pipe")).unwrap();
    }
    fs::remove_file(folder.path("pipe")).unwrap();
    for input in ["/dev/zero", "inner"] {
        for run in [
            format!("render {input} -o a.png"),
            format!("info {input}"),
            format!("query {input} --rays rays.csv"),
            format!("query scene.toml --rays {input}"),
            format!("query --mesh quad.obj --map {input} --scale 1 --rays rays.csv"),
            format!("merge {input} -o a.png"),
        ] {
            line_refused(&folder, &run, 3, &["it is a", input]);
        }
    }
}

#[test]
fn a_demo_replaces_what_it_made_and_nothing_else() {
    let folder = Folder::empty();
    let small = "demo asteroid --out rock --size 16x12 --spp 1 --map-size";
    let path = |name: &str| format!("rock/{name}");
    let read = |name: &str| fs::read(folder.path(&path(name))).unwrap();
    let names = [
        "asteroid.obj",
        "asteroid.png",
        "asteroid.toml",
        "asteroid_height.png",
    ];
    // What it made itself it replaces, also by something else, also without some of it.
    done(&folder, &format!("{small} 256"));
    fs::remove_file(folder.path("rock/asteroid.obj")).unwrap();
    done(&folder, &format!("{small} 300"));
    let changed = ["asteroid.png", "asteroid.toml"];
    for name in changed {
        folder.put(&path(name), [&read(name)[..], b"# mine"].concat());
    }
    let before = names.map(read);
    let words = changed.map(path);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let words = [&words[..], &["--force"]].concat();
    line_refused(&folder, &format!("{small} 256"), USAGE, &words);
    assert!(names.map(read) == before);
    done(&folder, &format!("{small} 256 --force"));
    assert!(changed.iter().all(|name| !read(name).ends_with(b"# mine")));
    // A picture that is not written may be what it wants.
    folder.put(&path("asteroid.png"), "mine");
    done(&folder, "demo --out rock --map-size 256 --no-render");
    assert_eq!(read("asteroid.png"), b"mine");
}

#[test]
fn a_demo_asks_where_nothing_is_its_own() {
    let folder = Folder::empty();
    fs::create_dir(folder.path("asteroid")).unwrap();
    folder.put("asteroid/asteroid.toml", "mine");
    folder.put("asteroid/notes.txt", "mine");
    let run = "demo --no-render --map-size 256";
    line_refused(&folder, run, USAGE, &["asteroid/asteroid.toml"]);
    assert_eq!(folder.text("asteroid/asteroid.toml"), "mine");
    assert!(!folder.path("asteroid/asteroid.obj").exists());
    done(&folder, &format!("{run} --force"));
    assert_eq!(folder.text("asteroid/notes.txt"), "mine");
    folder.put("asteroid/.prismarch-demo", "mine");
    line_refused(&folder, run, USAGE, &[".prismarch-demo"]);
}
