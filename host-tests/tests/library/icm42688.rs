//! ICM-42688-P: FIFO packets, and the driver on a simulated bus.

use gyronet::sample::Validity;
use gyronet::sensor::Source;
use gyronet::sensor::icm42688::packet::{Packet, PacketError};
use gyronet::sensor::icm42688::{CHECKS, Icm42688};
use gyronet::sensor::spi::SpiError;
use gyronet::units::{CentiCelsius, Micros};
use gyronet_host_tests::situations::icm42688::Simulated;
use gyronet_host_tests::spi::{NoDelay, Select};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

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
fn a_packet_is_read_as_the_data_sheet_says_and_invalid_marks_are_no_readings() {
    assert_eq!(Packet::parse(&PACKET_4), Ok(packet_4()));
    assert_eq!(packet_4().emit(), PACKET_4);
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

type Bus = Rc<RefCell<Simulated>>;

fn start(bus: &Bus) -> Result<Icm42688<Select<Simulated>>, SpiError<Infallible>> {
    Icm42688::new(Select(Rc::clone(bus), 0), &mut NoDelay)
}

#[test]
fn the_driver_configures_and_checks_each_register() {
    let bus = Bus::default();
    let after_reset = REGISTERS.map(|(bank, address, after_reset, _)| ((bank, address), after_reset));
    bus.borrow_mut().registers.extend(after_reset);
    let mut part = start(&bus).expect("a good part");
    let mut written = vec![(0, 0x11, 1)];
    written.extend(REGISTERS.map(|(bank, address, _, value)| (bank, address, value)));
    written.push((0, 0x4B, 0x02));
    assert_eq!(bus.borrow().written, written);
    for (bank, address, _, value) in REGISTERS {
        bus.borrow_mut().held = Some((bank, address, !value));
        let is_named = |error| {
            let Some(SpiError::Setting { bank: of, address: at, got, expected }) = error else {
                return false;
            };
            (of, at) == (bank, address) && got != expected && expected & !value == 0
        };
        assert!(is_named((0..CHECKS).find_map(|_| part.next_sample().err())), "{bank} {address:02x}");
        assert!(is_named(start(&bus).err()), "{bank} {address:02x}");
        bus.borrow_mut().held = None;
    }
}

#[test]
fn packets_are_read_one_by_one() {
    let bus = Bus::default();
    let mut part = start(&bus).expect("a good part");
    bus.borrow_mut().fifo.extend(PACKET_4[..19].iter().copied());
    assert_eq!(part.next_sample(), Ok(None));
    bus.borrow_mut().fifo.extend([PACKET_4[19]]);
    bus.borrow_mut().fifo.extend(Packet { time: 999, ..packet_4() }.emit());
    bus.borrow_mut().fifo.extend(Packet { rate: [None; 3], ..packet_4() }.emit());
    let sample = Source::next_sample(&mut part).expect("one waits").expect("good");
    assert!((sample.angular_rate[2].rad_per_sec() - 10f64.to_radians()).abs() < 2e-8);
    assert!((sample.specific_force[2].metre_per_sec2() - 9.806_65).abs() < 2e-6);
    // 1000 counts of 32/30 us, without a clock on CLKIN (DS-000347, 12.7).
    assert_eq!((sample.time.0, sample.temperature), (1067, Some(CentiCelsius(3000))));
    assert_eq!(sample.validity, Validity::Good);
    assert_eq!(part.next_sample().expect("good").expect("one waits").time.0, 70_971);
    assert_eq!(part.next_sample(), Err(SpiError::NoReading));
    // Another packet than was set empties the FIFO; the last one is empty after all.
    bus.borrow_mut().fifo.extend([0x68; 40]);
    assert_eq!(part.next_sample(), Err(SpiError::Packet { got: 0x68 }));
    bus.borrow_mut().fifo.extend([0x80; 20]);
    assert_eq!(part.next_sample(), Ok(None));
}

#[test]
fn another_part_or_none_is_named() {
    let bus = Bus::default();
    bus.borrow_mut().held = Some((0, 0x75, 0x42));
    let wrong = SpiError::Identity { bank: 0, got: 0x42, expected: 0x47 };
    assert_eq!(start(&bus).err(), Some(wrong));
    // A line that is always high: the reset bit never goes; the wait is bounded.
    bus.borrow_mut().held = Some((0, 0x11, 0xFF));
    assert_eq!(start(&bus).err(), Some(SpiError::Reset));
}
