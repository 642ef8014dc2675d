//! How well the board learns gain and mounting in 20 minutes with courses, on three simulated vehicles of the situations.
//!
//! Each seed is a part, mounted askew, on a ride in mixed traffic on sloping streets, with a GNSS receiver. A line for
//! each vehicle and quantity (gains in %, mounting in deg): RMS and mean of the board's errors, the median of its sigma,
//! and the share of errors inside it, 68 % where it is honest. The rate's gain is the part's as the ride shows it: a gyro
//! that leans with street, body or mounting reads less of a turn.

use gyronet::{heading::Heading, store::Learned, units::Micros};
use gyronet_host_tests::parallel;
use gyronet_host_tests::situations::vehicle::{CAR, HATCH, STEP, TRUCK, Vehicle};
use gyronet_host_tests::situations::{board::Board, ride::Ride, sensor::Sensor, wheels::frames};
use gyronet_tools::simulate::gnss::{Config, Gnss};
use gyronet_tools::{drive::DT, random::Random};

const MINUTES: usize = 20;
const SEEDS: std::ops::RangeInclusive<u64> = 1..=20;
const WHAT: [&str; 4] = ["part's gain", "rate's gain", "roll", "pitch"];
/// Assumed: sigma of slope and bank, 2 deg in rad; antenna ahead of the rear axle, m; slip outwards, rad per m/s^2.
const STREET: f64 = 0.035;
const ANTENNA: f64 = 1.0;
const SLIP: f64 = 0.002;

/// Town blocks, and faster roads with bends; a stop and another slope after each.
fn mixed_traffic(random: &mut Random) -> Ride {
    let mut ride = Ride::default();
    ride.hold(8.0);
    while ride.end() <= 60.0 * MINUTES as f64 {
        [ride.now.slope, ride.now.bank] = [STREET * random.normal(), STREET * random.normal()];
        if random.chance(0.6) {
            ride.town(1, random).hold(random.between(0.0, 32.0));
            continue;
        }
        let speed = random.between(14.0, 25.0);
        ride.reach(speed, speed / 1.5);
        for _ in 0..4 {
            let bend = random.sign() * random.between(10.0, 50.0);
            ride.hold(random.between(2.0, 12.0)).turn(bend, random.between(8.0, 14.0));
        }
        ride.stop(speed / 1.5, random.between(4.0, 40.0));
    }
    ride
}

/// Error and sigma of each of [`WHAT`].
fn learnt(vehicle: &Vehicle, seed: u64) -> [[f64; 2]; WHAT.len()] {
    let random = |stream| Random::new(seed, stream);
    let sensor = Sensor::new(vehicle, &mut random(1));
    let travelled = mixed_traffic(&mut random(0)).travel(vehicle, &mut random(2));
    let mut inertial = sensor.messages(&travelled, &mut random(3)).into_iter().peekable();
    let shown = vehicle.wheels.map(|shown| frames(&travelled, shown, &[], &mut random(4)));
    let mut wheels = shown.unwrap_or_default().into_iter().peekable();
    let mut gnss = Gnss::new(&Config { latency_s: 0.4, spoofed_from_s: None }, seed);
    let mut board = Board::new(vehicle.part, vehicle.wheels.is_some(), 10, &Learned::NOTHING);
    let (mut sums, mut before) = ([0.0; 2], 0.0);
    for step in 1..=60_000 * MINUTES {
        let now = step as f64 * STEP;
        let clock = Micros(1_000 * step as u64);
        let messages = std::iter::from_fn(|| inertial.next_if(|message| message.at <= now + 1e-7));
        messages.for_each(|message| board.receive(&message.bytes));
        std::iter::from_fn(|| wheels.next_if(|(at, _)| *at <= now))
            .for_each(|(_, frame)| board.receive_frame(frame));
        if step.is_multiple_of(10) {
            // The antenna moves where it points and turns, less slip; a receiver averages shaking out.
            let turning = (travelled.heading(now + 0.1) - travelled.heading(now - 0.1)) / 0.2;
            let (speed, heading) = (travelled.speed(now), travelled.heading(now));
            let course = heading + (ANTENNA * turning).atan2(speed.max(0.1)) - SLIP * speed * turning;
            let rate = (course - std::mem::replace(&mut before, course)) / DT;
            if let Some(fix) = gnss.step(rate, speed) {
                let [course, course_sigma, speed] =
                    [fix.course, fix.sigma, fix.speed].map(|value| Some(value as f32));
                let heading = Heading { course, course_sigma, speed, speed_sigma: None };
                board.coprocessor.heading(&heading, clock).expect("a course");
            }
        }
        board.step(clock);
        if step.is_multiple_of(1_000) {
            let turned = travelled.heading(now) - travelled.heading(now - 1.0);
            sums = [sums[0] + travelled.mean(now - 1.0, now)[2] * turned, sums[1] + turned * turned];
        }
    }
    let (gain, sigma) = board.coprocessor.pipeline().gain();
    let gain = [100.0 * gain, 100.0 * sigma.unwrap_or(f32::NAN)];
    let [roll, pitch, tilt] = board.coprocessor.pipeline().vertical().expect("a start at rest").tilt_deg();
    let known = [gain, gain, [roll, tilt], [pitch, tilt]].map(|known| known.map(f64::from));
    let (part, [roll, pitch, _]) = (sensor.gain[2], sensor.tilt);
    let rate = part * roll.cos() * pitch.cos() * sums[0] / sums[1];
    let truth = [100.0 * (part - 1.0), 100.0 * (rate - 1.0), roll.to_degrees(), pitch.to_degrees()];
    std::array::from_fn(|of| [known[of][0] - truth[of], known[of][1]])
}

fn main() {
    let seeds: Vec<u64> = SEEDS.collect();
    println!("| vehicle | what | RMS | mean | sigma | inside |\n|---|---|---|---|---|---|");
    for vehicle in [CAR, HATCH, TRUCK] {
        let rides = parallel::map(&seeds, |seed| learnt(&vehicle, *seed));
        for (of, what) in WHAT.into_iter().enumerate() {
            let mut all: Vec<[f64; 2]> = rides.iter().map(|ride| ride[of]).collect();
            all.sort_by(|one, other| one[1].total_cmp(&other[1]));
            let mean = |of: fn(&[f64; 2]) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
            let (rms, off) = (mean(|[error, _]| error * error).sqrt(), mean(|[error, _]| *error));
            let inside = 100.0 * mean(|[error, sigma]| f64::from(error.abs() <= *sigma));
            let (name, sigma) = (vehicle.name, all[all.len() / 2][1]);
            println!("| {name} | {what} | {rms:.3} | {off:+.3} | {sigma:.3} | {inside:.0} % |");
        }
    }
}
