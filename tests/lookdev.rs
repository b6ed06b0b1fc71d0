//! From a mesh and its maps to a picture without a scene file, and to the scene file that it stands for.

mod program;

use prismarch::image::{write_png_gray16, write_png_rgb8};
use program::{
    Folder, INPUT, QUAD, USAGE, done, is_refusal, line_refused, pixels, stderr, stdout, with,
};

/// A closed pyramid of four sides and a square, without texture coordinates.
const PYRAMID: &str = "\
v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv 0 1.5 0
f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 4 3 2 1
";

/// The quad, heights `bumps.png` from 1/4 to 3/4, and a picture of colours `paint.png`.
fn folder() -> Folder {
    let folder = Folder::empty();
    folder.put("quad.obj", QUAD);
    folder.put("pyramid.obj", PYRAMID);
    let bumps: Vec<u16> = (0..64).map(|i| [16384, 49152][i / 3 % 2]).collect();
    write_png_gray16(&folder.path("bumps.png"), 8, 8, &bumps).unwrap();
    write_png_rgb8(&folder.path("paint.png"), 1, 1, &[[200, 90, 30]], &[]).unwrap();
    folder
}

const SMALL: &str = "--size 40x30 --spp 2";

#[test]
fn what_is_saved_is_what_is_rendered() {
    let folder = folder();
    std::fs::create_dir(folder.path("out")).unwrap();
    for (index, line) in [
        "render quad.obj --displacement bumps.png",
        "render quad.obj --displacement bumps.png --color paint.png --roughness 0.3 --floor --integrator path",
        "render pyramid.obj --texcoords box --displacement bumps.png --uv-scale 2,1 --normals smooth --view top --orbit 10,-20",
        "render pyramid.obj --texcoords spherical --displacement bumps.png --subdivide 2 --up z --unit cm",
        "render pyramid.obj --floor --exposure 1 --filter box --clamp 5 --seed 9 --adaptive-threshold 0.1",
        "render quad.obj --displacement bumps.png --scale -0.1 --midlevel 0.5 --dt 0.5 --wrap mirror --metallic paint.png",
        "render quad.obj --displacement bumps.png --lod cone --tone agx --aovs N,Z --crop 3,4,30,20",
    ]
    .into_iter()
    .enumerate()
    {
        // A metalness of colours is refused, and said so.
        if line.contains("--metallic") {
            let line = format!("{line} {SMALL} -o x.exr");
            line_refused(&folder, &line, INPUT, &["paint.png", "differ"]);
            continue;
        }
        let (made, saved) = (format!("made{index}.exr"), format!("out/{index}.toml"));
        done(&folder, &format!("{line} {SMALL} --save {saved} -o {made} -q"));
        let text = folder.text(&saved);
        assert!(text.contains("file = \"../"), "{text}");
        done(&folder, &format!("render {saved} -o again.exr -q"));
        assert!(pixels(&folder, &made) == pixels(&folder, "again.exr"), "{line}");
        // Saved alone, from elsewhere, it is the same text.
        let alone = done(&folder, &format!("{line} {SMALL} --save out/alone.toml"));
        assert_eq!(stdout(&alone), "out/alone.toml\n");
        assert_eq!(folder.text("out/alone.toml"), text);
    }
}

#[test]
fn the_mesh_is_whole_in_the_picture_and_large_in_it() {
    let folder = folder();
    for size in ["40x30", "20x40"] {
        for view in [
            "three-quarter",
            "front",
            "left",
            "bottom",
            "back --orbit 130,25",
        ] {
            let line = format!(
                "render pyramid.obj --texcoords box --displacement bumps.png --view {view} --size {size} --spp 4 --filter box -o p.exr -q"
            );
            done(&folder, &line);
            let (_, channels) = pixels(&folder, "p.exr");
            let width: usize = size[..2].parse().unwrap();
            let alpha = channels["A"].iter().map(|&bits| f32::from_bits(bits));
            let seen: Vec<bool> = alpha.map(|alpha| alpha > 0.0).collect();
            let height = seen.len() / width;
            let at = |x: usize, y: usize| seen[y * width + x];
            let columns = (0..width)
                .filter(|&x| (0..height).any(|y| at(x, y)))
                .count();
            let rows = (0..height)
                .filter(|&y| (0..width).any(|x| at(x, y)))
                .count();
            let border = (0..width).any(|x| at(x, 0) || at(x, height - 1))
                || (0..height).any(|y| at(0, y) || at(width - 1, y));
            assert!(!border, "{line}");
            let filled = (columns as f64 / width as f64).max(rows as f64 / height as f64);
            // Boxes of blocks are wide over triangles as large as these.
            assert!(filled > 0.65, "{line}: {filled}");
        }
    }
}

#[test]
fn a_scale_is_guessed_and_said_unless_it_is_given() {
    let folder = folder();
    // Half of all heights are used, and the diagonal is 2.83.
    let guessed = done(
        &folder,
        &format!("render quad.obj --displacement bumps.png {SMALL}"),
    );
    let message = stderr(&guessed);
    for word in ["scale 0.28", "guessed", "5 %", "--scale"] {
        assert!(message.contains(word), "{message}");
    }
    assert!(folder.names().contains(&"quad.png".to_owned()));
    for quiet in ["--scale 0.2", "-q"] {
        let said = done(
            &folder,
            &format!("render quad.obj --displacement bumps.png {SMALL} {quiet}"),
        );
        assert!(!stderr(&said).contains("guessed"));
    }
    // What is laid over the scene is not guessed either, and framed as it is.
    let laid = done(
        &folder,
        &format!(
            "render quad.obj --displacement bumps.png {SMALL} --set mesh.0.displacement.scale=0.2 -o laid.exr"
        ),
    );
    assert!(!stderr(&laid).contains("guessed"));
    done(
        &folder,
        &format!("render quad.obj --displacement bumps.png {SMALL} --scale 0.2 -o given.exr"),
    );
    assert!(pixels(&folder, "laid.exr") == pixels(&folder, "given.exr"));
}

#[test]
fn maps_are_found_in_a_folder() {
    let folder = folder();
    std::fs::create_dir(folder.path("maps")).unwrap();
    for name in ["rock_disp_4k.png", "rock_rough_4k.png"] {
        std::fs::copy(folder.path("bumps.png"), folder.path("maps").join(name)).unwrap();
    }
    for name in ["Rock_BaseColor.png", "rock_nor_dx.png", "rock_ao.png"] {
        std::fs::copy(folder.path("paint.png"), folder.path("maps").join(name)).unwrap();
    }
    let line = format!("render quad.obj --displacement maps {SMALL} --save rock.toml");
    let message = stderr(&done(&folder, &line));
    for word in [
        "displacement rock_disp_4k.png",
        "color Rock_BaseColor.png",
        "unused: rock_ao.png",
        "DirectX",
    ] {
        assert!(message.contains(word), "{message}");
    }
    let text = folder.text("rock.toml");
    for word in [
        "map = \"maps/rock_disp_4k.png\"",
        "maps/Rock_BaseColor.png",
        "maps/rock_rough_4k.png",
    ] {
        assert!(text.contains(word), "{text}");
    }
    assert!(!text.contains("normal_map"), "{text}");
    done(&folder, &format!("{line} --color none --roughness 0.5"));
    let text = folder.text("rock.toml");
    assert!(
        !text.contains("BaseColor") && text.contains("roughness = 0.5"),
        "{text}"
    );
}

#[test]
fn bad_input_gets_a_sentence_that_says_what_to_do() {
    let folder = folder();
    std::fs::create_dir(folder.path("empty")).unwrap();
    std::fs::create_dir(folder.path("colors")).unwrap();
    std::fs::copy(folder.path("paint.png"), folder.path("colors/rock_col.png")).unwrap();
    folder.put("rock.fbx", "Kaydara");
    folder.put("scene.toml", "[[mesh]]\nfile = \"quad.obj\"\n");
    for (line, code, words) in [
        (
            "render pyramid.obj --displacement bumps.png",
            INPUT,
            &["pyramid.obj", "no texture coordinates", "--texcoords box"][..],
        ),
        (
            "render pyramid.obj --color paint.png",
            INPUT,
            &["no texture coordinates", "--texcoords box"],
        ),
        (
            "render quad.obj --displacement paint.png",
            INPUT,
            &["paint.png", "differ", "--channel", "--color"],
        ),
        (
            "render quad.obj --displacement empty",
            INPUT,
            &["empty", "no pictures", "_disp", "--displacement FILE"],
        ),
        (
            "render quad.obj --displacement colors",
            INPUT,
            &["rock_col.png", "_height"],
        ),
        (
            "render quad.obj --displacement none.png",
            INPUT,
            &["none.png"],
        ),
        (
            "render quad.obj --color colors",
            INPUT,
            &["colors", "a folder"],
        ),
        ("render none.obj", INPUT, &["none.obj"]),
        (
            "render rock.fbx --displacement bumps.png",
            INPUT,
            &["rock.fbx", ".obj", ".toml", "export"],
        ),
        ("render bumps.png", INPUT, &["bumps.png", "--displacement"]),
        ("render colors", INPUT, &["colors", "folder", "mesh"]),
        (
            "render scene.toml --displacement bumps.png",
            USAGE,
            &["--displacement", "scene.toml", "--set"],
        ),
        (
            "render scene.toml --save other.toml",
            USAGE,
            &["--save", "scene file"],
        ),
        (
            "render pyramid.obj --floor --view bottom",
            USAGE,
            &["floor", "--view"],
        ),
        (
            "render quad.obj --displacement bumps.png --save quad.obj",
            USAGE,
            &["quad.obj"],
        ),
        (
            "render quad.obj --displacement bumps.png --save bumps.png",
            USAGE,
            &["bumps.png"],
        ),
        (
            "render quad.obj --displacement bumps.png --save a.toml -o none/a.png",
            4,
            &["none"],
        ),
        (
            "render quad.obj --displacement bumps.png --set film.spp=0",
            USAGE,
            &["film.spp", "--set"],
        ),
    ] {
        line_refused(&folder, line, code, words);
    }
    for line in [
        "--roughness 1.5",
        "--orbit 1,2,3",
        "--save a.toml --set film.spp=1",
    ] {
        let line = format!("render quad.obj {line}");
        let output = folder.run(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(USAGE), "{line}");
    }
}

#[test]
fn names_that_no_scene_file_can_hold_are_refused() {
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        let folder = folder();
        let name = std::ffi::OsStr::from_bytes(b"r\xffck.obj");
        let placed = std::fs::write(folder.path("").join(name), QUAD);
        if placed.is_err() {
            return; // a file system of Unicode names
        }
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_prismarch"))
            .current_dir(folder.path(""))
            .arg("render")
            .arg(name)
            .output()
            .unwrap();
        is_refusal(&output, INPUT, &["UTF-8", "rename"]);
    }
}

#[test]
fn a_plane_is_a_shape_of_scenes() {
    let plane = "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 1 0\n\
                 f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n";
    let folder = with("plane.obj", plane);
    for (name, source) in [
        ("shape", "shape = \"plane\""),
        ("file", "file = \"plane.obj\""),
    ] {
        let scene = format!(
            "[film]\nwidth = 16\nheight = 12\nspp = 1\n[[mesh]]\n{source}\ntransform = {{ scale = 3 }}\n\
             [mesh.displacement]\nmap = \"flat.png\"\nscale = 0.2\n"
        );
        folder.put(&format!("{name}.toml"), scene);
        done(&folder, &format!("render {name}.toml -o {name}.exr -q"));
    }
    assert!(pixels(&folder, "shape.exr") == pixels(&folder, "file.exr"));
    for (source, words) in [
        ("shape = \"teapot\"", ["shape", "plane"]),
        (
            "shape = \"plane\"\nfile = \"plane.obj\"",
            ["a file and a shape", "only one"],
        ),
        ("", ["file", "shape"]),
    ] {
        folder.put("bad.toml", format!("[[mesh]]\n{source}\n"));
        line_refused(&folder, "render bad.toml", INPUT, &words);
    }
}

#[test]
fn shells_and_manuals_are_served() {
    let folder = Folder::empty();
    for (line, words) in [
        ("completions bash", ["_prismarch", "--displacement"]),
        ("completions zsh", ["#compdef prismarch", "three-quarter"]),
        (
            "completions fish",
            ["complete -c prismarch", "displacement"],
        ),
        ("man", [".TH prismarch 1", "prismarch 0."]),
        (
            "man render",
            [".TH prismarch\\-render 1", "three\\-quarter"],
        ),
    ] {
        let text = stdout(&done(&folder, line)).replace("prismarch-render", "prismarch\\-render");
        for word in words {
            assert!(text.contains(word), "{line}: {word}");
        }
    }
    done(&folder, "man --out .");
    let names = folder.names();
    for page in ["prismarch.1", "prismarch-render.1", "prismarch-man.1"] {
        assert!(names.contains(&page.to_owned()), "{names:?}");
    }
    line_refused(&folder, "man nothing", USAGE, &["nothing", "render"]);
    line_refused(&folder, "man --out none", 4, &["none"]);
}
