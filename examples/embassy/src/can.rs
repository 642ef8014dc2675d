//! CAN: classic frames on a bus that may carry CAN FD. embassy's driver moves the frames between the controller and two
//! queues in its interrupt.
//!
//! What the bus does not take within [`STALE`] is dropped, because old rates are useless. After bus-off the controller
//! returns at growing intervals, so that a broken node does not disturb the bus all the time.

use embassy_stm32::can::config::{GlobalFilter, TxBufferMode};
use embassy_stm32::can::filter::{Action, ExtendedFilter, FilterType, StandardFilter};
use embassy_stm32::can::{
    BufferedCan, BufferedCanReceiver, BufferedCanSender, CanConfigurator, Frame, IT0InterruptHandler,
    IT1InterruptHandler, RxBuf, RxPin, TxBuf, TxPin,
};
use embassy_stm32::interrupt::typelevel::{Binding, FDCAN1_IT0, FDCAN1_IT1};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::{Peri, pac, peripherals::FDCAN1};
use embassy_time::{Duration, Instant};
use embedded_can::{Frame as _, Id};
use gyronet::TimedFrame;
use gyronet::can::DataFrame;
use gyronet::can::wheel::WheelSettings;
use gyronet::coprocessor::{Bus, Sink};
use static_cell::ConstStaticCell;

/// Frames of four samples.
const QUEUE: usize = 24;
const BITS_PER_SECOND: u32 = 500_000;
/// Bit rate of the data in the frames of others.
const DATA_BITS_PER_SECOND: u32 = 2_000_000;
const STALE: Duration = Duration::from_millis(20);
/// Interval from bus-off to a return: the first one, and the longest. It doubles every time, until the controller has
/// stayed on the bus for as long as the longest.
const FIRST_RETURN: Duration = Duration::from_millis(10);
const LAST_RETURN: Duration = Duration::from_millis(1_280);

static SENT: ConstStaticCell<TxBuf<QUEUE>> = ConstStaticCell::new(TxBuf::new());
static RECEIVED: ConstStaticCell<RxBuf<QUEUE>> = ConstStaticCell::new(RxBuf::new());

/// The bus, for [`gyronet::Coprocessor::step`].
pub struct CanBus {
    _driver: BufferedCan<'static, QUEUE, QUEUE>,
    sender: BufferedCanSender,
    receiver: BufferedCanReceiver,
    lost: u32,
    /// Frames received since the last step.
    taken: usize,
    /// When one of the last three frames had been sent, or none waited.
    alive: Instant,
    /// Since when the controller is on the bus, or off it.
    changed: Instant,
    is_off: bool,
    interval: Duration,
}

impl CanBus {
    /// Joins the bus. Of the frames of others only those with wheel speeds are received.
    pub fn start(
        peripheral: Peri<'static, FDCAN1>,
        rx: Peri<'static, impl RxPin<FDCAN1>>,
        tx: Peri<'static, impl TxPin<FDCAN1>>,
        interrupts: impl Binding<FDCAN1_IT0, IT0InterruptHandler<FDCAN1>>
        + Binding<FDCAN1_IT1, IT1InterruptHandler<FDCAN1>>
        + 'static,
        wheels: &WheelSettings,
    ) -> Self {
        let mut can = CanConfigurator::new(peripheral, rx, tx, interrupts);
        can.set_bitrate(BITS_PER_SECOND);
        // This also lets it receive CAN FD; without it, each such frame would be an error.
        can.set_fd_data_bitrate(DATA_BITS_PER_SECOND, false);
        let config = can.config().set_global_filter(GlobalFilter::reject_all());
        let config = config.set_tx_buffer_mode(TxBufferMode::Fifo);
        can.set_config(config.set_automatic_bus_off_recovery(false));
        for (slot, frame) in wheels.frames.iter().flatten().enumerate() {
            let (slot, action) = (slot as u8, Action::StoreInFifo0);
            match frame.id {
                Id::Standard(id) => can.properties().set_standard_filter(
                    slot.into(),
                    StandardFilter { filter: FilterType::DedicatedSingle(id), action },
                ),
                Id::Extended(id) => can.properties().set_extended_filter(
                    slot.into(),
                    ExtendedFilter { filter: FilterType::DedicatedSingle(id), action },
                ),
            }
        }
        let driver = can.into_normal_mode().buffered(SENT.take(), RECEIVED.take());
        let now = Instant::now();
        Self {
            sender: driver.writer(),
            receiver: driver.reader(),
            _driver: driver,
            lost: 0,
            taken: 0,
            alive: now,
            changed: now,
            is_off: false,
            interval: FIRST_RETURN,
        }
    }

    fn lose(&mut self, frames: u32) {
        self.lost = self.lost.saturating_add(frames);
    }

    /// Drops what waits to be sent. A frame under way and those behind it can take a few calls.
    fn drop_waiting(&mut self) {
        for _ in 0..QUEUE {
            // The driver's interrupt, which comes at once, passes a waiting frame to the controller.
            interrupt::FDCAN1_IT0.pend();
            let places = pac::FDCAN1.txbrp().read().0;
            pac::FDCAN1.txbcr().write(|w| w.0 = places);
            self.lose((pac::FDCAN1.txbcf().read().0 & places).count_ones());
        }
    }

    /// Follows the controller off the bus and back.
    fn follow(&mut self, now: Instant) {
        let is_off = pac::FDCAN1.psr().read().bo();
        if is_off != self.is_off {
            (self.is_off, self.changed) = (is_off, now);
        }
        if !is_off {
            if now - self.changed > LAST_RETURN {
                self.interval = FIRST_RETURN;
            }
            return;
        }
        self.drop_waiting();
        // The controller sets INIT when it goes off; from its end on it counts 129 times 11 recessive bits.
        if pac::FDCAN1.cccr().read().init() && now - self.changed >= self.interval {
            pac::FDCAN1.cccr().modify(|w| w.set_init(false));
            self.interval = (self.interval * 2).min(LAST_RETURN);
        }
    }
}

impl Sink for CanBus {
    fn frame(&mut self, sent: TimedFrame) {
        let frame = sent.frame.convert::<Frame>();
        if frame.is_none_or(|frame| self.sender.try_write(frame).is_err()) {
            self.lose(1);
        }
    }
}

impl Bus for CanBus {
    fn receive(&mut self) -> Option<DataFrame> {
        loop {
            let received = self.receiver.try_receive().ok()?;
            self.taken += 1;
            // The driver also passes errors of the bus, which the controller counts.
            if let Ok(received) = received {
                let frame = received.frame;
                return DataFrame::new(*frame.id(), frame.data());
            }
        }
    }

    fn flush(&mut self) {
        let now = Instant::now();
        // The driver drops what finds its queue full.
        if core::mem::take(&mut self.taken) >= QUEUE {
            self.lose(1);
        }
        if pac::FDCAN1.ir().read().rfl(0) {
            pac::FDCAN1.ir().write(|w| w.set_rfl(0, true));
            self.lose(1);
        }
        self.follow(now);
        let (waiting, sent) = (pac::FDCAN1.txbrp().read().0, pac::FDCAN1.txbto().read().0);
        let is_stale = now - self.alive > STALE;
        if sent != 0 || waiting == 0 && !is_stale {
            self.alive = now;
        } else if is_stale {
            self.drop_waiting();
        }
    }

    fn lost(&self) -> u32 {
        self.lost
    }

    fn is_off(&self) -> bool {
        self.is_off
    }
}
