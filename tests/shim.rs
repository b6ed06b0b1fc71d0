//! Compiles the C test of the shim with warnings denied, against the Embree of this build, and runs it.
#![cfg(feature = "embree")]

use std::path::Path;
use std::process::Command;

#[test]
fn packets_agree_with_single_rays() {
    let dir = tempfile::tempdir().unwrap();
    let program = dir.path().join("packets");
    let lib = env!("PRISMARCH_EMBREE_LIB");
    let major = env!("PRISMARCH_EMBREE").split('.').next().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_string());
    let compiled = Command::new(compiler)
        .args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror"])
        .arg(format!("-DPM_EMBREE_MAJOR={major}"))
        .args(["-I", env!("PRISMARCH_EMBREE_INCLUDE")])
        .args(["tests/shim/packets.c", "ffi/point_query.c"].map(|file| root.join(file)))
        .arg("-o")
        .arg(&program)
        .args([&format!("-L{lib}"), &format!("-Wl,-rpath,{lib}")])
        .args([&format!("-lembree{major}"), "-lm"])
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{told}");

    let ran = Command::new(&program).output().unwrap();
    let told = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{told}");
}
