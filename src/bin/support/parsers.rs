//! Measures the parsers with a frame of each kind, byte by byte as the output task takes them out of their queue. A
//! parser with a clock or a counter has parsed a frame before the measured one.

use crate::meter::Meter;
use core::hint::black_box;
use cortex_m_semihosting::hprintln;
use gyronet::sensor::ByteSource;
use gyronet::sensor::dsp1760::Dsp1760;
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::icm42688::packet::Packet;
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::units::Micros;

pub fn run(meter: &mut Meter) {
    dsp1760(meter);
    mtdata2(meter);
    packet(meter);
    hprintln!("sensor/dsp1760_parser bytes={}", size_of::<Dsp1760>());
    hprintln!("sensor/mtdata2_parser bytes={}", size_of::<Mti>());
    hprintln!("sensor/icm42688_packet_parser bytes={}", size_of::<Packet>());
}

/// Measures the second of two frames through a parser.
fn stream<P: ByteSource>(meter: &mut Meter, name: &str, part: &mut P, frames: [&[u8]; 2]) {
    let [first, second] = frames;
    let mut samples = 0;
    let mut feed = |bytes: &[u8]| {
        for byte in bytes {
            part.receive(*byte);
            while let Some(sample) = part.next_sample() {
                samples += u32::from(black_box(sample).is_ok());
            }
        }
    };
    feed(first);
    meter.run(name, || feed(black_box(second)));
    hprintln!("{} bytes={}", name, second.len());
    if samples != 2 {
        hprintln!("FAILED: {} gives {} samples of 2", name, samples);
    }
}

fn dsp1760(meter: &mut Meter) {
    let message = |sequence, extra| Message {
        rotation: [1.25e-5, -3.1e-6, 1.745_329_3e-4],
        acceleration: [0.0; 3],
        extra,
        validity: Validity::GYRO,
        sequence,
    };
    let untimed = [0, 1].map(|n| message(n, Extra::Temperature(25)).emit());
    let timed =
        [0, 1].map(|n| message(n, Extra::Timed { time: 1_000 * u32::from(n) + 7, temperature: 25 }).emit());
    stream(meter, "sensor/dsp1760_frame", &mut Dsp1760::new(), untimed.each_ref().map(|frame| &frame[..]));
    stream(
        meter,
        "sensor/dsp1760_timed_frame",
        &mut Dsp1760::new(),
        timed.each_ref().map(|frame| &frame[..]),
    );
}

fn mtdata2(meter: &mut Meter) {
    let message = |n: u16| MtData2 {
        packet_counter: Some(n),
        sample_time_fine: Some(100 * u32::from(n)),
        acceleration: Some([0.25, -0.5, 9.81]),
        rate_of_turn: Some([0.012, -0.003, 0.174_532_93]),
        temperature: None,
        status: Some(3),
    };
    let frames = [1, 2].map(|n| message(n).emit());
    stream(meter, "sensor/mtdata2_frame", &mut Mti::new(), frames.each_ref().map(|frame| &frame[..]));
}

/// Measures the parser of the bytes of an SPI transfer.
fn packet(meter: &mut Meter) {
    let packet = Packet {
        acceleration: [12, -4, 32_768].map(Some),
        rate: [6, -2, 2_620].map(Some),
        temperature: Some(662),
        time: 1_000,
    };
    let bytes = packet.emit();
    meter.run("sensor/icm42688_packet", || {
        let packet = Packet::parse(black_box(&bytes));
        black_box(packet.ok().and_then(|packet| packet.sample(Micros(1_000))));
    });
    hprintln!("sensor/icm42688_packet bytes={}", bytes.len());
}
