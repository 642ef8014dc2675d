//! Each situation once: no promise is broken.

mod judge;

use gyronet_host_tests::situations::judge::HEADING;
use gyronet_host_tests::situations::list::{self, Situation};
use gyronet_host_tests::situations::vehicle::Vehicle;
use gyronet_host_tests::{parallel, recordings, situations};

#[test]
fn no_situation_is_wrong_and_good() {
    let situations: Vec<&Situation> = list::all().collect();
    parallel::table(HEADING, &situations, |situation| judged(situation, &situation.vehicles[0], 1));
}

/// The line of a table, and the promises that were broken.
fn judged(situation: &Situation, vehicle: &Vehicle, seed: u64) -> (String, Vec<String>) {
    let outcome = situation.run(vehicle, seed);
    let failed = outcome.broken().into_iter().map(|(_, text)| format!("{}: {text}", situation.name));
    (outcome.line(situation.name, vehicle.name), failed.collect())
}

/// Situations, vehicles and seeds in which an earlier version was good and off by more than four sigma.
const CURED: &[(&str, &str, u64)] = &[
    ("shuttle train", "truck", 2),
    ("start on a steep slope", "hatch", 3),
    ("car wash with a conveyor", "truck", 2),
    ("reversing", "bare", 1),
    ("bias steps after a knock", "utv", 1),
    ("bias steps after a knock", "van", 1),
    ("bias steps after a knock", "hatch", 4),
    ("sensor moved between two drives", "van", 2),
    ("serpentines of 15 %", "van", 5),
    ("parking garage spiral", "van", 5),
    ("bits flip on the line", "truck", 2),
    ("wheel frames frozen at zero on a motorway", "truck", 2),
    ("one small implausible reading", "van", 4),
    ("speed bumps", "car", 4),
    ("people board, the wind rocks", "bare", 1),
    ("banked test track", "utv", 1),
    ("washboard road", "utv", 1),
    ("two faults, drawn", "car", 201),
    ("bias steps after a knock", "utv", 326),
    ("one small implausible reading", "van", 303),
    ("mounted 5 deg askew", "van", 508),
    ("loading ramp", "van", 507),
    ("creeping from the start", "truck", 902),
];

#[test]
fn a_cured_pair_of_situation_and_vehicle_stays_within_four_sigma() {
    parallel::table(HEADING, CURED, |(name, vehicle, seed)| {
        let situation = list::all().find(|one| one.name == *name).expect("a situation of the list");
        let vehicle = situation.vehicles.iter().find(|one| one.name == *vehicle).expect("one of its own");
        judged(situation, vehicle, *seed)
    });
}

#[test]
fn a_recording_is_judged_by_its_reference() {
    if recordings::found("truck").is_none() {
        return;
    }
    let judged = situations::recordings::judged(&recordings::folder(), "truck/joined");
    assert_eq!(judged.len(), 2);
    for (name, outcome) in judged {
        assert_eq!(outcome.broken(), [], "{name}");
        assert!(outcome.good > 35 && outcome.second.ratio > 0.1, "{name}: {outcome:?}");
    }
}
