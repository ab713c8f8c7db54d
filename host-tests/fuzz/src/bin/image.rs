//! `cargo xtask fuzz image`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::image::run(data));
