//! Firmware of the coprocessor, for an STM32F405: receives sensor bytes and sends CAN frames.
//!
//! Pins and bit rates are those of the board that the image is built for (`boards`).
//!
//! | line | use |
//! |---|---|
//! | USART1 | Xsens MTi |
//! | SPI1 | ICM-42688-P, BMI088 or ASM330LHH, where one is configured |
//! | USART3 | KVH DSP-1760 |
//! | UART4 | a GNSS receiver, where one is configured |
//! | USART2 | SLCAN |
//! | USART6 | service line: SLCAN with diagnosis alone |
//! | CAN1 | 500 kbit/s: messages, wheels, diagnosis |
//!
//! # What runs when
//! | priority | task | when | what |
//! |---|---|---|---|
//! | 4 | `tick` | 1 ms | board time; counts the bytes that DMA has received |
//! | 4, 3 | `imu_line`, `fog_line`, `slcan_line`, `gnss_line`; `service_line` | a damaged byte | counts it |
//! | 3 | `can_received`, `can_sent` | a frame | into and out of their queues |
//! | 3 | `can_went_off` | bus-off | notes the time |
//! | 2 | `output` | pended by `tick` when a message or time is due, `can_received`, `can_sent`, `window` | samples, frames, watchdog |
//! | 1 | `window` | pended by `output` and itself | a piece of a GyroNet window |
//! | 0 | `idle` | the remaining time | diagnosis, checksums of the weights; otherwise sleep |
//!
//! `output`, `window` and `idle` share the library's `Coprocessor`; everything else is passed on in queues of fixed
//! length, and what does not fit is counted. An estimate is used two samples after its window, so the time at which
//! it is ready changes no frame. A crash records its reason in RAM and resets the chip.
#![no_std]
#![no_main]

mod board;
#[path = "../boards/mod.rs"]
mod boards;
mod copy;
mod crash;
mod diagnosis;
mod frames;
mod idle;
mod imu;
mod output;
mod queues;
mod regions;
mod ring;
mod serial;
mod start;
#[path = "../stm32f405/mod.rs"]
mod stm32f405;
mod tasks;

/// Vector and priority of each task below as data, because the stack analysis reads them there and RTIC encodes them
/// only in instructions. A test compares them with the running image.
#[allow(unsafe_code, reason = "a section that is not loaded")]
#[used]
#[unsafe(link_section = ".priorities")]
static PRIORITIES: [[u8; 2]; 12] = {
    use crate::stm32f405::pac::Interrupt;
    const SYSTICK: u8 = 15;
    const FIRST: u8 = 16;
    [
        [FIRST + Interrupt::USART1 as u8, 4],
        [FIRST + Interrupt::USART3 as u8, 4],
        [SYSTICK, 4],
        [FIRST + Interrupt::USART2 as u8, 4],
        [FIRST + Interrupt::UART4 as u8, 4],
        [FIRST + Interrupt::PVD as u8, 4],
        [FIRST + Interrupt::USART6 as u8, 3],
        [FIRST + Interrupt::CAN1_RX0 as u8, 3],
        [FIRST + Interrupt::CAN1_TX as u8, 3],
        [FIRST + Interrupt::CAN1_SCE as u8, 3],
        [FIRST + Interrupt::SPI3 as u8, 2],
        [FIRST + Interrupt::UART5 as u8, 1],
    ]
};

// This image does not use SPI3 and UART5; software pends their interrupts to run `output` and `window`.
#[allow(unsafe_code, reason = "what RTIC generates; nothing in here is written with it")]
#[rtic::app(device = crate::stm32f405::pac, peripherals = true)]
mod app {
    use crate::diagnosis::Diagnosis;
    use crate::idle::Idle;
    use crate::imu::BringUp;
    use crate::output::Output;
    use crate::queues::FRAMES;
    use crate::stm32f405::pac::Interrupt;
    use crate::stm32f405::{can, timer};
    use crate::tasks::{Task, is_idle_due, is_output_due, report, wake_idle, wake_output};
    use crate::{board, crash, frames, serial, start};
    use core::mem::MaybeUninit;
    use cortex_m::asm::dsb;
    use gyronet::coprocessor::Coprocessor;
    use gyronet::model::GyroNet;
    use gyronet::model::gyronet::LargestState;
    use gyronet::service::message::LineCounters;

    #[shared]
    struct Shared {
        coprocessor: &'static mut Coprocessor,
        /// Counters of the lines, which idle reports to testers.
        lines: LineCounters,
    }

    #[local]
    struct Local {
        imu: serial::Handler,
        fog_handler: serial::Handler,
        slcan: serial::Handler,
        service: serial::Handler,
        gnss: serial::Handler,
        receptions: [Option<serial::Reception>; 5],
        sender: &'static mut Output,
        network: Option<GyroNet<'static, &'static mut LargestState>>,
        rest: &'static mut Idle,
    }

    #[init(local = [
        network_state: LargestState = LargestState::ZERO,
        coprocessor_place: MaybeUninit<Coprocessor> = MaybeUninit::uninit(),
        sender_place: MaybeUninit<Output> = MaybeUninit::uninit(),
        rest_place: MaybeUninit<Idle> = MaybeUninit::uninit(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (board, handlers) = board::Board::start(cx.device, cx.core.SYST);
        let Some(parts) = start::parts(&board) else { cortex_m::peripheral::SCB::sys_reset() };
        let start::Parts { part, bits_per_second, line, config, weights, device } = parts;
        let coprocessor = start::init_static(cx.local.coprocessor_place, || Coprocessor::new(*config));
        let network = weights.and_then(|blob| GyroNet::with_state(blob, cx.local.network_state).ok());
        let service = board.service;
        let bring_up = BringUp::new(part, board.spi);
        let (gnss, gnss_reception, gnss_port) = board::gnss(&board.clocks, line);
        let ports = ([board.imu, board.fog, board.slcan, gnss_port], board.can);
        let sender =
            start::init_static(cx.local.sender_place, || Output::new(part, bits_per_second, line, ports));
        let rest = start::init_static(cx.local.rest_place, || {
            let diagnosis = Diagnosis::new(service, bits_per_second);
            Idle::new(device, diagnosis, bring_up, board.clocks.fault)
        });
        let board::Handlers { imu, fog: fog_handler, slcan, service, receptions: [a, b, c, d] } = handlers;
        let receptions = [a, b, c, gnss_reception, d]; // Idle reads the last one's line.
        let shared = Shared { coprocessor, lines: LineCounters::NONE };
        (shared, Local { imu, fog_handler, slcan, service, gnss, receptions, sender, network, rest })
    }

    // Short handlers end with a barrier: a store that is still pending when the handler returns can make the
    // processor take the wrong vector (Arm erratum 838869 of the Cortex-M4).
    #[task(binds = USART1, priority = 4, local = [imu])]
    #[unsafe(link_section = ".ram_code.imu_line")]
    fn imu_line(cx: imu_line::Context) {
        cx.local.imu.serve();
        dsb();
    }

    #[task(binds = USART3, priority = 4, local = [fog_handler])]
    #[unsafe(link_section = ".ram_code.fog_line")]
    fn fog_line(cx: fog_line::Context) {
        cx.local.fog_handler.serve();
        dsb();
    }

    #[task(binds = SysTick, priority = 4, local = [receptions, counted_at: u32 = 0])]
    #[unsafe(link_section = ".ram_code.tick")]
    fn tick(cx: tick::Context) {
        let now = timer::tick();
        let elapsed = now.wrapping_sub(core::mem::replace(cx.local.counted_at, now));
        let count = |reception: &mut Option<serial::Reception>| {
            reception.as_mut().is_some_and(|reception| reception.count(elapsed))
        };
        let [imu, slcan, fog, gnss, service] = cx.local.receptions;
        let has_work = is_output_due(now) | count(imu);
        let has_input = count(slcan) | count(fog) | count(gnss);
        if count(service) {
            wake_idle();
        }
        report(Task::Tick);
        if has_input {
            // The task may have run in this millisecond already, and then leaves these lines to the next.
            wake_output();
        } else if has_work {
            rtic::pend(Interrupt::SPI3);
        }
        dsb();
    }

    #[task(binds = USART2, priority = 4, local = [slcan])]
    #[unsafe(link_section = ".ram_code.slcan_line")]
    fn slcan_line(cx: slcan_line::Context) {
        cx.local.slcan.serve();
        dsb();
    }

    #[task(binds = UART4, priority = 4, local = [gnss])]
    #[unsafe(link_section = ".ram_code.gnss_line")]
    fn gnss_line(cx: gnss_line::Context) {
        cx.local.gnss.serve();
        dsb();
    }

    #[task(binds = USART6, priority = 3, local = [service])]
    #[unsafe(link_section = ".ram_code.service_line")]
    fn service_line(cx: service_line::Context) {
        cx.local.service.serve();
        dsb();
    }

    #[task(binds = CAN1_RX0, priority = 3)]
    fn can_received(_: can_received::Context) {
        frames::take();
        if !FRAMES.is_empty() {
            rtic::pend(Interrupt::SPI3);
        }
        dsb();
    }

    #[task(binds = CAN1_TX, priority = 3)]
    fn can_sent(_: can_sent::Context) {
        can::transmitted();
        if frames::do_wait_for_can() {
            rtic::pend(Interrupt::SPI3);
        }
        dsb();
    }

    #[task(binds = CAN1_SCE, priority = 3)]
    fn can_went_off(_: can_went_off::Context) {
        can::went_off();
        wake_output();
        dsb();
    }

    /// Handles a falling supply: the chip must neither keep running at this clock nor change its flash.
    #[task(binds = PVD, priority = 4)]
    fn supply_low(_: supply_low::Context) {
        crash::supply_low();
    }

    #[task(binds = SPI3, priority = 2, local = [sender], shared = [coprocessor, lines])]
    fn output(cx: output::Context) {
        let runs_window = (cx.shared.coprocessor, cx.shared.lines)
            .lock(|coprocessor, lines| cx.local.sender.step(coprocessor, lines));
        if runs_window {
            rtic::pend(Interrupt::UART5);
        }
    }

    /// Runs a piece of a window each time, so that the watchdog sees a large model advance at any clock.
    #[task(binds = UART5, priority = 1, local = [network, end: Option<u32> = None], shared = [coprocessor])]
    fn window(mut cx: window::Context) {
        let window::LocalResources { network, end, .. } = cx.local;
        if let (Some(network), Some(under_way)) = (network.as_mut(), *end) {
            if let Some(estimate) = network.advance() {
                *end = None;
                // A late estimate is counted.
                let _ = cx.shared.coprocessor.lock(|coprocessor| coprocessor.deliver(under_way, estimate));
                rtic::pend(Interrupt::SPI3);
            }
        } else {
            let due = cx.shared.coprocessor.lock(|coprocessor| coprocessor.window());
            if let (Some(network), Some(due)) = (network, due) {
                network.start(&due.features);
                *end = Some(due.end);
            }
        }
        if end.is_some() {
            rtic::pend(Interrupt::UART5);
        }
        report(Task::Window);
    }

    #[idle(local = [rest], shared = [coprocessor, lines])]
    fn idle(cx: idle::Context) -> ! {
        let idle::SharedResources { mut coprocessor, mut lines, .. } = cx.shared;
        loop {
            if is_idle_due() {
                cx.local.rest.step(&mut coprocessor, &mut lines);
            }
            report(Task::Idle);
            // Every interrupt ends the sleep, the next tick at the latest.
            cortex_m::asm::wfi();
        }
    }
}
