//! Writes an HTML page that loads no other files. The page is readable without a script; the script adds
//! zooming.

pub mod chart;

const STYLE: &str = include_str!("page/style.css");
const SCRIPT: &str = include_str!("page/zoom.js");
pub const HINT: &str =
    "Point at a chart to read it; drag over it, or press + and -, to zoom; tap a name to hide its curve.";

pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n<style>\n{STYLE}</style></head>\n\
         <body>\n{body}<script>\n{SCRIPT}</script>\n</body></html>\n",
        escaped(title)
    )
}

/// Returns a table. The first column is text, the others are figures.
pub fn table(class: &str, header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let row = |kind: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cells = cells.map(|cell| format!("<{kind}>{}</{kind}>", escaped(cell)));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let body = rows.into_iter().map(|cells| row("td", &mut cells.iter().map(String::as_str)));
    format!(
        "<div class=\"scroll\"><table class=\"{class}\"><thead>{}</thead>\n<tbody>\n{}</tbody></table></div>\n",
        row("th", &mut header.iter().copied()),
        body.collect::<String>()
    )
}

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
        let page = document("<b>", &table("t", &["a&b"], [vec!["<script>".into()]]));
        assert!(page.contains("<title>&lt;b&gt;</title>") && page.contains("a&amp;b"));
        assert_eq!(page.matches("<script>").count(), 1, "our own");
    }

    #[test]
    fn thousands() {
        assert_eq!([0, 999, 1_000, 1_162_256].map(grouped), ["0", "999", "1,000", "1,162,256"]);
    }
}
