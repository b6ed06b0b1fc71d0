//! The declarations of `ffi/prismarch.h`, made by bindgen: what crosses the border has their layout.

#![allow(
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    dead_code,
    clippy::all,
    clippy::undocumented_unsafe_blocks
)]

include!(concat!(env!("OUT_DIR"), "/prismarch.rs"));
