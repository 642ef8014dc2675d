//! Writes the page about a training.

use super::examine::Examined;
use super::gain::Gain;
use super::history::{History, Seed};
use super::roles::Roles;
use crate::plot::page::chart::{Chart, Curve};
use crate::plot::page::{document, escaped, grouped, table};

/// Classes of the seeds' curves in the style sheet; further seeds are not drawn.
const SEEDS: [&str; 5] = ["default", "gyronet_int", "static_zero_rate", "gyronet_f32", "raw"];

/// The contents of the page about a training.
#[derive(Debug)]
pub struct Training<'a> {
    /// The name of the folder.
    pub name: String,
    /// The drives and their roles.
    pub roles: &'a Roles,
    pub history: &'a History,
    /// The gain on the held-out drives.
    pub gain: &'a Gain,
    /// The gain on the validation drive, which chose the epoch.
    pub validation: &'a Gain,
    /// The size of the weight file, bytes.
    pub bytes: usize,
}

pub fn page(training: &Training<'_>) -> String {
    let Training { name, roles, history, gain, validation, bytes } = training;
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"lead\">Weights trained on {}, and what they gain on held-out drives. Written by \
         <code>gyronet train</code> {}.</p>\n",
        escaped(name),
        match roles.train.len() {
            0 => "Parquet shards".to_owned(),
            drives => format!("{drives} drives"),
        },
        env!("CARGO_PKG_VERSION")
    );
    let mut facts = Vec::new();
    let spread = |spread: &super::gain::Spread| spread.to_string().replace("+-", "&plusmn;");
    facts.extend(gain.sent().map(|sent| ("1 s error over static initialisation", spread(&sent))));
    facts.extend(
        gain.over_best_classical.map(|ours| ("error over that of the best classical method", spread(&ours))),
    );
    facts.push(("training", format!("{:.0} <small>s</small>", history.seconds())));
    facts.push(("weight file", format!("{} <small>bytes</small>", grouped(*bytes as u64))));
    let rows = facts.iter().map(|(what, figure)| format!("<div><dt>{what}</dt><dd>{figure}</dd></div>\n"));
    body += &format!("<dl class=\"facts\">\n{}</dl>\n", rows.collect::<String>());
    body += "<h2>Gain</h2>\n";
    body += &gains(gain, validation);
    body += "<h2>Training</h2>\n";
    body += &courses(history);
    body += "<h2>Drives</h2>\n";
    body += &drives(roles);
    document(&format!("gyronet train: {name}"), &body)
}

fn gains(gain: &Gain, validation: &Gain) -> String {
    let mut header = vec!["1 s error over static initialisation"];
    header.extend(["mean", "deviation"]);
    header.extend(gain.drives.iter().map(String::as_str));
    header.extend(validation.drives.iter().map(String::as_str));
    let rows = gain.over_static.iter().zip(&validation.over_static).map(|(ratio, chosen)| {
        let mut row = vec![ratio.method.to_owned()];
        row.push(format!("{:.3}", ratio.all.mean));
        row.push(ratio.all.deviation.map_or_else(|| "–".to_owned(), |deviation| format!("{deviation:.3}")));
        row.extend(ratio.drives.iter().map(|ratio| format!("{ratio:.3}")));
        row.extend(chosen.drives.iter().map(|ratio| format!("{ratio:.3}")));
        row
    });
    let one = match gain.drives.len() {
        1 => {
            " Only one drive is held out, so there is no spread; hold out more with <code>--hold-out</code>."
        }
        _ => "",
    };
    format!(
        "{}<p class=\"note\">The mean angle error of a rate after 1 s, over that of the gyro less its bias at rest: below 1 is \
         better. Mean and standard deviation over the held-out drives. The last column is the validation drive: it chose the \
         epoch, so its error is too optimistic. The last two rows are the rates that the board sends with these weights, in \
         integers; the other methods use no weights.{one}</p>\n",
        table("methods", "", &header, rows)
    )
}

fn courses(history: &History) -> String {
    let points = |values: &[f64], scale: f64| {
        values.iter().enumerate().map(|(k, value)| ((k + 1) as f64, scale * value)).collect::<Vec<_>>()
    };
    let curves = |of: fn(&Seed) -> &[f64], scale: f64| {
        let seeds = history.seeds.iter().zip(SEEDS).map(move |((seed, course), class)| {
            let kept = if *seed == history.seed { ", kept" } else { "" };
            let note = format!("best after {} of {}{kept}", course.best, course.loss.len());
            Curve {
                class,
                label: format!("seed {seed}"),
                note,
                points: points(of(course), scale),
                in_scale: true,
            }
        });
        seeds.collect::<Vec<_>>()
    };
    let longest = history.seeds.values().map(|seed| seed.loss.len()).max().unwrap_or_default();
    let mut errors = curves(|seed| &seed.mean_1s_rad, 1e3);
    errors.push(Curve {
        class: "static",
        label: "static initialisation".into(),
        note: String::new(),
        points: points(&vec![history.static_1s_rad; longest], 1e3),
        in_scale: true,
    });
    let axes = "mrad in 1 s, over epochs";
    Chart { title: "Error on the validation drive", axes, same_scale: false, curves: errors }.html()
        + &Chart {
            title: "Loss on the training drives",
            axes: "error, in standard deviations of the gyro error, plus a tenth of the expected error's log loss; over epochs",
            same_scale: false,
            curves: curves(|seed| &seed.loss, 1.0),
        }
        .html()
}

fn drives(roles: &Roles) -> String {
    let row = |role: &str, drive: &Examined| {
        let turned = drive.turned_rad.to_degrees();
        vec![
            drive.name.clone(),
            role.to_owned(),
            format!("{:.0} s, turns of {turned:.0} degrees", drive.seconds),
        ]
    };
    let mut rows: Vec<_> = roles.train.iter().map(|drive| row("training", drive)).collect();
    rows.push(row("validation, chooses the epoch", &roles.validate));
    rows.extend(roles.held_out.iter().map(|drive| row("held out", drive)));
    rows.extend(roles.refused.iter().map(|refusal| {
        let text = refusal.to_string();
        let (path, reason) = text.split_once(": ").unwrap_or(("", &text));
        let name = std::path::Path::new(path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        vec![name, "left out".to_owned(), reason.to_owned()]
    }));
    table("costs", "", &["drive", "role", "length after 3 s at rest"], rows)
}
