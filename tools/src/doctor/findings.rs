//! The findings on a recording.

use super::allan::{Allan, Noise};
use super::recording::Rows;
use super::wheels::{self, Pair};
use crate::drive::error::DataError;
use crate::drive::recording::{Recording, WHEEL_STANDS};
use crate::drive::replay::Replay;
use crate::drive::{DT, wheel_frames};
use crate::evaluate::ablation::Uncorrected;
use crate::import::align;
use gyronet::pipeline::PipelineConfig;
use std::path::Path;

/// Rows in which static initialisation is over.
const STARTED: usize = 400;
/// Samples of a second.
const SECOND: usize = 100;
/// A gap is longer than this, s.
const GAP: f64 = 0.015;
/// Samples at the very same extreme in a row that look like a limit.
const CLIPPED_RUN: usize = 3;
/// Equal samples in a row on all axes that look stuck.
const STUCK_RUN: usize = 5;
/// A second is at rest where its gyro scatters by less than this many times its quietest second, and by at most as much,
/// rad/s, as static initialisation takes on three axes.
const QUIET: (f64, f64) = (2.5, 0.0866);
/// The same for the mean of the yaw rate against that of the longest standstill, rad/s.
const RESTING_RATE: f64 = 0.01;
/// Standstill that a noise figure needs, s.
const NOISE_S: f64 = 10.0;
/// Turn that counts, rad.
const TURN: f64 = std::f64::consts::FRAC_PI_4;
/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.806_65;

/// How a finding is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As it should be.
    Good,
    /// Worth knowing.
    Note,
    /// To be cured before results are trusted.
    Bad,
}

/// One finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The subject.
    pub what: &'static str,
    /// How it is meant.
    pub verdict: Verdict,
    /// One sentence with its numbers.
    pub text: String,
}

/// How the sensor is mounted, by gravity at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    /// Degrees.
    pub roll_deg: f64,
    /// Degrees.
    pub pitch_deg: f64,
    /// Length of the specific force, m/s^2.
    pub force: f64,
}

/// A recording examined.
#[derive(Debug)]
pub struct Doctor {
    /// Its name.
    pub name: String,
    /// From the first row to the last, s.
    pub seconds: f64,
    /// The findings.
    pub findings: Vec<Finding>,
    /// Standstills: from and to, s.
    pub standstills: Vec<(f64, f64)>,
    /// Allan deviations of the gyro about x, y and z in the longest standstill.
    pub allan: Option<[Allan; 3]>,
    /// Their figures.
    pub noise: Option<[Option<Noise>; 3]>,
    /// The mounting.
    pub mounting: Option<Mounting>,
    /// Yaw rate over time, rad/s, for the picture: the gyro's and the reference's.
    pub curves: [Vec<(f64, f64)>; 2],
}

impl Doctor {
    /// Examines a recording.
    ///
    /// # Errors
    /// [`DataError`]: the file is no drive at all.
    pub fn examine(path: &Path) -> Result<Self, DataError> {
        let mut doctor = Self::of(&Rows::read(path)?);
        // What a drive does to static initialisation, the pipeline itself says.
        let start = Recording::read(path).map_err(|error| error.to_string()).and_then(|mut recording| {
            recording.rows.truncate(STARTED);
            let run = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Uncorrected, || {});
            run.map(|_| ()).map_err(|error| error.to_string())
        });
        let (verdict, text) = match start {
            Ok(()) => (Verdict::Good, "Static initialisation succeeds.".to_owned()),
            Err(reason) => {
                (Verdict::Bad, format!("{reason}; `gyronet import --from` leaves out a beginning."))
            }
        };
        doctor.findings.insert(0, Finding { what: "start", verdict, text });
        Ok(doctor)
    }

    fn of(rows: &Rows) -> Self {
        let mut findings = Vec::new();
        let mut say = |what, verdict, text| findings.push(Finding { what, verdict, text });
        let seconds = rows.seconds.last().copied().unwrap_or_default();
        rate_and_gaps(rows, &mut say);
        saturation(rows, &mut say);
        let standstills = standstills(rows);
        standing(rows, &standstills, &mut say);
        let longest = standstills.iter().copied().max_by(|a, b| (a.1 - a.0).cmp(&(b.1 - b.0)));
        let at_rest = longest.filter(|(from, to)| (to - from) as f64 * DT >= NOISE_S);
        let allan = at_rest.map(|(from, to)| {
            std::array::from_fn(|axis| {
                let rates: Vec<f64> = rows.rate[from..to].iter().map(|rate| rate[axis]).collect();
                Allan::new(&rates)
            })
        });
        let noise = allan.as_ref().map(|allan: &[Allan; 3]| [0, 1, 2].map(|axis: usize| allan[axis].noise()));
        noise_text(noise.as_ref(), longest, &mut say);
        say(
            "temperature",
            Verdict::Note,
            "Not a column of a drive: a bias that follows temperature cannot be told from one that drifts."
                .to_owned(),
        );
        let mounting = longest.and_then(|(from, to)| mounting(&rows.force[from..to]));
        mounting_text(mounting, &mut say);
        wheels_text(rows, &mut say);
        reference(rows, longest, &mut say);
        can_be_judged(rows, &standstills, &mut say);
        let to_seconds = |at: usize| rows.seconds[at.min(rows.len() - 1)];
        let curve = |of: &dyn Fn(usize) -> Option<f64>| {
            (0..rows.len()).filter_map(|k| Some((rows.seconds[k], of(k)?))).collect()
        };
        Self {
            name: rows.name.clone(),
            seconds,
            standstills: standstills.iter().map(|(from, to)| (to_seconds(*from), to_seconds(*to))).collect(),
            allan,
            noise,
            mounting,
            curves: [curve(&|k| Some(rows.rate[k][2])), curve(&|k| rows.reference[k])],
            findings,
        }
    }

    /// The finding on a subject.
    #[must_use]
    pub fn finding(&self, what: &str) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.what == what)
    }
}

fn rate_and_gaps(rows: &Rows, say: &mut impl FnMut(&'static str, Verdict, String)) {
    let mut periods: Vec<f64> = rows.seconds.windows(2).map(|pair| pair[1] - pair[0]).collect();
    periods.sort_unstable_by(f64::total_cmp);
    let (Some(median), Some(longest)) = (periods.get(periods.len() / 2), periods.last()) else {
        return say("rate", Verdict::Bad, "No two rows can be read.".to_owned());
    };
    let hz = 1.0 / median;
    let off = (hz - 100.0).abs() > 20.0;
    let how = if off { ": other commands refuse it, `gyronet import` brings any rate to 100 Hz" } else { "" };
    say(
        "rate",
        if off { Verdict::Bad } else { Verdict::Good },
        format!("{hz:.2} Hz by the median period{how}."),
    );
    let gaps = periods.iter().filter(|period| **period > GAP).count();
    let missing: f64 =
        periods.iter().map(|period| (period / DT).round() - 1.0).filter(|missing| *missing > 0.0).sum();
    match gaps {
        _ if off => {}
        0 => say("gaps", Verdict::Good, "None.".to_owned()),
        _ => {
            let share = missing / (missing + rows.len() as f64);
            let verdict = if share > 0.01 || *longest > 1.0 { Verdict::Bad } else { Verdict::Note };
            say(
                "gaps",
                verdict,
                format!(
                    "{gaps} with {missing:.0} missing rows ({:.2} %), the longest {longest:.2} s.",
                    100.0 * share
                ),
            );
        }
    }
    if rows.bad > 0 {
        let first = rows.first_bad.as_deref().unwrap_or("more than a day");
        say("unreadable rows", Verdict::Bad, format!("{}; the first: {first}.", rows.bad));
    }
}

fn saturation(rows: &Rows, say: &mut impl FnMut(&'static str, Verdict, String)) {
    for (what, values, unit, scale) in [
        ("gyro range", &rows.rate, "deg/s", 180.0 / std::f64::consts::PI),
        ("accelerometer range", &rows.force, "m/s^2", 1.0),
    ] {
        let largest = values.iter().flatten().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let at_limit = (0..3)
            .map(|axis| {
                runs(
                    values,
                    |a, b| a[axis] == b[axis] && a[axis].abs() >= 0.999 * largest && largest > 0.0,
                    CLIPPED_RUN,
                )
            })
            .sum::<usize>();
        match at_limit {
            0 => {
                say(what, Verdict::Good, format!("At most {:.1} {unit}, no run at a limit.", scale * largest))
            }
            count => say(
                what,
                Verdict::Bad,
                format!(
                    "{count} samples at the limit of {:.1} {unit}, several in a row: the range is too small.",
                    scale * largest
                ),
            ),
        }
    }
    let both: Vec<([f64; 3], [f64; 3])> = rows.rate.iter().copied().zip(rows.force.iter().copied()).collect();
    let stuck = runs(&both, |a, b| a == b, STUCK_RUN);
    if stuck > 0 {
        say(
            "stuck samples",
            Verdict::Bad,
            format!("{stuck} samples repeat the one before on all six axes, {STUCK_RUN} or more in a row."),
        );
    }
}

/// Elements in runs of at least so many that are alike.
fn runs<T>(values: &[T], alike: impl Fn(&T, &T) -> bool, least: usize) -> usize {
    values.chunk_by(|a, b| alike(a, b)).filter(|run| run.len() >= least).map(<[T]>::len).sum()
}

/// Whole seconds at rest, joined, as ranges of rows: quiet by the gyro, and by the wheels where there are any.
fn standstills(rows: &Rows) -> Vec<(usize, usize)> {
    let spread = |span: &[[f64; 3]]| {
        let axis = |axis: usize| {
            let mean = span.iter().map(|v| v[axis]).sum::<f64>() / span.len() as f64;
            span.iter().map(|v| (v[axis] - mean).powi(2)).sum::<f64>() / span.len() as f64
        };
        (axis(0) + axis(1) + axis(2)).sqrt()
    };
    let spreads: Vec<f64> = rows.rate.chunks_exact(SECOND).map(spread).collect();
    let mut sorted = spreads.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(quietest) = sorted.get(sorted.len() / 100) else { return Vec::new() };
    let limit = (QUIET.0 * quietest).min(QUIET.1);
    let mean_rate = |second: usize| {
        rows.rate[second * SECOND..(second + 1) * SECOND].iter().map(|rate| rate[2]).sum::<f64>()
            / SECOND as f64
    };
    let wheels_rest = |second: usize| {
        rows.wheels.iter().all(|wheel| {
            let span = &wheel[second * SECOND..(second + 1) * SECOND];
            let known = || span.iter().flatten();
            known().sum::<f64>().abs() / known().count().max(1) as f64 <= WHEEL_STANDS
        })
    };
    let quiet: Vec<bool> = (0..spreads.len()).map(|k| spreads[k] <= limit && wheels_rest(k)).collect();
    // A slow turn is as quiet as a rest: its mean is not that of most quiet seconds.
    let mut means: Vec<f64> = (0..quiet.len()).filter(|k| quiet[*k]).map(mean_rate).collect();
    means.sort_unstable_by(f64::total_cmp);
    let Some(bias) = means.get(means.len() / 2).copied() else { return Vec::new() };
    let rests = |k: usize| quiet[k] && (mean_rate(k) - bias).abs() < RESTING_RATE;
    let mut standstills: Vec<(usize, usize)> = Vec::new();
    for k in (0..quiet.len()).filter(|k| rests(*k)) {
        match standstills.last_mut() {
            Some((_, to)) if *to == k * SECOND => *to += SECOND,
            _ => standstills.push((k * SECOND, (k + 1) * SECOND)),
        }
    }
    standstills
}

fn standing(
    rows: &Rows,
    standstills: &[(usize, usize)],
    say: &mut impl FnMut(&'static str, Verdict, String),
) {
    let total = standstills.iter().map(|(from, to)| to - from).sum::<usize>() as f64 * DT;
    let longest = standstills.iter().map(|(from, to)| to - from).max().unwrap_or_default() as f64 * DT;
    let by =
        if rows.wheels.iter().flatten().any(Option::is_some) { "gyro and wheels" } else { "the gyro alone" };
    let text = format!("{} by {by}, {total:.0} s together, the longest {longest:.0} s.", standstills.len());
    say("standstills", if total > 0.0 { Verdict::Good } else { Verdict::Note }, text);
}

fn noise_text(
    noise: Option<&[Option<Noise>; 3]>,
    longest: Option<(usize, usize)>,
    say: &mut impl FnMut(&'static str, Verdict, String),
) {
    let Some([_, _, Some(Noise { random_walk, instability })]) = noise else {
        let seconds = longest.map_or(0.0, |(from, to)| (to - from) as f64 * DT);
        return say(
            "gyro noise",
            Verdict::Note,
            format!("Not read off: the longest standstill has {seconds:.0} s, it takes {NOISE_S:.0}."),
        );
    };
    let walk = random_walk.to_degrees() * 60.0;
    let bottom = match instability {
        Some((rate, tau)) => {
            format!("bias instability {:.2} deg/h at {tau:.0} s", rate.to_degrees() * 3_600.0)
        }
        None => "no bottom yet, so no bias instability: it takes a longer standstill".to_owned(),
    };
    say(
        "gyro noise",
        Verdict::Note,
        format!(
            "About z: angular random walk {walk:.3} deg/sqrt(h), {bottom}; the engine's vibration included."
        ),
    );
}

fn mounting(force: &[[f64; 3]]) -> Option<Mounting> {
    let [x, y, z] =
        [0, 1, 2].map(|axis: usize| force.iter().map(|force| force[axis]).sum::<f64>() / force.len() as f64);
    let length = (x * x + y * y + z * z).sqrt();
    (length > 0.1).then(|| Mounting {
        roll_deg: y.atan2(z).to_degrees(),
        pitch_deg: (-x).atan2(y.hypot(z)).to_degrees(),
        force: length,
    })
}

fn mounting_text(mounting: Option<Mounting>, say: &mut impl FnMut(&'static str, Verdict, String)) {
    let Some(Mounting { roll_deg, pitch_deg, force }) = mounting else {
        return say("mounting", Verdict::Note, "No standstill to see gravity at.".to_owned());
    };
    let tilt = roll_deg.abs().max(pitch_deg.abs());
    let length =
        format!("specific force {force:.3} m/s^2, {:+.2} % of gravity", 100.0 * (force / GRAVITY - 1.0));
    let angles = format!("roll {roll_deg:+.1} deg, pitch {pitch_deg:+.1} deg, {length}");
    if (force / GRAVITY - 1.0).abs() > 0.1 {
        say("mounting", Verdict::Bad, format!("{angles}: the unit of the accelerometer is not m/s^2."));
    } else if tilt > 60.0 {
        say(
            "mounting",
            Verdict::Bad,
            format!("{angles}: z is not up; name the mounting in the vehicle file."),
        );
    } else if tilt > 15.0 {
        say(
            "mounting",
            Verdict::Note,
            format!("{angles}: beyond 15 deg the board levels by itself, better name it."),
        );
    } else {
        say("mounting", Verdict::Good, format!("{angles}. Gravity does not show the yaw angle."));
    }
}

fn wheels_text(rows: &Rows, say: &mut impl FnMut(&'static str, Verdict, String)) {
    let known = rows.wheels.iter().filter(|wheel| wheel.iter().any(Option::is_some)).count();
    if known == 0 {
        return say("wheels", Verdict::Note, "None: no zero-rate updates by wheels, no speed.".to_owned());
    }
    let Some(Pair { slope, correlation, offset }) = wheels::compare(rows) else {
        return say(
            "wheels",
            Verdict::Note,
            format!("{known}; no axle with both wheels turns enough to be held against the gyro."),
        );
    };
    let track = slope * wheel_frames::RADIUS;
    let text = format!(
        "{known}; left and right against the gyro: correlation {correlation:.3}, track {track:.2} m at a radius of {} m, offset {offset:+.3} rad/s",
        wheel_frames::RADIUS
    );
    if correlation > 0.9 && (0.2..4.0).contains(&track) {
        say("wheels", Verdict::Good, format!("{text}."));
    } else if correlation < -0.9 {
        say("wheels", Verdict::Bad, format!("{text}: left and right are swapped, or z is down."));
    } else {
        say("wheels", Verdict::Note, format!("{text}: good for standstill and speed, not for the yaw rate."));
    }
}

fn reference(
    rows: &Rows,
    longest: Option<(usize, usize)>,
    say: &mut impl FnMut(&'static str, Verdict, String),
) {
    let rate: Vec<(f64, f64)> =
        (0..rows.len()).filter_map(|k| Some((rows.seconds[k], rows.reference[k]?))).collect();
    let courses = rows.course.iter().flatten().count();
    let gyro: Vec<(f64, f64)> =
        rows.seconds.iter().zip(&rows.rate).map(|(seconds, rate)| (*seconds, rate[2])).collect();
    if rate.is_empty() && courses == 0 {
        return say(
            "reference",
            Verdict::Note,
            "None: nothing can be judged on it, and nothing trained.".to_owned(),
        );
    }
    if rate.is_empty() {
        let known: Vec<(f64, f64)> =
            (0..rows.len()).filter_map(|k| Some((rows.seconds[k], rows.course[k]?))).collect();
        let change = |pair: &[(f64, f64)]| {
            let seconds = pair[1].0 - pair[0].0;
            let turn = (pair[1].1 - pair[0].1 + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                - std::f64::consts::PI;
            (seconds < 2.0).then(|| (0.5 * (pair[0].0 + pair[1].0), turn / seconds))
        };
        let change: Vec<(f64, f64)> = known.windows(2).filter_map(change).collect();
        return match align::offset(&gyro, &change) {
            Ok(align::Offset { seconds, coefficient }) => say(
                "reference",
                if seconds.abs() < 0.5 { Verdict::Good } else { Verdict::Note },
                format!(
                    "A course, {courses} values; its change agrees with the gyro (correlation {coefficient:.3}), {:.0} ms late.",
                    -1e3 * seconds
                ),
            ),
            Err(reason) => say(
                "reference",
                Verdict::Note,
                format!("A course, {courses} values; not laid on the gyro: {reason}."),
            ),
        };
    }
    let share = 100.0 * rate.len() as f64 / rows.len() as f64;
    let noise = longest.map(|(from, to)| {
        let seconds: Vec<f64> = rows.reference[from..to]
            .chunks_exact(SECOND)
            .map(|s| s.iter().flatten().sum::<f64>() * DT)
            .collect();
        let mean = seconds.iter().sum::<f64>() / seconds.len() as f64;
        let variance = seconds.iter().map(|angle| (angle - mean).powi(2)).sum::<f64>() / seconds.len() as f64;
        format!("; at rest it scatters by {:.6} rad in 1 s: smaller errors cannot be seen", variance.sqrt())
    });
    let noise = noise.unwrap_or_default();
    match align::offset(&gyro, &rate) {
        Ok(align::Offset { seconds, coefficient }) => {
            let late = if seconds.abs() < 0.015 { Verdict::Good } else { Verdict::Bad };
            say(
                "reference",
                late,
                format!(
                    "A yaw rate in {share:.0} % of the rows, correlation with the gyro {coefficient:.4}, {:+.1} ms late{noise}.",
                    -1e3 * seconds
                ),
            );
        }
        Err(reason) => say(
            "reference",
            Verdict::Bad,
            format!("A yaw rate in {share:.0} % of the rows that does not fit the gyro: {reason}{noise}."),
        ),
    }
}

fn can_be_judged(
    rows: &Rows,
    standstills: &[(usize, usize)],
    say: &mut impl FnMut(&'static str, Verdict, String),
) {
    let bias = standstills.first().map_or(0.0, |(from, to)| {
        rows.rate[*from..*to].iter().map(|rate| rate[2]).sum::<f64>() / (to - from) as f64
    });
    let (mut turned, mut turns, mut angle, mut last) = (0.0, 0, 0.0f64, 0.0f64);
    for second in rows.rate.chunks(SECOND) {
        let step = second.iter().map(|rate| rate[2] - bias).sum::<f64>() * DT;
        turned += step.abs();
        // A turn goes on while its direction does.
        if step.abs() < 0.02 || step * last < 0.0 {
            turns += usize::from(angle.abs() > TURN);
            angle = 0.0;
        }
        angle += step;
        last = step;
    }
    turns += usize::from(angle.abs() > TURN);
    let seconds = rows.len() as f64 * DT;
    let stops = standstills.iter().skip(1).count();
    let mut lacks = Vec::new();
    if turned < 6.0 {
        lacks.push("gain and mounting (few turns)");
    }
    if stops == 0 {
        lacks.push("zero-rate updates (no later stop)");
    }
    if seconds < 300.0 {
        lacks.push("drift over minutes (too short)");
    }
    if !rows.reference.iter().any(Option::is_some) {
        lacks.push("errors of 1 s and 10 s (no reference rate)");
    }
    let lacks = if lacks.is_empty() { "nothing".to_owned() } else { lacks.join(", ") };
    say(
        "what it can judge",
        Verdict::Note,
        format!(
            "{turns} turns of more than 45 deg, {turned:.1} rad turned in all, {stops} later stops, {seconds:.0} s. It cannot judge: {lacks}."
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::recording::Reader;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use std::fmt::Write;

    /// A car at rest for 20 s, in turns for 40 s, at rest again for 20 s; `edit` changes a row's time, force, rate, wheels
    /// 2 and 4, and reference.
    fn doctor(edit: impl Fn(usize, &mut [f64; 10]) -> bool) -> Doctor {
        let (mut random, normal) = (ChaCha8Rng::seed_from_u64(1), Normal::new(0.0, 0.002).unwrap());
        let mut text =
            String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel2_rate,wheel4_rate,ref_gyr_z\n");
        for k in 0..8_000 {
            let time = 0.01 * k as f64;
            let moves = (2_000..6_000).contains(&k);
            let yaw = if moves { 0.4 * (0.21 * time).sin() * (0.05 * time + 0.4).cos() } else { 0.0 };
            let speed = if moves { 20.0 } else { 0.0 };
            let mut noise = || normal.sample(&mut random);
            let shakes = if moves { 10.0 } else { 1.0 };
            let mut row = [
                time,
                0.17 + noise(),
                noise(),
                9.8 + noise(),
                shakes * noise(),
                shakes * noise(),
                yaw + 0.01 + shakes * noise(),
                speed + 2.5 * yaw,
                speed - 2.5 * yaw,
                yaw,
            ];
            if edit(k, &mut row) {
                writeln!(text, "{}", row.map(|value| format!("{value:.6}")).join(",")).unwrap();
            }
        }
        let reader = Reader::new("made.csv", text.as_bytes()).unwrap();
        Doctor::of(&Rows::parse("made", reader).unwrap())
    }

    fn found<'d>(doctor: &'d Doctor, what: &str) -> (Verdict, &'d str) {
        let finding = doctor.finding(what).unwrap_or_else(|| panic!("{what}: {:?}", doctor.findings));
        (finding.verdict, &finding.text)
    }

    #[test]
    fn a_good_recording_has_nothing_to_cure() {
        let doctor = doctor(|_, _| true);
        assert!(
            doctor.findings.iter().all(|finding| finding.verdict != Verdict::Bad),
            "{:?}",
            doctor.findings
        );
        assert_eq!(doctor.standstills.len(), 2);
        let Some(Mounting { pitch_deg, .. }) = doctor.mounting else { panic!() };
        assert!((pitch_deg + 1.0).abs() < 0.05, "{pitch_deg}");
        let Some([.., Some(noise)]) = doctor.noise else { panic!() };
        // 0.002 rad/s at 100 Hz.
        assert!((noise.random_walk / 2e-4 - 1.0).abs() < 0.15, "{noise:?}");
        let (verdict, wheels) = found(&doctor, "wheels");
        assert!(verdict == Verdict::Good && wheels.contains("track 1.44 m"), "{wheels}");
        let (verdict, reference) = found(&doctor, "reference");
        assert!(verdict == Verdict::Good && reference.contains("ms late"), "{reference}");
    }

    #[test]
    fn each_defect_is_found() {
        let bad = |what: &str, text: &str, edit: &dyn Fn(usize, &mut [f64; 10]) -> bool| {
            let doctor = doctor(edit);
            let (verdict, found) = found(&doctor, what);
            assert!(verdict == Verdict::Bad && found.contains(text), "{what}: {found}");
        };
        bad("gaps", "1 with 150 missing rows", &|k, _| !(3_000..3_150).contains(&k));
        bad("gyro range", "samples at the limit of 11.5 deg/s", &|_, row| {
            row[6] = row[6].clamp(-0.2, 0.2);
            true
        });
        bad("stuck samples", "12 samples repeat", &|k, row| {
            if (4_000..4_012).contains(&k) {
                row[1..7].fill(0.5);
            }
            true
        });
        bad("rate", "50.00 Hz", &|k, _| k % 2 == 0);
        bad("unreadable rows", "time goes backwards", &|k, row| {
            row[0] -= if k == 500 { 1.0 } else { 0.0 };
            true
        });
        bad("mounting", "z is not up", &|_, row| {
            row[3] = -row[3];
            true
        });
        bad("mounting", "is not m/s^2", &|_, row| {
            row[1..4].iter_mut().for_each(|force| *force /= 9.8);
            true
        });
        bad("wheels", "swapped", &|_, row| {
            row.swap(7, 8);
            true
        });
        bad("reference", "does not fit the gyro", &|k, row| {
            row[9] = (0.3 * row[0] + 1e-4 * k as f64 * row[0]).sin();
            true
        });
    }
}
