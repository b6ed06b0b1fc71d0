//! Fuzz targets of everything that reads a file, one per kind of file.
//!
//! A target is a folder of sound files in which one is replaced by the input, and the scenes that read it. Whatever the input, a scene is loaded
//! and traced, or refused in a sentence that names a file of the folder. `fuzz_targets/loader.rs` runs a target under libFuzzer, tests/fuzzing.rs
//! runs all of them on mutations drawn from a seed; both begin with the files of `corpus/`.

pub mod mutate;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use glam::Vec3;
use prismarch::bvh::BvhTracer;
use prismarch::image::write_png_gray16;
use prismarch::ray::Ray;
use prismarch::render::film::{FrameFile, merge};
use prismarch::scene::Loaded;
use prismarch::trace::Tracer;

/// What is done with an input.
enum Reader {
    /// It is a file that each of these scenes names.
    Scenes(&'static [&'static str]),
    /// It is a scene file.
    Scene,
    /// It is a picture that this program has written.
    Frame,
}

/// A kind of file.
pub struct Target {
    /// Of the target, and of its folder in `corpus/`.
    pub name: &'static str,
    /// Name of the file that the input becomes.
    file: &'static str,
    reader: Reader,
    /// Whether the format is made of words and numbers.
    pub is_text: bool,
}

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n\
    mtllib lib.mtl\nusemtl one\nf 1/1/1 2/2/1 3/3/1\nusemtl two\nf 1/1/1 3/3/1 4/4/1\n";

const LIBRARY: &str =
    "newmtl one\nKd 0.8 0.8 0.8\nmap_Kd flat.png\nnewmtl two\nKd 1 1 1\ndisp flat.png\n";

macro_rules! picture {
    ($name:literal, $file:literal) => {
        Target {
            name: $name,
            file: $file,
            reader: Reader::Scenes(&[
                concat!(
                    "[[mesh]]\nfile = \"quad.obj\"\n[mesh.displacement]\nmap = \"",
                    $file,
                    "\"\nscale = 0.2\nseams = \"closed\"\n"
                ),
                concat!(
                    "[[mesh]]\nfile = \"quad.obj\"\nmaterial = \"m\"\n[[material]]\nname = \"m\"\nbase_color = { file = \"",
                    $file,
                    "\" }\nroughness = { file = \"",
                    $file,
                    "\", channel = \"r\" }\n"
                ),
                concat!(
                    "[[mesh]]\nfile = \"quad.obj\"\n[[light]]\ntype = \"environment\"\nfile = \"",
                    $file,
                    "\"\n"
                ),
            ]),
            is_text: false,
        }
    };
}

macro_rules! mesh {
    ($name:literal, $file:literal, $is_text:literal) => {
        Target {
            name: $name,
            file: $file,
            reader: Reader::Scenes(&[
                concat!("[[mesh]]\nfile = \"", $file, "\"\n"),
                concat!(
                    "[[mesh]]\nfile = \"",
                    $file,
                    "\"\nnormals = \"smooth\"\ncrease_angle = 40\n[mesh.displacement]\nmap = \"flat.png\"\nscale = 0.1\nseams = \"closed\"\n"
                ),
                concat!(
                    "[[mesh]]\nfile = \"",
                    $file,
                    "\"\ntexcoords = \"box\"\nup = \"z\"\nunit = 0.5\n[mesh.displacement]\nmap = \"flat.png\"\nscale = -0.1\nwrap = \"mirror\"\n"
                ),
                concat!(
                    "[[mesh]]\nfile = \"",
                    $file,
                    "\"\nsubdivide = 1\ncrease_angle = 40\ntransform = { scale = -2.0 }\n"
                ),
            ]),
            is_text: $is_text,
        }
    };
}

/// All targets.
pub const TARGETS: [Target; 16] = [
    picture!("png", "input.png"),
    picture!("jpeg", "input.jpg"),
    picture!("tiff", "input.tif"),
    picture!("exr", "input.exr"),
    picture!("hdr", "input.hdr"),
    picture!("webp", "input.webp"),
    picture!("bmp", "input.bmp"),
    picture!("tga", "input.tga"),
    picture!("pnm", "input.pnm"),
    mesh!("obj", "input.obj", true),
    mesh!("ply", "input.ply", false),
    mesh!("gltf", "input.gltf", true),
    mesh!("glb", "input.glb", false),
    Target {
        name: "mtl",
        file: "lib.mtl",
        reader: Reader::Scenes(&[
            "[[mesh]]\nfile = \"quad.obj\"\n",
            "[[mesh]]\nfile = \"quad.obj\"\n[mesh.displacement]\nscale = 0.1\n",
        ]),
        is_text: true,
    },
    Target {
        name: "scene",
        file: "input.toml",
        reader: Reader::Scene,
        is_text: true,
    },
    Target {
        name: "frame",
        file: "input.exr",
        reader: Reader::Frame,
        is_text: false,
    },
];

/// A target in its folder, ready for inputs.
pub struct Bench<'t> {
    target: &'t Target,
    folder: PathBuf,
    scenes: Vec<PathBuf>,
}

impl Target {
    /// Writes the sound files into `folder`, which is made if it is missing.
    pub fn bench(&self, folder: &Path) -> Bench<'_> {
        fs::create_dir_all(folder).unwrap();
        fs::write(folder.join("quad.obj"), QUAD).unwrap();
        fs::write(folder.join("lib.mtl"), LIBRARY).unwrap();
        let heights: Vec<u16> = (0..64).map(|i: u32| (i * 40_503) as u16).collect();
        write_png_gray16(&folder.join("flat.png"), 8, 8, &heights).unwrap();
        let texts = match self.reader {
            Reader::Scenes(texts) => texts,
            Reader::Scene | Reader::Frame => &[],
        };
        let scenes = texts.iter().enumerate().map(|(k, text)| {
            let path = folder.join(format!("scene{k}.toml"));
            fs::write(&path, text).unwrap();
            path
        });
        Bench {
            target: self,
            folder: folder.to_owned(),
            scenes: scenes.collect(),
        }
    }
}

impl Bench<'_> {
    /// Reads the input in every way there is. What came of each: nothing, or why it was refused.
    pub fn run(&self, bytes: &[u8]) -> Vec<Result<(), String>> {
        // The file stays: after a crash it is the input that did it.
        let input = self.folder.join(self.target.file);
        fs::write(&input, bytes).unwrap();
        match self.target.reader {
            Reader::Scenes(_) => self.scenes.iter().map(|scene| self.scene(scene)).collect(),
            Reader::Scene => vec![self.scene(&input)],
            Reader::Frame => vec![
                self.taken(FrameFile::read(&input)).map(drop),
                self.taken(merge(std::slice::from_ref(&input))).map(drop),
            ],
        }
    }

    fn scene(&self, path: &Path) -> Result<(), String> {
        self.taken(Loaded::from_file(path))
            .map(|loaded| trace(&loaded))
    }

    /// A refusal says which file it is about.
    fn taken<T, E: std::error::Error>(&self, result: Result<T, E>) -> Result<T, String> {
        result.map_err(|error| {
            let error = error.to_string();
            let folder = self.folder.display().to_string();
            assert!(error.contains(&folder), "no file is named in: {error}");
            error
        })
    }
}

/// From now on a panic of prismarch's own ends the process also where it would be caught, in what guards the decoders of other crates.
pub fn end_at_own_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !prismarch::files::is_guarded() {
            return usual(info);
        }
        let file = info.location().map_or("", |place| place.file());
        if !file.contains("/registry/") && !file.starts_with("/rustc/") {
            // Not by `eprintln`, which tests keep to themselves.
            let _ = writeln!(std::io::stderr(), "{info}");
            std::process::abort();
        }
    }));
}

/// What was loaded can be traced, its hits are points, and its lights and camera are numbers.
fn trace(loaded: &Loaded) {
    let seen = format!("{:?} {:?}", loaded.scene.lights, loaded.scene.camera);
    assert!(!seen.contains("NaN"), "{seen}");
    let Ok(world) = loaded.scene.world() else {
        return;
    };
    let Ok(tracer) = BvhTracer::new(&world) else {
        return;
    };
    for k in 0..16 {
        let across = Vec3::new((k % 4) as f32 - 1.5, (k / 4) as f32 - 1.5, 0.0) * 0.6;
        let ray = Ray::new(
            across + Vec3::new(0.1, 0.2, 5.0),
            Vec3::new(0.01, -0.02, -1.0),
        );
        if let Some(hit) = tracer.intersect(&ray) {
            let point = world.surface_point(&hit);
            assert!(
                !point.position.is_nan() && !point.shading_normal.is_nan(),
                "{point:?}"
            );
        }
    }
}

/// The target of this name.
pub fn find(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
