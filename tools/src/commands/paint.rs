//! Formats tables with bold text and colours on a terminal, and as plain text elsewhere and with NO_COLOR.

use console::style;
use gyronet_tools::demo::Tunnel;
use gyronet_tools::evaluate::methods::Method;
use gyronet_tools::evaluate::report::TITLE;

/// Returns a printed report with its headings and the delayed rate highlighted.
pub fn report(report: &str) -> String {
    let mut text = String::new();
    for line in report.lines() {
        let line = if !line.starts_with(' ') {
            style(line).bold()
        } else if line.trim_start().starts_with(TITLE) {
            style(line).dim()
        } else if line.trim_start().starts_with(Method::DELAYED.name) {
            style(line).green().bold()
        } else {
            style(line)
        };
        text += &format!("{line}\n");
    }
    text
}

/// Returns the tunnels of a drive with our row in green where its median is the smallest, else in yellow.
pub fn tunnel(tunnel: &Tunnel) -> String {
    let wins = tunnel.over_best().is_some_and(|ratio| ratio <= 1.0);
    let painted = |line: &str| {
        if !line.starts_with(' ') {
            style(line).bold().to_string()
        } else if line.trim_start().starts_with("gyronet ") && !line.contains("without its model") {
            let line = style(line).bold();
            if wins { line.green() } else { line.yellow() }.to_string()
        } else {
            line.to_owned()
        }
    };
    tunnel.to_string().lines().map(|line| painted(line) + "\n").collect()
}
