//! Writes an HTML page that loads no other files. The page is readable without a script; the script adds
//! zooming.

pub mod chart;

use std::fmt::{Display, Write};

const STYLE: &str = include_str!("page/style.css");
const SCRIPT: &str = include_str!("page/zoom.js");
pub const HINT: &str = "Drag over a chart, or press + and - on it, to zoom; tap a name to hide its curve.";

pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n<style>\n{STYLE}</style></head>\n\
         <body>\n{body}<script>\n{SCRIPT}</script>\n</body></html>\n",
        escaped(title)
    )
}

/// Returns a table; an empty caption is left out. The first column is text, the others are figures.
pub fn table<C: Display>(
    class: &str,
    caption: &str,
    header: &[&str],
    rows: impl IntoIterator<Item = Vec<C>>,
) -> String {
    let mut html = format!("<div class=\"scroll\"><table class=\"{class}\">");
    if !caption.is_empty() {
        html += &format!("<caption>{}</caption>", escaped(caption));
    }
    html += "<thead><tr>";
    for column in header {
        html += &format!("<th>{}</th>", escaped(column));
    }
    html += "</tr></thead>\n<tbody>\n";
    for row in rows {
        html += "<tr>";
        for cell in row {
            // Writing to a string does not fail.
            let _ = write!(html, "<td>{}</td>", escaped(&cell.to_string()));
        }
        html += "</tr>\n";
    }
    html + "</tbody></table></div>\n"
}

/// Returns text with the special characters of HTML escaped.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Formats a count with thousands separators: 1,162,256.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_cannot_become_markup() {
        let page = document("<b>", &table("t", "", &["a&b"], [vec!["<script>"]]));
        assert!(page.contains("<title>&lt;b&gt;</title>") && page.contains("a&amp;b"));
        assert_eq!(page.matches("<script>").count(), 1, "our own");
    }

    #[test]
    fn thousands() {
        assert_eq!([0, 999, 1_000, 1_162_256].map(grouped), ["0", "999", "1,000", "1,162,256"]);
    }
}
