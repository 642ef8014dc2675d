//! What a sequence of 20 minutes costs: processor time of this process, and its memory. One test,
//! so that nothing else runs in it.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet_host_tests::require::skipped;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::paper::sequence::Sequence;
use gyronet_tools::simulate::layout::{self, Layout, Set};
use std::path::Path;

/// Processor time so far, s; `None` where the system does not say (only Linux does).
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // Behind the name, which is in brackets: utime and stime are fields 14 and 15, in 10 ms.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |k: usize| fields.get(k)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

/// Most memory so far, MB.
fn peak_megabytes() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

#[test]
fn import_and_replay_of_twenty_minutes() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sequence_cost");
    let spec = &Set::Test.specs(Layout::Kaist)[0];
    layout::write(spec, &folder, || {}).expect("a scratch folder");
    let Some(begin) = processor_seconds() else {
        skipped("import_and_replay_of_twenty_minutes", "no /proc/self/stat");
        return;
    };
    let sequence = Sequence::read(&folder, |_| {}).expect("it was just written");
    std::fs::remove_dir_all(&folder).expect("ours");
    let imported = processor_seconds().expect("it was there") - begin;
    let after_import = peak_megabytes().expect("as the other");
    assert_eq!(sequence.files[1].rows, 1_200_000);

    let mut network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).expect("bundled"));
    let mut recording = sequence.recording().expect("it has a gyro");
    // The overflow checks that a release build has not cost several times as much: two minutes do.
    if cfg!(debug_assertions) {
        recording.rows.truncate(12_000);
    }
    let drive = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut network, || {})
        .expect("it stands at first");
    let replayed = processor_seconds().expect("it was there") - begin - imported;
    let peak = peak_megabytes().expect("as the other");
    println!(
        "20 min of simulated KAIST: import {imported:.2} s and {after_import:.0} MB, \
         replay of {} samples {replayed:.2} s{}, {peak:.0} MB in all",
        drive.steps.len(),
        if cfg!(debug_assertions) { " (with overflow checks)" } else { "" }
    );
    assert!(imported <= 3.0, "{imported}");
    assert!(peak <= 300.0, "{peak}");
    if !cfg!(debug_assertions) {
        assert!(replayed <= 10.0, "{replayed}");
    }
}
