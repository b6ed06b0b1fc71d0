//! Every kind of file that is read, damaged in ways drawn from a seed: taken or refused in a sentence, within a limit of memory, without a
//! panic. `script/fuzz` looks further, guided by coverage.
#![cfg(feature = "bvh")]

#[path = "../fuzz/loaders/mod.rs"]
mod loaders;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Once;

use loaders::mutate::{Random, damaged, mend};
use loaders::{TARGETS, Target};

/// Damaged files per target. Readers know nothing of Embree: one lane, that without it, runs them all, in a minute.
const INPUTS: usize = if cfg!(feature = "embree") { 500 } else { 5000 };

/// Most address space of the process: what all threads may have at once, whatever headers claim.
#[cfg(target_os = "linux")]
const MOST_BYTES: u64 = 4 << 30;

/// Files that are sound have names that begin with this; the others once did harm, or may be refused.
const SOUND: &str = "good-";

/// Within memory, and so that the input of a panic stays in its folder.
fn prepare() {
    static PREPARED: Once = Once::new();
    PREPARED.call_once(|| {
        loaders::end_at_own_panics();
        #[cfg(target_os = "linux")]
        {
            use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
            let limit = Rlimit {
                current: Some(MOST_BYTES),
                ..getrlimit(Resource::As)
            };
            setrlimit(Resource::As, limit).unwrap();
        }
    });
}

fn corpus(target: &Target) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/corpus")
        .join(target.name);
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("{folder:?}: {error}"))
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    paths
        .iter()
        .map(|path| (name(path), fs::read(path).unwrap()))
        .collect()
}

fn holds(name: &str) {
    prepare();
    let target = loaders::find(name).unwrap();
    // Of this run alone: two at once would read each other's inputs.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let bench = target.bench(folder.path());
    let files = corpus(target);
    assert!(
        files.iter().any(|(name, _)| name.starts_with(SOUND)),
        "no sound file for {name}"
    );
    for (file, bytes) in &files {
        let outcomes = bench.run(bytes);
        let is_read = outcomes.iter().any(Result::is_ok);
        assert!(
            is_read || !file.starts_with(SOUND),
            "{name}/{file}: {outcomes:?}"
        );
    }
    let mut random = Random::new(1);
    let (mut ways, mut taken) = (0, 0);
    for _ in 0..INPUTS {
        let (_, whole) = &files[random.below(files.len())];
        let (_, other) = &files[random.below(files.len())];
        let mut bytes = damaged(&mut random, whole, other, target.is_text);
        if random.below(4) > 0 {
            mend(&mut bytes);
        }
        let outcomes = bench.run(&bytes);
        ways += outcomes.len();
        taken += outcomes.iter().filter(|outcome| outcome.is_ok()).count();
    }
    println!("{name}: {INPUTS} damaged files, {taken} of {ways} readings taken");
    // Damage that is always refused, or never, asks nothing.
    assert!(taken > 0 && taken < ways, "{name}: {taken} of {ways}");
}

#[test]
fn every_target_has_a_test() {
    let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
    assert_eq!(names, TESTED);
}

macro_rules! targets {
    ($($name:ident)*) => {
        const TESTED: [&str; 16] = [$(stringify!($name)),*];
        $(#[test] fn $name() { holds(stringify!($name)) })*
    };
}

targets!(png jpeg tiff exr hdr webp bmp tga pnm obj ply gltf glb mtl scene frame);
