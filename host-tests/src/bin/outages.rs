//! The heading after a loss of GNSS on every recording that has a course, in `$GYRONET_DATA`, and where gyronet is worse than
//! zero-rate updates by more than 5 % and 0.1 deg, in the median or at 90 %.
//!
//! Of three sets the course is made here. On `real_car` and `rc_car` it is the GNSS reference, until each outage begins. On
//! `kingston2008`, whose reference knows east and north velocity, it is their direction; its rows are brought from 10 to
//! 100 Hz, and it is run by the numbers of a MEMS part and by those of its ring lasers.

use gyronet::model::GyroNet;
use gyronet::pipeline::PipelineConfig;
use gyronet_host_tests::kingston::{HG1700, at, table};
use gyronet_host_tests::recordings::{drives, folder};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::methods::Method;
use gyronet_tools::evaluate::outage::{EVERY_S, run};
use gyronet_tools::evaluate::outage_table::Outages;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Lengths of the outages, s.
const LENGTHS: [usize; 3] = [30, 60, 120];
/// Accuracy of the RC car's RTK course, rad.
const RTK: f64 = 0.02;
/// Slowest speed with a direction of the velocity, m/s.
const SLOWEST: f64 = 1.0;

type Set = (&'static str, PipelineConfig, Vec<PathBuf>);

fn sets(made: &Path) -> Vec<Set> {
    let ours = PipelineConfig::DEFAULT;
    let of = |set: &str| drives(&folder().join(set));
    let mut sets: Vec<Set> = ["utv", "car_mti710", "truck", "wid_car"].map(|set| (set, ours, of(set))).into();
    for (set, sigma) in [("rc_car", Some(RTK)), ("real_car", None)] {
        sets.push((set, ours, of(set).iter().map(|drive| by_reference(drive, sigma, made)).collect()));
    }
    let kingston = kingston(&folder().join("kingston2008"), made);
    sets.push(("kingston2008", ours, kingston.clone()));
    sets.push(("kingston2008 by its data sheet", ours.with_gyro(&HG1700), kingston));
    sets
}

/// Writes a drive whose reference is its course, too.
fn by_reference(drive: &Path, sigma: Option<f64>, made: &Path) -> PathBuf {
    let text = std::fs::read_to_string(drive).expect("a drive");
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let [yaw, speed] = ["ref_yaw", "speed"].map(|name| head.iter().position(|own| *own == name).expect(name));
    let mut out = format!("{},course,gnss_speed,course_sigma\n", head.join(","));
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let course =
            fields[yaw].parse::<f64>().map(|yaw| format!("{:.6},{}", (-yaw).rem_euclid(TAU), fields[speed]));
        let sigma = sigma.filter(|_| course.is_ok()).map(|sigma| sigma.to_string()).unwrap_or_default();
        writeln!(out, "{line},{},{sigma}", course.unwrap_or_else(|_| ",".into())).expect("a string");
    }
    let path = made.join(drive.file_name().expect("a file"));
    std::fs::write(&path, out).expect("a temporary file");
    path
}

/// Writes the hour in Kingston as a drive; nothing without its folder.
fn kingston(folder: &Path, made: &Path) -> Vec<PathBuf> {
    if !folder.is_dir() {
        return Vec::new();
    }
    let [imu, fixes] = ["imu_10hz.csv", "reference_1hz.csv"].map(|name| table(&folder.join(name)));
    let end = imu.last().expect("rows")[0].min(fixes.last().expect("rows")[0]);
    let mut fixes = fixes.iter().filter(|fix| fix[0] >= 0.0).peekable();
    let mut out = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_yaw,course,gnss_speed\n".to_owned();
    for step in 0..=(end * 100.0) as u32 {
        let now = 0.01 * f64::from(step);
        write!(out, "{now:.2}").expect("a string");
        (1..=6).for_each(|column| write!(out, ",{:.8}", at(&imu, column, now)).expect("a string"));
        let fix = fixes.next_if(|fix| (100.0 * fix[0]).round() <= f64::from(step));
        let known = fix.map_or(",,,".into(), |fix| {
            let (east, north, speed) = (fix[4], fix[5], fix[4].hypot(fix[5]));
            let course = format!("{:.6},{speed:.3}", east.atan2(north).rem_euclid(TAU));
            let course = if speed > SLOWEST { course } else { format!(",{speed:.3}") };
            format!(",{:.6},{course}", -fix[9].to_radians())
        });
        writeln!(out, "{known}").expect("a string");
    }
    let path = made.join("hour.csv");
    std::fs::write(&path, out).expect("a temporary file");
    vec![path]
}

/// Prints each length at which gyronet breaks the promise.
fn judge(table: &Outages) {
    for (after, lengths) in [(60, &table.outage), (20, &table.outage_after_20_s)] {
        for (length, methods) in lengths {
            let [theirs, ours] = [Method::STATIC_ZERO_RATE, Method::DELAYED].map(|one| methods.get(one.key));
            let Some((theirs, ours)) = theirs.zip(ours) else { continue };
            let (them, us, starts) = (theirs.heading_deg, ours.heading_deg, ours.starts);
            for (what, them, us) in [("median", them.median, us.median), ("90 %", them.p90, us.p90)] {
                // Of fewer starts it is the worst one.
                if us - them > (0.05 * them).max(0.1) && (what == "median" || starts >= 10) {
                    let set = &table.set;
                    println!(
                        "WORSE: {set}: {length} s after {after} s, {what} of {starts}: {them:.2} -> {us:.2} deg"
                    );
                }
            }
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let made = tempfile::tempdir()?;
    let sets = sets(made.path());
    if sets.iter().all(|(_, _, files)| files.is_empty()) {
        return Err(format!("no recordings in {}", folder().display()).into());
    }
    for (name, ours, files) in sets {
        let mut drives = Vec::new();
        for file in &files {
            let (mut network, drive) = (GyroNet::shipped()?, Drive::open_moving(file)?);
            drives.push(run(&drive, &mut network, &LENGTHS, EVERY_S, ours, || {})?.0);
        }
        let table = Outages::new(name, &LENGTHS, drives.iter().map(Vec::as_slice));
        print!("{table}");
        judge(&table);
        for (file, drive) in files.iter().zip(&drives).filter(|_| files.len() > 1) {
            let name = format!("{name}, {}", file.file_stem().unwrap_or_default().display());
            judge(&Outages::new(&name, &LENGTHS, std::iter::once(drive.as_slice())));
        }
    }
    Ok(())
}
