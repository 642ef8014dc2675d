//! A receiver of the board's yaw messages and of its slow status, written from the page of the bus (src/can/README.md)
//! without the library's decoders.

use crate::wire::raw;
use embedded_can::Frame;
use gyronet::can::DataFrame;

/// The first of the messages rate, angle, detail: of the inertial sensor, of a fibre-optic gyro.
pub const INERTIAL: u16 = 0x1A0;
pub const FIBRE_OPTIC: u16 = 0x1A4;
const STATUS: u16 = 0x1A3;
const GOOD: u8 = 0;

/// A set of rate, angle and detail with one sample counter.
#[derive(Debug, Clone, Copy)]
pub struct Set {
    /// Time of the sample that it belongs to, s.
    pub sampled: f64,
    /// Accumulated yaw without its wraps, rad.
    pub yaw: f64,
    /// 0 good, 1 degraded, 2 initialising, 3 not to be used.
    pub quality: u8,
    pub faults: u8,
    /// Expected error over a second, rad.
    pub sigma: Option<f64>,
}

impl Set {
    pub fn is_good(&self) -> bool {
        self.quality == GOOD
    }
}

/// The newest slow status, and its time, s.
#[derive(Debug, Clone, Copy)]
pub struct Slow {
    pub at: f64,
    pub stands: bool,
    /// A second source contradicts.
    pub contradicted: bool,
    /// The bias is not confirmed yet, or contradicted.
    pub doubted_bias: bool,
    pub gaps: u8,
    /// Doubt of the accumulated yaw, rad.
    pub doubt: Option<f64>,
}

#[derive(Debug)]
pub struct Receiver {
    first: u16,
    rate: Option<(u8, u8)>,
    angle: Option<(u8, i32, u8)>,
    newest: Option<(i32, f64)>,
    pub sets: Vec<Set>,
    pub slow: Vec<Slow>,
}

impl Receiver {
    pub const fn new(first: u16) -> Self {
        Self { first, rate: None, angle: None, newest: None, sets: Vec::new(), slow: Vec::new() }
    }

    pub fn take(&mut self, frame: &DataFrame, at: f64) {
        let Ok(data) = <[u8; 8]>::try_from(frame.data()) else { return };
        let counter = data[2];
        let word = i32::from_le_bytes([data[3], data[4], data[5], data[6]]);
        if raw(frame) == STATUS {
            return self.status(u64::from_le_bytes(data) >> 24, at);
        }
        match raw(frame).wrapping_sub(self.first) {
            0 => self.rate = Some((counter, data[7] >> 3 & 3)),
            1 => self.angle = Some((counter, word, data[7])),
            2 => {
                let (Some((one, quality)), Some((two, code, faults))) = (self.rate, self.angle) else {
                    return;
                };
                if [one, two] != [counter; 2] {
                    return;
                }
                let (before, yaw) = self.newest.unwrap_or((code, 0.0));
                // A turn's code wraps; the difference of two codes is the angle between them.
                let yaw =
                    yaw + f64::from(code.wrapping_sub(before)) * std::f64::consts::TAU / 4_294_967_296.0;
                self.newest = Some((code, yaw));
                let sigma = u16::from_le_bytes([data[5], data[6]]);
                let sigma = (sigma != u16::MAX).then(|| (f64::from(sigma) * 1e-5).to_radians());
                let latency = if data[7] == u8::MAX { 0.0 } else { f64::from(data[7]) * 0.5e-3 };
                self.sets.push(Set { sampled: at - latency, yaw, quality, faults, sigma });
            }
            _ => {}
        }
    }

    fn status(&mut self, bits: u64, at: f64) {
        // The gaps are those of both yaws, the rest but for the second source is about the inertial sensor alone.
        let bits = if self.first == INERTIAL { bits } else { bits & 0xFF_E000 | 0xFFFF << 24 };
        let doubt = bits >> 24 & 0xFFFF;
        self.slow.push(Slow {
            at,
            stands: bits & 3 == 1,
            contradicted: !matches!(bits >> 13 & 7, 0 | 7),
            doubted_bias: matches!(bits >> 4 & 7, 1 | 3),
            gaps: (bits >> 16) as u8,
            doubt: (doubt != 0xFFFF).then(|| (doubt as f64 * 0.01).to_radians()),
        });
    }
}
