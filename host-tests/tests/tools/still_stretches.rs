//! The limits of static initialisation against real drives: every stretch of three seconds in
//! which no wheel turns is accepted although the engine runs, and those that are driven are
//! refused, as far as inertial sensors alone can tell.

use gyronet::bias::{STATIC_SAMPLES, StaticConfig, StaticInit};
use gyronet_host_tests::recordings;
use gyronet_tools::drive::recording::{Recording, Row};

const TRIALS: [u32; 8] = [2, 3, 4, 6, 7, 8, 9, 11];
/// Samples from one stretch to the next.
const STEP: usize = 25;
/// rad/s: what the wheel sensors show at standstill, and what no standing wheel shows.
const STANDS: f64 = 0.15;
const TURNS: f64 = 0.5;
/// The share of the driven stretches that must be noticed.
const NOTICED: f64 = 0.9;

/// Mean of the wheels that were recorded, rad/s.
fn wheels(row: &Row) -> f64 {
    let rates: Vec<f64> = row.wheels.iter().flatten().map(|rate| rate.abs()).collect();
    rates.iter().sum::<f64>() / rates.len() as f64
}

fn accepted(rows: &[Row]) -> bool {
    let mut init = StaticInit::new(StaticConfig::DEFAULT);
    let results: Vec<bool> = rows
        .iter()
        .filter_map(|row| init.add(&row.sample, false, false))
        .map(|result| result.is_ok())
        .collect();
    assert_eq!(results.len(), 1);
    results[0]
}

#[test]
fn static_initialisation_tells_rest_from_driving_on_real_drives() {
    let Some(paths) = recordings::trials(&TRIALS) else { return };
    let (mut still, mut refused_still, mut driven, mut refused_driven) = (0, 0, 0, 0);
    for path in paths {
        let recording = Recording::read(&path).expect("a recording");
        for stretch in recording.rows.windows(STATIC_SAMPLES as usize).step_by(STEP) {
            if stretch.iter().all(|row| wheels(row) < STANDS) {
                still += 1;
                refused_still += usize::from(!accepted(stretch));
            } else if stretch.iter().all(|row| wheels(row) > TURNS) {
                driven += 1;
                refused_driven += usize::from(!accepted(stretch));
            }
        }
    }
    println!("still: {refused_still} of {still} refused; driven: {refused_driven} of {driven} refused");
    assert!(still > 100 && driven > 1_000, "{still} still, {driven} driven");
    assert_eq!(refused_still, 0);
    assert!(f64::from(refused_driven as u32) >= NOTICED * f64::from(driven as u32));
}
