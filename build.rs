//! Finds Embree, compiles `ffi/` against it and makes the Rust declarations of `ffi/shim.h`.
//!
//! Environment: `EMBREE_DIR` (a prefix with include/ and lib/) instead of the system's places,
//! `EMBREE_VERSION` (3 or 4) instead of the newer one found.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "embree")]
    if let Err(message) = embree::build() {
        for line in message.lines() {
            println!("cargo::error={line}");
        }
    }
}

#[cfg(feature = "embree")]
mod embree {
    use std::env;
    use std::panic;
    use std::path::{Path, PathBuf};

    const PREFIXES: [&str; 4] = ["/usr", "/usr/local", "/opt/homebrew", "/opt/local"];
    const SOURCES: [&str; 4] = [
        "ffi/shim.c",
        "ffi/user_geometry.c",
        "ffi/point_query.c",
        "ffi/foreign.c",
    ];
    const INSTALL_HINT: &str = "install Embree and libclang (Debian, Ubuntu: `apt install libembree-dev libclang-dev`), \
        or set EMBREE_DIR to a prefix that has include/embree4 or include/embree3, \
        or build without Embree: `--no-default-features --features bvh`";

    struct Embree {
        major: u32,
        /// As in the headers, like `4.3.3`.
        version: String,
        include: PathBuf,
        lib: PathBuf,
    }

    pub fn build() -> Result<(), String> {
        for variable in ["EMBREE_DIR", "EMBREE_VERSION"] {
            println!("cargo::rerun-if-env-changed={variable}");
        }
        for file in SOURCES.iter().chain(&[
            "ffi/shim.h",
            "ffi/prismarch.h",
            "ffi/embree.h",
            "ffi/lanes.h",
        ]) {
            println!("cargo::rerun-if-changed={file}");
        }
        let embree = find()?;
        if env::var_os("CARGO_FEATURE_EMBREE4_SYS").is_some() && embree.major != 4 {
            return Err(format!(
                "the feature embree4-sys needs Embree 4; found Embree {}",
                embree.version
            ));
        }
        let config = header(&embree.include, embree.major);
        println!("cargo::rerun-if-changed={}", config.display());
        println!("cargo::rustc-env=PRISMARCH_EMBREE={}", embree.version);
        // For the C test of the shim.
        println!(
            "cargo::rustc-env=PRISMARCH_EMBREE_INCLUDE={}",
            embree.include.display()
        );
        println!(
            "cargo::rustc-env=PRISMARCH_EMBREE_LIB={}",
            embree.lib.display()
        );
        compile(&embree)?;
        generate()?;
        link(&embree);
        Ok(())
    }

    fn find() -> Result<Embree, String> {
        let majors = match env::var("EMBREE_VERSION") {
            Err(_) => vec![4, 3],
            Ok(v) if v == "4" || v == "3" => v.parse().into_iter().collect(),
            Ok(v) => return Err(format!("EMBREE_VERSION is `{v}`; expected 3 or 4")),
        };
        let given = env::var_os("EMBREE_DIR").filter(|dir| !dir.is_empty());
        let prefixes: Vec<PathBuf> = match &given {
            Some(dir) => vec![PathBuf::from(dir)],
            None => PREFIXES.map(PathBuf::from).to_vec(),
        };
        for &major in &majors {
            for prefix in &prefixes {
                if let Some(embree) = in_prefix(prefix, major) {
                    return Ok(embree);
                }
            }
        }
        let wanted: Vec<String> = majors.iter().map(|m| format!("Embree {m}")).collect();
        let places: Vec<String> = prefixes.iter().map(|p| p.display().to_string()).collect();
        Err(format!(
            "{} was not found (headers and library) under {}: {INSTALL_HINT}",
            wanted.join(" or "),
            places.join(", ")
        ))
    }

    fn in_prefix(prefix: &Path, major: u32) -> Option<Embree> {
        let include = prefix.join("include");
        let version = header_version(&header(&include, major), major)?;
        let arch = env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
        let lib = [
            "lib".into(),
            format!("lib/{arch}-linux-gnu"),
            "lib64".into(),
        ]
        .iter()
        .map(|dir: &String| prefix.join(dir))
        .find(|dir| {
            ["so", "dylib"]
                .iter()
                .any(|ext| dir.join(format!("libembree{major}.{ext}")).exists())
        })?;
        Some(Embree {
            major,
            version,
            include,
            lib,
        })
    }

    fn header(include: &Path, major: u32) -> PathBuf {
        include.join(format!("embree{major}/rtcore_config.h"))
    }

    fn header_version(header: &Path, major: u32) -> Option<String> {
        let text = std::fs::read_to_string(header).ok()?;
        let quoted = text
            .lines()
            .find_map(|line| line.strip_prefix("#define RTC_VERSION_STRING"))?;
        let version = quoted.trim().trim_matches('"').to_string();
        version.starts_with(&format!("{major}.")).then_some(version)
    }

    fn compile(embree: &Embree) -> Result<(), String> {
        let mut build = cc::Build::new();
        build
            .files(SOURCES)
            .include(&embree.include)
            .define("PM_EMBREE_MAJOR", embree.major.to_string().as_str())
            .std("c11")
            .opt_level(2)
            .warnings(true)
            .extra_warnings(true)
            .warnings_into_errors(true)
            .cargo_metadata(true);
        build.try_compile("prismarch_shim").map_err(|error| {
            format!(
                "ffi/ does not compile against Embree {}: {error}",
                embree.version
            )
        })
    }

    /// Rust declarations of what both headers declare.
    fn generate() -> Result<(), String> {
        declare("ffi/shim.h", "shim.rs", "(pm|PM)_.*", &[])?;
        let own = ["-DPRISMARCH_WITHOUT_EMBREE"];
        declare(
            "ffi/prismarch.h",
            "prismarch.rs",
            "(prismarch|PRISMARCH)_.*",
            &own,
        )
    }

    /// bindgen panics where libclang is missing: that becomes an ordinary message here.
    fn declare(header: &str, out: &str, items: &str, arguments: &[&str]) -> Result<(), String> {
        let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set")?).join(out);
        let hook = panic::take_hook();
        panic::set_hook(Box::new(|_| {}));
        let bindings = panic::catch_unwind(|| {
            bindgen::Builder::default()
                .header(header)
                .clang_args(arguments)
                .allowlist_item(items)
                .rust_edition(bindgen::RustEdition::Edition2024)
                .generate_comments(false)
                .layout_tests(true)
                .generate()
        });
        panic::set_hook(hook);
        match bindings {
            Err(_) => Err(format!("libclang was not found: {INSTALL_HINT}")),
            Ok(Err(error)) => Err(format!("no bindings could be made from {header}: {error}")),
            Ok(Ok(bindings)) => bindings
                .write_to_file(&out)
                .map_err(|error| format!("cannot write {}: {error}", out.display())),
        }
    }

    fn link(embree: &Embree) {
        let lib = embree.lib.display();
        println!("cargo::rustc-link-search=native={lib}");
        println!("cargo::rustc-link-lib=embree{}", embree.major);
        // Until 1.0 every minor version may break what was linked.
        if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
            let [major, minor] = ["MAJOR", "MINOR"]
                .map(|part| env::var(format!("CARGO_PKG_VERSION_{part}")).unwrap_or_default());
            println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libprismarch.so.{major}.{minor}");
        }
        // A prefix of the user's own is not on the loader's path.
        if env::var_os("EMBREE_DIR").is_some() {
            println!("cargo::rustc-link-arg=-Wl,-rpath,{lib}");
        }
    }
}
