//! A board's loop in one call: what it reads, receives, estimates, sends and reports.

use super::transmit_queue::{Controller, Mood};
use embedded_can::Frame;
use gyronet::coprocessor::{Bus, Config, Coprocessor, QueuedCan, Step};
use gyronet::health::{Faults, Status};
use gyronet::model::GyroNet;
use gyronet::sample::{ImuSample, PERIOD_US, Standstill, TestSignal};
use gyronet::units::{Micros, RangeError};
use gyronet_host_tests::wire::{data_frame, wheels};
use gyronet_tools::drive::wheel_frames::receiver;

/// Frames of a sample.
const SET: usize = 6;
/// Places in the queue before the controller.
const QUEUE: usize = 24;

fn taking() -> Controller {
    Controller { then: Mood::Takes, ..Controller::default() }
}

/// A parked car on a board; the reading of each step is up to the test.
struct Car {
    coprocessor: Coprocessor,
    network: GyroNet<'static, gyronet::model::GyroNetState>,
    number: u32,
}

type Reading = Option<Result<ImuSample, RangeError>>;

impl Car {
    fn new() -> Self {
        let wheels = Some(receiver());
        let coprocessor = Coprocessor::new(Config { wheels, ..Config::DEFAULT });
        Self { coprocessor, network: GyroNet::shipped().expect("it comes with the library"), number: 0 }
    }

    fn step(&mut self, mut reading: Reading, bus: &mut impl Bus) -> Step<RangeError> {
        let now = Micros(u64::from(self.number) * PERIOD_US);
        self.number += 1;
        self.coprocessor.step(now, &mut reading, bus, Some(&mut self.network))
    }

    fn sample(&mut self, bus: &mut impl Bus) -> Step<RangeError> {
        let sample = TestSignal::turning(0.5).sample(self.number);
        self.step(Some(Ok(sample)), bus)
    }
}

#[test]
fn constant_readings_of_a_test_become_good_rates() {
    let (mut car, mut can) = (Car::new(), QueuedCan::<_>::new(taking()));
    let last = (0..400).map(|_| car.sample(&mut can)).last().expect("steps");
    let live = last.observation.expect("a message set").vehicle.live;
    assert_eq!((live.status, live.faults, last.imu_error), (Status::Ready, Faults::NONE, None));
    assert!(live.rate.rad_per_sec().abs() < 1e-4, "{}", live.rate.rad_per_sec());
    assert_eq!(can.controller().sent.len(), 400 * SET);
}

#[test]
fn a_sensor_that_fails_to_read_is_counted_and_reported_as_silent() {
    let (mut car, mut can) = (Car::new(), QueuedCan::<_>::new(taking()));
    for _ in 0..400 {
        car.sample(&mut can);
    }
    let failing: Vec<Step<RangeError>> =
        (0..5).map(|_| car.step(Some(Err(RangeError::NotFinite)), &mut can)).collect();
    assert!(failing.iter().all(|step| step.imu_error == Some(RangeError::NotFinite)));
    assert_eq!(car.coprocessor.input_counters().imu_errors, 5);
    let silent = failing.iter().filter_map(|step| step.observation);
    let statuses: Vec<Status> = silent.map(|observation| observation.vehicle.live.status).collect();
    // 30 ms after the last sample, then every 10 ms.
    assert_eq!(statuses, [Status::Silent; 3]);
    assert_eq!(can.controller().sent.len(), 403 * SET);
    let next = car.sample(&mut can).observation.map(|seen| seen.vehicle.live.status);
    assert_eq!(next, Some(Status::Degraded), "until the next window");
}

#[test]
fn frames_that_the_bus_does_not_take_are_lost_and_reported() {
    let controller = Controller::default();
    let (mut car, mut can) = (Car::new(), QueuedCan::<_, QUEUE>::new(controller));
    let faults: Vec<Faults> = (0..6)
        .map(|_| car.sample(&mut can).observation.expect("a message set").vehicle.live.faults)
        .collect();
    assert_eq!(can.lost() as usize, 6 * SET - QUEUE);
    // The fifth set pushes out the first, which the sixth reports.
    assert_eq!(faults, [Faults::NONE, Faults::NONE, Faults::NONE, Faults::NONE, Faults::NONE, Faults::BUS]);
}

#[test]
fn received_wheel_frames_are_used_and_damaged_ones_counted() {
    let controller = Controller { received: [wheels(0.0)].into(), ..taking() };
    let (mut car, mut can) = (Car::new(), QueuedCan::<_>::new(controller));
    let seen = car.sample(&mut can).observation.expect("a message set");
    assert!(seen.wheels.speeds.iter().all(Option::is_some));
    assert_eq!(seen.wheels.standstill, Standstill::Unknown, "for half a second");
    let short = data_frame(wheels(0.0).id(), &wheels(0.0).data()[..3]);
    let controller = Controller { received: [short].into(), ..taking() };
    let (mut car, mut can) = (Car::new(), QueuedCan::<_>::new(controller));
    car.sample(&mut can);
    assert_eq!(car.coprocessor.input_counters().wheel_errors, 1);
}
