#![no_main]

#[allow(dead_code, reason = "each target runs one of them")]
#[path = "../drivers/mod.rs"]
mod drivers;

libfuzzer_sys::fuzz_target!(|data: &[u8]| drivers::files::compressed(data));
