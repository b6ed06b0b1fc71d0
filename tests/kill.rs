//! Runs that are killed at any moment: the output is the old file or the new one, whole, and the next run tidies up.
#![cfg(unix)]

mod program;

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use prismarch::image::{read_exr, write_png_gray16};
use program::{Folder, Pixels, done, pixels};

const KILLS: usize = 100;
/// A whole run after this many that were killed.
const WHOLE: usize = 10;
/// Samples per pixel after each progressive pass.
const PASSES: [u32; 4] = [1, 2, 4, 8];
const RENDER: &str = "render scene.toml --size 32x24 --threads 1 --quiet";

/// The usual folder with bumps, so that pictures of two seeds differ.
fn folder() -> Folder {
    let folder = Folder::in_memory();
    let noise = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 16) as u16;
    let heights: Vec<u16> = (0..32 * 32).map(noise).collect();
    write_png_gray16(&folder.path("flat.png"), 32, 32, &heights).unwrap();
    folder
}

/// Uniform in [0, 1), the same in every run of the test: a linear congruential generator of 64 bits (Knuth's MMIX).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        let next = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = next.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn spawn(folder: &Folder, run: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_prismarch"))
        .args(run.split(' '))
        .current_dir(folder.path(""))
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

/// What is killed.
struct Victim<'a> {
    folder: &'a Folder,
    output: &'a str,
    /// Run i.
    run: &'a dyn Fn(usize) -> String,
    /// What is done before every run.
    prepare: &'a dyn Fn(),
    /// Whether this is an output of run i.
    is_new: &'a dyn Fn(usize, &Pixels) -> bool,
}

impl Victim<'_> {
    /// Kills each run at a moment within the length of a whole one, and a bit beyond.
    fn kill_many(&self) {
        let Self { folder, run, .. } = self;
        let mut dice = Dice(self.output.len() as u64);
        (self.prepare)();
        let begun = Instant::now();
        done(folder, &run(0));
        let length = begun.elapsed().as_secs_f64();
        let names = folder.names();
        for i in 0..KILLS {
            (self.prepare)();
            let before = self.read();
            let mut child = spawn(folder, &run(i));
            std::thread::sleep(Duration::from_secs_f64(1.1 * length * dice.roll()));
            child.kill().unwrap();
            child.wait().unwrap();
            assert!(
                self.read() == before || self.is_whole(i),
                "run {i} left neither the old file nor a new one"
            );
            let left = folder.names().into_iter().filter(|n| !names.contains(n));
            let strange: Vec<_> = left.filter(|name| !name.ends_with(".part")).collect();
            assert!(strange.is_empty(), "{strange:?}");
            if i % WHOLE == WHOLE - 1 {
                (self.prepare)();
                done(folder, &run(i));
                assert!(self.is_whole(i));
                assert_eq!(folder.names(), names, "what killed runs have left");
            }
        }
    }

    fn read(&self) -> Vec<u8> {
        std::fs::read(self.folder.path(self.output)).unwrap()
    }

    fn is_whole(&self, i: usize) -> bool {
        (self.is_new)(i, &pixels(self.folder, self.output))
    }
}

/// The pictures of a seed after every pass.
fn passes(folder: &Folder, seed: usize) -> Vec<Pixels> {
    let pass = |spp| {
        let run = format!("{RENDER} -o a.exr --seed {seed} --spp {spp}");
        done(folder, &run);
        pixels(folder, "a.exr")
    };
    PASSES.map(pass).into()
}

/// Whether the file is the picture after some pass, in all channels that a complete picture has.
fn is_pass(found: &Pixels, passes: &[Pixels]) -> bool {
    let has = |(name, bits): (&String, _)| found.1.get(name) == Some(bits);
    passes.iter().any(|pass| pass.1.iter().all(has))
}

#[test]
fn a_killed_render_leaves_the_old_picture_or_a_new_one() {
    let folder = folder();
    let expected = [0, 1].map(|seed| passes(&folder, seed));
    let victim = Victim {
        folder: &folder,
        output: "a.exr",
        run: &|i| format!("{RENDER} -o a.exr --spp 8 --progressive --seed {}", i % 2),
        prepare: &|| (),
        is_new: &|i, found| is_pass(found, &expected[i % 2]),
    };
    victim.kill_many();
}

#[test]
fn a_killed_run_leaves_what_the_next_goes_on_with() {
    let folder = folder();
    let expected = passes(&folder, 0);
    let run = format!("{RENDER} -o a.exr --spp 8 --progressive --resume");
    let is_partial = || {
        let picture = read_exr(&folder.path("a.exr")).unwrap();
        let partial = ("prismarch/partial".to_owned(), "true".to_owned());
        picture.attributes.contains(&partial)
    };
    let begin = || {
        std::fs::remove_file(folder.path("a.exr")).unwrap();
        let mut child = spawn(&folder, &run);
        while !folder.path("a.exr").exists() {
            std::thread::sleep(Duration::from_micros(100));
        }
        child.kill().unwrap();
        child.wait().unwrap();
    };
    let victim = Victim {
        folder: &folder,
        output: "a.exr",
        run: &|_| run.clone(),
        prepare: &|| {
            while !is_partial() {
                begin();
            }
        },
        is_new: &|_, found| is_pass(found, &expected),
    };
    victim.kill_many();
    done(&folder, &run);
    assert!(is_pass(&pixels(&folder, "a.exr"), &expected[3..]));
}

#[test]
fn a_killed_merge_leaves_the_old_picture_or_the_new_one() {
    let folder = folder();
    let merge = |seed| format!("merge {seed}a.exr {seed}b.exr -o merged.exr");
    let expected = [0, 1].map(|seed| {
        let part = format!("{RENDER} --spp 2 --seed {seed}");
        done(&folder, &format!("{part} --crop 0,0,12,24 -o {seed}a.exr"));
        done(&folder, &format!("{part} --crop 12,0,32,24 -o {seed}b.exr"));
        done(&folder, &merge(seed));
        pixels(&folder, "merged.exr")
    });
    let victim = Victim {
        folder: &folder,
        output: "merged.exr",
        run: &|i| merge(i % 2),
        prepare: &|| (),
        is_new: &|i, found| *found == expected[i % 2],
    };
    victim.kill_many();
}
