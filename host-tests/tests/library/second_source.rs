//! Sources of the yaw rate that contradict each other: the one that is alone is doubted, and no other.

use embedded_can::Frame;
use gyronet::bias::Latitude;
use gyronet::can::config::{self, Settings, StatusSettings};
use gyronet::can::status::STATUS_ID;
use gyronet::coprocessor::Contradiction;
use gyronet::estimate::YawEstimate;
use gyronet::fog::FogConfig;
use gyronet::health::{Faults, Quality};
use gyronet::sample::{FogSample, PERIOD_US};
use gyronet::units::{Angle, Micros};
use gyronet::{Config, Coprocessor};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::synthetic::{force, noisy, rate, turning};
use gyronet_host_tests::wire::id11;
use gyronet_tools::drive::wheel_frames::{frame, receiver};

/// The Earth's rate at 48 deg north, rad/s.
const EARTH: f64 = 5.419e-5;

/// What the sources show: yaw rates of the inertial and the fibre-optic gyro, rad/s, lateral force, m/s^2, the speed and how
/// much faster the right wheels are, m/s.
type Shown = ([Option<f64>; 2], f64, [f64; 2]);

/// A turn of 0.2 rad/s at 10 m/s.
const TURN: Shown = ([Some(0.2), Some(0.2)], 2.0, [10.0, 0.3]);
const STRAIGHT: Shown = ([Some(0.0), Some(0.0)], 0.0, [10.0, 0.0]);
const SLOW: Shown = ([Some(0.1), Some(0.1)], 0.2, [2.0, 0.1]);

struct Board {
    coprocessor: Coprocessor,
    noise: Noise,
    tick: u64,
    sent: Sent,
}

impl Board {
    /// Stands for 6 s, by the fibre-optic gyro, too, if `is_confirmed`.
    fn stands(is_confirmed: bool) -> Self {
        let status = Some(StatusSettings { id: STATUS_ID });
        let can = config::Config::new(Settings { status, ..Settings::DEFAULT }).expect("checked");
        let fog = FogConfig { latitude: Latitude::from_degrees(48.0), ..FogConfig::DEFAULT };
        let coprocessor = Coprocessor::new(Config { wheels: Some(receiver()), can, fog, ..Config::DEFAULT });
        let mut board = Self { coprocessor, noise: Noise::new(3), tick: 0, sent: Sent::default() };
        board.show(6, ([Some(0.0), is_confirmed.then_some(0.0)], 0.0, [0.0; 2]));
        board
    }

    fn show(&mut self, seconds: u64, shown: Shown) -> YawEstimate {
        (0..100 * seconds).for_each(|_| self.step(shown));
        self.sent.fog.last().copied().unwrap_or_default()
    }

    fn step(&mut self, ([inertial, fog], lateral, [speed, difference]): Shown) {
        self.tick += 1;
        let now = Micros(self.tick * PERIOD_US);
        let [left, right] = [-0.5, 0.5].map(|side| Some(3.6 * (speed + side * difference)));
        let wheels = frame([left, right, left, right]).expect("all are known");
        self.coprocessor.can(&wheels, now).expect("a good frame");
        if let Some(fog) = fog {
            let turn = 0.01 * (fog + EARTH) + 1e-7 * self.noise.normal();
            let increment = [None, None, Some(Angle::from_rad(turn as f32).expect("in range"))];
            let sample = FogSample { time: now, span: 10_000, lost: 0, increment, temperature: None };
            self.coprocessor.fog(sample, now, &mut self.sent).expect("in order");
        }
        if let Some(inertial) = inertial {
            let mut sample = turning(self.tick, rate(0.001 + inertial));
            sample.specific_force[1] = force(lateral);
            let sample = noisy(sample, [2e-4, 2e-3], &mut self.noise);
            self.coprocessor.imu(sample, now, &mut self.sent).expect("in time");
        }
    }

    /// The doubts that the next status message says: inertial gyro 1, fibre-optic gyro 2, wheels 4. The rates say the same.
    fn doubts(&self) -> u8 {
        self.status()[4] >> 5
    }

    fn status(&self) -> [u8; 8] {
        let Self { coprocessor, noise, tick, .. } = self;
        let (coprocessor, noise) = (coprocessor.clone(), noise.clone());
        let mut next = Self { coprocessor, noise, tick: *tick, sent: Sent::default() };
        next.step(STRAIGHT);
        let mut frames = next.sent.frames.iter().map(|sent| sent.frame);
        let status = frames.find(|frame| frame.id() == id11(STATUS_ID)).expect("one a second");
        let status: [u8; 8] = status.data().try_into().expect("eight bytes");
        let doubts = status[4] >> 5;
        let faults = next.sent.seen.last().expect("a step").vehicle.live.faults;
        assert_eq!(faults.contains(Faults::IMPLAUSIBLE), doubts & 1 > 0, "{faults:?}");
        assert_eq!(faults.contains(Faults::WHEELS), doubts & 4 > 0, "{faults:?}");
        let fog = next.sent.fog.last().filter(|_| doubts & 2 > 0);
        assert!(
            fog.is_none_or(|fog| fog.faults.contains(Faults::IMPLAUSIBLE) && fog.quality != Quality::Good)
        );
        status
    }
}

#[test]
fn a_doubt_begins_with_the_second_second_and_ends_where_its_source_agrees() {
    let alone = |(gyros, lateral, wheels): Shown| ([gyros[0], None], lateral, wheels);
    let gyros = |inertial, fog, (_, lateral, wheels): Shown| ([Some(inertial), Some(fog)], lateral, wheels);
    let [turn, straight] = [TURN, STRAIGHT].map(alone);
    type Rows<'a> = &'a [(u64, Shown, u8)];
    let scenes: &[(&str, bool, Rows<'_>)] = &[
        (
            "all agree, within their errors",
            true,
            &[(8, TURN, 0), (3, (TURN.0, 2.0, [10.0, 0.2]), 0), (3, (STRAIGHT.0, 0.0, [20.0, 0.35]), 0)],
        ),
        (
            "wheels and accelerometer against the inertial gyro, and what ends it",
            false,
            &[
                (1, ([Some(-0.2), None], 2.0, [10.0, 0.5]), 0),
                (1, ([Some(-0.2), None], 2.0, [10.0, 0.5]), 1),
                (3, straight, 1),
                (3, ([Some(0.2), None], -2.0, [10.0, 0.3]), 1),
                (1, turn, 1),
                (1, straight, 1),
                (1, turn, 0),
            ],
        ),
        (
            "the wheels alone, on a bank",
            false,
            &[(2, ([Some(0.2), None], 4.5, [10.0, -0.5]), 4), (3, straight, 4), (2, turn, 0)],
        ),
        ("a wheel that stands, against both gyros", true, &[(2, (TURN.0, 2.0, [5.0, -10.0]), 4)]),
        ("a wheel that slips, against both gyros", true, &[(2, (TURN.0, 2.0, [11.0, 3.0]), 4)]),
        ("wheels and accelerometer against both gyros", true, &[(2, ([Some(-0.2); 2], 2.0, [10.0, 0.5]), 7)]),
        ("the inertial gyro alone", true, &[(2, gyros(-0.2, 0.2, TURN), 1)]),
        (
            "the fibre-optic gyro alone",
            true,
            &[
                (1, gyros(0.2, -0.2, TURN), 0),
                (1, gyros(0.2, -0.2, TURN), 2),
                (2, TURN, 0),
                (2, gyros(0.2, 11.5, TURN), 2),
            ],
        ),
        (
            "both gyros, with no judge: a gain",
            true,
            &[(2, gyros(0.1, 0.2, SLOW), 3), (3, STRAIGHT, 3), (1, TURN, 3), (1, TURN, 0)],
        ),
        ("both gyros, with whom the others agree", true, &[(6, gyros(0.2, 0.1, TURN), 3)]),
        ("both gyros, a bias", true, &[(3, gyros(-0.087, 0.0, STRAIGHT), 3), (2, STRAIGHT, 0)]),
        (
            "a fibre-optic gyro that nothing has confirmed",
            false,
            &[(1, gyros(0.1, 0.2, SLOW), 2), (3, gyros(0.1, 0.2, SLOW), 2)],
        ),
    ];
    for (name, is_confirmed, rows) in scenes {
        let mut board = Board::stands(*is_confirmed);
        for (number, (seconds, shown, doubts)) in rows.iter().enumerate() {
            board.show(*seconds, *shown);
            assert_eq!(board.doubts(), *doubts, "{name}: row {number}");
        }
    }
    let mut board = Board::stands(true);
    board.show(1, gyros(0.0, 7.0, STRAIGHT));
}

#[test]
fn a_contradiction_leaves_its_numbers() {
    let mut board = Board::stands(true);
    board.show(2, TURN);
    assert_eq!(*board.coprocessor.contradiction(), Contradiction::default());
    board.show(3, ([Some(0.2), Some(7.0)], 2.0, [10.0, 0.3]));
    let Contradiction { seconds, gyros, lateral, wheels } = *board.coprocessor.contradiction();
    let [inertial, fog] = gyros;
    // The largest code is that of a silent source.
    assert_eq!((seconds, fog), (3, Some(i16::MAX - 1)));
    let [speed, difference] = wheels.expect("they were asked");
    for (code, shown) in [(inertial, 1_146), (lateral, 200), (Some(speed), 1_000), (Some(difference), 30)] {
        assert!(code.is_some_and(|code| (code - shown).abs() <= 6), "{code:?}, {shown} was shown");
    }
}

#[test]
fn a_gap_in_either_yaw_is_counted() {
    let mut board = Board::stands(true);
    assert_eq!(board.status()[5], 0);
    (0..5).for_each(|_| board.step(([Some(0.0), None], 0.0, [0.0; 2])));
    (0..95).for_each(|_| board.step(([Some(0.0); 2], 0.0, [0.0; 2])));
    assert_eq!(board.status()[5], 1);
}

#[test]
fn a_turn_in_which_both_gyros_agree_confirms_the_fibre_optic_one() {
    let mut board = Board::stands(false);
    for (rate, quality) in [(0.0, Quality::Degraded), (0.09, Quality::Degraded), (0.15, Quality::Good)] {
        let found = board.show(3, ([Some(rate); 2], 10.0 * rate, [10.0, rate]));
        assert_eq!(found.quality, quality, "{rate}: {found:?}");
    }
}

#[test]
fn a_difference_of_the_gyros_is_part_of_sigma() {
    let sigma = |estimate: YawEstimate| estimate.sigma.expect("a rate").rad_per_sec();
    // Straight on, by more than the inertial gyro explains, and by more than sigma can say on the bus.
    for (off, doubted) in [(0.009, false), (0.015, true)] {
        let found = Board::stands(true).show(2, ([Some(0.0), Some(off)], 0.0, [10.0, 0.0]));
        assert!((sigma(found) / off - 1.0).abs() < 0.05, "{off}: {found:?}");
        assert_eq!(found.faults.contains(Faults::IMPLAUSIBLE), doubted, "{off}");
    }
    // In turns as a share of the rate, and for as long as the inertial sensor is silent; slow turns are not compared.
    for (rate, share) in [(0.2, 0.0199), (0.09, 0.0)] {
        let mut board = Board::stands(true);
        board.show(10, ([Some(rate), Some(1.02 * rate)], 10.0 * rate, [10.0, rate]));
        let alone = sigma(board.show(2, ([None, Some(rate)], 0.0, [10.0, rate])));
        assert!((alone / rate - share).abs() < 2.5e-3, "{rate}: {alone}");
    }
}
