//! Pictures as files: split and merged, interrupted and gone on with, refused.

mod program;

use std::collections::BTreeMap;

use prismarch::image::{read_exr, write_png_gray16};
use program::{Folder, SCENE, done, line_refused, pixels, stderr, stdout};

/// The usual folder with bumps, so that every channel has something to tell.
fn folder() -> Folder {
    let folder = Folder::with_quad();
    let noise = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 16) as u16;
    let heights: Vec<u16> = (0..32 * 32).map(noise).collect();
    write_png_gray16(&folder.path("flat.png"), 32, 32, &heights).unwrap();
    folder.put("scene.toml", SCENE.replace("spp = 1", "spp = 12"));
    folder
}

fn attributes(folder: &Folder, name: &str) -> BTreeMap<String, String> {
    let picture = read_exr(&folder.path(name)).unwrap();
    let own = picture.attributes.into_iter();
    own.filter_map(|(name, value)| Some((name.strip_prefix("prismarch/")?.to_owned(), value)))
        .collect()
}

#[test]
fn pictures_do_not_depend_on_the_simd_level() {
    let folder = folder();
    for look in ["--lod cone", "--lod off", "--march uniform --dt 2"] {
        for spp in [1, 8] {
            let arguments = format!("render scene.toml {look} --spp {spp} -o");
            done(&folder, &format!("{arguments} usual.exr"));
            let baseline = format!("{arguments} baseline.exr");
            let baseline: Vec<&str> = baseline.split(' ').collect();
            let output = folder.run_at_baseline(&baseline);
            assert!(output.status.success(), "{}", stderr(&output));
            let (usual, baseline) = (
                pixels(&folder, "usual.exr"),
                pixels(&folder, "baseline.exr"),
            );
            assert!(usual.1.len() > 10);
            for (name, bits) in &usual.1 {
                assert_eq!(bits, &baseline.1[name], "{look}, {spp}: {name}");
            }
        }
    }
}

#[test]
fn tiles_of_any_size_on_any_threads_merge_to_the_whole() {
    let folder = folder();
    for options in [
        "",
        " --filter mitchell",
        " --adaptive-threshold 0.1 --adaptive-min-spp 4",
    ] {
        done(&folder, &format!("render scene.toml -o whole.exr{options}"));
        let tiles = ["0,0,16,1", "0,1,5,12", "5,1,16,12"];
        for (index, (crop, threads)) in tiles.iter().zip([1, 2, 3]).enumerate() {
            done(
                &folder,
                &format!(
                    "render scene.toml -o {index}.exr --crop {crop} --threads {threads}{options}"
                ),
            );
        }
        let line = stdout(&done(&folder, "merge 2.exr 0.exr 1.exr -o merged.exr"));
        assert_eq!(line, "merged.exr: 0,0,16,12 0..12 of 12 spp\n");
        assert!(
            pixels(&folder, "merged.exr") == pixels(&folder, "whole.exr"),
            "{options}"
        );
        assert_eq!(
            attributes(&folder, "merged.exr"),
            attributes(&folder, "whole.exr")
        );
        assert_eq!(pixels(&folder, "2.exr").0, (5, 1));
    }
}

#[test]
fn runs_of_samples_merge_to_the_whole_up_to_rounding() {
    let folder = folder();
    done(&folder, "render scene.toml -o whole.exr");
    done(&folder, "render scene.toml -o a.exr --samples 0..5");
    done(
        &folder,
        "render scene.toml -o b.exr --samples 5..12 --crop 0,0,16,6",
    );
    done(
        &folder,
        "render scene.toml -o c.exr --samples 5..12 --crop 0,6,16,12 --progressive",
    );
    done(&folder, "merge b.exr c.exr a.exr -o merged.exr");
    let (merged, whole) = (
        pixels(&folder, "merged.exr").1,
        pixels(&folder, "whole.exr").1,
    );
    assert!(merged.keys().eq(whole.keys()));
    for (name, whole) in &whole {
        for (&m, &w) in merged[name].iter().zip(whole) {
            let [a, b] = [m, w].map(f32::from_bits);
            assert!(m == w || (a - b).abs() <= 1e-6 * b.abs(), "{name} {a} {b}");
        }
    }
    assert_eq!(
        attributes(&folder, "merged.exr"),
        attributes(&folder, "whole.exr")
    );
}

#[test]
fn a_file_tells_what_it_is() {
    let folder = folder();
    done(
        &folder,
        "render scene.toml -o a.exr --seed 7 --clamp 5 --crop 1,2,9,12 --backend bvh",
    );
    let tells = attributes(&folder, "a.exr");
    for (name, value) in [
        ("version", env!("CARGO_PKG_VERSION")),
        ("scene", "scene.toml"),
        ("seed", "7"),
        ("spp", "12"),
        ("parts", "1,2,9,12 0..12"),
        ("filter", "blackman-harris 1.5"),
        ("clamp", "5"),
        ("adaptive", "off"),
        ("partial", "false"),
        ("backend", "obvhs"),
    ] {
        assert_eq!(tells[name], value, "{name}");
    }
    assert_eq!(tells["scene_hash"].len(), 32);
    let channels = pixels(&folder, "a.exr").1;
    for name in [
        "R",
        "A",
        "albedo.G",
        "N.X",
        "P.Y",
        "Z",
        "UV.U",
        "displacement",
        "prim",
    ] {
        assert!(channels[name].iter().any(|&bits| bits != 0), "{name}");
    }
    done(&folder, "render scene.toml -o few.exr --aovs Z,N");
    let channels = pixels(&folder, "few.exr").1;
    assert!(channels.contains_key("Z") && !channels.contains_key("albedo.R"));
    // The picture from the file is the picture of the renderer.
    done(
        &folder,
        "render scene.toml -o direct.png --tone agx --exposure 1",
    );
    done(&folder, "render scene.toml -o b.exr");
    done(&folder, "merge b.exr -o merged.png --tone agx --exposure 1");
    let png = |name: &str| {
        let decoder = png::Decoder::new(std::io::BufReader::new(
            std::fs::File::open(folder.path(name)).unwrap(),
        ));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        let texts = &reader.info().uncompressed_latin1_text;
        let partial = texts
            .iter()
            .find(|text| text.keyword == "prismarch/partial");
        assert_eq!(partial.unwrap().text, "false");
        assert!(reader.info().srgb.is_some());
        bytes
    };
    assert_eq!(png("direct.png"), png("merged.png"));
}

#[test]
fn any_key_can_be_set_and_is_part_of_the_scene() {
    let folder = folder();
    done(
        &folder,
        "render scene.toml -o a.exr --set film.spp=3 --set mesh.0.displacement.scale=0.3",
    );
    folder.put(
        "b.toml",
        folder
            .text("scene.toml")
            .replace("scale = 0.2", "scale = 0.3"),
    );
    done(&folder, "render b.toml -o b.exr --spp 3 --set film.spp=4");
    assert!(pixels(&folder, "a.exr") == pixels(&folder, "b.exr"));
    let [a, b] = ["a.exr", "b.exr"].map(|name| attributes(&folder, name));
    assert_eq!(a["scene_hash"], b["scene_hash"]);
}

#[test]
fn the_scene_s_hash_is_that_of_what_is_seen() {
    let folder = folder();
    let hash = |scene: &str| {
        folder.put("scene.toml", scene);
        done(&folder, "render scene.toml -o a.exr --aovs none --spp 1");
        attributes(&folder, "a.exr")["scene_hash"].clone()
    };
    let first = hash(SCENE);
    assert_eq!(
        hash(&SCENE.replace("[film]", "# a comment\n[film]\nexposure = 2")),
        first
    );
    assert_ne!(
        hash(&SCENE.replace("scale = 0.2", "scale = 0.2000001")),
        first
    );
    assert_ne!(hash(&format!("{SCENE}\n[[light]]\ntype = \"sky\"")), first);
    assert_ne!(
        hash(&SCENE.replace("scale = 0.2", "scale = 0.2\nwrap = \"clamp\"")),
        first
    );
    let mut heights = [32768; 64];
    write_png_gray16(&folder.path("flat.png"), 8, 8, &heights).unwrap();
    let flat = hash(SCENE);
    heights[63] += 1;
    write_png_gray16(&folder.path("flat.png"), 8, 8, &heights).unwrap();
    assert_ne!(hash(SCENE), flat);
}

#[test]
fn what_does_not_fit_is_not_merged() {
    let folder = folder();
    done(&folder, "render scene.toml -o a.exr --crop 0,0,8,12");
    done(
        &folder,
        "render scene.toml -o a_again.exr --crop 7,11,16,12",
    );
    done(
        &folder,
        "render scene.toml -o seed.exr --crop 8,0,16,12 --seed 1",
    );
    done(
        &folder,
        "render scene.toml -o size.exr --size 20x12 --crop 8,0,16,12",
    );
    done(&folder, "render scene.toml -o picture.png");
    folder.put(
        "scene.toml",
        folder
            .text("scene.toml")
            .replace("scale = 0.2", "scale = 0.3"),
    );
    done(&folder, "render scene.toml -o scene.exr --crop 8,0,16,12");
    let whole = std::fs::read(folder.path("a.exr")).unwrap();
    folder.put("cut.exr", &whole[..whole.len() / 2]);
    folder.put("none.exr", "");
    for (file, words) in [
        ("a.exr", &["a.exr", "samples 0..12", "0,0,8,12"][..]),
        (
            "a_again.exr",
            &["a_again.exr", "samples 0..12", "7,11,8,12"],
        ),
        ("seed.exr", &["seed.exr", "seed", "found 1", "expected 0"]),
        ("size.exr", &["size.exr", "found 20x12", "expected 16x12"]),
        ("scene.exr", &["scene.exr", "scene_hash"]),
        ("cut.exr", &["cut.exr"]),
        ("none.exr", &["none.exr", "empty"]),
        ("picture.png", &["picture.png", "PNG"]),
        ("missing.exr", &["missing.exr", "No such file"]),
    ] {
        line_refused(&folder, &format!("merge a.exr {file} -o out.exr"), 3, words);
    }
    line_refused(&folder, "merge -o out.exr", 2, &["EXR"]);
    line_refused(&folder, "merge a.exr -o out.txt", 2, &[".png or .exr"]);
    line_refused(&folder, "merge a.exr -o no/out.exr", 4, &["no folder"]);
}

#[test]
fn odd_options_are_refused_before_the_work() {
    let folder = folder();
    for (options, words) in [
        ("--crop 0,0,17,12", &["0,0,17,12", "16x12"][..]),
        ("--crop 4,4,4,8", &["--crop", "x0 < x1"]),
        ("--samples 0..0", &["--samples", "A < B"]),
        ("--samples 4..13", &["found 13", "12 samples"]),
        ("--samples 0..6 --adaptive-threshold 0.1", &["adaptive"]),
        ("--spp 0", &["--spp"]),
        ("--filter sinc", &["--filter", "mitchell"]),
        ("--clamp 0", &["--clamp", "off"]),
        ("--aovs speed", &["--aovs", "displacement"]),
        ("--tone aces", &["--tone", "agx"]),
        ("--exposure 65", &["--exposure", "64"]),
        ("--resume", &[".exr", "--resume"]),
        ("--set film.spp=0", &["--set:1:10", "film.spp", "found 0"]),
        ("--set film.speed=1", &["--set:1:6", "film.speed"]),
        ("--set mesh.0.file=no.obj", &["--set:1:13", "no.obj"]),
    ] {
        line_refused(
            &folder,
            &format!("render scene.toml -o a.png {options}"),
            2,
            words,
        );
    }
    folder.put(
        "scene.toml",
        SCENE.replace("spp = 1", "crop = [0, 0, 8, 8]"),
    );
    let small = "render scene.toml -o a.png --size 7x7";
    line_refused(&folder, small, 2, &["0,0,8,8", "7x7"]);
}

#[test]
fn resume_begins_ends_and_refuses() {
    let folder = folder();
    done(&folder, "render scene.toml -o a.exr --resume");
    let first = std::fs::read(folder.path("a.exr")).unwrap();
    let line = stdout(&done(&folder, "render scene.toml -o a.exr --resume"));
    assert_eq!(line, "a.exr is complete\n");
    for (options, words) in [
        ("--seed 1", &["seed", "found 0", "expected 1"][..]),
        ("--spp 13", &["of 12 spp", "of 13 spp"]),
        ("--crop 0,0,4,4", &["0,0,16,12", "0,0,4,4"]),
        ("--aovs Z", &["aovs", "expected Z"]),
        ("--clamp 3", &["clamp", "found off"]),
    ] {
        let words = [&["a.exr", "scene.toml"], words].concat();
        line_refused(
            &folder,
            &format!("render scene.toml -o a.exr --resume {options}"),
            3,
            &words,
        );
    }
    folder.put(
        "scene.toml",
        folder
            .text("scene.toml")
            .replace("scale = 0.2", "scale = 0.3"),
    );
    line_refused(
        &folder,
        "render scene.toml -o a.exr --resume",
        3,
        &["scene_hash", "found", "expected"],
    );
    assert_eq!(std::fs::read(folder.path("a.exr")).unwrap(), first);
    folder.put("a.exr", &first[..first.len() / 3]);
    line_refused(
        &folder,
        "render scene.toml -o a.exr --resume",
        3,
        &["a.exr"],
    );
}

/// Runs until the first tenth is done, sends a signal, and waits for the end.
#[cfg(unix)]
fn interrupted(folder: &Folder, arguments: &str, signal: &str) -> (Option<i32>, String) {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_prismarch"))
        .args(arguments.split(' '))
        .current_dir(folder.path(""))
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let begun = lines.by_ref().any(|line| line.unwrap().contains('%'));
    assert!(begun, "nothing was rendered");
    // The shell's own `kill`: the program of that name is not on every system.
    let kill = Command::new("sh")
        .args(["-c", &format!("kill -s {signal} {}", child.id())])
        .status();
    assert!(kill.unwrap().success());
    let rest: Vec<String> = lines.map(Result::unwrap).collect();
    (child.wait().unwrap().code(), rest.join("\n"))
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_run_that_goes_on_to_the_same_bits() {
    let folder = folder();
    for options in ["", " --progressive --filter mitchell"] {
        let render = format!("render scene.toml --spp 6000 --aovs N,object,variance{options} -o");
        let (code, message) = interrupted(&folder, &format!("{render} a.exr"), "TERM");
        assert_eq!(code, Some(128 + 15), "{message}");
        assert!(
            message.contains("a.exr is partial, --resume goes on"),
            "{message}"
        );
        assert_eq!(attributes(&folder, "a.exr")["partial"], "true");
        line_refused(&folder, "merge a.exr -o b.exr", 3, &["a.exr", "partial"]);
        line_refused(
            &folder,
            &format!("{render} a.exr --resume --seed 3"),
            3,
            &["seed"],
        );
        let (code, message) = interrupted(&folder, &format!("{render} a.exr --resume"), "INT");
        assert_eq!(code, Some(128 + 2), "{message}");
        done(&folder, &format!("{render} a.exr --resume"));
        done(&folder, &format!("{render} whole.exr"));
        assert!(
            pixels(&folder, "a.exr") == pixels(&folder, "whole.exr"),
            "{options}"
        );
        assert_eq!(
            attributes(&folder, "a.exr"),
            attributes(&folder, "whole.exr")
        );
    }
    let png = "render scene.toml --spp 6000 -o a.png";
    let (code, message) = interrupted(&folder, png, "INT");
    assert_eq!(code, Some(128 + 2), "{message}");
    assert!(message.contains("a.png is partial") && folder.path("a.png").exists());
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_old_file() {
    let folder = folder();
    done(&folder, "render scene.toml -o a.exr --spp 1");
    let before = std::fs::read(folder.path("a.exr")).unwrap();
    let options = ["render", "scene.toml", "-o", "a.exr", "--progressive"];
    let output = folder.run_on_full_disk(&options);
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert_eq!(std::fs::read(folder.path("a.exr")).unwrap(), before);
}

#[cfg(feature = "embree")]
#[test]
fn the_cost_is_counted_alike_by_every_backend_and_number_of_threads() {
    let folder = folder();
    let render = |name: &str, options: &str| {
        let what = format!("render scene.toml -o {name}.exr --integrator cost{options}");
        done(&folder, &what);
        pixels(&folder, &format!("{name}.exr")).1
    };
    let costs = |pixels: &BTreeMap<String, Vec<u32>>| -> Vec<f32> {
        pixels["cost"].iter().copied().map(f32::from_bits).collect()
    };
    for march in ["", " --march uniform --dt 0.25"] {
        let one = render("one", &format!("{march} --threads 1"));
        assert!(one == render("two", &format!("{march} --threads 2")));
        // Of a plane's two triangles Embree may name the other one on the diagonal, but the work is the same.
        let bvh = render("bvh", &format!("{march} --backend bvh"));
        for channel in ["R", "G", "B", "cost"] {
            assert!(one[channel] == bvh[channel], "{march} {channel}");
        }
        let costs = costs(&one);
        assert!(costs.iter().all(|cost| (0.0..1000.0).contains(cost)));
        assert!(costs.iter().any(|&cost| cost > 1.0));
    }
    done(&folder, "render scene.toml -o beauty.exr");
    assert!(!pixels(&folder, "beauty.exr").1.contains_key("cost"));
    done(
        &folder,
        "render scene.toml -o a.exr --integrator cost --samples 0..6",
    );
    done(
        &folder,
        "render scene.toml -o b.exr --integrator cost --samples 6..12",
    );
    done(&folder, "merge a.exr b.exr -o merged.exr");
    let exact = render("exact", "");
    for (a, b) in costs(&pixels(&folder, "merged.exr").1)
        .iter()
        .zip(costs(&exact))
    {
        assert!((a - b).abs() <= 1e-5 * b, "{a} {b}");
    }
}
