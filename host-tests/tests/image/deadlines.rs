//! Every task of the flashed image, with the largest model that it can run, meets its deadline at 168 MHz and 5 wait
//! states with a quarter of it to spare, by what each costs while the image runs in the emulator (modelled cycles).

use gyronet_host_tests::require::{Need, wants};
use gyronet_host_tests::{image, qemu};
use gyronet_tools::target::bench;
use gyronet_tools::target::schedule::Schedule;
use gyronet_tools::target::tasks::{self, Cycles};

/// Instructions and cycles of a window of FoGNet, as `target_counts` holds them at most.
const FOGNET: (u64, Cycles) = (23_800_000, Cycles { zero: 26_100_000, five: 32_000_000 });
/// Cycles at 5 wait states for which idle may keep the output task out, by the copy of FoGNet's window or another.
const KEPT_OUT: u64 = 5_000;

#[test]
fn every_deadline_is_met() {
    let test = "every_deadline_is_met";
    let Some(()) = qemu::available(test) else { return };
    let Some(elf) = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR")) else { return };
    let plugin = bench::plugin(&bench::workspace());
    let plugin = plugin.ok_or_else(|| "no C compiler for the instruction counter".to_owned());
    let Some(plugin) = wants(test, Need::Qemu, plugin) else { return };
    let tasks = tasks::measure(&elf, &plugin).unwrap_or_else(|error| panic!("{error}"));
    let schedule = Schedule::new(&tasks, Some(FOGNET)).expect("deadlines of all tasks are known");
    println!("{tasks}\n{schedule}");
    // The emulator has no CAN controller, and its supply does not fall.
    let never = tasks.handlers.iter().filter(|handler| handler.least.cycles.zero == 0);
    let never: Vec<&str> = never.map(|handler| &*handler.name).collect();
    assert_eq!(never, ["PVD", "CAN1_TX", "CAN1_RX0"]);
    // Lines and the tick run from SRAM, and read nothing from flash: they take no line of the caches from
    // what they preempt.
    for name in ["USART1", "USART2", "USART3", "USART6", "SysTick"] {
        let handler = tasks.handlers.iter().find(|handler| handler.name == name).expect(name);
        let fills: Vec<u64> = handler.activations.iter().flatten().map(|ran| ran.fills).collect();
        assert!(!fills.is_empty() && fills.iter().all(|fills| *fills == 0), "{handler}");
    }
    assert!(schedule.met(), "{schedule}");
    assert!(tasks.some_off.five <= KEPT_OUT, "{}", tasks.some_off);
}
