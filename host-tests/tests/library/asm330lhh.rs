//! ASM330LHH: words of the FIFO, and the driver on a simulated bus.

use gyronet::sample::{ImuSample, Validity};
use gyronet::sensor::asm330lhh::word::{Incomplete, Outputs, Readings, Word};
use gyronet::sensor::asm330lhh::{Asm330lhh, CHECKS};
use gyronet::sensor::spi::SpiError;
use gyronet::units::{CentiCelsius, Micros};
use gyronet_host_tests::spi::{self, NoDelay, Select};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

/// 10 deg/s about z in the range of 250, and 1 g along z in that of 16 g.
const RATE: [i16; 3] = [0, -2, 1143];
const FORCE: [i16; 3] = [0, -4, 2049];
const AT: u32 = 0x0403_0201;

fn word(output: u8, sensor: u8, data: &[u8]) -> [u8; 7] {
    let tag = sensor << 3 | (output & 3) << 1;
    let mut word = [0; 7];
    word[0] = tag | (tag.count_ones() % 2) as u8;
    word[1..=data.len()].copy_from_slice(data);
    word
}

/// The words of an output: rate, acceleration, time.
fn output(number: u8, time: u32) -> [[u8; 7]; 3] {
    let [rate, force] = [RATE, FORCE].map(|axes| axes.map(i16::to_le_bytes).concat());
    [word(number, 1, &rate), word(number, 2, &force), word(number, 4, &time.to_le_bytes())]
}

fn parsed(word: [u8; 7]) -> Word {
    Word::parse(&word).expect("a good word")
}

#[test]
fn words_of_one_output_belong_together_in_any_order() {
    // By hand: 1 << 3 | 2 << 1 has two ones, 3 << 3 | 1 << 1 three.
    assert_eq!((output(2, AT)[0][0], word(1, 3, &[])[0]), (0x0C, 0x1B));
    for sensor in [0, 5, 6, 31] {
        assert_eq!(Word::parse(&word(0, sensor, &[])), None, "{sensor}");
    }
    let words = output(1, AT).map(parsed);
    let complete = |temperature| Ok(Some(Readings { rate: RATE, force: FORCE, time: AT, temperature }));
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let mut outputs = Outputs::default();
        let [first, second, third] = order.map(|at| outputs.add(words[at]));
        assert_eq!([first, second, third], [Ok(None), Ok(None), complete(None)], "{order:?}");
    }
    for missing in 0..3 {
        let mut outputs = Outputs::default();
        let kept = words.iter().enumerate().filter(|(at, _)| *at != missing);
        assert!(kept.map(|(_, word)| outputs.add(*word)).all(|added| added == Ok(None)));
        // The temperature alone begins no output, and is that of the next one; the first word of the next is kept.
        let next = output(2, AT).map(parsed);
        assert_eq!(outputs.add(next[0]), Err(Incomplete), "without word {missing}");
        assert_eq!(outputs.add(parsed(word(2, 3, &[0x80, 0xFF]))), Ok(None));
        assert_eq!([outputs.add(next[1]), outputs.add(next[2])], [Ok(None), complete(Some(-128))]);
        assert_eq!(outputs.add(parsed(word(3, 3, &[0, 2]))), Ok(None));
        assert_eq!(outputs.add(words[0]), Ok(None));
    }
}

#[test]
fn readings_have_the_units_of_the_data_sheet() {
    let readings = Readings { rate: RATE, force: FORCE, time: 0, temperature: Some(-640) };
    let sample = readings.sample(Micros(7)).expect("in range");
    assert_eq!((sample.time, sample.temperature), (Micros(7), Some(CentiCelsius(2_250))));
    assert!((sample.angular_rate[2].rad_per_sec().to_degrees() - 10.001_25).abs() < 1e-5);
    assert!((sample.specific_force[2].metre_per_sec2() - 9.806_65 * 0.999_912).abs() < 1e-5);
    // 250 deg/s, and the ends of a word.
    for (rate, force, expected) in [
        (28_570, 32_766, Validity::Good),
        (-28_570, -32_766, Validity::Good),
        (28_571, 0, Validity::Saturated),
        (-28_571, 0, Validity::Saturated),
        (i16::MIN, 0, Validity::Saturated),
        (0, i16::MAX, Validity::Saturated),
        (0, -i16::MAX, Validity::Saturated),
        (0, i16::MIN, Validity::Saturated),
    ] {
        for axis in 0..3 {
            let mut readings = Readings { rate: [0; 3], force: [0; 3], ..readings };
            (readings.rate[axis], readings.force[axis]) = (rate, force);
            assert_eq!(readings.sample(Micros(0)).expect("in range").validity, expected, "{rate} {force}");
        }
    }
}

/// Address and value; written from ST's registers, not from the driver's constants.
const REGISTERS: [(u8, u8); CHECKS] = [
    (0x12, 0x44),
    (0x13, 0x06),
    (0x14, 0x00),
    (0x15, 0x06),
    (0x17, 0x20),
    (0x18, 0xE2),
    (0x19, 0x20),
    (0x10, 0x56),
    (0x11, 0x50),
    (0x09, 0x55),
    (0x0A, 0x76),
];

/// Registers, and a FIFO that is filled by hand.
struct Part {
    registers: [u8; 128],
    /// Registers that answer this, whatever is written.
    held: Vec<(u8, u8)>,
    fifo: VecDeque<[u8; 7]>,
    has_lost: bool,
    /// What the self-test changes: rate, acceleration, counts at 2000 deg/s and 4 g.
    deflected: [[i16; 3]; 2],
}

type Bus = Rc<RefCell<Part>>;

fn new() -> Bus {
    let deflected = [[2_143, -10_000, 5_000], [328, -13_934, 1_000]];
    let (held, fifo) = (Vec::new(), VecDeque::new());
    Rc::new(RefCell::new(Part { registers: [0; 128], held, fifo, has_lost: false, deflected }))
}

fn start(bus: &Bus, self_test: bool) -> Result<Asm330lhh<Select<Part>>, SpiError<Infallible>> {
    Asm330lhh::new(Select(Rc::clone(bus), 0), self_test, &mut NoDelay)
}

impl spi::Part for Part {
    fn write(&mut self, _: usize, address: u8, value: u8) {
        match (address, value) {
            (0x12, 0x05) => self.registers = [0; 128],
            _ => self.registers[usize::from(address)] = value,
        }
    }

    fn read(&mut self, _: usize, address: u8, to: &mut [u8]) {
        if let Some((_, held)) = self.held.iter().find(|(at, _)| *at == address) {
            return to.fill(*held);
        }
        match address {
            0x0F => to.fill(0x6B),
            0x22 | 0x28 => {
                let is_test = [0x10, 0x11, 0x12].map(|at| self.registers[at]) == [0x58, 0x5C, 0x44];
                assert!(is_test, "208 Hz, 4 g and 2000 deg/s, no byte changes in a transfer");
                let moved = i16::from(self.registers[0x14] == 0x05);
                let sensor = usize::from(address == 0x28);
                let readings = self.deflected[sensor].iter().map(|counts| 100 + counts * moved);
                to.copy_from_slice(&readings.flat_map(i16::to_le_bytes).collect::<Vec<_>>());
            }
            0x3A => {
                let state =
                    self.fifo.len() as u16 | if core::mem::take(&mut self.has_lost) { 0x4800 } else { 0 };
                to.copy_from_slice(&state.to_le_bytes());
            }
            0x78 => to.copy_from_slice(&self.fifo.pop_front().unwrap_or_default()),
            at => to.fill(self.registers[usize::from(at)]),
        }
    }
}

#[test]
fn a_self_test_out_of_its_limits_is_named() {
    let bus = new();
    assert_eq!(start(&bus, true).err(), None);
    for (sensor, limits) in [[2_143, 10_000], [328, 13_934]].into_iter().enumerate() {
        for (axis, wrong) in (0..3).flat_map(|axis| [(axis, limits[0] - 1), (axis, limits[1] + 1), (axis, 0)])
        {
            let bus = new();
            bus.borrow_mut().deflected[sensor][axis] = wrong;
            assert_eq!(start(&bus, true).err(), Some(SpiError::SelfTest { bank: 0 }), "{axis} {wrong}");
            assert_eq!(start(&bus, false).err(), None);
        }
    }
}

/// At the start and later.
#[test]
fn a_setting_that_does_not_read_back_is_named() {
    let bus = new();
    let mut part = start(&bus, true).expect("a good part");
    for (address, expected) in REGISTERS {
        assert_eq!(bus.borrow().registers[usize::from(address)], expected, "{address:02x}");
        let got = expected ^ 0x40;
        bus.borrow_mut().held = vec![(address, got)];
        let changed = Some(SpiError::Setting { bank: 0, address, got, expected });
        assert_eq!((0..CHECKS).find_map(|_| part.next_sample().err()), changed);
        assert_eq!(start(&bus, false).err(), changed);
    }
    assert!(SpiError::<Infallible>::Reset.is_lost() && !SpiError::<Infallible>::NoReading.is_lost());
}

fn sample(part: &mut Asm330lhh<Select<Part>>) -> ImuSample {
    part.next_sample().expect("good").expect("one waits")
}

#[test]
fn outputs_are_read_one_by_one_and_what_is_missing_is_named() {
    let bus = new();
    let mut part = start(&bus, false).expect("a good part");
    assert_eq!(part.next_sample(), Ok(None));
    let [rate, force, time] = output(1, 192);
    bus.borrow_mut().fifo.extend([rate, force]);
    assert_eq!(part.next_sample(), Ok(None));
    bus.borrow_mut().fifo.extend([time].into_iter().chain(output(2, 384)));
    // The first one has a temperature, too: 25 deg C.
    let first = sample(&mut part);
    assert_eq!((first.time, first.temperature), (Micros(4_800), Some(CentiCelsius(2_500))));
    assert_eq!(sample(&mut part).time, Micros(9_600));
    assert_eq!(part.next_sample(), Ok(None));
    // A damaged tag: its word is left out, and then its output.
    let mut damaged = output(3, 576);
    damaged[1][0] ^= 0x20;
    bus.borrow_mut().fifo.extend(damaged.into_iter().chain(output(0, 768)));
    assert_eq!(part.next_sample(), Err(SpiError::Packet { got: damaged[1][0] }));
    assert_eq!(part.next_sample(), Err(SpiError::NoReading));
    assert_eq!(sample(&mut part).time, Micros(19_200));
    // A full FIFO: what was begun is not put together with words of a later output of the same number.
    bus.borrow_mut().fifo.extend([rate]);
    assert_eq!(part.next_sample(), Ok(None));
    bus.borrow_mut().fifo.extend([force, time].into_iter().chain(output(2, 400_000)));
    bus.borrow_mut().has_lost = true;
    assert_eq!(part.next_sample(), Err(SpiError::Overflow));
    assert_eq!(part.next_sample(), Err(SpiError::NoReading));
    assert_eq!(sample(&mut part).time, Micros(10_000_000));
}

#[test]
fn time_stamps_have_the_measured_deviation_of_the_oscillator() {
    for (fine, us) in [(0_i8, 25_000_000.0), (7, 25_000_000.0 / 1.0105), (-128, 25_000_000.0 / 0.808)] {
        let bus = new();
        bus.borrow_mut().held = vec![(0x63, fine as u8)];
        let mut part = start(&bus, false).expect("a good part");
        // A counter that wraps on the way.
        bus.borrow_mut().fifo.extend(output(1, u32::MAX - 499_999).into_iter().chain(output(2, 500_000)));
        let [first, second] = [sample(&mut part).time.0, sample(&mut part).time.0];
        assert!(((second - first) as f64 - us).abs() <= 1.0, "{fine}: {first} {second}");
    }
}
