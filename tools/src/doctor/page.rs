//! Writes the page about an examined recording.

use super::{Allan, Doctor, Noise, Verdict};
use crate::plot::page::chart::{Chart, Curve};
use crate::plot::page::{HINT, document, escaped, table};

/// Class of each axis's curve in the style sheet, and the name of the axis.
const AXES: [(&str, &str); 3] = [("static", "x"), ("live", "y"), ("default", "z")];

pub fn page(doctor: &Doctor) -> String {
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"lead\">Examination of a recording of {:.0} s. Written by <code>gyronet \
         doctor</code> {}.</p>\n",
        escaped(&doctor.name),
        doctor.seconds,
        env!("CARGO_PKG_VERSION")
    );
    let count = |verdict| doctor.findings.iter().filter(|finding| finding.verdict == verdict).count();
    let bad = count(Verdict::Bad);
    let (class, word) = if bad == 0 { ("agrees", "none".to_owned()) } else { ("differs", bad.to_string()) };
    let still: f64 = doctor.standstills.iter().map(|(from, to)| to - from).sum();
    body += &format!(
        "<dl class=\"facts\">\n<div><dt>to be fixed</dt><dd><span class=\"{class}\">{word}</span></dd></div>\n\
         <div><dt>length</dt><dd>{:.0} <small>s</small></dd></div>\n<div><dt>at rest</dt><dd>{still:.0} <small>s</small></dd></div>\n{}</dl>\n",
        doctor.seconds,
        noise_facts(doctor)
    );
    body += "<h2>Findings</h2>\n<div class=\"scroll\"><table class=\"costs findings\">\n<thead><tr><th>subject</th><th></th><th>finding</th></tr></thead>\n<tbody>\n";
    for finding in &doctor.findings {
        let class = match finding.verdict {
            Verdict::Good => "agrees",
            Verdict::Note => "note",
            Verdict::Bad => "differs",
        };
        body += &format!(
            "<tr><td>{}</td><td><span class=\"{class}\">{}</span></td><td>{}</td></tr>\n",
            finding.what,
            finding.verdict.word(),
            escaped(&finding.text)
        );
    }
    body += "</tbody></table></div>\n<h2>Yaw rate</h2>\n";
    body += &rates(doctor);
    body += "<h2>Noise at rest</h2>\n";
    body += &match (&doctor.allan, &doctor.noise) {
        (Some(allan), Some(noise)) => allan_section(allan, noise),
        _ => "<p>No standstill is long enough.</p>\n".to_owned(),
    };
    document(&format!("gyronet doctor: {}", doctor.name), &body)
}

fn noise_facts(doctor: &Doctor) -> String {
    let Some([_, _, Some(Noise { random_walk, instability })]) = &doctor.noise else { return String::new() };
    let mut html = format!(
        "<div><dt>angular random walk, z</dt><dd>{:.3} <small>deg/&radic;h</small></dd></div>\n",
        random_walk.to_degrees() * 60.0
    );
    if let Some((rate, _)) = instability {
        let rate = rate.to_degrees() * 3_600.0;
        html += &format!("<div><dt>bias instability, z</dt><dd>{rate:.1} <small>deg/h</small></dd></div>\n");
    }
    html
}

fn rates(doctor: &Doctor) -> String {
    let [gyro, reference] = &doctor.curves;
    let degrees =
        |points: &[(f64, f64)]| points.iter().map(|(t, rate)| (*t, rate.to_degrees())).collect::<Vec<_>>();
    let curve = |class, label: &str, points| Curve {
        class,
        label: label.into(),
        note: String::new(),
        points,
        in_scale: true,
    };
    // The reference is drawn in front, since a noisy gyro curve would hide it.
    let mut curves = vec![curve("static", "gyro", degrees(gyro))];
    if !reference.is_empty() {
        curves.push(curve("reference", "reference", degrees(reference)));
    }
    let title = if reference.is_empty() { "By the gyro" } else { "By gyro and reference" };
    let chart = Chart { title, axes: "deg/s, over time in s", same_scale: false, curves };
    format!("{}<p class=\"note\">{HINT}</p>\n", chart.html())
}

fn allan_section(allan: &[Allan; 3], noise: &[Option<Noise>; 3]) -> String {
    let curves = AXES.iter().zip(allan).map(|((class, label), allan)| {
        let log = |(tau, deviation): &(f64, f64)| (tau.log10(), (deviation.to_degrees() * 3_600.0).log10());
        let points = allan.points.iter().filter(|(_, deviation)| *deviation > 0.0).map(log).collect();
        Curve { class, label: (*label).to_owned(), note: String::new(), points, in_scale: true }
    });
    let chart = Chart {
        title: "Allan deviation",
        axes: "deg/h, over averaging time in s",
        same_scale: true,
        curves: curves.collect(),
    };
    let rows = AXES.iter().zip(noise).map(|((_, axis), noise)| {
        let figure = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
        let walk = noise.map(|noise| format!("{:.3}", noise.random_walk.to_degrees() * 60.0));
        let bottom = noise.and_then(|noise| noise.instability);
        vec![
            (*axis).to_owned(),
            figure(walk),
            figure(bottom.map(|(rate, _)| format!("{:.2}", rate.to_degrees() * 3_600.0))),
            figure(bottom.map(|(_, tau)| format!("{tau:.0}"))),
        ]
    });
    let header =
        ["axis", "angular random walk, deg/√h", "bias instability, deg/h", "at an averaging time of, s"];
    chart.log_html()
        + &table("methods", "", &header, rows)
        + "<p class=\"note\">Measured in the longest standstill. The random walk is the deviation at 1 s on the falling part of the \
           curve. The bias instability is the minimum of the curve over 0.664 (IEEE Std 952), or a dash if the curve still \
           falls at its end. Both include the vibration of the standing vehicle.</p>\n"
}
