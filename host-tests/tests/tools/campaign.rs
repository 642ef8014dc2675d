//! A small part of the fault campaign on the simulated drive: nothing panics, and no fault moves the yaw unseen that is
//! not on the named list.

use gyronet::model::{Blob, weights};
use gyronet_tools::bundled;
use gyronet_tools::campaign::drive::Drive;
use gyronet_tools::campaign::fault::{Axes, Fault, Kind, Line, Span};
use gyronet_tools::campaign::judge::Outcome;
use gyronet_tools::campaign::networks::Integer;
use gyronet_tools::campaign::report::Report;
use gyronet_tools::campaign::scene::Scene;
use gyronet_tools::campaign::{self, Plan, QUICK};
use gyronet_tools::parts::Part;

fn drive() -> Drive {
    Drive::new(&bundled::simulated_drive().expect("it comes with the tools"))
}

fn blob() -> Blob<'static> {
    Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library")
}

/// Returns the outcome of a stretch in which the car drives and turns, with or without a fault.
fn outcome(scene: &Scene<'_>, fault: Option<Fault>) -> Outcome {
    let span = Span { from: 2_000, to: 2_800, healthy: 101 };
    scene.run(span, fault.as_slice(), &mut Integer::new(blob()))
}

fn fault(kind: Kind, rows: usize, size: f64) -> Fault {
    let (axes, line) = (Axes::One(2), Line::Sensor);
    Fault { kind, line, from: 2_150, rows, share: 1.0, size, axes, form: 0, seed: 7 }
}

#[test]
fn no_fault_moves_yaw_unseen() {
    let drives = [drive()];
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let scenes = campaign::scenes(&drives, &blob(), threads, || {});
    for scene in &scenes {
        let seconds = scene.baseline.against_truth().expect("a reference").seconds;
        let good = 100.0 * seconds as f64 / scene.rows() as f64;
        assert!(good > 0.9, "{}: {good} of the undamaged drive is good", scene.part.name());
        let undamaged = outcome(scene, None);
        let seen = (undamaged.reported_after, undamaged.counted, undamaged.moved, undamaged.grown);
        assert_eq!(seen, (None, false, 0.0, 0.0), "{}: a stretch is the whole drive's", scene.part.name());
        assert!(undamaged.error > 0.0, "the reference is there");
        // A build that is wrong by itself, or states another error than it has, is not to be held against itself.
        let errors = scene.baseline.against_truth().expect("a reference");
        assert!(errors.in_order && errors.seconds > 60, "{}: {errors:?}", scene.part.name());
    }
    let plan = Plan { runs: QUICK, seed: 1, threads };
    let runs = campaign::run(plan, &scenes, &blob(), || {});
    let report = Report::new(plan.seed, &scenes, &runs);
    println!("{report}");
    assert!(report.failures.is_empty(), "{} undetected or panicked", report.failures.len());
    let all = report.lines.last().expect("a line of all");
    assert_eq!((all.runs, all.panics, all.undetected), (QUICK, 0, 0));
    assert!(all.reported > QUICK / 2 && all.harmless > 0 && all.excepted > 0, "{all:?}");

    let again = campaign::run(Plan { runs: 4, threads: 1, ..plan }, &scenes, &blob(), || {});
    for (run, again) in runs.iter().zip(&again) {
        assert_eq!((&run.faults, &run.outcome), (&again.faults, &again.outcome), "whatever the threads");
    }
}

#[test]
fn the_judge_sees_known_faults() {
    let drive = drive();
    let scene = Scene::new(&drive, Part::Icm42688, &mut Integer::new(blob()));
    // 0.01 rad/s from one sample to the next, in a turn: nothing can tell, and the yaw shows it.
    let bias = outcome(&scene, Some(fault(Kind::BiasStep, 650, 0.01)));
    assert!(bias.is_undetected() && bias.reported_after.is_none() && !bias.counted, "{bias:?}");
    assert!((0.008..0.02).contains(&bias.moved), "{bias:?}");
    // A frozen yaw axis is reported after seven samples, before any of it has gone out.
    let stuck = outcome(&scene, Some(fault(Kind::Stuck, 200, 0.0)));
    assert!((0.06..0.08).contains(&stuck.reported_after.expect("it is reported")), "{stuck:?}");
    assert!(!stuck.is_undetected() && stuck.recovery < 0.2 && !stuck.not_recovered, "{stuck:?}");
    // Nothing comes for 100 ms: the time-out reports it.
    let silent = outcome(&scene, Some(Fault { rows: 10, ..fault(Kind::Stall, 10, 0.0) }));
    assert!(silent.reported_after.expect("it is reported") < 0.035, "{silent:?}");
    // A bit that makes a reading jump is no reading, whatever the part's checksum is.
    let spikes = outcome(&scene, Some(fault(Kind::BitFlip, 200, 0.0)));
    assert!(spikes.reported_after.expect("it is reported") < 0.3 && spikes.moved < 0.05, "{spikes:?}");
    // Twice the same is once.
    let twice = outcome(&scene, Some(fault(Kind::Duplicate, 200, 0.0)));
    assert!(twice.is_harmless() && twice.counted && twice.moved == 0.0, "{twice:?}");
}

/// The part's clock is the only one that the pipeline integrates by: a drift scales the turn, and a
/// crystal's is far below what counts.
#[test]
fn a_clock_that_drifts_moves_yaw_by_that_share_of_the_turn() {
    let drive = drive();
    for part in Part::ALL {
        let scene = Scene::new(&drive, part, &mut Integer::new(blob()));
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
