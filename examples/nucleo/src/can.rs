//! CAN: classic frames, and one of CAN FD where it is configured; those of others are skipped. embassy's driver moves the frames
//! between the controller and two queues in its interrupt.
//!
//! The driver computes bit times with a sample point at 90 %; most networks use 80 %, which the times here have. There 400 ns of
//! a data bit have passed, more than the 255 ns that a transceiver takes (ISO 11898-2): its delay needs no compensation.
//!
//! What the bus does not take within [`STALE`] is dropped, because old rates are useless. For bus-off see [`BusOff`].

use crate::service;
use core::num::{NonZeroU8, NonZeroU16};
use core::sync::atomic::Ordering::Relaxed;
use embassy_stm32::can::config::{
    DataBitTiming, FrameTransmissionConfig, GlobalFilter, NominalBitTiming, NonMatchingFilter, TxBufferMode,
};
use embassy_stm32::can::filter::{Action, ExtendedFilter, FilterType, StandardFilter};
use embassy_stm32::can::frame::{FdFrame, Header};
use embassy_stm32::can::{
    BufferedCanFd, BufferedFdCanReceiver, BufferedFdCanSender, CanConfigurator, IT0InterruptHandler,
    IT1InterruptHandler, RxFdBuf, RxPin, TxFdBuf, TxPin,
};
use embassy_stm32::interrupt::typelevel::{Binding, FDCAN1_IT0, FDCAN1_IT1};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::{Peri, pac, peripherals::FDCAN1};
use embassy_time::{Duration, Instant};
use embedded_can::{Frame as _, Id};
use gyronet::TimedFrame;
use gyronet::can::bus_off::BusOff;
use gyronet::can::config::Settings;
use gyronet::can::fd::{DATA_BITS_PER_SECOND, Joiner};
use gyronet::can::{DataFrame, load};
use gyronet::coprocessor::{Bus, Observation, Sink};
use gyronet::health::count;
use gyronet::service::message::LineCounters;
use static_cell::ConstStaticCell;

/// Frames of four samples.
const QUEUE: usize = 24;
/// The controller's clock.
const CLOCK_HZ: u32 = 50_000_000;
/// Quanta of a bit that the controller can count, with a sample point at 80 %.
const MOST_QUANTA: u32 = 250;
const STALE: Duration = Duration::from_millis(20);

/// Filters of the controller for identifiers of 11 and of 29 bits.
const STANDARD_FILTERS: u8 = 28;
const EXTENDED_FILTERS: u8 = 8;

static SENT: ConstStaticCell<TxFdBuf<QUEUE>> = ConstStaticCell::new(TxFdBuf::new());
static RECEIVED: ConstStaticCell<RxFdBuf<QUEUE>> = ConstStaticCell::new(RxFdBuf::new());

/// What the bus is to receive, and how it sends.
pub struct Received<F> {
    /// Identifiers of requests to this board and to all servers, and of responses.
    pub ids: [Id; 3],
    /// Identifiers, each with the mask of its bits that count.
    pub filters: F,
    pub settings: Settings,
}

/// The bus, for [`gyronet::Coprocessor::step`].
pub struct CanBus {
    _driver: BufferedCanFd<'static, QUEUE, QUEUE>,
    sender: BufferedFdCanSender,
    receiver: BufferedFdCanReceiver,
    /// Identifiers of requests.
    requests: [Id; 2],
    pub counters: LineCounters,
    /// Frames received since the last step.
    taken: usize,
    /// The controller's places whose last frame had been sent at the last step, and those whose frame is being cancelled.
    sent: u32,
    cancelled: u32,
    /// When a frame had been sent since the step before, or none waited.
    alive: Instant,
    bus_off: BusOff,
    joiner: Joiner,
}

impl CanBus {
    /// Joins the bus, of whose frames it receives only what is used.
    pub fn start(
        peripheral: Peri<'static, FDCAN1>,
        rx: Peri<'static, impl RxPin<FDCAN1>>,
        tx: Peri<'static, impl TxPin<FDCAN1>>,
        interrupts: impl Binding<FDCAN1_IT0, IT0InterruptHandler<FDCAN1>>
        + Binding<FDCAN1_IT1, IT1InterruptHandler<FDCAN1>>
        + 'static,
        received: Received<impl Iterator<Item = (Id, u32)>>,
    ) -> Self {
        let mut can = CanConfigurator::new(peripheral, rx, tx, interrupts);
        let action = Action::StoreInFifo0;
        let (mut standard, mut extended) = (0, 0);
        for (id, mask) in received.filters {
            match id {
                Id::Standard(id) if standard < STANDARD_FILTERS => {
                    let filter = FilterType::BitMask { filter: id.as_raw(), mask: mask as u16 & 0x7FF };
                    can.properties().set_standard_filter(standard.into(), StandardFilter { filter, action });
                    standard += 1;
                }
                Id::Extended(id) if extended < EXTENDED_FILTERS => {
                    let filter = FilterType::BitMask { filter: id.as_raw(), mask: mask & 0x1FFF_FFFF };
                    can.properties().set_extended_filter(extended.into(), ExtendedFilter { filter, action });
                    extended += 1;
                }
                // All others share what no filter takes.
                Id::Standard(_) => standard = u8::MAX,
                Id::Extended(_) => extended = u8::MAX,
            }
        }
        let rest = |filters| match filters {
            u8::MAX => NonMatchingFilter::IntoRxFifo0,
            _ => NonMatchingFilter::Reject,
        };
        let others = GlobalFilter::reject_all()
            .set_handle_standard_frames(rest(standard))
            .set_handle_extended_frames(rest(extended));
        let config = can.config().set_global_filter(others).set_tx_buffer_mode(TxBufferMode::Fifo);
        let (prescaler, seg1, seg2) = bit_time(received.settings.bits_per_second);
        let nominal = NominalBitTiming { prescaler, seg1, seg2, sync_jump_width: seg2 };
        let (prescaler, seg1, seg2) = bit_time(DATA_BITS_PER_SECOND);
        let transceiver_delay_compensation = false;
        let data =
            DataBitTiming { transceiver_delay_compensation, prescaler, seg1, seg2, sync_jump_width: seg2 };
        let config = config.set_nominal_bit_timing(nominal).set_data_bit_timing(data);
        // Unless it receives CAN FD, each such frame is an error.
        let config = config.set_frame_transmit(FrameTransmissionConfig::AllowFdCanAndBRS);
        can.set_config(config.set_automatic_bus_off_recovery(false));
        let driver = can.into_normal_mode().buffered_fd(SENT.take(), RECEIVED.take());
        let now = Instant::now();
        Self {
            sender: driver.writer(),
            receiver: driver.reader(),
            _driver: driver,
            requests: [received.ids[0], received.ids[1]],
            counters: LineCounters::NONE,
            taken: 0,
            sent: 0,
            cancelled: 0,
            alive: now,
            bus_off: BusOff::new(now.as_micros()),
            joiner: Joiner::new(&received.settings),
        }
    }

    fn transmit(&mut self, frame: DataFrame) {
        let Some((id, data)) = self.joiner.join(&frame) else { return };
        let (length, is_fd) = (data.len() as u8, data.len() > frame.padded().len());
        let header =
            if is_fd { Header::new_fd(id, length, false, true) } else { Header::new(id, length, false) };
        let is_taken = !is_fd || self.bus_off.takes_fd(Instant::now().as_micros());
        service::FD_REFUSED.fetch_or(!is_taken && self.bus_off.refuses_fd(), Relaxed);
        let frame = FdFrame::new(header, data).ok().filter(|_| is_taken);
        if frame.is_none_or(|frame| self.sender.try_write(frame).is_err()) {
            count(&mut self.counters.unsent, 1);
        }
    }

    /// Drops what waits to be sent, and returns whether nothing waits any more. A frame under way and those behind it can
    /// take a few calls.
    fn drop_waiting(&mut self) -> bool {
        let mut is_empty = true;
        for _ in 0..QUEUE {
            // The driver's interrupt, which comes at once, passes a waiting frame to the controller.
            interrupt::FDCAN1_IT0.pend();
            self.count_cancelled();
            let places = pac::FDCAN1.txbrp().read().0;
            pac::FDCAN1.txbcr().write(|w| w.0 = places);
            self.cancelled |= places;
            is_empty &= pac::FDCAN1.txbrp().read().0 == 0;
        }
        is_empty
    }

    /// Counts the cancelled frames that have ended without being sent: that under way ends later.
    fn count_cancelled(&mut self) {
        let ended = self.cancelled & !pac::FDCAN1.txbcr().read().0;
        self.cancelled &= !ended;
        count(&mut self.counters.unsent, (ended & !pac::FDCAN1.txbto().read().0).count_ones());
    }

    /// Follows the controller off the bus and back.
    fn follow(&mut self, has_sent: bool, now: Instant) {
        self.bus_off.follow(pac::FDCAN1.psr().read().bo(), has_sent, now.as_micros());
        if !self.bus_off.is_off() {
            return;
        }
        self.drop_waiting();
        // The controller sets INIT when it goes off; from its end on it counts 129 times 11 recessive bits.
        if pac::FDCAN1.cccr().read().init() && self.bus_off.returns(now.as_micros()) {
            pac::FDCAN1.cccr().modify(|w| w.set_init(false));
        }
    }
}

impl Sink for CanBus {
    fn frame(&mut self, sent: TimedFrame) {
        if !service::SILENCED.load(Relaxed) {
            self.transmit(sent.frame);
        }
    }

    fn observed(&mut self, observation: &Observation) {
        if service::OBSERVATIONS.try_send(*observation).is_err() {
            count(&mut self.counters.overruns, 1);
        }
    }
}

impl Bus for CanBus {
    fn receive(&mut self) -> Option<DataFrame> {
        loop {
            let received = self.receiver.try_receive().ok()?;
            self.taken += 1;
            // The driver also passes errors of the bus, which the controller counts.
            if let Ok(received) = received
                && !received.frame.header().fdcan()
                && let Some(frame) = DataFrame::new(*received.frame.id(), received.frame.data())
            {
                if !self.requests.contains(&frame.id()) {
                    return Some(frame);
                }
                if service::REQUESTS.try_send(frame).is_err() {
                    count(&mut self.counters.frames_lost, 1);
                }
            }
        }
    }

    fn flush(&mut self) {
        let now = Instant::now();
        // The driver drops what finds its queue full.
        if core::mem::take(&mut self.taken) >= QUEUE {
            count(&mut self.counters.frames_lost, 1);
        }
        if pac::FDCAN1.ir().read().rfl(0) {
            pac::FDCAN1.ir().write(|w| w.set_rfl(0, true));
            count(&mut self.counters.frames_lost, 1);
        }
        let sent = pac::FDCAN1.txbto().read().0;
        let has_sent = sent & !core::mem::replace(&mut self.sent, sent) != 0;
        self.follow(has_sent, now);
        while let Ok(frame) = service::RESPONSES.try_receive() {
            self.transmit(frame);
        }
        self.count_cancelled();
        let is_stale = !has_sent && now - self.alive > STALE;
        let is_empty = if is_stale { self.drop_waiting() } else { pac::FDCAN1.txbrp().read().0 == 0 };
        if has_sent || is_empty {
            self.alive = now;
        }
    }

    fn lost(&self) -> u32 {
        self.counters.unsent.saturating_add(self.counters.frames_lost)
    }

    fn is_off(&self) -> bool {
        self.bus_off.is_off()
    }
}

/// Returns the prescaler and both segments of a bit.
fn bit_time(bits_per_second: u32) -> (NonZeroU16, NonZeroU8, NonZeroU8) {
    let (prescaler, seg1, seg2) = load::bit_time(CLOCK_HZ, bits_per_second, MOST_QUANTA);
    let segment = |quanta| NonZeroU8::new(quanta).unwrap_or(NonZeroU8::MIN);
    (NonZeroU16::new(prescaler).unwrap_or(NonZeroU16::MIN), segment(seg1), segment(seg2))
}
