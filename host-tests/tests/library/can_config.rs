//! The configuration of the vehicle bus: what is refused, what it costs, what goes out.

use embedded_can::Frame;
use gyronet::can::bus_off::{BusOff, LAST_US};
use gyronet::can::config::{BoschSettings, Config, ConfigError, E2e, Settings, StatusSettings, YawSettings};
use gyronet::can::e2e::DataIdMode;
use gyronet::can::encoder::CanEncoder;
use gyronet::can::fd::{FD_ID, Joiner};
use gyronet::can::load::{self, bit_time};
use gyronet::can::status::STATUS_ID;
use gyronet::can::yaw::Quality;
use gyronet::estimate::VehicleSample;
use gyronet::units::{AngularRate, Yaw};
use gyronet_host_tests::synthetic;
use gyronet_host_tests::wire::id11;

const YAW: YawSettings = match Settings::DEFAULT.yaw {
    Some(yaw) => yaw,
    None => panic!("the default has our own messages"),
};
const ALL: Settings = Settings { status: Some(StatusSettings { id: STATUS_ID }), ..Settings::DEFAULT };

fn with_yaw(yaw: YawSettings) -> Settings {
    Settings { yaw: Some(yaw), ..Settings::DEFAULT }
}

fn with_e2e(e2e: E2e) -> Settings {
    with_yaw(YawSettings { e2e, ..YAW })
}

#[test]
fn bus_loads_equal_those_by_hand() {
    // Six frames of 135 bits a hundred times a second.
    let config = Config::new(Settings::DEFAULT).expect("checked");
    assert_eq!(config, Config::DEFAULT);
    assert_eq!(load::per_mille(&config.messages(), 500_000), 6 * 135 * 100 / 500);
    // 34 bits, and 278 at 2 Mbit/s.
    for (bits_per_second, per_mille) in [(250_000, 28), (500_000, 21), (1_000_000, 18)] {
        let yaw = Some(YawSettings { fd: Some(FD_ID), ..YAW });
        let config = Config::new(Settings { bits_per_second, bosch: None, yaw, ..Settings::DEFAULT });
        assert_eq!(load::per_mille(&config.expect("checked").messages(), bits_per_second), per_mille);
    }
}

#[test]
fn a_bit_is_sampled_at_80_percent() {
    for (bits_per_second, expected) in
        [(125_000, (2, 159, 40)), (250_000, (1, 159, 40)), (500_000, (1, 79, 20)), (2_000_000, (1, 19, 5))]
    {
        assert_eq!(bit_time(50_000_000, bits_per_second, 250), expected);
    }
    assert_eq!(bit_time(0, 0, 0).0, 1);
}

#[test]
fn settings_that_cannot_be_are_refused() {
    let refused = |settings| Config::new(settings).expect_err("refused");
    let nothing = Settings { bosch: None, yaw: None, ..Settings::DEFAULT };
    assert_eq!(refused(nothing), ConfigError::Empty);
    assert_eq!(refused(Settings { bits_per_second: 0, ..ALL }), ConfigError::BitRate(0));
    let ids = |ids| with_yaw(YawSettings { ids, ..YAW });
    assert_eq!(refused(ids([0x1A0, 0x800, 0x1A2])), ConfigError::Identifier(0x800));
    assert_eq!(refused(ids([0x7DF, 0x1A1, 0x1A2])), ConfigError::Identifier(0x7DF));
    assert_eq!(refused(ids([0x1A0, 0x1A1, 0x1A0])), ConfigError::DuplicateIdentifier(0x1A0));
    assert_eq!(refused(ids([0x1A0, 0x178, 0x1A2])), ConfigError::DuplicateIdentifier(0x178));
    let tx1_only = Settings { bosch: Some(BoschSettings { tx1_only: true }), ..ids([0x1A0, 0x178, 0x1A2]) };
    assert!(Config::new(tx1_only).is_ok(), "0x178 is free then");
    let fd = |fd| with_yaw(YawSettings { fd: Some(fd), ..YAW });
    assert_eq!(refused(fd(0x800)), ConfigError::Identifier(0x800));
    for id in [0x1A1, 0x178] {
        assert_eq!(refused(fd(id)), ConfigError::DuplicateIdentifier(id));
    }
    for period_ms in [0, 5, 15, 1010] {
        let settings = with_yaw(YawSettings { period_ms, ..YAW });
        assert_eq!(refused(settings), ConfigError::Period(period_ms));
    }
    let status = |id| Settings { status: Some(StatusSettings { id }), ..Settings::DEFAULT };
    assert_eq!(refused(status(0x1A2)), ConfigError::DuplicateIdentifier(0x1A2));
    assert_eq!(refused(status(0x7E0)), ConfigError::Identifier(0x7E0));
    assert!(Config::new(status(STATUS_ID)).is_ok());
    for bits_per_second in [100_000, 800_000] {
        let refusal = ConfigError::BitRate(bits_per_second);
        assert_eq!(refused(Settings { bits_per_second, ..ALL }), refusal);
    }
}

#[test]
fn e2e_identifiers_tell_the_messages_apart() {
    let refused = |e2e| Config::new(with_e2e(e2e)).expect_err("refused");
    let duplicate = ConfigError::DuplicateDataId;
    use DataIdMode::{Alternating, Both, Low, Nibble};
    assert_eq!(refused(E2e::P01 { mode: Both, data_ids: [1, 2, 1] }), duplicate);
    assert_eq!(refused(E2e::P01 { mode: Low, data_ids: [0x101, 0x201, 2] }), duplicate);
    assert_eq!(refused(E2e::P01 { mode: Alternating, data_ids: [0x101, 0x102, 0x203] }), duplicate);
    assert_eq!(refused(E2e::P01 { mode: Alternating, data_ids: [0x101, 0x201, 0x302] }), duplicate);
    assert_eq!(refused(E2e::P01 { mode: Nibble, data_ids: [1, 2, 0x1000] }), ConfigError::DataId(0x1000));
    assert_eq!(refused(E2e::P01 { mode: Nibble, data_ids: [1, 2, 2] }), duplicate);
    for e2e in [
        E2e::P01 { mode: Low, data_ids: [1, 2, 3] },
        E2e::P01 { mode: Alternating, data_ids: [0x101, 0x202, 0x303] },
        E2e::P01 { mode: Nibble, data_ids: [0x101, 0x102, 0x201] },
    ] {
        assert!(Config::new(with_e2e(e2e)).is_ok(), "{e2e:?}");
    }
}

fn sample(tick: u32) -> VehicleSample {
    synthetic::vehicle(tick, AngularRate(1_000_000), Yaw::default())
}

#[test]
fn one_frame_of_can_fd_carries_a_set_as_it_is() {
    let joined = with_yaw(YawSettings { fd: Some(FD_ID), ..YAW });
    for settings in [Settings::DEFAULT, joined] {
        let mut encoder = CanEncoder::new(Config::new(settings).expect("checked"));
        let mut joiner = Joiner::new(&settings);
        for tick in 0..20 {
            let frames = encoder.encode(&sample(tick));
            let join = |frame| joiner.join(frame).map(|(id, data)| (id, data.to_vec()));
            let sent: Vec<_> = frames.iter().filter_map(join).collect();
            let mut due: Vec<_> = frames.iter().map(|frame| (frame.id(), frame.data().to_vec())).collect();
            if settings == joined {
                let set = due.split_off(due.len() - 3);
                assert_eq!(set.iter().map(|(id, _)| *id).collect::<Vec<_>>(), YAW.ids.map(id11));
                due.push((id11(FD_ID), set.into_iter().flat_map(|(_, data)| data).collect()));
            }
            assert_eq!(sent, due);
        }
    }
    // A set of which a part was lost is not sent with the part before.
    let mut encoder = CanEncoder::new(Config::new(joined).expect("checked"));
    let mut joiner = Joiner::new(&joined);
    for tick in 0..12 {
        let frames = encoder.encode(&sample(tick));
        let set = frames.iter().rev().take(3).rev().enumerate();
        let sent = set
            .filter(|(part, _)| Some(*part as u32) != (tick % 4).checked_sub(1))
            .filter_map(|(_, frame)| joiner.join(frame).map(|(id, _)| id))
            .count();
        assert_eq!(sent, usize::from(tick % 4 == 0), "{tick}");
    }
}

/// The controller goes off the bus at each CAN FD frame, with a short circuit at each frame, or, with a loose connector, some
/// time after each return.
#[test]
fn can_fd_frames_end_where_they_alone_take_the_board_off_the_bus() {
    const FOREVER: u64 = u64::MAX;
    for (takes_fd, short_until, stays) in
        [(false, 0, FOREVER), (true, 0, FOREVER), (true, 20_000, FOREVER), (true, 0, 100)]
    {
        let mut bus = BusOff::new(0);
        let (mut is_off, mut times_off, mut sent_at, mut returned) = (false, 0, 0, 0);
        for now in 0..30_000 {
            let is_short = now < short_until;
            let has_sent = !is_off && !is_short && now % 10 == 0;
            bus.follow(is_off, has_sent, 1_000 * now);
            if bus.is_off() && bus.returns(1_000 * now) {
                (is_off, returned) = (false, now);
            } else if now % 10 == 5 && !is_off {
                let is_sent = bus.takes_fd(1_000 * now);
                is_off = is_short || is_sent && !takes_fd || now - returned >= stays;
                times_off += u32::from(is_off);
                sent_at = if is_sent && !is_off { now } else { sent_at };
            }
        }
        assert_eq!(bus.refuses_fd(), !takes_fd);
        if stays < FOREVER {
            continue;
        }
        assert!(bus.is_off() == is_off && !is_off);
        if takes_fd {
            assert_eq!(sent_at, 29_995);
        } else {
            assert_eq!(times_off, 8);
        }
    }
}

#[test]
fn a_controller_returns_at_growing_intervals_until_it_stays() {
    let (mut bus, mut now) = (BusOff::new(0), 0);
    let waited = [10, 10, 1_270, 1_290, 10, 10, 10, 10, 10, 10, 10, 10].map(|stays| {
        let off_at = now;
        bus.follow(true, false, now);
        while !bus.returns(now) {
            now += 1_000;
            bus.follow(true, false, now);
        }
        let waited = (now - off_at) / 1_000;
        bus.follow(false, true, now);
        assert!(!bus.returns(now + LAST_US), "it is on the bus");
        now += 1_000 * stays;
        bus.follow(false, true, now);
        waited
    });
    assert_eq!(waited, [10, 20, 40, 80, 10, 20, 40, 80, 160, 320, 640, 1_280]);
}

#[test]
fn can_fd_frames_are_blamed_only_where_classic_ones_were_taken() {
    for is_taken in [true, false] {
        let (mut bus, mut now) = (BusOff::new(0), 0);
        for _ in 0..10 {
            bus.follow(true, false, now);
            while !bus.returns(now) {
                now += 1_000;
            }
            bus.follow(false, is_taken, now);
            bus.follow(false, true, now + 700_000);
            now += 800_000;
        }
        bus.follow(true, false, now);
        assert_eq!(bus.refuses_fd(), is_taken);
    }
}

#[test]
fn frames_go_out_as_configured() {
    let slow = Settings::DEFAULT.yaw.map(|yaw| YawSettings { period_ms: 50, ..yaw });
    for settings in [Settings::DEFAULT, Settings { yaw: slow, ..Settings::DEFAULT }] {
        let config = Config::new(settings).expect("checked");
        let mut encoder = CanEncoder::new(config);
        let mut sent = Vec::new();
        for tick in 0..100 {
            sent.extend(encoder.encode(&sample(tick)));
        }
        for message in config.messages() {
            let count = sent.iter().filter(|frame| frame.id() == message.id).count();
            assert_eq!(count, 1000 / usize::from(message.period_ms), "{message:?}");
            assert!(config.sends(message.id));
        }
        assert!(
            sent.iter().all(|frame| config.sends(frame.id()) && !frame.is_extended() && frame.dlc() == 8)
        );
    }
    assert!(!Config::new(ALL).expect("checked").sends(id11(0x123)));
}

#[test]
fn every_message_reports_that_the_rate_is_not_to_be_used() {
    let mut encoder = CanEncoder::new(Config::new(ALL).expect("checked"));
    for (quality, nibble, rate) in [(Quality::Initialising, 4, 426_887), (Quality::Unusable, 2, i32::MIN)] {
        let mut unusable = sample(0);
        unusable.delayed.quality = quality;
        unusable.live.quality = quality;
        let frames = encoder.encode(&unusable);
        assert_eq!(frames[0].data()[2] >> 4, nibble);
        // What the part has not passed on is no acceleration either.
        let force = if quality == Quality::Unusable { 2 } else { 0 };
        assert_eq!(frames[0].data()[6] >> 4, force);
        assert_eq!(frames[3].data()[3..7], i32::to_le_bytes(rate));
    }
}
