//! BMI088: frames, and the driver and its two clocks on a simulated bus.

use gyronet::sample::{ImuSample, Validity};
use gyronet::sensor::bmi088::frame::{self, State};
use gyronet::sensor::bmi088::{Bmi088, CHECKS, OLDEST};
use gyronet::sensor::spi::{self, SpiError};
use gyronet::units::{CentiCelsius, Micros};
use gyronet_host_tests::spi::{NoDelay, Part, Select};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// Registers 18 to 25: time 0x030201, 23.375 deg C, this many bytes in the FIFO.
const fn state(bytes: u8) -> [u8; 14] {
    let empty = if bytes == 0 { 0x80 } else { 0 };
    [1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0x60, bytes, empty]
}

/// 10 deg/s about z in the range of 250, and 1 g along z in that of 12 g.
const RATE: [u8; 6] = [0, 0, 0xFE, 0xFF, 0x1F, 0x05];
const FORCE: [u8; 7] = [0x84, 0, 0, 0xFC, 0xFF, 0xAB, 0x0A];

#[test]
fn frames_are_read_as_the_data_sheet_says() {
    assert_eq!(spi::vector(&RATE), [0, -2, 1311]);
    let sample = frame::sample(Micros(7), [0, -4, 2731], [0, -2, 1311], None).expect("in range");
    assert!((sample.angular_rate[2].rad_per_sec().to_degrees() - 1311.0 / 131.072).abs() < 1e-5);
    assert!((sample.specific_force[2].metre_per_sec2() - 9.806_65 * 2731.0 * 12.0 / 32_768.0).abs() < 1e-5);
    for (header, is_read) in [
        (0x84, true),
        (0x87, true),
        (0x40, false),
        (0x44, false),
        (0x48, false),
        (0x50, false),
        (0x80, false),
    ] {
        let mut bytes = FORCE;
        bytes[0] = header;
        assert_eq!(frame::acceleration(&bytes), is_read.then_some([0, -4, 2731]), "{header:02x}");
    }
    let parsed = State::parse(&state(14));
    assert_eq!(parsed, State { time: 0x03_0201, temperature: Some(3), bytes: 14 });
    assert_eq!(State::parse(&state(0)).bytes, 0);
    // The data sheet's examples (5.3.7), in hundredths of a degree.
    for (high, low, expected) in [
        (0x3E, 0, Some(8_500)),
        (0, 0x60, Some(2_337)),
        (0, 0, Some(2_300)),
        (0xC1, 0, Some(-4_000)),
        (0x80, 0, None),
    ] {
        let mut bytes = state(0);
        (bytes[10], bytes[11]) = (high, low);
        let sample =
            frame::sample(Micros(7), [0; 3], [0; 3], State::parse(&bytes).temperature).expect("zeros");
        assert_eq!((sample.time, sample.temperature), (Micros(7), expected.map(CentiCelsius)));
    }
}

#[test]
fn either_end_of_the_range_is_saturation() {
    for (count, expected) in [
        (i16::MAX, Validity::Saturated),
        (i16::MIN, Validity::Saturated),
        (-i16::MAX, Validity::Saturated),
        (i16::MAX - 1, Validity::Good),
        (2 - i16::MAX, Validity::Good),
    ] {
        for axis in 0..6 {
            let mut counts = [[0; 3]; 2];
            counts[axis / 3][axis % 3] = count;
            let [force, rate] = counts;
            assert_eq!(frame::sample(Micros(0), force, rate, None).expect("in range").validity, expected);
        }
    }
}

const ACC: usize = 0;
const GYRO: usize = 1;

/// Die, address, value; written from the data sheet, not from the driver's constants.
const REGISTERS: [(usize, u8, u8); CHECKS - 1] = [
    (ACC, 0x7C, 0x00),
    (ACC, 0x7D, 0x04),
    (ACC, 0x40, 0x89),
    (ACC, 0x41, 0x02),
    (ACC, 0x48, 0x02),
    (ACC, 0x49, 0x50),
    (GYRO, 0x0F, 0x03),
    (GYRO, 0x10, 0x84),
    (GYRO, 0x11, 0x00),
    (GYRO, 0x3E, 0x40),
];

#[test]
fn a_failed_self_test_is_named() {
    let failed = |bank| Some(SpiError::SelfTest { bank });
    let dies = Dies::new([0.0; 2]);
    assert_eq!(start(&dies, true).err(), None);
    // The gyro fails, its drive is not in order, its test never ends.
    for gyro in [0x16, 0x02, 0] {
        dies.borrow_mut().held = vec![(GYRO, 0x3C, gyro)];
        assert_eq!(start(&dies, true).err(), failed(1));
    }
    dies.borrow_mut().held.clear();
    // y and z move too little, all move the wrong way.
    for deflected in [
        [[683, 682, 1366], [-683, -683, 0]],
        [[683, 683, 1365], [-683, -683, 683]],
        [[-683, -683, -683], [683, 683, 683]],
    ] {
        dies.borrow_mut().deflected = deflected;
        assert_eq!(start(&dies, true).err(), failed(0));
    }
}

/// At the start and later.
#[test]
fn a_setting_that_does_not_read_back_and_a_drive_that_fails_are_named() {
    let dies = Dies::new([0.0; 2]);
    let mut part = start(&dies, false).expect("a good part");
    assert_eq!([(ACC, 0x7E), (GYRO, 0x14)].map(|(die, at)| dies.borrow().registers[die][at]), [0xB6; 2]);
    for (die, address, expected) in REGISTERS {
        assert_eq!(dies.borrow().registers[die][usize::from(address)], expected);
        let got = expected ^ 0x21;
        dies.borrow_mut().held = vec![(die, address, got)];
        let changed = Some(SpiError::Setting { bank: die as u8, address, got, expected });
        assert_eq!((0..CHECKS).find_map(|_| part.next_sample().err()), changed);
        assert_eq!(start(&dies, false).err(), changed);
    }
    dies.borrow_mut().held = vec![(GYRO, 0x3C, 0x02)];
    let failed = Some(SpiError::SelfTest { bank: 1 });
    assert_eq!((0..CHECKS).find_map(|_| part.next_sample().err()), failed);
}

/// A reading is the true time of its frame in units of 100 us, modulo this.
const WRAP_MS: f64 = 3_276.8;

/// Two dies with a FIFO each, of which only the gyro's can be full.
struct Dies {
    now_us: f64,
    period_us: [f64; 2],
    /// Frames made and read.
    made: [u64; 2],
    read: [u64; 2],
    overrun: bool,
    /// The accelerometer misses what would empty its FIFO.
    is_deaf: bool,
    registers: [[u8; 128]; 2],
    /// Registers that answer this, whatever is written.
    held: Vec<(usize, u8, u8)>,
    /// What the accelerometer reads in its self-test, counts at 24 g, 1365 per g.
    deflected: [[i16; 3]; 2],
}

impl Dies {
    fn new(fast: [f64; 2]) -> Rc<RefCell<Self>> {
        Rc::new(RefCell::new(Self {
            now_us: 0.0,
            period_us: fast.map(|fast| 5_000.0 / (1.0 + fast)),
            made: [0; 2],
            read: [0; 2],
            overrun: false,
            is_deaf: false,
            registers: [[0; 128]; 2],
            held: Vec::new(),
            deflected: [[683, 683, 1366], [-683, -683, 683]],
        }))
    }

    fn run_until(&mut self, now_us: f64) {
        self.now_us = now_us;
        for die in [ACC, GYRO] {
            let due = (now_us / self.period_us[die]) as u64;
            if die == GYRO && due - self.read[GYRO] > 100 {
                (self.overrun, self.made[GYRO]) = (true, self.read[GYRO] + 100);
            } else if !(die == GYRO && self.overrun) {
                self.made[die] = due;
            }
        }
    }

    fn reading(&mut self, die: usize) -> [u8; 6] {
        self.read[die] += 1;
        let at = (self.read[die] as f64 * self.period_us[die] / 100.0) as u64 % 32_768;
        [at as i16; 3].map(i16::to_le_bytes).concat().try_into().expect("six bytes")
    }
}

impl Part for Dies {
    /// The accelerometer sends one byte before the value.
    fn dummies(die: usize) -> usize {
        usize::from(die == ACC)
    }

    fn read(&mut self, die: usize, address: u8, to: &mut [u8]) {
        if let Some((.., held)) = self.held.iter().find(|(of, at, _)| (*of, *at) == (die, address)) {
            return to.fill(*held);
        }
        match (die, address) {
            (_, 0x00) => to.fill([0x1E, 0x0F][die]),
            (GYRO, 0x0E) => {
                to.fill((self.made[GYRO] - self.read[GYRO]) as u8 | if self.overrun { 0x80 } else { 0 });
            }
            (GYRO, 0x3F) => to.copy_from_slice(&self.reading(GYRO)),
            (ACC, 0x18) => {
                let time = (self.now_us / self.period_us[ACC] * 128.0) as u32 & 0xFF_FFFF;
                to.fill(0);
                to[..3].copy_from_slice(&time.to_le_bytes()[..3]);
                to[12..].copy_from_slice(&((self.made[ACC] - self.read[ACC]) as u16 * 7).to_le_bytes());
            }
            (ACC, 0x26) => {
                to[0] = 0x84;
                to[1..].copy_from_slice(&self.reading(ACC));
            }
            (GYRO, 0x3C) => to.fill(if self.registers[GYRO][0x3C] == 1 { 0x12 } else { 0x10 }),
            (ACC, 0x12) => {
                assert_eq!([0x40, 0x41].map(|at| self.registers[ACC][at]), [0xAC, 3]);
                let ways = [0x0D, 0x09].map(|way| way == self.registers[ACC][0x6D]);
                let way = ways.iter().position(|is_set| *is_set).expect("masses are deflected");
                to.copy_from_slice(&self.deflected[way].map(i16::to_le_bytes).concat());
            }
            _ => to.fill(self.registers[die][usize::from(address)]),
        }
    }

    fn write(&mut self, die: usize, address: u8, value: u8) {
        if (die, address) == (GYRO, 0x3E) {
            self.overrun = false;
            self.made[GYRO] = (self.now_us / self.period_us[GYRO]) as u64;
        }
        if matches!((die, address), (GYRO, 0x3E) | (ACC, 0x7E)) && !(self.is_deaf && die == ACC) {
            self.read[die] = self.made[die];
        }
        if value == 0xB6 {
            self.registers[die] = [0; 128];
        }
        self.registers[die][usize::from(address)] = value;
    }
}

fn start(dies: &Rc<RefCell<Dies>>, self_test: bool) -> Result<Bmi088<Select<Dies>>, SpiError<Infallible>> {
    Bmi088::new([ACC, GYRO].map(|die| Select(dies.clone(), die)), self_test, &mut NoDelay)
}

/// For each difference of the clocks: a minute with a poll every millisecond, stalls of 0.4 s (the FIFO holds them) and of
/// 0.9 s (it overflows). The bounds are those of the module's table.
#[test]
fn two_clocks_cost_what_the_module_says() {
    for fast in [[0.0, 0.0], [0.01, -0.01], [-0.01, 0.01], [0.01, 0.01]] {
        let dies = Dies::new(fast);
        let difference: f64 = (fast[ACC] - fast[GYRO]).abs();
        let mut part = start(&dies, false).expect("a good part");
        let [mut in_step, mut behind] = [[0.0f64; 2]; 2];
        let (mut misplaced, mut overflows, mut without, mut samples, mut now) = (0.0f64, 0, 0, 0u32, 0.0);
        while now < 60e6 {
            let stall = match (now / 1e3) as u64 % 10_000 {
                4_000 => 400e3,
                8_000 => 900e3,
                _ => 1e3,
            };
            now += stall;
            dies.borrow_mut().run_until(now);
            loop {
                match part.next_sample() {
                    Ok(None) => break,
                    Ok(Some(sample)) => {
                        samples += 1;
                        if overflows == 0 {
                            assert_eq!(sample.time, Micros(5_000 * u64::from(samples + without)));
                        }
                        let [rate, force] = taken(&sample);
                        let older = wrapped(rate - force);
                        let worst = if stall < 2e3 { &mut in_step } else { &mut behind };
                        *worst = [worst[0].min(older), worst[1].max(older)];
                        // The time stamps tell the gyro's clock.
                        let stamp = sample.time.0 as f64 / 1e3 / (1.0 + fast[GYRO]);
                        misplaced = misplaced.max(wrapped(rate - stamp).abs());
                    }
                    Err(SpiError::Overflow) => overflows += 1,
                    Err(SpiError::NoReading) => without += 1,
                    Err(other) => panic!("{other}"),
                }
            }
        }
        println!(
            "clocks {difference} apart: the force is {in_step:.1?} ms older in step, {behind:.1?} ms after a stall; \
             after {overflows} overflows {misplaced:.1} ms misplaced"
        );
        // But for what the overflows drop, every frame of the gyro gives a sample; the first one, and the first after each
        // overflow, may come before any force.
        let due = ((60e6 - 6.0 * 900e3) * (1.0 + fast[GYRO]) / 5e3) as u32;
        assert!(overflows == 6 && without <= overflows + 1, "{overflows} overflows, {without} without force");
        assert!((samples + without).abs_diff(due) <= 200, "{samples} of {due} samples");
        assert!(in_step[0] >= -1.1 && in_step[1] <= 5.2, "{in_step:?}");
        assert!(
            behind[0] >= -6.0 - 400.0 * difference && behind[1] <= 6.0 + 400.0 * difference,
            "{behind:?}"
        );
        assert!(misplaced <= 6.0 * (1_000.0 * difference + 2.6), "{misplaced}");
    }
}

#[test]
fn accelerations_from_before_an_overflow_go_with_no_rate() {
    let dies = Dies::new([0.0; 2]);
    let mut part = start(&dies, false).expect("a good part");
    dies.borrow_mut().is_deaf = true;
    dies.borrow_mut().run_until(900e3);
    assert_eq!(part.next_sample(), Err(SpiError::Overflow));
    let (mut good, mut without) = (0, 0);
    for frame in 1..=40 {
        dies.borrow_mut().run_until(900e3 + 5e3 * f64::from(frame) + 1.0);
        match part.next_sample() {
            Ok(sample) => {
                let [rate, force] = taken(&sample.expect("a frame waits"));
                assert!(wrapped(rate - force).abs() <= 6.0, "{rate} {force}");
                good += 1;
            }
            Err(error) => {
                assert_eq!(error, SpiError::NoReading);
                without += 1;
            }
        }
    }
    assert!((good, without) == (29, 11), "{good} good, {without} without");
    // No acceleration comes any more: the last one serves for four samples.
    dies.borrow_mut().held = vec![(ACC, 0x18, 0)];
    for frame in 1..=2 * OLDEST {
        dies.borrow_mut().run_until(1_100e3 + 5e3 * f64::from(frame) + 1.0);
        assert_eq!(part.next_sample().is_ok(), frame <= OLDEST);
    }
}

/// Times at which rate and force were taken, ms modulo [`WRAP_MS`].
fn taken(sample: &ImuSample) -> [f64; 2] {
    let rate = sample.angular_rate[0].rad_per_sec().to_degrees() * 131.072;
    let force = sample.specific_force[0].metre_per_sec2() * (32_768.0 / 12.0 / 9.806_65);
    [rate, force].map(|count| count.round() / 10.0)
}

fn wrapped(ms: f64) -> f64 {
    (ms + WRAP_MS / 2.0).rem_euclid(WRAP_MS) - WRAP_MS / 2.0
}
