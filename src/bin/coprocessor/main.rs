//! The coprocessor's firmware, for the STM32F405 or the part in `chip`: sensor bytes in, CAN frames out.
//!
//! | pin | function |
//! |---|---|
//! | PA10 (PA9) | USART1 RX (TX), 115200 8N1, Xsens MTi |
//! | PA5, PA6, PA7, PA4 | SPI1 clock, in, out, select: ICM-42688-P, where one is configured |
//! | PB11 (PB10) | USART3 RX (TX), 921600 8N1, KVH DSP-1760 |
//! | PA2, PA3 | USART2 TX, RX, 921600 8N1, SLCAN |
//! | PC6, PC7 | USART6 TX, RX, 115200 8N1, service line |
//! | PB8, PB9 | CAN1 RX, TX, 500 kbit/s |
//!
//! # What runs when
//! | priority | task | when | what |
//! |---|---|---|---|
//! | 4 | `imu_line`, `fog_line`, `slcan_line`, `tick` | a byte, 1 ms | a byte into or out of its queue; board time |
//! | 3 | `service_line`, `bus::receive` | a byte, a frame | into and out of their queues |
//! | 2 | `output` | pended by both | samples, pipeline, frames, watchdog |
//! | 1 | `window` | pended by `output` | GyroNet |
//! | 0 | `idle` | the rest | FoGNet in pieces, service line, weights against their checksum |
//!
//! Tasks hand things over in queues of fixed length; what does not fit is counted. An estimate is
//! used two samples after its window, so when it was ready changes no frame; see `window.rs` for
//! one that is late. A crash leaves its reason in RAM and resets.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is a firmware image: build it with `cargo fw`");
}

#[cfg(all(target_os = "none", feature = "rtt"))]
use defmt_rtt as _;

#[cfg(target_os = "none")]
mod board;
#[cfg(all(target_os = "none", feature = "firmware"))]
#[path = "stm32f405/mod.rs"]
mod chip;
#[cfg(all(target_os = "none", not(feature = "firmware")))]
#[path = "stm32h743/mod.rs"]
mod chip;
#[cfg(target_os = "none")]
mod clock;
#[cfg(target_os = "none")]
mod crash;
#[cfg(target_os = "none")]
mod fog_network;
#[cfg(target_os = "none")]
mod idle;
#[cfg(target_os = "none")]
mod imu;
#[cfg(target_os = "none")]
mod outgoing;
#[cfg(target_os = "none")]
mod output;
#[cfg(target_os = "none")]
mod queue;
#[cfg(target_os = "none")]
mod received;
#[cfg(target_os = "none")]
mod regions;
#[cfg(target_os = "none")]
mod serial;
#[cfg(target_os = "none")]
mod start;
#[cfg(target_os = "none")]
mod usart;
#[cfg(target_os = "none")]
mod wheels;
#[cfg(target_os = "none")]
mod window;

/// Vector and priority of each task below: RTIC has them in instructions alone, the bound of the
/// stack wants them as data. A test holds them against the running image.
#[cfg(target_os = "none")]
#[allow(unsafe_code, reason = "a section that is not loaded")]
#[used]
#[unsafe(link_section = ".priorities")]
static PRIORITIES: [[u8; 2]; 8] = {
    use crate::board::CAN_PRIORITY;
    use crate::chip::{CAN_INTERRUPT, pac::Interrupt};
    const SYSTICK: u8 = 15;
    const FIRST: u8 = 16;
    [
        [FIRST + Interrupt::USART1 as u8, 4],
        [FIRST + Interrupt::USART3 as u8, 4],
        [SYSTICK, 4],
        [FIRST + Interrupt::USART2 as u8, 4],
        [FIRST + Interrupt::USART6 as u8, 3],
        [FIRST + CAN_INTERRUPT as u8, CAN_PRIORITY],
        [FIRST + Interrupt::UART4 as u8, 2],
        [FIRST + Interrupt::UART5 as u8, 1],
    ]
};

// The vectors of UART4 and UART5, which this board does not use, are pended by hand.
#[cfg(target_os = "none")]
#[allow(unsafe_code, reason = "what RTIC generates; nothing in here is written with it")]
#[rtic::app(device = crate::chip::pac, peripherals = true)]
mod app {
    use crate::chip::pac::Interrupt;
    use crate::idle::Idle;
    use crate::imu::BringUp;
    use crate::output::Output;
    use crate::window::WindowTask;
    use crate::{board, clock, serial, start};
    use core::mem::MaybeUninit;
    use gyronet::fog::FogConfig;
    use gyronet::fog::lane::FogLane;
    use gyronet::health::supervisor::Task;
    use gyronet::model::GyroNet;
    use gyronet::service::message::AllCounters;
    use gyronet::units::Micros;

    /// What idle tells of, and what it has found out.
    #[shared]
    struct Shared {
        counters: AllCounters,
        weights_damaged: bool,
        fog: &'static mut FogLane,
    }

    #[local]
    struct Local {
        imu: serial::Handler<{ board::IMU_QUEUE }>,
        fog_handler: serial::Handler<{ board::FOG_QUEUE }>,
        slcan: serial::Handler<{ board::SLCAN_QUEUE }>,
        service: serial::Handler<{ board::SERVICE_QUEUE }>,
        sender: &'static mut Output,
        network: WindowTask,
        rest: &'static mut Idle,
    }

    #[init(local = [
        network_place: MaybeUninit<GyroNet<'static>> = MaybeUninit::uninit(),
        sender_place: MaybeUninit<Output> = MaybeUninit::uninit(),
        fog_place: MaybeUninit<FogLane> = MaybeUninit::uninit(),
        rest_place: MaybeUninit<Idle> = MaybeUninit::uninit(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (board, handlers) = board::Board::start(cx.device, cx.core.SYST);
        let Some(parts) = start::parts(&board) else { cortex_m::peripheral::SCB::sys_reset() };
        let start::Parts { output, weights, fog_network, fog_expected, device } = parts;
        let network = weights.map(|blob| start::place(cx.local.network_place, || GyroNet::new(blob)));
        let network = WindowTask { network };
        let service = board.service;
        let bring_up = BringUp::of(output.part, board.spi);
        let ports = (board.imu, board.fog, board.slcan, board.can);
        let has_network = fog_network.is_some();
        let fog = start::place(cx.local.fog_place, || FogLane::new(FogConfig::DEFAULT, has_network));
        if fog_expected {
            // The board's clock has just begun.
            fog.expect(Micros(0));
        }
        let sender =
            start::place(cx.local.sender_place, || output.connect(ports, board.time, board.watchdog));
        let rest = start::place(cx.local.rest_place, || Idle::new(device, service, fog_network, bring_up));
        let board::Handlers { imu, fog: fog_handler, slcan, service } = handlers;
        let shared = Shared { counters: AllCounters::default(), weights_damaged: false, fog };
        (shared, Local { imu, fog_handler, slcan, service, sender, network, rest })
    }

    #[task(binds = USART1, priority = 4, local = [imu])]
    fn imu_line(cx: imu_line::Context) {
        cx.local.imu.serve();
        rtic::pend(Interrupt::UART4);
    }

    // A thousand messages a second: they are looked at with every tick, not with every byte.
    #[task(binds = USART3, priority = 4, local = [fog_handler])]
    fn fog_line(cx: fog_line::Context) {
        cx.local.fog_handler.serve();
    }

    #[task(binds = SysTick, priority = 4)]
    fn tick(_: tick::Context) {
        clock::tick();
        board::SUPERVISOR.report(Task::Tick);
        rtic::pend(Interrupt::UART4);
    }

    #[task(binds = USART2, priority = 4, local = [slcan])]
    fn slcan_line(cx: slcan_line::Context) {
        cx.local.slcan.serve();
    }

    #[task(binds = USART6, priority = 3, local = [service])]
    fn service_line(cx: service_line::Context) {
        cx.local.service.serve();
    }

    #[task(binds = UART4, priority = 2, local = [sender], shared = [counters, weights_damaged, fog])]
    fn output(cx: output::Context) {
        (cx.shared.counters, cx.shared.weights_damaged, cx.shared.fog)
            .lock(|counters, damaged, fog| cx.local.sender.turn(counters, *damaged, fog));
        rtic::pend(Interrupt::UART5);
    }

    #[task(binds = UART5, priority = 1, local = [network])]
    fn window(cx: window::Context) {
        if cx.local.network.run() {
            rtic::pend(Interrupt::UART4);
        }
        board::SUPERVISOR.report(Task::Window);
    }

    #[idle(local = [rest], shared = [counters, weights_damaged, fog])]
    fn idle(mut cx: idle::Context) -> ! {
        loop {
            let counters = cx.shared.counters.lock(|counters| *counters);
            let damaged = cx.local.rest.turn(&counters);
            if damaged {
                cx.shared.weights_damaged.lock(|known| *known = true);
            }
            let fog_network = cx.local.rest.fog_network();
            let begun = fog_network.is_waiting() && cx.shared.fog.lock(|fog| fog_network.begin(fog));
            if let (false, Some((number, estimate))) = (begun, fog_network.advance()) {
                cx.shared.fog.lock(|fog| fog.deliver(number, estimate));
            }
            board::SUPERVISOR.report(Task::Idle);
        }
    }
}
