//! Writes the page of a drive.

use super::Demo;
use super::trajectory::Trajectories;
use crate::evaluate::angle::integral;
use crate::evaluate::heading_error::{AgainstCourse, BLOCK_S};
use crate::evaluate::methods::Method;
use crate::evaluate::rates::Rates;
use crate::evaluate::report::{HEADINGS, MARKS, figures};
use crate::plot::page::chart::{Chart, Curve};
use crate::plot::page::{HINT, document, escaped, grouped, table};
use gyronet::bias::STATIC_SAMPLES;
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
    if let Some(tunnel) = demo.tunnel {
        body += "<h2>A tunnel</h2>\n<p class=\"note\">Every method had the same courses before it.</p>\n";
        body += &format!("<div class=\"tunnel\">\n{}</div>\n", tunnel.picture);
        let title = tunnel.title();
        let header = [&title, "heading, deg: median", "worst", "position, m: median", "worst"];
        body += &table("ours", &header, tunnel.rows().map(Vec::from));
        body += &tunnel.command.as_ref().map_or_else(String::new, |command| {
            format!("<p class=\"note\">All starts: <code>{}</code></p>\n", escaped(command))
        });
    }
    body += "<h2>Yaw</h2>\n";
    body += &yaw(demo);
    if let Some(trajectories) = &demo.trajectories {
        body += "<h2>Path</h2>\n";
        body += &paths(trajectories, demo.drive.vehicle.radius_m());
    }
    // A simulated standstill has been put before a drive that begins in motion.
    let is_later = demo.errors.is_some_and(|errors| errors.simulated_rest);
    let start = if is_later { f64::from(STATIC_SAMPLES) / f64::from(RATE_HZ) } else { 0.0 };
    let learnt = demo.learnt.charts(span(demo.rates), start);
    if !learnt.is_empty() {
        body += &format!(
            "<h2>What the board learns</h2>\n<p class=\"note\">With the drive's courses, where it has any. The bias is that when driving.</p>\n{learnt}"
        );
    }
    body += "<h2>Methods</h2>\n";
    body += &methods(demo);
    document(&format!("gyronet demo: {name}"), &body)
}

/// The time of the drive in which methods are compared, s, which all charts over time share.
fn span(rates: &Rates) -> (f64, f64) {
    rates.seconds.first().copied().zip(rates.seconds.last().copied()).unwrap_or((0.0, 1.0))
}

fn facts(demo: &Demo<'_>) -> String {
    let mut facts = Vec::new();
    if let Some(errors) = demo.errors {
        let sent = errors.methods[Method::DELAYED].error;
        if let Some(ours) = errors.over_best_classical {
            facts
                .push(("error over that of the best classical method", format!("{:.2}", ours.default.ratio)));
        }
        let degrees = |rad: f64, decimals| format!("{:.decimals$}°", rad.to_degrees());
        facts.extend(sent.mean_1s_rad.map(|rad| ("error in 1 s, delayed rate", degrees(rad, 4))));
        facts.extend(sent.rms_rad.map(|rad| ("RMS over the drive, delayed rate", degrees(rad, 2))));
    }
    facts.push(("CAN messages", grouped(demo.frames)));
    let rows = facts.iter().map(|(name, figure)| format!("<div><dt>{name}</dt><dd>{figure}</dd></div>\n"));
    format!("<dl class=\"facts\">\n{}</dl>\n", rows.collect::<String>())
}

fn yaw(demo: &Demo<'_>) -> String {
    let rates = demo.rates;
    // Where the value is known.
    let points = |degrees: &mut dyn Iterator<Item = Option<f64>>| {
        let times = rates.seconds.iter().copied();
        times.zip(degrees).filter_map(|(time, value)| Some((time, value?.to_degrees()))).collect::<Vec<_>>()
    };
    let truth = rates.truth();
    let mut angles: Vec<Curve> = Vec::new();
    let mut errors: Vec<Curve> = Vec::new();
    for method in DRAWN {
        let yaw = integral(&rates.rates[method]);
        // A method that keeps its bias may leave the errors' scale.
        let in_scale = method != Method::RAW;
        let curve = |note, points, in_scale| Curve {
            class: method.key,
            label: method.name.into(),
            note,
            points,
            in_scale,
        };
        if let Some(truth) = &truth {
            let off = match rates.courses() {
                Some(courses) => by_course(rates, method, courses),
                None => points(&mut yaw.iter().zip(truth).map(|(yaw, truth)| Some(yaw - (*truth)?))),
            };
            let note = format!("ends {:+.2}° off", off.last().map_or(0.0, |(_, degrees)| *degrees));
            errors.push(curve(note, off, in_scale));
        }
        angles.push(curve(String::new(), points(&mut yaw.into_iter().map(Some)), true));
    }
    if let Some(truth) = &truth {
        let label = if rates.courses().is_some() { "course by GNSS" } else { REFERENCE }.into();
        let points = points(&mut truth.iter().copied());
        angles.push(Curve { class: REFERENCE, label, note: String::new(), points, in_scale: true });
    }
    let mut html =
        Chart { title: "Angle", axes: "deg, over time in s", time: Some(span(rates)), curves: angles }.html();
    if truth.is_some() {
        html += &Chart {
            title: "Error against the reference",
            axes: "deg, over time in s",
            time: Some(span(rates)),
            curves: errors,
        }
        .html();
    }
    html +=
        &format!("<p class=\"note\">{HINT} Time begins at the end of static initialisation (3 s at rest).");
    html += match truth {
        Some(_) => {
            " The scale of the errors fits the corrected methods; a method that keeps its bias leaves the chart."
        }
        None => {
            " The drive has no reference (<code>ref_gyr_z</code> or <code>ref_yaw</code>), so no error is drawn."
        }
    };
    if rates.courses().is_some() {
        html += " A course scatters by degrees from one second to the next, so the errors are medians over 10 s, aligned \
                 on the first 20 s, as in the table.";
    }
    html + "</p>\n"
}

/// The errors of a method against the courses as the table has them, degrees, each at the middle of its block.
fn by_course(rates: &Rates, method: Method, courses: &[Option<f64>]) -> Vec<(f64, f64)> {
    let mut against = AgainstCourse::default();
    rates.rates[method].iter().zip(courses).for_each(|(rate, course)| against.add(*rate, *course));
    let errors = against.finish().into_iter().enumerate();
    let middle = |block: usize| {
        let samples = BLOCK_S * RATE_HZ as usize;
        rates.seconds[(block * samples + samples / 2).min(rates.seconds.len() - 1)]
    };
    errors.filter_map(|(block, error)| Some((middle(block), error?.to_degrees()))).collect()
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
        Chart { title: "Seen from above", axes: "m, from where it started", time: None, curves }.html();
    let speed = match wheels {
        0 => "speed by GNSS".to_owned(),
        1 => format!("speed of one wheel (radius {radius} m)"),
        _ => format!("speed of the mean of {wheels} wheels (radius {radius} m)"),
    };
    let off = |method| paths.iter().find(|path| path.method == Some(method)).and_then(|path| path.error_m);
    let farther = match off(Method::DELAYED).zip(off(Method::STATIC)) {
        Some((ours, theirs)) if ours > theirs => {
            " Here gyronet's path is farther off than static initialisation's: an early error of the heading moves all that follows."
        }
        _ => "",
    };
    format!(
        "{chart}<p class=\"note\">Dead reckoning over {metres:.0} m: each method's yaw rate and the recorded \
         {speed}.{farther} The reference's path has its heading and the same speed; a GNSS receiver's positions are laid onto it.</p>\n"
    )
}

fn methods(demo: &Demo<'_>) -> String {
    let Some(errors) = demo.errors else {
        return "<p>The drive has no reference, so there are no errors.</p>\n".into();
    };
    let ours = errors.over_best_classical.map(|ours| format!("<p>Delayed rate: {ours}.</p>\n"));
    format!(
        "{}{}<p class=\"note\">Heading error over {:.1} s against <code>{}</code>: mean over windows of 1 and 60 s, RMS \
         and value at the end; {MARKS}. The linear \
         window is a complete estimate after static initialisation. The last two rows are the rates that the board \
         sends: with the sample (Bosch TX1), and in its own messages some samples later.</p>\n",
        ours.unwrap_or_default(),
        table("ours", &HEADINGS, figures(&errors.methods)),
        errors.seconds,
        errors.reference
    )
}
