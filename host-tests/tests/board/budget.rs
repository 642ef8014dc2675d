//! Time and settings on the image: the longest path of each task at both clocks, and configurations that the check
//! accepts or refuses, run for a while.
//!
//! | command | what |
//! |---|---|
//! | `cargo test -p gyronet-host-tests --test board moving_vehicle -- --nocapture` | the whole image's cycles a sample |
//! | `cargo test -p gyronet-host-tests --test board longest_paths -- --nocapture` | the table of paths |
//! | `GYRONET_SETTINGS=50,10,20,60 cargo test -p gyronet-host-tests --test board accepted -- --nocapture` | so many accepted configurations (and of them the costliest), refused ones, and seconds for each |

use crate::common::{self, IMU, SAMPLE, SECOND, SERVICE, START};
use crate::service::{self, on_bus, on_line};
use gyronet::compensate::Stride;
use gyronet::model::blob::Shape;
use gyronet::model::weights;
use gyronet::service::message::{FAILED_STARTS, Origin, Refusal};
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{Configuration, Record, Slot, StoreError};
use gyronet_host_tests::board::{At, Board};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::stored::{Stored, other_weights};
use gyronet_host_tests::{replay, settings};
use gyronet_tools::bundled;
use gyronet_tools::client::bus::SlcanBus;
use gyronet_tools::client::device::error::DeviceError;
use gyronet_tools::client::device::upload::upload;
use gyronet_tools::client::device::{Authority, Device};
use gyronet_tools::signing::PrivateKey;

/// Clocks of an instruction that the virtual board assumes.
const CLOCKS: f64 = 1.3;
/// Least times until the watchdog resets the board, s: all tasks, and idle while it checks a signature or a file.
const SHORT: [f64; 2] = [0.068, 0.714];
const LONG: [f64; 2] = [2.66, 5.3];
/// `movs r0, #1; bx lr`.
const TRUE: &[u8] = &[0x01, 0x20, 0x70, 0x47];
/// The check whether a window of the weights fits, in the image.
const FITS: &str = "slots::fits";

fn iwdg(board: &mut Board) -> usize {
    common::resets(board).iter().filter(|(_, cause)| cause == "iwdg").count()
}

fn drive(board: &mut Board, seconds: usize) {
    for samples in common::drive(100 * seconds).chunks(100) {
        let now = board.counts().time;
        common::send(board, samples, now);
        common::stop_wheels(board, 100, now);
        board.run(SECOND);
        board.can_frames();
    }
}

/// The whole image while the vehicle drives, with the default model: interrupts, pipeline, network, both lines and idle.
#[test]
fn a_moving_vehicle_costs_what_the_page_says() {
    const CYCLES: u64 = 25_000;
    /// Samples before the count and in it: the simulated car drives off after six seconds.
    const SAMPLES: [usize; 2] = [1_200, 300];
    let Some(mut board) = common::started() else { return };
    let drive = bundled::simulated_drive().expect("it comes with the tools");
    let mut wheels = drive.wheels().expect("it has wheels");
    let mut before = board.counts();
    for (k, row) in drive.rows.iter().take(SAMPLES.iter().sum()).enumerate() {
        if k == SAMPLES[0] {
            before = board.counts();
        }
        board.send(IMU, &replay::message(k, &row.sample));
        wheels.next(row).iter().for_each(|frame| board.can_send(frame));
        board.run(SAMPLE);
    }
    let after = board.counts();
    let awake = (after.time - before.time) - (after.asleep - before.asleep);
    let [cycles, instructions] =
        [awake.as_secs_f64() * 168e6, (after.instructions - before.instructions) as f64]
            .map(|of_all| (of_all / SAMPLES[1] as f64) as u64);
    println!("{instructions} instructions a sample, {cycles} cycles awake");
    assert!(cycles <= CYCLES, "{cycles}");
    let page = include_str!("../../../tools/MEASUREMENTS.md");
    assert!(page.contains("takes 25,000 cycles a sample"), "the page says another number");
}

/// With and without the crystal, signed writes, an upload and windows run, and the watchdog resets nothing.
#[test]
fn longest_paths_at_both_clocks() {
    for (slow, hz) in [(0, 168e6), (1, 16e6)] {
        let Some(mut board) = common::unpowered() else { return };
        Stored::default().weights(Slot::B, &weights::GYRONET.0).write_to(&mut board);
        board.configure("RCC.lsi_hz", 47_000); // The fastest watchdog.
        board.power_on();
        board.run(3 * SECOND);
        let key = PrivateKey::generate().expect("random numbers");
        on_line(&mut board).set_key(&key.public()).expect("there was none");
        if slow == 1 {
            board.configure("RCC.crystal_hz", serde_json::Value::Null);
            board.configure("USART2.baud", 500_000);
        }
        board.power_cycle(SAMPLE, 3 * SECOND);
        let info = service::info(&mut board);
        assert_eq!(u64::from(info.identity.clock_hz), hz as u64);
        if slow == 1 {
            assert_eq!(info.weights, WeightSource::BuiltIn);
            assert!(matches!(info.refused_slots, [None, Some(SlotError::Slow { .. })]), "{info:?}");
        } else {
            assert_eq!(info.weights, WeightSource::Slot(Slot::B));
        }
        board.paths();
        // Without the crystal there are no random numbers, and no challenge: what is written is signed before.
        let signed = service::at_latitude(1.0);
        let content = service::storing(&signed);
        let trailer = key.trailer(0x0100, None, 1, &content[3..]);
        for (configuration, is_right) in [(Configuration::DEFAULT, false), (signed, true)] {
            let mut device = on_line(&mut board).authorise(Authority::Signature(trailer));
            match device.set_configuration(&configuration) {
                Ok(()) => assert!(is_right),
                Err(DeviceError::Refused(Refusal::Signature)) => assert!(!is_right),
                other => panic!("{other:?}"),
            }
        }
        let trailer = key.trailer(0xFF01, None, 2, &weights::DEFAULT.0);
        let mut device = on_line(&mut board).authorise(Authority::Signature(trailer));
        upload(&mut device, &weights::DEFAULT.0, |_| {}).expect("it is signed");
        let before = board.counts().instructions;
        drive(&mut board, 6);
        let of_a_sample = (board.counts().instructions - before) as f64 / 600.0;
        let paths = board.paths();
        println!("{:.0} MHz, {CLOCKS} clocks an instruction, {of_a_sample:.0} a sample", hz / 1e6);
        for (name, instructions) in &paths {
            let time = *instructions as f64 * CLOCKS / hz;
            println!("  {name:10} {instructions:>10} instructions {:>9.3} ms", 1e3 * time);
            let limit = if name == "idle" { LONG[slow] } else { SHORT[slow] };
            assert!(time < limit, "{name}: {time} s");
        }
        assert!(paths.len() >= 4, "{paths:?}");
        assert_eq!(iwdg(&mut board), 0);
    }
}

/// Weights that cannot run are forced upon the board: it ends with the built-in configuration, and answers.
#[test]
fn three_resets_by_the_watchdog_lead_to_the_built_in_configuration() {
    let Some(mut board) = common::unpowered() else { return };
    let mut configuration = Configuration::DEFAULT;
    configuration.compensate.stride = Stride::new(1).expect("one sample");
    Stored::default().record(&configuration).weights(Slot::A, &other_weights(1)).write_to(&mut board);
    board.patch(At::Symbol(FITS), TRUE);
    board.power_on();
    board.run(START);
    let mut resets = 0;
    for _ in 0..8 {
        drive(&mut board, 6);
        resets += iwdg(&mut board);
    }
    assert_eq!(resets, usize::from(FAILED_STARTS), "and none after them");
    let info = service::info(&mut board);
    assert_eq!(info.identity.failed_starts, FAILED_STARTS);
    assert_eq!(info.configuration, Origin::Refused(StoreError::Resets));
    assert_eq!(info.weights, WeightSource::BuiltIn);
    let troubles = on_bus(&mut board).ask(&[0x19, 2, 0x09]).expect("a list");
    for code in [[0x5A, 0x03, 0x47], [0x5A, 0x02, 0x44]] {
        assert!(troubles[2..].chunks(4).any(|trouble| trouble[..3] == code), "{troubles:02x?}");
    }
    // A restart on request tries what is stored.
    service::restart(&mut board);
    assert_eq!(service::info(&mut board).configuration, Origin::Stored);
}

/// What the check accepts runs, the costliest first; what it refuses for its cost, forced upon the board, does not.
#[test]
fn accepted_settings_run_and_refused_ones_do_not() {
    let numbers = std::env::var("GYRONET_SETTINGS").unwrap_or_else(|_| "2,1,4,6".to_owned());
    let numbers: Vec<usize> = numbers.split(',').flat_map(str::parse).collect();
    let [accepted, costliest, refused, seconds] = numbers[..] else { panic!("four numbers") };
    let cost = |configuration: &Configuration, shape: Shape| {
        f64::from(shape.window_cycles())
            / f64::from(configuration.compensate.stride.window_cycles(168_000_000))
    };
    let shapes = [Shape { units: 0, linear: true }, Shape::PAPER];
    let mut all: Vec<(f64, Configuration, Shape)> = (0..10_000)
        .filter_map(|seed| {
            let mut noise = Noise::new(seed);
            // Windows run only behind a static initialisation.
            let Configuration { static_init, mounting, .. } = Configuration::DEFAULT;
            let configuration =
                Configuration { static_init, mounting, ..settings::configuration(&mut noise) };
            let shape = shapes[seed as usize % 2];
            configuration
                .check()
                .and_then(|()| configuration.check_wheels(&settings::wheels(&mut noise)))
                .ok()?;
            Some((cost(&configuration, shape), configuration, shape))
        })
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (over, under): (Vec<_>, Vec<_>) = all.into_iter().partition(|(cost, ..)| *cost > 1.0);
    assert!(over.len() >= refused && under.len() >= accepted);
    let others = (under.len().saturating_sub(costliest) / (accepted - costliest).max(1)).max(1);
    let rest = under.iter().skip(costliest).step_by(others).take(accepted - costliest);
    let runs: Vec<_> = under.iter().take(costliest).chain(rest).collect();
    let mut counts = [0; 2];
    for (number, (cost, configuration, shape)) in
        runs.iter().copied().chain(over.iter().take(refused)).enumerate()
    {
        let is_forced = number >= runs.len();
        let Some(mut board) = common::unpowered() else { return };
        let stored = Stored::default().record(configuration);
        let stored = if shape.units > 4 { stored.weights(Slot::A, &weights::GYRONET.0) } else { stored };
        stored.write_to(&mut board);
        board.configure("CAN1.bit_rate", configuration.can.bits_per_second);
        if is_forced {
            board.patch(At::Symbol(FITS), TRUE);
        }
        board.power_on();
        board.run(START);
        // A refused one has failed after 6 s.
        drive(&mut board, if is_forced { seconds.min(6) } else { seconds });
        // A board that is being reset does not answer.
        let fails = iwdg(&mut board) > 0 || {
            let bus = SlcanBus::new(board.line(SERVICE));
            let device = Device::with_ids(bus, "the virtual board", &configuration.diagnosis);
            device.and_then(|mut device| device.counters()).expect("a response").pipeline.late > 0
        };
        println!("{cost:.2}, {:?}, {} units: fails {fails}", configuration.compensate.stride, shape.units);
        assert!(is_forced || !fails, "{configuration:?}");
        counts[usize::from(is_forced)] += usize::from(fails == is_forced);
    }
    println!("{} of {accepted} accepted run {seconds} s, {} of {refused} refused fail", counts[0], counts[1]);
    assert!(4 * counts[1] >= 3 * refused);
}
