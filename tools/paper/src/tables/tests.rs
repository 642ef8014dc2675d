use super::joint::Fit;
use super::results::{Group, Results, SequenceErrors};
use super::{estimates, table};
use crate::sequence::{Sequence, Step, StreamSummary};
use crate::simulate::{self, Spec};
use gyronet_tools::board::Uncorrected;
use gyronet_tools::drive::track::Track;
use gyronet_tools::evaluate::methods::Method;
use std::path::PathBuf;

fn sequence(name: &str, seconds: u32) -> Sequence {
    let folder = tempfile::tempdir().unwrap();
    let spec = Spec { name: name.into(), seconds, device: 1, run: 3 };
    simulate::write(&spec, folder.path()).unwrap();
    Sequence::read(folder.path()).unwrap()
}

/// Returns a sequence that dead reckoning of the truth reproduces.
fn exact() -> Sequence {
    let mut track = Track { position: [100.0, -50.0], yaw: 2.0 };
    let step = |k: usize| {
        let turned = if k < 400 { 0.0 } else { 0.003 * (k as f64 * 0.002).sin() };
        let way = if k < 400 { 0.0 } else { 0.1 };
        track.step([way; 2], turned);
        // Every axis has noise as a sensor has, with mean zero over three steps: equal readings would count as stuck.
        let noise = 1e-4 * ((k % 3) as f32 - 1.0);
        Step {
            specific_force: [10.0 * noise, 10.0 * noise, 9.8 + 10.0 * noise],
            angular_rate: [noise, noise, (turned / 0.01 + 0.002) as f32 + noise],
            imu_gap: false,
            other_gap: false,
            fog: turned,
            wheels: [way; 2],
            position: track.position,
            yaw: track.yaw,
            vendor_yaw: track.yaw,
        }
    };
    let file = || StreamSummary::new(&PathBuf::from("a.csv"), 100.0);
    Sequence {
        name: "urban18".into(),
        path: PathBuf::from("urban18"),
        simulated: None,
        wheel_base: 1.5,
        latitude: None,
        start_s: 1.5e9,
        origin: [0.0; 2],
        steps: (0..6_000).map(step).collect(),
        in_gap: [0; 4],
        files: [file(), file(), file(), file()],
    }
}

fn errors(sequence: &Sequence) -> SequenceErrors {
    SequenceErrors::new(sequence, &estimates::run(sequence, &mut Uncorrected))
}

#[test]
fn each_method_does_what_it_says() {
    let errors = errors(&exact());
    let final_rad = |key: &str| errors.methods[key].final_unwrapped_rad;
    let seconds = 57.0;
    assert!((final_rad("raw") - 0.002 * seconds).abs() < 1e-4, "the bias alone: {}", final_rad("raw"));
    assert!(final_rad("static") < 1e-4, "{}", final_rad("static"));
    // Without a correction by the network, static initialisation remains.
    assert!((final_rad("gyronet") - final_rad("static")).abs() < 1e-5);
    assert!((final_rad("gyronet_online") - final_rad("static")).abs() < 1e-5);
    assert!((final_rad("gyronet_loop") - final_rad("static")).abs() < 1e-5);
    assert!(final_rad("fog") < 1e-9 && final_rad("vendor") < 1e-9);
    let earth = 7.292_115e-5 * 36.37f64.to_radians().sin() * seconds;
    assert!((final_rad("fog_earth") - earth).abs() < 1e-9, "nothing to take off here");
    let fog = errors.methods["fog"];
    assert!(fog.ate_m < 1e-9 && fog.aligned_ate_m < 1e-9 && fog.mean_1s_rad < 1e-12, "{fog:?}");
    assert!(errors.group == Group::NewlyReleased && !errors.simulated);
    assert!((errors.metres - 560.0).abs() < 0.2, "{}", errors.metres);
}

#[test]
fn wheels_alone_turn_by_their_difference() {
    let mut sequence = exact();
    for step in &mut sequence.steps {
        let [left, right] = &mut step.wheels;
        (*left, *right) = (*left - 0.75 * step.fog, *right + 0.75 * step.fog);
    }
    let wheels = errors(&sequence).methods["wheels"];
    assert!(wheels.final_unwrapped_rad < 1e-9 && wheels.ate_m < 1e-6, "{wheels:?}");
    // A wheel base that is wrong by a tenth makes the turn wrong by a tenth.
    sequence.wheel_base = 1.5 / 1.1;
    let errors = errors(&sequence);
    let turned: f64 = sequence.turns()[300..].iter().sum();
    assert!((errors.methods["wheels"].final_unwrapped_rad - 0.1 * turned.abs()).abs() < 1e-9, "{errors:?}");
}

#[test]
fn wheels_and_gyro_are_fitted_together() {
    let training = exact();
    let (scale, constant, longer) = (1.0 + 1e-3, 4e-5, 1.002);
    let worse = |sequence: &Sequence| {
        let mut sequence = sequence.clone();
        for step in &mut sequence.steps {
            step.fog = step.fog * scale + 0.01 * constant;
            step.wheels = step.wheels.map(|way| longer * way);
        }
        sequence
    };
    let mut fit = Fit::default();
    fit.add(&worse(&training));
    // Both wheels cover the same distance here, so the share of their difference cannot be fitted.
    assert_eq!(fit.solve(), None);
    let mut turning = training.clone();
    for (k, step) in turning.steps.iter_mut().enumerate() {
        let way = 1e-3 * (k as f64 * 0.001).sin();
        step.wheels = [step.wheels[0] - way, step.wheels[1] + way];
    }
    fit.add(&worse(&turning));
    let joint = fit.solve().unwrap();
    assert!((joint.gyro * scale - 1.0).abs() < 1e-9 && joint.difference.abs() < 1e-9, "{joint:?}");
    assert!((joint.constant + constant / scale).abs() < 1e-9, "{joint:?}");
    assert!((joint.way * longer - 1.0).abs() < 1e-6, "{joint:?}");

    let tested = worse(&training);
    let mut estimates = estimates::run(&tested, &mut Uncorrected);
    estimates.add_joint(&tested, &joint);
    let errors = SequenceErrors::new(&tested, &estimates);
    assert!(errors.methods["fog"].ate_m > 0.1, "{errors:?}");
    let fitted = errors.methods["fog_wheels"];
    assert!(fitted.ate_m < 1e-3 && fitted.final_unwrapped_rad < 1e-6, "{fitted:?}");
    let table = &table::tables(&Results::new(vec![errors]))[0];
    assert!(table.notes.iter().any(|note| note.contains("fitted on urban18, urban18")), "{:?}", table.notes);
}

#[test]
fn what_needs_to_stand_still_is_left_out_when_it_does_not() {
    let mut sequence = exact();
    for (k, step) in sequence.steps.iter_mut().enumerate().take(400) {
        step.angular_rate[2] = 0.002 * k as f32;
    }
    let errors = errors(&sequence);
    assert!(
        !errors.methods.contains_key(Method::STATIC.key) && !errors.methods.contains_key(Method::GYRONET.key)
    );
    assert!(errors.methods.contains_key(Method::RAW.key) && errors.methods.contains_key(Method::FOG.key));
    assert!(errors.refused.as_ref().is_some_and(|why| why.contains("starts moving")), "{errors:?}");
}

#[test]
fn sequences_of_the_paper_get_the_tables_that_it_has_for_them() {
    let of = |name: &str| {
        let mut errors = errors(&Sequence { name: name.into(), ..exact() });
        let fognet = errors.methods["fog"];
        errors.methods.insert(Method::FOGNET.key, fognet);
        errors.order.push(Method::FOGNET);
        errors
    };
    let tables = table::tables(&Results::new(vec![of("urban15"), of("urban18")]));
    let titled = |title: &str| tables.iter().find(|table| table.title.starts_with(title)).expect("a table");
    let rivals = titled("Table IV:");
    let names: Vec<&str> = rivals.rows.iter().map(|row| row.name.as_str()).collect();
    assert_eq!(names, ["urban15", "average"]);
    assert!(rivals.rows.iter().all(|row| row.figures.iter().all(Option::is_some)));
    let recomputed = rivals.paper_rows.last().expect("the paper's rows");
    assert_eq!(recomputed.figures[1], Some(9.0), "printed: 10");
    assert!(rivals.notes[0].contains("15.7 and 9.0, printed are 22 and 10"), "{:?}", rivals.notes);
    let later = titled("Table V:");
    assert_eq!(later.title, "Table V: average ATE on newly released sequences, 1 sequences, m");
    for table in [rivals, later] {
        assert!(table.notes.iter().any(|note| note.contains("trained on simulated")), "{:?}", table.notes);
        assert!(table.notes.iter().any(|note| note.contains("prediction minus")), "{:?}", table.notes);
    }
}

#[test]
fn json_and_tables_of_simulated_sequences() {
    let results = Results::new(["k", "n"].map(|name| errors(&sequence(name, 60))).into());
    let json = serde_json::to_value(&results).unwrap();
    assert_eq!(json["simulated"], true);
    for method in ["raw", "static", "fir", "vqf", "gyronet", "fog", "fog_earth"] {
        for error in ["mean_1s_rad", "final_rad", "ate_m", "aligned_ate_m"] {
            assert!(json["sequences"][1]["methods"][method][error].is_f64(), "{method} {error}");
            let mean = json["mean"][method][error].as_f64().unwrap();
            let each = [0, 1].map(|k| json["sequences"][k]["methods"][method][error].as_f64().unwrap());
            assert!((mean - (each[0] + each[1]) / 2.0).abs() < 1e-12);
        }
    }
    assert!(json["sequences"][0]["methods"].get("vendor").is_none(), "a simulation has no vendor");
    assert!((json["gyronet_to_static"].as_f64().unwrap() - 1.0).abs() < 0.01);

    let tables = table::tables(&results);
    let titles: Vec<&str> = tables.iter().map(|table| table.title.split(':').next().unwrap()).collect();
    assert_eq!(titles, ["Table I", "Table II"], "no FoGNet, no Table IV");
    for table in &tables {
        assert!(table.to_string().lines().next().unwrap().ends_with("(simulated)"));
        let columns = table.columns.len();
        assert!(table.rows.iter().all(|row| row.figures.len() == columns), "{}", table.title);
        let columns = table.paper_columns.len();
        assert!(table.paper_rows.iter().all(|row| row.figures.len() == columns), "{}", table.title);
    }
}
