//! A small campaign on the simulated drive: no run panics, and no fault moves the yaw undetected beyond its bound.

use gyronet_host_tests::faults::drive::Drive;
use gyronet_host_tests::faults::fault::{Axes, Fault, Kind, Line, Span};
use gyronet_host_tests::faults::judge::Outcome;
use gyronet_host_tests::faults::networks::Networks;
use gyronet_host_tests::faults::report::{self, Report};
use gyronet_host_tests::faults::scene::Scene;
use gyronet_host_tests::faults::{self, Plan, QUICK, Run};
use gyronet_tools::bundled;
use gyronet_tools::parts::Part;

fn drive() -> Drive {
    Drive::new(&bundled::simulated_drive().expect("it comes with the tools"))
}

/// The outcome of a stretch in which the car drives and turns, with or without a fault.
fn outcome(scene: &Scene<'_>, fault: Option<Fault>) -> Outcome {
    let span = Span { from: 2_000, to: 2_800, healthy: 101 };
    scene.run(span, fault.as_slice(), &mut Networks::default())
}

fn fault(kind: Kind, rows: usize, size: f64) -> Fault {
    let (axes, line) = (Axes::One(2), Line::Sensor);
    Fault { kind, line, from: 2_150, rows, share: 1.0, size, axes, form: 0, seed: 7 }
}

#[test]
fn no_fault_moves_yaw_undetected() {
    let drives = [drive()];
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let scenes = faults::scenes(&drives, threads);
    for scene in &scenes {
        let seconds = scene.baseline.against_truth().expect("a reference").seconds;
        let good = 100.0 * seconds as f64 / scene.rows() as f64;
        assert!(good > 0.9, "{}: {good} of the undamaged drive is good", scene.part.name());
        let undamaged = outcome(scene, None);
        let seen = (undamaged.reported_after, undamaged.moved, undamaged.grown);
        assert_eq!(seen, (None, 0.0, 0.0), "{}: a stretch is the whole drive's", scene.part.name());
        assert!(undamaged.error > 0.0, "the reference is there");
        // The undamaged run is compared with the reference, so a build with a wrong rate or a wrong stated error fails.
        let errors = scene.baseline.against_truth().expect("a reference");
        assert!(errors.in_order && errors.seconds > 60, "{}: {errors:?}", scene.part.name());
    }
    let plan = Plan { runs: QUICK, seed: 1, threads };
    let runs = faults::run(plan, &scenes);
    println!("{}", Report(&scenes, &runs));
    assert_eq!(runs.iter().filter(|run| run.is_failure()).count(), 0, "undetected or panicked");
    let all = report::Line::new(runs.iter());
    assert_eq!((all.runs, all.reported + all.harmless + all.bounded), (QUICK, QUICK));
    assert!(all.reported > QUICK / 2 && all.harmless > 0 && all.bounded > 0, "{all}");
    assert!(runs.iter().filter(|run| run.is_bounded()).count() < QUICK / 10, "{all}");

    let again: Vec<Run> = faults::run(Plan { runs: 4, threads: 1, ..plan }, &scenes);
    for (run, again) in runs.iter().zip(&again) {
        assert_eq!((&run.faults, &run.outcome), (&again.faults, &again.outcome), "whatever the threads");
    }
}

#[test]
fn the_judge_sees_known_faults() {
    let drive = drive();
    let scene = Scene::new(&drive, Part::Icm42688, &mut Networks::default());
    // A step of 0.01 rad/s in a turn cannot be detected, and moves the yaw.
    let bias = outcome(&scene, Some(fault(Kind::BiasStep, 650, 0.01)));
    assert!(bias.is_undetected() && bias.reported_after.is_none(), "{bias:?}");
    assert!((0.008..0.02).contains(&bias.moved), "{bias:?}");
    // A frozen yaw axis is reported after seven samples, before any of its yaw is sent.
    let stuck = outcome(&scene, Some(fault(Kind::Stuck, 200, 0.0)));
    assert!((0.06..0.08).contains(&stuck.reported_after.expect("it is reported")), "{stuck:?}");
    assert!(!stuck.is_undetected() && stuck.recovery < 0.2 && !stuck.not_recovered, "{stuck:?}");
    // Nothing comes for 100 ms: the time-out reports it.
    let silent = outcome(&scene, Some(Fault { rows: 10, ..fault(Kind::Stall, 10, 0.0) }));
    assert!(silent.reported_after.expect("it is reported") < 0.035, "{silent:?}");
    // A reading that jumps is refused, whatever the part's checksum is.
    let spikes = outcome(&scene, Some(fault(Kind::BitFlip, 200, 0.0)));
    assert!(spikes.reported_after.expect("it is reported") < 0.3 && spikes.moved < 0.05, "{spikes:?}");
    // A sample that arrives twice counts once.
    let twice = outcome(&scene, Some(fault(Kind::Duplicate, 200, 0.0)));
    assert!(twice.is_harmless() && twice.moved == 0.0, "{twice:?}");
}

/// The pipeline integrates by the part's clock. The drift of a crystal is far below the limit.
#[test]
fn a_clock_that_drifts_moves_yaw_by_that_share_of_the_turn() {
    let drive = drive();
    for part in Part::ALL {
        let scene = Scene::new(&drive, part, &mut Networks::default());
        for ppm in [50.0, 200.0, 1_000.0, 5_000.0, 20_000.0] {
            let drift = outcome(&scene, Some(fault(Kind::ClockDrift, 650, ppm)));
            let Outcome { moved, moved_limits, reported_after, .. } = drift;
            println!(
                "{}: {ppm} ppm: {moved:.1e} rad, {moved_limits:.2} of the limit, reported after {reported_after:?} s",
                part.name()
            );
            // 0.7 rad/s is the fastest turn of the drives.
            assert!(moved <= 0.7e-6 * ppm + 5e-4, "{}: {ppm} ppm: {drift:?}", part.name());
            assert!(ppm > 200.0 || drift.is_harmless(), "{}: {ppm} ppm: {drift:?}", part.name());
        }
    }
}
