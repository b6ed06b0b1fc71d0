//! One kind of file, named by PRISMARCH_FUZZ_LOADER: see `loaders`. Its folder is made anew in the system's temporary folder for each process.
#![no_main]

#[allow(dead_code)] // the seeded run has uses for more of it
#[path = "../loaders/mod.rs"]
mod loaders;

use std::sync::OnceLock;

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use loaders::{Bench, end_at_own_panics, find, mutate};

fn bench() -> &'static Bench<'static> {
    static BENCH: OnceLock<Bench> = OnceLock::new();
    BENCH.get_or_init(|| {
        end_at_own_panics();
        let name = std::env::var("PRISMARCH_FUZZ_LOADER").unwrap_or_default();
        let target =
            find(&name).unwrap_or_else(|| panic!("PRISMARCH_FUZZ_LOADER={name}: no such target"));
        let folder = format!("prismarch-fuzz-{name}-{}", std::process::id());
        target.bench(&std::env::temp_dir().join(folder))
    })
}

fuzz_target!(|bytes: &[u8]| {
    bench().run(bytes);
});

fuzz_mutator!(
    |data: &mut [u8], size: usize, max_size: usize, _seed: u32| {
        let size = fuzzer_mutate(data, size, max_size);
        let mut mended = data[..size].to_vec();
        mutate::mend(&mut mended);
        data[..size].copy_from_slice(&mended);
        size
    }
);
