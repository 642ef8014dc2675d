//! The entrance of bytes that the variable `ENTRANCE` names.
#![no_main]

use gyronet_host_tests::entrance::ALL;
use std::sync::LazyLock;

static RUN: LazyLock<fn(&[u8])> = LazyLock::new(|| {
    let name = std::env::var("ENTRANCE").expect("ENTRANCE names one of them");
    ALL.iter().find(|entrance| entrance.name == name).expect("an entrance of that name").run
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| RUN(data));
