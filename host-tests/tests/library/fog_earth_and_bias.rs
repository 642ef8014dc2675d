//! The corrections of a fibre-optic gyro without a network: Earth's rate, bias by standstills, and what its messages say of both.

use embedded_can::Frame;
use gyronet::bias::Latitude;
use gyronet::can::DataFrame;
use gyronet::coprocessor::{Config, Coprocessor, InputError};
use gyronet::estimate::YawEstimate;
use gyronet::fog::{FogConfig, FogErrors, FogPipeline, RestReading};
use gyronet::heading::latitude::CONFIRM;
use gyronet::heading::{HeadingError, HeadingReceiver, HeadingSettings, Received};
use gyronet::health::{Faults, Quality, Source};
use gyronet::sample::{FogSample, PERIOD_US, Standstill, WheelSample};
use gyronet::units::{Angle, Micros, WheelSpeed};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::wire::{data_frame, id29};

const DEG_PER_HOUR: f64 = std::f64::consts::PI / 180.0 / 3600.0;
const EARTH: f64 = 7.292_115e-5;

/// A DSP-1760 that turns with the Earth, has a bias and the noise of its data sheet.
struct Gyro {
    noise: Noise,
    rate: f64,
    step: u64,
    standstill: Standstill,
}

impl Gyro {
    fn new(seed: u64, latitude_deg: f64, bias_deg_per_hour: f64) -> Self {
        let rate = EARTH * latitude_deg.to_radians().sin() + bias_deg_per_hour * DEG_PER_HOUR;
        Self { noise: Noise::new(seed), rate, step: 0, standstill: Standstill::Still }
    }

    fn sample(&mut self) -> FogSample {
        self.step += 1;
        let turn = 0.01 * self.rate + 0.1 * f64::from(FogErrors::DSP1760.angle_walk) * self.noise.normal();
        let increment = [None, None, Some(Angle((turn * f64::from(Angle::PER_RAD)).round() as i64))];
        let time = Micros(self.step * PERIOD_US);
        FogSample { time, span: PERIOD_US as u32, lost: 0, increment, temperature: None }
    }

    fn run(&mut self, fog: &mut FogPipeline, seconds: usize) -> Vec<YawEstimate> {
        let mut sent = Vec::new();
        for _ in 0..100 * seconds {
            let sample = self.sample();
            fog.add(sample.time, sample).expect("in order");
            let speeds = [Some(WheelSpeed(0)); 4];
            let wheels = WheelSample { time: sample.time, speeds, standstill: self.standstill };
            sent.extend(std::iter::from_fn(|| fog.next_step(sample.time, Some(&wheels))));
        }
        sent
    }
}

fn at_latitude(latitude_deg: Option<f32>) -> FogPipeline {
    let config = FogConfig { latitude: latitude_deg.and_then(Latitude::from_degrees), ..FogConfig::DEFAULT };
    FogPipeline::new(config, false)
}

fn mean_deg_per_hour(sent: &[YawEstimate]) -> f64 {
    sent.iter().map(|yaw| yaw.rate.rad_per_sec()).sum::<f64>() / sent.len() as f64 / DEG_PER_HOUR
}

/// Ten minutes at rest, then ten minutes straight on: the gyro's own walk leaves 0.03 deg/h of each.
#[test]
fn ten_straight_minutes_anywhere_on_earth() {
    for (seed, (latitude, bias)) in
        [(0.0f32, 0.4), (60.0, -0.5), (-34.0, 0.25), (36.37, 0.0), (90.0, 0.1)].into_iter().enumerate()
    {
        let mut gyro = Gyro::new(seed as u64 + 1, latitude.into(), bias);
        let mut fog = at_latitude(Some(latitude));
        gyro.run(&mut fog, 600);
        gyro.standstill = Standstill::Moving;
        let sent = gyro.run(&mut fog, 600);
        let error = mean_deg_per_hour(&sent);
        println!("{latitude} deg: {error:.3} deg/h");
        assert!(error.abs() < 0.1, "{latitude}: {error}");
        assert!(sent.iter().all(|yaw| (yaw.source, yaw.quality) == (Source::EarthRate, Quality::Good)));
        // The shaking of a moving car, and little more.
        let sigma = sent[0].sigma.expect("expected error").rad_per_sec() / DEG_PER_HOUR;
        assert!((31.7..32.7).contains(&sigma), "{sigma}");
        assert_eq!((fog.counters.no_latitude, fog.counters.contradicted), (0, 0));
        assert!(fog.counters.zero_rate_updates > 590);
    }
}

#[test]
fn without_a_latitude_the_rate_is_degraded() {
    let mut gyro = Gyro::new(9, -34.0, 0.0);
    gyro.standstill = Standstill::Moving;
    let mut fog = at_latitude(None);
    let sent = gyro.run(&mut fog, 10);
    assert!(sent.iter().all(|yaw| (yaw.source, yaw.quality) == (Source::Raw, Quality::Degraded)));
    // Any latitude may be the right one: 8.7 deg/h beside the shaking of 32.2.
    let sigma = sent[0].sigma.expect("expected error").rad_per_sec() / DEG_PER_HOUR;
    assert!((32.8..33.8).contains(&sigma), "{sigma}");
    gyro.standstill = Standstill::Still;
    gyro.run(&mut fog, 300);
    gyro.standstill = Standstill::Moving;
    let sent = gyro.run(&mut fog, 300);
    assert!(sent.iter().all(|yaw| (yaw.source, yaw.quality) == (Source::Static, Quality::Degraded)));
    assert!(mean_deg_per_hour(&sent).abs() < 0.2, "{}", mean_deg_per_hour(&sent));
    assert_eq!(fog.counters.no_latitude, 61_000);
}

#[test]
fn a_turn_on_standing_wheels_is_reported_and_not_learnt() {
    let mut gyro = Gyro::new(4, 60.0, 0.0);
    let mut fog = at_latitude(Some(60.0));
    gyro.run(&mut fog, 60);
    gyro.rate += 100.0 * DEG_PER_HOUR;
    let sent = gyro.run(&mut fog, 60);
    let last = sent.last().expect("a step");
    assert_eq!((last.quality, last.faults), (Quality::Degraded, Faults::WHEELS));
    assert!(fog.counters.contradicted > 55);
    assert!((mean_deg_per_hour(&sent) - 100.0).abs() < 1.0, "{}", mean_deg_per_hour(&sent));
}

/// The reading at rest of a part whose bias may be large, alone.
struct Rest {
    reading: RestReading,
    gyro: Gyro,
}

impl Rest {
    const ERRORS: FogErrors = FogErrors { bias: 1e-2, bias_walk: 1e-6, ..FogErrors::DSP1760 };

    fn new(earth: Option<f32>, rate: f64) -> Self {
        let reading = RestReading::new(Self::ERRORS, earth);
        Self { reading, gyro: Gyro { rate, ..Gyro::new(9, 0.0, 0.0) } }
    }

    /// Steps of the gyro, whose noise is so many times the part's, with a rate by the seconds since the first one.
    fn go(&mut self, steps: u32, unit: f64, rate: impl Fn(f64) -> f64) {
        let usual = self.gyro.rate;
        for step in 0..steps {
            self.gyro.rate = (usual + rate(0.01 * f64::from(step))) / unit;
            let [.., turn] = self.gyro.sample().increment;
            let turn = turn.map(|Angle(code)| Angle((code as f64 * unit) as i64));
            self.reading.observe(turn, self.gyro.standstill);
        }
        self.gyro.rate = usual;
    }

    fn sigma(&self) -> f64 {
        self.reading.sigma(0.0, 0.0).into()
    }
}

/// By the Earth's rate after one mean, or by the noise, in units of the part's, after 20.
#[test]
fn a_reading_shows_unit_and_sign() {
    let earth = 5.4e-5;
    let cases = [
        (Some(earth), 1.0, 1.0, 3..60, true),
        (Some(earth), -1.0, 1.0, 3..4, false),
        (None, 1.0, 1.0, 3..22, false),
        (None, 1.0, 1.0, 22..60, true),
        (None, 0.0, 8.0, 22..60, true),
        (None, 0.0, 57.3, 3..60, false),
        (Some(0.0), 0.0, 57.3, 3..60, false),
    ];
    for (known, share, unit, seconds, shows) in cases {
        let mut rest = Rest::new(known, share * f64::from(earth));
        for second in 1..seconds.end {
            rest.go(100, unit, |_| 0.0);
            let is_due = seconds.contains(&second);
            assert!(!is_due || rest.reading.shows_unit() == shows, "{known:?}, {share}, {unit}: {second} s");
        }
    }
    // A deck that turns to and fro is no noise.
    let mut rest = Rest::new(None, 0.0);
    rest.go(1_000, 1.0, |_| 0.0);
    rest.go(3_000, 1.0, |second| if second % 2.0 < 1.0 { 1e-3 } else { -1e-3 });
    assert!(rest.reading.shows_unit());
}

#[test]
fn the_expected_error_at_rest_is_the_parts_until_it_turns_or_drives() {
    let (mut rest, part) = (Rest::new(None, 5e-3), f64::from(Rest::ERRORS.angle_walk));
    rest.go(1_000, 1.0, |_| 0.0);
    for step in 0..5_000 {
        rest.go(1, 1.0, |_| 0.0);
        assert!((part..1.3 * part).contains(&rest.sigma()), "{step}: {}", rest.sigma() / part);
    }
    for (rate, shake, due) in [(0.5, 0.0, 1e-4), (0.0, 2e-4, 2e-4), (0.5, 2e-4, 2.236e-4)] {
        let found = rest.reading.sigma(rate, shake);
        assert!((found / due - 1.0).abs() < 0.01, "{rate}, {shake}: {found}");
    }
    // At first less what an engine may turn it to and fro; then the angle of a second and a quarter.
    for (steps, share) in [(10, 0.215), (30, 0.7), (210, 1.25)] {
        rest.go(steps, 1.0, |_| 0.01);
        assert!((rest.sigma() / (0.01 * share) - 1.0).abs() < 0.03, "{steps}: {}", rest.sigma());
    }
    assert!(rest.reading.is_contradicted());
    rest.gyro.standstill = Standstill::Moving;
    rest.go(1, 1.0, |_| 0.0);
    assert!(!rest.reading.is_contradicted());
    // A bias walks while it drives.
    let mut rest = Rest::new(None, 5e-3);
    rest.go(6_000, 1.0, |_| 0.0);
    rest.gyro.standstill = Standstill::Moving;
    rest.go(100_000, 1.0, |_| 0.0);
    assert!((rest.sigma() / 3.2e-5 - 1.0).abs() < 0.05, "{}", rest.sigma());
}

/// An engine turns it to and fro by 2e-4 rad.
#[test]
fn the_first_reading_is_free_of_vibration() {
    let mut rest = Rest::new(None, 5e-3);
    rest.go(300, 1.0, |second| 0.02 * (std::f64::consts::TAU * 13.7 * second).sin());
    let found = rest.reading.reading();
    assert!((found - 5e-3).abs() < 3e-5, "{found}");
}

/// Reads J1939's position, with a latitude that is known before.
fn known(latitude: Option<f32>) -> HeadingReceiver {
    HeadingReceiver::new(HeadingSettings { j1939: true, ..HeadingSettings::NONE }, latitude)
}

/// J1939's vehicle position: 1e-7 deg from -210.
fn position(degrees: f64) -> DataFrame {
    let raw = ((degrees + 210.0) * 1e7).round() as u32;
    data_frame(id29(0x18FE_F31C), &[raw.to_le_bytes(), [0; 4]].concat())
}

#[test]
fn a_latitude_over_can_is_used_when_it_is_confirmed() {
    let mut receiver = known(None);
    let mut now = 0;
    let mut take = |receiver: &mut HeadingReceiver, degrees: f64| {
        now += 100_000;
        let received = receiver.decode(&position(degrees), Micros(now)).expect("its frame");
        received.and_then(|received| received.latitude).transpose()
    };
    // Frames that do not agree never confirm each other.
    for k in 0..4 * CONFIRM {
        assert_eq!(take(&mut receiver, if k % 2 == 0 { 48.1 } else { 47.9 }), None);
    }
    for _ in 1..CONFIRM {
        assert_eq!(take(&mut receiver, 48.1), None);
    }
    let first = take(&mut receiver, 48.1).expect("confirmed").expect("good");
    assert!((first.degrees - 48.1).abs() < 1e-4 && !first.moved);
    let next = take(&mut receiver, 48.101).expect("known").expect("good");
    assert!(next.moved && !receiver.is_contested());
    // A jump is refused, and the one in use is contested until a frame agrees with it.
    let jump = take(&mut receiver, -48.1);
    assert!(matches!(jump, Some(Err(HeadingError::Jump { .. }))) && receiver.is_contested(), "{jump:?}");
    assert!(take(&mut receiver, 48.1).expect("known").is_ok() && !receiver.is_contested());
    // One that stays has to be believed.
    let jumps: Vec<_> = (0..CONFIRM).map(|_| take(&mut receiver, 52.0).expect("judged")).collect();
    let (last, refused) = jumps.split_last().expect("some");
    assert!(refused.iter().all(Result::is_err) && last.is_ok_and(|last| !last.moved));
    // What no latitude can be.
    assert!(matches!(take(&mut receiver, 95.0), Some(Err(HeadingError::Range { what: "latitude", .. }))));
    let marked = data_frame(position(0.0).id(), &[0xFF; 8]);
    assert_eq!(receiver.decode(&marked, Micros(now)), Some(Ok(Received::NONE)));
    let short = data_frame(position(0.0).id(), &[0; 3]);
    assert_eq!(receiver.decode(&short, Micros(now)), Some(Err(HeadingError::Short(3))));
}

/// 0.02 deg, and 400 km/h since the last one, up to a degree.
#[test]
fn a_latitude_that_a_vehicle_can_have_reached_is_used() {
    for (seconds, by, is_reached) in
        [(0, 0.021, false), (60, 0.079, true), (60, 0.081, false), (3_600, 1.021, false)]
    {
        let mut receiver = known(Some(48.0));
        let read = receiver.decode(&position(48.0 + by), Micros(seconds * 1_000_000)).expect("its frame");
        assert_eq!(read.is_ok_and(|read| read.latitude.is_ok()), is_reached, "{by} deg in {seconds} s");
    }
}

#[test]
fn the_coprocessor_takes_the_latitude_from_the_bus() {
    let mut coprocessor = Coprocessor::new(Config { heading: Some(known(None)), ..Config::DEFAULT });
    let mut gyro = Gyro::new(7, -34.0, 0.0);
    let (mut rates, mut sources) = (Sent::default(), Vec::new());
    for step in 0..400 {
        let sample = gyro.sample();
        coprocessor.fog(sample, sample.time, &mut rates).expect("in order");
        sources.extend(rates.fog.drain(..).map(|yaw| yaw.source));
        if step >= 200 && step % 10 == 0 {
            coprocessor.can(&position(-34.0), sample.time).expect("a latitude");
        }
    }
    assert_eq!((sources.first(), sources.last()), (Some(&Source::Raw), Some(&Source::EarthRate)));
    let now = Micros(400 * PERIOD_US);
    let jump = coprocessor.can(&position(34.0), now);
    assert!(matches!(jump, Err(InputError::Heading(HeadingError::Jump { .. }))), "{jump:?}");
    assert_eq!(coprocessor.input_counters().latitude_errors, 1);
    let sample = gyro.sample();
    coprocessor.fog(sample, sample.time, &mut rates).expect("in order");
    let contested = rates.fog.last().expect("a rate");
    assert!(contested.faults.contains(Faults::IMPLAUSIBLE) && contested.quality == Quality::Degraded);
}
