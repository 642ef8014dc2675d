//! Writes a simulated drive in the layout of [`crate::drive::recording`].

use super::gnss::Course;
use super::{Config, Sample, Simulation};
use gyronet::sample::RATE_HZ;
use std::io::{self, Write};

pub const HEADER: &str = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_x,ref_gyr_y,ref_gyr_z,\
                          wheel1_rate,wheel2_rate,wheel3_rate,wheel4_rate";

pub fn write(config: &Config, mut out: impl Write) -> io::Result<u32> {
    let temperature = if config.warming.is_some() { ",temp_c" } else { "" };
    let gnss = if config.gnss.is_some() { ",course,course_sigma,gnss_speed" } else { "" };
    writeln!(out, "{HEADER}{temperature}{gnss}")?;
    let samples = config.seconds * RATE_HZ;
    for sample in Simulation::new(config).take(samples as usize) {
        row(&sample, &mut out)?;
        match sample.course {
            Some(Course { course, sigma, speed }) => write!(out, ",{course:.5},{sigma:.5},{speed:.3}")?,
            None if config.gnss.is_some() => write!(out, ",,,")?,
            None => {}
        }
        writeln!(out)?;
    }
    out.flush()?;
    Ok(samples)
}

fn row(sample: &Sample, out: &mut impl Write) -> io::Result<()> {
    write!(out, "{:.2}", sample.seconds)?;
    let Sample { specific_force, angular_rate, reference, wheels, .. } = sample;
    for value in specific_force.iter().chain(angular_rate).chain(reference).chain(wheels) {
        // Adding zero makes a rounded -0 a 0.
        write!(out, ",{:.6}", (value * 1e6).round() / 1e6 + 0.0)?;
    }
    if let Some(celsius) = sample.celsius {
        write!(out, ",{celsius:.2}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::stream::Recording;
    use crate::simulate::gnss;
    use crate::simulate::warming::{self, Trip};
    use gyronet::heading::Heading;
    use gyronet::units::CentiCelsius;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn what_is_written_can_be_read() {
        let mut bytes = Vec::new();
        let config = Config { seconds: 20, seed: 4, ..Config::DEFAULT };
        assert_eq!(write(&config, &mut bytes).unwrap(), 2_000);
        let recording = Recording::parse("a.csv", &bytes[..]).unwrap();
        assert_eq!((recording.rows.len(), recording.missing), (2_000, 0));
        let sample = Simulation::new(&config).nth(1_234).unwrap();
        let row = recording.rows[1_234];
        assert!((row.sample.angular_rate[2].rad_per_sec() - sample.angular_rate[2]).abs() < 1e-6);
        assert!((row.reference.unwrap() - sample.reference[2]).abs() < 1e-6);
        assert!((row.wheels[3].unwrap() - sample.wheels[3]).abs() < 1e-6);
        assert_eq!((row.sample.temperature, sample.celsius), (None, None));
    }

    #[test]
    fn courses_come_late_and_not_in_outages() {
        let mut bytes = Vec::new();
        let gnss = Some(gnss::Config { latency_s: 1.5, spoofed_from_s: None });
        let config = Config { seconds: 600, gnss, ..Config::DEFAULT };
        write(&config, &mut bytes).unwrap();
        let recording = Recording::parse("a.csv", &bytes[..]).unwrap();
        let (mut heading, mut headings, mut used) = (0.0, Vec::new(), 0);
        for row in &recording.rows {
            heading += 0.01 * row.reference.unwrap();
            headings.push(heading);
            let Some(Heading { course: Some(course), course_sigma: Some(sigma), .. }) = row.heading else {
                continue;
            };
            let due = headings[headings.len() - 151];
            let off = (f64::from(course) + due + PI).rem_euclid(TAU) - PI;
            assert!(off.abs() < 5.0 * f64::from(sigma) + 1e-3, "{off} {sigma}");
            let seconds = headings.len() / 100;
            assert!(seconds >= 30 && seconds % 300 < 240);
            used += 1;
        }
        assert!(used > 300, "{used}");
    }

    #[test]
    fn a_trip_has_the_temperature_of_its_sensor() {
        let mut bytes = Vec::new();
        let warming = Some(warming::Config { trip: Trip::Town, device: 2 });
        let config = Config { seconds: 20, warming, ..Config::DEFAULT };
        write(&config, &mut bytes).unwrap();
        let recording = Recording::parse("a.csv", &bytes[..]).unwrap();
        let celsius = Simulation::new(&config).nth(1_234).unwrap().celsius.unwrap();
        let CentiCelsius(code) = recording.rows[1_234].sample.temperature.unwrap();
        assert!((f64::from(code) / 100.0 - celsius).abs() < 0.0051, "{code} {celsius}");
        let text = String::from_utf8(bytes).unwrap();
        let hot = text.lines().take(400).map(|line| line.to_owned() + "\n").collect::<String>()
            + "4.00,0,0,9.8,0,0,0,0,0,0,0,0,0,0,400\n";
        let error = Recording::parse("a.csv", hot.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("temp_c") && error.contains("out of range"), "{error}");
    }
}
