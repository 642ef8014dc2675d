//! A picture of one outage, as an SVG that a page shows in a column of 390 px or more, light or dark: the error of
//! the heading by time, and how far off each path is.

use crate::evaluate::methods::Method;
use crate::evaluate::outage::{AFTER_S, Outage};
use crate::evaluate::outage_path::{ByMethod, METHODS, Point};
use crate::plot::curve::range;
use crate::plot::page::chart::{part, ticks};
use crate::plot::page::escaped;
use std::fmt::Write;

const WIDTH: f64 = 480.0;
/// Left and right margins of a panel, and the place of its axis' numbers and title.
const MARGINS: [f64; 2] = [48.0, 12.0];
const GAP: f64 = 52.0;
const HEIGHT: f64 = 150.0;
/// Height of a line of the legend.
const LINE: f64 = 20.0;
/// The methods that are drawn, from back to front, with their colours on light and on dark ground, those of the page,
/// where the live rate has the EKF's, and their dashes: zero-rate updates may hide static initialisation.
const DRAWN: [(Method, &str, &str, &str); 4] = [
    (Method::STATIC, "#0068a8", "#5cb3ef", "none"),
    (Method::STATIC_ZERO_RATE, "#b5569a", "#e08cc6", "7 7"),
    (Method::EKF, "#7d858d", "#9aa3ab", "none"),
    (Method::DELAYED, "#c8400a", "#ff8152", "none"),
];
/// These lie in the picture as a whole; others may leave it.
const IN_SCALE: [Method; 3] = [Method::STATIC_ZERO_RATE, Method::EKF, Method::DELAYED];
const SECONDS_OF_A_POINT: f64 = 0.5;

fn column(method: Method) -> usize {
    METHODS.iter().position(|own| *own == method).expect("the drawn methods are compared ones")
}

/// `which` says which of the outages of a drive or set it is.
pub fn svg(drive: &str, which: &str, outage: &Outage, points: &[Point]) -> String {
    let Outage { seconds, start_s, driven_s, .. } = outage;
    let title = format!(
        "{drive}: {seconds} s without GNSS, {start_s:.0} s after the start, after {driven_s:.0} s with it: {which}"
    );
    let mut body = legend(outage);
    let top = 78.0 + LINE * DRAWN.len() as f64;
    let time = (1..).map(|k| f64::from(k) * SECONDS_OF_A_POINT);
    let by_time: Vec<_> = time.zip(points.iter().map(|point| point.heading.map(f64::to_degrees))).collect();
    let mut bottom = panel(&mut body, top, &by_time, "error of the heading, degrees, by seconds");
    let by_way: Vec<_> = points.iter().filter_map(|point| point.position).collect();
    if !by_way.is_empty() {
        let axes = "distance from the reference's path, m, by metres driven";
        bottom = panel(&mut body, bottom + GAP, &by_way, axes);
    }
    let height = bottom + GAP - 6.0;
    format!(
        "<svg id=\"tunnel\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" \
         font-family=\"system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif\" font-size=\"15\" role=\"img\" \
         aria-label=\"{}\">\n<style>\n{}</style>\n\
         <rect class=\"ground\" width=\"{WIDTH}\" height=\"{height:.0}\" rx=\"8\"/>\n<text x=\"12\" y=\"24\" font-weight=\"600\">\
         {seconds} s without GNSS</text><text class=\"note\" x=\"12\" y=\"44\">{}</text>\
         <text class=\"note\" x=\"12\" y=\"62\">{}</text>\n{body}</svg>\n",
        escaped(&title),
        style(),
        escaped(&format!("{drive}, {start_s:.0} s after its start")),
        escaped(which),
    )
}

/// Returns the style sheet. Every rule holds in this picture alone, since a page may have the picture in its text.
fn style() -> String {
    let grounds = [
        ["#fff", "#f5f6f8", "#dfe3e7", "#1d2126", "#5d6670"],
        ["#14171a", "#1c2126", "#333a41", "#e6e9ec", "#98a2ac"],
    ];
    let rules = grounds.into_iter().enumerate().map(|(is_dark, [ground, panel, grid, ink, soft])| {
        let mut rules = format!(
            "#tunnel .ground{{fill:{ground}}}#tunnel .panel{{fill:{panel}}}#tunnel .grid{{stroke:{grid}}}#tunnel text{{fill:{ink}}}\
             #tunnel .note{{fill:{soft}}}"
        );
        for (k, (_, on_light, on_dark, dash)) in DRAWN.iter().enumerate() {
            // Writing to a string does not fail.
            let colour = [on_light, on_dark][is_dark];
            let _ = write!(rules, "#tunnel .m{k}{{stroke:{colour};stroke-dasharray:{dash}}}");
        }
        rules
    });
    let [light, dark] = [0, 1].map(|at| rules.clone().nth(at).unwrap_or_default());
    format!(
        "#tunnel .note{{font-size:14px}}#tunnel .curve{{fill:none;stroke-width:2;stroke-linejoin:round}}\n{light}\n\
         @media (prefers-color-scheme:dark){{{dark}}}\n"
    )
}

/// Returns the median and the worst of the longest outages by the mean error of the drawn methods' headings, those
/// whose path is known first, each with the words that say so.
pub fn typical<'a>(outages: impl Iterator<Item = &'a Outage> + Clone) -> Option<[(&'a Outage, String); 2]> {
    let after = f64::from(AFTER_S[0] as u32);
    let longest = outages.clone().map(|outage| outage.seconds).max()?;
    let rank =
        |outage: &Outage| (outage.seconds == longest, outage.position.is_some(), outage.driven_s >= after);
    let best = outages.clone().map(rank).max()?;
    let mut chosen: Vec<&Outage> = outages.filter(|outage| rank(outage) == best).collect();
    let error =
        |outage: &Outage| DRAWN.iter().map(|(method, ..)| outage.heading[column(*method)]).sum::<f64>();
    chosen.sort_by(|a, b| error(a).total_cmp(&error(b)));
    let which = |rank: &str| format!("{rank} of {} by these methods' mean", chosen.len());
    Some([(chosen.get(chosen.len() / 2)?, which("the median")), (chosen.last()?, which("the worst"))])
}

fn legend(outage: &Outage) -> String {
    let mut text = String::new();
    for (k, (method, ..)) in DRAWN.iter().enumerate() {
        let at = column(*method);
        let end = outage.position.map(|(driven, ends)| format!(", {:.1} m after {driven:.0} m", ends[at]));
        let note = format!("{:.1}° off{}", outage.heading[at].to_degrees(), end.unwrap_or_default());
        let name = if *method == Method::DELAYED { "gyronet" } else { method.name };
        let y = 84.0 + LINE * k as f64;
        let _ = writeln!(
            text,
            "<line class=\"curve m{k}\" x1=\"12\" x2=\"34\" y1=\"{0:.0}\" y2=\"{0:.0}\"/><text x=\"42\" y=\"{y:.0}\">{name}</text>\
             <text class=\"note\" x=\"254\" y=\"{y:.0}\">{note}</text>",
            y - 5.0
        );
    }
    text
}

/// Draws the errors of each method over a time or a way, with axes, and returns the lower end.
fn panel(body: &mut String, top: f64, errors: &[(f64, ByMethod<f64>)], axes: &str) -> f64 {
    let of = |method: Method| {
        let curve = errors.iter().map(move |(at, errors)| [*at, errors[column(method)]]);
        std::iter::once([0.0; 2]).chain(curve)
    };
    let scaled: Vec<[f64; 2]> = IN_SCALE.into_iter().flat_map(of).collect();
    let x = range(scaled.iter().map(|point| point[0]), 0.0);
    let y = range(scaled.iter().map(|point| point[1]), 0.15);
    let [left, right] = [MARGINS[0], WIDTH - MARGINS[1]];
    let width = right - left;
    let bottom = top + HEIGHT;
    let (across, up) = (|at: f64| left + width * part(at, x), |at: f64| bottom - HEIGHT * part(at, y));
    let _ = writeln!(
        body,
        "<svg x=\"{left}\" y=\"{top:.0}\" width=\"{width}\" height=\"{HEIGHT}\" viewBox=\"{left} {top:.0} {width} {HEIGHT}\">\
         <rect class=\"panel\" x=\"{left}\" y=\"{top:.0}\" width=\"{width}\" height=\"{HEIGHT}\"/>"
    );
    let mut numbers = String::new();
    let mut mark = |[x1, x2, y1, y2]: [f64; 4], anchor: &str, [x, y]: [f64; 2], label: &str| {
        let _ = writeln!(
            body,
            "<line class=\"grid\" x1=\"{x1:.1}\" x2=\"{x2:.1}\" y1=\"{y1:.1}\" y2=\"{y2:.1}\"/>"
        );
        let _ = write!(
            numbers,
            "<text class=\"note\" text-anchor=\"{anchor}\" x=\"{x:.1}\" y=\"{y:.1}\">{label}</text>"
        );
    };
    for tick in ticks(x, 6) {
        let at = across(tick.at);
        mark([at, at, top, bottom], "middle", [at, bottom + 17.0], &tick.label);
    }
    for tick in ticks(y, 5) {
        let at = up(tick.at);
        mark([left, right, at, at], "end", [left - 6.0, at + 4.0], &tick.label);
    }
    for (k, (method, ..)) in DRAWN.iter().enumerate() {
        let _ = write!(body, "<polyline class=\"curve m{k}\" points=\"");
        for [at, value] in of(*method) {
            // A curve that has left the picture stays near it.
            let near = |value: f64| value.clamp(-2_000.0, 2_000.0);
            let _ = write!(body, "{:.1},{:.1} ", near(across(at)), near(up(value)));
        }
        body.push_str("\"/>\n");
    }
    let _ = writeln!(
        body,
        "</svg>\n{numbers}<text class=\"note\" x=\"{left}\" y=\"{:.0}\">{axes}</text>",
        bottom + 36.0
    );
    bottom
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outage(seconds: usize, error: f64) -> Outage {
        let heading = std::array::from_fn(|_| error);
        let position = Some((500.0, std::array::from_fn(|_| 3.0)));
        let expected = None;
        Outage { driven_s: 70.0, seconds, start_s: 80.0, is_rested: true, heading, position, expected }
    }

    #[test]
    fn the_median_and_the_worst_of_the_longest_are_typical() {
        let all = [outage(30, 9.0), outage(60, 0.3), outage(60, 0.1), outage(60, 0.2)];
        let [(median, words), (worst, _)] = typical(all.iter()).unwrap();
        assert_eq!((median, worst, &*words), (&all[3], &all[1], "the median of 3 by these methods' mean"));
        assert_eq!(typical([].iter()), None);
    }

    #[test]
    fn a_picture_has_all_curves_and_the_errors_at_the_end() {
        let points: Vec<_> = (1..=120)
            .map(|k| Point {
                heading: std::array::from_fn(|m| 0.001 * f64::from(k) * m as f64),
                position: Some((f64::from(k), std::array::from_fn(|m| m as f64))),
            })
            .collect();
        let svg = svg("<b>", "the median of 3", &outage(60, 0.1), &points);
        for text in ["&lt;b&gt;, 80 s after its start", ">the median of 3<", "5.7° off, 3.0 m after 500 m"] {
            assert!(svg.contains(text), "{svg}");
        }
        assert_eq!(svg.matches("<polyline").count(), 4 + 4, "the errors of heading and position");
    }
}
