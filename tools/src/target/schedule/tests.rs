use super::cost::{COPY, EXCEPTION, LINE_READ, LINES, TICKS, TURNS, VECTOR};
use super::*;
use crate::target::tasks::{Activation, KINDS, Least};

/// Creates a handler whose activation takes this many cycles in total, without and with wait states.
fn handler(name: &str, priority: u8, cycles: Option<[u64; 2]>) -> Handler {
    let ran = cycles.map(|[zero, five]| Activation {
        runs: 1,
        instructions: zero,
        cycles: Cycles { zero: zero - EXCEPTION, five: five - EXCEPTION - VECTOR },
        fills: 0,
    });
    let burst = Activation {
        runs: 1,
        instructions: 9,
        cycles: Cycles { zero: 1_000_000, five: 2_000_000 },
        fills: 0,
    };
    // An activation that fills the caches costs the preempted task all lines.
    let full = EXCEPTION + VECTOR + LINES * LINE_READ;
    Handler {
        name: name.to_owned(),
        priority,
        activations: [ran, None, None, None, Some(burst)],
        least: Least { cycles: Cycles { zero: 168 - EXCEPTION, five: 840 - full }, fills: LINES },
        looking: Least { cycles: Cycles { zero: 336 - EXCEPTION, five: 1_008 - full }, fills: LINES },
        code: 100,
    }
}

fn tasks(window: u64) -> Tasks {
    let mut handlers = vec![
        handler("USART1", 4, Some([168, 336])),
        handler("SysTick", 4, Some([168, 336])),
        handler("USART2", 4, Some([168, 168])),
        handler("USART6", 3, Some([168, 168])),
        handler("CAN1_RX0", 3, None),
        handler("UART4", 2, Some([168 * 40, 168 * 50])),
        handler("UART5", 1, Some([window, window])),
    ];
    for other in handlers.iter_mut().filter(|handler| !handler.name.starts_with("USART")) {
        // Only serial lines have activations that move many bytes.
        other.activations[KINDS - 1] = None;
    }
    // A sample.
    handlers[5].activations[1] = Some(Activation {
        runs: 1,
        instructions: 1,
        cycles: Cycles { zero: 168 * 60 - EXCEPTION, five: 168 * 80 - EXCEPTION - VECTOR - 2 * LINE_READ },
        fills: 2,
    });
    let off = |us: u64| Cycles { zero: 168 * us, five: 336 * us };
    Tasks { handlers, all_off: off(1), some_off: off(2) }
}

#[test]
fn responses_by_hand() {
    let schedule = Schedule::new(&tasks(168_000), None).unwrap();
    let task = |name: &str| schedule.0.iter().find(|task| task.name == name).unwrap();
    let close = |name: &str, us: [f64; 2]| {
        let Task { response_us, response_5ws_us, .. } = task(name);
        for (response, us) in [response_us, response_5ws_us].into_iter().zip(us) {
            let response = response.unwrap();
            assert!((response - us).abs() < 1e-6, "{name}: {response}, not {us}\n{schedule}");
        }
    };
    // The line's own microsecond, the tick's, and the blocking, all of them twice with wait states; and the other
    // line's.
    close("imu_line", [4.0, 7.0]);
    // The line's own cost, that of imu_line, the tick and the other line, and the blocking; and CAN, whose bound is
    // from its code: 100 halfwords are 13 lines, each missed twice, and once more by the preempted task. With wait
    // states the other line's next byte arrives in that time.
    let can = 300 + COPY + EXCEPTION;
    let can_5ws = can + 2 * 13 * LINE_READ + VECTOR + 13 * LINE_READ;
    close("service_line", [5.0 + can as f64 / 168.0, 9.0 + can_5ws as f64 / 168.0]);
    assert_eq!((task("can_frames").runs, task("can_frames").cycles), (0, can));
    // 60 us with a sample, 40 us without, TURNS activations of 1 us, and TICKS that check all lines in 2 us.
    assert_eq!(task("output").cycles, 168 * (100 + TURNS + 2 * TICKS));
    assert_eq!(task("output").cycles_5ws, 168 * (130 + 5 * TURNS + 6 * TICKS));
    assert!(schedule.met(), "{schedule}");
}

/// With a deadline of 20 ms for a window and everything that preempts it, 13 ms leave a quarter to spare and 16 ms
/// do not.
#[test]
fn a_deadline_met_without_spare_time_is_missed() {
    let window = |us: u64| Schedule::new(&tasks(168 * us), None).unwrap();
    let response = |schedule: &Schedule| schedule.0.last().unwrap().response_5ws_us.unwrap();
    let (spare, late) = (window(11_000), window(14_000));
    assert!(spare.met() && response(&spare) > 11_000.0, "{spare}");
    assert!(!late.met() && response(&late) < 20_000.0, "{late}");
}

#[test]
fn a_deadline_that_is_missed_is_reported() {
    let schedule = Schedule::new(&tasks(168 * 21_000), None).unwrap();
    assert!(!schedule.met() && schedule.to_string().contains("used two samples later: MISSED"), "{schedule}");
    let mut more = tasks(168_000);
    more.handlers[0].name = "SPI1".to_owned();
    assert_eq!(Schedule::new(&more, None), None);
}
