#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| gyronet_host_tests::entrance::run("asm330lhh", data));
