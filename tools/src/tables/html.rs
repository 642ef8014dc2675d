//! One page with everything in it: tables, and pictures as SVG; nothing is loaded from elsewhere.

use super::pictures::Picture;
use super::table::{Row, Table};
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;\
    color:#222}table{border-collapse:collapse;margin:.6em 0 1em;font-variant-numeric:tabular-nums}\
    caption{text-align:left;color:#666;padding:.2em 0}th,td{padding:.15em .8em;text-align:right;\
    border-bottom:1px solid #ddd}th:first-child,td:first-child{text-align:left}th{border-bottom:2px solid #999;\
    font-weight:600}.simulated{background:#fff3cd;border:1px solid #e0c860;padding:.1em .5em;font-size:.8em;\
    font-weight:400}.note{color:#555;margin:.2em 0}figure{margin:1em 0}figcaption{color:#666}\
    svg{max-width:100%;height:auto}summary{cursor:pointer;font-weight:600}";

/// The page. Pictures come with the name of their sequence.
#[must_use]
pub fn page(tables: &[Table], pictures: &[(String, Vec<Picture>)]) -> String {
    let mut html = String::from("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">");
    html += "<title>gyronet: the paper's tables</title><style>";
    html += STYLE;
    html += "</style></head><body>\n<h1>The paper's tables</h1>\n";
    html += "<p>X. Zhao et al., <i>Learning to Compensate for the Drift and Error of Gyroscope in Vehicle \
             Localization</i>; written by <code>gyronet tables</code>.</p>\n";
    for table in tables {
        let simulated = if table.simulated { " <span class=\"simulated\">simulated</span>" } else { "" };
        // Writing to a string does not fail.
        let _ = writeln!(html, "<h2>{}{simulated}</h2>", escaped(&table.title));
        let ours = if table.simulated { "here, simulated" } else { "here" };
        block(&mut html, ours, &table.columns, &table.rows, table.decimals);
        block(&mut html, "in the paper", &table.paper_columns, &table.paper_rows, table.decimals);
        for note in &table.notes {
            let _ = writeln!(html, "<p class=\"note\">{}</p>", escaped(note));
        }
    }
    for (k, (name, pictures)) in pictures.iter().enumerate() {
        let open = if k == 0 { " open" } else { "" };
        let _ = writeln!(html, "<details{open}><summary>{}</summary>", escaped(name));
        for picture in pictures {
            let caption = escaped(&picture.caption);
            let _ = writeln!(html, "<figure>{}<figcaption>{caption}</figcaption></figure>", picture.svg);
        }
        html += "</details>\n";
    }
    html += "</body></html>\n";
    html
}

fn block(html: &mut String, caption: &str, columns: &[String], rows: &[Row], decimals: usize) {
    let _ = write!(html, "<table><caption>{caption}</caption><tr><th></th>");
    for column in columns {
        let _ = write!(html, "<th>{}</th>", escaped(column));
    }
    *html += "</tr>\n";
    for Row { name, figures } in rows {
        let _ = write!(html, "<tr><td>{}</td>", escaped(name));
        for figure in figures {
            let _ = match figure {
                Some(figure) => write!(html, "<td>{figure:.decimals$}</td>"),
                None => write!(html, "<td>-</td>"),
            };
        }
        *html += "</tr>\n";
    }
    *html += "</table>\n";
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
