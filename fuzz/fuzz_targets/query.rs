#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| { let _ = prismarch::prism::SimdLevel::detect(); let _ = data; });
