//! Runs the program in a folder of its own.
#![allow(dead_code)] // each test program uses its own part

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use prismarch::image::{ExrSamples, read_exr, write_png_gray16};
use tempfile::TempDir;

/// A square of two triangles, 2 by 2 around the origin in the plane z = 0, seen from +z.
pub const QUAD: &str = "\
v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
vn 0 0 1
f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1
";

/// The quad displaced by `flat.png`.
pub const SCENE: &str = "\
[film]
width = 16
height = 12
spp = 1

[[mesh]]
file = \"quad.obj\"

[mesh.displacement]
map = \"flat.png\"
scale = 0.2
";

/// What the height 32768 of `flat.png` displaces by under the scale of [`SCENE`].
pub const FLAT: f64 = 0.2 * 32768.0 / 65535.0;

pub struct Folder(TempDir);

/// Exit code of wrong usage.
pub const USAGE: i32 = 2;
/// Exit code of bad input.
pub const INPUT: i32 = 3;
/// Exit code of an output that cannot be written.
pub const OUTPUT: i32 = 4;

impl Folder {
    /// An empty folder.
    pub fn empty() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with `quad.obj`, `flat.png` (8x8 texels of height 32768) and `scene.toml`.
    pub fn with_quad() -> Self {
        Self::empty().filled()
    }

    /// The same in a file system without a disk, if there is one: many small files do not wait for it there.
    pub fn in_memory() -> Self {
        tempfile::tempdir_in("/dev/shm")
            .map_or_else(|_| Self::empty(), Self)
            .filled()
    }

    fn filled(self) -> Self {
        let folder = self;
        folder.put("quad.obj", QUAD);
        folder.put("scene.toml", SCENE);
        write_png_gray16(&folder.path("flat.png"), 8, 8, &[32768; 64]).unwrap();
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    pub fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// The names of all files, hidden ones too.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// What all files hold, by name; links are told by what they lead to.
    pub fn contents(&self) -> BTreeMap<String, Option<Vec<u8>>> {
        let names = self.names().into_iter();
        names
            .map(|name| (name.clone(), std::fs::read(self.path(&name)).ok()))
            .collect()
    }

    /// Runs the program here.
    pub fn run(&self, arguments: &[&str]) -> Output {
        self.run_with_input(arguments, "")
    }

    /// Runs the program here with kernels of the lowest SIMD level.
    pub fn run_at_baseline(&self, arguments: &[&str]) -> Output {
        let mut program = Command::new(env!("CARGO_BIN_EXE_prismarch"));
        program.env("PRISMARCH_SIMD", "baseline");
        self.finish(program, arguments, "")
    }

    pub fn run_with_input(&self, arguments: &[&str], input: &str) -> Output {
        let program = Command::new(env!("CARGO_BIN_EXE_prismarch"));
        self.finish(program, arguments, input)
    }

    /// Runs the program here, unable to write files of more than 512 bytes: what a full disk does, without one.
    #[cfg(unix)]
    pub fn run_on_full_disk(&self, arguments: &[&str]) -> Output {
        let mut shell = Command::new("sh");
        // An ignored signal stays ignored: the write fails instead of ending the program.
        shell.args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\""]);
        shell.arg(env!("CARGO_BIN_EXE_prismarch"));
        self.finish(shell, arguments, "")
    }

    /// Runs the program here with at most so many KB of address space.
    #[cfg(unix)]
    pub fn run_in_memory(&self, kilobytes: u64, arguments: &[&str]) -> Output {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("ulimit -v {kilobytes}; exec \"$0\" \"$@\"")]);
        shell.arg(env!("CARGO_BIN_EXE_prismarch"));
        self.finish(shell, arguments, "")
    }

    fn finish(&self, mut program: Command, arguments: &[&str], input: &str) -> Output {
        let mut child = program
            .args(arguments)
            .current_dir(self.0.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // A program that ends before it has read its input is no failure of the test.
        let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
        child.wait_with_output().unwrap()
    }
}

/// The usual folder with one file replaced.
pub fn with(name: &str, bytes: impl AsRef<[u8]>) -> Folder {
    let folder = Folder::with_quad();
    folder.put(name, bytes);
    folder
}

/// The usual folder with a piece of the scene file replaced.
pub fn with_scene(from: &str, to: &str) -> Folder {
    assert!(SCENE.contains(from));
    with("scene.toml", SCENE.replace(from, to))
}

/// Runs the program on a line of arguments; it must succeed.
#[track_caller]
pub fn done(folder: &Folder, arguments: &str) -> Output {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = folder.run(&arguments);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        stderr(&output)
    );
    output
}

/// Runs the program and holds it to `code`, one error that has all of `words`, and unchanged files.
#[track_caller]
pub fn refused(folder: &Folder, arguments: &[&str], code: i32, words: &[&str]) {
    let before = folder.contents();
    let output = folder.run(arguments);
    is_refusal(&output, code, words);
    assert!(folder.contents() == before, "{arguments:?}: files changed");
}

/// The same of a line of arguments.
#[track_caller]
pub fn line_refused(folder: &Folder, arguments: &str, code: i32, words: &[&str]) {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    refused(folder, &arguments, code, words);
}

/// One error with this exit code and all of `words`, before anything was rendered.
#[track_caller]
pub fn is_refusal(output: &Output, code: i32, words: &[&str]) {
    let message = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{message}");
    assert_eq!(
        message.matches("prismarch: error: ").count(),
        1,
        "{message}"
    );
    assert!(!message.contains("rendering"), "{message}");
    for word in words {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

/// Where the window of an EXR file begins, and the bits of every channel by name.
pub type Pixels = ((i32, i32), BTreeMap<String, Vec<u32>>);

pub fn pixels(folder: &Folder, name: &str) -> Pixels {
    let picture = read_exr(&folder.path(name)).unwrap();
    let channels = picture.channels.into_iter().map(|channel| {
        let bits = match channel.samples {
            ExrSamples::F32(s) => s.into_iter().map(f32::to_bits).collect(),
            ExrSamples::U32(s) => s,
        };
        (channel.name, bits)
    });
    (picture.position, channels.collect())
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}
