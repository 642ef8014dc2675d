//! `tools/gyronet.dbc` says what the codecs do: parsed by another's parser, decoded bit by bit.

use can_dbc::{AttributeValue, ByteOrder, Dbc, Message, MessageId, NumericValue, Signal, ValueType};
use embedded_can::{Frame, Id};
use gyronet::can::config::{Config, Settings, StatusSettings, YawSettings};
use gyronet::can::diagnosis::DiagnosisIds;
use gyronet::can::encoder::CanEncoder;
use gyronet::can::fd::{FD_ID, LENGTH};
use gyronet::can::load::Periodic;
use gyronet::can::status::{Evidence, Knowledge, STATUS_ID, SlowStatus, StatusEncoder, Verdict};
use gyronet::can::yaw::{AngleMessage, DetailMessage, FOG_IDS, Faults, Quality, RateMessage, Source};
use gyronet::can::{DataFrame, bosch};
use gyronet::estimate::{VehicleSample, YawEstimate};
use gyronet::units::{AngularRate, CentiCelsius, SpecificForce, Yaw};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::wire::{data_frame, id11};
use std::collections::BTreeMap;
use std::sync::LazyLock;

const ALL: Settings = Settings { status: Some(StatusSettings { id: STATUS_ID }), ..Settings::DEFAULT };

static DBC: LazyLock<Dbc> =
    LazyLock::new(|| Dbc::try_from(include_str!("../../../tools/gyronet.dbc")).expect("a DBC file"));

fn message_id(id: Id) -> MessageId {
    match id {
        Id::Standard(id) => MessageId::Standard(id.as_raw()),
        Id::Extended(id) => MessageId::Extended(id.as_raw()),
    }
}

fn message(id: Id) -> &'static Message {
    let id = message_id(id);
    DBC.messages.iter().find(|message| message.id == id).expect("a message of the file")
}

fn number(value: NumericValue) -> f64 {
    match value {
        NumericValue::Uint(value) => value as f64,
        NumericValue::Int(value) => value as f64,
        NumericValue::Double(value) => value,
    }
}

fn raw(signal: &Signal, data: &[u8]) -> i64 {
    assert_eq!(signal.byte_order, ByteOrder::LittleEndian, "{}", signal.name);
    let bit = |k: u64| i64::from(data[(k / 8) as usize] >> (k % 8) & 1);
    let value = (0..signal.size).map(|k| bit(signal.start_bit + k) << k).sum::<i64>();
    let sign = 1 << (signal.size - 1);
    if signal.value_type == ValueType::Signed && value & sign != 0 { value - 2 * sign } else { value }
}

fn decode(frame: &DataFrame) -> BTreeMap<String, (i64, f64)> {
    let signals = &message(frame.id()).signals;
    let decoded = signals.iter().map(|signal| {
        let raw = raw(signal, frame.data());
        (signal.name.clone(), (raw, raw as f64 * signal.factor + signal.offset))
    });
    decoded.collect()
}

fn encoder() -> CanEncoder {
    CanEncoder::new(Config::new(ALL).expect("checked"))
}

#[test]
fn the_file_has_every_message_with_its_cycle_time() {
    let config = Config::new(ALL).expect("checked");
    let fog = FOG_IDS.map(|id| Periodic { id: id11(id), period_ms: 10, is_fd: false });
    let yaw = ALL.yaw.map(|yaw| YawSettings { fd: Some(FD_ID), ..yaw });
    let fd = Config::new(Settings { bosch: None, yaw, ..Settings::DEFAULT }).expect("checked").messages();
    assert_eq!(fd.len(), 1);
    let sent: Vec<Periodic> = config.messages().iter().chain(&fd).copied().chain(fog).collect();
    assert_eq!(DBC.messages.len(), sent.len() + DIAGNOSIS.len());
    for sent in sent {
        let message = message(sent.id);
        assert_eq!(message.size, if sent.is_fd { LENGTH as u64 } else { 8 });
        // Of the list of Vector's tools: StandardCAN_FD, with the higher bit rate.
        let format = sent.is_fd.then_some(&AttributeValue::Uint(14));
        assert_eq!(DBC.message_attribute(message.id, "VFrameFormat"), format);
        let switches = sent.is_fd.then_some(&AttributeValue::Uint(1));
        assert_eq!(DBC.message_attribute(message.id, "CANFD_BRS"), switches);
        let cycle = DBC.message_attribute(message.id, "GenMsgCycleTime");
        assert_eq!(cycle, Some(&AttributeValue::Uint(sent.period_ms.into())), "{}", message.name);
        assert!(DBC.message_comment(message.id).is_some(), "{}", message.name);
    }
}

/// The attributes by which Vector's tools know a diagnostic message.
const DIAGNOSIS: [&str; 3] = ["DiagRequest", "DiagState", "DiagResponse"];

#[test]
fn the_file_has_the_frames_of_diagnosis() {
    let ids = DiagnosisIds::DEFAULT.ids().expect("they differ");
    for (id, attribute) in ids.into_iter().zip(DIAGNOSIS) {
        let message = message(id);
        assert!(message.size == 8 && message.signals.is_empty(), "{}", message.name);
        assert_eq!(DBC.message_attribute(message.id, attribute), Some(&AttributeValue::Uint(1)));
        assert!(DBC.message_comment(message.id).is_some(), "{}", message.name);
    }
}

#[test]
fn signals_lie_apart_and_their_ranges_are_what_their_bits_hold() {
    for message in &DBC.messages {
        let mut taken = [false; 8 * LENGTH];
        for signal in &message.signals {
            let end = signal.start_bit + signal.size;
            assert!(end <= 8 * message.size, "{}", signal.name);
            for bit in &mut taken[signal.start_bit as usize..end as usize] {
                assert!(!core::mem::replace(bit, true), "{}", signal.name);
            }
            let span = 1i64 << signal.size;
            let (low, high) = match signal.value_type {
                ValueType::Signed => (-span / 2, span / 2 - 1),
                ValueType::Unsigned => (0, span - 1),
            };
            let physical = |raw: i64| raw as f64 * signal.factor + signal.offset;
            let (min, max) = (number(signal.min), number(signal.max));
            // Value tables keep some codes; a range never promises more than there is.
            let slack = signal.factor * 1e-6;
            assert!(min >= physical(low) - slack && max <= physical(high) + slack, "{}", signal.name);
            assert!(min < max, "{}", signal.name);
        }
    }
}

#[test]
fn other_messages_have_the_layout_of_the_inertial_sensors() {
    let layout = |id: u16, start: u64| {
        let message = message(id11(id));
        let of = |signal: &Signal| {
            let values = DBC.value_descriptions_for_signal(message.id, &signal.name);
            let signal = Signal { start_bit: start + signal.start_bit, ..signal.clone() };
            format!("{signal:?} {values:?}")
        };
        message.signals.iter().map(of).collect::<Vec<_>>()
    };
    let own = ALL.yaw.expect("sent by default").ids;
    assert_eq!(FOG_IDS.map(|id| layout(id, 0)), own.map(|id| layout(id, 0)));
    let parts: Vec<_> = own.into_iter().zip([0, 64, 128]).flat_map(|(id, start)| layout(id, start)).collect();
    assert_eq!(layout(FD_ID, 0), parts, "one after the other");
}

fn table(id: u16, name: &str) -> Vec<(i64, String)> {
    let table = DBC.value_descriptions_for_signal(MessageId::Standard(id), name).expect("a table");
    table.iter().map(|value| (value.id, value.description.to_lowercase())).collect()
}

#[test]
fn value_tables_are_our_enumerations() {
    let named = |code: u8, name: &str| (i64::from(code), name.to_owned());
    let sources = [Source::Raw, Source::Static, Source::Model, Source::EarthRate]
        .map(|source| named(source as u8, &format!("{source:?}").to_lowercase()));
    assert_eq!(table(0x1A0, "Source"), sources);
    let qualities = [Quality::Good, Quality::Degraded, Quality::Initialising, Quality::Unusable]
        .map(|quality| named(quality as u8, &format!("{quality:?}").to_lowercase()));
    assert_eq!(table(0x1A0, "Quality"), qualities);
    use bosch::SignalStatus;
    let statuses = [
        named(SignalStatus::OK.0, "ok"),
        named(SignalStatus::NOT_AVAILABLE.0, "not available"),
        named(SignalStatus::FAILURE.0, "failure"),
        named(SignalStatus::INITIALISING.0, "initialising"),
    ];
    for (id, names) in [
        (0x174, ["YawRate_STAT", "AY_STAT"]),
        (0x178, ["RollRate_STAT", "AX_STAT"]),
        (0x17C, ["PitchRate_STAT", "AZ_STAT"]),
    ] {
        for name in names {
            assert_eq!(table(id, name), statuses);
        }
    }
    assert_eq!(table(0x174, "TEMP")[1].0, i64::from(bosch::encode_temperature(None)));
}

#[test]
fn each_fault_has_its_bit() {
    for (name, fault) in [
        ("Fault_Gap", Faults::GAP),
        ("Fault_Clipped", Faults::CLIPPED),
        ("Fault_Stuck", Faults::STUCK),
        ("Fault_Implausible", Faults::IMPLAUSIBLE),
        ("Fault_Late", Faults::LATE),
        ("Fault_Stored", Faults::STORED),
        ("Fault_Wheels", Faults::WHEELS),
        ("Fault_Bus", Faults::BUS),
    ] {
        let data = AngleMessage { yaw: 0, faults: fault }.emit();
        let decoded = decode(&data_frame(id11(0x1A1), &data));
        let set: Vec<_> =
            decoded.iter().filter(|(name, (raw, _))| name.starts_with("Fault_") && *raw == 1).collect();
        assert_eq!(set.len(), 1);
        assert_eq!(set[0].0, name);
    }
}

/// The file decodes each value of the slow status message, which the codes and its value tables name.
#[test]
fn the_slow_status_means_what_the_file_says() {
    let knowledge = [Knowledge::Unknown, Knowledge::Coarse, Knowledge::Fine, Knowledge::Refused];
    let verdicts = [Verdict::Unknown, Verdict::Standing, Verdict::Moving];
    let evidence = [Evidence::None, Evidence::Wheels, Evidence::Inertial];
    let mut encoder = StatusEncoder::new(STATUS_ID).expect("11 bits");
    let mut check = |status: SlowStatus, gaps: i64| {
        let frame = (0..100).find_map(|_| encoder.frame(|| status)).expect("one in a hundred");
        let decoded = decode(&frame);
        let named = |name: &str, value: &dyn std::fmt::Debug| {
            let code = decoded[name].0;
            assert!(
                table(STATUS_ID, name).contains(&(code, format!("{value:?}").to_lowercase())),
                "{name} {code}"
            );
        };
        named("Standstill", &status.verdict);
        named("StandstillEvidence", &status.evidence);
        named("BiasKnowledge", &status.bias);
        named("GainKnowledge", &status.gain);
        named("MountingKnowledge", &status.mounting);
        assert_eq!(decoded["YawGaps"].0, gaps);
        let doubt = status.doubt.map_or(0xFFFF, |doubt| i64::from(doubt.min(0xFFFE)));
        assert_eq!(decoded["YawDoubt"].0, doubt);
        close(decoded["YawDoubt"].1, doubt as f64 * 0.01, 1e-9);
        assert_eq!(decoded["SecondSourceDoubt"].0, status.doubts.map_or(7, i64::from));
    };
    for (gaps, code) in [(None, 255), (Some(0), 0), (Some(253), 253), (Some(254), 254), (Some(255), 0)] {
        let doubt = gaps.map(|gaps: u32| gaps.saturating_mul(257));
        check(SlowStatus { gaps, doubt, ..SlowStatus::default() }, code);
    }
    for k in 0..12 {
        let [bias, gain, mounting] = [k, k / 2, k / 3].map(|k| knowledge[k % 4]);
        let (verdict, evidence) = (verdicts[k % 3], evidence[k / 4]);
        check(
            SlowStatus {
                verdict,
                evidence,
                bias,
                gain,
                mounting,
                doubts: Some(k as u8 % 7),
                gaps: Some(k as u32),
                doubt: Some(1),
            },
            k as i64,
        );
    }
}

/// A sample of anything, a little beyond what the coarse signals hold.
fn any_sample(noise: &mut Noise) -> VehicleSample {
    let mut up_to = |size: i64| noise.int(-size, size) as i32;
    let [rate, live, roll, pitch] = [(); 4].map(|()| AngularRate(up_to(500_000_000)));
    let [correction, sigma] = [17_000_000, 1_600_000].map(|size| AngularRate(up_to(size)));
    let specific_force = [(); 3].map(|()| SpecificForce(up_to(50_000_000)));
    let temperature = CentiCelsius(5_000 + up_to(11_000) as i16);
    let latency = up_to(150_000) as u32;
    let bits = noise.bits();
    let one_of_four = |at: u64| (bits >> at & 3) as usize;
    let qualities = [Quality::Good, Quality::Degraded, Quality::Initialising, Quality::Unusable];
    let delayed = YawEstimate {
        rate,
        correction,
        yaw: Yaw(noise.bits() as i64),
        sigma: Some(sigma).filter(|_| one_of_four(0) > 0),
        source: [Source::Raw, Source::Static, Source::Model, Source::EarthRate][one_of_four(2)],
        quality: qualities[one_of_four(4)],
        faults: Faults(noise.byte()),
        latency_us: Some(latency % 300_000).filter(|_| one_of_four(6) > 0),
        ..YawEstimate::default()
    };
    VehicleSample {
        live: YawEstimate { rate: live, quality: qualities[one_of_four(8)], ..YawEstimate::default() },
        delayed,
        roll_rate: roll,
        pitch_rate: pitch,
        specific_force,
        temperature: Some(temperature).filter(|_| one_of_four(10) > 0),
        tick: noise.bits() as u32,
    }
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

fn compare_bosch(frame: &DataFrame, names: [&str; 6], due: (AngularRate, SpecificForce), tick: u32) {
    let decoded = decode(frame);
    let message = bosch::Message::parse(frame.data()).expect("checksum");
    let [rate, rate_status, force, force_status, counter, crc] = names.map(|name| decoded[name]);
    assert_eq!(rate.0, i64::from(message.rate));
    assert_eq!(rate_status.0, i64::from(message.rate_status.0));
    assert_eq!(force.0, i64::from(message.acceleration));
    assert_eq!(force_status.0, i64::from(message.acceleration_status.0));
    assert_eq!(counter.0, i64::from(tick & 0xF));
    assert_eq!(crc.0, i64::from(frame.data()[7]));
    // The nearest code, one LSB more for the residual of the rate.
    if message.rate_status.0 & bosch::SignalStatus::FAILURE.0 == 0 {
        close(rate.1, due.0.rad_per_sec().to_degrees(), 0.0051);
    }
    if message.acceleration_status.0 == 0 {
        close(force.1, due.1.metre_per_sec2() / 9.806_65, 0.000_127_465 * 0.51);
    }
}

/// The file decodes every frame to what the codecs decode, and to what was put in.
#[test]
fn frames_mean_what_the_file_says() {
    let (mut encoder, mut noise) = (encoder(), Noise::new(1));
    for _ in 0..5_000 {
        let sample = &any_sample(&mut noise);
        let frames = encoder.encode(sample);
        let [tx1, tx2, tx3, rate, angle, detail] = frames.as_slice() else { panic!("six frames") };
        let [forward, left, up] = sample.specific_force;
        let negated = AngularRate(-sample.roll_rate.0);
        let names = ["YawRate", "YawRate_STAT", "AY", "AY_STAT", "MSG_CNT_TX1", "CRC_TX1"];
        compare_bosch(tx1, names, (sample.live.rate, left), sample.tick);
        let names = ["RollRate", "RollRate_STAT", "AX", "AX_STAT", "MSG_CNT_TX2", "CRC_TX2"];
        compare_bosch(tx2, names, (negated, forward), sample.tick);
        let names = ["PitchRate", "PitchRate_STAT", "AZ", "AZ_STAT", "MSG_CNT_TX3", "CRC_TX3"];
        compare_bosch(tx3, names, (sample.pitch_rate, up), sample.tick);
        if let Some(CentiCelsius(centi)) = sample.temperature
            && (-5000..=15_000).contains(&centi)
        {
            close(decode(tx1)["TEMP"].1, f64::from(centi) / 100.0, 0.51);
        }

        for (frame, name) in [(rate, "Rate"), (angle, "Angle"), (detail, "Detail")] {
            let decoded = decode(frame);
            let [crc, counter, samples, ..] = frame.data() else { continue };
            assert_eq!(decoded[&format!("{name}_CRC")].0, i64::from(*crc));
            assert_eq!(decoded[&format!("{name}_Counter")].0, i64::from(*counter));
            assert_eq!(decoded[&format!("{name}_SampleCounter")].0, i64::from(*samples));
        }

        let decoded = decode(rate);
        let message = RateMessage::parse(rate.data()).expect("a rate message");
        assert_eq!(decoded["Rate"].0, i64::from(message.rate));
        assert_eq!(decoded["Source"].0, sample.delayed.source as i64);
        assert_eq!(decoded["Quality"].0, sample.delayed.quality as i64);
        if let Some(sent) = message.deg_per_sec() {
            close(decoded["Rate"].1, sent, 1e-9);
            close(sent, sample.delayed.rate.rad_per_sec().to_degrees(), 1.1e-6);
        }

        let decoded = decode(angle);
        let message = AngleMessage::parse(angle.data()).expect("an angle message");
        assert_eq!(decoded["Yaw"].0, i64::from(message.yaw));
        close(decoded["Yaw"].1, message.deg(), 1e-12);

        let decoded = decode(detail);
        let message = DetailMessage::parse(detail.data()).expect("a detail message");
        assert_eq!(decoded["Correction"].0, i64::from(message.correction));
        assert_eq!(decoded["ExpectedError"].0, i64::from(message.sigma));
        assert_eq!(decoded["Latency"].0, i64::from(message.latency));
        if let Some(sigma) = sample.delayed.sigma
            && message.sigma < u16::MAX - 1
        {
            // Rounded up to the next step of 1e-5 deg/s.
            let beyond = decoded["ExpectedError"].1 - sigma.rad_per_sec().abs().to_degrees();
            assert!((-1e-9..1.001e-5).contains(&beyond), "{beyond}");
        }
        if message.correction.abs() < i16::MAX {
            close(decoded["Correction"].1, sample.delayed.correction.rad_per_sec().to_degrees(), 2.1e-4);
        }
        if let Some(us) = sample.delayed.latency_us
            && us <= 127_000
        {
            close(decoded["Latency"].1, f64::from(us) / 1000.0, 0.5);
        }
    }
}
