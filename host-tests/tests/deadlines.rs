//! Every task of the flashed image meets its deadline at 168 MHz, by what each costs while the
//! image runs in the emulator (modelled cycles).

use gyronet_host_tests::require::{Need, wants};
use gyronet_host_tests::{image, qemu};
use gyronet_tools::schedule::Schedule;
use gyronet_tools::{target_bench, task_bench};

#[test]
fn every_deadline_is_met() {
    let test = "every_deadline_is_met";
    let Some(()) = qemu::available(test) else { return };
    let Some(elf) = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR")) else { return };
    let plugin = target_bench::plugin(&target_bench::workspace());
    let plugin = plugin.ok_or_else(|| "no C compiler for the instruction counter".to_owned());
    let Some(plugin) = wants(test, Need::Qemu, plugin) else { return };
    let tasks = task_bench::measure(&elf, &plugin).unwrap_or_else(|error| panic!("{error}"));
    let schedule = Schedule::new(&tasks).expect("deadlines of all tasks are known");
    println!("{tasks}\n{schedule}");
    let ran = |handler: &&task_bench::Handler| handler.least > 0;
    // The emulator has no CAN controller.
    assert_eq!(tasks.handlers.iter().filter(ran).count(), tasks.handlers.len() - 1);
    assert!(schedule.met(), "{schedule}");
}
