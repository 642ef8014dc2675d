//! The main program's service: stored data, diagnosis over the bus, and the check of the weights.
//!
//! It runs below everything else. What `drive` passes on waits in channels of fixed length; what finds no room is counted.

use crate::flash::Array;
use crate::imu::{PASSED, Spi};
use crate::rng;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::SCB;
use embassy_stm32::pac;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex as Raw;
use embassy_sync::{channel::Channel, signal::Signal};
use embassy_time::{Delay, Duration, Instant};
use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::coprocessor;
use gyronet::heading::CourseState;
use gyronet::model::background::BackgroundCheck;
use gyronet::service::event::{CanFault, ResetCause};
use gyronet::service::message::{AllCounters, Identity};
use gyronet::service::{Device, SupportedHardware, spi_imu::BringUp};
use gyronet::store::ImuPart;
use gyronet::store::banks::{Records, Slots};
use gyronet::store::firmware::{LABEL_SIZE, Label};
use gyronet::uds::Server;

/// Clock of the core, Hz.
pub const CORE_HZ: u32 = 250_000_000;
pub const SUPPORTED: SupportedHardware = SupportedHardware {
    imus: &[ImuPart::XsensMti, ImuPart::Icm42688, ImuPart::Bmi088, ImuPart::Asm330lhh],
    fogs: &[],
    gnss: false,
    fd: true,
    clock_hz: CORE_HZ,
};
/// Time for the announcement of a restart to leave.
const LEAVE: Duration = Duration::from_millis(25);
/// Duration of one pass over the weights, ms.
const CHECK_MS: usize = 10_000;

/// Frames of testers, and the responses to them.
pub static REQUESTS: Channel<Raw, DataFrame, 16> = Channel::new();
pub static RESPONSES: Channel<Raw, DataFrame, 16> = Channel::new();
pub static OBSERVATIONS: Channel<Raw, coprocessor::Observation, 32> = Channel::new();
pub static COUNTERS: Signal<Raw, AllCounters> = Signal::new();
pub static COURSE: Signal<Raw, CourseState> = Signal::new();
/// True while a tester has stopped the messages of the board, and while the rates are withheld before a restart.
pub static SILENCED: AtomicBool = AtomicBool::new(false);
pub static PAUSED: AtomicBool = AtomicBool::new(false);
/// Faults that were found here, for the coprocessor.
pub static WEIGHTS_DAMAGED: AtomicBool = AtomicBool::new(false);
pub static MOUNT_MOVED: AtomicBool = AtomicBool::new(false);
/// Found in `drive`: no node takes CAN FD.
pub static FD_REFUSED: AtomicBool = AtomicBool::new(false);
/// Number of cycles of the main program.
pub static CYCLES: AtomicU32 = AtomicU32::new(0);

/// Notes that the main program gets on.
pub fn alive() {
    CYCLES.fetch_add(1, Relaxed);
}

pub type Stored = Device<Records<Array>, Slots<Array>>;

pub struct Service {
    device: &'static mut Stored,
    server: Server,
    /// Identifiers of requests to this board and to all servers, and of responses.
    ids: [Id; 3],
    weights: Option<BackgroundCheck<'static>>,
    bring_up: Option<BringUp<Spi>>,
    counters: AllCounters,
    /// Time of the last check of the weights, ms.
    checked: u32,
}

impl Service {
    pub fn new(
        device: &'static mut Stored,
        ids: [Id; 3],
        weights: Option<BackgroundCheck<'static>>,
        bring_up: Option<BringUp<Spi>>,
    ) -> Self {
        let counters = AllCounters::default();
        Self { device, server: Server::new(), ids, weights, bring_up, counters, checked: 0 }
    }

    /// Does a bounded piece of work.
    pub fn step(&mut self) {
        let now = Instant::now().as_millis() as u32;
        while let Ok(seen) = OBSERVATIONS.try_receive() {
            self.device.observed(&seen);
        }
        let step = |up: &mut BringUp<Spi>| up.step(now, &mut Delay, |part| PASSED.signal(part));
        if let Some(result) = self.bring_up.as_mut().and_then(step) {
            self.device.sensor(result);
        }
        COURSE.try_take().into_iter().for_each(|course| self.device.learn_course(&course));
        self.counters = COUNTERS.try_take().unwrap_or(self.counters);
        self.serve(now);
        if core::mem::replace(&mut self.checked, now) != now {
            let pass = self.weights.as_mut().and_then(|check| check.advance(check.len() / CHECK_MS + 1));
            if pass.is_some_and(|pass| pass.is_err()) {
                self.weights = None;
                self.device.weights_damaged();
                WEIGHTS_DAMAGED.store(true, Relaxed);
            }
        }
        if FD_REFUSED.load(Relaxed) {
            self.device.can_fault(CanFault::Fd);
        }
        if self.device.take_mount_moved() {
            MOUNT_MOVED.store(true, Relaxed);
        }
        let is_acknowledged = pac::FDCAN1.txbto().read().0 != 0;
        if self.device.firmware_trial(is_acknowledged, self.counters.pipeline.windows, now) {
            restart();
        }
    }

    /// Serves the tester.
    fn serve(&mut self, now: u32) {
        while let Ok(frame) = REQUESTS.try_receive() {
            if frame.id() == self.ids[1] {
                self.server.receive_functional(frame.data(), now);
            } else {
                self.server.receive(frame.data(), now);
            }
        }
        let Self { device, server, ids: [_, _, response], counters, .. } = self;
        if RESPONSES.is_empty() && pac::FDCAN1.txbrp().read().0 == 0 {
            server.frames_left(now);
        }
        server.poll(device, || *counters, now, rng::bytes);
        SILENCED.store(server.is_silenced(), Relaxed);
        while !RESPONSES.is_full()
            && let Some(data) = server.next_frame(now)
        {
            if let Some(frame) = DataFrame::new(*response, &data) {
                // There is room.
                let _ = RESPONSES.try_send(frame);
            }
        }
        if server.restart_is_due() && RESPONSES.is_empty() {
            restart();
        }
    }
}

/// Restarts the board, after announcing it.
fn restart() -> ! {
    PAUSED.store(true, Relaxed);
    let until = Instant::now() + LEAVE;
    while Instant::now() < until {
        alive();
        cortex_m::asm::wfi();
    }
    SCB::sys_reset()
}

/// The label of the image, by which an update is accepted.
#[used]
#[unsafe(link_section = ".label")]
static LABEL: [u8; LABEL_SIZE] = Label::new(VERSION, "nucleo-h563zi").bytes();
const VERSION: [u8; 3] = gyronet::store::firmware::version(env!("CARGO_PKG_VERSION"));

/// Returns what the board says of itself.
pub fn identity() -> Identity {
    Identity {
        firmware: VERSION,
        serial: embassy_stm32::uid::uid(),
        clock_hz: CORE_HZ,
        reset: reset_cause(),
        ..Identity::UNKNOWN
    }
}

/// Reads the reset flags and clears them for the next reset. The most specific cause comes first.
fn reset_cause() -> ResetCause {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    let causes = [
        (flags.iwdgrstf() || flags.wwdgrstf(), ResetCause::Watchdog),
        (flags.sftrstf(), ResetCause::Software),
        (flags.lpwrrstf(), ResetCause::LowPower),
        (flags.borrstf(), ResetCause::PowerOn),
        (flags.pinrstf(), ResetCause::Pin),
    ];
    causes.into_iter().find_map(|(set, cause)| set.then_some(cause)).unwrap_or(ResetCause::Unknown)
}
