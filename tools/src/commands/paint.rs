//! Formats tables with bold text and colours on a terminal, and as plain text elsewhere and with NO_COLOR.

use console::style;
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
