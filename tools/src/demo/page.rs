//! Writes the page of a drive.

use super::trajectory::Trajectories;
use super::{Demo, Tunnel};
use crate::evaluate::methods::Method;
use crate::evaluate::metrics::integral;
use crate::evaluate::report::{COLUMNS, columns};
use crate::plot::page::chart::{Chart, Curve};
use crate::plot::page::{HINT, document, escaped, grouped, table};
use gyronet::sample::RATE_HZ;

/// The curves of these methods are drawn, from back to front.
const DRAWN: [Method; 5] =
    [Method::RAW, Method::STATIC, Method::STATIC_ZERO_RATE, Method::LIVE, Method::DELAYED];
const REFERENCE: &str = "reference";

pub fn page(demo: &Demo<'_>) -> String {
    let name = demo.drive.name();
    let mut body = format!("<h1>{}</h1>\n", escaped(name));
    body += &format!(
        "<p class=\"lead\">{} s at {RATE_HZ} Hz through the integer code of the firmware, beside other methods. \
         Written by <code>gyronet demo</code> {}.</p>\n",
        format_args!("{:.0}", demo.drive.facts.seconds()),
        env!("CARGO_PKG_VERSION"),
    );
    if demo.simulated {
        body += "<p class=\"simulated\"><b>Simulated drive.</b> It shows what the board does, not what you gain: the \
                 weights were trained on another vehicle. Your own drive: <code>gyronet demo DRIVE.csv</code>.</p>\n";
    }
    body += &facts(demo);
    if let Some(Tunnel { picture, .. }) = demo.tunnel {
        body += "<h2>A tunnel</h2>\n<p class=\"note\">The median of the drive's tunnels. Every method had the same courses before \
                 it.</p>\n";
        body += &format!("<div class=\"tunnel\">\n{picture}</div>\n");
    }
    body += "<h2>Yaw</h2>\n";
    body += &yaw(demo);
    if let Some(trajectories) = &demo.trajectories {
        body += "<h2>Path</h2>\n";
        body += &paths(trajectories, demo.drive.vehicle.radius_m());
    }
    body += "<h2>Methods</h2>\n";
    body += &methods(demo);
    document(&format!("gyronet demo: {name}"), &body)
}

/// Returns the few figures that matter most.
fn facts(demo: &Demo<'_>) -> String {
    let mut facts = Vec::new();
    if let Some(errors) = demo.errors {
        let sent = errors.methods[Method::DELAYED].error;
        if let Some(ours) = errors.over_best_classical {
            facts
                .push(("error over that of the best classical method", format!("{:.2}", ours.default.ratio)));
        }
        let mrad = |rad: f64| format!("{:.3} <small>mrad</small>", 1e3 * rad);
        facts.extend(sent.mean_1s_rad.map(|rad| ("error in 1 s, delayed rate", mrad(rad))));
        facts.extend(sent.rms_rad.map(|rad| ("its RMS over the drive", mrad(rad))));
    }
    facts.push(("CAN messages", grouped(demo.frames)));
    let rows = facts.iter().map(|(name, figure)| format!("<div><dt>{name}</dt><dd>{figure}</dd></div>\n"));
    format!("<dl class=\"facts\">\n{}</dl>\n", rows.collect::<String>())
}

/// Returns the charts of the yaw and, with a reference, of each method's error.
fn yaw(demo: &Demo<'_>) -> String {
    let rates = demo.rates;
    let points = |values: Vec<f64>| rates.seconds.iter().copied().zip(values).collect::<Vec<(f64, f64)>>();
    let truth = rates.reference.as_deref().map(integral);
    let mut angles: Vec<Curve> = Vec::new();
    let mut errors: Vec<Curve> = Vec::new();
    for method in DRAWN {
        let yaw = integral(&rates.rates[method]);
        // A method that keeps its bias may leave the errors' scale.
        let in_scale = method != Method::RAW;
        let curve = |note, values, in_scale| Curve {
            class: method.key,
            label: method.name.into(),
            note,
            points: points(values),
            in_scale,
        };
        if let Some(truth) = &truth {
            let off: Vec<f64> = yaw.iter().zip(truth).map(|(yaw, truth)| 1e3 * (yaw - truth)).collect();
            let note = format!("ends {:+.1} mrad off", off.last().copied().unwrap_or(0.0));
            errors.push(curve(note, off, in_scale));
        }
        angles.push(curve(String::new(), yaw.iter().map(|rad| rad.to_degrees()).collect(), true));
    }
    if let Some(truth) = &truth {
        let degrees = truth.iter().map(|rad| rad.to_degrees()).collect();
        let (label, note) = (REFERENCE.into(), String::new());
        angles.push(Curve { class: REFERENCE, label, note, points: points(degrees), in_scale: true });
    }
    let mut html =
        Chart { title: "Angle", axes: "deg, over time in s", same_scale: false, curves: angles }.html();
    if truth.is_some() {
        html += &Chart {
            title: "Error against the reference",
            axes: "mrad, over time in s",
            same_scale: false,
            curves: errors,
        }
        .html();
    }
    html +=
        &format!("<p class=\"note\">{HINT} Time begins at the end of static initialisation (3 s at rest).");
    html += match truth {
        Some(_) => {
            " The scale of the errors fits the corrected methods; a method that keeps its bias leaves the chart.</p>\n"
        }
        None => " The drive has no reference yaw rate (<code>ref_gyr_z</code>), so no error is drawn.</p>\n",
    };
    html
}

fn paths(trajectories: &Trajectories, radius: f64) -> String {
    let Trajectories { paths, wheels, metres } = trajectories;
    let mut curves: Vec<Curve> = paths
        .iter()
        .map(|path| Curve {
            class: path.method.map_or(REFERENCE, |method| method.key),
            label: path.method.map_or(REFERENCE, |method| method.name).into(),
            note: path.error_m.map(|metres| format!("{metres:.2} m off, RMS")).unwrap_or_default(),
            points: path.points.iter().map(|[x, y]| (*x, *y)).collect(),
            in_scale: path.method != Some(Method::RAW),
        })
        .collect();
    // The reference is drawn behind the methods compared with it.
    curves.sort_by_key(|curve| (curve.in_scale, curve.class != REFERENCE));
    let chart =
        Chart { title: "Seen from above", axes: "m, from where it started", same_scale: true, curves }.html();
    let of_wheels = if *wheels == 1 { "one wheel".into() } else { format!("the mean of {wheels} wheels") };
    format!(
        "{chart}<p class=\"note\">Dead reckoning over {metres:.0} m: each method's yaw rate and the recorded \
         speed of {of_wheels} (radius {radius} m). The reference path uses the reference's yaw rate and the same speed.</p>\n"
    )
}

fn methods(demo: &Demo<'_>) -> String {
    let Some(errors) = demo.errors else {
        return "<p>The drive has no reference, so there are no errors.</p>\n".into();
    };
    let ours = errors.over_best_classical.map(|ours| format!("<p>Delayed rate: {ours}.</p>\n"));
    let rows = columns(&errors.methods).map(|(_, columns)| columns.to_vec());
    format!(
        "{}{}<p class=\"note\">Heading error over {:.1} s against <code>{}</code>: mean over windows of 1, 10 and 60 s, RMS \
         and value at the end. To static: the error in 1 s (the RMS where the reference is a course) over that of static \
         initialisation. Mean: the mean correction beyond static initialisation and zero-rate updates. The linear \
         window is a complete estimate after static initialisation. The last two rows are the rates that the board \
         sends: with the sample (Bosch TX1, VDC2), and in its own messages some samples later.</p>\n",
        ours.unwrap_or_default(),
        table("methods", "", &COLUMNS, rows),
        errors.seconds,
        errors.reference
    )
}
