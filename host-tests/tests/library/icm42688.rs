//! ICM-42688-P: FIFO packets, and the driver on a mocked bus.

use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use gyronet::sample::Validity;
use gyronet::sensor::Source;
use gyronet::sensor::icm42688::packet::{Packet, PacketError};
use gyronet::sensor::icm42688::registers::{self as reg, Register};
use gyronet::sensor::icm42688::{Bandwidth, Icm42688, Icm42688Config, Icm42688Error, OutputRate};
use gyronet::units::{CentiCelsius, Micros};
use proptest::prelude::*;

/// az 1 g, gz 10 deg/s, ay -4 and gy -2 counts, 30 deg C, time 1000.
const PACKET_4: [u8; 20] =
    [0x78, 0, 0, 0xff, 0xff, 8, 0, 0, 0, 0xff, 0xff, 0, 0xa3, 2, 0x96, 3, 0xe8, 0, 0xce, 0x0c];

fn packet_4() -> Packet {
    Packet {
        acceleration: [0, -4, 32_768].map(Some),
        rate: [0, -2, 2620].map(Some),
        temperature: Some(662),
        time: 1000,
    }
}

#[test]
fn a_packet_is_read_as_the_data_sheet_says() {
    assert_eq!(Packet::parse(&PACKET_4), Ok(packet_4()));
    assert_eq!(packet_4().emit(), PACKET_4);
}

#[test]
fn invalid_marks_are_no_readings() {
    let mut bytes = PACKET_4;
    bytes[0] |= 0x80;
    assert_eq!(Packet::parse(&bytes), Err(PacketError::Empty));
    for axis in 0..3 {
        let mut missing = packet_4();
        missing.acceleration[axis] = None;
        missing.temperature = None;
        assert_eq!(missing.emit()[1 + 2 * axis..3 + 2 * axis], [0x80, 0]);
        assert_eq!(Packet::parse(&missing.emit()), Ok(missing));
        let mut missing = packet_4();
        missing.rate[axis] = None;
        assert_eq!(Packet::parse(&missing.emit()), Ok(missing));
    }
}

/// The lowest reading that a saturated axis gives is above those that mean "no reading" (DS-000347,
/// 12.8, FIFO_HOLD_LAST_DATA_EN = 0).
#[test]
fn either_end_of_the_range_is_saturation() {
    let clipped =
        |packet: Packet| packet.sample(Micros(0)).expect("a reading").validity == Validity::Saturated;
    for (end, inside) in [(-524_256, -524_252), (524_284, 524_280)] {
        for axis in 0..3 {
            for (reading, saturated) in [(end, true), (inside, false)] {
                let mut packet = packet_4();
                packet.acceleration[axis] = Some(reading);
                assert_eq!(clipped(packet), saturated, "acceleration {reading}");
                // 2000 deg/s is beyond what a rate holds: there is no sample then.
                let packet = Packet { rate: [Some(reading); 3], ..packet_4() };
                assert_eq!(packet.sample(Micros(0)), None);
            }
        }
    }
}

/// The part's registers, and what the bus sees of them.
#[derive(Default)]
struct Bus {
    seen: Vec<Transaction<u8>>,
}

impl Bus {
    fn write(&mut self, address: u8, value: u8) {
        self.seen.push(Transaction::transaction_start());
        self.seen.push(Transaction::write_vec(vec![address, value]));
        self.seen.push(Transaction::transaction_end());
    }

    fn read(&mut self, address: u8, values: &[u8]) {
        self.seen.push(Transaction::transaction_start());
        self.seen.push(Transaction::write_vec(vec![address | 0x80]));
        self.seen.push(Transaction::read_vec(values.to_vec()));
        self.seen.push(Transaction::transaction_end());
    }

    fn in_bank(&mut self, bank: u8, act: impl FnOnce(&mut Self)) {
        if bank > 0 {
            self.write(0x76, bank);
        }
        act(self);
        if bank > 0 {
            self.write(0x76, 0);
        }
    }

    /// Selects bank 0, resets, answers the second look, and says who it is.
    fn reset(&mut self, identity: u8) {
        self.write(0x76, 0);
        self.write(0x11, 1);
        self.read(0x11, &[1]);
        self.read(0x11, &[0]);
        self.read(0x75, &[identity]);
    }

    fn start(&mut self, registers: &[(u8, u8, u8, u8); 17]) {
        self.reset(0x47);
        for &(bank, address, after_reset, value) in registers {
            self.in_bank(bank, |bus| {
                bus.read(address, &[after_reset]);
                bus.write(address, value);
            });
        }
        for &(bank, address, _, value) in registers {
            self.in_bank(bank, |bus| bus.read(address, &[value]));
        }
        self.write(0x4B, 0x02);
    }
}

/// Bank, address, value after a reset, value that the driver writes; written from the data, not
/// from the driver's constants.
const REGISTERS: [(u8, u8, u8, u8); 17] = [
    (0, 0x4C, 0x30, 0x30),
    (0, 0x4D, 0x91, 0x51),
    (0, 0x4F, 0x06, 0x68),
    (0, 0x50, 0x06, 0x08),
    (0, 0x51, 0x16, 0x1A),
    (0, 0x52, 0x11, 0x55),
    (0, 0x53, 0x0D, 0x15),
    (1, 0x0B, 0xA0, 0xA0),
    (1, 0x0C, 0x0D, 0x06),
    (1, 0x0D, 0xAA, 0x24),
    (1, 0x0E, 0x80, 0xA0),
    (2, 0x03, 0x30, 0x0C),
    (2, 0x04, 0x40, 0x24),
    (2, 0x05, 0x62, 0xA0),
    (0, 0x5F, 0x00, 0x17),
    (0, 0x16, 0x00, 0x40),
    (0, 0x4E, 0x00, 0x0F),
];

#[test]
fn the_driver_configures_and_reads() {
    let mut bus = Bus::default();
    bus.start(&REGISTERS);
    // Nothing waits.
    bus.read(0x4C, &[0x30]);
    bus.read(0x2E, &[0, 19]);
    // One packet, and again with the time wrapped.
    bus.read(0x4D, &[0x51]);
    bus.read(0x2E, &[0, 20]);
    bus.read(0x30, &PACKET_4);
    bus.read(0x4F, &[0x68]);
    bus.read(0x2E, &[0, 40]);
    bus.read(0x30, &Packet { time: 999, ..packet_4() }.emit());
    // An axis without a reading; another packet than was set; an empty FIFO after all.
    bus.read(0x50, &[0x08]);
    bus.read(0x2E, &[0, 40]);
    bus.read(0x30, &Packet { rate: [None; 3], ..packet_4() }.emit());
    bus.read(0x51, &[0x1A]);
    bus.read(0x2E, &[0, 40]);
    bus.read(0x30, &[0x68; 20]);
    bus.write(0x4B, 0x02);
    bus.read(0x52, &[0x55]);
    bus.read(0x2E, &[0, 40]);
    bus.read(0x30, &[0x80; 20]);
    bus.read(0x53, &[0x15]);
    bus.read(0x2E, &[0, 0]);
    // A register of another bank that has changed.
    bus.in_bank(1, |bus| bus.read(0x0B, &[0xA1]));
    let mut spi = Mock::new(&bus.seen);
    let mut part =
        Icm42688::new(spi.clone(), Icm42688Config::default(), &mut NoopDelay::new()).expect("a good part");
    assert_eq!(part.next_sample(), Ok(None));
    let sample = part.next_sample().expect("good").expect("one waits");
    assert!((sample.angular_rate[2].rad_per_sec() - 10f64.to_radians()).abs() < 2e-8);
    assert!((sample.specific_force[2].metre_per_sec2() - 9.806_65).abs() < 2e-6);
    // 1000 counts of 32/30 us, without a clock on CLKIN (DS-000347, 12.7).
    assert_eq!((sample.time.0, sample.temperature), (1067, Some(CentiCelsius(3000))));
    assert_eq!(sample.validity, Validity::Good);
    assert_eq!(part.next_sample().expect("good").expect("one waits").time.0, 70_971);
    assert_eq!(part.next_sample(), Err(Icm42688Error::NoReading));
    assert_eq!(part.next_sample(), Err(Icm42688Error::Packet(PacketError::Header { got: 0x68 })));
    assert_eq!(part.next_sample(), Ok(None));
    assert_eq!(part.next_sample(), Ok(None));
    let register = Register { bank: 1, address: 0x0B };
    let changed = Icm42688Error::Setting { register, got: 1, expected: 0 };
    assert_eq!(part.next_sample(), Err(changed));
    drop(part);
    spi.done();
}

#[test]
fn a_part_at_1_khz_is_read() {
    let mut registers = REGISTERS;
    registers[2].3 = 0x66;
    registers[3].3 = 0x06;
    registers[5].3 = 0x66;
    let mut bus = Bus::default();
    bus.start(&registers);
    bus.read(0x4C, &[0x30]);
    bus.read(0x2E, &[0, 20]);
    bus.read(0x30, &PACKET_4);
    let mut spi = Mock::new(&bus.seen);
    let config = Icm42688Config { rate: OutputRate::Hz1000, bandwidth: Bandwidth::Twentieth };
    let mut part = Icm42688::new(spi.clone(), config, &mut NoopDelay::new()).expect("a good part");
    // As every part is asked, whatever its line.
    let sample = Source::next_sample(&mut part).expect("one waits").expect("good");
    assert!((sample.angular_rate[2].rad_per_sec() - 10f64.to_radians()).abs() < 2e-8);
    drop(part);
    spi.done();
}

/// The part keeps its reset value, 92.3 Hz, in the register of the bandwidths.
#[test]
fn a_bandwidth_that_does_not_read_back_is_refused() {
    let mut bus = Bus::default();
    bus.reset(0x47);
    for &(bank, address, after_reset, value) in &REGISTERS {
        bus.in_bank(bank, |bus| {
            bus.read(address, &[after_reset]);
            bus.write(address, value);
        });
    }
    for &(bank, address, after_reset, value) in &REGISTERS[..6] {
        let held = if address == 0x52 { after_reset } else { value };
        bus.in_bank(bank, |bus| bus.read(address, &[held]));
    }
    let mut spi = Mock::new(&bus.seen);
    let error = Icm42688::new(spi.clone(), Icm42688Config::default(), &mut NoopDelay::new()).err();
    let register = Register { bank: 0, address: 0x52 };
    assert_eq!(error, Some(Icm42688Error::Setting { register, got: 0x11, expected: 0x55 }));
    spi.done();
}

#[test]
fn another_part_or_none_is_named() {
    let mut bus = Bus::default();
    bus.reset(0x42);
    let mut spi = Mock::new(&bus.seen);
    let error = Icm42688::new(spi.clone(), Icm42688Config::default(), &mut NoopDelay::new()).err();
    assert_eq!(error, Some(Icm42688Error::Identity { got: 0x42 }));
    spi.done();
    // A line that is always high: the reset bit never goes; the wait is bounded.
    let mut bus = Bus::default();
    bus.write(0x76, 0);
    bus.write(0x11, 1);
    (0..10).for_each(|_| bus.read(0x11, &[0xFF]));
    let mut spi = Mock::new(&bus.seen);
    let error = Icm42688::new(spi.clone(), Icm42688Config::default(), &mut NoopDelay::new()).err();
    assert_eq!(error, Some(Icm42688Error::Reset));
    spi.done();
    assert_eq!(reg::IDENTITY, 0x47);
}

fn any_packet() -> impl Strategy<Value = Packet> {
    let axes = || prop::array::uniform3(prop::option::of(-524_287..524_288i32));
    let temperature = prop::option::of(-32_767..=32_767i16);
    (axes(), axes(), temperature, any::<u16>()).prop_map(|(acceleration, rate, temperature, time)| Packet {
        acceleration,
        rate,
        temperature,
        time,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trip(packet in any_packet()) {
        prop_assert_eq!(Packet::parse(&packet.emit()), Ok(packet));
    }
}
