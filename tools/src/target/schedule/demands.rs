//! This module lists how often each task of the image can be activated, and its deadline.

use super::cost::Cost;

/// Duration of a byte (ten bits) at 115200 and at 921600 bit/s, us.
const BYTE_115200: f64 = 10e6 / 115_200.0;
const BYTE_921600: f64 = 10e6 / 921_600.0;
/// Largest delay of a sample's frames, us: the output task waits for a tick and runs for at most 3 ms. If it takes
/// longer, the schedule counts as not met.
pub(super) const FRAMES_LATE: f64 = 4e3;
/// Duration of the shortest frame (47 bits) at 500 kbit/s, us.
const FRAME: f64 = 47.0 / 0.5;

/// A limit of activations in bursts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Burst {
    pub(super) count: f64,
    /// Time from one burst to the next, us.
    pub(super) span: f64,
    /// The largest delay of one activation, us.
    pub(super) jitter: f64,
}

impl Burst {
    const fn new(count: f64, span: f64, jitter: f64) -> Option<Self> {
        Some(Self { count, span, jitter })
    }
}

/// The demand on a task: how often it is activated, and its deadline.
pub(super) struct Demand {
    pub(super) name: &'static str,
    pub(super) handler: &'static str,
    pub(super) cost: Cost,
    /// The shortest time between two activations, us.
    pub(super) period: f64,
    /// Limit of the activations in a burst.
    pub(super) burst: Option<Burst>,
    /// Time from the activation to the deadline, us.
    pub(super) deadline: f64,
    pub(super) why: &'static str,
}

const MAILBOXES: &str = "three mailboxes are empty";
/// Handlers that end a run: the supply voltage falls, and the board restarts.
pub(super) const LAST: [&str; 1] = ["PVD"];

/// The demands on all tasks of `coprocessor` with everything configured and connected. The row of a task that an
/// image does not have is left out.
pub(super) const DEMANDS: [Demand; 9] = [
    byte("imu_line", "USART1", BYTE_115200),
    // Messages of up to 47 bytes, 1000 a second.
    Demand { burst: Burst::new(47.0, 1e3, 1e3), ..byte("fog_line", "USART3", BYTE_921600) },
    demand("tick", "SysTick", Cost::Worst, 1e3, 1e3, "the next tick"),
    // In 10 ms, with their stamps: nine frames of 26 characters and VDC2's 31 out; four wheel frames of 22 in.
    Demand { burst: Burst::new(353.0, 1e4, FRAMES_LATE), ..both_ways("slcan_line", "USART2", BYTE_921600) },
    both_ways("service_line", "USART6", BYTE_115200),
    // The filters pass only wheel frames: four identifiers, twice each.
    Demand {
        burst: Burst::new(8.0, 1e4, 1e4),
        ..demand(
            "can_frames",
            "CAN1_RX0",
            Cost::Worst,
            FRAME,
            3.0 * FRAME,
            "three frames fill the controller",
        )
    },
    // Six frames are sent with a sample, four with the sums of the fibre-optic gyro.
    Demand {
        burst: Burst::new(10.0, 1e4, FRAMES_LATE),
        ..demand("can_sent", "CAN1_TX", Cost::Worst, FRAME, 3.0 * FRAME, MAILBOXES)
    },
    demand("output", "UART4", Cost::Sample, 1e4, 1e4, "the next sample"),
    demand("window", "UART5", Cost::Worst, 5e4, 2e4, "used two samples later"),
];

const fn demand(
    name: &'static str,
    handler: &'static str,
    cost: Cost,
    period: f64,
    deadline: f64,
    why: &'static str,
) -> Demand {
    Demand { name, handler, cost, period, burst: None, deadline, why }
}

/// Returns the demand of a line at full speed that only receives: each byte must be read before the next one arrives.
const fn byte(name: &'static str, handler: &'static str, period: f64) -> Demand {
    demand(name, handler, Cost::Bytes(1), period, period, "the next byte")
}

/// Returns the demand of a line at full speed that receives and sends.
const fn both_ways(name: &'static str, handler: &'static str, period: f64) -> Demand {
    Demand { cost: Cost::Bytes(3), ..byte(name, handler, period) }
}
